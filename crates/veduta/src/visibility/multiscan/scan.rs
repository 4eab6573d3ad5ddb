//! Down the picture: which faces cross each sub-scanline, and where.
//!
//! Active faces are kept from one sub-scanline to the next with the two sides that cross it, as in
//! any scanline algorithm; but x is computed from the side's upper end, not summed step by step, so
//! that it depends neither on where a band begins nor on which of two neighbours asks.

use super::ROWS_PER_BAND;
use crate::sweep::{LeftEnd, Segment, Sweep};
use rayon::prelude::*;
use veduta_geometry::DVec2;
use veduta_map::{FaceId, Faces, Span, SpanBand};

/// Faces whose extent a task finds at a time.
const FACES_PER_TASK: usize = 16 * 1024;

/// Scans all bands, each on its own: what is found on a sub-scanline does not depend on the others.
pub(super) fn bands(faces: &Faces, width: u32, height: u32, n: u32) -> Vec<SpanBand> {
    let heights = heights(height, n);
    let per_band = ROWS_PER_BAND * n;
    let entries = Entries::new(faces, &heights, per_band);
    (0..height.div_ceil(ROWS_PER_BAND))
        .into_par_iter()
        .map(|band| {
            let first = band * per_band;
            let last_band = (band + 1) * ROWS_PER_BAND >= height;
            let end = if last_band {
                height * n + 1
            } else {
                first + per_band
            };
            scan_band(faces, &heights, &entries, first..end, f64::from(width))
        })
        .collect()
}

/// Image-plane y of each sub-scanline.
///
/// The last is moved inside the frame by the least possible, so that it meets what lies above the
/// lower border by the rule that all others follow.
fn heights(height: u32, n: u32) -> Vec<f64> {
    let count = height
        .checked_mul(n)
        .filter(|&count| count < u32::MAX)
        .expect("at most u32::MAX sub-scanlines");
    let mut heights: Vec<f64> = (0..=count)
        .map(|k| f64::from(k) / f64::from(count))
        .collect();
    heights[count as usize] = 1.0_f64.next_down();
    heights
}

/// Which faces are met for the first time at which sub-scanline.
///
/// A face that reaches over several bands is listed at the first sub-scanline of each.
struct Entries {
    /// `starts[k]..starts[k + 1]` are the faces that enter at sub-scanline `k`.
    starts: Vec<u32>,
    faces: Vec<FaceId>,
    /// First and end of each face's sub-scanlines.
    extents: Vec<[u32; 2]>,
}

impl Entries {
    fn new(faces: &Faces, heights: &[f64], per_band: u32) -> Self {
        let extents: Vec<[u32; 2]> = (0..faces.len())
            .into_par_iter()
            .with_min_len(FACES_PER_TASK)
            .map(|index| extent(faces, FaceId(index as u32), heights))
            .collect();
        let entries_of = |[first, end]: [u32; 2]| {
            let next_band = (first / per_band + 1) * per_band;
            // The sub-scanline after the last full band is in that band.
            let bands_end = end.min(heights.len() as u32 - 1);
            let later = (next_band..bands_end).step_by(per_band as usize);
            (first < end).then_some(first).into_iter().chain(later)
        };
        let mut starts = vec![0_u32; heights.len() + 1];
        for &extent in &extents {
            for line in entries_of(extent) {
                starts[line as usize + 1] += 1;
            }
        }
        let mut sum = 0_u32;
        for start in &mut starts {
            sum = sum.checked_add(*start).expect("at most u32::MAX entries");
            *start = sum;
        }
        let mut next = starts.clone();
        let mut entered = vec![FaceId(0); sum as usize];
        for (index, &extent) in extents.iter().enumerate() {
            for line in entries_of(extent) {
                let place = &mut next[line as usize];
                entered[*place as usize] = FaceId(index as u32);
                *place += 1;
            }
        }
        Self {
            starts,
            faces: entered,
            extents,
        }
    }

    fn at(&self, line: u32) -> &[FaceId] {
        let line = line as usize;
        &self.faces[self.starts[line] as usize..self.starts[line + 1] as usize]
    }
}

/// The sub-scanlines that an opaque face crosses: those with `top <= y < bottom`.
fn extent(faces: &Faces, face: FaceId, heights: &[f64]) -> [u32; 2] {
    if faces.is_veil(face) {
        return [0, 0];
    }
    let (mut top, mut bottom) = (f64::INFINITY, f64::NEG_INFINITY);
    for vertex in faces.outline(face) {
        top = top.min(vertex.y);
        bottom = bottom.max(vertex.y);
    }
    [top, bottom].map(|y| first_at_or_below(heights, y))
}

/// The first sub-scanline with a height of at least `y`; their number if there is none.
#[inline]
fn first_at_or_below(heights: &[f64], y: f64) -> u32 {
    let guess = (y * (heights.len() - 1) as f64).ceil().max(0.0) as usize;
    let mut line = guess.min(heights.len());
    // Rounding leaves the guess one off at most; the comparison decides.
    while line > 0 && heights[line - 1] >= y {
        line -= 1;
    }
    while line < heights.len() && heights[line] < y {
        line += 1;
    }
    line as u32
}

/// A side of a face, from its upper end, so that neighbours compute the same x.
#[derive(Clone, Copy, Debug)]
struct Edge {
    top: DVec2,
    bottom_y: f64,
    /// Change of x per unit of y.
    slope: f64,
}

