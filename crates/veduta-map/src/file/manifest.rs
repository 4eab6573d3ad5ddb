//! `manifest.json`: what is in a file and where, written last.

use super::FileError;
use crate::scene::{Layer, Light, Material, World};
use crate::{Camera, GuestGrid, GuestKind, Reading, Source};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the member.
pub const MANIFEST: &str = "manifest.json";

/// What the format calls itself.
pub const FORMAT: &str = "veduta visibility map";

/// What it calls itself where it holds spans of multiscan: programs that know only maps refuse it.
pub const SPANS_FORMAT: &str = "veduta multiscan spans";

/// Major version: readers refuse others. Minor version: readers skip what they do not know.
pub const VERSION: [u32; 2] = [2, 0];

/// The manifest. Fields that a reader does not know are skipped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    pub format: String,
    /// Major and minor version.
    pub version: [u32; 2],
    /// The program that wrote the file.
    pub generator: String,
    /// Pixels of the picture it was made for; a map has no resolution.
    pub size: [u32; 2],
    /// Whether something was cut or left out, so that a face may be unseen where nothing hides it.
    pub has_holes: bool,
    pub camera: Camera,
    pub world: World,
    pub layers: Vec<Layer>,
    pub lights: Vec<Light>,
    pub materials: Vec<Material>,
    pub sources: Vec<Source>,
    /// Sub-scanlines of a row of pixels, in a file that holds spans in place of regions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sub_scanlines: Option<u32>,
    /// What casts shadows, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub casters: Option<CastersTold>,
    /// Pictures of other programs.
    pub guests: Vec<GuestEntry>,
    /// Boxes around what the tiles' faces show: left, top, right, bottom, in the image plane. Tile `i`
    /// is batch `i` of the members that are cut into tiles.
    pub tiles: Vec<[f64; 4]>,
    /// Of each member that holds a table, by name.
    pub tables: BTreeMap<String, Table>,
}

/// What the tables do not tell of a guest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuestEntry {
    pub name: String,
    pub kind: GuestKind,
    pub grid: GuestGrid,
    /// Names of what its samples belong to.
    pub objects: Vec<String>,
}

/// What casts, as far as it is not in tables.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CastersTold {
    /// Of the scene in the tables `caster-*.arrow`; `None` if there are none.
    #[serde(default)]
    pub embedded: Option<EmbeddedScene>,
    #[serde(default)]
    pub readings: Vec<Reading>,
}

/// What the tables do not tell of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EmbeddedScene {
    pub world: World,
    pub layers: Vec<Layer>,
    pub lights: Vec<Light>,
    pub cameras: Vec<(String, Camera)>,
    pub materials: Vec<Material>,
    /// Of each image its row in `images.arrow`, in which those of what is seen stand, or, counted on
    /// from the last of these, in `caster-images.arrow`.
    pub images: Vec<u32>,
}

/// Where the batches of a table lie, and their checksums. A table's bytes are its head (Arrow's schema),
/// the batches and its tail (Arrow's footer), one after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    pub head: Segment,
    pub batches: Vec<Segment>,
    pub tail: Segment,
}

/// Bytes of a member.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Number of bytes.
    pub length: u64,
    /// XXH3 of the bytes, 64 bits, hexadecimal.
    pub xxh3: String,
}

impl Segment {
    /// The segment of these bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self {
            length: bytes.len() as u64,
            xxh3: format!("{:016x}", xxhash_rust::xxh3::xxh3_64(bytes)),
        }
    }
}

impl Manifest {
    /// Reads a manifest, the version first: of another one nothing else is known.
    pub fn parse(bytes: &[u8]) -> Result<Self, FileError> {
        #[derive(Deserialize)]
        struct Versioned {
            format: String,
            version: [u32; 2],
        }
        let unsound = |error: serde_json::Error| FileError::Unsound {
            member: MANIFEST.into(),
            what: error.to_string(),
        };
        let Versioned { format, version } = serde_json::from_slice(bytes).map_err(unsound)?;
        if format != FORMAT && format != SPANS_FORMAT {
            let what = format!("the format is {format:?}, not {FORMAT:?}");
            return Err(FileError::Unsound {
                member: MANIFEST.into(),
                what,
            });
        }
        if version[0] != VERSION[0] {
            return Err(FileError::Version { found: version });
        }
        serde_json::from_slice(bytes).map_err(unsound)
    }
}
