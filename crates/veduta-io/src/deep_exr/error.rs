use std::fmt;
use std::path::PathBuf;

/// Why a deep file could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.display())]
pub struct DeepError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it. Part of the message, therefore not also its `source`.
    pub problem: DeepProblem,
}

/// What is wrong with a deep file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeepProblem {
    /// The operating system's word.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] std::io::Error),
    /// The first bytes are not those of an OpenEXR file.
    #[error("is no OpenEXR file: it starts with {found:02x?} instead of [76, 2f, 31, 01]")]
    NotOpenExr {
        /// What it starts with, at most four bytes.
        found: Vec<u8>,
    },
    /// It has flat parts only.
    #[error("holds no deep picture; read it as a flat one")]
    NotDeep,
    /// A channel is missing without which a deep picture means nothing.
    #[error("has no channel {0:?}, which a deep picture needs; write it anew with it")]
    NoChannel(&'static str),
    /// The bytes break the rules of the format.
    #[error("is damaged {place}: {what}; make it anew")]
    Damaged {
        /// Where.
        place: DeepPlace,
        /// What was found, and what was expected.
        what: String,
    },
    /// A kind of file that is not read.
    #[error("is not read: {what}, {place}; {mend}")]
    Unsupported {
        /// Where the file says so.
        place: DeepPlace,
        /// What is not read.
        what: String,
        /// What can be done.
        mend: &'static str,
    },
    /// Unpacked, it would be larger than an honest file of that length can be.
    #[error("would unpack to over {asked} bytes, too many for {input} bytes; it is damaged")]
    TooLarge {
        /// Bytes asked for.
        asked: u64,
        /// Length of the file.
        input: u64,
    },
}

/// A place in a deep file. It reads as "in part 0, chunk 12, at byte 3456".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeepPlace {
    /// The part, counted from 0; `None` before the first.
    pub part: Option<usize>,
    /// The chunk (scanline or tile), counted from 0 in the order of the part's table; `None` in a header.
    pub chunk: Option<usize>,
    /// The byte, counted from 0.
    pub byte: u64,
}

impl fmt::Display for DeepPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.part, self.chunk) {
            (Some(part), Some(chunk)) => write!(f, "in part {part}, chunk {chunk}, ")?,
            (Some(part), None) => write!(f, "in the header of part {part}, ")?,
            _ => {}
        }
        write!(f, "at byte {}", self.byte)
    }
}
