//! What is made of the views: through which lens, how large, into which files.

use crate::exit::{Code, Failure};
use crate::values::{self, Size};
use crate::verb::frame_names::FrameNames;
use crate::verb::side_names;
use clap::{Args, ValueEnum};
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use veduta::accumulate::Picture;
use veduta::geometry::DVec2;
use veduta::reproject::cube::{Layout, Side, Spacing};
use veduta::reproject::{Lens, Orientation, Projection};
use veduta_io::PictureFormat;
use veduta_io::sphere::{self, Panorama, SideForm};

/// Through which lens, and where it looks.
#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub struct Aim {
    /// The lens: omnimax, domemaster, fisheye:FOV, equisolid, stereographic, orthographic, polynomial:K1,K2,…,
    /// equirect, cylinder, mercator, ball, perspective:FOV, or cube, which makes six sides
    #[arg(long, value_name = "LENS", default_value = "domemaster")]
    lens: LensOrCube,
    /// The field of view, where the lens has one: across the circle, or from bottom to top
    #[arg(long, value_name = "ANGLE")]
    fov: Option<String>,
    /// Size in pixels, or the width alone; as fine as the views by default
    #[arg(long, value_name = "N|WxH", value_parser = size)]
    size: Option<Asked>,
    /// How far above the horizon the lens looks: 11deg for omnimax by default, 90deg for domemaster, else 0
    #[arg(long, value_name = "ANGLE", value_parser = values::angle, allow_hyphen_values = true)]
    elevation: Option<f64>,
    /// How far a dome's axis leans to the front: 90deg less this is its elevation. Theatres of 15 to 30
    /// degrees need it where the horizon shall be level in the seats
    #[arg(long, value_name = "ANGLE", value_parser = values::angle, allow_hyphen_values = true, conflicts_with = "elevation")]
    tilt: Option<f64>,
    /// How far it is turned to the right of the front
    #[arg(long, value_name = "ANGLE", default_value = "0", hide_default_value = true, value_parser = values::angle, allow_hyphen_values = true)]
    yaw: f64,
    /// How far it leans to the right
    #[arg(long, value_name = "ANGLE", default_value = "0", hide_default_value = true, value_parser = values::angle, allow_hyphen_values = true)]
    roll: f64,
    /// Exchange left and right: for sky charts, and for mirrors before a projector
    #[arg(long)]
    mirror: bool,
    /// Where the sides of --lens cube lie in one picture, as in --layout; without it each side is a file,
    /// with {side}, {letter} or {axis} in its name for front, f or pz and so on
    #[arg(long, value_name = "NAME")]
    to_layout: Option<String>,
    /// The order of the sides of that, as in --order
    #[arg(long, value_name = "LETTERS", requires = "to_layout")]
    to_order: Option<String>,
    /// How many quarters each of them is turned, as in --rotations
    #[arg(long, value_name = "DIGITS", requires = "to_layout")]
    to_rotations: Option<String>,
    /// Make an environment map of OpenEXR, and say so in the .exr: an equirectangular picture whose outermost
    /// samples lie on the border
    #[arg(long)]
    envmap: bool,
    /// How two pictures for two eyes (--right) go into one: left eye above, or to the left; without it each
    /// has a file, with {eye} in its name for left and right
    #[arg(long, value_name = "HOW", requires = "right")]
    stereo: Option<Stereo>,
}

/// `--lens`
#[derive(Clone, Debug, PartialEq)]
enum LensOrCube {
    Lens(String, Lens),
    Cube,
}

impl FromStr for LensOrCube {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "cube" {
            return Ok(Self::Cube);
        }
        let lens = text.parse().map_err(|error| format!("{error}, and cube"))?;
        Ok(Self::Lens(text.to_owned(), lens))
    }
}

/// `--stereo`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Stereo {
    /// The left eye above the right
    TopBottom,
    /// The left eye to the left
    SideBySide,
}

/// `--size`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Width(u32),
    Both(Size),
}

fn size(text: &str) -> Result<Asked, String> {
    if text.contains(['x', 'X']) {
        return text.parse().map(Asked::Both);
    }
    let width = text
        .parse()
        .map_err(|_| "expected a width, or WIDTHxHEIGHT, such as 4096");
    Size::new(width?, 1).map(|size| Asked::Width(size.width))
}

/// What is made for one eye: one picture, or six sides.
#[derive(Debug)]
pub struct Made {
    /// What each picture shows, and of which side it is.
    pub pictures: Vec<(Option<Side>, Projection)>,
    /// Of six sides that go into one picture, where they lie.
    pub layout: Option<Layout>,
    /// What the file tells of it.
    pub panorama: Option<Panorama>,
}

impl Aim {
    /// Whether six sides are made.
    pub fn is_cube(&self) -> bool {
        self.lens == LensOrCube::Cube
    }

