use crate::scene::Scene;
use veduta_geometry::DVec3;
use veduta_map::{Camera, Projection};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The smallest coordinates.
    pub min: DVec3,
    /// The largest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// The box around the vertices in use, in world space; `None` for a scene without faces.
    pub fn of_scene(scene: &Scene) -> Option<Self> {
        let mut bounds: Option<Self> = None;
        each_used_vertex(scene, |point| {
            let grown = bounds.map_or((point, point), |b| (b.min.min(point), b.max.max(point)));
            bounds = Some(Self {
                min: grown.0,
                max: grown.1,
            });
        });
        bounds
    }
}

/// Calls `visit` with every vertex that a face uses, in world space.
fn each_used_vertex(scene: &Scene, mut visit: impl FnMut(DVec3)) {
    for object in &scene.objects {
        let mesh = &scene.meshes[object.mesh.0 as usize];
        let mut used = vec![false; mesh.positions.len()];
        for &index in mesh.triangles.iter().flatten() {
            used[index as usize] = true;
        }
        for (&position, _) in mesh.positions.iter().zip(&used).filter(|(_, used)| **used) {
            visit(object.world_from_object.transform_point3(position));
        }
    }
}

/// Vertical field of view of the framing camera, in radians.
pub const FRAMING_FOV: f64 = 35.0_f64.to_radians();
/// Share of the frame left free on each side.
const FRAMING_MARGIN: f64 = 0.05;

/// A camera that shows the whole scene: three quarters from the front right, 20 degrees above,
/// 5 % margin. The front of a model is -Y.
///
/// `aspect` is width over height. `None` for a scene without faces.
pub fn framing_camera(scene: &Scene, aspect: f64) -> Option<Camera> {
    framing_camera_of_fov(scene, aspect, FRAMING_FOV)
}

/// [`framing_camera`] with a vertical field of view of `fov` radians, between 0 and pi.
pub fn framing_camera_of_fov(scene: &Scene, aspect: f64, fov: f64) -> Option<Camera> {
    let bounds = Bounds::of_scene(scene)?;
    let center = 0.5 * (bounds.min + bounds.max);
    let radius = (0.5 * (bounds.max - bounds.min).length()).max(1e-9);
    let (azimuth, elevation) = (-45.0_f64.to_radians(), 20.0_f64.to_radians());
    let back = DVec3::new(
        elevation.cos() * azimuth.cos(),
        elevation.cos() * azimuth.sin(),
        elevation.sin(),
    );
    let tan_half_height = (0.5 * fov).tan();
    let projection = Projection::Perspective {
        tan_half_height,
        aspect,
    };
    let turned = Camera::looking(center + back, center, DVec3::Z, projection, 1.0)?;

    // In the turned camera's axes a vertex at (x, y, z) is inside a frame with half-angle tangent t
    // seen from (ex, ey, -d) when |x - ex| <= t (z + d). The four sides give the extreme planes;
    // the nearest eye that satisfies all is found for each axis alone.
    let shrink = 1.0 - 2.0 * FRAMING_MARGIN;
    let tangents = [tan_half_height * aspect * shrink, tan_half_height * shrink];
    let mut extremes = [[f64::NEG_INFINITY; 2]; 2];
    each_used_vertex(scene, |point| {
        let p = turned.eye_from_world.transform_point3(point);
        for axis in 0..2 {
            for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
                let e = sign * p[axis] - tangents[axis] * p.z;
                extremes[axis][side] = extremes[axis][side].max(e);
            }
        }
    });
    // -x + ex <= t (z + d) and x - ex <= t (z + d): e0 + ex <= t d, e1 - ex <= t d.
    let mut distance = f64::NEG_INFINITY;
    let mut offset = [0.0; 2];
    for axis in 0..2 {
        let [low, high] = extremes[axis];
        offset[axis] = 0.5 * (high - low);
        distance = distance.max(0.5 * (low + high) / tangents[axis]);
    }
    let eye_in_turned = DVec3::new(offset[0], offset[1], -distance);
    let eye = turned
        .eye_from_world
        .inverse()
        .transform_point3(eye_in_turned);
    let near = (radius * 1e-5).max(f64::MIN_POSITIVE);
    Camera::looking(eye, eye - back, DVec3::Z, projection, near)
}
