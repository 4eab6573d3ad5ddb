//! What the readers make of files: sound ones, wrong ones, damaged ones and real ones.

mod animation;
mod casters;
mod cityjson;
#[cfg(feature = "meshopt")]
mod compressed;
mod damaged;
mod gltf;
mod gltf_poses;
mod obj;
mod ply;
mod real_models;
mod scene_file;
mod scene_file_damaged;
mod stl;
mod support;
mod views_file;
