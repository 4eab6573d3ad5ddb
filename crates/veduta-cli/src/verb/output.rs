//! Where a picture goes, and as what.

use super::deep::DeepTarget;
use super::vector::VectorTarget;
use crate::exit::{Code, Failure};
use crate::preview::Style;
use crate::values::Size;
use clap::{Args, ValueEnum};
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use veduta::accumulate::{AovSettings, Picture};
use veduta_io::deep_exr::DeepCompression;
use veduta_io::sphere::Panorama;
use veduta_io::{
    ExrCompression, Layers, PICTURE_SUFFIXES, PictureFormat, PictureOptions, Samples,
    VECTOR_SUFFIXES, VectorFormat, WriteProblem, is_map, reason, stream_layers, stream_picture,
    write_layers, write_picture_as,
};

/// Where a picture goes, and as what.
#[derive(Clone, Debug, Args)]
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
    /// Write further channels into an .exr, separated by commas
    ///
    /// Depth, normal, position and numbers are those of the face that covers most of the pixel, at the
    /// centroid of what is seen of it, and not filtered; albedo and Cryptomatte are exact areas,
    /// whatever the --filter. Where nothing is seen, depth is 1e10 and all else 0. The camera is told
    /// by worldToCamera and worldToNDC.
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "output")]
    aov: Vec<AovArgument>,
    /// How many names a Cryptomatte can tell of a pixel, rounded up to an even number; 6 by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=i64::from(Output::MOST_RANKS)), requires = "aov")]
    crypto_ranks: Option<u8>,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum AovArgument {
    /// Z: metres along the line of sight's axis, larger is farther
    Depth,
    /// N.X, N.Y, N.Z in world space, towards the eye
    Normal,
    /// P.X, P.Y, P.Z in world space, in metres
    Position,
    /// albedo.R, albedo.G, albedo.B: colours without light, premultiplied
    Albedo,
    /// id.object: its place in the list that `veduta info --json` tells of the input, counted from 1;
    /// 0 for none
    Object,
    /// id.material: likewise
    Material,
    /// id.face: likewise, in its object
    Face,
    /// Cryptomatte of the objects' names: exact coverage
    CryptoObject,
    /// Cryptomatte of the materials' names
    CryptoMaterial,
}

