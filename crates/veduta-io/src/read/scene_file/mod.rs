//! Scene files: TOML that puts models together to a scene, with cameras and other materials.
//!
//! 1. The text becomes tables whose values know their places (the `toml` crate), or all its faults
//!    of syntax.
//! 2. The tables become a [`Document`], or all faults of form (`form`, `value`, `document`). The same
//!    description makes the JSON [`schema`].
//! 3. What can be checked before anything large is read is checked: cameras, names, globs, and
//!    whether the files are there.
//! 4. Models are read and placed, a layer after the other (`layer`, `instances`, `anchor`); one may
//!    be a scene file itself.
//! 5. Materials are changed (`material`), and cameras get the near plane that suits the scene.
//!
//! Each step tells all it finds, with places ([`Faults`]); the next begins only if that was nothing.

mod anchor;
mod camera;
mod document;
mod form;
mod inclusion;
mod instances;
mod keys;
mod layer;
mod material;
mod source;
mod value;
mod views;

pub use views::{FileView, read_views_file, views_file_schema};

use super::error::{Place, Problem, ReadError, Warning, Warnings};
use super::moment::USUAL_FRAMES_PER_SECOND;
use super::names::neighbour;
use super::over_time::Models;
use super::{Animation, Loaded, Moment, ReadOptions, finish};
use document::{Changes, Document};
use form::{Form, Node};
use inclusion::Inclusion;
use serde_json::{Value, json};
use source::{Faults, Source};
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};
use veduta::scene::Scene;

/// Whether a file is a scene file, by its name.
pub(crate) fn is_scene_file(path: &Path) -> bool {
    path.extension()
        .is_some_and(|suffix| suffix.eq_ignore_ascii_case("toml"))
}

/// The JSON Schema (draft 2020-12) of scene files, as editors use it to complete and to check.
///
/// It refuses what the reader refuses, except for what a schema cannot say: that files are there and
/// names are unique, ranges of values with units, and cameras without a direction to look.
pub fn scene_file_schema() -> Value {
    let mut schema = Document::schema();
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("Veduta scene file");
    schema
}

/// Reads a scene file and the models it names.
pub(crate) fn read(
    path: &Path,
    options: &ReadOptions,
    models: &mut Models,
) -> Result<Loaded, ReadError> {
    let mut inclusion = Inclusion::new(models);
    inclusion
        .enter(path)
        .map_err(|problem| problem.at(Place::Whole).of(path))?;
    let loaded = read_included(path, options, &mut inclusion)?;
    Ok(Loaded {
        files: inclusion.finish(),
        ..loaded
    })
}

/// Reads a scene file that `inclusion` knows to be read; all its files are told to that.
fn read_included(
    path: &Path,
    options: &ReadOptions,
    inclusion: &mut Inclusion<'_>,
) -> Result<Loaded, ReadError> {
    let whole = |problem: Problem| problem.at(Place::Whole).of(path);
    let bytes = inclusion.read(path);
    let bytes = bytes.map_err(|error| whole(Problem::Unreadable(error)))?;
    let source = Source::new(path, &bytes)?;
    let document: Document = read_form("a scene file", &source)?;

    let mut warnings = Warnings::new(path.to_owned());
    let untimed = ReadOptions {
        moment: Moment::Rest,
        ..options.clone()
    };
    if untimed != ReadOptions::default() {
        let message = "its models are read as its layers say, so that no axis, level of detail or \
            animation can be asked for; they have `up`, `lod` and `animation`";
        warnings.add(Place::Whole, message);
    }
    let animation = document.animation.as_ref();
    let fps = animation.and_then(|animation| animation.value.fps.as_ref());
    let frames_per_second = fps.map_or(USUAL_FRAMES_PER_SECOND, |fps| fps.value.0);
    // Of a scene file there is a beginning, but no rest.
    let seconds = options.moment.seconds(frames_per_second).unwrap_or(0.0);
    let time = Time {
        seconds,
        frames_per_second,
    };
    let mut faults = Faults::default();
    let cameras = camera::all(&document, time, &mut faults);
    let globs = material::globs(&document.material, &mut faults);
    let layers = layer::plan(&document, path, time, &mut faults);
    faults.finish(&source)?;

    let mut parts = layer::read(&layers, &source, inclusion, &mut warnings)?;
    let mut faults = Faults::default();
    let world = anchor::anchor(&document, &layers, &mut parts, &mut faults);
    faults.finish(&source)?;

    let mut scene = Scene {
        world,
        ..Scene::default()
    };
    let mut picture_sizes = Vec::new();
    for camera in &cameras {
        scene.cameras.push((camera.name.clone(), camera.camera));
        picture_sizes.extend(camera.size.map(|size| (camera.name.clone(), size)));
    }
    let mut animations: Vec<Animation> = cameras
        .iter()
        .filter_map(|camera| camera.animation.clone())
        .collect();
    let default_camera = cameras.first().map(|camera| camera.name.clone());
    for (layer, part) in layers.iter().zip(parts) {
        animations.extend(layer.animations(&part.loaded));
        let sizes = layer::append(&mut scene, layer, part, &source, inclusion, &mut warnings)?;
        picture_sizes.extend(sizes);
    }
    material::change(&mut scene, &globs, &source, inclusion, &mut warnings)?;
    camera::set_near_planes(&mut scene, &cameras);
    finish::check_reach(&scene).map_err(whole)?;
    Ok(Loaded {
        scene,
        warnings: warnings.finish(),
        files: Vec::new(),
        default_camera,
        picture_sizes,
        animations,
        frames_per_second,
    })
}

