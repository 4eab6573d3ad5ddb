//! `veduta shade --into`: some pixels of a picture are made again, the others kept.

use super::{Shade, whole_size};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, counted, print};
use crate::verb::look::Development;
use crate::verb::output::Target;
use crate::verb::stored::{open, tell_work};
use crate::verb::{tell_shortcomings, unknown_name};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use veduta::accumulate::Picture;
use veduta::dice::{PixelGrid, Region};
use veduta::map::SeenScene;
use veduta::pipeline;
use veduta_geometry::DVec2;
use veduta_io::{LoadedPicture, ObjectNames, OpenMap, read_picture};

/// A part of a picture that is there is made again.
#[derive(Debug, Args)]
#[command(next_help_heading = "Local processing")]
pub struct Into {
    /// Make again only a part of this picture of the map, and keep the rest: the pixels of --window, those
    /// that --objects touch, or those that do both
    #[arg(long, value_name = "PICTURE")]
    pub into: Option<PathBuf>,
    /// The objects whose pixels are made again; names match with *, ** and ?. May be given several times
    #[arg(long, value_name = "NAME", requires = "into")]
    objects: Vec<ObjectNames>,
    /// The map that the picture shows, where the objects have moved since: their pixels there are made
    /// again, too
    #[arg(long, value_name = "MAP", requires = "objects")]
    was: Option<PathBuf>,
}

