//! A polygon's rings -> rings without holes, each around one connected region, which may touch
//! themselves but do not cross themselves.

use super::{Effort, Polygon, Shape};
use std::cmp::Ordering;
use veduta_geometry::{DVec2, cross};

/// Takes out corners that repeat the one before, and spikes: corners between two equal ones.
pub fn clean(ring: &mut Vec<usize>, same: impl Fn(usize, usize) -> bool) {
    let mut kept = 0;
    for k in 0..ring.len() {
        let corner = ring[k];
        if kept >= 1 && same(ring[kept - 1], corner) {
            continue;
        }
        if kept >= 2 && same(ring[kept - 2], corner) {
            kept -= 1;
            continue;
        }
        ring[kept] = corner;
        kept += 1;
    }
    ring.truncate(kept);
    // The same across the seam.
    let mut first = 0;
    while ring.len() - first >= 2 {
        let (start, end) = (ring[first], ring[ring.len() - 1]);
        if same(start, end) {
            ring.pop();
        } else if same(start, ring[ring.len() - 2]) {
            ring.pop();
            ring.pop();
        } else if same(ring[first + 1], end) {
            first += 1;
        } else {
            break;
        }
    }
    ring.drain(..first);
}

/// The outline, counterclockwise, and the holes, clockwise. Points at one place are called by the
/// first of them, so that rings that touch share corners.
pub fn sorted_out(polygon: &Polygon<'_>, shape: Shape<'_>, outline: &[usize]) -> Vec<Vec<usize>> {
    let points = polygon.points;
    let mut order: Vec<usize> = (0..points.len()).collect();
    let key = |index: usize| points[index].to_array();
    order.sort_by(|&a, &b| {
        let (p, q) = (key(a), key(b));
        p.partial_cmp(&q).unwrap_or(Ordering::Equal).then(a.cmp(&b))
    });
    let mut first_at: Vec<usize> = (0..points.len()).collect();
    for pair in order.windows(2) {
        if points[pair[0]] == points[pair[1]] {
            first_at[pair[1]] = first_at[pair[0]];
        }
    }
    let mut rings = vec![outline.iter().map(|&corner| first_at[corner]).collect()];
    let starts = &polygon.ring_ends[..polygon.ring_ends.len().saturating_sub(1)];
    for (&start, &end) in starts.iter().zip(&polygon.ring_ends[1..]) {
        let mut hole: Vec<usize> = first_at[start..end].to_vec();
        clean(&mut hole, |a, b| a == b);
        let area = signed_area(shape, &hole);
        if area == 0.0 {
            continue;
        }
        if area > 0.0 {
            hole.reverse();
        }
        rings.push(hole);
    }
    rings
}

fn signed_area(shape: Shape<'_>, ring: &[usize]) -> f64 {
    let corners: Vec<DVec2> = ring.iter().map(|&corner| shape.flat[corner]).collect();
    veduta_geometry::signed_area(&corners)
}

/// The regions between the rings, each as one ring, counterclockwise. False where rings overlap or a
/// hole could not be joined to its outline and is left out.
///
/// Where a corner lies within `reach` of a side, it is made a corner of that side too. Then the
/// sides are threaded anew, so that what touches is together or apart as the region between is;
/// holes that touch nothing are joined by bridges.
pub fn regions(
    shape: Shape<'_>,
    rings: &[Vec<usize>],
    reach: f64,
    effort: &mut Effort,
) -> (Vec<Vec<usize>>, bool) {
    let split = split_where_touched(shape, rings, reach, effort);
    let (loops, mut sound) = thread(shape, &split, effort);
    let (mut outlines, mut holes): (Vec<_>, Vec<_>) = loops
        .into_iter()
        .partition(|ring| signed_area(shape, ring) > 0.0);
    // A hole's leftmost corner sees the outline, or a hole farther left, to its left (Eberly,
    // "Triangulation by ear clipping", 2002): in this order every hole can be joined.
    holes.sort_by(|a, b| {
        let (a, b) = (leftmost(shape, a), leftmost(shape, b));
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
    });
    let mut others = vec![Vec::new(); outlines.len()];
    for hole in holes {
        let inside = |outline: &Vec<usize>| {
            effort.spend(outline.len()) && surrounds(shape, outline, leftmost(shape, &hole))
        };
        match outlines.iter().position(inside) {
            Some(outline) => others[outline].push(hole),
            None => sound = false,
        }
    }
    for (ring, holes) in outlines.iter_mut().zip(&others) {
        for index in 0..holes.len() {
            match find_bridge(shape, ring, &holes[index..], effort) {
                Some(bridge) => cross_bridge(ring, &holes[index], bridge),
                None => sound = false,
            }
        }
    }
    (outlines, sound)
}