/// The moment at which a scene file is read.
#[derive(Clone, Copy, Debug)]
struct Time {
    seconds: f64,
    frames_per_second: f64,
}

/// Changes materials of a scene that is there already, as a scene file changes those that its models
/// bring: `text` has tables `[material."…"]` and nothing else. Paths in it are relative to `path`, which
/// names the text in messages.
///
/// # Errors
/// All that is wrong with the text.
pub fn change_scene(
    scene: &mut Scene,
    path: &Path,
    text: &[u8],
) -> Result<Vec<Warning>, ReadError> {
    let source = Source::new(path, text)?;
    let changes: Changes = read_form("a file of changes", &source)?;
    let mut faults = Faults::default();
    let globs = material::globs(&changes.material, &mut faults);
    faults.finish(&source)?;
    let mut warnings = Warnings::new(path.to_owned());
    let mut models = Models::default();
    let mut inclusion = Inclusion::new(&mut models);
    inclusion.add_input(path, text.len());
    material::change(scene, &globs, &source, &mut inclusion, &mut warnings)?;
    Ok(warnings.finish())
}

/// Changes a material of a scene by one line, such as `material."city/roofs".color=#446`: what
/// [`change_scene`] reads, but that words need no quotation marks.
///
/// # Errors
/// All that is wrong with the line.
pub fn set_in_scene(scene: &mut Scene, line: &str) -> Result<Vec<Warning>, ReadError> {
    let is_toml = |text: &str| DeTable::parse(text).is_ok();
    let text = match line.rsplit_once('=') {
        Some((path, value)) if !is_toml(line) => {
            let quoted = format!("{path}={}", Value::from(value.trim()));
            if is_toml(&quoted) {
                quoted
            } else {
                line.to_owned()
            }
        }
        _ => line.to_owned(),
    };
    change_scene(scene, Path::new("--set"), text.as_bytes())
}

/// The text in a form of that name, or all that is wrong in it.
fn read_form<F: Form>(name: &'static str, source: &Source<'_>) -> Result<F, ReadError> {
    let mut faults = Faults::default();
    let (table, errors) = DeTable::parse_recoverable(source.text);
    for error in errors {
        let span = error.span().unwrap_or(0..0);
        faults.add(span, Problem::Toml(with_hint(error.message())));
    }
    faults.finish(source)?;

    let mut faults = Faults::default();
    let root = Node::new(table.span(), DeValue::Table(table.into_inner()));
    let form = F::read(name, &root, &mut faults);
    faults.finish(source)?;
    Ok(form.expect("a form without faults can be read"))
}

/// What the parser says, and what most often leads to it.
fn with_hint(message: &str) -> String {
    let hint = if message.starts_with("invalid float") || message.starts_with("invalid integer") {
        "; a value with a unit stands in quotes, such as \"40deg\""
    } else {
        ""
    };
    format!("{message}{hint}")
}

/// The path of a file that a scene file names, if it is there and may be read.
fn find_file(scene_file: &Path, named: &str) -> Result<PathBuf, Problem> {
    if named.contains("://") {
        return Err(Problem::RemoteUri(named.to_owned()));
    }
    let path = scene_file.parent().unwrap_or(Path::new("")).join(named);
    let mut reason = match std::fs::metadata(&path) {
        Ok(metadata) if metadata.is_file() => return Ok(path),
        Ok(_) => "it is not a plain file".to_owned(),
        Err(error) => crate::reason(&error),
    };
    if let Some(name) = neighbour(&path) {
        reason += &format!("; did you mean {name:?}?");
    }
    Err(Problem::NoFile { path, reason })
}
