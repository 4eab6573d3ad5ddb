//! Guests, pictures of other programs: what a picture shows of them, before, behind and between our own
//! surfaces.

use rng::Rng;
use veduta::accumulate::AovSettings;
use veduta::composite::{CompositeError, Operator, composite, hold_out, lay_on, operate};
use veduta::dice::PixelGrid;
use veduta::filter::Filter;
use veduta::geometry::{DMat4, DVec2, DVec3};
use veduta::map::{
    Camera, Guest, GuestGrid, GuestKind, GuestSamples, MaterialId, Projection, SeenScene,
};
use veduta::pipeline::{find_visibility, render_seen};
use veduta::scene::{AlphaMode, Material, Mesh, MeshId, Object, Scene, Shown};

#[path = "support/rng.rs"]
#[allow(dead_code)]
mod rng;

/// Looks along +Y at the origin from 4 m before it; the frame is 3 m high there.
fn camera(projection: Projection) -> Camera {
    let eye = DVec3::new(0.0, -4.0, 0.0);
    Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.1).expect("a sound camera")
}

const PERSPECTIVE: Projection = Projection::Perspective {
    tan_half_height: 0.375,
    aspect: 4.0 / 3.0,
};

const PARALLEL: Projection = Projection::Parallel {
    height: 3.0,
    aspect: 4.0 / 3.0,
};

fn nearness(projection: Projection, depth: f64) -> f64 {
    match projection {
        Projection::Perspective { .. } => 1.0 / depth,
        Projection::Parallel { .. } => -depth,
    }
}

/// A triangle with one colour and opacity, shown as it is.
#[derive(Clone, Debug)]
struct Pane {
    corners: [DVec3; 3],
    color: [f32; 4],
}

impl Pane {
    fn random(rng: &mut Rng) -> Self {
        let mut corner = || {
            let [x, y, z] = [3.0, 1.5, 2.0].map(|most| rng.within(-most, most));
            DVec3::new(x, y, z)
        };
        let corners = [corner(), corner(), corner()];
        let opacity = if rng.chance(0.5) { 1.0 } else { rng.unit() };
        let color = [rng.unit(), rng.unit(), rng.unit(), opacity].map(|value| value as f32);
        Self { corners, color }
    }
}

fn seen_of(panes: &[Pane], projection: Projection) -> SeenScene {
    let mut scene = Scene::default();
    for (index, pane) in (0..).zip(panes) {
        scene.meshes.push(Mesh {
            positions: pane.corners.to_vec(),
            triangles: vec![[0, 1, 2]],
            materials: vec![(0, MaterialId(index))],
            ..Mesh::default()
        });
        scene.objects.push(Object {
            name: format!("pane {index:03}"),
            mesh: MeshId(index),
            world_from_object: DMat4::IDENTITY,
        });
        scene.materials.push(Material {
            base_color: pane.color,
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            double_sided: true,
            ..Material::default()
        });
    }
    let map = find_visibility(&scene, &camera(projection));
    SeenScene::of(&scene, &map, [12, 9])
}

fn picture_of(seen: &SeenScene, width: u32, height: u32) -> Vec<[f32; 4]> {
    let grid = PixelGrid::of_frame(width, height);
    let pixels = render_seen(seen, &grid, true, Filter::Box, AovSettings::default())
        .0
        .pixels;
    assert!(pixels.iter().all(|pixel| pixel[3] <= 1.0 + 1e-6));
    pixels
}

/// A guest that fills the frame; of each pixel `samples` tells depths of front and back, opacity and colour.
fn guest(
    projection: Projection,
    size: [u32; 2],
    mut samples: impl FnMut() -> Vec<([f64; 2], f32, [f32; 3])>,
) -> Guest {
    let mut columns = GuestSamples::default();
    for _ in 0..size[0] * size[1] {
        for (depths, opacity, color) in samples() {
            let nearness = depths.map(|depth| nearness(projection, depth));
            columns.push(nearness, opacity, color, Guest::NO_OBJECT);
        }
        columns.end_pixel();
    }
    let grid = GuestGrid {
        frame: size,
        first: [0, 0],
        size,
    };
    Guest::new("guest".into(), GuestKind::Deep, grid, columns, Vec::new()).expect("sound")
}

