//! The light of a scene that brings none: a sun and a plain sky.

use veduta_geometry::Vec3;

/// Light that falls on a surface from a distant sun and from a sky that knows nothing but up and down.
///
/// Quantities are irradiance / π, linear Rec.709: the radiance of a perfectly white matt surface in
/// that light. A scale of 1 is the white of the picture; absolute units come with light sources.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Daylight {
    /// Unit vector towards the sun, in world space.
    pub to_sun: Vec3,
    /// From the sun, on a surface that faces it.
    pub sun: Vec3,
    /// From the sky, on a surface that faces up.
    pub sky: Vec3,
    /// From the ground, on a surface that faces down.
    pub ground: Vec3,
}

impl Default for Daylight {
    /// A warm sun from the upper left of a model's front, which is -Y, and a cool sky. The framing
    /// camera sees the front lit and the right side in shade.
    fn default() -> Self {
        Self {
            to_sun: Vec3::new(-0.5, -0.65, 0.8).normalize(),
            sun: Vec3::new(0.84, 0.78, 0.68),
            sky: Vec3::new(0.34, 0.40, 0.48),
            ground: Vec3::new(0.17, 0.155, 0.14),
        }
    }
}

impl Daylight {
    /// Radiance of a white matt surface with unit normal `normal` in world space.
    ///
    /// The sky term is the irradiance of two uniform half-spheres, the share of the upper one being
    /// (1 + cos θ) / 2 for a normal at the angle θ from up.
    #[inline]
    pub fn on(&self, normal: Vec3) -> Vec3 {
        let upper = 0.5 + 0.5 * normal.z;
        let around = self.ground + (self.sky - self.ground) * upper;
        around + self.sun * normal.dot(self.to_sun).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_turned_from_the_sun_gets_the_sky_only() {
        let light = Daylight::default();
        let away = light.on(-light.to_sun);
        let upper = 0.5 - 0.5 * light.to_sun.z;
        assert_eq!(away, light.ground + (light.sky - light.ground) * upper);
        assert!(light.on(light.to_sun).min_element() > away.max_element());
    }

    #[test]
    fn no_white_surface_is_much_brighter_than_white() {
        let light = Daylight::default();
        for step in 0..1000 {
            let angle = step as f32 * 0.1;
            let z = step as f32 / 500.0 - 1.0;
            let flat = (1.0 - z * z).sqrt();
            let normal = Vec3::new(flat * angle.cos(), flat * angle.sin(), z);
            assert!(light.on(normal).max_element() < 1.2);
        }
    }
}