impl Shade {
    /// Makes a part of the picture `old` again.
    pub(super) fn run_into(
        &self,
        old: &Path,
        target: &Target,
        json: bool,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        let usage = |message: &str| Failure::new(Code::Usage, message);
        if self.output.has_layers() {
            return Err(usage("a part is made of the light alone; leave --aov out"));
        }
        if self.window.is_none() && self.local.objects.is_empty() {
            let message = "--into needs the part that is made again: --window, --objects or both";
            return Err(usage(message));
        }
        self.look
            .refuse_filter("a filter reaches beyond the pixels that are made again")?;
        talk.begin("reading");
        let mut map = open(self.map())?;
        refuse_spans(self.map(), &map)?;
        let frame = self.frame(map.reader().size());
        let size = whole_size(frame)?;
        target.refuse_size(size)?;
        let grid = PixelGrid {
            width: size.width,
            height: size.height,
            pixels_per_frame: frame,
            origin: DVec2::ZERO,
        };
        let window = self.window_region(&grid)?;
        let mut picture = read_old(old, &grid, target, self.strict, talk)?;
        let shown = match window.as_ref().and_then(Region::bounds) {
            None => [DVec2::ZERO, DVec2::ONE],
            Some([columns, rows]) => {
                let corner =
                    |x: u32, y: u32| grid.image_from_pixels(DVec2::new(x.into(), y.into()));
                [
                    corner(columns.start, rows.start),
                    corner(columns.end, rows.end),
                ]
            }
        };
        let mut seen = map.read(|reader| reader.read_window(shown))?;
        let bytes_read = map.reader().bytes_read();
        let region = self.region(window, &seen, &grid)?;
        self.changes.apply(&mut seen.scene, self.strict, talk)?;
        let development = self.look.development(&seen.scene, self.strict, talk)?;
        if development.exposes_itself(!target.linear) {
            let message = "a part does not tell how the whole picture was exposed: give --exposure, \
                which render and shade tell with --json";
            return Err(usage(message));
        }
        let shortcomings = pipeline::shortcomings(&seen.scene, &seen.map);
        tell_shortcomings(self.map(), &seen.scene, &shortcomings, self.strict, talk)?;
        talk.begin("shading");
        blend(
            &seen,
            &grid,
            &region,
            self.look.unlit,
            &development,
            target,
            &mut picture,
        );
        talk.begin("writing");
        target.write(&picture, None)?;
        talk.end();
        let made = region.count();
        talk.detail(format_args!("{} made again", counted(made, "pixel")));
        if json {
            let mut told = json!({
                "output": target.name(),
                "size": [size.width, size.height],
                "pixelsMade": made,
                "facesSeen": seen.map.faces.len(),
                "bytesRead": bytes_read,
                "warnings": talk.warnings(),
            });
            tell_work(&mut told);
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// The pixels of `--window`, if it is given.
    fn window_region(&self, grid: &PixelGrid) -> Result<Option<Region>, Failure> {
        let Some(window) = self.window else {
            return Ok(None);
        };
        let left_top = window.left_top;
        if left_top != left_top.floor() || left_top.min_element() < 0.0 {
            let message =
                "pixels are made again whole: --window begins at whole pixels of the picture";
            return Err(Failure::new(Code::Usage, message));
        }
        let range = |from: f64, length: u32| {
            let from = from.min(f64::from(u32::MAX)) as u32;
            from..from.saturating_add(length)
        };
        let columns = range(left_top.x, window.size.width);
        let rows = range(left_top.y, window.size.height);
        let region = Region::window(grid, columns, rows);
        if region.count() == 0 {
            let (width, height) = (grid.width, grid.height);
            let message = format!("--window lies outside the picture of {width} x {height} pixels");
            return Err(Failure::new(Code::Usage, message));
        }
        Ok(Some(region))
    }

    /// The pixels that are made again.
    fn region(
        &self,
        window: Option<Region>,
        seen: &SeenScene,
        grid: &PixelGrid,
    ) -> Result<Region, Failure> {
        let Into { objects, was, .. } = &self.local;
        if objects.is_empty() {
            return Ok(window.expect("one of the two was asked for"));
        }
        let was = was.as_ref().map(|path| -> Result<SeenScene, Failure> {
            let mut map = open(path)?;
            refuse_spans(path, &map)?;
            let was = map.read(|reader| reader.read())?;
            if let Some(difference) = other_view(seen, &was) {
                let message = format!("{}: {difference}", path.display());
                return Err(Failure::new(Code::BadInput, message));
            }
            Ok(was)
        });
        let was = was.transpose()?;
        let maps: Vec<&SeenScene> = [seen].into_iter().chain(&was).collect();
        let all = || maps.iter().flat_map(|seen| &seen.scene.objects);
        for names in objects {
            // A window holds what is seen in it only, so that a name may rightly be absent.
            if window.is_none() && !all().any(|object| names.match_name(&object.name)) {
                let known: Vec<&str> = all().map(|object| object.name.as_str()).collect();
                let help = unknown_name(names.text(), "objects", known);
                let message = format!("no object of the map is called {:?}; {help}", names.text());
                return Err(Failure::new(Code::Missing, message));
            }
        }
        let mut region = Region::none(grid);
        for SeenScene { map, scene, .. } in maps {
            let is_wanted: Vec<bool> = scene
                .objects
                .iter()
                .map(|object| objects.iter().any(|names| names.match_name(&object.name)))
                .collect();
            let wanted = |face| is_wanted[map.faces.object(face).index()];
            region = region.or(&Region::of_faces(map, grid, wanted));
        }
        Ok(match &window {
            Some(window) => region.and(window),
            None => region,
        })
    }
}

/// Refuses a map of spans, which have no exact pixels.
pub(super) fn refuse_spans(path: &Path, map: &OpenMap) -> Result<(), Failure> {
    if map.reader().sub_scanlines_per_row().is_none() {
        return Ok(());
    }
    let message = format!(
        "{}: holds spans on sub-scanlines; parts of pictures are made of regions, which veduta render \
         finds without --sampling",
        path.display()
    );
    Err(Failure::new(Code::Usage, message))
}

/// Why pixels of one map are not those of another, if they are not.
fn other_view(seen: &SeenScene, was: &SeenScene) -> Option<&'static str> {
    let near = seen.map.camera.near;
    let camera = veduta::map::Camera {
        near,
        ..was.map.camera
    };
    (camera != seen.map.camera)
        .then_some("was seen through another camera, so that no pixel of the picture stays")
}

/// The picture that is blended into.
fn read_old(
    old: &Path,
    grid: &PixelGrid,
    target: &Target,
    strict: bool,
    talk: &mut Talk,
) -> Result<Picture, Failure> {
    let LoadedPicture {
        picture,
        linear,
        further_channels,
        warnings,
        panorama: _,
    } = read_picture(old)?;
    let file = old.display();
    let refuse = |message: String| Err(Failure::new(Code::Usage, format!("{file}: {message}")));
    if (picture.width, picture.height) != (grid.width, grid.height) {
        return refuse(format!(
            "has {} x {} pixels, and the picture of the map {} x {}; give --size or --scale as it was made",
            picture.width, picture.height, grid.width, grid.height
        ));
    }
    if linear != target.linear {
        let [is, other] = ["linear light", "made for a display"];
        let [old, new] = if linear { [is, other] } else { [other, is] };
        return refuse(format!("is {old}, and what is written would be {new}"));
    }
    if !further_channels.is_empty() {
        return refuse(format!(
            "has channels beside the light, which would be lost: {}",
            further_channels.join(", ")
        ));
    }
    for warning in warnings {
        let message = format!("{file}: {warning}");
        talk.warn_or_fail(message, strict, Code::BadInput)?;
    }
    Ok(picture)
}

/// Makes the pixels of `region` and develops them as those of the picture were.
fn blend(
    seen: &SeenScene,
    grid: &PixelGrid,
    region: &Region,
    unlit: bool,
    development: &Development,
    target: &Target,
    picture: &mut Picture,
) {
    // In place, since a picture behind is scaled to the whole frame.
    let mut made = Picture {
        pixels: vec![[0.0; 4]; grid.pixel_count()],
        ..*picture
    };
    let (scene, map, guests) = (&seen.scene, &seen.map, &seen.guests);
    pipeline::render_region(scene, map, guests, grid, region, unlit, &mut made);
    development.develop(&mut made, !target.linear);
    let rows = picture
        .pixels
        .iter_mut()
        .zip(&made.pixels)
        .zip(region.pixels());
    for ((pixel, made), _) in rows.filter(|row| *row.1) {
        *pixel = *made;
    }
}
