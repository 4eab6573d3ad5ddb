//! A cluster of overlapping slices between two V-scanlines, cut until one face is nearest in each
//! part.
//!
//! First in x, where bounds cross each other: between two such crossings the bounds have one order
//! from top to bottom. Between each bound and the next lies a trapezoid in which a fixed set of
//! faces is, and there the planes decide; where two planes cross inside it, it is cut along the line
//! in which they do, the paper's virtual edge (§4). A virtual edge is an edge for this trapezoid
//! only, so no face enters or leaves at it, and it needs no prolongation to the cell's border.

use super::emit::Layer;
use super::h_scan::Slice;
use super::{Bound, Piece, ROUNDING, Trapezoid, between, both_between, is_same_y};
use veduta_geometry::{Affine, DVec2};
use veduta_map::{FaceId, Faces};

/// A slice of a cluster, with its bounds' y at the two V-scanlines.
#[derive(Clone, Copy)]
pub(super) struct Member {
    pub slice: u32,
    pub top: [f64; 2],
    pub bottom: [f64; 2],
}

/// Cuts clusters. It keeps only memory between them.
#[derive(Default)]
pub(super) struct Splitter {
    members: Vec<Member>,
    /// y of the members' upper and lower bounds at the ends of the current part of the cluster.
    here: Vec<[[f64; 2]; 2]>,
    /// Upper and lower bounds of the members; sorted from top to bottom where they are used.
    bounds: Vec<MemberBound>,
    /// V-scanlines at which the rest of the cluster is cut, the leftmost last.
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
    /// y at the ends of the current part of the cluster.
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
    /// Cuts the cluster of `members` between the V-scanlines at `ends`, hands the pieces to the
    /// layers (opaque, veils), and notes which slices are `hidden` somewhere.
    pub fn split(
        &mut self,
        faces: &Faces,
        slices: &[Slice],
        members: impl Iterator<Item = Member>,
        ends: [f64; 2],
        hidden: &mut [bool],
        mut layers: [&mut Layer; 2],
    ) {
        self.members.clear();
        self.members.extend(members);
        self.bounds.clear();
        for member in 0..self.members.len() as u32 {
            for is_lower in [false, true] {
                self.bounds.push(MemberBound {
                    member,
                    is_lower,
                    y: [0.0; 2],
                });
            }
        }
        let mut left = ends[0];
        self.cuts.clear();
        self.cuts.push(ends[1]);
        while let Some(&right) = self.cuts.last() {
            self.sort_bounds(ends, left, right);
            if let Some(x) = self.first_crossing(left, right) {
                self.cuts.push(x);
                continue;
            }
            self.from_top_to_bottom(faces, slices, [left, right], hidden, &mut layers);
            for layer in &mut layers {
                layer.join();
                layer.close_between(ends, right);
            }
            left = right;
            self.cuts.pop();
        }
    }

    /// Evaluates the bounds at `left` and `right`, between the V-scanlines at `ends`, and sorts them
    /// by the middle.
    fn sort_bounds(&mut self, ends: [f64; 2], left: f64, right: f64) {
        let width = ends[1] - ends[0];
        let along = [left, right].map(|x| (x - ends[0]) / width);
        self.here.clear();
        if [left, right] == ends {
            let y = self
                .members
                .iter()
                .map(|member| [member.top, member.bottom]);
            self.here.extend(y);
        } else {
            self.here.extend(self.members.iter().map(|member| {
                [
                    both_between(member.top, along),
                    both_between(member.bottom, along),
                ]
            }));
        }
        for bound in &mut self.bounds {
            bound.y = self.here[bound.member as usize][usize::from(bound.is_lower)];
        }
        // Stable, and quick where the order has hardly changed since the last part.
        self.bounds
            .sort_by(|bound, other| bound.middle().total_cmp(&other.middle()));
    }

