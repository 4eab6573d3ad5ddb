//! Blocks of pixels -> patches in which the lens is straight enough.

use super::Patch;
use crate::reproject::Projection;
use std::ops::Range;
use veduta_geometry::{DVec2, DVec3, cross};

/// How far from its place anything may be seen, in pixels. Larger would bend lines visibly, smaller makes more
/// patches: their number grows with its inverse.
pub const TOLERANCE: f64 = 1.0 / 64.0;

/// The same in patches within a pixel, in which several of them add up: all are right at their corners, and off to
/// either side between. Poles and the rims of balls need most of these.
const TOLERANCE_WITHIN_PIXEL: f64 = 1.0 / 16.0;

/// In patches up to this size several of them average in a pixel, so that its scale matters no more; in pixels.
const STRAIGHT_ENOUGH_SIDE: f64 = 0.5;

/// How far from its place anything may be seen in a larger patch, by the patch's size. The local scale
/// is off by up to sixteen times as much in a corner of a patch, and with it the brightness of wires; on average it is right.
/// Where a lens stretches what it shows, as panoramas do towards their poles, it may be off by as much more.
const LEAST_STRAIGHTNESS: f64 = 1.0 / 1600.0;

/// An arc of angle t whose directions are mixed linearly is right in its middle, and off by about 0.021 t^3 at its
/// quarters; the lens itself may add as much again. Larger makes more patches in small pictures, in others
/// nothing; smaller would let patches that look at a large part of the sphere pass for straight.
const THIRD_ORDER: f64 = 0.05;

/// Sides below this are not halved any more, in pixels. Smaller would only change what poles and rims look like
/// within a pixel.
const LEAST_SIDE: f64 = 1.0 / 64.0;

/// Side of the blocks that subdivision begins with, in pixels. A power of two.
const BLOCK: u32 = 16;

/// Patches along the rim are at most this long, in pixels: between a chord and its arc lies a millionth of a pixel in
/// a picture of 1000 pixels.
const RIM_SIDE: f64 = 0.25;

/// What rounding may take from the share of a whole pixel. Larger would overlook the rim.
const ROUNDING: f64 = 1e-12;

/// The rim is not looked for more finely where it cuts off less than this of a pixel.
const LEAST_SHARE: f64 = 1e-3;

/// Of two ways the second is taken only if it is better than the first by this factor, since most lenses are
/// symmetric, and rounding is not to decide.
const CLEARLY: f64 = 0.99;

/// How often the rim is looked for between two points of an edge: to the last bits of a pixel.
const HALVINGS: u32 = 45;

/// Side of the patch in a pixel of which the rim leaves too little to follow, in pixels.
const SLIVER: f64 = 1e-3;

/// How far corners of a patch at a pole are moved towards its middle, so that their directions differ.
const AWAY_FROM_POLE: f64 = 1.0 / 8.0;

/// Cuts the picture of a lens into patches.
#[derive(Clone, Copy, Debug)]
pub struct Subdivision<'a> {
    projection: &'a Projection,
}

impl<'a> Subdivision<'a> {
    /// Of the picture of `projection`, whose world is that of the eye: right, up and backwards.
    pub fn new(projection: &'a Projection) -> Self {
        Self { projection }
    }

    /// The patches of some rows, in a fixed order; `patches` is overwritten.
    ///
    /// They fill each pixel that the lens fills, and no patch reaches over a border of `rows`.
    pub fn cut(&self, rows: Range<u32>, patches: &mut Vec<Patch>) {
        patches.clear();
        for [top, height] in blocks(rows) {
            for [left, width] in blocks(0..self.projection.width) {
                Block::new(self.projection, [left, top], [width, height]).cut(patches);
            }
        }
    }
}

/// Cuts a range into lengths that are powers of two, [`BLOCK`] at most: start and length of each.
fn blocks(range: Range<u32>) -> impl Iterator<Item = [u32; 2]> {
    let mut at = range.start;
    std::iter::from_fn(move || {
        let left = range.end - at;
        let length = BLOCK.min(1 << left.checked_ilog2()?);
        at += length;
        Some([at - length, length])
    })
}

