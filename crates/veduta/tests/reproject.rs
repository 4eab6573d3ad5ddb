//! Reprojection against brute force: known functions on the sphere, sampled many times a pixel with the same kernel.

use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use veduta::accumulate::Picture;
use veduta::filter::ewa::{Ewa, Profile};
use veduta::geometry::{DMat3, DVec2, DVec3};
use veduta::reproject::{Lens, Orientation, Projection, Reprojection, reproject};

/// Three channels at a direction, 0 to 1.
type Pattern = dyn Fn(DVec3) -> [f64; 3] + Sync;

/// The faces of a cube, front, right, back, left, up and down, in the dome's world turned by `turn`.
fn cube(size: u32, turn: &Orientation) -> Vec<Projection> {
    let angles = [
        (0.0, 0.0),
        (FRAC_PI_2, 0.0),
        (PI, 0.0),
        (-FRAC_PI_2, 0.0),
        (0.0, FRAC_PI_2),
        (0.0, -FRAC_PI_2),
    ];
    let face = |(yaw, elevation)| {
        let of_face = Orientation::from_angles(yaw, elevation, 0.0).within(turn);
        Projection::new(Lens::Perspective { fov: FRAC_PI_2 }, of_face, size, size)
    };
    angles.map(face).to_vec()
}

/// A picture of the pattern whose pixels are means over their area, of `samples` x `samples` points each.
fn rendered(projection: &Projection, pattern: &Pattern, samples: u32) -> Picture {
    let (width, height) = (projection.width, projection.height);
    let pixel = |index: usize| {
        let corner = DVec2::new((index as u32 % width).into(), (index as u32 / width).into());
        let mut sum = [0.0; 3];
        for k in 0..samples * samples {
            let part = DVec2::new((k % samples).into(), (k / samples).into()) + 0.5;
            let at = corner + part / f64::from(samples);
            let Some(direction) = projection.direction(at) else {
                continue;
            };
            for (sum, value) in sum.iter_mut().zip(pattern(direction)) {
                *sum += value / f64::from(samples * samples);
            }
        }
        let [r, g, b] = sum.map(|x| x as f32);
        [r, g, b, 1.0]
    };
    let count = width as usize * height as usize;
    Picture {
        width,
        height,
        pixels: (0..count).into_par_iter().map(pixel).collect(),
    }
}

/// The pattern through the paper's kernel, exp(-2 r^2) within a radius of one pixel, at one pixel.
fn truth(projection: &Projection, pattern: &Pattern, column: u32, row: u32) -> Option<[f64; 3]> {
    const SAMPLES: i32 = 8;
    let centre = DVec2::new(column.into(), row.into()) + 0.5;
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for j in -SAMPLES..SAMPLES {
        for i in -SAMPLES..SAMPLES {
            let away = (DVec2::new(i.into(), j.into()) + 0.5) / f64::from(SAMPLES);
            let r2 = away.length_squared();
            if r2 < 1.0 {
                let weight = (-2.0 * r2).exp();
                for (sum, value) in sum
                    .iter_mut()
                    .zip(pattern(projection.direction(centre + away)?))
                {
                    *sum += weight * value;
                }
                weights += weight;
            }
        }
    }
    Some(sum.map(|sum| sum / weights))
}

/// Rings around a direction whose frequency grows to `frequency` cycles a radian at 90 degrees.
fn rings(direction: DVec3, centre: DVec3, frequency: f64) -> f64 {
    let phase = 2.0 * PI * frequency * (1.0 - direction.dot(centre.normalize()));
    0.5 + 0.5 * phase.cos()
}

/// Zone plates around a corner, an edge and another point of the cube.
fn zone_plates(frequency: f64) -> impl Fn(DVec3) -> [f64; 3] + Sync {
    move |direction| {
        let corner = DVec3::new(1.0, 1.0, -1.0);
        let edge = DVec3::new(1.0, 0.0, -1.0);
        let other = DVec3::new(-0.3, 0.5, -0.8);
        [corner, edge, other].map(|centre| rings(direction, centre, frequency))
    }
}

