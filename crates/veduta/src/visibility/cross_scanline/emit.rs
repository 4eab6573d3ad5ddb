//! Pieces become fragments: joined across V-scanlines, their sides named, sorted by face.

use super::h_scan::{EdgeOnScanline, Entering, Slice, Strip};
use super::{Bound, Piece, StripSeen, Trapezoid, is_same_y};
use crate::visibility::Seen;
use veduta_geometry::{DVec2, signed_area};
use veduta_map::{FaceId, Faces, Fragments, Side};

/// The pieces of a strip, either of opaque faces or of veils, while it is swept.
///
/// The pieces of a face that lie between the same two bounds, one right of the other, become one,
/// and so do pieces one above the other: V-scanlines and the edges of hidden faces leave no trace.
#[derive(Default)]
pub(super) struct Layer {
    /// What has been seen between the last two cuts in x.
    column: Vec<Piece>,
    /// Pieces that may go on at their right end.
    open: Vec<Piece>,
    closed: Vec<Piece>,
}

impl Layer {
    pub fn clear(&mut self) {
        self.column.clear();
        self.open.clear();
        self.closed.clear();
    }

    /// Adds a piece that may go on at its right end.
    pub fn push(&mut self, piece: Piece) {
        self.open.push(piece);
    }

    /// Adds a piece to the column; within it pieces come from top to bottom.
    pub fn stack(&mut self, piece: Piece) {
        let shape = piece.shape;
        let above = self.column.iter_mut().rfind(|above| {
            above.face == piece.face
                && above.shape.left == shape.left
                && above.shape.right == shape.right
                && above.shape.bottom == shape.top
        });
        match above {
            Some(above) => {
                above.shape.bottom = shape.bottom;
                above.shape.below = shape.below;
            }
            None => self.column.push(piece),
        }
    }

    /// Joins the column's pieces with those that they continue.
    pub fn join(&mut self) {
        for piece in self.column.drain(..) {
            let shape = piece.shape;
            let before = self.open.iter_mut().rfind(|before| {
                before.is_between(piece.face, shape.left, shape.above, shape.below)
            });
            let joined = before.and_then(|before| {
                before.shape = before.shape.joined(&shape)?;
                Some(())
            });
            if joined.is_none() {
                self.open.push(piece);
            }
        }
    }

    /// Takes out the piece that `slice` continues from the V-scanline at `x` on, if there is one.
    pub fn take(&mut self, slice: &Slice, x: f64) -> Option<Trapezoid> {
        let place = self.open.iter().position(|before| {
            let shape = &before.shape;
            before.is_between(slice.face, x, slice.top.bound, slice.bottom.bound)
                && is_same_y(
                    shape.top,
                    [slice.top.at(shape.left), slice.top.at(shape.right)],
                )
                && is_same_y(
                    shape.bottom,
                    [slice.bottom.at(shape.left), slice.bottom.at(shape.right)],
                )
        })?;
        Some(self.open.swap_remove(place).shape)
    }

    /// Nothing more comes between the first of `ends`, neighbouring V-scanlines, and `x`.
    pub fn close_between(&mut self, ends: [f64; 2], x: f64) {
        self.close_unless(|right| right <= ends[0] || right == x || right >= ends[1]);
    }

    /// Nothing more comes left of `x`.
    pub fn close(&mut self, x: f64) {
        self.close_unless(|right| right == x);
    }

    fn close_unless(&mut self, stays_open: impl Fn(f64) -> bool) {
        let closed = &mut self.closed;
        self.open.retain(|piece| {
            let stays = stays_open(piece.shape.right);
            if !stays {
                closed.push(*piece);
            }
            stays
        });
    }

    pub fn closed(&self) -> &[Piece] {
        &self.closed
    }
}

impl Piece {
    fn is_between(&self, face: FaceId, right: f64, above: Bound, below: Bound) -> bool {
        self.shape.right == right
            && self.face == face
            && self.shape.above == above
            && self.shape.below == below
    }
}

impl Trapezoid {
    /// This one and `next`, to its right and between the same bounds, as one.
    ///
    /// `None` if rounding has bent a bound where they meet: near-vertical edges, which cross each
    /// other within the last bits of x, may be anywhere between two V-scanlines that close together,
    /// and a straight line from there would go astray.
    fn joined(&self, next: &Trapezoid) -> Option<Trapezoid> {
        let joined = Trapezoid {
            right: next.right,
            top: [self.top[0], next.top[1]],
            bottom: [self.bottom[0], next.bottom[1]],
            ..*self
        };
        let [ours, its] = [
            joined.between(self.left, self.right),
            joined.between(next.left, next.right),
        ];
        let is_straight = is_same_y(ours.top, self.top)
            && is_same_y(ours.bottom, self.bottom)
            && is_same_y(its.top, next.top)
            && is_same_y(its.bottom, next.bottom);
        is_straight.then_some(joined)
    }
}

