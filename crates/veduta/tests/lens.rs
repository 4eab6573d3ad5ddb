//! Pictures by lenses, directly from scenes: nothing is lost or shown twice, wires stay wires, and where the faces of
//! the cube meet cannot be seen.

use panes::{Pane, scene_of};
use rng::Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use veduta::accumulate::Picture;
use veduta::geometry::{DMat3, DMat4, DVec2, DVec3, Vec2};
use veduta::map::{self, Camera, MaterialId};
use veduta::pipeline::{self, RenderSettings};
use veduta::reproject::cube::Layout;
use veduta::reproject::patches::{Subdivision, TOLERANCE};
use veduta::reproject::{Lens, Orientation, Projection};
use veduta::scene::{Image, ImageId, Material, Mesh, MeshId, Object, Scene, TextureRef};

#[path = "support/rng.rs"]
#[allow(dead_code)]
mod rng;

#[path = "support/panes.rs"]
mod panes;

const LENSES: [&str; 14] = [
    "omnimax",
    "domemaster",
    "fisheye:220",
    "angular",
    "equisolid:180",
    "stereographic:270",
    "orthographic:180",
    "polynomial:1.2,0.3,-0.2",
    "equirect",
    "cylinder",
    "mercator",
    "ball",
    "equiangular",
    "perspective:100",
];

fn lens(name: &str) -> Lens {
    name.parse().expect(name)
}

/// An eye at the origin that looks along +Y, then is turned about an axis.
fn eye(axis: DVec3, angle: f64) -> Camera {
    let projection = map::Projection::Perspective {
        tan_half_height: 1.0,
        aspect: 1.0,
    };
    let turn = DMat3::from_axis_angle(axis.normalize(), angle);
    Camera::looking(
        DVec3::ZERO,
        turn * DVec3::Y,
        turn * DVec3::Z,
        projection,
        1e-3,
    )
    .expect("a sound camera")
}

/// A lens that looks along `forward` of the scene with `up` upwards, in the world of `eye`.
fn projection(
    eye: &Camera,
    lens: Lens,
    [forward, up]: [DVec3; 2],
    width: u32,
    height: u32,
) -> Projection {
    let of_eye = |direction: DVec3| {
        let seen = eye.eye_from_world.transform_vector3(direction);
        DVec3::new(seen.x, -seen.y, -seen.z)
    };
    let orientation = Orientation::looking(of_eye(forward), of_eye(up)).expect("not parallel");
    Projection::new(lens, orientation, width, height)
}

fn scene_direction(eye: &Camera, projection: &Projection, point: DVec2) -> Option<DVec3> {
    let world = projection.direction(point)?;
    let of_eye = DVec3::new(world.x, -world.y, -world.z);
    Some(eye.eye_from_world.inverse().transform_vector3(of_eye))
}

/// Askew, so that nothing of a lens falls together with anything of a cube.
const ASKEW: [DVec3; 2] = [DVec3::new(0.3, 1.0, 0.45), DVec3::new(0.2, -0.1, 1.0)];

/// Width and height in pixels of which neither is a round number.
fn size_of(lens: Lens, width: u32) -> [u32; 2] {
    [width, (f64::from(width) / lens.aspect()).round() as u32]
}

/// A ball of triangles around the eye, which stands beside its middle; every triangle has a colour.
fn ball_around(rng: &mut Rng, bands: u32, sectors: u32) -> Scene {
    let middle = DVec3::new(0.4, -0.3, 0.2);
    let at = |band: u32, sector: u32| {
        let (polar, azimuth) = (
            PI * f64::from(band) / f64::from(bands),
            TAU * f64::from(sector % sectors) / f64::from(sectors),
        );
        let flat = match band {
            0 => 0.0,
            band if band == bands => 0.0,
            _ => polar.sin(),
        };
        middle + 3.0 * DVec3::new(flat * azimuth.cos(), flat * azimuth.sin(), polar.cos())
    };
    let mut panes = Vec::new();
    for band in 0..bands {
        for sector in 0..sectors {
            let corners = [
                at(band, sector),
                at(band, sector + 1),
                at(band + 1, sector + 1),
                at(band + 1, sector),
            ];
            for corners in [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| corners[k])) {
                let [a, b, c] = corners;
                if (b - a).cross(c - a).length() < 1e-12 {
                    continue;
                }
                let color = [rng.unit() as f32, rng.unit() as f32, rng.unit() as f32, 1.0];
                panes.push(Pane {
                    corners: corners.to_vec(),
                    color,
                });
            }
        }
    }
    scene_of(&panes)
}

