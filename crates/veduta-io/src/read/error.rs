use std::fmt;
use std::path::{Path, PathBuf};
use veduta::scene::MeshError;

/// Why a scene could not be read: in which file, where in it, and what is wrong there.
///
/// Displayed as `file:line: what is wrong; how to mend it`, or `file: place: …` where the place is
/// not a line.
#[derive(Debug, thiserror::Error)]
#[error("{}{place}: {problem}", file.display())]
pub struct ReadError {
    /// The file.
    pub file: Box<Path>,
    /// Where in the file.
    pub place: Place,
    /// What is wrong there. Part of the message, therefore not also its `source`.
    pub problem: Problem,
    /// What more is known if it is of a file that people write.
    pub detail: Option<Box<Detail>>,
}

/// What more is known of an error in a file that people write.
#[derive(Debug)]
pub struct Detail {
    /// The line it is about.
    pub excerpt: Excerpt,
    /// What else was found wrong in the same file, in the order of its text.
    pub further: Vec<ReadError>,
}

/// A line of a text file, and the part of it that an error is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excerpt {
    /// The line, or what of it is around the place; without control characters.
    pub line: String,
    /// Characters of `line` before the part.
    pub before: usize,
    /// Characters of the part, at least 1; they may go on past the end of the line.
    pub length: usize,
}

impl ReadError {
    /// This error, and then those that were found with it.
    pub fn all(&self) -> impl Iterator<Item = &ReadError> {
        let further = self.detail.iter().flat_map(|detail| &detail.further);
        std::iter::once(self).chain(further)
    }

    /// Who can mend it.
    pub fn kind(&self) -> ErrorKind {
        match self.problem {
            Problem::Unreadable(_) | Problem::NoSuchFile { .. } => ErrorKind::InputOutput,
            Problem::UnknownFormat { .. }
            | Problem::Version { .. }
            | Problem::PointCloud { .. }
            | Problem::RequiredExtension { .. }
            | Problem::RemoteUri(_)
            | Problem::NotYet { .. } => ErrorKind::Unsupported,
            Problem::NotThere { .. }
            | Problem::NoBinChunk
            | Problem::NoFile { .. }
            | Problem::NoAnimation { .. } => ErrorKind::Missing,
            _ => ErrorKind::BadInput,
        }
    }
}

/// Who can mend an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The file is damaged, or breaks the rules of its format.
    BadInput,
    /// Something that the file names is not there.
    Missing,
    /// The file may be fine, but uses what is not supported here.
    Unsupported,
    /// The operating system did not let it be read.
    InputOutput,
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line of a text file, counted from 1.
    Line(u64),
    /// A character of a text file.
    Text {
        /// Its line, counted from 1.
        line: u64,
        /// Which character of the line it is, counted from 1.
        column: u64,
    },
    /// An offset from the start of a binary file.
    Byte(u64),
    /// A path into a JSON document, such as `meshes[3].primitives[0].indices`.
    Json(String),
    /// A path into the JSON document on a line of a file of such lines.
    JsonInLine {
        /// The line, counted from 1.
        line: u64,
        /// The path.
        path: String,
    },
}

impl fmt::Display for Place {
    /// What follows the file's name in a message.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Whole => Ok(()),
            Place::Line(line) => write!(f, ":{line}"),
            Place::Text { line, column } => write!(f, ":{line}:{column}"),
            Place::Byte(offset) => write!(f, ": byte {offset}"),
            Place::Json(path) => write!(f, ": {path}"),
            Place::JsonInLine { line, path } => write!(f, ":{line}: {path}"),
        }
    }
}

