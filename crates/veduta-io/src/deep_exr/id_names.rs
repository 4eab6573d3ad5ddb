//! An id manifest -> the names of ids. Its form is told in OpenEXR's `ImfIDManifest.cpp` only.

use super::bytes::Bytes;
use super::{DeepHeader, DeepProblem};
use crate::deflate::{MOST_OF_ONE, inflate};
use std::collections::{BTreeMap, BTreeSet};

/// The names that a file gives for the ids in one of its channels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IdNames {
    /// The channel, a row of the header's.
    pub channel: usize,
    /// The name that each id stands for; of several parts, such as a model and an object, joined by `/`.
    pub names: BTreeMap<u32, String>,
}

/// A group of channels of a manifest.
struct Group {
    channels: Vec<String>,
    names: BTreeMap<u64, String>,
}

impl IdNames {
    /// What the header's manifest tells of the first channel of whole numbers that it names; `None` if there is
    /// no manifest, or it names none.
    ///
    /// # Errors
    /// [`DeepProblem::Damaged`] for a manifest that is none; bytes are counted within it, unpacked.
    pub fn of(header: &DeepHeader) -> Result<Option<Self>, DeepProblem> {
        let Some(packed) = header.id_manifest() else {
            return Ok(None);
        };
        let unpacked = unpacked(packed)?;
        for group in groups(&unpacked)? {
            // Ids of 64 bits are in two channels.
            let [name] = &group.channels[..] else {
                continue;
            };
            let Some(channel) = header.channel(name) else {
                continue;
            };
            if header.channels[channel].sample_type != super::SampleType::Uint {
                continue;
            }
            let names = group.names.into_iter();
            let names = names.filter_map(|(id, name)| Some((u32::try_from(id).ok()?, name)));
            return Ok(Some(Self {
                channel,
                names: names.collect(),
            }));
        }
        Ok(None)
    }
}

fn unpacked(packed: &[u8]) -> Result<Vec<u8>, DeepProblem> {
    let mut bytes = Bytes::new(packed);
    let size = bytes.u64("the size of the table of names")?;
    let rest = bytes.take(bytes.left(), "the table of names")?;
    let size = usize::try_from(size)
        .ok()
        .filter(|&size| size <= rest.len().saturating_mul(MOST_OF_ONE));
    let size = size.ok_or_else(|| bytes.damaged("the table of names is larger than it can be"))?;
    inflate(rest, size).map_err(|what| bytes.damaged(format!("the table of names {what}")))
}

