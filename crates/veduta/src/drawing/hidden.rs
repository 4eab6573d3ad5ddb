//! Edges of faces -> segments, for lines that no side of a fragment tells.
//!
//! What is hidden is no fragment, and veils are seen with what is behind them. So this looks at faces: all that
//! are in the map's table. Edges are the sides of their outlines, and by `crossings` where they pierce each other;
//! what an edge is, its faces tell, as for lines that are seen.
//!
//! Each edge is hidden where some opaque face covers it that is nearer there. Along an edge the distances from a
//! face's sides and the difference of two nearnesses are affine functions, so that each face hides one
//! interval, and what is hidden is their union (Appel, "The notion of quantitative invisibility", 1967,
//! without the bookkeeping that saves looking at faces again). How many faces hide a part is his quantitative
//! invisibility.

use super::lines::{JOINED, Judge, normal_of};
use super::places::{Places, box_around};
use super::{COINCIDENT, LineKind, crossings, is_on_frame};
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
pub(super) struct Edge {
    pub kind: LineKind,
    pub from: DVec2,
    pub to: DVec2,
    /// Nearness along it.
    pub nearness: Affine,
    /// Whether it is one of veils, or of a veil and another face: fragments do not tell where it is seen.
    pub is_of_veil: bool,
}

impl Edge {
    fn length(&self) -> f64 {
        (self.to - self.from).length()
    }

    /// The points between two shares of its length.
    fn part(&self, part: [f64; 2]) -> [DVec2; 2] {
        part.map(|share| match share {
            0.0 => self.from,
            1.0 => self.to,
            share => self.from.lerp(self.to, share),
        })
    }
}

/// Segments in the image plane: where edges of the kinds that `judge` looks for are hidden by at most
/// `most_before` faces, if hidden ones are drawn, and where those of veils are seen.
///
/// Nothing is told of veils in `unseen` (ascending).
pub(super) fn segments(
    judge: &Judge,
    map: &VisibilityMap,
    unseen: &[FaceId],
    most_before: usize,
) -> Vec<(LineKind, [DVec2; 2])> {
    let faces = (0..map.faces.len() as u32).map(FaceId);
    let boxes: Vec<_> = faces
        .clone()
        .map(|face| box_around(map.faces.outline(face)))
        .collect();
    let places = Places::new(boxes.iter().copied());
    let (veils, opaque): (Vec<FaceId>, Vec<FaceId>) = faces
        .filter(|face| unseen.binary_search(face).is_err())
        .partition(|&face| map.faces.is_veil(face));
    let has_hidden = judge.wants(LineKind::Hidden);
    let mut all = edges(judge, map, &places, &veils);
    if has_hidden {
        all.extend(edges(judge, map, &places, &opaque));
    }
    if judge.wants(LineKind::Crease) {
        let of_interest = if has_hidden { &opaque[..] } else { &[] };
        all.extend(crossings::edges(
            judge,
            map,
            &places,
            &boxes,
            &veils,
            of_interest,
            unseen,
        ));
    }
    let of_edges: Vec<Vec<(LineKind, [DVec2; 2])>> = all
        .par_iter()
        .map_init(Vec::new, |near, edge| {
            places.along(edge.from, edge.to, NEARBY, near);
            let hidden = hidden_parts(map, edge, near);
            let mut segments = Vec::new();
            if edge.is_of_veil {
                let seen = between(&hidden, edge.length());
                segments.extend(seen.map(|part| (edge.kind, edge.part(part))));
            }
            if has_hidden {
                let drawn = joined(hidden.iter().filter(|hidden| hidden.before <= most_before));
                segments.extend(drawn.map(|part| (LineKind::Hidden, edge.part(part))));
            }
            segments
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
    /// Nearness of the face at [`inner`].
    nearness: f64,
}

/// The point of a side at which faces that share it are told from others. Not its middle: that is where what is
/// symmetric pierces itself.
fn inner([from, to]: [DVec2; 2]) -> DVec2 {
    from.lerp(to, 0.382)
}

/// The edges of the kinds that are looked for, of `faces`: all veils, or all others.
fn edges(judge: &Judge, map: &VisibilityMap, places: &Places, of: &[FaceId]) -> Vec<Edge> {
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
            let ends = if forth { [from, to] } else { [to, from] };
            Some(Side {
                ends,
                face,
                forth,
                nearness: plane.at(inner(ends)),
            })
        })
    };
    let mut sides: Vec<Side> = of
        .par_iter()
        .flat_map_iter(|&face| sides_of(face))
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
            let kind = kind(judge, map, places, sides, near)?;
            Some(edge(faces, sides, kind))
        })
        .filter_map(|edge| edge)
        .collect()
}

/// The edge that some faces share.
fn edge(faces: &Faces, sides: &[Side], kind: LineKind) -> Edge {
    let slope = |side: &Side| {
        let plane = faces.face_nearness(side.face);
        plane.a.hypot(plane.b)
    };
    // The flattest: steep planes multiply rounding.
    let flattest = sides.iter().min_by(|a, b| slope(a).total_cmp(&slope(b)));
    let [from, to] = sides[0].ends;
    let face = flattest.expect("an edge has a face").face;
    Edge {
        kind,
        from,
        to,
        nearness: *faces.face_nearness(face),
        is_of_veil: faces.is_veil(face),
    }
}

