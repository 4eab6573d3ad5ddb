//! Between two H-scanlines: which faces enter the strip, and their slices.

use super::{Bound, COINCIDENT, ROUNDING};
use veduta_geometry::DVec2;
use veduta_map::{FaceId, Faces, Side};

/// The part of the frame between two H-scanlines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strip {
    /// y of the upper H-scanline.
    pub top: f64,
    /// y of the lower H-scanline.
    pub bottom: f64,
}

/// Which faces touch which strip.
pub(super) struct Bins {
    strips: u32,
    /// `start[k]..start[k + 1]` are the members of strip `k`.
    start: Vec<usize>,
    members: Vec<FaceId>,
}

impl Bins {
    /// Sorts faces into strips. A face that only touches an H-scanline is in the strips on both
    /// sides of it, because it may name a side of what is seen there.
    pub fn new(faces: &Faces, strips: u32) -> Self {
        let ranges: Vec<(u32, u32)> = faces
            .ids()
            .map(|face| {
                let ys = faces.outline(face).iter().map(|vertex| vertex.y);
                let top = ys.clone().fold(f64::INFINITY, f64::min);
                let bottom = ys.fold(f64::NEG_INFINITY, f64::max);
                // The quotient may round to either side of an H-scanline, so the scanlines decide.
                let guess = |y: f64| (y * f64::from(strips)).clamp(0.0, f64::from(strips)) as u32;
                let mut first = guess(top).min(strips - 1);
                while first > 0 && h_scanline(first, strips) >= top - COINCIDENT {
                    first -= 1;
                }
                let mut last = guess(bottom).min(strips - 1);
                while last + 1 < strips && h_scanline(last + 1, strips) <= bottom + COINCIDENT {
                    last += 1;
                }
                (first, last)
            })
            .collect();
        let mut start = vec![0; strips as usize + 1];
        for &(first, last) in &ranges {
            for strip in first..=last {
                start[strip as usize + 1] += 1;
            }
        }
        for strip in 0..strips as usize {
            start[strip + 1] += start[strip];
        }
        let mut next = start.clone();
        let mut members = vec![FaceId(0); start[strips as usize]];
        for (face, &(first, last)) in faces.ids().zip(&ranges) {
            for strip in first..=last {
                members[next[strip as usize]] = face;
                next[strip as usize] += 1;
            }
        }
        Self {
            strips,
            start,
            members,
        }
    }

    /// Where strip `index` lies.
    pub fn strip(&self, index: u32) -> Strip {
        Strip {
            top: h_scanline(index, self.strips),
            bottom: h_scanline(index + 1, self.strips),
        }
    }

    /// The faces that touch strip `index`, ascending.
    pub fn faces(&self, index: u32) -> &[FaceId] {
        let index = index as usize;
        &self.members[self.start[index]..self.start[index + 1]]
    }
}

/// y of H-scanline `index`: a row's border, when there is a strip for each row.
fn h_scanline(index: u32, strips: u32) -> f64 {
    f64::from(index) / f64::from(strips)
}

/// A straight bound of a slice as a function of x, within the strip.
///
/// Evaluated from the end that is smaller by (x, y), so that faces with a common edge get bit-equal
/// values, and exact at both ends, so that edges with a common vertex meet there.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoundLine {
    from: DVec2,
    to: DVec2,
    slope: f64,
    lowest: f64,
    highest: f64,
    pub bound: Bound,
}

impl BoundLine {
    fn h_scanline(y: f64) -> Self {
        Self {
            from: DVec2::new(f64::NEG_INFINITY, y),
            to: DVec2::new(f64::INFINITY, y),
            slope: 0.0,
            lowest: y,
            highest: y,
            bound: Bound::HScanline,
        }
    }

    fn edge(face: FaceId, index: u32, ends: [DVec2; 2], strip: Strip) -> Self {
        let [from, to] = in_order(ends);
        let slope = (to.y - from.y) / (to.x - from.x);
        Self {
            from,
            to,
            slope,
            lowest: from.y.min(to.y).max(strip.top),
            highest: from.y.max(to.y).min(strip.bottom),
            bound: Bound::Edge(face, index),
        }
    }

    /// y at `x`.
    #[inline]
    pub fn at(&self, x: f64) -> f64 {
        let y = if self.lowest == self.highest {
            self.lowest
        } else if x <= self.from.x {
            self.from.y
        } else if x >= self.to.x {
            self.to.y
        } else {
            self.from.y + (x - self.from.x) * self.slope
        };
        // Not `clamp`: it panics where rounding has put the bounds in the wrong order.
        y.max(self.lowest).min(self.highest)
    }
}

/// What one face has in the strip between two of its V-scanlines: a trapezoid between two straight
/// bounds. The slices of a face fill its part of the strip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    pub face: FaceId,
    pub left: f64,
    pub right: f64,
    pub top: BoundLine,
    pub bottom: BoundLine,
}

/// An outline's side that lies along a scanline.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeOnScanline {
    /// x of a V-scanline, y of an H-scanline.
    pub at: f64,
    /// The smaller other coordinate of its ends.
    pub from: f64,
    /// The larger one.
    pub to: f64,
    pub side: Side,
}

/// What the H-scan finds in a strip.
#[derive(Default)]
pub(super) struct Entering {
    /// All slices, by face and then by x.
    pub slices: Vec<Slice>,
    /// Vertical sides of outlines, by x: if they are quite vertical no slice has them for a bound.
    pub vertical: Vec<EdgeOnScanline>,
    /// Sides of outlines that lie on the upper or the lower H-scanline.
    pub horizontal: Vec<EdgeOnScanline>,
    above: Vec<Reach>,
    below: Vec<Reach>,
}

