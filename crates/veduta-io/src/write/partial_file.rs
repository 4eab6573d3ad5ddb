use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

/// A file on its way to its place: it has a name of its own beside it until [`PartialFile::finish`]
/// renames it. Dropped before that, it is removed.
#[derive(Debug)]
pub(crate) struct PartialFile {
    place: PathBuf,
    partial: PathBuf,
    writer: Option<BufWriter<File>>,
}

/// Partial files of this process that are neither finished nor removed.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the files that are being written; for the handler of an interrupt, after which the
/// process ends. Writing goes on to fail or to nowhere.
pub fn remove_unfinished() {
    let mut unfinished = unfinished();
    for partial in unfinished.drain(..) {
        // The process is ending: there is nobody left to tell.
        let _ = fs::remove_file(partial);
    }
}

/// The list, even if a thread died while it held it: it is right after every step.
fn unfinished() -> std::sync::MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl PartialFile {
    /// Begins a file that will stand at `place`.
    pub fn create(place: &Path) -> io::Result<Self> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let mut name = std::ffi::OsString::from(".");
        name.push(place.file_name().ok_or(io::ErrorKind::InvalidFilename)?);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        name.push(format!(".{}-{count}.part", std::process::id()));
        let partial = place.with_file_name(name);
        // Never one that is there: it may be another's.
        let file = File::options()
            .write(true)
            .create_new(true)
            .open(&partial)?;
        unfinished().push(partial.clone());
        Ok(Self {
            place: place.to_owned(),
            partial,
            writer: Some(BufWriter::with_capacity(1 << 20, file)),
        })
    }

    /// Puts the file in its place.
    pub fn finish(mut self) -> io::Result<()> {
        if let Some(writer) = self.writer.take() {
            writer
                .into_inner()
                .map_err(io::IntoInnerError::into_error)?;
        }
        fs::rename(&self.partial, &self.place)?;
        self.forget();
        Ok(())
    }

    fn forget(&self) {
        unfinished().retain(|other| *other != self.partial);
    }

    fn writer(&mut self) -> io::Result<&mut BufWriter<File>> {
        self.writer
            .as_mut()
            .ok_or_else(|| io::ErrorKind::NotConnected.into())
    }
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        self.writer = None;
        if unfinished().contains(&self.partial) {
            // The failure that led here is the one that is told.
            let _ = fs::remove_file(&self.partial);
            self.forget();
        }
    }
}

impl Write for PartialFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer()?.flush()
    }
}

impl Seek for PartialFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.writer()?.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("veduta-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for the test");
        folder
    }

    fn entries(folder: &Path) -> usize {
        fs::read_dir(folder).expect("the test's folder").count()
    }

    #[test]
    fn a_file_is_there_whole_or_not_at_all() {
        let folder = folder("whole");
        let place = folder.join("a.txt");
        let mut file = PartialFile::create(&place).expect("may write here");
        file.write_all(b"half").expect("may write");
        assert!(!place.exists());
        drop(file);
        assert_eq!(entries(&folder), 0, "a dropped file is gone");

        for text in ["first", "second"] {
            let mut file = PartialFile::create(&place).expect("may write here");
            file.write_all(text.as_bytes()).expect("may write");
            file.finish().expect("can be renamed");
            assert_eq!(fs::read_to_string(&place).expect("is there"), text);
        }
        assert_eq!(entries(&folder), 1);
        fs::remove_dir_all(folder).expect("can be removed");
    }

    #[test]
    fn a_place_that_cannot_be_taken_leaves_nothing_beside_it() {
        let folder = folder("taken");
        let place = folder.join("a.png");
        fs::create_dir(&place).expect("may write here");
        let file = PartialFile::create(&place).expect("may write here");
        assert!(
            file.finish().is_err(),
            "a folder cannot be replaced by a file"
        );
        assert_eq!(entries(&folder), 1);
        fs::remove_dir_all(folder).expect("can be removed");
    }
}
