use super::merge;
use crate::scene::PlaneGroups;
use std::cmp::Reverse;
use veduta_map::scene::{
    Image, ImageId, Layer, Material, Mesh, MeshId, Object, ObjectKey, Scene, World,
};
use veduta_map::{
    Affine, Camera, FaceId, Faces, MaterialId, ObjectId, PlaneId, Projection, Seen, SeenScene,
    VisibilityMap,
};

/// Why maps cannot be composited.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompositeError {
    /// There is none.
    #[error("there is no map to composite")]
    Nothing,
    /// Nearness can be compared along the same lines of sight only.
    #[error("map {index} was seen through another camera than the first: {difference}")]
    OtherCamera {
        /// Which of the maps.
        index: usize,
        /// In what they differ.
        difference: String,
    },
    /// Coordinates of different origins cannot be compared.
    #[error("map {index} stands elsewhere in the world than the first: {difference}")]
    OtherWorld {
        /// Which of the maps.
        index: usize,
        /// In what they differ.
        difference: String,
    },
}

/// What is seen of all maps together: composite(A, B, …) is the map of A and B and …
///
/// Camera and size are the first map's, lights those of all maps.
///
/// # Errors
/// [`CompositeError`] for maps of different cameras or places in the world.
pub fn composite(maps: &[SeenScene]) -> Result<SeenScene, CompositeError> {
    hold_out(maps, &[])
}

/// [`composite`] of `maps` as far as the surfaces of `holdouts` do not hide them. Where those are seen
/// nothing is: the picture has a hole of their exact shape.
///
/// # Errors
/// As [`composite`]; indices count the maps first, then the holdouts.
pub fn hold_out(maps: &[SeenScene], holdouts: &[SeenScene]) -> Result<SeenScene, CompositeError> {
    let shown = maps.len();
    let maps: Vec<&SeenScene> = maps.iter().chain(holdouts).collect();
    let first = maps.first().ok_or(CompositeError::Nothing)?;
    for (index, other) in maps.iter().enumerate().skip(1) {
        if let Some(difference) = camera_difference(&first.map.camera, &other.map.camera) {
            return Err(CompositeError::OtherCamera { index, difference });
        }
        if let Some(difference) = world_difference(&first.scene.world, &other.scene.world) {
            return Err(CompositeError::OtherWorld { index, difference });
        }
    }
    let united = UnitedScenes::of(&maps);
    let groups = PlaneGroups::of(&united.scene);
    let (faces, new_ids) = united.faces(&maps, &groups);
    let seen: Vec<Seen> = maps
        .iter()
        .zip(&new_ids)
        .map(|(seen, new_ids)| {
            let new_id = |face: FaceId| new_ids[face.index()];
            Seen {
                opaque: seen.map.opaque.renumbered(new_id),
                veils: seen.map.veils.renumbered(new_id),
            }
        })
        .collect();
    // What was clipped before a near plane is not known; it does not change what lies behind.
    let nears = maps.iter().map(|seen| seen.map.camera.near);
    let camera = Camera {
        near: nears.fold(f64::INFINITY, f64::min),
        ..first.map.camera
    };
    let mut is_shown = vec![false; faces.len()];
    for face in new_ids[..shown].iter().flatten() {
        is_shown[face.index()] = true;
    }
    let Seen { opaque, veils } = merge(&faces, &seen, camera.aspect());
    let [opaque, veils] =
        [opaque, veils].map(|fragments| fragments.selected(|face| is_shown[face.index()]));
    let map = VisibilityMap {
        camera,
        faces,
        opaque,
        veils,
    };
    Ok(SeenScene::of(&united.scene, &map, first.size))
}

/// In what two cameras differ, in words for the user. Near planes may: nearness does not depend on them.
fn camera_difference(one: &Camera, other: &Camera) -> Option<String> {
    let near = one.near;
    if *one == (Camera { near, ..*other }) {
        return None;
    }
    let place = |camera: &Camera| camera.eye_from_world.inverse().w_axis.truncate();
    let forward = |camera: &Camera| camera.eye_from_world.row(2).truncate();
    let up = |camera: &Camera| -camera.eye_from_world.row(1).truncate();
    let words = |what: &str, a: &dyn std::fmt::Display, b: &dyn std::fmt::Display| {
        Some(format!("{what} {b} instead of {a}"))
    };
    if place(one) != place(other) {
        return words("its eye stands at", &place(one), &place(other));
    }
    if forward(one) != forward(other) {
        return words("it looks towards", &forward(one), &forward(other));
    }
    if one.eye_from_world != other.eye_from_world {
        return words("upwards in it is", &up(one), &up(other));
    }
    match (one.projection, other.projection) {
        (
            Projection::Perspective {
                tan_half_height: a, ..
            },
            Projection::Perspective {
                tan_half_height: b, ..
            },
        ) if a != b => {
            let degrees = |tan: f64| format!("{}deg", 2.0 * tan.atan().to_degrees());
            return words("its field of view is", &degrees(a), &degrees(b));
        }
        (Projection::Parallel { height: a, .. }, Projection::Parallel { height: b, .. })
            if a != b =>
        {
            return words("its frame has a height of", &a, &b);
        }
        (Projection::Perspective { .. }, Projection::Parallel { .. })
        | (Projection::Parallel { .. }, Projection::Perspective { .. }) => {
            return Some("one projects in parallel, the other in perspective".into());
        }
        _ => {}
    }
    if one.aspect() != other.aspect() {
        let (a, b) = (one.aspect(), other.aspect());
        return words("width over height of its frame are", &a, &b);
    }
    words("its lens is shifted by", &one.shift, &other.shift)
}