/// Triangles all around the eye; a third of them are veils where `veils`.
fn panes_around(rng: &mut Rng, count: u32, veils: bool) -> Vec<Pane> {
    let direction = |rng: &mut Rng| loop {
        let d = DVec3::new(
            rng.within(-1.0, 1.0),
            rng.within(-1.0, 1.0),
            rng.within(-1.0, 1.0),
        );
        if (0.1..1.0).contains(&d.length()) {
            return d.normalize();
        }
    };
    (0..count)
        .map(|_| {
            let middle = direction(rng) * rng.within(2.0, 6.0);
            let corners = (0..3).map(|_| middle + direction(rng) * rng.within(0.3, 1.8));
            let corners = corners.collect();
            let opacity = if veils && rng.chance(0.33) {
                rng.unit() as f32
            } else {
                1.0
            };
            let color = [
                rng.unit() as f32,
                rng.unit() as f32,
                rng.unit() as f32,
                opacity,
            ];
            Pane { corners, color }
        })
        .collect()
}

/// Premultiplied colour and opacity along a ray from the origin.
fn along_ray(panes: &[Pane], direction: DVec3) -> [f64; 4] {
    let mut hits: Vec<(f64, [f32; 4])> = Vec::new();
    for pane in panes {
        let [a, b, c] = [pane.corners[0], pane.corners[1], pane.corners[2]];
        let whole = a.dot(b.cross(c));
        let weights = [b.cross(c), c.cross(a), a.cross(b)].map(|n| n.dot(direction) / whole);
        if weights.iter().all(|&weight| weight >= 0.0) {
            hits.push((weights.iter().sum::<f64>().recip(), pane.color));
        }
    }
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut seen = [0.0; 4];
    let mut through = 1.0;
    for (_, [r, g, b, opacity]) in hits {
        let weight = through * f64::from(opacity);
        for (sum, channel) in seen.iter_mut().zip([r, g, b, 1.0]) {
            *sum += weight * f64::from(channel);
        }
        through *= 1.0 - f64::from(opacity);
    }
    seen
}

fn picture_of(scene: &Scene, eye: &Camera, projection: &Projection) -> Picture {
    let surroundings = pipeline::find_surroundings(scene, eye, projection, |_| {});
    pipeline::render_surroundings(scene, &surroundings, projection, true)
}

/// What opaque faces cover of each pixel.
fn covered(scene: &Scene, eye: &Camera, projection: &Projection) -> Vec<f64> {
    let surroundings = pipeline::find_surroundings(scene, eye, projection, |_| {});
    let mut sums = vec![0.0; projection.width as usize * projection.height as usize];
    for row in pipeline::lens_coverage(&surroundings, projection)
        .into_iter()
        .flatten()
    {
        sums[row.pixel] += row.area;
    }
    sums
}

#[test]
fn what_is_all_around_fills_every_pixel_and_the_rim_as_far_as_it_goes() {
    let scene = ball_around(&mut Rng::new(1), 13, 19);
    for name in LENSES {
        let lens = lens(name);
        for (eye, looking, width) in [
            (eye(DVec3::Z, 0.0), [DVec3::Y, DVec3::Z], 30),
            (eye(DVec3::Z, 0.0), [DVec3::Z, -DVec3::Y], 23),
            (eye(DVec3::new(1.0, 2.0, -0.7), 0.8), ASKEW, 27),
        ] {
            let [width, height] = size_of(lens, width);
            let projection = projection(&eye, lens, looking, width, height);
            for (pixel, covered) in covered(&scene, &eye, &projection).into_iter().enumerate() {
                let [column, row] = [pixel as u32 % width, pixel as u32 / width];
                let share = projection.coverage(column, row);
                assert!(
                    (covered - share).abs() < 1e-9,
                    "{name}, pixel {column} {row}: {covered} and not {share}"
                );
            }
        }
    }
}

