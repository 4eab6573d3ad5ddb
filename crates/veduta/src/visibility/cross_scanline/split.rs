//! A cluster of overlapping slices between two V-scanlines, cut until one face is nearest in each
//! part.
//!
//! First in x, where bounds cross each other: between two such crossings the bounds have one order
//! from top to bottom. A cut need not go through the whole cluster, only through the *zone* of
//! bounds that cross one another, from the next straight bound above to the next one below:
//!
//! ```text
//!     ──────────────────    a bound that crosses nothing
//!     ╲_      │     _╱
//!       ╲_    │   _╱        a zone, cut at the crossing
//!         ╲_  │_╱
//!           ╲╱│╲
//!     ────────┴──╲──────    the next bound that crosses nothing here
//! ```
//!
//! Between each bound and the next lies a trapezoid in which a fixed set of faces is, and there the
//! planes decide; where two planes cross inside it, it is cut along the line in which they do, the
//! paper's virtual edge (§4). A virtual edge is an edge for this trapezoid only, so no face enters or
//! leaves at it, and it needs no prolongation to the cell's border.

use super::emit::Layer;
use super::h_scan::Slice;
use super::order::Difference;
use super::{Bound, COINCIDENT, Piece, ROUNDING, Trapezoid, between, both_between};
use std::ops::Range;
use veduta_geometry::DVec2;
use veduta_map::{FaceId, Faces};

/// A slice of a cluster, with its bounds' y at the two V-scanlines.
#[derive(Clone, Copy)]
pub(super) struct Member {
    pub slice: u32,
    pub top: [f64; 2],
    pub bottom: [f64; 2],
}

/// The strip that clusters are of, and what is found out about it.
pub(super) struct Found<'a> {
    pub faces: &'a Faces,
    pub slices: &'a [Slice],
    /// Of each slice, whether something in front of it hides a part of it.
    pub hidden: &'a mut [bool],
    pub opaque: &'a mut Layer,
    pub veils: &'a mut Layer,
}

/// Cuts clusters. It keeps only memory between them.
#[derive(Default)]
pub(super) struct Splitter {
    /// x of the V-scanlines on both sides of the cluster.
    ends: [f64; 2],
    members: Vec<Member>,
    /// Upper and lower bounds of the members; sorted from top to bottom where they are used.
    bounds: Vec<MemberBound>,
    /// `reach[i]`: the topmost y of `bounds[i..]` in the current zone, at both ends.
    reach: Vec<[f64; 2]>,
    /// The right ends of what is left of each zone, the outermost zone's first.
    cuts: Vec<f64>,
    /// What covers the current trapezoid, in no order, and the same sorted.
    cover: Vec<Covering>,
    opaque: Vec<Covering>,
    veils: Vec<Covering>,
    /// The parts of the current trapezoid, each with the nearest opaque face.
    nearest: Vec<(Covering, Trapezoid)>,
}

/// The upper or lower bound of a member.
#[derive(Clone, Copy)]
struct MemberBound {
    member: u32,
    is_lower: bool,
    /// y at the ends of the current part of the zone.
    y: [f64; 2],
}

impl MemberBound {
    /// Twice y in the middle.
    fn middle(&self) -> f64 {
        self.y[0] + self.y[1]
    }
}

/// A face that covers the current trapezoid.
#[derive(Clone, Copy)]
struct Covering {
    face: FaceId,
    member: u32,
}

impl Splitter {
    /// Cuts the cluster of `members` between the V-scanlines at `ends`.
    pub fn split(
        &mut self,
        found: &mut Found,
        members: impl Iterator<Item = Member>,
        ends: [f64; 2],
    ) {
        self.ends = ends;
        self.members.clear();
        self.members.extend(members);
        self.bounds.clear();
        for (index, member) in self.members.iter().enumerate() {
            for (is_lower, y) in [(false, member.top), (true, member.bottom)] {
                self.bounds.push(MemberBound {
                    member: index as u32,
                    is_lower,
                    y,
                });
            }
        }
        self.reach.resize(self.bounds.len(), [0.0; 2]);
        self.cover.clear();
        self.zone(found, 0..self.bounds.len(), [None, None], ends);
        found.opaque.join();
        found.veils.join();
    }

