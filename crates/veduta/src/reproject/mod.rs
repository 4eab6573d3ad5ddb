//! Views of all around -> domes, panoramas and mirror balls.
//!
//! Comes in: views, each a picture with the [`Projection`] by which it was made (faces of a cube, other perspective
//! windows, panoramas, fisheyes). Goes out: one picture by another projection. The steps:
//!
//! 1. `lens`, `orientation`, `projection`: which direction is seen where; `names` of lenses;
//! 2. `mapping`, `tiles`: where each pixel lies in which view, as polynomials in tiles of the picture
//!    ([`Reprojection`]);
//! 3. `views`, `aprons`: the views' pictures, continued beyond their borders by their neighbours ([`Views`]);
//! 4. `run`: the filter, eight pixels at once.
//!
//! Steps 1 and 2 do not look at pictures, so that what is needed of which view is known before any is read, and further
//! frames of a sequence need steps 3 and 4 only. The filter is that of Greene & Heckbert (1986), in
//! [`filter::ewa`](crate::filter::ewa).

mod aprons;
pub mod cube;
mod lens;
mod mapping;
mod names;
mod orientation;
mod parts;
pub mod patches;
mod pixels;
mod polynomial;
mod projection;
mod reprojection;
mod run;
mod tiles;
mod views;

pub use lens::{FisheyeLaw, Lens, LensPolynomial, Ray};
pub use names::{LENS_NAMES, LensError};
pub use orientation::{Orientation, dome_from_scene, scene_from_dome};
pub use projection::Projection;
pub use reprojection::{Missing, Need, Reprojection, reproject};
pub use views::Views;
