//! The other half of a map: where it comes from, and all that could cast a shadow on what is seen.

use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::io::{self, Read};
use xxhash_rust::xxh3::Xxh3;

/// What a map is made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// All files that its scene was read from.
    pub sources: Vec<Source>,
    /// What casts; `None` where that is not known.
    pub casters: Option<Casters>,
}

/// What casts shadows and is seen in mirrors: the whole geometry of the scene, hidden faces and those
/// off the picture too. The scene is `embedded` and what `readings` give, together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Casters {
    /// What is kept with the map.
    pub embedded: Option<Scene>,
    /// What is to be read again from files.
    pub readings: Vec<Reading>,
}

/// How a scene was read from files, so that the same can be read again.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reading {
    /// All files that were read, each once. The first is the one that names the others.
    pub files: Vec<Source>,
    /// The axis of the file that points upwards, `y` or `z`; `None` for what is usual in its format.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up_axis: Option<String>,
    /// The level of detail that was asked for, such as `1.3`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level_of_detail: Option<String>,
    /// The names of the layers that were kept; `None` for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layers: Option<Vec<String>>,
    /// Which objects were kept, one choice after the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Choice>,
}

/// A choice of objects by patterns of their names, in which `*`, `**` and `?` stand for parts.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Choice {
    /// Only objects of these names; all if there are none.
    pub only: Vec<String>,
    /// But not those of these names.
    pub without: Vec<String>,
}

/// A file that a scene was read from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// As it was named; in a file of a map, relative to that file where it can be.
    pub path: String,
    /// Number of bytes.
    pub length: u64,
    /// XXH3 of the bytes, 128 bits, hexadecimal.
    pub xxh3: String,
}

impl Source {
    /// What is to be said of a file with these contents.
    ///
    /// # Errors
    /// Those of `contents`.
    pub fn of(path: &str, mut contents: impl Read) -> io::Result<Self> {
        let mut checksum = Xxh3::new();
        let mut length = 0;
        let mut buffer = vec![0; 1 << 16];
        loop {
            let read = contents.read(&mut buffer)?;
            if read == 0 {
                break;
            }
            checksum.update(&buffer[..read]);
            length += read as u64;
        }
        Ok(Self {
            path: path.to_owned(),
            length,
            xxh3: format!("{:032x}", checksum.digest128()),
        })
    }

    /// Whether the files had the same contents, wherever they stand.
    pub fn is_alike(&self, other: &Self) -> bool {
        self.length == other.length && self.xxh3 == other.xxh3
    }
}
