//! Cryptomatte: which objects or materials cover how much of each pixel, with their names.
//!
//! Friedman and Jones, "Fully automatic ID mattes with support for motion blur and transparency"
//! (SIGGRAPH 2015), and its specification 1.2.0. A name's hash, as a float, is its id; a pixel has
//! pairs of id and coverage, two pairs in the four channels of each layer, the largest coverage
//! first. The manifest in the header tells the names.

use super::Channel;
use crate::deep_exr::murmur3_32;
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::LayerAttributes;
use std::collections::BTreeMap;
use std::fmt::Write;
use veduta::accumulate::{Matte, Rank};

/// A matte and the names of its things.
pub struct Cryptomatte<'a> {
    /// Of the layers, to which they add a number of two digits.
    pub name: &'static str,
    pub matte: &'a Matte,
    /// Ids of the things, by their rows.
    ids: Vec<f32>,
    names: Vec<&'a str>,
}

impl<'a> Cryptomatte<'a> {
    pub fn new(name: &'static str, matte: &'a Matte, names: Vec<&'a str>) -> Self {
        let ids = names.iter().map(|name| id_of(name)).collect();
        Self {
            name,
            matte,
            ids,
            names,
        }
    }

    /// Adds the layers: four channels for each two ranks.
    pub fn add_channels(self, channels: &mut Vec<Channel<'a>>) {
        let Matte { ranks, rows, .. } = self.matte;
        let ids = std::sync::Arc::new(self.ids);
        for layer in 0..ranks.div_ceil(2) {
            for (k, letter) in ["R", "G", "B", "A"].into_iter().enumerate() {
                let rank = 2 * layer + k / 2;
                let row = move |pixel: usize| {
                    // Of an odd number of ranks the last layer's second pair stays free.
                    if rank < *ranks {
                        rows[pixel * ranks + rank]
                    } else {
                        Rank::FREE
                    }
                };
                let ids = ids.clone();
                let name = format!("{}{layer:02}.{letter}", self.name);
                channels.push(if k % 2 == 0 {
                    let id =
                        move |pixel| ids.get(row(pixel).thing as usize).copied().unwrap_or(0.0);
                    Channel::of_floats(name, id)
                } else {
                    Channel::of_floats(name, move |pixel| row(pixel).area)
                });
            }
        }
    }

    /// Adds what tells programs that the layers are there, and the manifest of all names.
    pub fn add_attributes(&self, attributes: &mut LayerAttributes) {
        let key = format!("{:08x}", murmur3_32(self.name.as_bytes()));
        for (what, value) in [
            ("name", self.name.to_owned()),
            ("hash", "MurmurHash3_32".to_owned()),
            ("conversion", "uint32_to_float32".to_owned()),
            ("manifest", self.manifest()),
        ] {
            let name = format!("cryptomatte/{}/{what}", &key[..7]);
            let value = AttributeValue::Text(Text::new_or_panic(value));
            attributes.other.insert(Text::new_or_panic(name), value);
        }
    }

    /// JSON: of each name its id in hexadecimal digits. In ASCII, since the header knows no other.
    fn manifest(&self) -> String {
        let ids: BTreeMap<&str, f32> = self
            .names
            .iter()
            .copied()
            .zip(self.ids.iter().copied())
            .collect();
        let mut json = String::from("{");
        for (name, id) in ids {
            if json.len() > 1 {
                json.push(',');
            }
            push_json(name, &mut json);
            write!(json, ":\"{:08x}\"", id.to_bits()).expect("strings grow");
        }
        json.push('}');
        json
    }
}

/// Names that share their id with another, in pairs: their mattes cannot be told apart.
pub fn collisions<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<[&'a str; 2]> {
    let mut of_ids = BTreeMap::new();
    let mut found = Vec::new();
    for name in names {
        let first = *of_ids.entry(id_of(name).to_bits()).or_insert(name);
        if first != name && !found.contains(&[first, name]) {
            found.push([first, name]);
        }
    }
    found
}

/// The id of a name: its hash, as a float that is finite and not 0.
fn id_of(name: &str) -> f32 {
    let hash = murmur3_32(name.as_bytes());
    // Exponents of zeros, of infinities and of what is no number differ by one from those of numbers.
    let flip = match hash >> 23 & 0xff {
        0 | 0xff => 1 << 23,
        _ => 0,
    };
    f32::from_bits(hash ^ flip)
}

/// Appends a string of JSON, in ASCII.
fn push_json(text: &str, json: &mut String) {
    json.push('"');
    for unit in text.encode_utf16() {
        match u8::try_from(unit) {
            Ok(byte @ (b'"' | b'\\')) => {
                json.push('\\');
                json.push(char::from(byte));
            }
            Ok(byte @ 0x20..0x7f) => json.push(char::from(byte)),
            _ => write!(json, "\\u{unit:04x}").expect("strings grow"),
        }
    }
    json.push('"');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_and_ids_are_those_of_the_specification() {
        for (name, hash) in [
            ("", 0),
            ("hello", 0x248b_fa47),
            ("hello, world", 0x149b_bb7f),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(murmur3_32(name.as_bytes()), hash, "{name}");
        }
        for (name, id) in [
            ("hello", 6.070_563e-17),
            ("cube", -4.084_619e15),
            ("sphere", 2.790_186e15),
            ("plane", 3.665_576_2e-11),
        ] {
            assert!((id_of(name) / id - 1.0f32).abs() < 1e-6, "{name}");
        }
        assert_eq!(id_of(""), f32::MIN_POSITIVE);
    }

    #[test]
    fn every_id_is_a_number_and_not_zero() {
        for index in 0..100_000 {
            let id = id_of(&format!("object {index}"));
            assert!(id.is_normal(), "{index}: {id}");
        }
    }

    #[test]
    fn names_of_one_id_are_told() {
        // Found by trying: birthdays among 32 bits come after some ten thousands of names.
        let names: Vec<String> = (0..200_000).map(|index| index.to_string()).collect();
        let found = collisions(names.iter().map(String::as_str));
        assert!(!found.is_empty());
        for [a, b] in found {
            assert!(a != b && id_of(a) == id_of(b), "{a} and {b}");
        }
        assert!(
            collisions(["a", "b", "a"]).is_empty(),
            "one name twice is one thing"
        );
    }

    #[test]
    fn strings_of_json_are_ascii() {
        let mut json = String::new();
        push_json("Dach \"Süd\"\\\n\u{1f3e0}", &mut json);
        assert_eq!(json, r#""Dach \"S\u00fcd\"\\\u000a\ud83c\udfe0""#);
    }
}
