//! Models that other people made. They stand outside the project, in the folder that `VEDUTA_DATA`
//! names; without it these tests say that they skip.

use std::collections::BTreeMap;
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

/// A city, without word of its warnings.
fn city(name: &str) -> Option<Scene> {
    let path = models()?.parent()?.join("city").join(name);
    let loaded = read_scene(&path, &ReadOptions::default());
    Some(loaded.unwrap_or_else(|error| panic!("{error}")).scene)
}

/// Numbers of faces by the name of their material.
fn faces_by_material(scene: &Scene) -> BTreeMap<&str, usize> {
    let mut counts = BTreeMap::new();
    for object in &scene.objects {
        let mesh = &scene.meshes[object.mesh.0 as usize];
        for face in 0..mesh.face_count() as u32 {
            let material = scene.material(mesh.material_of(face));
            *counts.entry(material.name.as_str()).or_default() += 1;
        }
    }
    counts
}

#[test]
fn the_surfaces_of_delft_tell_apart_and_no_wall_is_missing() {
    let Some(scene) = city("delft.city.json") else {
        return;
    };
    assert_eq!(scene.world.crs.as_deref(), Some("EPSG:7415"));
    assert_eq!(scene.objects.len(), 570);
    // All 36,271 triangles but three that are a line.
    assert_eq!(scene.face_count(), 36_268);
    let counts = faces_by_material(&scene);
    let expected = [
        ("Bridge", 101),
        ("GenericCityObject", 2278),
        ("LandUse", 8016),
        ("PlantCover", 15_693),
        ("Road", 4112),
        ("RoofSurface", 1283),
        ("WallSurface", 4280),
        ("WaterBody", 505),
    ];
    assert_eq!(counts, BTreeMap::from(expected));
    let mut roofs_without_wall = 0;
    for object in &scene.objects {
        let mesh = &scene.meshes[object.mesh.0 as usize];
        let mut edges: BTreeMap<(u32, u32), (u32, bool)> = BTreeMap::new();
        for face in 0..mesh.face_count() as u32 {
            let is_roof = scene.material(mesh.material_of(face)).name == "RoofSurface";
            let corners: Vec<u32> = mesh.corners_of(face).collect();
            for (k, &a) in corners.iter().enumerate() {
                let b = corners[(k + 1) % corners.len()];
                let edge = edges.entry((a.min(b), a.max(b))).or_default();
                edge.0 += 1;
                edge.1 |= is_roof;
            }
        }
        roofs_without_wall += edges.values().filter(|edge| **edge == (1, true)).count();
    }
    assert_eq!(roofs_without_wall, 0);
}

#[test]
fn the_polygons_of_rotterdam_stay_polygons() {
    let Some(scene) = city("rotterdam_subset.city.json") else {
        return;
    };
    assert_eq!(scene.world.crs, None);
    assert_eq!(scene.objects.len(), 16);
    let mut corners: BTreeMap<usize, usize> = BTreeMap::new();
    for mesh in &scene.meshes {
        for face in 0..mesh.face_count() as u32 {
            *corners.entry(mesh.corners_of(face).count()).or_default() += 1;
        }
    }
    // Of 248 surfaces 12 are a line; concave ones are more than one face.
    let expected = [(3, 49), (4, 232), (5, 24), (6, 5), (7, 1), (8, 2)];
    assert_eq!(corners, BTreeMap::from(expected));
    let kinds = [
        ("GroundSurface", 45),
        ("RoofSurface", 89),
        ("WallSurface", 179),
    ];
    assert_eq!(faces_by_material(&scene), BTreeMap::from(kinds));
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
