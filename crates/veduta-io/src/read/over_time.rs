//! A scene at several moments: what does not depend on time is read once.

use super::{Loaded, Moment, ReadError, ReadOptions, read_model, read_with};
use std::path::{Path, PathBuf};

/// A scene that is read at several moments. What does not depend on time comes from its files once.
#[derive(Debug)]
pub struct SceneOverTime {
    path: PathBuf,
    options: ReadOptions,
    models: Models,
}

impl SceneOverTime {
    /// The scene of a file, which is read when it is asked for. Its moment in `options` is of no
    /// account.
    pub fn new(path: &Path, options: ReadOptions) -> Self {
        Self {
            path: path.to_owned(),
            options,
            models: Models {
                keeps: true,
                kept: Vec::new(),
            },
        }
    }

    /// The scene at a moment.
    ///
    /// # Errors
    /// As [`read_scene`](super::read_scene).
    pub fn at(&mut self, moment: Moment) -> Result<Loaded, ReadError> {
        let options = ReadOptions {
            moment,
            ..self.options.clone()
        };
        read_with(&self.path, &options, &mut self.models)
    }
}

/// Models, which are read from their files or have been before.
#[derive(Debug, Default)]
pub(crate) struct Models {
    /// Whether models are kept.
    keeps: bool,
    /// As they were asked for. Few, so that none is worth a faster search.
    kept: Vec<(PathBuf, ReadOptions, Loaded)>,
}

impl Models {
    /// Reads a model that is no scene file.
    pub fn read(&mut self, path: &Path, options: &ReadOptions) -> Result<Loaded, ReadError> {
        let mut kept = self.kept.iter();
        if let Some((_, _, loaded)) = kept.find(|row| row.0 == path && row.1.is_kept_for(options)) {
            return Ok(loaded.clone());
        }
        let loaded = read_model(path, options)?;
        // One that moves is another at the next moment.
        if self.keeps && (options.moment == Moment::Rest || loaded.animations.is_empty()) {
            let row = (path.to_owned(), options.clone(), loaded.clone());
            self.kept.push(row);
        }
        Ok(loaded)
    }
}

impl ReadOptions {
    /// Whether a model that was read and kept with these options is what others ask for. Those kept do
    /// not depend on time, unless they are at rest where time is asked for.
    fn is_kept_for(&self, asked: &Self) -> bool {
        let timeless = |options: &Self| Self {
            moment: Moment::Rest,
            ..options.clone()
        };
        (self.moment == Moment::Rest) == (asked.moment == Moment::Rest)
            && timeless(self) == timeless(asked)
    }
}
