//! Scene files: what is made of them, and what is said of those that are wrong.

use crate::support::{Folder, Glb, small_png};
use serde_json::json;
use veduta::geometry::{DMat4, DVec2, DVec3, Vec2};
use veduta::map::{Camera, Projection};
use veduta::scene::{AlphaMode, Bounds, Scene};
use veduta_io::{ErrorKind, Loaded, Place, ReadError, ReadOptions, read_scene};

/// A triangle with two materials' worth of names: `o part`, material `red`, texture coordinates.
const PART: &str = "mtllib m.mtl\no part\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
    usemtl red\nf 1/1 2/2 3/3\n";
/// The same without texture coordinates, and in two materials.
const PLAIN: &str = "mtllib m.mtl\no plain\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n\
    usemtl red\nf 1 2 3\nusemtl blue\nf 2 4 3\n";
const LIBRARY: &str = "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n";

/// A folder with models to make scenes of.
pub fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("part.obj", PART);
    folder.write("plain.obj", PLAIN);
    folder.write("m.mtl", LIBRARY);
    folder.write("tiles.png", small_png());
    folder
}

pub fn read(folder: &Folder, text: &str) -> Result<Loaded, ReadError> {
    read_scene(&folder.write("s.toml", text), &ReadOptions::default())
}

fn sound(folder: &Folder, text: &str) -> Loaded {
    let loaded = read(folder, text).unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded
}

fn names(scene: &Scene) -> Vec<&str> {
    scene
        .objects
        .iter()
        .map(|object| object.name.as_str())
        .collect()
}

fn material_names(scene: &Scene) -> Vec<&str> {
    let names = scene
        .materials
        .iter()
        .map(|material| material.name.as_str());
    names.collect()
}

/// Where the origin, x, y and z of an object's model come to lie.
fn frame(scene: &Scene, object: usize) -> [DVec3; 4] {
    let place = scene.objects[object].world_from_object;
    [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|point| place.transform_point3(point))
}

fn assert_near(found: [DVec3; 4], expected: [DVec3; 4]) {
    for (found, expected) in found.into_iter().zip(expected) {
        assert!(
            (found - expected).length() < 1e-12,
            "{found} is not {expected}"
        );
    }
}

#[test]
fn layers_stand_by_priority_and_name_what_they_bring() {
    let loaded = sound(
        &folder(),
        r#"
        [[layer]]
        name = "low"
        model = "part.obj"
        priority = -1
        [[layer]]
        name = "first"
        model = "plain.obj"
        [[layer]]
        name = "second"
        model = "part.obj"
        "#,
    );
    let scene = &loaded.scene;
    assert_eq!(names(scene), ["first/plain", "second/part", "low/part"]);
    let expected = ["first/red", "first/blue", "second/red", "low/red"];
    assert_eq!(material_names(scene), expected);
    let layers: Vec<_> = scene
        .layers
        .iter()
        .map(|layer| (layer.name.as_str(), layer.priority, layer.objects.clone()))
        .collect();
    let expected = [("first", 0, 0..1), ("second", 0, 1..2), ("low", -1, 2..3)];
    assert_eq!(layers, expected);
    // Each face kept the material that it came with.
    for (index, expected) in ["first/red", "second/red", "low/red"]
        .into_iter()
        .enumerate()
    {
        let object = veduta::map::ObjectId(index as u32);
        assert_eq!(scene.material_of(object, 0).name, expected);
    }
    assert_eq!(
        scene.material_of(veduta::map::ObjectId(0), 1).name,
        "first/blue"
    );
}

#[test]
fn a_model_is_scaled_then_turned_then_moved() {
    let folder = folder();
    let placed = sound(
        &folder,
        r#"
        [[layer]]
        name = "a"
        model = "part.obj"
        up = "z"
        at = { translate = [10, 20, 30], rotate = { axis = [0, 0, 2], angle = "90deg" }, scale = [2, 3, 4] }
        [[layer]]
        name = "b"
        model = "part.obj"
        up = "z"
        at = { matrix = [[0, -3, 0, 10], [2, 0, 0, 20], [0, 0, 4, 30]] }
        "#,
    );
    let origin = DVec3::new(10.0, 20.0, 30.0);
    let expected = [
        origin,
        origin + 2.0 * DVec3::Y,
        origin - 3.0 * DVec3::X,
        origin + 4.0 * DVec3::Z,
    ];
    assert_near(frame(&placed.scene, 0), expected);
    assert_near(frame(&placed.scene, 1), expected);
}

