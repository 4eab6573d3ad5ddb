//! What a scene file draws in: which files are being read, how much memory all may take, and at which
//! moment all is read.

use crate::read::budget::Budget;
use crate::read::error::{Problem, ReadError};
use crate::read::over_time::Models;
use crate::read::{Loaded, ReadOptions};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use veduta::map::Source;
use veduta::scene::{Mesh, Object, Scene};

/// Scene files within scene files, so deep; deeper would only be a way to use up the stack.
const MOST_NESTED: usize = 32;
/// What reading a model costs besides its size, in bytes: so that a small model cannot be asked for
/// a million times by scene files that double each other.
const LOAD_COST: usize = 16 << 10;
/// Bytes that the pictures of all models may take together.
const MOST_PICTURE_BYTES: u64 = 4 << 30;

/// The files that are being read, each because the one before names it.
#[derive(Debug)]
pub(crate) struct Inclusion<'m> {
    /// Scene files, from the outermost to the innermost: as named, and in one way only.
    chain: Vec<(PathBuf, PathBuf)>,
    /// Files whose length the budget has been told.
    known: BTreeSet<PathBuf>,
    budget: Budget,
    picture_bytes: u64,
    /// Models that may have been read before.
    models: &'m mut Models,
}

impl<'m> Inclusion<'m> {
    /// For a scene file that nobody includes.
    pub fn new(models: &'m mut Models) -> Self {
        Self {
            models,
            chain: Vec::new(),
            known: BTreeSet::new(),
            budget: Budget::new(),
            picture_bytes: 0,
        }
    }

    /// Reads a model that is no scene file.
    pub fn read_model(&mut self, path: &Path, options: &ReadOptions) -> Result<Loaded, ReadError> {
        self.models.read(path, options)
    }

    /// Says that `scene_file` is being read until [`Inclusion::leave`].
    ///
    /// # Errors
    /// When it is being read already: it would never end.
    pub fn enter(&mut self, scene_file: &Path) -> Result<(), Problem> {
        let unique = unique(scene_file);
        if let Some(first) = self.chain.iter().position(|(_, known)| *known == unique) {
            let circle = self.chain[first..].iter().map(|(named, _)| named.as_path());
            let circle: Vec<_> = circle
                .chain([scene_file])
                .map(|path| path.display().to_string())
                .collect();
            let circle = circle.join(" -> ");
            return Err(Problem::Senseless(format!(
                "a scene file cannot be a part of itself: {circle}"
            )));
        }
        if self.chain.len() >= MOST_NESTED {
            return Err(Problem::Senseless(format!(
                "scene files are nested more than {MOST_NESTED} deep"
            )));
        }
        self.chain.push((scene_file.to_owned(), unique));
        Ok(())
    }

    /// Ends what [`Inclusion::enter`] began.
    pub fn leave(&mut self) {
        self.chain.pop();
    }

    /// A file's bytes. It justifies memory once.
    pub fn read(&mut self, file: &Path) -> io::Result<Vec<u8>> {
        let bytes = self.budget.files.read(file)?;
        self.add_input(file, bytes.len());
        Ok(bytes)
    }

    /// Says which files a model was read from.
    pub fn append_files(&mut self, files: Vec<Source>) {
        self.budget.files.append(files);
    }

    /// All files that were read.
    pub fn finish(self) -> Vec<Source> {
        self.budget.files.finish()
    }

    /// Says that a file of `length` bytes has been read. A file justifies memory once.
    pub fn add_input(&mut self, file: &Path, length: usize) {
        if self.known.insert(unique(file)) {
            self.budget.add_input(length);
        }
    }

    /// Accounts for a model that was read from `file`.
    ///
    /// # Errors
    /// When the files read so far do not justify so much.
    pub fn charge_model(&mut self, file: &Path, scene: &Scene) -> Result<(), Problem> {
        let length = std::fs::metadata(file).map_or(0, |metadata| metadata.len());
        self.add_input(file, usize::try_from(length).unwrap_or(usize::MAX));
        let of_mesh = |mesh: &Mesh| {
            24 * mesh.positions.len()
                + 12 * (mesh.triangles.len() + mesh.normals.len() + mesh.colors.len())
                + 8 * (mesh.texcoords.len() + mesh.second_texcoords.len())
                + 4 * mesh.opacities.len()
        };
        let of_object = |object: &Object| size_of::<Object>() + object.name.len();
        let bytes = LOAD_COST
            + scene.meshes.iter().map(of_mesh).sum::<usize>()
            + scene.objects.iter().map(of_object).sum::<usize>();
        self.budget.charge(bytes as u64, 1)?;
        for image in &scene.images {
            self.charge_picture(image.pixels.len())?;
        }
        Ok(())
    }

    /// Accounts for a picture.
    ///
    /// # Errors
    /// When all pictures together are too large.
    pub fn charge_picture(&mut self, pixels: usize) -> Result<(), Problem> {
        self.picture_bytes += 4 * pixels as u64;
        if self.picture_bytes > MOST_PICTURE_BYTES {
            return Err(Problem::Senseless(
                "the pictures of all layers together take more than 4 GiB; make them smaller, or \
                 use `instances` where a model stands more than once"
                    .into(),
            ));
        }
        Ok(())
    }

    /// Accounts for `rows` rows of `row_bytes` bytes.
    ///
    /// # Errors
    /// When the files read so far do not justify so much.
    pub fn charge(&mut self, rows: usize, row_bytes: usize) -> Result<(), Problem> {
        self.budget.charge(rows as u64, row_bytes)
    }
}

/// A path by which a file is known, whatever way leads to it.
fn unique(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}