    /// Handles the zone of the bounds `run` and of what lies between them and the straight bounds
    /// `around` it, above and below.
    ///
    /// The cover is what it is above the zone, and becomes what it is below.
    fn zone(
        &mut self,
        found: &mut Found,
        run: Range<usize>,
        around: [Option<usize>; 2],
        [mut left, right]: [f64; 2],
    ) {
        let first_pieces = [found.opaque.mark(), found.veils.mark()];
        let outer_cuts = self.cuts.len();
        self.cuts.push(right);
        let mut is_cut = false;
        while let Some(&right) = self.cuts[outer_cuts..].last() {
            self.sort_bounds(run.clone(), left, right);
            let all_cross = self.end_of_crossings(run.start, run.end) == run.end;
            let crossing = all_cross
                .then(|| self.first_crossing(run.clone(), left, right))
                .flatten();
            if let Some(x) = crossing {
                self.cuts.push(x);
                is_cut = true;
                continue;
            }
            self.descend(found, run.clone(), around, [left, right], all_cross);
            left = right;
            self.cuts.pop();
            if self.cuts.len() > outer_cuts {
                // Back to the cover above the zone.
                run.clone().for_each(|index| self.toggle(found, index));
            }
        }
        if is_cut {
            found.opaque.fold(first_pieces[0]);
            found.veils.fold(first_pieces[1]);
        }
    }

    /// Bound `index` between two `ends`, which lie between the V-scanlines.
    fn evaluated(&self, index: usize, ends: [f64; 2]) -> MemberBound {
        let bound = self.bounds[index];
        let member = &self.members[bound.member as usize];
        let y = if bound.is_lower {
            member.bottom
        } else {
            member.top
        };
        let y = self.part_of(y, ends);
        MemberBound { y, ..bound }
    }

    /// The part between the two `ends` of a line with these `y` at the V-scanlines.
    fn part_of(&self, y: [f64; 2], ends: [f64; 2]) -> [f64; 2] {
        let width = self.ends[1] - self.ends[0];
        both_between(y, ends.map(|x| (x - self.ends[0]) / width))
    }

    /// Evaluates the bounds `run` at `left` and `right`, sorts them by the middle, and notes how far
    /// up those further down reach.
    fn sort_bounds(&mut self, run: Range<usize>, left: f64, right: f64) {
        for index in run.clone() {
            self.bounds[index] = self.evaluated(index, [left, right]);
        }
        // Stable, and quick where the order has hardly changed since the last part.
        self.bounds[run.clone()].sort_by(|bound, other| bound.middle().total_cmp(&other.middle()));
        let mut topmost = [f64::INFINITY; 2];
        for index in run.rev() {
            let y = self.bounds[index].y;
            topmost = [topmost[0].min(y[0]), topmost[1].min(y[1])];
            self.reach[index] = topmost;
        }
    }

    /// The end of the bounds from `first` on that cross others: `first` itself if that crosses none.
    fn end_of_crossings(&self, first: usize, end: usize) -> usize {
        let mut straight = first;
        while straight < end {
            let mut lowest = self.bounds[straight].y;
            let mut next = straight + 1;
            while next < end
                && (self.reach[next][0] < lowest[0] - ROUNDING
                    || self.reach[next][1] < lowest[1] - ROUNDING)
            {
                let y = self.bounds[next].y;
                lowest = lower_of(lowest, y);
                next += 1;
            }
            if next == straight + 1 {
                break;
            }
            straight = next;
        }
        straight
    }

    /// Where two bounds that are neighbours in the middle cross on the way to an end, if any do.
    ///
    /// Looking at neighbours is enough: of bounds that are out of order at an end, some neighbours
    /// are. After a cut at the crossing the two are in order on both sides, but for rounding, so
    /// the cutting comes to an end.
    fn first_crossing(&self, run: Range<usize>, left: f64, right: f64) -> Option<f64> {
        let half = 0.5 * (right - left);
        let middle = left + half;
        self.bounds[run].windows(2).find_map(|pair| {
            let at_middle = 0.5 * (pair[0].middle() - pair[1].middle());
            [(0, -half), (1, half)].into_iter().find_map(|(end, way)| {
                let at_end = pair[0].y[end] - pair[1].y[end];
                if at_end <= ROUNDING {
                    return None;
                }
                let x = middle + way * (at_middle / (at_middle - at_end));
                (x > left + ROUNDING && x < right - ROUNDING).then_some(x)
            })
        })
    }

