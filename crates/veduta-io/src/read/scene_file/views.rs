//! Files of views: pictures of the sphere around a viewer, each with its lens and where it looks.
//!
//! They are TOML like scene files, read by the same steps, and paths in them are relative to them. A path
//! may have # for the digits of frames; whether its files are there is seen when they are read.

use super::form::{Fields, Form, Given, Key, Layout, List, Node, table};
use super::read_form;
use super::source::{Faults, Source};
use super::value::{
    Angle, Circle, Direction, FieldOfView, FilePath, Flag, LensName, Quarters, Shift,
};
use crate::read::error::{Place, Problem, ReadError};
use crate::sphere::View;
use serde_json::{Value, json};
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};
use veduta::geometry::{DVec2, DVec3};
use veduta::reproject::cube::Turn;
use veduta::reproject::{Lens, Orientation, Projection, dome_from_scene};

table! {
    /// Pictures of all that is around a viewer, from which `veduta dome` makes domes and panoramas.
    "a file of views" => struct Views {
        /// The pictures. Where several show a direction, that is taken whose axis is nearest.
        required view: List<ViewTable>,
    }
}

table! {
    /// A picture, its lens, and where it looks.
    "[[view]]" => struct ViewTable {
        /// The picture; # for the digits of frames.
        required picture: FilePath,
        /// The lens, as veduta dome calls them: "perspective:60" by its vertical angle, "fisheye:200",
        /// "equisolid:180", "equirect" and so on. A square view of 90 degrees by default.
        optional lens: LensName,
        /// Vertical field of view of a perspective view, such as "60deg".
        optional fov: FieldOfView,
        /// How far it is turned to the right of the front, such as "90deg".
        optional yaw: Angle,
        /// How far it looks above the horizon.
        optional elevation: Angle,
        /// How far the camera leans to the right.
        optional roll: Angle,
        /// Where it looks, instead of angles: x to the right, y to the front, z up.
        optional direction: Direction,
        /// What is upwards in it; [0, 0, 1] by default, and the back where it looks straight up.
        optional up: Direction,
        /// Shift of a perspective lens: how far the frame is moved, in its widths to the right and its
        /// heights upwards. With [0, 0.5] only what is above the middle is seen.
        optional shift: Shift,
        /// Of a round lens: x and y of the centre and the radius of the circle, in pixels from the left
        /// top corner. In the middle of the picture and as large as fits by default.
        optional circle: Circle,
        /// By how much the picture is turned clockwise: 0, 90, 180 or 270 degrees.
        optional turned: Quarters,
        /// Whether the picture is mirrored left to right.
        optional mirrored: Flag,
    }
    exclude (lens, fov) (direction, yaw) (direction, elevation) (shift, circle)
    needs (up, direction)
}

/// A view of a file of views.
#[derive(Clone, Debug, PartialEq)]
pub struct FileView {
    /// The picture's path, relative to where the program runs.
    pub picture: PathBuf,
    /// The lens.
    pub lens: Lens,
    /// Where it looks.
    pub orientation: Orientation,
    /// The frame's shift, in widths to the right and heights upwards.
    pub shift: DVec2,
    /// Centre and radius of the disc of a round lens, in pixels.
    pub circle: Option<[f64; 3]>,
    /// How the picture lies.
    pub turn: Turn,
}

impl FileView {
    /// The view in its picture of that size, which is file number `file`.
    pub fn view(&self, file: usize, [width, height]: [u32; 2]) -> View {
        let [width, height] = match self.turn.quarters % 2 {
            0 => [width, height],
            _ => [height, width],
        };
        let projection =
            match self.circle {
                Some([x, y, radius]) => {
                    let across = (2.0 * radius).round().clamp(1.0, 1e9);
                    Projection::new(self.lens, self.orientation, across as u32, across as u32)
                        .cropped(0.5 * across - x, 0.5 * across - y, width, height)
                }
                None => {
                    let moved = self.shift * DVec2::new(f64::from(width), f64::from(height));
                    Projection::new(self.lens, self.orientation, width, height)
                        .cropped(moved.x, -moved.y, width, height)
                }
            };
        let name = self.picture.file_stem().unwrap_or_default();
        View {
            name: name.to_string_lossy().into_owned(),
            side: None,
            file,
            window: None,
            turn: self.turn,
            projection,
        }
    }
}

/// The JSON Schema (draft 2020-12) of files of views.
pub fn views_file_schema() -> Value {
    let mut schema = Views::schema();
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("Veduta file of views");
    schema
}

/// Reads a file of views.
///
/// # Errors
/// All that is wrong with it.
pub fn read_views_file(path: &Path) -> Result<Vec<FileView>, ReadError> {
    let whole = |error| Problem::Unreadable(error).at(Place::Whole).of(path);
    let bytes = std::fs::read(path).map_err(whole)?;
    let source = Source::new(path, &bytes)?;
    let document: Views = read_form("a file of views", &source)?;
    let mut faults = Faults::default();
    let mut views = Vec::new();
    for row in &document.view.value.0 {
        views.extend(view(&row.value, path, &mut faults));
    }
    faults.finish(&source)?;
    Ok(views)
}

