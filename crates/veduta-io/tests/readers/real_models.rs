//! Models that other people made. They stand outside the project, in the folder that `VEDUTA_DATA`
//! names; without it these tests say that they skip.

use std::path::PathBuf;
use veduta::scene::{Bounds, Scene};
use veduta_io::{ReadOptions, UpAxis, read_scene};

/// The folder of models, or `None` and a word to whoever reads the test's output.
fn models() -> Option<PathBuf> {
    let Some(data) = std::env::var_os("VEDUTA_DATA") else {
        eprintln!("SKIPPED: VEDUTA_DATA is not set, so no real models are read");
        return None;
    };
    Some(PathBuf::from(data).join("models"))
}

fn read(path: &std::path::Path) -> Scene {
    let loaded =
        read_scene(path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

#[test]
fn every_model_has_all_its_faces_objects_materials_and_pictures() {
    let Some(models) = models() else { return };
    // Faces of glTF models are counted with every place of a mesh, from the files' JSON.
    let expected = [
        ("2CylinderEngine.glb", 121_496, 67, 34, 0),
        ("CesiumMilkTruck.glb", 3_624, 3, 4, 1),
        ("Duck.glb", 4_212, 1, 1, 1),
        ("fandisk.obj", 12_946, 1, 1, 0),
        ("ogre.obj", 124_008, 1, 1, 0),
        ("spot.obj", 5_856, 1, 1, 0),
        ("stanford-bunny.obj", 69_451, 1, 1, 0),
        ("teapot.obj", 6_320, 1, 1, 0),
    ];
    let mut found = Vec::new();
    for (name, ..) in expected {
        let scene = read(&models.join(name));
        found.push((
            name,
            scene.face_count(),
            scene.objects.len(),
            scene.materials.len(),
            scene.images.len(),
        ));
        for mesh in &scene.meshes {
            mesh.check()
                .unwrap_or_else(|fault| panic!("{name}: {fault}"));
        }
        let names: std::collections::HashSet<_> = scene.objects.iter().map(|o| &o.name).collect();
        assert_eq!(names.len(), scene.objects.len(), "{name}: names differ");
    }
    assert_eq!(found, expected);
    let other = std::fs::read_dir(&models)
        .expect("the folder of models")
        .flatten();
    let scenes = other.filter(|entry| {
        let path = entry.path();
        let suffix = path.extension().unwrap_or_default();
        suffix == "glb" || suffix == "obj"
    });
    assert_eq!(
        scenes.count(),
        expected.len(),
        "a model has no expected counts"
    );
}

#[test]
fn models_stand_upright_and_face_minus_y() {
    let Some(models) = models() else { return };
    let duck = Bounds::of_scene(&read(&models.join("Duck.glb"))).expect("faces");
    let size = duck.max - duck.min;
    // Extents of the file's POSITION accessor, scaled by its root node's 0.01.
    assert!((size.z - (163.97 - 9.93) * 0.01).abs() < 1e-2, "{size}");
    assert!(duck.min.z > 0.0, "the duck stands on the ground: {duck:?}");
    // The truck is longer than wide, and its wheels stand on the ground.
    let truck = Bounds::of_scene(&read(&models.join("CesiumMilkTruck.glb"))).expect("faces");
    assert!(truck.min.z.abs() < 0.01 && truck.max.z > 2.0, "{truck:?}");
    // As Z up, the spot's height lies along Y, as in its file.
    let z_up = ReadOptions {
        up_axis: Some(UpAxis::Z),
        ..ReadOptions::default()
    };
    let spot = read_scene(&models.join("spot.obj"), &z_up)
        .expect("spot")
        .scene;
    let lying = Bounds::of_scene(&spot).expect("faces");
    let upright = Bounds::of_scene(&read(&models.join("spot.obj"))).expect("faces");
    assert_eq!(lying.max.y, upright.max.z);
    assert_eq!(lying.max.z, -upright.min.y);
}