    /// Goes through the trapezoids between each bound of `run` and the next, and through the zones in
    /// between; with `in_order`, what is left of crossings is taken for rounding.
    fn descend(
        &mut self,
        found: &mut Found,
        run: Range<usize>,
        [above, below]: [Option<usize>; 2],
        ends: [f64; 2],
        in_order: bool,
    ) {
        // The last bound's place, and its y, moved down where rounding has put it above others.
        let mut above = above.map(|above| (above, self.evaluated(above, ends).y));
        let mut index = run.start;
        while index < run.end {
            let straight = if in_order {
                index
            } else {
                self.end_of_crossings(index, run.end)
            };
            let next = if straight < run.end {
                Some(straight)
            } else {
                below
            };
            if straight > index {
                let around = [above.map(|(place, _)| place), next];
                self.zone(found, index..straight, around, ends);
            } else {
                self.between_bounds(found, above, next, ends);
            }
            if straight == run.end {
                return;
            }
            self.toggle(found, straight);
            let y = self.bounds[straight].y;
            above = Some((straight, above.map_or(y, |(_, above)| lower_of(y, above))));
            index = straight + 1;
        }
        self.between_bounds(found, above, below, ends);
    }

    /// At a member's first bound it enters the cover, at the second it leaves. Which of them is the
    /// lower one does not matter: a slice thinner than rounding may be upside down.
    fn toggle(&mut self, found: &Found, index: usize) {
        let member = self.bounds[index].member;
        let place = self.cover.iter().position(|other| other.member == member);
        if let Some(place) = place {
            self.cover.swap_remove(place);
        } else {
            let slice = self.members[member as usize].slice;
            let face = found.slices[slice as usize].face;
            self.cover.push(Covering { face, member });
        }
    }

    /// Handles the trapezoid between two neighbouring bounds.
    fn between_bounds(
        &mut self,
        found: &mut Found,
        above: Option<(usize, [f64; 2])>,
        below: Option<usize>,
        ends: [f64; 2],
    ) {
        let (Some((above, top)), Some(below)) = (above, below) else {
            return;
        };
        if self.cover.is_empty() {
            return;
        }
        let shape = Trapezoid {
            left: ends[0],
            right: ends[1],
            top,
            bottom: lower_of(self.evaluated(below, ends).y, top),
            above: self.name(found, &self.bounds[above]),
            below: self.name(found, &self.bounds[below]),
        };
        if !shape.is_flat() {
            self.see(found, shape);
        }
    }

    /// What makes a bound.
    fn name(&self, found: &Found, bound: &MemberBound) -> Bound {
        let slice = &found.slices[self.members[bound.member as usize].slice as usize];
        if bound.is_lower {
            slice.bottom.bound
        } else {
            slice.top.bound
        }
    }

    /// Finds what is seen in the trapezoid `shape`, which every face of the cover covers.
    fn see(&mut self, found: &mut Found, shape: Trapezoid) {
        let faces = found.faces;
        self.sort_cover(faces, &shape);
        self.nearest.clear();
        if let Some((&first, rest)) = self.opaque.split_first() {
            nearest(faces, shape, first, rest, &mut self.nearest);
        }
        for &(covering, part) in &self.nearest {
            let piece = self.piece(found, covering, &shape, part);
            found.opaque.stack(piece);
        }
        // What rounding may have hidden does not keep a face from being seen whole.
        let matters = !shape.is_negligible();
        for covering in &self.opaque {
            let is_seen = |(seen, _): &(Covering, _)| seen.face == covering.face;
            if matters && !self.nearest.iter().all(is_seen) {
                self.hide(found, *covering);
            }
        }
        for &veil in &self.veils {
            if self.nearest.is_empty() {
                let piece = self.piece(found, veil, &shape, shape);
                found.veils.stack(piece);
            }
            for &(front, part) in &self.nearest {
                let order = compare(faces, veil.face, front.face, &part);
                if matters && !matches!(order, Order::Front) {
                    self.hide(found, veil);
                }
                order.for_each_front(part, |part| {
                    let piece = self.piece(found, veil, &shape, part);
                    found.veils.stack(piece);
                });
            }
        }
    }