fn leftmost(shape: Shape<'_>, ring: &[usize]) -> DVec2 {
    let corners = ring.iter().map(|&corner| shape.flat[corner]);
    corners.fold(DVec2::INFINITY, |least, p| {
        if (p.x, p.y) < (least.x, least.y) {
            p
        } else {
            least
        }
    })
}

/// Whether a ring goes round a point that is not on it.
fn surrounds(shape: Shape<'_>, ring: &[usize], point: DVec2) -> bool {
    let after = ring.iter().skip(1).chain(ring.first());
    let crossed = ring.iter().zip(after).filter(|&(&a, &b)| {
        let (p, q) = (shape.flat[a] - point, shape.flat[b] - point);
        // The ray to the left.
        (p.y > 0.0) != (q.y > 0.0) && (cross(p, q) > 0.0) == (p.y > q.y)
    });
    crossed.count() % 2 == 1
}

/// Takes out sides that are there in both directions (bridges, spikes, a hole along the outline),
/// and threads the others to rings: at a corner where several sides arrive and leave, each goes on
/// with the first on its inner side. False where a side is there twice.
fn thread(shape: Shape<'_>, rings: &[Vec<usize>], effort: &mut Effort) -> (Vec<Vec<usize>>, bool) {
    let mut sides: Vec<(usize, usize)> = Vec::new();
    for ring in rings {
        let after = ring.iter().skip(1).chain(ring.first());
        sides.extend(ring.iter().copied().zip(after.copied()));
    }
    sides.sort_unstable();
    let whole = sides.len();
    sides.dedup();
    let sound = sides.len() == whole;
    let both_ways = sides.clone();
    sides.retain(|&(a, b)| both_ways.binary_search(&(b, a)).is_err());

    let mut used = vec![false; sides.len()];
    let mut loops = Vec::new();
    for first in 0..sides.len() {
        let mut ring = Vec::new();
        let mut side = first;
        while !used[side] {
            used[side] = true;
            let (before, corner) = sides[side];
            ring.push(corner);
            let start = sides.partition_point(|&(from, _)| from < corner);
            let end = sides.partition_point(|&(from, _)| from <= corner);
            if !effort.spend(end - start) {
                return (loops, false);
            }
            let free = (start..end).filter(|&other| other == first || !used[other]);
            let inner = free
                .min_by(|&a, &b| clockwise_order(shape, corner, before, sides[a].1, sides[b].1));
            let Some(next) = inner else {
                break;
            };
            side = next;
        }
        if ring.len() >= 3 {
            loops.push(ring);
        }
    }
    (loops, sound)
}

/// Which of `a` and `b` is met first when the direction from `center` to `start` turns clockwise.
fn clockwise_order(shape: Shape<'_>, center: usize, start: usize, a: usize, b: usize) -> Ordering {
    // Less than half a turn, half a turn, more; a whole turn at last.
    let sector = |target: usize| {
        let turn = shape.turn(center, start, target);
        let [from, to] = [start, target].map(|end| shape.flat[end] - shape.flat[center]);
        if turn < 0.0 {
            0
        } else if turn > 0.0 {
            2
        } else if from.dot(to) < 0.0 {
            1
        } else {
            3
        }
    };
    let turn = shape.turn(center, a, b);
    sector(a).cmp(&sector(b)).then(if turn < 0.0 {
        Ordering::Less
    } else if turn > 0.0 {
        Ordering::Greater
    } else {
        Ordering::Equal
    })
}

/// Puts corners into the sides that they lie on.
fn split_where_touched(
    shape: Shape<'_>,
    rings: &[Vec<usize>],
    reach: f64,
    effort: &mut Effort,
) -> Vec<Vec<usize>> {
    let mut corners: Vec<usize> = rings.iter().flatten().copied().collect();
    corners.sort_by(|&a, &b| {
        let (p, q) = (shape.flat[a].x, shape.flat[b].x);
        p.total_cmp(&q).then(a.cmp(&b))
    });
    corners.dedup();
    let mut touching = Vec::new();
    let mut split = Vec::with_capacity(rings.len());
    for ring in rings {
        let mut whole = Vec::with_capacity(ring.len());
        for (k, &a) in ring.iter().enumerate() {
            let b = ring[(k + 1) % ring.len()];
            let (p, q) = (shape.flat[a], shape.flat[b]);
            let side = q - p;
            let length = side.length();
            let (low, high) = (p.min(q) - reach, p.max(q) + reach);
            let from = corners.partition_point(|&c| shape.flat[c].x < low.x);
            let near = corners[from..]
                .iter()
                .take_while(|&&c| shape.flat[c].x <= high.x);
            touching.clear();
            let mut steps = 0;
            for &corner in near {
                steps += 1;
                let point = shape.flat[corner];
                if corner == a || corner == b || point.y < low.y || point.y > high.y {
                    continue;
                }
                let along = side.dot(point - p) / length;
                let off = cross(side, point - p).abs() / length;
                if off <= reach && along > reach && along < length - reach {
                    touching.push((along, corner));
                }
            }
            whole.push(a);
            if effort.spend(steps) {
                touching.sort_by(|s, t| s.0.total_cmp(&t.0));
                whole.extend(touching.iter().map(|&(_, corner)| corner));
            }
        }
        clean(&mut whole, |a, b| a == b);
        split.push(whole);
    }
    split
}

