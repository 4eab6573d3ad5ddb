//! A z-buffer: one sample in the middle of each pixel.
//!
//! The yardstick for finding visibility. Single-threaded, without tiles or SIMD by hand; nearness
//! in `f32`, stepped along the row.

use veduta::accumulate::Picture;
use veduta::geometry::DVec2;
use veduta::map::{FaceId, Faces};

/// Marks samples that no face covers.
const BACKGROUND: FaceId = FaceId(u32::MAX);

/// Which face is nearest at each sample, and how near it is.
#[derive(Clone, Debug, PartialEq)]
pub struct ZBuffer {
    width: usize,
    height: usize,
    nearness: Vec<f32>,
    faces: Vec<FaceId>,
}

impl ZBuffer {
    /// A buffer of `width` x `height` samples.
    pub fn new(width: u32, height: u32) -> Self {
        let (width, height) = (width as usize, height as usize);
        Self {
            width,
            height,
            nearness: vec![f32::NEG_INFINITY; width * height],
            faces: vec![BACKGROUND; width * height],
        }
    }

    /// Finds the nearest of `faces` at each sample. What was in the buffer before is lost.
    pub fn find(&mut self, faces: &Faces) {
        self.nearness.fill(f32::NEG_INFINITY);
        self.faces.fill(BACKGROUND);
        for face in faces.ids() {
            self.draw(faces, face);
        }
    }

    /// The face seen at a sample.
    pub fn face_at(&self, column: usize, row: usize) -> Option<FaceId> {
        let face = self.faces[row * self.width + column];
        (face != BACKGROUND).then_some(face)
    }

    /// Makes `picture` the one in which each pixel is the mean of `n` x `n` samples (linear,
    /// premultiplied). Its memory is used again: getting that of a large picture from the system
    /// can take longer than all else here.
    ///
    /// # Panics
    /// If `n` does not divide the width and height of the buffer.
    pub fn resolve(&self, n: usize, color: impl Fn(FaceId) -> [f32; 4], picture: &mut Picture) {
        assert!(
            n > 0 && self.width.is_multiple_of(n) && self.height.is_multiple_of(n),
            "{} x {} samples are not pixels of {n} x {n}",
            self.width,
            self.height
        );
        let (width, height) = (self.width / n, self.height / n);
        (picture.width, picture.height) = (width as u32, height as u32);
        picture.pixels.clear();
        picture.pixels.resize(width * height, [0.0; 4]);
        let weight = 1.0 / (n * n) as f32;
        for (row, samples) in self.faces.chunks_exact(self.width).enumerate() {
            let pixels = &mut picture.pixels[row / n * width..][..width];
            for (pixel, samples) in pixels.iter_mut().zip(samples.chunks_exact(n)) {
                for &face in samples.iter().filter(|face| **face != BACKGROUND) {
                    for (sum, value) in pixel.iter_mut().zip(color(face)) {
                        *sum += weight * value;
                    }
                }
            }
        }
    }

    fn draw(&mut self, faces: &Faces, face: FaceId) {
        let outline = faces.outline(face);
        let size = DVec2::new(self.width as f64, self.height as f64);
        let (mut top, mut bottom, mut topmost) = (f64::INFINITY, f64::NEG_INFINITY, 0);
        for (index, vertex) in outline.iter().enumerate() {
            if vertex.y < top {
                top = vertex.y;
                topmost = index;
            }
            bottom = bottom.max(vertex.y);
        }
        let first = first_centre(top * size.y);
        let end = first_centre(bottom * size.y).min(self.height);
        if first >= end {
            return;
        }
        // Positively wound, with y down: forwards from the topmost vertex is down on the right.
        let mut right = Side::new(outline, size, topmost, 1);
        let mut left = Side::new(outline, size, topmost, outline.len() - 1);
        let nearness = faces.face_nearness(face);
        let (slope_x, slope_y) = (nearness.a / size.x, nearness.b / size.y);
        let step = slope_x as f32;
        for row in first..end {
            let y = row as f64 + 0.5;
            let begin = first_centre(left.x_at(y, outline, size));
            let end = first_centre(right.x_at(y, outline, size)).min(self.width);
            if begin >= end {
                continue;
            }
            let at_first = slope_x * (begin as f64 + 0.5) + slope_y * y + nearness.c;
            let mut value = at_first as f32;
            let samples = row * self.width + begin..row * self.width + end;
            let kept = self.nearness[samples.clone()].iter_mut();
            for (nearest, seen) in kept.zip(&mut self.faces[samples]) {
                if value > *nearest {
                    *nearest = value;
                    *seen = face;
                }
                value += step;
            }
        }
    }
}

