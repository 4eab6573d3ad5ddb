//! Pictures of the sphere around a viewer, as people and programs store them.
//!
//! - `side`: the sides of a cube, and the ways in which a square picture can lie; `file_names`: which side a
//!   file shows; `layout`: where sides lie in one picture.
//! - `gpano`: what photographs tell of themselves as panoramas, and [`Panorama`], what any file tells.

mod file_names;
#[cfg(feature = "xmp")]
mod gpano;
mod layout;
mod pose;
mod side;

pub use file_names::{NamesError, sides_by_names};
#[cfg(feature = "xmp")]
pub use gpano::Gpano;
pub use layout::{Cell, Layout, LayoutError, ShapeError, Spacing, USUAL_ORDER, sides_of, turns_of};
pub use pose::Pose;
pub use side::{Side, Turn};

/// What a file tells of its picture as one of a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Panorama {
    /// PNG and JPEG: an equirectangular picture, or a part of one.
    #[cfg(feature = "xmp")]
    Gpano(Gpano),
    /// OpenEXR: `envmap` by latitude and longitude. The front is along +z and in the middle, +x to the left
    /// of it; the centres of the outermost pixels lie on the poles and on the line behind the viewer, which
    /// both the first and the last column show.
    ExrLatLong {
        /// How the camera stands, for `worldToCamera`; not read.
        pose: Pose,
    },
    /// OpenEXR: `envmap` of six sides, in the layout `exr`.
    ExrCube,
}
