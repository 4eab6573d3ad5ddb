//! `.veduta` files: a seen scene on disk.
//!
//! A file is a ZIP archive whose members are stored as they are: Arrow IPC files, each a table, and
//! `manifest.json`, written last. docs/format.md tells the columns and how to read them from Python.
//!
//! - `casters` keeps, where that is asked for, what the map does not show but what casts shadows.
//! - `spans` is what multiscan found, in a file of another kind: in place of regions.
//! - `guests` are pictures of other programs.
//! - `tables` are the columns, `rows` what is read of them, which `assemble` puts together; `tiles` says which rows stand together, so that a window of the picture
//!   reads little; `projected` is what is left out since it follows from vertices; `container` is the
//!   archive, `manifest` what else there is to know.
//! - Every byte is under a checksum, or is compared with its only legal value, before it is decoded:
//!   damage is an error that says where, never another picture.
//! - Equal maps make equal bytes.
//!
//! Writing goes through the tables one after the other, reading through the tiles, so that neither
//! holds more than the map itself and a tile of the file.

mod assemble;
mod casters;
mod container;
mod guests;
mod manifest;
mod message;
mod projected;
mod read;
mod rows;
mod spans;
mod tables;
mod tiles;
mod write;

pub use manifest::VERSION;
pub use read::MapReader;
pub use write::{write_map, write_spans};

/// Why a file could not be read or written. The caller knows which file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The file system failed.
    #[error("{what}: {source}")]
    Io {
        /// What was being read or written.
        what: &'static str,
        /// What went wrong.
        source: std::io::Error,
    },
    /// It does not begin as maps do.
    #[error("not a visibility map: it begins with the bytes {found:02x?}")]
    NotAMap {
        /// The first bytes.
        found: [u8; 4],
    },
    /// The end is missing.
    #[error(
        "the end is missing: {length} bytes are there, and no directory at their end; copy or make the file again"
    )]
    Cut {
        /// Bytes in the file.
        length: u64,
    },
    /// Bytes are not those that were written.
    #[error(
        "damaged in {what}, at byte {offset} or after it: what was written there is no longer so; copy or make the file again"
    )]
    Damaged {
        /// The member, or what else is there.
        what: String,
        /// Where it begins, or where it differs.
        offset: u64,
    },
    /// Another version of the format.
    #[error("version {}.{} of the format, but this program reads version {}.x", found[0], found[1], VERSION[0])]
    Version {
        /// Major and minor version of the file.
        found: [u32; 2],
    },
    /// It holds something else than what is asked for.
    #[error("holds {found}; what is asked for needs {expected}")]
    OtherContents {
        /// What is in it.
        found: &'static str,
        /// What was looked for.
        expected: &'static str,
    },
    /// Sound bytes that say what cannot be: not from this program.
    #[error("{member}: {what}")]
    Unsound {
        /// The member.
        member: String,
        /// What is wrong with it.
        what: String,
    },
}

impl FileError {
    fn unsound(member: &str, what: impl Into<String>) -> Self {
        Self::Unsound {
            member: member.into(),
            what: what.into(),
        }
    }

    fn io(what: &'static str) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::Io { what, source }
    }
}

#[cfg(test)]
mod forged;
#[cfg(test)]
mod tests;
