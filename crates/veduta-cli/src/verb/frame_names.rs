//! Names of files that have the numbers of frames in them: `out.####.png`.

use crate::exit::{Code, Failure};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// The names of the frames' files.
#[derive(Debug)]
pub struct FrameNames<'a> {
    pub pattern: &'a Path,
    /// The file's name before and after the number's digits, and their count, if it has any.
    number: Option<(String, usize, String)>,
}

impl<'a> FrameNames<'a> {
    /// Names by a pattern with `#` for digits, which `several` frames need.
    pub fn of(pattern: &'a Path, several: bool) -> Result<Self, Failure> {
        let usage = |problem: &str| {
            let message = format!("{}: {problem}", pattern.display());
            Err(Failure::new(Code::Usage, message))
        };
        if pattern.as_os_str() == "-" {
            return usage("frames are files; name them, such as out.####.png");
        }
        let Some(name) = pattern.file_name().and_then(|name| name.to_str()) else {
            return usage("frames are named by text, such as out.####.png");
        };
        let number = number_in(name);
        if number.is_none() && several {
            return usage("frames need # where their numbers come, such as out.####.png");
        }
        Ok(Self { pattern, number })
    }

    /// Names of files that are there, which need no digits.
    pub fn of_input(pattern: &'a Path) -> Self {
        let name = pattern.file_name().and_then(|name| name.to_str());
        // A file of that very name is no pattern.
        let number = name.filter(|_| !pattern.exists()).and_then(number_in);
        Self { pattern, number }
    }

    /// Whether each frame has a file of its own.
    pub fn has_number(&self) -> bool {
        self.number.is_some()
    }

    /// The numbers of the frames whose files are there.
    pub fn numbers_there(&self) -> io::Result<BTreeSet<u32>> {
        let Some((before, _, after)) = &self.number else {
            return Ok(BTreeSet::new());
        };
        let folder = match self.pattern.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut found = BTreeSet::new();
        for entry in std::fs::read_dir(folder)? {
            let name = entry?.file_name();
            let digits = name.to_str().and_then(|name| {
                let rest = name.strip_prefix(before.as_str())?;
                rest.strip_suffix(after.as_str())
            });
            let number = digits.and_then(|digits| {
                let is_number = digits.bytes().all(|byte| byte.is_ascii_digit());
                is_number.then(|| digits.parse().ok())?
            });
            // As it would be written: 7 is not frame 7 of ####.
            found.extend(
                number.filter(|&number| self.path(number).file_name() == Some(name.as_os_str())),
            );
        }
        Ok(found)
    }

    pub fn path(&self, frame: u32) -> PathBuf {
        match &self.number {
            None => self.pattern.to_owned(),
            Some((before, digits, after)) => {
                let name = format!("{before}{frame:0width$}{after}", width = *digits);
                self.pattern.with_file_name(name)
            }
        }
    }
}

/// What stands before and after the last # of a name, and how many there are together.
fn number_in(name: &str) -> Option<(String, usize, String)> {
    let last = name.rfind('#')?;
    let before = name[..last].trim_end_matches('#');
    let digits = last + 1 - before.len();
    Some((before.to_owned(), digits, name[last + 1..].to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_their_numbers_in_their_names() {
        let name = |pattern: &str, frame| {
            let names = FrameNames::of(Path::new(pattern), true).expect("has a number");
            names.path(frame).to_string_lossy().into_owned()
        };
        assert_eq!(name("out.####.png", 7), "out.0007.png");
        assert_eq!(name("a/b#c##.exr", 123), "a/b#c123.exr");
        assert_eq!(name("#.png", 0), "0.png");
        assert!(FrameNames::of(Path::new("a#/out.png"), true).is_err());
        let one = FrameNames::of(Path::new("out.png"), false).expect("one frame needs none");
        assert_eq!(one.path(9), Path::new("out.png"));
    }

    #[test]
    fn frames_that_are_there_are_found_by_their_names() {
        let folder = std::env::temp_dir().join(format!("veduta-frames-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for the test");
        for name in [
            "a.0001.png",
            "a.0012.png",
            "a.7.png",
            "a.0003.exr",
            "b.0005.png",
            "a.x001.png",
        ] {
            std::fs::write(folder.join(name), "").expect("may write there");
        }
        let pattern = folder.join("a.####.png");
        let found = FrameNames::of_input(&pattern)
            .numbers_there()
            .expect("may be read");
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [1, 12]);
        assert!(!FrameNames::of_input(&folder.join("a.7.png")).has_number());
        std::fs::remove_dir_all(folder).expect("can be removed");
    }
}