/// The kind of the edge that some faces share, if it is one that is looked for.
fn kind(
    judge: &Judge,
    map: &VisibilityMap,
    places: &Places,
    sides: &[Side],
    near: &mut Vec<u32>,
) -> Option<LineKind> {
    use LineKind::{Boundary, Crease, Silhouette};
    let faces = &map.faces;
    let first = &sides[0];
    let angle_with = |other: FaceId| {
        let planes = [first.face, other].map(|face| faces.face_nearness(face));
        let [one, other] = planes.map(|plane| normal_of(&map.camera, plane));
        one.angle_between(other)
    };
    let is_crease = |other| judge.is_crease([first.face, other], angle_with(other));
    let is_boundary = || judge.wants(Boundary) && judge.is_boundary(first.face, first.ends);
    let rest = &sides[1..];
    if !rest.is_empty() {
        // Where all faces lie on one side of the edge, the surface turns away from the eye.
        if rest.iter().any(|side| side.forth != first.forth) {
            let mut others = rest.iter().map(|side| side.face);
            return others.any(is_crease).then_some(Crease);
        }
        // Faces on both sides of one sheet have no contour between them.
        let mut others = rest.iter().map(|side| side.face);
        let turns = others.any(|other| angle_with(other) > COPLANAR_ANGLE);
        let is_silhouette = turns && judge.wants(Silhouette);
        return (is_silhouette.then_some(Silhouette)).or_else(|| is_boundary().then_some(Boundary));
    }
    // A corner of one may lie on the edge of the other, so that they share no edge.
    let inner = inner(first.ends);
    places.along(inner, inner, NEARBY, near);
    let unit = JOINED * super::join::depth_unit(&map.camera, first.nearness);
    let is_opaque = !faces.is_veil(first.face);
    let other = near.iter().map(|&face| FaceId(face)).find(|&other| {
        other != first.face
            && !(is_opaque && faces.is_veil(other))
            && (faces.face_nearness(other).at(inner) - first.nearness).abs() <= unit
            && contains(faces.outline(other), inner)
    });
    match other {
        Some(_) if is_boundary() => Some(Boundary),
        Some(other) => is_crease(other).then_some(Crease),
        // Its neighbour is seen edge-on, if it has one. Otherwise it comes of the near plane's cut.
        None if judge.wants(Silhouette) => {
            let is_edge = judge.is_edge(first.face, first.ends);
            is_edge.then_some(Silhouette)
        }
        None => is_boundary().then_some(Boundary),
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

/// A part of an edge, in shares of its length, that is hidden, and by how many faces.
struct Hidden {
    part: [f64; 2],
    before: usize,
}

/// Where an edge is hidden by the faces near it, in order.
fn hidden_parts(map: &VisibilityMap, edge: &Edge, near: &[u32]) -> Vec<Hidden> {
    let length = edge.length();
    // Where a face begins and ends to hide it.
    let mut borders: Vec<(f64, isize)> = near
        .iter()
        .filter_map(|&face| hidden_by(map, edge, FaceId(face)))
        .flat_map(|[start, end]| [(start, 1), (end, -1)])
        .collect();
    borders.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut parts: Vec<Hidden> = Vec::new();
    let mut before = 0isize;
    for pair in borders.windows(2) {
        before += pair[0].1;
        let part = [pair[0].0, pair[1].0];
        if before == 0 || (part[1] - part[0]) * length <= NEGLIGIBLE_LENGTH {
            continue;
        }
        let before = before.unsigned_abs();
        match parts.last_mut() {
            // What rounding leaves between them belongs to both.
            Some(last) if (part[0] - last.part[1]) * length <= NEGLIGIBLE_LENGTH => {
                if last.before == before {
                    last.part[1] = part[1];
                } else {
                    let start = last.part[1];
                    parts.push(Hidden {
                        part: [start, part[1]],
                        before,
                    });
                }
            }
            _ => parts.push(Hidden { part, before }),
        }
    }
    // And at the ends.
    if let Some(first) = parts.first_mut()
        && first.part[0] * length <= NEGLIGIBLE_LENGTH
    {
        first.part[0] = 0.0;
    }
    if let Some(last) = parts.last_mut()
        && (1.0 - last.part[1]) * length <= NEGLIGIBLE_LENGTH
    {
        last.part[1] = 1.0;
    }
    parts
}

/// Parts in order, those that touch in one.
fn joined<'a>(parts: impl Iterator<Item = &'a Hidden>) -> impl Iterator<Item = [f64; 2]> {
    let mut joined: Vec<[f64; 2]> = Vec::new();
    for &Hidden { part, .. } in parts {
        match joined.last_mut() {
            Some(last) if last[1] == part[0] => last[1] = part[1],
            _ => joined.push(part),
        }
    }
    joined.into_iter()
}

/// The parts of an edge of that length between hidden ones.
fn between(hidden: &[Hidden], length: f64) -> impl Iterator<Item = [f64; 2]> {
    let starts = [0.0]
        .into_iter()
        .chain(hidden.iter().map(|hidden| hidden.part[1]));
    let ends = hidden.iter().map(|hidden| hidden.part[0]).chain([1.0]);
    let parts = starts.zip(ends).map(|(start, end)| [start, end]);
    parts.filter(move |[start, end]| (end - start) * length > NEGLIGIBLE_LENGTH)
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
pub(super) fn positive([start, end]: [f64; 2], at_start: f64, at_end: f64) -> Option<[f64; 2]> {
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
