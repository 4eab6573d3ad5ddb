//! Multiscan: what is seen along n sub-scanlines for each row of pixels.
//!
//! Nakamae et al., "Compositing 3D images with antialiasing and various shading effects" (1989),
//! after Nishita & Nakamae (1984). Exact along x, sampled along y: quick previews, and the yardstick
//! of Tanaka & Takahashi (1991), who count what exactness costs in sub-scanlines.
//!
//! 1. `scan` finds the faces that cross each sub-scanline, sorted by their left ends;
//! 2. `sweep` runs along a sub-scanline and keeps the nearest face, switching where two pierce;
//! 3. [`regenerate`](Spans::picture) sums spans to pixels, eq. (1) to (6).
//!
//! Sub-scanlines 0 and n of a row lie on its borders and weigh half, as in eq. (1); the one between
//! two rows is scanned once and counts in both. We differ from the paper in that a span keeps its
//! face, whose plane tells the depth anywhere, instead of a depth and a slope of its own.
//!
//! A face without thickness in y between two sub-scanlines is missed, however wide it is: that is
//! the method's limit, not a fault of this code (see the tests).

mod regenerate;
mod scan;
mod sweep;

use scan::Band;
use veduta_map::{FaceId, Faces};

/// A visible segment of a sub-scanline.
///
/// `left < right`, both in pixels from the picture's left border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// The face seen.
    pub face: FaceId,
    /// Where the segment begins.
    pub left: f64,
    /// Where it ends.
    pub right: f64,
}

/// What is seen along every sub-scanline of a picture.
///
/// Sub-scanline `k` lies `k / n` pixels below the picture's upper border, from 0 to `n * height`.
/// Its spans ascend in x and do not overlap; where there is none the background is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Spans {
    width: u32,
    height: u32,
    per_row: u32,
    /// Rows of a band, so that bands can be found, and later shown, side by side.
    bands: Vec<Band>,
}

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
        width > 0 && height > 0,
        "a picture of {width} x {height} has no pixels"
    );
    assert!(n > 0, "a row has at least one sub-scanline");
    Spans {
        width,
        height,
        per_row: n,
        bands: scan::bands(faces, width, height, n),
    }
}

impl Spans {
    /// Width of the picture in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height of the picture in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Sub-scanlines per row: the n of the paper.
    pub fn sub_scanlines_per_row(&self) -> u32 {
        self.per_row
    }

    /// The spans of sub-scanline `index`.
    ///
    /// # Panics
    /// If `index` is greater than `n * height`.
    pub fn sub_scanline(&self, index: u32) -> &[Span] {
        let band = (index / (ROWS_PER_BAND * self.per_row)) as usize;
        // The last sub-scanline belongs to the last band, which may be full without it.
        let band = band.min(self.bands.len() - 1);
        self.bands[band].sub_scanline(index)
    }

    /// The faces seen, ascending.
    pub fn faces(&self) -> Vec<FaceId> {
        let mut faces: Vec<FaceId> = self.bands.iter().flat_map(Band::faces).collect();
        faces.sort_unstable();
        faces.dedup();
        faces
    }

    /// Number of spans.
    pub fn len(&self) -> usize {
        self.bands.iter().map(Band::len).sum()
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[cfg(test)]
mod tests;