/// The first sample whose middle is at `position` or beyond.
#[inline(always)]
fn first_centre(position: f64) -> usize {
    // The cast takes what is negative to 0.
    (position - 0.5).ceil() as usize
}

/// The outline's way down on one side.
struct Side {
    /// Index of the vertex at the lower end of the present edge.
    lower: usize,
    /// By how many vertices the way goes on.
    stride: usize,
    /// Ends of the present edge, in samples.
    top: DVec2,
    bottom: DVec2,
    slope: f64,
}

impl Side {
    #[inline]
    fn new(outline: &[DVec2], size: DVec2, topmost: usize, stride: usize) -> Self {
        let top = outline[topmost] * size;
        let mut side = Self {
            lower: topmost,
            stride,
            top,
            bottom: top,
            slope: 0.0,
        };
        side.advance(outline, size);
        side
    }

    #[inline]
    fn advance(&mut self, outline: &[DVec2], size: DVec2) {
        self.lower += self.stride;
        if self.lower >= outline.len() {
            self.lower -= outline.len();
        }
        self.top = self.bottom;
        self.bottom = outline[self.lower] * size;
        self.slope = (self.bottom.x - self.top.x) / (self.bottom.y - self.top.y);
    }

    /// Where the side is at `y`, which grows from call to call and lies above the lowest vertex.
    #[inline(always)]
    fn x_at(&mut self, y: f64, outline: &[DVec2], size: DVec2) -> f64 {
        while self.bottom.y <= y {
            self.advance(outline, size);
        }
        self.top.x + (y - self.top.y) * self.slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta::scene::generate;
    use veduta::visibility::{multiscan, project};

    #[test]
    fn samples_show_what_multiscan_sees_there() {
        // Sub-scanlines 1, 3, 5 … of two for each row run through the middles of the pixels.
        for name in ["balls3", "soup", "buildings", "pierce"] {
            let made = generate::by_name(name).expect("a generated scene");
            let faces = project(&made.scene, &made.camera);
            let (width, height) = (211, 120);
            let mut buffer = ZBuffer::new(width, height);
            buffer.find(&faces);
            let spans = multiscan::find_spans(&faces, width, height, 2);
            let mut differing = 0;
            for row in 0..height {
                let spans = spans.sub_scanline(2 * row + 1);
                for column in 0..width {
                    let x = f64::from(column) + 0.5;
                    let span = spans.iter().find(|span| span.left <= x && x < span.right);
                    let found = buffer.face_at(column as usize, row as usize);
                    differing += u32::from(found != span.map(|span| span.face));
                }
            }
            // Nearness in f32 decides otherwise where two faces are almost equally near.
            assert!(
                differing * 2000 < width * height,
                "{name}: {differing} differ"
            );
        }
    }

    #[test]
    fn the_mean_of_many_samples_is_the_area() {
        let made = generate::by_name("radial").expect("a generated scene");
        let faces = project(&made.scene, &made.camera);
        let area: f64 = faces
            .ids()
            .map(|face| veduta::geometry::signed_area(faces.outline(face)))
            .sum();
        let mut buffer = ZBuffer::new(512, 512);
        buffer.find(&faces);
        let mut picture = Picture {
            width: 0,
            height: 0,
            pixels: Vec::new(),
        };
        buffer.resolve(16, |_| [1.0; 4], &mut picture);
        let mean = picture
            .pixels
            .iter()
            .map(|pixel| f64::from(pixel[3]))
            .sum::<f64>()
            / 1024.0;
        assert!((mean - area).abs() < 1e-3, "{mean} is not {area}");
    }
}
