//! `veduta render --lens`: domes, panoramas, mirror balls and cubes.

use super::{Render, View, tell_step};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use crate::values::{self, Size};
use clap::{Args, ValueEnum};
use std::fmt;
use std::str::FromStr;
use veduta::accumulate::Picture;
use veduta::map::{self, Camera};
use veduta::pipeline::{self, RenderSettings, Sampling, Surroundings};
use veduta::reproject::{LENS_NAMES, Lens, Orientation, Projection};
use veduta::scene::{Bounds, Scene};
use veduta_geometry::{DVec2, DVec3};
use veduta_io::Loaded;

/// By which lens the picture is made.
#[derive(Debug, Args)]
#[command(next_help_heading = "Lens")]
pub struct LensOptions {
    /// Make the picture by another lens: omnimax, domemaster[:FOV], fisheye[:FOV], equirect, cylinder, mercator,
    /// stereographic[:FOV], ball and others, or cube for the six faces as a cross
    ///
    /// Regions stay exact under it: areas are found in the lens's own pixels, lines are bent within 1/64 of a pixel, and
    /// there are no faces of a cube to be seen. The lens looks where the camera does, with what is up in the camera's
    /// picture up in its own, so look level (--look-at as high as --eye) for a level dome. Only what the lens
    /// looks at is found. A lens has its own angle and no frame, so that --fov, --parallel and --shift are
    /// not for it. Not made by a lens: vector pictures, .veduta, --deep, --aov, --filter, --sampling multiscan.
    #[arg(long, value_name = "LENS")]
    pub lens: Option<LensArgument>,
    /// How a lens's picture is made: exact regions, or ewa: by ellipses from pictures of the cube's faces, softer, and
    /// blind to what their pixels do not show
    #[arg(long, value_name = "HOW", default_value = "exact", requires = "lens")]
    lens_filter: LensFilter,
    /// How far the lens's axis is raised above the line of sight: 90deg for domemaster, 11deg for omnimax, else 0
    #[arg(long, value_name = "ANGLE", value_parser = values::angle, allow_hyphen_values = true, requires = "lens")]
    elevation: Option<f64>,
    /// Turn the lens to the right, before it is raised
    #[arg(long, value_name = "ANGLE", value_parser = values::angle, allow_hyphen_values = true, requires = "lens")]
    yaw: Option<f64>,
    /// Turn the lens clockwise around its axis, at last
    #[arg(long, value_name = "ANGLE", value_parser = values::angle, allow_hyphen_values = true, requires = "lens")]
    roll: Option<f64>,
}

/// `--lens-filter`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LensFilter {
    /// Exact areas in the lens's own pixels
    Exact,
    /// The elliptical weighted average of Greene & Heckbert (1986)
    Ewa,
}

/// Pixels along a face of the cube for each pixel of the lens in the same angle, at least, where its picture is
/// filtered. Less blurs; more costs time.
const FACE_PIXELS: f64 = 2.0;

/// The largest face of the cube, in pixels.
const MOST_FACE: f64 = 8192.0;

/// `--lens`
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LensArgument {
    /// A picture by one lens.
    Lens(Lens),
    /// The faces of a cube, as a cross of four columns and three rows.
    Cube,
}

impl FromStr for LensArgument {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        if name == "cube" {
            return Ok(Self::Cube);
        }
        match name.parse() {
            Ok(lens) => Ok(Self::Lens(lens)),
            Err(veduta::reproject::LensError::Unknown { .. }) => Err(format!(
                "there is no lens of that name; there are {LENS_NAMES}, cube"
            )),
            Err(problem) => Err(problem.to_string()),
        }
    }
}

impl fmt::Display for LensArgument {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Lens(lens) => lens.fmt(formatter),
            Self::Cube => formatter.write_str("cube"),
        }
    }
}

/// Columns and rows of the cross of a cube's faces.
const CROSS: [u32; 2] = [4, 3];

impl LensArgument {
    /// The size of a picture where none is given.
    fn usual_size(self) -> Size {
        let aspect = match self {
            Self::Lens(lens) => lens.aspect(),
            Self::Cube => f64::from(CROSS[0]) / f64::from(CROSS[1]),
        };
        let width = if aspect > 1.5 { 2048 } else { 1024 };
        // A cylinder that reaches almost to the poles is higher than any picture; so much of it is enough.
        let height = (f64::from(width) / aspect).round().clamp(1.0, 65_535.0);
        Size {
            width,
            height: height as u32,
        }
    }
}

