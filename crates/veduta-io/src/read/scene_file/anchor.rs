//! Georeferenced models -> their places in the scene.

use super::document::Document;
use super::layer::{Part, PlannedLayer};
use super::source::Faults;
use veduta::geometry::{DMat4, DVec3};
use veduta::scene::World;

/// Moves the parts that are somewhere on Earth to their places relative to the scene's origin, and
/// tells what that is.
///
/// Without a coordinate system in the file, that of the only georeferenced part is the scene's.
/// Nothing is reprojected: parts in another coordinate system are refused.
pub fn anchor(
    document: &Document,
    layers: &[PlannedLayer<'_>],
    parts: &mut [Part],
    faults: &mut Faults,
) -> World {
    let told = document.world.as_ref().and_then(|world| {
        let world = &world.value;
        let origin = world.origin.as_ref();
        Some(World {
            crs: Some(world.crs.as_ref()?.value.0.clone()),
            origin: origin.map_or(DVec3::ZERO, |origin| origin.value.0),
            vertical_datum: world
                .vertical_datum
                .as_ref()
                .map(|datum| datum.value.0.clone()),
        })
    });
    let is_told = told.is_some();
    let mut world = told.unwrap_or_default();
    let mut first: Option<&str> = None;
    for (layer, part) in layers.iter().zip(parts) {
        let own = &part.loaded.scene.world;
        let Some(crs) = &own.crs else {
            continue;
        };
        let name = layer.name;
        if layer.has_instances() {
            faults.senseless(
                layer.model_span.clone(),
                format!(
                    "the model of layer {name:?} has its place on Earth ({crs}), so that it cannot \
                     have `instances`"
                ),
            );
            continue;
        }
        if first.is_none() && !is_told {
            world = own.clone();
        } else if !is_told && *own != world {
            let [x, y, z] = world.origin.to_array();
            faults.senseless(
                layer.model_span.clone(),
                format!(
                    "layers {:?} and {name:?} are somewhere on Earth, each with its own origin; say \
                     which is the scene's: add [world] with crs = {:?}, origin = [{x}, {y}, {z}]",
                    first.unwrap_or_default(),
                    world.crs.as_deref().unwrap_or_default(),
                ),
            );
        }
        first = first.or(Some(name));
        let scene_crs = world.crs.as_deref().unwrap_or_default();
        if !same_crs(crs, scene_crs) {
            faults.senseless(
                layer.model_span.clone(),
                format!(
                    "layer {name:?} is in the coordinate system {crs:?}, the scene in \
                     {scene_crs:?}; reproject the model, for nothing is reprojected here"
                ),
            );
        }
        if let (Some(a), Some(b)) = (&own.vertical_datum, &world.vertical_datum)
            && !a.eq_ignore_ascii_case(b)
        {
            faults.senseless(
                layer.model_span.clone(),
                format!("layer {name:?} counts its heights from {a:?}, the scene from {b:?}"),
            );
        }
        let offset = DMat4::from_translation(own.origin - world.origin);
        for (_, place) in &mut part.places {
            *place = offset * *place;
        }
    }
    world
}

/// Whether two names mean one coordinate system: `EPSG:7415`,
/// `https://www.opengis.net/def/crs/EPSG/0/7415` and `urn:ogc:def:crs:EPSG::7415` do.
fn same_crs(a: &str, b: &str) -> bool {
    authority_and_code(a) == authority_and_code(b)
}

fn authority_and_code(name: &str) -> (String, String) {
    let name = name.trim().to_ascii_lowercase();
    let parts: Vec<&str> = match (
        name.strip_prefix("urn:ogc:def:crs:"),
        name.split_once("opengis.net/def/crs/"),
    ) {
        (Some(rest), _) => rest.split(':').collect(),
        (_, Some((_, rest))) => rest.split('/').collect(),
        _ => name.split(':').collect(),
    };
    match parts[..] {
        // With a version in the middle, which may be empty or 0.
        [authority, code] | [authority, _, code] => (authority.into(), code.into()),
        _ => (String::new(), name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_ways_to_write_a_coordinate_system_are_one() {
        let names = [
            "EPSG:7415",
            "epsg:7415",
            "https://www.opengis.net/def/crs/EPSG/0/7415",
            "http://www.opengis.net/def/crs/EPSG/0/7415",
            "urn:ogc:def:crs:EPSG::7415",
        ];
        for name in names {
            assert!(same_crs(name, names[0]), "{name}");
        }
        assert!(!same_crs("EPSG:28992", "EPSG:7415"));
        assert!(same_crs("local grid", "Local grid"));
        assert!(!same_crs("local grid", "other grid"));
    }
}
