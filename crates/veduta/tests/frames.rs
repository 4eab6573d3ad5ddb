//! Law 2 over time: a frame of which only what moved was found is the frame found as a whole.

use std::collections::BTreeMap;
use veduta::dice::{Coverage, PixelGrid, coverage};
use veduta::map::{Camera, SeenScene};
use veduta::pipeline::{Extent, Frames, find_visibility, render_window};
use veduta::scene::generate::by_name;
use veduta::scene::{AlphaMode, Layer, MeshId, Object, Scene, Shown};
use veduta_geometry::{DMat4, DVec3};

const SIZE: [u32; 2] = [96, 64];

/// Scenes by formula, each as a layer of its own. Those used here are laid out for one camera, so that
/// they stand in one another.
fn layered(names: &[&str]) -> (Scene, Camera) {
    let mut scene = Scene::default();
    let mut camera = None;
    for &name in names {
        let generated = by_name(name).expect("a scene");
        camera.get_or_insert(generated.camera.with_aspect(1.5));
        let first = scene.objects.len() as u32;
        let first_mesh = scene.meshes.len() as u32;
        let first_material = scene.materials.len() as u32;
        assert!(generated.scene.images.is_empty(), "{name} has no pictures");
        for mut mesh in generated.scene.meshes {
            for (_, material) in &mut mesh.materials {
                material.0 += first_material;
            }
            scene.meshes.push(mesh);
        }
        scene.materials.extend(generated.scene.materials);
        for object in generated.scene.objects {
            scene.objects.push(Object {
                name: format!("{name}/{}", object.name),
                mesh: MeshId(first_mesh + object.mesh.0),
                ..object
            });
        }
        scene.layers.push(Layer {
            name: name.into(),
            priority: 0,
            objects: first..scene.objects.len() as u32,
            shown: Shown::Seen,
        });
    }
    (scene, camera.expect("there is a scene"))
}

/// Moves all objects of a layer.
fn move_layer(scene: &mut Scene, layer: usize, by: DVec3) {
    let rows = scene.layers[layer].objects.clone();
    for object in &mut scene.objects[rows.start as usize..rows.end as usize] {
        object.world_from_object = DMat4::from_translation(by) * object.world_from_object;
    }
}

/// A face by the name of its object and the places of its first triangle.
type Face = (String, [[u64; 3]; 3]);

/// What each pixel shows of each face.
fn areas(seen: &SeenScene) -> BTreeMap<(usize, Face), f64> {
    let grid = PixelGrid::of_frame(SIZE[0], SIZE[1]);
    let mut areas = BTreeMap::new();
    for Coverage { pixel, face, area } in coverage(&seen.map, &grid) {
        let object = seen.map.faces.object(face);
        let mesh = seen.scene.mesh_of(object);
        let first = mesh.triangles_of(seen.map.faces.source(face)).start;
        let corners = mesh.triangles[first].map(|corner| {
            let position = mesh.positions[corner as usize];
            position.to_array().map(f64::to_bits)
        });
        let name = seen.scene.object(object).name.clone();
        *areas.entry((pixel, (name, corners))).or_insert(0.0) += area;
    }
    areas
}

/// Compares a frame with the same found as a whole.
fn assert_is_whole(frame: &SeenScene, scene: &Scene, camera: &Camera, what: &str) {
    let whole = find_visibility(scene, camera);
    let expected = SeenScene::of(scene, &whole, SIZE);
    let (found, expected_areas) = (areas(frame), areas(&expected));
    for key in found.keys().chain(expected_areas.keys()) {
        let [a, b] = [&found, &expected_areas].map(|areas| areas.get(key).copied().unwrap_or(0.0));
        assert!((a - b).abs() < 1e-9, "{what}: {key:?} has {a} and not {b}");
    }
    let grid = PixelGrid::of_frame(SIZE[0], SIZE[1]);
    let picture = render_window(&frame.scene, &frame.map, &grid, false);
    let expected = render_window(scene, &whole, &grid, false);
    let pairs = picture
        .pixels
        .iter()
        .flatten()
        .zip(expected.pixels.iter().flatten());
    for (a, b) in pairs {
        assert!((a - b).abs() < 1e-5, "{what}: {a} and not {b}");
    }
}

const NAMES: [&str; 4] = ["soup", "balls3", "pierce", "balls7"];

#[test]
fn a_frame_of_kept_and_moved_layers_is_the_frame_found_as_a_whole() {
    let (mut scene, camera) = layered(&NAMES);
    let mut frames = Frames::new(SIZE);
    let all: &[&str] = &NAMES;
    // Which layers move from a frame to the next, and which are found for it.
    let steps: [(&[usize], &[&str], Extent); 8] = [
        (&[], all, Extent::First),
        // What stands is not known alone yet.
        (&[1], all, Extent::Parts),
        (&[1], &["balls3"], Extent::Parts),
        (&[], &[], Extent::Nothing),
        (&[1], &["balls3"], Extent::Parts),
        // Another begins to move, and what still stands is not known alone.
        (&[1, 2], all, Extent::Parts),
        (&[2], &["pierce"], Extent::Parts),
        // Nearly everything.
        (&[0, 1, 3], all, Extent::MostChanged),
    ];
    for (frame, (moved, found, extent)) in steps.into_iter().enumerate() {
        for &layer in moved {
            let by = DVec3::new(0.031, 0.017, -0.005) * (frame + layer) as f64;
            move_layer(&mut scene, layer, by);
        }
        let (seen, work) = frames.next(scene.clone(), &camera, |_| {});
        assert_eq!(work.extent, extent, "frame {frame}");
        assert_eq!(work.found, found, "frame {frame}");
        let changed: Vec<&str> = moved.iter().map(|&layer| NAMES[layer]).collect();
        assert!(frame == 0 || work.changed == changed, "frame {frame}");
        assert_is_whole(seen, &scene, &camera, &format!("frame {frame}"));
        let layers = seen
            .scene
            .layers
            .iter()
            .filter(|layer| !layer.objects.is_empty());
        assert!(layers.count() >= 3, "layers are seen among one another");
    }
}

