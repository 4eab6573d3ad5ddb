//! Vector pictures: what is drawn, and where it goes.

use super::output::Place;
use crate::exit::{Code, Failure};
use crate::values;
use clap::{Args, ValueEnum};
use std::io;
use veduta::drawing::{self, Drawing, LineKind};
use veduta_io::{VectorFormat, VectorOptions, WriteProblem, stream_drawing, write_drawing};

/// What a vector picture shows.
///
/// All are options so that one that has no effect on a picture of pixels is refused there.
#[derive(Debug, Args)]
#[command(next_help_heading = "Vector pictures (.svg, .pdf, .geojson)")]
pub struct Vector {
    /// What fills shapes: faces, their colours; none, for lines only
    #[arg(long, value_name = "WHAT")]
    fill: Option<Fill>,
    /// Visible edges to draw as lines: silhouette, boundary (of a single face), crease; several with
    /// commas between them
    #[arg(long, value_name = "KINDS", value_delimiter = ',')]
    lines: Vec<Line>,
    /// Width of the lines, such as 0.5px or 0.35mm (96 pixels to 25.4 mm); 1px by default
    #[arg(long, value_name = "WIDTH", value_parser = values::line_width)]
    line_width: Option<f64>,
    /// Colour of the lines, such as #204060; black by default
    #[arg(long, value_name = "COLOUR", value_parser = values::color)]
    line_color: Option<[f32; 3]>,
    /// The angle between two faces from which on their edge is a crease; 30deg by default
    #[arg(long, value_name = "ANGLE", value_parser = values::crease_angle)]
    crease_angle: Option<f64>,
    /// Decimals of coordinates, in pixels: 0 to 9; 3 by default
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
    pub fn has_shapes(&self) -> bool {
        self.fill != Some(Fill::None)
    }

    /// What is to be drawn for a file of that format.
    pub fn drawing(&self, format: VectorFormat) -> Result<drawing::Settings, Failure> {
        let usage = |message: &str| Err(Failure::new(Code::Usage, message));
        let has_lines = !self.lines.is_empty();
        if !self.has_shapes() && !has_lines {
            return usage("--fill none leaves nothing to draw without --lines");
        }
        if has_lines && !format.has_lines() {
            return usage("--lines is for .svg and .pdf: .geojson holds shapes");
        }
        let usual = drawing::Settings::default();
        Ok(drawing::Settings {
            // Shapes of GeoJSON are for measuring: they end where they end.
            trap: if format.has_lines() { usual.trap } else { 0.0 },
            shapes: self.has_shapes(),
            lines: self
                .lines
                .iter()
                .map(|line| match line {
                    Line::Silhouette => LineKind::Silhouette,
                    Line::Boundary => LineKind::Boundary,
                    Line::Crease => LineKind::Crease,
                })
                .collect(),
            crease_angle: self.crease_angle.unwrap_or(usual.crease_angle),
        })
    }

    /// How the file is to be written.
    pub fn options(&self, title: String, background: Option<[f32; 3]>) -> VectorOptions {
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
