//! `veduta dome`: views of all around -> domes, panoramas, mirror balls and cubes.
//!
//! 1. `source`: the files, and what they show ([`View`]s); 2. `target`: what is made of them, and its files;
//! 3. `doubts`: what may be wrong with the views, and what is missing; 4. `frame`: each frame is read, filtered by
//!    [`veduta::reproject`] (`geometry`), finished (mask, guides, background) and, here, written.
//!
//! What is seen where is worked out once for all frames of a sequence.

mod doubts;
mod frame;
mod geometry;
mod source;
mod target;

use super::frame_names::FrameNames;
use super::output::{Output, Target};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, counted, plain, print};
use crate::values::{Background, FrameRange, Size};
use clap::{Args, ValueEnum};
use frame::{Eye, Pictures};
use geometry::Filtering;
use serde_json::{Value, json};
use source::{Files, Source};
use std::path::{Path, PathBuf};
use target::{Aim, EYE};
use veduta_io::sphere::View;
use veduta_io::{FileView, PictureFormat};

/// Make a dome, a panorama, a mirror ball or a cube of pictures of all that is around
///
/// The views are the sides of a cube, in files or in one picture, a panorama, a fisheye, or any pictures whose
/// lenses a file of views (.toml; veduta schema views) tells. Each pixel is the weighted mean of all texels
/// in its footprint (EWA, after Greene & Heckbert), so that nothing flickers and no seams show.
///
/// Where the views show nothing, the picture is clear. Light is averaged as light: numbers of 8 and 16 bits
/// are taken as sRGB. Sequences have # for the digits of their numbers, in views and -o.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Dome {
    /// The views: pictures, or a file of views
    #[arg(value_name = "VIEWS", required_unless_present_any = ["test_card", "guides"])]
    views: Vec<PathBuf>,
    /// The same for the right eye; those before are for the left
    #[arg(long, value_name = "VIEWS", num_args = 1.., requires = "views")]
    right: Vec<PathBuf>,
    /// Which frames of a sequence: FIRST..LAST, both included, FIRST..LASTxSTEP, or one number; all that are
    /// there by default
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// The number of the first frame that is written; that of its views by default
    #[arg(long, value_name = "N")]
    start: Option<u32>,
    /// Keep a circle of that angle, and let it end softly within the second: 180deg,4deg
    #[arg(long, value_name = "FOV[,SOFT]", value_parser = target::mask)]
    mask: Option<[f64; 2]>,
    /// Lay lines over a dome: alignment (altitudes, azimuths and names), safe-area (what all seats see well)
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    guides: Vec<GuideArgument>,
    /// What lies behind: a colour or none; black by default for .jpg
    #[arg(long, value_name = "COLOUR", value_parser = background)]
    background: Option<Behind>,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    aim: Aim,
    #[command(flatten)]
    source: Source,
    #[command(flatten)]
    filtering: Filtering,
    #[command(flatten)]
    output: Output,
}

const EXAMPLES: &str = "\
Examples:
  What is where? A cube whose sides tell it, as a domemaster and as a strip:
      veduta dome --test-card -o card.png
      veduta dome --test-card 512 --lens cube --to-layout 3x2 -o strip.png
  A domemaster of the sides of a cube that are in one picture or in six files:
      veduta dome strip.png -o dome.png --size 1024
      veduta dome strip.png --lens cube -o 'sky_{side}.png'
      veduta dome sky_*.png -o dome.png --size 1024
  The frame of an Omnimax film, and a panorama that photo viewers know:
      veduta dome sky_*.png --lens omnimax -o frame.png --size 983
      veduta dome sky_*.png --lens equirect -o pano.jpg
  Of that again a theatre's picture, its dome tilted by 20 degrees:
      veduta dome pano.jpg --tilt 20deg --mask 180deg,2deg -o show.png
  Lines to align projectors by:
      veduta dome --guides alignment,safe-area --size 1024 -o align.png
";

/// `--guides`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum GuideArgument {
    /// Circles of altitude, lines of azimuth, and their names
    Alignment,
    /// 50 degrees to both sides of the front, from 10 to 60 degrees of altitude
    SafeArea,
}

/// `--background`: a linear colour, or nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Behind(Option<[f32; 3]>);

fn background(text: &str) -> Result<Behind, String> {
    match text.parse() {
        Ok(Background::None) => Ok(Behind(None)),
        Ok(Background::Color(color)) => Ok(Behind(Some(color))),
        _ => Err("expected none, or a colour such as '#000' (in quotes)".into()),
    }
}

/// What is the same for all frames.
struct Run<'a> {
    /// Of the left eye, or of the only one, and of the right.
    eyes: Vec<Eye<'a>>,
    names: FrameNames<'a>,
    format: PictureFormat,
    /// Whether the whole may go on where a frame cannot be read.
    is_sequence: bool,
}

