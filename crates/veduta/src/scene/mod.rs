//! What is to be shown: objects made of meshes, their materials, the cameras and lights.
//!
//! The data themselves are [`veduta_map::scene`]'s, since maps keep what is seen of them. Here stands
//! what is found out about them before anything is seen.
//!
//! Readers of foreign files turn what they read to the world's space, through
//! [`Object::world_from_object`].

mod coplanar;
mod framing;
pub mod generate;
mod opacity;

pub use coplanar::{FaceIndex, PlaneGroups};
pub use framing::{Bounds, FRAMING_FOV, framing_camera, framing_camera_of_fov};
pub use opacity::{Opacities, Opacity};
pub use veduta_map::scene::{
    AlphaMode, Image, ImageId, Layer, Light, LightKind, Material, Mesh, MeshError, MeshId, Object,
    ObjectKey, Scene, Shown, TexcoordSet, TextureRef, World, Wrap,
};