/// What is wrong at a place of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The operating system's word.
    #[error("cannot be read: {}", crate::reason(.0))]
    Unreadable(std::io::Error),
    /// Nothing stands at the path.
    #[error("there is no such file{}", asked(.meant))]
    NoSuchFile {
        /// The name of a file beside it that may be meant.
        meant: Option<Box<str>>,
    },
    /// Neither the suffix nor the first bytes tell what it is.
    #[error("is of no format that is read here; scenes are read from {known}")]
    UnknownFormat {
        /// The suffixes of the formats that are read.
        known: String,
    },
    /// A version of the format that is not read.
    #[error("is {found}, expected {expected}; convert it with the program that made it")]
    Version {
        /// The version found.
        found: String,
        /// The versions that are read.
        expected: &'static str,
    },
    /// The bytes end too early.
    #[error(
        "{what} needs {needed} bytes, but {present} are there; the file is cut short or damaged"
    )]
    Truncated {
        /// What needs them.
        what: &'static str,
        /// How many it needs.
        needed: u64,
        /// How many there are.
        present: u64,
    },
    /// The first bytes are not those of the format.
    #[error("starts with {found:02x?}, which is no {format} file")]
    WrongMagic {
        /// The format that the file's name promises.
        format: &'static str,
        /// The first bytes.
        found: Vec<u8>,
    },
    /// The JSON does not parse, or not to what glTF asks for.
    #[error("is not valid glTF: {0}")]
    Json(String),
    /// The file breaks the grammar of its format.
    #[error("is not valid {format}: {found}")]
    NotValid {
        /// The format.
        format: &'static str,
        /// What is wrong.
        found: String,
    },
    /// The file says that it cannot be understood without an extension.
    #[error("the extension {name} is required but not supported; {mend}")]
    RequiredExtension {
        /// Its name.
        name: String,
        /// What a user can do.
        mend: &'static str,
    },
    /// Compressed data that does not decompress.
    #[error("the {codec} data does not decompress: {reason}; the file is damaged")]
    Compressed {
        /// How it is compressed.
        codec: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// A file that the file names is not there, or is no file.
    #[error("names {}, which cannot be read: {}; put it there or export to .glb", path.display(), crate::reason(source))]
    NotThere {
        /// The path that was tried.
        path: PathBuf,
        /// Why it could not be read.
        source: std::io::Error,
    },
    /// A buffer without URI, in a file without binary chunk.
    #[error(
        "has no uri, and the file has no binary chunk; it needs the .bin file that belongs to it"
    )]
    NoBinChunk,
    /// An address on the network.
    #[error("{0:?} is not a path to a file; download it and put it beside the model")]
    RemoteUri(String),
    /// A `data:` URI that does not decode.
    #[error("is no valid data URI: {0}")]
    DataUri(String),
    /// The animation that was asked for does not exist.
    #[error("has no animation {name:?}; {help}")]
    NoAnimation {
        /// The name that was asked for.
        name: String,
        /// What may be meant.
        help: String,
    },
    /// An index to a row that does not exist.
    #[error("refers to {what} {index}, counted from 0, but the file has {count}")]
    NoSuch {
        /// What kind of row.
        what: &'static str,
        /// The index found.
        index: u64,
        /// Number of rows.
        count: usize,
    },
    /// Something that must be there is not.
    #[error("has no {0}")]
    Lacks(&'static str),
    /// A value outside its legal range.
    #[error("is {found}, expected {expected}")]
    Illegal {
        /// What is there.
        found: String,
        /// What may be there.
        expected: &'static str,
    },
    /// Reading on would take more memory than the input justifies.
    #[error(
        "asks for {asked} bytes more of memory, which input of {input} bytes does not justify; \
         the file is damaged, or repeats the same data too often"
    )]
    TooLarge {
        /// How much was asked for.
        asked: u64,
        /// Length of everything read so far.
        input: u64,
    },
    /// A node that contains itself.
    #[error("is its own descendant; nodes must form a tree")]
    Cycle,
    /// A node that is reached twice.
    #[error("node {node} has a parent already, {parent}; a node may be placed once")]
    PlacedTwice {
        /// The node.
        node: usize,
        /// Who placed it first.
        parent: String,
    },
    /// An index of a face or triangle past the vertices.
    #[error("index {at} is {index}, but the number of vertices is {vertices}")]
    IndexOutOfRange {
        /// Which index of the accessor.
        at: usize,
        /// Its value.
        index: u32,
        /// Number of vertices.
        vertices: u64,
    },
    /// A vertex that is placed out of this world.
    #[error(
        "{what} reaches {reach:e} m from the origin, expected less than {limit:e} m; mend its coordinates or transform"
    )]
    TooFar {
        /// The object.
        what: String,
        /// How far.
        reach: f64,
        /// How far is allowed.
        limit: f64,
    },
    /// A token of a text file that is not what is expected there.
    #[error("{} where {expected} should stand", told(found))]
    Token {
        /// The token, shortened; empty at the end of the line.
        found: String,
        /// What should stand there.
        expected: &'static str,
    },
    /// A reference of an OBJ face to an element that was not given before it.
    #[error("refers to {what} {index}, but {count} stand before it")]
    NoSuchBefore {
        /// `vertex`, `texture coordinate` or `normal`.
        what: &'static str,
        /// The reference as written: from 1, or negative from the last.
        index: i64,
        /// How many were given before.
        count: usize,
    },
    /// Points without faces.
    #[error(
        "has {points} points but no faces; make a surface of them first, for example in MeshLab"
    )]
    PointCloud {
        /// How many points.
        points: usize,
    },
    /// A face with too few or too many corners.
    #[error("a face with {found} corners, expected 3 to {most}")]
    Corners {
        /// Number of corners.
        found: usize,
        /// The most that are read.
        most: usize,
    },
    /// A scene file is no TOML.
    #[error("is not valid TOML: {0}")]
    Toml(String),
    /// A key that a scene file may not have there. The JSON Schema refuses it, too.
    #[error("unknown key {found:?} in {table}; {help}")]
    UnknownKey {
        /// The key.
        found: Box<str>,
        /// What it stands in.
        table: &'static str,
        /// The key that may be meant, or those that there are.
        help: Box<str>,
    },
    /// A key that must be there is not. The JSON Schema refuses it, too.
    #[error("{table} has no {key:?}, which it needs")]
    LacksKey {
        /// What should have it.
        table: &'static str,
        /// The key.
        key: &'static str,
    },
    /// A key that means nothing without another. The JSON Schema refuses it, too.
    #[error("{key:?} is given without {other:?}, which it needs")]
    NeedsKey {
        /// The key that is there.
        key: &'static str,
        /// The one that is not.
        other: &'static str,
    },
    /// Two keys that say the same in different ways. The JSON Schema refuses them, too.
    #[error("{second:?} and {first:?} exclude each other; keep one of them")]
    Exclude {
        /// The key that stands first in the file.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// A value of the wrong form. The JSON Schema refuses it, too.
    #[error("{key} is {found}, expected {expected}")]
    WrongValue {
        /// Of what it is the value.
        key: Box<str>,
        /// What is there.
        found: Box<str>,
        /// What may be there.
        expected: &'static str,
    },
    /// A value of the right form that is out of range in a way that a JSON Schema cannot say.
    #[error("{key} is {found}, expected {expected}")]
    OutOfRange {
        /// Of what it is the value.
        key: Box<str>,
        /// What is there.
        found: Box<str>,
        /// What may be there.
        expected: &'static str,
    },
    /// A part of scene files that is planned. The JSON Schema refuses it, too.
    #[error("{key:?} is not supported yet in scene files; leave it out")]
    NotYet {
        /// The key.
        key: &'static str,
    },
    /// Something in a scene file or its tables that has the right form but makes no sense: a
    /// sentence.
    #[error("{0}")]
    Senseless(String),
    /// A file that a scene file names cannot be read.
    #[error("names {}, which cannot be read: {reason}", path.display())]
    NoFile {
        /// The path that was tried.
        path: PathBuf,
        /// Why it could not be read, and a file that may be meant.
        reason: String,
    },
    /// The mesh that was read is unsound.
    #[error("mesh {name:?}: {fault}; export the model anew")]
    Mesh {
        /// Its name.
        name: String,
        /// What is wrong; in a box, since errors are passed about by value.
        fault: Box<MeshError>,
    },
}

