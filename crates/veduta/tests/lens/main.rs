//! Pictures by lenses, directly from scenes: nothing is lost or shown twice, wires stay wires, and where the sides of
//! the cube meet cannot be seen.

mod areas;
mod pictures;
mod sides;
mod views;
mod wires;

use panes::{Pane, scene_of};
use rng::Rng;
use std::f64::consts::{PI, TAU};
use veduta::accumulate::Picture;
use veduta::geometry::{DMat3, DVec2, DVec3};
use veduta::map::{self, Camera};
use veduta::pipeline;
use veduta::reproject::{Lens, Orientation, Projection};
use veduta::scene::Scene;

#[path = "../support/rng.rs"]
#[allow(dead_code)]
mod rng;

#[path = "../support/panes.rs"]
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
    pipeline::render_surroundings(scene, &surroundings, projection, true).picture
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

fn patch_direction(of_eye: DVec3) -> DVec3 {
    DVec3::new(of_eye.x, -of_eye.y, -of_eye.z)
}
