use super::forged::Parts;
use super::*;
use crate::VisibilityMap;
use crate::scene::{
    AlphaMode, Image, ImageId, Layer, Light, LightKind, Material, Mesh, MeshId, Object, Scene,
    Shown, TextureRef, World,
};
use crate::{
    Camera, Casters, Choice, FaceId, Faces, Fragments, Guest, GuestGrid, GuestKind, GuestSamples,
    MaterialId, ObjectId, Origin, Projection, Reading, SeenScene, SeenSpans, Side, Source, Span,
    SpanBand, Spans,
};
use arrow_array::Array;
use arrow_array::cast::AsArray;
use std::io::Cursor;
use veduta_geometry::{Affine, DMat4, DVec2, DVec3, Vec2, Vec3};

fn camera() -> Camera {
    let projection = Projection::Perspective {
        tan_half_height: 0.1 + 0.2,
        aspect: 1.5,
    };
    let eye = DVec3::new(1.0 / 3.0, -4.0, 2.0);
    Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.1).expect("a sound camera")
}

/// A strip of quadrilaterals and triangles with all attributes.
fn mesh(faces: u32) -> Mesh {
    let mut mesh = Mesh {
        materials: vec![(0, MaterialId(1)), (faces / 2, MaterialId(0))],
        ..Mesh::default()
    };
    for k in 0..2 * faces + 2 {
        let x = f64::from(k / 2) / 7.0;
        mesh.positions
            .push(DVec3::new(x, f64::from(k % 2), 0.1 * x));
        mesh.normals.push(Vec3::new(0.0, 0.6, 0.8));
        mesh.texcoords.push(Vec2::new(k as f32 / 3.0, 0.5));
        mesh.colors.push([1.0, 0.5, k as f32]);
    }
    for face in 0..faces {
        let [p, q, r, s] = [0, 1, 3, 2].map(|corner| 2 * face + corner);
        if face % 3 == 0 {
            mesh.push_fan(&[p, q, r, s]);
        } else {
            mesh.push_fan(&[p, q, r]);
        }
    }
    mesh
}

/// A scene of two objects, with everything that a file keeps.
fn scene(faces: u32) -> Scene {
    let image = |name: &str| Image {
        name: name.into(),
        width: 2,
        height: 1,
        pixels: vec![[1, 2, 3, 4], [255, 0, 128, 9]],
    };
    let material = |name: &str, image: u32| Material {
        name: name.into(),
        base_color_texture: Some(TextureRef::new(ImageId(image))),
        alpha_mode: AlphaMode::Mask(0.3),
        ..Material::default()
    };
    let object = |name: &str, mesh: u32| Object {
        name: name.into(),
        mesh: MeshId(mesh),
        world_from_object: DMat4::from_rotation_z(0.1 + f64::from(mesh)),
    };
    let triangles = Mesh {
        materials: vec![(0, MaterialId(2))],
        positions: mesh(faces).positions,
        triangles: mesh(faces).triangles,
        ..Mesh::default()
    };
    let light = Light {
        name: "lämp".into(),
        color: [1.0, 0.7, 0.1],
        kind: LightKind::Point {
            intensity: 0.1,
            range: f32::INFINITY,
        },
        world_from_light: DMat4::IDENTITY,
    };
    Scene {
        objects: vec![object("a/first", 0), object("b", 1)],
        meshes: vec![mesh(faces), triangles],
        materials: vec![
            material("unused", 0),
            material("wood", 1),
            Material::default(),
        ],
        images: vec![image("unused.png"), image("wood.png")],
        cameras: vec![("other".into(), camera())],
        lights: vec![light],
        layers: vec![Layer {
            name: "a".into(),
            priority: 2,
            shown: Shown::Matte,
            objects: 0..1,
        }],
        world: World {
            crs: Some("EPSG:7415".into()),
            origin: DVec3::new(84_900.1, 447_700.0, 0.0),
            vertical_datum: None,
        },
    }
}

