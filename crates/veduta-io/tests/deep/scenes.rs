//! Deep pictures of scenes: flat, they are the flat pictures; and their samples are where the faces are.

use crate::OneFile;
use std::collections::BTreeSet;
use veduta::accumulate::DeepRows;
use veduta::pipeline::{RenderSettings, render, render_deep};
use veduta::scene::Scene;
use veduta::scene::generate::{NAMES, by_name};
use veduta_io::deep_exr::{
    DeepCompression, DeepFile, DeepImage, DeepPicture, DeepSink, IdNames, ObjectIds,
    Samples as Column, read_deep, stream_deep_picture, write_deep_picture,
};
use veduta_io::{Samples, WriteProblem};

fn settings(width: u32, height: u32) -> RenderSettings {
    RenderSettings {
        width,
        height,
        ..Default::default()
    }
}

fn ids(scene: &Scene) -> ObjectIds {
    ObjectIds::of_names(scene.objects.iter().map(|object| object.name.as_str()))
}

/// The deep picture of a scene, through a file in memory.
fn deep(
    scene: &Scene,
    camera: &veduta::map::Camera,
    settings: &RenderSettings,
    samples: Samples,
) -> DeepImage {
    let picture = DeepPicture {
        width: settings.width,
        height: settings.height,
        camera: *camera,
        objects: ids(scene),
        samples,
        compression: DeepCompression::Zips,
    };
    let mut bytes = Vec::new();
    stream_deep_picture(&mut bytes, &picture, |sink| {
        render_deep(scene, camera, settings, |_| {}, |rows| sink.write(rows))
    })
    .expect("memory takes all");
    let file = DeepFile::from_bytes(bytes).expect("a sound file");
    file.read(0).expect("a sound file")
}