/// Depth, opacity and premultiplied colour of what a ray meets.
type Met = (f64, f64, [f64; 3]);

fn panes_met(panes: &[Pane], projection: Projection, image: DVec2) -> Vec<Met> {
    let camera = camera(projection);
    let world_from_eye = camera.eye_from_world.inverse();
    let (origin, direction) = camera.eye_ray(image);
    let origin = world_from_eye.transform_point3(origin);
    let direction = world_from_eye.transform_vector3(direction);
    let met = panes.iter().filter_map(|pane| {
        let [a, b, c] = pane.corners;
        let normal = (b - a).cross(c - a);
        // The direction has a depth of 1.
        let depth = (a - origin).dot(normal) / direction.dot(normal);
        let hit = origin + depth * direction;
        let is_inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|&(p, q)| (q - p).cross(hit - p).dot(normal) >= 0.0);
        let [r, g, b, opacity] = pane.color.map(f64::from);
        let color = [r, g, b].map(|channel| opacity * channel);
        (depth > 0.1 && is_inside).then_some((depth, opacity, color))
    });
    met.collect()
}

fn samples_met(guest: &Guest, projection: Projection, image: DVec2) -> Vec<Met> {
    let [columns, rows] = guest.grid().size;
    let column = (image.x * f64::from(columns)) as usize;
    let row = (image.y * f64::from(rows)) as usize;
    let all = guest.samples();
    let samples = guest
        .samples_of(row * columns as usize + column)
        .map(|sample| {
            let depth = match projection {
                Projection::Perspective { .. } => 1.0 / all.near[sample],
                Projection::Parallel { .. } => -all.near[sample],
            };
            let color = all.color[sample].map(f64::from);
            (depth, f64::from(all.opacity[sample]), color)
        });
    samples.collect()
}

fn blended(mut met: Vec<Met>) -> [f64; 4] {
    met.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sum = [0.0; 4];
    let mut left = 1.0;
    for (_, opacity, [r, g, b]) in met {
        for (sum, value) in sum.iter_mut().zip([r, g, b, opacity]) {
            *sum += left * value;
        }
        left *= 1.0 - opacity;
    }
    sum
}

#[test]
fn a_picture_with_guests_is_what_rays_see() {
    const SIDE: u32 = 32;
    let mut worst: f64 = 0.0;
    for seed in 0..24 {
        let mut rng = Rng::new(seed);
        let projection = [PERSPECTIVE, PARALLEL][seed as usize % 2];
        // Few panes with few edges in a pixel, and many that lie across one another.
        let panes: Vec<Pane> = (0..[1, 4, 14, 60][seed as usize % 4])
            .map(|_| Pane::random(&mut rng))
            .collect();
        // The picture's own pixels, larger ones, and a second grid that cuts the first.
        let sizes: &[[u32; 2]] = [&[[12, 9]][..], &[[4, 3]], &[[12, 9], [5, 7]]][seed as usize % 3];
        let guests = sizes.iter().map(|&size| {
            guest(projection, size, || {
                let count = rng.integer(0, 3);
                let samples = (0..count).map(|_| {
                    let depth = rng.within(2.5, 5.5);
                    let opacity = if rng.chance(0.3) {
                        1.0
                    } else {
                        rng.unit() as f32
                    };
                    let color = [0; 3].map(|_| opacity * rng.unit() as f32);
                    ([depth; 2], opacity, color)
                });
                samples.collect()
            })
        });
        let guests: Vec<Guest> = guests.collect();
        let seen = SeenScene {
            guests,
            ..seen_of(&panes, projection)
        };
        let picture = picture_of(&seen, 12, 9);
        for (index, found) in (0..).zip(&picture) {
            let corner = DVec2::new(f64::from(index % 12), f64::from(index / 12));
            let mut mean = [0.0; 4];
            for sample in 0..SIDE * SIDE {
                let square = DVec2::new(f64::from(sample % SIDE), f64::from(sample / SIDE));
                let jitter = DVec2::new(rng.unit(), rng.unit());
                let point = corner + (square + jitter) / f64::from(SIDE);
                let image = point / DVec2::new(12.0, 9.0);
                let mut met = panes_met(&panes, projection, image);
                for guest in &seen.guests {
                    met.extend(samples_met(guest, projection, image));
                }
                for (mean, value) in mean.iter_mut().zip(blended(met)) {
                    *mean += value / f64::from(SIDE * SIDE);
                }
            }
            // Where more veils meet than are cut by samples, parts count as wholes.
            let tolerance = if panes.len() > 14 { 0.15 } else { 0.015 };
            for (found, expected) in found.iter().zip(mean) {
                let off = (f64::from(*found) - expected).abs();
                worst = worst.max(off);
                assert!(
                    off < tolerance,
                    "seed {seed}, pixel {index}: {found:?} and {mean:?}"
                );
            }
        }
    }
    println!("off by at most {worst}");
}