impl Dome {
    pub fn run(&self, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        let output = self.output.file()?.to_owned();
        let format = self.check(&output)?;
        self.source.check()?;
        let rigs = [&self.views, &self.right].map(|views| self.source.rig(views));
        let [left_rig, right_rig] = rigs;
        let (left_rig, right_rig) = (left_rig?, right_rig?);
        let mut run = self.prepare(&output, format, left_rig.as_deref(), right_rig.as_deref())?;
        let numbers = self.numbers(&run)?;
        if let Some(gap) = gap_in(&numbers) {
            talk.warn_or_fail(gap, self.strict, Code::Missing)?;
        }
        let mut rows = Vec::new();
        let mut failed: Vec<(u32, String)> = Vec::new();
        talk.begin(if run.is_sequence { "frames" } else { "making" });
        for (done, &number) in numbers.iter().enumerate() {
            if run.is_sequence {
                talk.part(done, numbers.len());
            }
            let written = self
                .start
                .map_or(number, |start| start.saturating_add(done as u32));
            match self.frame(&mut run, number, talk) {
                Ok(made) => rows.push(self.write(&run, number, written, made)?),
                Err(failure) if run.is_sequence && is_of_a_frame(failure.code) => {
                    talk.warn(format!("frame {number}: {failure}"));
                    failed.push((number, failure.to_string()));
                }
                Err(failure) => return Err(failure),
            }
        }
        talk.end();
        if json {
            print(&format!("{}\n", self.told(&run, &rows, &failed, talk)?))?;
        }
        if failed.is_empty() {
            return Ok(());
        }
        let list: Vec<_> = failed
            .iter()
            .map(|(number, _)| number.to_string())
            .collect();
        let message = format!(
            "{} of {} could not be made: {}",
            failed.len(),
            counted(numbers.len(), "frame"),
            list.join(", ")
        );
        Err(Failure::new(Code::Missing, message))
    }

    /// Refuses what makes no sense together; the format of the pictures.
    fn check(&self, output: &Path) -> Result<PictureFormat, Failure> {
        let usage = |message: &str| Err(Failure::new(Code::Usage, message.to_owned()));
        if self.output.preview.is_some() {
            return usage("a dome is written by -o FILE; --preview is for veduta render");
        }
        if self.output.has_layers() {
            return usage("pictures of others have no further channels: --aov is not for domes");
        }
        let target = self.target(output)?;
        let format = target.format();
        self.aim.check(output, format)?;
        let round = self.aim.lens()?.is_round() && !self.aim.is_cube();
        if !self.guides.is_empty() && !round {
            return usage("--guides are for round lenses, such as --lens domemaster");
        }
        if self.mask.is_some() && !round {
            return usage("--mask is for round lenses, such as --lens domemaster");
        }
        let names_eyes = output.to_string_lossy().contains(EYE);
        let is_joined = self.aim.stereo().is_some();
        match (self.right.is_empty(), names_eyes, is_joined) {
            (true, true, _) => usage(
                "{eye} in a name is for two eyes; name the views of the right one with --right",
            ),
            (false, true, true) => {
                usage("--stereo makes one picture of both eyes; take {eye} out of its name")
            }
            (false, false, false) => usage(
                "pictures for two eyes are two files: put {eye} into the name, such as -o 'show_{eye}.png', or \
                 one with --stereo",
            ),
            (false, false, true) if self.aim.is_cube() => {
                usage("--stereo joins two pictures, not two cubes")
            }
            _ => Ok(format),
        }
    }