fn view(table: &ViewTable, path: &Path, faults: &mut Faults) -> Option<FileView> {
    let angle = |given: &Option<Given<Angle>>| given.as_ref().map_or(0.0, |given| given.value.0);
    let roll = angle(&table.roll);
    let orientation = match &table.direction {
        None => Orientation::from_angles(angle(&table.yaw), angle(&table.elevation), roll),
        Some(direction) => {
            let up = table.up.as_ref().map(|up| up.value.0);
            let looking = |up: DVec3| {
                Orientation::looking(dome_from_scene(direction.value.0), dome_from_scene(up))
            };
            let upright = match up {
                Some(up) => looking(up),
                // Straight up or down, as the upper and lower side of a cross lie.
                None => looking(DVec3::Z).or_else(|| looking(-DVec3::Y * direction.value.0.z)),
            };
            let Some(upright) = upright else {
                faults.senseless(direction.span.clone(), "direction and up are parallel");
                return None;
            };
            Orientation::from_angles(0.0, 0.0, roll).within(&upright)
        }
    };
    let lens = match (&table.lens, &table.fov) {
        (Some(lens), _) => lens.value.0,
        (None, fov) => Lens::Perspective {
            fov: fov.as_ref().map_or(FRAC_PI_2, |fov| fov.value.0),
        },
    };
    if let Some(circle) = table.circle.as_ref().filter(|_| !lens.is_round()) {
        let message = format!("the lens {lens} has no circle");
        faults.senseless(circle.span.clone(), message);
    }
    if let Some(shift) = &table.shift
        && !matches!(lens, Lens::Perspective { .. })
    {
        let message = format!("the lens {lens} has no shift; that is for perspective views");
        faults.senseless(shift.span.clone(), message);
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    Some(FileView {
        picture: folder.join(&table.picture.value.0),
        lens,
        orientation,
        shift: table
            .shift
            .as_ref()
            .map_or(DVec2::ZERO, |shift| shift.value.0),
        circle: table.circle.as_ref().map(|circle| circle.value.0),
        turn: Turn {
            mirrored: table.mirrored.as_ref().is_some_and(|flag| flag.value.0),
            quarters: table.turned.as_ref().map_or(0, |turned| turned.value.0),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta::geometry::DVec2;

    fn read(text: &str) -> Result<Vec<FileView>, ReadError> {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("rig.toml");
        std::fs::write(&path, text).expect("may write in the test's folder");
        read_views_file(&path)
    }

    #[test]
    fn angles_and_directions_say_the_same() {
        let views = read(
            "[[view]]\npicture = 'a.png'\nyaw = '90deg'\n\
             [[view]]\npicture = 'a.png'\ndirection = [1, 0, 0]\n\
             [[view]]\npicture = 'a.png'\nelevation = 90\n\
             [[view]]\npicture = 'a.png'\ndirection = [0, 0, 2]\n",
        )
        .expect("is sound");
        for pair in views.chunks(2) {
            let [a, b] = [0, 1].map(|k| pair[k].orientation);
            assert!((a.forward() - b.forward()).length() < 1e-12);
            assert!((a.up() - b.up()).length() < 1e-12, "{} {}", a.up(), b.up());
        }
    }

    #[test]
    fn half_views_and_discs_are_where_they_are_said_to_be() {
        let views = read(
            "[[view]]\npicture = 'upper.png'\nfov = 53.13010235415598\nshift = [0, 0.5]\n\
             [[view]]\npicture = 'disc.png'\nlens = 'fisheye:180'\ncircle = [30, 40, 20]\n",
        )
        .expect("is sound");
        // A frame twice as wide as high whose lower edge is at the horizon: the upper half of a side.
        let upper = views[0].view(0, [64, 32]).projection;
        let low = upper.direction(DVec2::new(0.0, 32.0)).expect("ahead");
        let high = upper.direction(DVec2::new(0.0, 0.0)).expect("ahead");
        assert!(
            (low.y / low.z).abs() < 1e-12 && (low.x / low.z - 1.0).abs() < 1e-12,
            "{low}"
        );
        assert!((high.y / -high.z - 1.0).abs() < 1e-12, "{high}");
        let disc = views[1].view(0, [60, 80]).projection;
        let right = disc
            .direction(DVec2::new(50.0, 40.0))
            .expect("on the circle");
        assert!((right - DVec3::X).length() < 1e-12, "{right}");
    }

    #[test]
    fn faults_are_told_with_their_places() {
        for (text, told) in [
            ("", "view"),
            ("[[view]]\nyaw = 1\n", "picture"),
            ("[[view]]\npicture = 'a.png'\nlens = 'fisch'\n", "a lens"),
            (
                "[[view]]\npicture = 'a.png'\nlens = 'equirect'\nfov = 20\n",
                "fov",
            ),
            ("[[view]]\npicture = 'a.png'\nturned = 45\n", "270"),
            (
                "[[view]]\npicture = 'a.png'\ncircle = [1, 2, 3]\n",
                "no circle",
            ),
            (
                "[[view]]\npicture = 'a.png'\ncircle = [1, 2, 0]\nlens = 'ball'\n",
                "radius",
            ),
            (
                "[[view]]\npicture = 'a.png'\nlens = 'ball'\nshift = [1, 0]\n",
                "no shift",
            ),
            (
                "[[view]]\npicture = 'a.png'\ndirection = [0, 0, 1]\nup = [0, 0, 1]\n",
                "parallel",
            ),
            ("[[view]]\npicture = 'a.png'\nyawn = 5\n", "\"yaw\""),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.to_string().contains(told), "{text}: {error}");
        }
    }
}
