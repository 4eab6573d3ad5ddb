use crate::support::{Folder, small_png};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use veduta::scene::{AlphaMode, Mesh, Scene, Wrap};
use veduta_geometry::{DVec3, Vec2};
use veduta_io::{ErrorKind, LevelOfDetail, Loaded, ReadOptions, read_scene};

/// Corners of a house of 4 x 3 m, its walls 3 m and its ridge 5 m high, in millimetres.
const HOUSE: [[i64; 3]; 10] = [
    [0, 0, 0],
    [4000, 0, 0],
    [4000, 3000, 0],
    [0, 3000, 0],
    [0, 0, 3000],
    [4000, 0, 3000],
    [4000, 3000, 3000],
    [0, 3000, 3000],
    [0, 1500, 5000],
    [4000, 1500, 5000],
];

fn shell() -> Value {
    json!([
        [[0, 3, 2, 1]],
        [[0, 1, 5, 4]],
        [[2, 3, 7, 6]],
        [[1, 2, 6, 9, 5]],
        [[3, 0, 4, 8, 7]],
        [[4, 5, 9, 8]],
        [[6, 7, 8, 9]]
    ])
}

/// A city of the given objects, near Delft.
pub fn city(objects: Value) -> Value {
    json!({
        "type": "CityJSON", "version": "2.0",
        "transform": { "scale": [0.001, 0.001, 0.001], "translate": [84616.468, 447422.999, -0.452] },
        "metadata": { "referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415" },
        "CityObjects": objects,
        "vertices": HOUSE,
    })
}

/// A city of one house.
pub fn house() -> Value {
    city(
        json!({ "house": { "type": "Building", "attributes": { "year": 1640 }, "geometry": [{
        "type": "Solid", "lod": "2.2", "boundaries": [shell()],
        "semantics": { "surfaces": [
            { "type": "GroundSurface" }, { "type": "WallSurface" }, { "type": "RoofSurface" }
        ], "values": [[0, 1, 1, 1, 1, 2, 2]] } }] } }),
    )
}

/// A city with a bit of everything that is read.
pub fn rich() -> Value {
    let mut city = house();
    let geometry = &mut city["CityObjects"]["house"]["geometry"][0];
    geometry["material"] = json!({ "a": { "values": [[null, 0, 0, null, null, 0, 0]] } });
    geometry["texture"] = json!({ "a": { "values": [[[[null]], [[0, 0, 1, 2, 3]]]] } });
    city["appearance"] = json!({
        "materials": [{ "name": "brick", "diffuseColor": [0.5, 0.25, 0.125] }],
        "textures": [{ "type": "PNG", "image": "brick.png" }],
        "vertices-texture": [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]],
    });
    city["CityObjects"]["tree"] = json!({ "type": "SolitaryVegetationObject", "parents": ["house"],
        "geometry": [{ "type": "GeometryInstance", "template": 0, "boundaries": [2],
            "transformationMatrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }] });
    city["CityObjects"]["yard"] = json!({ "type": "LandUse", "geometry": [
        { "type": "MultiSurface", "lod": "1", "boundaries": [[[0, 1, 2, 3, 0], [4, 5, 6]]] },
        { "type": "MultiSolid", "lod": 1, "boundaries": [[[[[0, 1, 9, 2]]]]] } ] });
    city["geometry-templates"] = json!({
        "templates": [{ "type": "MultiSurface", "lod": "2", "boundaries": [[[0, 1, 2]]] }],
        "vertices-templates": [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 0.0, 3.0]],
    });
    city
}

fn read(document: &Value) -> Loaded {
    let loaded = Folder::new().read("m.city.json", document.to_string());
    loaded.unwrap_or_else(|error| panic!("{error}"))
}

fn scene(document: &Value) -> Scene {
    let loaded = read(document);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

/// The faces of each material, by its name.
fn faces_of(scene: &Scene, mesh: &Mesh) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    for face in 0..mesh.face_count() as u32 {
        let material = scene.material(mesh.material_of(face));
        *counts.entry(material.name.clone()).or_default() += 1;
    }
    counts
}

fn counts(pairs: &[(&str, usize)]) -> BTreeMap<String, usize> {
    pairs
        .iter()
        .map(|&(name, count)| (name.to_owned(), count))
        .collect()
}

#[test]
fn polygons_stay_whole_and_coordinates_lose_nothing() {
    let scene = scene(&house());
    assert_eq!(scene.objects[0].name, "house");
    assert_eq!(scene.world.crs.as_deref(), Some("EPSG:7415"));
    assert_eq!(scene.world.origin, DVec3::new(84600.0, 447400.0, 0.0));
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.face_count(), mesh.positions.len()), (7, 10));
    assert_eq!(mesh.corners_of(3).count(), 5, "a gable");
    let ridge = scene.world.origin + mesh.positions[mesh.positions.len() - 1];
    let size = |k: usize| mesh.positions.iter().map(|p| p[k]).fold(f64::MIN, f64::max);
    assert!((size(2) - (5.0 - 0.452)).abs() < 1e-12);
    assert!(ridge.x > 84616.0 && ridge.y > 447422.0);
    assert_eq!(
        faces_of(&scene, mesh),
        counts(&[("GroundSurface", 1), ("RoofSurface", 2), ("WallSurface", 4)])
    );
    assert!(scene.materials.iter().all(|material| material.double_sided));
}

