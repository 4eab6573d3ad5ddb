//! A lens made of small perspective pictures, so that regions stay regions under it.
//!
//! A lens bends lines, and a bent fragment is no polygon. So the picture is cut into small triangles, *patches*, and
//! within each the lens is replaced by a perspective that sees the same directions at the three corners and, as far as one
//! can, in the middles of its sides: in between, directions are mixed linearly. Lines stay lines in a patch, fragments stay convex polygons, and their areas
//! in pixels are exact. How far the replacement is off is measured in pixels, and a patch that is off by more than
//! [`TOLERANCE`] is cut again.
//!
//! Two things come for nothing. Patches partition the *picture*, and a patch that looks at what a map covers is
//! covered wholly: no gap can open between two patches, whatever their sizes, nor in a pole, where a row of pixels
//! sees a single direction. And a patch mixes directions, not points of any view: where it looks at two sides of a
//! cube, what the one shows ends in the very line in which the other begins, since directions on the border
//! between sides are the same numbers in both. So there are no seams to hide.
//!
//! Comes in: a [`Projection`]. Goes out: the [`Patch`]es of a band of its picture. Steps:
//!
//! 1. `subdivide`: `block`s of pixels are halved into `cell`s until the lens is straight enough in them, and follow the
//!    `rim` of round lenses;
//! 2. `patch`: a triangle with its perspective;
//! 3. `views`: the frames through which the eye looks, any perspective cameras that stand in it; `sides`: those of a
//!    cube around it, as far as patches look at them; `regions`: which frame shows what where several do.
//!
//! [`Projection`]: super::Projection

mod block;
mod cell;
mod patch;
mod regions;
mod rim;
mod sides;
mod subdivide;
mod views;

pub use patch::Patch;
pub use regions::{Region, regions};
pub use sides::{SideView, side_views};
pub use subdivide::{Subdivision, TOLERANCE};
pub use views::{View, ViewError};