impl Render {
    /// Fails for all that no picture by a lens is made with.
    fn refuse_with_lens(&self, lens: LensArgument) -> Result<(), Failure> {
        let output = &self.output;
        let is_vector = output.vector_target(&self.model, false)?.is_some();
        let not_made = [
            (is_vector, "vector pictures"),
            (output.map_place().is_some(), "stored maps (.veduta)"),
            (self.deep, "--deep"),
            (output.has_layers(), "--aov"),
            (!self.look.is_by_area(), "--filter"),
            (self.sampling != Sampling::Exact, "--sampling multiscan"),
        ];
        if let Some((_, what)) = not_made.into_iter().find(|not_made| not_made.0) {
            let message = format!(
                "{what}: not made by a lens; leave --lens {lens} out, or make a picture of pixels, by area"
            );
            return Err(Failure::new(Code::Unsupported, message));
        }
        let without_meaning = [
            (self.view.fov.is_some(), "--fov"),
            (self.view.parallel.is_some(), "--parallel"),
            (self.view.shift.is_some(), "--shift"),
        ];
        match without_meaning.into_iter().find(|option| option.0) {
            Some((_, option)) => {
                let message = format!(
                    "{option} is of a frame, which a lens has not; tell its angle by --lens, as in fisheye:220"
                );
                Err(Failure::new(Code::Usage, message))
            }
            None => self.refuse_self_contained(),
        }
    }

