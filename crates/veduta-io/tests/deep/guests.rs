//! Pictures of other programs as guests: files in, pictures out.

use crate::{OneFile, Random, channels};
use veduta::accumulate::{AovSettings, Aovs, Picture};
use veduta::composite::composite;
use veduta::dice::PixelGrid;
use veduta::filter::Filter;
use veduta::map::{Camera, Guest, GuestKind, Projection, SeenScene};
use veduta::pipeline::{self, find_visibility, render_seen};
use veduta::scene::generate::{Generated, by_name};
use veduta_geometry::{DVec2, DVec3};
use veduta_io::deep_exr::{
    DeepHeader, DeepImage, DeepPixels, DeepWriter, SampleType, Samples, merge,
};
use veduta_io::depth_picture::{DepthKind, DepthOptions};
use veduta_io::{
    ExrCompression, GuestOptions, GuestProblem, Layers, PictureFormat, PictureOptions,
    PictureProblem, read_guest, write_layers, write_picture_as,
};

const SIZE: [u32; 2] = [9, 6];

/// Random samples: surfaces and what fills a depth, opaque or not, many at the same depths, in any order.
fn deep_image(random: &mut Random) -> DeepImage {
    let [width, height] = SIZE;
    let names = ["A", "B", "G", "R", "Z", "ZBack"];
    let header = DeepHeader::new(
        width,
        height,
        channels(names.map(|name| (name, SampleType::Float))),
    );
    let mut columns: Vec<Samples> = names
        .iter()
        .map(|_| Samples::new(SampleType::Float))
        .collect();
    let mut counts = Vec::new();
    for _ in 0..width * height {
        let count = random.below(6);
        counts.push(count as u32);
        for _ in 0..count {
            let front = 2.0 + 0.5 * random.below(8) as f32;
            let length = if random.below(2) == 0 {
                0.0
            } else {
                0.25 + random.unit()
            };
            let opacity = match random.below(6) {
                0 => 1.0,
                1 => 0.0,
                _ => random.unit(),
            };
            let mut color = || opacity * random.unit();
            let values = [opacity, color(), color(), color(), front, front + length];
            for (column, value) in columns.iter_mut().zip(values) {
                column.push(f64::from(value));
            }
        }
    }
    let pixels = DeepPixels::from_counts(width as usize, counts, columns);
    DeepImage { header, pixels }
}

fn write_deep(image: &DeepImage, file: &OneFile) {
    let bytes = std::io::Cursor::new(Vec::new());
    let mut writer = DeepWriter::new(bytes, image.header.clone()).expect("memory takes all");
    writer.write(&image.pixels).expect("memory takes all");
    file.write(writer.finish().expect("memory takes all").get_ref());
}

fn picture_of(seen: &SeenScene, [width, height]: [u32; 2]) -> Picture {
    let grid = PixelGrid::of_frame(width, height);
    render_seen(seen, &grid, true, Filter::Box, AovSettings::default()).0
}

fn assert_alike(found: &Picture, expected: &Picture, tolerance: f32) {
    for (pixel, (found, expected)) in found.pixels.iter().zip(&expected.pixels).enumerate() {
        for (a, b) in found.iter().zip(expected) {
            assert!(
                (a - b).abs() <= tolerance,
                "pixel {pixel}: {found:?}, {expected:?}"
            );
        }
    }
}

#[test]
fn deep_files_composite_as_openexr_merges_and_flattens_them() {
    let mut random = Random(7);
    for _ in 0..6 {
        let images = [0; 3].map(|_| deep_image(&mut random));
        let merged = merge(&images.each_ref()).expect("of the same channels");
        let expected = merged.flatten().expect("depth and opacity");
        let mut camera = None;
        let guests = images.each_ref().map(|image| {
            let file = OneFile::new("deep.exr");
            write_deep(image, &file);
            let options = GuestOptions {
                camera,
                ..GuestOptions::default()
            };
            let loaded = read_guest(&file.path, &options).expect("sound");
            assert_eq!(loaded.guest.kind(), GuestKind::Deep);
            camera = Some(loaded.camera);
            loaded.guest
        });
        let mut seen = SeenScene::of_nothing(camera.expect("read"), SIZE);
        seen.guests = guests.to_vec();
        assert_alike(&picture_of(&seen, SIZE), &expected, 1e-6);
        seen.guests.reverse();
        assert_alike(&picture_of(&seen, SIZE), &expected, 1e-6);
    }
}