/// What of a region belongs to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Inside {
    All,
    Some,
    None,
}

/// A block of pixels.
struct Block<'a> {
    projection: &'a Projection,
    corner: [u32; 2],
    size: [u32; 2],
    /// Share of each pixel that belongs to the picture.
    shares: [f64; (BLOCK * BLOCK) as usize],
    /// Patches in pixels that the rim passes through: pixel of the block, and row of the patches.
    at_rim: Vec<(usize, usize)>,
}

/// A rectangle with the directions of its corners, the middles of its sides, and its middle; rows from the top.
#[derive(Clone, Copy)]
struct Cell {
    min: DVec2,
    max: DVec2,
    directions: [[Option<DVec3>; 3]; 3],
}

/// How far the patches of a cell are off, in pixels: along x, along y, and in the middle.
#[derive(Clone, Copy)]
struct Off {
    along_x: f64,
    along_y: f64,
    middle: f64,
}

/// A cell cut along a diagonal.
struct TwoPatches {
    /// Corners, and the patch unless its directions lie on a line.
    triangles: [([DVec2; 3], Option<Patch>); 2],
    off: Off,
}

impl<'a> Block<'a> {
    fn new(projection: &'a Projection, corner: [u32; 2], size: [u32; 2]) -> Self {
        let mut shares = [0.0; (BLOCK * BLOCK) as usize];
        for row in 0..size[1] {
            for column in 0..size[0] {
                let share = projection.coverage(corner[0] + column, corner[1] + row);
                // Where the lens's centre lies between pixels, a whole pixel is one but for rounding.
                let share = if share > 1.0 - ROUNDING { 1.0 } else { share };
                shares[(row * BLOCK + column) as usize] = share;
            }
        }
        Self {
            projection,
            corner,
            size,
            shares,
            at_rim: Vec::new(),
        }
    }

    fn cut(mut self, patches: &mut Vec<Patch>) {
        let min = DVec2::from(self.corner.map(f64::from));
        let max = min + DVec2::from(self.size.map(f64::from));
        if self.inside(min, max) != Inside::None {
            let cell = self.cell(min, max);
            self.divide(cell, patches);
        }
        if self.at_rim.is_empty() && self.shares.iter().all(|share| share.fract() == 0.0) {
            return;
        }
        self.fill_slivers(patches);
        self.weigh(patches);
    }

    /// The pixels of the block that a rectangle touches: columns and rows.
    fn pixels(&self, min: DVec2, max: DVec2) -> [Range<u32>; 2] {
        [0, 1].map(|axis| {
            let first = min[axis].floor() as u32 - self.corner[axis];
            let end = max[axis].ceil() as u32 - self.corner[axis];
            first..end
        })
    }

    /// What of a rectangle's pixels belongs to the picture.
    fn inside(&self, min: DVec2, max: DVec2) -> Inside {
        let [columns, rows] = self.pixels(min, max);
        let mut all = true;
        let mut none = true;
        for row in rows {
            for column in columns.clone() {
                let share = self.shares[(row * BLOCK + column) as usize];
                all &= share >= 1.0;
                none &= share <= 0.0;
            }
        }
        match (all, none) {
            (true, _) => Inside::All,
            (_, true) => Inside::None,
            _ => Inside::Some,
        }
    }

    /// Direction at a point, in eye space.
    fn direction(&self, point: DVec2) -> Option<DVec3> {
        let world = self.projection.direction(point)?;
        Some(DVec3::new(world.x, -world.y, -world.z))
    }

    fn cell(&self, min: DVec2, max: DVec2) -> Cell {
        let mut cell = Cell {
            min,
            max,
            directions: [[None; 3]; 3],
        };
        for (j, row) in [0, 1, 2].into_iter().enumerate() {
            for i in 0..3 {
                cell.directions[row][i] = self.direction(cell.point(i, j));
            }
        }
        cell
    }