#[test]
fn the_axis_that_is_up_is_that_of_the_format_unless_told() {
    let folder = folder();
    let layer = "[[layer]]\nname = \"a\"\nmodel = \"part.obj\"\n";
    let up = |text: &str| frame(&sound(&folder, text).scene, 0)[2];
    assert_eq!(up(layer), DVec3::Z);
    assert_eq!(up(&format!("{layer}up = \"z\"\n")), DVec3::Y);
}

#[test]
fn a_model_stands_at_each_row_of_a_table_and_is_stored_once() {
    let folder = folder();
    folder.write(
        "t.csv",
        "\u{feff}# posts\r\nname, x,y ,z,heading,scale\r\n\r\n\"left, old\",1,2,3,90,2\r\nright,-1,0,0,0,1\r\n",
    );
    let loaded = sound(
        &folder,
        r#"
        [[layer]]
        name = "posts"
        model = "part.obj"
        up = "z"
        instances = "t.csv"
        at = { translate = [0, 0, 10] }
        "#,
    );
    let scene = &loaded.scene;
    assert_eq!(names(scene), ["posts/left, old/part", "posts/right/part"]);
    assert_eq!((scene.meshes.len(), scene.materials.len()), (1, 1));
    let foot = DVec3::new(1.0, 2.0, 3.0 + 2.0 * 10.0);
    // Heading 90 turns north, the model's +y, to the east.
    let expected = [
        foot,
        foot - 2.0 * DVec3::Y,
        foot + 2.0 * DVec3::X,
        foot + 2.0 * DVec3::Z,
    ];
    assert_near(frame(scene, 0), expected);
    let foot = DVec3::new(-1.0, 0.0, 10.0);
    assert_near(
        frame(scene, 1),
        [foot, foot + DVec3::X, foot + DVec3::Y, foot + DVec3::Z],
    );
}

#[test]
fn rows_without_names_are_numbered_and_unknown_columns_are_told() {
    let folder = folder();
    folder.write("t.csv", "x,y,z,haeding\n0,0,0,90\n# none\n1,1,1,0\n");
    let text = "[[layer]]\nname = \"p\"\nmodel = \"part.obj\"\ninstances = \"t.csv\"\n";
    let loaded = read(&folder, text).expect("can be read");
    assert_eq!(names(&loaded.scene), ["p/1/part", "p/2/part"]);
    let [warning] = &loaded.warnings[..] else {
        panic!("{:?}", loaded.warnings);
    };
    let warning = warning.to_string();
    assert!(
        warning.contains("t.csv:1:7: the column \"haeding\""),
        "{warning}"
    );
    assert!(warning.contains("did you mean \"heading\"?"), "{warning}");
}

#[test]
fn a_scene_file_within_another_keeps_its_layers_in_its_names() {
    let folder = folder();
    folder.write(
        "inner.toml",
        r##"
        [camera.near]
        eye = [0, -5, 0]
        look_at = [0, 0, 0]
        size = [64, 48]
        [[layer]]
        name = "in"
        model = "part.obj"
        at = { translate = [1, 0, 0] }
        [material."in/red"]
        color = "#00ff00"
        "##,
    );
    let loaded = sound(
        &folder,
        r#"
        [camera.far]
        eye = [0, -50, 0]
        look_at = [0, 0, 0]
        [[layer]]
        name = "out"
        model = "inner.toml"
        at = { translate = [0, 0, 7] }
        [material."out/in/*"]
        unlit = true
        "#,
    );
    let scene = &loaded.scene;
    assert_eq!(names(scene), ["out/in/part"]);
    assert_eq!(frame(scene, 0)[0], DVec3::new(1.0, 0.0, 7.0));
    assert_eq!(scene.materials[0].base_color[..3], [0.0, 1.0, 0.0]);
    assert!(scene.materials[0].unlit);
    assert_eq!(scene.layers.len(), 1);
    let cameras: Vec<_> = scene
        .cameras
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(cameras, ["far", "out/near"]);
    assert_eq!(loaded.default_camera.as_deref(), Some("far"));
    assert_eq!(loaded.picture_sizes, [("out/near".to_owned(), [64, 48])]);
    let moved = scene.cameras[1]
        .1
        .eye_from_world
        .inverse()
        .w_axis
        .truncate();
    assert!(
        (moved - DVec3::new(0.0, -5.0, 7.0)).length() < 1e-12,
        "{moved}"
    );
}

#[test]
fn a_scene_file_that_contains_itself_is_refused_with_the_way_it_takes() {
    let folder = folder();
    let of = |model: &str| format!("[[layer]]\nname = \"a\"\nmodel = \"{model}\"\n");
    folder.write("b.toml", of("./c.toml"));
    folder.write("c.toml", of("s.toml"));
    let error = read(&folder, &of("b.toml")).expect_err("never ends");
    assert_eq!(error.kind(), ErrorKind::BadInput);
    let message = error.to_string();
    assert!(
        message.contains("c.toml:3:9: a scene file cannot be a part of itself"),
        "{message}"
    );
    let way: Vec<_> = message.match_indices(".toml").collect();
    assert_eq!(way.len(), 5, "the place and s -> b -> c -> s: {message}");
    let error = read(&folder, &of("s.toml")).expect_err("never ends");
    assert!(error.to_string().contains("part of itself"), "{error}");
}

