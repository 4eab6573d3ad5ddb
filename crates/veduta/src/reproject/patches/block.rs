//! A block of pixels, halved until the lens is straight enough in each cell.

use super::cell::{Cell, off_at};
use super::{Patch, TOLERANCE};
use crate::reproject::Projection;
use std::ops::Range;
use veduta_geometry::{DVec2, DVec3};

/// The same as [`TOLERANCE`] in patches within a pixel, in which several of them add up: all are right at their corners,
/// and off to either side between. Poles and the rims of balls need most of these.
pub(super) const TOLERANCE_WITHIN_PIXEL: f64 = 1.0 / 16.0;

/// In patches up to this size several of them average in a pixel, so that its scale matters no more; in pixels.
const STRAIGHT_ENOUGH_SIDE: f64 = 0.5;

/// How much the scale of a larger patch may be off, and with it the brightness of wires; on average it is right. Where a lens
/// stretches what it shows, as panoramas do towards their poles, it may be off by as much more.
const SCALE_TOLERANCE: f64 = 1.0 / 150.0;

/// Sides below this are not halved any more, in pixels: two patches of this size side by side show nothing farther from
/// its place than [`TOLERANCE_WITHIN_PIXEL`].
pub(super) const LEAST_SIDE: f64 = 1.0 / 32.0;

/// Size of the patches at a pole that fills a side, across and along that side, in pixels: there one direction is
/// seen in all of the side, so that only thin ones are right. Larger would smear what is at the pole;
/// smaller makes more patches where hardly anything is seen.
const POLE_SIDES: [f64; 2] = [1.0 / 64.0, 0.5];

/// Side of the blocks that subdivision begins with, in pixels. A power of two.
pub(super) const BLOCK: u32 = 16;

/// What rounding may take from the share of a whole pixel. Larger would overlook the rim.
const ROUNDING: f64 = 1e-12;

/// Of two ways the second is taken only if it is better than the first by this factor, since most lenses are
/// symmetric, and rounding is not to decide.
const CLEARLY: f64 = 0.99;

/// How far corners of a patch at a pole are moved towards its middle, so that their directions differ.
const AWAY_FROM_POLE: f64 = 1.0 / 8.0;

/// What of a region belongs to the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Inside {
    All,
    Some,
    None,
}

/// A block of pixels.
pub(super) struct Block<'a> {
    pub projection: &'a Projection,
    pub corner: [u32; 2],
    size: [u32; 2],
    /// Whether the picture fills the block and the pixels around it, as far as its lens goes.
    is_within: bool,
    /// Share of each pixel that belongs to the picture.
    pub shares: [f64; (BLOCK * BLOCK) as usize],
    /// Patches in pixels that the rim passes through: pixel of the block, and row of the patches.
    pub at_rim: Vec<(usize, usize)>,
}

impl<'a> Block<'a> {
    pub fn new(projection: &'a Projection, corner: [u32; 2], size: [u32; 2]) -> Self {
        let min = DVec2::from(corner.map(f64::from));
        let max = min + DVec2::from(size.map(f64::from));
        // With the pixels around it.
        let is_within = projection.fills(min - 1.0, max + 1.0);
        let mut shares = [f64::from(is_within); (BLOCK * BLOCK) as usize];
        if !is_within {
            for row in 0..size[1] {
                for column in 0..size[0] {
                    let share = share_of(projection, corner[0] + column, corner[1] + row);
                    shares[(row * BLOCK + column) as usize] = share;
                }
            }
        }
        Self {
            projection,
            corner,
            size,
            is_within,
            shares,
            at_rim: Vec::new(),
        }
    }

    /// Whether the picture may end in the block or beside it.
    pub fn is_at_border(&self) -> bool {
        let frame = [self.projection.width, self.projection.height];
        let at_frame = |axis: usize| {
            self.corner[axis] == 0 || self.corner[axis] + self.size[axis] == frame[axis]
        };
        !self.is_within || at_frame(0) || at_frame(1)
    }

    pub fn cut(mut self, patches: &mut Vec<Patch>) {
        let min = DVec2::from(self.corner.map(f64::from));
        let max = min + DVec2::from(self.size.map(f64::from));
        self.divide(min, max, patches);
        if self.at_rim.is_empty() && self.shares.iter().all(|share| share.fract() == 0.0) {
            return;
        }
        self.fill_slivers(patches);
        self.weigh(patches);
    }

