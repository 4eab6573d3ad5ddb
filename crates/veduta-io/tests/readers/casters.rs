//! What casts shadows of a stored map: the scene that was given, from the file or from its sources.

use crate::cityjson::rich;
use crate::support::{Folder, Glb, small_png};
use serde_json::json;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use veduta::map::{Casters, Choice, Origin, Reading, SeenScene};
use veduta::pipeline::find_visibility;
use veduta::scene::{Scene, framing_camera};
use veduta_io::{
    CastersError, Loaded, ReadOptions, SourceProblem, check_source, open_map, read_casters,
    read_scene, reading_of, write_map,
};

/// A town that needs all kinds of files, each once.
const FILES: [&str; 13] = [
    "town.toml",
    "part.obj",
    "part.mtl",
    "wall.png",
    "places.csv",
    "model.gltf",
    "model.bin",
    "model.png",
    "mesh.ply",
    "mesh.png",
    "city/houses.city.json",
    "city/brick.png",
    "roof.png",
];

fn town() -> Folder {
    let folder = Folder::new();
    let obj = "mtllib part.mtl\no part\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
        usemtl red\nf 1/1 2/2 3/3\no under\nusemtl red\nv 0 0 -1\nv 1 0 -1\nv 0 1 -1\nf 4 5 6\n";
    folder.write("part.obj", obj);
    folder.write("part.mtl", "newmtl red\nKd 1 0 0\nmap_Kd wall.png\n");
    folder.write("places.csv", "x,y,z\n0,0,0\n3,0,0\n");

    let mut glb = Glb::triangle();
    let texcoord = glb.f32s("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let primitive = &mut glb.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = json!(texcoord);
    primitive["material"] = json!(0);
    let textured = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    glb.json["materials"] = json!([textured]);
    glb.json["textures"] = json!([{ "source": 0 }]);
    glb.json["images"] = json!([{ "uri": "model.png" }]);
    glb.json["buffers"] = json!([{ "byteLength": glb.bin.len(), "uri": "model.bin" }]);
    folder.write("model.gltf", glb.json.to_string());
    folder.write("model.bin", &glb.bin);

    let ply = "ply\nformat ascii 1.0\ncomment TextureFile mesh.png\nelement vertex 3\n\
        property float x\nproperty float y\nproperty float z\nproperty float s\nproperty float t\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n";
    folder.write("mesh.ply", ply);

    std::fs::create_dir(folder.path("city")).expect("may write in the test's folder");
    let mut city = rich();
    city["metadata"] = json!({});
    city["transform"] = json!({ "scale": [0.001, 0.001, 0.001], "translate": [0, 0, 0] });
    folder.write("city/houses.city.json", city.to_string());
    folder.write(
        "town.toml",
        r##"
        [[layer]]
        name = "parts"
        model = "part.obj"
        instances = "places.csv"
        [[layer]]
        name = "model"
        model = "model.gltf"
        [[layer]]
        name = "mesh"
        model = "mesh.ply"
        [[layer]]
        name = "city"
        model = "city/houses.city.json"
        lod = "2.2"
        [material."parts/**"]
        texture = { image = "roof.png" }
        "##,
    );
    for name in [
        "wall.png",
        "model.png",
        "mesh.png",
        "city/brick.png",
        "roof.png",
    ] {
        folder.write(name, small_png());
    }
    folder
}

fn read(folder: &Folder) -> Loaded {
    let read = read_scene(&folder.path("town.toml"), &ReadOptions::default());
    read.unwrap_or_else(|error| panic!("{error}"))
}

/// Stores a map of the scene; where it stands.
fn stored(folder: &Folder, name: &str, scene: &Scene, casters: Option<Casters>) -> PathBuf {
    let camera = framing_camera(scene, 1.5).expect("the scene has an extent");
    let seen = SeenScene::of(scene, &find_visibility(scene, &camera), [30, 20]);
    let readings = casters.iter().flat_map(|casters| &casters.readings);
    let origin = Origin {
        sources: readings.flat_map(|reading| reading.files.clone()).collect(),
        casters,
    };
    let place = folder.path(name);
    write_map(&place, &seen, &origin).unwrap_or_else(|error| panic!("{error}"));
    place
}

fn embedded(scene: &Scene) -> Option<Casters> {
    Some(Casters {
        embedded: Some(scene.clone()),
        readings: Vec::new(),
    })
}

fn read_again(reading: Reading) -> Option<Casters> {
    Some(Casters {
        embedded: None,
        readings: vec![reading],
    })
}

fn casters(map: &Path) -> Result<Scene, CastersError> {
    read_casters(&mut open_map(map).unwrap_or_else(|error| panic!("{error}")))
}

#[test]
fn all_files_that_a_scene_was_read_from_are_told() {
    let folder = town();
    let loaded = read(&folder);
    let mut told: Vec<&str> = loaded.files.iter().map(|file| file.path.as_str()).collect();
    assert!(told[0].ends_with("town.toml"), "{told:?}");
    told.sort_unstable();
    let expected = FILES.map(|name| folder.path(name).to_string_lossy().into_owned());
    let mut expected = expected.to_vec();
    expected.sort_unstable();
    assert_eq!(told, expected);
}

#[test]
fn casters_read_again_are_the_scene_given_wherever_the_folder_stands() {
    let folder = town();
    let loaded = read(&folder);
    let reading = reading_of(loaded.files.clone(), &ReadOptions::default());
    let map = stored(&folder, "town.veduta", &loaded.scene, read_again(reading));
    assert!(casters(&map).expect("all is there") == loaded.scene);

    // Paths are told from where the map stands.
    let moved = Folder::new();
    for name in FILES.iter().chain(&["town.veduta"]) {
        let place = moved.path(name);
        std::fs::create_dir_all(place.parent().expect("is in a folder")).expect("may write");
        std::fs::copy(folder.path(name), place).expect("may copy");
    }
    drop(folder);
    let map = moved.path("town.veduta");
    assert!(casters(&map).expect("all is there") == loaded.scene);
    let opened = open_map(&map).expect("sound");
    for source in opened.sources() {
        check_source(&source).unwrap_or_else(|error| panic!("{error}"));
    }
    assert_eq!(opened.reader().sources()[0].path, "town.toml");
}

#[test]
fn casters_kept_in_the_file_need_no_other() {
    let folder = town();
    let scene = read(&folder).scene;
    let map = stored(&folder, "town.veduta", &scene, embedded(&scene));
    let seen = open_map(&map).and_then(|mut map| map.read(|reader| reader.read()));
    let seen = seen.unwrap_or_else(|error| panic!("{error}")).scene;
    assert!(
        seen.face_count() < scene.face_count(),
        "some faces are hidden"
    );
    for name in FILES {
        std::fs::remove_file(folder.path(name)).expect("is there");
    }
    assert!(casters(&map).expect("needs no file") == scene);
}

#[test]
fn a_file_that_is_gone_or_changed_is_named() {
    let folder = town();
    let loaded = read(&folder);
    let reading = reading_of(loaded.files.clone(), &ReadOptions::default());
    let map = stored(&folder, "town.veduta", &loaded.scene, read_again(reading));
    for name in FILES {
        let sound = std::fs::read(folder.path(name)).expect("is there");
        for damage in ["changed", "longer", "gone"] {
            let mut bytes = sound.clone();
            match damage {
                "changed" => bytes[sound.len() / 2] ^= 1,
                "longer" => bytes.push(b'\n'),
                _ => {}
            }
            folder.write(name, bytes);
            if damage == "gone" {
                std::fs::remove_file(folder.path(name)).expect("is there");
            }
            let Err(CastersError::Source(error)) = casters(&map) else {
                panic!("{name} {damage}");
            };
            assert!(error.file.ends_with(name), "{error}");
            let expected = match error.problem {
                SourceProblem::Changed => damage != "gone",
                SourceProblem::Unreadable(_) => damage == "gone",
                _ => false,
            };
            assert!(expected, "{name} {damage}: {error}");
        }
        folder.write(name, sound);
    }
    assert!(casters(&map).is_ok(), "all is as it was");
}

#[test]
fn a_file_that_was_not_there_when_the_map_was_made_is_named() {
    let folder = town();
    std::fs::remove_file(folder.path("wall.png")).expect("is there");
    let loaded = read(&folder);
    let reading = reading_of(loaded.files.clone(), &ReadOptions::default());
    let map = stored(&folder, "town.veduta", &loaded.scene, read_again(reading));
    assert!(casters(&map).expect("all is as it was") == loaded.scene);
    folder.write("wall.png", small_png());
    let error = casters(&map).expect_err("the scene is another").to_string();
    assert!(error.contains("wall.png: was not there"), "{error}");
}

#[test]
fn layers_and_objects_that_were_left_out_cast_nothing() {
    let folder = town();
    let loaded = read(&folder);
    let mut scene = loaded.scene.clone();
    scene.keep_layers(|layer| layer.name == "parts" || layer.name == "mesh");
    let reading = Reading {
        layers: Some(vec!["parts".into(), "mesh".into()]),
        choices: vec![Choice {
            only: vec!["parts/**".into(), "mesh/**".into()],
            without: vec!["**/under".into()],
        }],
        ..reading_of(loaded.files, &ReadOptions::default())
    };
    let map = stored(&folder, "parts.veduta", &scene, read_again(reading));
    let found = casters(&map).expect("all is there");
    scene.keep_objects(|object| !object.name.ends_with("under"));
    assert!(found == scene);
    assert_eq!(found.objects.len(), 3, "{:?}", found.objects);
}

#[test]
fn casters_of_several_parts_are_one_scene_in_key_order() {
    let folder = town();
    let loaded = read(&folder);
    let part = |layers: &[&str]| {
        let mut scene = loaded.scene.clone();
        scene.keep_layers(|layer| layers.contains(&layer.name.as_str()));
        scene
    };
    let rest = part(&["model", "mesh", "city"]);
    let casters_of_both = Casters {
        embedded: Some(rest),
        readings: vec![Reading {
            layers: Some(vec!["parts".into()]),
            ..reading_of(loaded.files.clone(), &ReadOptions::default())
        }],
    };
    let map = stored(&folder, "both.veduta", &loaded.scene, Some(casters_of_both));
    let found = casters(&map).expect("all is there");
    // Object by object what the whole scene has.
    let names = |scene: &Scene| -> Vec<String> {
        let order = scene.key_order().into_iter();
        order.map(|id| scene.object(id).name.clone()).collect()
    };
    assert_eq!(names(&found), names(&loaded.scene));
    for (object, id) in found.objects.iter().zip(loaded.scene.key_order()) {
        let whole = loaded.scene.object(id);
        assert_eq!(object.world_from_object, whole.world_from_object);
        let mesh = &found.meshes[object.mesh.0 as usize];
        assert_eq!(mesh.positions, loaded.scene.mesh_of(id).positions);
        let materials = [(&found, mesh), (&loaded.scene, loaded.scene.mesh_of(id))];
        let [a, b] = materials.map(|(scene, mesh)| {
            let material = scene.material(mesh.material_of(0));
            let image = material.base_color_texture.map(|t| t.image.0 as usize);
            (
                material.name.clone(),
                image.map(|image| scene.images[image].clone()),
            )
        });
        assert_eq!(a, b);
    }
    // The two places of the parts share their meshes, and no other mesh is there.
    let used = |scene: &Scene| -> BTreeSet<u32> {
        let meshes = scene.objects.iter().map(|object| object.mesh.0);
        meshes.collect()
    };
    assert_eq!(used(&found).len(), found.meshes.len());
    assert_eq!(found.meshes.len(), used(&loaded.scene).len());
}

#[test]
fn a_map_that_does_not_tell_is_refused() {
    let folder = town();
    let scene = read(&folder).scene;
    let map = stored(&folder, "old.veduta", &scene, None);
    let error = casters(&map).expect_err("nothing is told").to_string();
    assert!(
        error.contains("old.veduta: does not tell what casts"),
        "{error}"
    );
}
