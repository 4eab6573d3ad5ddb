//! `veduta render --lens`: domes, panoramas, mirror balls and cubes.

use super::{Render, View, tell_step};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use crate::values::Size;
use crate::verb::lens::{Aim, LensArgument, side_at_parity};
use crate::verb::output::Target;
use crate::verb::side_names;
use crate::verb::stored::{Stored, refuse_place, tell_work};
use clap::{Args, ValueEnum};
use std::path::Path;
use veduta::accumulate::Picture;
use veduta::map::{self, Camera, SeenScene};
use veduta::pipeline::{self, Sampling, Surroundings};
use veduta::reproject::cube::{Layout, Side};
use veduta::reproject::{Lens, Projection};
use veduta::scene::{Bounds, Scene};
use veduta_geometry::{DVec2, DVec3};
use veduta_io::Loaded;
use veduta_io::sphere::Panorama;

/// By which lens the picture is made.
#[derive(Debug, Args)]
#[command(next_help_heading = "Lens")]
pub struct LensOptions {
    /// Make the picture by another lens: omnimax, domemaster[:FOV], fisheye[:FOV], equirect, cylinder, mercator,
    /// stereographic[:FOV], ball and others, or cube for the six sides as a cross
    ///
    /// Regions stay exact under it: areas are found in the lens's own pixels, lines are bent within 1/64 of a pixel, and
    /// there are no sides of a cube to be seen. The lens looks where the camera does, with what is up in the camera's
    /// picture up in its own, so look level (--look-at as high as --eye) for a level dome. Only what the lens
    /// looks at is found. A lens has its own angle and no frame, so that --fov, --parallel and --shift are
    /// not for it. With {side}, {letter} or {axis} in the name of a .veduta, what is seen is kept, in a map for
    /// each side of a cube that the lens looks at (with cube, of all six), of which veduta shade --lens makes
    /// pictures by any lens. Not made by a lens: vector pictures, --deep, --aov, --filter, --sampling multiscan.
    #[arg(long, value_name = "LENS")]
    pub lens: Option<LensArgument>,
    /// How a lens's picture is made: exact regions, or ewa: by ellipses from pictures of the cube's sides, softer, and
    /// blind to what their pixels do not show
    #[arg(long, value_name = "HOW", default_value = "exact", requires = "lens")]
    lens_filter: LensFilter,
    #[command(flatten)]
    aim: Aim,
}

/// `--lens-filter`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LensFilter {
    /// Exact areas in the lens's own pixels
    Exact,
    /// The elliptical weighted average of Greene & Heckbert (1986)
    Ewa,
}

/// Pixels along a side of the cube for each pixel of the lens in the same angle, at least, where its picture is
/// filtered. Less blurs; more costs time.
const SIDE_PIXELS: f64 = 2.0;

/// The largest side of the cube, in pixels.
const MOST_SIDE: f64 = 8192.0;

/// The largest picture that a stored map is of, in pixels.
const MOST_PIXELS: DVec2 = DVec2::splat(65_535.0);

impl Render {
    /// Fails for all that no picture by a lens is made with.
    fn refuse_with_lens(&self, lens: LensArgument) -> Result<(), Failure> {
        let output = &self.output;
        let is_vector = output.vector_target(&self.model, false)?.is_some();
        let not_made = [
            (is_vector, "vector pictures"),
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
            None => Ok(()),
        }
    }