impl Edge {
    #[inline]
    fn new(top: DVec2, bottom: DVec2) -> Self {
        Self {
            top,
            bottom_y: bottom.y,
            slope: (bottom.x - top.x) / (bottom.y - top.y),
        }
    }

    /// Where the edge crosses height `y`, inside the frame.
    #[inline]
    fn x_at(&self, y: f64) -> f64 {
        (self.top.x + (y - self.top.y) * self.slope).clamp(0.0, 1.0)
    }
}

/// A face that crosses the sub-scanline.
#[derive(Clone, Copy, Debug)]
struct ActiveFace {
    segment: Segment,
    /// The sub-scanline after its last.
    end: u32,
    sides: [Edge; 2],
}

impl AsRef<Segment> for ActiveFace {
    #[inline(always)]
    fn as_ref(&self) -> &Segment {
        &self.segment
    }
}

impl ActiveFace {
    fn new(faces: &Faces, face: FaceId, end: u32, y: f64) -> Self {
        Self {
            segment: Segment {
                face,
                right: 0.0,
                nearness: *faces.face_nearness(face),
            },
            end,
            sides: sides_at(faces.outline(face), y),
        }
    }

    /// Goes to height `y`, below the previous one; the segment's left end.
    #[inline]
    fn go_to(&mut self, faces: &Faces, y: f64) -> f64 {
        if y >= self.sides[0].bottom_y.min(self.sides[1].bottom_y) {
            self.sides = sides_at(faces.outline(self.segment.face), y);
        }
        self.segment.right = self.sides[1].x_at(y);
        self.sides[0].x_at(y)
    }
}

/// The left and the right side of a convex outline at height `y`, which must cross it.
#[inline]
fn sides_at(outline: &[DVec2], y: f64) -> [Edge; 2] {
    // Both are found, since the height lies between the topmost and the lowest vertex.
    let mut sides = [Edge::new(outline[0], outline[0]); 2];
    let mut previous = outline[outline.len() - 1];
    for &vertex in outline {
        match (previous.y <= y, vertex.y <= y) {
            // Positively wound, with y down: the outline goes down on the right.
            (true, false) => sides[1] = Edge::new(previous, vertex),
            (false, true) => sides[0] = Edge::new(vertex, previous),
            _ => {}
        }
        previous = vertex;
    }
    sides
}

fn scan_band(
    faces: &Faces,
    heights: &[f64],
    entries: &Entries,
    lines: std::ops::Range<u32>,
    width: f64,
) -> SpanBand {
    let mut band = SpanBand {
        first: lines.start,
        spans: Vec::new(),
        ends: Vec::with_capacity(lines.len()),
    };
    let mut active: Vec<ActiveFace> = Vec::new();
    let mut free: Vec<u32> = Vec::new();
    let mut left_ends: Vec<LeftEnd> = Vec::new();
    let mut newcomers: Vec<LeftEnd> = Vec::new();
    let mut sweep = Sweep::default();
    for line in lines {
        let y = heights[line as usize];
        left_ends.retain_mut(|left_end| {
            let face = &mut active[left_end.slot as usize];
            if face.end <= line {
                free.push(left_end.slot);
                return false;
            }
            left_end.x = face.go_to(faces, y);
            true
        });
        let retained = left_ends.len();
        for &face in entries.at(line) {
            let end = entries.extents[face.index()][1];
            let mut entering = ActiveFace::new(faces, face, end, y);
            let x = entering.go_to(faces, y);
            let slot = free.pop().unwrap_or(active.len() as u32);
            if slot as usize == active.len() {
                active.push(entering);
            } else {
                active[slot as usize] = entering;
            }
            left_ends.push(LeftEnd { x, face, slot });
        }
        sort(&mut left_ends, retained, &mut newcomers);
        sweep.along(y, &left_ends, &active, |face, left, right| {
            let (left, right) = (left * width, right * width);
            if left < right {
                band.spans.push(Span { face, left, right });
            }
        });
        let end = u32::try_from(band.spans.len()).expect("at most u32::MAX spans in a band");
        band.ends.push(end);
    }
    band
}

/// Sorts by left end, where the first `retained` were in order on the sub-scanline before: few of
/// them have changed places, and the others are merged in.
fn sort(left_ends: &mut [LeftEnd], retained: usize, newcomers: &mut Vec<LeftEnd>) {
    // So many moves cost about as much as a sort that knows nothing.
    let mut moves_left = 6 * retained;
    for next in 1..retained {
        let moving = left_ends[next];
        let mut place = next;
        while place > 0 && moving.order(&left_ends[place - 1]).is_lt() {
            left_ends[place] = left_ends[place - 1];
            place -= 1;
        }
        left_ends[place] = moving;
        if next - place > moves_left {
            left_ends.sort_unstable_by(LeftEnd::order);
            return;
        }
        moves_left -= next - place;
    }
    newcomers.clear();
    newcomers.extend_from_slice(&left_ends[retained..]);
    newcomers.sort_unstable_by(LeftEnd::order);
    // From the back, into the room that the newcomers leave.
    let (mut place, mut old) = (left_ends.len(), retained);
    while let Some(newcomer) = newcomers.last() {
        place -= 1;
        if old > 0 && newcomer.order(&left_ends[old - 1]).is_lt() {
            old -= 1;
            left_ends[place] = left_ends[old];
        } else {
            left_ends[place] = *newcomer;
            newcomers.pop();
        }
    }
}