/// Waves of some 60 degrees, which any picture carries.
fn smooth(direction: DVec3) -> [f64; 3] {
    [direction.x, direction.y, direction.z].map(|x| 0.5 + 0.35 * (3.0 * x + 0.4).sin())
}

fn domed(lens: &str, width: u32) -> Projection {
    let lens: Lens = lens.parse().expect("a lens");
    let height = ((f64::from(width) / lens.aspect()).round() as u32).max(1);
    Projection::new(lens, Orientation::from_angles(0.4, 0.3, 0.1), width, height)
}

fn views(sources: &[Projection], pattern: &Pattern, samples: u32) -> Vec<(Projection, Picture)> {
    let picture = |source: &Projection| (*source, rendered(source, pattern, samples));
    sources.iter().map(picture).collect()
}

/// Of pixels that are wholly covered: the errors against the truth, x 255.
struct Errors {
    places: Vec<(u32, u32)>,
    errors: Vec<[f64; 3]>,
}

impl Errors {
    fn of(picture: &Picture, projection: &Projection, pattern: &Pattern) -> Self {
        let all: Vec<(u32, u32)> = (0..picture.height)
            .flat_map(|row| (0..picture.width).map(move |column| (column, row)))
            .filter(|&(column, row)| {
                // The kernel reaches a pixel from the centre.
                let corner = DVec2::new(column.into(), row.into());
                let reach = [(-0.5, -0.5), (1.5, -0.5), (-0.5, 1.5), (1.5, 1.5)];
                let lens = projection.lens;
                let shown =
                    |at: DVec2| !lens.is_round() || lens.covers(projection.lens_from_image(at));
                reach
                    .into_iter()
                    .all(|(x, y)| shown(corner + DVec2::new(x, y)))
            })
            .collect();
        let error = |&(column, row): &(u32, u32)| {
            let exact = truth(projection, pattern, column, row).expect("covered");
            let found = picture.pixels[(row * picture.width + column) as usize];
            assert_eq!(found[3], 1.0, "opaque at {column}, {row}");
            std::array::from_fn(|k| 255.0 * (f64::from(found[k]) - exact[k]))
        };
        Self {
            errors: all.par_iter().map(error).collect(),
            places: all,
        }
    }