#[test]
fn scene_files_that_double_one_another_are_refused_in_bounded_time() {
    let folder = folder();
    let twice = |model: &str| {
        format!(
            "[[layer]]\nname = \"a\"\nmodel = \"{model}\"\n[[layer]]\nname = \"b\"\nmodel = \"{model}\"\n"
        )
    };
    folder.write("d0.toml", twice("part.obj"));
    for level in 1..25 {
        folder.write(
            &format!("d{level}.toml"),
            twice(&format!("d{}.toml", level - 1)),
        );
    }
    let error = read(&folder, &twice("d24.toml")).expect_err("2^26 triangles");
    assert!(error.to_string().contains("memory"), "{error}");
}

#[test]
fn scene_files_may_be_nested_but_not_without_end() {
    let folder = folder();
    let of = |model: &str| format!("[[layer]]\nname = \"a\"\nmodel = \"{model}\"\n");
    folder.write("d0.toml", of("part.obj"));
    for level in 1..100 {
        folder.write(
            &format!("d{level}.toml"),
            of(&format!("d{}.toml", level - 1)),
        );
    }
    assert_eq!(
        names(&sound(&folder, &of("d20.toml")).scene)[0]
            .matches('/')
            .count(),
        22
    );
    let error = read(&folder, &of("d99.toml")).expect_err("100 deep");
    assert!(
        error.to_string().contains("nested more than 32 deep"),
        "{error}"
    );
}

const LAYER: &str = "[[layer]]\nname = \"a\"\nmodel = \"part.obj\"\nup = \"z\"\n";

fn camera(keys: &str) -> (Camera, Loaded) {
    let text = format!("[camera.c]\neye = [0, -4, 0]\nlook_at = [0, 0, 0]\n{keys}\n{LAYER}");
    let loaded = sound(&folder(), &text);
    (loaded.scene.cameras[0].1, loaded)
}

#[test]
fn a_lens_is_told_by_its_angle_or_its_length_and_the_sensor() {
    let tan = |camera: Camera| match camera.projection {
        Projection::Perspective {
            tan_half_height, ..
        } => tan_half_height,
        Projection::Parallel { .. } => panic!("is a perspective"),
    };
    for (keys, expected) in [
        ("fov = \"90deg\"", 1.0),
        ("fov = 90", 1.0),
        ("focal_length = \"24 mm\"", 0.5),
        ("focal_length = \"5 cm\"\nsensor_height = \"100 mm\"", 1.0),
        ("", 17.5_f64.to_radians().tan()),
    ] {
        let found = tan(camera(keys).0);
        assert!((found - expected).abs() < 1e-12, "{keys}: {found}");
    }
    let (plan, _) = camera("parallel = \"20 m\"\nsize = [300, 100]");
    let expected = Projection::Parallel {
        height: 20.0,
        aspect: 3.0,
    };
    assert_eq!((plan.projection, plan.near), (expected, 0.0));
}

#[test]
fn cameras_have_their_shift_size_near_plane_and_order() {
    let (shifted, loaded) = camera("shift = [0.5, -0.25]\nnear = \"10 cm\"\nsize = [640, 480]");
    assert_eq!(shifted.shift, DVec2::new(0.5, -0.25));
    assert_eq!(shifted.near, 0.1);
    assert_eq!(loaded.picture_sizes, [("c".to_owned(), [640, 480])]);
    // Without a near plane, what suits the scene.
    let near = camera("").0.near;
    assert!((1e-6..1e-3).contains(&near), "{near}");

    let text = format!(
        "[camera.z]\neye = [0, 0, 9]\nlook_at = [0, 0, 0]\n\
         [camera.a]\neye = [0, 0, 9]\nlook_at = [0, 0, 0]\nup = [1, 0, 0]\n{LAYER}"
    );
    let loaded = sound(&folder(), &text);
    assert_eq!(loaded.default_camera.as_deref(), Some("z"));
    let up = |row: usize| {
        let camera = &loaded.scene.cameras[row].1;
        -camera.eye_from_world.row(1).truncate()
    };
    // Straight down, north is up.
    assert_eq!((up(0), up(1)), (DVec3::Y, DVec3::X));
}