/// A token of a text file, for messages.
fn told(token: &str) -> String {
    match token {
        "" => "the line ends".to_owned(),
        token => format!("{token:?}"),
    }
}

/// Whether that name is meant.
fn asked(meant: &Option<Box<str>>) -> String {
    match meant {
        Some(name) => format!("; did you mean {name:?}?"),
        None => String::new(),
    }
}

impl Problem {
    /// Says at which place.
    pub(crate) fn at(self, place: Place) -> Fault {
        Fault {
            place,
            problem: self,
        }
    }

    /// Says at which path of the JSON document.
    #[cfg(feature = "gltf")]
    pub(crate) fn at_json(self, path: impl Into<String>) -> Fault {
        self.at(Place::Json(path.into()))
    }
}

/// A [`ReadError`] that has not yet been told its file.
#[derive(Debug)]
pub(crate) struct Fault {
    pub place: Place,
    pub problem: Problem,
}

impl Fault {
    /// Says in which file.
    pub fn of(self, file: &Path) -> ReadError {
        ReadError {
            file: file.into(),
            place: self.place,
            problem: self.problem,
            detail: None,
        }
    }
}

/// Something that was read otherwise than the file asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file.
    pub file: PathBuf,
    /// Where in the file.
    pub place: Place,
    /// What was found, and what was made of it.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}: {}", self.file.display(), self.place, self.message)
    }
}

/// Collects the warnings of one file, so many that a person may still read them.
#[derive(Debug)]
pub(crate) struct Warnings {
    file: PathBuf,
    rows: Vec<Warning>,
    left_out: usize,
}

/// More warnings than this about one file help nobody.
const MOST_WARNINGS: usize = 40;

impl Warnings {
    pub fn new(file: PathBuf) -> Self {
        Self {
            file,
            rows: Vec::new(),
            left_out: 0,
        }
    }

    pub fn add(&mut self, place: Place, message: impl Into<String>) {
        self.add_in(self.file.clone(), place, message);
    }

    /// Adds a warning about a file that belongs to this one.
    pub fn add_in(&mut self, file: PathBuf, place: Place, message: impl Into<String>) {
        self.append([Warning {
            file,
            place,
            message: message.into(),
        }]);
    }

    /// Adds the warnings of files that belong to this one.
    pub fn append(&mut self, warnings: impl IntoIterator<Item = Warning>) {
        for warning in warnings {
            if self.rows.len() < MOST_WARNINGS {
                self.rows.push(warning);
            } else {
                self.left_out += 1;
            }
        }
    }

    pub fn finish(mut self) -> Vec<Warning> {
        if self.left_out > 0 {
            self.rows.push(Warning {
                file: self.file,
                place: Place::Whole,
                message: format!("{} more warnings of such kinds are left out", self.left_out),
            });
        }
        self.rows
    }
}
