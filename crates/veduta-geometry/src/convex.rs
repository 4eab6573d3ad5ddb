use crate::DVec2;

/// The z component of `u × v`: twice the signed area of the triangle `0, u, v`.
#[inline(always)]
pub fn cross(u: DVec2, v: DVec2) -> f64 {
    u.x * v.y - u.y * v.x
}

/// Signed area of a polygon, positive when it is positively wound.
///
/// Taken relative to the first vertex, so that a small polygon far from the origin loses nothing.
pub fn signed_area(polygon: &[DVec2]) -> f64 {
    let Some((&first, rest)) = polygon.split_first() else {
        return 0.0;
    };
    0.5 * rest
        .windows(2)
        .map(|edge| cross(edge[0] - first, edge[1] - first))
        .sum::<f64>()
}
