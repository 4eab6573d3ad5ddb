//! The JSON of glTF 2.0, as far as it is read here: one struct for each kind of object, fields in
//! the order of the specification, absent ones as its defaults say.
//!
//! Our own rather than those of the `gltf` crate, which round node transforms to `f32` (centimetres
//! are lost in national coordinates) and whose accessors panic on indices out of range.

use serde::Deserialize;
use std::collections::BTreeMap;

/// Index of a row in one of the document's tables. Not checked; see [`row`](super::row).
pub type Index = u64;

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Document {
    pub asset: Asset,
    #[serde(default)]
    pub extensions_used: Vec<String>,
    #[serde(default)]
    pub extensions_required: Vec<String>,
    pub scene: Option<Index>,
    #[serde(default)]
    pub scenes: Vec<SceneRoots>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<MeshOfPrimitives>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub materials: Vec<Material>,
    #[serde(default)]
    pub textures: Vec<Texture>,
    #[serde(default)]
    pub samplers: Vec<Sampler>,
    #[serde(default)]
    pub images: Vec<Image>,
    #[serde(default)]
    pub cameras: Vec<Camera>,
    #[serde(default)]
    pub skins: Vec<Skin>,
    #[serde(default)]
    pub animations: Vec<Animation>,
    #[serde(default)]
    pub extensions: DocumentExtensions,
}

#[derive(Debug, Deserialize, Default)]
pub struct DocumentExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights: Option<Lights>,
}

/// KHR_lights_punctual in the document.
#[derive(Debug, Deserialize)]
pub struct Lights {
    #[serde(default)]
    pub lights: Vec<Light>,
}

#[derive(Debug, Deserialize)]
pub struct Light {
    pub name: Option<String>,
    #[serde(default = "white")]
    pub color: [f32; 3],
    #[serde(default = "one")]
    pub intensity: f32,
    #[serde(rename = "type")]
    pub kind: String,
    pub range: Option<f32>,
    #[serde(default)]
    pub spot: Spot,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct Spot {
    pub inner_cone_angle: f32,
    pub outer_cone_angle: f32,
}

impl Default for Spot {
    fn default() -> Self {
        Self {
            inner_cone_angle: 0.0,
            outer_cone_angle: std::f32::consts::FRAC_PI_4,
        }
    }
}

fn white() -> [f32; 3] {
    [1.0; 3]
}

fn one() -> f32 {
    1.0
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Asset {
    pub version: String,
    pub min_version: Option<String>,
}

#[derive(Debug, Deserialize)]
pub struct SceneRoots {
    #[serde(default)]
    pub nodes: Vec<Index>,
}

#[derive(Debug, Deserialize)]
pub struct Node {
    pub name: Option<String>,
    #[serde(default)]
    pub children: Vec<Index>,
    pub mesh: Option<Index>,
    pub camera: Option<Index>,
    pub skin: Option<Index>,
    /// Column by column; excludes the three below.
    pub matrix: Option<Box<[f64; 16]>>,
    pub translation: Option<[f64; 3]>,
    /// Quaternion x, y, z, w.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    /// Shares of the mesh's morph targets, in place of the mesh's own.
    pub weights: Option<Vec<f32>>,
    #[serde(default)]
    pub extensions: NodeExtensions,
}

#[derive(Debug, Deserialize, Default)]
pub struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instances: Option<Instances>,
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<LightOfNode>,
}

/// EXT_mesh_gpu_instancing.
#[derive(Debug, Deserialize)]
pub struct Instances {
    #[serde(default)]
    pub attributes: Attributes,
}

/// KHR_lights_punctual in a node.
#[derive(Debug, Deserialize)]
pub struct LightOfNode {
    pub light: Index,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Skin {
    pub inverse_bind_matrices: Option<Index>,
    pub joints: Vec<Index>,
}

#[derive(Debug, Deserialize)]
pub struct Animation {
    pub name: Option<String>,
    #[serde(default)]
    pub channels: Vec<Channel>,
    #[serde(default)]
    pub samplers: Vec<AnimationSampler>,
}

/// What a sampler of its animation moves.
#[derive(Debug, Deserialize)]
pub struct Channel {
    pub sampler: Index,
    pub target: ChannelTarget,
}

#[derive(Debug, Deserialize)]
pub struct ChannelTarget {
    pub node: Option<Index>,
    pub path: String,
}

#[derive(Debug, Deserialize)]
pub struct AnimationSampler {
    /// Accessor of the keys' times.
    pub input: Index,
    pub interpolation: Option<String>,
    /// Accessor of the keys' values.
    pub output: Index,
}

#[derive(Debug, Deserialize)]
pub struct MeshOfPrimitives {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    /// Shares of the primitives' morph targets.
    #[serde(default)]
    pub weights: Vec<f32>,
}

#[derive(Debug, Deserialize)]
pub struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<Index>,
    pub material: Option<Index>,
    #[serde(default = "triangles")]
    pub mode: u64,
    /// Morph targets: what is added to the attributes.
    #[serde(default)]
    pub targets: Vec<Attributes>,
    #[serde(default)]
    pub extensions: PrimitiveExtensions,
}

/// Accessors by the names of attributes, such as `POSITION` and `TEXCOORD_0`.
pub type Attributes = BTreeMap<String, Index>;

#[derive(Debug, Deserialize, Default)]
pub struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<Draco>,
}

/// KHR_draco_mesh_compression.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Draco {
    pub buffer_view: Index,
    /// Numbers of attributes within the compressed mesh, not of accessors.
    pub attributes: Attributes,
}

