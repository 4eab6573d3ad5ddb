//! Deep pictures of `veduta render --deep` and `veduta shade --deep`: they are written while they are made.

use super::output::{Target, written_to_stdout};
use crate::exit::Failure;
use std::io;
use veduta::map::Camera;
use veduta::scene::Scene;
use veduta_io::deep_exr::{
    DeepCompression, DeepPicture, DeepSink, ObjectIds, stream_deep_picture, write_deep_picture,
};
use veduta_io::{Samples, WriteProblem};

/// Where a deep picture goes, and how it is stored.
#[derive(Debug)]
pub struct DeepTarget<'a> {
    pub target: &'a Target,
    pub compression: DeepCompression,
    pub samples: Samples,
}

impl DeepTarget<'_> {
    /// Writes there the rows that `make` hands over, of a picture of `scene` whose frame is that of
    /// `camera`. How many samples were written, and what `make` tells.
    pub fn write<T: Default>(
        &self,
        scene: &Scene,
        camera: Camera,
        [width, height]: [u32; 2],
        make: impl FnOnce(&mut DeepSink) -> Result<T, WriteProblem>,
    ) -> Result<(u64, T), Failure> {
        let names = scene.objects.iter().map(|object| object.name.as_str());
        let picture = DeepPicture {
            width,
            height,
            camera,
            objects: ObjectIds::of_names(names),
            samples: self.samples,
            compression: self.compression,
        };
        let make = |sink: &mut DeepSink| -> Result<(u64, T), WriteProblem> {
            let made = make(sink)?;
            Ok((sink.samples_written(), made))
        };
        match self.target.file() {
            Some(path) => Ok(write_deep_picture(path, &picture, make)?),
            None => stream_deep_picture(&mut io::stdout().lock(), &picture, make)
                .or_else(|problem| written_to_stdout(problem).map(|()| Default::default())),
        }
    }

    /// The name to tell.
    pub fn name(&self) -> String {
        self.target.name()
    }
}
