//! A ZIP archive of stored members, in one legal form.
//!
//! Any program that knows ZIP64 reads it. We write each header in one way only (no times, no
//! permissions, sizes always in 64 bits, members one after the other from byte 0 on, their bytes
//! aligned) and compare what we read with that, so that no byte of an archive is without meaning.

use super::FileError;
use std::io::{self, Read, Seek, SeekFrom, Write};

/// Members' bytes begin at multiples of this, for readers that map files into memory.
const ALIGNMENT: u64 = 64;

/// 1 January 1980, the first day that ZIP knows: equal maps make equal files.
const DATE: u16 = 0x0021;

/// ZIP64 was new in version 4.5 of the format.
const VERSION: u16 = 45;

/// Sizes and offsets are in the ZIP64 records.
const IN_64_BITS: u32 = u32::MAX;

/// Bytes of a local header without name and padding: 30 of its own, 20 of the sizes, 4 that head the
/// padding.
const LOCAL_HEADER: u64 = 54;

/// Bytes of a row of the directory without the name: 46 of its own, 28 of the sizes and the offset.
const DIRECTORY_ROW: u64 = 74;

/// Bytes after the rows of the directory: the ZIP64 end record, its locator, the end record.
const END: u64 = 56 + 20 + 22;

/// Longest name of a member: ours are short, and damage must not ask for much memory.
const LONGEST_NAME: u16 = 255;

/// A member of an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    pub name: String,
    /// Where its local header begins.
    header: u64,
    /// Bytes of the member.
    pub length: u64,
    crc32: u32,
}

impl Member {
    /// Where its bytes begin.
    pub fn start(&self) -> u64 {
        (self.header + LOCAL_HEADER + self.name.len() as u64).next_multiple_of(ALIGNMENT)
    }

    /// Where its bytes end, and with them the member.
    pub fn end(&self) -> u64 {
        self.start() + self.length
    }

    fn local_header(&self) -> Vec<u8> {
        let padding = self.start() - self.header - LOCAL_HEADER - self.name.len() as u64;
        let mut bytes = Vec::with_capacity((self.start() - self.header) as usize);
        bytes.extend(b"PK\x03\x04");
        self.common_fields(&mut bytes, 20 + 4 + padding as u16);
        bytes.extend(self.name.as_bytes());
        bytes.extend(1u16.to_le_bytes());
        bytes.extend(16u16.to_le_bytes());
        bytes.extend(self.length.to_le_bytes());
        bytes.extend(self.length.to_le_bytes());
        // An extra field that other readers skip, as Android's tools pad.
        bytes.extend(0xd935u16.to_le_bytes());
        bytes.extend((padding as u16).to_le_bytes());
        bytes.resize((self.start() - self.header) as usize, 0);
        bytes
    }

    fn directory_row(&self, bytes: &mut Vec<u8>) {
        bytes.extend(b"PK\x01\x02");
        bytes.extend(VERSION.to_le_bytes());
        self.common_fields(bytes, 28);
        // No comment, disk 0, no attributes.
        bytes.extend([0; 2 + 2 + 2 + 4]);
        bytes.extend(IN_64_BITS.to_le_bytes());
        bytes.extend(self.name.as_bytes());
        bytes.extend(1u16.to_le_bytes());
        bytes.extend(24u16.to_le_bytes());
        for value in [self.length, self.length, self.header] {
            bytes.extend(value.to_le_bytes());
        }
    }

    /// What local header and directory have in common: from the version to the lengths of name and
    /// extra fields.
    fn common_fields(&self, bytes: &mut Vec<u8>, extra: u16) {
        bytes.extend(VERSION.to_le_bytes());
        // The name is UTF-8; not compressed; at midnight.
        for value in [0x0800u16, 0, 0, DATE] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend(self.crc32.to_le_bytes());
        bytes.extend(IN_64_BITS.to_le_bytes());
        bytes.extend(IN_64_BITS.to_le_bytes());
        bytes.extend((self.name.len() as u16).to_le_bytes());
        bytes.extend(extra.to_le_bytes());
    }
}

