use crate::support::{Folder, small_png};
use veduta::scene::{Mesh, Scene};
use veduta_geometry::{DVec3, Vec2, Vec3};
use veduta_io::{ErrorKind, ReadOptions, read_scene};

/// Numbers of a file, as text and as bytes.
enum Value {
    U8(u8),
    I16(i16),
    I32(i32),
    U32(u32),
    F32(f32),
    F64(f64),
}
use Value::*;

impl Value {
    fn bytes(&self, big: bool) -> Vec<u8> {
        let mut bytes = match self {
            U8(v) => v.to_le_bytes().to_vec(),
            I16(v) => v.to_le_bytes().to_vec(),
            I32(v) => v.to_le_bytes().to_vec(),
            U32(v) => v.to_le_bytes().to_vec(),
            F32(v) => v.to_le_bytes().to_vec(),
            F64(v) => v.to_le_bytes().to_vec(),
        };
        if big {
            bytes.reverse();
        }
        bytes
    }

    fn text(&self) -> String {
        match self {
            U8(v) => v.to_string(),
            I16(v) => v.to_string(),
            I32(v) => v.to_string(),
            U32(v) => v.to_string(),
            F32(v) => v.to_string(),
            F64(v) => v.to_string(),
        }
    }
}

/// A file in each of the three encodings; rows end where a list of values does.
fn encodings(header: &str, rows: &[Vec<Value>]) -> Vec<Vec<u8>> {
    let text_rows = rows.iter().map(|row| {
        let words: Vec<String> = row.iter().map(Value::text).collect();
        words.join(" ") + "\n"
    });
    let text: String = text_rows.collect();
    let bytes = |big| {
        rows.iter()
            .flatten()
            .flat_map(move |value| value.bytes(big))
    };
    let header = |encoding: &str| format!("ply\nformat {encoding} 1.0\n{header}end_header\n");
    vec![
        [header("ascii").into_bytes(), text.into_bytes()].concat(),
        [
            header("binary_little_endian").into_bytes(),
            bytes(false).collect(),
        ]
        .concat(),
        [
            header("binary_big_endian").into_bytes(),
            bytes(true).collect(),
        ]
        .concat(),
    ]
}

fn scene(bytes: impl AsRef<[u8]>) -> Scene {
    let loaded = Folder::new().read("m.ply", bytes);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

/// A file with a bit of everything, in each encoding.
pub fn rich() -> Vec<Vec<u8>> {
    let header = "comment made by hand\nelement camera 1\nproperty list uchar float view\n\
        property int id\nelement vertex 5\nproperty uchar red\nproperty uchar green\n\
        property uchar blue\nproperty uchar alpha\nproperty double x\nproperty float y\n\
        property short z\nproperty float nx\nproperty float ny\nproperty float nz\n\
        property float s\nproperty float t\nproperty list uchar int neighbours\n\
        element face 2\nproperty uchar flags\nproperty list uchar uint vertex_indices\n";
    let mut rows = vec![vec![U8(2), F32(0.5), F32(1.5), I32(-7)]];
    for (x, y) in [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 2.0), (0.0, 1.0)] {
        rows.push(vec![
            U8(255),
            U8(0),
            U8(188),
            U8(7),
            F64(x),
            F32(y as f32),
            I16(5),
            F32(0.0),
            F32(0.0),
            F32(2.0),
            F32(0.25 * x as f32),
            F32(0.5 * y as f32),
            U8(1),
            I32(3),
        ]);
    }
    rows.push(vec![U8(9), U8(5), U32(0), U32(1), U32(2), U32(3), U32(4)]);
    rows.push(vec![U8(9), U8(3), U32(4), U32(3), U32(2)]);
    encodings(header, &rows)
}

#[test]
fn all_encodings_orders_and_types_of_columns_give_the_same_mesh() {
    let meshes: Vec<Mesh> = rich()
        .into_iter()
        .map(|file| scene(file).meshes.remove(0))
        .collect();
    let mesh = &meshes[0];
    assert_eq!(mesh.positions[3], DVec3::new(1.0, 2.0, 5.0));
    assert_eq!(mesh.normals, [Vec3::Z; 5]);
    assert_eq!(
        mesh.texcoords[3],
        Vec2::new(0.25, 0.0),
        "v counts from the bottom"
    );
    let [r, g, b] = mesh.colors[0];
    assert!(
        r == 1.0 && g == 0.0 && (b - 0.503).abs() < 1e-3,
        "bytes are sRGB"
    );
    assert_eq!(mesh.face_count(), 2);
    assert_eq!(
        (mesh.corners_of(0).count(), mesh.corners_of(1).count()),
        (5, 3)
    );
    assert!(meshes.iter().all(|other| other == mesh));
}

const SQUARE: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const CORNERS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

fn text(header: &str, rows: &str) -> String {
    format!("ply\nformat ascii 1.0\n{SQUARE}{header}end_header\n{CORNERS}{rows}")
}

const FACES: &str = "element face 2\nproperty list uchar int vertex_index\n";

#[test]
fn colours_in_fractions_are_linear() {
    let file = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float red\nproperty float green\nproperty float blue\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 0.5 0.25 1\n1 0 0 0.5 0.25 1\n0 1 0 0.5 0.25 1\n3 0 1 2\n";
    let scene = scene(file);
    assert_eq!(scene.meshes[0].colors, [[0.5, 0.25, 1.0]; 3]);
    assert_eq!(scene.materials[0].base_color, [1.0; 4]);
}

