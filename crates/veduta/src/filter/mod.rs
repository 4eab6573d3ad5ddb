//! Pixel filters: how much of what is seen at a point goes to which pixel. Knows no stage.
//!
//! A pixel is the integral of radiance times a kernel around its centre. The kernels are *separable*,
//! `k(x) k(y)`, and polynomials of degree 3 at most between one pixel centre and the next. So on the
//! cells of a grid whose corners are the pixels' centres the weight of a polygon is a sum over its
//! moments ([`CellMoments`](veduta_geometry::CellMoments)), without an error and without samples:
//!
//! ```text
//!     .-------.-------.-------.      . centres of pixels, at the corners of cells
//!     |       |       |       |
//!     |   +---|---+   |       |      P is one of them, and the square around it the pixel.
//!     .---|---P---|---.-------.      A kernel of radius 1 reaches the four cells that meet
//!     |   +---|---+   |       |      at P, one of radius 2 these and the twelve around them.
//!     |       |       |       |
//!     .-------.-------.-------.
//! ```
//!
//! Textures and views are filtered the other way round, from pixels to texels: [`ewa`], on [`Texels`].
//!
//! Kernels sum to 1 over all pixels at any point ([`Kernel`]): no point of the scene counts more than another,
//! however it lies to the pixels, and what a picture sums up to does not depend on the filter.

pub mod ewa;
mod kernel;
mod texels;

pub use kernel::{CellKernel, Kernel};
pub(crate) use texels::PADDING;
pub use texels::{Texels, Wrap};

/// A pixel filter.
///
/// All but the box mix what lies within the kernel's radius, also from the neighbours of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Exact area in the pixel: radius 1/2. Sharp, and steps along edges are those of area.
    #[default]
    Box,
    /// `1 - |x|`: radius 1.
    Triangle,
    /// Nearly the Gaussian of standard deviation 1/2 pixel ([`Kernel::gaussian`]): radius 2, no lobe below 0.
    Gaussian,
    /// The cubic of Mitchell & Netravali with B = C = 1/3: radius 2, a little sharper than the Gaussian, with
    /// lobes below 0.
    Mitchell,
    /// The cubic of Catmull & Rom, B = 0, C = 1/2: radius 2, the sharpest, with deeper lobes below 0.
    CatmullRom,
    /// The cubic B-spline, B = 1, C = 0: radius 2, the softest.
    BSpline,
}

impl Filter {
    /// The kernel; none for the box, whose weights are areas.
    pub fn kernel(self) -> Option<Kernel> {
        match self {
            Self::Box => None,
            Self::Triangle => Some(Kernel::triangle()),
            Self::Gaussian => Some(Kernel::gaussian()),
            Self::Mitchell => Some(Kernel::cubic(1.0 / 3.0, 1.0 / 3.0)),
            Self::CatmullRom => Some(Kernel::cubic(0.0, 0.5)),
            Self::BSpline => Some(Kernel::cubic(1.0, 0.0)),
        }
    }
}
