//! `veduta info`: what a model or a picture holds, and what a camera sees at a point of a picture.

mod animations;
mod lights;
mod model;
mod pick;
mod tree;

use super::guests::kind_name;
use super::render::View;
use super::stored::Stored;
use super::{When, is_picture, load};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, plain, print};
use crate::values::Size;
use clap::Args;
use pick::Spot;
use serde_json::{Value, json};
use std::io::{Read, Seek};
use std::path::PathBuf;
use veduta::map::file::MapReader;
use veduta::pipeline;
use veduta_io::{LoadedPicture, is_map, open_map, read_picture};

/// Tell what is inside a model, a stored map or a picture
///
/// With --pick: which object, face and material are seen at a point of the picture that `veduta
/// render` would make with the same options, where in the world that is, and with which exact areas
/// the pixel there shows which faces.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Info {
    /// The model (.glb, .gltf, .obj, .stl, .ply, .city.json), scene file (.toml), stored map (.veduta)
    /// or picture
    file: PathBuf,
    /// List all objects, not only the first
    #[arg(long)]
    all: bool,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,
    /// Tell what is seen at a pixel, counted from 0 at the top left; 12,7 means the middle of that
    /// pixel, 12.5,7.0 the exact point
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    pick: Option<Spot>,
    /// Size in pixels of the picture that is picked from; that of the scene file's camera by default,
    /// else 1280x960
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    #[command(flatten)]
    view: View,
    #[command(flatten)]
    when: When,
}

const EXAMPLES: &str = "\
Examples:
  What is inside a model:
      veduta info town.obj
  The names of its objects, for another program:
      veduta info town.obj --json
  What the default view shows in the middle of a picture of 320 x 240 pixels:
      veduta info town.obj --size 320x240 --pick 160,120
  What a picture holds:
      veduta info sky.jpg
";

impl Info {
    pub fn run(&self, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        if self.pick.is_none() && self.view.is_asked_for() {
            let message = "options of the view are for --pick; add it, or leave them out";
            return Err(Failure::new(Code::Usage, message));
        }
        let (mut told, text) = if is_map(&self.file) {
            self.map(talk)?
        } else if is_picture(&self.file) {
            self.picture(talk)?
        } else {
            self.model(talk)?
        };
        if json {
            told["file"] = self.file.to_string_lossy().into();
            told["warnings"] = talk.warnings().into();
            print(&format!("{told}\n"))
        } else {
            print(&format!("{}\n{text}", plain(&self.file.to_string_lossy())))
        }
    }

    /// JSON and text.
    fn model(&self, talk: &mut Talk) -> Result<(Value, String), Failure> {
        let options = self.when.options(&self.view.reading);
        let loaded = load(&self.file, &options, self.strict, talk)?;
        let Some(spot) = self.pick else {
            let scene = &loaded.scene;
            let mut told = model::as_json(scene);
            told["animations"] = animations::as_json(&loaded);
            told["framesPerSecond"] = loaded.frames_per_second.into();
            let text = model::as_text(scene, self.all) + &animations::as_text(&loaded);
            return Ok((told, text));
        };
        let (camera, size) = self.view.camera(&self.file, &loaded, self.size)?;
        talk.begin("finding visibility");
        let map = pipeline::find_visibility(&loaded.scene, &camera);
        let picked = pick::pick(&loaded.scene, &map, size, spot)?;
        talk.end();
        Ok((picked.as_json(), picked.as_text()))
    }

    /// What a stored map holds; nothing is found anew.
    fn map(&self, talk: &mut Talk) -> Result<(Value, String), Failure> {
        talk.begin("reading");
        let mut map = open_map(&self.file)?;
        let seen = Stored::read(&mut map)?;
        talk.end();
        if let Some(spot) = self.pick {
            let Stored::Regions(seen) = &seen else {
                let message = "--pick is for maps of regions; spans on sub-scanlines leave out what \
                    lies between these";
                return Err(Failure::new(Code::Usage, message));
            };
            let [width, height] = seen.size;
            let size = self.size.unwrap_or(Size { width, height });
            let picked = pick::pick(&seen.scene, &seen.map, size, spot)?;
            return Ok((picked.as_json(), picked.as_text()));
        }
        Ok(map_told(&seen, map.reader(), self.all))
    }

    fn picture(&self, talk: &mut Talk) -> Result<(Value, String), Failure> {
        if self.pick.is_some() {
            let message = "--pick is for models: a picture does not know what it shows";
            return Err(Failure::new(Code::Usage, message));
        }
        talk.begin("reading");
        let loaded = read_picture(&self.file)?;
        talk.end();
        for warning in &loaded.warnings {
            let message = format!("{}: {warning}", self.file.display());
            talk.warn_or_fail(message, self.strict, Code::BadInput)?;
        }
        Ok(picture_told(&loaded))
    }
}