    fn prepare<'a>(
        &'a self,
        output: &'a Path,
        format: PictureFormat,
        left: Option<&'a [FileView]>,
        right: Option<&'a [FileView]>,
    ) -> Result<Run<'a>, Failure> {
        let eye = |name, views: &'a [PathBuf], rig| Eye {
            name,
            files: (!views.is_empty()).then(|| self.source.files(views, rig)),
            seen: None,
        };
        let mut eyes = vec![eye("left", &self.views, left)];
        if !self.right.is_empty() {
            eyes.push(eye("right", &self.right, right));
        }
        let are_numbered = eyes
            .iter()
            .filter_map(|eye| eye.files.as_ref())
            .any(Files::are_numbered);
        if !are_numbered && self.frames.is_some() {
            let message = "--frames is for sequences: views with # for the digits of their numbers, such as \
                front.####.png";
            return Err(Failure::new(Code::Usage, message));
        }
        let several = are_numbered && self.frames.is_none_or(|frames| !frames.is_one());
        let to_stdout = output.as_os_str() == "-";
        if to_stdout && (several || self.aim.makes_six_files()) {
            let message = "several pictures are files; name them with -o";
            return Err(Failure::new(Code::Usage, message));
        }
        // One picture may go to stdout.
        let names = match to_stdout {
            true => FrameNames::of_input(output),
            false => FrameNames::of(output, several)?,
        };
        Ok(Run {
            eyes,
            names,
            format,
            is_sequence: are_numbered,
        })
    }

    /// The numbers of the frames to make.
    fn numbers(&self, run: &Run<'_>) -> Result<Vec<u32>, Failure> {
        if !run.is_sequence {
            return Ok(vec![0]);
        }
        if let Some(frames) = self.frames {
            return Ok(frames.numbers().collect());
        }
        let mut numbers = std::collections::BTreeSet::new();
        for files in run.eyes.iter().filter_map(|eye| eye.files.as_ref()) {
            numbers.extend(files.numbers_there()?);
        }
        if numbers.is_empty() {
            let first = run.eyes[0]
                .files
                .as_ref()
                .map_or(Path::new(""), Files::first);
            let pattern = plain(&first.to_string_lossy());
            let message = format!("{pattern}: no file has a name like that, with digits for #");
            return Err(Failure::new(Code::Missing, message));
        }
        Ok(numbers.into_iter().collect())
    }

    /// The place of a picture.
    fn target(&self, path: &Path) -> Result<Target, Failure> {
        let input = self
            .views
            .first()
            .map_or(Path::new("dome.png"), PathBuf::as_path);
        let target = self.output.at(path).target(input, false)?;
        target.ok_or_else(|| Failure::new(Code::Usage, "a dome is written by -o FILE"))
    }

    /// Writes the pictures of a frame; what to tell of it.
    fn write(
        &self,
        run: &Run<'_>,
        number: u32,
        written: u32,
        made: Vec<Pictures>,
    ) -> Result<Value, Failure> {
        let mut paths = Vec::new();
        for (eye, pictures) in run.eyes.iter().zip(made) {
            let seen = eye.seen.as_ref().expect("a frame was made of it");
            // Two eyes in one picture are what no tag tells.
            let panorama = seen.made.panorama.filter(|_| self.aim.stereo().is_none());
            for (side, picture) in pictures {
                let path = target::file(&run.names, written, eye.name, side);
                let target = self.target(&path)?.of_panorama(panorama);
                let (width, height) = (picture.width, picture.height);
                target.refuse_size(Size { width, height })?;
                target.write(&picture, None)?;
                paths.push(target.name());
            }
        }
        Ok(json!({ "frame": number, "output": paths }))
    }

    fn told(
        &self,
        run: &Run<'_>,
        rows: &[Value],
        failed: &[(u32, String)],
        talk: &Talk,
    ) -> Result<Value, Failure> {
        let mut told = json!({
            "output": run.names.pattern.to_string_lossy(),
            "lens": self.aim.name()?,
            "frames": rows,
            "failed": failed.iter().map(|(frame, error)| json!({ "frame": frame, "error": error })).collect::<Vec<_>>(),
            "warnings": talk.warnings(),
        });
        if let Some(seen) = run.eyes.first().and_then(|eye| eye.seen.as_ref()) {
            let (_, projection) = seen.made.pictures[0];
            told["size"] = json!([projection.width, projection.height]);
            let view = |view: &View| {
                json!({
                    "name": view.name,
                    "lens": view.projection.lens.to_string(),
                    "size": [view.projection.width, view.projection.height],
                })
            };
            told["views"] = seen.views.iter().map(view).collect();
            let missing = |(what, share): &(String, f64)| json!({ "what": what, "share": share });
            told["missing"] = seen.missing.iter().map(missing).collect();
        }
        Ok(told)
    }
}

/// Whether others than the frame that failed so may be made all the same.
fn is_of_a_frame(code: Code) -> bool {
    matches!(
        code,
        Code::BadInput | Code::InputOutput | Code::Missing | Code::Unsupported
    )
}

/// What to say of numbers that are missing between others, which follow one another at one distance: a frame that
/// is there in no view tells nothing else.
fn gap_in(numbers: &[u32]) -> Option<String> {
    let steps = numbers.windows(2).map(|pair| pair[1] - pair[0]);
    let step = steps.clone().min()?;
    let missing: u32 = steps.map(|between| between.div_ceil(step) - 1).sum();
    let pair = numbers.windows(2).find(|pair| pair[1] - pair[0] > step)?;
    let first = pair[0] + step;
    Some(match missing {
        1 => format!("there is no frame {first}"),
        _ => format!("{missing} frames are not there, the first of them {first}"),
    })
}