/// A wall through the whole frame that leans away from the eye: its depth is 4 + y.
fn leaning_wall() -> Pane {
    Pane {
        corners: [[-40.0, -20.0], [40.0, -20.0], [0.0, 60.0]].map(|[x, z]| DVec3::new(x, z, z)),
        color: [1.0, 0.0, 0.0, 1.0],
    }
}

#[test]
fn a_card_cuts_a_leaning_wall_along_a_straight_line() {
    // In parallel projection the wall is at depth 4 in the middle of the frame, farther above it.
    let seen = |depth: f64, opacity: f32| {
        let color = [0.0, opacity, 0.0];
        let card = guest(PARALLEL, [1, 1], || vec![([depth; 2], opacity, color)]);
        SeenScene {
            guests: vec![card],
            ..seen_of(&[leaning_wall()], PARALLEL)
        }
    };
    for opacity in [1.0, 0.25] {
        // Depth 3 is at z = -1: a sixth of the frame from below.
        for (depth, share_before) in [(4.0, 0.5), (3.0, 5.0 / 6.0), (9.0, 0.0), (1.0, 1.0)] {
            let [r, g, b, a] = picture_of(&seen(depth, opacity), 1, 1)[0];
            let green = share_before * f64::from(opacity);
            let off = [
                f64::from(r) - (1.0 - green),
                f64::from(g) - green,
                f64::from(a) - 1.0,
            ];
            assert!(
                off.iter().all(|off| off.abs() < 1e-6),
                "{depth}, {opacity}: {r} {g} {a}"
            );
            assert_eq!(b, 0.0);
        }
    }
}

#[test]
fn what_fills_a_depth_is_cut_by_a_wall_in_it_as_openexr_cuts_it() {
    // Fog from 2 to 6 m that lets 0.16 through, and a wall at 3 m: a quarter of it.
    let wall = Pane {
        corners: [[-40.0, -20.0], [40.0, -20.0], [0.0, 60.0]].map(|[x, z]| DVec3::new(x, -1.0, z)),
        color: [1.0, 0.0, 0.0, 1.0],
    };
    for projection in [PERSPECTIVE, PARALLEL] {
        let fog = guest(projection, [4, 3], || {
            vec![([2.0, 6.0], 0.84, [0.0, 0.84, 0.0])]
        });
        let seen = SeenScene {
            guests: vec![fog],
            ..seen_of(std::slice::from_ref(&wall), projection)
        };
        let through = 0.16_f64.powf(0.25);
        for [r, g, _, a] in picture_of(&seen, 12, 9) {
            assert!((f64::from(r) - through).abs() < 1e-6, "{r}");
            assert!((f64::from(g) - (1.0 - through)).abs() < 1e-6, "{g}");
            assert!((a - 1.0).abs() < 1e-6);
        }
    }
    // A wall that leans through it: converges, and is close as it is.
    let fog = guest(PARALLEL, [1, 1], || {
        vec![([2.5, 5.5], 0.84, [0.0, 0.84, 0.0])]
    });
    let seen = SeenScene {
        guests: vec![fog],
        ..seen_of(&[leaning_wall()], PARALLEL)
    };
    let [r, ..] = picture_of(&seen, 1, 1)[0];
    let steps = 1000;
    let exact: f64 = (0..steps)
        .map(|k| 0.16_f64.powf((f64::from(k) + 0.5) / f64::from(steps)) / f64::from(steps))
        .sum();
    assert!((f64::from(r) - exact).abs() < 0.01, "{r} and {exact}");
}

