use super::{Part, Parts, Run};
use std::ops::{Range, RangeInclusive};
use veduta_geometry::{DVec2, Vec2};
use veduta_map::{FaceId, Span, Spans};

/// Dices the spans of some rows of a picture, as [`dice`](super::dice) does fragments: an area is
/// what Nakamae et al. (1989), eq. (1) to (6), make of the lengths of spans. `parts` is overwritten.
///
/// `fragment_of` numbers the faces. Where one face is seen along all sub-scanlines of a pixel, the
/// pixel is taken to be filled; elsewhere a part is the sum over sub-scanlines, with the centroid of
/// the segments.
pub fn dice_spans(
    spans: &Spans,
    rows: Range<u32>,
    fragment_of: impl Fn(FaceId) -> u32,
    dicer: &mut SpanDicer,
    parts: &mut Parts,
) {
    parts.boundary.clear();
    parts.runs.clear();
    for row in rows.clone() {
        let (first_line, last_line) = spans.lines_of_row(row).into_inner();
        let n = last_line - first_line;
        if n == 0 {
            continue;
        }
        let first_pixel = (row - rows.start) * spans.width();
        dicer.find_filled(spans, first_line..=last_line);
        dicer.pieces.clear();
        for line in 0..=n {
            // Sub-scanlines 0 and n lie on the row's borders: eq. (1).
            let weight = if line == 0 || line == n { 0.5 } else { 1.0 } / f64::from(n);
            let y = f64::from(line) / f64::from(n);
            dicer.add_pieces(spans.sub_scanline(first_line + line), y, weight);
        }
        dicer.pieces.sort_by_key(|piece| (piece.pixel, piece.face));
        let of_one = |a: &Piece, b: &Piece| (a.pixel, a.face) == (b.pixel, b.face);
        for pieces in dicer.pieces.chunk_by(of_one) {
            let area: f64 = pieces.iter().map(|piece| piece.area).sum();
            let moment: DVec2 = pieces.iter().map(|piece| piece.moment).sum();
            parts.boundary.push(Part {
                pixel: first_pixel + pieces[0].pixel,
                fragment: fragment_of(pieces[0].face),
                area: area as f32,
                centroid: (moment / area).as_vec2().clamp(Vec2::ZERO, Vec2::ONE),
            });
        }
        parts.runs.extend(dicer.filled.iter().map(|filled| Run {
            pixel: first_pixel + filled.pixels.start,
            length: filled.pixels.end - filled.pixels.start,
            fragment: fragment_of(filled.face),
        }));
    }
}

/// Buffers that [`dice_spans`] keeps from row to row.
#[derive(Clone, Debug, Default)]
pub struct SpanDicer {
    filled: Vec<Filled>,
    narrowed: Vec<Filled>,
    pieces: Vec<Piece>,
}

/// Pixels of a row that a face fills along all sub-scanlines looked at.
#[derive(Clone, Debug)]
struct Filled {
    pixels: Range<u32>,
    face: FaceId,
}

/// What a sub-scanline adds to a pixel.
#[derive(Clone, Copy, Debug)]
struct Piece {
    pixel: u32,
    face: FaceId,
    area: f64,
    /// Area times centre, from the pixel's top left corner.
    moment: DVec2,
}

impl SpanDicer {
    /// Intersects what is filled on the row's sub-scanlines.
    fn find_filled(&mut self, spans: &Spans, lines: RangeInclusive<u32>) {
        let (first, last) = lines.into_inner();
        self.filled.clear();
        let of_first = spans.sub_scanline(first).iter();
        self.filled.extend(of_first.filter_map(filled_by));
        for line in first + 1..=last {
            self.narrowed.clear();
            let mut before = self.filled.iter().peekable();
            for next in spans.sub_scanline(line).iter().filter_map(filled_by) {
                while before
                    .next_if(|b| b.pixels.end <= next.pixels.start)
                    .is_some()
                {}
                while let Some(filled) = before.peek() {
                    let start = filled.pixels.start.max(next.pixels.start);
                    let end = filled.pixels.end.min(next.pixels.end);
                    if start < end && filled.face == next.face {
                        let (pixels, face) = (start..end, next.face);
                        self.narrowed.push(Filled { pixels, face });
                    }
                    if filled.pixels.end > next.pixels.end {
                        break;
                    }
                    before.next();
                }
            }
            std::mem::swap(&mut self.filled, &mut self.narrowed);
        }
    }

    /// Cuts spans at the pixels' borders, eq. (3) to (6), outside the filled pixels.
    fn add_pieces(&mut self, spans: &[Span], y: f64, weight: f64) {
        let mut filled = self.filled.iter().peekable();
        for span in spans {
            let mut left = span.left;
            while left < span.right {
                let pixel = left as u32;
                while filled
                    .next_if(|filled| filled.pixels.end <= pixel)
                    .is_some()
                {}
                if let Some(filled) = filled.peek()
                    && filled.pixels.contains(&pixel)
                {
                    left = f64::from(filled.pixels.end);
                    continue;
                }
                let right = span.right.min(f64::from(pixel + 1));
                let area = weight * (right - left);
                let centre = DVec2::new(0.5 * (left + right) - f64::from(pixel), y);
                self.pieces.push(Piece {
                    pixel,
                    face: span.face,
                    area,
                    moment: area * centre,
                });
                left = right;
            }
        }
    }
}

/// The pixels that a span crosses from border to border.
fn filled_by(span: &Span) -> Option<Filled> {
    let pixels = span.left.ceil() as u32..span.right as u32;
    (pixels.start < pixels.end).then_some(Filled {
        pixels,
        face: span.face,
    })
}
