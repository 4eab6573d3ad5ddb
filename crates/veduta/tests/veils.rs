//! Veils, faces that are not fully opaque: what a picture shows through them.

use panes::{Pane, scene_of};
use rng::Rng;
use veduta::accumulate::{AovSettings, Picture};
use veduta::composite::composite;
use veduta::dice::PixelGrid;
use veduta::filter::Filter;
use veduta::geometry::{DVec2, DVec3, Vec2};
use veduta::map::{Camera, Projection, SeenScene};
use veduta::pipeline::{self, RenderSettings};
use veduta::scene::{AlphaMode, Image, ImageId, Material, Scene, TextureRef};

#[path = "support/rng.rs"]
#[allow(dead_code)]
mod rng;

#[path = "support/panes.rs"]
mod panes;

const WIDTH: u32 = 12;
const HEIGHT: u32 = 9;

/// Looks along +Y at the origin from 4 m before it; the frame is 3 m high there.
fn camera() -> Camera {
    let projection = Projection::Perspective {
        tan_half_height: 0.375,
        aspect: f64::from(WIDTH) / f64::from(HEIGHT),
    };
    let eye = DVec3::new(0.0, -4.0, 0.0);
    Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.1).expect("a sound camera")
}

fn random_panes(rng: &mut Rng, count: u32) -> Vec<Pane> {
    (0..count)
        .map(|_| {
            // Half of the panes stand upright to the line of sight, so that they have an order.
            let flat = rng.chance(0.5);
            let depth = rng.within(-1.0, 1.0);
            let corners = (0..3).map(|_| {
                let y = if flat { depth } else { rng.within(-1.5, 1.5) };
                DVec3::new(rng.within(-3.0, 3.0), y, rng.within(-2.0, 2.0))
            });
            let corners: Vec<DVec3> = corners.collect();
            let mut shade = || rng.unit() as f32;
            let color = [shade(), shade(), shade()];
            let opacity = if rng.chance(0.3) {
                1.0
            } else {
                rng.unit() as f32
            };
            Pane {
                corners,
                color: [color[0], color[1], color[2], opacity],
            }
        })
        .collect()
}

fn picture_of(scene: &Scene, width: u32, height: u32) -> Picture {
    let settings = RenderSettings {
        width,
        height,
        unlit: true,
        ..RenderSettings::default()
    };
    let rendered = pipeline::render(scene, &camera(), &settings, |_| {});
    assert_eq!(rendered.shortcomings, []);
    rendered.picture
}

/// What a ray meets, blended from the front: premultiplied colour and opacity.
fn along_ray(panes: &[Pane], image: DVec2) -> [f64; 4] {
    let camera = camera();
    let world_from_eye = camera.eye_from_world.inverse();
    let (origin, direction) = camera.eye_ray(image);
    let origin = world_from_eye.transform_point3(origin);
    let direction = world_from_eye.transform_vector3(direction);
    let mut met: Vec<(f64, [f32; 4])> = panes
        .iter()
        .filter_map(|pane| {
            let [a, b, c] = [pane.corners[0], pane.corners[1], pane.corners[2]];
            let normal = (b - a).cross(c - a);
            let distance = (a - origin).dot(normal) / direction.dot(normal);
            let hit = origin + distance * direction;
            let corners = &pane.corners;
            let inside = (0..corners.len()).all(|k| {
                let (p, q) = (corners[k], corners[(k + 1) % corners.len()]);
                (q - p).cross(hit - p).dot(normal) >= 0.0
            });
            (distance > 0.1 && inside).then_some((distance, pane.color))
        })
        .collect();
    met.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sum = [0.0; 4];
    let mut left = 1.0;
    for (_, [r, g, b, opacity]) in met {
        let share = left * f64::from(opacity);
        for (sum, channel) in sum.iter_mut().zip([r, g, b, 1.0]) {
            *sum += share * f64::from(channel);
        }
        left *= 1.0 - f64::from(opacity);
    }
    sum
}