    /// The two halves of a cell; the directions that it has are not asked for again.
    fn halves(&self, cell: &Cell, axis: usize) -> [Cell; 2] {
        let middle = 0.5 * (cell.min[axis] + cell.max[axis]);
        [0, 1].map(|half| {
            let mut part = *cell;
            if half == 0 {
                part.max[axis] = middle;
            } else {
                part.min[axis] = middle;
            }
            for across in 0..3 {
                for along in 0..3 {
                    // Of the cell's own three, the half has two at its ends.
                    let known = (along != 1).then_some(half + along / 2);
                    let (i, j) = if axis == 0 {
                        (along, across)
                    } else {
                        (across, along)
                    };
                    part.directions[j][i] = match known {
                        Some(at) if axis == 0 => cell.directions[j][at],
                        Some(at) => cell.directions[at][i],
                        None => self.direction(part.point(i, j)),
                    };
                }
            }
            part
        })
    }

    fn divide(&mut self, cell: Cell, patches: &mut Vec<Patch>) {
        let size = cell.max - cell.min;
        let [columns, rows] = self.pixels(cell.min, cell.max).map(|pixels| pixels.len());
        let inside = match self.inside(cell.min, cell.max) {
            Inside::None => return,
            Inside::Some if columns * rows > 1 => {
                let axis = usize::from(rows > columns);
                return self.divide_along(&cell, axis, patches);
            }
            Inside::Some => self.inside_of_pixel(&cell),
            Inside::All => Inside::All,
        };
        let longer = usize::from(size.y > size.x);
        let rim_side = RIM_SIDE.min(0.5 * self.least_chord(&cell));
        match inside {
            Inside::None if size[longer] <= rim_side => {}
            Inside::Some if size[longer] <= rim_side.max(LEAST_SIDE) => {
                self.cut_at_rim(&cell, longer, patches);
            }
            Inside::None | Inside::Some => self.divide_along(&cell, longer, patches),
            Inside::All => self.cut_straight(&cell, longer, patches),
        }
    }

    fn divide_along(&mut self, cell: &Cell, axis: usize, patches: &mut Vec<Patch>) {
        for half in self.halves(cell, axis) {
            self.divide(half, patches);
        }
    }

    /// Whether the nine points of a cell, in a pixel that the rim passes through, belong to the picture.
    fn inside_of_pixel(&self, cell: &Cell) -> Inside {
        let covered = (0..9)
            .filter(|k| self.projection.covers(cell.point(k % 3, k / 3)))
            .count();
        match covered {
            0 => Inside::None,
            9 => Inside::All,
            _ => Inside::Some,
        }
    }

    /// About how long the rim is in the pixel of a cell, if it cuts off a corner or a side only.
    fn least_chord(&self, cell: &Cell) -> f64 {
        let [columns, rows] = self.pixels(cell.min, cell.max);
        let share = self.shares[(rows.start * BLOCK + columns.start) as usize];
        share.min(1.0 - share).max(LEAST_SHARE).sqrt()
    }

    /// Makes two patches of a cell if the lens is straight enough in it, else divides it.
    fn cut_straight(&mut self, cell: &Cell, longer: usize, patches: &mut Vec<Patch>) {
        let side = (cell.max - cell.min)[longer];
        let mut tolerance = if side < 1.0 {
            TOLERANCE_WITHIN_PIXEL
        } else {
            TOLERANCE
        };
        if side > STRAIGHT_ENOUGH_SIDE {
            tolerance = tolerance.min(LEAST_STRAIGHTNESS * cell.stretch() * side);
        }
        let mut made = cell.two_patches(false);
        let sides = made.off.along_x.max(made.off.along_y);
        // The sides are the same whichever the diagonal.
        if sides <= tolerance && made.off.middle > tolerance {
            made = cell.two_patches(true);
        }
        if sides.max(made.off.middle) <= tolerance {
            return self.push_both(&made, patches);
        }
        // A pole is infinitely far off either way.
        let axis = if sides <= tolerance || sides.is_infinite() {
            longer
        } else {
            usize::from(made.off.along_x < CLEARLY * made.off.along_y)
        };
        // A short side is left as it is when the other one may still help.
        let axis = if (cell.max - cell.min)[axis] <= LEAST_SIDE {
            1 - axis
        } else {
            axis
        };
        if (cell.max - cell.min)[axis] <= LEAST_SIDE {
            return self.push_both(&made, patches);
        }
        self.divide_along(cell, axis, patches);
    }

