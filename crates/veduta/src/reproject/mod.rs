//! Views of all around -> domes, panoramas and mirror balls.
//!
//! Comes in: views, each a picture with the [`Projection`] by which it was made (faces of a cube, other perspective
//! windows, panoramas, fisheyes). Goes out: one picture by another projection. The steps:
//!
//! 1. `lens`, `orientation`, `projection`: which direction is seen where;

mod lens;
mod names;
mod orientation;
pub mod patches;
mod projection;

pub use lens::{FisheyeLaw, Lens, LensPolynomial, Ray};
pub use names::{LENS_NAMES, LensError};
pub use orientation::{Orientation, dome_from_scene, scene_from_dome};
pub use projection::Projection;
