use super::merge::{Meeting, merge};
use super::pieced::Pieced;
use crate::scene::{FaceIndex, PlaneGroups};
use std::cmp::Reverse;
use std::collections::HashMap;
use std::ops::Range;
use veduta_geometry::DMat4;
use veduta_map::scene::{
    Image, ImageId, Layer, Material, Mesh, MeshId, Object, ObjectKey, Scene, Shown, World,
};
use veduta_map::{
    Camera, FaceId, Faces, Guest, MaterialId, ObjectId, ObjectMesh, PlaneId, Projection, Seen,
    SeenScene, VisibilityMap,
};

/// Why maps cannot be composited.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompositeError {
    /// There is none.
    #[error("there is no map to composite")]
    Nothing,
    /// Nearness can be compared along the same lines of sight only.
    #[error("map {index} was seen through another camera than the first: {difference}")]
    OtherCamera {
        /// Which of the maps.
        index: usize,
        /// In what they differ.
        difference: String,
    },
    /// Coordinates of different origins cannot be compared.
    #[error("map {index} stands elsewhere in the world than the first: {difference}")]
    OtherWorld {
        /// Which of the maps.
        index: usize,
        /// In what they differ.
        difference: String,
    },
    /// Pictures of other programs have no region that could cut a map or lie behind one.
    #[error(
        "map {index} holds pictures of other programs, which only hide by depth and are hidden by it"
    )]
    Guests {
        /// Which of the maps.
        index: usize,
    },
    /// Spans meet on common sub-scanlines only.
    #[error("picture {index} was sampled otherwise than the first: {difference}")]
    OtherSampling {
        /// Which of the pictures.
        index: usize,
        /// In what they differ.
        difference: String,
    },
}

/// What is seen of all maps together: composite(A, B, …) is the map of A and B and …
///
/// Camera and size are the first map's, lights and guests those of all maps.
///
/// # Errors
/// [`CompositeError`] for maps of different cameras or places in the world.
pub fn composite(maps: &[SeenScene]) -> Result<SeenScene, CompositeError> {
    hold_out(maps, &[])
}

/// [`composite`] of `maps` as far as the surfaces of `holdouts` do not hide them. Where those are seen
/// nothing is: the picture has a hole of their exact shape. Where there are guests, what holds out
/// stays in the map as a matte, since guests find what hides them when pixels are made.
///
/// # Errors
/// As [`composite`]; indices count the maps first, then the holdouts, which may have no guests.
pub fn hold_out(maps: &[SeenScene], holdouts: &[SeenScene]) -> Result<SeenScene, CompositeError> {
    refuse_guests(holdouts, maps.len())?;
    let guests: Vec<Guest> = maps.iter().flat_map(|seen| seen.guests.clone()).collect();
    if !(guests.is_empty() || holdouts.is_empty()) {
        let mut all = [maps, holdouts].concat();
        for holdout in &mut all[maps.len()..] {
            holdout.scene.show_as(Shown::Matte, |_| true);
        }
        return composite(&all);
    }
    let mut union = Union::of(maps.iter().chain(holdouts))?;
    let Seen {
        mut opaque,
        mut veils,
    } = union.merged();
    if !holdouts.is_empty() {
        let mut is_shown = vec![false; union.faces.len()];
        for face in union.new_ids[..maps.len()].iter().flatten() {
            is_shown[face.index()] = true;
        }
        for fragments in [&mut opaque, &mut veils] {
            *fragments = fragments.selected(|face| is_shown[face.index()]);
        }
    }
    let has_holes = !holdouts.is_empty() || union.has_holes.contains(&true);
    Ok(SeenScene {
        guests,
        ..union.into_seen(Seen { opaque, veils }, has_holes)
    })
}

/// Fails for maps with guests, of which the first is number `first`.
pub(super) fn refuse_guests<'a>(
    maps: impl IntoIterator<Item = &'a SeenScene>,
    first: usize,
) -> Result<(), CompositeError> {
    let mut maps = maps.into_iter();
    match maps.position(|seen| !seen.guests.is_empty()) {
        Some(index) => Err(CompositeError::Guests {
            index: first + index,
        }),
        None => Ok(()),
    }
}

/// Several maps with what is seen of their scenes, brought to one table of faces and one scene.
pub(super) struct Union<'a> {
    united: UnitedScenes<'a>,
    pub camera: Camera,
    pub faces: Faces,
    /// What is seen in each map.
    pub maps: Vec<Seen>,
    /// Of each map, whether faces are unseen in it where nothing hides them.
    pub has_holes: Vec<bool>,
    /// Of each map, the new numbers of its faces.
    pub new_ids: Vec<Vec<FaceId>>,
    size: [u32; 2],
}