    /// Makes patches of what of a small cell lies on the inner side of the rim.
    fn cut_at_rim(&mut self, cell: &Cell, longer: usize, patches: &mut Vec<Patch>) {
        let corners = [(0, 0), (2, 0), (2, 2), (0, 2)].map(|(i, j)| cell.point(i, j));
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
        if polygon.len() < 3 {
            return;
        }
        let triangles: Vec<[DVec2; 3]> = (1..polygon.len() - 1)
            .map(|k| [polygon[0], polygon[k], polygon[k + 1]])
            .filter(|[a, b, c]| cross(*b - *a, *c - *a) > 0.0)
            .collect();
        let side = (cell.max - cell.min)[longer];
        let off = |triangle: &[DVec2; 3]| self.off_of_triangle(triangle);
        if side > LEAST_SIDE
            && triangles.iter().map(off).fold(0.0, f64::max) > TOLERANCE_WITHIN_PIXEL
        {
            return self.divide_along(cell, longer, patches);
        }
        for triangle in triangles {
            self.push(triangle, patches);
        }
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

    /// How far any triangle is off, in pixels.
    fn off_of_triangle(&self, corners: &[DVec2; 3]) -> f64 {
        let directions = corners.map(|corner| self.direction(corner));
        let [Some(a), Some(b), Some(c)] = directions else {
            return f64::INFINITY;
        };
        let Some(patch) = Patch::new(*corners, [a, b, c]) else {
            return f64::INFINITY;
        };
        let middles = (0..3).map(|k| 0.5 * (corners[k] + corners[(k + 1) % 3]));
        let off = middles.map(|middle| match self.direction(middle) {
            Some(direction) => distance(&patch, direction, middle),
            None => f64::INFINITY,
        });
        off.fold(0.0, f64::max)
    }

    fn push_both(&mut self, made: &TwoPatches, patches: &mut Vec<Patch>) {
        for (corners, patch) in &made.triangles {
            match patch {
                Some(patch) => self.put(*patch, patches),
                None => self.push(*corners, patches),
            }
        }
    }

    /// Adds the patch of a triangle. Where the directions of its corners lie on a line (at a pole) they are taken
    /// from nearer to its middle.
    fn push(&mut self, corners: [DVec2; 3], patches: &mut Vec<Patch>) {
        let directions_at = |points: [DVec2; 3]| match points.map(|p| self.direction(p)) {
            [Some(a), Some(b), Some(c)] => Some([a, b, c]),
            _ => None,
        };
        let patch_of = |points| Patch::new(corners, directions_at(points)?);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let nearer = || corners.map(|corner| corner + (middle - corner) * AWAY_FROM_POLE);
        let Some(patch) = patch_of(corners).or_else(|| patch_of(nearer())) else {
            return;
        };
        self.put(patch, patches);
    }

    /// Adds a patch.
    fn put(&mut self, patch: Patch, patches: &mut Vec<Patch>) {
        let [a, b, c] = *patch.corners();
        let [columns, rows] = self.pixels(a.min(b).min(c), a.max(b).max(c));
        let pixel = (rows.start * BLOCK + columns.start) as usize;
        if columns.len() * rows.len() == 1 && self.shares[pixel] < 1.0 {
            self.at_rim.push((pixel, patches.len()));
        }
        patches.push(patch);
    }

    /// Gives the patches in each pixel at the rim the share of it that belongs to the picture: they have chords in
    /// place of arcs.
    fn weigh(&mut self, patches: &mut [Patch]) {
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
    fn fill_slivers(&mut self, patches: &mut Vec<Patch>) {
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
            if let [Some(a), Some(b), Some(c)] = directions
                && let Some(patch) = Patch::new(corners, [a, b, c])
            {
                self.at_rim.push((pixel, patches.len()));
                patches.push(patch);
            }
        }
    }
}

impl Cell {
    /// A corner, or a middle: column and row from 0 to 2.
    fn point(&self, column: usize, row: usize) -> DVec2 {
        let along = |axis: usize, step: usize| match step {
            0 => self.min[axis],
            1 => 0.5 * (self.min[axis] + self.max[axis]),
            _ => self.max[axis],
        };
        DVec2::new(along(0, column), along(1, row))
    }

