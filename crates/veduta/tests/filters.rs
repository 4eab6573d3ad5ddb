//! Pixel filters that reach beyond the pixel, against closed forms and against the same kernels over many
//! samples.
//!
//! A metre is a pixel here: scenes are seen from above, in parallel, with the frame's top left corner at
//! x = 0, y = 0 and y downwards, so that world and pixel coordinates differ in the sign of y alone.

use panes::{Pane, scene_of};
use rng::Rng;
use veduta::accumulate::{AovSettings, Picture};
use veduta::dice::PixelGrid;
use veduta::filter::Filter;
use veduta::geometry::{DMat4, DVec2, DVec3, Vec2};
use veduta::map::{Camera, MaterialId, Projection};
use veduta::pipeline::{self, RenderSettings, find_visibility, render_channels};
use veduta::scene::{Image, ImageId, Material, Mesh, MeshId, Object, Scene, TextureRef, generate};

#[path = "support/rng.rs"]
#[allow(dead_code)]
mod rng;

#[path = "support/panes.rs"]
mod panes;

const WIDE: [Filter; 5] = [
    Filter::Triangle,
    Filter::Gaussian,
    Filter::Mitchell,
    Filter::CatmullRom,
    Filter::BSpline,
];

/// The kernels as the literature writes them.
fn kernel(filter: Filter, x: f64) -> f64 {
    let x = x.abs();
    let cubic = |b: f64, c: f64| {
        let sum = if x < 1.0 {
            (12.0 - 9.0 * b - 6.0 * c) * x.powi(3)
                + (-18.0 + 12.0 * b + 6.0 * c) * x.powi(2)
                + (6.0 - 2.0 * b)
        } else if x < 2.0 {
            (-b - 6.0 * c) * x.powi(3)
                + (6.0 * b + 30.0 * c) * x.powi(2)
                + (-12.0 * b - 48.0 * c) * x
                + (8.0 * b + 24.0 * c)
        } else {
            0.0
        };
        sum / 6.0
    };
    match filter {
        Filter::Box => f64::from(u8::from(x < 0.5)),
        Filter::Triangle => (1.0 - x).max(0.0),
        Filter::Gaussian => cubic(0.625, 0.0),
        Filter::Mitchell => cubic(1.0 / 3.0, 1.0 / 3.0),
        Filter::CatmullRom => cubic(0.0, 0.5),
        Filter::BSpline => cubic(1.0, 0.0),
    }
}

impl Pane {
    /// A rectangle in the plane z = 0, in pixels.
    fn rectangle(left: f64, top: f64, right: f64, bottom: f64, color: [f32; 3]) -> Self {
        let corners = [(left, top), (left, bottom), (right, bottom), (right, top)];
        let [r, g, b] = color;
        Self {
            corners: corners.map(|(x, y)| DVec3::new(x, -y, 0.0)).to_vec(),
            color: [r, g, b, 1.0],
        }
    }

    fn random(rng: &mut Rng, size: DVec2, veils: bool) -> Self {
        let corners = (0..3).map(|_| {
            let place = DVec2::new(rng.within(-0.3, 1.3), rng.within(-0.3, 1.3)) * size;
            DVec3::new(place.x, -place.y, rng.within(-5.0, 5.0))
        });
        let corners = corners.collect();
        let mut shade = || rng.unit() as f32;
        let [r, g, b, opacity] = [shade(), shade(), shade(), shade()];
        Self {
            corners,
            color: [r, g, b, if veils { opacity } else { 1.0 }],
        }
    }
}

fn camera(width: u32, height: u32) -> Camera {
    let size = DVec2::new(f64::from(width), f64::from(height));
    let projection = Projection::Parallel {
        height: size.y,
        aspect: size.x / size.y,
    };
    let middle = DVec3::new(0.5 * size.x, -0.5 * size.y, 0.0);
    let eye = middle + 100.0 * DVec3::Z;
    Camera::looking(eye, middle, DVec3::Y, projection, 0.0).expect("a sound camera")
}

/// The picture of a scene on a grid of its frame of `width` x `height` pixels.
fn picture_on(
    scene: &Scene,
    [width, height]: [u32; 2],
    grid: &PixelGrid,
    filter: Filter,
) -> Picture {
    let map = find_visibility(scene, &camera(width, height));
    map.check().expect("a sound map");
    let aovs = AovSettings::default();
    render_channels(scene, &map, grid, true, filter, aovs).0
}

fn picture_of(scene: &Scene, size: [u32; 2], filter: Filter) -> Picture {
    picture_on(scene, size, &PixelGrid::of_frame(size[0], size[1]), filter)
}