impl<'a> Union<'a> {
    /// # Errors
    /// [`CompositeError`] for none, or for maps of different cameras or places in the world.
    pub fn of(maps: impl Iterator<Item = &'a SeenScene>) -> Result<Self, CompositeError> {
        let maps: Vec<&SeenScene> = maps.collect();
        check_alike(&maps)?;
        let first = maps[0];
        let scenes: Vec<&Scene> = maps.iter().map(|seen| &seen.scene).collect();
        let united = UnitedScenes::of(&scenes);
        let tables: Vec<&Faces> = maps.iter().map(|seen| &seen.map.faces).collect();
        let (faces, new_ids) = united.faces(&tables);
        let seen = maps.iter().zip(&new_ids).map(|(seen, new_ids)| {
            let new_id = |face: FaceId| new_ids[face.index()];
            Seen {
                opaque: seen.map.opaque.renumbered(new_id),
                veils: seen.map.veils.renumbered(new_id),
            }
        });
        // What was clipped before a near plane is not known; it does not change what lies behind.
        let nears = maps.iter().map(|seen| seen.map.camera.near);
        let camera = Camera {
            near: nears.fold(f64::INFINITY, f64::min),
            ..first.map.camera
        };
        Ok(Self {
            camera,
            faces,
            maps: seen.collect(),
            has_holes: maps.iter().map(|seen| seen.has_holes).collect(),
            new_ids,
            size: first.size,
            united,
        })
    }

    /// What the maps show, as one scene; meshes stay with the maps.
    pub fn scene(&self) -> &Scene {
        &self.united.scene
    }

    /// What is seen of all maps together. Faces that meet in one plane share it from then on.
    fn merged(&mut self) -> Seen {
        let aspect = self.camera.aspect();
        let mut meeting = Meeting::of(&self.faces, &self.maps, aspect);
        self.united.share_planes(&mut self.faces, &mut meeting);
        if !self.has_holes.contains(&true) {
            return meeting.merge(&self.faces);
        }
        let pieced = Pieced::new(&self.faces, &self.maps, &self.has_holes);
        pieced.put_together(&merge(&pieced.faces, &pieced.maps, aspect))
    }

    /// The union with `seen` in it.
    pub fn into_seen(self, Seen { opaque, veils }: Seen, has_holes: bool) -> SeenScene {
        let map = VisibilityMap {
            camera: self.camera,
            faces: self.faces,
            opaque,
            veils,
        };
        let UnitedScenes { scene, meshes, .. } = &self.united;
        SeenScene {
            has_holes,
            ..SeenScene::of_meshes(scene, meshes, &map, self.size)
        }
    }
}

/// Fails for no maps, and for maps of different cameras or places in the world.
pub(super) fn check_alike(maps: &[&SeenScene]) -> Result<(), CompositeError> {
    let views = maps.iter();
    refuse_other_views(views.map(|seen| (&seen.map.camera, &seen.scene.world)))
}

/// Fails on the first view that cannot be composited with that before all.
pub(super) fn refuse_other_views<'a>(
    mut views: impl Iterator<Item = (&'a Camera, &'a World)>,
) -> Result<(), CompositeError> {
    let Some((camera, world)) = views.next() else {
        return Err(CompositeError::Nothing);
    };
    for (index, (other_camera, other_world)) in (1..).zip(views) {
        if let Some(difference) = camera_difference(camera, other_camera) {
            return Err(CompositeError::OtherCamera { index, difference });
        }
        if let Some(difference) = world_difference(world, other_world) {
            return Err(CompositeError::OtherWorld { index, difference });
        }
    }
    Ok(())
}

/// Scenes as one, with their objects in the order of [`Scene::key_order`]; also where they are told scene
/// by scene or united before. Cameras, meshes without an object and layers without one are left out.
pub fn unite(scenes: &[&Scene]) -> Scene {
    UnitedScenes::of(scenes).into_scene()
}