/// The directory of an archive and all that follows it.
fn directory(members: &[Member]) -> Vec<u8> {
    let start = members.last().map_or(0, Member::end);
    let mut bytes = Vec::new();
    members
        .iter()
        .for_each(|member| member.directory_row(&mut bytes));
    let length = bytes.len() as u64;
    let count = members.len() as u64;
    bytes.extend(b"PK\x06\x06");
    bytes.extend(44u64.to_le_bytes());
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend([0; 8]);
    for value in [count, count, length, start] {
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(b"PK\x06\x07");
    bytes.extend([0; 4]);
    bytes.extend((start + length).to_le_bytes());
    bytes.extend(1u32.to_le_bytes());
    bytes.extend(b"PK\x05\x06");
    bytes.extend([0; 4]);
    bytes.extend([u8::MAX; 2 + 2 + 4 + 4]);
    bytes.extend([0; 2]);
    bytes
}

/// Writes an archive, one member after the other.
pub struct ArchiveWriter<W> {
    out: W,
    members: Vec<Member>,
    checksum: crc32fast::Hasher,
}

impl<W: Write + Seek> ArchiveWriter<W> {
    /// An archive that begins where `out` stands, which must be its byte 0.
    pub fn new(out: W) -> Self {
        Self {
            out,
            members: Vec::new(),
            checksum: crc32fast::Hasher::new(),
        }
    }

    /// Begins a member; what is then written is its bytes.
    pub fn begin(&mut self, name: &str) -> io::Result<()> {
        let member = Member {
            name: name.to_owned(),
            header: self.members.last().map_or(0, Member::end),
            length: 0,
            crc32: 0,
        };
        self.out.write_all(&member.local_header())?;
        self.members.push(member);
        self.checksum = crc32fast::Hasher::new();
        Ok(())
    }

    /// Ends the member that was begun last.
    pub fn end(&mut self) -> io::Result<()> {
        let checksum = std::mem::take(&mut self.checksum).finalize();
        if let Some(member) = self.members.last_mut() {
            member.crc32 = checksum;
            self.out.seek(SeekFrom::Start(member.header))?;
            self.out.write_all(&member.local_header())?;
            self.out.seek(SeekFrom::Start(member.end()))?;
        }
        Ok(())
    }

    /// Ends the archive.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.write_all(&directory(&self.members))?;
        self.out.flush()?;
        Ok(self.out)
    }
}

impl<W: Write> Write for ArchiveWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.checksum.update(&bytes[..written]);
        if let Some(member) = self.members.last_mut() {
            member.length += written as u64;
        }
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Reads the members of an archive.
#[derive(Debug)]
pub struct ArchiveReader<R> {
    input: R,
    members: Vec<Member>,
    /// Bytes read so far.
    read: u64,
}

impl<R: Read + Seek> ArchiveReader<R> {
    /// Reads the directory, and compares every byte that is not a member's with its only legal value.
    pub fn new(mut input: R) -> Result<Self, FileError> {
        let mut start = [0; 4];
        let length = input
            .seek(SeekFrom::End(0))
            .and_then(|length| input.rewind().map(|()| length))
            .and_then(|length| {
                let known = length.min(4) as usize;
                input.read_exact(&mut start[..known]).map(|()| length)
            })
            .map_err(|source| FileError::Io {
                what: "the first bytes",
                source,
            })?;
        if start != *b"PK\x03\x04" {
            return Err(FileError::NotAMap { found: start });
        }
        let mut archive = Self {
            input,
            members: Vec::new(),
            read: 4,
        };
        archive.read_directory(length)?;
        for index in 0..archive.members.len() {
            let member = archive.members[index].clone();
            let expected = member.local_header();
            let what = "a member's header";
            let found = archive.bytes(what, member.header, expected.len() as u64)?;
            same(what, member.header, &found, &expected)?;
        }
        Ok(archive)
    }

    fn read_directory(&mut self, length: u64) -> Result<(), FileError> {
        let what = "the directory at its end";
        let cut = FileError::Cut { length };
        if length < END {
            return Err(cut);
        }
        let end = self.bytes(what, length - END, END)?;
        if end[..4] != *b"PK\x06\x06" {
            return Err(cut);
        }
        let number = |at: usize| u64_at(&end, at);
        let (count, bytes, start) = (number(24), number(40), number(48));
        let fits = start
            .checked_add(bytes)
            .and_then(|sum| sum.checked_add(END))
            == Some(length);
        if !fits || count > bytes / DIRECTORY_ROW {
            return Err(FileError::Damaged {
                what: what.into(),
                offset: length - END,
            });
        }
        let found = self.bytes(what, start, length - start)?;
        let mut at = 0;
        for _ in 0..count {
            let member = directory_row(&found[at..]).filter(|member| member.fits_into(start));
            let Some(member) = member else {
                let offset = start + at as u64;
                return Err(FileError::Damaged {
                    what: what.into(),
                    offset,
                });
            };
            at += DIRECTORY_ROW as usize + member.name.len();
            self.members.push(member);
        }
        // Members follow one another from the first byte to the directory.
        let mut next = 0;
        for member in &self.members {
            if member.header != next {
                return Err(FileError::Damaged {
                    what: what.into(),
                    offset: start,
                });
            }
            next = member.end();
        }
        same(what, start, &found, &directory(&self.members))
    }

