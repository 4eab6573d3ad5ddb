//! The JSON of CityJSON, as far as it is read. Attributes, addresses and extensions are passed over.

use super::nested::Nested;
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// A CityJSON document, or a feature of a sequence.
#[derive(Debug, Deserialize)]
pub struct Document {
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default)]
    pub version: Option<String>,
    #[serde(default)]
    pub transform: Option<Transform>,
    #[serde(default)]
    pub metadata: Option<Metadata>,
    #[serde(default, rename = "CityObjects")]
    pub city_objects: Ordered<CityObject>,
    /// Integers, to be scaled and moved by the transform.
    #[serde(default)]
    pub vertices: Vec<[f64; 3]>,
    #[serde(default)]
    pub appearance: Option<Appearance>,
    #[serde(default, rename = "geometry-templates")]
    pub templates: Option<Templates>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Transform {
    pub scale: [f64; 3],
    pub translate: [f64; 3],
}

#[derive(Debug, Deserialize)]
pub struct Metadata {
    #[serde(default, rename = "referenceSystem")]
    pub reference_system: Option<String>,
}

#[derive(Debug, Deserialize)]
pub struct CityObject {
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default)]
    pub geometry: Vec<Geometry>,
    #[serde(default)]
    pub parents: Vec<String>,
}

#[derive(Debug, Deserialize)]
pub struct Geometry {
    #[serde(rename = "type")]
    pub kind: String,
    /// A text; in CityJSON 1.0 a number.
    #[serde(default)]
    pub lod: Option<TextOrNumber>,
    #[serde(default)]
    pub boundaries: Nested,
    #[serde(default)]
    pub semantics: Option<Semantics>,
    /// By theme.
    #[serde(default)]
    pub material: Option<Ordered<ThemeMaterial>>,
    /// By theme.
    #[serde(default)]
    pub texture: Option<Ordered<ThemeTexture>>,
    /// Of a GeometryInstance: row of the templates.
    #[serde(default)]
    pub template: Option<u64>,
    /// Of a GeometryInstance: 4 x 4, row by row.
    #[serde(default, rename = "transformationMatrix")]
    pub transformation_matrix: Option<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub enum TextOrNumber {
    Text(String),
    Number(f64),
}

impl fmt::Display for TextOrNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Number(number) => write!(f, "{number}"),
        }
    }
}

#[derive(Debug, Deserialize)]
pub struct Semantics {
    #[serde(default)]
    pub surfaces: Vec<SemanticSurface>,
    #[serde(default)]
    pub values: Nested,
}

#[derive(Debug, Deserialize)]
pub struct SemanticSurface {
    #[serde(rename = "type")]
    pub kind: String,
}

#[derive(Debug, Deserialize)]
pub struct ThemeMaterial {
    /// One material for all surfaces.
    #[serde(default)]
    pub value: Option<u64>,
    #[serde(default)]
    pub values: Nested,
}

#[derive(Debug, Deserialize)]
pub struct ThemeTexture {
    #[serde(default)]
    pub values: Nested,
}

#[derive(Debug, Default, Deserialize)]
pub struct Appearance {
    #[serde(default)]
    pub materials: Vec<Material>,
    #[serde(default)]
    pub textures: Vec<Texture>,
    #[serde(default, rename = "vertices-texture")]
    pub texture_vertices: Vec<[f64; 2]>,
    #[serde(default, rename = "default-theme-material")]
    pub default_material_theme: Option<String>,
    #[serde(default, rename = "default-theme-texture")]
    pub default_texture_theme: Option<String>,
}

#[derive(Debug, Deserialize)]
pub struct Material {
    #[serde(default)]
    pub name: String,
    #[serde(default, rename = "diffuseColor")]
    pub diffuse: Option<[f64; 3]>,
    #[serde(default, rename = "emissiveColor")]
    pub emissive: Option<[f64; 3]>,
    #[serde(default)]
    pub transparency: f64,
}

#[derive(Debug, Deserialize)]
pub struct Texture {
    pub image: String,
    #[serde(default, rename = "wrapMode")]
    pub wrap_mode: Option<String>,
}

#[derive(Debug, Deserialize)]
pub struct Templates {
    #[serde(default)]
    pub templates: Vec<Geometry>,
    /// In metres; the transform is not for them.
    #[serde(default, rename = "vertices-templates")]
    pub vertices: Vec<[f64; 3]>,
}

/// The fields of a JSON object in the order of the file.
#[derive(Debug)]
pub struct Ordered<T>(pub Vec<(String, T)>);

impl<T> Default for Ordered<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Ordered<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Fields<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Fields<T> {
            type Value = Ordered<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Ordered<T>, M::Error> {
                let mut fields = Vec::new();
                while let Some(field) = map.next_entry()? {
                    fields.push(field);
                }
                Ok(Ordered(fields))
            }
        }

        deserializer.deserialize_map(Fields(PhantomData))
    }
}
