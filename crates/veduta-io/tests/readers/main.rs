//! What the readers make of files: sound ones, wrong ones, damaged ones and real ones.

mod cityjson;
mod damaged;
mod gltf;
mod obj;
mod ply;
mod real_models;
mod stl;
mod support;
