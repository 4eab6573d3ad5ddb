//! How the command ends: what each exit code means, and the one way to fail.

use crate::excerpt::with_excerpts;
use std::fmt;
use std::io::{self, IsTerminal};
use veduta::map::file::FileError;
use veduta_io::deep_exr::DeepProblem;
use veduta_io::{
    CastersError, ErrorKind, MapFileError, PictureProblem, ReadError, ReadPictureError, WriteError,
    WriteProblem,
};

/// Exit codes. `0` is success, `130` an interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Code {
    /// What was checked is not as it should be.
    CheckFailed = 1,
    /// The command line asks for something that makes no sense.
    Usage = 2,
    /// Something that is named is missing.
    Missing = 3,
    /// The input is damaged or cannot be shown.
    BadInput = 4,
    /// The input may be fine, but uses what is not supported.
    Unsupported = 5,
    /// The operating system refused to read or write.
    InputOutput = 6,
    /// A fault of the program itself (`EX_SOFTWARE` of sysexits.h).
    Internal = 70,
    /// The user, or the system, interrupted it (128 + SIGINT; the same for SIGTERM and SIGHUP).
    Interrupted = 130,
}

/// How a verb that did its work ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// As it should.
    Fine,
    /// With what was checked not as it should be, which has been told.
    CheckFailed,
}

/// Why a verb failed, in a sentence.
#[derive(Debug)]
pub struct Failure {
    pub code: Code,
    message: String,
}

impl Failure {
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        let code = match error.kind() {
            ErrorKind::BadInput => Code::BadInput,
            ErrorKind::Missing => Code::Missing,
            ErrorKind::Unsupported => Code::Unsupported,
            ErrorKind::InputOutput => Code::InputOutput,
        };
        let colored = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        Self::new(code, with_excerpts(&error, "\nveduta: error: ", colored))
    }
}

impl From<MapFileError> for Failure {
    fn from(error: MapFileError) -> Self {
        let code = match error.problem {
            FileError::Io { .. } => Code::InputOutput,
            FileError::Version { .. } => Code::Unsupported,
            _ => Code::BadInput,
        };
        Self::new(code, error.to_string())
    }
}

impl From<CastersError> for Failure {
    fn from(error: CastersError) -> Self {
        let code = match error {
            CastersError::Map(error) => return error.into(),
            CastersError::Scene(error) => return (*error).into(),
            CastersError::Reading { .. } => Code::Unsupported,
            _ => Code::Missing,
        };
        Self::new(code, error.to_string())
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        let code = match error.problem {
            WriteProblem::UnknownSuffix(_)
            | WriteProblem::UnknownModelSuffix(_)
            | WriteProblem::NoSuchSamples { .. } => Code::Usage,
            WriteProblem::Model(_) => Code::Unsupported,
            _ => Code::InputOutput,
        };
        Self::new(code, error.to_string())
    }
}

impl From<ReadPictureError> for Failure {
    fn from(error: ReadPictureError) -> Self {
        let code = match error.problem {
            PictureProblem::Unreadable(_) => Code::InputOutput,
            PictureProblem::UnknownFormat(_)
            | PictureProblem::Unsupported(_)
            | PictureProblem::Deep(DeepProblem::Unsupported { .. }) => Code::Unsupported,
            _ => Code::BadInput,
        };
        Self::new(code, error.to_string())
    }
}
