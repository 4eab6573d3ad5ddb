//! `veduta shade --lens`: domes, panoramas and mirror balls of stored maps.

use super::Shade;
use super::into::refuse_spans;
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use crate::values;
use crate::verb::lens::{Aim, LensArgument};
use crate::verb::stored::{open, tell_work};
use crate::verb::tell_shortcomings;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use veduta::map::{self, Camera, SeenScene};
use veduta::pipeline::{self, LensPicture, SeenViews};
use veduta::reproject::cube::Side;
use veduta::reproject::patches::View;
use veduta::reproject::{Lens, Projection};
use veduta::scene::Scene;
use veduta_geometry::{DMat3, DMat4, DVec3};
use veduta_io::sphere::{Panorama, sides_by_names};

/// By which lens the picture is made.
#[derive(Debug, Args)]
#[command(next_help_heading = "Lens")]
pub struct LensOptions {
    /// Make a picture by a lens of what maps of one eye show: omnimax, domemaster[:FOV], fisheye[:FOV], equirect,
    /// cylinder, mercator, stereographic[:FOV], ball and others
    ///
    /// Any perspective maps will do whose eyes stand in one point, turned in any way; veduta render --lens makes those
    /// of a cube's sides. Nothing is found anew, and areas are exact in the lens's own pixels. Where frames overlap,
    /// the map that is given first is shown. What no map shows stays empty, and its share is told (--strict
    /// makes it an error). The lens looks to the front of the cube where files are named as its sides are
    /// (front, left, up and so on), so that it makes the picture that veduta render --lens would; otherwise where
    /// the camera of the first map does, with the same way up; or as --look-at and --up say.
    #[arg(long, value_name = "LENS")]
    pub lens: Option<LensArgument>,
    /// What the lens looks at before it is turned, in metres
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true, requires = "lens")]
    look_at: Option<DVec3>,
    /// What is upwards in its picture then; 0,0,1 by default
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true, requires = "look_at")]
    up: Option<DVec3>,
    #[command(flatten)]
    aim: Aim,
}

/// How far a camera may be turned from where its name says that it looks; for cameras made by hand.
const TURNED_AS_NAMED: f64 = 1e-6;