#[test]
fn walls_and_roofs_of_a_building_that_does_not_tell_are_told_by_their_slope() {
    for turned_over in [false, true] {
        let mut city = house();
        let geometry = &mut city["CityObjects"]["house"]["geometry"][0];
        geometry
            .as_object_mut()
            .expect("an object")
            .remove("semantics");
        if turned_over {
            for surface in geometry["boundaries"][0].as_array_mut().expect("surfaces") {
                surface[0].as_array_mut().expect("a ring").reverse();
            }
        }
        let scene = scene(&city);
        assert_eq!(
            faces_of(&scene, &scene.meshes[0]),
            counts(&[("GroundSurface", 1), ("RoofSurface", 2), ("WallSurface", 4)])
        );
    }
}

#[test]
fn all_types_of_geometry_are_read() {
    let surfaces = || json!([[[0, 1, 2, 3]], [[4, 5, 6, 7]]]);
    for (kind, boundaries, faces) in [
        ("MultiSurface", surfaces(), 2),
        ("CompositeSurface", surfaces(), 2),
        ("Solid", json!([shell(), surfaces()]), 9),
        ("MultiSolid", json!([[shell()], [surfaces()]]), 9),
        ("CompositeSolid", json!([[shell()], [surfaces()]]), 9),
    ] {
        let geometry = json!([{ "type": kind, "lod": "1", "boundaries": boundaries }]);
        let city = city(json!({ "a": { "type": "LandUse", "geometry": geometry } }));
        assert_eq!(scene(&city).face_count(), faces, "{kind}");
    }
}

#[test]
fn holes_are_cut_out() {
    let mut city = city(json!({ "a": { "type": "LandUse", "geometry": [{
        "type": "MultiSurface", "lod": "1", "boundaries": [[[0, 1, 2, 3], [10, 11, 12]]] }] } }));
    let vertices = city["vertices"].as_array_mut().expect("vertices");
    vertices.extend([
        json!([1000, 1000, 0]),
        json!([1000, 2000, 0]),
        json!([2000, 1000, 0]),
    ]);
    let scene = scene(&city);
    let mesh = &scene.meshes[0];
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            0.5 * (b - a).cross(c - a).z
        })
        .sum();
    assert!((area - 11.5).abs() < 1e-9, "{area}");
}

#[test]
fn templates_are_placed_and_share_a_mesh() {
    let instance = |vertex: u32, scale: f64| {
        json!({ "type": "SolitaryVegetationObject", "geometry": [{
            "type": "GeometryInstance", "template": 0, "boundaries": [vertex],
            "transformationMatrix": [0, -scale, 0, 1, scale, 0, 0, 2, 0, 0, scale, 0, 0, 0, 0, 1] }] })
    };
    let mut city = city(json!({ "elm": instance(2, 2.0), "oak": instance(3, 1.0) }));
    city["geometry-templates"] = json!({
        "templates": [{ "type": "MultiSurface", "lod": "2", "boundaries": [[[0, 1, 2]]] }],
        "vertices-templates": [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 0.0, 3.0]],
    });
    let scene = scene(&city);
    assert_eq!((scene.objects.len(), scene.meshes.len()), (2, 1));
    let elm = &scene.objects[0];
    // Turned by a quarter, scaled by 2, moved by (1, 2), put at (4, 3) from the first corner.
    let tip = elm
        .world_from_object
        .transform_point3(DVec3::new(1.5, 0.0, 0.0));
    let corner = DVec3::new(84616.468 - 84600.0, 447422.999 - 447400.0, -0.452);
    let expected = corner + DVec3::new(4.0 + 1.0, 3.0 + 2.0 + 3.0, 0.0);
    assert!(tip.abs_diff_eq(expected, 1e-9), "{tip} is not {expected}");
    assert_eq!(scene.materials[0].name, "SolitaryVegetationObject");
}

