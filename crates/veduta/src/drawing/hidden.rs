//! Hidden edges -> segments.
//!
//! What is hidden is no fragment, so this looks at faces: all that are in the map's table. Edges are the
//! sides of their outlines; what an edge is, its faces tell, as for lines that are seen.
//!
//! Each edge is hidden where some face covers it that is nearer there. Along an edge the distances from a
//! face's sides and the difference of two nearnesses are affine functions, so that each face hides one
//! interval, and what is hidden is their union (Appel, "The notion of quantitative invisibility", 1967,
//! without the bookkeeping that saves looking at faces again).

use super::lines::{JOINED, Judge, normal_of};
use super::places::{Places, box_around};
use super::{COINCIDENT, LineKind, is_on_frame};
use rayon::prelude::*;
use veduta_geometry::{Affine, DVec2, cross};
use veduta_map::{FaceId, Faces, VisibilityMap};

/// Gaps in what hides an edge, and hidden parts, that are not looked at: shares of the frame. Where faces
/// share a side that crosses the edge, rounding leaves gaps.
const NEGLIGIBLE_LENGTH: f64 = 1e-10;

/// How near to an edge, as a share of the frame, faces are looked at: more than rounding is enough.
const NEARBY: f64 = 1e-9;

/// An edge of a face as it is seen, or would be.
#[derive(Clone, Copy)]
struct Edge {
    from: DVec2,
    to: DVec2,
    /// Nearness along it.
    nearness: Affine,
}

/// Where edges of the kinds that `judge` looks for are hidden: segments in the image plane.
pub(super) fn segments(judge: &Judge, map: &VisibilityMap) -> Vec<[DVec2; 2]> {
    let faces = (0..map.faces.len() as u32).map(FaceId);
    let boxes: Vec<_> = faces
        .map(|face| box_around(map.faces.outline(face)))
        .collect();
    let places = Places::new(boxes.into_iter());
    let edges = edges(judge, map, &places);
    let of_edges: Vec<Vec<[DVec2; 2]>> = edges
        .par_iter()
        .map_init(Vec::new, |near, edge| {
            places.along(edge.from, edge.to, NEARBY, near);
            hidden_parts(map, edge, near)
        })
        .collect();
    of_edges.into_iter().flatten().collect()
}

/// A side of a face's outline.
#[derive(Clone, Copy)]
struct Side {
    /// Its ends, the smaller by (x, y) first: equal to the bit for neighbours.
    ends: [DVec2; 2],
    face: FaceId,
    /// Whether it runs from the first of its ends to the other, which tells on which side the face lies.
    forth: bool,
    /// Nearness of the face in the middle.
    nearness: f64,
}

/// The edges of the kinds that are looked for.
fn edges(judge: &Judge, map: &VisibilityMap, places: &Places) -> Vec<Edge> {
    let faces = &map.faces;
    let sides_of = |face: FaceId| {
        let outline = faces.outline(face);
        let plane = faces.face_nearness(face);
        (0..outline.len()).filter_map(move |k| {
            let [from, to] = [outline[k], outline[(k + 1) % outline.len()]];
            if from == to || is_on_frame([from, to]) {
                return None;
            }
            let forth = (from.x, from.y) <= (to.x, to.y);
            Some(Side {
                ends: if forth { [from, to] } else { [to, from] },
                face,
                forth,
                nearness: plane.at(0.5 * (from + to)),
            })
        })
    };
    let mut sides: Vec<Side> = (0..faces.len() as u32)
        .into_par_iter()
        .map(FaceId)
        .filter(|&face| !faces.is_veil(face))
        .flat_map_iter(sides_of)
        .collect();
    let place = |side: &Side| side.ends.map(|end| [end.x, end.y]);
    let order = |a: &Side, b: &Side| {
        let [a_place, b_place] =
            [place(a), place(b)].map(|ends| [ends[0][0], ends[0][1], ends[1][0], ends[1][1]]);
        let by_place = a_place.iter().zip(&b_place).map(|(a, b)| a.total_cmp(b));
        let by_place = by_place.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then);
        by_place
            .then(a.nearness.total_cmp(&b.nearness))
            .then(a.face.cmp(&b.face))
    };
    sides.par_sort_unstable_by(order);
    let unit = |nearness: f64| JOINED * super::join::depth_unit(&map.camera, nearness);
    let joined: Vec<&[Side]> = sides
        .chunk_by(|a, b| place(a) == place(b) && b.nearness - a.nearness <= unit(a.nearness))
        .collect();
    joined
        .par_iter()
        .map_init(Vec::new, |near, sides| {
            is_wanted(judge, map, places, sides, near).then(|| edge(faces, sides))
        })
        .filter_map(|edge| edge)
        .collect()
}

/// The edge that some faces share.
fn edge(faces: &Faces, sides: &[Side]) -> Edge {
    let slope = |side: &Side| {
        let plane = faces.face_nearness(side.face);
        plane.a.hypot(plane.b)
    };
    // The flattest: steep planes multiply rounding.
    let flattest = sides.iter().min_by(|a, b| slope(a).total_cmp(&slope(b)));
    let [from, to] = sides[0].ends;
    Edge {
        from,
        to,
        nearness: *faces.face_nearness(flattest.expect("an edge has a face").face),
    }
}

