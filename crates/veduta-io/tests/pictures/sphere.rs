//! Pictures of the sphere: one known function of the direction is stored in every layout as its own
//! specification says, and read back; then each pixel must be what is seen where it says it is.

use crate::{OneFile, encoded, sample_picture};
use veduta::accumulate::Picture;
use veduta::geometry::{DVec2, DVec3};
use veduta::reproject::cube::{Layout, Side, Turn};
use veduta::reproject::{Lens, Orientation};
use veduta_io::sphere::{
    Gpano, Panorama, Pose, SideForm, View, one_lens, sides_in_files, sides_in_layout,
};
use veduta_io::{PictureOptions, read_linear_picture, read_picture, write_picture};

/// A direction as a colour that floats hold.
fn color(direction: DVec3) -> [f32; 4] {
    let d = direction.normalize().as_vec3();
    [d.x, d.y, d.z, 1.0]
}

fn picture(width: u32, height: u32, pixel: impl Fn(u32, u32) -> DVec3) -> Picture {
    let pixels = (0..width * height).map(|k| color(pixel(k % width, k / width)));
    Picture {
        width,
        height,
        pixels: pixels.collect(),
    }
}

/// Stored and read again.
fn through_a_file(picture: &Picture, panorama: Option<Panorama>) -> veduta_io::LoadedPicture {
    let file = OneFile::new("picture.exr");
    let options = PictureOptions {
        panorama,
        ..PictureOptions::default()
    };
    write_picture(&file.path, picture, &options).expect("can be written");
    read_picture(&file.path).expect("can be read")
}

/// Every pixel of the views shows what it should.
fn check(views: &[View], file: &Picture, case: &str) {
    for view in views {
        let shown = view.picture(file);
        for (k, pixel) in (0..).zip(&shown.pixels) {
            let at = DVec2::new(f64::from(k % shown.width), f64::from(k / shown.width)) + 0.5;
            let direction = view.projection.direction(at).expect("in the picture");
            let off = DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into()) - direction;
            assert!(
                off.length() < 1e-6,
                "{case}, {} at {at}: {pixel:?}, {direction}",
                view.name
            );
        }
    }
}

/// Right, up and so on in the world: x right, y up, z backward.
fn axis(name: &str) -> DVec3 {
    match name {
        "right" => DVec3::X,
        "left" => -DVec3::X,
        "up" => DVec3::Y,
        "down" => -DVec3::Y,
        "front" => -DVec3::Z,
        "back" => DVec3::Z,
        other => panic!("{other}"),
    }
}

/// A strip, whatever its columns.
const STRIP: &[[&str; 3]] = &[
    ["right", "back", "up"],
    ["left", "front", "up"],
    ["up", "right", "back"],
    ["down", "right", "front"],
    ["front", "right", "up"],
    ["back", "left", "up"],
];

/// Of each layout its columns, and of each cell, row by row, what is in the middle of it, to its right and
/// above. Strips and eac: as FFmpeg's v360 was seen to write them. sv3d: as the specification of Spherical
/// Video V2 says; crosses: folded.
const LAYOUTS: &[(&str, u32, &[[&str; 3]])] = &[
    ("3x2", 3, STRIP),
    ("1x6", 1, STRIP),
    (
        "eac",
        3,
        &[
            ["left", "front", "up"],
            ["front", "right", "up"],
            ["right", "back", "up"],
            ["down", "back", "right"],
            ["back", "up", "right"],
            ["up", "front", "right"],
        ],
    ),
    (
        "sv3d",
        3,
        &[
            ["right", "back", "up"],
            ["left", "front", "up"],
            ["up", "left", "front"],
            ["down", "left", "back"],
            ["front", "right", "up"],
            ["back", "left", "up"],
        ],
    ),
    (
        "vertical-cross",
        3,
        &[
            ["", "", ""],
            ["up", "right", "back"],
            ["", "", ""],
            ["left", "front", "up"],
            ["front", "right", "up"],
            ["right", "back", "up"],
            ["", "", ""],
            ["down", "right", "front"],
            ["", "", ""],
            ["", "", ""],
            ["back", "right", "down"],
            ["", "", ""],
        ],
    ),
];

