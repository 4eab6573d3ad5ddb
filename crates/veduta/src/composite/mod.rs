//! Depth compositing: several visibility maps of one camera become one.
//!
//! Nakamae et al. (1989), "Compositing 3D images", merge the spans of a scanline by depth, in three
//! cases: no crossing, a crossing, an overlap. Here the spans are exact fragments with the planes of
//! their faces, and the cases are the signs of the difference of two planes, so that pictures merge
//! exactly, also where surfaces pass through one another. All maps are merged in one pass.
//!
//! - [`merge`]: what is seen of several sets of faces -> what is seen of all of them. What is left of a
//!   face in its own map is clipped by the seen faces of the *other* maps only: what is hidden in its
//!   own map stays hidden. Where no other map has anything, all stays as it is.
//! - [`cover`]: what is seen inside or outside the region that faces cover, whatever the depth.
//! - [`composite`] and [`hold_out`]: the first for stored maps with what is seen of their scenes, which
//!   are united.
//! - [`operate`] and [`lay_on`]: the second for these: the operators of Porter & Duff (1984), "Compositing
//!   digital images", by exact area, and what lies behind everything.
//! - [`see_through`]: a map as if another camera had seen it.
//! - [`composite_spans`]: as the paper does it, for what multiscan found.
//! - [`unite`]: whole scenes as one, for what casts shadows.
//!
//! Maps that something was cut out of go through `pieced` first. Coplanar faces of different maps are
//! decided by the order of their faces: priority of the layer, name of the object, face; whatever the
//! order of the maps.

mod camera;
mod cover;
mod merge;
mod operators;
mod pieced;
mod spans;
mod unite;

pub use camera::{CameraMismatch, see_through};
pub use cover::{Keep, cover};
pub use merge::merge;
pub use operators::{Operator, lay_on, operate};
pub use spans::composite_spans;
pub use unite::{CompositeError, composite, hold_out, unite};
