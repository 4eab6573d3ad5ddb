//! `veduta shade`: pixels of a stored map, at any scale and in other colours.

use super::look::Look;
use super::output::Output;
use super::stored::{Changes, Trust, laid_on, open, refuse_filter_of_guests, tell_work};
use super::vector::{Subject, Vector};
use super::{tell_of_mattes, tell_shortcomings};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use crate::values::{self, Size};
use clap::Args;
use std::path::PathBuf;
use veduta::dice::PixelGrid;
use veduta::drawing::LineKind;
use veduta::pipeline;
use veduta_geometry::DVec2;
use veduta_io::Layers;

/// Make a picture of a stored map
///
/// What is seen where was found when the map was made; here it becomes pixels, of any size, whole or a
/// window of it, in these colours or others. The files of the scene are not needed.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Shade {
    /// The map: .veduta
    map: PathBuf,
    /// Size of the whole picture in pixels; that of the map by default
    #[arg(long, value_name = "WxH", conflicts_with = "scale")]
    size: Option<Size>,
    /// Scale of the whole picture; of x and y apart if two are given
    #[arg(long, value_name = "S|SX,SY", value_parser = values::scale)]
    scale: Option<DVec2>,
    /// Make only this part of it, in pixels of the whole picture; parts of pixels are fine
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::window, allow_hyphen_values = true)]
    window: Option<values::Window>,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    trust: Trust,
    #[command(flatten)]
    changes: Changes,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    look: Look,
    #[command(flatten)]
    vector: Vector,
}

const EXAMPLES: &str = "\
Examples:
  Keep what is seen, then make pictures of it:
      veduta render town.obj -o town.veduta --force
      veduta shade town.veduta -o town.png
      veduta shade town.veduta --scale 4 -o large.png
  A part of it, as through a magnifying glass:
      veduta shade town.veduta --scale 9 --window 3000,2000,320,240 -o part.png
  Before what another map shows, however near that is:
      veduta render hut.obj --eye 9,-9,5 --look-at 0,0,0 -o far.veduta
      veduta render town.obj --eye 9,-9,5 --look-at 0,0,0 -o near.veduta
      veduta shade near.veduta --background far.veduta -o before.png
  With what was red in another colour:
      veduta shade town.veduta --set 'material.\"red\".color=#446' -o slate.png
";

impl Shade {
    pub fn run(&self, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        if self.window.is_some() && self.output.has_numbers() {
            let message = "numbers of objects, materials and faces are those of a whole map; leave \
                --window out, or ask for --aov crypto-object";
            return Err(Failure::new(Code::Usage, message));
        }
        let vector = match self.output.vector_target(&self.map, json)? {
            Some(target) => {
                self.look.refuse_filter("a vector picture has no pixels")?;
                let settings = self.vector.drawing(target.format)?;
                if settings.lines.contains(&LineKind::Boundary) {
                    let message = "a map holds the faces that are seen, so that it cannot tell which \
                        edges have a single one; draw boundaries by veduta render";
                    return Err(Failure::new(Code::Usage, message));
                }
                Some((target, settings))
            }
            None => {
                self.vector.refuse()?;
                None
            }
        };
        let pixels = match vector {
            Some(_) => None,
            None => self.output.target(&self.map, json)?,
        };
        if vector.is_none() && pixels.is_none() {
            let message = "a map is shown by -o FILE; --preview is for veduta render";
            return Err(Failure::new(Code::Usage, message));
        }
        talk.begin("reading");
        let mut map = open(&self.map)?;
        let [width, height] = map.reader().size();
        let frame = match self.size {
            Some(size) => DVec2::new(size.width.into(), size.height.into()),
            None => DVec2::new(width.into(), height.into()) * self.scale.unwrap_or(DVec2::ONE),
        };
        let (left_top, size) = match self.window {
            Some(window) => (window.left_top, window.size),
            None => {
                let pixels = frame.round().max(DVec2::ONE);
                let size = Size::new(pixels.x as u64, pixels.y as u64);
                let size = size.map_err(|problem| Failure::new(Code::Usage, problem))?;
                (DVec2::ZERO, size)
            }
        };
        if let Some(target) = &pixels {
            target.refuse_size(size)?;
        }
        let grid = PixelGrid {
            width: size.width,
            height: size.height,
            pixels_per_frame: frame,
            origin: left_top,
        };
        let filter = self.look.filter();
        // A filter looks beyond the window.
        let reached = match filter.kernel() {
            Some(kernel) => grid.between_centres(kernel.radius(), 1),
            None => grid,
        };
        let corner = DVec2::new(reached.width.into(), reached.height.into());
        let shown = [DVec2::ZERO, corner].map(|pixels| reached.image_from_pixels(pixels));
        let seen = map.read(|reader| reader.read_window(shown))?;
        let bytes_read = map.reader().bytes_read();
        let mut seen = laid_on(seen, &self.look, self.trust, |reader| {
            reader.read_window(shown)
        })?;
        self.changes.apply(&mut seen.scene, self.strict, talk)?;
        let development = self.look.development(&seen.scene, self.strict, talk)?;
        let mut told = if let Some((target, settings)) = &vector {
            if !seen.guests.is_empty() {
                let message = format!(
                    "{}: holds pictures of other programs, which have no shapes: make a picture of pixels",
                    self.map.display()
                );
                return Err(Failure::new(Code::Unsupported, message));
            }
            let subject = Subject {
                file: &self.map,
                scene: &seen.scene,
                map: &seen.map,
                grid: &grid,
                unlit: self.look.unlit,
                strict: self.strict,
            };
            self.vector
                .draw(target, settings, &subject, &development, talk)?
        } else if let Some(target) = &pixels {
            talk.begin("shading");
            let shortcomings = pipeline::shortcomings(&seen.scene, &seen.map);
            tell_shortcomings(&self.map, &seen.scene, &shortcomings, self.strict, talk)?;
            let (aovs, unlit) = (self.output.aovs(), self.look.unlit);
            refuse_filter_of_guests(&self.map, &seen, &self.look)?;
            let (mut picture, aovs) = pipeline::render_seen(&seen, &grid, unlit, filter, aovs);
            let layers = Layers {
                aovs: &aovs,
                scene: &seen.scene,
                camera: &seen.map.camera,
                grid,
            };
            tell_of_mattes(&self.map, &layers, self.strict, talk)?;
            talk.begin("developing");
            let ev = development.develop(&mut picture, !target.linear);
            talk.begin("writing");
            target.write(&picture, self.output.has_layers().then_some(&layers))?;
            talk.end();
            talk.detail(format_args!("exposure {ev:.2} EV"));
            serde_json::json!({
                "output": target.name(),
                "size": [size.width, size.height],
                "exposure": ev,
            })
        } else {
            unreachable!("one of the two was asked for")
        };
        if json {
            told["facesSeen"] = seen.map.faces.len().into();
            told["bytesRead"] = bytes_read.into();
            told["warnings"] = talk.warnings().into();
            tell_work(&mut told);
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }
}
