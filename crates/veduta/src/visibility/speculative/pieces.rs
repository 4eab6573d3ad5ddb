//! What is left of one face while nearer faces are taken from it: convex pieces.
//!
//! Pieces live in one arena that is emptied for the next face. A piece that an occluder does not
//! touch stays where it is; of one that it cuts, the parts are appended.

use std::ops::Range;
use veduta_geometry::{Affine, DVec2, cross};
use veduta_map::{FaceId, Side};

/// Distance, in frame heights or widths, within which a point counts as lying on a line.
///
/// Points constructed on a line miss it by a few units of 2^-53. Without this band every such miss
/// would cut off a sliver; the area it can misplace is its width times a line's length in a pixel,
/// 2e-12 pixels at 2000 pixels across.
pub(super) const ON_LINE: f64 = 1e-15;

/// Area, as a share of the frame, below which a piece is dropped: 2e-12 pixels at 1920 x 1080.
const NEGLIGIBLE_AREA: f64 = 1e-18;

/// A vertex of a piece, and what lies along the side from it to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub point: DVec2,
    pub side: Side,
}

/// The line through a side of an occluder, its inside on the positive side.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    start: DVec2,
    direction: DVec2,
    /// [`ON_LINE`] in units of [`Edge::beyond`].
    tolerance: f64,
}

impl Edge {
    #[inline(always)]
    pub fn new(start: DVec2, end: DVec2) -> Self {
        let direction = end - start;
        let tolerance = ON_LINE * (direction.x.abs() + direction.y.abs());
        Self {
            start,
            direction,
            tolerance,
        }
    }

    /// Positive inside; exactly zero at the edge's start.
    #[inline(always)]
    fn beyond(&self, point: DVec2) -> f64 {
        cross(self.direction, point - self.start)
    }

    /// Whether all of `points` lie outside or on the line.
    #[inline(always)]
    pub fn separates(&self, mut points: impl Iterator<Item = DVec2>) -> bool {
        points.all(|point| self.beyond(point) <= self.tolerance)
    }
}

/// How an occluder lies to the face it may hide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Depth {
    /// Behind it wherever they overlap.
    Behind,
    /// In front of it wherever they overlap.
    InFront,
    /// In front where this function (the occluder's nearness less the face's) is positive.
    Crossing(Affine),
}

/// Value below which the difference of two planes counts as zero: its rounding error.
#[inline(always)]
pub(super) fn crossing_tolerance(difference: &Affine) -> f64 {
    4e-16 * (difference.a.abs() + difference.b.abs() + difference.c.abs())
}

/// Pieces of one face.
#[derive(Default)]
pub(super) struct Pieces {
    corners: Vec<Corner>,
    pieces: Vec<Range<u32>>,
    next: Vec<Range<u32>>,
    outside: Vec<Range<u32>>,
    distances: Vec<f64>,
    edges: Vec<Edge>,
    touched: bool,
    crossed: bool,
    /// How often a part was taken away.
    losses: usize,
}

impl Pieces {
    /// Starts anew with the whole outline of `face`.
    pub fn start(&mut self, face: FaceId, outline: &[DVec2]) {
        self.corners.clear();
        self.corners
            .extend(outline.iter().enumerate().map(|(index, &point)| Corner {
                point,
                side: Side::of_outline(face, index),
            }));
        self.pieces.clear();
        self.pieces.push(0..outline.len() as u32);
        self.touched = false;
        self.crossed = false;
    }

    /// Starts anew with nothing, for [`Pieces::add`].
    pub fn clear(&mut self) {
        self.corners.clear();
        self.pieces.clear();
        self.touched = true;
        self.crossed = false;
    }