/// A map of [`scene`]. It is not what the camera sees: files do not ask.
pub(super) fn seen(faces: u32) -> SeenScene {
    let scene = scene(faces);
    let mut table = Faces::new();
    let (mut opaque, mut veils) = (Fragments::new(), Fragments::new());
    for object in 0..2 {
        for source in 0..faces / 2 {
            let plane = table.push_plane(Affine::new(0.1, f64::from(source), 1.0));
            let at = DVec2::new(
                f64::from(source) / f64::from(faces),
                f64::from(object) / 3.0,
            );
            let size = 1.0 / f64::from(faces);
            let outline = [[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]].map(|p| at + size * DVec2::from(p));
            let face = table.push(&outline, plane, ObjectId(object), source);
            let face = face.expect("a triangle with area");
            let cutter = FaceId(face.0.saturating_sub(1));
            let sides = [
                Side::of_outline(face, 0),
                Side::crossing(cutter),
                Side::scan(face),
            ];
            match source % 5 {
                0 => opaque.push_whole(face),
                1 => {
                    let [p, q, r] = outline;
                    let middle = 0.5 * (p + q);
                    opaque.push_cut(face, [p, middle, r].into_iter().zip(sides));
                    opaque.push_cut(face, [middle, q, r].into_iter().zip(sides));
                }
                2 => {
                    table.set_veil(face);
                    veils.push_cut(face, outline.into_iter().zip(sides));
                }
                3 => {
                    table.set_veil(face);
                    veils.push_whole(face);
                }
                _ => {}
            }
        }
    }
    let map = VisibilityMap {
        camera: camera(),
        faces: table,
        opaque,
        veils,
    };
    SeenScene {
        has_holes: true,
        guests: vec![guest("deep.exr", [4, 2]), guest("card.png", [2, 1])],
        ..SeenScene::of(&scene, &map, [1920, 1080])
    }
}

fn guest(name: &str, size: [u32; 2]) -> Guest {
    let mut samples = GuestSamples::default();
    for pixel in 0..size[0] * size[1] {
        for k in 0..pixel % 3 {
            let near = 1.0 / f64::from(pixel + k + 3);
            samples.push([near, 0.5 * near], 0.25, [0.1, 0.2, k as f32], k % 2);
        }
        samples.end_pixel();
    }
    let grid = GuestGrid {
        frame: [5, 80],
        first: [-1, 2],
        size,
    };
    let objects = vec!["a".into(), "bäume".into()];
    Guest::new(name.into(), GuestKind::Deep, grid, samples, objects).expect("sound")
}

fn source(path: &str) -> Source {
    Source {
        path: path.into(),
        length: 3,
        xxh3: "0".into(),
    }
}

pub(super) fn written_of(seen: &SeenScene, casters: Option<Casters>) -> Vec<u8> {
    let origin = Origin {
        sources: vec![source("town.glb")],
        casters,
    };
    let out = write_map(Cursor::new(Vec::new()), seen, &origin).expect("memory takes all");
    out.into_inner()
}

/// Some spans of [`scene`].
pub(super) fn seen_spans() -> SeenSpans {
    let seen = seen(12);
    let (width, height, per_row) = (40, 70, 2);
    let faces = seen.map.faces.len() as u32;
    let mut bands: Vec<SpanBand> = Vec::new();
    for band in 0..3 {
        let first = 64 * band;
        let mut band = SpanBand {
            first,
            ..SpanBand::default()
        };
        for line in first..(first + 64).min(per_row * height + 1) {
            // Along some nothing is seen.
            for k in 0..line % 4 {
                let left = 7.3 * f64::from(k) + 0.1;
                let face = FaceId((line + k) % faces);
                let right = left + 1.0 + f64::from(line % 9) / 1.5;
                band.spans.push(Span { face, left, right });
            }
            band.ends.push(band.spans.len() as u32);
        }
        bands.push(band);
    }
    let spans = Spans::new(width, height, per_row, bands);
    SeenSpans::of(&seen.scene, &seen.map.camera, seen.map.faces, &spans)
}