#[test]
fn every_layout_is_read_as_its_specification_says() {
    const SIDE: u32 = 5;
    for (name, columns, cells) in LAYOUTS {
        let layout: Layout = name.parse().expect(name);
        let is_even_in_angle = *name == "eac";
        let rows = cells.len() as u32 / columns;
        let stored = picture(SIDE * columns, SIDE * rows, |x, y| {
            let [forward, right, up] = cells[(y / SIDE * columns + x / SIDE) as usize];
            if forward.is_empty() {
                return DVec3::X;
            }
            let [s, t] = [x, y].map(|k| (f64::from(k % SIDE) + 0.5) / f64::from(SIDE) * 2.0 - 1.0);
            let [s, t] = [s, t].map(|k| match is_even_in_angle {
                true => (k * std::f64::consts::FRAC_PI_4).tan(),
                false => k,
            });
            axis(forward) + s * axis(right) - t * axis(up)
        });
        let file = through_a_file(&stored, None).picture;
        let size = [file.width, file.height];
        let views = sides_in_layout(&layout, size, &SideForm::default()).expect(name);
        assert_eq!(views.len(), 6);
        check(&views, &file, name);
    }
}

#[test]
fn cubes_and_globes_of_openexr_are_read_as_it_defines_them() {
    // ImfEnvmap: front +z, up +y, and therefore +x to the left.
    let world = |x: f64, y: f64, z: f64| DVec3::new(-x, y, -z);
    const SIDE: u32 = 6;
    let last = f64::from(SIDE - 1);
    let cube = picture(SIDE, 6 * SIDE, |x, y| {
        let (px, py) = (f64::from(x), f64::from(y % SIDE));
        // The inverses of CubeMap::pixelPosition: which pixel shows which place on a side.
        let unit = |k: f64| 2.0 * k / last - 1.0;
        match y / SIDE {
            0 => world(1.0, unit(last - py), unit(px)),
            1 => world(-1.0, unit(last - py), unit(last - px)),
            2 => world(unit(px), 1.0, unit(last - py)),
            3 => world(unit(px), -1.0, unit(py)),
            4 => world(unit(last - px), unit(last - py), 1.0),
            _ => world(unit(px), unit(last - py), -1.0),
        }
    });
    let loaded = through_a_file(&cube, Some(Panorama::ExrCube));
    assert_eq!(loaded.panorama, Some(Panorama::ExrCube));
    let layout: Layout = "exr".parse().expect("a layout");
    let size = [SIDE, 6 * SIDE];
    let views = sides_in_layout(&layout, size, &SideForm::default()).expect("is one");
    check(&views, &loaded.picture, "cube");

    let (width, height) = (12, 7);
    let globe = picture(width, height, |x, y| {
        let pi = std::f64::consts::PI;
        let longitude = pi * (1.0 - 2.0 * f64::from(x) / f64::from(width - 1));
        let latitude = pi * (0.5 - f64::from(y) / f64::from(height - 1));
        let level = latitude.cos();
        world(
            longitude.sin() * level,
            latitude.sin(),
            longitude.cos() * level,
        )
    });
    let orientation = Orientation::from_angles(0.5, 0.2, 0.1);
    let loaded = through_a_file(&globe, Some(Panorama::ExrLatLong { orientation }));
    assert!(matches!(loaded.panorama, Some(Panorama::ExrLatLong { .. })));
    let front = Orientation::default();
    let view = one_lens(
        "globe",
        Lens::Equirect,
        front,
        [width, height],
        loaded.panorama.as_ref(),
    );
    check(&[view], &loaded.picture, "globe");
}

#[test]
fn turned_and_mirrored_files_are_laid_as_they_should() {
    for k in 0..8 {
        let turn = Turn {
            mirrored: k >= 4,
            quarters: k % 4,
        };
        for side in Side::ALL {
            let files = [(side, turn, [4, 4])];
            let views = sides_in_files(&files, &SideForm::default()).expect("is a side");
            let projection = views[0].projection;
            let lying = picture(4, 4, |x, y| {
                let at = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
                projection.direction(at).expect("in the picture")
            });
            check(&views, &turn.of(lying), &format!("{side} {turn:?}"));
        }
    }
}

