//! `veduta frames`: the pictures of an animation, one after the other.

use super::frame_names::FrameNames;
use super::look::{Development, Look};
use super::output::{Output, Target};
use super::render::View;
use super::stored::tell_work;
use super::{tell_of_mattes, tell_shortcomings};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, counted, print};
use crate::values::{FrameRange, Size};
use clap::Args;
use cpu_time::ProcessTime;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use veduta::dice::PixelGrid;
use veduta::map::{Camera, Origin};
use veduta::pipeline::{self, Extent, FrameStep, FrameWork};
use veduta_io::{
    Layers, Loaded, Moment, ReadOptions, SceneOverTime, VectorFormat, is_map, write_map,
};

/// Make the pictures of an animation
///
/// Of each frame only the layers that have moved are found again; the others are kept, and all are put
/// together by depth, which is exact. Through a camera that moves all is found again, and so it is where
/// most of the faces have moved. Without a camera in the scene, that which shows all of the first frame is
/// used for all.
///
/// Frames that are there already are left as they are, so that a run that was interrupted goes on where
/// it ended; --force makes them again. Pictures for a display all have the exposure of the first frame.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Frames {
    /// What moves: a scene file (.toml) with keys, or a model with animations (.glb, .gltf)
    model: PathBuf,
    /// Which frames: FIRST..LAST, both included, FIRST..LASTxSTEP, or one number; all by default. -o names
    /// them with # for the digits of their numbers: out.####.png
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// The animation of the model that is played; its first by default
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    /// Size in pixels; that of the scene file's camera by default, else 1280x960
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// For measuring: find each frame as a whole, too, and tell how long that takes
    #[arg(long, requires = "json")]
    compare: bool,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    view: View,
    #[command(flatten)]
    look: Look,
}

const EXAMPLES: &str = "\
Examples:
  Two seconds of film:
      veduta frames voyage.toml -o voyage.####.png --frames 0..47
  Every second frame in linear light, for compositing:
      veduta frames voyage.toml -o voyage.###.exr --frames 0..47x2
  What is seen in each, kept:
      veduta frames voyage.toml -o voyage.##.veduta --frames 10..12
";

/// What stays the same from frame to frame.
struct Run<'a> {
    size: Size,
    first_camera: Camera,
    /// Of pictures; maps are not developed.
    development: Option<Development>,
    /// Whether the first frame tells the exposure of all.
    exposes_itself: bool,
    /// In EV, once it is known.
    exposure: Option<f32>,
    frames: pipeline::Frames,
    /// Whether frames are stored maps.
    makes_maps: bool,
    names: FrameNames<'a>,
}

/// Seconds of CPU time, of all threads.
#[derive(Clone, Copy, Debug, Default)]
struct Times {
    reading: f64,
    comparing: f64,
    finding: f64,
    compositing: f64,
    shading: f64,
    writing: f64,
    /// Finding the frame as a whole, where that is asked for.
    finding_all: Option<f64>,
}

