//! Pictures of other programs -> guests of a composite.
//!
//! Deep OpenEXR brings all its samples; OpenEXR with a depth in each pixel (`depth_picture`) one for each
//! pixel; any flat picture is a card at a depth. Where a file tells its camera it must be that of the
//! composite; what is taken for granted is told, among the warnings.

use crate::deep_exr::{DeepFile, IdNames, is_deep};
use crate::depth_picture::{DepthKind, DepthOptions, DepthPicture, read_depth_picture};
use crate::read_picture::{PictureProblem, ReadPictureError, read_picture};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use veduta::accumulate::Picture;
use veduta::map::{Camera, Guest, GuestError, GuestGrid, GuestKind, GuestSamples, Projection};
use veduta_geometry::{DVec2, DVec3};

/// How a picture is to be taken as a guest.
#[derive(Clone, Debug, Default)]
pub struct GuestOptions {
    /// How depths are to be understood; its camera is not looked at.
    pub depth: DepthOptions,
    /// The depth of a card in metres: a flat picture all of which lies there.
    pub card: Option<f64>,
    /// The camera of the composite; `None` for that of the file, or one that sees the file's frame in
    /// perspective.
    pub camera: Option<Camera>,
    /// Take the file for what that camera sees, whatever the file says.
    pub trust_camera: bool,
}

/// A guest that was read.
#[derive(Clone, Debug)]
pub struct LoadedGuest {
    /// The guest.
    pub guest: Guest,
    /// The camera that it was taken for.
    pub camera: Camera,
    /// What a user should know; sentences without the file's name.
    pub warnings: Vec<String>,
}

/// Why a picture cannot be a guest.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GuestProblem {
    /// Its frame has another shape than the camera's.
    #[error(
        "has a frame of {width} x {height} pixels, but that of the composite is {aspect} times as wide as \
         high; make it of the same camera, at any size of that shape"
    )]
    OtherShape {
        /// Width of its frame in pixels.
        width: u32,
        /// Height of its frame in pixels.
        height: u32,
        /// Width over height of the camera's frame.
        aspect: String,
    },
    /// Its camera is another one.
    #[error(
        "was seen through another camera than the composite: {difference}; --trust-camera takes it as it is"
    )]
    OtherCamera {
        /// In what they differ.
        difference: String,
    },
    /// Its samples are none.
    #[error("cannot be composited: {0}")]
    Unsound(GuestError),
}

impl From<GuestProblem> for PictureProblem {
    fn from(problem: GuestProblem) -> Self {
        Self::Guest(problem)
    }
}

/// Reads a picture as a guest.
///
/// # Errors
/// When the file cannot be read, is damaged, tells no depth where no card is asked for, or was seen through
/// another camera.
pub fn read_guest(path: &Path, options: &GuestOptions) -> Result<LoadedGuest, ReadPictureError> {
    let name = path.to_string_lossy().into_owned();
    let read = || {
        if let Some(depth) = options.card {
            let loaded = read_picture(path).map_err(|error| error.problem)?;
            return card(name, &loaded.picture, depth, options, loaded.warnings);
        }
        let mut start = Vec::new();
        File::open(path)?.take(8).read_to_end(&mut start)?;
        if is_deep(&start) {
            let file = DeepFile::open(path).map_err(|error| PictureProblem::Deep(error.problem))?;
            return deep(name, &file, options);
        }
        let depth = DepthOptions {
            camera: options.camera,
            ..options.depth.clone()
        };
        let loaded = read_depth_picture(path, &depth).map_err(|error| error.problem)?;
        depths(name, loaded, options)
    };
    read().map_err(|problem| ReadPictureError {
        file: path.to_owned(),
        problem,
    })
}

