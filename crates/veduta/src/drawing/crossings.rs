//! Faces -> edges along which two of them pierce each other.
//!
//! Along these the planes of both are equally near. Where opaque faces are seen to pierce each other fragments end
//! there; this is for the rest.

use super::hidden::{Edge, positive};
use super::join::depth_unit;
use super::lines::{JOINED, Judge, normal_of};
use super::places::Places;
use super::{COINCIDENT, LineKind};
use rayon::prelude::*;
use veduta_geometry::{Affine, DVec2, cross};
use veduta_map::{FaceId, VisibilityMap};

/// The edges in which veils pierce one another and other faces, and in which those of `opaque` pierce one another:
/// those that `judge` takes for creases. `boxes` are those of all faces, by which `places` knows them; `unseen`
/// faces have none.
pub(super) fn edges(
    judge: &Judge,
    map: &VisibilityMap,
    places: &Places,
    boxes: &[[DVec2; 2]],
    veils: &[FaceId],
    opaque: &[FaceId],
    unseen: &[FaceId],
) -> Vec<Edge> {
    let faces = &map.faces;
    let nearness: Vec<[f64; 2]> = faces
        .ids()
        .map(|face| {
            let plane = faces.face_nearness(face);
            let corners = faces.outline(face).iter().map(|&corner| plane.at(corner));
            let start = [f64::INFINITY, f64::NEG_INFINITY];
            corners.fold(start, |[low, high], here| [low.min(here), high.max(here)])
        })
        .collect();
    let meet = |one: FaceId, other: FaceId| {
        let [[low, high], [other_low, other_high]] = [one, other].map(|face| boxes[face.index()]);
        let [range, other_range] = [one, other].map(|face| nearness[face.index()]);
        low.cmplt(other_high).all()
            && other_low.cmplt(high).all()
            && range[0] < other_range[1]
            && other_range[0] < range[1]
    };
    // Each pair once: of two alike, at the first.
    let of_face = |near: &mut Vec<u32>, &face: &FaceId| {
        places.within(boxes[face.index()], near);
        let is_veil = faces.is_veil(face);
        let others = near.iter().map(|&other| FaceId(other)).filter(|&other| {
            (faces.is_veil(other) != is_veil && is_veil
                || faces.is_veil(other) == is_veil && other > face)
                && meet(face, other)
                && unseen.binary_search(&other).is_err()
        });
        let crossing = |other| crossing(judge, map, face, other);
        others.filter_map(crossing).collect::<Vec<Edge>>()
    };
    let of_faces: Vec<Vec<Edge>> = veils
        .par_iter()
        .chain(opaque)
        .map_init(Vec::new, of_face)
        .collect();
    of_faces.into_iter().flatten().collect()
}

/// Where two faces pierce each other, if that is a crease.
fn crossing(judge: &Judge, map: &VisibilityMap, face: FaceId, other: FaceId) -> Option<Edge> {
    let faces = &map.faces;
    let planes = [face, other].map(|face| *faces.face_nearness(face));
    let nearer = planes[0].minus(&planes[1]);
    let is_pierced = |face: FaceId| {
        let outline = faces.outline(face);
        let unit = JOINED * depth_unit(&map.camera, faces.face_nearness(face).at(outline[0]));
        let on_side = |sign: f64| {
            outline
                .iter()
                .any(|&corner| sign * nearer.at(corner) > unit)
        };
        // Neighbours, and what stands on a face, have corners on one side only.
        on_side(1.0) && on_side(-1.0)
    };
    if !is_pierced(face) || !is_pierced(other) {
        return None;
    }
    let [from, to] = within(faces.outline(other), across(faces.outline(face), &nearer)?)?;
    let [one, two] = planes.map(|plane| normal_of(&map.camera, &plane));
    if !judge.is_crease([face, other], one.angle_between(two)) {
        return None;
    }
    // The flatter: steep planes multiply rounding.
    let [slope, other_slope] = planes.map(|plane| plane.a.hypot(plane.b));
    Some(Edge {
        kind: LineKind::Crease,
        from,
        to,
        nearness: planes[usize::from(other_slope < slope)],
        is_of_veil: faces.is_veil(face) || faces.is_veil(other),
    })
}

/// The segment of a convex polygon in which a function is zero, if it changes its sign there.
fn across(outline: &[DVec2], function: &Affine) -> Option<[DVec2; 2]> {
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    let mut zeros = sides.filter_map(|(&from, &to)| {
        let (start, end) = (function.at(from), function.at(to));
        ((start > 0.0) != (end > 0.0)).then(|| from.lerp(to, start / (start - end)))
    });
    Some([zeros.next()?, zeros.next()?])
}

/// The part of a segment within a convex polygon.
fn within(outline: &[DVec2], [from, to]: [DVec2; 2]) -> Option<[DVec2; 2]> {
    let mut part = [0.0, 1.0];
    for (&start, &end) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let along = end - start;
        let distance = |point: DVec2| cross(along, point - start) - COINCIDENT * along.length();
        part = positive(part, distance(from), distance(to))?;
    }
    Some(part.map(|share| from.lerp(to, share)))
}