impl Frames {
    pub fn run(&self, force: bool, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        let names = FrameNames::of(self.output.file()?, self.frames.is_none_or(|f| !f.is_one()))?;
        let options = ReadOptions {
            animation: self.animation.clone(),
            ..self.view.reading.options()
        };
        let mut scene = SceneOverTime::new(&self.model, options);
        let first = self.frames.map_or(0, |frames| frames.first);
        let loaded = self.read(&mut scene, first, talk)?;
        let frames = self.frames.map_or_else(|| self.all_frames(&loaded), Ok)?;
        let mut run = self.prepare(&loaded, names, talk)?;

        let (mut told, mut left) = (Vec::new(), 0);
        let mut loaded = Some(loaded);
        talk.begin("frames");
        for (done, number) in frames.numbers().enumerate() {
            talk.part(done, frames.count());
            let is_there = !force && run.names.path(number).exists();
            left += usize::from(is_there);
            // All need the exposure of the first, whether or not it is there.
            let is_needed = run.exposes_itself && run.exposure.is_none();
            if is_there && !is_needed {
                loaded = None;
                continue;
            }
            let row = self.frame(&mut scene, &mut run, number, loaded.take(), is_there, talk);
            let row = row.map_err(|failure| {
                Failure::new(failure.code, format!("frame {number}: {failure}"))
            })?;
            told.push(row);
        }
        talk.end();
        if left > 0 {
            talk.detail(format_args!(
                "{} there already, left as they were",
                counted(left, "frame")
            ));
        }
        if json {
            let mut told = json!({
                "output": run.names.pattern.to_string_lossy(),
                "size": [run.size.width, run.size.height],
                "frames": told,
                "leftAsTheyWere": left,
                "exposure": run.exposure,
                "warnings": talk.warnings(),
            });
            tell_work(&mut told);
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// The scene of a frame. Of warnings each is told once.
    fn read(
        &self,
        scene: &mut SceneOverTime,
        number: u32,
        talk: &mut Talk,
    ) -> Result<Loaded, Failure> {
        super::refuse_no_model(&self.model)?;
        let loaded = scene.at(Moment::Frame(number))?;
        for warning in &loaded.warnings {
            talk.warn_once_or_fail(warning.to_string(), self.strict, Code::BadInput)?;
        }
        Ok(loaded)
    }

    /// The frames up to the last key of anything.
    fn all_frames(&self, loaded: &Loaded) -> Result<FrameRange, Failure> {
        let ends = loaded.animations.iter().map(|animation| animation.seconds);
        let end = ends.fold(0.0, f64::max);
        // A key at the very beginning of a frame is shown by it, also where rounding puts it before.
        let last = (end * loaded.frames_per_second + 1e-6).floor();
        if last < 1.0 {
            let message = format!(
                "{}: nothing moves in it; name the frames all the same with --frames 0..LAST, or give \
                 layers keys or an animation",
                self.model.display()
            );
            return Err(Failure::new(Code::BadInput, message));
        }
        Ok(FrameRange {
            first: 0,
            last: last.min(f64::from(u32::MAX)) as u32,
            step: 1,
        })
    }

    /// What is the same for all frames.
    fn prepare<'a>(
        &self,
        loaded: &Loaded,
        names: FrameNames<'a>,
        talk: &mut Talk,
    ) -> Result<Run<'a>, Failure> {
        let (camera, size) = self.view.camera(&self.model, loaded, self.size)?;
        if VectorFormat::of(names.pattern).is_some() {
            let message = "frames are pictures of pixels, or maps; draw one at a time by \
                veduta render --frame N";
            return Err(Failure::new(Code::Usage, message));
        }
        let makes_maps = is_map(names.pattern);
        if makes_maps {
            self.look.refuse_filter("a map is of no picture")?;
        }
        if makes_maps && self.output.has_layers() {
            let message = "a map is of no picture: --aov is not for .veduta";
            return Err(Failure::new(Code::Usage, message));
        }
        if self.output.has_numbers() {
            let message = "numbers of objects, materials and faces are those of a whole scene, and \
                frames are put together of parts; ask for --aov crypto-object";
            return Err(Failure::new(Code::Usage, message));
        }
        let mut development = None;
        let mut exposes_itself = false;
        if !makes_maps {
            let target = self.target(&names.path(0))?;
            target.refuse_size(size)?;
            let look = self.look.development(&loaded.scene, self.strict, talk)?;
            exposes_itself = look.exposes_itself(!target.linear);
            development = Some(look);
        }
        Ok(Run {
            size,
            first_camera: camera,
            development,
            exposes_itself,
            exposure: None,
            frames: pipeline::Frames::new([size.width, size.height]),
            makes_maps,
            names,
        })
    }

    /// Where the picture of a frame goes.
    fn target(&self, path: &Path) -> Result<Target, Failure> {
        let target = self.output.at(path).target(&self.model, false)?;
        target.ok_or_else(|| Failure::new(Code::Usage, "frames are written by -o FILE"))
    }

