use super::{UpAxisArgument, load, unknown_name};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use crate::values::{self, Background, FieldOfView, Size};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use veduta::accumulate::Picture;
use veduta::map::{Camera, Projection};
use veduta::pipeline::{self, RenderSettings, Sampling, Shortcoming};
use veduta::scene::{Bounds, FRAMING_FOV, Scene, framing_camera_of_fov};
use veduta_geometry::{DVec2, DVec3};
use veduta_io::tone::{self, Exposure, Tone};
use veduta_io::{Loaded, PictureFormat, PictureOptions, PngDepth, write_picture};

/// Make a picture of a model
///
/// Without a camera the whole model is shown, three quarters from the front right and a little from
/// above; of a scene file, its first camera is used. World axes: Z is up; a model's front is -Y.
#[derive(Debug, Args)]
pub struct Render {
    /// The model: .glb, .gltf, .obj, or a scene file: .toml
    model: PathBuf,
    /// The picture: .png, .exr or .npy
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Size in pixels; that of the scene file's camera by default, else 1280x960
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Show one layer of a scene file only; may be given several times
    #[arg(long, value_name = "NAME")]
    layer: Vec<String>,
    /// How areas in pixels are found: exact, or multiscan:N for N sub-scanlines a pixel
    #[arg(long, value_name = "HOW", default_value = "exact", value_parser = values::sampling)]
    sampling: Sampling,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    view: View,
    #[command(flatten)]
    look: Look,
}

/// Where the picture is taken from.
#[derive(Debug, Args)]
#[command(next_help_heading = "View")]
struct View {
    /// A camera of the model by its name; auto shows the whole model
    #[arg(long, value_name = "NAME", conflicts_with = "eye")]
    camera: Option<String>,
    /// Where the eye stands, in metres
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    eye: Option<DVec3>,
    /// What the eye looks at; the middle of the model by default
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true, requires = "eye")]
    look_at: Option<DVec3>,
    /// What is upwards in the picture; 0,0,1 by default
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true, requires = "eye")]
    up: Option<DVec3>,
    /// Vertical field of view, such as 40deg
    #[arg(long, value_name = "ANGLE", conflicts_with = "parallel")]
    fov: Option<FieldOfView>,
    /// Parallel projection, with this height of the frame in metres
    #[arg(long, value_name = "HEIGHT", value_parser = values::length)]
    parallel: Option<f64>,
    /// Move the frame over the picture's plane, in its widths to the right and heights upwards: 0,0.25
    /// shows a quarter more above, and uprights stay upright
    #[arg(long, value_name = "X,Y", value_parser = values::shift, allow_hyphen_values = true)]
    shift: Option<DVec2>,
    /// Distance in metres before which nothing is shown
    #[arg(long, value_name = "D", value_parser = values::length)]
    near: Option<f64>,
    /// The axis of the file that points upwards; the format's habit by default
    #[arg(long, value_name = "AXIS")]
    up_axis: Option<UpAxisArgument>,
}

