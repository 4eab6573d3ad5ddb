//! What is left of one face while nearer faces are taken from it: convex pieces.
//!
//! Pieces live in one arena that is emptied for the next face. A piece that an occluder does not
//! touch stays where it is; of one that it cuts, the parts are appended.

use super::sides::{LANES, Sides};
use std::ops::Range;
use veduta_geometry::{Affine, DVec2, cross};
use veduta_map::{FaceId, Side};
use wide::f64x4;

/// Area, as a share of the frame, below which a piece is dropped: 2e-12 pixels at 1920 x 1080.
const NEGLIGIBLE_AREA: f64 = 1e-18;

/// A vertex of a piece, and what lies along the side from it to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub point: DVec2,
    pub side: Side,
}

/// A corner of the piece that is being cut, with its distances from the cutting lines.
#[derive(Clone, Copy)]
pub(crate) struct Measured {
    pub corner: Corner,
    distance: [f64; LANES],
}

/// A convex piece: corners in the arena, and the box around them.
#[derive(Clone, Debug)]
struct Piece {
    corners: Range<u32>,
    min: DVec2,
    max: DVec2,
}

/// How an occluder lies to the face it may hide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Depth {
    /// Behind it wherever they overlap.
    Behind,
    /// In front of it wherever they overlap.
    InFront,
    /// In front where this function (the occluder's nearness less the face's) is positive.
    Crossing(Affine),
}

/// Value below which the difference of two planes counts as zero: its rounding error.
#[inline(always)]
pub(crate) fn crossing_tolerance(difference: &Affine) -> f64 {
    4e-16 * (difference.a.abs() + difference.b.abs() + difference.c.abs())
}

/// Pieces of one face.
#[derive(Default)]
pub(crate) struct Pieces {
    arena: Vec<Corner>,
    pieces: Vec<Piece>,
    next: Vec<Piece>,
    /// The overlap of a piece with the occluder, and what is left of it after one more cut.
    overlap: [Vec<Measured>; 2],
    touched: bool,
    crossed: bool,
    losses: usize,
}

impl Pieces {
    /// Starts anew with the whole outline of `face`.
    pub fn start(&mut self, face: FaceId, outline: &[DVec2]) {
        self.clear();
        self.touched = false;
        self.arena
            .extend(outline.iter().enumerate().map(|(index, &point)| Corner {
                point,
                side: Side::of_outline(face, index),
            }));
        self.pieces.extend(Piece::from(&self.arena, 0));
    }

    /// Starts anew with nothing, for [`Pieces::add`].
    pub fn clear(&mut self) {
        self.arena.clear();
        self.pieces.clear();
        self.touched = true;
        self.crossed = false;
    }

    /// Adds a piece found before.
    pub fn add(&mut self, corners: impl Iterator<Item = Corner>) {
        let start = self.arena.len();
        self.arena.extend(corners);
        self.pieces.extend(Piece::from(&self.arena, start));
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
        self.pieces.iter().map(|piece| piece.corners(&self.arena))
    }

    /// Takes away the part that `occluder` hides. `sides` are those of its outline (the first four
    /// of them).
    pub fn subtract(&mut self, occluder: FaceId, outline: &[DVec2], sides: &Sides, depth: Depth) {
        self.subtract_and_tell(occluder, outline, sides, depth, |_| {});
    }

    /// [`Pieces::subtract`]; `taken` is told each piece that is taken away.
    pub fn subtract_and_tell(
        &mut self,
        occluder: FaceId,
        outline: &[DVec2],
        sides: &Sides,
        depth: Depth,
        mut taken: impl FnMut(&[Measured]),
    ) {
        debug_assert!(depth != Depth::Behind);
        let (mut min, mut max) = (outline[0], outline[0]);
        for &point in &outline[1..] {
            min = min.min(point);
            max = max.max(point);
        }
        let apart = |piece: &Piece| {
            piece.min.x >= max.x
                || piece.min.y >= max.y
                || piece.max.x <= min.x
                || piece.max.y <= min.y
        };
        // A large face behind many small ones has hundreds of pieces, and most of them stay.
        let Some(first) = self.pieces.iter().position(|piece| !apart(piece)) else {
            return;
        };
        let mut pieces = std::mem::take(&mut self.pieces);
        self.next.clear();
        for piece in pieces.drain(first..) {
            if apart(&piece) || !self.cut_away(&piece, occluder, outline, sides, depth) {
                self.next.push(piece);
            } else {
                taken(&self.overlap[0]);
            }
        }
        pieces.append(&mut self.next);
        self.pieces = pieces;
    }