#[test]
fn cameras_of_a_model_come_along_unless_their_layer_distorts_them() {
    let folder = folder();
    let mut glb = Glb::triangle();
    glb.add("nodes", json!({ "camera": 0, "translation": [0, 0, 5] }));
    glb.json["scenes"][0]["nodes"] = json!([0, 1]);
    glb.json["cameras"] = json!([
        { "name": "eye", "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }
    ]);
    folder.write("m.glb", glb.bytes());
    let text = |at: &str| format!("[[layer]]\nname = \"a\"\nmodel = \"m.glb\"\n{at}");
    let loaded = sound(&folder, &text("at = { translate = [1, 2, 3], scale = 2 }"));
    let (name, camera) = &loaded.scene.cameras[0];
    let eye = camera.eye_from_world.inverse().w_axis.truncate();
    assert_eq!(name, "a/eye");
    assert!(
        (eye - DVec3::new(1.0, 2.0 - 10.0, 3.0)).length() < 1e-12,
        "{eye}"
    );
    assert!(loaded.default_camera.is_none());

    let loaded = read(&folder, &text("at = { scale = [1, 1, 2] }")).expect("can be read");
    assert!(loaded.scene.cameras.is_empty());
    assert!(
        loaded.warnings[0]
            .to_string()
            .contains("camera \"a/eye\" is left out")
    );
}

#[test]
fn materials_change_as_told_and_the_later_change_wins() {
    let text = format!(
        r##"{LAYER}
        [[layer]]
        name = "b"
        model = "plain.obj"
        [material."a/red"]
        color = [0.5, 0.25, 0]
        opacity = 0.5
        texture = {{ image = "tiles.png", repeat = [2, 3] }}
        emissive = [4, 0, 0]
        double_sided = false
        [material."b/*"]
        color = "#ffffff"
        unlit = true
        [material."b/bl?e"]
        color = "#000"
        "##
    );
    let scene = sound(&folder(), &text).scene;
    let red = &scene.materials[0];
    assert_eq!(red.base_color, [0.5, 0.25, 0.0, 0.5]);
    assert_eq!(red.alpha_mode, AlphaMode::Blend);
    assert_eq!(
        (red.emissive, red.double_sided, red.unlit),
        ([4.0, 0.0, 0.0], false, false)
    );
    let texture = red.base_color_texture.expect("has a texture");
    assert_eq!(texture.scale, Vec2::new(2.0, 3.0));
    assert_eq!(scene.images[texture.image.0 as usize].width, 2);
    let colors: Vec<_> = scene.materials[1..].iter().map(|m| m.base_color).collect();
    assert_eq!(colors, [[1.0; 4], [0.0, 0.0, 0.0, 1.0]]);
    assert!(scene.materials[1..].iter().all(|material| material.unlit));
}

#[test]
fn globs_and_textures_that_come_to_nothing_are_warned_of() {
    let folder = folder();
    let warned = |change: &str| {
        let loaded = read(&folder, &format!("{LAYER}{change}")).expect("can be read");
        let warnings: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(warnings.len(), 1, "{change}: {warnings:?}");
        warnings[0].clone()
    };
    let warning = warned("[material.\"a/rde\"]\ncolor = \"#fff\"\n");
    assert!(
        warning.contains("s.toml:5:11: no material is called \"a/rde\""),
        "{warning}"
    );
    assert!(warning.contains("did you mean \"a/red\"?"), "{warning}");
    let warning = warned("[material.\"somewhere else\"]\ncolor = \"#fff\"\n");
    assert!(warning.contains("there are \"a/red\""), "{warning}");
    let warning = warned("[material.\"a/red\"]\ntexture = { image = \"tile.png\" }\n");
    assert!(
        warning.contains("s.toml:6:21: ") && warning.contains("\"tiles.png\"?"),
        "{warning}"
    );
    let warning = warned("[material.\"a/red\"]\ntexture = { image = \"m.mtl\" }\n");
    assert!(warning.contains("neither PNG nor JPEG"), "{warning}");
    folder.write("part.obj", PLAIN);
    let warning = warned("[material.\"a/red\"]\ntexture = { image = \"tiles.png\" }\n");
    assert!(warning.contains("has texture coordinates"), "{warning}");
}

#[test]
fn a_texture_of_the_model_may_be_taken_away() {
    let folder = folder();
    folder.write("m.mtl", "newmtl red\nKd 1 0 0\nmap_Kd tiles.png\n");
    let textured = |change: &str| {
        let scene = sound(&folder, &format!("{LAYER}{change}")).scene;
        scene.materials[0].base_color_texture.is_some()
    };
    assert!(textured(""));
    assert!(!textured("[material.\"a/red\"]\ntexture = false\n"));
}

fn world(crs: &str, origin: [f64; 3]) -> String {
    format!("[world]\ncrs = \"{crs}\"\norigin = {origin:?}\n{LAYER}")
}

#[test]
fn georeferenced_parts_stand_relative_to_the_scenes_origin() {
    let folder = folder();
    folder.write("east.toml", world("EPSG:7415", [84_950.0, 447_700.0, 2.0]));
    folder.write(
        "north.toml",
        world("urn:ogc:def:crs:EPSG::7415", [84_900.5, 447_800.25, 0.0]),
    );
    let both = "[[layer]]\nname = \"east\"\nmodel = \"east.toml\"\nat = { scale = 2 }\n\
        [[layer]]\nname = \"north\"\nmodel = \"north.toml\"\n";
    let text = format!("[world]\ncrs = \"EPSG:7415\"\norigin = [84900, 447700, 0]\n{both}");
    let scene = sound(&folder, &text).scene;
    assert_eq!(
        frame(&scene, 0)[..2],
        [DVec3::new(50.0, 0.0, 2.0), DVec3::new(52.0, 0.0, 2.0)]
    );
    assert_eq!(frame(&scene, 1)[0], DVec3::new(0.5, 100.25, 0.0));
    assert_eq!(scene.world.origin, DVec3::new(84_900.0, 447_700.0, 0.0));

    // One alone needs no [world]: its own is the scene's.
    let alone = sound(&folder, "[[layer]]\nname = \"e\"\nmodel = \"east.toml\"\n").scene;
    assert_eq!(alone.world.crs.as_deref(), Some("EPSG:7415"));
    assert_eq!(frame(&alone, 0)[0], DVec3::ZERO);

    // Two do.
    let error = read(&folder, both).expect_err("whose origin?").to_string();
    assert!(
        error.contains("s.toml:7:9: layers \"east\" and \"north\""),
        "{error}"
    );
    assert!(error.contains("origin = [84950, 447700, 2]"), "{error}");
}

/// A building of two levels of detail, 100 m east and 1 m above of (84900, 447700, 0) in EPSG:7415.
pub const CITY: &str = r#"{ "type": "CityJSON", "version": "2.0",
    "metadata": { "referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415" },
    "transform": { "scale": [0.001, 0.001, 0.001], "translate": [85000, 447700, 1] },
    "vertices": [[0, 0, 0], [1000, 0, 0], [0, 1000, 0], [0, 0, 5000]],
    "CityObjects": { "hall": { "type": "Building", "geometry": [
        { "type": "MultiSurface", "lod": "1.2", "boundaries": [[[0, 1, 2]]] },
        { "type": "MultiSurface", "lod": "2.2", "boundaries": [[[0, 1, 3]]] } ] } } }"#;

