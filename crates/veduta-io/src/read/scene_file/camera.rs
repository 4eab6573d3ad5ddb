//! Cameras of the file -> cameras of the scene.

use super::Time;
use super::document::{Camera as CameraTable, Document};
use super::keys::CameraKeys;
use super::source::Faults;
use super::value::Interpolation;
use crate::read::{Animation, AnimationKind};
use veduta::geometry::DVec3;
use veduta::map::{Camera, Projection};
use veduta::scene::{Bounds, FRAMING_FOV, Scene};

/// Height of the sensor where none is given, in metres: that of small-format film, 36 mm x 24 mm.
const SENSOR_HEIGHT: f64 = 0.024;
/// Width over height of a frame without size; who renders replaces it with that of the picture.
const ASPECT: f64 = 4.0 / 3.0;
/// Depth of the near plane where none is given, as a share of the scene's size.
const NEAR_SHARE: f64 = 1e-5;

/// A camera of the file.
#[derive(Debug)]
pub struct NamedCamera {
    pub name: String,
    pub camera: Camera,
    /// In pixels.
    pub size: Option<[u32; 2]>,
    has_near: bool,
    /// From the eye to what it looks at, in metres.
    distance: f64,
    /// If it has keys.
    pub animation: Option<Animation>,
}

/// The cameras of the file at a moment, in its order.
pub fn all(document: &Document, time: Time, faults: &mut Faults) -> Vec<NamedCamera> {
    let Some(cameras) = &document.camera else {
        return Vec::new();
    };
    let mut all = Vec::new();
    for (name, table) in &cameras.value.0 {
        let keys = table.keys.as_ref().map(|keys| {
            let interpolation = table.interpolation.as_ref();
            let interpolation = interpolation.map_or(Interpolation::default(), |how| how.value);
            CameraKeys::of(&keys.value, interpolation, time.frames_per_second, faults)
        });
        let keyed = keys.as_ref();
        let eye = keyed.and_then(|keys| keys.eye(time.seconds));
        let look_at = keyed.and_then(|keys| keys.look_at(time.seconds));
        let eye = eye.unwrap_or(table.eye.value.0);
        let look_at = look_at.unwrap_or(table.look_at.value.0);
        match camera(table, eye, look_at) {
            Some(camera) => {
                let offset = look_at - eye;
                all.push(NamedCamera {
                    name: name.value.0.clone(),
                    camera,
                    size: table.size.as_ref().map(|size| size.value.0),
                    has_near: table.near.is_some(),
                    distance: offset.length(),
                    animation: keys.map(|keys| Animation {
                        name: name.value.0.clone(),
                        kind: AnimationKind::Camera,
                        seconds: keys.end,
                    }),
                });
            }
            None => {
                let when = match &table.keys {
                    Some(_) => format!(", {} s after the beginning", time.seconds),
                    None => String::new(),
                };
                let message = format!(
                    "camera {:?}{when}: eye, look_at and up define no direction: the eye must not \
                     stand on what it looks at, nor look along up",
                    name.value.0
                );
                let at = table.up.as_ref().map_or(&table.look_at.span, |up| &up.span);
                let at = table.keys.as_ref().map_or(at, |keys| &keys.span);
                faults.senseless(at.clone(), message);
            }
        }
    }
    all
}

fn camera(table: &CameraTable, eye: DVec3, look_at: DVec3) -> Option<Camera> {
    let aspect = match &table.size {
        Some(size) => {
            let [width, height] = size.value.0.map(f64::from);
            width / height
        }
        None => ASPECT,
    };
    let projection = match (&table.parallel, &table.focal_length) {
        (Some(height), _) => Projection::Parallel {
            height: height.value.0,
            aspect,
        },
        (None, Some(focal_length)) => {
            let sensor = table.sensor_height.as_ref();
            let sensor = sensor.map_or(SENSOR_HEIGHT, |height| height.value.0);
            Projection::Perspective {
                tan_half_height: 0.5 * sensor / focal_length.value.0,
                aspect,
            }
        }
        (None, None) => {
            let fov = table.fov.as_ref().map_or(FRAMING_FOV, |fov| fov.value.0);
            Projection::Perspective {
                tan_half_height: (0.5 * fov).tan(),
                aspect,
            }
        }
    };
    let near = table.near.as_ref().map_or(0.0, |near| near.value.0);
    let looking = |up| Camera::looking(eye, look_at, up, projection, near);
    let mut camera = match &table.up {
        Some(up) => looking(up.value.0),
        // Straight up or down, north is upwards, as on a plan.
        None => looking(DVec3::Z).or_else(|| looking(DVec3::Y)),
    }?;
    if let Some(shift) = &table.shift {
        camera.shift = shift.value.0;
    }
    Some(camera)
}

/// Gives perspective cameras without a near plane one that suits the size of the scene.
pub fn set_near_planes(scene: &mut Scene, cameras: &[NamedCamera]) {
    let size = Bounds::of_scene(scene).map_or(0.0, |bounds| (bounds.max - bounds.min).length());
    for ((_, camera), table) in scene.cameras.iter_mut().zip(cameras) {
        let is_perspective = matches!(camera.projection, Projection::Perspective { .. });
        if is_perspective && !table.has_near {
            camera.near = (NEAR_SHARE * size.max(table.distance)).max(f64::MIN_POSITIVE);
        }
    }
}
