//! Blocks of pixels -> patches in which the lens is straight enough.

use super::Patch;
use super::block::{BLOCK, Block};
use crate::reproject::Projection;
use std::ops::Range;

/// How far from its place anything may be seen, in pixels. Larger would bend lines visibly, smaller makes more
/// patches: their number grows with its inverse.
pub const TOLERANCE: f64 = 1.0 / 64.0;

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
        self.blocks(rows).for_each(|block| block.cut(patches));
    }

    /// Those of them in blocks along the border of the picture, where the outermost directions are seen: within, a
    /// lens sees more on all sides.
    pub fn cut_border(&self, rows: Range<u32>, patches: &mut Vec<Patch>) {
        patches.clear();
        let at_border = self.blocks(rows).filter(Block::is_at_border);
        at_border.for_each(|block| block.cut(patches));
    }

    fn blocks(&self, rows: Range<u32>) -> impl Iterator<Item = Block<'a>> {
        let projection = self.projection;
        lengths(rows).flat_map(move |[top, height]| {
            lengths(0..projection.width)
                .map(move |[left, width]| Block::new(projection, [left, top], [width, height]))
        })
    }
}

/// Cuts a range into lengths that are powers of two, [`BLOCK`] at most: start and length of each.
fn lengths(range: Range<u32>) -> impl Iterator<Item = [u32; 2]> {
    let mut at = range.start;
    std::iter::from_fn(move || {
        let left = range.end - at;
        let length = BLOCK.min(1 << left.checked_ilog2()?);
        at += length;
        Some([at - length, length])
    })
}