    /// Where two bounds that are neighbours in the middle cross on the way to an end, if any do.
    ///
    /// Looking at neighbours is enough: of bounds that are out of order at an end, some neighbours
    /// are. After a cut at the crossing the two are in order on both sides, but for rounding, so
    /// the cutting comes to an end.
    fn first_crossing(&self, left: f64, right: f64) -> Option<f64> {
        let half = 0.5 * (right - left);
        let middle = left + half;
        self.bounds.windows(2).find_map(|pair| {
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

    /// Goes through the trapezoids between each bound and the next.
    fn from_top_to_bottom(
        &mut self,
        faces: &Faces,
        slices: &[Slice],
        [left, right]: [f64; 2],
        hidden: &mut [bool],
        layers: &mut [&mut Layer; 2],
    ) {
        self.cover.clear();
        let mut top = self.bounds[0].y;
        for index in 0..self.bounds.len() {
            let MemberBound { member, y, .. } = self.bounds[index];
            // Never above the bound before, so that rounding makes neither gap nor overlap.
            let bottom = [y[0].max(top[0]), y[1].max(top[1])];
            let is_flat = bottom[0] - top[0] <= ROUNDING && bottom[1] - top[1] <= ROUNDING;
            if !self.cover.is_empty() && !is_flat {
                let shape = Trapezoid {
                    left,
                    right,
                    top,
                    bottom,
                    above: self.name(slices, index - 1),
                    below: self.name(slices, index),
                };
                self.see(faces, slices, shape, hidden, layers);
            }
            // The member's first bound lets it in and the second lets it out. Which of them is the
            // lower one does not matter: a slice thinner than rounding may be upside down.
            let is_member = |covering: &Covering| covering.member == member;
            match self.cover.iter().position(is_member) {
                Some(place) => {
                    self.cover.swap_remove(place);
                }
                None => {
                    let slice = self.members[member as usize].slice;
                    let face = slices[slice as usize].face;
                    self.cover.push(Covering { face, member });
                }
            }
            top = bottom;
        }
    }

    /// What makes bound `index`.
    fn name(&self, slices: &[Slice], index: usize) -> Bound {
        let MemberBound {
            member, is_lower, ..
        } = self.bounds[index];
        let slice = &slices[self.members[member as usize].slice as usize];
        if is_lower {
            slice.bottom.bound
        } else {
            slice.top.bound
        }
    }

    /// Finds what is seen in the trapezoid `shape`, which every face of the cover covers.
    fn see(
        &mut self,
        faces: &Faces,
        slices: &[Slice],
        shape: Trapezoid,
        hidden: &mut [bool],
        [opaque, veils]: &mut [&mut Layer; 2],
    ) {
        self.sort_cover(faces, &shape);
        self.nearest.clear();
        if let Some((&first, rest)) = self.opaque.split_first() {
            nearest(faces, shape, first, rest, &mut self.nearest);
        }
        for &(covering, part) in &self.nearest {
            opaque.stack(self.piece(slices, covering, &shape, part));
        }
        // What rounding may have hidden does not keep a face from being seen whole.
        let matters = !shape.is_negligible();
        let mut hide = |covering: &Covering| {
            hidden[self.members[covering.member as usize].slice as usize] |= matters;
        };
        for covering in &self.opaque {
            let is_seen = |(seen, _): &(Covering, _)| seen.face == covering.face;
            if !self.nearest.iter().all(is_seen) {
                hide(covering);
            }
        }
        for veil in &self.veils {
            if self.nearest.is_empty() {
                veils.stack(self.piece(slices, *veil, &shape, shape));
            }
            for &(front, part) in &self.nearest {
                match compare(faces, veil.face, front.face, &part) {
                    Order::Front => veils.stack(self.piece(slices, *veil, &shape, part)),
                    Order::Behind => hide(veil),
                    Order::Crossing(parts) => {
                        hide(veil);
                        for seen in parts.iter().filter(|part| part.first_is_front) {
                            veils.stack(self.piece(slices, *veil, &shape, seen.shape));
                        }
                    }
                }
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
            if is_in_front(faces, covering.face, self.opaque[0].face, middle) {
                self.opaque.swap(0, last);
            }
        }
    }

    /// What is seen of a face in `part` of the trapezoid `shape`. A face prefers its own name for a
    /// bound that it shares with others.
    fn piece(
        &self,
        slices: &[Slice],
        covering: Covering,
        shape: &Trapezoid,
        part: Trapezoid,
    ) -> Piece {
        let slice = &slices[self.members[covering.member as usize].slice as usize];
        let [top, bottom] = self.here[covering.member as usize];
        let mut piece = Piece {
            face: covering.face,
            shape: part,
        };
        if part.above == shape.above && is_same_y(shape.top, top) {
            piece.shape.above = slice.top.bound;
        }
        if part.below == shape.below && is_same_y(shape.bottom, bottom) {
            piece.shape.below = slice.bottom.bound;
        }
        piece
    }
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
                for part in parts.iter() {
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
    Crossing(Parts),
}

/// A trapezoid cut along the line in which two planes cross.
#[derive(Clone, Copy)]
struct Part {
    shape: Trapezoid,
    first_is_front: bool,
}

/// At most three stretches of x, since the line crosses each bound at most once, and in each a part
/// above the line and one below.
struct Parts {
    parts: [Option<Part>; 6],
}

impl Parts {
    fn iter(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter().flatten()
    }
}

/// The difference of two faces' nearness, or which is in front everywhere.
enum Difference {
    Everywhere(Order),
    Affine(Affine),
}

fn difference(faces: &Faces, first: FaceId, second: FaceId) -> Difference {
    let by_id = || {
        Difference::Everywhere(if first < second {
            Order::Front
        } else {
            Order::Behind
        })
    };
    let (plane, other) = (faces.plane(first), faces.plane(second));
    if plane == other {
        return by_id();
    }
    let difference = faces.nearness(plane).minus(faces.nearness(other));
    if difference == Affine::default() {
        return by_id();
    }
    Difference::Affine(difference)
}

fn is_in_front(faces: &Faces, first: FaceId, second: FaceId, point: DVec2) -> bool {
    match difference(faces, first, second) {
        Difference::Everywhere(order) => matches!(order, Order::Front),
        Difference::Affine(difference) => difference.at(point) > 0.0,
    }
}

/// Which of two faces is in front in `shape`, where both are.
fn compare(faces: &Faces, first: FaceId, second: FaceId, shape: &Trapezoid) -> Order {
    let difference = match difference(faces, first, second) {
        Difference::Everywhere(order) => return order,
        Difference::Affine(difference) => difference,
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
///     + ┬────+──┬──-───┬ -         in the middle the first face is in front above the line,
///       │       │ ╲    │           left of it everywhere, right of it nowhere
///     + ┴────+──┴───+╲─┴ -
/// ```
fn cut(shape: &Trapezoid, above: [f64; 2], below: [f64; 2], line: Bound) -> Parts {
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
    let mut parts = [None; 6];
    for (stretch, free) in ends.windows(2).zip(parts.chunks_exact_mut(2)) {
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
            free[0] = Some(Part {
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
        free[0] = Some(Part {
            shape: Trapezoid {
                bottom: crossing,
                below: line,
                ..whole
            },
            first_is_front: sign_above > 0.0,
        });
        free[1] = Some(Part {
            shape: Trapezoid {
                top: crossing,
                above: line,
                ..whole
            },
            first_is_front: sign_above <= 0.0,
        });
    }
    Parts { parts }
}
