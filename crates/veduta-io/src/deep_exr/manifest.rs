//! Ids of objects, and the table of their names that OpenEXR calls an id manifest.
//!
//! The ids are those of "OpenEXR Deep IDs Specification": the 32 bits of MurmurHash3 of the name, so
//! that an object has the same id in every picture it is in. The table is that of OpenEXR's
//! `ImfIDManifest.cpp`, the only place where it is told.

use super::Attribute;
use crate::deflate::deflate;
use std::collections::BTreeMap;

/// The ids of objects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectIds {
    ids: Vec<u32>,
    /// The name that each id stands for.
    names: BTreeMap<u32, String>,
    /// Whether each is the hash of its name.
    hashed: bool,
}

impl ObjectIds {
    /// Ids of the objects with these names. Objects of one name share an id; of two names with equal
    /// hashes the later gets the next number that is free.
    pub fn of_names<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        let mut known: BTreeMap<&str, u32> = BTreeMap::new();
        let mut of_ids: BTreeMap<u32, String> = BTreeMap::new();
        let mut hashed = true;
        let mut id_of = |name: &'a str| {
            if let Some(&id) = known.get(name) {
                return id;
            }
            let mut id = murmur3_32(name.as_bytes());
            while of_ids.contains_key(&id) {
                hashed = false;
                id = id.wrapping_add(1);
            }
            known.insert(name, id);
            of_ids.insert(id, name.to_owned());
            id
        };
        let ids = names.into_iter().map(&mut id_of).collect();
        Self {
            ids,
            names: of_ids,
            hashed,
        }
    }

    /// The id of object `index`, in the order of the names.
    pub fn of(&self, index: usize) -> u32 {
        self.ids[index]
    }

    /// The attribute `idManifest`, which names the ids in channel `id`.
    pub fn attribute(&self) -> Attribute {
        let bytes = self.bytes();
        let mut value = (bytes.len() as u64).to_le_bytes().to_vec();
        value.extend(deflate(&bytes, 6));
        Attribute::new("idManifest", "idmanifest", value)
    }

    /// The table before it is packed: the names; an order of them; one group of channels, `id`, whose
    /// one component is `object`; and the ids, each with the place of its name in that order.
    fn bytes(&self) -> Vec<u8> {
        // Each name once, sorted; all but the first tell how much they share with the one before, and
        // then the rest.
        let mut names: Vec<&str> = self.names.values().map(String::as_str).collect();
        names.sort_unstable();
        let mut previous: &[u8] = &[];
        let mut cut = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let name = name.as_bytes();
            if index == 0 {
                cut.push(name.to_vec());
            } else {
                let same = name.iter().zip(previous).take_while(|(a, b)| a == b);
                let shared = same.count().min(usize::from(u16::MAX));
                let shared_bytes = (shared as u16).to_be_bytes();
                let mut text = match previous.len() {
                    0..=255 => vec![shared_bytes[1]],
                    _ => shared_bytes.to_vec(),
                };
                text.extend(&name[shared..]);
                cut.push(text);
            }
            previous = name;
        }

        const VERSION: i32 = 0;
        /// For every picture of all time, if ids are hashes.
        const STABLE: u8 = 2;
        /// For this picture.
        const FRAME: u8 = 0;
        /// Ids as numbers of 32 bits, each less the one before.
        const IDS_OF_32_BITS: u8 = 1;
        let mut bytes = VERSION.to_le_bytes().to_vec();
        push_strings(&mut bytes, &cut);
        // Names are counted as they are sorted: one run of all.
        match names.len() {
            0 => push_int(&mut bytes, 0),
            count => [1, 0, count - 1]
                .iter()
                .for_each(|&n| push_int(&mut bytes, n)),
        }
        push_int(&mut bytes, 1);
        push_strings(&mut bytes, &[b"id".to_vec()]);
        push_strings(&mut bytes, &[b"object".to_vec()]);
        bytes.push(if self.hashed { STABLE } else { FRAME });
        let scheme = if self.hashed {
            "MurmurHash3_32"
        } else {
            "custom"
        };
        for text in [scheme, "id"] {
            push_int(&mut bytes, text.len());
            bytes.extend(text.as_bytes());
        }
        bytes.push(IDS_OF_32_BITS);
        push_int(&mut bytes, self.names.len());
        let mut before = 0;
        for (&id, name) in &self.names {
            bytes.extend((id - before).to_le_bytes());
            before = id;
            let place = names.partition_point(|other| *other < name.as_str());
            push_variable(&mut bytes, place);
        }
        bytes
    }
}

fn push_int(bytes: &mut Vec<u8>, number: usize) {
    let number = u32::try_from(number).expect("fewer objects than 2^32");
    bytes.extend(number.to_le_bytes());
}

/// Seven bits a byte, the lowest first; the eighth says that more follow.
fn push_variable(bytes: &mut Vec<u8>, mut number: usize) {
    while number > 127 {
        bytes.push((number & 127) as u8 | 128);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// Their number, their lengths, then they themselves.
fn push_strings(bytes: &mut Vec<u8>, strings: &[Vec<u8>]) {
    push_int(bytes, strings.len());
    for text in strings {
        push_variable(bytes, text.len());
    }
    bytes.extend(strings.iter().flatten());
}

/// The hash of 32 bits of MurmurHash3 (A. Appleby, `MurmurHash3_x86_32`), with seed 0: that of deep
/// ids and of Cryptomatte.
pub fn murmur3_32(bytes: &[u8]) -> u32 {
    let scramble = |word: u32| {
        let word = word.wrapping_mul(0xcc9e_2d51).rotate_left(15);
        word.wrapping_mul(0x1b87_3593)
    };
    let (words, tail) = bytes.as_chunks::<4>();
    let mut hash = 0_u32;
    for &word in words {
        hash ^= scramble(u32::from_le_bytes(word));
        hash = hash
            .rotate_left(13)
            .wrapping_mul(5)
            .wrapping_add(0xe654_6b64);
    }
    if !tail.is_empty() {
        let mut word = [0; 4];
        word[..tail.len()].copy_from_slice(tail);
        hash ^= scramble(u32::from_le_bytes(word));
    }
    hash ^= bytes.len() as u32;
    hash ^= hash >> 16;
    hash = hash.wrapping_mul(0x85eb_ca6b);
    hash ^= hash >> 13;
    hash = hash.wrapping_mul(0xc2b2_ae35);
    hash ^ (hash >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_murmur() {
        // From the reference implementation.
        for (text, hash) in [
            ("", 0),
            ("hello", 0x248b_fa47),
            ("hello, world", 0x149b_bb7f),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(murmur3_32(text.as_bytes()), hash, "{text}");
        }
    }

    #[test]
    fn objects_of_one_name_share_an_id_and_others_do_not() {
        let ids = ObjectIds::of_names(["town/wall", "town/roof", "town/wall"]);
        assert_eq!(ids.of(0), ids.of(2));
        assert_ne!(ids.of(0), ids.of(1));
        assert!(ids.hashed);
    }
}
