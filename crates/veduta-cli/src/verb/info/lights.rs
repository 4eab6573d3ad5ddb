//! What lights a model brings.

use crate::talk::plain;
use serde_json::{Value, json};
use std::fmt::Write;
use veduta::scene::{Light, LightKind};
use veduta_geometry::DVec3;

/// Angles are in degrees from the axis of the cone, lengths in metres; a range of null has no end.
pub fn as_json(light: &Light) -> Value {
    let mut told = json!({
        "name": light.name,
        "kind": kind(light.kind),
        "color": light.color,
    });
    let position = light.position().to_array();
    let direction = light.direction().to_array();
    let finite = |range: f32| range.is_finite().then_some(range);
    match light.kind {
        LightKind::Directional { illuminance } => {
            told["illuminance"] = illuminance.into();
            told["direction"] = json!(direction);
        }
        LightKind::Point { intensity, range } => {
            told["intensity"] = intensity.into();
            told["range"] = finite(range).into();
            told["position"] = json!(position);
        }
        LightKind::Spot {
            intensity,
            range,
            inner_angle,
            outer_angle,
        } => {
            told["intensity"] = intensity.into();
            told["range"] = finite(range).into();
            told["position"] = json!(position);
            told["direction"] = json!(direction);
            told["innerAngle"] = degrees(inner_angle).into();
            told["outerAngle"] = degrees(outer_angle).into();
        }
    }
    told
}

/// Appends a line.
pub fn write(light: &Light, text: &mut String) -> std::fmt::Result {
    let (name, kind) = (plain(&light.name), kind(light.kind));
    write!(text, "    {name}  {kind}, ")?;
    match light.kind {
        LightKind::Directional { illuminance } => write!(text, "{illuminance} lx")?,
        LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => {
            write!(text, "{intensity} cd")?;
        }
    }
    let [r, g, b] = light.color;
    write!(text, ", colour {r:.3} {g:.3} {b:.3}")?;
    let (position, direction) = (light.position(), light.direction());
    match light.kind {
        LightKind::Directional { .. } => write_vector(", shines along", direction, "", text)?,
        LightKind::Point { range, .. } => {
            write_vector(", at", position, " m", text)?;
            write_range(range, text)?;
        }
        LightKind::Spot {
            range,
            inner_angle,
            outer_angle,
            ..
        } => {
            write_vector(", at", position, " m", text)?;
            write_vector(", shines along", direction, "", text)?;
            write_range(range, text)?;
            let [inner, outer] = [inner_angle, outer_angle].map(degrees);
            write!(
                text,
                ", full to {inner:.1}deg from its axis, none from {outer:.1}deg"
            )?;
        }
    }
    writeln!(text)
}

fn write_vector(what: &str, vector: DVec3, unit: &str, text: &mut String) -> std::fmt::Result {
    // Without the sign of a zero, which rotations leave.
    let DVec3 { x, y, z } = (vector * 1000.0).round() / 1000.0 + 0.0;
    write!(text, "{what} {x}, {y}, {z}{unit}")
}

fn write_range(range: f32, text: &mut String) -> std::fmt::Result {
    if range.is_finite() {
        write!(text, ", reaches {range} m")
    } else {
        Ok(())
    }
}

fn kind(kind: LightKind) -> &'static str {
    match kind {
        LightKind::Directional { .. } => "directional",
        LightKind::Point { .. } => "point",
        LightKind::Spot { .. } => "spot",
    }
}

/// In f64, so that the angle of a file in radians comes out as it was meant.
fn degrees(radians: f32) -> f64 {
    f64::from(radians).to_degrees()
}
