//! What the readers make of files: sound ones, wrong ones, damaged ones and real ones.

#[cfg(feature = "meshopt")]
mod compressed;
mod damaged;
mod gltf;
mod gltf_poses;
mod obj;
mod real_models;
mod support;
