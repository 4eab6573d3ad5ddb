//! Parts and their radiance -> deep pixels: of each face seen in a pixel one sample.
//!
//! Deep samples know no place within the pixel, so that "over" takes what is nearer to cover the same
//! share of all that is farther. Faces seen in a pixel lie side by side, however: they are given the
//! opacity c / (1 - sum of nearer c), where c is their exact area, and then any program that lays the
//! samples one over the other gets exactly the pixel of the flat picture.
//!
//! Samples ascend in depth and do not overlap (they are *tidy*): a face's range of depths ends half way
//! to the next face's depth. Otherwise readers would split and mix faces that only lie side by side.

use crate::dice::{DepthRange, Depths, Parts, PixelGrid, depth_of_nearness};
use crate::shade::Radiance;
use veduta_geometry::DVec2;
use veduta_map::{FaceId, ObjectId, VisibilityMap};

/// What is seen of one face in one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeepSample {
    /// Depth of the face at the middle of what is seen of it: planar distance in metres.
    pub depth: f32,
    /// Depth of the nearest point, but not before half way from the sample before.
    pub front: f32,
    /// Depth of the farthest point, but not beyond half way to the sample behind.
    pub back: f32,
    /// Linear RGB, multiplied by the opacity.
    pub color: [f32; 3],
    /// Share of what nearer samples leave of the pixel, 0 to 1.
    pub opacity: f32,
    /// What it belongs to.
    pub object: ObjectId,
}

/// Deep pixels of some rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeepRows {
    /// Pixels of a row.
    pub width: u32,
    /// Samples of each pixel, rows from the top.
    pub counts: Vec<u32>,
    /// The samples of all pixels one after the other; in each, from near to far.
    pub samples: Vec<DeepSample>,
}

/// What is seen of one fragment in one pixel; then of one face.
#[derive(Clone, Copy, Debug)]
struct Seen {
    pixel: u32,
    face: FaceId,
    area: f64,
    /// Area times where it is, in pixels from the pixel's corner.
    moment: DVec2,
    /// Area times radiance.
    light: [f64; 3],
    range: DepthRange,
    /// At the middle of the area; known once all fragments of the face are together.
    depth: f64,
}

impl Seen {
    fn add(&mut self, other: &Self) {
        self.area += other.area;
        self.moment += other.moment;
        for (light, more) in self.light.iter_mut().zip(other.light) {
            *light += more;
        }
        self.range = self.range.with(other.range);
    }
}

/// Makes deep pixels, in buffers that it keeps.
#[derive(Clone, Debug, Default)]
pub struct DeepFilter {
    seen: Vec<Seen>,
    depths: Depths,
}

impl DeepFilter {
    /// Makes the rows of a band of `grid` that starts at row `first_row` and has `rows` rows; `deep` is
    /// overwritten. `parts` must have been diced with centroids for all fragments.
    pub fn fill(
        &mut self,
        map: &VisibilityMap,
        grid: &PixelGrid,
        [first_row, rows]: [u32; 2],
        parts: &Parts,
        radiance: &Radiance,
        deep: &mut DeepRows,
    ) {
        self.collect(map, grid, first_row, parts, radiance);
        // Parts are in the order of fragments, whose faces ascend: so the order within a pixel and face
        // is that of the flat picture's sums.
        self.seen.sort_by_key(|seen| (seen.pixel, seen.face));
        self.seen.dedup_by(|next, first| {
            let same = (next.pixel, next.face) == (first.pixel, first.face);
            if same {
                first.add(next);
            }
            same
        });
        let width = grid.width;
        for seen in &mut self.seen {
            let corner = DVec2::new(
                f64::from(seen.pixel % width),
                f64::from(first_row + seen.pixel / width),
            );
            let middle = grid.image_from_pixels(corner + seen.moment / seen.area);
            let nearness = map.faces.face_nearness(seen.face).at(middle);
            let depth = depth_of_nearness(&map.camera, nearness);
            // Of a sliver, rounding may put the middle beyond its ends.
            seen.depth = depth.max(seen.range.front).min(seen.range.back);
        }
        deep.width = width;
        deep.counts.clear();
        deep.counts.resize((width * rows) as usize, 0);
        deep.samples.clear();
        for pixel in self.seen.chunk_by_mut(|a, b| a.pixel == b.pixel) {
            // Of equal depths, the smaller face: coplanar faces are seen in that order too.
            pixel.sort_by(|a, b| a.depth.total_cmp(&b.depth).then(a.face.cmp(&b.face)));
            deep.counts[pixel[0].pixel as usize] = pixel.len() as u32;
            push_pixel(map, pixel, &mut deep.samples);
        }
    }

    fn collect(
        &mut self,
        map: &VisibilityMap,
        grid: &PixelGrid,
        first_row: u32,
        parts: &Parts,
        radiance: &Radiance,
    ) {
        self.seen.clear();
        let place = |pixel: u32| (pixel % grid.width, first_row + pixel / grid.width);
        // An area that single precision rounds to nothing, or that veils hide, is nothing.
        let boundary = parts.boundary.iter().zip(&radiance.boundary);
        for (part, light) in boundary.filter(|(part, _)| part.area > 0.0) {
            let (column, row) = place(part.pixel);
            let area = f64::from(part.area);
            let range = self.depths.of_part(map, grid, part.fragment, column, row);
            self.seen.push(Seen {
                pixel: part.pixel,
                face: map.face_of(part.fragment as usize),
                area,
                moment: area * part.centroid.as_dvec2(),
                light: light.map(|channel| area * f64::from(channel)),
                range,
                depth: 0.0,
            });
        }
        for (index, run) in parts.runs.iter().enumerate() {
            let face = map.opaque.face(run.fragment as usize);
            let lights = radiance.of_run(index);
            for (step, pixel) in run.pixels().enumerate() {
                let (column, row) = place(pixel as u32);
                let light = if lights.len() == 1 {
                    lights[0]
                } else {
                    lights[step]
                };
                self.seen.push(Seen {
                    pixel: pixel as u32,
                    face,
                    area: 1.0,
                    moment: DVec2::splat(0.5),
                    light: light.map(f64::from),
                    range: self.depths.of_pixel(map, grid, face, column, row),
                    depth: 0.0,
                });
            }
        }
    }
}

/// Adds the samples of a pixel whose faces are sorted by depth.
fn push_pixel(map: &VisibilityMap, pixel: &[Seen], samples: &mut Vec<DeepSample>) {
    let first = samples.len();
    let mut left = 1.0;
    for seen in pixel {
        // Areas are exact to seven digits, so that the last may be a little more than what is left.
        let opacity = if seen.area < left {
            seen.area / left
        } else {
            1.0
        };
        left -= seen.area;
        let before = samples[first..].last().map(|sample| sample.depth);
        let depth = match before {
            // Single precision may not tell two faces apart: the next number there is.
            Some(before) => (seen.depth as f32).max(before.next_up()),
            None => seen.depth as f32,
        };
        samples.push(DeepSample {
            depth,
            front: (seen.range.front as f32).min(depth),
            back: (seen.range.back as f32).max(depth),
            color: seen.light.map(|light| (light / seen.area * opacity) as f32),
            opacity: opacity as f32,
            object: map.faces.object(seen.face),
        });
    }
    for k in first + 1..samples.len() {
        let [near, far] = [samples[k - 1].depth, samples[k].depth];
        // From `near` on and before `far`, since these differ.
        let middle = near + 0.5 * (far - near);
        let middle = if middle < far { middle } else { near };
        samples[k - 1].back = samples[k - 1].back.min(middle);
        samples[k].front = samples[k].front.max(middle.next_up());
    }
}