#[test]
fn photographs_tell_which_part_of_the_sphere_they_show() {
    let told = Gpano {
        full: [400, 200],
        left_top: [100, 50],
        cropped: [74, 42],
        pose: Pose {
            heading: 1.0,
            pitch: 0.3,
            roll: -0.1,
        },
    };
    for suffix in ["png", "jpg"] {
        let options = PictureOptions {
            panorama: Some(Panorama::Gpano(told)),
            ..PictureOptions::default()
        };
        let bytes = encoded(suffix, &sample_picture(), &options);
        let file = OneFile::new(&format!("picture.{suffix}"));
        file.write(&bytes);
        let loaded = read_picture(&file.path).expect("can be read");
        let Some(Panorama::Gpano(read)) = loaded.panorama else {
            panic!("{suffix}: {:?}", loaded.panorama);
        };
        assert_eq!(
            (read.full, read.left_top),
            (told.full, told.left_top),
            "{suffix}"
        );
        assert!((read.pose.pitch - 0.3).abs() < 1e-12);
        // The picture was halved since: 37 x 21 pixels.
        let size = [loaded.picture.width, loaded.picture.height];
        let front = Orientation::default();
        let view = one_lens("p", Lens::Equirect, front, size, loaded.panorama.as_ref());
        let corner = view.projection.lens_from_image(DVec2::ZERO);
        let expected = DVec2::new(-0.5, 0.25);
        assert!((corner - expected).length() < 1e-12, "{suffix}: {corner}");
        let forward = view.projection.axis();
        assert!(
            (forward.y - 0.3_f64.sin()).abs() < 1e-12 && forward.x == 0.0,
            "{forward}"
        );

        // Without it, the bytes are those of before, and nothing is told.
        let plain = encoded(suffix, &sample_picture(), &PictureOptions::default());
        assert!(plain.len() < bytes.len());
        file.write(&plain);
        assert_eq!(
            read_picture(&file.path).expect("can be read").panorama,
            None
        );
    }
}

#[test]
fn damaged_descriptions_are_read_or_told() {
    let options = PictureOptions {
        panorama: Some(Panorama::Gpano(Gpano::whole(37, 21))),
        ..PictureOptions::default()
    };
    let sound = encoded("jpg", &sample_picture(), &options);
    let file = OneFile::new("picture.jpg");
    let start = sound
        .windows(7)
        .position(|bytes| bytes == b"xmpmeta")
        .expect("is there");
    let end = sound.windows(12).position(|bytes| bytes == b"</x:xmpmeta>");
    let end = end.expect("is there");
    let mut warned = 0;
    for at in start..end {
        for byte in [0, b'<', b'"', b'9', 0xff] {
            let mut bytes = sound.clone();
            bytes[at] = byte;
            file.write(&bytes);
            // The picture is sound whatever is said of it.
            let loaded = read_picture(&file.path).expect("can be read");
            warned += usize::from(!loaded.warnings.is_empty());
            for warning in loaded.warnings {
                assert!(
                    warning.len() < 400 && !warning.contains('\n'),
                    "{at}: {warning}"
                );
            }
        }
    }
    assert!(warned > end - start, "{warned} of {}", 5 * (end - start));
}

#[test]
fn numbers_may_be_taken_as_light() {
    let grey = Picture {
        width: 1,
        height: 1,
        pixels: vec![[0.25, 0.25, 0.25, 1.0]],
    };
    let file = OneFile::new("picture.png");
    write_picture(&file.path, &grey, &PictureOptions::default()).expect("can be written");
    let read = read_linear_picture(&file.path).expect("can be read");
    // sRGB of 0.25 is 0.5371, 137 of 255.
    assert_eq!(read.picture.pixels[0][0], 137.0 / 255.0);
    assert!(read.linear);
}

#[test]
fn radiance_holds_light_to_its_own_precision() {
    let mut picture = sample_picture();
    picture.pixels[3] = [1e6, 2e6, 3e5, 1.0];
    picture.pixels[4] = [-1.0, f32::NAN, 0.5, 1.0];
    let file = OneFile::new("picture.hdr");
    write_picture(&file.path, &picture, &PictureOptions::default()).expect("can be written");
    let loaded = read_picture(&file.path).expect("can be read");
    assert!(loaded.linear);
    for (read, pixel) in loaded.picture.pixels.iter().zip(&picture.pixels) {
        let expected = pixel.map(|v| if v > 0.0 { v } else { 0.0 });
        let most = expected[..3].iter().fold(0.0_f32, |a, &b| a.max(b));
        for k in 0..3 {
            // Eight bits of the largest channel.
            assert!(
                (read[k] - expected[k]).abs() <= most / 128.0,
                "{read:?} {expected:?}"
            );
        }
        assert_eq!(read[3], 1.0);
    }
}