fn at_level(document: &Value, level: Option<&str>) -> Vec<(String, usize)> {
    let folder = Folder::new();
    let path = folder.write("m.city.json", document.to_string());
    let options = ReadOptions {
        level_of_detail: level.map(|level| level.parse::<LevelOfDetail>().expect("a level")),
        ..ReadOptions::default()
    };
    let scene = read_scene(&path, &options).expect("sound").scene;
    let faces = |o: &veduta::scene::Object| scene.meshes[o.mesh.0 as usize].face_count();
    scene
        .objects
        .iter()
        .map(|o| (o.name.clone(), faces(o)))
        .collect()
}

#[test]
fn one_level_of_detail_of_each_object_is_shown() {
    let flat = |lod: Value, count: usize| {
        let surfaces: Vec<Value> = shell().as_array().expect("a shell")[..count].to_vec();
        json!({ "type": "MultiSurface", "lod": lod, "boundaries": surfaces })
    };
    let document = city(json!({
        "a": { "type": "Building", "geometry":
            [flat(json!("1.2"), 1), flat(json!("2.2"), 3), flat(json!(1.3), 2), flat(json!("2.2"), 4)] },
        "b": { "type": "Road", "geometry": [flat(json!(1), 1)] },
        // The footprint of a building whose parts are shown.
        "c": { "type": "Building", "children": ["d"], "geometry": [flat(json!("0"), 1)] },
        "d": { "type": "BuildingPart", "parents": ["c"], "geometry": [flat(json!("2.2"), 5)] },
    }));
    let shown = |level| {
        let objects = at_level(&document, level);
        let text = |(name, faces): &(String, usize)| format!("{name} {faces}");
        objects.iter().map(text).collect::<Vec<_>>().join(", ")
    };
    assert_eq!(shown(None), "a 7, b 1, c/d 5");
    assert_eq!(shown(Some("2")), "a 7, b 1, c/d 5");
    assert_eq!(shown(Some("1.3")), "a 2, b 1, c/d 5");
    assert_eq!(shown(Some("1.2")), "a 1, b 1, c/d 5");
    assert_eq!(shown(Some("0")), "a 1, b 1, c/d 5");
}

#[test]
fn points_and_lines_are_warned_of_and_left_out() {
    let mut city = house();
    city["CityObjects"]["house"]["geometry"]
        .as_array_mut()
        .expect("geometries")
        .extend([
            json!({ "type": "MultiPoint", "lod": "3", "boundaries": [0, 1] }),
            json!({ "type": "MultiLineString", "lod": "3", "boundaries": [[0, 1, 2]] }),
        ]);
    let loaded = read(&city);
    assert_eq!(loaded.scene.face_count(), 7);
    let expected = "CityObjects.house.geometry[1]: points and lines have no surface";
    assert_eq!(loaded.warnings.len(), 1);
    assert!(
        loaded.warnings[0].to_string().contains(expected),
        "{:?}",
        loaded.warnings
    );
}