/// Whether the edge that some faces share is of a kind that is looked for.
fn is_wanted(
    judge: &Judge,
    map: &VisibilityMap,
    places: &Places,
    sides: &[Side],
    near: &mut Vec<u32>,
) -> bool {
    let faces = &map.faces;
    let first = &sides[0];
    let angle_with = |other: FaceId| {
        let planes = [first.face, other].map(|face| faces.face_nearness(face));
        let [one, other] = planes.map(|plane| normal_of(&map.camera, plane));
        one.angle_between(other)
    };
    if let [_, rest @ ..] = sides
        && !rest.is_empty()
    {
        // Where all faces lie on one side of the edge, the surface turns away from the eye.
        let is_contour = rest.iter().all(|side| side.forth == first.forth);
        if is_contour {
            // Faces on both sides of one sheet have no contour between them.
            let turns = rest
                .iter()
                .any(|side| angle_with(side.face) > COPLANAR_ANGLE);
            return turns && judge.wants(LineKind::Silhouette)
                || judge.wants(LineKind::Boundary) && judge.is_boundary(first.face, first.ends);
        }
        return rest
            .iter()
            .any(|side| judge.is_crease([first.face, side.face], angle_with(side.face)));
    }
    let is_boundary = || judge.is_boundary(first.face, first.ends);
    // A corner of one may lie on the edge of the other, so that they share no edge.
    let [from, to] = first.ends;
    let middle = 0.5 * (from + to);
    places.along(middle, middle, NEARBY, near);
    let unit = JOINED * super::join::depth_unit(&map.camera, first.nearness);
    let other = near.iter().map(|&face| FaceId(face)).find(|&other| {
        other != first.face
            && !faces.is_veil(other)
            && (faces.face_nearness(other).at(middle) - first.nearness).abs() <= unit
            && contains(faces.outline(other), middle)
    });
    match other {
        Some(other) => {
            judge.is_crease([first.face, other], angle_with(other))
                || judge.wants(LineKind::Boundary) && is_boundary()
        }
        // Its neighbour is seen edge-on, if it has one. Otherwise it comes of the near plane's cut.
        None if judge.wants(LineKind::Silhouette) => judge.is_edge(first.face, first.ends),
        None => judge.wants(LineKind::Boundary) && is_boundary(),
    }
}

/// Angle in radians below which planes are one.
const COPLANAR_ANGLE: f64 = 1e-6;

/// Whether a point lies in a convex polygon or on its border.
fn contains(outline: &[DVec2], point: DVec2) -> bool {
    (0..outline.len()).all(|k| {
        let (from, to) = (outline[k], outline[(k + 1) % outline.len()]);
        cross(to - from, point - from) >= -2.0 * COINCIDENT * (to - from).length()
    })
}

/// Where an edge is hidden by the faces near it.
fn hidden_parts(map: &VisibilityMap, edge: &Edge, near: &[u32]) -> Vec<[DVec2; 2]> {
    let length = (edge.to - edge.from).length();
    let mut intervals: Vec<[f64; 2]> = near
        .iter()
        .filter_map(|&face| hidden_by(map, edge, FaceId(face)))
        .collect();
    intervals.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut parts: Vec<[f64; 2]> = Vec::new();
    for [start, end] in intervals {
        match parts.last_mut() {
            Some(last) if (start - last[1]) * length <= NEGLIGIBLE_LENGTH => {
                last[1] = last[1].max(end);
            }
            _ => parts.push([start, end]),
        }
    }
    let at = |share: f64| match share {
        0.0 => edge.from,
        1.0 => edge.to,
        share => edge.from.lerp(edge.to, share),
    };
    parts
        .into_iter()
        .map(|[start, end]| {
            // What rounding leaves at the ends.
            let start = if start * length <= NEGLIGIBLE_LENGTH {
                0.0
            } else {
                start
            };
            let end = if (1.0 - end) * length <= NEGLIGIBLE_LENGTH {
                1.0
            } else {
                end
            };
            [start, end]
        })
        .filter(|[start, end]| (end - start) * length > NEGLIGIBLE_LENGTH)
        .map(|part| part.map(at))
        .collect()
}

/// The part of an edge, as shares of its length, that a face hides.
fn hidden_by(map: &VisibilityMap, edge: &Edge, face: FaceId) -> Option<[f64; 2]> {
    if map.faces.is_veil(face) {
        return None;
    }
    let mut part = [0.0, 1.0];
    let outline = map.faces.outline(face);
    for (k, &from) in outline.iter().enumerate() {
        let along = outline[(k + 1) % outline.len()] - from;
        // What runs along its side is not hidden by a face.
        let distance = |point: DVec2| cross(along, point - from) - COINCIDENT * along.length();
        part = positive(part, distance(edge.from), distance(edge.to))?;
    }
    let plane = map.faces.face_nearness(face);
    let nearer = plane.minus(&edge.nearness);
    let [start, end] = [edge.from, edge.to].map(|point| nearer.at(point));
    let part = positive(part, start, end)?;
    let nearer_at = |share: f64| start + share * (end - start);
    let middle = plane.at(edge.from.midpoint(edge.to));
    let joined = JOINED * super::join::depth_unit(&map.camera, middle);
    // What is joined to the edge does not hide it.
    (nearer_at(part[0]).max(nearer_at(part[1])) > joined).then_some(part)
}

/// The part in which an affine function with these values at 0 and 1 is positive.
fn positive([start, end]: [f64; 2], at_start: f64, at_end: f64) -> Option<[f64; 2]> {
    let part = match (at_start > 0.0, at_end > 0.0) {
        (true, true) => [start, end],
        (false, false) => return None,
        (starts, _) => {
            let zero = at_start / (at_start - at_end);
            if starts {
                [start, end.min(zero)]
            } else {
                [start.max(zero), end]
            }
        }
    };
    (part[0] < part[1]).then_some(part)
}