    /// Makes a frame; if it `is_left`, only for its exposure.
    fn frame(
        &self,
        scene: &mut SceneOverTime,
        run: &mut Run<'_>,
        number: u32,
        loaded: Option<Loaded>,
        is_left: bool,
        talk: &mut Talk,
    ) -> Result<Value, Failure> {
        let mut times = Times::default();
        let mut watch = ProcessTime::now();
        let mut lap = move || {
            let now = ProcessTime::now();
            let seconds = now.duration_since(watch).as_secs_f64();
            watch = now;
            seconds
        };
        let loaded = match loaded {
            Some(loaded) => loaded,
            None => self.read(scene, number, talk)?,
        };
        let camera = self.camera(&loaded, run)?;
        times.reading = lap();
        if self.compare {
            pipeline::find_visibility(&loaded.scene, &camera);
            times.finding_all = Some(lap());
        }
        let mut step = None;
        let mut end_step = |times: &mut Times, next: Option<FrameStep>| {
            let seconds = lap();
            match step {
                Some(FrameStep::Comparing) => times.comparing += seconds,
                Some(FrameStep::Finding) => times.finding += seconds,
                Some(FrameStep::Compositing) => times.compositing += seconds,
                _ => {}
            }
            step = next;
        };
        let files = loaded.files;
        let (seen, work) = run.frames.next(loaded.scene, &camera, |next| {
            end_step(&mut times, Some(next));
        });
        end_step(&mut times, None);
        let path = run.names.path(number);
        if run.makes_maps {
            let origin = Origin {
                sources: files,
                // A reading of the files tells of no moment.
                casters: None,
            };
            write_map(&path, seen, &origin)?;
            times.writing = lap();
        }
        if let Some(development) = &run.development {
            let target = self.target(&path)?;
            let shortcomings = pipeline::shortcomings(&seen.scene, &seen.map);
            tell_shortcomings(&self.model, &seen.scene, &shortcomings, self.strict, talk)?;
            let grid = PixelGrid::of_frame(run.size.width, run.size.height);
            let (aovs, unlit, filter) = (self.output.aovs(), self.look.unlit, self.look.filter());
            let (mut picture, aovs) =
                pipeline::render_channels(&seen.scene, &seen.map, &grid, unlit, filter, aovs);
            match run.exposure {
                Some(ev) => development.develop_at(&mut picture, ev, !target.linear),
                None => run.exposure = Some(development.develop(&mut picture, !target.linear)),
            }
            times.shading = lap();
            if !is_left {
                let layers = Layers {
                    aovs: &aovs,
                    scene: &seen.scene,
                    camera: &seen.map.camera,
                    grid,
                };
                tell_of_mattes(&self.model, &layers, self.strict, talk)?;
                target.write(&picture, self.output.has_layers().then_some(&layers))?;
                times.writing = lap();
            }
        }
        talk.detail(format_args!("frame {number}: {}", in_words(&work)));
        Ok(json!({
            "frame": number,
            "output": path.to_string_lossy(),
            "written": !is_left,
            "made": in_a_word(work.extent),
            "changed": work.changed,
            "found": work.found,
            "facesSeen": seen.map.faces.len(),
            "cpuSeconds": times.as_json(),
        }))
    }

    /// The camera of a frame: one with a name moves as it does, any other stays.
    fn camera(&self, loaded: &Loaded, run: &Run<'_>) -> Result<Camera, Failure> {
        if self.view.camera_name(loaded).is_none() {
            return Ok(run.first_camera);
        }
        let (camera, _) = self.view.camera(&self.model, loaded, Some(run.size))?;
        // Where none is given it goes with the size of the scene, which changes with every balloon that
        // rises, and would make of each frame one through another camera.
        let near = run.first_camera.near;
        Ok(Camera { near, ..camera })
    }
}

impl Times {
    fn as_json(self) -> Value {
        let mut told = json!({
            "reading": self.reading,
            "comparing": self.comparing,
            "finding": self.finding,
            "compositing": self.compositing,
            "shading": self.shading,
            "writing": self.writing,
        });
        if let Some(seconds) = self.finding_all {
            told["findingAll"] = seconds.into();
        }
        told
    }
}

/// How a frame was made, for programs.
fn in_a_word(extent: Extent) -> &'static str {
    match extent {
        Extent::First => "first",
        Extent::OtherView => "otherView",
        Extent::MostChanged => "mostChanged",
        Extent::Parts => "parts",
        Extent::Nothing => "nothing",
        _ => "otherwise",
    }
}

/// How a frame was made, for people.
fn in_words(work: &FrameWork) -> String {
    match work.extent {
        Extent::OtherView => "all found, since the camera or the list of layers is another".into(),
        Extent::MostChanged => "all found, since most of it has changed".into(),
        Extent::Parts => format!("found of it: {}", work.found.join(", ")),
        Extent::Nothing => "the same as before".into(),
        _ => "all found".into(),
    }
}
