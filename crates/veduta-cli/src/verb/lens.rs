//! What verbs that make pictures by a lens share: which lens, how large, and how it is turned.

use crate::values::{self, Size};
use clap::Args;
use std::fmt;
use std::str::FromStr;
use veduta::map::Camera;
use veduta::reproject::cube::Layout;
use veduta::reproject::{LENS_NAMES, Lens, Orientation, Projection};
use veduta_geometry::{DMat3, DMat4, DVec2, DVec3};

/// How a lens is turned from the line of sight.
#[derive(Debug, Args)]
#[command(next_help_heading = "Lens")]
pub struct Aim {
    /// How far a lens's axis is raised above the line of sight: 90deg for domemaster, 11deg for omnimax, else 0
    #[arg(long, value_name = "ANGLE", value_parser = values::angle, allow_hyphen_values = true, requires = "lens")]
    elevation: Option<f64>,
    /// Turn the lens to the right, before it is raised
    #[arg(long, value_name = "ANGLE", value_parser = values::angle, allow_hyphen_values = true, requires = "lens")]
    yaw: Option<f64>,
    /// Turn the lens clockwise around its axis, at last
    #[arg(long, value_name = "ANGLE", value_parser = values::angle, allow_hyphen_values = true, requires = "lens")]
    roll: Option<f64>,
}

impl Aim {
    /// How the lens is turned with respect to the line of sight.
    pub fn orientation(&self, usual_elevation: f64) -> Orientation {
        let elevation = self.elevation.unwrap_or(usual_elevation);
        Orientation::from_angles(self.yaw.unwrap_or(0.0), elevation, self.roll.unwrap_or(0.0))
    }

    /// The eye turned as the lens is.
    pub fn turned(&self, eye: &Camera) -> Camera {
        let orientation = self.orientation(0.0);
        let (right, up) = (orientation.right(), orientation.up());
        let forward = orientation.forward();
        // From right, up, backward to right, down, forward.
        let rows = [right, -up, forward].map(|axis| DVec3::new(axis.x, -axis.y, -axis.z));
        let turn = DMat3::from_cols_array_2d(&rows.map(|row| row.to_array()));
        Camera {
            eye_from_world: DMat4::from_mat3(turn.transpose()) * eye.eye_from_world,
            ..*eye
        }
    }
}

/// Pixels along the side of a cube that has as many in an angle as a lens's picture in its middle, where round
/// lenses show most.
pub fn side_at_parity(projection: &Projection) -> f64 {
    let middle = projection.image_from_lens(DVec2::ZERO);
    let per_pixel = projection
        .ray(middle)
        .map_or(DVec3::ONE, |ray| ray.derivatives[1])
        .length();
    // A side is two radians wide by the scale of its own middle, where it shows least.
    2.0 / per_pixel
}

/// `--lens`
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LensArgument {
    /// A picture by one lens.
    Lens(Lens),
    /// The sides of a cube, as a cross of four columns and three rows.
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

impl LensArgument {
    /// The size of a picture where none is given.
    pub fn usual_size(self) -> Size {
        let aspect = match self {
            Self::Lens(lens) => lens.aspect(),
            Self::Cube => {
                let [columns, rows] = Layout::cross().shape().map(f64::from);
                columns / rows
            }
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