    fn rms_where(&self, chosen: impl Fn(u32, u32) -> bool) -> f64 {
        let chosen = self
            .places
            .iter()
            .zip(&self.errors)
            .filter(|((x, y), _)| chosen(*x, *y));
        let squares: Vec<f64> = chosen.flat_map(|(_, e)| e.map(|e| e * e)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    fn rms(&self) -> f64 {
        self.rms_where(|_, _| true)
    }

    fn bias(&self) -> f64 {
        let all: Vec<f64> = self.errors.iter().flatten().copied().collect();
        all.iter().sum::<f64>() / all.len() as f64
    }
}

#[test]
fn reduced_zone_plates_are_those_of_brute_force_along_seams_too() {
    let turn = Orientation::from_angles(0.0, 0.0, 0.0);
    let width = 160;
    // Three times what the pixels can carry, and less than the faces carry.
    let pattern = zone_plates(2.5 * f64::from(width) / (2.0 * PI));
    let views = views(&cube(2 * width, &turn), &pattern, 5);
    let ewa = Ewa {
        profile: Profile::Gaussian,
        ..Ewa::default()
    };
    for lens in ["fisheye:180", "stereographic:180", "omnimax"] {
        let target = domed(lens, width);
        let (picture, _) = reproject(&views, &target, &ewa);
        let errors = Errors::of(&picture, &target, &pattern);
        let near_seam = |column: u32, row: u32| {
            let at = DVec2::new(column.into(), row.into()) + 0.5;
            let place = |away: DVec2| {
                let d = target.direction(at + away).expect("covered").abs();
                (0..3).fold(0, |best, k| if d[k] > d[best] { k } else { best })
            };
            let own = place(DVec2::ZERO);
            [(-1.5, 0.0), (1.5, 0.0), (0.0, -1.5), (0.0, 1.5)]
                .into_iter()
                .any(|(x, y)| place(DVec2::new(x, y)) != own)
        };
        let (seams, interior) = (
            errors.rms_where(near_seam),
            errors.rms_where(|x, y| !near_seam(x, y)),
        );
        println!(
            "{lens}: rms {:.3}, bias {:.4}, seams {seams:.3}, interior {interior:.3}",
            errors.rms(),
            errors.bias()
        );
        assert!(errors.rms() <= 1.2, "{lens}: {}", errors.rms());
        assert!(errors.bias().abs() <= 0.15, "{lens}: {}", errors.bias());
        assert!(seams <= interior, "{lens}: {seams} and {interior}");
    }
}

#[test]
fn poles_and_rims_are_filtered_in_parts() {
    let pattern = zone_plates(10.0);
    let views = views(&cube(256, &Orientation::default()), &pattern, 3);
    let ewa = Ewa {
        profile: Profile::Gaussian,
        ..Ewa::default()
    };
    for lens in ["equirect", "ball", "equisolid:360"] {
        let target = domed(lens, 128);
        let (picture, _) = reproject(&views, &target, &ewa);
        let errors = Errors::of(&picture, &target, &pattern);
        let pole = errors.rms_where(|_, row| row < 2 || row + 3 > target.height);
        let rim = errors.rms_where(|column, row| {
            let at = DVec2::new(column.into(), row.into()) + 0.5;
            let point = target.lens_from_image(at);
            target.lens.is_round() && point.length() > 1.0 - 3.0 / target.pixels_per_unit()
        });
        println!(
            "{lens}: rms {:.3}, first and last rows {pole:.3}, rim {rim:.3}",
            errors.rms()
        );
        assert!(errors.rms() <= 1.2, "{lens}: {}", errors.rms());
        assert!(pole <= 1.2, "{lens}: {pole}");
        assert!(!target.lens.is_round() || rim <= 1.2, "{lens}: {rim}");
    }
}

#[test]
fn smooth_fields_lie_where_they_are() {
    let turn = Orientation::from_angles(0.2, 0.1, 0.0);
    let width = 96;
    let views = views(&cube(320, &turn), &smooth, 2);
    for lens in [
        "fisheye:180",
        "equirect",
        "mercator:70",
        "cylinder",
        "face",
        "stereographic:200",
        "ball",
    ] {
        let target = domed(lens, width);
        let (picture, _) = reproject(&views, &target, &Ewa::default());
        // Least squares of a shift of the picture, and of a difference in softness, from slopes of the truth.
        let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
        for row in 2..target.height - 2 {
            for column in 2..target.width - 2 {
                let at = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)];
                let value = |(x, y): (i32, i32)| {
                    let (x, y) = (column.wrapping_add_signed(x), row.wrapping_add_signed(y));
                    // Where pixels are long and narrow, softness has a direction.
                    let at = DVec2::new(x.into(), y.into()) + 0.5;
                    let [a, b] = target.ray(at)?.derivatives.map(|step| step.length());
                    let shown = target.covers(at) && a < 1.25 * b && b < 1.25 * a;
                    shown.then(|| truth(&target, &smooth, x, y)).flatten()
                };
                let [Some(here), Some(east), Some(west), Some(south), Some(north)] = at.map(value)
                else {
                    continue;
                };
                for k in 0..3 {
                    let curve = east[k] + west[k] + south[k] + north[k] - 4.0 * here[k];
                    let slope = [
                        0.5 * (east[k] - west[k]),
                        0.5 * (south[k] - north[k]),
                        curve,
                    ];
                    let off =
                        f64::from(picture.pixels[(row * width + column) as usize][k]) - here[k];
                    for i in 0..3 {
                        b[i] += slope[i] * off;
                        for j in 0..3 {
                            a[i][j] += slope[i] * slope[j];
                        }
                    }
                }
            }
        }
        let matrix = DMat3::from_cols_array_2d(&a);
        let fit = matrix.inverse() * DVec3::from(b);
        println!("{lens}: shifted by {fit}");
        assert!(
            fit.x.abs() <= 0.001 && fit.y.abs() <= 0.001,
            "{lens}: {fit}"
        );
    }
}