    /// Makes the picture by a lens.
    pub(super) fn render_by_lens(
        &self,
        lens: LensArgument,
        json: bool,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        self.refuse_with_lens(lens)?;
        self.vector.refuse()?;
        let target = self.output.target(&self.model, json)?;
        let size = self.size.unwrap_or_else(|| lens.usual_size());
        if let Some(target) = &target {
            target.refuse_size(size)?;
        }
        if lens == LensArgument::Cube {
            refuse_no_cross(size)?;
            if self.lens.lens_filter == LensFilter::Ewa {
                let message = "the faces of a cube are made as they are; leave --lens-filter out";
                return Err(Failure::new(Code::Usage, message));
            }
        }
        let loaded = self.load(talk)?;
        let eye = self.view.eye_of_lens(self, &loaded, size)?;
        let mut scene = loaded.scene;
        self.keep_layers(&mut scene)?;
        let development = self.look.development(&scene, self.strict, talk)?;
        let Some(places) = self.places(target, talk) else {
            return Ok(());
        };
        let (picture, told_of_lens) = match lens {
            LensArgument::Lens(lens) => self.by_lens(lens, &scene, &eye, size, talk),
            LensArgument::Cube => {
                let settings = RenderSettings {
                    width: size.width / CROSS[0],
                    height: size.height / CROSS[1],
                    unlit: self.look.unlit,
                    ..RenderSettings::default()
                };
                let eye = self.lens.turned(&eye);
                let picture =
                    pipeline::render_cube(&scene, &eye, &settings, |step| tell_step(step, talk));
                (picture, serde_json::json!({}))
            }
        };
        let ev = places.develop(
            picture,
            size,
            &development,
            talk,
            |target, picture, talk| {
                talk.begin("writing");
                target.write(picture, None)
            },
        )?;
        talk.detail(format_args!(
            "{} faces, exposure {ev:.2} EV",
            scene.face_count()
        ));
        if let (true, Some(target)) = (json, &places.target) {
            let mut told = serde_json::json!({
                "output": target.name(),
                "size": [size.width, size.height],
                "faces": scene.face_count(),
                "exposure": ev,
                "lens": lens.to_string(),
                "warnings": talk.warnings(),
            });
            if let (Some(told), serde_json::Value::Object(more)) =
                (told.as_object_mut(), told_of_lens)
            {
                told.extend(more);
            }
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// The picture, and what is told of how it was made.
    fn by_lens(
        &self,
        lens: Lens,
        scene: &Scene,
        eye: &Camera,
        size: Size,
        talk: &mut Talk,
    ) -> (Picture, serde_json::Value) {
        let orientation = self.lens.orientation(lens.usual_elevation());
        let projection = Projection::new(lens, orientation, size.width, size.height);
        if self.lens.lens_filter == LensFilter::Ewa {
            let side = face_side(&projection);
            let unlit = self.look.unlit;
            let begin = |step| tell_step(step, talk);
            let (picture, faces) =
                pipeline::render_filtered(scene, eye, &projection, side, unlit, begin);
            let faces: Vec<&str> = faces.into_iter().map(|face| face.name()).collect();
            return (
                picture,
                serde_json::json!({ "faceSide": side, "views": faces }),
            );
        }
        let surroundings = pipeline::find_surroundings(scene, eye, &projection, |step| {
            tell_step(step, talk);
        });
        talk.begin("shading");
        let unlit = self.look.unlit;
        let picture = pipeline::render_surroundings(scene, &surroundings, &projection, unlit);
        (picture, told_of(&surroundings))
    }
}

/// Pixels along the side of the cube's faces from which a picture is filtered: by the lens's scale at its middle, where
/// round lenses show most.
fn face_side(projection: &Projection) -> u32 {
    let middle = projection.image_from_lens(DVec2::ZERO);
    let per_pixel = projection
        .ray(middle)
        .map_or(DVec3::ONE, |ray| ray.derivatives[1])
        .length();
    // A face is two radians wide by the scale of its own middle, where it shows least.
    let side = (FACE_PIXELS * 2.0 / per_pixel).min(MOST_FACE);
    (side as u32).next_multiple_of(64)
}

fn told_of(surroundings: &Surroundings) -> serde_json::Value {
    let views = surroundings.views.iter().map(|seen| {
        let [min, max] = seen.view.window;
        serde_json::json!({
            "face": seen.view.face.name(),
            "window": [min.x, min.y, max.x, max.y],
            "fragments": seen.map.fragment_count(),
        })
    });
    serde_json::json!({
        "facesSeen": surroundings.faces_seen(),
        "patches": surroundings.patches,
        "views": views.collect::<Vec<_>>(),
    })
}

/// Fails if a picture of that size has no cross of square faces.
fn refuse_no_cross(size: Size) -> Result<(), Failure> {
    let side = size.width / CROSS[0];
    if side > 0 && [size.width, size.height] == CROSS.map(|sides| sides * side) {
        return Ok(());
    }
    let side = side.max(1);
    let message = format!(
        "a cube's faces lie in {} columns and {} rows of squares, so that its size is {}x{}, for one",
        CROSS[0],
        CROSS[1],
        CROSS[0] * side,
        CROSS[1] * side
    );
    Err(Failure::new(Code::Usage, message))
}

impl LensOptions {
    /// How the lens is turned with respect to the line of sight.
    fn orientation(&self, usual_elevation: f64) -> Orientation {
        let elevation = self.elevation.unwrap_or(usual_elevation);
        Orientation::from_angles(self.yaw.unwrap_or(0.0), elevation, self.roll.unwrap_or(0.0))
    }

    /// The eye turned as the lens is.
    fn turned(&self, eye: &Camera) -> Camera {
        let orientation = self.orientation(0.0);
        let (right, up) = (orientation.right(), orientation.up());
        let forward = orientation.forward();
        // From right, up, backward to right, down, forward.
        let rows = [right, -up, forward].map(|axis| DVec3::new(axis.x, -axis.y, -axis.z));
        let turn = veduta_geometry::DMat3::from_cols_array_2d(&rows.map(|row| row.to_array()));
        Camera {
            eye_from_world: veduta_geometry::DMat4::from_mat3(turn.transpose())
                * eye.eye_from_world,
            ..*eye
        }
    }
}

impl View {
    /// The camera whose eye the lens has.
    fn eye_of_lens(&self, render: &Render, loaded: &Loaded, size: Size) -> Result<Camera, Failure> {
        let bounds = Bounds::of_scene(&loaded.scene);
        let mut camera = match (self.eye, self.look_at, bounds) {
            (Some(eye), None, Some(bounds)) => {
                // Towards the model's middle, but level; to the north from right above or below it.
                let middle = (0.5 * (bounds.min + bounds.max)).with_z(eye.z);
                let north = eye + DVec3::Y;
                let ahead = if middle == eye { north } else { middle };
                self.explicit(eye, Some(ahead), &bounds, 1.0)?
            }
            _ => self.camera(&render.model, loaded, Some(size))?.0,
        };
        if let Some(near) = self.near {
            camera.near = near;
        }
        if matches!(camera.projection, map::Projection::Parallel { .. }) {
            let message = format!(
                "{}: its camera projects in parallel, and a lens needs an eye; give --eye",
                render.model.display()
            );
            return Err(Failure::new(Code::Unsupported, message));
        }
        Ok(camera)
    }
}