#[test]
fn patches_show_everything_where_it_is() {
    let mut rng = Rng::new(2);
    for name in LENSES {
        let lens = lens(name);
        let eye = eye(DVec3::Z, 0.0);
        let [width, height] = size_of(lens, 110);
        let projection = projection(&eye, lens, ASKEW, width, height);
        let subdivision = Subdivision::new(&projection);
        let mut patches = Vec::new();
        // In patches of a pixel and more, and in smaller ones.
        let mut worst = [0.0_f64; 2];
        for first in (0..height).step_by(16) {
            subdivision.cut(first..(first + 16).min(height), &mut patches);
            for patch in &patches {
                let [a, b, c] = *patch.corners();
                let (u, v) = (rng.unit(), rng.unit());
                let (u, v) = if u + v > 1.0 {
                    (1.0 - u, 1.0 - v)
                } else {
                    (u, v)
                };
                let point = a + (b - a) * u + (c - a) * v;
                // Within a pixel of a pole, which a whole row or rim may be, a hair's breadth is half around.
                let from_middle = projection.lens_from_image(point);
                let pixel = (projection.lens_from_image(DVec2::X)
                    - projection.lens_from_image(DVec2::ZERO))
                .x;
                let at_pole = match name {
                    "equirect" => from_middle.y.abs() > 0.5 - pixel,
                    "angular" => from_middle.length() > 1.0 - pixel,
                    _ => false,
                };
                let direction = patch_direction(patch.look(point)[0]);
                let Some(seen) = projection.image(direction).filter(|_| !at_pole) else {
                    continue;
                };
                let mut off = seen - point;
                if let Some(period) = projection.period() {
                    off.x -= period * (off.x / period).round();
                }
                let longest = (b - a).max_element().max((c - a).max_element());
                let worst = &mut worst[usize::from(longest.max((c - b).max_element()) < 1.0)];
                *worst = worst.max(off.length());
            }
        }
        // The largest error in a patch is about 4/3 of that in the middles of its sides.
        assert!(
            worst[0] < 1.5 * TOLERANCE,
            "{name}: off by {worst:?} pixels"
        );
        assert!(
            worst[1] < 8.0 * TOLERANCE,
            "{name}: off by {worst:?} pixels"
        );
        assert!(worst != [0.0; 2], "{name}: no patch was looked at");
    }
}

fn patch_direction(of_eye: DVec3) -> DVec3 {
    DVec3::new(of_eye.x, -of_eye.y, -of_eye.z)
}

#[test]
fn the_cube_may_be_turned_any_way() {
    let mut rng = Rng::new(3);
    let scene = scene_of(&panes_around(&mut rng, 120, true));
    for name in LENSES {
        let lens = lens(name);
        let [width, height] = size_of(lens, 45);
        let [a, b] = [
            eye(DVec3::Z, 0.0),
            eye(DVec3::new(-0.4, 1.0, 0.6), 1.0 + rng.unit()),
        ]
        .map(|eye| {
            let projection = projection(&eye, lens, ASKEW, width, height);
            picture_of(&scene, &eye, &projection)
        });
        for (pixel, (a, b)) in a.pixels.iter().zip(&b.pixels).enumerate() {
            for (a, b) in a.iter().zip(b) {
                let [column, row] = [pixel as u32 % width, pixel as u32 / width];
                assert!((a - b).abs() < 1e-5, "{name}, {column} {row}: {a} and {b}");
            }
        }
    }
}

/// Rays along each side of a pixel.
const RAYS: u32 = 16;

#[test]
fn a_picture_is_that_of_many_rays() {
    let mut rng = Rng::new(4);
    let panes = panes_around(&mut rng, 60, true);
    let scene = scene_of(&panes);
    let eye = eye(DVec3::X, 0.3);
    for name in LENSES {
        let lens = lens(name);
        let [width, height] = size_of(lens, 24);
        let projection = projection(&eye, lens, ASKEW, width, height);
        let picture = picture_of(&scene, &eye, &projection);
        let mut squares = 0.0;
        let mut count = 0;
        for row in 0..height {
            for column in 0..width {
                // Around the pole one needs more rays than anyone has time for.
                let at_pole = lens == Lens::Equirect && (row == 0 || row == height - 1);
                if projection.coverage(column, row) < 1.0 - 1e-9 || at_pole {
                    continue;
                }
                let mut sum = [0.0; 4];
                for ray in 0..RAYS * RAYS {
                    let [i, j] = [ray % RAYS, ray / RAYS].map(f64::from);
                    let within = DVec2::new(i + rng.unit(), j + rng.unit()) / f64::from(RAYS);
                    let corner = DVec2::new(f64::from(column), f64::from(row));
                    let direction = scene_direction(&eye, &projection, corner + within);
                    let seen = along_ray(&panes, direction.expect("covered"));
                    sum = std::array::from_fn(|channel| sum[channel] + seen[channel]);
                }
                let pixel = picture.pixels[(row * width + column) as usize];
                for (found, sum) in pixel.into_iter().zip(sum) {
                    let expected = sum / f64::from(RAYS * RAYS);
                    let off = f64::from(found) - expected;
                    assert!(
                        off.abs() < 0.1,
                        "{name}, {column} {row}: {found} and not {expected}"
                    );
                    squares += off * off;
                    count += 1;
                }
            }
        }
        let rms = (squares / f64::from(count)).sqrt();
        // Of a stratified sample; an edge that is misplaced by a tenth of a pixel would make more.
        assert!(rms < 0.006, "{name}: off by {rms}");
    }
}

