//! Where a picture goes, and as what.

use super::vector::VectorTarget;
use crate::exit::{Code, Failure};
use crate::preview::Style;
use crate::values::Size;
use clap::{Args, ValueEnum};
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use veduta::accumulate::Picture;
use veduta_io::{
    ExrCompression, PICTURE_SUFFIXES, PictureFormat, PictureOptions, Samples, VECTOR_SUFFIXES,
    VectorFormat, WriteProblem, is_map, stream_picture, write_picture_as,
};

/// Where a picture goes, and as what.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct Output {
    /// The picture; its suffix chooses the format. - writes to stdout, as .png or as --format says
    #[arg(short, long, value_name = "FILE", required_unless_present = "preview")]
    output: Option<PathBuf>,
    /// The format, whatever the suffix: png, jpg, tif, webp, exr, pfm, npy, svg, pdf or geojson
    #[arg(long, value_name = "FORMAT", value_parser = format, requires = "output")]
    format: Option<Format>,
    /// Bits of a channel: 8, 16, half or float. 8 by default for .png and .tif, float for .exr
    #[arg(long, value_name = "BITS", requires = "output")]
    depth: Option<DepthArgument>,
    /// Quality of a .jpg, 1 to 100; 92 by default
    #[arg(long, value_name = "Q", value_parser = clap::value_parser!(u8).range(1..=100), requires = "output")]
    quality: Option<u8>,
    /// How an .exr is compressed, always without loss; zip by default
    #[arg(long, value_name = "HOW", requires = "output")]
    compression: Option<CompressionArgument>,
    /// Store an .exr in tiles of this many pixels a side; in scanlines by default
    #[arg(long, value_name = "SIDE", value_parser = clap::value_parser!(u32).range(1..=65_535), requires = "output")]
    tile: Option<u32>,
    /// Show the picture small in the terminal: as kitty graphics, sixel or half blocks, chosen by
    /// what the terminal says of itself, or as told (also into a pipe)
    #[arg(
        long,
        value_name = "HOW",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "auto",
        conflicts_with = "json"
    )]
    pub preview: Option<Style>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DepthArgument {
    /// 8 bits of sRGB
    #[value(name = "8")]
    Eight,
    /// 16 bits of sRGB
    #[value(name = "16")]
    Sixteen,
    /// Floating point of 16 bits, linear
    Half,
    /// Floating point of 32 bits, linear
    Float,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum CompressionArgument {
    /// Not at all
    None,
    /// Runs of equal bytes
    Rle,
    /// Deflate, each scanline alone
    Zips,
    /// Deflate, 16 scanlines together
    Zip,
    /// Wavelets, for noisy pictures
    Piz,
}

/// `--format`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Pixels(PictureFormat),
    Vector(VectorFormat),
}

fn format(name: &str) -> Result<Format, String> {
    let pixels = PictureFormat::of_suffix(name).map(Format::Pixels);
    let format = pixels.or_else(|| VectorFormat::of_suffix(name).map(Format::Vector));
    let known = [PICTURE_SUFFIXES, VECTOR_SUFFIXES].concat().join(", ");
    format.ok_or_else(|| format!("expected one of {known}"))
}

/// A place for a picture, checked as far as it can be before there is one.
#[derive(Debug)]
pub struct Target {
    place: Place,
    format: PictureFormat,
    options: PictureOptions,
    /// Whether light is stored as it is.
    pub linear: bool,
}

/// Where a picture goes.
#[derive(Debug)]
pub enum Place {
    Stdout,
    File(PathBuf),
}

impl Output {
    /// The place of a stored map, if one is asked for.
    pub fn map_place(&self) -> Option<&Path> {
        let output = self.output.as_deref();
        output.filter(|output| self.format.is_none() && is_map(output))
    }

    /// The place for a vector picture, if one is asked for.
    pub fn vector_target(&self, json: bool) -> Result<Option<VectorTarget>, Failure> {
        let Some(output) = &self.output else {
            return Ok(None);
        };
        let format = match self.format {
            Some(Format::Vector(format)) => Some(format),
            Some(Format::Pixels(_)) => None,
            None => VectorFormat::of(output),
        };
        let Some(format) = format else {
            return Ok(None);
        };
        let for_pixels = [
            (self.depth.is_some(), "--depth"),
            (self.quality.is_some(), "--quality"),
            (self.compression.is_some(), "--compression"),
            (self.tile.is_some(), "--tile"),
            (self.preview.is_some(), "--preview"),
        ];
        if let Some((_, option)) = for_pixels.into_iter().find(|(is_given, _)| *is_given) {
            let message = format!("{option} is for pictures of pixels, not for vector pictures");
            return Err(Failure::new(Code::Usage, message));
        }
        let place = self.place(output, json)?;
        Ok(Some(VectorTarget { place, format }))
    }

