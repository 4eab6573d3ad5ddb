use serde::{Deserialize, Serialize};
use veduta_geometry::{DMat4, DVec3};

/// A light of the scene.
///
/// Photometric units, as in KHR_lights_punctual: the unit belongs to the colour (1, 1, 1), and each
/// channel is scaled by its own factor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name that no other light of the scene has.
    pub name: String,
    /// Linear Rec.709, at least 0; a factor of the kind's illuminance or intensity.
    pub color: [f32; 3],
    /// What sends the light out, and how much.
    pub kind: LightKind,
    /// Rigid motion: the light stands at its own origin and shines along its -Z, +Y up.
    pub world_from_light: DMat4,
}

/// What sends light out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// Parallel rays from infinitely far away, like the sun's.
    Directional {
        /// On a surface that faces the light, in lux.
        illuminance: f32,
    },
    /// A point that shines evenly in all directions.
    Point {
        /// Luminous intensity in candela.
        intensity: f32,
        /// Distance in metres beyond which nothing is lit; infinite for none.
        #[serde(with = "perhaps_infinite")]
        range: f32,
    },
    /// A point that shines into a cone.
    Spot {
        /// Luminous intensity within the inner cone, in candela.
        intensity: f32,
        /// Distance in metres beyond which nothing is lit; infinite for none.
        #[serde(with = "perhaps_infinite")]
        range: f32,
        /// Angle in radians from the axis to where the light begins to fall off; at least 0.
        inner_angle: f32,
        /// Angle in radians from the axis to where nothing is left of it: more than `inner_angle`,
        /// at most π/2.
        outer_angle: f32,
    },
}

impl Light {
    /// Where the light stands, in world space; of no meaning for a directional one.
    pub fn position(&self) -> DVec3 {
        self.world_from_light.w_axis.truncate()
    }

    /// Unit vector along which the light shines, in world space; of no meaning for a point.
    pub fn direction(&self) -> DVec3 {
        -self.world_from_light.z_axis.truncate()
    }
}

/// JSON has no infinity: it is left out.
mod perhaps_infinite {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
        value.is_finite().then_some(value).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f32::INFINITY))
    }
}
