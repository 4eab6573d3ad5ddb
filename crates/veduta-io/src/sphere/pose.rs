//! How something is turned in the world of the viewer.

use veduta::geometry::{DMat3, DVec3};

/// Angles in radians by which a camera, or a view of a rig, is turned: first rolled, then pitched, then
/// yawed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// To the right.
    pub yaw: f64,
    /// Upwards.
    pub pitch: f64,
    /// Clockwise, as the camera is turned, seen from behind it.
    pub roll: f64,
}

impl Pose {
    /// The axes of what is turned: to its right, upwards, forward; in components to the right, upwards and
    /// forward of the viewer.
    pub fn axes(self) -> [DVec3; 3] {
        let matrix = self.viewer_from_own();
        [matrix.x_axis, matrix.y_axis, matrix.z_axis]
    }

    /// The rotation from components of what is turned to those of the viewer; all of them to the right,
    /// upwards and forward, in this order, which is left-handed.
    pub fn viewer_from_own(self) -> DMat3 {
        let ([sin_y, cos_y], [sin_p, cos_p], [sin_r, cos_r]) =
            (sin_cos(self.yaw), sin_cos(self.pitch), sin_cos(self.roll));
        let yawed = DMat3::from_cols(
            DVec3::new(cos_y, 0.0, -sin_y),
            DVec3::Y,
            DVec3::new(sin_y, 0.0, cos_y),
        );
        let pitched = DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.0, cos_p, -sin_p),
            DVec3::new(0.0, sin_p, cos_p),
        );
        let rolled = DMat3::from_cols(
            DVec3::new(cos_r, -sin_r, 0.0),
            DVec3::new(sin_r, cos_r, 0.0),
            DVec3::Z,
        );
        yawed * pitched * rolled
    }

    /// For `worldToCamera` of OpenEXR: rows of the matrix that vectors stand to the left of; x right, y up,
    /// z forward.
    #[cfg(feature = "exr")]
    pub(crate) fn world_to_camera(self) -> [f32; 16] {
        // The inverse of a rotation is its transpose, and row vectors transpose once more.
        let [right, up, forward] = self.axes().map(|axis| axis.as_vec3().to_array());
        let row = |k: usize| [right[k], up[k], forward[k], 0.0];
        let rows = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
        std::array::from_fn(|k| rows[k / 4][k % 4])
    }
}

/// Sine and cosine; whole quarters of a turn give whole numbers, so that level views lie exactly.
fn sin_cos(angle: f64) -> [f64; 2] {
    let quarters = angle / std::f64::consts::FRAC_PI_2;
    if quarters.fract() != 0.0 {
        return [angle.sin(), angle.cos()];
    }
    match quarters.rem_euclid(4.0) as u8 {
        0 => [0.0, 1.0],
        1 => [1.0, 0.0],
        2 => [0.0, -1.0],
        _ => [-1.0, 0.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn angles_turn_to_the_right_upwards_and_clockwise() {
        let axes = |yaw, pitch, roll| Pose { yaw, pitch, roll }.axes();
        let [right, up, forward] = axes(0.0, 0.0, 0.0);
        assert_eq!([right, up, forward], [DVec3::X, DVec3::Y, DVec3::Z]);
        assert_eq!(axes(FRAC_PI_2, 0.0, 0.0)[2], DVec3::X);
        assert_eq!(axes(0.0, FRAC_PI_2, 0.0)[2], DVec3::Y);
        // The head leans to the right.
        assert_eq!(axes(0.0, 0.0, FRAC_PI_2)[1], DVec3::X);
        // Yaw is about what is upright, whatever the pitch.
        let [_, up, forward] = axes(FRAC_PI_2, FRAC_PI_2, 0.0);
        assert_eq!((forward, up), (DVec3::Y, -DVec3::X));
    }
}