    /// Where `output` leads.
    fn place(&self, output: &Path, json: bool) -> Result<Place, Failure> {
        let usage = |message: String| Err(Failure::new(Code::Usage, message));
        if output.as_os_str() == "-" {
            if json {
                return usage("-o - and --json both write to stdout; leave one out".into());
            }
            if self.preview.is_some() {
                return usage("-o - and --preview both write to stdout; leave one out".into());
            }
            if io::stdout().is_terminal() {
                return usage(
                    "-o - would write a picture to the terminal; send it into a pipe or a file, \
                     or use --preview"
                        .into(),
                );
            }
            Ok(Place::Stdout)
        } else {
            refuse_output_nowhere(output)?;
            Ok(Place::File(output.to_owned()))
        }
    }

    /// The place for a picture of pixels, if one is asked for.
    pub fn target(&self, json: bool) -> Result<Option<Target>, Failure> {
        let Some(output) = &self.output else {
            return Ok(None);
        };
        let usage = |message: String| Err(Failure::new(Code::Usage, message));
        let place = self.place(output, json)?;
        let format = match (self.format, &place) {
            (Some(Format::Pixels(format)), _) => format,
            (Some(Format::Vector(_)), _) => {
                return usage("this verb makes pictures of pixels only".into());
            }
            (None, Place::Stdout) => PictureFormat::Png,
            (None, Place::File(path)) => PictureFormat::of(path)?,
        };
        if self.quality.is_some() && format != PictureFormat::Jpeg {
            return usage("--quality is for .jpg".into());
        }
        let for_exr = self.compression.is_some() || self.tile.is_some();
        if for_exr && format != PictureFormat::Exr {
            return usage("--compression and --tile are for .exr".into());
        }
        let options = self.options();
        let samples = options.samples_in(format);
        let samples = samples.map_err(|problem| {
            Failure::new(Code::Usage, format!("{}: {problem}", output.display()))
        })?;
        Ok(Some(Target {
            place,
            format,
            options,
            linear: samples.are_linear(),
        }))
    }

    fn options(&self) -> PictureOptions {
        let usual = PictureOptions::default();
        PictureOptions {
            samples: self.depth.map(|depth| match depth {
                DepthArgument::Eight => Samples::U8,
                DepthArgument::Sixteen => Samples::U16,
                DepthArgument::Half => Samples::F16,
                DepthArgument::Float => Samples::F32,
            }),
            jpeg_quality: self.quality.unwrap_or(usual.jpeg_quality),
            exr_compression: match self.compression {
                None => usual.exr_compression,
                Some(CompressionArgument::None) => ExrCompression::None,
                Some(CompressionArgument::Rle) => ExrCompression::Rle,
                Some(CompressionArgument::Zips) => ExrCompression::Zips,
                Some(CompressionArgument::Zip) => ExrCompression::Zip,
                Some(CompressionArgument::Piz) => ExrCompression::Piz,
            },
            exr_tile: self.tile,
        }
    }
}

impl Target {
    /// A file for a picture for people, whose suffix chooses the format.
    pub fn of_file(output: &Path) -> Result<Self, Failure> {
        refuse_output_nowhere(output)?;
        let format = PictureFormat::of(output)?;
        let options = PictureOptions::default();
        Ok(Self {
            place: Place::File(output.to_owned()),
            linear: format.samples()[0].are_linear(),
            format,
            options,
        })
    }

    /// Fails if the format has no pictures of that size.
    pub fn refuse_size(&self, size: Size) -> Result<(), Failure> {
        match self.format.most_side() {
            Some(most) if size.width.max(size.height) > most => {
                let message = format!(
                    "{}: a picture of that format has at most {most} pixels a side; write .png",
                    self.name()
                );
                Err(Failure::new(Code::Usage, message))
            }
            _ => Ok(()),
        }
    }

    /// Writes the picture there.
    pub fn write(&self, picture: &Picture) -> Result<(), Failure> {
        let Place::File(path) = &self.place else {
            let mut stdout = io::stdout().lock();
            return match stream_picture(&mut stdout, self.format, picture, &self.options) {
                Ok(()) => Ok(()),
                // Who reads has read enough: `veduta render … -o - | head`.
                Err(WriteProblem::Io(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
                Err(problem) => Err(Failure::new(
                    Code::InputOutput,
                    format!("stdout: {problem}"),
                )),
            };
        };
        Ok(write_picture_as(path, self.format, picture, &self.options)?)
    }

    /// The name to tell.
    pub fn name(&self) -> String {
        self.place.name()
    }
}

impl Place {
    /// The name to tell.
    pub fn name(&self) -> String {
        match self {
            Self::Stdout => "-".to_owned(),
            Self::File(path) => path.to_string_lossy().into_owned(),
        }
    }
}

/// Fails before the work rather than after it when the output has no folder to stand in.
pub fn refuse_output_nowhere(output: &Path) -> Result<(), Failure> {
    let folder = output
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let found = folder.map_or(Ok(()), |folder| match std::fs::metadata(folder) {
        Ok(metadata) if metadata.is_dir() => Ok(()),
        Ok(_) => Err("it is not a folder".to_owned()),
        Err(error) => Err(error.to_string()),
    });
    found.map_err(|reason| {
        let folder = folder.unwrap_or(output).display();
        let message = format!(
            "{}: cannot be written into {folder}: {reason}",
            output.display()
        );
        Failure::new(Code::InputOutput, message)
    })
}