pub(super) fn written_spans(seen: &SeenSpans) -> Vec<u8> {
    let origin = Origin {
        sources: vec![source("town.glb")],
        casters: Some(Casters::default()),
    };
    let out = write_spans(Cursor::new(Vec::new()), seen, &origin).expect("memory takes all");
    out.into_inner()
}

fn written(seen: &SeenScene) -> Vec<u8> {
    written_of(seen, None)
}

/// A scene that casts: what [`seen`] is a part of, with an image of its own and meshes of all kinds.
pub(super) fn casters(faces: u32) -> Casters {
    let mut scene = scene(faces);
    let tangle = |faces: u32| Mesh {
        normals: Vec::new(),
        opacities: vec![0.5; mesh(faces).positions.len()],
        second_texcoords: mesh(faces).texcoords,
        ..mesh(faces)
    };
    scene
        .meshes
        .extend([Mesh::default(), tangle(2), tangle(70)]);
    scene.meshes.push(Mesh {
        // Triangles alone, but told as polygons; and a material told twice.
        fans: vec![0, 1],
        triangles: vec![[0, 1, 2], [2, 1, 3]],
        materials: vec![(0, MaterialId(1)), (1, MaterialId(1))],
        positions: mesh(1).positions,
        ..Mesh::default()
    });
    for mesh in [2, 5, 3, 4, 3] {
        scene.objects.push(Object {
            name: format!("hidden/{mesh}"),
            mesh: MeshId(mesh),
            world_from_object: DMat4::from_scale(DVec3::new(-0.1, 0.0, 1.0 / 3.0)),
        });
    }
    let reading = Reading {
        files: vec![source("lamp.toml"), source("lamp.glb")],
        up_axis: Some("z".into()),
        layers: Some(vec!["lamp".into()]),
        choices: vec![Choice {
            only: vec!["lamp/**".into()],
            without: Vec::new(),
        }],
        ..Reading::default()
    };
    Casters {
        embedded: Some(scene),
        readings: vec![reading],
    }
}

fn read(bytes: &[u8]) -> Result<SeenScene, FileError> {
    MapReader::new(Cursor::new(bytes))?.check()
}

#[test]
fn what_is_unseen_is_left_out_and_the_rest_stays() {
    let seen = seen(20);
    assert_eq!(
        SeenScene::of(&seen.scene, &seen.map, seen.size).map,
        seen.map
    );
    assert_eq!(
        SeenScene::of(&seen.scene, &seen.map, seen.size).scene,
        seen.scene
    );
    let names: Vec<_> = seen
        .scene
        .materials
        .iter()
        .map(|m| m.name.as_str())
        .collect();
    assert_eq!(names, ["wood", ""]);
    assert_eq!(seen.scene.images.len(), 1);
    assert_eq!(seen.scene.images[0].name, "wood.png");
    for (object, mesh) in seen.scene.meshes.iter().enumerate() {
        mesh.check().expect("sound");
        // Of every five faces one is neither seen nor named.
        assert_eq!(mesh.face_count(), 8, "of object {object}");
    }
}

#[test]
fn what_was_written_is_read_bit_for_bit() {
    // Of one tile, of several, and of none.
    for faces in [12, 6000, 0] {
        let seen = seen(faces);
        let bytes = written(&seen);
        assert!(bytes == written(&seen), "equal maps make equal bytes");
        let found = read(&bytes).expect("sound");
        assert!(found == seen, "{faces} faces");
        let found = MapReader::new(Cursor::new(&bytes)).expect("sound");
        assert_eq!(found.sources()[0].path, "town.glb");
    }
}