fn world_difference(one: &World, other: &World) -> Option<String> {
    let crs = |world: &World| world.crs.clone().unwrap_or_else(|| "none".into());
    if one.crs.is_some() && other.crs.is_some() && one.crs != other.crs {
        let (a, b) = (crs(one), crs(other));
        return Some(format!("its coordinate system is {b} instead of {a}"));
    }
    (one.origin != other.origin).then(|| {
        format!(
            "its origin is at {} instead of {}",
            other.origin, one.origin
        )
    })
}

/// The scenes of several maps as one.
struct UnitedScenes {
    scene: Scene,
    /// Of each map, the new numbers of its objects.
    objects: Vec<Vec<ObjectId>>,
}

impl UnitedScenes {
    fn of(maps: &[&SeenScene]) -> Self {
        let mut scene = Scene {
            world: maps
                .iter()
                .map(|seen| &seen.scene.world)
                .find(|world| world.crs.is_some())
                .unwrap_or(&maps[0].scene.world)
                .clone(),
            ..Scene::default()
        };
        let mut order: Vec<(ObjectKey, usize, ObjectId)> = Vec::new();
        for (map, SeenScene { scene, .. }) in maps.iter().enumerate() {
            let objects = (0..scene.objects.len()).map(ObjectId::from_index);
            order.extend(objects.map(|object| (scene.key_of(object), map, object)));
        }
        order.sort_unstable();
        let has_layers = maps.iter().any(|seen| !seen.scene.layers.is_empty());
        let mut objects: Vec<Vec<ObjectId>> = maps
            .iter()
            .map(|seen| vec![ObjectId(0); seen.scene.objects.len()])
            .collect();
        let mut meshes: Vec<&Mesh> = Vec::new();
        let mut of_map: Vec<usize> = Vec::new();
        for &((Reverse(priority), layer, _), map, object) in &order {
            let id = ObjectId::from_index(scene.objects.len());
            objects[map][object.index()] = id;
            let from = &maps[map].scene;
            meshes.push(from.mesh_of(object));
            of_map.push(map);
            scene.objects.push(Object {
                mesh: MeshId(id.0),
                ..from.object(object).clone()
            });
            if has_layers {
                match scene.layers.last_mut() {
                    Some(last) if last.name == layer && last.priority == priority => {
                        last.objects.end = id.0 + 1;
                    }
                    _ => scene.layers.push(Layer {
                        name: layer.into(),
                        priority,
                        objects: id.0..id.0 + 1,
                    }),
                }
            }
        }
        let first_material: Vec<u32> = maps
            .iter()
            .map(|seen| add_materials(&mut scene, &seen.scene.materials, &seen.scene.images))
            .collect();
        for (mesh, map) in meshes.into_iter().zip(of_map) {
            let mut mesh = mesh.clone();
            for (_, material) in &mut mesh.materials {
                *material = MaterialId(material.0 + first_material[map]);
            }
            scene.meshes.push(mesh);
        }
        for seen in maps {
            for light in &seen.scene.lights {
                if !scene.lights.contains(light) {
                    scene.lights.push(light.clone());
                }
            }
        }
        Self { scene, objects }
    }

    /// The faces of all maps as one table in the order of the objects, and of each map the new numbers
    /// of its faces. Faces of one plane share it.
    fn faces(&self, maps: &[&SeenScene], groups: &PlaneGroups) -> (Faces, Vec<Vec<FaceId>>) {
        let mut order: Vec<(ObjectId, FaceId, usize)> = Vec::new();
        for (map, seen) in maps.iter().enumerate() {
            let table = &seen.map.faces;
            let object = |face: FaceId| self.objects[map][table.object(face).index()];
            order.extend(table.ids().map(|face| (object(face), face, map)));
        }
        order.sort_unstable();
        let mut faces = Faces::with_capacity(order.len());
        let mut new_ids: Vec<Vec<FaceId>> = maps
            .iter()
            .map(|seen| vec![FaceId(0); seen.map.faces.len()])
            .collect();
        let mut first_plane = Vec::with_capacity(maps.len());
        for seen in maps {
            first_plane.push(faces.planes().len() as u32);
            let planes: &[Affine] = seen.map.faces.planes();
            planes.iter().for_each(|&plane| {
                faces.push_plane(plane);
            });
        }
        for (object, face, map) in order {
            let table = &maps[map].map.faces;
            let plane = PlaneId(table.plane(face).0 + first_plane[map]);
            let id = faces.push(table.outline(face), plane, object, table.source(face));
            let id = id.expect("a face of a table has an area");
            if table.is_veil(face) {
                faces.set_veil(id);
            }
            new_ids[map][face.index()] = id;
        }
        groups.share_planes(&mut faces);
        (faces, new_ids)
    }
}

/// Adds to a scene materials of another with their images; the number that the first of them has now.
fn add_materials(scene: &mut Scene, materials: &[Material], images: &[Image]) -> u32 {
    let first = scene.materials.len() as u32;
    let first_image = scene.images.len() as u32;
    scene.images.extend_from_slice(images);
    for material in materials {
        let mut material = material.clone();
        let textures = [
            &mut material.base_color_texture,
            &mut material.emissive_texture,
        ];
        for texture in textures.into_iter().flatten() {
            texture.image = ImageId(texture.image.0 + first_image);
        }
        scene.materials.push(material);
    }
    first
}
