//! Pictures of other programs among the inputs of a composite.

use crate::exit::{Code, Failure};
use crate::talk::Talk;
use crate::values;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use veduta::map::{Camera, GuestKind};
use veduta_io::depth_picture::{DepthKind, DepthOptions};
use veduta_io::{GuestOptions, LoadedGuest, PictureFormat, read_guest};

/// How the depths of other programs' pictures are to be understood.
#[derive(Debug, Args)]
#[command(next_help_heading = "Pictures of other programs")]
pub struct Depths {
    /// What the depths of .exr are; by default what the program that wrote the file is known to write,
    /// which is told
    #[arg(long, value_name = "KIND")]
    depth_kind: Option<KindArgument>,
    /// The channel of depth, by its full name, where the file has several
    #[arg(long, value_name = "NAME")]
    depth_channel: Option<String>,
    /// Metres in a unit of the depths: 0.01 for centimetres
    #[arg(long, value_name = "METRES", value_parser = values::length, default_value = "1")]
    depth_unit: f64,
    /// Depth of the near plane, for ndc and reversed-ndc
    #[arg(long, value_name = "D", value_parser = values::length)]
    depth_near: Option<f64>,
    /// Depth of the far plane, for ndc and reversed-ndc; infinite by default
    #[arg(long, value_name = "D", value_parser = values::length)]
    depth_far: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum KindArgument {
    /// Along the line of sight's axis: Blender, OpenEXR
    Planar,
    /// Along the ray to the point: Mitsuba, many ray tracers
    Ray,
    /// One over the planar depth: Nuke
    Inverse,
    /// A graphics card's: 0 at the near plane, 1 at the far one
    Ndc,
    /// A graphics card's: 1 at the near plane, 0 at the far one
    ReversedNdc,
}

impl Depths {
    fn kind(&self) -> Result<Option<DepthKind>, Failure> {
        let planes = self.depth_near.is_some() || self.depth_far.is_some();
        let device = |reversed| {
            let Some(near) = self.depth_near else {
                let message = "depths of a graphics card need the depth of its near plane: \
                    --depth-near D, and --depth-far D unless that is infinite";
                return Err(Failure::new(Code::Usage, message));
            };
            Ok(DepthKind::Device {
                near,
                far: self.depth_far.unwrap_or(f64::INFINITY),
                reversed,
            })
        };
        let kind = match self.depth_kind {
            Some(KindArgument::Ndc) => return device(false).map(Some),
            Some(KindArgument::ReversedNdc) => return device(true).map(Some),
            Some(KindArgument::Planar) => Some(DepthKind::Planar),
            Some(KindArgument::Ray) => Some(DepthKind::Ray),
            Some(KindArgument::Inverse) => Some(DepthKind::Inverse),
            None => None,
        };
        if planes {
            let message = "--depth-near and --depth-far are for --depth-kind ndc and reversed-ndc";
            return Err(Failure::new(Code::Usage, message));
        }
        Ok(kind)
    }

    /// Reads a picture as what `camera` sees; with none, as what its own one does.
    pub fn read(
        &self,
        input: &GuestInput,
        camera: Option<Camera>,
        trust_camera: bool,
        strict: bool,
        talk: &mut Talk,
    ) -> Result<LoadedGuest, Failure> {
        let options = GuestOptions {
            depth: DepthOptions {
                kind: self.kind()?,
                channel: self.depth_channel.clone(),
                metres_per_unit: self.depth_unit,
                camera: None,
            },
            card: input.depth,
            camera,
            trust_camera,
        };
        let loaded = read_guest(&input.path, &options)?;
        for warning in &loaded.warnings {
            let message = format!("{}: {warning}", input.path.display());
            talk.warn_or_fail(message, strict, Code::BadInput)?;
        }
        Ok(loaded)
    }
}

/// A picture among the inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct GuestInput {
    pub path: PathBuf,
    /// Of a card, in metres.
    pub depth: Option<f64>,
}

impl GuestInput {
    /// The picture that an argument names, if it names one: FILE.exr, or FILE@DEPTH.
    pub fn of(argument: &Path) -> Result<Option<Self>, Failure> {
        match PictureFormat::of(argument) {
            Ok(PictureFormat::Exr) => {
                return Ok(Some(Self {
                    path: argument.to_owned(),
                    depth: None,
                }));
            }
            Ok(_) => {
                let name = argument.display();
                let message = format!("{name}: tells no depths; lay it at one, as in {name}@12m");
                return Err(Failure::new(Code::Usage, message));
            }
            Err(_) => {}
        }
        let parts = argument.to_str().and_then(|text| text.rsplit_once('@'));
        let Some((path, depth)) =
            parts.filter(|(path, _)| PictureFormat::of(Path::new(path)).is_ok())
        else {
            return Ok(None);
        };
        let depth = values::length(depth).map_err(|problem| {
            let message = format!("{}: the depth after @: {problem}", argument.display());
            Failure::new(Code::Usage, message)
        })?;
        Ok(Some(Self {
            path: path.into(),
            depth: Some(depth),
        }))
    }
}

/// What a kind of guest is called.
pub fn kind_name(kind: GuestKind) -> &'static str {
    match kind {
        GuestKind::Deep => "deep picture",
        GuestKind::Depth => "picture with depths",
        GuestKind::Card => "card",
    }
}
