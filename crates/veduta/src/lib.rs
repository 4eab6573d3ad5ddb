//! Veduta finds which surface is seen where in a picture of a 3D scene, exactly, and keeps it.
//!
//! ```text
//! scene -> visibility -> map -> dice -> shade -> accumulate -> output
//! ```
//!
//! Each stage is a module of that name. Stages meet in the data they hand over and never call one
//! another; `pipeline` alone knows their order.

pub mod accumulate;
mod buckets;
mod clip;
pub mod composite;
pub mod dice;
pub mod drawing;
pub mod filter;
pub mod pipeline;
pub mod reproject;
pub mod scene;
pub mod shade;
mod sweep;
pub mod visibility;

pub use veduta_geometry as geometry;
pub use veduta_map as map;