/// Area in square pixels that a polygon of closely set points covers of the columns from `first` to `end`.
fn area_in_columns(polygon: &[DVec2], first: f64, end: f64) -> f64 {
    let mut area = 0.0;
    for (k, &p) in polygon.iter().enumerate() {
        let q = polygon[(k + 1) % polygon.len()];
        let (low, high) = (p.x.clamp(first, end), q.x.clamp(first, end));
        if p.x != q.x {
            let at = |x: f64| p.y + (q.y - p.y) * ((x - p.x) / (q.x - p.x));
            area += 0.5 * (at(low) + at(high)) * (low - high);
        }
    }
    area.abs()
}

#[test]
fn a_wire_stays_a_wire() {
    let eye = eye(DVec3::Z, 0.0);
    // Lenses, what they look at, and the wire's ends.
    let high = [DVec3::new(-9.0, 3.0, 2.5), DVec3::new(9.0, 3.0, 2.2)];
    let level = [DVec3::Y, DVec3::Z];
    let upwards = [DVec3::Z, -DVec3::Y];
    for (name, looking, [from, to]) in [
        ("domemaster", upwards, high),
        ("fisheye:180", level, high),
        ("equisolid:200", level, high),
        ("omnimax:full", level, high),
        ("equirect", level, high),
        ("cylinder", level, high),
        ("mercator", level, high),
        ("stereographic:220", level, high),
        (
            "ball",
            level,
            [DVec3::new(5.0, -4.0, 3.0), DVec3::new(-5.0, -4.0, 2.0)],
        ),
    ] {
        let lens = lens(name);
        // So large that the scale of the lens does not change by more than a per cent or two from pixel to pixel.
        for width in if lens.is_round() {
            [200, 440]
        } else {
            [400, 600]
        } {
            let [width, height] = size_of(lens, width);
            let projection = projection(&eye, lens, looking, width, height);
            // Of a twentieth of a pixel, in the middle.
            let middle = 0.5 * (from + to);
            let at = |point: DVec3| {
                let seen = eye.eye_from_world.transform_vector3(point);
                let point = projection.image(patch_direction(seen));
                point.expect("in view")
            };
            let across = middle.cross(to - from).normalize();
            let step = (at(middle + 1e-4 * across) - at(middle)).length() / 1e-4;
            let half = 0.5 * across * (0.05 / step);
            let corners = [from - half, to - half, to + half, from + half];
            let pane = Pane {
                corners: corners.to_vec(),
                color: [1.0; 4],
            };
            let picture = picture_of(&scene_of(&[pane]), &eye, &projection);

            let along = |p: DVec3, q: DVec3| {
                (0..20_000).map(move |k| at(p + (q - p) * (f64::from(k) / 20_000.0)))
            };
            let [a, b, c, d] = corners;
            let outline: Vec<DVec2> = along(a, b)
                .chain(along(b, c))
                .chain(along(c, d))
                .chain(along(d, a))
                .collect();
            let (left, right) = outline
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, r), p| {
                    (l.min(p.x), r.max(p.x))
                });
            let (mut columns, mut worst) = (0, 0.0_f64);
            for column in left.ceil() as u32 + 1..right.floor() as u32 - 1 {
                let expected = area_in_columns(&outline, f64::from(column), f64::from(column + 1));
                let found: f64 = (0..height)
                    .map(|row| f64::from(picture.pixels[(row * width + column) as usize][3]))
                    .sum();
                worst = worst.max((found / expected - 1.0).abs());
                columns += 1;
            }
            println!("{name} {width}: off by {worst:.5} in a column");
            assert!(columns > width / 4, "{name}: the wire is {columns} long");
            assert!(worst < 0.01, "{name} {width}: off by {worst} in a column");
        }
    }
}

