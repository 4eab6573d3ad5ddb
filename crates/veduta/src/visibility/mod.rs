//! Finding visibility: faces in the image plane -> the regions in which each is seen.
//!
//! [`project`] puts a scene's faces into the image plane. Engines then do the same step, with the
//! same input and output:
//!
//! - [`speculative`], the main one: guess with a z-buffer, clip exactly, verify, mend;
//! - [`cross_scanline`]: Tanaka & Takahashi's sweep, the oracle of the other;
//!
//! and [`multiscan`], which samples on sub-scanlines and returns spans, a type of its own. [`Strips`]
//! cuts the frame into parts that an engine can find one after the other.
//!
//! All obey one depth order. At a point of the image plane the face with the larger nearness is in
//! front, as given by the faces' stored planes; of faces that share a plane the smaller id is.
//! A crossing of two planes is the zero of [`Affine::minus`](veduta_geometry::Affine::minus).

pub mod cross_scanline;
pub mod multiscan;
mod project;
pub mod speculative;
mod strips;

pub use project::project;
pub use strips::{Strip, Strips};

pub use veduta_map::Seen;

use std::sync::atomic::Ordering::Relaxed;

/// How much visibility was found, since the process began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Work {
    /// Faces put into the image plane.
    pub projected: u64,
    /// Faces compared with others to find what is seen of them, by the main engine or in compositing.
    pub clipped: u64,
}

/// How much visibility this process has found so far: proof that what works on a stored map finds none.
pub fn work() -> Work {
    Work {
        projected: project::PROJECTED.load(Relaxed),
        clipped: crate::clip::CLIPPED.load(Relaxed),
    }
}