/// Blends from the front what lies at a point: premultiplied colour and opacity.
fn seen_at(panes: &[Pane], at: DVec2) -> [f64; 4] {
    let mut met: Vec<(f64, [f32; 4])> = panes
        .iter()
        .filter_map(|pane| {
            let [a, b, c] = [pane.corners[0], pane.corners[1], pane.corners[2]];
            let side =
                |p: DVec3, q: DVec3| (q.x - p.x) * (-at.y - p.y) - (q.y - p.y) * (at.x - p.x);
            let [u, v, w] = [side(b, c), side(c, a), side(a, b)];
            let inside = (u >= 0.0) == (v >= 0.0) && (v >= 0.0) == (w >= 0.0);
            let height = (u * a.z + v * b.z + w * c.z) / (u + v + w);
            inside.then_some((height, pane.color))
        })
        .collect();
    met.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut sum = [0.0; 4];
    let mut left = 1.0;
    for (_, [r, g, b, opacity]) in met {
        let share = left * f64::from(opacity);
        for (sum, channel) in sum.iter_mut().zip([r, g, b, 1.0]) {
            *sum += share * f64::from(channel);
        }
        left -= share;
    }
    sum
}

/// The mean over the frame's samples, `SIDE` along each side of a pixel, by their weights in the kernel.
fn supersampled(
    samples: &[[f64; 4]],
    [width, height]: [usize; 2],
    filter: Filter,
) -> Vec<[f64; 4]> {
    const REACH: usize = 3;
    let weights_of = |pixel: usize, pixels: usize| -> Vec<(usize, f64)> {
        let first = pixel.saturating_sub(REACH) * SIDE;
        let end = (pixel + 1 + REACH).min(pixels) * SIDE;
        let centre = pixel as f64 + 0.5;
        let weights = (first..end).map(|sample| {
            let at = (sample as f64 + 0.5) / SIDE as f64;
            (sample, kernel(filter, at - centre))
        });
        weights.filter(|(_, weight)| *weight != 0.0).collect()
    };
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    pixels
        .map(|(column, row)| {
            let (columns, rows) = (weights_of(column, width), weights_of(row, height));
            let (mut sum, mut total) = ([0.0; 4], 0.0);
            for &(y, of_row) in &rows {
                for &(x, of_column) in &columns {
                    let weight = of_row * of_column;
                    total += weight;
                    for (sum, channel) in sum.iter_mut().zip(samples[y * width * SIDE + x]) {
                        *sum += weight * channel;
                    }
                }
            }
            sum.map(|sum| sum / total)
        })
        .collect()
}

/// Samples along each side of a pixel.
const SIDE: usize = 64;

fn compare_with_samples(veils: bool) {
    let size = [7, 5];
    for seed in 0..8 {
        let mut rng = Rng::new(seed);
        let extent = DVec2::new(f64::from(size[0]), f64::from(size[1]));
        let count = [2, 6, 15, 30][seed as usize % 4];
        let panes: Vec<Pane> = (0..count)
            .map(|_| Pane::random(&mut rng, extent, veils))
            .collect();
        let scene = scene_of(&panes);
        let [width, height] = size.map(|side| side as usize);
        let samples: Vec<[f64; 4]> = (0..width * height * SIDE * SIDE)
            .map(|k| {
                let (x, y) = (k % (width * SIDE), k / (width * SIDE));
                let jitter = DVec2::new(rng.unit(), rng.unit());
                seen_at(
                    &panes,
                    (DVec2::new(x as f64, y as f64) + jitter) / SIDE as f64,
                )
            })
            .collect();
        for filter in WIDE {
            let picture = picture_of(&scene, size, filter);
            let expected = supersampled(&samples, [width, height], filter);
            let mut squares = 0.0;
            for (index, (found, expected)) in picture.pixels.iter().zip(&expected).enumerate() {
                for (found, expected) in found.iter().zip(expected) {
                    let wrong = (f64::from(*found) - expected).abs();
                    squares += wrong * wrong;
                    assert!(
                        wrong < 4e-3,
                        "seed {seed}, {filter:?}, pixel {index}: {found} and not {expected}"
                    );
                }
            }
            let rms = (squares / (4.0 * expected.len() as f64)).sqrt();
            assert!(rms < 8e-4, "seed {seed}, {filter:?}: off by {rms}");
        }
    }
}

#[test]
fn pictures_are_those_of_many_samples_with_the_same_kernel() {
    compare_with_samples(false);
}

#[test]
fn pictures_through_veils_are_those_of_many_samples_with_the_same_kernel() {
    compare_with_samples(true);
}