/// A ball in the middle of a wall that stands upright to the line of sight, and what each shows alone.
fn ball_and_wall(size: [u32; 2]) -> (Camera, [SeenScene; 3]) {
    let Generated { scene, .. } = by_name("balls3").expect("a scene");
    let lens = Projection::Perspective {
        tan_half_height: 0.4,
        aspect: f64::from(size[0]) / f64::from(size[1]),
    };
    let bounds = veduta::scene::Bounds::of_scene(&scene).expect("faces");
    let middle = 0.5 * (bounds.min + bounds.max);
    let across = (bounds.max - bounds.min).length();
    let eye = middle - DVec3::Y * 1.5 * across;
    let camera = Camera::looking(eye, middle, DVec3::Z, lens, 0.01).expect("a camera");
    let mut wall = scene.clone();
    wall.objects.truncate(1);
    // In the first object's place, a wall through the middle of the frame and across its left half.
    let corners = [[-3.0, -3.0], [0.03, -3.0], [0.03, 3.0], [-3.0, 3.0]];
    let mesh = &mut wall.meshes[wall.objects[0].mesh.0 as usize];
    *mesh = veduta::scene::Mesh {
        positions: corners
            .map(|[x, z]| middle + across * DVec3::new(x, 0.0, z))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        materials: vec![(0, veduta::map::MaterialId(0))],
        ..Default::default()
    };
    wall.objects[0].world_from_object = Default::default();
    wall.objects[0].name = "wall".into();
    let mut balls = scene;
    for material in balls.materials.iter_mut().chain(&mut wall.materials) {
        material.double_sided = true;
    }
    let seen =
        |scene: &veduta::scene::Scene| SeenScene::of(scene, &find_visibility(scene, &camera), size);
    let [balls, wall] = [&balls, &wall].map(seen);
    let both = composite(&[balls.clone(), wall.clone()]).expect("of one camera");
    (camera, [balls, wall, both])
}

/// Writes what a map shows with its depth, as another program would.
fn write_with_depth(seen: &SeenScene, size: [u32; 2], file: &OneFile) {
    let grid = PixelGrid::of_frame(size[0], size[1]);
    let settings = AovSettings {
        depth: true,
        ..AovSettings::default()
    };
    let (picture, aovs): (Picture, Aovs) =
        pipeline::render_channels(&seen.scene, &seen.map, &grid, true, Filter::Box, settings);
    let layers = Layers {
        aovs: &aovs,
        scene: &seen.scene,
        camera: &seen.map.camera,
        grid,
    };
    let options = PictureOptions {
        exr_compression: ExrCompression::Zips,
        ..PictureOptions::default()
    };
    write_layers(&file.path, &picture, &layers, &options).expect("may write");
}