/// All of a deep file: of its first deep part.
fn deep(
    name: String,
    file: &DeepFile,
    options: &GuestOptions,
) -> Result<LoadedGuest, PictureProblem> {
    let header = file.headers().next().expect("a deep file has a deep part");
    let mut warnings = Vec::new();
    if file.headers().len() > 1 {
        warnings.push(format!(
            "has {} deep parts, of which the first is taken",
            file.headers().len()
        ));
    }
    let unsound = |what: &str| PictureProblem::Damaged(what.to_owned());
    let side = |count: u64| u32::try_from(count).map_err(|_| unsound("its frame is too large"));
    let (display, data) = (&header.display_window, &header.data_window);
    let frame = [side(display.width())?, side(display.height())?];
    let first = [0, 1].map(|axis| data.min[axis].checked_sub(display.min[axis]));
    let [Some(column), Some(row)] = first else {
        return Err(unsound("its data lie too far from its frame"));
    };
    let grid = GuestGrid {
        frame,
        first: [column, row],
        size: [side(data.width())?, side(data.height())?],
    };
    let pixel_aspect = f64::from(header.pixel_aspect_ratio);
    let camera = camera_of(header.camera(), frame, pixel_aspect, options, &mut warnings)?;
    // What OpenEXR means by Z, unless told.
    let kind = options.depth.kind.unwrap_or(DepthKind::Planar);
    kind.check(Some(&camera))?;
    let nearness = |depth: f64, [column, row]: [u64; 2]| {
        let [left_top, right_bottom] = grid.corners(column as u32, row as u32);
        let image = 0.5 * (left_top + right_bottom);
        let planar = match kind {
            DepthKind::Planar => depth,
            kind => kind.planar(depth, Some(&camera), image),
        };
        nearness_of_depth(&camera, planar * options.depth.metres_per_unit)
    };
    let names = IdNames::of(header).unwrap_or_else(|problem| {
        warnings.push(format!("its objects have no names: {problem}"));
        None
    });
    let samples = file
        .guest_samples(0, names.as_ref(), nearness)
        .map_err(PictureProblem::Deep)?;
    let objects = names
        .into_iter()
        .flat_map(|names| names.names.into_values());
    let (kind, objects) = (GuestKind::Deep, objects.collect());
    finish(name, kind, grid, samples, objects, camera, warnings)
}

/// A picture with a depth in each pixel: a sample for each pixel that is not empty.
fn depths(
    name: String,
    loaded: DepthPicture,
    options: &GuestOptions,
) -> Result<LoadedGuest, PictureProblem> {
    let DepthPicture {
        picture,
        depth,
        file_camera,
        mut warnings,
        ..
    } = loaded;
    let grid = whole_frame(&picture);
    let camera = camera_of(file_camera, grid.frame, 1.0, options, &mut warnings)?;
    let nearness = |pixel: usize| nearness_of_depth(&camera, f64::from(depth[pixel]));
    let samples = flat_samples(&picture, nearness);
    let (kind, objects) = (GuestKind::Depth, Vec::new());
    finish(name, kind, grid, samples, objects, camera, warnings)
}

/// A flat picture all of which lies at one depth.
fn card(
    name: String,
    picture: &Picture,
    depth: f64,
    options: &GuestOptions,
    mut warnings: Vec<String>,
) -> Result<LoadedGuest, PictureProblem> {
    let grid = whole_frame(picture);
    let own = options.camera.or(Some(some_camera(grid.frame, 1.0)));
    let camera = camera_of(own, grid.frame, 1.0, options, &mut warnings)?;
    let nearness = nearness_of_depth(&camera, depth);
    let samples = flat_samples(picture, |_| nearness);
    let (kind, objects) = (GuestKind::Card, Vec::new());
    finish(name, kind, grid, samples, objects, camera, warnings)
}

fn whole_frame(picture: &Picture) -> GuestGrid {
    let size = [picture.width, picture.height];
    GuestGrid {
        frame: size,
        first: [0, 0],
        size,
    }
}

/// A sample for each pixel of a flat picture that is not empty.
fn flat_samples(picture: &Picture, nearness: impl Fn(usize) -> f64) -> GuestSamples {
    let mut samples = GuestSamples::default();
    for (pixel, &[r, g, b, opacity]) in picture.pixels.iter().enumerate() {
        let color = [r, g, b].map(|channel| if channel.is_finite() { channel } else { 0.0 });
        let opacity = if opacity > 0.0 { opacity.min(1.0) } else { 0.0 };
        if opacity > 0.0 || color != [0.0; 3] {
            samples.push([nearness(pixel); 2], opacity, color, Guest::NO_OBJECT);
        }
        samples.end_pixel();
    }
    samples
}

fn finish(
    name: String,
    kind: GuestKind,
    grid: GuestGrid,
    samples: GuestSamples,
    objects: Vec<String>,
    camera: Camera,
    warnings: Vec<String>,
) -> Result<LoadedGuest, PictureProblem> {
    let guest = Guest::new(name, kind, grid, samples, objects).map_err(GuestProblem::Unsound)?;
    Ok(LoadedGuest {
        guest,
        camera,
        warnings,
    })
}

