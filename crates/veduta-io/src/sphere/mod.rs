//! Pictures of the sphere around a viewer, as people and programs store them.
//!
//! - `file_names`: which side of a cube ([`veduta::reproject::cube`]) a file shows.
//! - `views`: pictures of files -> views, each with what it sees where; `borders`: whether sides fit together.
//! - `test_card`, `guides` (both of `letters`): pictures to try conventions and projectors on.
//! - `gpano`: what photographs tell of themselves as panoramas, and [`Panorama`], what any file tells.

mod borders;
mod file_names;
#[cfg(feature = "xmp")]
mod gpano;
mod guides;
mod letters;
mod test_card;
mod views;

pub use borders::{Change, Fit, fit};
pub use file_names::{NamesError, sides_by_names};
#[cfg(feature = "xmp")]
pub use gpano::{Gpano, Pose};
pub use guides::{Guide, draw_guides, mask};
pub use test_card::test_card;
pub use views::{
    SideForm, View, ViewsError, finest_pixel, one_lens, side_projection, sides_in_files,
    sides_in_layout, two_discs,
};

#[cfg(feature = "xmp")]
use veduta::reproject::Lens;
use veduta::reproject::Orientation;

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
        orientation: Orientation,
    },
    /// OpenEXR: `envmap` of six sides, in the layout `exr`.
    ExrCube,
}

#[cfg(feature = "xmp")]
impl Panorama {
    /// What a picture of `size` by a lens tells of itself: one of all around that is twice as wide as high is GPano's.
    /// (Viewers stretch others to that shape.)
    pub fn of_lens(lens: Lens, [width, height]: [u32; 2]) -> Option<Self> {
        let is_whole = lens == Lens::Equirect && u64::from(width) == 2 * u64::from(height);
        is_whole.then(|| Self::Gpano(Gpano::whole(width, height)))
    }
}