/// How light becomes colour.
#[derive(Debug, Args)]
#[command(next_help_heading = "Look")]
struct Look {
    /// Show the colours of materials as they are, without light
    #[arg(long)]
    unlit: bool,
    /// none, or a colour such as #8ab4d8
    #[arg(long, value_name = "COLOUR", default_value = "none")]
    background: Background,
    /// auto, or doublings of light; auto for lit .png by default, else 0
    #[arg(long, value_name = "EV", value_parser = values::exposure, allow_hyphen_values = true)]
    exposure: Option<Exposure>,
    /// How highlights are rolled off; filmic for lit .png by default, else none
    #[arg(long, value_name = "CURVE")]
    tone: Option<ToneArgument>,
    /// Bits of a channel of a .png
    #[arg(long, value_name = "BITS", default_value = "8")]
    depth: DepthArgument,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ToneArgument {
    /// Cut off what is brighter than white
    None,
    /// Leave middle tones, roll off highlights
    Filmic,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DepthArgument {
    /// 8 bits
    #[value(name = "8")]
    Eight,
    /// 16 bits
    #[value(name = "16")]
    Sixteen,
}

impl Render {
    pub fn run(&self, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        let format = PictureFormat::of(&self.output)?;
        refuse_output_nowhere(&self.output)?;
        let loaded = load(&self.model, self.view.up_axis, self.strict, talk)?;
        let name = self.view.camera_name(&loaded);
        let size = self.size(&loaded, name)?;
        // Of the whole scene, so that pictures of its layers fit one on the other.
        let camera = self.view.camera(&self.model, &loaded.scene, name, size)?;
        let mut scene = loaded.scene;
        self.keep_layers(&mut scene)?;

        let settings = RenderSettings {
            width: size.width,
            height: size.height,
            sampling: self.sampling,
            unlit: self.look.unlit,
        };
        if self.sampling != Sampling::Exact {
            let message = "--sampling multiscan makes no pictures yet; leave it out";
            return Err(Failure::new(Code::Unsupported, message));
        }
        talk.begin("finding visibility");
        let map = pipeline::find_visibility(&scene, &camera);
        self.tell_shortcomings(&scene, &pipeline::shortcomings(&scene, &map), talk)?;
        talk.begin("shading");
        let mut picture = pipeline::render_map(&scene, &map, &settings);
        talk.begin("developing");
        let ev = self.look.develop(&mut picture, &scene, format);
        talk.begin("writing");
        let depth = match self.look.depth {
            DepthArgument::Eight => PngDepth::Eight,
            DepthArgument::Sixteen => PngDepth::Sixteen,
        };
        write_picture(&self.output, &picture, &PictureOptions { depth })?;
        talk.end();
        talk.detail(format_args!(
            "{} faces, exposure {ev:.2} EV",
            scene.face_count()
        ));

        if json {
            let told = serde_json::json!({
                "output": self.output.to_string_lossy(),
                "size": [size.width, size.height],
                "faces": scene.face_count(),
                "exposure": ev,
                "warnings": talk.warnings(),
            });
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// The size asked for, or that of the camera called `name`.
    fn size(&self, loaded: &Loaded, name: Option<&str>) -> Result<Size, Failure> {
        if let Some(size) = self.size {
            return Ok(size);
        }
        let mut sizes = loaded.picture_sizes.iter();
        match sizes.find(|(of, _)| Some(of.as_str()) == name) {
            Some(&(_, [width, height])) => {
                Size::new(width.into(), height.into()).map_err(|problem| {
                    let name = name.unwrap_or_default();
                    let message = format!("{}: camera {name:?}: {problem}", self.model.display());
                    Failure::new(Code::BadInput, message)
                })
            }
            None => Ok(DEFAULT_SIZE),
        }
    }

    /// Leaves out all layers but those asked for.
    fn keep_layers(&self, scene: &mut Scene) -> Result<(), Failure> {
        if self.layer.is_empty() {
            return Ok(());
        }
        let names = scene.layers.iter().map(|layer| layer.name.as_str());
        for name in &self.layer {
            if names.clone().all(|known| known != name) {
                let message = format!(
                    "{}: no layer {name:?}; {}",
                    self.model.display(),
                    unknown_name(name, "layers", names)
                );
                return Err(Failure::new(Code::Missing, message));
            }
        }
        scene.keep_layers(|layer| self.layer.contains(&layer.name));
        Ok(())
    }

    /// Warns of what the picture will not show as it should; if strict, fails.
    fn tell_shortcomings(
        &self,
        scene: &Scene,
        shortcomings: &[Shortcoming],
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        let model = self.model.display();
        for shortcoming in shortcomings {
            let message = match shortcoming {
                Shortcoming::DrawnOpaque(material) => {
                    let name = &scene.material(*material).name;
                    format!("{model}: the material {name:?} is not opaque, but drawn so")
                }
                Shortcoming::VeilsLeftOut(count) => {
                    format!("{model}: {count} pieces of surfaces that are not opaque are left out")
                }
                other => format!("{model}: not shown as it should be: {other:?}"),
            };
            if self.strict {
                let message = format!("{message} (an error because of --strict)");
                return Err(Failure::new(Code::Unsupported, message));
            }
            talk.warn(message);
        }
        Ok(())
    }
}

/// Fails before the work rather than after it when the output has no folder to stand in.
fn refuse_output_nowhere(output: &Path) -> Result<(), Failure> {
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

/// Size of a picture where neither the user nor a camera tells one.
const DEFAULT_SIZE: Size = Size {
    width: 1280,
    height: 960,
};

/// Depth of the near plane where none is given, as a share of the scene's size.
const NEAR_SHARE: f64 = 1e-5;

impl View {
    /// The name of the camera that is to be used, if it has one: the one asked for, else that which
    /// the scene file means.
    fn camera_name<'a>(&'a self, loaded: &'a Loaded) -> Option<&'a str> {
        match (&self.camera, self.eye) {
            (Some(name), _) => Some(name.as_str()).filter(|name| *name != "auto"),
            (None, Some(_)) => None,
            (None, None) => loaded.default_camera.as_deref(),
        }
    }

    /// The camera that the arguments ask for: the one called `name`, or one that they describe.
    fn camera(
        &self,
        model: &Path,
        scene: &Scene,
        name: Option<&str>,
        size: Size,
    ) -> Result<Camera, Failure> {
        let aspect = f64::from(size.width) / f64::from(size.height);
        let Some(bounds) = Bounds::of_scene(scene) else {
            let message = format!(
                "{}: has no faces, so there is nothing to show",
                model.display()
            );
            return Err(Failure::new(Code::BadInput, message));
        };
        let mut camera = match self.eye {
            Some(eye) => self.explicit(eye, &bounds, aspect)?,
            None => match name {
                None => self.framing(scene, &bounds, aspect)?,
                Some(name) => self.named(model, scene, name, aspect)?,
            },
        };
        if let Some(shift) = self.shift {
            camera.shift = shift;
        }
        if let Some(near) = self.near {
            camera.near = near;
        }
        Ok(camera)
    }

    /// The projection asked for; without, a perspective of `fov`.
    fn projection(&self, fov: f64, aspect: f64) -> Projection {
        match self.parallel {
            Some(height) => Projection::Parallel { height, aspect },
            None => Projection::Perspective {
                tan_half_height: (0.5 * self.fov.map_or(fov, |fov| fov.0)).tan(),
                aspect,
            },
        }
    }

    fn explicit(&self, eye: DVec3, bounds: &Bounds, aspect: f64) -> Result<Camera, Failure> {
        let middle = 0.5 * (bounds.min + bounds.max);
        let look_at = self.look_at.unwrap_or(middle);
        let projection = self.projection(FRAMING_FOV, aspect);
        let near = match projection {
            Projection::Perspective { .. } => {
                let size = (bounds.max - bounds.min)
                    .length()
                    .max((look_at - eye).length());
                (NEAR_SHARE * size).max(f64::MIN_POSITIVE)
            }
            Projection::Parallel { .. } => 0.0,
        };
        let looking = |up| Camera::looking(eye, look_at, up, projection, near);
        let camera = match self.up {
            Some(up) => looking(up),
            // Straight up or down, north is upwards, as on a plan.
            None => looking(DVec3::Z).or_else(|| looking(DVec3::Y)),
        };
        camera.ok_or_else(|| {
            let message = "--eye, --look-at and --up define no direction: the eye must not stand \
                on what it looks at, nor look along --up";
            Failure::new(Code::Usage, message)
        })
    }

    fn framing(&self, scene: &Scene, bounds: &Bounds, aspect: f64) -> Result<Camera, Failure> {
        let fov = self.fov.map_or(FRAMING_FOV, |fov| fov.0);
        let framing = framing_camera_of_fov(scene, aspect, fov);
        let camera = framing.and_then(|camera| match self.parallel {
            None => Some(camera),
            Some(_) => {
                let to_world = camera.eye_from_world.inverse();
                let forward = to_world.transform_vector3(DVec3::Z);
                let middle = 0.5 * (bounds.min + bounds.max);
                // From outside, so that nothing is behind the eye.
                let back = (bounds.max - bounds.min).length().max(f64::MIN_POSITIVE);
                let projection = self.projection(fov, aspect);
                Camera::looking(middle - back * forward, middle, DVec3::Z, projection, 0.0)
            }
        });
        camera.ok_or_else(|| {
            let message = "the model has no extent that a camera could frame; give --eye";
            Failure::new(Code::BadInput, message)
        })
    }

    fn named(
        &self,
        model: &Path,
        scene: &Scene,
        name: &str,
        aspect: f64,
    ) -> Result<Camera, Failure> {
        let Some((_, camera)) = scene.cameras.iter().find(|(known, _)| known == name) else {
            let names = scene.cameras.iter().map(|(name, _)| name.as_str());
            let message = format!(
                "{}: no camera {name:?}; {}",
                model.display(),
                unknown_name(name, "cameras", names)
            );
            return Err(Failure::new(Code::Missing, message));
        };
        // The picture's shape is the user's: the height of the view is kept.
        let mut camera = camera.with_aspect(aspect);
        if self.fov.is_some() || self.parallel.is_some() {
            let was_parallel = matches!(camera.projection, Projection::Parallel { .. });
            camera.projection = self.projection(FRAMING_FOV, aspect);
            if was_parallel && self.parallel.is_none() {
                let extent = Bounds::of_scene(scene).map_or(1.0, |b| (b.max - b.min).length());
                camera.near = (NEAR_SHARE * extent).max(f64::MIN_POSITIVE);
            }
        }
        Ok(camera)
    }
}

impl Look {
    /// Applies exposure, tone and background; tells the exposure in EV.
    ///
    /// Only a lit picture for a display is exposed and toned unasked: linear formats are for further
    /// work, and unlit colours are to come through as they are.
    fn develop(&self, picture: &mut Picture, scene: &Scene, format: PictureFormat) -> f32 {
        let unlit = self.unlit || scene.materials.iter().all(|material| material.unlit);
        let for_display = format == PictureFormat::Png && !unlit;
        let (exposure, tone) = if for_display {
            (Exposure::Auto, Tone::Filmic)
        } else {
            (Exposure::Ev(0.0), Tone::None)
        };
        let tone = match self.tone {
            Some(ToneArgument::None) => Tone::None,
            Some(ToneArgument::Filmic) => Tone::Filmic,
            None => tone,
        };
        let ev = tone::exposure_of(picture, self.exposure.unwrap_or(exposure));
        if ev != 0.0 {
            tone::expose(picture, ev);
        }
        tone::apply_tone(picture, tone);
        if let Background::Color(color) = self.background {
            tone::lay_on(picture, color);
        }
        ev
    }
}
