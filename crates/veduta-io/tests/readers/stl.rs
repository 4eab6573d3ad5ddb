use crate::support::Folder;
use veduta::scene::{Mesh, Scene};
use veduta_geometry::DVec3;
use veduta_io::{ErrorKind, ReadOptions, read_scene};

/// A tetrahedron's faces; corners meet.
const CORNERS: [[[f32; 3]; 3]; 4] = {
    let (o, x, y, z) = (
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    );
    [[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
};

/// A binary file; `spare` has the last two bytes of each facet.
pub fn binary(header: &[u8], spare: [u16; 4]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend(4u32.to_le_bytes());
    for (facet, spare) in CORNERS.iter().zip(spare) {
        bytes.extend([0; 12]);
        let numbers = facet.iter().flatten();
        bytes.extend(numbers.flat_map(|number| number.to_le_bytes()));
        bytes.extend(spare.to_le_bytes());
    }
    bytes
}

pub fn text(name: &str) -> String {
    let mut text = format!("solid {name}\n");
    for facet in CORNERS {
        text.push_str(" facet normal 0 0 0\n  outer loop\n");
        for [x, y, z] in facet {
            text.push_str(&format!("   vertex {x:e} {y} {z:.3}\n"));
        }
        text.push_str("  endloop\n endfacet\n");
    }
    text + &format!("endsolid {name}\n")
}

fn scene(bytes: impl AsRef<[u8]>) -> Scene {
    let loaded = Folder::new().read("m.stl", bytes);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

fn assert_tetrahedron(mesh: &Mesh) {
    assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::Z]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [2, 1, 3]]);
}

#[test]
fn corners_at_one_place_are_one_vertex_in_text_and_binary() {
    for bytes in [binary(b"", [0; 4]), text("t").into_bytes()] {
        assert_tetrahedron(&scene(bytes).meshes[0]);
    }
    // Both zeros are one place.
    let minus = text("t").replacen("vertex 0e0 0 0.000", "vertex -0 -0.0 -0", 1);
    assert_eq!(scene(minus).meshes[0].positions.len(), 4);
}

#[test]
fn a_binary_file_that_begins_with_solid_is_known_by_its_length() {
    for header in ["solid", "solid part\n", "solid a\nfacet normal"] {
        assert_tetrahedron(&scene(binary(header.as_bytes(), [0; 4])).meshes[0]);
    }
}

#[test]
fn solids_become_objects() {
    let two = text("base plate") + "\r\n" + &text("") + &text("base plate").to_uppercase();
    let scene = scene(two);
    let names: Vec<_> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["base plate", "m", "BASE PLATE"]);
    assert_eq!(scene.face_count(), 12);
}

#[test]
fn z_is_up() {
    let folder = Folder::new();
    let path = folder.write("m.stl", text("t"));
    let scene = read_scene(&path, &ReadOptions::default())
        .expect("sound")
        .scene;
    let up = scene.objects[0]
        .world_from_object
        .transform_point3(DVec3::Z);
    assert_eq!(up, DVec3::Z);
}

#[test]
fn text_without_a_telling_suffix_is_known_by_its_first_lines() {
    let loaded = Folder::new().read("model", text("t")).expect("sound");
    assert_tetrahedron(&loaded.scene.meshes[0]);
}

#[test]
fn facets_are_coloured_in_both_dialects() {
    let (red, green) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    // VisCAM: red is high, and the highest bit tells that there is a color.
    let viscam = scene(binary(b"", [0x8000 | 31 << 10, 0x8000 | 31 << 5, 0, 0]));
    let color = |scene: &Scene, face: usize| {
        let mesh = &scene.meshes[0];
        let colors = mesh.triangles[face].map(|vertex| mesh.colors[vertex as usize]);
        assert!(colors[0] == colors[1] && colors[1] == colors[2]);
        colors[0]
    };
    assert_eq!((color(&viscam, 0), color(&viscam, 1)), (red, green));
    assert_eq!(color(&viscam, 2), [0.6; 3], "the usual grey");
    // Magics: red is low, and the highest bit tells that the header's color is taken.
    let magics = scene(binary(
        b"COLOR=\x00\xff\x00\xff",
        [31, 0x8000, 31 << 10, 0x8000],
    ));
    assert_eq!((color(&magics, 0), color(&magics, 1)), (red, green));
    assert_eq!(color(&magics, 2), [0.0, 0.0, 1.0]);
    assert_eq!(magics.materials[0].base_color, [1.0; 4]);
    assert!(scene(binary(b"", [3; 4])).meshes[0].colors.is_empty());
}

#[test]
fn wrong_files_are_refused_with_the_place() {
    let whole = text("t");
    let cases: [(Vec<u8>, &str); 8] = [
        (
            binary(b"", [0; 4])[..200].to_vec(),
            "m.stl: byte 80: a binary STL file with this number of triangles needs 284 bytes, but 200 are there",
        ),
        (
            b"hello".to_vec(),
            "m.stl: starts with [68, 65, 6c, 6c], which is no STL file",
        ),
        (
            whole.replace("vertex 1e0 0 0.000", "vertex 1 0").into(),
            "m.stl:6: the line ends where three numbers should stand",
        ),
        (
            whole.replacen("vertex", "vortex", 1).into(),
            "m.stl:4: \"vortex\" where facet, outer loop",
        ),
        (
            whole.replacen("   vertex 0e0 0 0.000\n", "", 1).into(),
            "m.stl:7: a face with 2 corners",
        ),
        (
            whole[..whole.len() - 12].into(),
            "the file ends before endsolid; it is cut short",
        ),
        (
            (whole.clone() + "facet").into(),
            "\"facet\" where solid should stand",
        ),
        (
            whole.replacen("1e0", "nan", 1).into(),
            "m.stl:6: \"nan\" where three numbers",
        ),
    ];
    for (bytes, expected) in cases {
        let error = Folder::new().read("m.stl", &bytes).expect_err(expected);
        assert_eq!(error.kind(), ErrorKind::BadInput);
        let message = error.to_string();
        assert!(
            message.contains(expected),
            "{message:?} has not {expected:?}"
        );
    }
}

#[test]
fn bytes_behind_the_triangles_are_warned_of() {
    let mut bytes = binary(b"", [0; 4]);
    bytes.extend(b"made by hand");
    let loaded = Folder::new().read("m.stl", bytes).expect("readable");
    assert_tetrahedron(&loaded.scene.meshes[0]);
    assert!(loaded.warnings[0].to_string().contains("12 bytes behind"));
}
