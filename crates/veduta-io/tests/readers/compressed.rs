//! Compressed models, written by the encoders that most tools use; see `tests/data/compress.mjs`.

use crate::support::{Folder, Glb};
use serde_json::json;
use veduta::scene::{Mesh, Scene};
use veduta_geometry::{DVec3, Vec3};
use veduta_io::ErrorKind;

#[cfg(feature = "draco")]
pub const EDGEBREAKER: &[u8] = include_bytes!("../data/draco-edgebreaker.glb");
#[cfg(feature = "draco")]
pub const SEQUENTIAL: &[u8] = include_bytes!("../data/draco-sequential.glb");
pub const MESHOPT_EXT: &[u8] = include_bytes!("../data/meshopt-ext.glb");
pub const MESHOPT_KHR: &[u8] = include_bytes!("../data/meshopt-khr.glb");

/// Vertices along each side of the surface.
const SIDE: usize = 9;

fn scene(bytes: &[u8]) -> Scene {
    let loaded = Folder::new().read("m.glb", bytes);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

/// The surface's vertex at a place of the grid.
fn vertex(i: usize, j: usize) -> DVec3 {
    let height = (3 * i * i + 5 * j * j) % 16;
    DVec3::new(i as f64 / 8.0, height as f64 / 16.0, j as f64 / 8.0)
}

/// Checks that a mesh holds the surface `times` times, all coordinates within `error`; the normals
/// within `normal_error`, if it has any, and so the colours within `color_error`.
fn assert_is_the_surface(
    mesh: &Mesh,
    times: usize,
    error: f64,
    normal_error: f32,
    color_error: f32,
) {
    mesh.check().expect("a sound mesh");
    let place = |p: DVec3| [p.x, p.z].map(|c| (8.0 * c).round() as usize);
    for (index, &position) in mesh.positions.iter().enumerate() {
        let [i, j] = place(position);
        let off = (position - vertex(i, j)).abs().max_element();
        assert!(off <= error, "{position} lies {off} off");
        if let Some(normal) = mesh.normals.get(index).filter(|_| times == 1) {
            let expected = Vec3::new(i as f32 - 4.0, 3.0, j as f32 - 4.0).normalize();
            let off = (*normal - expected).abs().max_element();
            assert!(off <= normal_error, "{normal} is {off} off");
        }
        if let Some(color) = mesh.colors.get(index).filter(|_| times == 1) {
            let expected = Vec3::new(i as f32 / 8.0, j as f32 / 8.0, 0.5);
            let off = (Vec3::from(*color) - expected).abs().max_element();
            assert!(off <= color_error, "{color:?} is {off} off");
            let off = (mesh.opacities[index] - (i + j) as f32 / 16.0).abs();
            assert!(off <= color_error, "an opacity is {off} off");
        }
    }
    // Each face begins at its smallest corner: codecs may turn faces, but not over.
    let mut found: Vec<[usize; 3]> = mesh
        .triangles
        .iter()
        .map(|triangle| {
            turned(triangle.map(|corner| {
                let [i, j] = place(mesh.positions[corner as usize]);
                j * SIDE + i
            }))
        })
        .collect();
    found.sort_unstable();
    let mut expected: Vec<[usize; 3]> = (0..(SIDE - 1) * (SIDE - 1))
        .flat_map(|cell| {
            let p = cell / (SIDE - 1) * SIDE + cell % (SIDE - 1);
            [[p, p + SIDE, p + 1], [p + 1, p + SIDE, p + SIDE + 1]]
        })
        .map(turned)
        .collect();
    expected = expected.repeat(times);
    expected.sort_unstable();
    assert_eq!(found, expected);
}

fn turned(mut corners: [usize; 3]) -> [usize; 3] {
    let smallest = (0..3).min_by_key(|&k| corners[k]).expect("three");
    corners.rotate_left(smallest);
    corners
}

#[test]
fn meshopt_streams_of_both_versions_are_the_surface_they_were_made_of() {
    // Version 0 has no filter for colours.
    for (file, color_error) in [(MESHOPT_EXT, 0.51 / 255.0), (MESHOPT_KHR, 3.0 / 255.0)] {
        let scene = scene(file);
        assert_eq!(scene.meshes.len(), 2);
        // Positions without filter are exact; normals have 8 bits.
        assert_is_the_surface(&scene.meshes[0], 1, 0.0, 0.03, color_error);
        // The other has the surface twice: with 15 bits of mantissa and 12 of normals, its indices as
        // numbers of two bytes; and plain, without normals, its indices as a sequence.
        let both = &scene.meshes[1];
        assert_is_the_surface(both, 2, 1.0 / f64::from(1 << 14), 0.0, 0.0);
        let first = Mesh {
            triangles: both.triangles[..128].to_vec(),
            positions: both.positions[..81].to_vec(),
            normals: both.normals[..81].to_vec(),
            colors: both.colors[..81].to_vec(),
            opacities: both.opacities[..81].to_vec(),
            ..both.clone()
        };
        assert_is_the_surface(&first, 1, 1.0 / f64::from(1 << 14), 2e-3, 2e-3);
    }
}

#[test]
fn instances_in_meshopt_streams_are_turned_step_by_step() {
    for file in [MESHOPT_EXT, MESHOPT_KHR] {
        let scene = scene(file);
        assert_eq!(scene.objects.len(), 1 + 8);
        for (k, object) in scene.objects[1..].iter().enumerate() {
            assert_eq!(object.name, format!("node1/instance{k}"));
            let angle = k as f64 * std::f64::consts::TAU / 8.0;
            let expected = DVec3::new(3.0 * k as f64 + angle.cos(), 0.0, -angle.sin());
            let found = object.world_from_object.transform_point3(DVec3::X);
            assert!((found - expected).length() < 1e-3, "{k}: {found}");
        }
    }
}

#[cfg(feature = "draco")]
#[test]
fn draco_streams_of_both_methods_are_the_surface_they_were_made_of() {
    for file in [EDGEBREAKER, SEQUENTIAL] {
        let scene = scene(file);
        assert_eq!(scene.meshes.len(), 1);
        // Positions have 14 bits, normals 10; colours are exact.
        let error = 1.0 / f64::from(1 << 14);
        assert_is_the_surface(&scene.meshes[0], 1, error, 5e-3, 0.51 / 255.0);
    }
}

/// Reads a compressed file after an edit of its bytes, which must be refused; the message without the
/// file's name.
fn refusal(bytes: &[u8]) -> String {
    let error = Folder::new().read("m.glb", bytes).expect_err("damaged");
    assert_eq!(error.kind(), ErrorKind::BadInput);
    let message = error.to_string();
    message.split_once("m.glb").expect("a file").1.to_owned()
}

/// Where the binary chunk of a GLB begins.
fn bin(bytes: &[u8]) -> usize {
    let json = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes"));
    12 + 8 + json as usize + 8
}

#[test]
fn streams_of_another_kind_are_refused_with_their_view() {
    let mut bytes = MESHOPT_KHR.to_vec();
    let start = bin(&bytes);
    bytes[start] = 0xe1;
    assert_eq!(
        refusal(&bytes),
        ": bufferViews[0].extensions.KHR_meshopt_compression: the meshopt data does not \
         decompress: the stream is of another mode or version; the file is damaged"
    );
    #[cfg(feature = "draco")]
    {
        let mut bytes = EDGEBREAKER.to_vec();
        let start = bin(&bytes);
        bytes[start] = b'd';
        let message = refusal(&bytes);
        assert!(
            message.starts_with(
                ": meshes[0].primitives[0].extensions.KHR_draco_mesh_compression: the Draco data \
                 does not decompress: "
            ),
            "{message}"
        );
    }
}

#[test]
fn few_compressed_bytes_cannot_ask_for_much_memory() {
    let mut glb = Glb::from_bytes(MESHOPT_KHR);
    let stream = &mut glb.json["bufferViews"][0]["extensions"]["KHR_meshopt_compression"];
    stream["count"] = json!(1_000_000_000);
    let message = refusal(&glb.bytes());
    let expected = ": bufferViews[0].extensions.KHR_meshopt_compression.count: asks for \
                    12000000000 bytes more of memory";
    assert!(message.starts_with(expected), "{message}");
}