    /// Sorts the cover into opaque faces and veils; the opaque face that is nearest in the middle of
    /// the trapezoid comes first, because it is likely to hide the others without any cut.
    fn sort_cover(&mut self, faces: &Faces, shape: &Trapezoid) {
        let middle = DVec2::new(
            0.5 * (shape.left + shape.right),
            0.25 * (shape.top[0] + shape.top[1] + shape.bottom[0] + shape.bottom[1]),
        );
        self.opaque.clear();
        self.veils.clear();
        for &covering in &self.cover {
            if faces.is_veil(covering.face) {
                self.veils.push(covering);
                continue;
            }
            self.opaque.push(covering);
            let last = self.opaque.len() - 1;
            if Difference::of(faces, covering.face, self.opaque[0].face).is_in_front(middle) {
                self.opaque.swap(0, last);
            }
        }
    }

    fn hide(&self, found: &mut Found, covering: Covering) {
        found.hidden[self.members[covering.member as usize].slice as usize] = true;
    }

    /// What is seen of a face in `part` of the trapezoid `shape`. A face prefers its own name for a
    /// bound that it shares with others.
    fn piece(
        &self,
        found: &Found,
        covering: Covering,
        shape: &Trapezoid,
        part: Trapezoid,
    ) -> Piece {
        let member = &self.members[covering.member as usize];
        let slice = &found.slices[member.slice as usize];
        let is_own = |y: [f64; 2], own: [f64; 2]| {
            let own = self.part_of(own, [shape.left, shape.right]);
            (y[0] - own[0]).abs() <= COINCIDENT && (y[1] - own[1]).abs() <= COINCIDENT
        };
        let mut piece = Piece {
            face: covering.face,
            shape: part,
        };
        // Other bounds of the part are virtual edges.
        if part.above == shape.above && is_own(shape.top, member.top) {
            piece.shape.above = slice.top.bound;
        }
        if part.below == shape.below && is_own(shape.bottom, member.bottom) {
            piece.shape.below = slice.bottom.bound;
        }
        piece
    }
}

/// The lower of two bounds, at either end.
fn lower_of(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [one[0].max(other[0]), one[1].max(other[1])]
}

/// Finds the nearest of `front` and `others` in `shape`, in parts where there is not one alone.
fn nearest(
    faces: &Faces,
    shape: Trapezoid,
    mut front: Covering,
    others: &[Covering],
    found: &mut Vec<(Covering, Trapezoid)>,
) {
    for (index, &other) in others.iter().enumerate() {
        match compare(faces, front.face, other.face, &shape) {
            Order::Front => {}
            Order::Behind => front = other,
            Order::Crossing(parts) => {
                for part in parts {
                    let front = if part.first_is_front { front } else { other };
                    nearest(faces, part.shape, front, &others[index + 1..], found);
                }
                return;
            }
        }
    }
    found.push((front, shape));
}

/// Which of two faces is in front throughout a trapezoid.
enum Order {
    /// The first one.
    Front,
    /// The second one.
    Behind,
    /// Each in some parts.
    Crossing(Vec<Part>),
}

impl Order {
    /// Calls `see` with the parts of `shape` in which the first face is in front.
    fn for_each_front(&self, shape: Trapezoid, mut see: impl FnMut(Trapezoid)) {
        match self {
            Order::Front => see(shape),
            Order::Behind => {}
            Order::Crossing(parts) => parts
                .iter()
                .filter(|part| part.first_is_front)
                .for_each(|part| see(part.shape)),
        }
    }
}

/// A part of a trapezoid that was cut along the line in which two planes cross.
#[derive(Clone, Copy)]
struct Part {
    shape: Trapezoid,
    first_is_front: bool,
}

