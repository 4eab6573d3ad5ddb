//! Foreign formats, in and out: files of other programs -> [`Scene`](veduta::scene::Scene), and
//! [`Picture`](veduta::accumulate::Picture) -> files that other programs read.
//!
//! Bytes that come from outside are not trusted. Whatever a file holds, reading it ends in a scene
//! that [`Mesh::check`](veduta::scene::Mesh::check) accepts or in a [`ReadError`] that says where
//! the file is wrong, in memory that the bytes at hand can justify.
//!
//! Each format is behind a feature of its name; all are on by default.

#[cfg(any(
    feature = "gltf",
    feature = "obj",
    feature = "stl",
    feature = "ply",
    feature = "cityjson",
    feature = "toml"
))]
mod casters;
#[cfg(feature = "exr")]
pub mod deep_exr;
#[cfg(any(feature = "exr", feature = "pdf"))]
mod deflate;
#[cfg(feature = "exr")]
pub mod depth_picture;
#[cfg(feature = "exr")]
mod guest;
mod map_file;
mod object_names;
#[cfg(any(
    feature = "gltf",
    feature = "obj",
    feature = "stl",
    feature = "ply",
    feature = "cityjson",
    feature = "toml"
))]
mod read;
mod read_picture;
mod reason;
mod scale;
pub mod sphere;
pub mod tone;
mod write;

#[cfg(any(
    feature = "gltf",
    feature = "obj",
    feature = "stl",
    feature = "ply",
    feature = "cityjson",
    feature = "toml"
))]
pub use casters::{
    CastersError, SourceError, SourceProblem, check_source, choose_objects, read_casters,
    reading_of,
};
#[cfg(feature = "exr")]
pub use guest::{GuestOptions, GuestProblem, LoadedGuest, read_guest};
pub use map_file::{MAP_SUFFIX, MapFileError, OpenMap, is_map, open_map, write_map, write_spans};
pub use object_names::ObjectNames;
#[cfg(any(
    feature = "gltf",
    feature = "obj",
    feature = "stl",
    feature = "ply",
    feature = "cityjson",
    feature = "toml"
))]
pub use read::{
    Animation, AnimationKind, Detail, ErrorKind, Excerpt, Loaded, Moment, Place, Problem,
    ReadError, ReadOptions, SCENE_SUFFIXES, SceneOverTime, UpAxis, Warning, read_scene,
};
#[cfg(feature = "toml")]
pub use read::{
    FileView, change_scene, closest_name, read_views_file, scene_file_schema, set_in_scene,
    views_file_schema,
};
#[cfg(feature = "cityjson")]
pub use read::{LevelOfDetail, LevelOfDetailError};
pub use read_picture::{
    LoadedPicture, PictureProblem, ReadPictureError, read_linear_picture, read_picture,
};
pub use reason::reason;
pub use scale::scaled;
pub use write::{
    ExrCompression, MODEL_SUFFIXES, PICTURE_SUFFIXES, PictureFormat, PictureOptions, Samples,
    WriteError, WriteProblem, remove_unfinished, stream_picture, write_model, write_picture,
    write_picture_as,
};
#[cfg(feature = "exr")]
pub use write::{Layers, stream_layers, write_layers};
#[cfg(any(feature = "svg", feature = "pdf", feature = "geojson"))]
pub use write::{
    MOST_DECIMALS, VECTOR_SUFFIXES, VectorFormat, VectorOptions, hidden_dash, stream_drawing,
    write_drawing,
};