/// `Primitive::mode` of separate triangles, the default.
fn triangles() -> u64 {
    4
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Accessor {
    pub buffer_view: Option<Index>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u64,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<Sparse>,
}

#[derive(Debug, Deserialize)]
pub struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SparseIndices {
    pub buffer_view: Index,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SparseValues {
    pub buffer_view: Index,
    #[serde(default)]
    pub byte_offset: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct BufferView {
    pub buffer: Index,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
    #[cfg(feature = "meshopt")]
    #[serde(default)]
    pub extensions: BufferViewExtensions,
}

#[cfg(feature = "meshopt")]
#[derive(Debug, Deserialize, Default)]
pub struct BufferViewExtensions {
    #[serde(rename = "KHR_meshopt_compression")]
    meshopt_khr: Option<Meshopt>,
    #[serde(rename = "EXT_meshopt_compression")]
    meshopt_ext: Option<Meshopt>,
}

#[cfg(feature = "meshopt")]
impl BufferViewExtensions {
    /// How the view is compressed, and the name of the extension that says so.
    pub fn meshopt(&self) -> Option<(&'static str, &Meshopt)> {
        let khr = self.meshopt_khr.as_ref();
        let ext = self.meshopt_ext.as_ref();
        khr.map(|row| ("KHR_meshopt_compression", row))
            .or(ext.map(|row| ("EXT_meshopt_compression", row)))
    }
}

/// KHR_meshopt_compression, or EXT_meshopt_compression, of which it is an extension.
#[cfg(feature = "meshopt")]
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Meshopt {
    pub buffer: Index,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: u64,
    pub count: u64,
    pub mode: String,
    pub filter: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Buffer {
    pub uri: Option<String>,
    pub byte_length: u64,
    #[cfg(feature = "meshopt")]
    #[serde(default)]
    pub extensions: BufferExtensions,
}

#[cfg(feature = "meshopt")]
#[derive(Debug, Deserialize, Default)]
pub struct BufferExtensions {
    #[serde(rename = "KHR_meshopt_compression")]
    pub meshopt_khr: Option<MeshoptBuffer>,
    #[serde(rename = "EXT_meshopt_compression")]
    pub meshopt_ext: Option<MeshoptBuffer>,
}

/// What KHR_meshopt_compression says of a buffer.
#[cfg(feature = "meshopt")]
#[derive(Debug, Deserialize)]
pub struct MeshoptBuffer {
    /// The buffer is for readers that cannot decompress, and need not exist.
    #[serde(default)]
    pub fallback: bool,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Material {
    #[serde(default)]
    pub name: String,
    #[serde(default)]
    pub pbr_metallic_roughness: Pbr,
    pub emissive_texture: Option<TextureInfo>,
    #[serde(default)]
    pub emissive_factor: [f32; 3],
    pub alpha_mode: Option<String>,
    pub alpha_cutoff: Option<f32>,
    #[serde(default)]
    pub double_sided: bool,
    #[serde(default)]
    pub extensions: MaterialExtensions,
}

#[derive(Debug, Deserialize, Default)]
#[serde(rename_all = "camelCase")]
pub struct Pbr {
    pub base_color_factor: Option<[f32; 4]>,
    pub base_color_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize, Default)]
pub struct MaterialExtensions {
    #[serde(rename = "KHR_materials_unlit")]
    pub unlit: Option<serde::de::IgnoredAny>,
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub specular_glossiness: Option<SpecularGlossiness>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct EmissiveStrength {
    pub emissive_strength: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SpecularGlossiness {
    pub diffuse_factor: Option<[f32; 4]>,
    pub diffuse_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct TextureInfo {
    pub index: Index,
    #[serde(default)]
    pub tex_coord: u64,
    #[serde(default)]
    pub extensions: TextureExtensions,
}

impl TextureInfo {
    /// The set of texture coordinates that places the picture.
    pub fn texcoord_set(&self) -> u64 {
        let transform = self.extensions.transform.as_ref();
        transform
            .and_then(|transform| transform.tex_coord)
            .unwrap_or(self.tex_coord)
    }
}

#[derive(Debug, Deserialize, Default)]
pub struct TextureExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct TextureTransform {
    #[serde(default)]
    pub offset: [f32; 2],
    #[serde(default)]
    pub rotation: f32,
    #[serde(default = "unscaled")]
    pub scale: [f32; 2],
    pub tex_coord: Option<u64>,
}

fn unscaled() -> [f32; 2] {
    [1.0; 2]
}

#[derive(Debug, Deserialize)]
pub struct Texture {
    pub source: Option<Index>,
    pub sampler: Option<Index>,
    #[serde(default)]
    pub extensions: TextureSources,
}

/// Images that take the place of a texture's own.
#[derive(Debug, Deserialize, Default)]
pub struct TextureSources {
    #[serde(rename = "EXT_texture_webp")]
    pub webp: Option<TextureSource>,
}

#[derive(Debug, Deserialize)]
pub struct TextureSource {
    pub source: Option<Index>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Sampler {
    pub wrap_s: Option<u64>,
    pub wrap_t: Option<u64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Image {
    pub name: Option<String>,
    pub uri: Option<String>,
    pub buffer_view: Option<Index>,
}

#[derive(Debug, Deserialize)]
pub struct Camera {
    pub name: Option<String>,
    pub perspective: Option<PerspectiveCamera>,
    pub orthographic: Option<OrthographicCamera>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct PerspectiveCamera {
    pub aspect_ratio: Option<f64>,
    pub yfov: f64,
    pub znear: f64,
}

#[derive(Debug, Deserialize)]
pub struct OrthographicCamera {
    pub xmag: f64,
    pub ymag: f64,
    pub znear: f64,
}
