//! The cross-scanline sweep: exact visibility, strip by strip.
//!
//! Tanaka & Takahashi, "Cross Scanline Algorithm for Anti-aliasing" (1991), with strips of any
//! height where the paper has pixel rows. H-scanlines cut the frame into strips. Within a strip
//! short V-scanlines run through every vertex, through every point where an edge meets an
//! H-scanline, and through every crossing of two edges. Between two V-scanlines nothing but
//! straight lines is left, so what is seen there falls into trapezoids, and their areas are exact.
//!
//! ```text
//!      H-scanline  ──┬─────┬──────────┬────┬──   a slice: what one face has between two of its
//!                    │   ╱ │          │╲   │     own V-scanlines, bounded by two straight lines
//!                    │ ╱   │          │  ╲ │
//!      H-scanline  ──┴─────┴──────────┴────┴──
//! ```
//!
//! The steps, a file each:
//!
//! 1. `h_scan`: which faces enter a strip, and their slices (the paper's 2-1 to 2-4);
//! 2. `v_scan`: the sweep in x, which leaves a slice alone as long as no other overlaps it (3-1);
//! 3. `split`: overlapping slices are cut where edges cross (3-2) and where planes do (§4, virtual
//!    edges), and the nearest face is found;
//! 4. `emit`: trapezoids become fragments whose sides are named (3-3 needs no more than that: area
//!    is left to the map's readers).
//!
//! Departures from the paper: a slice's own V-scanlines do not cut its neighbours, slices keep the
//! lines that bound them rather than values sampled on scanlines, and trapezoids are joined again
//! across V-scanlines that turned out not to matter. Nothing is sampled and nothing is guessed, so
//! this engine is the reference for the others; it is at its best where strips are about as high
//! as the faces.
//!
//! Cost: a strip with `n` slices of which at most `k` meet a V-scanline takes `O(n (log n + k))`,
//! plus a sort of the overlapping ones for each crossing.

mod emit;
mod h_scan;
mod split;
mod v_scan;

use super::Seen;
use emit::Pieces;
use h_scan::Bins;
use rayon::prelude::*;
use v_scan::Sweep;
use veduta_map::{FaceId, Faces};

/// How the sweep goes about its work. What is seen does not depend on it, only how it is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Number of strips of equal height that the frame is cut into; the paper has one for each row
    /// of pixels. Fastest when a strip is about as high as a typical face.
    pub strips: u32,
}

impl Default for Settings {
    /// 128 strips: 8 rows of a picture about 1,000 pixels high.
    fn default() -> Self {
        Self { strips: 128 }
    }
}

/// Distances in the image plane up to which two computed positions are taken for one.
///
/// Coordinates lie in the unit square, where `f64` resolves 1e-16, and a position computed here is
/// off by a few of that. If the constant were smaller than that noise, edges that merely touch
/// would be cut at crossings that are none. What lies within it may go to the wrong face or to
/// none: a sliver of this width and at most a pixel long, 1e-15 of the frame's side times a pixel's,
/// which at 4,096 pixels is 4e-12 of a pixel's area.
const ROUNDING: f64 = 1e-15;

/// Finds what is seen of `faces`: the exact regions in which each face is.
///
/// Faces none of whose slices is hidden are reported whole, the others as trapezoids and triangles.
/// The result does not depend on the number of threads; the regions do not depend on `settings`.
///
/// # Panics
/// If `settings.strips` is zero.
pub fn find(faces: &Faces, settings: &Settings) -> Seen {
    assert!(settings.strips > 0, "the frame is at least one strip");
    let bins = Bins::new(faces, settings.strips);
    let strips: Vec<StripSeen> = (0..settings.strips)
        .into_par_iter()
        .map_init(Sweep::default, |sweep, index| {
            sweep.strip(faces, bins.strip(index), bins.faces(index))
        })
        .collect();
    emit::assemble(faces, &strips)
}

/// What is seen in one strip.
struct StripSeen {
    opaque: Pieces,
    veils: Pieces,
    /// Faces of which something is hidden here, in no order.
    hidden: Vec<FaceId>,
}

/// What bounds a trapezoid above or below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bound {
    /// The strip's upper or lower end.
    HScanline,
    /// A side of a face's outline.
    Edge(FaceId, u32),
    /// The paper's virtual edge: the planes of two faces cross.
    Crossing(FaceId, FaceId),
}

/// A region between two V-scanlines and two straight lines. In a triangle one height is zero.
///
/// Invariants: `left < right`, and at both ends `top <= bottom` (y points down).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Trapezoid {
    left: f64,
    right: f64,
    /// y of the upper bound on the left and on the right.
    top: [f64; 2],
    /// y of the lower bound on the left and on the right.
    bottom: [f64; 2],
    above: Bound,
    below: Bound,
}

impl Trapezoid {
    /// The part between the V-scanlines at `left` and `right`, which lie within it.
    fn between(&self, left: f64, right: f64) -> Trapezoid {
        let along = [left, right].map(|x| (x - self.left) / (self.right - self.left));
        let top = both_between(self.top, along);
        let bottom = both_between(self.bottom, along);
        Trapezoid {
            left,
            right,
            top,
            bottom: [bottom[0].max(top[0]), bottom[1].max(top[1])],
            ..*self
        }
    }

    /// Whether its heights are within rounding.
    fn is_flat(&self) -> bool {
        self.bottom[0] - self.top[0] <= ROUNDING && self.bottom[1] - self.top[1] <= ROUNDING
    }

    /// Whether it is so narrow or so flat that rounding may have made it.
    fn is_negligible(&self) -> bool {
        self.right - self.left <= ROUNDING || self.is_flat()
    }
}

/// A trapezoid in which a face is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    face: FaceId,
    shape: Trapezoid,
}

/// Linear interpolation: `ends[0]` at 0 and `ends[1]` at 1, exactly.
fn between(ends: [f64; 2], along: f64) -> f64 {
    if along == 1.0 {
        ends[1]
    } else {
        ends[0] + (ends[1] - ends[0]) * along
    }
}

fn both_between(ends: [f64; 2], along: [f64; 2]) -> [f64; 2] {
    [between(ends, along[0]), between(ends, along[1])]
}

/// Whether two lines are one between two V-scanlines, where `one` and `other` are their y.
fn is_same_y(one: [f64; 2], other: [f64; 2]) -> bool {
    (one[0] - other[0]).abs() <= ROUNDING && (one[1] - other[1]).abs() <= ROUNDING
}
