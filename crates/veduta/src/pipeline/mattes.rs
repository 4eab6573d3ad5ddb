//! Mattes: objects that hide what is behind them and are not seen themselves.

use crate::scene::Scene;
use std::borrow::Cow;
use veduta_map::{FaceId, VisibilityMap};

/// What is to be shown of a map of `scene`: all but the fragments of mattes, which have done their work
/// when visibility was found.
pub(super) fn without_mattes<'m>(scene: &Scene, map: &'m VisibilityMap) -> Cow<'m, VisibilityMap> {
    let Some(are_seen) = scene.are_seen() else {
        return Cow::Borrowed(map);
    };
    let is_seen = |face: FaceId| are_seen[map.faces.object(face).index()];
    Cow::Owned(VisibilityMap {
        camera: map.camera,
        faces: map.faces.clone(),
        opaque: map.opaque.selected(is_seen),
        veils: map.veils.selected(is_seen),
    })
}