#[test]
fn faces_may_have_their_own_colours() {
    let header = format!("{FACES}property uchar red\nproperty uchar green\nproperty uchar blue\n");
    let mesh = &scene(text(&header, "3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n")).meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(mesh.colors[..3], [[1.0, 0.0, 0.0]; 3]);
    assert_eq!(mesh.colors[3..], [[0.0, 0.0, 1.0]; 3]);
}

#[test]
fn faces_may_have_their_own_texture_coordinates() {
    let folder = Folder::new();
    folder.write("tiles a.png", small_png());
    let header =
        format!("comment TextureFile tiles a.png\n{FACES}property list uchar float texcoord\n");
    let rows = "4 0 1 2 3 8 0 0 1 0 1 1 0 1\n3 0 2 3 6 0 0 0.5 1 0 1\n";
    let loaded = folder.read("m.ply", text(&header, rows)).expect("sound");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(mesh.face_count(), 2, "the square is textured evenly");
    assert_eq!(mesh.positions.len(), 5, "one corner has other coordinates");
    assert_eq!(mesh.texcoords[0], Vec2::new(0.0, 1.0));
    assert!(loaded.scene.materials[0].base_color_texture.is_some());
    let gone = Folder::new()
        .read("m.ply", text(&header, rows))
        .expect("sound");
    assert!(
        gone.warnings[0]
            .to_string()
            .contains("the texture \"tiles a.png\" cannot be read")
    );
}

#[test]
fn strips_become_triangles_of_one_winding() {
    let header = "element tristrips 1\nproperty list int int vertex_indices\n";
    let mesh = &scene(text(header, "8 0 1 3 2 -1 0 1 2\n")).meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 3], [3, 1, 2], [0, 1, 2]]);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        assert_eq!((b - a).cross(c - a), DVec3::Z);
    }
}

#[test]
fn faces_may_come_before_vertices() {
    let file =
        format!("ply\nformat ascii 1.0\n{FACES}{SQUARE}end_header\n3 0 1 2\n3 0 2 3\n{CORNERS}");
    assert_eq!(scene(file).face_count(), 2);
}

#[test]
fn z_is_up_and_the_first_bytes_tell_the_format() {
    let folder = Folder::new();
    let path = folder.write("bunny", text(FACES, "3 0 1 2\n3 0 2 3\n"));
    let scene = read_scene(&path, &ReadOptions::default())
        .expect("sound")
        .scene;
    assert_eq!(scene.objects[0].name, "bunny");
    let up = scene.objects[0]
        .world_from_object
        .transform_point3(DVec3::Z);
    assert_eq!(up, DVec3::Z);
}

#[test]
fn a_cloud_of_points_is_refused_with_advice() {
    for file in [
        text("", ""),
        text(
            "element face 0\nproperty list uchar int vertex_indices\n",
            "",
        ),
    ] {
        let error = Folder::new().read("m.ply", file).expect_err("points");
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        let expected = "has 4 points but no faces; make a surface of them first";
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn wrong_files_are_refused_with_the_place() {
    let faces = |rows: &str| text(FACES, rows);
    let big = |count: &str| faces("3 0 1 2\n3 0 2 3\n").replace("vertex 4", count);
    let binary = &rich()[1];
    let cases: [(Vec<u8>, &str); 12] = [
        (
            b"plx\n".to_vec(),
            "starts with [70, 6c, 78, 0a], which is no PLY file",
        ),
        (
            b"ply\nformat ascii 1.0\n".to_vec(),
            "has no end_header; it is cut short",
        ),
        (b"ply\nend_header\n".to_vec(), "has no line \"format"),
        (
            faces("3 0 1 2\n3 0 2 3\n").replace("ascii", "asci").into(),
            "m.ply:2: \"asci\" where ascii,",
        ),
        (
            faces("").replace("float y", "real y").into(),
            "m.ply:5: \"real\" where a type such as float",
        ),
        (
            faces("3 0 1 2\n3 0 2 4\n").into(),
            "refers to vertex 4, counted from 0, but the file has 4",
        ),
        (
            faces("3 0 1 2\n3 0 2 -1\n").into(),
            "m.ply:15: is -1, expected the index of a vertex",
        ),
        (
            faces("3 0 1 2\n3 0 x 1\n").into(),
            "m.ply:15: \"x\" where a number should stand",
        ),
        (
            faces("3 0 1 2\n3 0 2\n").into(),
            "the next number needs 1 bytes, but 0 are there",
        ),
        (
            big("vertex 4000000000").into(),
            "the table of vertices needs 24000000000 bytes",
        ),
        (
            big("vertex -1").into(),
            "\"-1\" where the number of elements",
        ),
        (
            binary[..binary.len() - 3].to_vec(),
            "a list needs 12 bytes, but 9 are there",
        ),
    ];
    for (bytes, expected) in cases {
        let error = Folder::new().read("m.ply", &bytes).expect_err(expected);
        assert_eq!(error.kind(), ErrorKind::BadInput, "{error}");
        let message = error.to_string();
        assert!(
            message.contains(expected),
            "{message:?} has not {expected:?}"
        );
    }
}