    /// Adds a piece found before.
    pub fn add(&mut self, points: &[DVec2], sides: &[Side]) {
        let start = self.corners.len() as u32;
        self.corners.extend(
            points
                .iter()
                .zip(sides)
                .map(|(&point, &side)| Corner { point, side }),
        );
        self.pieces.push(start..self.corners.len() as u32);
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Whether something was taken away.
    pub fn touched(&self) -> bool {
        self.touched
    }

    /// How often something was taken away, from any face.
    pub fn losses(&self) -> usize {
        self.losses
    }

    /// Whether a crossing of planes cut here.
    pub fn crossed(&self) -> bool {
        self.crossed
    }

    /// The pieces.
    pub fn iter(&self) -> impl Iterator<Item = &[Corner]> {
        self.pieces
            .iter()
            .map(|piece| corners(&self.corners, piece))
    }

    /// Takes away the part that `occluder` hides.
    pub fn subtract(&mut self, occluder: FaceId, outline: &[DVec2], depth: Depth) {
        debug_assert!(depth != Depth::Behind);
        self.edges.clear();
        for (index, &start) in outline.iter().enumerate() {
            let end = outline[if index + 1 == outline.len() {
                0
            } else {
                index + 1
            }];
            self.edges.push(Edge::new(start, end));
        }
        let mut pieces = std::mem::take(&mut self.pieces);
        self.next.clear();
        for piece in pieces.drain(..) {
            self.subtract_from_piece(piece, occluder, outline, depth);
        }
        self.pieces = std::mem::replace(&mut self.next, pieces);
    }

    fn subtract_from_piece(
        &mut self,
        piece: Range<u32>,
        occluder: FaceId,
        outline: &[DVec2],
        depth: Depth,
    ) {
        if self.is_apart(&piece, outline) {
            self.next.push(piece);
            return;
        }
        // Cut along one side of the occluder after the other: what lies outside is kept, what is
        // inside of all of them is the overlap.
        let arena = self.corners.len();
        self.outside.clear();
        let mut overlap = piece.clone();
        for index in 0..self.edges.len() {
            let edge = self.edges[index];
            self.distances.clear();
            self.distances.extend(
                corners(&self.corners, &overlap)
                    .iter()
                    .map(|corner| edge.beyond(corner.point)),
            );
            let side = Side::of_outline(occluder, index);
            let (inside, outside) = self.split(overlap, edge.tolerance, side);
            let Some(inside) = inside else {
                self.corners.truncate(arena);
                self.next.push(piece);
                return;
            };
            self.outside.extend(outside);
            overlap = inside;
        }
        let mut in_front = None;
        if let Depth::Crossing(difference) = depth {
            self.distances.clear();
            self.distances.extend(
                corners(&self.corners, &overlap)
                    .iter()
                    .map(|corner| -difference.at(corner.point)),
            );
            let tolerance = crossing_tolerance(&difference);
            let (before, behind) = self.split(overlap, tolerance, Side::crossing(occluder));
            let Some(behind) = behind else {
                self.corners.truncate(arena);
                self.next.push(piece);
                return;
            };
            self.crossed |= before.is_some();
            in_front = before;
            overlap = behind;
        }
        if twice_area(corners(&self.corners, &overlap)) <= 2.0 * NEGLIGIBLE_AREA {
            self.corners.truncate(arena);
            self.next.push(piece);
            return;
        }
        self.touched = true;
        self.losses += 1;
        for part in self.outside.drain(..).chain(in_front) {
            if twice_area(corners(&self.corners, &part)) > 2.0 * NEGLIGIBLE_AREA {
                self.next.push(part);
            }
        }
    }

    /// Whether a side of the piece or of the occluder has the other on its outside.
    fn is_apart(&self, piece: &Range<u32>, outline: &[DVec2]) -> bool {
        let piece = corners(&self.corners, piece);
        self.edges
            .iter()
            .any(|edge| edge.separates(piece.iter().map(|corner| corner.point)))
            || (0..piece.len()).any(|index| {
                let end = piece[if index + 1 == piece.len() {
                    0
                } else {
                    index + 1
                }]
                .point;
                Edge::new(piece[index].point, end).separates(outline.iter().copied())
            })
    }

    /// Splits a piece along a line, given its corners' signed distances in `self.distances`, and
    /// returns what lies on the positive and on the negative side. `side` names the line.
    ///
    /// A piece all on one side (or on the line) is returned as it is, without a copy.
    fn split(
        &mut self,
        piece: Range<u32>,
        tolerance: f64,
        side: Side,
    ) -> (Option<Range<u32>>, Option<Range<u32>>) {
        let positive = self.distances.iter().any(|&distance| distance > tolerance);
        let negative = self.distances.iter().any(|&distance| distance < -tolerance);
        if !negative {
            return if positive {
                (Some(piece), None)
            } else {
                (None, Some(piece))
            };
        }
        if !positive {
            return (None, Some(piece));
        }
        let inside = self.cut(&piece, tolerance, side, 1.0);
        let outside = self.cut(&piece, tolerance, side, -1.0);
        (inside, outside)
    }

    /// The part of a piece where `sign * distance` is not negative, as a new piece.
    fn cut(
        &mut self,
        piece: &Range<u32>,
        tolerance: f64,
        side: Side,
        sign: f64,
    ) -> Option<Range<u32>> {
        let first = self.corners.len() as u32;
        let count = piece.len();
        let start = piece.start as usize;
        for index in 0..count {
            let after = if index + 1 == count { 0 } else { index + 1 };
            let here = self.corners[start + index];
            let there = self.corners[start + after];
            let (d_here, d_there) = (sign * self.distances[index], sign * self.distances[after]);
            if d_here >= -tolerance {
                // On the line with the next vertex beyond it: the side from here is the cut.
                let leaves = d_here <= tolerance && d_there < -tolerance;
                let side = if leaves { side } else { here.side };
                self.corners.push(Corner {
                    point: here.point,
                    side,
                });
            }
            let enters = d_here < -tolerance && d_there > tolerance;
            let leaves = d_here > tolerance && d_there < -tolerance;
            if enters || leaves {
                let point = here.point + (there.point - here.point) * (d_here / (d_here - d_there));
                self.corners.push(Corner {
                    point,
                    side: if leaves { side } else { here.side },
                });
            }
        }
        let end = self.corners.len() as u32;
        if end - first < 3 {
            self.corners.truncate(first as usize);
            return None;
        }
        Some(first..end)
    }
}

#[inline(always)]
fn corners<'a>(arena: &'a [Corner], piece: &Range<u32>) -> &'a [Corner] {
    &arena[piece.start as usize..piece.end as usize]
}

/// Twice the area of a piece, relative to its first corner.
#[inline]
pub(super) fn twice_area(piece: &[Corner]) -> f64 {
    let first = piece[0].point;
    piece[1..]
        .windows(2)
        .map(|edge| cross(edge[0].point - first, edge[1].point - first))
        .sum()
}