#[test]
fn materials_and_textures_are_those_of_the_file() {
    let folder = Folder::new();
    folder.write("brick.png", small_png());
    let mut city = house();
    let geometry = &mut city["CityObjects"]["house"]["geometry"][0];
    geometry["material"] = json!({
        "winter": { "value": 1 },
        "summer": { "values": [[null, 0, 0, null, null, 1, 1]] } });
    let none = json!([[null]]);
    geometry["texture"] = json!({ "photos": { "values": [[
        none, [[0, 0, 1, 2, 3]], none, none, none, [[1, 0, 1, 2, 3]], none ]] } });
    city["appearance"] = json!({
        "default-theme-material": "summer",
        "materials": [
            { "name": "brick", "diffuseColor": [0.5, 0.25, 0.125] },
            { "name": "glass", "transparency": 0.75, "emissiveColor": [1, 0, 0] } ],
        "textures": [
            { "type": "PNG", "image": "brick.png", "wrapMode": "mirror" },
            { "type": "JPG", "image": "gone.jpg" } ],
        "vertices-texture": [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]],
    });
    let loaded = folder.read("m.city.json", city.to_string()).expect("sound");
    let scene = &loaded.scene;
    let mesh = &scene.meshes[0];
    assert_eq!(
        faces_of(scene, mesh),
        counts(&[
            ("GroundSurface", 1),
            ("WallSurface", 2),
            ("brick", 1),
            ("brick.png", 1),
            ("glass", 2)
        ])
    );
    let textured = scene
        .materials
        .iter()
        .find(|m| m.name == "brick.png")
        .expect("textured");
    let texture = textured.base_color_texture.expect("a texture");
    assert_eq!(
        (texture.wrap, textured.base_color),
        ([Wrap::Mirror; 2], [1.0; 4])
    );
    let corner = mesh.corners_of(1).next().expect("a corner") as usize;
    assert_eq!(
        mesh.texcoords[corner],
        Vec2::new(0.0, 1.0),
        "v counts from the bottom"
    );
    let glass = scene
        .materials
        .iter()
        .find(|m| m.name == "glass")
        .expect("glass");
    assert_eq!(
        (glass.base_color[3], glass.alpha_mode),
        (0.25, AlphaMode::Blend)
    );
    assert_eq!(glass.emissive, [1.0, 0.0, 0.0]);
    assert_eq!(loaded.warnings.len(), 1);
    assert!(
        loaded.warnings[0]
            .to_string()
            .contains("\"gone.jpg\" cannot be read")
    );
}

/// Lines of a sequence of two houses.
pub fn sequence() -> String {
    let mut header = city(json!({}));
    header["vertices"] = json!([]);
    let feature = |id: &str| {
        let mut objects = house()["CityObjects"].clone();
        let house = objects["house"].take();
        json!({ "type": "CityJSONFeature", "id": id, "CityObjects": { id: house }, "vertices": HOUSE })
    };
    format!("{header}\n{}\n\n{}\n", feature("one"), feature("two"))
}

#[test]
fn a_sequence_is_read_line_by_line() {
    for name in ["m.city.jsonl", "m.json"] {
        let loaded = Folder::new().read(name, sequence()).expect("sound");
        let names: Vec<_> = loaded
            .scene
            .objects
            .iter()
            .map(|o| o.name.as_str())
            .collect();
        assert_eq!(names, ["one", "two"]);
        assert_eq!(
            (loaded.scene.face_count(), loaded.scene.materials.len()),
            (14, 3)
        );
        assert_eq!(
            loaded.scene.world.origin,
            DVec3::new(84600.0, 447400.0, 0.0)
        );
    }
    let wrong = sequence().replacen("[0,1,5,4]", "[0,1,5,40]", 1);
    let error = Folder::new()
        .read("m.city.jsonl", wrong)
        .expect_err("no such vertex");
    assert_eq!(
        error
            .to_string()
            .split_once("m.city.jsonl")
            .expect("the file")
            .1,
        ":2: CityObjects.one.geometry[0].boundaries[0][1][0][3]: refers to vertex 40, counted \
         from 0, but the file has 10"
    );
}

#[test]
fn parents_give_their_names_and_no_two_objects_share_one() {
    let road = |parents: Value| {
        json!({ "type": "Road", "parents": parents, "geometry":
            [{ "type": "MultiSurface", "lod": "1", "boundaries": [[[0, 1, 2]]] }] })
    };
    let mut city = city(json!({
        "a": road(json!([])), "b": road(json!(["a"])), "c/d": road(json!(["b"])),
        "e": road(json!(["elsewhere"])),
    }));
    let names: Vec<_> = scene(&city)
        .objects
        .iter()
        .map(|o| o.name.clone())
        .collect();
    assert_eq!(names, ["a", "a/b", "a/b/c_d", "elsewhere/e"]);
    city["CityObjects"]["a"] = road(json!(["c/d"]));
    let error = Folder::new()
        .read("m.city.json", city.to_string())
        .expect_err("a circle");
    assert!(
        error.to_string().contains("is its own descendant"),
        "{error}"
    );
}