#[test]
fn a_ball_through_a_wall_of_another_program_is_cut_exactly() {
    let size = [100, 60];
    let (camera, [balls, wall, both]) = ball_and_wall(size);
    let expected = picture_of(&both, size);
    for guest_size in [size, [50, 30], [200, 120]] {
        let file = OneFile::new("wall.exr");
        write_with_depth(&wall, guest_size, &file);
        let planar = DepthOptions {
            kind: Some(DepthKind::Planar),
            ..DepthOptions::default()
        };
        let options = GuestOptions {
            depth: planar,
            camera: Some(camera),
            ..GuestOptions::default()
        };
        let loaded = read_guest(&file.path, &options).expect("sound");
        assert_eq!(loaded.warnings, [""; 0], "it tells the camera");
        let seen = SeenScene {
            guests: vec![loaded.guest],
            ..balls.clone()
        };
        let found = picture_of(&seen, size);
        let wall_alone = picture_of(&wall, size);
        let mut crossing = 0;
        for (pixel, (found, expected)) in found.pixels.iter().zip(&expected.pixels).enumerate() {
            // Along the wall's own border its picture knows no place within the pixel.
            let column = pixel as u32 % size[0];
            let near_border = (-3..=2).any(|step| {
                let other = column.saturating_add_signed(step).min(size[0] - 1);
                let other = (pixel as u32 / size[0] * size[0] + other) as usize;
                let opacity = wall_alone.pixels[other][3];
                opacity > 1e-6 && opacity < 1.0 - 1e-6
            });
            if near_border {
                continue;
            }
            for (a, b) in found.iter().zip(expected) {
                // Depths of single precision move the line where ball and wall meet by as much.
                assert!(
                    (a - b).abs() < 1e-4,
                    "{guest_size:?}, {pixel}: {found:?}, {expected:?}"
                );
            }
            crossing += usize::from(
                *expected != wall_alone.pixels[pixel] && wall_alone.pixels[pixel][3] > 0.5,
            );
        }
        assert!(crossing > 20, "the balls come through: {crossing}");
    }
}

#[test]
fn guests_of_other_cameras_and_shapes_are_refused() {
    let (camera, [_, wall, _]) = ball_and_wall([30, 20]);
    let file = OneFile::new("wall.exr");
    write_with_depth(&wall, [30, 20], &file);
    let read = |camera: Camera, trust_camera: bool| {
        let options = GuestOptions {
            camera: Some(camera),
            trust_camera,
            ..GuestOptions::default()
        };
        read_guest(&file.path, &options)
    };
    assert!(read(camera, false).is_ok());
    let problem = |camera: Camera| match read(camera, false).expect_err("another camera").problem {
        PictureProblem::Guest(problem) => problem,
        other => panic!("{other}"),
    };
    let mut moved = camera;
    moved.eye_from_world.w_axis.x += 0.1;
    let turned = Camera {
        shift: DVec2::new(0.01, 0.0),
        ..camera
    };
    for other in [moved, turned] {
        let found = problem(other);
        assert!(matches!(found, GuestProblem::OtherCamera { .. }), "{found}");
        assert!(read(other, true).is_ok());
    }
    let found = problem(camera.with_aspect(1.6));
    assert!(matches!(found, GuestProblem::OtherShape { .. }), "{found}");
}

#[test]
fn a_card_lies_at_its_depth() {
    let (camera, [balls, wall, _]) = ball_and_wall([30, 20]);
    let file = OneFile::new("card.png");
    write_picture_as(
        &file.path,
        PictureFormat::Png,
        &picture_of(&wall, [30, 20]),
        &PictureOptions::default(),
    )
    .expect("may write");
    let read = |depth: f64| {
        let options = GuestOptions {
            card: Some(depth),
            camera: Some(camera),
            ..GuestOptions::default()
        };
        let guest: Guest = read_guest(&file.path, &options).expect("sound").guest;
        assert_eq!(guest.kind(), GuestKind::Card);
        picture_of(
            &SeenScene {
                guests: vec![guest],
                ..balls.clone()
            },
            [30, 20],
        )
    };
    let alone = picture_of(&balls, [30, 20]);
    let [near, far] = [read(0.02), read(1e6)];
    for (pixel, ball) in alone.pixels.iter().enumerate() {
        if ball[3] >= 1.0 {
            assert_eq!(far.pixels[pixel], *ball, "it lies behind the balls");
        }
        let column = pixel % 30;
        if column < 14 {
            assert!((near.pixels[pixel][3] - 1.0).abs() < 1e-6);
            assert_ne!(near.pixels[pixel], *ball, "it lies before them");
        }
    }
}