#[test]
fn a_constant_world_is_constant_in_every_picture() {
    let colour = [0.7_f32, 1.0 / 3.0, 0.123_456, 1.0];
    let constant = |projection: &Projection| {
        let count = projection.width as usize * projection.height as usize;
        let (width, height) = (projection.width, projection.height);
        (
            *projection,
            Picture {
                width,
                height,
                pixels: vec![colour; count],
            },
        )
    };
    let turn = Orientation::from_angles(0.3, 0.2, 0.1);
    let panorama = Projection::new(Lens::Equirect, turn, 64, 32);
    let mut worst = 0;
    for (name, sources) in [
        ("cube", cube(33, &turn)),
        ("cube of one texel", cube(1, &turn)),
        ("cube of two texels", cube(2, &turn)),
        ("large cube", cube(200, &turn)),
        ("panorama", vec![panorama]),
    ] {
        let views: Vec<_> = sources.iter().map(constant).collect();
        for lens in [
            "omnimax",
            "domemaster",
            "fisheye:360",
            "equisolid:300",
            "equisolid:360",
            "orthographic",
            "equirect",
            "cylinder",
            "mercator",
            "stereographic:320",
            "ball",
            "perspective:150",
            "equiangular",
        ] {
            for width in [1, 2, 3, 7, 64] {
                let target = domed(lens, width);
                let (picture, missing) = reproject(&views, &target, &Ewa::default());
                assert_eq!(missing.share, 0.0, "{lens} of {name}");
                for (index, pixel) in picture.pixels.iter().enumerate() {
                    let (column, row) = (index as u32 % width, index as u32 / width);
                    let share = target.coverage(column, row) as f32;
                    assert!(
                        pixel[3] == share,
                        "{lens} {width} of {name}, {column} {row}: {pixel:?}"
                    );
                    for (found, expected) in pixel.iter().zip(colour) {
                        let off = found.to_bits().abs_diff((expected * share).to_bits());
                        worst = worst.max(off);
                        assert!(
                            off <= 1,
                            "{lens} {width} of {name}, {column} {row}: {found} is off by {off}"
                        );
                    }
                }
            }
        }
    }
    println!("off by {worst} units in the last place");
}

#[test]
fn two_levels_of_a_pyramid_are_near_one_large_ellipse() {
    let turn = Orientation::default();
    let (faces, width) = (1024, 64);
    // As fine as the faces carry with ease: far above what the picture can.
    let pattern = zone_plates(160.0);
    let views = views(&cube(faces, &turn), &pattern, 1);
    let target = domed("fisheye:180", width);
    let with = Ewa::default();
    let without = Ewa {
        pyramid: None,
        ..with
    };
    let [two, one] = [with, without].map(|ewa| reproject(&views, &target, &ewa).0);
    let errors =
        two.pixels.iter().zip(&one.pixels).flat_map(|(a, b)| {
            std::array::from_fn::<f64, 3, _>(|k| 255.0 * f64::from(a[k] - b[k]))
        });
    let errors: Vec<f64> = errors.collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let most = errors.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
    println!("pyramid: rms {rms}, most {most}");
    assert!(most <= 5.0, "{most}");
    assert!(rms <= 0.3, "{rms}");
}

