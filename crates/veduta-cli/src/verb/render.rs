mod lens;

use super::deep::DeepTarget;
use super::look::{Development, Look};
use super::output::{Output, Target};
use super::stored::{Stored, refuse_place, tell_work};
use super::vector::{Subject, Vector, VectorTarget};
use super::{Reading, When, load, tell_of_mattes, tell_shortcomings, unknown_name};
use crate::exit::{Code, Failure};
use crate::preview::Screen;
use crate::talk::{Talk, print, print_bytes};
use crate::values::{self, FieldOfView, Size};
use clap::Args;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use veduta::accumulate::{Aovs, Picture};
use veduta::dice::PixelGrid;
use veduta::map::{self, Camera, Casters, Origin, Projection, SeenScene, Source};
use veduta::pipeline::{self, RenderSettings, Rendered, Sampling, Step};
use veduta::scene::{Bounds, FRAMING_FOV, Scene, framing_camera_of_fov};
use veduta_geometry::{DVec2, DVec3};
use veduta_io::{Layers, Loaded, reading_of, scaled};

/// Make a picture of a model
///
/// Without a camera the whole model is shown, three quarters from the front right and a little from
/// above; of a scene file, its first camera is used. World axes: Z is up; a model's front is -Y.
///
/// Pictures for a display (.png, .jpg, .webp, .tif of 8 or 16 bits) are exposed and toned unless told;
/// those for further work (.exr, .pfm, .npy, .tif of floats) are linear and left as they are.
///
/// Vector pictures (.svg, .pdf, .geojson) have one shape for neighbouring faces in one plane that look
/// alike, named as their objects are, with --trap against seams between them. A shape has one colour: the mean, where it has a
/// texture, smooth normals or colours at its corners. Lines are visible edges, those of
/// transparent faces too, which hide no line; hidden ones are dashed, if they are asked for.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Render {
    /// The model: .glb, .gltf, .obj, .stl, .ply, .city.json, or a scene file: .toml
    model: PathBuf,
    /// Size in pixels; that of the scene file's camera by default, else 1280x960
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Show one layer of a scene file only; may be given several times
    #[arg(long, value_name = "NAME")]
    layer: Vec<String>,
    /// How areas in pixels are found: exact, or multiscan:N for N sub-scanlines a pixel. A .veduta keeps
    /// the spans on these, which scale less well than regions
    #[arg(long, value_name = "HOW", default_value = "exact", value_parser = values::sampling)]
    sampling: Sampling,
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

    /// Keep the whole scene in a .veduta, hidden faces and those off the picture too, for shadows and
    /// mirrors; otherwise it names the files to read again
    #[arg(long, requires = "output")]
    self_contained: bool,

    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    view: View,
    #[command(flatten)]
    lens: lens::LensOptions,
    #[command(flatten)]
    when: When,
    #[command(flatten)]
    look: Look,
    #[command(flatten)]
    vector: Vector,
}

const EXAMPLES: &str = "\
Examples:
  A first look, in the terminal:
      veduta render town.obj --preview=blocks
  From a point of view, on a colour:
      veduta render town.obj -o a.png --eye 40,-60,25 --background '#cfdde6'
  A plan, north upwards, with 16 bits a channel:
      veduta render town.obj -o plan.tif --depth 16 --eye 0,0,100 --parallel 120
  Linear light for compositing, in tiles of half floats:
      veduta render town.obj -o town.exr --depth half --tile 64
  All that is seen in each pixel, with depths and ids, for deep compositing:
      veduta render town.obj -o deep.exr --deep --depth half
  With depth and mattes of all objects:
      veduta render town.obj -o town.exr --aov depth,normal,crypto-object
  A drawing for print, with lines of a quarter of a millimetre:
      veduta render town.obj -o town.pdf --lines crease --line-width 0.25mm
  A machine with what lies behind its outer walls dashed:
      veduta render town.obj -o b.svg --lines crease,hidden --hidden-behind 1
  A moment of what moves:
      veduta render voyage.toml --frame 36 -o a.png
  Lines only, for an illustration:
      veduta render town.obj -o a.svg --fill none --lines silhouette,crease
  What is seen, kept for any number of pictures; and with all that is not seen, for shadows:
      veduta render town.obj -o kept.veduta
      veduta render town.obj -o whole.veduta --self-contained
  A dome for a planetarium from a street, and all around as a panorama:
      veduta render town.obj --lens domemaster --eye 12,-8,1.7 -o dome.png
      veduta render town.obj --lens equirect --eye 12,-8,1.7 -o around.png
  What is seen all around, kept for pictures by any lens:
      veduta render town.obj --lens cube --eye 12,-8,1.7 -o 't_{side}.veduta'
  Onto a photograph, through a pipe:
      veduta render town.obj --background sky.jpg -o - | cat > town.png
