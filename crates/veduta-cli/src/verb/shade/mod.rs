//! `veduta shade`: pixels of a stored map, at any scale and in other colours.

mod into;
mod lens;

use super::look::{Development, Look};
use super::output::{Output, Target};
use super::stored::{Changes, Stored, Trust, laid_on, open, refuse_filter_of_guests, tell_work};
use super::vector::{Subject, Vector};
use super::{tell_of_mattes, tell_of_nothing, tell_shortcomings};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use crate::values::{self, Size};
use clap::Args;
use into::Into;
use lens::LensOptions;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use veduta::accumulate::{AovSettings, Picture};
use veduta::dice::PixelGrid;
use veduta::drawing::LineKind;
use veduta::pipeline;
use veduta::scene::{Material, Scene};
use veduta_geometry::DVec2;
use veduta_io::{Layers, OpenMap};

/// Make a picture of a stored map
///
/// What is seen where was found when the map was made; here it becomes pixels, of any size, whole or a
/// window of it, in these colours or others. The files of the scene are not needed.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Shade {
    /// The map: .veduta; with --lens any number of them, of one eye
    #[arg(required = true, value_name = "MAP")]
    maps: Vec<PathBuf>,
    /// Size of the whole picture in pixels; that of the map by default
    #[arg(long, value_name = "WxH", conflicts_with = "scale")]
    size: Option<Size>,
    /// Scale of the whole picture; of x and y apart if two are given
    #[arg(long, value_name = "S|SX,SY", value_parser = values::scale)]
    scale: Option<DVec2>,
    /// Make only this part of it, in pixels of the whole picture; X and Y may lie within pixels. It is exposed as the
    /// whole picture is
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::window, allow_hyphen_values = true)]
    window: Option<values::Window>,
    /// Keep of each pixel all that is seen in it, each face with its depth and its object's id: a deep
    /// .exr, which lays flat to the same picture
    #[arg(
        long,
        requires = "output",
        conflicts_with_all = ["preview", "background", "exposure", "tone", "aov"]
    )]
    deep: bool,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    lens: LensOptions,
    #[command(flatten)]
    local: Into,
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
      veduta shade town.veduta --scale 9 --window 5600,4200,320,240 -o part.png
  Some objects anew, in a picture that is there:
      veduta shade town.veduta -o a.exr
      veduta shade town.veduta --unlit --into a.exr --objects wall -o b.exr
  Before what another map shows, however near that is:
      veduta render hut.obj --eye 9,-9,5 --look-at 0,0,0 -o far.veduta
      veduta render town.obj --eye 9,-9,5 --look-at 0,0,0 -o near.veduta
      veduta shade near.veduta --background far.veduta -o before.png
  For deep compositing, all that is seen in each pixel:
      veduta shade town.veduta -o town-deep.exr --deep
  By a lens, of maps of all that is around an eye:
      veduta render town.obj --lens cube --eye 12,-8,1.7 -o 's_{side}.veduta'
      veduta shade s_*.veduta --lens domemaster -o dome.png
      veduta shade s_*.veduta --lens equirect --yaw 90deg -o around.png
  With what was red in another colour:
      veduta shade town.veduta --set 'material.\"red\".color=#446' -o slate.png
";

impl Shade {
    /// The map that is shown where there is no lens.
    fn map(&self) -> &Path {
        &self.maps[0]
    }

