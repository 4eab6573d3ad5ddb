//! Deep OpenEXR: files that hold of each pixel a list of samples, each with its depth.
//!
//! No crate of Rust reads or writes them, and the tables of counts in them are where readers of other
//! languages have been broken most often. This one never makes a table that the bytes at hand cannot
//! fill: a count is believed only once as many bytes have been unpacked.
//!
//! In: [`DeepFile`] reads the headers (`header`) and then any row of chunks on its own (`read`,
//! `packing`), scanlines and tiles, one part or several. [`DeepImage::flatten`] and [`merge`] follow
//! "Interpreting OpenEXR Deep Pixels" (openexr.com): samples are split where they overlap, merged
//! where they coincide (`tidy`), and laid one over the other.
//!
//! Out: [`DeepWriter`] writes row by row, and keeps none. [`write_deep_picture`] makes such files of
//! what [`render_deep`](veduta::pipeline::render_deep) makes of a scene.
//!
//! Depth is planar distance in metres, larger is farther, in channel Z; colours are premultiplied by
//! the sample's own opacity. Pixels are counted from the top left corner of the data window.

mod bytes;
mod camera;
mod error;
mod flatten;
mod guest;
mod header;
mod id_names;
mod image;
mod manifest;
mod merge;
mod packing;
mod picture;
mod read;
mod tidy;
mod write;

pub use camera::{camera_from_matrices, matrices_of_camera};
pub use error::{DeepError, DeepPlace, DeepProblem};
pub use header::{Attribute, Channel, DeepCompression, DeepHeader};
pub use id_names::IdNames;
pub use image::{DeepImage, DeepPixels, SampleType, Samples, Window};
pub use manifest::{ObjectIds, murmur3_32};
pub use merge::{MergeError, merge};
pub(crate) use packing::pack;
pub use picture::{DeepPicture, DeepSink, stream_deep_picture, write_deep_picture};
pub(crate) use read::is_deep;
pub use read::{DeepFile, read_deep};
pub use write::DeepWriter;