#[test]
fn plain_coordinates_of_version_1_0_are_read() {
    let mut city = house();
    city["version"] = json!("1.0");
    city.as_object_mut().expect("an object").remove("transform");
    city["metadata"]["referenceSystem"] = json!("urn:ogc:def:crs:EPSG::7415");
    city["vertices"] = HOUSE
        .map(|[x, y, z]| [x, y, z].map(|c| c as f64 / 1000.0 + 85_000.123))
        .iter()
        .map(|v| json!(v))
        .collect();
    let scene = scene(&city);
    assert_eq!(scene.face_count(), 7, "planar within rounding");
    assert_eq!(scene.world.origin, DVec3::new(85_000.0, 85_000.0, 0.0));
}

#[test]
fn degrees_are_warned_of() {
    let mut city = house();
    city["metadata"]["referenceSystem"] = json!("http://www.opengis.net/def/crs/EPSG/0/4979");
    let warning = read(&city).warnings[0].to_string();
    assert!(
        warning.contains("metadata.referenceSystem: coordinates are degrees"),
        "{warning}"
    );
}

#[test]
fn wrong_files_are_refused_with_the_place() {
    let changed = |path: &str, value: Value| {
        let mut city = house();
        *city.pointer_mut(path).expect(path) = value;
        city.to_string()
    };
    let geometry = "/CityObjects/house/geometry/0";
    let in_geometry = |path: &str, value| changed(&format!("{geometry}{path}"), value);
    let cases = [
        (
            "{}".into(),
            ErrorKind::BadInput,
            "is not valid CityJSON: missing field `type`",
        ),
        (
            changed("/type", json!("Feature")),
            ErrorKind::BadInput,
            ": type: is \"Feature\", expected \"CityJSON\"",
        ),
        (
            changed("/version", json!("3.0")),
            ErrorKind::Unsupported,
            ": version: is CityJSON 3.0, expected CityJSON 1.0, 1.1 or 2.0",
        ),
        (
            changed("/transform", json!(null)),
            ErrorKind::BadInput,
            "has no transform",
        ),
        (
            changed("/transform/scale/1", json!(0)),
            ErrorKind::BadInput,
            ": transform.scale: is [0.001, 0.0, 0.001], expected three numbers above 0",
        ),
        (
            in_geometry("/boundaries/0/3/0/2", json!(10)),
            ErrorKind::BadInput,
            "CityObjects.house.geometry[0].boundaries[0][3][0][2]: refers to vertex 10, counted from 0, but the file has 10",
        ),
        (
            in_geometry("/boundaries/0/3/0", json!(1)),
            ErrorKind::BadInput,
            "geometry[0].boundaries[0][3][0]: is no array, expected a ring",
        ),
        (
            in_geometry("/boundaries/0", json!(1)),
            ErrorKind::BadInput,
            "geometry[0].boundaries[0]: is no array, expected arrays of shells",
        ),
        (
            in_geometry("/boundaries/0/0/0/0", json!(-1)),
            ErrorKind::BadInput,
            "CityObjects.house.geometry[0].boundaries",
        ),
        (
            in_geometry("/semantics/values/0/2", json!(3)),
            ErrorKind::BadInput,
            "refers to semantic surface 3, counted from 0, but the file has 3",
        ),
        (
            in_geometry("/type", json!("Blob")),
            ErrorKind::BadInput,
            "geometry[0].type: is \"Blob\", expected a type of geometry of CityJSON",
        ),
        (
            in_geometry("/type", json!("GeometryInstance")),
            ErrorKind::BadInput,
            "geometry[0]: has no template",
        ),
    ];
    for (text, kind, expected) in cases {
        let error = Folder::new()
            .read("m.city.json", &text)
            .expect_err(expected);
        let message = error.to_string();
        assert!(
            message.contains(expected),
            "{message:?} has not {expected:?}"
        );
        assert_eq!(error.kind(), kind, "{message}");
    }
}
