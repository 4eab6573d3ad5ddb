//! Strips of the frame, each to be seen on its own.
//!
//! Where a picture has more faces than pixels, hardly a fragment is worth keeping: strip after strip
//! is found, made to pixels and forgotten, so that memory is bounded by the faces of a strip. Coverage
//! is that of the whole frame: the faces are cut along the strips' borders, neither moved nor
//! simplified.

use crate::buckets::Buckets;
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;
use veduta_geometry::DVec2;
use veduta_map::{FaceId, Faces, PlaneId};

/// Faces of the frame, sorted into horizontal strips of it.
pub struct Strips<'a> {
    faces: &'a Faces,
    /// Top and bottom of each strip in the image plane.
    extents: Vec<[f64; 2]>,
    touching: Buckets,
}

/// What of the faces lies in a strip.
pub struct Strip {
    /// The faces cut along the strip's borders, in their order.
    pub faces: Faces,
    /// Of each the face that it is a part of.
    pub parts_of: Vec<FaceId>,
}

impl<'a> Strips<'a> {
    /// Sorts `faces` into strips with these tops and bottoms, which may overlap.
    ///
    /// # Panics
    /// If a strip is empty, or its top or bottom lies above that of the strip before.
    pub fn new(faces: &'a Faces, extents: Vec<[f64; 2]>) -> Self {
        assert!(
            extents.iter().all(|[top, bottom]| top < bottom)
                && extents.is_sorted_by(|a, b| a[0] <= b[0] && a[1] <= b[1]),
            "strips have a height, and come from above downwards"
        );
        let touched: Vec<Range<u32>> = (0..faces.len() as u32)
            .into_par_iter()
            .with_min_len(4096)
            .map(|index| {
                let heights = faces.outline(FaceId(index)).iter().map(|p| p.y);
                let (top, bottom) = heights
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(t, b), y| {
                        (t.min(y), b.max(y))
                    });
                let first = extents.partition_point(|strip| strip[1] <= top);
                let end = extents.partition_point(|strip| strip[0] < bottom);
                first as u32..end as u32
            })
            .collect();
        let touching = Buckets::new(extents.len(), &touched);
        Self {
            faces,
            extents,
            touching,
        }
    }

    /// Number of strips.
    pub fn len(&self) -> usize {
        self.touching.len()
    }

    /// Whether there is no strip. There is always one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Top and bottom of a strip in the image plane.
    pub fn extent(&self, strip: usize) -> [f64; 2] {
        self.extents[strip]
    }

    /// Cuts the faces of a strip.
    pub fn cut(&self, strip: usize) -> Strip {
        let [top, bottom] = self.extent(strip);
        let touching = self.touching.of(strip);
        let mut cut = Faces::with_capacity(touching.len());
        let mut parts_of = Vec::with_capacity(touching.len());
        let mut planes: HashMap<PlaneId, PlaneId> = HashMap::with_capacity(touching.len());
        let (mut outline, mut buffer) = (Vec::new(), Vec::new());
        for &index in touching {
            let face = FaceId(index);
            outline.clear();
            outline.extend_from_slice(self.faces.outline(face));
            keep_side(&mut outline, &mut buffer, top, 1.0);
            keep_side(&mut outline, &mut buffer, bottom, -1.0);
            if veduta_geometry::signed_area(&outline) <= 0.0 {
                continue;
            }
            let plane = self.faces.plane(face);
            let plane = *planes
                .entry(plane)
                .or_insert_with(|| cut.push_plane(*self.faces.nearness(plane)));
            let (object, source) = (self.faces.object(face), self.faces.source(face));
            if let Some(added) = cut.push(&outline, plane, object, source) {
                parts_of.push(face);
                if self.faces.is_veil(face) {
                    cut.set_veil(added);
                }
            }
        }
        Strip {
            faces: cut,
            parts_of,
        }
    }
}

/// Keeps of a polygon what lies at `sign * (y - border) >= 0` (Sutherland and Hodgman).
fn keep_side(polygon: &mut Vec<DVec2>, kept: &mut Vec<DVec2>, border: f64, sign: f64) {
    if polygon.iter().all(|p| sign * (p.y - border) >= 0.0) {
        return;
    }
    kept.clear();
    let Some(&last) = polygon.last() else {
        return;
    };
    let mut p = last;
    for &q in &*polygon {
        let (a, b) = (sign * (p.y - border), sign * (q.y - border));
        if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
            // From the smaller end, so that both neighbours of an edge find the same point.
            let (u, v) = if (p.x, p.y) <= (q.x, q.y) {
                (p, q)
            } else {
                (q, p)
            };
            let x = u.x + (v.x - u.x) * ((border - u.y) / (v.y - u.y));
            kept.push(DVec2::new(x, border));
        }
        if b >= 0.0 {
            kept.push(q);
        }
        p = q;
    }
    std::mem::swap(polygon, kept);
}
