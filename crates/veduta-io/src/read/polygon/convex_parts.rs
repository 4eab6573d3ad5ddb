//! Triangles of a polygon -> convex parts.
//!
//! Diagonals are taken out one after another where the parts on both sides stay convex together
//! (Hertel & Mehlhorn, "Fast triangulation of the plane with respect to simple polygons", 1985).
//! That gives at most four times as many parts as the fewest possible.

use super::Shape;
use std::collections::HashMap;

/// Joins triangles, counterclockwise, that share sides.
pub fn join(shape: Shape<'_>, triangles: &[[usize; 3]]) -> Vec<Vec<usize>> {
    let mut parts: Vec<Vec<usize>> = triangles.iter().map(|t| t.to_vec()).collect();
    // For each part: itself, or one that it was joined to.
    let mut joined_to: Vec<usize> = (0..parts.len()).collect();
    let sides = |triangle: &[usize; 3]| {
        let [a, b, c] = *triangle;
        [(a, b), (b, c), (c, a)]
    };
    let mut part_of_side: HashMap<(usize, usize), usize> = HashMap::new();
    for (part, triangle) in triangles.iter().enumerate() {
        for side in sides(triangle) {
            part_of_side.insert(side, part);
        }
    }
    for triangle in triangles {
        for (a, b) in sides(triangle) {
            // Each diagonal once.
            if a > b {
                continue;
            }
            let (Some(&left), Some(&right)) =
                (part_of_side.get(&(a, b)), part_of_side.get(&(b, a)))
            else {
                continue;
            };
            let (left, right) = (find(&mut joined_to, left), find(&mut joined_to, right));
            if left == right {
                continue;
            }
            if let Some(both) = together(shape, &parts[left], &parts[right], a, b) {
                parts[left] = both;
                parts[right] = Vec::new();
                joined_to[right] = left;
            }
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// The part that a part has become.
fn find(joined_to: &mut [usize], mut part: usize) -> usize {
    while joined_to[part] != part {
        joined_to[part] = joined_to[joined_to[part]];
        part = joined_to[part];
    }
    part
}

/// `left`, of which a -> b is a side, and `right`, of which b -> a is one, without that side; `None`
/// if the result were not convex.
fn together(
    shape: Shape<'_>,
    left: &[usize],
    right: &[usize],
    a: usize,
    b: usize,
) -> Option<Vec<usize>> {
    // From b all the way round to a, and from a round to b.
    let around = |part: &[usize], from: usize, to: usize| {
        let start = (0..part.len())
            .find(|&k| part[k] == from && part[(k + part.len() - 1) % part.len()] == to)?;
        let mut turned = part.to_vec();
        turned.rotate_left(start);
        Some(turned)
    };
    let mut whole = around(left, b, a)?;
    let other = around(right, a, b)?;
    let (at_a, at_b) = (whole.len() - 1, 0);
    let convex_at_a = shape.is_convex_corner(whole[at_a - 1], a, other[1]);
    let convex_at_b = shape.is_convex_corner(other[other.len() - 2], b, whole[at_b + 1]);
    if !(convex_at_a && convex_at_b) {
        return None;
    }
    whole.extend_from_slice(&other[1..other.len() - 1]);
    Some(whole)
}
