//! What is written is read again; and files that OpenEXR's own library wrote.

use crate::{OneFile, PACKINGS, channels, encoded, formula};
use veduta::map::{Camera, Projection};
use veduta_geometry::DVec3;
use veduta_io::deep_exr::{
    Attribute, DeepFile, DeepHeader, DeepImage, DeepPixels, DeepProblem, DeepWriter, SampleType,
    read_deep,
};
use veduta_io::{PictureProblem, read_picture};

/// Files by OpenEXR 3.1.5 of the picture that `formula` tells. Those of tiles have tiles of 4 x 3.
const BY_OPENEXR: [(&str, &[u8]); 5] = [
    (
        "runs, scanlines from the bottom",
        include_bytes!("files/scan_rle_down.exr"),
    ),
    ("scanlines", include_bytes!("files/scan_zips.exr")),
    ("tiles", include_bytes!("files/tile_zips_one.exr")),
    (
        "tiles in random order, of all resolutions",
        include_bytes!("files/tile_rle_mip_up.exr"),
    ),
    (
        "tiles of all resolutions each way",
        include_bytes!("files/tile_none_rip.exr"),
    ),
];

/// Three parts: flat, deep scanlines, deep tiles; their chunks in another order.
const PARTS: &[u8] = include_bytes!("files/parts.exr");

fn file(bytes: &[u8]) -> DeepFile {
    DeepFile::from_bytes(bytes.to_vec()).unwrap_or_else(|problem| panic!("{problem}"))
}

fn assert_is_formula(image: &DeepImage, case: &str) {
    let expected = formula();
    assert_eq!(image.pixels, expected.pixels, "{case}");
    assert_eq!(image.header.channels, expected.header.channels, "{case}");
    assert_eq!(
        image.header.data_window, expected.header.data_window,
        "{case}"
    );
    let frame = expected.header.display_window;
    assert_eq!(image.header.display_window, frame, "{case}");
}

#[test]
fn what_is_written_is_read_again() {
    for compression in PACKINGS {
        let mut image = formula();
        image.header.compression = compression;
        image.header.name = "beauty".to_owned();
        let long_name = "a-name-that-is-longer-than-old-readers-allow";
        image
            .header
            .set_attribute(Attribute::new(long_name, "int", vec![1, 2, 3, 4]));
        let file = OneFile::new("deep.exr");
        file.write(&encoded(&image));
        let read = read_deep(&file.path).unwrap_or_else(|error| panic!("{error}"));
        assert_is_formula(&read, &format!("{compression:?}"));
        assert_eq!(read.header.name, "beauty");
        assert_eq!(read.header.compression, compression);
        let value = read.header.attribute(long_name).map(|a| &a.value[..]);
        assert_eq!(value, Some(&[1, 2, 3, 4][..]));
    }
}

#[test]
fn bytes_do_not_depend_on_how_many_rows_are_written_at_once() {
    let image = formula();
    let rows: Vec<DeepPixels> = {
        let file = file(&encoded(&image));
        (0..7)
            .map(|band| file.read_band(0, band).expect("a sound file"))
            .collect()
    };
    let mut writer = DeepWriter::new(std::io::Cursor::new(Vec::new()), image.header.clone())
        .expect("memory takes all");
    for row in &rows {
        writer.write(row).expect("memory takes all");
    }
    let bytes = writer.finish().expect("memory takes all").into_inner();
    assert_eq!(bytes, encoded(&image));
}

#[test]
fn files_of_openexr_are_read() {
    for (case, bytes) in BY_OPENEXR {
        let image = file(bytes)
            .read(0)
            .unwrap_or_else(|problem| panic!("{case}: {problem}"));
        assert_is_formula(&image, case);
    }
}

#[test]
fn deep_parts_are_found_among_others() {
    let file = file(PARTS);
    let names: Vec<&str> = file.headers().map(|header| header.name.as_str()).collect();
    assert_eq!(names, ["lines", "tiles"]);
    for (part, name) in names.into_iter().enumerate() {
        let image = file
            .read(part)
            .unwrap_or_else(|problem| panic!("{name}: {problem}"));
        assert_is_formula(&image, name);
    }
}

#[test]
fn bands_are_rows_or_rows_of_tiles() {
    let lines = file(BY_OPENEXR[1].1);
    assert_eq!(lines.band_count(0), 7);
    assert_eq!(lines.rows_of_band(0, 6), 6..7);
    let tiles = file(BY_OPENEXR[2].1);
    assert_eq!(tiles.band_count(0), 3);
    assert_eq!(tiles.rows_of_band(0, 2), 6..7);
    let band = tiles.read_band(0, 1).expect("a sound file");
    assert_eq!((band.width(), band.rows()), (11, 3));
}