/// In what two cameras differ, in words for the user. Near planes may: nearness does not depend on them.
fn camera_difference(one: &Camera, other: &Camera) -> Option<String> {
    let near = one.near;
    if *one == (Camera { near, ..*other }) {
        return None;
    }
    let place = |camera: &Camera| camera.eye_from_world.inverse().w_axis.truncate();
    let forward = |camera: &Camera| camera.eye_from_world.row(2).truncate();
    let up = |camera: &Camera| -camera.eye_from_world.row(1).truncate();
    let words = |what: &str, a: &dyn std::fmt::Display, b: &dyn std::fmt::Display| {
        Some(format!("{what} {b} instead of {a}"))
    };
    if place(one) != place(other) {
        return words("its eye stands at", &place(one), &place(other));
    }
    if forward(one) != forward(other) {
        return words("it looks towards", &forward(one), &forward(other));
    }
    if one.eye_from_world != other.eye_from_world {
        return words("upwards in it is", &up(one), &up(other));
    }
    match (one.projection, other.projection) {
        (
            Projection::Perspective {
                tan_half_height: a, ..
            },
            Projection::Perspective {
                tan_half_height: b, ..
            },
        ) if a != b => {
            let degrees = |tan: f64| format!("{}deg", 2.0 * tan.atan().to_degrees());
            return words("its field of view is", &degrees(a), &degrees(b));
        }
        (Projection::Parallel { height: a, .. }, Projection::Parallel { height: b, .. })
            if a != b =>
        {
            return words("its frame has a height of", &a, &b);
        }
        (Projection::Perspective { .. }, Projection::Parallel { .. })
        | (Projection::Parallel { .. }, Projection::Perspective { .. }) => {
            return Some("one projects in parallel, the other in perspective".into());
        }
        _ => {}
    }
    if one.aspect() != other.aspect() {
        let (a, b) = (one.aspect(), other.aspect());
        return words("width over height of its frame are", &a, &b);
    }
    words("its lens is shifted by", &one.shift, &other.shift)
}

fn world_difference(one: &World, other: &World) -> Option<String> {
    let crs = |world: &World| world.crs.clone().unwrap_or_else(|| "none".into());
    if one.crs.is_some() && other.crs.is_some() && one.crs != other.crs {
        let (a, b) = (crs(one), crs(other));
        return Some(format!("its coordinate system is {b} instead of {a}"));
    }
    (one.origin != other.origin).then(|| {
        format!(
            "its origin is at {} instead of {}",
            other.origin, one.origin
        )
    })
}

/// Several scenes as one.
pub(super) struct UnitedScenes<'a> {
    /// Without meshes.
    scene: Scene,
    /// Those of its objects.
    meshes: Vec<ObjectMesh<'a>>,
    /// Of each of the scenes, the new numbers of its objects.
    objects: Vec<Vec<ObjectId>>,
}

