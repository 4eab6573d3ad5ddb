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
//! - [`composite`]: the same for stored maps with what is seen of their scenes, which are united.
//! - [`hold_out`]: less what is seen of maps that only hide.
//! - [`composite_spans`]: as the paper does it, for what multiscan found.
//! - [`unite`]: whole scenes as one, for what casts shadows.
//!
//! Coplanar faces of different maps are decided by the order of their faces: priority of the layer,
//! name of the object, face; whatever the order of the maps.

mod merge;
mod spans;
mod unite;

pub use merge::merge;
pub use spans::composite_spans;
pub use unite::{CompositeError, composite, hold_out, unite};