#[test]
fn a_picture_through_veils_is_what_rays_see() {
    const SIDE: u32 = 48;
    let mut worst: f64 = 0.0;
    for seed in 0..24 {
        let mut rng = Rng::new(seed);
        // Few panes with few edges in a pixel, and many that lie across one another.
        let count = [2, 5, 12, 40][seed as usize % 4];
        let panes = random_panes(&mut rng, count);
        let picture = picture_of(&scene_of(&panes), WIDTH, HEIGHT);
        let size = DVec2::new(f64::from(WIDTH), f64::from(HEIGHT));
        for (index, found) in (0..).zip(&picture.pixels) {
            let corner = DVec2::new(f64::from(index % WIDTH), f64::from(index / WIDTH));
            let mut mean = [0.0; 4];
            for sample in 0..SIDE * SIDE {
                let square = DVec2::new(f64::from(sample % SIDE), f64::from(sample / SIDE));
                let jitter = DVec2::new(rng.unit(), rng.unit());
                let at = corner + (square + jitter) / f64::from(SIDE);
                for (mean, channel) in mean.iter_mut().zip(along_ray(&panes, at / size)) {
                    *mean += channel / f64::from(SIDE * SIDE);
                }
            }
            for (found, mean) in found.iter().zip(mean) {
                let error = (f64::from(*found) - mean).abs();
                worst = worst.max(error);
                // Each edge wrongs up to 2 SIDE samples by at random half of what it changes: with 40
                // panes about 100 edges and crossings, so four standard deviations are below 0.01.
                assert!(
                    error < 0.012,
                    "{found} and not {mean} in pixel {index} of scene {seed}"
                );
            }
        }
    }
    assert!(worst > 1e-5, "samples are not exact: {worst}");
}

#[test]
fn two_panes_that_cross_in_a_pixel_are_blended_by_its_halves() {
    // Seen from above at x: the first pane is nearer at the left, the second at the right.
    let pane = |slope: f64, color: [f32; 4]| {
        let corner = |x: f64, z: f64| DVec3::new(x, slope * x, z);
        let corners = vec![
            corner(-3.0, -3.0),
            corner(3.0, -3.0),
            corner(3.0, 3.0),
            corner(-3.0, 3.0),
        ];
        Pane { corners, color }
    };
    let panes = [
        pane(0.3, [1.0, 0.0, 0.0, 0.5]),
        pane(-0.3, [0.0, 1.0, 0.0, 0.25]),
    ];
    // One pixel whose middle column is where they cross.
    let picture = picture_of(&scene_of(&panes), 1, 1);
    let [red, green, blue, opacity] = picture.pixels[0];
    // Left: 0.5 red, then 0.5 * 0.25 green; right: 0.25 green, then 0.75 * 0.5 red.
    let expected = [0.5 * (0.5 + 0.375), 0.5 * (0.125 + 0.25), 0.0, 0.625];
    for (found, expected) in [red, green, blue, opacity].iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-6,
            "{found} and not {expected}"
        );
    }
}

#[test]
fn what_is_white_before_white_is_white_through_any_veils() {
    for seed in 100..130 {
        let mut rng = Rng::new(seed);
        let mut panes = random_panes(&mut rng, 3 + seed as u32 % 30);
        for pane in &mut panes {
            pane.color = [1.0, 1.0, 1.0, pane.color[3]];
        }
        let pixels = |panes: &[Pane]| picture_of(&scene_of(panes), WIDTH, HEIGHT).pixels;
        for [r, g, b, opacity] in pixels(&panes) {
            assert!((0.0..=1.0 + 1e-6).contains(&opacity));
            assert!(
                [r, g, b].iter().all(|c| (c - opacity).abs() < 1e-6),
                "scene {seed}"
            );
        }
        let [x, y, z] = [40.0, 5.0, 40.0];
        let corners = [(-x, -z), (x, -z), (x, z), (-x, z)].map(|(x, z)| DVec3::new(x, y, z));
        panes.push(Pane {
            corners: corners.to_vec(),
            color: [1.0; 4],
        });
        for pixel in pixels(&panes) {
            assert!(
                pixel.iter().all(|c| (c - 1.0).abs() < 1e-6),
                "{pixel:?} in scene {seed}"
            );
        }
    }
}