impl<'a> UnitedScenes<'a> {
    pub fn of(scenes: &[&'a Scene]) -> Self {
        let placed = scenes.iter().find(|scene| scene.world.crs.is_some());
        let mut united = Scene {
            world: placed
                .or(scenes.first())
                .map_or_else(World::default, |scene| scene.world.clone()),
            ..Scene::default()
        };
        let mut order: Vec<(ObjectKey, usize, ObjectId)> = Vec::new();
        for (number, scene) in scenes.iter().enumerate() {
            let objects = (0..scene.objects.len()).map(ObjectId::from_index);
            order.extend(objects.map(|object| (scene.key_of(object), number, object)));
        }
        order.sort_unstable();
        let has_layers = scenes.iter().any(|scene| !scene.layers.is_empty());
        let mut objects: Vec<Vec<ObjectId>> = scenes
            .iter()
            .map(|scene| vec![ObjectId(0); scene.objects.len()])
            .collect();
        let first_material: Vec<u32> = scenes
            .iter()
            .map(|scene| add_materials(&mut united, &scene.materials, &scene.images))
            .collect();
        let mut meshes: Vec<ObjectMesh> = Vec::with_capacity(order.len());
        for &((Reverse(priority), layer, _), number, object) in &order {
            let id = ObjectId::from_index(united.objects.len());
            objects[number][object.index()] = id;
            let from = scenes[number];
            meshes.push(ObjectMesh {
                mesh: from.mesh_of(object),
                first_material: first_material[number],
            });
            united.objects.push(Object {
                mesh: MeshId(id.0),
                ..from.object(object).clone()
            });
            if has_layers {
                let shown = from.shown(object);
                let row = (layer, priority, shown);
                match united.layers.last_mut() {
                    Some(last) if (&*last.name, last.priority, last.shown) == row => {
                        last.objects.end = id.0 + 1;
                    }
                    _ => united.layers.push(Layer {
                        name: layer.into(),
                        priority,
                        shown,
                        objects: id.0..id.0 + 1,
                    }),
                }
            }
        }
        for light in scenes.iter().flat_map(|scene| &scene.lights) {
            if !united.lights.contains(light) {
                united.lights.push(light.clone());
            }
        }
        Self {
            scene: united,
            meshes,
            objects,
        }
    }

    /// The scene with its meshes. Objects that shared one go on to do so.
    pub fn into_scene(self) -> Scene {
        let mut scene = self.scene;
        let mut known: HashMap<*const Mesh, MeshId> = HashMap::new();
        for (object, of) in scene.objects.iter_mut().zip(&self.meshes) {
            object.mesh = *known.entry(std::ptr::from_ref(of.mesh)).or_insert_with(|| {
                let mut mesh = of.mesh.clone();
                for (_, material) in &mut mesh.materials {
                    *material = MaterialId(material.0 + of.first_material);
                }
                scene.meshes.push(mesh);
                MeshId(scene.meshes.len() as u32 - 1)
            });
        }
        scene
    }

    /// The faces of all scenes as one table in the order of the objects, and of each scene the new
    /// numbers of its faces.
    pub fn faces(&self, tables: &[&Faces]) -> (Faces, Vec<Vec<FaceId>>) {
        // Faces of an object follow one another in its table.
        let mut runs: Vec<(ObjectId, usize, Range<u32>)> = Vec::new();
        for (map, table) in tables.iter().enumerate() {
            for face in table.ids() {
                let object = self.objects[map][table.object(face).index()];
                match runs.last_mut() {
                    Some(run) if run.0 == object && run.1 == map => run.2.end += 1,
                    _ => runs.push((object, map, face.0..face.0 + 1)),
                }
            }
        }
        runs.sort_by_key(|run| run.0);
        let count = tables.iter().map(|table| table.len()).sum();
        let mut faces = Faces::with_capacity(count);
        let mut new_ids: Vec<Vec<FaceId>> = tables
            .iter()
            .map(|table| vec![FaceId(0); table.len()])
            .collect();
        let mut first_plane = Vec::with_capacity(tables.len());
        for table in tables {
            first_plane.push(faces.planes().len() as u32);
            for &plane in table.planes() {
                faces.push_plane(plane);
            }
        }
        for (object, map, run) in runs {
            let table = tables[map];
            for face in run.map(FaceId) {
                let plane = PlaneId(table.plane(face).0 + first_plane[map]);
                let source = table.source(face);
                new_ids[map][face.index()] = faces.push_row(table, face, plane, object, source);
            }
        }
        (faces, new_ids)
    }

    /// Gives faces of different maps that meet in one plane that plane.
    fn share_planes(&self, faces: &mut Faces, meeting: &mut Meeting) {
        let objects = self.scene.objects.iter();
        let placed: Vec<(&Mesh, DMat4)> = objects
            .zip(&self.meshes)
            .map(|(object, of)| (of.mesh, object.world_from_object))
            .collect();
        let index_of = |faces: &Faces, face: FaceId| (faces.object(face).0, faces.source(face));
        let candidates: Vec<(FaceId, (FaceIndex, u32))> = meeting
            .faces()
            .into_iter()
            .map(|(face, map)| (face, (index_of(faces, face), map)))
            .collect();
        let indices: Vec<(FaceIndex, u32)> = candidates.iter().map(|pair| pair.1).collect();
        let groups = PlaneGroups::among_maps(&placed, &indices);
        let id_of = |index: FaceIndex| {
            let row = candidates.partition_point(|&(_, (other, _))| other < index);
            candidates[row].0
        };
        for &(face, first) in groups.pairs() {
            let face = id_of(face);
            faces.share_plane(face, id_of(first));
            meeting.plane_changed(faces, face);
        }
    }
}

/// Adds to a scene materials of another with their images; the number that the first of them has now.
fn add_materials(scene: &mut Scene, materials: &[Material], images: &[Image]) -> u32 {
    let first = scene.materials.len() as u32;
    let first_image = scene.images.len() as u32;
    scene.images.extend_from_slice(images);
    for material in materials {
        let mut material = material.clone();
        let textures = [
            &mut material.base_color_texture,
            &mut material.emissive_texture,
        ];
        for texture in textures.into_iter().flatten() {
            texture.image = ImageId(texture.image.0 + first_image);
        }
        scene.materials.push(material);
    }
    first
}
