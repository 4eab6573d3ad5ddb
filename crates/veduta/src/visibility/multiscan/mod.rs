//! Multiscan: what is seen along n sub-scanlines for each row of pixels.
//!
//! Nakamae et al., "Compositing 3D images with antialiasing and various shading effects" (1989),
//! after Nishita & Nakamae (1984). Exact along x, sampled along y: quick previews, and the yardstick
//! of Tanaka & Takahashi (1991), who count what exactness costs in sub-scanlines.
//!
//! 1. `scan` finds the faces that cross each sub-scanline, sorted by their left ends;
//! 2. `sweep` runs along a sub-scanline and keeps the nearest face, switching where two
//!    pierce;
//! 3. [`picture`] sums spans to pixels, eq. (1) to (6), as they are or scaled by [`Spans::on_grid`],
//!    eq. (7).
//!
//! Sub-scanlines 0 and n of a row lie on its borders and weigh half, as in eq. (1); the one between
//! two rows is scanned once and counts in both. We differ from the paper in that a span keeps its
//! face, whose plane tells the depth anywhere, instead of a depth and a slope of its own.
//!
//! A face without thickness in y between two sub-scanlines is missed, however wide it is: that is
//! the method's limit, not a fault of this code (see the tests).

mod regenerate;
mod scan;

pub use regenerate::picture;
pub use veduta_map::{Span, Spans};

use veduta_map::Faces;

/// Rows that a task scans. More share less of the work on faces that reach into several bands;
/// fewer spread better over threads.
const ROWS_PER_BAND: u32 = 32;

/// What the opaque `faces` show along `n` sub-scanlines for each row of a picture of
/// `width` x `height` pixels.
///
/// The sub-scanline on a pixel's border belongs to the faces below it; the last one, on the
/// picture's lower border, to those above it, since there are none below. Veils are left out.
///
/// # Panics
/// If `width`, `height` or `n` is zero, or there are more than `u32::MAX` sub-scanlines.
pub fn find_spans(faces: &Faces, width: u32, height: u32, n: u32) -> Spans {
    assert!(
        width > 0 && height > 0 && n > 0,
        "a picture of {width} x {height} with {n} sub-scanlines a row has no pixels"
    );
    Spans::new(width, height, n, scan::bands(faces, width, height, n))
}

#[cfg(test)]
mod tests;