#[test]
fn composited_veils_look_as_if_rendered_together() {
    for seed in 200..220 {
        let mut rng = Rng::new(seed);
        let panes = random_panes(&mut rng, 4 + seed as u32 % 20);
        let whole = scene_of(&panes);
        let expected = picture_of(&whole, WIDTH, HEIGHT);
        let map_of = |kept: &dyn Fn(usize) -> bool| {
            let mut scene = whole.clone();
            let objects = scene.objects.into_iter().enumerate();
            scene.objects = objects.filter(|(k, _)| kept(*k)).map(|(_, o)| o).collect();
            let map = pipeline::find_visibility(&scene, &camera());
            SeenScene::of(&scene, &map, [WIDTH, HEIGHT])
        };
        let maps: Vec<SeenScene> = (0..3).map(|k| map_of(&|index| index % 3 == k)).collect();
        let seen = composite(&maps).expect("maps of one camera");
        let grid = PixelGrid::of_frame(WIDTH, HEIGHT);
        let found = pipeline::render_window(&seen.scene, &seen.map, &grid, true);
        for (found, expected) in found.pixels.iter().zip(&expected.pixels) {
            for (a, b) in found.iter().zip(expected) {
                assert!(
                    (a - b).abs() < 1e-5,
                    "{found:?} and not {expected:?} in scene {seed}"
                );
            }
        }
    }
}

#[test]
fn mattes_share_out_what_is_seen_through_veils() {
    let settings = AovSettings {
        object_ranks: 40,
        ..AovSettings::default()
    };
    for seed in 300..310 {
        let panes = random_panes(&mut Rng::new(seed), 12);
        let scene = scene_of(&panes);
        let map = pipeline::find_visibility(&scene, &camera());
        let grid = PixelGrid::of_frame(WIDTH, HEIGHT);
        let (picture, aovs) =
            pipeline::render_channels(&scene, &map, &grid, true, Filter::Box, settings);
        let matte = aovs.object_matte.expect("asked for");
        for (pixel, ranks) in picture.pixels.iter().zip(matte.rows.chunks(matte.ranks)) {
            let sum: f32 = ranks.iter().map(|rank| rank.area).sum();
            assert!((sum - pixel[3]).abs() < 1e-5, "{sum} of {}", pixel[3]);
            // Each object's share of the red is its colour times its rank.
            let ranks = ranks.iter().filter(|rank| rank.area > 0.0);
            let red: f32 = ranks
                .map(|rank| rank.area * panes[rank.thing as usize].color[0])
                .sum();
            assert!((red - pixel[0]).abs() < 1e-5);
        }
    }
}

#[test]
fn deep_samples_of_veils_come_to_the_flat_picture() {
    for seed in 400..410 {
        let scene = scene_of(&random_panes(&mut Rng::new(seed), 10));
        let settings = RenderSettings {
            width: WIDTH,
            height: HEIGHT,
            unlit: true,
            ..RenderSettings::default()
        };
        let expected = picture_of(&scene, WIDTH, HEIGHT);
        let mut pixels = expected.pixels.iter();
        pipeline::render_deep(
            &scene,
            &camera(),
            &settings,
            |_| {},
            |rows| {
                let mut samples = rows.samples.iter();
                for &count in &rows.counts {
                    let mut flat = [0.0_f32; 4];
                    for sample in samples.by_ref().take(count as usize) {
                        let [r, g, b] = sample.color;
                        let left = 1.0 - flat[3];
                        for (sum, channel) in flat.iter_mut().zip([r, g, b, sample.opacity]) {
                            *sum += left * channel;
                        }
                    }
                    let expected = pixels.next().expect("as many pixels");
                    for (a, b) in flat.iter().zip(expected) {
                        assert!((a - b).abs() < 1e-5, "{flat:?} and not {expected:?}");
                    }
                }
                Ok::<(), ()>(())
            },
        )
        .expect("nothing fails");
        assert!(pixels.next().is_none());
    }
}

