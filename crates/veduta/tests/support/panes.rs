//! Scenes of panes: polygons with one colour and opacity each, shown as they are.

use veduta::geometry::{DMat4, DVec3};
use veduta::map::MaterialId;
use veduta::scene::{AlphaMode, Material, Mesh, MeshId, Object, Scene};

/// A convex polygon with one colour and opacity.
#[derive(Clone, Debug)]
pub struct Pane {
    pub corners: Vec<DVec3>,
    pub color: [f32; 4],
}

/// A scene of panes, each an object with a material of its own.
pub fn scene_of(panes: &[Pane]) -> Scene {
    let mut scene = Scene::default();
    for (index, pane) in panes.iter().enumerate() {
        let fans = (2..pane.corners.len() as u32).map(|k| [0, k - 1, k]);
        scene.meshes.push(Mesh {
            positions: pane.corners.clone(),
            triangles: fans.collect(),
            fans: vec![0],
            materials: vec![(0, MaterialId(index as u32))],
            ..Mesh::default()
        });
        scene.objects.push(Object {
            name: format!("pane {index:03}"),
            mesh: MeshId(index as u32),
            world_from_object: DMat4::IDENTITY,
        });
        scene.materials.push(Material {
            base_color: pane.color,
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            ..Material::default()
        });
    }
    scene
}