/// Whether there is no float between two.
fn are_neighbours(a: f32, b: f32) -> bool {
    a == b || a.to_bits().abs_diff(b.to_bits()) == 1
}

#[test]
fn a_plain_scene_stays_plain_up_to_the_border_of_the_frame() {
    let color = [0.7, 0.3, 0.05];
    let size = [13, 9];
    // In many pieces, over the frame's border, and one behind the other.
    let mut rng = Rng::new(5);
    let extent = DVec2::new(13.0, 9.0);
    let mut panes = vec![Pane::rectangle(-2.0, -2.0, 20.0, 20.0, color)];
    for pane in &mut panes {
        pane.corners.iter_mut().for_each(|corner| corner.z = -50.0);
    }
    panes.extend((0..40).map(|_| Pane {
        color: [color[0], color[1], color[2], 1.0],
        ..Pane::random(&mut rng, extent, false)
    }));
    let scene = scene_of(&panes);
    let frame = PixelGrid::of_frame(13, 9);
    let zoomed = PixelGrid {
        width: 30,
        height: 22,
        pixels_per_frame: DVec2::new(30.0, 21.7),
        origin: DVec2::new(0.0, 0.0),
    };
    let single = PixelGrid {
        width: 1,
        height: 1,
        pixels_per_frame: DVec2::new(0.4, 0.3),
        origin: DVec2::ZERO,
    };
    let beyond = frame.window(-3.25, -2.5, 20, 14);
    for filter in WIDE {
        for grid in [frame, zoomed, single, beyond] {
            let picture = picture_on(&scene, size, &grid, filter);
            for (index, pixel) in picture.pixels.iter().enumerate() {
                // What of the pixel the frame contains, which is all that is known.
                let corner = DVec2::new(
                    (index % grid.width as usize) as f64,
                    (index / grid.width as usize) as f64,
                );
                let end = grid.pixels_per_frame - grid.origin;
                let inside = (end.min(corner + 1.0) - corner.max(-grid.origin)).max(DVec2::ZERO);
                let share = inside.x * inside.y;
                for (found, color) in pixel.iter().zip([color[0], color[1], color[2], 1.0]) {
                    let expected = (f64::from(color) * share) as f32;
                    assert!(
                        are_neighbours(*found, expected),
                        "{filter:?}, pixel {index} of {grid:?}: {found} and not {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn an_upright_edge_is_filtered_as_the_closed_form_says() {
    // What lies right of the edge, by the kernel's integral from the edge on.
    let triangle = |d: f64| match d {
        d if d <= -1.0 => 1.0,
        d if d <= 0.0 => 1.0 - 0.5 * (1.0 + d).powi(2),
        d if d <= 1.0 => 0.5 * (1.0 - d).powi(2),
        _ => 0.0,
    };
    // Mitchell's cubic times 18: 21 x³ - 36 x² + 16, and -7 x³ + 36 x² - 60 x + 32.
    let inner = |x: f64| (21.0 / 4.0 * x.powi(4) - 12.0 * x.powi(3) + 16.0 * x) / 18.0;
    let outer =
        |x: f64| (-7.0 / 4.0 * x.powi(4) + 12.0 * x.powi(3) - 30.0 * x.powi(2) + 32.0 * x) / 18.0;
    let mitchell = |d: f64| {
        let x = d.abs().min(2.0);
        let from_centre = if x <= 1.0 {
            inner(x)
        } else {
            inner(1.0) + outer(x) - outer(1.0)
        };
        0.5 - from_centre * d.signum()
    };
    let size = [11, 8];
    let mut lobes = 0;
    for step in 0..=20 {
        let edge = 5.0 + f64::from(step) / 20.0;
        let scene = scene_of(&[Pane::rectangle(edge, -1.0, 30.0, 30.0, [1.0; 3])]);
        for (filter, closed) in [
            (Filter::Triangle, &triangle as &dyn Fn(f64) -> f64),
            (Filter::Mitchell, &mitchell),
        ] {
            let picture = picture_of(&scene, size, filter);
            for row in picture.pixels.chunks_exact(11) {
                for (column, pixel) in row.iter().enumerate().take(9).skip(2) {
                    let expected = closed(edge - (column as f64 + 0.5));
                    for found in pixel {
                        let wrong = (f64::from(*found) - expected).abs();
                        assert!(wrong < 1e-7, "{filter:?}, edge at {edge}, column {column}");
                    }
                    lobes += u32::from(pixel[3] < -1e-3 || pixel[3] > 1.0 + 1e-3);
                }
            }
        }
    }
    assert!(lobes > 100, "what the lobes make is kept");
}

#[test]
fn an_edge_through_the_middle_of_a_pixel_halves_it() {
    let size = [12, 12];
    for angle in 0..12 {
        let along = DVec2::from_angle(f64::from(angle) * 0.53) * 100.0;
        let across = DVec2::new(-along.y, along.x);
        let middle = DVec2::new(6.5, 5.5);
        let corners = [
            middle - along,
            middle + along,
            middle + along + across,
            middle - along + across,
        ];
        let scene = scene_of(&[Pane {
            corners: corners.map(|p| DVec3::new(p.x, -p.y, 0.0)).to_vec(),
            color: [1.0; 4],
        }]);
        for filter in WIDE {
            let picture = picture_of(&scene, size, filter);
            let found = picture.pixels[5 * 12 + 6][3];
            assert!(
                (found - 0.5).abs() < 1e-7,
                "{filter:?}, angle {angle}: {found}"
            );
        }
    }
}

#[test]
fn a_picture_shifted_by_whole_pixels_has_the_same_pixels() {
    let mut rng = Rng::new(9);
    let extent = DVec2::new(8.0, 8.0);
    let panes: Vec<Pane> = (0..9)
        .map(|_| {
            let mut pane = Pane::random(&mut rng, extent, false);
            pane.corners
                .iter_mut()
                .for_each(|p| *p = 0.5 * *p + DVec3::new(6.0, -6.0, 0.0));
            pane
        })
        .collect();
    let mut shifted = panes.clone();
    for corner in shifted.iter_mut().flat_map(|pane| &mut pane.corners) {
        *corner += DVec3::new(3.0, -2.0, 0.0);
    }
    let size = [20, 20];
    for filter in WIDE {
        let [one, other] =
            [&panes, &shifted].map(|panes| picture_of(&scene_of(panes), size, filter));
        for (row, column) in (0..17).flat_map(|row| (0..17).map(move |column| (row, column))) {
            let (a, b) = (
                one.pixels[row * 20 + column],
                other.pixels[(row + 2) * 20 + column + 3],
            );
            for (a, b) in a.iter().zip(b) {
                assert!(
                    (a - b).abs() < 1e-6,
                    "{filter:?} at {column}, {row}: {a} and {b}"
                );
            }
        }
    }
}

#[test]
fn what_a_picture_sums_up_to_is_the_area_of_what_is_seen() {
    for step in 0..7 {
        let at = f64::from(step) * 0.37;
        let corners = [(8.0 + at, 8.1), (8.3 + at, 9.7), (8.9 + at, 8.6)];
        let scene = scene_of(&[Pane {
            corners: corners
                .map(|(x, y): (f64, f64)| DVec3::new(x, -y, 0.0))
                .to_vec(),
            color: [1.0; 4],
        }]);
        let area: f64 = 0.5 * (0.3 * 0.5_f64 - 1.6 * 0.9).abs();
        for filter in WIDE {
            let picture = picture_of(&scene, [20, 18], filter);
            let sum: f64 = picture.pixels.iter().map(|pixel| f64::from(pixel[3])).sum();
            assert!(
                (sum - area).abs() < 1e-6,
                "{filter:?}: {sum} and not {area}"
            );
        }
    }
}

#[test]
fn a_pixel_is_the_same_whatever_the_window() {
    let mut rng = Rng::new(21);
    let size = [16, 12];
    let extent = DVec2::new(16.0, 12.0);
    let panes: Vec<Pane> = (0..30)
        .map(|k| Pane::random(&mut rng, extent, k % 3 == 0))
        .collect();
    let scene = scene_of(&panes);
    let zoomed = PixelGrid {
        width: 60,
        height: 40,
        pixels_per_frame: DVec2::new(59.3, 40.0),
        origin: DVec2::new(0.4, 0.0),
    };
    for filter in WIDE {
        let whole = picture_on(&scene, size, &zoomed, filter);
        for [left, top, width, height] in [
            [20, 13, 17, 19],
            [0, 0, 1, 1],
            [41, 39, 1, 1],
            [55, 3, 5, 37],
        ] {
            let grid = zoomed.window(f64::from(left), f64::from(top), width, height);
            let window = picture_on(&scene, size, &grid, filter);
            for (index, found) in (0..).zip(&window.pixels) {
                let (column, row) = (left + index % width, top + index / width);
                let expected = whole.pixels[(row * 60 + column) as usize];
                for (found, expected) in found.iter().zip(expected) {
                    assert!(
                        (found - expected).abs() < 1e-6,
                        "{filter:?} at {column}, {row}: {found} and not {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn stripes_of_a_texture_keep_the_contrast_that_the_kernel_leaves_them() {
    // Upright waves, 6 pixels long, in a picture with 8 texels a pixel.
    const WAVE: f64 = 6.0;
    let (width, height) = (36_u32, 12_u32);
    let texels = 8 * width;
    let level = |x: f64| 0.5 + 0.4 * (x / WAVE * std::f64::consts::TAU).cos();
    let code = |light: f64| {
        let coded = 1.055 * light.powf(1.0 / 2.4) - 0.055;
        (coded * 255.0).round() as u8
    };
    let row: Vec<[u8; 4]> = (0..texels)
        .map(|k| {
            let value = code(level((f64::from(k) + 0.5) / 8.0));
            [value, value, value, 255]
        })
        .collect();
    let image = Image {
        name: "stripes".into(),
        width: texels,
        height: 8,
        pixels: row.repeat(8),
    };
    let mut mesh = Mesh {
        positions: Vec::new(),
        materials: vec![(0, MaterialId(0))],
        ..Mesh::default()
    };
    for (u, v) in [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)] {
        let place = DVec2::new(u, v) * DVec2::new(f64::from(width), f64::from(height));
        mesh.positions.push(DVec3::new(place.x, -place.y, 0.0));
        mesh.texcoords.push(Vec2::new(u as f32, v as f32));
    }
    mesh.push_polygon(&[0, 1, 2, 3]);
    let scene = Scene {
        objects: vec![Object {
            name: "stripes".into(),
            mesh: MeshId(0),
            world_from_object: DMat4::IDENTITY,
        }],
        meshes: vec![mesh],
        materials: vec![Material {
            base_color: [1.0; 4],
            base_color_texture: Some(TextureRef::new(ImageId(0))),
            ..Material::default()
        }],
        images: vec![image],
        ..Scene::default()
    };
    for filter in WIDE {
        let picture = picture_of(&scene, [width, height], filter);
        // The amplitude of a wave whose length is that of the stripes, away from the borders.
        let columns = 6..30;
        let (mut cos, mut sin) = (0.0, 0.0);
        for column in columns.clone() {
            let x = (column as f64 + 0.5) / WAVE * std::f64::consts::TAU;
            let value = f64::from(picture.pixels[6 * width as usize + column][0]);
            cos += value * x.cos() * 2.0 / columns.len() as f64;
            sin += value * x.sin() * 2.0 / columns.len() as f64;
        }
        let steps = 4000;
        let places = (0..steps).map(|k| (f64::from(k) + 0.5) / f64::from(steps) * 4.0 - 2.0);
        let left: f64 = places
            .map(|x| kernel(filter, x) * (x / WAVE * std::f64::consts::TAU).cos())
            .sum::<f64>()
            * 4.0
            / f64::from(steps);
        let expected = 0.4 * left;
        // The look-up's own footprint takes 2 to 3 per cent, cells of half a pixel 1 per cent.
        assert!(
            cos > 0.95 * expected && cos < 1.01 * expected && sin.abs() < 0.005,
            "{filter:?}: {cos} and not {expected}, {sin} to the side"
        );
    }
}

#[test]
fn channels_beside_the_light_are_those_of_the_box() {
    let made = generate::by_name("pierce").expect("a scene");
    let map = find_visibility(&made.scene, &made.camera);
    let grid = PixelGrid::of_frame(60, 60);
    let aovs = AovSettings {
        depth: true,
        normal: true,
        position: true,
        albedo: true,
        object: true,
        material: true,
        face: true,
        object_ranks: 6,
        material_ranks: 6,
    };
    let of = |filter| render_channels(&made.scene, &map, &grid, false, filter, aovs);
    let (sharp, expected) = of(Filter::Box);
    for filter in WIDE {
        let (picture, channels) = of(filter);
        assert!(channels == expected, "{filter:?}");
        assert!(picture != sharp, "{filter:?} filters the light");
    }
}

#[test]
fn the_number_of_threads_changes_no_byte_of_a_filtered_picture() {
    let made = generate::by_name("balls3").expect("a scene");
    for filter in WIDE {
        let settings = RenderSettings {
            width: 70,
            height: 67,
            filter,
            ..RenderSettings::default()
        };
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a thread pool").install(|| {
                let made = pipeline::render(&made.scene, &made.camera, &settings, |_| {});
                let bits = |pixel: &[f32; 4]| pixel.map(f32::to_bits);
                made.picture.pixels.iter().map(bits).collect::<Vec<_>>()
            })
        };
        assert!(with_threads(1) == with_threads(3), "{filter:?}");
    }
}