#[test]
fn what_no_view_shows_is_transparent_and_told() {
    let sources = cube(64, &Orientation::default());
    let target = Projection::new(Lens::Equirect, Orientation::default(), 128, 64);
    let paper = [0, 1, 3, 4].map(|k| sources[k]);
    let reprojection = Reprojection::new(&paper, &target, &Ewa::default());
    let missing = reprojection.missing();
    let names: Vec<&str> = missing.toward.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["down", "back"]);
    let mut views = reprojection.views();
    for (index, source) in paper.iter().enumerate() {
        views.set(index, &rendered(source, &smooth, 1));
    }
    views.complete();
    let picture = reprojection.picture(&views);
    assert_eq!(picture.pixels[63 * 128 + 64], [0.0; 4]);
    let clear = picture
        .pixels
        .iter()
        .filter(|pixel| pixel[3] == 0.0)
        .count();
    let clear = clear as f64 / 8192.0;
    assert!(
        (clear - missing.share).abs() < 1e-9,
        "{clear} and {missing:?}"
    );

    // Of what the down side would show, all is clear: nothing is taken from the borders of the others.
    let down = |column: u32, row: u32| {
        let at = DVec2::new(column.into(), row.into()) + 0.5;
        let direction = target.direction(at).expect("a panorama");
        direction.y < -direction.x.abs().max(direction.z.abs())
    };
    for (index, pixel) in picture.pixels.iter().enumerate() {
        let (column, row) = (index as u32 % 128, index as u32 / 128);
        assert!(!down(column, row) || pixel[3] == 0.0, "{column} {row}");
    }

    // Sides that were told to see a little less than they do: no line of clear pixels between them.
    let narrow: Lens = "perspective:89.9".parse().expect("a lens");
    let sides = sources.clone().into_iter();
    let sides = sides.map(|side| Projection::new(narrow, side.orientation, 256, 256));
    let sides: Vec<Projection> = sides.collect();
    let reprojection = Reprojection::new(&sides, &target, &Ewa::default());
    assert_eq!(reprojection.missing().share, 0.0);

    // The paper's four faces are enough for its own picture, with the cube along the projection's axis.
    let omnimax = Projection::new(Lens::OMNIMAX, Orientation::default(), 196, 153);
    let reprojection = Reprojection::new(&paper, &omnimax, &Ewa::default());
    assert_eq!(reprojection.missing().share, 0.0);
    // And of those at the sides, half.
    let right = reprojection.needs()[1].window.expect("seen");
    assert!(right[0] == 0 && right[2] < 40, "{right:?}");
}

#[test]
fn views_of_other_kinds_give_the_same_picture() {
    let target = domed("fisheye:180", 96);
    let turn = Orientation::from_angles(1.0, 0.2, 0.3);
    let back = Orientation::from_angles(PI, 0.0, 0.0).within(&turn);
    let fisheye: Lens = "fisheye:200".parse().expect("a lens");
    let [front, behind] = [turn, back].map(|o| Projection::new(fisheye, o, 256, 256));
    let panorama = Projection::new(Lens::Equirect, turn, 512, 256);
    let wide: Lens = "perspective:110".parse().expect("a lens");
    let wide = cube(200, &turn)
        .into_iter()
        .map(|face| Projection::new(wide, face.orientation, 300, 300));
    for (name, sources) in [
        ("two fisheyes", vec![front, behind]),
        ("panorama", vec![panorama]),
        ("wide faces", wide.collect()),
    ] {
        let views = views(&sources, &smooth, 2);
        let (picture, missing) = reproject(&views, &target, &Ewa::default());
        assert_eq!(missing.share, 0.0, "{name}");
        let errors = Errors::of(&picture, &target, &smooth);
        println!("{name}: rms {}", errors.rms());
        assert!(errors.rms() < 0.1, "{name}: {}", errors.rms());
    }
}

#[test]
fn bytes_do_not_depend_on_threads_and_a_sequence_is_its_frames() {
    let sources = cube(100, &Orientation::default());
    let target = domed("stereographic:250", 130);
    let pattern = zone_plates(30.0);
    let first = views(&sources, &smooth, 1);
    let second = views(&sources, &pattern, 1);
    let alone = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| reproject(&second, &target, &Ewa::default()).0)
    };
    let [one, two] = [1, 2].map(alone);
    assert!(one == two);
    let reprojection = Reprojection::new(&sources, &target, &Ewa::default());
    let mut planes = reprojection.views();
    for frame in [&first, &second] {
        for (index, (_, picture)) in frame.iter().enumerate() {
            planes.set(index, picture);
        }
        planes.complete();
    }
    assert!(reprojection.picture(&planes) == one);
}