impl Shade {
    /// Makes the picture by a lens.
    pub(super) fn run_by_lens(
        &self,
        lens: LensArgument,
        json: bool,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        let lens = self.refuse_with_lens(lens)?;
        self.vector.refuse()?;
        let Some(target) = self.output.target(self.map(), json)? else {
            let message = "a map is shown by -o FILE; --preview is for veduta render";
            return Err(Failure::new(Code::Usage, message));
        };
        let size = match self.size {
            Some(size) => size,
            None => LensArgument::Lens(lens).usual_size(),
        };
        target.refuse_size(size)?;
        talk.begin("reading");
        let (mut seen, bytes_read) = self.read_all()?;
        let eye = self.eye_of_lens(&seen)?;
        let views = self.views(&eye, &seen)?;
        let mut scenes: Vec<&mut Scene> = seen.iter_mut().map(|seen| &mut seen.scene).collect();
        self.changes.apply_to_all(&mut scenes, self.strict, talk)?;
        // Of all scenes alike, but that each has its own materials.
        let unlit = |seen: &SeenScene| seen.scene.materials.iter().all(|material| material.unlit);
        let lit = seen.iter().find(|seen| !unlit(seen)).unwrap_or(&seen[0]);
        let mut development = self.look.development(&lit.scene, self.strict, talk)?;
        talk.begin("shading");
        for (path, seen) in self.maps.iter().zip(&seen) {
            let shortcomings = pipeline::shortcomings(&seen.scene, &seen.map);
            tell_shortcomings(path, &seen.scene, &shortcomings, self.strict, talk)?;
        }
        let orientation = self.lens.aim.orientation(lens.usual_elevation());
        let projection = Projection::new(lens, orientation, size.width, size.height);
        development.within(projection);
        let scenes: Vec<SeenViews> = seen
            .iter()
            .zip(views)
            .map(|(seen, view)| SeenViews {
                scene: &seen.scene,
                views: vec![(view, &seen.map)],
            })
            .collect();
        let made = pipeline::render_views(&scenes, &projection, self.look.unlit);
        let LensPicture {
            mut picture,
            unseen,
            patches,
        } = made;
        if unseen > 0.0 {
            // Not less than 0.1 %, which would read as nothing.
            let share = (100.0 * unseen).max(0.1);
            let message = format!("no map shows {share:.1} % of the picture, which stays clear");
            talk.warn_or_fail(message, self.strict, Code::BadInput)?;
        }
        talk.begin("developing");
        let ev = development.develop(&mut picture, !target.linear);
        talk.begin("writing");
        let panorama = Panorama::of_lens(lens, [size.width, size.height]);
        let target = target.of_panorama(panorama);
        target.write(&picture, None)?;
        talk.end();
        talk.detail(format_args!("exposure {ev:.2} EV"));
        if json {
            let mut told = json!({
                "output": target.name(),
                "size": [size.width, size.height],
                "exposure": ev,
                "lens": lens.to_string(),
                "patches": patches,
                "unseen": unseen,
                "bytesRead": bytes_read,
                "warnings": talk.warnings(),
            });
            tell_work(&mut told);
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// The lens; fails for all that no picture by a lens is made with.
    fn refuse_with_lens(&self, lens: LensArgument) -> Result<Lens, Failure> {
        let usage = |message: String| Err(Failure::new(Code::Usage, message));
        let LensArgument::Lens(lens) = lens else {
            return usage(
                "the maps are sides of a cube already: shade each by itself, or leave out --lens cube".into(),
            );
        };
        let output = &self.output;
        let is_vector = output.vector_target(self.map(), false)?.is_some();
        let not_made = [
            (is_vector, "vector pictures"),
            (self.deep, "--deep"),
            (output.has_layers(), "--aov"),
            (!self.look.is_by_area(), "--filter"),
            (
                self.look.background_map().is_some(),
                "a map as --background",
            ),
            (self.local.into.is_some(), "--into"),
        ];
        if let Some((_, what)) = not_made.into_iter().find(|not_made| not_made.0) {
            let message = format!(
                "{what}: not made by a lens; leave --lens {lens} out, or make a picture of pixels, by area"
            );
            return Err(Failure::new(Code::Unsupported, message));
        }
        if self.scale.is_some() || self.window.is_some() {
            return usage(
                "--scale and --window are of a map's frame, which a lens has not; give --size"
                    .into(),
            );
        }
        Ok(lens)
    }

    /// All maps, and how many bytes were read.
    fn read_all(&self) -> Result<(Vec<SeenScene>, u64), Failure> {
        let mut all: Vec<SeenScene> = Vec::with_capacity(self.maps.len());
        let mut bytes_read = 0;
        for path in &self.maps {
            let mut map = open(path)?;
            refuse_spans(path, &map)?;
            let seen = map.read(|reader| reader.read())?;
            bytes_read += map.reader().bytes_read();
            if !seen.guests.is_empty() {
                let message = format!(
                    "{}: holds pictures of other programs, which no lens sees",
                    path.display()
                );
                return Err(Failure::new(Code::Unsupported, message));
            }
            if all
                .first()
                .is_some_and(|first| first.scene.world != seen.scene.world)
            {
                let message = format!(
                    "{}: lies in another place of the world than {}: their coordinates do not fit",
                    path.display(),
                    self.map().display()
                );
                return Err(Failure::new(Code::BadInput, message));
            }
            all.push(seen);
        }
        Ok((all, bytes_read))
    }

    /// The camera whose eye the lens has, and from whose line of sight it is turned.
    fn eye_of_lens(&self, seen: &[SeenScene]) -> Result<Camera, Failure> {
        let first = &seen[0].map.camera;
        if let Some(look_at) = self.lens.look_at {
            let eye = first.eye_from_world.inverse().transform_point3(DVec3::ZERO);
            let looking = |up| Camera::looking(eye, look_at, up, ANY_FRAME, first.near);
            let camera = match self.lens.up {
                Some(up) => looking(up),
                // Straight up or down, north is upwards, as on a plan.
                None => looking(DVec3::Z).or_else(|| looking(DVec3::Y)),
            };
            return camera.ok_or_else(|| {
                let message = "--look-at and --up define no direction: the eye must not stand on what it \
                    looks at, nor look along --up";
                Failure::new(Code::Usage, message)
            });
        }
        // A map alone is more likely called so for another reason.
        match sides_by_names(&self.maps) {
            Ok(sides) if sides.len() > 1 => self.eye_of_sides(seen, &sides),
            _ => Ok(*first),
        }
    }

    /// The camera that looks to the front of a cube of which the maps are sides.
    fn eye_of_sides(&self, seen: &[SeenScene], sides: &[Side]) -> Result<Camera, Failure> {
        let rotations = seen.iter().zip(sides).map(|(seen, side)| {
            let of_side = DMat3::from_mat4(seen.map.camera.eye_from_world);
            side.side_from_eye().transpose() * of_side
        });
        let rotations: Vec<DMat3> = rotations.collect();
        let other = rotations
            .iter()
            .position(|rotation| !rotation.abs_diff_eq(rotations[0], TURNED_AS_NAMED));
        if let Some(other) = other {
            let message = format!(
                "{}: is called {}, but does not look there if {} is {}; say where the lens looks with --look-at",
                self.maps[other].display(),
                sides[other],
                self.map().display(),
                sides[0],
            );
            return Err(Failure::new(Code::BadInput, message));
        }
        let front = sides.iter().position(|side| *side == Side::Front);
        let row = front.unwrap_or(0);
        let camera = &seen[row].map.camera;
        Ok(Camera {
            eye_from_world: DMat4::from_mat3(sides[row].side_from_eye().transpose())
                * camera.eye_from_world,
            ..*camera
        })
    }

    /// The views of all maps.
    fn views(&self, eye: &Camera, seen: &[SeenScene]) -> Result<Vec<View>, Failure> {
        let maps: std::slice::Iter<'_, PathBuf> = self.maps.iter();
        let views = maps.zip(seen).map(|(path, seen)| {
            View::new(eye, &seen.map.camera).map_err(|error| {
                let message = format!("{}: {error} ({})", path.display(), self.map().display());
                Failure::new(Code::BadInput, message)
            })
        });
        views.collect()
    }
}

/// A frame, since a camera has one; none is looked through.
const ANY_FRAME: map::Projection = map::Projection::Perspective {
    tan_half_height: 1.0,
    aspect: 1.0,
};
