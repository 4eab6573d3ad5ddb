//! The exact clip: each candidate less the nearer parts of the candidates that overlap it.
//!
//! No face depends on another's result, so the order in which they are taken changes nothing.

use super::cells::CellLists;
use super::found::Pile;
use super::grid::{Extent, Grid};
use super::pieces::{Corner, Depth, Pieces, crossing_tolerance};
use super::sides::{LANES, Sides, later_sides_separate};
use veduta_geometry::{Affine, DVec2};
use veduta_map::{FaceId, Faces};
use wide::f64x4;

/// What all clips share.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    pub faces: &'a Faces,
    pub extents: &'a [Extent],
    pub grid: &'a Grid,
}

/// Clips one face after the other; holds what is reused between them.
pub(crate) struct Clipper<'a> {
    context: Context<'a>,
    pub pieces: Pieces,
    /// Whether a face in the same plane hid something of this one.
    tied: bool,
    /// For each face, the last face it was compared with: a pair may meet in several cells.
    ///
    /// Ids are kept plus one: memory that is zero from the start costs nothing until it is used.
    compared_with: Vec<u32>,
}

impl<'a> Clipper<'a> {
    pub fn new(context: Context<'a>) -> Self {
        let compared_with = vec![0; context.faces.len()];
        Self {
            context,
            pieces: Pieces::default(),
            tied: false,
            compared_with,
        }
    }

    /// Leaves in `self.pieces` what is seen of `face` among the faces of `lists`.
    pub fn clip(&mut self, face: FaceId, lists: &[&CellLists]) {
        self.pieces.start(face, self.context.faces.outline(face));
        self.tied = false;
        self.subtract_listed(face, lists, |_| true);
    }

    /// Makes `self.pieces` the fragments of `face` found before; one without corners is all of it.
    pub fn resume(
        &mut self,
        face: FaceId,
        fragments: impl Iterator<Item = impl ExactSizeIterator<Item = Corner>>,
    ) {
        self.tied = false;
        self.pieces.clear();
        for corners in fragments {
            if corners.len() == 0 {
                self.pieces.start(face, self.context.faces.outline(face));
            } else {
                self.pieces.add(corners);
            }
        }
    }

    /// Adds to `pile` what is left of `face`.
    pub fn store(&self, face: FaceId, pile: &mut Pile) {
        pile.push(face, &self.pieces);
        pile.pierced += usize::from(self.pieces.crossed());
        pile.tied += usize::from(self.tied);
    }

    /// Takes from `self.pieces`, which are of `face`, what the faces listed in its cells hide;
    /// only in cells for which `wanted` holds.
    pub fn subtract_listed(
        &mut self,
        face: FaceId,
        lists: &[&CellLists],
        wanted: impl Fn(usize) -> bool,
    ) {
        self.subtract(face, lists, None, wanted);
    }

    /// The same by what is listed of other maps than that of `face`.
    pub fn subtract_others(&mut self, face: FaceId, list: &CellLists, map: u32) {
        self.subtract(face, &[list], Some(map), |_| true);
    }

    fn subtract(
        &mut self,
        face: FaceId,
        lists: &[&CellLists],
        own: Option<u32>,
        wanted: impl Fn(usize) -> bool,
    ) {
        let Self {
            context,
            pieces,
            tied,
            compared_with,
        } = self;
        let Context {
            faces,
            extents,
            grid,
        } = *context;
        let outline = faces.outline(face);
        let extent = &extents[face.index()];
        let occludee = Occludee::new(faces, face);
        let stamp = face.0 + 1;
        compared_with[face.index()] = stamp;
        grid.each_row(outline, extent, |row, columns| {
            for column in columns {
                let cell = grid.index(column, row);
                if !wanted(cell) {
                    continue;
                }
                for list in lists {
                    list.overlapping(cell, extent, own, |occluder| {
                        if compared_with[occluder.index()] == stamp {
                            return true;
                        }
                        compared_with[occluder.index()] = stamp;
                        if let Some((depth, sides)) = occludee.occlusion(occluder) {
                            let losses = pieces.losses();
                            pieces.subtract(occluder, faces.outline(occluder), &sides, depth);
                            *tied |= pieces.losses() != losses
                                && faces.plane(occluder) == faces.plane(face);
                        }
                        !pieces.is_empty()
                    });
                    if pieces.is_empty() {
                        return false;
                    }
                }
            }
            true
        });
    }
}

