//! Lights of the model: KHR_lights_punctual.

use super::document::Light as LightRow;
use std::f32::consts::FRAC_PI_2;
use veduta::scene::LightKind;
use veduta_geometry::{DMat3, DMat4, DVec3};

/// What the light sends out, and its place. It shines along the node's -Z; the node's scale changes
/// neither its range nor its strength.
///
/// # Errors
/// A sentence for a warning: a model is not lost with its light.
pub fn place(row: &LightRow, world_from_node: &DMat4) -> Result<(LightKind, DMat4), String> {
    let sound = |number: f32| number.is_finite() && number >= 0.0;
    if !(sound(row.intensity) && row.color.into_iter().all(sound)) {
        return Err("has a colour or an intensity that is negative or not finite".into());
    }
    let range = row.range.unwrap_or(f32::INFINITY);
    if range.is_nan() || range <= 0.0 {
        return Err(format!("has the range {range}, expected more than 0"));
    }
    let intensity = row.intensity;
    let kind = match row.kind.as_str() {
        "directional" => LightKind::Directional {
            illuminance: intensity,
        },
        "point" => LightKind::Point { intensity, range },
        "spot" => {
            let (inner, outer) = (row.spot.inner_cone_angle, row.spot.outer_cone_angle);
            // Single precision may round π/2 up.
            if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2 * (1.0 + f32::EPSILON)) {
                let found = format!("has cones of {inner} and {outer}");
                return Err(format!("{found}, expected 0 <= inner < outer <= pi/2"));
            }
            LightKind::Spot {
                intensity,
                range,
                inner_angle: inner,
                outer_angle: outer.min(FRAC_PI_2),
            }
        }
        other => {
            let start: String = other.chars().take(16).collect();
            return Err(format!("is of type {start:?}, which is not known"));
        }
    };
    let position = world_from_node.w_axis.truncate();
    if !position.is_finite() {
        return Err("stands where its node's transform is not finite".into());
    }
    let rotation = match (frame(world_from_node), kind) {
        (Some(rotation), _) => rotation,
        (None, LightKind::Point { .. }) => DMat3::IDENTITY,
        (None, _) => return Err("has no direction under its node's transform".into()),
    };
    let world_from_light = DMat4::from_mat3_translation(rotation, position);
    Ok((kind, world_from_light))
}

/// The rotation that keeps the transform's Z, and its Y as far as that is at right angles to Z.
fn frame(transform: &DMat4) -> Option<DMat3> {
    let z = transform.transform_vector3(DVec3::Z).try_normalize()?;
    let y = transform.transform_vector3(DVec3::Y).try_normalize()?;
    let x = y.cross(z).try_normalize()?;
    Some(DMat3::from_cols(x, z.cross(x), z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_keeps_its_direction_under_any_scale() {
        let row = LightRow {
            name: None,
            color: [1.0; 3],
            intensity: 5.0,
            kind: "spot".into(),
            range: None,
            spot: Default::default(),
        };
        let turn = DMat4::from_rotation_x(-0.5);
        let node = DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0))
            * DMat4::from_scale(DVec3::new(-2.0, 1.0, 7.0))
            * turn;
        let (kind, world_from_light) = place(&row, &node).expect("a sound light");
        let LightKind::Spot { range, .. } = kind else {
            panic!("{kind:?}");
        };
        assert_eq!(range, f32::INFINITY);
        let expected = node.transform_vector3(-DVec3::Z).normalize();
        let found = world_from_light.transform_vector3(-DVec3::Z);
        assert!((found - expected).length() < 1e-12, "{found}");
        assert!((world_from_light.determinant() - 1.0).abs() < 1e-12);
        let flat = DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0));
        assert!(place(&row, &flat).is_err());
    }
}