    /// Makes the picture by a lens, or stores what it looks at.
    pub(super) fn render_by_lens(
        &self,
        lens: LensArgument,
        force: bool,
        json: bool,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        self.refuse_with_lens(lens)?;
        self.vector.refuse()?;
        if let Some(pattern) = self.output.map_place() {
            return self.store_by_lens(lens, pattern, force, json, talk);
        }
        self.refuse_self_contained()?;
        let target = self.output.target(&self.model, json)?;
        let size = self.size.unwrap_or_else(|| lens.usual_size());
        if let Some(target) = &target {
            target.refuse_size(size)?;
        }
        if lens == LensArgument::Cube {
            if let Some(file) = target.as_ref().and_then(Target::path)
                && side_names::has_place(&file.file_name().unwrap_or_default().to_string_lossy())
            {
                let message = format!(
                    "{}: the sides of a cube are one picture, a cross; leave the braces out, and part it by \
                     `veduta dome CROSS --lens cube -o 'NAME_{{side}}.png'`",
                    file.display()
                );
                return Err(Failure::new(Code::Usage, message));
            }
            refuse_no_cross(size)?;
            if self.lens.lens_filter == LensFilter::Ewa {
                let message = "the sides of a cube are made as they are; leave --lens-filter out";
                return Err(Failure::new(Code::Usage, message));
            }
        }
        let loaded = self.load(talk)?;
        let eye = self.view.eye_of_lens(self, &loaded, size)?;
        let mut scene = loaded.scene;
        self.keep_layers(&mut scene)?;
        let mut development = self.look.development(&scene, self.strict, talk)?;
        let target = match lens {
            LensArgument::Lens(lens) => {
                development.within(self.projection(lens, size));
                let panorama = Panorama::of_lens(lens, [size.width, size.height]);
                target.map(|target| target.of_panorama(panorama))
            }
            LensArgument::Cube => target,
        };
        let Some(places) = self.places(target, talk) else {
            return Ok(());
        };
        let (picture, told_of_lens) = match lens {
            LensArgument::Lens(lens) => self.by_lens(lens, &scene, &eye, size, talk),
            LensArgument::Cube => {
                let layout = Layout::cross();
                let side = size.width / layout.shape()[0];
                let eye = self.lens.aim.turned(&eye);
                let unlit = self.look.unlit;
                let picture = pipeline::render_cube(&scene, &eye, &layout, side, unlit, |step| {
                    tell_step(step, talk);
                });
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

    fn projection(&self, lens: Lens, size: Size) -> Projection {
        let orientation = self.lens.aim.orientation(lens.usual_elevation());
        Projection::new(lens, orientation, size.width, size.height)
    }

    /// Stores what the lens looks at: a map for each side of the cube.
    fn store_by_lens(
        &self,
        lens: LensArgument,
        pattern: &Path,
        force: bool,
        json: bool,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        let usage = |message: &str| Err(Failure::new(Code::Usage, message));
        let name = pattern.file_name().unwrap_or_default().to_string_lossy();
        if !side_names::has_place(&name) {
            return usage(
                "a lens looks at several sides of a cube, each kept in a map: put {side} into the name, such as \
                 -o 'hall_{side}.veduta'",
            );
        }
        if self.output.preview.is_some() || self.lens.lens_filter == LensFilter::Ewa {
            return usage(
                "a map is of no picture: --preview and --lens-filter are not for .veduta",
            );
        }
        let place = |side: Side| pattern.with_file_name(side_names::named(&name, side));
        for side in Side::ALL {
            refuse_place(&place(side), force)?;
        }
        let size = self.size.unwrap_or_else(|| lens.usual_size());
        let loaded = self.load(talk)?;
        let eye = self.view.eye_of_lens(self, &loaded, size)?;
        let mut scene = loaded.scene;
        self.keep_layers(&mut scene)?;
        let begin = |step| tell_step(step, talk);
        let (surroundings, side) = match lens {
            LensArgument::Lens(lens) => {
                let projection = self.projection(lens, size);
                let found = pipeline::find_surroundings(&scene, &eye, &projection, begin);
                (found, side_at_parity(&projection))
            }
            LensArgument::Cube => {
                refuse_no_cross(size)?;
                let eye = self.lens.aim.turned(&eye);
                let side = f64::from(size.width / Layout::cross().shape()[0]);
                (pipeline::find_all_around(&scene, &eye, begin), side)
            }
        };
        talk.begin("writing");
        let mut told = told_of(&surroundings);
        told["output"] = surroundings
            .sides
            .iter()
            .map(|seen| serde_json::json!(place(seen.part.side).to_string_lossy()))
            .collect();
        told["lens"] = lens.to_string().into();
        told["faces"] = scene.face_count().into();
        let seen = surroundings.sides.iter().map(|seen| {
            let [min, max] = seen.part.window;
            // So that a picture of the map is as fine as the lens's.
            let pixels = (side * (max - min)).round().clamp(DVec2::ONE, MOST_PIXELS);
            let size = [pixels.x as u32, pixels.y as u32];
            (seen.part.side, SeenScene::of(&scene, &seen.map, size))
        });
        let seen: Vec<(Side, SeenScene)> = seen.collect();
        let origin = self.origin(scene, loaded.files);
        for (side, seen) in seen {
            Stored::Regions(seen).write(&place(side), &origin)?;
        }
        talk.end();
        if json {
            told["warnings"] = talk.warnings().into();
            tell_work(&mut told);
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
        let projection = self.projection(lens, size);
        if self.lens.lens_filter == LensFilter::Ewa {
            let side = filtered_side(&projection);
            let unlit = self.look.unlit;
            let begin = |step| tell_step(step, talk);
            let (picture, sides) =
                pipeline::render_filtered(scene, eye, &projection, side, unlit, begin);
            let sides: Vec<&str> = sides.into_iter().map(|side| side.name()).collect();
            return (
                picture,
                serde_json::json!({ "sidePixels": side, "views": sides }),
            );
        }
        let surroundings = pipeline::find_surroundings(scene, eye, &projection, |step| {
            tell_step(step, talk);
        });
        talk.begin("shading");
        let unlit = self.look.unlit;
        let made = pipeline::render_surroundings(scene, &surroundings, &projection, unlit);
        let mut told = told_of(&surroundings);
        told["patches"] = made.patches.into();
        (made.picture, told)
    }
}

/// Pixels along the side of the cube's sides from which a picture is filtered.
fn filtered_side(projection: &Projection) -> u32 {
    let side = (SIDE_PIXELS * side_at_parity(projection)).min(MOST_SIDE);
    (side as u32).next_multiple_of(64)
}

fn told_of(surroundings: &Surroundings) -> serde_json::Value {
    let views = surroundings.sides.iter().map(|seen| {
        let [min, max] = seen.part.window;
        serde_json::json!({
            "side": seen.part.side.name(),
            "window": [min.x, min.y, max.x, max.y],
            "fragments": seen.map.fragment_count(),
        })
    });
    serde_json::json!({
        "facesSeen": surroundings.faces_seen(),
        "views": views.collect::<Vec<_>>(),
    })
}

/// Fails if a picture of that size has no cross of square faces.
fn refuse_no_cross(size: Size) -> Result<(), Failure> {
    let cross = Layout::cross();
    if cross.cell_side(size.width, size.height).is_ok() {
        return Ok(());
    }
    let [columns, rows] = cross.shape();
    let side = (size.width / columns).max(1);
    let message = format!(
        "a cube's sides lie in {columns} columns and {rows} rows of squares, so that its size is {}x{}, for one",
        columns * side,
        rows * side
    );
    Err(Failure::new(Code::Usage, message))
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