impl Clipper<'_> {
    /// Takes from `self.pieces`, which are of `face`, what the faces of `list` cover, nearer or not, and
    /// adds it to `taken`.
    pub fn subtract_covered(
        &mut self,
        face: FaceId,
        list: &CellLists,
        taken: &mut Vec<Vec<Corner>>,
    ) {
        let Self {
            context,
            pieces,
            compared_with,
            ..
        } = self;
        let Context {
            faces,
            extents,
            grid,
        } = *context;
        let outline = faces.outline(face);
        // Behind all, so that nothing is passed over for its depth.
        let extent = Extent {
            nearness: [f32::NEG_INFINITY; 2],
            ..extents[face.index()]
        };
        let stamp = face.0 + 1;
        grid.each_row(outline, &extent, |row, columns| {
            for column in columns {
                list.overlapping(grid.index(column, row), &extent, None, |cover| {
                    if compared_with[cover.index()] == stamp {
                        return true;
                    }
                    compared_with[cover.index()] = stamp;
                    let other = faces.outline(cover);
                    let sides = Sides::group(other, 0);
                    pieces.subtract_and_tell(cover, other, &sides, Depth::InFront, |piece| {
                        taken.push(piece.iter().map(|measured| measured.corner).collect());
                    });
                    !pieces.is_empty()
                });
                if pieces.is_empty() {
                    return false;
                }
            }
            true
        });
    }
}

/// A face that may be hidden, made ready to be compared with many others.
struct Occludee<'a> {
    face: FaceId,
    faces: &'a Faces,
    outline: &'a [DVec2],
    plane: &'a Affine,
    sides: Sides,
}

impl<'a> Occludee<'a> {
    fn new(faces: &'a Faces, face: FaceId) -> Self {
        let outline = faces.outline(face);
        let plane = faces.face_nearness(face);
        Self {
            face,
            faces,
            outline,
            plane,
            sides: Sides::group(outline, 0),
        }
    }

    /// How `occluder` lies to this face, and its sides; `None` where it hides nothing: it is behind,
    /// or their projections do not overlap.
    #[inline]
    fn occlusion(&self, occluder: FaceId) -> Option<(Depth, Sides)> {
        let other = self.faces.outline(occluder);
        if self.sides.separate(other) {
            return None;
        }
        let sides = Sides::group(other, 0);
        let depth = self.order(occluder, other, &sides);
        if depth == Depth::Behind
            || sides.separate(self.outline)
            || later_sides_separate(self.outline, other)
            || later_sides_separate(other, self.outline)
        {
            return None;
        }
        Some((depth, sides))
    }

    /// Which of the two is in front. Both sides of a pair come to the same answer: a difference of
    /// planes is exactly antisymmetric.
    #[inline]
    fn order(&self, occluder: FaceId, other: &[DVec2], sides: &Sides) -> Depth {
        let by_key = if self.faces.wins_tie(occluder, self.face) {
            Depth::InFront
        } else {
            Depth::Behind
        };
        if self.faces.plane(self.face) == self.faces.plane(occluder) {
            return by_key;
        }
        let difference = self.faces.face_nearness(occluder).minus(self.plane);
        let tolerance = crossing_tolerance(&difference);
        for (sides, outline) in [(&self.sides, self.outline), (sides, other)] {
            let values = sides.at_starts(&difference);
            let mut in_front = values.simd_gt(f64x4::splat(tolerance)).any();
            let mut behind = values.simd_lt(f64x4::splat(-tolerance)).any();
            for &point in outline.iter().skip(LANES) {
                let value = difference.at(point);
                in_front |= value > tolerance;
                behind |= value < -tolerance;
            }
            match (in_front, behind) {
                (false, false) => return by_key,
                (true, false) => return Depth::InFront,
                (false, true) => return Depth::Behind,
                (true, true) => {}
            }
        }
        Depth::Crossing(difference)
    }
}
