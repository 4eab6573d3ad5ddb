use super::DepthProblem;
use std::fmt;
use veduta::map::{Camera, Projection};
use veduta_geometry::DVec2;

/// What the numbers of a channel of depth mean. Lengths are in the file's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthKind {
    /// Distance along the line of sight: z of eye space. Blender, and what OpenEXR means by Z.
    Planar,
    /// Distance from the eye along the ray; in parallel projection from the eye's plane. Many ray
    /// tracers.
    Ray,
    /// 1/z, 0 where nothing is. Nuke.
    Inverse,
    /// What a graphics card keeps: from 0 at the near plane to 1 at the far one, in between affine in
    /// 1/z (in parallel projection, in z).
    Device {
        /// Depth of the near plane, above 0.
        near: f64,
        /// Depth of the far plane; may be infinite.
        far: f64,
        /// 1 at the near plane and 0 at the far one instead.
        reversed: bool,
    },
}

/// Depths of this size and beyond are those of nothing: Blender writes 1e10, others 1e30 or the largest
/// number there is. In the file's unit.
const NOTHING: f64 = 1e10;

impl DepthKind {
    /// In words, for messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Planar => "planar depth",
            Self::Ray => "distance along rays",
            Self::Inverse => "inverse depth",
            Self::Device { .. } => "device depth",
        }
    }

    /// Fails if the kind makes no sense.
    pub(crate) fn check(&self, camera: Option<&Camera>) -> Result<(), DepthProblem> {
        let Self::Device { near, far, .. } = *self else {
            return Ok(());
        };
        // Not the negation: what is no number is no plane.
        if near > 0.0 && far > near && (far.is_finite() || !is_parallel(camera)) {
            return Ok(());
        }
        let told = |number: &dyn fmt::Display| number.to_string();
        Err(DepthProblem::NoRange {
            near: told(&near),
            far: told(&far),
        })
    }

    /// Planar depth, in the same unit, of a sample at `image`, a point of the frame (the unit square);
    /// infinite for nothing, and for what lies behind the eye. Without a camera, rays are taken for
    /// parallel to the line of sight, and the projection for a perspective.
    pub fn planar(&self, sample: f64, camera: Option<&Camera>, image: DVec2) -> f64 {
        let depth = match *self {
            Self::Planar => sample,
            // The ray's direction has z = 1, and no part aside in parallel projection.
            Self::Ray => sample / camera.map_or(1.0, |camera| camera.eye_ray(image).1.length()),
            Self::Inverse => 1.0 / sample,
            Self::Device {
                near,
                far,
                reversed,
            } => {
                let share = if reversed { 1.0 - sample } else { sample };
                if share >= 1.0 {
                    // The far plane, which is what the buffer was cleared to.
                    f64::INFINITY
                } else if is_parallel(camera) {
                    near + share * (far - near)
                } else {
                    near / (1.0 - share * (1.0 - near / far))
                }
            }
        };
        if depth > 0.0 && depth < NOTHING {
            depth
        } else {
            f64::INFINITY
        }
    }
}

fn is_parallel(camera: Option<&Camera>) -> bool {
    camera.is_some_and(|camera| matches!(camera.projection, Projection::Parallel { .. }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta_geometry::DVec3;

    fn camera(projection: Projection) -> Camera {
        let camera = Camera::looking(DVec3::ZERO, DVec3::Y, DVec3::Z, projection, 0.1);
        camera.expect("a sound camera")
    }

    fn perspective() -> Camera {
        camera(Projection::Perspective {
            tan_half_height: 0.75,
            aspect: 4.0 / 3.0,
        })
    }

    fn parallel() -> Camera {
        camera(Projection::Parallel {
            height: 2.0,
            aspect: 1.0,
        })
    }

    const CORNER: DVec2 = DVec2::ONE;

    #[test]
    fn every_kind_tells_the_same_depth() {
        let (near, far) = (0.5, 200.0);
        let z = 8.0;
        // In the corner of the frame the ray is (1, 0.75, 1) long for each metre ahead.
        let slant = (1.0_f64 + 0.75 * 0.75 + 1.0).sqrt();
        let device = |far: f64, reversed: bool| DepthKind::Device {
            near,
            far,
            reversed,
        };
        // As projection matrices make it: f (z - n) / (z (f - n)).
        let kept = far * (z - near) / (z * (far - near));
        for (kind, sample) in [
            (DepthKind::Planar, z),
            (DepthKind::Ray, z * slant),
            (DepthKind::Inverse, 1.0 / z),
            (device(far, false), kept),
            (device(far, true), 1.0 - kept),
            (device(f64::INFINITY, false), 1.0 - near / z),
            (device(f64::INFINITY, true), near / z),
        ] {
            let found = kind.planar(sample, Some(&perspective()), CORNER);
            assert!((found - z).abs() < 1e-12 * z, "{kind:?}: {found}");
        }
        let share = (z - near) / (far - near);
        for (kind, sample) in [
            (DepthKind::Planar, z),
            (DepthKind::Ray, z),
            (device(far, false), share),
            (device(far, true), 1.0 - share),
        ] {
            let found = kind.planar(sample, Some(&parallel()), CORNER);
            assert!((found - z).abs() < 1e-12 * z, "parallel, {kind:?}: {found}");
        }
    }

    #[test]
    fn what_stands_for_nothing_is_infinitely_far() {
        let device = |reversed| DepthKind::Device {
            near: 0.1,
            far: 10.0,
            reversed,
        };
        for (kind, sample) in [
            (DepthKind::Planar, 1e10),
            (DepthKind::Planar, f64::from(f32::MAX)),
            (DepthKind::Planar, f64::INFINITY),
            (DepthKind::Planar, f64::NAN),
            (DepthKind::Planar, 0.0),
            (DepthKind::Planar, -1.0),
            (DepthKind::Ray, 1e30),
            (DepthKind::Inverse, 0.0),
            (DepthKind::Inverse, -0.0),
            (device(false), 1.0),
            (device(true), 0.0),
        ] {
            let found = kind.planar(sample, Some(&perspective()), CORNER);
            assert_eq!(found, f64::INFINITY, "{kind:?} {sample}");
        }
    }

    #[test]
    fn device_depths_need_planes_that_can_be() {
        let check = |near, far, camera: Option<Camera>| {
            let reversed = false;
            let kind = DepthKind::Device {
                near,
                far,
                reversed,
            };
            kind.check(camera.as_ref()).is_ok()
        };
        assert!(check(0.1, 10.0, None) && check(0.1, f64::INFINITY, None));
        assert!(!check(0.0, 10.0, None) && !check(2.0, 1.0, None) && !check(f64::NAN, 1.0, None));
        assert!(!check(0.1, f64::INFINITY, Some(parallel())));
    }
}
