//! The visibility map: which face is seen where in the image, and how near it is there.
//!
//! This crate is the contract between programs that make maps and programs that use them. It holds
//! the types, their invariants and the checks, and can be read without any engine.
//!
//! **Spaces.** *World*: right-handed, Z up, metres. *Eye*: x right, y down, z forward, the eye at
//! the origin. *Image*: x right, y down, the frame is the unit square whatever the picture's size
//! or shape; pixels come later, as an affine map of the image plane. So a map has no resolution.

mod camera;
mod casters;
mod faces;
pub mod file;
mod fragments;
mod guest;
mod ids;
mod line;
mod map;
pub mod scene;
mod spans;
mod stored;

pub use camera::{Camera, Projection, image_from_homogeneous};
pub use casters::{Casters, Choice, Origin, Reading, Source};
pub use faces::Faces;
pub use fragments::{Fragment, Fragments, Seen, Side};
pub use guest::{Guest, GuestError, GuestGrid, GuestKind, GuestSamples};
pub use ids::{FaceId, LineId, MaterialId, ObjectId, PlaneId};
pub use line::{FrameSide, Line, Lines};
pub use map::{Invariant, VisibilityMap};
pub use spans::{SeenSpans, Span, SpanBand, Spans, TooFewSubScanlines};
pub use stored::{ObjectMesh, SeenScene};
pub use veduta_geometry::Affine;