    /// The member of this name.
    pub fn member(&self, name: &str) -> Option<&Member> {
        self.members.iter().find(|member| member.name == name)
    }

    /// All members.
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// `length` bytes from `offset` on, which must lie in the archive.
    pub fn bytes(
        &mut self,
        what: &'static str,
        offset: u64,
        length: u64,
    ) -> Result<Vec<u8>, FileError> {
        let mut bytes = vec![0; length as usize];
        self.input
            .seek(SeekFrom::Start(offset))
            .and_then(|_| self.input.read_exact(&mut bytes))
            .map_err(|source| FileError::Io { what, source })?;
        self.read += length;
        Ok(bytes)
    }

    /// Bytes read so far.
    pub fn bytes_read(&self) -> u64 {
        self.read
    }

    /// Compares a whole member with its checksum, in bounded memory.
    pub fn check(&mut self, member: &Member) -> Result<(), FileError> {
        let mut checksum = crc32fast::Hasher::new();
        let mut at = member.start();
        while at < member.end() {
            let length = (member.end() - at).min(1 << 20);
            checksum.update(&self.bytes("a member", at, length)?);
            at += length;
        }
        same_checksum(checksum, member)
    }

    /// All bytes of a member, which are those that were written.
    pub fn checked_bytes(&mut self, member: &Member) -> Result<Vec<u8>, FileError> {
        let bytes = self.bytes("a member", member.start(), member.length)?;
        let mut checksum = crc32fast::Hasher::new();
        checksum.update(&bytes);
        same_checksum(checksum, member)?;
        Ok(bytes)
    }
}

fn same_checksum(checksum: crc32fast::Hasher, member: &Member) -> Result<(), FileError> {
    if checksum.finalize() == member.crc32 {
        Ok(())
    } else {
        Err(FileError::Damaged {
            what: member.name.clone(),
            offset: member.start(),
        })
    }
}

impl Member {
    /// Whether it ends before `end`, without overflow.
    fn fits_into(&self, end: u64) -> bool {
        self.header <= end && self.length <= end && self.end() <= end
    }
}

/// A row of the directory, as far as it tells anything; the rest is compared later.
fn directory_row(bytes: &[u8]) -> Option<Member> {
    let name_length = u16::from_le_bytes(bytes.get(28..30)?.try_into().ok()?);
    if name_length > LONGEST_NAME {
        return None;
    }
    let name_end = 46 + name_length as usize;
    let numbers = bytes.get(name_end + 4..name_end + 28)?;
    Some(Member {
        name: str::from_utf8(&bytes[46..name_end]).ok()?.to_owned(),
        header: u64_at(numbers, 16),
        length: u64_at(numbers, 0),
        crc32: u32::from_le_bytes(bytes[16..20].try_into().ok()?),
    })
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    let mut number = [0; 8];
    number.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(number)
}

/// Compares bytes read at `offset` with their only legal value.
fn same(what: &'static str, offset: u64, found: &[u8], expected: &[u8]) -> Result<(), FileError> {
    let differs = found.iter().zip(expected).position(|(a, b)| a != b);
    match differs.or((found.len() != expected.len()).then_some(0)) {
        None => Ok(()),
        Some(at) => Err(FileError::Damaged {
            what: what.into(),
            offset: offset + at as u64,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn archive() -> Vec<u8> {
        let mut writer = ArchiveWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in [
            ("a.txt", "first"),
            ("b/c.bin", ""),
            ("d", "the last member"),
        ] {
            writer.begin(name).expect("memory takes all");
            writer
                .write_all(bytes.as_bytes())
                .expect("memory takes all");
            writer.end().expect("memory takes all");
        }
        writer.finish().expect("memory takes all").into_inner()
    }

    fn read(bytes: &[u8]) -> Result<Vec<Vec<u8>>, FileError> {
        let mut reader = ArchiveReader::new(Cursor::new(bytes))?;
        let members = reader.members().to_vec();
        members
            .iter()
            .map(|member| {
                reader.check(member)?;
                reader.bytes("a member", member.start(), member.length)
            })
            .collect()
    }

    #[test]
    fn what_was_written_is_read() {
        let members = read(&archive()).expect("sound");
        assert_eq!(members, [&b"first"[..], b"", b"the last member"]);
    }

    #[test]
    fn every_cut_and_every_flipped_bit_is_noticed() {
        let sound = archive();
        for length in 0..sound.len() {
            assert!(read(&sound[..length]).is_err(), "cut to {length} bytes");
        }
        for bit in 0..8 * sound.len() {
            let mut damaged = sound.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(read(&damaged).is_err(), "bit {bit}");
        }
    }
}