#[test]
fn a_window_of_a_zoom_through_veils_is_the_same_as_a_render_of_that_size() {
    let scene = scene_of(&random_panes(&mut Rng::new(7), 12));
    let map = pipeline::find_visibility(&scene, &camera());
    let large = pipeline::render_window(&scene, &map, &PixelGrid::of_frame(60, 27), true);
    let window = PixelGrid::of_frame(60, 27).window(17.0, 5.0, 21, 11);
    let found = pipeline::render_window(&scene, &map, &window, true);
    for (index, found) in found.pixels.iter().enumerate() {
        let expected = &large.pixels[(5 + index / 21) * 60 + 17 + index % 21];
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-5, "{found:?} and not {expected:?}");
        }
    }
}

/// A square card, 3 m wide, with a picture of a disc that has `radius` (of the card's half width) and
/// opacity falling from 1 to 0 within two texels around it.
fn card(alpha_mode: AlphaMode, radius: f64, texels: u32) -> Scene {
    let opacity = |i: u32, j: u32| {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(texels) * 2.0 - 1.0;
        let inside = (radius - at(i).hypot(at(j))) * f64::from(texels) / 4.0;
        ((inside + 0.5).clamp(0.0, 1.0) * 255.0).round() as u8
    };
    let corners = [(-1.5, 1.5), (1.5, 1.5), (1.5, -1.5), (-1.5, -1.5)];
    let uv = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let mut scene = scene_of(&[Pane {
        corners: corners.map(|(x, z)| DVec3::new(x, 0.0, z)).to_vec(),
        color: [1.0; 4],
    }]);
    scene.meshes[0].texcoords = uv.to_vec();
    scene.materials[0] = Material {
        base_color_texture: Some(TextureRef::new(ImageId(0))),
        alpha_mode,
        ..scene.materials[0].clone()
    };
    // Green where it is there, red where it is not: a red rim would be a fault.
    scene.images = vec![Image {
        name: "disc".into(),
        width: texels,
        height: texels,
        pixels: (0..texels * texels)
            .map(|k| {
                let opacity = opacity(k % texels, k / texels);
                let there = if opacity > 0 { 255 } else { 0 };
                [255 - there, there, 0, opacity]
            })
            .collect(),
    }];
    scene
}

#[test]
fn a_cut_out_has_the_area_of_what_its_picture_shows() {
    let area = std::f64::consts::PI * 0.6 * 0.6 / 4.0;
    for alpha_mode in [AlphaMode::Mask(0.5), AlphaMode::Blend] {
        // From texels as large as pixels to 1/16 of one, and texels much larger than pixels.
        for (texels, height) in [(64, 64), (64, 16), (256, 16), (16, 128), (33, 95)] {
            let scene = card(alpha_mode, 0.6, texels);
            let picture = picture_of(&scene, height * WIDTH / HEIGHT, height);
            let sum = |channel: usize| {
                let pixels = picture.pixels.iter();
                pixels.map(|pixel| f64::from(pixel[channel])).sum::<f64>()
            };
            let found = sum(3) / f64::from(height * height);
            let told = format!("{alpha_mode:?}, {texels} texels, {height} rows");
            assert!(
                (found / area - 1.0).abs() < 0.02,
                "{found} and not {area}: {told}"
            );
            assert!(sum(0) < 1e-6, "what is not there shows its colour: {told}");
            assert!((sum(1) / sum(3) - 1.0).abs() < 1e-5, "{told}");
        }
    }
}