#[test]
fn a_city_stands_where_it_is_on_earth_in_the_detail_asked_for() {
    let folder = folder();
    folder.write("c.city.json", CITY);
    let city = "[[layer]]\nname = \"city\"\nmodel = \"c.city.json\"\n";
    let world = "[world]\ncrs = \"EPSG:7415\"\norigin = [84900, 447700, 0]\n";
    let extent = |keys: &str| {
        let scene = sound(&folder, &format!("{world}{city}{keys}")).scene;
        Bounds::of_scene(&scene).expect("has a face")
    };
    let low = DVec3::new(100.0, 0.0, 1.0);
    for (keys, size) in [
        ("", DVec3::new(1.0, 0.0, 5.0)),
        ("lod = \"1.2\"", DVec3::new(1.0, 1.0, 0.0)),
        ("lod = \"2\"", DVec3::new(1.0, 0.0, 5.0)),
    ] {
        let found = extent(keys);
        assert!((found.min - low).length() < 1e-9, "{keys}: {found:?}");
        assert!(
            (found.max - low - size).length() < 1e-9,
            "{keys}: {found:?}"
        );
    }
    // Alone it brings its own origin.
    let scene = sound(&folder, city).scene;
    let found = Bounds::of_scene(&scene).expect("has a face");
    let there = scene.world.origin + found.min;
    assert!(
        (there - DVec3::new(85_000.0, 447_700.0, 1.0)).length() < 1e-9,
        "{there}"
    );
}