    /// Whether six sides are made that do not go into one picture.
    pub fn makes_six_files(&self) -> bool {
        self.is_cube() && self.to_layout.is_none()
    }

    /// How two eyes go into one picture.
    pub fn stereo(&self) -> Option<Stereo> {
        self.stereo
    }

    /// The lens; that of a side for a cube.
    pub fn lens(&self) -> Result<Lens, Failure> {
        let usage = |message: String| Failure::new(Code::Usage, message);
        match (&self.lens, &self.fov) {
            (LensOrCube::Cube, None) => Ok(Lens::Perspective { fov: FRAC_PI_2 }),
            (LensOrCube::Cube, Some(_)) => Err(usage(
                "the sides of a cube see 90 degrees; leave --fov out".into(),
            )),
            (LensOrCube::Lens(_, lens), None) => Ok(*lens),
            (LensOrCube::Lens(name, _), Some(_)) if name.contains(':') => Err(usage(format!(
                "--lens {name} tells its angle already; leave --fov out"
            ))),
            (LensOrCube::Lens(name, _), Some(fov)) => {
                let lens = format!("{name}:{fov}").parse::<Lens>();
                lens.map_err(|error| usage(format!("--fov {fov}: {error}")))
            }
        }
    }

    /// The name of the lens, to be told.
    pub fn name(&self) -> Result<String, Failure> {
        match self.is_cube() {
            true => Ok("cube".into()),
            false => Ok(self.lens()?.to_string()),
        }
    }

    fn orientation(&self, lens: Lens) -> Result<Orientation, Failure> {
        let elevation = match (self.tilt, self.elevation) {
            (Some(tilt), _) if matches!(lens, Lens::Domemaster { .. }) && !self.is_cube() => {
                FRAC_PI_2 - tilt
            }
            (Some(_), _) => {
                let message = "--tilt is how far a domemaster leans; other lenses have --elevation";
                return Err(Failure::new(Code::Usage, message));
            }
            (None, Some(elevation)) => elevation,
            (None, None) => lens.usual_elevation(),
        };
        Ok(Orientation::from_angles(self.yaw, elevation, self.roll))
    }

    /// Checks what needs no picture.
    pub fn check(&self, output: &Path, format: PictureFormat) -> Result<(), Failure> {
        let usage = |message: &str| Err(Failure::new(Code::Usage, message.to_owned()));
        let lens = self.lens()?;
        self.orientation(lens)?;
        let name = output
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let names_sides = side_names::has_place(&name);
        if !self.is_cube() {
            if self.to_layout.is_some() {
                return usage("--to-layout is for --lens cube");
            }
            if names_sides {
                return usage("{side}, {letter} and {axis} in a name are for --lens cube");
            }
        } else {
            let layout = self.layout()?;
            if self.mirror {
                return usage("the sides of a cube are not mirrored; --mirror is for one picture");
            }
            if matches!(self.size, Some(Asked::Both(size)) if size.width != size.height) {
                return usage("the sides of a cube are square; give --size one number");
            }
            match (layout, names_sides) {
                (Some(_), true) => {
                    return usage(
                        "--to-layout makes one picture of all sides; take {side} out of its name",
                    );
                }
                (None, false) => {
                    return usage(
                        "--lens cube makes six files: put {side} into the name, such as -o 'sky_{side}.png', \
                         or one picture with --to-layout",
                    );
                }
                _ => {}
            }
        }
        if self.envmap && !(is_exr(format) && lens == Lens::Equirect) {
            return usage("--envmap is for --lens equirect and .exr");
        }
        if self.envmap && self.mirror {
            return usage("an environment map is not mirrored; leave --mirror or --envmap out");
        }
        Ok(())
    }

    fn layout(&self) -> Result<Option<Layout>, Failure> {
        let Some(name) = &self.to_layout else {
            return Ok(None);
        };
        let layout = Layout::new(name, self.to_order.as_deref(), self.to_rotations.as_deref());
        let layout =
            layout.map_err(|error| Failure::new(Code::Usage, format!("--to-layout: {error}")));
        layout.map(Some)
    }

    /// What is made of views whose finest pixel has that angle, in radians; pictures of `format`.
    pub fn made(&self, finest: f64, format: PictureFormat) -> Result<Made, Failure> {
        let lens = self.lens()?;
        let orientation = self.orientation(lens)?;
        let [width, height] = self.pixels(lens, finest)?;
        if self.is_cube() {
            return self.cube(orientation, width, format);
        }
        let mut projection = Projection::new(lens, orientation, width, height);
        let mut panorama = None;
        if !self.mirror {
            panorama = Panorama::of_lens(lens, [width, height]);
        }
        if self.envmap {
            if width.min(height) < 2 {
                let message = "an environment map has at least 2 pixels a side";
                return Err(Failure::new(Code::Usage, message));
            }
            projection = projection.sampled_on_border();
            panorama = Some(Panorama::ExrLatLong { orientation });
        }
        if self.mirror {
            projection = projection.mirrored();
        }
        Ok(Made {
            pictures: vec![(None, projection)],
            layout: None,
            panorama,
        })
    }

