//! The cube around a viewer: its six sides, and how people lay them into pictures.
//!
//! - `side`: the sides, their names, and where they look;
//! - `turn`: the ways in which the picture of a side can lie;
//! - `layout`: where sides lie in one picture.

mod layout;
mod side;
mod turn;

pub use layout::{Cell, Layout, LayoutError, ShapeError, Spacing, USUAL_ORDER, sides_of, turns_of};
pub use side::Side;
pub use turn::Turn;