/// The stretch of x in which a side of an outline, or an H-scanline, bounds the face's part of the
/// strip.
#[derive(Clone, Copy)]
struct Reach {
    from: f64,
    to: f64,
    /// `None` for the H-scanline.
    edge: Option<u32>,
}

impl Entering {
    /// Finds the slices of `members` in `strip`.
    pub fn scan(&mut self, faces: &Faces, members: &[FaceId], strip: Strip) {
        self.slices.clear();
        self.vertical.clear();
        self.horizontal.clear();
        for &face in members {
            self.enter(faces, face, strip);
        }
        self.vertical
            .sort_by(|edge, other| edge.at.total_cmp(&other.at));
    }

    /// A positively wound outline has its upper sides run to the right and its lower sides to the
    /// left. Where no upper side is in the strip, the face reaches up to the H-scanline, and down
    /// likewise.
    fn enter(&mut self, faces: &Faces, face: FaceId, strip: Strip) {
        let outline = faces.outline(face);
        self.above.clear();
        self.below.clear();
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        for index in 0..outline.len() {
            let ends = side_of(outline, index);
            let [p, q] = ends;
            let extent = (q - p).abs();
            if extent.min_element() <= COINCIDENT {
                self.note_edge_on_scanline(face, index, ends, strip);
            }
            if p.y.max(q.y) <= strip.top || p.y.min(q.y) >= strip.bottom {
                continue;
            }
            let start = x_within(strip, ends, p);
            let end = x_within(strip, ends, q);
            left = left.min(start.min(end));
            right = right.max(start.max(end));
            let edge = Some(index as u32);
            if start < end {
                let (from, to) = (start, end);
                self.above.push(Reach { from, to, edge });
            } else if end < start {
                let (from, to) = (end, start);
                self.below.push(Reach { from, to, edge });
            }
        }
        fill_with_h_scanline(&mut self.above, left, right);
        fill_with_h_scanline(&mut self.below, left, right);

        let line = |edge: Option<u32>, y: f64| match edge {
            None => BoundLine::h_scanline(y),
            Some(index) => BoundLine::edge(face, index, side_of(outline, index as usize), strip),
        };
        let (mut upper, mut lower) = (0, 0);
        while upper < self.above.len() && lower < self.below.len() {
            let (above, below) = (self.above[upper], self.below[lower]);
            let left = above.from.max(below.from);
            let right = above.to.min(below.to);
            if left < right {
                self.slices.push(Slice {
                    face,
                    left,
                    right,
                    top: line(above.edge, strip.top),
                    bottom: line(below.edge, strip.bottom),
                });
            }
            upper += usize::from(above.to <= below.to);
            lower += usize::from(below.to <= above.to);
        }
    }

    fn note_edge_on_scanline(
        &mut self,
        face: FaceId,
        index: usize,
        [p, q]: [DVec2; 2],
        strip: Strip,
    ) {
        let side = Side::of_outline(face, index);
        let extent = (q - p).abs();
        let is_vertical = extent.x <= extent.y;
        if is_vertical && p.y.max(q.y) > strip.top && p.y.min(q.y) < strip.bottom {
            self.vertical.push(EdgeOnScanline {
                at: p.x,
                from: p.y.min(q.y),
                to: p.y.max(q.y),
                side,
            });
        }
        let is_at = |y: f64| (p.y - y).abs() <= COINCIDENT;
        if !is_vertical && (is_at(strip.top) || is_at(strip.bottom)) {
            self.horizontal.push(EdgeOnScanline {
                at: p.y,
                from: p.x.min(q.x),
                to: p.x.max(q.x),
                side,
            });
        }
    }
}

/// The ends of side `index`, in the outline's direction.
fn side_of(outline: &[DVec2], index: usize) -> [DVec2; 2] {
    let next = if index + 1 == outline.len() {
        0
    } else {
        index + 1
    };
    [outline[index], outline[next]]
}

/// The ends of an edge, the one that is smaller by (x, y) first.
fn in_order([p, q]: [DVec2; 2]) -> [DVec2; 2] {
    if (p.x, p.y) <= (q.x, q.y) {
        [p, q]
    } else {
        [q, p]
    }
}

/// x of `end`, one of an edge's `ends`, after the edge has been cut off at the H-scanlines.
/// Bit-equal for faces with a common edge.
fn x_within(strip: Strip, ends: [DVec2; 2], end: DVec2) -> f64 {
    let y = end.y.max(strip.top).min(strip.bottom);
    if y == end.y {
        return end.x;
    }
    let [from, to] = in_order(ends);
    let x = from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y));
    x.max(from.x).min(to.x)
}

/// Sorts the stretches of one chain by x and fills the gaps between `left` and `right`.
///
/// A gap within rounding is none: two edges that meet near the H-scanline may leave one where the
/// outline has nothing, and its slice would reach to the far H-scanline.
fn fill_with_h_scanline(chain: &mut Vec<Reach>, left: f64, right: f64) {
    chain.sort_unstable_by(|reach, other| reach.from.total_cmp(&other.from));
    let edges = chain.len();
    let mut filled = left;
    for index in 0..=edges {
        let next = chain[..edges].get(index).copied();
        let from = next.map_or(right, |reach| reach.from);
        if from - filled > ROUNDING {
            chain.push(Reach {
                from: filled,
                to: from,
                edge: None,
            });
        }
        filled = next.map_or(right, |reach| reach.to);
    }
    if chain.len() > edges {
        chain.sort_unstable_by(|reach, other| reach.from.total_cmp(&other.from));
    }
}