/// Which of two faces is in front in `shape`, where both are.
fn compare(faces: &Faces, first: FaceId, second: FaceId, shape: &Trapezoid) -> Order {
    let difference = match Difference::of(faces, first, second) {
        Difference::Affine(difference) => difference,
        Difference::FirstInFront => return Order::Front,
        Difference::SecondInFront => return Order::Behind,
    };
    let at_corners = |y: [f64; 2]| {
        [
            difference.at(DVec2::new(shape.left, y[0])),
            difference.at(DVec2::new(shape.right, y[1])),
        ]
    };
    let above = at_corners(shape.top);
    let below = at_corners(shape.bottom);
    let least = above[0].min(above[1]).min(below[0]).min(below[1]);
    let greatest = above[0].max(above[1]).max(below[0]).max(below[1]);
    if least >= 0.0 {
        return Order::Front;
    }
    if greatest <= 0.0 {
        return Order::Behind;
    }
    let parts = cut(shape, above, below, Bound::Crossing(first, second));
    // Where faces touch without piercing each other, rounding may have them cross by a hair.
    let matters = |first_is_front: bool| {
        parts
            .iter()
            .any(|part| part.first_is_front == first_is_front && !part.shape.is_negligible())
    };
    match (matters(true), matters(false)) {
        (true, true) => Order::Crossing(parts),
        (true, false) => Order::Front,
        (false, true) => Order::Behind,
        (false, false) if greatest >= -least => Order::Front,
        (false, false) => Order::Behind,
    }
}

/// Cuts `shape` along the zero of an affine function with the values `above` and `below` at the ends
/// of its upper and its lower bound, of both signs.
///
/// The line crosses each bound where the values change sign, and V-scanlines there leave stretches
/// in which upper and lower bound have one sign each:
///
/// ```text
///     + ┬───────┬───────┬─────── -     left: the first face is in front;
///       │       │╲   -  │              middle: below the line the first, above it the second;
///       │   +   │  ╲    │   -          right: the second
///       │       │ +  ╲  │
///     + ┴───────┴──────╲┴─────── -
/// ```
fn cut(shape: &Trapezoid, above: [f64; 2], below: [f64; 2], line: Bound) -> Vec<Part> {
    let width = shape.right - shape.left;
    let zero = |values: [f64; 2]| {
        ((values[0] > 0.0) != (values[1] > 0.0))
            .then(|| shape.left + width * (values[0] / (values[0] - values[1])))
            .filter(|&x| x > shape.left && x < shape.right)
    };
    let zeros = [zero(above), zero(below)];
    let mut ends = [
        shape.left,
        zeros[0].unwrap_or(shape.left),
        zeros[1].unwrap_or(shape.left),
        shape.right,
    ];
    if ends[1] > ends[2] {
        ends.swap(1, 2);
    }
    // At most three stretches, with a part above the line and one below.
    let mut parts = Vec::with_capacity(6);
    for stretch in ends.windows(2) {
        let [left, right] = [stretch[0], stretch[1]];
        if left >= right {
            continue;
        }
        let whole = shape.between(left, right);
        // The sign of a bound in this stretch: that of the end on this side of its zero.
        let sign = |values: [f64; 2], zero: Option<f64>| match zero {
            Some(x) if right <= x => values[0],
            Some(_) => values[1],
            None if values[0].abs() >= values[1].abs() => values[0],
            None => values[1],
        };
        let (sign_above, sign_below) = (sign(above, zeros[0]), sign(below, zeros[1]));
        if sign_above.min(sign_below) >= 0.0 || sign_above.max(sign_below) <= 0.0 {
            parts.push(Part {
                shape: whole,
                first_is_front: sign_above.min(sign_below) >= 0.0,
            });
            continue;
        }
        // y of the line at an end of the stretch.
        let y = |x: f64, end: usize| {
            if zeros[0] == Some(x) {
                return whole.top[end];
            }
            if zeros[1] == Some(x) {
                return whole.bottom[end];
            }
            let (up, down) = (above[end].abs(), below[end].abs());
            let along = if up + down > 0.0 {
                up / (up + down)
            } else {
                0.5
            };
            between([whole.top[end], whole.bottom[end]], along)
        };
        let crossing = [y(left, 0), y(right, 1)];
        parts.push(Part {
            shape: Trapezoid {
                bottom: crossing,
                below: line,
                ..whole
            },
            first_is_front: sign_above > 0.0,
        });
        parts.push(Part {
            shape: Trapezoid {
                top: crossing,
                above: line,
                ..whole
            },
            first_is_front: sign_above <= 0.0,
        });
    }
    parts
}