/// The strip of [`mesh`] as the camera sees it, of which the last face has a plane and an outline of its own.
pub(super) fn projected(faces: u32) -> SeenScene {
    let scene = scene(faces);
    let (camera, object) = (camera(), ObjectId(0));
    let eye_from_object = camera.eye_from_world * scene.object(object).world_from_object;
    let mesh = scene.mesh_of(object);
    let eye = |vertex: u32| eye_from_object.transform_point3(mesh.positions[vertex as usize]);
    let (mut table, mut opaque) = (Faces::new(), Fragments::new());
    for source in 0..faces {
        let corners: Vec<DVec3> = mesh.corners_of(source).map(eye).collect();
        let [p, q, r] = [0, 1, 2].map(|corner| corners[corner]);
        let nearness = camera.nearness_of_plane(p, (q - p).cross(r - p));
        let mut nearness = nearness.expect("not edge-on");
        let mut outline: Vec<DVec2> = corners.iter().map(|&p| camera.image_from_eye(p)).collect();
        if source + 1 == faces {
            nearness.c = nearness.c.next_up();
            outline[0].x = outline[0].x.next_up();
        }
        let plane = table.push_plane(nearness);
        let face = table.push(&outline, plane, object, source);
        opaque.push_whole(face.expect("a face with area"));
    }
    let map = VisibilityMap {
        camera,
        faces: table,
        opaque,
        veils: Fragments::new(),
    };
    SeenScene::of(&scene, &map, [1920, 1080])
}

#[test]
fn what_follows_from_vertices_is_left_out_and_comes_back_bit_for_bit() {
    let seen = projected(12);
    let bytes = written(&seen);
    let found = read(&bytes).expect("sound");
    assert!(found == seen);
    for face in seen.map.faces.ids() {
        let [found, expected] = [&found, &seen].map(|seen| {
            let corners = seen.map.faces.outline(face).iter();
            let nearness = seen.map.faces.face_nearness(face);
            let numbers = corners.flat_map(|corner| corner.to_array());
            let numbers = numbers.chain([nearness.a, nearness.b, nearness.c]);
            numbers.map(f64::to_bits).collect::<Vec<u64>>()
        });
        assert_eq!(found, expected);
    }
    // Of 12 faces the last one is told.
    let faces = Parts::of(&bytes).rows("faces.arrow");
    let told = |column: &str| {
        faces[0]
            .column_by_name(column)
            .expect("is there")
            .null_count()
    };
    assert_eq!(["a", "b", "c"].map(told), [11; 3]);
    let outlines = faces[0].column_by_name("outline").expect("is there");
    let outlines = outlines.as_list::<i32>().iter().flatten();
    let told: usize = outlines.map(|outline| outline.len()).sum();
    assert_eq!(told, 3, "a triangle");
    let points = Parts::of(&bytes).rows("points.arrow");
    assert_eq!(points[0].num_rows(), 1, "the corner that was moved");
}

#[test]
fn casters_are_read_bit_for_bit_by_those_who_ask() {
    // Meshes within a batch, and one over several.
    for faces in [12, 40_000] {
        let (seen, casters) = (seen(12), casters(faces));
        let bytes = written_of(&seen, Some(casters.clone()));
        assert!(bytes == written_of(&seen, Some(casters.clone())));
        let mut reader = MapReader::new(Cursor::new(&bytes)).expect("sound");
        assert!(reader.read().expect("sound") == seen);
        let without = reader.bytes_read();
        let found = reader.read_casters().expect("sound").expect("are told");
        assert!(found == casters, "{faces} faces");
        assert!(faces < 100 || reader.bytes_read() > 10 * without);
        assert_eq!(reader.readings(), casters.readings);
        // Of three images, of which one is seen, two are stored beside it.
        let images = reader.manifest().casters.clone();
        let images = images
            .and_then(|told| told.embedded)
            .expect("are told")
            .images;
        assert_eq!(images, [1, 0]);
    }
    let unknown = written(&seen(12));
    let mut reader = MapReader::new(Cursor::new(&unknown)).expect("sound");
    assert!(reader.read_casters().expect("sound").is_none());
}

