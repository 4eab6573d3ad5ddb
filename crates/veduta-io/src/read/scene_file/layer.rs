//! Layers: models are read and placed in the scene.

use super::document::Document;
use super::inclusion::Inclusion;
use super::keys::{LayerKeys, world_from_model};
use super::source::{Faults, Source, Span};
use super::value::{Played, Up};
use super::{Time, find_file, instances, is_scene_file, read_included};
#[cfg(feature = "cityjson")]
use crate::read::LevelOfDetail;
use crate::read::error::{Problem, ReadError, Warnings};
use crate::read::names::unique;
use crate::read::{Animation, AnimationKind, Loaded, Moment, ReadOptions, UpAxis};
use std::cmp::Reverse;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use veduta::geometry::{DMat4, DVec3};
use veduta::map::{Camera, MaterialId, Projection};
use veduta::scene::{ImageId, Layer, Light, MeshId, Object, Scene, Shown};

/// A layer whose files are there.
#[derive(Debug)]
pub struct PlannedLayer<'d> {
    pub name: &'d str,
    pub priority: i32,
    shown: Shown,
    model: PathBuf,
    pub model_span: Span,
    options: ReadOptions,
    /// Where the animation that is played is asked for.
    animation_span: Option<Span>,
    at: DMat4,
    /// When its last key is, in seconds, if it has keys.
    keys_end: Option<f64>,
    instances: Option<(PathBuf, Span)>,
}

/// What a layer brings.
#[derive(Debug)]
pub struct Part {
    pub loaded: Loaded,
    /// Where it stands; a name for each instance.
    pub places: Vec<(Option<String>, DMat4)>,
}

impl PlannedLayer<'_> {
    /// The layer, without objects, before object `next` of a scene.
    fn row(&self, next: u32, shown: Shown) -> Layer {
        Layer {
            name: self.name.to_owned(),
            priority: self.priority,
            shown,
            objects: next..next,
        }
    }

    /// Whether its places come from a table.
    pub fn has_instances(&self) -> bool {
        self.instances.is_some()
    }

    /// What moves it, and what moves in its model or could.
    pub fn animations(&self, loaded: &Loaded) -> Vec<Animation> {
        let keys = self.keys_end.map(|seconds| Animation {
            name: self.name.to_owned(),
            kind: AnimationKind::Layer,
            seconds,
        });
        let of_model = loaded.animations.iter().map(|animation| Animation {
            name: prefixed(self.name, &animation.name),
            ..animation.clone()
        });
        keys.into_iter().chain(of_model).collect()
    }
}

/// The layers in descending order of priority; of equals the first in the file is the first.
pub fn plan<'d>(
    document: &'d Document,
    scene_file: &Path,
    time: Time,
    faults: &mut Faults,
) -> Vec<PlannedLayer<'d>> {
    let mut layers = Vec::new();
    let mut names: HashMap<&str, Span> = HashMap::new();
    for layer in &document.layer.value.0 {
        let layer = &layer.value;
        let name = layer.name.value.0.as_str();
        if names.insert(name, layer.name.span.clone()).is_some() {
            let message = format!("another layer is called {name:?}; each needs its own name");
            faults.senseless(layer.name.span.clone(), message);
        }
        let mut find = |named: &str, span: &Span| {
            find_file(scene_file, named)
                .map_err(|problem| faults.add(span.clone(), problem))
                .ok()
        };
        let model_span = layer.model.span.clone();
        let model = find(&layer.model.value.0, &model_span);
        let instances = layer.instances.as_ref().map(|instances| {
            let path = find(&instances.value.0, &instances.span);
            path.map(|path| (path, instances.span.clone()))
        });
        let up = layer.up.as_ref().map(|up| match up.value {
            Up::Y => UpAxis::Y,
            Up::Z => UpAxis::Z,
        });
        if let (Some(up), Some(model)) = (&layer.up, &model)
            && is_scene_file(model)
        {
            let message = "the model is a scene file, which has Z up always; leave `up` out";
            faults.senseless(up.span.clone(), message);
        }
        if let (Some(lod), Some(model)) = (&layer.lod, &model)
            && !is_city_model(model)
        {
            let message = "`lod` is for city models (.city.json, .city.jsonl); leave it out";
            faults.senseless(lod.span.clone(), message);
        }
        let played = layer.animation.as_ref();
        let plays = played.is_some_and(|played| played.value != Played::None);
        if let (Some(played), Some(model)) = (played, &model)
            && !may_have_animations(model)
        {
            let message = "`animation` is for glTF models (.glb, .gltf); leave it out";
            faults.senseless(played.span.clone(), message);
        }
        if let Some(repeat) = &layer.repeat
            && layer.keys.is_none()
            && !plays
        {
            let message = "`repeat` is for a layer with `keys` or `animation`; leave it out";
            faults.senseless(repeat.span.clone(), message);
        }
        let at = layer.at.as_ref().map(|at| &at.value);
        let keys = LayerKeys::of(layer, time.frames_per_second, faults);
        if let (Some(model), None | Some(Some(_))) = (model, &instances) {
            let is_timed = plays || is_scene_file(&model);
            layers.push(PlannedLayer {
                name,
                priority: layer
                    .priority
                    .as_ref()
                    .map_or(0, |priority| priority.value.0),
                shown: layer
                    .shown
                    .as_ref()
                    .map_or(Shown::Seen, |shown| shown.value),
                model,
                model_span,
                options: ReadOptions {
                    up_axis: up,
                    #[cfg(feature = "cityjson")]
                    level_of_detail: layer.lod.as_ref().map(|lod| LevelOfDetail {
                        level: lod.value.level,
                        refinement: lod.value.refinement,
                    }),
                    moment: if is_timed {
                        Moment::Seconds(time.seconds)
                    } else {
                        Moment::Rest
                    },
                    animation: played.and_then(|played| match &played.value {
                        Played::Named(name) => Some(name.clone()),
                        Played::First | Played::None => None,
                    }),
                    repeats: layer.repeat.as_ref().is_some_and(|repeat| repeat.value.0),
                },
                animation_span: played.map(|played| played.span.clone()),
                at: match &keys {
                    Some(keys) => keys.world_from_model(at, time.seconds),
                    None => at.map_or(DMat4::IDENTITY, world_from_model),
                },
                keys_end: keys.as_ref().map(|keys| keys.end),
                instances: instances.flatten(),
            });
        }
    }
    layers.sort_by_key(|layer| Reverse(layer.priority));
    layers
}