/// What a stored map holds, as JSON and text.
fn map_told<R: Read + Seek>(seen: &Stored, file: &MapReader<R>, all: bool) -> (Value, String) {
    let mut told = model::as_json(seen.scene());
    let [width, height] = seen.size();
    let sources: Vec<&str> = file
        .sources()
        .iter()
        .map(|source| source.path.as_str())
        .collect();
    told["size"] = json!(seen.size());
    told["facesSeen"] = seen.faces().len().into();
    let pieces = match seen {
        Stored::Regions(seen) => {
            let (opaque, veils) = (seen.map.opaque.len(), seen.map.veils.len());
            told["fragments"] = opaque.into();
            told["veils"] = veils.into();
            format!("{opaque} fragments, {veils} veils")
        }
        Stored::Spans(seen) => {
            let n = seen.spans.sub_scanlines_per_row();
            told["spans"] = seen.spans.len().into();
            told["subScanlines"] = n.into();
            format!("{} spans on {n} sub-scanlines a row", seen.spans.len())
        }
    };
    told["camera"] = model::camera_as_json("", seen.camera());
    told["sources"] = json!(sources);
    told["generator"] = file.generator().into();
    if let Stored::Regions(seen) = seen {
        told["hasHoles"] = seen.has_holes.into();
        let guests = seen.guests.iter().map(|guest| {
            let samples = guest.samples().len();
            json!({
                "name": guest.name(),
                "kind": guest.kind(),
                "size": guest.grid().size,
                "samples": samples,
            })
        });
        told["guests"] = guests.collect();
    }
    let again: Vec<&str> = file
        .readings()
        .iter()
        .filter_map(|reading| reading.files.first())
        .map(|first| first.path.as_str())
        .collect();
    told["casters"] = match file.tells_casters() {
        false => Value::Null,
        true => json!({ "embedded": file.has_embedded_casters(), "readAgain": again }),
    };
    let mut text = format!(
        "  a map of  {width} x {height} pixels, by {}\n  seen      {} faces in {pieces}\n",
        plain(file.generator()),
        seen.faces().len(),
    );
    for source in sources {
        text += &format!("  made of   {}\n", plain(source));
    }
    if let Stored::Regions(seen) = seen {
        for guest in &seen.guests {
            let (name, [width, height]) = (plain(guest.name()), guest.grid().size);
            let (kind, samples) = (kind_name(guest.kind()), guest.samples().len());
            text += &format!(
                "  guest     {name}: {kind}, {width} x {height} pixels, {samples} samples\n"
            );
        }
    }
    let mut casters: Vec<String> = Vec::new();
    if file.has_embedded_casters() {
        casters.push("kept in the file".into());
    }
    casters.extend(
        again
            .iter()
            .map(|path| format!("read again from {}", plain(path))),
    );
    if !file.tells_casters() {
        casters.push("not told".into());
    }
    text += &format!("  casters   {}\n", casters.join("; "));
    text += &model::as_text(seen.scene(), all);
    (told, text)
}

/// What a picture holds, as JSON and text.
fn picture_told(loaded: &LoadedPicture) -> (Value, String) {
    let picture = &loaded.picture;
    let count = picture.pixels.len() as f64;
    let mut low = [f32::INFINITY; 4];
    let mut high = [f32::NEG_INFINITY; 4];
    let mut sums = [0.0; 4];
    let mut not_finite = 0;
    for pixel in &picture.pixels {
        if !pixel.iter().all(|value| value.is_finite()) {
            not_finite += 1;
            continue;
        }
        for (k, &value) in pixel.iter().enumerate() {
            low[k] = low[k].min(value);
            high[k] = high[k].max(value);
            sums[k] += f64::from(value);
        }
    }
    let finite = count - f64::from(not_finite);
    let mean = sums.map(|sum| sum / finite.max(1.0));
    let stored = if loaded.linear { "linear" } else { "sRGB" };
    let json = json!({
        "size": [picture.width, picture.height],
        "stored": stored,
        "furtherChannels": loaded.further_channels,
        "min": (finite > 0.0).then_some(low),
        "max": (finite > 0.0).then_some(high),
        "mean": (finite > 0.0).then_some(mean),
        "notFinite": not_finite,
    });
    let mut text = format!(
        "  size      {} x {} pixels\n  stored    {stored}\n",
        picture.width, picture.height
    );
    if !loaded.further_channels.is_empty() {
        let names: Vec<_> = loaded
            .further_channels
            .iter()
            .map(|name| plain(name))
            .collect();
        text += &format!("  beside    {}\n", names.join(", "));
    }
    if finite > 0.0 {
        text += "  linear light, premultiplied     min         mean          max\n";
        for (k, name) in ["red", "green", "blue", "opacity"].into_iter().enumerate() {
            text += &format!(
                "    {name:20} {:12.6} {:12.6} {:12.6}\n",
                low[k], mean[k], high[k]
            );
        }
    }
    if not_finite > 0 {
        text += &format!("  pixels that are not finite: {not_finite}\n");
    }
    (json, text)
}