/// A ground with a chequered picture and a few walls, in the light.
fn lit_ground() -> Scene {
    let texels = [[20, 40, 60, 255], [220, 200, 180, 255]];
    let image = Image {
        name: "squares".into(),
        width: 8,
        height: 8,
        pixels: (0..64)
            .map(|k| texels[(k % 8 / 2 + k / 8 / 2) % 2])
            .collect(),
    };
    let square = |corner: DVec3, along: DVec3, up: DVec3| Mesh {
        positions: vec![corner, corner + along, corner + along + up, corner + up],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        texcoords: [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)]
            .map(Vec2::from)
            .to_vec(),
        materials: vec![(0, MaterialId(0))],
        ..Mesh::default()
    };
    let meshes = vec![
        square(
            DVec3::new(-9.0, -9.0, -1.5),
            18.0 * DVec3::X,
            18.0 * DVec3::Y,
        ),
        square(DVec3::new(-3.0, 4.0, -1.5), 4.0 * DVec3::X, 4.0 * DVec3::Z),
        square(
            DVec3::new(2.0, 3.0, -1.5),
            DVec3::new(1.0, 3.0, 0.0),
            3.0 * DVec3::Z,
        ),
    ];
    let objects = (0..meshes.len()).map(|k| Object {
        name: k.to_string(),
        mesh: MeshId(k as u32),
        world_from_object: DMat4::IDENTITY,
    });
    Scene {
        objects: objects.collect(),
        meshes,
        images: vec![image],
        materials: vec![Material {
            base_color_texture: Some(TextureRef::new(ImageId(0))),
            double_sided: true,
            ..Material::default()
        }],
        ..Scene::default()
    }
}

/// Pixels along the side of the squares in which means are compared.
const SQUARE: u32 = 8;

#[test]
fn filtered_pictures_of_the_cubes_faces_have_the_same_means() {
    let scene = ball_around(&mut Rng::new(7), 10, 14);
    let eye = eye(DVec3::Z, 0.2);
    for name in ["domemaster", "omnimax:full", "equirect", "ball"] {
        let lens = lens(name);
        let [width, height] = size_of(lens, 96);
        let projection = projection(&eye, lens, ASKEW, width, height);
        let exact = picture_of(&scene, &eye, &projection);
        let (filtered, faces) =
            pipeline::render_filtered(&scene, &eye, &projection, 192, true, |_| {});
        assert!(faces.len() > 3, "{name}: {faces:?}");
        let mut worst = 0.0_f64;
        let mut count = 0;
        for top in (0..height - SQUARE).step_by(SQUARE as usize) {
            for left in (0..width - SQUARE).step_by(SQUARE as usize) {
                let pixels = (0..SQUARE * SQUARE).map(|k| (left + k % SQUARE, top + k / SQUARE));
                let inside = |(x, y): (u32, u32)| projection.coverage(x, y) == 1.0;
                // Along a pole's row and a ball's rim, a footprint is no ellipse.
                let middle = projection.lens_from_image(DVec2::new(
                    f64::from(left + SQUARE / 2),
                    f64::from(top + SQUARE / 2),
                ));
                let is_plain = match name {
                    "ball" => middle.length() < 0.8,
                    "equirect" => middle.y.abs() < 0.35,
                    _ => true,
                };
                if !is_plain || !pixels.clone().all(inside) {
                    continue;
                }
                for channel in 0..4 {
                    let mean = |picture: &Picture| {
                        let values = pixels.clone().map(|(x, y)| {
                            f64::from(picture.pixels[(y * width + x) as usize][channel])
                        });
                        values.sum::<f64>() / f64::from(SQUARE * SQUARE)
                    };
                    worst = worst.max((mean(&exact) - mean(&filtered)).abs());
                    count += 1;
                }
            }
        }
        assert!(count > 100 && worst < 0.02, "{name}: off by {worst}");
    }
}