/// Places in the ring and in the hole that a bridge joins.
type Bridge = (usize, usize);

/// A short way from the ring to the first of `holes` that crosses nothing.
fn find_bridge(
    shape: Shape<'_>,
    ring: &[usize],
    holes: &[Vec<usize>],
    effort: &mut Effort,
) -> Option<Bridge> {
    let hole = &holes[0];
    let mut from_leftmost: Vec<usize> = (0..hole.len()).collect();
    from_leftmost.sort_by(|&a, &b| shape.flat[hole[a]].x.total_cmp(&shape.flat[hole[b]].x));
    let mut ways: Vec<(f64, usize)> = Vec::new();
    // The leftmost corner will do, unless rounding has put it a little outside.
    for at_hole in from_leftmost {
        let point = shape.flat[hole[at_hole]];
        ways.clear();
        let distance = |&corner: &usize| (shape.flat[corner] - point).length_squared();
        ways.extend(ring.iter().map(distance).zip(0..));
        ways.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(distance, at_ring) in &ways {
            if !effort.spend(ring.len()) {
                return None;
            }
            if distance > 0.0
                && opens_to(shape, ring, at_ring, hole[at_hole])
                && opens_to(shape, hole, at_hole, ring[at_ring])
                && is_clear(shape, ring, holes, ring[at_ring], hole[at_hole], effort)
            {
                return Some((at_ring, at_hole));
            }
        }
    }
    None
}

/// Whether the way from a corner of a ring to `target` begins on the ring's left side.
fn opens_to(shape: Shape<'_>, ring: &[usize], at: usize, target: usize) -> bool {
    let n = ring.len();
    let (before, corner, after) = (ring[(at + n - 1) % n], ring[at], ring[(at + 1) % n]);
    let left_of_before = shape.turn(before, corner, target) > 0.0;
    let left_of_after = shape.turn(corner, after, target) > 0.0;
    if before == after {
        // The tip of a bridge: all is free but the way back.
        return left_of_before || shape.turn(before, corner, target) < 0.0;
    }
    if shape.turn(before, corner, after) > 0.0 {
        left_of_before && left_of_after
    } else {
        left_of_before || left_of_after
    }
}

/// Whether nothing lies on the way from `start` to `end`, which are corners.
fn is_clear(
    shape: Shape<'_>,
    ring: &[usize],
    holes: &[Vec<usize>],
    start: usize,
    end: usize,
    effort: &mut Effort,
) -> bool {
    let (p, q) = (shape.flat[start], shape.flat[end]);
    let (low, high) = (p.min(q), p.max(q));
    let is_crossed_by = |a: usize, b: usize| {
        let (r, s) = (shape.flat[a], shape.flat[b]);
        if r.min(s).cmpgt(high).any() || r.max(s).cmplt(low).any() {
            return false;
        }
        let own = |point: DVec2| point == p || point == q;
        if own(r) || own(s) {
            // A side that begins here can lie on the way only with its other end.
            let on_way = |corner: usize, point: DVec2| {
                !own(point)
                    && shape.turn(start, end, corner) == 0.0
                    && (point - p).dot(q - p) > 0.0
                    && (point - q).dot(p - q) > 0.0
            };
            return on_way(a, r) || on_way(b, s);
        }
        // On both sides, or on the line itself.
        let apart = |s: f64, t: f64| !(s > 0.0 && t > 0.0 || s < 0.0 && t < 0.0);
        apart(shape.turn(start, end, a), shape.turn(start, end, b))
            && apart(shape.turn(a, b, start), shape.turn(a, b, end))
    };
    let mut rings = std::iter::once(ring).chain(holes.iter().map(Vec::as_slice));
    rings.all(|ring| {
        let after = ring.iter().skip(1).chain(ring.first());
        let crossed = ring.iter().zip(after).any(|(&a, &b)| is_crossed_by(a, b));
        effort.spend(ring.len()) && !crossed
    })
}

/// Puts a hole into the ring: along the bridge, round the hole, and back.
fn cross_bridge(ring: &mut Vec<usize>, hole: &[usize], (at_ring, at_hole): Bridge) {
    let around = hole[at_hole..].iter().chain(&hole[..at_hole]).copied();
    let detour: Vec<usize> = around.chain([hole[at_hole], ring[at_ring]]).collect();
    ring.splice(at_ring + 1..at_ring + 1, detour);
}
