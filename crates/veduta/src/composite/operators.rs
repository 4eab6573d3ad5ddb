use super::cover::{Keep, cover};
use super::pieced::Pieced;
use super::unite::{CompositeError, Union, check_alike, composite, refuse_guests};
use veduta_map::{FaceId, Seen, SeenScene};

/// What becomes of a map A where another one, B, covers and where it does not. Depth plays no part.
///
/// A map covers where it shows something, opaque or not. What is a matte shows nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// A where B covers.
    In,
    /// A where B does not.
    Out,
    /// A where B covers, on B.
    Atop,
}

/// `map` in, out of or atop the maps `others`, which are seen together.
///
/// # Errors
/// As for [`composite`]; indices count `map` first. None may have guests.
pub fn operate(
    map: &SeenScene,
    operator: Operator,
    others: &[SeenScene],
) -> Result<SeenScene, CompositeError> {
    let all: Vec<&SeenScene> = std::iter::once(map).chain(others).collect();
    refuse_guests(all.iter().copied(), 0)?;
    check_alike(&all)?;
    let others = composite(others)?;
    let union = Union::of([map, &others].into_iter())?;
    let [own, other] = [0, 1];
    let seen = match operator {
        Operator::In => cut(&union, own, other, Keep::Inside, |_| true),
        Operator::Out => cut(&union, own, other, Keep::Outside, |_| true),
        Operator::Atop => {
            let front = cut(&union, own, other, Keep::Inside, |_| true);
            // Under what is not opaque the other one shows.
            let rest = cut(&union, other, own, Keep::Outside, |face| {
                !union.faces.is_veil(face)
            });
            both(&front, &rest)
        }
    };
    Ok(union.into_seen(seen, true))
}

/// `front` with `background` behind all of it, whatever the depth.
///
/// # Errors
/// As for [`composite`]. Neither may have guests.
pub fn lay_on(front: &SeenScene, background: &SeenScene) -> Result<SeenScene, CompositeError> {
    refuse_guests([front, background], 0)?;
    let union = Union::of([front, background].into_iter())?;
    let [own, other] = [0, 1];
    let behind = cut(&union, other, own, Keep::Outside, |face| {
        !union.faces.is_veil(face)
    });
    let seen = both(&union.maps[own], &behind);
    // Holes that mattes leave show the background, as they show a picture. So mattes are done with.
    let seen = match union.scene().are_seen() {
        Some(are_seen) => {
            let is_seen = |face: FaceId| are_seen[union.faces.object(face).index()];
            Seen {
                opaque: seen.opaque.selected(is_seen),
                veils: seen.veils.selected(is_seen),
            }
        }
        None => seen,
    };
    Ok(union.into_seen(seen, true))
}

/// What lies of map `of` inside or outside what map `by` covers with the faces that `covers` accepts.
fn cut(
    union: &Union,
    of: usize,
    by: usize,
    keep: Keep,
    covers: impl Fn(FaceId) -> bool + Sync,
) -> Seen {
    let mut is_of = vec![false; union.faces.len()];
    for face in &union.new_ids[by] {
        is_of[face.index()] = true;
    }
    let are_seen = union.scene().are_seen();
    let is_cover = |face: FaceId| {
        let is_seen = |of: &Vec<bool>| of[union.faces.object(face).index()];
        is_of[face.index()] && covers(face) && are_seen.as_ref().is_none_or(is_seen)
    };
    let aspect = union.camera.aspect();
    // Only fragments tell where a face is that mattes may hide.
    let has_holes = union.has_holes[by] || are_seen.is_some();
    if !has_holes {
        // Of a map without holes the faces cover what their fragments do.
        let shown = shown(&union.maps[by], union.faces.len());
        let is_cover = |face: FaceId| shown[face.index()] && is_cover(face);
        return cover(&union.faces, &union.maps[of], is_cover, keep, aspect);
    }
    let mut holes = vec![false; union.maps.len()];
    holes[by] = true;
    let pieced = Pieced::new(&union.faces, &union.maps, &holes);
    let is_cover = |face: FaceId| is_cover(pieced.origin(face));
    let seen = cover(&pieced.faces, &pieced.maps[of], is_cover, keep, aspect);
    pieced.put_together(&seen)
}

/// Which faces have fragments.
fn shown(seen: &Seen, faces: usize) -> Vec<bool> {
    let mut shown = vec![false; faces];
    for fragment in seen.opaque.iter().chain(seen.veils.iter()) {
        shown[fragment.face().index()] = true;
    }
    shown
}

/// What is seen in two maps that do not cover each other.
fn both(one: &Seen, other: &Seen) -> Seen {
    Seen {
        opaque: one.opaque.with(&other.opaque),
        veils: one.veils.with(&other.veils),
    }
}