#[test]
fn a_perspective_lens_makes_what_a_camera_makes() {
    let scene = lit_ground();
    let mut camera = eye(DVec3::X, -0.2);
    let fov = 1.2_f64;
    let lens = Lens::Perspective { fov };
    let projection = Projection::new(lens, Orientation::default(), 90, 60);
    let surroundings = pipeline::find_surroundings(&scene, &camera, &projection, |_| {});
    let found = pipeline::render_surroundings(&scene, &surroundings, &projection, false);
    camera.projection = map::Projection::Perspective {
        tan_half_height: (0.5 * fov).tan(),
        aspect: 1.5,
    };
    let settings = RenderSettings {
        width: 90,
        height: 60,
        ..RenderSettings::default()
    };
    let expected = pipeline::render(&scene, &camera, &settings, |_| {}).picture;
    let mut squares = 0.0;
    for (a, b) in found.pixels.iter().zip(&expected.pixels) {
        for (a, b) in a.iter().zip(b) {
            squares += f64::from(a - b).powi(2);
        }
    }
    let rms = (squares / (4.0 * 90.0 * 60.0)).sqrt();
    assert!(rms < 0.004, "off by {rms}");
}

#[test]
fn only_what_a_lens_looks_at_is_found() {
    let scene = lit_ground();
    let eye = eye(DVec3::Z, 0.0);
    let faces = |name: &str, elevation: f64| -> Vec<&str> {
        let orientation = Orientation::from_angles(0.0, elevation, 0.0);
        let projection = Projection::new(lens(name), orientation, 100, 78);
        let found = pipeline::find_surroundings(&scene, &eye, &projection, |_| {});
        found
            .sides
            .iter()
            .map(|seen| seen.part.side.name())
            .collect()
    };
    // The paper's four faces; the arc touches the bottom's border only.
    assert_eq!(faces("omnimax", 0.0), ["front", "right", "left", "up"]);
    let upper = ["front", "right", "back", "left", "up"];
    assert_eq!(faces("domemaster", FRAC_PI_2), upper);
    assert_eq!(faces("perspective:60", 0.0), ["front"]);
    assert_eq!(faces("equirect", 0.0).len(), 6);
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let scene = scene_of(&panes_around(&mut Rng::new(5), 80, true));
    let eye = eye(DVec3::Z, 0.5);
    let projection = projection(&eye, lens("fisheye:200"), ASKEW, 70, 70);
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a thread pool").install(|| {
            let picture = picture_of(&scene, &eye, &projection);
            let bits = |pixel: &[f32; 4]| pixel.map(f32::to_bits);
            picture.pixels.iter().map(bits).collect::<Vec<_>>()
        })
    };
    assert!(with_threads(1) == with_threads(3));
}

#[test]
fn the_faces_of_a_cube_fit_together() {
    // A ball of many colours: across each side of the front, pixels go on where they end.
    let scene = ball_around(&mut Rng::new(6), 12, 16);
    let eye = eye(DVec3::Z, 0.3);
    let side = 64;
    let cross = pipeline::render_cube(&scene, &eye, &Layout::cross(), side, true, |_| {});
    assert_eq!((cross.width, cross.height), (4 * side, 3 * side));
    let at = |x: u32, y: u32| cross.pixels[(y * cross.width + x) as usize];
    let difference = |p: [u32; 2], q: [u32; 2]| {
        let (p, q) = (at(p[0], p[1]), at(q[0], q[1]));
        p.iter().zip(q).map(|(a, b)| (a - b).abs()).sum::<f32>()
    };
    let (first, last) = (side, 2 * side - 1);
    for [across, within] in [
        // Left, right, above and below of the front; each against pixels within it.
        (first..=last)
            .map(|y| [[first - 1, y], [first, y]])
            .collect(),
        (first..=last).map(|y| [[last, y], [last + 1, y]]).collect(),
        (first..=last)
            .map(|x| [[x, first - 1], [x, first]])
            .collect(),
        (first..=last)
            .map(|x| [[x, last], [x, last + 1]])
            .collect::<Vec<_>>(),
    ]
    .map(|pairs| {
        let middle = side + side / 2;
        let upright = pairs[0][0][1] == pairs[0][1][1];
        let within = pairs.iter().map(|pair| match upright {
            true => difference([middle, pair[0][1]], [middle + 1, pair[0][1]]),
            false => difference([pair[0][0], middle], [pair[0][0], middle + 1]),
        });
        let across = pairs.iter().map(|pair| difference(pair[0], pair[1]));
        [across.sum::<f32>(), within.sum::<f32>()]
    }) {
        assert!(across < 3.0 * within, "{across} and {within} within");
    }
    // The bottom left square of the cross is empty.
    assert_eq!(at(0, 2 * side), [0.0; 4]);
}