    /// Replaces `piece` by what the occluder leaves of it; false, and nothing is done, if that is
    /// all of it.
    fn cut_away(
        &mut self,
        piece: &Piece,
        occluder: FaceId,
        outline: &[DVec2],
        sides: &Sides,
        depth: Depth,
    ) -> bool {
        let arena = self.arena.len();
        let kept = self.next.len();
        let [overlap, after] = &mut self.overlap;
        overlap.clear();
        overlap.extend(piece.corners(&self.arena).iter().map(|&corner| Measured {
            corner,
            distance: sides.inside(corner.point).to_array(),
        }));

        // Cut along one side of the occluder after the other: what lies outside is kept, what is
        // inside of all of them is the overlap.
        for first in (0..outline.len()).step_by(LANES) {
            let later;
            let group = if first == 0 {
                sides
            } else {
                later = Sides::group(outline, first);
                for measured in overlap.iter_mut() {
                    measured.distance = later.inside(measured.corner.point).to_array();
                }
                &later
            };
            let cutting = Cutting::of(overlap, group);
            let apart =
                cutting == Cutting::Separated || first == 0 && separated_by_sides(overlap, outline);
            if apart {
                self.undo(arena, kept);
                return false;
            }
            let Cutting::Lanes(lanes) = cutting else {
                continue;
            };
            let tolerance = group.tolerance.to_array();
            for lane in (0..group.count).filter(|lane| lanes >> lane & 1 == 1) {
                let side = Side::of_outline(occluder, first + lane);
                let outside = self.arena.len();
                split(overlap, after, &mut self.arena, lane, tolerance[lane], side);
                std::mem::swap(overlap, after);
                self.next.extend(Piece::from(&self.arena, outside));
                if overlap.len() < 3 {
                    self.undo(arena, kept);
                    return false;
                }
            }
        }

        if let Depth::Crossing(difference) = depth {
            let tolerance = crossing_tolerance(&difference);
            for measured in overlap.iter_mut() {
                measured.distance[0] = difference.at(measured.corner.point);
            }
            if !overlap
                .iter()
                .any(|measured| measured.distance[0] > tolerance)
            {
                self.undo(arena, kept);
                return false;
            }
            if overlap
                .iter()
                .any(|measured| measured.distance[0] < -tolerance)
            {
                let before = self.arena.len();
                split(
                    overlap,
                    after,
                    &mut self.arena,
                    0,
                    tolerance,
                    Side::crossing(occluder),
                );
                std::mem::swap(overlap, after);
                self.next.extend(Piece::from(&self.arena, before));
                self.crossed = true;
            }
        }
        if overlap.len() < 3
            || twice_area(overlap.iter().map(|m| m.corner.point)) <= 2.0 * NEGLIGIBLE_AREA
        {
            self.undo(arena, kept);
            return false;
        }
        self.touched = true;
        self.losses += 1;
        true
    }

    fn undo(&mut self, arena: usize, kept: usize) {
        self.arena.truncate(arena);
        self.next.truncate(kept);
    }
}

impl Piece {
    /// The piece with the corners from `start` on, unless its area is negligible.
    fn from(arena: &[Corner], start: usize) -> Option<Self> {
        let corners = &arena[start..];
        if corners.len() < 3
            || twice_area(corners.iter().map(|corner| corner.point)) <= 2.0 * NEGLIGIBLE_AREA
        {
            return None;
        }
        let (mut min, mut max) = (corners[0].point, corners[0].point);
        for corner in &corners[1..] {
            min = min.min(corner.point);
            max = max.max(corner.point);
        }
        Some(Self {
            corners: start as u32..arena.len() as u32,
            min,
            max,
        })
    }

