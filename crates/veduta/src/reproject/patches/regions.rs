//! Which view shows what where frames overlap: the first, and the others what is left.

use super::View;
use veduta_geometry::DVec3;

/// What of a view's frame is shown: directions in which none of these linear functions is negative. Without any, the
/// whole frame is.
pub type Region = Vec<DVec3>;

/// Frames that share less than this, as seen from a distance of 1, touch. Larger would show a strip twice; smaller
/// would cut views along borders that rounding has moved.
const TOUCHING: f64 = 1e-9;

/// For each view the parts of its frame that no view before it shows, so that all of them together show each direction
/// once. A frame that others cover wholly has none.
pub fn regions(views: &[View]) -> Vec<Vec<Region>> {
    let of_view = views.iter().enumerate().map(|(index, view)| {
        let mut left = vec![Region::new()];
        for before in &views[..index] {
            left = left
                .into_iter()
                .flat_map(|region| without(view, region, before))
                .collect();
        }
        left
    });
    of_view.collect()
}

/// What is left of a region of a view's frame outside of another frame: up to four regions, one beyond each side.
fn without(view: &View, region: Region, other: &View) -> Vec<Region> {
    let sides = other.sides();
    if !has_extent(view, region.iter().chain(&sides)) {
        return vec![region];
    }
    let mut left = Vec::new();
    let mut inside = region;
    for side in sides {
        let mut beyond = inside.clone();
        beyond.push(-side);
        if has_extent(view, &beyond) {
            left.push(beyond);
        }
        inside.push(side);
    }
    left
}

/// Whether what of a view's frame these functions leave is more than a line.
fn has_extent<'a>(view: &View, region: impl IntoIterator<Item = &'a DVec3>) -> bool {
    let mut polygon = view.corners().map(DVec3::normalize).to_vec();
    for side in region {
        // As a distance from the plane, whatever the frame's scale.
        let side = side.normalize();
        let from_plane = |d: DVec3| side.dot(d);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (k, &p) in polygon.iter().enumerate() {
            let q = polygon[(k + 1) % polygon.len()];
            let (dp, dq) = (from_plane(p), from_plane(q));
            if dp >= TOUCHING {
                kept.push(p);
            }
            if (dp >= TOUCHING) != (dq >= TOUCHING) && dp != dq {
                kept.push(p + (q - p) * (dp / (dp - dq)).clamp(0.0, 1.0));
            }
        }
        polygon = kept;
    }
    polygon.len() > 2
}