#[test]
fn veils_that_move_and_veils_that_stand_are_seen_through_one_another() {
    let (mut scene, camera) = layered(&["pierce", "balls3", "balls7"]);
    for layer in [0, 1] {
        for row in scene.layers[layer].objects.clone() {
            let mesh = &scene.meshes[scene.objects[row as usize].mesh.0 as usize];
            for &(_, material) in &mesh.materials {
                let material = &mut scene.materials[material.index()];
                material.base_color[3] = 0.6;
                material.alpha_mode = AlphaMode::Blend;
            }
        }
    }
    let mut frames = Frames::new(SIZE);
    for frame in 0..3 {
        let (seen, work) = frames.next(scene.clone(), &camera, |_| {});
        let expected = if frame == 0 {
            Extent::First
        } else {
            Extent::Parts
        };
        assert_eq!(work.extent, expected);
        assert!(!seen.map.veils.is_empty());
        assert_is_whole(seen, &scene, &camera, &format!("frame {frame}"));
        move_layer(&mut scene, 0, DVec3::new(0.05, 0.02, -0.03));
    }
}

#[test]
fn through_a_camera_that_moves_all_is_found_again() {
    let (scene, mut camera) = layered(&["pierce", "balls3"]);
    let mut frames = Frames::new(SIZE);
    for frame in 0..3 {
        let (seen, work) = frames.next(scene.clone(), &camera, |_| {});
        let expected = if frame == 0 {
            Extent::First
        } else {
            Extent::OtherView
        };
        assert_eq!((work.extent, work.found.len()), (expected, 2));
        assert!(frame == 0 || work.changed.is_empty(), "no layer has moved");
        assert_is_whole(seen, &scene, &camera, &format!("frame {frame}"));
        camera.eye_from_world = DMat4::from_translation(DVec3::X * 0.1) * camera.eye_from_world;
    }
}

#[test]
fn what_changes_in_a_layer_is_found_whatever_it_is() {
    let (scene, camera) = layered(&["pierce", "balls3"]);
    type Change = fn(&mut Scene);
    let changes: [(&str, Change); 6] = [
        ("a place", |scene| move_layer(scene, 0, DVec3::X * 1e-12)),
        ("a vertex", |scene| scene.meshes[0].positions[3].x += 1e-3),
        ("a colour", |scene| scene.materials[0].base_color[1] *= 0.5),
        ("a priority", |scene| scene.layers[0].priority = -1),
        ("a name", |scene| scene.objects[0].name += "x"),
        ("a normal", |scene| {
            let mesh = &mut scene.meshes[0];
            mesh.normals = vec![veduta_geometry::Vec3::Z; mesh.positions.len()];
        }),
    ];
    for (what, change) in changes {
        let mut frames = Frames::new(SIZE);
        frames.next(scene.clone(), &camera, |_| {});
        let mut changed = scene.clone();
        change(&mut changed);
        let (seen, work) = frames.next(changed.clone(), &camera, |_| {});
        assert_eq!(work.changed, ["pierce"], "{what}");
        assert_is_whole(seen, &changed, &camera, what);
        let (_, work) = frames.next(changed.clone(), &camera, |_| {});
        assert_eq!(work.extent, Extent::Nothing, "{what} stays as it is");
    }
}

#[test]
fn layers_that_move_by_turns_end_in_few_parts() {
    // Without layers each object is made apart.
    let (mut scene, camera) = layered(&["balls7"]);
    scene.layers.clear();
    let object = scene.objects.last().expect("a ball").clone();
    scene.objects = (0..12)
        .map(|number| Object {
            name: format!("balls {number:02}"),
            world_from_object: DMat4::from_translation(DVec3::Y * 0.3 * f64::from(number)),
            ..object.clone()
        })
        .collect();
    let mut frames = Frames::new(SIZE);
    for frame in 0..14 {
        let row = frame % scene.objects.len();
        let moved = &mut scene.objects[row].world_from_object;
        *moved = DMat4::from_translation(DVec3::new(0.02, 0.0, 0.01)) * *moved;
        let (seen, work) = frames.next(scene.clone(), &camera, |_| {});
        if frame > 0 {
            assert_eq!(work.changed, [scene.objects[row].name.as_str()]);
        }
        if frame % 4 == 3 {
            assert_is_whole(seen, &scene, &camera, &format!("frame {frame}"));
        }
    }
}
