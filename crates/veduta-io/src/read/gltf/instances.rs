//! Instances: a node's mesh in many places.
//!
//! EXT_mesh_gpu_instancing. Attributes other than the places are not looked at.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::document::{Document, Instances};
use super::{Fault, Problem};
use crate::read::budget::Budget;
use veduta::scene::Object;
use veduta_geometry::{DMat4, DQuat, DVec3};

/// Where the instances stand, in the space of their node. Each is charged as an object with a name
/// of `name_length` bytes; `at` is the node's path.
pub fn places(
    document: &Document,
    buffers: &Buffers<'_>,
    instances: &Instances,
    budget: &mut Budget,
    name_length: usize,
    at: &str,
) -> Result<Vec<DMat4>, Fault> {
    let at = format!("{at}.extensions.EXT_mesh_gpu_instancing.attributes");
    let mut count = None;
    let mut find = |name: &str, shapes| {
        let Some(&index) = instances.attributes.get(name) else {
            return Ok(None);
        };
        let at = format!("{at}.{name}");
        let elements = Elements::find(document, buffers, index, shapes, &at)?;
        let expected = *count.get_or_insert(elements.count);
        if elements.count != expected {
            return Err(Problem::Illegal {
                found: format!("{} elements, where others have {expected}", elements.count),
                expected: "one element for each instance",
            }
            .at_json(at));
        }
        Ok(Some(elements))
    };
    let translations = find("TRANSLATION", "VEC3")?;
    let rotations = find("ROTATION", "VEC4")?;
    let scales = find("SCALE", "VEC3")?;
    let Some(count) = count else {
        let problem = Problem::Lacks("TRANSLATION, ROTATION or SCALE");
        return Err(problem.at_json(at));
    };
    let row_bytes = size_of::<Object>() + size_of::<DMat4>() + name_length + 3 * 12;
    let charged = budget.charge(count, row_bytes);
    charged.map_err(|problem| problem.at_json(&at))?;

    let translations = translations.map(|elements| elements.vectors(None, |v: [f32; 3]| v));
    let rotations = rotations.map(|elements| elements.vectors(None, |v: [f32; 4]| v));
    let scales = scales.map(|elements| elements.vectors(None, |v: [f32; 3]| v));
    (0..count as usize)
        .map(|index| {
            let vector = |table: &Option<Vec<[f32; 3]>>, default| {
                let row = table.as_ref().map(|rows| rows[index].map(f64::from));
                row.map_or(default, DVec3::from_array)
            };
            let rotation = match &rotations {
                None => DQuat::IDENTITY,
                Some(rows) => {
                    let quaternion = DQuat::from_array(rows[index].map(f64::from));
                    let length = quaternion.length();
                    if !(length > 0.0 && length.is_finite()) {
                        let found = format!("{:?} at instance {index}", rows[index]);
                        let expected = "a quaternion of length 1";
                        let problem = Problem::Illegal { found, expected };
                        return Err(problem.at_json(format!("{at}.ROTATION")));
                    }
                    quaternion / length
                }
            };
            Ok(DMat4::from_scale_rotation_translation(
                vector(&scales, DVec3::ONE),
                rotation,
                vector(&translations, DVec3::ZERO),
            ))
        })
        .collect()
}
