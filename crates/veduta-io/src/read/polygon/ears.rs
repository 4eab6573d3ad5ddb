//! A ring -> triangles, by clipping ears.
//!
//! The ring loses one ear after another: a convex corner whose triangle no other corner enters
//! (Meisters, "Polygons have ears", 1975). Bridges to holes, and corners at which a polygon touches
//! itself, are in the ring more than once.

use super::{Effort, Shape};

/// Cuts a ring, counterclockwise, into triangles that have area, and adds them to `triangles`.
///
/// False where the ring crosses itself, or effort has run out. Why that can be
/// told from the triangles alone: added up as signed areas they are, point by point, the winding
/// number of the ring. Where that is 0 or 1 everywhere and none is turned over, they cover the
/// inside once.
pub fn clip(
    shape: Shape<'_>,
    ring: &[usize],
    triangles: &mut Vec<[usize; 3]>,
    effort: &mut Effort,
) -> bool {
    let n = ring.len();
    if n < 3 {
        return true;
    }
    let mut nodes = Nodes {
        shape,
        ring,
        next: (1..n).chain([0]).collect(),
        previous: [n - 1].into_iter().chain(0..n - 1).collect(),
        may_enter: Vec::new(),
    };
    nodes.may_enter = (0..n).map(|node| nodes.turn_at(node) <= 0.0).collect();
    let mut simple = true;
    let mut node = 0;
    for left in (3..=n).rev() {
        let chosen = nodes.next_ear(node, left, effort);
        let (before, after) = (nodes.previous[chosen], nodes.next[chosen]);
        let turn = nodes.turn_at(chosen);
        if turn != 0.0 {
            triangles.push([before, chosen, after].map(|node| ring[node]));
        }
        simple &= turn >= 0.0 && effort.left > 0;
        nodes.remove(chosen);
        // The corner after the next one: cutting ears in turn makes fewer slivers.
        node = nodes.next[after];
    }
    simple
}

/// The corners that are left, as a linked list.
struct Nodes<'a> {
    shape: Shape<'a>,
    ring: &'a [usize],
    next: Vec<usize>,
    previous: Vec<usize>,
    /// Whether the ring does not turn left there: if any corner lies in an ear, such a one does.
    may_enter: Vec<bool>,
}

impl Nodes<'_> {
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let [a, b, c] = [a, b, c].map(|node| self.ring[node]);
        self.shape.turn(a, b, c)
    }

    fn turn_at(&self, node: usize) -> f64 {
        self.turn(self.previous[node], node, self.next[node])
    }

    /// The first ear from `start` on. Where there is none, a corner that can go without harm: one
    /// that turns nowhere, or else one that at least turns left.
    fn next_ear(&self, start: usize, left: usize, effort: &mut Effort) -> usize {
        let mut node = start;
        for _ in 0..left {
            if effort.left == 0 || self.is_ear(node, effort) {
                return node;
            }
            node = self.next[node];
        }
        let around =
            || std::iter::successors(Some(start), |&node| Some(self.next[node])).take(left);
        let flat = around().find(|&node| self.turn_at(node) == 0.0);
        let convex = || around().find(|&node| self.turn_at(node) > 0.0);
        flat.or_else(convex).unwrap_or(start)
    }

    /// Whether the triangle at `corner` can be cut off.
    fn is_ear(&self, corner: usize, effort: &mut Effort) -> bool {
        let (before, after) = (self.previous[corner], self.next[corner]);
        if self.turn(before, corner, after) <= 0.0 {
            return false;
        }
        let triangle = [before, corner, after];
        let [a, b, c] = triangle.map(|node| self.shape.flat[self.ring[node]]);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let mut other = self.next[after];
        let mut steps = 1;
        let mut is_free = true;
        while other != before && is_free {
            let point = self.shape.flat[self.ring[other]];
            let may_enter =
                self.may_enter[other] && point.cmpge(low).all() && point.cmple(high).all();
            is_free = !(may_enter && self.enters(other, triangle));
            other = self.next[other];
            steps += 1;
        }
        effort.spend(steps) && is_free
    }

    /// Whether the ring is within a triangle, its border included, at `node`.
    fn enters(&self, node: usize, triangle: [usize; 3]) -> bool {
        let [before, corner, after] = triangle;
        let point = self.ring[node];
        for (tip, right, left) in [
            (before, corner, after),
            (corner, after, before),
            (after, before, corner),
        ] {
            if self.shape.flat[self.ring[tip]] == self.shape.flat[point] {
                // The ring touches itself there. It enters only if it goes on into the triangle.
                let goes_in = |next: usize| {
                    self.turn(tip, right, next) > 0.0 && self.turn(left, tip, next) > 0.0
                };
                return goes_in(self.next[node]) || goes_in(self.previous[node]);
            }
        }
        self.turn(before, corner, node) >= 0.0
            && self.turn(corner, after, node) >= 0.0
            && self.turn(after, before, node) >= 0.0
    }

    fn remove(&mut self, node: usize) {
        let (before, after) = (self.previous[node], self.next[node]);
        self.next[before] = after;
        self.previous[after] = before;
        for node in [before, after] {
            self.may_enter[node] = self.turn_at(node) <= 0.0;
        }
    }
}
