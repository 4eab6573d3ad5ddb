//! Files of other programs -> a scene.
//!
//! [`read_scene`] chooses the reader by the file's suffix or first bytes. A reader turns bytes to
//! meshes, materials, pictures, cameras and a list of placed objects in the file's own axes. What
//! all formats share stands beside the readers: `finish` checks the meshes and turns the world so
//! that Z is up, `picture` decodes textures, `budget` bounds memory.

mod budget;
#[cfg(feature = "cityjson")]
mod cityjson;
mod error;
mod files;
mod finish;
#[cfg(feature = "gltf")]
mod gltf;
mod moment;
#[cfg(any(
    feature = "gltf",
    feature = "cityjson",
    feature = "stl",
    feature = "toml"
))]
mod names;
#[cfg(feature = "obj")]
mod obj;
mod over_time;
#[cfg(any(
    feature = "gltf",
    feature = "obj",
    feature = "ply",
    feature = "cityjson"
))]
mod picture;
#[cfg(feature = "ply")]
mod ply;
#[cfg(any(feature = "obj", feature = "ply", feature = "cityjson"))]
mod polygon;
#[cfg(feature = "toml")]
mod scene_file;
#[cfg(feature = "stl")]
mod stl;
#[cfg(any(feature = "obj", feature = "ply", feature = "stl"))]
mod text;
#[cfg(any(feature = "obj", feature = "ply", feature = "cityjson"))]
mod vertices;

#[cfg(feature = "cityjson")]
pub use cityjson::{LevelOfDetail, LevelOfDetailError};
pub use error::{Detail, ErrorKind, Excerpt, Place, Problem, ReadError, Warning};
pub use moment::{Animation, AnimationKind, Moment};
#[cfg(feature = "toml")]
pub use names::closest as closest_name;
pub use over_time::SceneOverTime;
#[cfg(feature = "toml")]
pub use scene_file::{
    FileView, change_scene, read_views_file, scene_file_schema, set_in_scene, views_file_schema,
};

use budget::Budget;
use error::{Fault, Warnings};
use moment::USUAL_FRAMES_PER_SECOND;
use over_time::Models;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use veduta::map::Source;
use veduta::scene::Scene;

/// The axis of a file that points upwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// Y is up and Z comes to the front: the rule of glTF, and the habit of OBJ.
    Y,
    /// Z is up, as in the world: nothing is turned.
    Z,
}

/// How to read a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// The axis that points upwards; `None` for what is usual in the format.
    pub up_axis: Option<UpAxis>,
    /// The level of detail of city models: of each object the highest up to this, or else the
    /// lowest; `None` for the highest.
    #[cfg(feature = "cityjson")]
    pub level_of_detail: Option<LevelOfDetail>,
    /// The moment at which everything that moves is shown.
    pub moment: Moment,
    /// The name of the animation of a glTF model that is played, unless the moment is at rest; `None`
    /// for its first. Scene files say of each layer what is played.
    pub animation: Option<String>,
    /// Whether that begins again when it is over; else the model stays as at its end.
    pub repeats: bool,
}

/// A scene, and what was read otherwise than the file asks for.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene; all its meshes are sound.
    pub scene: Scene,
    /// What a user should know.
    pub warnings: Vec<Warning>,
    /// The files that it was read from, each once; the first is the one that was named.
    pub files: Vec<Source>,
    /// Name of the camera that a scene file means to be used where none is asked for.
    pub default_camera: Option<String>,
    /// Widths and heights in pixels that cameras of a scene file mean their pictures to have, by the
    /// cameras' names.
    pub picture_sizes: Vec<(String, [u32; 2])>,
    /// What moves in it, or could, in the order of the file.
    pub animations: Vec<Animation>,
    /// Frames a second: what the scene file says, else 24.
    pub frames_per_second: f64,
}

/// Suffixes of the files that [`read_scene`] reads.
pub const SCENE_SUFFIXES: &[&str] = &[
    #[cfg(feature = "gltf")]
    "glb",
    #[cfg(feature = "gltf")]
    "gltf",
    #[cfg(feature = "obj")]
    "obj",
    #[cfg(feature = "ply")]
    "ply",
    #[cfg(feature = "stl")]
    "stl",
    #[cfg(feature = "cityjson")]
    "city.json",
    #[cfg(feature = "cityjson")]
    "city.jsonl",
    #[cfg(feature = "cityjson")]
    "json",
    #[cfg(feature = "cityjson")]
    "jsonl",
    #[cfg(feature = "toml")]
    "toml",
];

/// Reads a scene from a file and the files it names.
///
/// Object names are unique paths, joined by `/`, and objects stand in the order of the file's
/// tree. The world has Z up, and the front of a model with Y up faces -Y.
///
/// # Errors
/// When the file cannot be read, is damaged, or needs what is not supported. Never panics.
pub fn read_scene(path: &Path, options: &ReadOptions) -> Result<Loaded, ReadError> {
    read_with(path, options, &mut Models::default())
}

