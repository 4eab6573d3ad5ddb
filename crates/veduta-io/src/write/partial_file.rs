//! Files that are there whole or not at all.
//!
//! On Linux the file has no name while it is written (`O_TMPFILE`), so that nothing is left of it
//! whatever ends the process, SIGKILL and power cuts included. Where the file system knows no such
//! files (NFS, FAT), and elsewhere, it stands beside its place as `.NAME.PID-COUNT.part` and is
//! removed on failure and on interrupt; only a kill that cannot be caught leaves it there.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

/// A file on its way to its place, which it takes in [`PartialFile::finish`]. Dropped before that,
/// nothing is left of it.
#[derive(Debug)]
pub(crate) struct PartialFile {
    place: PathBuf,
    /// Its name until it is finished; `None` while it has none.
    partial: Option<PathBuf>,
    writer: Option<BufWriter<File>>,
}

/// Partial files of this process that have a name and are neither finished nor removed.
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

/// A name beside `place` that no other file of this process gets.
fn name_beside(place: &Path) -> io::Result<PathBuf> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let mut name = std::ffi::OsString::from(".");
    name.push(place.file_name().ok_or(io::ErrorKind::InvalidFilename)?);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    name.push(format!(".{}-{count}.part", std::process::id()));
    Ok(place.with_file_name(name))
}

impl PartialFile {
    /// Begins a file that will stand at `place`; if a symbolic link stands there, where it leads to.
    pub fn create(place: &Path) -> io::Result<Self> {
        let place = match fs::canonicalize(place) {
            Ok(resolved) => resolved,
            Err(_) => place.to_owned(),
        };
        let partial = name_beside(&place)?;
        if let Some(file) = nameless::create(&place)? {
            return Ok(Self::new(place, None, file));
        }
        // Never one that is there: it may be another's.
        let file = File::options()
            .write(true)
            .create_new(true)
            .open(&partial)?;
        unfinished().push(partial.clone());
        Ok(Self::new(place, Some(partial), file))
    }

    fn new(place: PathBuf, partial: Option<PathBuf>, file: File) -> Self {
        Self {
            place,
            partial,
            writer: Some(BufWriter::with_capacity(1 << 20, file)),
        }
    }

    /// Puts the file in its place.
    pub fn finish(mut self) -> io::Result<()> {
        let writer = self.writer.take().ok_or(io::ErrorKind::NotConnected)?;
        let file = writer
            .into_inner()
            .map_err(io::IntoInnerError::into_error)?;
        let partial = match &self.partial {
            Some(partial) => partial.clone(),
            None => {
                // Where nothing stands it goes there at once. A name cannot be taken from another
                // file in one step, so that otherwise it gets one of its own first, whole as it is.
                if nameless::give_name(&file, &self.place)? {
                    return Ok(());
                }
                let partial = name_beside(&self.place)?;
                unfinished().push(partial.clone());
                self.partial = Some(partial.clone());
                if !nameless::give_name(&file, &partial)? {
                    return Err(io::ErrorKind::AlreadyExists.into());
                }
                partial
            }
        };
        fs::rename(partial, &self.place)?;
        self.forget();
        Ok(())
    }

    fn forget(&mut self) {
        if let Some(partial) = self.partial.take() {
            unfinished().retain(|other| *other != partial);
        }
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
        if let Some(partial) = &self.partial {
            // The failure that led here is the one that is told.
            let _ = fs::remove_file(partial);
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

/// Files that have no name until they are given one.
#[cfg(target_os = "linux")]
mod nameless {
    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, open};
    use rustix::io::Errno;
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::Path;

    /// A file without name on the file system of `place`; `None` where there are no such files.
    pub fn create(place: &Path) -> io::Result<Option<File>> {
        let folder = match place.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        // Its name will be given by its number there.
        if !Path::new("/proc/self/fd").exists() {
            return Ok(None);
        }
        let flags = OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC;
        match open(folder, flags, Mode::from_raw_mode(0o666)) {
            Ok(file) => Ok(Some(File::from(file))),
            Err(Errno::OPNOTSUPP | Errno::ISDIR | Errno::NOENT | Errno::INVAL) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Names the file; `false` if something of that name is there already.
    pub fn give_name(file: &File, name: &Path) -> io::Result<bool> {
        let number = format!("/proc/self/fd/{}", file.as_raw_fd());
        match linkat(CWD, number, CWD, name, AtFlags::SYMLINK_FOLLOW) {
            Ok(()) => Ok(true),
            Err(Errno::EXIST) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod nameless {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    pub fn create(_place: &Path) -> io::Result<Option<File>> {
        Ok(None)
    }

    /// Never called: no file is without a name here.
    pub fn give_name(_file: &File, _name: &Path) -> io::Result<bool> {
        Err(io::ErrorKind::Unsupported.into())
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

    /// As where the file system knows no files without name.
    fn create_named(place: &Path) -> PartialFile {
        let partial = name_beside(place).expect("a file's name");
        let file = File::create_new(&partial).expect("may write here");
        unfinished().push(partial.clone());
        PartialFile::new(place.to_owned(), Some(partial), file)
    }

    #[test]
    fn a_file_is_there_whole_or_not_at_all() {
        let folder = folder("whole");
        let place = folder.join("a.txt");
        let create = |place: &Path| PartialFile::create(place).expect("may write here");
        for (way, create) in [
            ("as can be", &create as &dyn Fn(&Path) -> PartialFile),
            ("named", &create_named),
        ] {
            let mut file = create(&place);
            file.write_all(b"half").expect("may write");
            assert!(!place.exists());
            drop(file);
            assert_eq!(entries(&folder), 0, "{way}: a dropped file is gone");

            for text in ["first", "second"] {
                let mut file = create(&place);
                file.write_all(text.as_bytes()).expect("may write");
                file.finish().expect("can be renamed");
                assert_eq!(fs::read_to_string(&place).expect("is there"), text);
            }
            assert_eq!(entries(&folder), 1, "{way}");
            fs::remove_file(&place).expect("can be removed");
        }
        fs::remove_dir_all(folder).expect("can be removed");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_that_is_being_written_has_no_name() {
        let folder = folder("nameless");
        let mut file = PartialFile::create(&folder.join("a.txt")).expect("may write here");
        file.write_all(b"half").expect("may write");
        file.flush().expect("may write");
        if file.partial.is_some() {
            println!("skipped: {} has no files without name", folder.display());
        } else {
            assert_eq!(entries(&folder), 0);
        }
        drop(file);
        fs::remove_dir_all(folder).expect("can be removed");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_one_and_what_it_leads_to_is_replaced() {
        let folder = folder("link");
        let (real, link) = (folder.join("real.txt"), folder.join("link.txt"));
        fs::write(&real, "old").expect("may write here");
        std::os::unix::fs::symlink(&real, &link).expect("may link here");
        let mut file = PartialFile::create(&link).expect("may write here");
        file.write_all(b"new").expect("may write");
        file.finish().expect("can be renamed");
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&real).expect("is there"), "new");
        assert_eq!(entries(&folder), 2);
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