fn largest_difference(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
    assert_eq!(a.len(), b.len());
    let off = a.as_flattened().iter().zip(b.as_flattened());
    off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn floats(image: &DeepImage, name: &str) -> Vec<f32> {
    let channel = image.header.channel(name).expect("the channel");
    match &image.pixels.channels()[channel] {
        Column::Float(samples) => samples.clone(),
        other => panic!("{name} holds {:?}", other.sample_type()),
    }
}

#[test]
fn a_deep_picture_lays_flat_to_the_flat_one() {
    for &name in NAMES {
        // Those of millions of faces are measured elsewhere.
        if ["field1m", "field10m", "leaves400", "leaves100"].contains(&name) {
            continue;
        }
        let made = by_name(name).expect("a generated scene");
        // The last has more faces than pixels, and is made in strips.
        let sizes: &[[u32; 2]] = if name == "leaves20" {
            &[[160, 90], [64, 37]]
        } else {
            &[[120, 70]]
        };
        for &[width, height] in sizes {
            let settings = settings(width, height);
            let flat = render(&made.scene, &made.camera, &settings, |_| {}).picture;
            let image = deep(&made.scene, &made.camera, &settings, Samples::F32);
            let laid_flat = image.flatten().expect("depth and opacity");
            let off = largest_difference(&laid_flat.pixels, &flat.pixels);
            assert!(off < 2e-6, "{name}, {width} x {height}: {off}");

            let image = deep(&made.scene, &made.camera, &settings, Samples::F16);
            let laid_flat = image.flatten().expect("depth and opacity");
            let brightest = flat.pixels.iter().flatten().fold(1.0_f32, |m, &v| m.max(v));
            let off = largest_difference(&laid_flat.pixels, &flat.pixels);
            // Opacity has 11 bits, and errs once for each sample.
            assert!(off < 1e-3 * brightest, "{name}, half: {off}");
        }
    }
}

#[test]
fn samples_ascend_do_not_overlap_and_hold_depth_within_their_ends() {
    let made = by_name("pierce").expect("a generated scene");
    let settings = settings(90, 90);
    let mut pixels = 0;
    let check = |rows: &DeepRows| -> Result<(), ()> {
        let mut samples = &rows.samples[..];
        for &count in &rows.counts {
            let (pixel, rest) = samples.split_at(count as usize);
            for sample in pixel {
                assert!(sample.front <= sample.depth && sample.depth <= sample.back);
                assert!(sample.opacity > 0.0 && sample.opacity <= 1.0);
            }
            for pair in pixel.windows(2) {
                assert!(pair[0].back < pair[1].front, "{pair:?}");
            }
            samples = rest;
            pixels += 1;
        }
        assert!(samples.is_empty());
        Ok(())
    };
    render_deep(&made.scene, &made.camera, &settings, |_| {}, check).expect("no failure");
    assert_eq!(pixels, 90 * 90);
}

#[test]
fn depths_are_those_of_the_faces() {
    // Of pixels with one sample, whose face fills them or not: the flat depth at their middle, from the
    // map itself.
    for name in ["balls3", "buildings"] {
        let made = by_name(name).expect("a generated scene");
        let (width, height) = (80_u32, 60_u32);
        let image = deep(
            &made.scene,
            &made.camera,
            &settings(width, height),
            Samples::F32,
        );
        let map = veduta::pipeline::find_visibility(&made.scene, &made.camera);
        let grid = veduta::dice::PixelGrid::of_frame(width, height);
        let (fronts, backs) = (floats(&image, "Z"), floats(&image, "ZBack"));
        let mut checked = 0;
        for part in veduta::dice::coverage(&map, &grid) {
            let samples = image.pixels.samples_of(part.pixel);
            if part.area < 1.0 || samples.len() != 1 {
                continue;
            }
            let corner = [part.pixel as u32 % width, part.pixel as u32 / width];
            let corner = veduta_geometry::DVec2::from(corner.map(f64::from));
            let nearness = map.faces.face_nearness(part.face);
            let depth = |offset: [f64; 2]| {
                let at = grid.image_from_pixels(corner + veduta_geometry::DVec2::from(offset));
                made.camera.eye_from_image(at, nearness.at(at)).z
            };
            let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(depth);
            let least = corners.into_iter().fold(f64::INFINITY, f64::min);
            let most = corners.into_iter().fold(0.0, f64::max);
            let (front, back) = (
                f64::from(fronts[samples.start]),
                f64::from(backs[samples.start]),
            );
            assert!(
                (front - least).abs() < 1e-6 * least,
                "{name}: {front}, {least}"
            );
            assert!((back - most).abs() < 1e-6 * most, "{name}: {back}, {most}");
            checked += 1;
        }
        assert!(checked > 200, "{name}: {checked}");
    }
}

#[test]
fn samples_tell_their_object_and_the_file_its_camera() {
    let made = by_name("balls3").expect("a generated scene");
    let image = deep(&made.scene, &made.camera, &settings(60, 60), Samples::F32);
    let ids = ids(&made.scene);
    let known: BTreeSet<u32> = (0..made.scene.objects.len())
        .map(|index| ids.of(index))
        .collect();
    let channel = image.header.channel("id").expect("ids");
    let Column::Uint(found) = &image.pixels.channels()[channel] else {
        panic!("ids are whole numbers");
    };
    let found: BTreeSet<u32> = found.iter().copied().collect();
    assert!(
        !found.is_empty() && found.is_subset(&known),
        "{found:?} of {known:?}"
    );
    let names = IdNames::of(&image.header).expect("sound").expect("names");
    assert!(found.iter().all(|id| names.names.contains_key(id)));
    // OpenEXR's Python module cannot open files with this attribute.
    assert_eq!(image.header.attribute("deepImageState"), None);
    let camera = image.header.camera().expect("a camera");
    assert!((camera.aspect() - made.camera.aspect()).abs() < 1e-5);
}

#[test]
fn a_deep_file_is_the_same_for_any_number_of_threads() {
    let made = by_name("buildings").expect("a generated scene");
    let settings = settings(100, 100);
    let in_pool = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads")
            .install(|| deep(&made.scene, &made.camera, &settings, Samples::F16))
    };
    assert!(in_pool(1) == in_pool(5));
}

#[test]
fn a_failure_leaves_the_old_file_as_it_was() {
    let file = OneFile::new("deep.exr");
    file.write(b"old");
    let made = by_name("balls3").expect("a generated scene");
    let mut picture = DeepPicture {
        width: 4,
        height: 4,
        camera: made.camera,
        objects: ids(&made.scene),
        samples: Samples::F32,
        compression: DeepCompression::Rle,
    };
    let fail = |_: &mut DeepSink| Err::<(), _>(WriteProblem::Encode("stopped".to_owned()));
    let error = write_deep_picture(&file.path, &picture, fail).expect_err("it fails");
    assert!(error.to_string().contains("stopped"), "{error}");
    assert_eq!(std::fs::read(&file.path).expect("is there"), b"old");

    picture.samples = Samples::U8;
    let error = write_deep_picture(&file.path, &picture, |_| Ok(())).expect_err("no such samples");
    assert!(matches!(error.problem, WriteProblem::NoSuchSamples { .. }));

    picture.samples = Samples::F32;
    write_deep_picture(&file.path, &picture, |sink| {
        let settings = settings(4, 4);
        render_deep(
            &made.scene,
            &made.camera,
            &settings,
            |_| {},
            |rows| sink.write(rows),
        )
    })
    .expect("may write");
    let read = read_deep(&file.path).expect("a sound file");
    assert_eq!(read.header.compression, DeepCompression::Rle);
}
