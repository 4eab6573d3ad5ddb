//! Flat pictures with depths, as renderers write them.

use crate::OneFile;
use exr::prelude::*;
use veduta::map::{Camera, Projection};
use veduta_geometry::{DVec2, DVec3};
use veduta_io::deep_exr::matrices_of_camera;
use veduta_io::depth_picture::{
    DepthKind, DepthOptions, DepthPicture, DepthProblem, read_depth_picture,
};
use veduta_io::{PictureProblem, ReadPictureError};

const WIDTH: usize = 6;
const HEIGHT: usize = 4;

fn camera() -> Camera {
    let projection = Projection::Perspective {
        tan_half_height: 0.8,
        aspect: 1.5,
    };
    let eye = DVec3::new(1.0, -6.0, 2.0);
    let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.1);
    camera.expect("a sound camera")
}

/// Planar depth in a pixel.
fn depth_at(index: usize) -> f32 {
    3.0 + 0.5 * index as f32
}

fn middle(index: usize) -> DVec2 {
    let at = DVec2::new((index % WIDTH) as f64, (index / WIDTH) as f64);
    (at + 0.5) / DVec2::new(WIDTH as f64, HEIGHT as f64)
}

type OwnLayer = Layer<AnyChannels<FlatSamples>>;

fn layer(name: &str, channels: Vec<(&str, Vec<f32>)>) -> OwnLayer {
    let channels = channels
        .into_iter()
        .map(|(name, samples)| AnyChannel::new(name, FlatSamples::F32(samples)));
    let attributes = match name {
        "" => LayerAttributes::default(),
        name => LayerAttributes::named(name),
    };
    Layer::new(
        (WIDTH, HEIGHT),
        attributes,
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    )
}

/// Files of all kinds that are read: with a camera and without, in parts, in blocks and lines.
pub fn sound_files() -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::PIZ,
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 3))] {
            let mut channels = colors();
            channels.push(("Z", (0..WIDTH * HEIGHT).map(depth_at).collect()));
            let mut layer = layer("", channels);
            layer.encoding.compression = compression;
            layer.encoding.blocks = blocks;
            layer.encoding.line_order = LineOrder::Increasing;
            let mut image = Image::from_layer(layer);
            let [world_to_camera, world_to_ndc] = matrices_of_camera(&camera());
            let attributes = &mut image.layer_data.attributes;
            attributes.world_to_camera = Some(world_to_camera);
            attributes.world_to_normalized_device = Some(world_to_ndc);
            let mut bytes = std::io::Cursor::new(Vec::new());
            image
                .write()
                .to_buffered(&mut bytes)
                .expect("memory takes all");
            files.push((format!("{compression:?}, {blocks:?}"), bytes.into_inner()));
        }
    }
    files
}

fn colors() -> Vec<(&'static str, Vec<f32>)> {
    ["R", "G", "B", "A"]
        .into_iter()
        .enumerate()
        .map(|(k, name)| (name, vec![0.25 * (k + 1) as f32; WIDTH * HEIGHT]))
        .collect()
}

/// Colours and a channel of depth.
fn with_depth<'a>(name: &'a str, samples: Vec<f32>) -> OwnLayer {
    let mut channels: Vec<(&'a str, Vec<f32>)> = colors();
    channels.push((name, samples));
    layer("", channels)
}

fn read(
    layers: Vec<OwnLayer>,
    options: &DepthOptions,
) -> std::result::Result<DepthPicture, ReadPictureError> {
    let file = OneFile::new("depth.exr");
    let frame = IntegerBounds::new((0, 0), (WIDTH, HEIGHT));
    let image = Image::from_layers(ImageAttributes::new(frame), layers);
    image.write().to_file(&file.path).expect("may write");
    read_depth_picture(&file.path, options)
}

fn assert_is_scene(found: &DepthPicture, case: &str) {
    assert_eq!((found.picture.width, found.picture.height), (6, 4));
    assert!(
        found
            .picture
            .pixels
            .iter()
            .all(|&p| p == [0.25, 0.5, 0.75, 1.0])
    );
    for (index, &depth) in found.depth.iter().enumerate() {
        let due = depth_at(index);
        assert!(
            (depth - due).abs() < 1e-4 * due,
            "{case}, {index}: {depth}, {due}"
        );
    }
}

/// A kind of depth, and what it tells of a pixel in which the planar depth is so much.
type Told<'a> = (DepthKind, &'a dyn Fn(usize, f64) -> f64);

#[test]
fn all_kinds_of_depth_become_planar_metres() {
    let (near, far) = (0.5_f64, 100.0_f64);
    let device = |reversed| DepthKind::Device {
        near,
        far,
        reversed,
    };
    let kept = |z: f64| far * (z - near) / (z * (far - near));
    let slant = |index| camera().eye_ray(middle(index)).1.length();
    let kinds: [Told; 5] = [
        (DepthKind::Planar, &|_, z| z),
        (DepthKind::Ray, &|index, z| z * slant(index)),
        (DepthKind::Inverse, &|_, z| 1.0 / z),
        (device(false), &|_, z| kept(z)),
        (device(true), &|_, z| 1.0 - kept(z)),
    ];
    for (kind, sample) in kinds {
        let samples = (0..WIDTH * HEIGHT).map(|k| sample(k, f64::from(depth_at(k))) as f32);
        let mut options = DepthOptions {
            kind: Some(kind),
            camera: Some(camera()),
            ..Default::default()
        };
        let found = read(vec![with_depth("Z", samples.collect())], &options);
        let found = found.unwrap_or_else(|error| panic!("{kind:?}: {error}"));
        assert_is_scene(&found, &format!("{kind:?}"));
        assert_eq!((found.kind, found.channel.as_str()), (kind, "Z"));
        assert!(found.warnings.is_empty(), "nothing was guessed");

        // In centimetres.
        options.metres_per_unit = 0.01;
        options.kind = Some(DepthKind::Planar);
        let samples = (0..WIDTH * HEIGHT).map(|k| 100.0 * depth_at(k));
        let found = read(vec![with_depth("Z", samples.collect())], &options);
        assert_is_scene(&found.expect("a sound file"), "centimetres");
    }
}

