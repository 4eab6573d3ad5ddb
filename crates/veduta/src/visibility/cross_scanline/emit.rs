//! Pieces become fragments: joined across V-scanlines, their sides named, sorted by face.

use super::h_scan::{EdgeOnScanline, Entering, Slice, Strip};
use super::order::behind;
use super::{Bound, COINCIDENT, Piece, StripSeen, Trapezoid, is_same_y};
use crate::visibility::Seen;
use veduta_geometry::{DVec2, signed_area};
use veduta_map::{FaceId, Faces, Fragments, Side};

/// The pieces of a strip, either of opaque faces or of veils, while it is swept.
///
/// The pieces of a face that lie between the same two bounds, one right of the other, become one,
/// and so do pieces one above the other: V-scanlines and the edges of hidden faces leave no trace.
#[derive(Default)]
pub(super) struct Layer {
    /// What has been seen of a cluster between two V-scanlines.
    column: Vec<Piece>,
    /// What is being folded.
    folded: Vec<Piece>,
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

    /// Adds a piece to the column; between the same cuts in x, pieces come from top to bottom.
    pub fn stack(&mut self, piece: Piece) {
        let shape = piece.shape;
        let above = self.column.iter_mut().rfind(|above| {
            above.face == piece.face
                && above.shape.left == shape.left
                && above.shape.right == shape.right
                && is_same_y(above.shape.bottom, shape.top)
        });
        match above {
            Some(above) => {
                above.shape.bottom = shape.bottom;
                above.shape.below = shape.below;
            }
            None => self.column.push(piece),
        }
    }

    /// How much is in the column.
    pub fn mark(&self) -> usize {
        self.column.len()
    }

    /// Joins what the column has got since `mark`, where it has been cut in x, and stacks it anew: a
    /// face may not have noticed the crossing of edges behind it.
    pub fn fold(&mut self, mark: usize) {
        let mut folded = std::mem::take(&mut self.folded);
        for piece in self.column.drain(mark..) {
            append(&mut folded, piece);
        }
        for piece in folded.drain(..) {
            self.stack(piece);
        }
        self.folded = folded;
    }

