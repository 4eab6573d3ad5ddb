use crate::{OneFile, encoded, sample_picture};
use veduta::accumulate::Picture;
use veduta_io::tone::srgb_from_linear;
use veduta_io::{
    ExrCompression, PICTURE_SUFFIXES, PictureFormat, PictureOptions, Samples, read_picture,
    write_picture,
};

fn round_trip(suffix: &str, picture: &Picture, options: &PictureOptions) -> (Picture, bool) {
    let file = OneFile::new(&format!("picture.{suffix}"));
    write_picture(&file.path, picture, options).expect("can be written");
    let loaded = read_picture(&file.path).expect("can be read");
    assert!(
        loaded.warnings.is_empty(),
        "{suffix}: {:?}",
        loaded.warnings
    );
    (loaded.picture, loaded.linear)
}

/// The largest difference of two pictures as a display shows them, premultiplied by opacity.
fn shown_difference(a: &Picture, b: &Picture) -> f32 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let shown = |[r, g, b, alpha]: [f32; 4]| {
        let straight = |light: f32| {
            let light = if alpha > 0.0 { light / alpha } else { 0.0 };
            srgb_from_linear(light.clamp(0.0, 1.0)) * alpha
        };
        [straight(r), straight(g), straight(b), alpha]
    };
    let pairs = a.pixels.iter().zip(&b.pixels);
    let differences = pairs.flat_map(|(&a, &b)| {
        let (a, b) = (shown(a), shown(b));
        [0, 1, 2, 3].map(|channel| (a[channel] - b[channel]).abs())
    });
    differences.fold(0.0, f32::max)
}

#[test]
fn linear_formats_give_back_every_bit() {
    let mut picture = sample_picture();
    picture.pixels[7] = [-1e-7, 1e9, 1e-30, 0.5];
    let floats = PictureOptions {
        samples: Some(Samples::F32),
        ..PictureOptions::default()
    };
    for suffix in ["exr", "npy", "tif"] {
        let (read, linear) = round_trip(suffix, &picture, &floats);
        assert!(linear && read == picture, "{suffix}");
    }
    let (read, linear) = round_trip("pfm", &picture, &floats);
    assert!(linear);
    for (read, pixel) in read.pixels.iter().zip(&picture.pixels) {
        let [r, g, b, _] = *pixel;
        assert_eq!(*read, [r, g, b, 1.0], "without opacity, on black");
    }
}

#[test]
fn formats_for_displays_are_right_to_half_a_step() {
    let mut picture = sample_picture();
    picture.pixels[7] = [-1e-7, 1e9, 1e-30, 0.5];
    for (suffix, samples, steps) in [
        ("png", Samples::U8, 255.0),
        ("png", Samples::U16, 65_535.0),
        ("tif", Samples::U8, 255.0),
        ("tif", Samples::U16, 65_535.0),
        ("webp", Samples::U8, 255.0),
    ] {
        let options = PictureOptions {
            samples: Some(samples),
            ..PictureOptions::default()
        };
        let (read, linear) = round_trip(suffix, &picture, &options);
        let difference = shown_difference(&picture, &read);
        // Colour and opacity are each rounded once, and multiplied.
        let most = 1.0 / steps + 1e-6;
        assert!(
            !linear && difference <= most,
            "{suffix} {samples}: {difference}"
        );
    }
}

#[test]
fn a_jpeg_of_smooth_colour_is_close_and_on_white() {
    let (width, height) = (64, 48);
    let pixel = |index: u32| {
        let (x, y) = (index % width, index / width);
        let [x, y] = [x as f32 / width as f32, y as f32 / height as f32];
        [0.5 * x, 0.5 * y, 0.25, 1.0]
    };
    let mut picture = Picture {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
    };
    let fine = PictureOptions {
        jpeg_quality: 98,
        ..PictureOptions::default()
    };
    let (read, linear) = round_trip("jpg", &picture, &fine);
    let difference = shown_difference(&picture, &read);
    assert!(!linear && difference < 0.02, "{difference}");

    let coarse = PictureOptions {
        jpeg_quality: 5,
        ..PictureOptions::default()
    };
    assert!(encoded("jpg", &picture, &coarse).len() < encoded("jpg", &picture, &fine).len() / 2);

    picture.pixels.fill([0.0; 4]);
    let (read, _) = round_trip("jpeg", &picture, &fine);
    assert!(read.pixels.iter().all(|pixel| *pixel == [1.0; 4]));
}

