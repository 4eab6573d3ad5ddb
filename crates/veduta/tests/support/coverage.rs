//! Exact areas per pixel and face, by clipping polygons to pixels (Sutherland & Hodgman, 1974).
//!
//! Slow and plain on purpose: it shares no code with the pipeline's way from fragments to pixels.

use std::cmp::Ordering;
use std::fmt;
use veduta::geometry::DVec2;
use veduta::map::{Faces, Fragment, Fragments};

/// The area of one face in one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// `row * width + column`.
    pub pixel: u32,
    pub face: u32,
    /// In square pixels.
    pub area: f64,
    /// Length of all outlines of the face's fragments in the pixel, in pixels.
    pub perimeter: f64,
    /// How many fragments of the face have area in the pixel.
    pub fragments: u32,
}

/// Parts sorted by pixel and face, each pair at most once.
pub type Coverage = Vec<Part>;

/// Measures what `fragments` cover of a grid of `width` by `height` pixels.
pub fn measure(faces: &Faces, fragments: &Fragments, width: u32, height: u32) -> Coverage {
    let mut parts = Vec::new();
    let (mut row_part, mut pixel_part, mut spare) = (Vec::new(), Vec::new(), Vec::new());
    for fragment in fragments.iter() {
        let face = fragment.face();
        let polygon: Vec<DVec2> = match fragment {
            Fragment::Whole(face) => faces.outline(face),
            Fragment::Cut { vertices, .. } => vertices,
        }
        .iter()
        .map(|vertex| DVec2::new(vertex.x * f64::from(width), vertex.y * f64::from(height)))
        .collect();
        for row in pixels(polygon.iter().map(|vertex| vertex.y), height) {
            row_part.clone_from(&polygon);
            keep_between(&mut row_part, &mut spare, DVec2::Y, row);
            for column in pixels(row_part.iter().map(|vertex| vertex.x), width) {
                pixel_part.clone_from(&row_part);
                keep_between(&mut pixel_part, &mut spare, DVec2::X, column);
                let area = area(&pixel_part);
                if area != 0.0 {
                    parts.push(Part {
                        pixel: row * width + column,
                        face: face.0,
                        area,
                        perimeter: perimeter(&pixel_part),
                        fragments: 1,
                    });
                }
            }
        }
    }
    // A stable sort, so that sums of fragments are taken in one order.
    parts.sort_by_key(|part| (part.pixel, part.face));
    parts.dedup_by(|next, part| {
        let is_same = (next.pixel, next.face) == (part.pixel, part.face);
        if is_same {
            part.area += next.area;
            part.perimeter += next.perimeter;
            part.fragments += next.fragments;
        }
        is_same
    });
    parts
}

/// Indices of the pixels that `values`, in pixels, reach into.
fn pixels(values: impl Iterator<Item = f64> + Clone, count: u32) -> std::ops::Range<u32> {
    let low = values.clone().fold(f64::INFINITY, f64::min);
    let high = values.fold(f64::NEG_INFINITY, f64::max);
    let first = low.max(0.0) as u32;
    let end = (high.ceil().max(0.0) as u32).min(count);
    first..end.max(first)
}

/// Cuts off what lies outside pixel `index` along `axis`.
fn keep_between(polygon: &mut Vec<DVec2>, spare: &mut Vec<DVec2>, axis: DVec2, index: u32) {
    let low = f64::from(index);
    keep(polygon, spare, |vertex| vertex.dot(axis) - low);
    keep(polygon, spare, |vertex| low + 1.0 - vertex.dot(axis));
}

/// Keeps the part of a convex polygon where `distance`, which is affine, is not negative.
fn keep(polygon: &mut Vec<DVec2>, spare: &mut Vec<DVec2>, distance: impl Fn(DVec2) -> f64) {
    spare.clear();
    for (index, &end) in polygon.iter().enumerate() {
        let start = polygon[(index + polygon.len() - 1) % polygon.len()];
        let (at_start, at_end) = (distance(start), distance(end));
        if (at_start < 0.0) != (at_end < 0.0) {
            spare.push(start + (end - start) * (at_start / (at_start - at_end)));
        }
        if at_end >= 0.0 {
            spare.push(end);
        }
    }
    std::mem::swap(polygon, spare);
}

/// Shoelace formula about the first vertex.
fn area(polygon: &[DVec2]) -> f64 {
    let mut twice = 0.0;
    for index in 2..polygon.len() {
        let u = polygon[index - 1] - polygon[0];
        let v = polygon[index] - polygon[0];
        twice += u.x * v.y - u.y * v.x;
    }
    0.5 * twice
}

fn perimeter(polygon: &[DVec2]) -> f64 {
    (0..polygon.len())
        .map(|index| polygon[index].distance(polygon[(index + 1) % polygon.len()]))
        .sum()
}

/// Where two measurements differ most.
#[derive(Clone, Copy, Debug, Default)]
pub struct Difference {
    /// `row * width + column`.
    pub pixel: u32,
    pub face: u32,
    /// In square pixels.
    pub areas: [f64; 2],
}

impl Difference {
    /// How large the difference is, in square pixels.
    pub fn size(&self) -> f64 {
        (self.areas[0] - self.areas[1]).abs()
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "face {} in pixel {} differs by {:e}: {:?}",
            self.face,
            self.pixel,
            self.size(),
            self.areas
        )
    }
}

/// The largest difference of two measurements per face and pixel. A part that one of them lacks has
/// no area there.
pub fn largest_difference(one: &[Part], other: &[Part]) -> Difference {
    let mut largest = Difference::default();
    let (mut i, mut j) = (0, 0);
    while i < one.len() || j < other.len() {
        let order = match (one.get(i), other.get(j)) {
            (Some(a), Some(b)) => (a.pixel, a.face).cmp(&(b.pixel, b.face)),
            (Some(_), None) => Ordering::Less,
            _ => Ordering::Greater,
        };
        let mut areas = [0.0; 2];
        let mut key = (0, 0);
        if order.is_le() {
            areas[0] = one[i].area;
            key = (one[i].pixel, one[i].face);
            i += 1;
        }
        if order.is_ge() {
            areas[1] = other[j].area;
            key = (other[j].pixel, other[j].face);
            j += 1;
        }
        let (pixel, face) = key;
        let difference = Difference { pixel, face, areas };
        if exceeds(difference.size(), largest.size()) {
            largest = difference;
        }
    }
    largest
}

/// Whether a difference is too large, or not even a number.
pub fn exceeds(difference: f64, limit: f64) -> bool {
    difference > limit || difference.is_nan()
}

/// The smallest and the largest sum of areas in a pixel of a grid of `pixels`.
pub fn sums(coverage: &[Part], pixels: u32) -> (f64, f64) {
    let mut sums = vec![0.0; pixels as usize];
    for part in coverage {
        sums[part.pixel as usize] += part.area;
    }
    let least = sums.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = sums.iter().copied().fold(0.0, f64::max);
    (least, greatest)
}