#[test]
fn the_camera_of_the_file_straightens_rays() {
    let slant = |index| camera().eye_ray(middle(index)).1.length() as f32;
    let samples = (0..WIDTH * HEIGHT).map(|k| depth_at(k) * slant(k));
    let mut layer = with_depth("Z", samples.collect());
    let options = DepthOptions {
        kind: Some(DepthKind::Ray),
        ..Default::default()
    };
    let error = read(vec![layer.clone()], &options).expect_err("no camera");
    assert!(
        error
            .to_string()
            .contains("depth.exr: has distances along rays"),
        "{error}"
    );
    let [to_camera, to_ndc] = matrices_of_camera(&camera());
    layer.attributes.world_to_camera = Some(to_camera);
    layer.attributes.world_to_normalized_device = Some(to_ndc);
    let found = read(vec![layer], &options).expect("a sound file");
    assert_is_scene(&found, "rays");
    assert!(found.camera.is_some());
}

#[test]
fn the_kind_is_guessed_by_the_program_and_the_guess_is_told() {
    let planar: Vec<f32> = (0..WIDTH * HEIGHT).map(depth_at).collect();
    let inverse: Vec<f32> = planar.iter().map(|z| 1.0 / z).collect();
    let mut by_nuke = with_depth("depth.Z", inverse);
    let version = AttributeValue::Text(Text::from("14.0"));
    by_nuke
        .attributes
        .other
        .insert(Text::from("nuke/version"), version);
    let mut by_blender = with_depth("ViewLayer.Depth.Z", planar.clone());
    by_blender.attributes.software_name = Some(Text::from("Blender 4.5.1"));
    for (layer, kind, word) in [
        (by_nuke, DepthKind::Inverse, "Nuke"),
        (by_blender, DepthKind::Planar, "Blender"),
        (
            with_depth("Z", planar),
            DepthKind::Planar,
            "does not tell its program",
        ),
    ] {
        let found = read(vec![layer], &DepthOptions::default()).expect("a sound file");
        assert_is_scene(&found, word);
        assert_eq!(found.kind, kind);
        assert!(found.warnings[0].contains(word), "{:?}", found.warnings);
    }
}

#[test]
fn parts_are_laid_together_in_the_frame() {
    // A part with the colours, and one with the depths of the right half.
    let mut depths = Layer::new(
        (WIDTH / 2, HEIGHT),
        LayerAttributes::named("Depth"),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(
            [AnyChannel::new(
                "Z",
                FlatSamples::F32(vec![2.0; WIDTH * HEIGHT / 2]),
            )]
            .into_iter()
            .collect(),
        ),
    );
    depths.attributes.layer_position = Vec2(3, 0);
    let parts = vec![layer("Combined", colors()), depths];
    let found = read(parts, &DepthOptions::default()).expect("a sound file");
    assert_eq!(found.channel, "Depth.Z");
    assert!(
        found
            .picture
            .pixels
            .iter()
            .all(|&p| p == [0.25, 0.5, 0.75, 1.0])
    );
    for (index, &depth) in found.depth.iter().enumerate() {
        let due = if index % WIDTH < 3 {
            f32::INFINITY
        } else {
            2.0
        };
        assert_eq!(depth, due, "{index}");
    }
}

#[test]
fn what_has_no_depth_or_an_unsure_one_is_refused() {
    let problem = |layers, options: &DepthOptions| match read(layers, options) {
        Ok(_) => panic!("read"),
        Err(error) => error.problem,
    };
    let usual = DepthOptions::default();
    let none = problem(vec![layer("", colors())], &usual);
    assert!(
        matches!(none, PictureProblem::Depth(DepthProblem::NoDepth { .. })),
        "{none}"
    );
    let z = vec![1.0; WIDTH * HEIGHT];
    let mut channels = colors();
    channels.push(("a.depth.Z", z.clone()));
    channels.push(("b.depth.Z", z.clone()));
    let several = problem(vec![layer("", channels)], &usual);
    assert!(
        matches!(
            several,
            PictureProblem::Depth(DepthProblem::SeveralDepths { .. })
        ),
        "{several}"
    );
    let options = DepthOptions {
        kind: Some(DepthKind::Device {
            near: 2.0,
            far: 1.0,
            reversed: false,
        }),
        ..Default::default()
    };
    let range = problem(vec![with_depth("Z", z)], &options);
    assert!(range.to_string().contains("from 2 to 1"), "{range}");
    let file = OneFile::new("depth.exr");
    file.write(b"nothing of the kind");
    assert!(read_depth_picture(&file.path, &usual).is_err());
}