#[test]
fn spans_are_read_bit_for_bit_and_are_no_map() {
    let seen = seen_spans();
    assert!(seen.spans.len() > 100);
    let bytes = written_spans(&seen);
    assert!(bytes == written_spans(&seen));
    let mut reader = MapReader::new(Cursor::new(&bytes)).expect("sound");
    assert!(reader.check_spans().expect("sound") == seen);
    assert_eq!(
        reader.read_casters().expect("sound"),
        Some(Casters::default())
    );
    for refused in [reader.read(), reader.check()] {
        let message = refused.expect_err("is no map").to_string();
        assert!(message.contains("holds spans of multiscan"), "{message}");
    }
    let mut reader = MapReader::new(Cursor::new(written(&super::tests::seen(12)))).expect("sound");
    let message = reader.read_spans().expect_err("is a map").to_string();
    assert!(message.contains("holds regions"), "{message}");

    // Also where nothing is seen.
    let mut empty = seen;
    let band = SpanBand {
        first: 0,
        spans: Vec::new(),
        ends: vec![0; 141],
    };
    empty.spans = Spans::new(40, 70, 2, vec![band]);
    let empty = SeenSpans::of(&empty.scene, &empty.camera, empty.faces, &empty.spans);
    let bytes = written_spans(&empty);
    let mut reader = MapReader::new(Cursor::new(&bytes)).expect("sound");
    assert!(reader.check_spans().expect("sound") == empty);
}

#[test]
fn a_window_reads_what_is_seen_in_it_and_little_more() {
    let seen = seen(40_000);
    let bytes = written(&seen);
    let mut reader = MapReader::new(Cursor::new(&bytes)).expect("sound");
    let window = [DVec2::new(0.1, 0.2), DVec2::new(0.2, 0.9)];
    let found = reader.read_window(window).expect("sound");
    let share = reader.bytes_read() as f64 / bytes.len() as f64;
    assert!(
        share < 0.3,
        "a fifth of the faces, but {share} of the bytes"
    );
    let shown = |seen: &SeenScene| {
        let polygons = seen
            .map
            .opaque
            .iter()
            .map(|fragment| seen.map.polygon(fragment).to_vec());
        let inside = polygons.filter(|polygon| {
            polygon
                .iter()
                .any(|p| p.cmpge(window[0]).all() && p.cmple(window[1]).all())
        });
        inside.collect::<Vec<_>>()
    };
    assert!(shown(&found).len() > 1000);
    assert_eq!(shown(&found), shown(&seen));
    assert!(found.map.opaque.len() < seen.map.opaque.len() / 2);
}

/// `side` x `side` little faces all over the frame, packed towards its top left corner by `warp`.
fn sheet(side: u32, warp: impl Fn(f64) -> f64) -> SeenScene {
    let mut mesh = Mesh {
        materials: vec![(0, MaterialId(0))],
        ..Mesh::default()
    };
    let mut faces = Faces::new();
    let mut opaque = Fragments::new();
    let at = |column: u32, row: u32| {
        DVec2::new(column.into(), row.into()).map(|cells| warp(cells / f64::from(side)))
    };
    for source in 0..side * side {
        let (column, row) = (source % side, source / side);
        let outline = [at(column, row), at(column + 1, row), at(column, row + 1)];
        let corner = mesh.positions.len() as u32;
        mesh.positions
            .extend(outline.map(|point| point.extend(0.0)));
        mesh.push_fan(&[corner, corner + 1, corner + 2]);
        let plane = faces.push_plane(Affine::new(outline[0].x, outline[0].y, 1.0));
        let face = faces.push(&outline, plane, ObjectId(0), source);
        opaque.push_whole(face.expect("a triangle with area"));
    }
    let scene = Scene {
        objects: vec![Object {
            name: "sheet".into(),
            mesh: MeshId(0),
            world_from_object: DMat4::IDENTITY,
        }],
        meshes: vec![mesh],
        materials: vec![Material::default()],
        ..Scene::default()
    };
    let map = VisibilityMap {
        camera: camera(),
        faces,
        opaque,
        veils: Fragments::new(),
    };
    SeenScene::of(&scene, &map, [1920, 1080])
}

