//! Vectors, planes, clipping and exact areas. Knows nothing of scenes, faces or pictures.
//!
//! The image plane has x to the right and y downwards. A polygon is *positively wound* when its
//! signed area [`signed_area`] is positive, which on the screen looks clockwise.

pub use glam::{DMat3, DMat4, DQuat, DVec2, DVec3, DVec4, Vec2, Vec3, Vec4};

mod affine;
mod convex;
mod grid_area;
mod grid_moments;

pub use affine::Affine;
pub use convex::{cross, signed_area};
pub use grid_area::{CellArea, Cells, GridAreas};
pub use grid_moments::{CellMoments, GridMoments};
