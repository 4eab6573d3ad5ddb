//! Pixels that the rim of a round picture passes through.

use super::Patch;
use super::block::{BLOCK, Block, Inside, LEAST_SIDE, TOLERANCE_WITHIN_PIXEL};
use veduta_geometry::{DVec2, cross};

/// A chord in place of an arc is near enough if it cuts off that share of what is left of a pixel, or less: its patches are
/// given the pixel's exact share, so that what is seen in them is brighter by as much.
const BETWEEN_ARC_AND_CHORD: f64 = 1.0 / 300.0;

/// Patches along the rim are at most this long, in pixels, where a chord through the pixel is not.
const RIM_SIDE: f64 = 0.25;

/// The rim is not looked for more finely where it cuts off less than this of a pixel.
const LEAST_SHARE: f64 = 1e-2;

/// How often the rim is looked for between two points of an edge: to the last bits of a pixel.
const HALVINGS: u32 = 45;

/// Side of the patch in a pixel of which the rim leaves too little to follow, in pixels.
const SLIVER: f64 = 1e-3;

impl Block<'_> {
    /// Cuts what of a pixel, or of a part of it, lies on the inner side of the rim.
    pub fn divide_at_rim(&mut self, min: DVec2, max: DVec2, patches: &mut Vec<Patch>) {
        let size = max - min;
        let longer = usize::from(size.y > size.x);
        let rim_side = RIM_SIDE.min(0.5 * self.least_chord(min, max));
        match self.inside_of_pixel(min, max) {
            Inside::None if size[longer] <= rim_side => return,
            Inside::All => {
                let cell = self.cell(min, max);
                return self.cut_straight(&cell, patches);
            }
            Inside::None => {}
            Inside::Some => {
                let triangles = self.inner_triangles(min, max);
                let is_short = size[longer] <= rim_side.max(LEAST_SIDE);
                if (is_short || self.chord_is_near(min, max, &triangles))
                    && (size[longer] <= LEAST_SIDE || self.are_straight(&triangles))
                {
                    triangles.into_iter().for_each(|t| self.push(t, patches));
                    return;
                }
            }
        }
        let middle = 0.5 * (min[longer] + max[longer]);
        let (mut first_max, mut second_min) = (max, min);
        first_max[longer] = middle;
        second_min[longer] = middle;
        self.divide_at_rim(min, first_max, patches);
        self.divide_at_rim(second_min, max, patches);
    }

    /// Whether nine points of a pixel, or of a part of it, belong to the picture.
    fn inside_of_pixel(&self, min: DVec2, max: DVec2) -> Inside {
        let along = |axis: usize, step: usize| match step {
            0 => min[axis],
            1 => 0.5 * (min[axis] + max[axis]),
            _ => max[axis],
        };
        let points = (0..9).map(|k| DVec2::new(along(0, k % 3), along(1, k / 3)));
        match points.filter(|&p| self.projection.covers(p)).count() {
            0 => Inside::None,
            9 => Inside::All,
            _ => Inside::Some,
        }
    }

    /// Share of the pixel of a rectangle within it.
    fn share_at(&self, min: DVec2, max: DVec2) -> f64 {
        let [columns, rows] = self.pixels(min, max);
        self.shares[(rows.start * BLOCK + columns.start) as usize]
    }

    /// About how long the rim is in a pixel, if it cuts off a corner or a side only.
    fn least_chord(&self, min: DVec2, max: DVec2) -> f64 {
        let share = self.share_at(min, max);
        share.min(1.0 - share).max(LEAST_SHARE).sqrt()
    }

    /// Whether triangles up to a chord fill what the rim leaves of a whole pixel.
    fn chord_is_near(&self, min: DVec2, max: DVec2, triangles: &[[DVec2; 3]]) -> bool {
        let twice: f64 = triangles
            .iter()
            .map(|[a, b, c]| cross(*b - *a, *c - *a))
            .sum();
        let share = self.share_at(min, max);
        let off = (0.5 * twice - share).abs();
        max - min == DVec2::ONE && off <= BETWEEN_ARC_AND_CHORD * share
    }

    fn are_straight(&self, triangles: &[[DVec2; 3]]) -> bool {
        let mut off = triangles
            .iter()
            .map(|triangle| self.off_of_triangle(triangle));
        off.all(|off| off <= TOLERANCE_WITHIN_PIXEL)
    }

    /// What of a rectangle lies on the inner side of the rim, with a chord in place of it.
    fn inner_triangles(&self, min: DVec2, max: DVec2) -> Vec<[DVec2; 3]> {
        let corners = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)];
        let covered = corners.map(|corner| self.projection.covers(corner));
        let mut polygon: Vec<DVec2> = Vec::new();
        for (k, corner) in corners.into_iter().enumerate() {
            let (next, next_covered) = (corners[(k + 1) % 4], covered[(k + 1) % 4]);
            if covered[k] {
                polygon.push(corner);
            }
            if covered[k] && !next_covered {
                polygon.push(self.rim_between(corner, next));
            } else if !covered[k] && next_covered {
                polygon.push(self.rim_between(next, corner));
            }
        }
        (1..polygon.len().max(2) - 1)
            .map(|k| [polygon[0], polygon[k], polygon[k + 1]])
            .filter(|[a, b, c]| cross(*b - *a, *c - *a) > 0.0)
            .collect()
    }

    /// The last point of the picture on the way from a point in it to one outside.
    fn rim_between(&self, mut inner: DVec2, mut outer: DVec2) -> DVec2 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inner + outer);
            if self.projection.covers(middle) {
                inner = middle;
            } else {
                outer = middle;
            }
        }
        inner
    }

    /// Gives the patches in each pixel at the rim the share of it that belongs to the picture: they have chords in
    /// place of arcs.
    pub fn weigh(&mut self, patches: &mut [Patch]) {
        self.at_rim.sort_unstable();
        for of_pixel in self.at_rim.chunk_by(|a, b| a.0 == b.0) {
            let area: f64 = of_pixel.iter().map(|&(_, row)| patches[row].area()).sum();
            for &(pixel, row) in of_pixel {
                patches[row].share = self.shares[pixel] / area;
            }
        }
    }

    /// Adds a patch to each pixel of which the picture covers so little that no patch was made: what is seen at the
    /// pixel's nearest point to the middle of the lens fills that share.
    pub fn fill_slivers(&mut self, patches: &mut Vec<Patch>) {
        let middle = self.projection.image_from_lens(DVec2::ZERO);
        for pixel in 0..self.shares.len() {
            let share = self.shares[pixel];
            if share <= 0.0 || share >= 1.0 || self.at_rim.iter().any(|rim| rim.0 == pixel) {
                continue;
            }
            let [column, row] = [pixel as u32 % BLOCK, pixel as u32 / BLOCK];
            let corner = DVec2::new(
                f64::from(self.corner[0] + column),
                f64::from(self.corner[1] + row),
            );
            let nearest = middle.clamp(corner, corner + 1.0);
            let inwards = (corner + 0.5 - nearest).signum() * SLIVER;
            let along_x = nearest + DVec2::new(inwards.x, 0.0);
            let along_y = nearest + DVec2::new(0.0, inwards.y);
            let corners = if inwards.x * inwards.y > 0.0 {
                [nearest, along_x, along_y]
            } else {
                [nearest, along_y, along_x]
            };
            let shift = 4.0 * SLIVER * (middle - nearest).normalize_or_zero();
            let directions = corners.map(|corner| self.direction(corner + shift));
            if let Some(patch) = Patch::new(corners, directions) {
                self.at_rim.push((pixel, patches.len()));
                patches.push(patch);
            }
        }
    }
}
