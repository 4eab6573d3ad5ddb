use veduta_geometry::{DMat3, DVec3};

/// How a view is turned in the dome's world.
///
/// That world is right-handed: +X is right, +Y up and -Z forward, as seen by someone who looks to the front. It is
/// the convention of cube maps and panoramas. Scenes have Z up and +Y to the north: [`dome_from_scene`] has north
/// become the front and east the right side, so that yaw is an azimuth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// What is to the right, up and forward in the view; unit vectors, orthogonal, `right x up = -forward`.
    axes: [DVec3; 3],
}

impl Default for Orientation {
    /// To the front, upright.
    fn default() -> Self {
        Self::from_angles(0.0, 0.0, 0.0)
    }
}

impl Orientation {
    /// Turned to the right by `yaw`, then upwards by `elevation`, then clockwise around its axis by `roll`.
    ///
    /// All in radians. A camera rolled clockwise sees an upright world turned the other way. At an elevation of
    /// 90 degrees the lower side of the picture is towards the front, as in fulldome.
    pub fn from_angles(yaw: f64, elevation: f64, roll: f64) -> Self {
        let (sin, cos) = yaw.sin_cos();
        let (up, level) = elevation.sin_cos();
        let forward = DVec3::new(sin * level, up, -cos * level);
        let right = DVec3::new(cos, 0.0, sin);
        let up = right.cross(forward);
        let (sin, cos) = roll.sin_cos();
        Self {
            axes: [cos * right - sin * up, sin * right + cos * up, forward],
        }
    }

    /// With `forward` in the middle and `up` upwards in the picture; lengths do not matter.
    ///
    /// `None` if the two are parallel, or a number is not finite.
    pub fn looking(forward: DVec3, up: DVec3) -> Option<Self> {
        let forward = forward.try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        Some(Self {
            axes: [right, right.cross(forward), forward],
        })
    }

    /// What is to the right in the view.
    pub fn right(&self) -> DVec3 {
        self.axes[0]
    }

    /// What is up in the view.
    pub fn up(&self) -> DVec3 {
        self.axes[1]
    }

    /// The view's axis.
    pub fn forward(&self) -> DVec3 {
        self.axes[2]
    }

    /// The view turned with the world: `self` is told in a frame that is itself turned as `frame` says.
    pub fn within(&self, frame: &Self) -> Self {
        // The frame's own axes are right, up and backward.
        let axes = self
            .axes
            .map(|axis| frame.world_from_view(DVec3::new(axis.x, axis.y, -axis.z)));
        Self { axes }
    }

    /// World direction from one in the view (right, up, forward).
    #[inline]
    pub fn world_from_view(&self, view: DVec3) -> DVec3 {
        DMat3::from_cols(self.axes[0], self.axes[1], self.axes[2]) * view
    }

    /// Direction in the view (right, up, forward) from one in the world.
    #[inline]
    pub fn view_from_world(&self, world: DVec3) -> DVec3 {
        DVec3::from(self.axes.map(|axis| axis.dot(world)))
    }
}

/// Direction in the dome's world from one of a scene, whose Z is up and whose +Y is north, the dome's front.
pub fn dome_from_scene(direction: DVec3) -> DVec3 {
    DVec3::new(direction.x, direction.z, -direction.y)
}

/// Direction in a scene from one of the dome's world: the inverse of [`dome_from_scene`].
pub fn scene_from_dome(direction: DVec3) -> DVec3 {
    DVec3::new(direction.x, -direction.z, direction.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-15
    }

    #[test]
    fn yaw_turns_to_the_right_and_elevation_upwards() {
        let right = Orientation::from_angles(FRAC_PI_2, 0.0, 0.0);
        assert!(near(right.forward(), DVec3::X));
        assert!(near(right.up(), DVec3::Y));
        let up = Orientation::from_angles(0.0, FRAC_PI_2, 0.0);
        assert!(near(up.forward(), DVec3::Y));
        // The front is at the lower side, the right stays right.
        assert!(near(up.up(), DVec3::Z));
        assert!(near(up.right(), DVec3::X));
    }

    #[test]
    fn a_clockwise_roll_brings_the_top_of_the_view_to_the_right() {
        let rolled = Orientation::from_angles(0.0, 0.0, FRAC_PI_2);
        assert!(near(rolled.up(), DVec3::X));
        assert!(near(rolled.right(), -DVec3::Y));
    }

    #[test]
    fn looking_and_angles_agree() {
        for (yaw, elevation) in [(0.0, 0.0), (2.0, 0.5), (-1.0, -1.2)] {
            let angles = Orientation::from_angles(yaw, elevation, 0.0);
            let looking = Orientation::looking(7.0 * angles.forward(), DVec3::Y).expect("not up");
            for (a, b) in angles.axes.into_iter().zip(looking.axes) {
                assert!(near(a, b), "{yaw} {elevation}: {a} {b}");
            }
        }
        assert!(Orientation::looking(DVec3::Y, DVec3::Y).is_none());
    }

    #[test]
    fn a_view_within_a_turned_frame_turns_with_it() {
        let frame = Orientation::from_angles(0.3, 0.0, 0.0);
        let view = Orientation::from_angles(0.5, 0.2, 0.1);
        let both = Orientation::from_angles(0.8, 0.2, 0.1);
        for (a, b) in view.within(&frame).axes.into_iter().zip(both.axes) {
            assert!((a - b).length() < 1e-15, "{a} {b}");
        }
    }

    #[test]
    fn north_is_the_front_and_the_zenith_up() {
        assert_eq!(dome_from_scene(DVec3::Y), -DVec3::Z);
        assert_eq!(dome_from_scene(DVec3::Z), DVec3::Y);
        let any = DVec3::new(0.1, 0.2, 0.3);
        assert_eq!(scene_from_dome(dome_from_scene(any)), any);
    }
}