#[test]
fn other_coordinate_systems_and_datums_are_refused() {
    let folder = folder();
    folder.write("other.toml", world("EPSG:28992", [0.0; 3]));
    let layer = "[[layer]]\nname = \"o\"\nmodel = \"other.toml\"\n";
    let text = format!("[world]\ncrs = \"EPSG:7415\"\n{layer}");
    let error = read(&folder, &text).expect_err("not the same").to_string();
    assert!(
        error.contains("\"EPSG:28992\"") && error.contains("reproject"),
        "{error}"
    );

    let nap = world("EPSG:28992", [0.0; 3]).replace("origin", "vertical_datum = \"NAP\"\norigin");
    folder.write("other.toml", nap);
    let text = format!("[world]\ncrs = \"EPSG:28992\"\nvertical_datum = \"DHHN2016\"\n{layer}");
    let error = read(&folder, &text).expect_err("not the same").to_string();
    assert!(
        error.contains("\"NAP\"") && error.contains("\"DHHN2016\""),
        "{error}"
    );

    folder.write("t.csv", "x,y,z\n0,0,0\n");
    let error = read(&folder, &format!("{layer}instances = \"t.csv\"\n"));
    let error = error.expect_err("here or there?").to_string();
    assert!(error.contains("cannot have `instances`"), "{error}");
}

/// A scene file, what is replaced in it by what, and what is said: place, sentence.
const MISTAKES: &[(&str, &str, ErrorKind, &str)] = &[
    (
        "model =",
        "modle =",
        ErrorKind::BadInput,
        ":10:1: unknown key \"modle\" in [[layer]]; did you mean \"model\"?",
    ),
    (
        "model =",
        "path =",
        ErrorKind::BadInput,
        ":10:1: unknown key \"path\" in [[layer]]; it may have name, model, up, lod, at, keys, interpolation, animation, repeat, priority, shown, instances",
    ),
    (
        "[camera.c]",
        "[camra.c]",
        ErrorKind::BadInput,
        ":3:2: unknown key \"camra\" in a scene file; did you mean \"camera\"?",
    ),
    (
        "eye = [0, -4, 0]\n",
        "",
        ErrorKind::BadInput,
        ":3:1: [camera.NAME] has no \"eye\", which it needs",
    ),
    (
        "[0, -4, 0]",
        "[0, -4]",
        ErrorKind::BadInput,
        ":4:7: eye is [0, -4], expected three numbers in metres, such as [26, -44.5, 1.7]",
    ),
    (
        "[0, -4, 0]",
        "[0, -4, nan]",
        ErrorKind::BadInput,
        ":4:7: eye is [0, -4, nan], expected three numbers",
    ),
    (
        "\"40deg\"",
        "\"40 degrees\"",
        ErrorKind::BadInput,
        ":6:7: fov is \"40 degrees\", expected an angle above 0deg and below 180deg, such as \"40deg\"",
    ),
    (
        "\"40deg\"",
        "180",
        ErrorKind::BadInput,
        ":6:7: fov is 180, expected an angle above 0deg",
    ),
    (
        "\"40deg\"",
        "true",
        ErrorKind::BadInput,
        ":6:7: fov is true, expected an angle",
    ),
    (
        "fov =",
        "parallel = 3\nfov =",
        ErrorKind::BadInput,
        ":7:1: \"fov\" and \"parallel\" exclude each other; keep one of them",
    ),
    (
        "fov = \"40deg\"",
        "focal_length = 35",
        ErrorKind::BadInput,
        ":6:16: focal_length is 35, expected a length above 0 with its unit, such as \"35 mm\"",
    ),
    (
        "fov = \"40deg\"",
        "sensor_height = \"1 cm\"",
        ErrorKind::BadInput,
        ":6:1: \"sensor_height\" is given without \"focal_length\", which it needs",
    ),
    (
        "look_at = [0, 0, 0]",
        "look_at = [0, -4, 0]",
        ErrorKind::BadInput,
        ":5:11: camera \"c\": eye, look_at and up define no direction",
    ),
    (
        "[camera.c]",
        "[camera.auto]",
        ErrorKind::BadInput,
        ":3:9: a name in camera is \"auto\", expected a name without slash other than \"auto\"",
    ),
    (
        "\"part.obj\"",
        "\"parts.obj\"",
        ErrorKind::Missing,
        ":10:9: names ",
    ),
    (
        "\"part.obj\"",
        "\"parts.obj\"",
        ErrorKind::Missing,
        "; did you mean \"part.obj\"?",
    ),
    (
        "\"part.obj\"",
        "\".\"",
        ErrorKind::Missing,
        "it is not a plain file",
    ),
    (
        "\"part.obj\"",
        "\"https://example.org/a.glb\"",
        ErrorKind::Unsupported,
        "\"https://example.org/a.glb\" is not a path to a file",
    ),
    (
        "\"part.obj\"",
        "\"tiles.png\"",
        ErrorKind::Unsupported,
        "tiles.png: is of no format that is read here",
    ),
    (
        "name = \"a\"",
        "name = \"a/b\"",
        ErrorKind::BadInput,
        ":9:8: name is \"a/b\", expected a name without slash",
    ),
    (
        "scale = 2",
        "scale = 0",
        ErrorKind::BadInput,
        ":11:16: scale is 0, expected a factor or three",
    ),
    (
        "scale = 2",
        "scale = 2, matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]",
        ErrorKind::BadInput,
        ":11:19: \"matrix\" and \"scale\" exclude each other",
    ),
    (
        "scale = 2",
        "rotate = { axis = [0, 0, 0], angle = 3 }",
        ErrorKind::BadInput,
        ":11:26: axis is [0, 0, 0], expected three numbers that are not all 0",
    ),
    (
        "scale = 2",
        "matrix = [[1, 0, 0, 0], [2, 0, 0, 0], [0, 0, 1, 0]]",
        ErrorKind::BadInput,
        ":11:17: matrix is [[…], […], […]], expected three rows of four numbers that leave",
    ),
    (
        "priority = 1",
        "lod = \"2.2\"",
        ErrorKind::BadInput,
        ":12:7: `lod` is for city models",
    ),
    (
        "priority = 1",
        "lod = 2.2",
        ErrorKind::BadInput,
        ":12:7: lod is 2.2, expected a level of detail as a text",
    ),
    (
        "priority = 1",
        "priority = 1.5",
        ErrorKind::BadInput,
        ":12:12: priority is 1.5, expected a whole number",
    ),
    (
        "\"#123456\"",
        "\"red\"",
        ErrorKind::BadInput,
        ":14:9: color is \"red\", expected a colour such as \"#b5523b\"",
    ),
    (
        "\"#123456\"",
        "[1, 1, 2]",
        ErrorKind::BadInput,
        ":14:9: color is [1, 1, 2], expected a colour",
    ),
    (
        "color = \"#123456\"",
        "texture = true",
        ErrorKind::BadInput,
        ":14:11: texture is true, expected a picture, such as",
    ),
    (
        "\"a/red\"",
        "\"a/[red\"",
        ErrorKind::BadInput,
        ":13:11: \"a/[red\" is no pattern of names",
    ),
    (
        "priority = 1",
        "[[light]]\nname = \"sun\"",
        ErrorKind::Unsupported,
        ":12:3: \"light\" is not supported yet in scene files; leave it out",
    ),
    (
        "priority = 1",
        "[air]",
        ErrorKind::Unsupported,
        ":12:2: \"air\" is not supported yet",
    ),
    (
        "crs = \"EPSG:7415\"",
        "origin = [0, 0, 0]",
        ErrorKind::BadInput,
        ":2:1: \"origin\" is given without \"crs\"",
    ),
    (
        "priority = 1",
        "priority = 1\n[[layer]]\nname = \"a\"\nmodel = \"part.obj\"",
        ErrorKind::BadInput,
        ":14:8: another layer is called \"a\"",
    ),
    (
        "fov = \"40deg\"",
        "fov = \"40deg",
        ErrorKind::BadInput,
        ":6:13: is not valid TOML: ",
    ),
    (
        "priority = 1",
        "priority = 1\npriority = 2",
        ErrorKind::BadInput,
        ":13:1: is not valid TOML: duplicate key",
    ),
    (
        "[[layer]]",
        "[layer]",
        ErrorKind::BadInput,
        ":8:1: layer is a table, expected one or more tables, each under the name in double brackets",
    ),
];