/// Names that a Cryptomatte tells of a pixel unless told; what other programs write.
const USUAL_RANKS: u8 = 6;

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
    /// The most names of a pixel in a Cryptomatte: 99 layers of two.
    pub const MOST_RANKS: u8 = 198;

    /// The name of the files, for a verb that writes several.
    pub fn file(&self) -> Result<&Path, Failure> {
        let message = "frames are written by -o FILE; --preview is for veduta render";
        let output = self.output.as_deref();
        output.ok_or_else(|| Failure::new(Code::Usage, message))
    }

    /// The same in another file.
    pub fn at(&self, file: &Path) -> Self {
        Self {
            output: Some(file.to_owned()),
            ..self.clone()
        }
    }

    /// The place of a stored map, if one is asked for.
    pub fn map_place(&self) -> Option<&Path> {
        let output = self.output.as_deref();
        output.filter(|output| self.format.is_none() && is_map(output))
    }

    /// The place for a vector picture of `input`, if one is asked for.
    pub fn vector_target(&self, input: &Path, json: bool) -> Result<Option<VectorTarget>, Failure> {
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
            (!self.aov.is_empty(), "--aov"),
        ];
        if let Some((_, option)) = for_pixels.into_iter().find(|(is_given, _)| *is_given) {
            let message = format!("{option} is for pictures of pixels, not for vector pictures");
            return Err(Failure::new(Code::Usage, message));
        }
        let place = self.place(input, output, json)?;
        Ok(Some(VectorTarget { place, format }))
    }

    /// Where `output` leads.
    fn place(&self, input: &Path, output: &Path, json: bool) -> Result<Place, Failure> {
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
            let name = input.with_extension("png");
            let name = name.file_name().unwrap_or("picture.png".as_ref());
            refuse_folder(output, &name.to_string_lossy())?;
            Ok(Place::File(output.to_owned()))
        }
    }

    /// The place for a picture of pixels, if one is asked for.
    ///
    /// `input` is the file that the picture is made of.
    pub fn target(&self, input: &Path, json: bool) -> Result<Option<Target>, Failure> {
        let Some(output) = &self.output else {
            return Ok(None);
        };
        let usage = |message: String| Err(Failure::new(Code::Usage, message));
        let place = self.place(input, output, json)?;
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
        if self.has_layers() && format != PictureFormat::Exr {
            return usage("--aov is for .exr".into());
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

    /// `target` for a deep picture.
    pub fn deep_target<'a>(&self, target: &'a Target) -> Result<DeepTarget<'a>, Failure> {
        let usage = |message: &str| Err(Failure::new(Code::Usage, message));
        if target.format != PictureFormat::Exr {
            return usage("a deep picture is stored as .exr; name one with -o");
        }
        if self.tile.is_some() {
            return usage("a deep picture is stored in scanlines; leave --tile out");
        }
        let compression = match self.compression {
            None | Some(CompressionArgument::Zips) => DeepCompression::Zips,
            Some(CompressionArgument::None) => DeepCompression::None,
            Some(CompressionArgument::Rle) => DeepCompression::Rle,
            Some(_) => {
                return usage("a deep picture is compressed by --compression zips, rle or none");
            }
        };
        // The format's habit is floats.
        let samples = target.options.samples.unwrap_or(Samples::F32);
        Ok(DeepTarget {
            target,
            compression,
            samples,
        })
    }

    /// Whether channels are asked for beside the light.
    pub fn has_layers(&self) -> bool {
        !self.aov.is_empty()
    }

    /// Whether numbers of objects, materials or faces are asked for.
    pub fn has_numbers(&self) -> bool {
        let of_scene = [
            AovArgument::Object,
            AovArgument::Material,
            AovArgument::Face,
        ];
        self.aov.iter().any(|aov| of_scene.contains(aov))
    }

    /// The channels asked for beside the light.
    pub fn aovs(&self) -> AovSettings {
        let asks_for = |aov| self.aov.contains(&aov);
        let ranks = self.crypto_ranks.unwrap_or(USUAL_RANKS);
        let ranks = usize::from(ranks).next_multiple_of(2);
        let ranks_of = |aov| if asks_for(aov) { ranks } else { 0 };
        AovSettings {
            depth: asks_for(AovArgument::Depth),
            normal: asks_for(AovArgument::Normal),
            position: asks_for(AovArgument::Position),
            albedo: asks_for(AovArgument::Albedo),
            object: asks_for(AovArgument::Object),
            material: asks_for(AovArgument::Material),
            face: asks_for(AovArgument::Face),
            object_ranks: ranks_of(AovArgument::CryptoObject),
            material_ranks: ranks_of(AovArgument::CryptoMaterial),
        }
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
            panorama: None,
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

    /// The format.
    pub fn format(&self) -> PictureFormat {
        self.format
    }

    /// The same for a picture that tells of itself as one of a sphere.
    pub fn of_panorama(mut self, panorama: Option<Panorama>) -> Self {
        self.options.panorama = panorama;
        self
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

    /// The file, unless it is stdout.
    pub fn file(&self) -> Option<&Path> {
        match &self.place {
            Place::Stdout => None,
            Place::File(path) => Some(path),
        }
    }

    /// Writes the picture there, with `layers` if it is an .exr.
    pub fn write(&self, picture: &Picture, layers: Option<&Layers>) -> Result<(), Failure> {
        let (format, options) = (self.format, &self.options);
        let Place::File(path) = &self.place else {
            let mut stdout = io::stdout().lock();
            let streamed = match layers {
                Some(layers) => stream_layers(&mut stdout, picture, layers, options),
                None => stream_picture(&mut stdout, format, picture, options),
            };
            return streamed.or_else(written_to_stdout);
        };
        let written = match layers {
            Some(layers) => write_layers(path, picture, layers, options),
            None => write_picture_as(path, format, picture, options),
        };
        Ok(written?)
    }

    /// The name to tell.
    pub fn name(&self) -> String {
        self.place.name()
    }

    /// The file, if it is not stdout.
    pub fn path(&self) -> Option<&Path> {
        match &self.place {
            Place::Stdout => None,
            Place::File(path) => Some(path),
        }
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

/// What a failure to write to stdout means.
pub fn written_to_stdout(problem: WriteProblem) -> Result<(), Failure> {
    match problem {
        // Who reads has read enough: `veduta render … -o - | head`.
        WriteProblem::Io(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        problem => Err(Failure::new(
            Code::InputOutput,
            format!("stdout: {problem}"),
        )),
    }
}

/// Fails before the work rather than after it when the output has no folder to stand in.
pub fn refuse_output_nowhere(output: &Path) -> Result<(), Failure> {
    let folder = output
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let found = folder.map_or(Ok(()), |folder| match std::fs::metadata(folder) {
        Ok(metadata) if metadata.is_dir() => Ok(()),
        Ok(_) => Err(format!("{} is not a folder", folder.display())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(format!(
            "there is no folder {}; make it first",
            folder.display()
        )),
        Err(error) => Err(format!("{}: {}", folder.display(), reason(&error))),
    });
    found.map_err(|problem| {
        let message = format!("{}: {problem}", output.display());
        Failure::new(Code::InputOutput, message)
    })
}

/// Fails where a folder stands in the place of the file. `name` is that of a file, for the message.
fn refuse_folder(output: &Path, name: &str) -> Result<(), Failure> {
    if !output.is_dir() {
        return Ok(());
    }
    let message = format!(
        "{}: is a folder; name a file in it, such as {}",
        output.display(),
        output.join(name).display()
    );
    Err(Failure::new(Code::InputOutput, message))
}
