//! A header that is the same in every run.
//!
//! The encoder keeps attributes beyond the usual ones in a hash map, and writes them in its order. So
//! the header is recorded on its way, and written again with its attributes sorted by name: their
//! order means nothing to the format, and the header's length does not change.

use std::io::{self, Seek, SeekFrom, Write};

/// Magic number and version, before the first attribute.
const PREFACE: usize = 8;

/// Hands everything on, and keeps what is written before the first seek: the encoder seeks after the
/// header.
pub struct RecordHead<'w, W> {
    writer: &'w mut W,
    start: Option<u64>,
    head: Vec<u8>,
    is_recording: bool,
}

impl<'w, W: Write + Seek> RecordHead<'w, W> {
    pub fn new(writer: &'w mut W) -> Self {
        Self {
            writer,
            start: None,
            head: Vec::new(),
            is_recording: true,
        }
    }

    /// Writes the header again, in order, and goes back to the end of the file.
    pub fn put_in_order(self) -> io::Result<()> {
        let header = in_order(&self.head).ok_or_else(|| {
            let message = "the encoder wrote a header that cannot be read";
            io::Error::new(io::ErrorKind::InvalidData, message)
        })?;
        self.writer.seek(SeekFrom::Start(self.start.unwrap_or(0)))?;
        self.writer.write_all(&header)?;
        self.writer.seek(SeekFrom::End(0))?;
        Ok(())
    }
}

impl<W: Write + Seek> Write for RecordHead<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.start.is_none() {
            self.start = Some(self.writer.stream_position()?);
        }
        let count = self.writer.write(bytes)?;
        if self.is_recording {
            self.head.extend_from_slice(&bytes[..count]);
        }
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl<W: Write + Seek> Seek for RecordHead<'_, W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.is_recording = false;
        self.writer.seek(to)
    }
}

/// The header at the start of `bytes`, its attributes sorted by name; `None` if it is none.
fn in_order(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut attributes = Vec::new();
    let mut at = PREFACE;
    while *bytes.get(at)? != 0 {
        let name_end = at + zero_in(&bytes[at..])?;
        let type_end = name_end + 1 + zero_in(bytes.get(name_end + 1..)?)?;
        let size: [u8; 4] = bytes.get(type_end + 1..type_end + 5)?.try_into().ok()?;
        let end = type_end + 5 + usize::try_from(i32::from_le_bytes(size)).ok()?;
        attributes.push((&bytes[at..name_end], bytes.get(at..end)?));
        at = end;
    }
    attributes.sort();
    let mut header = bytes[..PREFACE].to_vec();
    for (_, attribute) in attributes {
        header.extend_from_slice(attribute);
    }
    header.push(0);
    Some(header)
}

fn zero_in(bytes: &[u8]) -> Option<usize> {
    bytes.iter().position(|&byte| byte == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_sorted_and_nothing_else_changes() {
        let attribute = |name: &str, value: &[u8]| {
            let size = (value.len() as i32).to_le_bytes();
            [name.as_bytes(), b"\0string\0", &size, value].concat()
        };
        let [a, b, c] = [("a", "one".as_bytes()), ("b", b""), ("c", b"\0\0c\0")]
            .map(|(name, value)| attribute(name, value));
        let preface = b"\x76\x2f\x31\x01\x02\0\0\0".as_slice();
        let written = [preface, &c, &a, &b, b"\0", b"more that is no header"].concat();
        let expected = [preface, &a, &b, &c, b"\0"].concat();
        assert_eq!(in_order(&written), Some(expected));
        for end in 0..preface.len() + c.len() + a.len() + b.len() {
            assert_eq!(in_order(&written[..end]), None, "cut at {end}");
        }
    }
}
