//! Spans -> pixels: "Regeneration of images" in Nakamae et al. (1989).

use super::ROWS_PER_BAND;
use crate::accumulate::Picture;
use rayon::prelude::*;
use std::ops::Range;
use veduta_map::{FaceId, Span, Spans};

/// The picture of faces that each have one colour (linear, premultiplied by opacity).
///
/// Nakamae et al., "Regeneration of images": the trapezoidal rule of eq. (1) and (2) down each row, with
/// lengths cut at the pixels' borders, eq. (3) to (6).
pub fn picture(spans: &Spans, color: impl Fn(FaceId) -> [f32; 4] + Sync) -> Picture {
    let width = spans.width() as usize;
    let mut pixels = vec![[0.0; 4]; width * spans.height() as usize];
    pixels
        .par_chunks_mut(width * ROWS_PER_BAND as usize)
        .enumerate()
        .for_each(|(band, rows)| {
            let first_row = band as u32 * ROWS_PER_BAND;
            let mut line = LineIntensity::new(width);
            line.scan(
                spans.sub_scanline(*spans.lines_of_row(first_row).start()),
                &color,
            );
            for (row, pixels) in (first_row..).zip(rows.chunks_exact_mut(width)) {
                let (first, last) = spans.lines_of_row(row).into_inner();
                if first == last {
                    continue;
                }
                let weight = 1.0 / (last - first) as f32;
                // Sub-scanline 0 of this row is sub-scanline n of the one above.
                line.add_to(pixels, 0.5 * weight);
                for j in first + 1..=last {
                    line.scan(spans.sub_scanline(j), &color);
                    line.add_to(pixels, if j == last { 0.5 * weight } else { weight });
                }
            }
        });
    Picture {
        width: spans.width(),
        height: spans.height(),
        pixels,
    }
}

/// Intensity of each pixel along one sub-scanline: the C' of eq. (2).
struct LineIntensity {
    /// A pixel more than the row has, for spans that end on its right border.
    pixels: Vec<[f32; 4]>,
    /// The pixels that may differ from zero.
    touched: Range<usize>,
}

impl LineIntensity {
    fn new(width: usize) -> Self {
        Self {
            pixels: vec![[0.0; 4]; width + 1],
            touched: 0..0,
        }
    }

    /// Replaces the intensities by those of another sub-scanline.
    fn scan(&mut self, spans: &[Span], color: impl Fn(FaceId) -> [f32; 4]) {
        self.pixels[self.touched.clone()].fill([0.0; 4]);
        let (Some(first), Some(last)) = (spans.first(), spans.last()) else {
            self.touched = 0..0;
            return;
        };
        self.touched = first.left as usize..last.right as usize + 1;
        for span in spans {
            self.add(span, color(span.face));
        }
    }

    /// Eq. (3) to (6); the sums run over all spans with a colour.
    #[inline]
    fn add(&mut self, span: &Span, color: [f32; 4]) {
        let (first, last) = (span.left as usize, span.right as usize);
        if first == last {
            add(
                &mut self.pixels[first],
                color,
                (span.right - span.left) as f32,
            );
            return;
        }
        add(
            &mut self.pixels[first],
            color,
            ((first + 1) as f64 - span.left) as f32,
        );
        for pixel in &mut self.pixels[first + 1..last] {
            add(pixel, color, 1.0);
        }
        add(
            &mut self.pixels[last],
            color,
            (span.right - last as f64) as f32,
        );
    }

    /// `C_i += d_j C'_i` of eq. (2).
    fn add_to(&self, row: &mut [[f32; 4]], weight: f32) {
        let touched = self.touched.start..self.touched.end.min(row.len());
        for (pixel, &intensity) in row[touched.clone()].iter_mut().zip(&self.pixels[touched]) {
            add(pixel, intensity, weight);
        }
    }
}

#[inline(always)]
fn add(pixel: &mut [f32; 4], color: [f32; 4], weight: f32) {
    for (sum, value) in pixel.iter_mut().zip(color) {
        *sum += weight * value;
    }
}