    fn cube(
        &self,
        orientation: Orientation,
        size: u32,
        format: PictureFormat,
    ) -> Result<Made, Failure> {
        let layout = self.layout()?;
        let spacing = layout.as_ref().map_or(Spacing::Plane, Layout::spacing);
        if let Some(layout) = &layout {
            let [columns, rows] = layout.shape().map(u64::from);
            Size::new(columns * u64::from(size), rows * u64::from(size))
                .map_err(|problem| Failure::new(Code::Usage, problem))?;
        }
        let picture = |side| {
            let form = SideForm::default();
            let mut projection = sphere::side_projection(side, size, spacing, &form)
                .expect("a side without padding can be made");
            projection.orientation = projection.orientation.within(&orientation);
            (Some(side), projection)
        };
        let is_envmap = spacing == Spacing::PlaneWithBorder && is_exr(format);
        Ok(Made {
            pictures: Side::ALL.map(picture).into(),
            layout,
            panorama: is_envmap.then_some(Panorama::ExrCube),
        })
    }

    /// Width and height of what is made; of a cube those of a side.
    fn pixels(&self, lens: Lens, finest: f64) -> Result<[u32; 2], Failure> {
        let usage = |problem| Failure::new(Code::Usage, problem);
        let width = match self.size {
            Some(Asked::Both(size)) => return Ok([size.width, size.height]),
            Some(Asked::Width(width)) => width,
            None => {
                // The angle across a pixel in the middle, or what is half as far from it as the rim.
                const PROBE: u32 = 4096;
                let height = (f64::from(PROBE) / lens.aspect()).round().max(1.0) as u32;
                let probe = Projection::new(lens, Orientation::default(), PROBE, height);
                let at = match lens {
                    Lens::Ball => DVec2::new(0.5, 0.0),
                    _ => DVec2::ZERO,
                };
                let ray = probe.ray(probe.image_from_lens(at));
                let angle = ray.map_or(finest, |ray| ray.derivatives[0].length());
                let width = f64::from(PROBE) * angle / finest;
                // Even, since videos are; to whole ones within rounding.
                let width = 2.0 * (0.5 * width - 1e-6).ceil();
                width.clamp(2.0, f64::from(MOST_GUESSED)) as u32
            }
        };
        let height = (f64::from(width) / lens.aspect()).round().max(1.0);
        let size = Size::new(u64::from(width), height as u64).map_err(usage)?;
        Ok([size.width, size.height])
    }
}

/// The widest picture that is made unasked.
const MOST_GUESSED: u32 = 16_384;

fn is_exr(format: PictureFormat) -> bool {
    format == PictureFormat::Exr
}

/// What stands in a name for an eye.
pub const EYE: &str = "{eye}";

/// The file of a picture: the pattern with its number, eye and side.
pub fn file(pattern: &FrameNames<'_>, number: u32, eye: &str, side: Option<Side>) -> PathBuf {
    let path = pattern.path(number);
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
        return path;
    };
    let mut name = name.replace(EYE, eye);
    if let Some(side) = side {
        name = side_names::named(&name, side);
    }
    path.with_file_name(name)
}

/// The pictures of two eyes as one.
pub fn both(left: Picture, right: &Picture, how: Stereo) -> Picture {
    let (width, height) = (left.width, left.height);
    match how {
        Stereo::TopBottom => {
            let mut pixels = left.pixels;
            pixels.extend_from_slice(&right.pixels);
            Picture {
                width,
                height: 2 * height,
                pixels,
            }
        }
        Stereo::SideBySide => {
            let rows = left.pixels.chunks(width as usize);
            let rows = rows.zip(right.pixels.chunks(width as usize));
            Picture {
                width: 2 * width,
                height,
                pixels: rows
                    .flat_map(|(left, right)| [left, right].concat())
                    .collect(),
            }
        }
    }
}

/// `--mask`: the angle across a circle, and within it that over which it ends: `180deg` or `180deg,2deg`.
pub fn mask(text: &str) -> Result<[f64; 2], String> {
    let (fov, feather) = text.split_once(',').unwrap_or((text, "0"));
    let parsed = values::angle(fov).ok().zip(values::angle(feather).ok());
    match parsed {
        Some((fov, feather))
            if fov > 0.0
                && fov < std::f64::consts::TAU + 1e-9
                && (0.0..=fov).contains(&feather) =>
        {
            Ok([fov, feather])
        }
        _ => Err("expected an angle, or two, such as 180deg or 180deg,4deg".into()),
    }
}
