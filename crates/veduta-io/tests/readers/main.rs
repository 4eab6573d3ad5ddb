//! What the readers make of files: sound ones, wrong ones, damaged ones and real ones.

mod damaged;
mod gltf;
mod obj;
mod real_models;
mod scene_file;
mod scene_file_damaged;
mod support;
