//! What Veduta's engines cost, and the simpler methods they are compared with.
//!
//! Ratios between engines mean something only when both were measured in one process and the
//! simpler one is well made. [`zbuffer`] is that: plain, single-threaded, and as quick as plain
//! code gets. Multiscan is part of the library.

pub mod cases;
pub mod composite;
pub mod deep;
pub mod dome;
pub mod exchange;
pub mod fit;
pub mod glb;
pub mod peers;
pub mod table;
pub mod timing;
pub mod two_pass;
pub mod zbuffer;