";

/// Where the picture is taken from.
#[derive(Debug, Args)]
#[command(next_help_heading = "View")]
pub(super) struct View {
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
    #[command(flatten)]
    pub(super) reading: Reading,
}

/// Where a picture goes: into a file, small into the terminal, or both.
struct Places {
    target: Option<Target>,
    screen: Option<Screen>,
}

impl Places {
    /// The size of what the terminal shows of a picture of that size.
    fn preview_size(&self, size: Size) -> Option<[u32; 2]> {
        let screen = self.screen?;
        Some(screen.size_of(size.width, size.height))
    }

    /// Develops a picture that is asked for in that size, lets `write` write it, and shows it; the exposure in EV.
    fn develop(
        &self,
        mut picture: Picture,
        size: Size,
        development: &Development,
        talk: &mut Talk,
        write: impl FnOnce(&Target, &Picture, &mut Talk) -> Result<(), Failure>,
    ) -> Result<f32, Failure> {
        talk.begin("developing");
        // Before it is developed, since pictures are scaled in linear light.
        let preview = self.preview_size(size);
        let mut preview = preview.map(|[width, height]| scaled(&picture, width, height));
        let mut ev = 0.0;
        if let Some(target) = &self.target {
            ev = development.develop(&mut picture, !target.linear);
            write(target, &picture, talk)?;
        }
        if let (Some(screen), Some(preview)) = (self.screen, &mut preview) {
            match &self.target {
                Some(target) if !target.linear => development.develop_at(preview, ev, true),
                _ => ev = development.develop(preview, true),
            }
            talk.end();
            print_bytes(&screen.show(preview))?;
        }
        talk.end();
        Ok(ev)
    }
}

impl Render {
    /// Width and height in pixels where none are given.
    pub const USUAL_SIZE: [u32; 2] = [1280, 960];