    /// The cell cut along a diagonal, falling (from the top left) or rising, and how far it is off.
    fn two_patches(&self, falling: bool) -> TwoPatches {
        // Corners by column and row; the diagonal leads from the first to the last of each.
        let triangles = if falling {
            [[(0, 0), (2, 0), (2, 2)], [(2, 2), (0, 2), (0, 0)]]
        } else {
            [[(2, 0), (2, 2), (0, 2)], [(0, 2), (0, 0), (2, 0)]]
        };
        let mut off = Off {
            along_x: 0.0,
            along_y: 0.0,
            middle: 0.0,
        };
        let triangles = triangles.map(|corners| {
            let points = corners.map(|(i, j)| self.point(i, j));
            let directions = corners.map(|(i, j)| self.directions[j][i]);
            let patch = match directions {
                [Some(a), Some(b), Some(c)] => Patch::new(points, [a, b, c]),
                _ => None,
            };
            for (k, (i, j)) in corners.into_iter().enumerate() {
                let (next_i, next_j) = corners[(k + 1) % 3];
                let between = ((i + next_i) / 2, (j + next_j) / 2);
                let here = self.off_at(patch.as_ref(), between)
                    + self.off_beside_middle((i, j), (next_i, next_j));
                let worst = match (i == next_i, j == next_j) {
                    (false, true) => &mut off.along_x,
                    (true, false) => &mut off.along_y,
                    _ => &mut off.middle,
                };
                *worst = worst.max(here);
            }
            (points, patch)
        });
        TwoPatches { triangles, off }
    }

    /// How much longer than wide a small round thing is shown.
    fn stretch(&self) -> f64 {
        let size = self.max - self.min;
        let along = |ends: [Option<DVec3>; 2], length: f64| match ends {
            [Some(a), Some(b)] => (b - a) / length,
            _ => DVec3::ZERO,
        };
        let x = along([self.directions[1][0], self.directions[1][2]], size.x);
        let y = along([self.directions[0][1], self.directions[2][1]], size.y);
        // The ratio of the singular values of the two, as columns.
        let (xx, yy, xy) = (x.length_squared(), y.length_squared(), x.dot(y));
        let (mean, difference) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let root = difference.hypot(xy);
        let stretch = ((mean + root) / (mean - root)).sqrt();
        if stretch.is_finite() { stretch } else { 1.0 }
    }

    /// How far a patch may be off between the end of a side and its middle while it is right in the middle, which
    /// is what symmetry does.
    fn off_beside_middle(&self, from: (usize, usize), to: (usize, usize)) -> f64 {
        let [a, b] = [from, to].map(|(i, j)| self.directions[j][i]);
        let (Some(a), Some(b)) = (a, b) else {
            return f64::INFINITY;
        };
        let length = (self.point(from.0, from.1) - self.point(to.0, to.1)).length();
        THIRD_ORDER * (b - a).length_squared() * length
    }

    /// How far from its place in pixels a patch shows the direction of a point of the cell.
    fn off_at(&self, patch: Option<&Patch>, (column, row): (usize, usize)) -> f64 {
        match (patch, self.directions[row][column]) {
            (Some(patch), Some(direction)) => distance(patch, direction, self.point(column, row)),
            _ => f64::INFINITY,
        }
    }
}

/// How far from `point` a patch shows what is seen there.
fn distance(patch: &Patch, direction: DVec3, point: DVec2) -> f64 {
    let weights = patch.weights(direction);
    if weights.element_sum() <= 0.0 {
        return f64::INFINITY;
    }
    let off = (patch.point(weights) - point).length();
    if off.is_nan() { f64::INFINITY } else { off }
}