    /// Joins the column's pieces with those that they continue.
    pub fn join(&mut self) {
        for piece in self.column.drain(..) {
            append(&mut self.open, piece);
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

    /// Nothing more comes left of `x`.
    pub fn close(&mut self, x: f64) {
        let closed = &mut self.closed;
        self.open.retain(|piece| {
            let stays_open = piece.shape.right == x;
            if !stays_open {
                closed.push(*piece);
            }
            stays_open
        });
    }

    pub fn closed(&self) -> &[Piece] {
        &self.closed
    }
}

/// Adds a piece to others, one of which it may continue.
fn append(pieces: &mut Vec<Piece>, piece: Piece) {
    let shape = piece.shape;
    let before = pieces
        .iter_mut()
        .rfind(|before| before.is_between(piece.face, shape.left, shape.above, shape.below));
    let joined = before.and_then(|before| {
        before.shape = before.shape.joined(&shape)?;
        Some(())
    });
    if joined.is_none() {
        pieces.push(piece);
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
    let naming = Naming {
        faces,
        entering,
        piece,
    };
    let upper = [DVec2::new(left, top[0]), DVec2::new(right, top[1])];
    let lower = [DVec2::new(right, bottom[1]), DVec2::new(left, bottom[0])];
    naming.bound(upper, above, strip.top, corners);
    if top[1] < bottom[1] {
        naming.v_scanline([upper[1], lower[0]], corners);
    }
    naming.bound(lower, below, strip.bottom, corners);
    if top[0] < bottom[0] {
        naming.v_scanline([lower[1], upper[0]], corners);
    }
}

/// Names the sides of one piece.
///
/// A side is named after an edge that bounds the piece's face there: the face's own, or that of an
/// opaque face not behind it. Several edges may lie along one side, and an edge may bound the face
/// along a part of it only, because it ends or goes behind the face; then the side is divided.
struct Naming<'a> {
    faces: &'a Faces,
    entering: &'a Entering,
    piece: &'a Piece,
}

/// An edge along a side, between two positions along the side.
#[derive(Clone, Copy)]
struct EdgeAlong {
    from: f64,
    to: f64,
    side: Side,
}

impl Naming<'_> {
    /// Names the side from `ends[0]` to `ends[1]` along a bound; if that is an H-scanline, it is the
    /// one at `h_scanline`.
    fn bound(
        &self,
        ends: [DVec2; 2],
        bound: Bound,
        h_scanline: f64,
        corners: &mut Vec<(DVec2, Side)>,
    ) {
        let face = self.piece.face;
        // Of several faces on one plane another may have been compared.
        let is_own = |other: FaceId| {
            other == face || self.faces.face_nearness(other) == self.faces.face_nearness(face)
        };
        match bound {
            Bound::HScanline => {
                let edges = self.entering.horizontal.iter();
                let is_here = |edge: &&EdgeOnScanline| is_coincident(edge.at, h_scanline);
                self.divide(ends, edges.filter(is_here).map(EdgeAlong::from), corners);
            }
            Bound::Crossing(one, other) if is_own(one) => {
                corners.push((ends[0], Side::crossing(other)));
            }
            Bound::Crossing(one, other) if is_own(other) => {
                corners.push((ends[0], Side::crossing(one)));
            }
            // Faces behind this one cross here, and it was cut with them.
            Bound::Crossing(..) => corners.push((ends[0], Side::scan(face))),
            Bound::Edge(other, index) => {
                if ends.map(|end| behind(self.faces, face, other, end) <= 0.0) == [true; 2] {
                    corners.push((ends[0], Side::of_outline(other, index as usize)));
                } else {
                    self.divide(ends, self.edges_along(ends), corners);
                }
            }
        }
    }

    /// Names the side from `ends[0]` to `ends[1]` along a V-scanline.
    fn v_scanline(&self, ends: [DVec2; 2], corners: &mut Vec<(DVec2, Side)>) {
        let edges = &self.entering.vertical;
        let x = ends[0].x;
        let start = edges.partition_point(|edge| edge.at < x - COINCIDENT);
        let here = edges[start..]
            .iter()
            .take_while(|edge| is_coincident(edge.at, x));
        self.divide(ends, here.map(EdgeAlong::from), corners);
    }

    /// All edges in the strip that lie along a side which is not vertical.
    fn edges_along(&self, ends: [DVec2; 2]) -> impl Iterator<Item = EdgeAlong> {
        let [start, end] = ends;
        let (low, high) = (start.x.min(end.x), start.x.max(end.x));
        let y = move |x: f64| start.y + (end.y - start.y) * ((x - start.x) / (end.x - start.x));
        self.entering
            .slices
            .iter()
            .filter(move |slice| slice.left < high && slice.right > low)
            .flat_map(|slice| [(slice, slice.top), (slice, slice.bottom)])
            .filter_map(move |(slice, line)| {
                let Bound::Edge(face, index) = line.bound else {
                    return None;
                };
                let (from, to) = (slice.left.max(low), slice.right.min(high));
                let is_along = [from, to]
                    .into_iter()
                    .all(|x| is_coincident(line.at(x), y(x)));
                let side = Side::of_outline(face, index as usize);
                is_along.then_some(EdgeAlong { from, to, side })
            })
    }

    /// Names the side from `ends[0]` to `ends[1]` after `edges`, in one or several parts.
    fn divide(
        &self,
        ends: [DVec2; 2],
        edges: impl Iterator<Item = EdgeAlong>,
        corners: &mut Vec<(DVec2, Side)>,
    ) {
        let is_vertical = ends[0].x == ends[1].x;
        let [start, end] = ends.map(|point| if is_vertical { point.y } else { point.x });
        let point = |along: f64| {
            if along == start {
                ends[0]
            } else if along == end {
                ends[1]
            } else {
                ends[0].lerp(ends[1], (along - start) / (end - start))
            }
        };
        let (low, high) = (start.min(end), start.max(end));
        let mut edges: Vec<EdgeAlong> = edges
            .filter(|edge| edge.from < high && edge.to > low)
            .filter_map(|edge| {
                let stretch = [edge.from.max(low), edge.to.min(high)];
                let behind = stretch
                    .map(|along| behind(self.faces, self.piece.face, edge.side.face, point(along)));
                let [from, to] = where_not_positive(stretch, behind)?;
                Some(EdgeAlong { from, to, ..edge })
            })
            .collect();
        let scan = Side::scan(self.piece.face);
        if edges.is_empty() {
            corners.push((ends[0], scan));
            return;
        }
        // The face's own edge before others, then by id.
        edges.sort_by_key(|edge| (edge.side.face != self.piece.face, edge.side));
        let mut cuts: Vec<f64> = edges
            .iter()
            .flat_map(|edge| [edge.from, edge.to])
            .filter(|&cut| cut > low + COINCIDENT && cut < high - COINCIDENT)
            .collect();
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|next, cut| is_coincident(*next, *cut));
        // Whatever is between them, the ends stay: the piece has its corners there.
        cuts.insert(0, low);
        cuts.push(high);
        let mut parts: Vec<(f64, f64, Side)> = Vec::new();
        for stretch in cuts.windows(2) {
            let middle = 0.5 * (stretch[0] + stretch[1]);
            let side = edges
                .iter()
                .find(|edge| edge.from <= middle && edge.to >= middle)
                .map_or(scan, |edge| edge.side);
            match parts.last_mut() {
                Some(last) if last.2 == side => last.1 = stretch[1],
                _ => parts.push((stretch[0], stretch[1], side)),
            }
        }
        if start > end {
            corners.extend(parts.iter().rev().map(|&(_, to, side)| (point(to), side)));
        } else {
            corners.extend(parts.iter().map(|&(from, _, side)| (point(from), side)));
        }
    }
}

impl From<&EdgeOnScanline> for EdgeAlong {
    fn from(edge: &EdgeOnScanline) -> Self {
        Self {
            from: edge.from,
            to: edge.to,
            side: edge.side,
        }
    }
}

fn is_coincident(one: f64, other: f64) -> bool {
    (one - other).abs() <= COINCIDENT
}

/// The part of a stretch in which an affine function is not positive, given its values at the ends.
fn where_not_positive([from, to]: [f64; 2], values: [f64; 2]) -> Option<[f64; 2]> {
    let zero = || from + (to - from) * (values[0] / (values[0] - values[1]));
    match values.map(|value| value <= 0.0) {
        [true, true] => Some([from, to]),
        [true, false] => Some([from, zero()]),
        [false, true] => Some([zero(), to]),
        [false, false] => None,
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