/// The nearest and the farthest depth that nearness tells in perspective, in metres.
const DEPTHS: [f64; 2] = [1e-30, 1e30];

/// The nearness of a planar depth in metres.
fn nearness_of_depth(camera: &Camera, depth: f64) -> f64 {
    if depth > DEPTHS[1] {
        return Guest::BEHIND_ALL;
    }
    match camera.projection {
        // What a file tells to be behind the eye is before everything.
        Projection::Perspective { .. } => 1.0 / depth.max(DEPTHS[0]),
        Projection::Parallel { .. } => -depth.max(-DEPTHS[1]),
    }
}

/// The camera that a file is taken for, which must fit its own and its frame.
fn camera_of(
    own: Option<Camera>,
    frame: [u32; 2],
    pixel_aspect: f64,
    options: &GuestOptions,
    warnings: &mut Vec<String>,
) -> Result<Camera, PictureProblem> {
    let Some(camera) = options.camera else {
        return Ok(own.unwrap_or_else(|| some_camera(frame, pixel_aspect)));
    };
    let [width, height] = frame;
    let aspect = pixel_aspect * f64::from(width) / f64::from(height);
    // Pixel aspects are of single precision.
    if (aspect / camera.aspect() - 1.0).abs() > 1e-6 {
        return Err(GuestProblem::OtherShape {
            width,
            height,
            aspect: format!("{:.4}", camera.aspect()),
        }
        .into());
    }
    match own {
        Some(own) if !options.trust_camera => {
            if let Some(difference) = difference(&camera, &own) {
                return Err(GuestProblem::OtherCamera { difference }.into());
            }
        }
        Some(_) => {}
        None => warnings.push("tells no camera: it is taken to be that of the composite".into()),
    }
    Ok(camera)
}

/// A camera that sees a frame of this shape, for files that are composited with one another only: depths
/// are compared, and nothing else is asked of it.
fn some_camera(frame: [u32; 2], pixel_aspect: f64) -> Camera {
    let lens = Projection::Perspective {
        tan_half_height: 0.5,
        aspect: pixel_aspect * f64::from(frame[0]) / f64::from(frame[1]),
    };
    let camera = Camera::looking(DVec3::ZERO, DVec3::Y, DVec3::Z, lens, DEPTHS[0]);
    camera.expect("a level view")
}

/// In what the camera of a file differs from that of the composite, beyond the single precision of files.
fn difference(expected: &Camera, found: &Camera) -> Option<String> {
    let is_parallel = |c: &Camera| matches!(c.projection, Projection::Parallel { .. });
    if is_parallel(expected) != is_parallel(found) {
        return Some("one projects in parallel, the other in perspective".into());
    }
    let eye = |c: &Camera| c.eye_from_world.inverse().w_axis.truncate();
    let [a, b] = [eye(expected), eye(found)];
    // Coordinates of single precision, of a matrix that was inverted.
    let rounding = 1e-6 * (1.0 + a.length());
    if !is_parallel(expected) && (b - a).length() > rounding {
        return Some(format!("its eye stands at {b} instead of {a}"));
    }
    // Where each sees what the other sees in the corners of the frame, near and far.
    let mut most: f64 = 0.0;
    for corner in [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y] {
        for depth in [10.0, 1000.0] {
            let nearness = nearness_of_depth(expected, depth);
            let point = expected.eye_from_image(corner, nearness);
            let world = expected.eye_from_world.inverse().transform_point3(point);
            let there = found.image_from_eye(found.eye_from_world.transform_point3(world));
            let allowed = rounding * expected.image_scale().max_element();
            let allowed = if is_parallel(expected) {
                allowed
            } else {
                allowed / depth
            };
            most = most.max((there - corner).length() - allowed);
            let off = found.eye_from_world.transform_point3(world).z - depth;
            if is_parallel(expected) && off.abs() > 1e-4 * depth + rounding {
                return Some(format!("its eye stands {off} m further back"));
            }
        }
    }
    // A tenth of a pixel of a picture of 1000.
    (most > 1e-4).then(|| {
        format!(
            "a corner of the frame lies {:.2} % of its size elsewhere",
            100.0 * most
        )
    })
}