fn groups(unpacked: &[u8]) -> Result<Vec<Group>, DeepProblem> {
    let mut bytes = Bytes::new(unpacked);
    let version = bytes.u32("the version of the table of names")?;
    if version != 0 {
        return Err(bytes.damaged(format!("a table of names of version {version}, not 0")));
    }
    let names = expanded(strings(&mut bytes)?, &bytes)?;
    let order = order(&mut bytes, names.len())?;
    let mut groups = Vec::new();
    for _ in 0..bytes.u32("the number of groups")? {
        let channels = strings(&mut bytes)?;
        let components = strings(&mut bytes)?.len();
        bytes.u8("how long ids live")?;
        for _ in 0..2 {
            let length = bytes.u32("the length of a text")?;
            bytes.take(length as usize, "a text")?;
        }
        let storage = bytes.u8("how ids are stored")?;
        let mut group = Group {
            channels: channels.iter().map(|name| text(name)).collect(),
            names: BTreeMap::new(),
        };
        let mut id = 0u64;
        for _ in 0..bytes.u32("the number of ids")? {
            let difference = match storage {
                0 => bytes.u64("an id")?,
                1 => bytes.u32("an id")?.into(),
                _ => number(&mut bytes, "an id")?,
            };
            id = id.wrapping_add(difference);
            let mut parts = Vec::new();
            for _ in 0..components {
                let place = number(&mut bytes, "the place of a name")?;
                let row = usize::try_from(place)
                    .ok()
                    .and_then(|place| order.get(place));
                let row = row.ok_or_else(|| bytes.damaged(format!("there is no name {place}")))?;
                parts.push(text(&names[*row]));
            }
            group.names.insert(id, parts.join("/"));
        }
        groups.push(group);
    }
    Ok(groups)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Each with what it shares with the one before.
fn expanded(strings: Vec<&[u8]>, bytes: &Bytes) -> Result<Vec<Vec<u8>>, DeepProblem> {
    let mut names: Vec<Vec<u8>> = Vec::new();
    for told in strings {
        let Some(before) = names.last() else {
            names.push(told.to_vec());
            continue;
        };
        let (shared, rest) = match (before.len() > 255, told) {
            (false, [shared, rest @ ..]) => (usize::from(*shared), rest),
            (true, [high, low, rest @ ..]) => (usize::from(*high) << 8 | usize::from(*low), rest),
            _ => return Err(bytes.damaged("a name does not say what it shares")),
        };
        let shared = before.get(..shared);
        let shared = shared.ok_or_else(|| bytes.damaged("a name shares more than there is"))?;
        names.push([shared, rest].concat());
    }
    Ok(names)
}

/// The row of each name in the order in which ids count them: told in runs, each row once.
fn order(bytes: &mut Bytes, count: usize) -> Result<Vec<usize>, DeepProblem> {
    let mut untold: BTreeSet<usize> = (0..count).collect();
    let mut order = Vec::with_capacity(count);
    for _ in 0..bytes.u32("the number of runs of names")? {
        let first = bytes.u32("a run of names")? as usize;
        let last = bytes.u32("a run of names")? as usize;
        if first > last || last >= count {
            return Err(bytes.damaged(format!("a run of names from {first} to {last}")));
        }
        while let Some(&row) = untold.range(first..=last).next() {
            untold.remove(&row);
            order.push(row);
        }
    }
    Ok(order)
}

/// Their number, their lengths, then they themselves.
fn strings<'a>(bytes: &mut Bytes<'a>) -> Result<Vec<&'a [u8]>, DeepProblem> {
    let count = bytes.u32("a number of texts")? as usize;
    if count > bytes.left() {
        return Err(bytes.damaged(format!("{count} texts with {} bytes left", bytes.left())));
    }
    let mut lengths = Vec::with_capacity(count);
    for _ in 0..count {
        lengths.push(number(bytes, "the length of a text")?);
    }
    let texts = lengths.into_iter().map(|length| {
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        bytes.take(length, "a text")
    });
    texts.collect()
}

/// Seven bits a byte, the lowest first; the eighth says that more follow.
fn number(bytes: &mut Bytes, what: &str) -> Result<u64, DeepProblem> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = bytes.u8(what)?;
        value |= u64::from(byte & 127) << shift;
        if byte < 128 {
            return Ok(value);
        }
    }
    Err(bytes.damaged(format!("{what} has too many bytes")))
}

#[cfg(test)]
mod tests {
    use super::super::{Channel, ObjectIds, SampleType};
    use super::*;

    fn header(names: &[&str]) -> DeepHeader {
        let channel = |name: &str, sample_type| Channel {
            name: name.to_owned(),
            sample_type,
        };
        let channels = vec![
            channel("A", SampleType::Float),
            channel("Z", SampleType::Float),
            channel("id", SampleType::Uint),
        ];
        let mut header = DeepHeader::new(2, 1, channels);
        header.set_attribute(ObjectIds::of_names(names.iter().copied()).attribute());
        header
    }

    #[test]
    fn names_that_were_written_are_read() {
        let long = "x".repeat(300);
        let longer = format!("{long}/roof");
        let names = ["town/wall", "town/roof", "", "täck", &long, &longer];
        let ids = ObjectIds::of_names(names);
        let found = IdNames::of(&header(&names))
            .expect("sound")
            .expect("is there");
        assert_eq!(found.channel, 2);
        assert_eq!(found.names.len(), names.len());
        for (index, name) in names.iter().enumerate() {
            assert_eq!(found.names[&ids.of(index)], *name);
        }
    }

    #[test]
    fn damaged_tables_are_errors_or_other_names() {
        let sound = header(&["a/b", "a/c", "d"]);
        let packed = sound.id_manifest().expect("is there").to_vec();
        let table = unpacked(&packed).expect("sound");
        for end in 0..packed.len() {
            assert!(unpacked(&packed[..end]).is_err(), "{end} bytes");
        }
        for end in 0..table.len() {
            assert!(groups(&table[..end]).is_err(), "{end} bytes");
        }
        for byte in 0..table.len() {
            for value in [0, 1, 127, 128, 255] {
                let mut other = table.clone();
                other[byte] = value;
                // Whatever it says: no panic, and no more names than bytes.
                if let Ok(groups) = groups(&other) {
                    let count: usize = groups.iter().map(|group| group.names.len()).sum();
                    assert!(count <= table.len(), "byte {byte}: {value}");
                }
            }
        }
    }
}
