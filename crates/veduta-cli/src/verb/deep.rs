//! `veduta render --deep`: a deep picture is written while it is made.

use super::output::{Target, written_to_stdout};
use super::render::tell_step;
use crate::exit::Failure;
use crate::talk::Talk;
use std::io;
use veduta::map::Camera;
use veduta::pipeline::{self, RenderSettings};
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
    /// Makes the picture there; returns how many samples were written.
    pub fn write(
        &self,
        scene: &Scene,
        camera: &Camera,
        settings: &RenderSettings,
        talk: &mut Talk,
    ) -> Result<u64, Failure> {
        let names = scene.objects.iter().map(|object| object.name.as_str());
        let picture = DeepPicture {
            width: settings.width,
            height: settings.height,
            camera: *camera,
            objects: ObjectIds::of_names(names),
            samples: self.samples,
            compression: self.compression,
        };
        let make = |sink: &mut DeepSink| -> Result<u64, WriteProblem> {
            let begin = |step| tell_step(step, talk);
            let write = |rows: &_| sink.write(rows);
            pipeline::render_deep(scene, camera, settings, begin, write)?;
            Ok(sink.samples_written())
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