#[test]
fn a_pixel_may_have_no_samples_and_a_picture_none_at_all() {
    let kinds = channels([("A", SampleType::Float), ("Z", SampleType::Float)]);
    for compression in PACKINGS {
        let mut header = DeepHeader::new(300, 2, kinds.clone());
        header.compression = compression;
        let empty = kinds
            .iter()
            .map(|k| veduta_io::deep_exr::Samples::new(k.sample_type));
        let pixels = DeepPixels::from_counts(300, [0; 600], empty.collect());
        let image = DeepImage { header, pixels };
        let read = file(&encoded(&image)).read(0).expect("a sound file");
        assert_eq!(read.pixels, image.pixels);
        let picture = read.flatten().expect("depth and opacity");
        assert!(picture.pixels.iter().all(|&pixel| pixel == [0.0; 4]));
    }
}

#[test]
fn the_camera_comes_through_a_file() {
    let projection = Projection::Perspective {
        tan_half_height: 0.5,
        aspect: 2.0,
    };
    let eye = DVec3::new(10.0, -20.0, 5.0);
    let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.1);
    let camera = camera.expect("a sound camera");
    let mut image = formula();
    image.header.set_camera(&camera);
    let read = file(&encoded(&image)).read(0).expect("a sound file");
    let found = read.header.camera().expect("a camera");
    let off = found.eye_from_world - camera.eye_from_world;
    assert!(
        off.to_cols_array().iter().all(|off| off.abs() < 1e-5),
        "{off}"
    );
    assert!((found.aspect() - 2.0).abs() < 1e-6);
}

#[test]
fn a_deep_file_is_read_as_the_picture_that_it_lays_flat_to() {
    let one = OneFile::new("deep.exr");
    for (_, bytes) in BY_OPENEXR {
        one.write(bytes);
        let read = read_picture(&one.path).unwrap_or_else(|error| panic!("{error}"));
        let expected = formula().flatten().expect("depth and opacity");
        assert_eq!(read.picture, expected);
        assert!(read.linear && read.warnings.is_empty());
    }
    // x + y = 6 at (5, 1), with two samples, one behind the other: 0.1875 + half of that.
    let picture = formula().flatten().expect("depth and opacity");
    assert_eq!(picture.pixels[11 + 5], [0.28125, 0.0, 0.0, 0.75]);
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    let refused = |bytes: &[u8]| match DeepFile::from_bytes(bytes.to_vec()) {
        Ok(_) => panic!("read, though it is not sound"),
        Err(problem) => problem,
    };
    let sound = BY_OPENEXR[1].1;
    let with = |mark: &[u8], offset: usize, byte: u8| {
        let mut bytes = sound.to_vec();
        let at = sound.windows(mark.len()).position(|part| part == mark);
        bytes[at.expect("the attribute") + mark.len() + offset] = byte;
        bytes
    };
    for (code, name) in [
        (3, "zip"),
        (4, "piz"),
        (10, "htj2k"),
        (13, "zstd"),
        (99, "99"),
    ] {
        // After the name and the type come four bytes of size.
        let problem = refused(&with(b"compression\0compression\0", 4, code));
        assert!(
            matches!(problem, DeepProblem::Unsupported { .. }),
            "{problem}"
        );
        let message = problem.to_string();
        assert!(
            message.contains(&format!("compression {name}")),
            "{message}"
        );
    }
    let problem = refused(&with(b"version\0int\0", 4, 2));
    assert!(
        problem.to_string().contains("deep data of version 2"),
        "{problem}"
    );
    let problem = refused(&[0x76, 0x2f, 0x31, 0x01, 3, 8, 0, 0, 0]);
    assert!(problem.to_string().contains("version 0x803"), "{problem}");
    assert!(matches!(
        refused(b"PNG and so on"),
        DeepProblem::NotOpenExr { .. }
    ));

    let one = OneFile::new("zip.exr");
    one.write(&with(b"compression\0compression\0", 4, 3));
    let error = read_picture(&one.path).expect_err("not read");
    assert!(matches!(error.problem, PictureProblem::Deep(_)));
    let message = error.to_string();
    assert!(
        message.contains(
            "zip.exr: is not read: deep data with compression zip, in the header of part 0"
        ),
        "{message}"
    );
}

#[test]
fn a_flat_file_is_not_taken_for_a_deep_one() {
    let one = OneFile::new("flat.exr");
    let picture = veduta::accumulate::Picture {
        width: 2,
        height: 1,
        pixels: vec![[0.5; 4]; 2],
    };
    veduta_io::write_picture(&one.path, &picture, &Default::default()).expect("may write");
    let error = read_deep(&one.path).expect_err("flat");
    assert!(matches!(error.problem, DeepProblem::NotDeep), "{error}");
    assert!(error.to_string().contains("flat.exr"), "{error}");
}