/// Of windows of a sixteenth of the frame all over it: share of the bytes read, share of the faces that
/// touch the window.
fn windows(seen: &SeenScene) -> Vec<[f64; 2]> {
    let bytes = written(seen);
    let faces = &seen.map.faces;
    let touch = |face: FaceId, [min, max]: [DVec2; 2]| {
        let outline = faces.outline(face);
        let (first, last) = (outline[0], outline[2].max(outline[1]));
        first.cmple(max).all() && last.cmpge(min).all()
    };
    (0..9)
        .map(|place| {
            let min = 0.01 + 0.36 * DVec2::new(f64::from(place % 3), f64::from(place / 3));
            let window = [min, min + 0.25];
            let mut reader = MapReader::new(Cursor::new(&bytes)).expect("sound");
            reader.read_window(window).expect("sound");
            let inside = faces.ids().filter(|&face| touch(face, window)).count();
            [
                reader.bytes_read() as f64 / bytes.len() as f64,
                inside as f64 / faces.len() as f64,
            ]
        })
        .collect()
}

#[test]
fn a_window_of_a_sixteenth_of_a_large_map_reads_an_eighth_of_it_at_most() {
    for [read, _] in windows(&sheet(360, |x| x)) {
        assert!(read <= 0.125, "{read} of the bytes");
    }
}

#[test]
fn where_faces_are_dense_a_window_reads_little_more_than_those_in_it() {
    for [read, inside] in windows(&sheet(360, |x| x * x)) {
        assert!(
            read < 1.5 * inside + 0.06,
            "{read} of the bytes for {inside} of the faces"
        );
    }
}

#[test]
fn every_cut_and_every_flipped_bit_of_a_small_file_is_an_error() {
    let sound = written_of(&seen(6), Some(casters(2)));
    for length in 0..sound.len() {
        assert!(read(&sound[..length]).is_err(), "cut to {length} bytes");
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for thread in 0..threads {
            let mut damaged = sound.clone();
            scope.spawn(move || {
                for bit in (thread..8 * damaged.len()).step_by(threads) {
                    damaged[bit / 8] ^= 1 << (bit % 8);
                    assert!(read(&damaged).is_err(), "bit {bit}");
                    damaged[bit / 8] ^= 1 << (bit % 8);
                }
            });
        }
    });
}

#[test]
fn a_window_reads_the_bands_of_guests_that_lie_in_it() {
    let seen = SeenScene {
        guests: vec![guest("deep.exr", [5, 70]), guest("card.png", [3, 2])],
        ..seen(6)
    };
    let bytes = written(&seen);
    let mut reader = MapReader::new(Cursor::new(&bytes)).expect("sound");
    // Rows 2 to 71 of 80 are the first guest's, rows 2 and 3 the second's.
    let below = [DVec2::new(0.0, 0.85), DVec2::ONE];
    let guests = reader.read_window(below).expect("sound").guests;
    assert_eq!(guests.len(), 1);
    let (found, whole) = (&guests[0], &seen.guests[0]);
    assert_eq!(found.grid().first, [-1, 66], "its second band");
    assert_eq!(found.grid().size, [5, 6]);
    for pixel in 0..30 {
        let [own, of_whole] = [found.samples_of(pixel), whole.samples_of(64 * 5 + pixel)];
        assert_eq!(
            found.samples().near[own.clone()],
            whole.samples().near[of_whole.clone()]
        );
        assert_eq!(found.samples().color[own], whole.samples().color[of_whole]);
    }
    let whole = reader
        .read_window([DVec2::ZERO, DVec2::ONE])
        .expect("sound");
    assert_eq!(whole.guests, seen.guests);
}

#[test]
fn flipped_bits_of_a_large_file_are_errors() {
    let sound = written_of(&seen(6000), Some(casters(1000)));
    let flips: u64 = std::env::var("VEDUTA_DAMAGE").map_or(500, |n| n.parse().expect("a number"));
    let mut state = 1_u64;
    for _ in 0..flips {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let bit = (state >> 20) as usize % (8 * sound.len());
        let mut damaged = sound.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&damaged).is_err(), "bit {bit}");
    }
}

#[test]
fn another_version_is_refused_by_its_number() {
    let text = format!(
        r#"{{"format":"{}","version":[3,7],"more":1}}"#,
        manifest::FORMAT
    );
    let error = manifest::Manifest::parse(text.as_bytes()).expect_err("of another version");
    assert!(error.to_string().contains("version 3.7"), "{error}");
}
