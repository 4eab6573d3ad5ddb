//! `veduta diff`: two pictures -> how much they differ, and where.

mod compare;

use super::output::Target;
use crate::exit::{Code, Ending, Failure};
use crate::talk::{Talk, plain, print};
use clap::Args;
use compare::{Differences, Space};
use serde_json::json;
use std::path::{Path, PathBuf};
use veduta_io::{LoadedPicture, read_picture};

/// Compare two pictures
///
/// Red, green, blue (premultiplied by opacity) and opacity are compared: as a display shows them, in
/// sRGB from 0 to 1, if both files are made for displays; else, or with --linear, as linear light.
///
/// Exit code 1 if a difference is larger than the tolerance, or the sizes differ.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Diff {
    /// A picture: .png, .jpg, .tif, .webp, .exr, .pfm or .npy
    a: PathBuf,
    /// The picture that it is compared with
    b: PathBuf,
    /// The largest difference of a channel that counts as none; one step of 8 bits is 0.00393
    #[arg(long, value_name = "T", default_value = "0", value_parser = tolerance)]
    tolerance: f64,
    /// Compare linear light, whatever the files are made for
    #[arg(long)]
    linear: bool,
    /// A picture of where they differ: dark red where hardly, yellow, white where most; where they
    /// are equal, the first picture in dark grey
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  Are two pictures the same to the last bit?
      veduta diff sky.jpg sky.jpg
  To one step of 8 bits; else, where not?
      veduta diff flat.png deep.png --tolerance 0.004 -o heat.png
  The figures, for another program:
      veduta diff flat.png deep.png --json --tolerance 1
";

/// `--tolerance`
fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if number >= 0.0 => Ok(number),
        _ => Err("expected a number of at least 0, such as 0.004".into()),
    }
}

impl Diff {
    pub fn run(&self, json: bool, talk: &mut Talk) -> Result<Ending, Failure> {
        let target = self.output.as_deref().map(Target::of_file).transpose()?;
        let a = read(&self.a, talk)?;
        let b = read(&self.b, talk)?;
        let sizes = [&a, &b].map(|loaded| [loaded.picture.width, loaded.picture.height]);
        if sizes[0] != sizes[1] {
            return self.tell_sizes(sizes, json);
        }
        let space = if self.linear || a.linear || b.linear {
            Space::Linear
        } else {
            Space::Srgb
        };
        talk.begin("comparing");
        let found = Differences::of(&a.picture, &b.picture, space, self.tolerance);
        if let Some(target) = &target {
            talk.begin("writing");
            target.write(&compare::heat(&a.picture, &b.picture, space), None)?;
        }
        talk.end();
        print(&if json {
            format!("{}\n", self.as_json(&found, space))
        } else {
            self.as_text(&found, space)
        })?;
        Ok(if found.above > 0 {
            Ending::CheckFailed
        } else {
            Ending::Fine
        })
    }

    fn tell_sizes(&self, sizes: [[u32; 2]; 2], json: bool) -> Result<Ending, Failure> {
        if self.output.is_some() {
            let message = format!(
                "pictures of {} x {} and {} x {} pixels make no picture of differences; scale one",
                sizes[0][0], sizes[0][1], sizes[1][0], sizes[1][1]
            );
            return Err(Failure::new(Code::Usage, message));
        }
        print(&if json {
            format!("{}\n", json!({ "equal": false, "sizes": sizes }))
        } else {
            let [[aw, ah], [bw, bh]] = sizes;
            format!("sizes differ: {aw} x {ah} and {bw} x {bh} pixels\n")
        })?;
        Ok(Ending::CheckFailed)
    }

    fn as_json(&self, found: &Differences, space: Space) -> serde_json::Value {
        json!({
            "equal": found.above == 0,
            "space": space.name(),
            "tolerance": self.tolerance,
            "pixels": found.pixels,
            "differing": found.differing,
            "aboveTolerance": found.above,
            "notFinite": found.not_finite,
            "max": found.largest.map(|largest| largest.size),
            "maxAt": found.largest.map(|largest| largest.at),
            "mean": found.mean,
            "rmse": found.rmse,
        })
    }

    fn as_text(&self, found: &Differences, space: Space) -> String {
        let of = |count: usize| {
            let share = 100.0 * count as f64 / found.pixels as f64;
            format!("{count} of {} pixels ({share:.3} %)", found.pixels)
        };
        let mut text = match found.differing {
            0 => format!("equal: all {} pixels\n", found.pixels),
            count => format!("differing   {}\n", of(count)),
        };
        if let Some(largest) = found.largest {
            if self.tolerance > 0.0 {
                let tolerance = self.tolerance;
                text += &format!("above {tolerance:<6}{}\n", of(found.above));
            }
            let steps = match space {
                Space::Srgb => format!(" ({:.1} steps of 255)", 255.0 * largest.size),
                Space::Linear => String::new(),
            };
            let [x, y] = largest.at;
            text += &format!(
                "largest     {:.9}{steps}, in {} at pixel {x}, {y}\n",
                largest.size, largest.channel
            );
            text += &format!("mean        {:.9}\n", found.mean);
            text += &format!("RMSE        {:.9}\n", found.rmse);
            text += &format!("compared    as {}\n", space.name());
        }
        if found.not_finite > 0 {
            text += &format!("not finite  {}\n", of(found.not_finite));
        }
        text
    }
}

fn read(path: &Path, talk: &mut Talk) -> Result<LoadedPicture, Failure> {
    talk.begin("reading");
    let loaded = read_picture(path)?;
    talk.end();
    for warning in &loaded.warnings {
        talk.warn(format!("{}: {warning}", plain(&path.to_string_lossy())));
    }
    Ok(loaded)
}