#[test]
fn every_kind_of_exr_holds_the_same_picture() {
    let mut picture = sample_picture();
    picture.pixels[3] = [1e9, 0.5, 0.25, 1.0];
    use ExrCompression::{None, Piz, Rle, Zip, Zips};
    for exr_compression in [None, Rle, Zips, Zip, Piz] {
        for exr_tile in [Option::None, Some(16)] {
            for samples in [Samples::F32, Samples::F16] {
                let options = PictureOptions {
                    samples: Some(samples),
                    exr_compression,
                    exr_tile,
                    ..PictureOptions::default()
                };
                let (read, linear) = round_trip("exr", &picture, &options);
                let case = format!("{exr_compression:?} {exr_tile:?} {samples}");
                assert!(linear, "{case}");
                if samples == Samples::F32 {
                    assert!(read == picture, "{case}");
                    continue;
                }
                assert_eq!(read.pixels[3][0], 65_504.0, "{case}: the brightest half");
                for (read, pixel) in read.pixels.iter().zip(&picture.pixels).skip(4) {
                    for (read, value) in read.iter().zip(pixel) {
                        // Eleven bits of a half.
                        assert!((read - value).abs() <= value.abs() / 2048.0, "{case}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_same_picture_makes_the_same_bytes() {
    let picture = sample_picture();
    for suffix in PICTURE_SUFFIXES {
        let options = PictureOptions::default();
        let bytes = encoded(suffix, &picture, &options);
        assert!(bytes == encoded(suffix, &picture, &options), "{suffix}");
        let file = OneFile::new(&format!("picture.{suffix}"));
        write_picture(&file.path, &picture, &options).expect("can be written");
        let written = std::fs::read(&file.path).expect("is there");
        assert!(written == bytes, "{suffix}: a file and a stream differ");
    }
}

#[test]
fn samples_that_a_format_does_not_hold_are_refused() {
    for (suffix, samples) in [
        ("png", Samples::F16),
        ("jpg", Samples::U16),
        ("webp", Samples::U16),
        ("tif", Samples::F16),
        ("exr", Samples::U8),
        ("pfm", Samples::U8),
        ("npy", Samples::F16),
    ] {
        let options = PictureOptions {
            samples: Some(samples),
            ..PictureOptions::default()
        };
        let format = PictureFormat::of_suffix(suffix).expect("a format");
        let error = options.samples_in(format).expect_err("not of this format");
        assert!(
            error.to_string().contains("is stored as"),
            "{suffix}: {error}"
        );
    }
}

#[test]
fn arrays_of_other_programs_are_read() {
    let array = |description: &str, shape: &str, data: &[u8]| {
        let header =
            format!("{{'descr': '{description}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    };
    let grey = [0.25, 0.25, 0.25, 1.0];
    let f64s: Vec<u8> = [0.25_f64, 0.25]
        .into_iter()
        .flat_map(f64::to_be_bytes)
        .collect();
    for (bytes, expected, linear) in [
        (array(">f8", "(1, 2)", &f64s), [grey, grey], true),
        // A half of 0.25 is 0x3400.
        (
            array("<f2", "(2, 1, 1)", &[0, 0x34, 0, 0x34]),
            [grey, grey],
            true,
        ),
        (
            array("|u1", "(1, 2, 2)", &[255, 51, 0, 255]),
            [[0.2; 4], [0.0, 0.0, 0.0, 1.0]],
            false,
        ),
        (
            array(
                "<u2",
                "(2, 1, 3)",
                &[255, 255, 0, 0, 0, 0, 0, 0, 255, 255, 0, 0],
            ),
            [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]],
            false,
        ),
    ] {
        let file = OneFile::new("a.npy");
        file.write(&bytes);
        let loaded = read_picture(&file.path).expect("can be read");
        assert_eq!(loaded.linear, linear);
        assert_eq!(loaded.picture.pixels, expected);
    }
}