/// Polygons with named sides.
#[derive(Default)]
pub(super) struct Pieces {
    /// Face and first corner of each polygon.
    entries: Vec<(FaceId, u32)>,
    corners: Vec<(DVec2, Side)>,
}

impl Pieces {
    fn corners(&self, index: usize) -> &[(DVec2, Side)] {
        let start = self.entries[index].1 as usize;
        let end = self
            .entries
            .get(index + 1)
            .map_or(self.corners.len(), |next| next.1 as usize);
        &self.corners[start..end]
    }
}

/// Makes polygons of a strip's trapezoids.
pub(super) fn pieces(
    faces: &Faces,
    strip: Strip,
    entering: &Entering,
    trapezoids: &[Piece],
) -> Pieces {
    let mut pieces = Pieces::default();
    let mut polygon = Vec::new();
    for piece in trapezoids {
        if piece.shape.is_negligible() {
            continue;
        }
        let start = pieces.corners.len();
        add_corners(faces, strip, entering, piece, &mut pieces.corners);
        polygon.clear();
        polygon.extend(pieces.corners[start..].iter().map(|corner| corner.0));
        if polygon.len() >= 3 && signed_area(&polygon) > 0.0 {
            let start = u32::try_from(start).expect("a strip has at most u32::MAX corners");
            pieces.entries.push((piece.face, start));
        } else {
            pieces.corners.truncate(start);
        }
    }
    pieces
}

/// Walks around a trapezoid, positively wound: along its top, down its right side, back along its
/// bottom, up its left side.
fn add_corners(
    faces: &Faces,
    strip: Strip,
    entering: &Entering,
    piece: &Piece,
    corners: &mut Vec<(DVec2, Side)>,
) {
    let Trapezoid {
        left,
        right,
        top,
        bottom,
        above,
        below,
    } = piece.shape;
    let naming = Naming { faces, piece };
    let upper = [DVec2::new(left, top[0]), DVec2::new(right, top[1])];
    let lower = [DVec2::new(right, bottom[1]), DVec2::new(left, bottom[0])];
    let at_x = |x: f64| {
        let edges = &entering.vertical;
        let start = edges.partition_point(|edge| edge.at < x);
        let count = edges[start..].partition_point(|edge| edge.at == x);
        &edges[start..start + count]
    };

    match above {
        Bound::HScanline => naming.scanline(upper, strip.top, &entering.horizontal, corners),
        bound => corners.push((upper[0], naming.bound(bound, upper))),
    }
    if top[1] < bottom[1] {
        naming.scanline([upper[1], lower[0]], right, at_x(right), corners);
    }
    match below {
        Bound::HScanline => naming.scanline(lower, strip.bottom, &entering.horizontal, corners),
        bound => corners.push((lower[0], naming.bound(bound, lower))),
    }
    if top[0] < bottom[0] {
        naming.scanline([lower[1], upper[0]], left, at_x(left), corners);
    }
}

/// Names the sides of one piece.
struct Naming<'a> {
    faces: &'a Faces,
    piece: &'a Piece,
}