    /// The pixels of the block that a rectangle touches: columns and rows.
    pub fn pixels(&self, min: DVec2, max: DVec2) -> [Range<u32>; 2] {
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

    /// Direction at a point, in eye space; not a number where the lens's law ends.
    pub fn direction(&self, point: DVec2) -> DVec3 {
        match self.projection.direction(point) {
            Some(world) => DVec3::new(world.x, -world.y, -world.z),
            None => DVec3::NAN,
        }
    }

    pub fn cell(&self, min: DVec2, max: DVec2) -> Cell {
        Cell::new(min, max, |point| self.direction(point))
    }

    /// Cuts what of a rectangle of pixels belongs to the picture.
    fn divide(&mut self, min: DVec2, max: DVec2, patches: &mut Vec<Patch>) {
        let [columns, rows] = self.pixels(min, max).map(|pixels| pixels.len());
        match self.inside(min, max) {
            Inside::None => {}
            Inside::All => self.cut_straight(&self.cell(min, max), patches),
            Inside::Some if columns * rows > 1 => {
                let axis = usize::from(rows > columns);
                let middle = 0.5 * (min[axis] + max[axis]);
                let (mut first_max, mut second_min) = (max, min);
                first_max[axis] = middle;
                second_min[axis] = middle;
                self.divide(min, first_max, patches);
                self.divide(second_min, max, patches);
            }
            Inside::Some => self.divide_at_rim(min, max, patches),
        }
    }

    /// Makes two patches of a cell if the lens is straight enough in it, else divides it.
    pub fn cut_straight(&mut self, cell: &Cell, patches: &mut Vec<Patch>) {
        let size = cell.max - cell.min;
        if let Some(across) = cell.pole() {
            // A pole is infinitely far off either way.
            let along = 1 - across;
            let axis = match size[across] > POLE_SIDES[0] {
                true => across,
                false => along,
            };
            if axis == across || size[along] > POLE_SIDES[1] {
                return self.divide_along(cell, axis, patches);
            }
            return self.push_both(cell, false, patches);
        }
        self.finish(cell, &Made::of(cell), patches);
    }

    /// Adds the patches of a cell without pole if they will do, else divides it.
    fn finish(&mut self, cell: &Cell, made: &Made, patches: &mut Vec<Patch>) {
        let size = cell.max - cell.min;
        let can_halve = [0, 1].map(|axis| size[axis] > LEAST_SIDE);
        match can_halve {
            _ if made.excess <= 1.0 => self.push_both(cell, made.falling, patches),
            [false, false] => self.push_both(cell, made.falling, patches),
            [true, true] if made.excess.is_finite() => self.divide_as_is_better(cell, patches),
            [true, true] => self.divide_along(cell, usize::from(size.y > size.x), patches),
            [x, _] => self.divide_along(cell, usize::from(!x), patches),
        }
    }

    /// Halves a cell along the axis after which it is less off: thin cells are needed where one direction fills a row.
    fn divide_as_is_better(&mut self, cell: &Cell, patches: &mut Vec<Patch>) {
        let [along_x, along_y] = [0, 1].map(|axis| {
            let halves = cell.halves(axis, |point| self.direction(point));
            let made = halves.each_ref().map(Made::of);
            (halves, made)
        });
        let excess = |[a, b]: &[Made; 2]| a.excess.max(b.excess);
        let (x, y) = (excess(&along_x.1), excess(&along_y.1));
        let size = cell.max - cell.min;
        // Of equals, the longer side.
        let halves_y = match size.y > size.x {
            true => y * CLEARLY <= x,
            false => y < x * CLEARLY,
        };
        let (halves, made) = if halves_y { along_y } else { along_x };
        for (half, made) in halves.iter().zip(&made) {
            self.finish(half, made, patches);
        }
    }

    fn divide_along(&mut self, cell: &Cell, axis: usize, patches: &mut Vec<Patch>) {
        for half in cell.halves(axis, |point| self.direction(point)) {
            self.cut_straight(&half, patches);
        }
    }

    fn push_both(&mut self, cell: &Cell, falling: bool, patches: &mut Vec<Patch>) {
        for (corners, patch) in cell.patches(falling) {
            match patch {
                Some(patch) => self.put(patch, patches),
                None => self.push(corners, patches),
            }
        }
    }

    /// How far any triangle is off, in pixels.
    pub fn off_of_triangle(&self, corners: &[DVec2; 3]) -> f64 {
        let directions = corners.map(|corner| self.direction(corner));
        let Some(patch) = Patch::new(*corners, directions) else {
            return f64::INFINITY;
        };
        let middles = (0..3).map(|k| 0.5 * (corners[k] + corners[(k + 1) % 3]));
        let off = middles.map(|middle| off_at(&patch, self.direction(middle), middle));
        off.fold(0.0, f64::max)
    }

    /// Adds the patch of a triangle. Where the directions of its corners lie on a line (at a pole) they are taken
    /// from nearer to its middle.
    pub fn push(&mut self, corners: [DVec2; 3], patches: &mut Vec<Patch>) {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let nearer = || corners.map(|corner| corner + (middle - corner) * AWAY_FROM_POLE);
        let patch_of = |points: [DVec2; 3]| Patch::new(corners, points.map(|p| self.direction(p)));
        if let Some(patch) = patch_of(corners).or_else(|| patch_of(nearer())) {
            self.put(patch, patches);
        }
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
}

/// The patches of a cell: along which diagonal it is cut.
#[derive(Clone, Copy)]
struct Made {
    falling: bool,
    /// How far they are off, as a share of what they may be.
    excess: f64,
}

impl Made {
    /// The better of the two ways to cut a cell, the first if it will do.
    fn of(cell: &Cell) -> Self {
        let size = cell.max - cell.min;
        let side = size.max_element();
        let tolerance = if side < 1.0 {
            TOLERANCE_WITHIN_PIXEL
        } else {
            TOLERANCE
        };
        let scale_tolerance = match side > STRAIGHT_ENOUGH_SIDE {
            true => SCALE_TOLERANCE * cell.stretch(),
            false => f64::INFINITY,
        };
        let made = |falling| {
            let [off, scale_off] = cell.off(falling);
            let excess = (off / tolerance).max(scale_off / scale_tolerance);
            let excess = if excess.is_nan() {
                f64::INFINITY
            } else {
                excess
            };
            Self { falling, excess }
        };
        let rising = made(false);
        if rising.excess <= 1.0 {
            return rising;
        }
        let falling = made(true);
        match falling.excess < CLEARLY * rising.excess {
            true => falling,
            false => rising,
        }
    }
}

/// Share of a pixel that belongs to the picture. Where the lens's centre lies between pixels, a whole pixel is one but
/// for rounding.
fn share_of(projection: &Projection, column: u32, row: u32) -> f64 {
    let share = projection.coverage(column, row);
    if share > 1.0 - ROUNDING { 1.0 } else { share }
}
