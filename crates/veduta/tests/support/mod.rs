//! What the laws are tested with: random scenes, and ways to measure what is seen in them that share
//! no code with the engines or the pipeline.

pub mod coverage;
pub mod rng;
pub mod samples;
pub mod scenes;