    #[inline(always)]
    fn corners<'a>(&self, arena: &'a [Corner]) -> &'a [Corner] {
        &arena[self.corners.start as usize..self.corners.end as usize]
    }
}

/// What the sides of an occluder do to a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cutting {
    /// One of them has all of the piece on its outside.
    Separated,
    /// These cut it; it is inside of the others.
    Lanes(u32),
}

impl Cutting {
    #[inline(always)]
    fn of(piece: &[Measured], sides: &Sides) -> Self {
        let mut nearest = f64x4::splat(f64::INFINITY);
        let mut farthest = f64x4::splat(f64::NEG_INFINITY);
        for measured in piece {
            let distance = f64x4::from(measured.distance);
            nearest = nearest.fast_min(distance);
            farthest = farthest.fast_max(distance);
        }
        if farthest.simd_le(sides.tolerance).any() {
            return Self::Separated;
        }
        Self::Lanes(nearest.simd_lt(-sides.tolerance).to_bitmask())
    }
}

/// Whether a side of the piece has all of `outline` on its outside.
#[inline]
fn separated_by_sides(piece: &[Measured], outline: &[DVec2]) -> bool {
    let mut start = piece[piece.len() - 1].corner.point;
    piece.iter().any(|measured| {
        let end = measured.corner.point;
        let direction = end - start;
        let tolerance = super::sides::ON_LINE * (direction.x.abs() + direction.y.abs());
        let origin = std::mem::replace(&mut start, end);
        outline
            .iter()
            .all(|&point| cross(direction, point - origin) <= tolerance)
    })
}

/// Splits a piece along the line of `lane`: what is inside of it becomes `inside`, what is outside
/// is appended to the arena. `side` names the line.
#[inline]
fn split(
    piece: &[Measured],
    inside: &mut Vec<Measured>,
    outside: &mut Vec<Corner>,
    lane: usize,
    tolerance: f64,
    side: Side,
) {
    inside.clear();
    let mut here = &piece[piece.len() - 1];
    for there in piece {
        let (d_here, d_there) = (here.distance[lane], there.distance[lane]);
        // A corner on the line belongs to both parts. The side from it is the cut in the part that
        // the next corner has left.
        if d_here >= -tolerance {
            let leaves = d_here <= tolerance && d_there < -tolerance;
            let along = if leaves { side } else { here.corner.side };
            inside.push(Measured {
                corner: Corner {
                    side: along,
                    ..here.corner
                },
                ..*here
            });
        }
        if d_here <= tolerance {
            let leaves = d_here >= -tolerance && d_there > tolerance;
            let along = if leaves { side } else { here.corner.side };
            outside.push(Corner {
                side: along,
                ..here.corner
            });
        }
        let leaves = d_here > tolerance && d_there < -tolerance;
        let enters = d_here < -tolerance && d_there > tolerance;
        if leaves || enters {
            let share = d_here / (d_here - d_there);
            let point = here.corner.point + (there.corner.point - here.corner.point) * share;
            let mut distance = std::array::from_fn(|other| {
                here.distance[other] + (there.distance[other] - here.distance[other]) * share
            });
            distance[lane] = 0.0;
            let (within, without) = if leaves {
                (side, here.corner.side)
            } else {
                (here.corner.side, side)
            };
            inside.push(Measured {
                corner: Corner {
                    point,
                    side: within,
                },
                distance,
            });
            outside.push(Corner {
                point,
                side: without,
            });
        }
        here = there;
    }
}

/// Twice the area of a polygon, relative to its first corner.
#[inline]
fn twice_area(mut points: impl Iterator<Item = DVec2>) -> f64 {
    let (Some(first), Some(second)) = (points.next(), points.next()) else {
        return 0.0;
    };
    let mut previous = second - first;
    points
        .map(|point| {
            let next = point - first;
            cross(std::mem::replace(&mut previous, next), next)
        })
        .sum()
}