/// [`read_scene`] where models may have been read before.
fn read_with(path: &Path, options: &ReadOptions, models: &mut Models) -> Result<Loaded, ReadError> {
    let mut read = || {
        #[cfg(feature = "toml")]
        if scene_file::is_scene_file(path) {
            return scene_file::read(path, options, models);
        }
        models.read(path, options)
    };
    read().map_err(|error| match error.problem {
        Problem::Unreadable(ref system) if system.kind() == io::ErrorKind::NotFound => {
            #[cfg(feature = "toml")]
            let meant = names::neighbour(path).map(String::into_boxed_str);
            #[cfg(not(feature = "toml"))]
            let meant = None;
            let problem = Problem::NoSuchFile { meant };
            ReadError { problem, ..error }
        }
        _ => error,
    })
}

/// Reads a scene from a file that is no scene file.
fn read_model(path: &Path, options: &ReadOptions) -> Result<Loaded, ReadError> {
    let mut warnings = Warnings::new(path.to_owned());
    let mut budget = Budget::new();
    let mut animations = Vec::new();
    let scene = read(path, options, &mut animations, &mut budget, &mut warnings);
    if animations.is_empty() && options.moment != Moment::Rest {
        let message = "has no animations, and stands at rest at any time";
        warnings.add(Place::Whole, message);
    }
    Ok(Loaded {
        scene: scene.map_err(|fault| fault.of(path))?,
        warnings: warnings.finish(),
        files: budget.files.finish(),
        default_camera: None,
        picture_sizes: Vec::new(),
        animations,
        frames_per_second: USUAL_FRAMES_PER_SECOND,
    })
}

/// The formats, by suffix.
enum Format {
    #[cfg(feature = "gltf")]
    Gltf,
    #[cfg(feature = "obj")]
    Obj,
    #[cfg(feature = "ply")]
    Ply,
    #[cfg(feature = "stl")]
    Stl,
    #[cfg(feature = "cityjson")]
    CityJson,
}

impl Format {
    /// By suffix; without a telling one, by the first bytes.
    fn of(path: &Path) -> Result<Option<Self>, Problem> {
        let suffix = path.extension().unwrap_or_default().to_ascii_lowercase();
        match suffix.to_str() {
            #[cfg(feature = "gltf")]
            Some("glb" | "gltf") => return Ok(Some(Self::Gltf)),
            #[cfg(feature = "obj")]
            Some("obj") => return Ok(Some(Self::Obj)),
            #[cfg(feature = "ply")]
            Some("ply") => return Ok(Some(Self::Ply)),
            #[cfg(feature = "stl")]
            Some("stl") => return Ok(Some(Self::Stl)),
            #[cfg(feature = "cityjson")]
            Some("json" | "jsonl") => return Ok(Some(Self::CityJson)),
            _ => {}
        }
        let mut start = Vec::new();
        File::open(path)
            .and_then(|file| file.take(512).read_to_end(&mut start))
            .map_err(Problem::Unreadable)?;
        Ok(match start.as_slice() {
            #[cfg(feature = "gltf")]
            start if start.starts_with(gltf::MAGIC) => Some(Self::Gltf),
            #[cfg(feature = "ply")]
            start if start.starts_with(ply::MAGIC) => Some(Self::Ply),
            #[cfg(feature = "stl")]
            start if stl::is_text(start) => Some(Self::Stl),
            _ => None,
        })
    }

    /// The axis that points upwards in most files.
    fn usual_up(&self) -> UpAxis {
        match self {
            #[cfg(feature = "gltf")]
            Self::Gltf => UpAxis::Y,
            #[cfg(feature = "obj")]
            Self::Obj => UpAxis::Y,
            #[cfg(feature = "ply")]
            Self::Ply => UpAxis::Z,
            #[cfg(feature = "stl")]
            Self::Stl => UpAxis::Z,
            #[cfg(feature = "cityjson")]
            Self::CityJson => UpAxis::Z,
        }
    }
}

fn read(
    path: &Path,
    options: &ReadOptions,
    animations: &mut Vec<Animation>,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Scene, Fault> {
    let whole = |problem: Problem| problem.at(Place::Whole);
    let Some(format) = Format::of(path).map_err(whole)? else {
        let known: Vec<_> = SCENE_SUFFIXES.iter().map(|s| format!(".{s}")).collect();
        let known = known.join(", ");
        return Err(whole(Problem::UnknownFormat { known }));
    };
    let bytes = std::fs::read(path).map_err(|error| whole(Problem::Unreadable(error)))?;
    budget.files.add(path, &bytes);
    budget.add_input(bytes.len());
    let mut scene = match format {
        #[cfg(feature = "gltf")]
        Format::Gltf => {
            let seconds = options.moment.seconds(USUAL_FRAMES_PER_SECOND);
            let played = seconds.map(|seconds| gltf::Played {
                name: options.animation.as_deref(),
                seconds,
                repeats: options.repeats,
            });
            gltf::read(path, &bytes, played, animations, budget, warnings)?
        }
        #[cfg(feature = "obj")]
        Format::Obj => obj::read(path, &bytes, budget, warnings)?,
        #[cfg(feature = "ply")]
        Format::Ply => ply::read(path, &bytes, budget, warnings)?,
        #[cfg(feature = "stl")]
        Format::Stl => stl::read(path, &bytes, budget, warnings)?,
        #[cfg(feature = "cityjson")]
        Format::CityJson => {
            let level = options.level_of_detail;
            cityjson::read(path, &bytes, level, budget, warnings)?
        }
    };
    let up = options.up_axis.unwrap_or_else(|| format.usual_up());
    finish::turn_up(&mut scene, up);
    finish::check_reach(&scene).map_err(whole)?;
    Ok(scene)
}