    pub fn run(&self, force: bool, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        self.look.refuse_background_map()?;
        if let Some(lens) = self.lens.lens {
            return self.render_by_lens(lens, force, json, talk);
        }
        if let Some(target) = self.output.vector_target(&self.model, json)? {
            self.refuse_self_contained()?;
            return self.draw(&target, json, talk);
        }
        self.vector.refuse()?;
        if let Some(place) = self.output.map_place() {
            return self.run_to_map(place, force, json, talk);
        }
        self.refuse_self_contained()?;
        let target = self.output.target(&self.model, json)?;
        let deep_target = self.deep_target(&target)?;
        if self.sampling != Sampling::Exact {
            self.look.refuse_filter(
                "filters weigh exact regions, which --sampling multiscan does not find",
            )?;
        }
        let loaded = self.load(talk)?;
        // Of the whole scene, so that pictures of its layers fit one on the other.
        let (camera, size) = self.view.camera(&self.model, &loaded, self.size)?;
        if let Some(target) = &target {
            target.refuse_size(size)?;
        }
        let mut scene = loaded.scene;
        let rows_before = self.keep_layers(&mut scene)?;
        if let Some(target) = deep_target {
            return self.render_deep(&target, &scene, &camera, size, json, talk);
        }
        let development = self.look.development(&scene, self.strict, talk)?;

        let Some(places) = self.places(target, talk) else {
            return Ok(());
        };
        // A preview alone is made in its own size: areas are exact in any.
        let [width, height] = match (&places.target, places.preview_size(size)) {
            (None, Some(preview_size)) => preview_size,
            _ => [size.width, size.height],
        };
        let settings = RenderSettings {
            width,
            height,
            sampling: self.sampling,
            unlit: self.look.unlit,
            filter: self.look.filter(),
            aovs: self.output.aovs(),
        };
        let Rendered {
            picture,
            mut aovs,
            shortcomings,
        } = pipeline::render(&scene, &camera, &settings, |step| tell_step(step, talk));
        tell_shortcomings(&self.model, &scene, &shortcomings, self.strict, talk)?;
        // So that pictures of layers give an object the same number.
        for object in aovs.object.iter_mut().flatten() {
            if *object != Aovs::NOTHING {
                *object = rows_before[*object as usize];
            }
        }
        let ev = places.develop(
            picture,
            size,
            &development,
            talk,
            |target, picture, talk| {
                let layers = Layers {
                    aovs: &aovs,
                    scene: &scene,
                    camera: &camera,
                    grid: PixelGrid::of_frame(width, height),
                };
                tell_of_mattes(&self.model, &layers, self.strict, talk)?;
                talk.begin("writing");
                target.write(picture, self.output.has_layers().then_some(&layers))
            },
        )?;
        talk.detail(format_args!(
            "{} faces, exposure {ev:.2} EV",
            scene.face_count()
        ));

        if let (true, Some(target)) = (json, &places.target) {
            let told = serde_json::json!({
                "output": target.name(),
                "size": [size.width, size.height],
                "faces": scene.face_count(),
                "exposure": ev,
                "warnings": talk.warnings(),
            });
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// Where the picture goes; `None`, with a warning, if it would be seen nowhere.
    fn places(&self, target: Option<Target>, talk: &mut Talk) -> Option<Places> {
        let screen = self.output.preview.and_then(Screen::of);
        if target.is_none() && screen.is_none() {
            let message =
                "nothing is shown: stdout is no terminal; --preview=blocks shows it there";
            talk.warn(message.to_owned());
            return None;
        }
        Some(Places { target, screen })
    }

    fn load(&self, talk: &mut Talk) -> Result<Loaded, Failure> {
        let options = self.when.options(&self.view.reading);
        load(&self.model, &options, self.strict, talk)
    }

    /// Where the deep picture goes, if one is asked for.
    fn deep_target<'a>(
        &self,
        target: &'a Option<Target>,
    ) -> Result<Option<DeepTarget<'a>>, Failure> {
        match target {
            Some(target) if self.deep => {
                if self.sampling != Sampling::Exact {
                    let message = "--deep needs exact areas; leave --sampling out";
                    return Err(Failure::new(Code::Usage, message));
                }
                let why = "a deep picture keeps what is seen in each pixel alone";
                self.look.refuse_filter(why)?;
                self.output.deep_target(target).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// Makes a deep picture, and writes it as it is made.
    fn render_deep(
        &self,
        target: &DeepTarget,
        scene: &Scene,
        camera: &Camera,
        size: Size,
        json: bool,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        let settings = RenderSettings {
            width: size.width,
            height: size.height,
            sampling: self.sampling,
            unlit: self.look.unlit,
            ..RenderSettings::default()
        };
        let picture_size = [size.width, size.height];
        let (samples, ()) = target.write(scene, *camera, picture_size, |sink| {
            let begin = |step| tell_step(step, talk);
            pipeline::render_deep(scene, camera, &settings, begin, |rows| sink.write(rows))
        })?;
        talk.end();
        talk.detail(format_args!(
            "{} faces, {samples} samples",
            scene.face_count()
        ));
        if json {
            let told = serde_json::json!({
                "output": target.name(),
                "size": [size.width, size.height],
                "faces": scene.face_count(),
                "samples": samples,
                "warnings": talk.warnings(),
            });
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// Makes a vector picture.
    fn draw(&self, target: &VectorTarget, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        if self.deep {
            let message = "a deep picture is stored as .exr; leave --deep out";
            return Err(Failure::new(Code::Usage, message));
        }
        if self.sampling != Sampling::Exact {
            let message = "a vector picture is made of exact regions; leave --sampling out";
            return Err(Failure::new(Code::Usage, message));
        }
        self.look.refuse_filter("a vector picture has no pixels")?;
        let settings = self.vector.drawing(target.format)?;
        let loaded = self.load(talk)?;
        let (camera, size) = self.view.camera(&self.model, &loaded, self.size)?;
        let mut scene = loaded.scene;
        self.keep_layers(&mut scene)?;
        let development = self.look.development(&scene, self.strict, talk)?;
        talk.begin("finding visibility");
        let map = pipeline::find_visibility(&scene, &camera);
        let subject = Subject {
            file: &self.model,
            scene: &scene,
            map: &map,
            grid: &PixelGrid::of_frame(size.width, size.height),
            unlit: self.look.unlit,
            strict: self.strict,
        };
        let mut told = self
            .vector
            .draw(target, &settings, &subject, &development, talk)?;
        if json {
            told["faces"] = scene.face_count().into();
            told["warnings"] = talk.warnings().into();
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// Stores what is seen instead of showing it.
    fn run_to_map(
        &self,
        place: &Path,
        force: bool,
        json: bool,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        refuse_place(place, force)?;
        if self.output.preview.is_some() || self.output.has_layers() || self.deep {
            let message = "a map is of no picture: --preview, --aov and --deep are not for .veduta";
            return Err(Failure::new(Code::Usage, message));
        }
        self.look.refuse_filter("a map is of no picture")?;
        let loaded = self.load(talk)?;
        let (camera, size) = self.view.camera(&self.model, &loaded, self.size)?;
        let mut scene = loaded.scene;
        self.keep_layers(&mut scene)?;
        let (faces, size) = (scene.face_count(), [size.width, size.height]);
        talk.begin("finding visibility");
        let seen = match self.sampling {
            Sampling::Exact => {
                let map = pipeline::find_visibility(&scene, &camera);
                Stored::Regions(SeenScene::of(&scene, &map, size))
            }
            Sampling::Multiscan(n) => {
                let (seen, left_out) = pipeline::find_spans(&scene, &camera, size, n);
                tell_shortcomings(&self.model, &scene, &left_out, self.strict, talk)?;
                Stored::Spans(seen)
            }
        };
        talk.begin("writing");
        seen.write(place, &self.origin(scene, loaded.files))?;
        talk.end();
        talk.detail(format_args!("{}", seen.summary()));
        if json {
            let mut told = serde_json::json!({
                "output": place.to_string_lossy(),
                "size": size,
                "faces": faces,
                "facesSeen": seen.faces().len(),
                "warnings": talk.warnings(),
            });
            tell_work(&mut told);
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// What a map of `scene` is made of. `files` are those that the scene was read from.
    fn origin(&self, scene: Scene, files: Vec<Source>) -> Origin {
        let casters = if self.self_contained {
            Casters {
                embedded: Some(scene),
                readings: Vec::new(),
            }
        } else {
            let reading = map::Reading {
                layers: (!self.layer.is_empty()).then(|| self.layer.clone()),
                ..reading_of(files.clone(), &self.view.reading.options())
            };
            Casters {
                embedded: None,
                readings: vec![reading],
            }
        };
        Origin {
            sources: files,
            // Files that are read again are read at rest.
            casters: (self.self_contained || !self.when.is_asked_for()).then_some(casters),
        }
    }

    fn refuse_self_contained(&self) -> Result<(), Failure> {
        if self.self_contained {
            let message = "a picture does not hold its scene; --self-contained is for .veduta";
            return Err(Failure::new(Code::Usage, message));
        }
        Ok(())
    }

    /// Leaves out all layers but those asked for. Tells of each object that stays its row before.
    fn keep_layers(&self, scene: &mut Scene) -> Result<Vec<u32>, Failure> {
        if self.layer.is_empty() {
            return Ok((0..scene.objects.len() as u32).collect());
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
        let objects = scene.objects.iter().map(|object| object.name.clone());
        let rows: HashMap<String, u32> = objects.zip(0..).collect();
        scene.keep_layers(|layer| self.layer.contains(&layer.name));
        Ok(scene
            .objects
            .iter()
            .map(|object| rows[&object.name])
            .collect())
    }
}

/// Tells what the pipeline is about to do.
pub(super) fn tell_step(step: Step, talk: &mut Talk) {
    match step {
        Step::Projecting => talk.begin("projecting"),
        Step::FindingVisibility => talk.begin("finding visibility"),
        Step::FollowingLens => talk.begin("following the lens"),
        Step::View { index, count } => {
            if index == 0 {
                talk.begin("finding visibility");
            }
            talk.part(index, count);
        }
        Step::Shading => talk.begin("shading"),
        Step::Strip { index, count } => {
            if index == 0 {
                talk.begin("rendering strip by strip");
            }
            talk.part(index, count);
        }
        _ => {}
    }
}

/// The size that a scene file tells for the pictures of its camera called `name`; else the usual one.
fn size_of_camera(model: &Path, loaded: &Loaded, name: Option<&str>) -> Result<Size, Failure> {
    let mut sizes = loaded.picture_sizes.iter();
    let found = sizes.find(|(of, _)| Some(of.as_str()) == name);
    let [width, height] = found.map_or(Render::USUAL_SIZE, |&(_, size)| size);
    Size::new(width.into(), height.into()).map_err(|problem| {
        let name = name.unwrap_or_default();
        let message = format!("{}: camera {name:?}: {problem}", model.display());
        Failure::new(Code::BadInput, message)
    })
}

/// Depth of the near plane where none is given, as a share of the scene's size.
const NEAR_SHARE: f64 = 1e-5;

impl View {
    /// Whether any of the options is given.
    pub(super) fn is_asked_for(&self) -> bool {
        self.camera.is_some()
            || self.eye.is_some()
            || self.fov.is_some()
            || self.parallel.is_some()
            || self.shift.is_some()
            || self.near.is_some()
    }

    /// The camera that the arguments ask for, and the size of its picture: the size asked for, that
    /// of the scene file's camera, or the usual one.
    pub(super) fn camera(
        &self,
        model: &Path,
        loaded: &Loaded,
        size: Option<Size>,
    ) -> Result<(Camera, Size), Failure> {
        let name = self.camera_name(loaded);
        let size = match size {
            Some(size) => size,
            None => size_of_camera(model, loaded, name)?,
        };
        let scene = &loaded.scene;
        let aspect = f64::from(size.width) / f64::from(size.height);
        let Some(bounds) = Bounds::of_scene(scene) else {
            let message = format!(
                "{}: has no faces, so there is nothing to show",
                model.display()
            );
            return Err(Failure::new(Code::BadInput, message));
        };
        let mut camera = match self.eye {
            Some(eye) => self.explicit(eye, self.look_at, &bounds, aspect)?,
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
        Ok((camera, size))
    }

    /// The name of the camera that is to be used, if it has one: the one asked for, else that which
    /// the scene file means.
    pub(super) fn camera_name<'a>(&'a self, loaded: &'a Loaded) -> Option<&'a str> {
        match (&self.camera, self.eye) {
            (Some(name), _) => Some(name.as_str()).filter(|name| *name != "auto"),
            (None, Some(_)) => None,
            (None, None) => loaded.default_camera.as_deref(),
        }
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

    fn explicit(
        &self,
        eye: DVec3,
        look_at: Option<DVec3>,
        bounds: &Bounds,
        aspect: f64,
    ) -> Result<Camera, Failure> {
        let middle = 0.5 * (bounds.min + bounds.max);
        let look_at = look_at.unwrap_or(middle);
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