/// Whether a file is one of the formats that have levels of detail, by its name.
fn is_city_model(path: &Path) -> bool {
    path.extension().is_some_and(|suffix| {
        suffix.eq_ignore_ascii_case("json") || suffix.eq_ignore_ascii_case("jsonl")
    })
}

/// Whether a file may be one of the formats that have animations, by its name.
fn may_have_animations(path: &Path) -> bool {
    path.extension().is_some_and(|suffix| {
        suffix.eq_ignore_ascii_case("glb") || suffix.eq_ignore_ascii_case("gltf")
    })
}

/// Reads the models of `layers`, a part for each.
pub fn read(
    layers: &[PlannedLayer<'_>],
    source: &Source<'_>,
    inclusion: &mut Inclusion<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<Part>, ReadError> {
    let mut parts = Vec::with_capacity(layers.len());
    for layer in layers {
        let here = |problem: Problem| source.error(layer.model_span.clone(), problem);
        let mut loaded = if is_scene_file(&layer.model) {
            inclusion.enter(&layer.model).map_err(here)?;
            let loaded = read_included(&layer.model, &layer.options, inclusion)?;
            inclusion.leave();
            loaded
        } else {
            let loaded = inclusion.read_model(&layer.model, &layer.options);
            loaded.map_err(|error| match (error.problem, &layer.animation_span) {
                // Where the name stands, not the file that lacks it.
                (problem @ Problem::NoAnimation { .. }, Some(span)) => {
                    source.error(span.clone(), problem)
                }
                (problem, _) => ReadError { problem, ..error },
            })?
        };
        inclusion.append_files(std::mem::take(&mut loaded.files));
        let charged = inclusion.charge_model(&layer.model, &loaded.scene);
        charged.map_err(here)?;
        warnings.append(std::mem::take(&mut loaded.warnings));
        let places = match &layer.instances {
            None => vec![(None, layer.at)],
            Some((table, _)) => instances::read(table, inclusion, warnings)?
                .into_iter()
                .map(|instance| (Some(instance.name), instance.world_from_model * layer.at))
                .collect(),
        };
        parts.push(Part { loaded, places });
    }
    Ok(parts)
}

/// Adds a part to the scene as a layer, all its names under that of the layer; the sizes of pictures that its
/// cameras ask for.
pub fn append(
    scene: &mut Scene,
    layer: &PlannedLayer<'_>,
    part: Part,
    source: &Source<'_>,
    inclusion: &mut Inclusion<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<(String, [u32; 2])>, ReadError> {
    // All fields are named, so that none that is new is lost here.
    let Scene {
        objects,
        meshes,
        materials,
        images,
        cameras,
        lights,
        layers,
        world: _,
    } = part.loaded.scene;
    // What is not simply seen in a scene file stays so where that is a layer of another.
    let shown_of = |object: usize| {
        let of = layers
            .iter()
            .find(|of| of.objects.contains(&(object as u32)));
        let own = of.map_or(Shown::Seen, |of| of.shown);
        if layer.shown.is_seen() {
            own
        } else {
            layer.shown
        }
    };
    let next = scene.objects.len() as u32;
    scene.layers.push(layer.row(next, layer.shown));
    let first_mesh = scene.meshes.len();
    let first_image = scene.images.len() as u32;
    let first_material = scene.materials.len();
    scene.images.extend(images);
    scene
        .materials
        .extend(materials.into_iter().map(|mut material| {
            material.name = prefixed(layer.name, &material.name);
            let textures = [
                &mut material.base_color_texture,
                &mut material.emissive_texture,
            ];
            for texture in textures.into_iter().flatten() {
                texture.image = ImageId(first_image + texture.image.0);
            }
            material
        }));
    scene.meshes.extend(meshes.into_iter().map(|mut mesh| {
        for (_, material) in &mut mesh.materials {
            *material = MaterialId::from_index(first_material + material.index());
        }
        mesh
    }));

    let mut charge = |bytes: usize| {
        inclusion.charge(1, bytes).map_err(|problem| {
            let table = layer.instances.as_ref().map(|(_, span)| span);
            source.error(table.unwrap_or(&layer.model_span).clone(), problem)
        })
    };
    for (instance, place) in &part.places {
        let prefix = match instance {
            None => layer.name.to_owned(),
            Some(instance) => format!("{}/{instance}", layer.name),
        };
        for (index, object) in objects.iter().enumerate() {
            let name = prefixed(&prefix, &object.name);
            charge(size_of::<Object>() + name.len())?;
            add_to_layer(scene, layer, shown_of(index));
            scene.objects.push(Object {
                name,
                mesh: MeshId((first_mesh + object.mesh.0 as usize) as u32),
                world_from_object: *place * object.world_from_object,
            });
        }
        for light in &lights {
            let name = prefixed(&prefix, &light.name);
            charge(size_of::<Light>() + name.len())?;
            scene.lights.push(Light {
                name,
                world_from_light: moved_light(&light.world_from_light, place),
                ..light.clone()
            });
        }
    }

    // A model that stands in many places would bring as many cameras of each kind.
    let [(None, place)] = &part.places[..] else {
        return Ok(Vec::new());
    };
    let mut sizes = part.loaded.picture_sizes;
    let mut taken: HashMap<String, u32> = scene
        .cameras
        .iter()
        .map(|(name, _)| (name.clone(), 1))
        .collect();
    for (own_name, camera) in cameras {
        let name = unique(prefixed(layer.name, &own_name), &mut taken);
        let Some(moved) = moved(&camera, place) else {
            let message = format!(
                "camera {name:?} is left out: its layer is mirrored or scaled unequally, which \
                 leaves no sound camera"
            );
            warnings.add(source.place(layer.model_span.start), message);
            continue;
        };
        for (of, _) in sizes.iter_mut().filter(|(of, _)| *of == own_name) {
            of.clone_from(&name);
        }
        scene.cameras.push((name, moved));
    }
    let is_known = |(name, _): &(String, [u32; 2])| scene.cameras.iter().any(|(of, _)| of == name);
    sizes.retain(is_known);
    Ok(sizes)
}

/// Says that the next object of the scene is of `layer`, the last one. A layer of which not all objects are
/// shown alike has several rows.
fn add_to_layer(scene: &mut Scene, layer: &PlannedLayer<'_>, shown: Shown) {
    let next = scene.objects.len() as u32;
    match scene.layers.last_mut() {
        Some(last) if last.shown == shown || last.objects.is_empty() => {
            last.shown = shown;
            last.objects.end = next + 1;
        }
        _ => {
            let row = layer.row(next, shown);
            scene.layers.push(Layer {
                objects: next..next + 1,
                ..row
            });
        }
    }
}

/// A name under another; what has none is called as what it is of.
fn prefixed(prefix: &str, name: &str) -> String {
    if name.is_empty() {
        prefix.to_owned()
    } else {
        format!("{prefix}/{name}")
    }
}

/// A camera of a model that is placed in the world; `None` where the place distorts what it sees.
fn moved(camera: &Camera, world_from_model: &DMat4) -> Option<Camera> {
    /// How far factors and right angles may be off.
    const TOLERANCE: f64 = 1e-6;
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| world_from_model.transform_vector3(axis));
    let [x, y, z] = axes;
    let scale = x.length();
    let is_even = axes
        .iter()
        .all(|axis| (axis.length() - scale).abs() <= TOLERANCE * scale);
    let is_square = [x.dot(y), y.dot(z), z.dot(x)]
        .iter()
        .all(|dot| dot.abs() <= TOLERANCE * scale * scale);
    if !(is_even && is_square && world_from_model.determinant() > 0.0) {
        return None;
    }
    let mut camera = *camera;
    // In eye space lengths are metres of the world.
    let larger = DMat4::from_scale(DVec3::splat(scale));
    camera.eye_from_world = larger * camera.eye_from_world * world_from_model.inverse();
    camera.near *= scale;
    if let Projection::Parallel { height, .. } = &mut camera.projection {
        *height *= scale;
    }
    let is_sound = camera.eye_from_world.is_finite() && camera.near.is_finite();
    is_sound.then_some(camera)
}

/// The rigid motion of a light of a model that is placed in the world.
///
/// Scale moves a light but does not change it (KHR_lights_punctual): what it sends out is in absolute
/// units.
fn moved_light(model_from_light: &DMat4, world_from_model: &DMat4) -> DMat4 {
    let world_from_light = *world_from_model * *model_from_light;
    // The light shines along its -Z, so that axis is kept and the others are set upright to it.
    let z = world_from_light.z_axis.truncate().normalize_or(DVec3::Z);
    let x = world_from_light.y_axis.truncate().cross(z);
    let x = x.try_normalize().unwrap_or(z.any_orthonormal_vector());
    DMat4::from_cols(
        x.extend(0.0),
        z.cross(x).extend(0.0),
        z.extend(0.0),
        world_from_light.w_axis,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta::geometry::DQuat;

    #[test]
    fn a_light_moves_with_its_model_and_stays_rigid_in_any_place() {
        let light = DMat4::from_rotation_translation(
            DQuat::from_rotation_x(-0.8),
            DVec3::new(1.0, 2.0, 3.0),
        );
        for scale in [
            DVec3::splat(2.0),
            DVec3::new(-1.0, 1.0, 1.0),
            DVec3::new(1.0, 3.0, 0.5),
        ] {
            let place = DMat4::from_scale_rotation_translation(
                scale,
                DQuat::from_rotation_z(0.4),
                DVec3::new(10.0, 0.0, -5.0),
            );
            let moved = moved_light(&light, &place);
            let stands = place.transform_point3(DVec3::new(1.0, 2.0, 3.0));
            assert!((moved.w_axis.truncate() - stands).length() < 1e-12);
            let shines = place.transform_vector3(light.transform_vector3(-DVec3::Z));
            let along = moved.transform_vector3(-DVec3::Z);
            assert!((along - shines.normalize()).length() < 1e-12, "{scale}");
            assert!((moved.determinant() - 1.0).abs() < 1e-12, "{scale}");
        }
    }

    #[test]
    fn a_camera_moved_with_its_model_takes_the_same_picture_of_it() {
        let point = DVec3::new(0.4, -0.3, 0.2);
        let place = DMat4::from_scale_rotation_translation(
            DVec3::splat(3.0),
            DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.7),
            DVec3::new(100.0, -50.0, 7.0),
        );
        for projection in [
            Projection::Perspective {
                tan_half_height: 0.4,
                aspect: 1.5,
            },
            Projection::Parallel {
                height: 3.0,
                aspect: 1.5,
            },
        ] {
            let eye = DVec3::new(3.0, -5.0, 2.0);
            let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.1);
            let camera = camera.expect("a sound camera");
            let moved = moved(&camera, &place).expect("nothing is distorted");
            let image = |camera: &Camera, point| {
                camera.image_from_eye(camera.eye_from_world.transform_point3(point))
            };
            let there = image(&moved, place.transform_point3(point));
            assert!((there - image(&camera, point)).length() < 1e-12);
            assert!((moved.near - 0.3).abs() < 1e-12);
            // Still a rigid motion.
            let axis = moved.eye_from_world.transform_vector3(DVec3::X);
            assert!((axis.length() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn mirrored_and_stretched_places_leave_no_camera() {
        let projection = Projection::Parallel {
            height: 1.0,
            aspect: 1.0,
        };
        let camera = Camera::looking(DVec3::Y, DVec3::ZERO, DVec3::Z, projection, 0.0);
        let camera = camera.expect("a sound camera");
        for scale in [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, 1.0, 2.0)] {
            assert!(moved(&camera, &DMat4::from_scale(scale)).is_none());
        }
    }
}
