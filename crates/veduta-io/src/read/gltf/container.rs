//! The GLB container: a header of 12 bytes, a chunk of JSON, a chunk of binary buffer.
//!
//! glTF 2.0, §4.4. Chunks of other types are legal and passed over.

use super::{Fault, MAGIC, Place, Problem};

/// The two chunks that are used.
#[derive(Debug)]
pub struct Chunks<'a> {
    pub json: &'a [u8],
    pub bin: Option<&'a [u8]>,
}

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

/// Finds the chunks of a GLB.
pub fn chunks(bytes: &[u8]) -> Result<Chunks<'_>, Fault> {
    let word = |offset: usize| {
        let word = bytes.get(offset..offset + 4)?;
        Some(u32::from_le_bytes(word.try_into().ok()?))
    };
    if !bytes.starts_with(MAGIC) {
        let found = bytes[..bytes.len().min(4)].to_vec();
        let format = "GLB";
        return Err(Problem::WrongMagic { format, found }.at(Place::Whole));
    }
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(cut("the GLB header", HEADER as u64, bytes.len(), 0));
    };
    if version != 2 {
        let found = format!("GLB version {version}");
        let expected = "version 2";
        return Err(Problem::Version { found, expected }.at(Place::Byte(4)));
    }
    if u64::from(length) > bytes.len() as u64 {
        return Err(cut("the GLB", length.into(), bytes.len(), 8));
    }
    let end = length as usize;

    let mut found = Chunks {
        json: &[],
        bin: None,
    };
    let mut offset = HEADER;
    let mut number = 0;
    while offset < end {
        let present = end - offset;
        if present < CHUNK_HEADER {
            // A few stray bytes after the last chunk harm nothing.
            break;
        }
        let (Some(length), Some(kind)) = (word(offset), word(offset + 4)) else {
            return Err(cut("a chunk header", CHUNK_HEADER as u64, present, offset));
        };
        let start = offset + CHUNK_HEADER;
        if length as usize > end - start {
            return Err(cut("the chunk", length.into(), end - start, offset));
        }
        let chunk = &bytes[start..start + length as usize];
        match (number, kind) {
            (0, JSON) => found.json = chunk,
            (0, _) => {
                return Err(Problem::Illegal {
                    found: format!(
                        "a chunk of type {:?}",
                        kind.to_le_bytes().escape_ascii().to_string()
                    ),
                    expected: "JSON as first chunk",
                }
                .at(Place::Byte(offset as u64 + 4)));
            }
            (_, BIN) if found.bin.is_none() => found.bin = Some(chunk),
            _ => {}
        }
        number += 1;
        // Chunks are padded to whole words; the padding counts in `length`, but not in all files.
        offset = start + (length as usize).next_multiple_of(4);
    }
    if number == 0 {
        return Err(cut(
            "the JSON chunk",
            CHUNK_HEADER as u64,
            end.saturating_sub(HEADER),
            HEADER,
        ));
    }
    Ok(found)
}

fn cut(what: &'static str, needed: u64, present: usize, at: usize) -> Fault {
    let present = present as u64;
    let problem = Problem::Truncated {
        what,
        needed,
        present,
    };
    problem.at(Place::Byte(at as u64))
}
