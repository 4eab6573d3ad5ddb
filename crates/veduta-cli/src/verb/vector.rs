//! Vector pictures: what is drawn, and where it goes.

use super::look::Development;
use super::output::Place;
use super::tell_shortcomings;
use crate::exit::{Code, Failure};
use crate::talk::Talk;
use crate::values;
use clap::{Args, ValueEnum};
use serde_json::Value;
use std::io;
use std::path::Path;
use veduta::accumulate::Picture;
use veduta::dice::PixelGrid;
use veduta::drawing::{self, Drawing, Evenness, Joining, LineKind};
use veduta::map::VisibilityMap;
use veduta::pipeline;
use veduta::scene::Scene;
use veduta_io::{
    VectorFormat, VectorOptions, WriteProblem, hidden_dash, stream_drawing, write_drawing,
};

/// What a vector picture shows.
///
/// All are options so that one that has no effect on a picture of pixels is refused there.
#[derive(Debug, Args)]
#[command(next_help_heading = "Vector pictures (.svg, .pdf, .geojson)")]
pub struct Vector {
    /// What fills shapes: faces, their colours; none, for lines only
    #[arg(long, value_name = "WHAT")]
    fill: Option<Fill>,
    /// Edges to draw as lines: silhouette, boundary (of a single face), crease; hidden, for where those are
    /// hidden; several with commas between them
    #[arg(long, value_name = "KINDS", value_delimiter = ',')]
    lines: Vec<Line>,
    /// Width of the lines, such as 0.5px or 0.35mm (96 pixels to 25.4 mm); 1px by default
    #[arg(long, value_name = "WIDTH", value_parser = values::line_width)]
    line_width: Option<f64>,
    /// Colour of the lines, such as #204060; black by default
    #[arg(long, value_name = "COLOUR", value_parser = values::color)]
    line_color: Option<[f32; 3]>,
    /// The angle between two faces from which on their edge is a crease; 30deg by default. Edges that are shaded
    /// smoothly, by equal normals on both sides, are none
    #[arg(long, value_name = "ANGLE", value_parser = values::crease_angle)]
    crease_angle: Option<f64>,
    /// How near hidden lines may come to lines beside them, such as 2px or 0.5mm; parts that come nearer, and hidden
    /// lines shorter than a dash, are left out. 0.7mm by default; 0 draws all
    #[arg(long, value_name = "DISTANCE", value_parser = values::spacing)]
    hidden_spacing: Option<f64>,
    /// Draw hidden lines only behind at most this many faces: 1 for the far sides of what is seen, 2 for
    /// what is in it; all by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    hidden_behind: Option<u32>,
    /// How far shapes reach under those on top of them, in pixels, so that viewers show no seams; 2 by
    /// default, enough to view the picture at its size or larger. 0 for outlines as they are seen
    #[arg(long, value_name = "PIXELS", value_parser = values::trap)]
    trap: Option<f64>,
    /// Decimals of coordinates, in pixels: 0 to 9; 2 by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=9))]
    decimals: Option<u8>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Fill {
    /// The colour of the faces
    Faces,
    /// Nothing
    None,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Line {
    /// Where something ends before something farther away
    Silhouette,
    /// Edges of a single face
    Boundary,
    /// Edges of two faces at an angle, and where faces pierce one another
    Crease,
    /// Edges of the other kinds given, dashed where they are hidden
    Hidden,
}

impl Vector {
    /// Fails if an option is given, for a picture of pixels.
    pub fn refuse(&self) -> Result<(), Failure> {
        let given = [
            (self.fill.is_some(), "--fill"),
            (!self.lines.is_empty(), "--lines"),
            (self.line_width.is_some(), "--line-width"),
            (self.line_color.is_some(), "--line-color"),
            (self.crease_angle.is_some(), "--crease-angle"),
            (self.hidden_spacing.is_some(), "--hidden-spacing"),
            (self.hidden_behind.is_some(), "--hidden-behind"),
            (self.trap.is_some(), "--trap"),
            (self.decimals.is_some(), "--decimals"),
        ];
        match given.into_iter().find(|(is_given, _)| *is_given) {
            None => Ok(()),
            Some((_, option)) => {
                let message = format!("{option} is for vector pictures: .svg, .pdf or .geojson");
                Err(Failure::new(Code::Usage, message))
            }
        }
    }

    /// Whether shapes are to be filled.
    fn has_shapes(&self) -> bool {
        self.fill != Some(Fill::None)
    }

    /// What is to be drawn for a file of that format.
    pub fn drawing(&self, format: VectorFormat) -> Result<drawing::Settings, Failure> {
        let usage = |message: &str| Err(Failure::new(Code::Usage, message));
        let has_lines = !self.lines.is_empty();
        if !self.has_shapes() && !has_lines {
            return usage("--fill none leaves nothing to draw without --lines");
        }
        if has_lines && self.lines.iter().all(|line| *line == Line::Hidden) {
            return usage(
                "--lines hidden goes with the kinds of edges to draw: --lines silhouette,crease,hidden",
            );
        }
        if has_lines && !format.has_lines() {
            return usage("--lines is for .svg and .pdf: .geojson holds shapes");
        }
        if self.trap.is_some() && !format.has_lines() {
            return usage(
                "--trap is for .svg and .pdf: shapes of .geojson end where they are seen to",
            );
        }
        let of_hidden = [
            (self.hidden_spacing.is_some(), "--hidden-spacing"),
            (self.hidden_behind.is_some(), "--hidden-behind"),
        ];
        if let Some((_, option)) = of_hidden.into_iter().find(|(is_given, _)| *is_given)
            && !self.lines.contains(&Line::Hidden)
        {
            return usage(&format!(
                "{option} is for hidden lines: --lines silhouette,crease,hidden"
            ));
        }
        let usual = drawing::Settings::default();
        let hidden_spacing = self.hidden_spacing.unwrap_or(HIDDEN_SPACING);
        let line_width = self
            .line_width
            .unwrap_or(VectorOptions::default().line_width);
        Ok(drawing::Settings {
            // Shapes of GeoJSON are for measuring.
            trap: match self.trap {
                Some(trap) => trap,
                None if format.has_lines() => usual.trap,
                None => 0.0,
            },
            // Layers of maps are made of surfaces.
            joining: if format.has_lines() {
                Joining::Colors
            } else {
                Joining::Surfaces
            },
            shapes: self.has_shapes(),
            lines: self
                .lines
                .iter()
                .map(|line| match line {
                    Line::Silhouette => LineKind::Silhouette,
                    Line::Boundary => LineKind::Boundary,
                    Line::Crease => LineKind::Crease,
                    Line::Hidden => LineKind::Hidden,
                })
                .collect(),
            crease_angle: self.crease_angle.unwrap_or(usual.crease_angle),
            most_before: self
                .hidden_behind
                .map_or(usual.most_before, |most| most as usize),
            hidden_spacing,
            shortest_hidden: if hidden_spacing > 0.0 {
                hidden_dash(line_width)
            } else {
                0.0
            },
        })
    }

    /// Draws `subject` and writes it to `target`; returns what `--json` tells of it.
    pub fn draw(
        &self,
        target: &VectorTarget,
        settings: &drawing::Settings,
        subject: &Subject,
        development: &Development,
        talk: &mut Talk,
    ) -> Result<Value, Failure> {
        let Subject {
            file,
            scene,
            map,
            grid,
            unlit,
            strict,
        } = *subject;
        let background = development.plain_background()?;
        let shortcomings = pipeline::shortcomings(scene, map);
        tell_shortcomings(file, scene, &shortcomings, strict, talk)?;
        talk.begin("drawing");
        let mut drawing = pipeline::draw_window(scene, map, grid, unlit, settings);
        let mut ev = 0.0;
        if settings.shapes {
            tell_means(&drawing, file, strict, talk)?;
            // Exposed as the picture of pixels would be: automatic exposure looks at those.
            talk.begin("developing");
            let mut picture = pipeline::render_window(scene, map, grid, unlit);
            ev = development.develop(&mut picture, true);
            let mut colors = picture_of_colors(&mut drawing);
            development.develop_at(&mut colors, ev, true);
            let mut developed = colors.pixels.iter().map(|&[r, g, b, _]| [r, g, b]);
            for (radiance, color) in radiances(&mut drawing).zip(&mut developed) {
                *radiance = color;
            }
        }
        talk.begin("writing");
        let title = file.file_name().unwrap_or_default().to_string_lossy();
        target.write(&drawing, &self.options(title.into_owned(), background))?;
        talk.end();
        let shapes = drawing.shapes.len() + drawing.veils.len();
        let strokes = drawing.strokes.len();
        talk.detail(format_args!(
            "{} fragments, {shapes} shapes, {strokes} lines, exposure {ev:.2} EV",
            map.opaque.len()
        ));
        Ok(serde_json::json!({
            "output": target.place.name(),
            "size": [grid.width, grid.height],
            "fragments": map.opaque.len(),
            "shapes": shapes,
            "meanShapes": uneven_shapes(&drawing),
            "lines": strokes,
            "exposure": ev,
        }))
    }

    /// How the file is to be written.
    fn options(&self, title: String, background: Option<[f32; 3]>) -> VectorOptions {
        let usual = VectorOptions::default();
        VectorOptions {
            decimals: self.decimals.unwrap_or(usual.decimals),
            background,
            line_width: self.line_width.unwrap_or(usual.line_width),
            line_color: self.line_color.unwrap_or(usual.line_color),
            title,
        }
    }
}

/// How near, in pixels, hidden lines come to others unless told: 0.7 mm, as ISO 128-20 has it of parallel lines.
const HIDDEN_SPACING: f64 = 0.7 * values::PIXELS_PER_MM;

/// What is drawn.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Where it comes from, for messages.
    pub file: &'a Path,
    pub scene: &'a Scene,
    pub map: &'a VisibilityMap,
    pub grid: &'a PixelGrid,
    /// Without light.
    pub unlit: bool,
    /// Warnings are errors.
    pub strict: bool,
}

/// Warns of shapes that have more than one colour; if strict, fails.
fn tell_means(
    drawing: &Drawing,
    file: &Path,
    strict: bool,
    talk: &mut Talk,
) -> Result<(), Failure> {
    let uneven = uneven_shapes(drawing);
    if uneven == 0 {
        return Ok(());
    }
    let message = format!(
        "{}: {uneven} of {} shapes have the mean of their colours, which differ from point to point \
         (textures, smooth normals, colours at corners)",
        file.display(),
        drawing.shapes.len() + drawing.veils.len()
    );
    talk.warn_or_fail(message, strict, Code::Unsupported)
}

/// How many shapes have the mean of several colours.
fn uneven_shapes(drawing: &Drawing) -> usize {
    let shapes = drawing.shapes.iter().map(|shape| shape.evenness);
    let veils = drawing.veils.iter().map(|veil| veil.evenness);
    shapes
        .chain(veils)
        .filter(|evenness| *evenness != Evenness::Even)
        .count()
}

/// All that is to be developed.
fn radiances(drawing: &mut Drawing) -> impl Iterator<Item = &mut [f32; 3]> {
    let shapes = drawing.shapes.iter_mut().map(|shape| &mut shape.radiance);
    let veils = drawing.veils.iter_mut().map(|veil| &mut veil.radiance);
    let beneath = drawing.underpainting.iter_mut().flat_map(|beneath| {
        let rims = beneath.rims.iter_mut().map(|rim| &mut rim.radiance);
        rims.chain([&mut beneath.radiance])
    });
    shapes.chain(veils).chain(beneath)
}

/// A pixel for each, so that they are developed as pictures are.
fn picture_of_colors(drawing: &mut Drawing) -> Picture {
    let pixels: Vec<_> = radiances(drawing)
        .map(|&mut [r, g, b]| [r, g, b, 1.0])
        .collect();
    Picture {
        width: pixels.len() as u32,
        height: 1,
        pixels,
    }
}

/// A place for a vector picture.
#[derive(Debug)]
pub struct VectorTarget {
    pub place: Place,
    pub format: VectorFormat,
}

impl VectorTarget {
    /// Writes the drawing there.
    pub fn write(&self, drawing: &Drawing, options: &VectorOptions) -> Result<(), Failure> {
        let Place::File(path) = &self.place else {
            let mut stdout = io::stdout().lock();
            return match stream_drawing(&mut stdout, self.format, drawing, options) {
                Ok(()) => Ok(()),
                // Who reads has read enough.
                Err(WriteProblem::Io(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
                Err(problem) => {
                    let message = format!("stdout: {problem}");
                    Err(Failure::new(Code::InputOutput, message))
                }
            };
        };
        Ok(write_drawing(path, self.format, drawing, options)?)
    }
}