pub const SOUND: &str = "[world]\ncrs = \"EPSG:7415\"\n[camera.c]\neye = [0, -4, 0]\n\
    look_at = [0, 0, 0]\nfov = \"40deg\"\nsize = [64, 48]\n[[layer]]\nname = \"a\"\n\
    model = \"part.obj\"\nat = { scale = 2 }\npriority = 1\n[material.\"a/red\"]\n\
    color = \"#123456\"\n";

#[test]
fn every_mistake_is_told_with_its_place_and_its_mend() {
    let folder = folder();
    sound(&folder, SOUND);
    let mut wrong = Vec::new();
    for &(part, replacement, kind, said) in MISTAKES {
        assert!(SOUND.contains(part), "{part}");
        let text = SOUND.replacen(part, replacement, 1);
        let error = read(&folder, &text).expect_err(replacement);
        let messages = messages(&error);
        let is_told = messages.iter().any(|message| message.contains(said));
        if !is_told || error.kind() != kind || messages.iter().any(|m| m.contains('\n')) {
            wrong.push(format!(
                "{part} -> {replacement}: {messages:#?}, not {kind:?}, {said}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Of the error and those that were found with it.
fn messages(error: &ReadError) -> Vec<String> {
    error.all().map(ToString::to_string).collect()
}

/// The part of the line that the caret is under.
fn pointed_at(error: &ReadError) -> String {
    let excerpt = &error.detail.as_ref().expect("is of a text").excerpt;
    let characters = excerpt.line.chars().skip(excerpt.before);
    characters.take(excerpt.length).collect()
}

#[test]
fn all_mistakes_of_a_file_are_told_at_once_and_in_order() {
    let text = SOUND
        .replace("model =", "modle =")
        .replace("\"40deg\"", "\"forty\"")
        .replace("crs", "csr")
        .replace("scale = 2", "scale = [1, 2]");
    let error = read(&folder(), &text).expect_err("four mistakes");
    let told: Vec<_> = error
        .all()
        .map(|error| match error.place {
            Place::Text { line, column } => (line, column, pointed_at(error)),
            _ => panic!("no place in a text: {error}"),
        })
        .collect();
    let expected = [
        (2, 1, "csr"),
        (6, 7, "\"forty\""),
        (10, 1, "modle"),
        (11, 16, "[1, 2]"),
    ];
    assert_eq!(
        told,
        expected.map(|(line, column, text)| (line, column, text.to_owned()))
    );
}

#[test]
fn mistakes_in_tables_of_places_are_told_with_row_and_column() {
    let folder = folder();
    let text = "[[layer]]\nname = \"p\"\nmodel = \"part.obj\"\ninstances = \"t.csv\"\n";
    for (table, said) in [
        (
            "",
            "t.csv: is empty; expected a header such as x,y,z,heading",
        ),
        (
            "a;b;c\n1;2;3\n",
            "t.csv:1:1: has no column x, y, z; expected a header",
        ),
        ("x,y\n1,2\n", "t.csv:1:1: has no column z; "),
        ("x,y,z,x\n", "t.csv:1:7: a second column is called \"x\""),
        (
            "x,y,z\n1,2,3\n1, two,3\n",
            "t.csv:3:4: row 2, column y: \"two\", expected a number in metres",
        ),
        (
            "x,y,z\n1,2\n",
            "t.csv:2:1: row 1 has 2 fields, but the header names 3",
        ),
        (
            "x,y,z,scale\n1,2,3,0\n",
            "t.csv:2:7: row 1, column scale: \"0\", expected a factor other than 0",
        ),
        (
            "x,y,z,heading\n1,2,3,1e999\n",
            "t.csv:2:7: row 1, column heading: \"1e999\", expected a number in degrees",
        ),
        (
            "x,y,z,name\n1,2,3,a/b\n",
            "t.csv:2:7: row 1, column name: \"a/b\", expected a name without slash",
        ),
        (
            "x,y,z,name\n1,2,3,\"ab\n",
            "t.csv:2:7: a double quote that opens a field is not closed",
        ),
        (
            "x,y,z,name\n\"1\"2,2,3,a\n",
            "t.csv:2:4: something stands between the closing quote and the comma",
        ),
    ] {
        folder.write("t.csv", table);
        let error = read(&folder, text).expect_err(table).to_string();
        assert!(error.contains(said), "{table:?}:\n{error}\nis not\n{said}");
    }
    folder.write("t.csv", "x,y,z\n");
    let loaded = read(&folder, text).expect("nothing stands there");
    assert!(loaded.scene.objects.is_empty() && loaded.warnings.len() == 1);
}

#[test]
fn an_axis_asked_for_on_the_whole_is_not_silently_ignored() {
    let folder = folder();
    let loaded = folder.read("s.toml", LAYER).expect("can be read");
    let [warning] = &loaded.warnings[..] else {
        panic!("{:?}", loaded.warnings);
    };
    assert!(
        warning
            .to_string()
            .contains("they have `up`, `lod` and `animation`"),
        "{warning}"
    );
    let text = format!("{LAYER}[[layer]]\nname = \"b\"\nmodel = \"in.toml\"\nup = \"y\"\n");
    folder.write("in.toml", LAYER);
    let error = read(&folder, &text).expect_err("has Z up").to_string();
    assert!(
        error.contains("s.toml:8:6: the model is a scene file"),
        "{error}"
    );
}

#[test]
fn a_mistake_in_an_inner_file_is_told_of_that_file() {
    let folder = folder();
    folder.write("in.toml", LAYER.replace("name", "nmae"));
    let text = "[[layer]]\nname = \"a\"\nmodel = \"in.toml\"\n";
    let error = read(&folder, text).expect_err("a key is misspelt");
    assert!(error.file.ends_with("in.toml"), "{error}");
    folder.write("part.obj", "v 0 0 x\n");
    let error = read(&folder, LAYER).expect_err("a number is misspelt");
    assert!(error.to_string().contains("part.obj:1"), "{error}");
}

#[test]
fn the_place_of_an_identity_is_left_as_the_model_has_it() {
    let scene = sound(&folder(), LAYER).scene;
    assert_eq!(scene.objects[0].world_from_object, DMat4::IDENTITY);
}