    pub fn run(&self, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        if let Some(lens) = self.lens.lens {
            return self.run_by_lens(lens, json, talk);
        }
        if let [_, second, ..] = self.maps.as_slice() {
            let message = format!(
                "{}: one map is shown at a time, several by a lens (--lens); veduta composite lays maps of one \
                 camera over one another",
                second.display()
            );
            return Err(Failure::new(Code::Usage, message));
        }
        if self.window.is_some() && self.output.has_numbers() {
            let message = "numbers of objects, materials and faces are those of a whole map; leave \
                --window out, or ask for --aov crypto-object";
            return Err(Failure::new(Code::Usage, message));
        }
        let vector = match self.output.vector_target(self.map(), json)? {
            Some(target) => {
                self.look.refuse_filter("a vector picture has no pixels")?;
                let settings = self.vector.drawing(target.format)?;
                if settings.lines.contains(&LineKind::Boundary) {
                    let message = "a map holds the faces that are seen, so that it cannot tell which \
                        edges have a single one; draw boundaries by veduta render";
                    return Err(Failure::new(Code::Usage, message));
                }
                if settings.lines.contains(&LineKind::Hidden) {
                    let message = "a map holds the faces that are seen, and hidden lines are edges of \
                        others too; draw them by veduta render";
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
            None => self.output.target(self.map(), json)?,
        };
        let deep = match &pixels {
            Some(target) if self.deep => {
                let why = "a deep picture keeps what is seen in each pixel alone";
                self.look.refuse_filter(why)?;
                Some(self.output.deep_target(target)?)
            }
            _ => None,
        };
        if vector.is_none() && pixels.is_none() {
            let message = "a map is shown by -o FILE; --preview is for veduta render";
            return Err(Failure::new(Code::Usage, message));
        }
        if let Some(old) = &self.local.into {
            let target = match &pixels {
                Some(target) if !self.deep => target,
                _ => {
                    let message = "a vector or deep picture is made as a whole; leave --into out";
                    return Err(Failure::new(Code::Usage, message));
                }
            };
            return self.run_into(old, target, json, talk);
        }
        if vector.is_some() && self.deep {
            let message = "a deep picture is stored as .exr; leave --deep out";
            return Err(Failure::new(Code::Usage, message));
        }
        talk.begin("reading");
        let mut map = open(self.map())?;
        let grid = self.grid(map.reader().size())?;
        if let Some(target) = &pixels {
            let [width, height] = [grid.width, grid.height];
            target.refuse_size(Size { width, height })?;
        }
        // A filter looks beyond the window.
        let reached = match self.look.filter().kernel() {
            Some(kernel) => grid.between_centres(kernel.radius(), 1),
            None => grid,
        };
        let window = |grid: &PixelGrid| {
            let corner = DVec2::new(grid.width.into(), grid.height.into());
            [DVec2::ZERO, corner].map(|pixels| grid.image_from_pixels(pixels))
        };
        let mut seen = match map.reader().sub_scanlines_per_row() {
            None => {
                let seen = map.read(|reader| reader.read_window(window(&reached)))?;
                let seen = laid_on(seen, &self.look, self.trust, |reader| {
                    reader.read_window(window(&reached))
                })?;
                if !seen.guests.is_empty() && (vector.is_some() || self.deep) {
                    let message = format!(
                        "{}: holds pictures of other programs, which are laid into flat pixels only",
                        self.map().display()
                    );
                    return Err(Failure::new(Code::Unsupported, message));
                }
                Stored::Regions(seen)
            }
            Some(_) if vector.is_some() || self.deep => {
                let message = format!(
                    "{}: holds spans on sub-scanlines; vector and deep pictures are made of regions, \
                     which veduta render finds without --sampling",
                    self.map().display()
                );
                return Err(Failure::new(Code::Usage, message));
            }
            Some(_) => {
                let why = "spans on sub-scanlines have no regions before a map as background";
                self.look.refuse_background_map_of(why)?;
                Stored::read(&mut map)?
            }
        };
        let bytes_read = map.reader().bytes_read();
        if self.window.is_some() {
            keep_names(seen.scene_mut(), map.reader().materials());
        }
        self.changes.apply(seen.scene_mut(), self.strict, talk)?;
        let mut development = self.look.development(seen.scene(), self.strict, talk)?;
        let for_display = match &pixels {
            Some(target) => !self.deep && !target.linear,
            None => true,
        };
        if self.window.is_some() && development.exposes_itself(for_display) {
            let whole = self.whole_picture(&mut map, &seen)?;
            development.expose_as(&whole, for_display);
        }
        let mut told = match (&seen, &vector, &deep, &pixels) {
            (Stored::Regions(seen), Some((target, settings)), ..) => {
                let subject = Subject {
                    file: self.map(),
                    scene: &seen.scene,
                    map: &seen.map,
                    grid: &grid,
                    unlit: self.look.unlit,
                    strict: self.strict,
                };
                self.vector
                    .draw(target, settings, &subject, &development, talk)?
            }
            (Stored::Regions(seen), _, Some(target), _) => {
                let shortcomings = pipeline::shortcomings(&seen.scene, &seen.map);
                tell_shortcomings(self.map(), &seen.scene, &shortcomings, self.strict, talk)?;
                talk.begin("shading");
                let camera = seen.map.camera.with_window(window(&grid));
                let size = [grid.width, grid.height];
                let unlit = self.look.unlit;
                let (samples, ()) = target.write(&seen.scene, camera, size, |sink| {
                    let (scene, map) = (&seen.scene, &seen.map);
                    pipeline::deep_window(scene, map, &grid, unlit, |rows| sink.write(rows))
                })?;
                talk.end();
                talk.detail(format_args!("{samples} samples"));
                json!({ "output": target.name(), "size": size, "samples": samples })
            }
            (_, _, _, Some(target)) => self.paint(target, &seen, &grid, &development, talk)?,
            _ => unreachable!("one of them was asked for"),
        };
        if json {
            told["facesSeen"] = seen.faces().len().into();
            told["bytesRead"] = bytes_read.into();
            told["warnings"] = talk.warnings().into();
            tell_work(&mut told);
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// The pixels to make of a map whose picture has `size`.
    fn grid(&self, of_map: [u32; 2]) -> Result<PixelGrid, Failure> {
        let frame = self.frame(of_map);
        let (origin, size) = match self.window {
            Some(window) => (window.left_top, window.size),
            None => (DVec2::ZERO, whole_size(frame)?),
        };
        Ok(PixelGrid {
            width: size.width,
            height: size.height,
            pixels_per_frame: frame,
            origin,
        })
    }

    /// Makes a picture of pixels; what to tell of it.
    fn paint(
        &self,
        target: &Target,
        seen: &Stored,
        grid: &PixelGrid,
        development: &Development,
        talk: &mut Talk,
    ) -> Result<Value, Failure> {
        let scene = seen.scene();
        talk.begin("shading");
        let shortcomings = seen.shortcomings();
        tell_shortcomings(self.map(), scene, &shortcomings, self.strict, talk)?;
        if matches!(seen, Stored::Spans(_)) {
            self.look
                .refuse_filter("filters weigh exact regions, not spans")?;
        }
        refuse_filter_of_guests(self.map(), seen, &self.look)?;
        let (aovs, filter) = (self.output.aovs(), self.look.filter());
        let picture = seen.picture(grid, self.look.unlit, filter, aovs);
        let (mut picture, aovs) = picture.map_err(|error| {
            let message = format!("{}: {error}", self.map().display());
            Failure::new(Code::Usage, message)
        })?;
        let layers = Layers {
            aovs: &aovs,
            scene,
            camera: seen.camera(),
            grid: *grid,
        };
        tell_of_mattes(self.map(), &layers, self.strict, talk)?;
        tell_of_nothing(self.map(), &picture, self.strict, talk)?;
        talk.begin("developing");
        let ev = development.develop(&mut picture, !target.linear);
        talk.begin("writing");
        target.write(&picture, self.output.has_layers().then_some(&layers))?;
        talk.end();
        talk.detail(format_args!("exposure {ev:.2} EV"));
        Ok(json!({
            "output": target.name(),
            "size": [grid.width, grid.height],
            "exposure": ev,
        }))
    }

    /// The whole picture in the map's own size, which tells how parts of it are exposed. `seen` is what the window
    /// needs: spans are always read as a whole.
    fn whole_picture(&self, map: &mut OpenMap, seen: &Stored) -> Result<Picture, Failure> {
        let regions;
        let whole = match seen {
            Stored::Spans(_) => seen,
            Stored::Regions(_) => {
                let seen = map.read(|reader| reader.read())?;
                let mut seen = laid_on(seen, &self.look, self.trust, |reader| reader.read())?;
                self.changes.apply_unheard(&mut seen.scene)?;
                regions = Stored::Regions(seen);
                &regions
            }
        };
        let [width, height] = whole.size();
        let grid = PixelGrid::of_frame(width, height);
        let (unlit, filter) = (self.look.unlit, self.look.filter());
        let (picture, _) = whole
            .picture(&grid, unlit, filter, AovSettings::default())
            .expect("a picture in its own size needs no more sub-scanlines");
        Ok(picture)
    }

    /// Width and height of the frame in pixels, with fractions.
    fn frame(&self, of_map: [u32; 2]) -> DVec2 {
        let [width, height] = of_map.map(f64::from);
        match self.size {
            Some(size) => DVec2::new(size.width.into(), size.height.into()),
            None => DVec2::new(width, height) * self.scale.unwrap_or(DVec2::ONE),
        }
    }
}

/// The size of a picture that shows all of a frame.
fn whole_size(frame: DVec2) -> Result<Size, Failure> {
    let pixels = frame.round().max(DVec2::ONE);
    let size = Size::new(pixels.x as u64, pixels.y as u64);
    size.map_err(|problem| Failure::new(Code::Usage, problem))
}

/// Adds the materials of a map that nothing in a window of it has, so that they may be named.
fn keep_names(scene: &mut Scene, all: &[Material]) {
    let there: HashSet<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    let unseen = all.iter().filter(|m| !there.contains(m.name.as_str()));
    let plain = |material: &Material| Material {
        base_color_texture: None,
        emissive_texture: None,
        ..material.clone()
    };
    // Their pictures were not read.
    let unseen: Vec<Material> = unseen.map(plain).collect();
    scene.materials.extend(unseen);
}
