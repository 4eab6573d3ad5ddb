//! Changes to the materials that the models bring.

use super::document::{MaterialChange, TextureChange};
use super::form::{Given, Named};
use super::inclusion::Inclusion;
use super::source::{Faults, Source, Span};
use super::{find_file, value::Text};
use crate::read::error::{Place, ReadError, Warnings};
use crate::read::names::closest;
use crate::read::picture::PictureDecoder;
use glob::{MatchOptions, Pattern};
use std::collections::HashMap;
use std::path::PathBuf;
use veduta::geometry::Vec2;
use veduta::scene::{AlphaMode, ImageId, Material, Scene, TextureRef};

/// A change, and the names of the materials it is for.
#[derive(Debug)]
pub struct Globbed<'d> {
    pattern: Pattern,
    text: &'d Given<Text>,
    change: &'d MaterialChange,
}

/// A star stands for a part of one name, two for any names.
const MATCHING: MatchOptions = MatchOptions {
    case_sensitive: true,
    require_literal_separator: true,
    require_literal_leading_dot: false,
};

/// The changes in the order of the file.
pub fn globs<'d>(
    changes: &'d Option<Given<Named<Text, MaterialChange>>>,
    faults: &mut Faults,
) -> Vec<Globbed<'d>> {
    let changes = changes.iter().flat_map(|named| &named.value.0);
    let mut globs = Vec::new();
    for (text, change) in changes {
        match Pattern::new(&text.value.0) {
            Ok(pattern) => globs.push(Globbed {
                pattern,
                text,
                change,
            }),
            Err(error) => {
                let message = format!(
                    "{:?} is no pattern of names: {}; a bracket is written [[]",
                    text.value.0, error.msg
                );
                faults.senseless(text.span.clone(), message);
            }
        }
    }
    globs
}

/// Changes the materials of `scene`.
pub fn change(
    scene: &mut Scene,
    globs: &[Globbed<'_>],
    source: &Source<'_>,
    inclusion: &mut Inclusion<'_>,
    warnings: &mut Warnings,
) -> Result<(), ReadError> {
    let mut pictures = Pictures {
        decoder: PictureDecoder::new(),
        known: HashMap::new(),
    };
    for glob in globs {
        let matched: Vec<usize> = (0..scene.materials.len())
            .filter(|&index| {
                glob.pattern
                    .matches_with(&scene.materials[index].name, MATCHING)
            })
            .collect();
        if matched.is_empty() {
            let message = no_match(&glob.text.value.0, &scene.materials);
            warnings.add(source.place(glob.text.span.start), message);
            continue;
        }
        let texture = match glob.change.texture.as_ref().map(|change| &change.value) {
            None => None,
            Some(TextureChange::None) => Some(None),
            Some(TextureChange::Picture(table)) => {
                let image = &table.image;
                let image = pictures.image(
                    scene,
                    &image.value.0,
                    &image.span,
                    source,
                    inclusion,
                    warnings,
                )?;
                let repeat = table.repeat.as_ref();
                // Where there is no picture, the colour is what is left.
                Some(image.map(|image| TextureRef {
                    scale: repeat.map_or(Vec2::ONE, |repeat| repeat.value.0),
                    ..TextureRef::new(image)
                }))
            }
        };
        if let Some(Some(_)) = texture
            && !any_has_texcoords(scene, &matched)
        {
            let message = format!(
                "no surface of {:?} has texture coordinates, so that the texture is not seen",
                glob.text.value.0
            );
            warnings.add(source.place(glob.text.span.start), message);
        }
        for index in matched {
            let material = &mut scene.materials[index];
            apply(glob.change, material);
            if let Some(texture) = texture {
                material.base_color_texture = texture;
            }
        }
    }
    Ok(())
}

fn apply(change: &MaterialChange, material: &mut Material) {
    if let Some(color) = &change.color {
        material.base_color[..3].copy_from_slice(&color.value.0);
    }
    if let Some(opacity) = &change.opacity {
        material.base_color[3] = opacity.value.0;
        material.alpha_mode = if opacity.value.0 < 1.0 {
            AlphaMode::Blend
        } else {
            AlphaMode::Opaque
        };
    }
    if let Some(unlit) = &change.unlit {
        material.unlit = unlit.value.0;
    }
    if let Some(double_sided) = &change.double_sided {
        material.double_sided = double_sided.value.0;
    }
    if let Some(emissive) = &change.emissive {
        material.emissive = emissive.value.0;
    }
}

fn no_match(text: &str, materials: &[Material]) -> String {
    let names = || materials.iter().map(|material| material.name.as_str());
    if materials.is_empty() {
        return format!("no material is called {text:?}; there is none");
    }
    let help = match closest(text, names()) {
        Some(name) => format!("did you mean {name:?}?"),
        None => {
            const MOST: usize = 8;
            let mut listed: Vec<_> = names().take(MOST).map(|name| format!("{name:?}")).collect();
            if materials.len() > MOST {
                listed.push(format!("and {} more", materials.len() - MOST));
            }
            format!("there are {}", listed.join(", "))
        }
    };
    format!("no material is called {text:?}; {help}")
}

fn any_has_texcoords(scene: &Scene, materials: &[usize]) -> bool {
    scene.meshes.iter().any(|mesh| {
        let is_of = |id: veduta::map::MaterialId| materials.binary_search(&id.index()).is_ok();
        !mesh.texcoords.is_empty() && mesh.materials.iter().any(|&(_, id)| is_of(id))
    })
}

/// The pictures that changes name, each read once.
struct Pictures {
    decoder: PictureDecoder,
    known: HashMap<PathBuf, Option<ImageId>>,
}

impl Pictures {
    /// The picture in a file; `None`, after a warning, where there is none.
    fn image(
        &mut self,
        scene: &mut Scene,
        named: &str,
        span: &Span,
        source: &Source<'_>,
        inclusion: &mut Inclusion<'_>,
        warnings: &mut Warnings,
    ) -> Result<Option<ImageId>, ReadError> {
        let mut warn = |message: String| {
            let place: Place = source.place(span.start);
            warnings.add(place, format!("{message}; the plain colour is shown"));
        };
        let path = match find_file(source.path, named) {
            Ok(path) => path,
            Err(problem) => {
                warn(problem.to_string());
                return Ok(None);
            }
        };
        if let Some(&known) = self.known.get(&path) {
            return Ok(known);
        }
        let decoded = inclusion
            .read(&path)
            .map_err(|error| format!("cannot be read: {}", crate::reason(&error)))
            .and_then(|bytes| self.decoder.decode(named, &bytes));
        let image = match decoded {
            Ok(image) => {
                let charged = inclusion.charge_picture(image.pixels.len());
                charged.map_err(|problem| source.error(span.clone(), problem))?;
                scene.images.push(image);
                Some(ImageId(scene.images.len() as u32 - 1))
            }
            Err(message) => {
                warn(format!("{}: {message}", path.display()));
                None
            }
        };
        self.known.insert(path, image);
        Ok(image)
    }
}