impl Naming<'_> {
    fn bound(&self, bound: Bound, ends: [DVec2; 2]) -> Side {
        let face = self.piece.face;
        match bound {
            Bound::Edge(edge_of, index) if self.may_end_at(edge_of, 0.5 * (ends[0] + ends[1])) => {
                Side::of_outline(edge_of, index as usize)
            }
            Bound::Crossing(one, other) if one == face => Side::crossing(other),
            Bound::Crossing(one, other) if other == face => Side::crossing(one),
            // Something behind this face was cut here, and so was this face.
            _ => Side::scan(face),
        }
    }

    /// Names the side from `ends[0]` to `ends[1]` along the scanline at `at`. Where edges lie on the
    /// scanline it may have to be divided.
    fn scanline(
        &self,
        ends: [DVec2; 2],
        at: f64,
        edges: &[EdgeOnScanline],
        corners: &mut Vec<(DVec2, Side)>,
    ) {
        let is_vertical = ends[0].x == ends[1].x;
        let along = |point: DVec2| if is_vertical { point.y } else { point.x };
        let point = |along: f64| {
            if is_vertical {
                DVec2::new(ends[0].x, along)
            } else {
                DVec2::new(along, ends[0].y)
            }
        };
        let [start, end] = ends.map(along);
        let (low, high) = (start.min(end), start.max(end));
        let mut candidates: Vec<&EdgeOnScanline> = edges
            .iter()
            .filter(|edge| edge.at == at && edge.from < high && edge.to > low)
            .collect();
        candidates.retain(|edge| {
            let middle = 0.5 * (edge.from.max(low) + edge.to.min(high));
            self.may_end_at(edge.side.face, point(middle))
        });
        if candidates.is_empty() {
            corners.push((ends[0], Side::scan(self.piece.face)));
            return;
        }
        // The face's own edge before others, then by id.
        candidates.sort_by_key(|edge| (edge.side.face != self.piece.face, edge.side));
        let mut cuts: Vec<f64> = candidates
            .iter()
            .flat_map(|edge| [edge.from, edge.to])
            .filter(|&cut| cut > low && cut < high)
            .chain([low, high])
            .collect();
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let mut sides: Vec<(f64, f64, Side)> = Vec::new();
        for stretch in cuts.windows(2) {
            let side = candidates
                .iter()
                .find(|edge| edge.from <= stretch[0] && edge.to >= stretch[1])
                .map_or(Side::scan(self.piece.face), |edge| edge.side);
            match sides.last_mut() {
                Some(last) if last.2 == side => last.1 = stretch[1],
                _ => sides.push((stretch[0], stretch[1], side)),
            }
        }
        if start > end {
            corners.extend(sides.iter().rev().map(|&(_, to, side)| (point(to), side)));
        } else {
            corners.extend(sides.iter().map(|&(from, _, side)| (point(from), side)));
        }
    }

    /// Whether an edge of `other` may be where this piece's face stops being seen: it is the face's
    /// own, or one of an opaque face that is not behind. Touching faces are given the benefit of the
    /// doubt, since both names are of the same line.
    fn may_end_at(&self, other: FaceId, point: DVec2) -> bool {
        /// Relative to the planes' coefficients. Larger would name edges of hidden faces; smaller
        /// would leave edges of touching faces without a name.
        const TOUCHING: f64 = 1e-12;
        let face = self.piece.face;
        if other == face {
            return true;
        }
        if self.faces.is_veil(other) {
            return false;
        }
        if self.faces.plane(face) == self.faces.plane(other) {
            return other < face;
        }
        let (own, its) = (
            self.faces.face_nearness(face),
            self.faces.face_nearness(other),
        );
        let scale =
            own.a.abs() + own.b.abs() + own.c.abs() + its.a.abs() + its.b.abs() + its.c.abs();
        own.minus(its).at(point) <= TOUCHING * scale
    }
}

/// Puts the strips together: whole faces as such, pieces of the others from top to bottom.
pub(super) fn assemble(faces: &Faces, strips: &[StripSeen]) -> Seen {
    let mut hidden = vec![false; faces.len()];
    for face in strips.iter().flat_map(|strip| &strip.hidden) {
        hidden[face.index()] = true;
    }
    Seen {
        opaque: by_face(&hidden, strips.iter().map(|strip| &strip.opaque)),
        veils: by_face(&hidden, strips.iter().map(|strip| &strip.veils)),
    }
}

fn by_face<'a>(hidden: &[bool], strips: impl Iterator<Item = &'a Pieces> + Clone) -> Fragments {
    let mut start = vec![0usize; hidden.len() + 1];
    for (face, _) in strips.clone().flat_map(|pieces| &pieces.entries) {
        start[face.index() + 1] += 1;
    }
    for face in 0..hidden.len() {
        start[face + 1] += start[face];
    }
    let mut next = start.clone();
    let mut sorted: Vec<&[(DVec2, Side)]> = vec![&[]; start[hidden.len()]];
    for pieces in strips {
        for (index, (face, _)) in pieces.entries.iter().enumerate() {
            sorted[next[face.index()]] = pieces.corners(index);
            next[face.index()] += 1;
        }
    }
    let mut fragments = Fragments::new();
    for (face, &is_hidden) in hidden.iter().enumerate() {
        let pieces = &sorted[start[face]..start[face + 1]];
        let face = FaceId::from_index(face);
        if !is_hidden && !pieces.is_empty() {
            fragments.push_whole(face);
            continue;
        }
        for corners in pieces {
            fragments.push_cut(face, corners.iter().copied());
        }
    }
    fragments
}