#[test]
fn a_guest_alone_keeps_its_light_at_any_size() {
    let mut rng = Rng::new(3);
    let own = guest(PERSPECTIVE, [7, 5], || {
        let opacity = rng.unit() as f32;
        vec![(
            [rng.within(2.0, 9.0); 2],
            opacity,
            [opacity * rng.unit() as f32; 3],
        )]
    });
    let own_mean: f64 = own
        .samples()
        .color
        .iter()
        .map(|c| f64::from(c[0]))
        .sum::<f64>()
        / 35.0;
    let seen = SeenScene {
        guests: vec![own],
        ..seen_of(&[], PERSPECTIVE)
    };
    for [width, height] in [[7, 5], [14, 15], [3, 4], [1, 1], [13, 2]] {
        let picture = picture_of(&seen, width, height);
        let sum: f64 = picture.iter().map(|pixel| f64::from(pixel[0])).sum();
        let mean = sum / f64::from(width * height);
        assert!((mean - own_mean).abs() < 1e-6, "{width} x {height}: {mean}");
    }
    let own_size = picture_of(&seen, 7, 5);
    let colors = &seen.guests[0].samples().color;
    assert!(
        own_size
            .iter()
            .zip(colors)
            .all(|(p, c)| (p[0] - c[0]).abs() < 1e-6)
    );
}

#[test]
fn mattes_and_holdouts_hide_guests() {
    let mut rng = Rng::new(5);
    let panes: Vec<Pane> = (0..4)
        .map(|_| Pane {
            color: [1.0, 0.5, 0.0, 1.0],
            ..Pane::random(&mut rng)
        })
        .collect();
    let card = guest(PERSPECTIVE, [12, 9], || {
        vec![([4.0; 2], 0.5, [0.0, 0.0, 0.5])]
    });
    let empty = SeenScene {
        guests: vec![card],
        ..seen_of(&[], PERSPECTIVE)
    };
    let walls = seen_of(&panes, PERSPECTIVE);
    let held_out = hold_out(std::slice::from_ref(&empty), std::slice::from_ref(&walls));
    let held_out = picture_of(&held_out.expect("of one camera"), 12, 9);
    let mut matte = walls.clone();
    matte.scene.show_as(Shown::Matte, |_| true);
    let with_matte = composite(&[empty.clone(), matte]).expect("of one camera");
    assert_eq!(picture_of(&with_matte, 12, 9), held_out);
    // Blue is what is seen of the card, with walls or with their holes.
    let both = composite(&[empty.clone(), walls.clone()]).expect("of one camera");
    let both = picture_of(&both, 12, 9);
    assert!(held_out.iter().any(|pixel| pixel[3] < 0.4));
    for (hole, wall) in held_out.iter().zip(&both) {
        assert!((hole[2] - wall[2]).abs() < 1e-6, "{hole:?} and {wall:?}");
        assert_eq!(hole[0], 0.0);
        assert!((hole[3] - hole[2]).abs() < 1e-6);
    }
    let refused = |found: Result<SeenScene, CompositeError>, index: usize| {
        assert_eq!(found, Err(CompositeError::Guests { index }));
    };
    let one = std::slice::from_ref;
    refused(hold_out(one(&walls), one(&empty)), 1);
    refused(operate(&walls, Operator::In, one(&empty)), 1);
    refused(lay_on(&empty, &walls), 0);
}
