use crate::scene::{ImageId, Layer, Material, Mesh, MeshId, Object, Scene, TextureRef};
use crate::{
    Camera, FaceId, Faces, Fragment, Fragments, Guest, MaterialId, ObjectId, PlaneId, Side,
    VisibilityMap,
};
use std::collections::BTreeSet;

/// A visibility map together with what is seen of its scene: all that pictures are made of.
///
/// Normal form, made by [`SeenScene::of`] and kept by files:
///
/// - the faces of the map are those that fragments are of or name along their sides, and its planes
///   those of its faces;
/// - each object has a mesh of its own with the same index, in which its faces stand in the order of
///   the map, without vertices that no face has;
/// - materials and images are those in use; there are no cameras beside the map's.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenScene {
    /// What is seen where.
    pub map: VisibilityMap,
    /// What is seen.
    pub scene: Scene,
    /// Width and height in pixels of the picture it was made for. A map has no resolution; this is what
    /// users expect who do not ask for another size.
    pub size: [u32; 2],
    /// Whether something was cut out of the map or left out of it. Without holes, where a face is unseen
    /// something nearer hides it; with them, only the fragments tell where a face is.
    pub has_holes: bool,
    /// Pictures of other programs that are seen with it, ordered by depth when pixels are made.
    pub guests: Vec<Guest>,
}

/// The mesh of an object, wherever it is kept.
#[derive(Clone, Copy, Debug)]
pub struct ObjectMesh<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// What is to be added to the numbers of its materials.
    pub first_material: u32,
}

impl SeenScene {
    /// Nothing, seen through `camera`: what guests of no map are in.
    pub fn of_nothing(camera: Camera, size: [u32; 2]) -> Self {
        Self {
            map: VisibilityMap {
                camera,
                faces: Faces::new(),
                opaque: Fragments::new(),
                veils: Fragments::new(),
            },
            scene: Scene::default(),
            size,
            has_holes: false,
            guests: Vec::new(),
        }
    }

    /// What `map`, which has no holes, shows of `scene`, in normal form. There are no guests.
    ///
    /// # Panics
    /// If `map` is not a map of `scene`.
    pub fn of(scene: &Scene, map: &VisibilityMap, size: [u32; 2]) -> Self {
        let objects = (0..scene.objects.len()).map(ObjectId::from_index);
        let meshes: Vec<ObjectMesh> = objects
            .map(|object| ObjectMesh {
                mesh: scene.mesh_of(object),
                first_material: 0,
            })
            .collect();
        Self::of_meshes(scene, &meshes, map, size)
    }

    /// [`SeenScene::of`] a scene whose meshes are kept elsewhere: `meshes` are those of its objects. So
    /// scenes can be put together without copies of all that is in them.
    ///
    /// # Panics
    /// If `map` is not a map of `scene`.
    pub fn of_meshes(
        scene: &Scene,
        meshes: &[ObjectMesh],
        map: &VisibilityMap,
        size: [u32; 2],
    ) -> Self {
        let faces = faces_named(map);
        let mut new_ids = vec![FaceId(u32::MAX); map.faces.len()];
        for (&face, index) in faces.iter().zip(0..) {
            new_ids[face.index()] = FaceId(index);
        }
        let new_id = |face: FaceId| new_ids[face.index()];
        let seen = SeenMeshes::new(meshes, &map.faces, &faces);
        Self {
            map: VisibilityMap {
                camera: map.camera,
                faces: seen.renumber(&map.faces, &faces),
                opaque: map.opaque.renumbered(new_id),
                veils: map.veils.renumbered(new_id),
            },
            scene: seen.into_scene(scene),
            size,
            has_holes: false,
            guests: Vec::new(),
        }
    }
}

/// The faces that fragments are of or name, ascending.
fn faces_named(map: &VisibilityMap) -> Vec<FaceId> {
    let mut is_named = vec![false; map.faces.len()];
    for fragment in map.opaque.iter().chain(map.veils.iter()) {
        is_named[fragment.face().index()] = true;
        if let Fragment::Cut { sides, .. } = fragment {
            sides
                .iter()
                .for_each(|side| is_named[side.face.index()] = true);
        }
    }
    let named = map.faces.ids().filter(|face| is_named[face.index()]);
    named.collect()
}

impl SeenScene {
    /// What is seen of the objects that `wanted` accepts by their names. Where others were seen nothing
    /// is: what they hide is not known. Guests stay.
    pub fn selected(&self, wanted: impl Fn(&str) -> bool) -> Self {
        let is_wanted: Vec<bool> = self.scene.objects.iter().map(|o| wanted(&o.name)).collect();
        let faces = &self.map.faces;
        let keep = |face: FaceId| is_wanted[faces.object(face).index()];
        let map = VisibilityMap {
            opaque: self.map.opaque.selected(keep),
            veils: self.map.veils.selected(keep),
            ..self.map.clone()
        };
        Self {
            has_holes: self.has_holes || is_wanted.contains(&false),
            guests: self
                .guests
                .iter()
                .map(|guest| guest.selected(&wanted))
                .collect(),
            ..Self::of(&self.scene, &map, self.size)
        }
    }
}

impl Fragments {
    /// The fragments of the faces that `wanted` accepts.
    pub fn selected(&self, wanted: impl Fn(FaceId) -> bool) -> Self {
        let mut selected = Self::new();
        let wanted = self.iter().filter(|fragment| wanted(fragment.face()));
        wanted.for_each(|fragment| selected.push(fragment));
        selected
    }

    /// These fragments and others, of other faces.
    pub fn with(&self, other: &Self) -> Self {
        let mut order: Vec<(FaceId, &Self, usize)> = Vec::with_capacity(self.len() + other.len());
        for of in [self, other] {
            order.extend((0..of.len()).map(|index| (of.face(index), of, index)));
        }
        // Stable: the fragments of a face stay in order.
        order.sort_by_key(|row| row.0);
        let mut both = Self::new();
        for (_, of, index) in order {
            both.push(of.get(index));
        }
        both
    }

    /// Adds a fragment of a face that is not before the last one's.
    fn push(&mut self, fragment: Fragment) {
        match fragment {
            Fragment::Whole(face) => self.push_whole(face),
            Fragment::Cut {
                face,
                vertices,
                sides,
            } => self.push_cut(face, vertices.iter().copied().zip(sides.iter().copied())),
        }
    }

    /// The same fragments of faces with other numbers, in their order.
    pub fn renumbered(&self, new_id: impl Fn(FaceId) -> FaceId) -> Self {
        let (entries, vertices, sides) = self.columns();
        let entries: Vec<(FaceId, u32)> = entries
            .iter()
            .map(|&(face, first)| (new_id(face), first))
            .collect();
        let sides = sides.iter().map(|side| Side {
            face: new_id(side.face),
            ..*side
        });
        let sides: Vec<Side> = sides.collect();
        // Most renumberings only close gaps.
        if entries.is_sorted_by_key(|entry| entry.0) {
            return Self::from_columns(entries, vertices.to_vec(), sides);
        }
        let mut order: Vec<usize> = (0..entries.len()).collect();
        // Stable: the fragments of a face stay in order.
        order.sort_by_key(|&index| entries[index].0);
        let mut renumbered = Self::new();
        for index in order {
            let (face, start) = entries[index];
            let end = entries
                .get(index + 1)
                .map_or(vertices.len(), |next| next.1 as usize);
            let corners = start as usize..end;
            if corners.is_empty() {
                renumbered.push_whole(face);
            } else {
                let points = vertices[corners.clone()].iter().copied();
                renumbered.push_cut(face, points.zip(sides[corners].iter().copied()));
            }
        }
        renumbered
    }
}

/// What is seen of each object.
struct SeenMeshes {
    /// The seen objects, ascending.
    objects: Vec<ObjectId>,
    /// Of each of them, its seen faces (rows of its mesh), ascending.
    faces: Vec<Vec<u32>>,
    meshes: Vec<Mesh>,
    materials: Vec<MaterialId>,
}

impl SeenMeshes {
    fn new(meshes: &[ObjectMesh], table: &Faces, seen: &[FaceId]) -> Self {
        let mut faces: Vec<Vec<u32>> = vec![Vec::new(); meshes.len()];
        for &face in seen {
            faces[table.object(face).index()].push(table.source(face));
        }
        let objects: Vec<ObjectId> = (0..meshes.len())
            .filter(|&object| !faces[object].is_empty())
            .map(ObjectId::from_index)
            .collect();
        faces.retain_mut(|faces| {
            faces.sort_unstable();
            faces.dedup();
            !faces.is_empty()
        });
        let mut selected: Vec<Mesh> = Vec::with_capacity(objects.len());
        for (object, faces) in objects.iter().zip(&faces) {
            let ObjectMesh {
                mesh,
                first_material,
            } = meshes[object.index()];
            let mut mesh = mesh.selected(faces);
            for (_, material) in &mut mesh.materials {
                material.0 += first_material;
            }
            selected.push(mesh);
        }
        let materials: BTreeSet<MaterialId> = selected
            .iter()
            .flat_map(|mesh| mesh.materials.iter().map(|range| range.1))
            .collect();
        let materials: Vec<MaterialId> = materials.into_iter().collect();
        for mesh in &mut selected {
            for (_, material) in &mut mesh.materials {
                *material = MaterialId::from_index(row_of(&materials, *material));
            }
        }
        Self {
            objects,
            faces,
            meshes: selected,
            materials,
        }
    }

    /// The rows `seen` of a table of faces, with objects, sources and planes as they are numbered now.
    fn renumber(&self, table: &Faces, seen: &[FaceId]) -> Faces {
        let mut is_named = vec![false; table.planes().len()];
        for &face in seen {
            is_named[table.plane(face).index()] = true;
        }
        let mut faces = Faces::with_capacity(seen.len());
        let mut new_planes = vec![PlaneId(u32::MAX); is_named.len()];
        for (new, (&nearness, is_named)) in new_planes
            .iter_mut()
            .zip(table.planes().iter().zip(is_named))
        {
            if is_named {
                *new = faces.push_plane(nearness);
            }
        }
        // Faces mostly follow one another in their mesh too.
        let mut expected = vec![0; self.objects.len()];
        for &face in seen {
            let object = row_of(&self.objects, table.object(face));
            let (of_object, source) = (&self.faces[object], table.source(face));
            if of_object.get(expected[object]) != Some(&source) {
                expected[object] = row_of(of_object, source);
            }
            let new_source = expected[object] as u32;
            expected[object] += 1;
            let plane = new_planes[table.plane(face).index()];
            faces.push_row(table, face, plane, ObjectId::from_index(object), new_source);
        }
        faces
    }

    fn into_scene(self, scene: &Scene) -> Scene {
        let mut materials: Vec<Material> = self
            .materials
            .iter()
            .map(|&id| scene.material(id).clone())
            .collect();
        let images: BTreeSet<ImageId> = materials
            .iter()
            .flat_map(|material| [material.base_color_texture, material.emissive_texture])
            .flatten()
            .map(|texture| texture.image)
            .collect();
        let images: Vec<ImageId> = images.into_iter().collect();
        for material in &mut materials {
            let textures = [
                &mut material.base_color_texture,
                &mut material.emissive_texture,
            ];
            for TextureRef { image, .. } in textures.into_iter().flatten() {
                *image = ImageId(row_of(&images, *image) as u32);
            }
        }
        let seen = self.objects;
        let before = |object: u32| seen.partition_point(|seen| seen.0 < object) as u32;
        Scene {
            objects: seen
                .iter()
                .zip(0..)
                .map(|(&object, mesh)| Object {
                    mesh: MeshId(mesh),
                    ..scene.object(object).clone()
                })
                .collect(),
            meshes: self.meshes,
            materials,
            images: images
                .iter()
                .map(|image| scene.images[image.0 as usize].clone())
                .collect(),
            cameras: Vec::new(),
            lights: scene.lights.clone(),
            layers: scene
                .layers
                .iter()
                .map(|layer| Layer {
                    objects: before(layer.objects.start)..before(layer.objects.end),
                    ..layer.clone()
                })
                .collect(),
            world: scene.world.clone(),
        }
    }
}

/// The row of a value that an ascending list has.
fn row_of<T: Ord>(list: &[T], value: T) -> usize {
    list.partition_point(|other| *other < value)
}

impl Mesh {
    /// The faces of these rows, ascending, with the vertices that they have, in the order in which they
    /// first have them.
    pub fn selected(&self, faces: &[u32]) -> Self {
        const UNSEEN: u32 = u32::MAX;
        let mut selected = Self::default();
        selected.triangles.reserve(faces.len());
        let mut new_row = vec![UNSEEN; self.positions.len()];
        let mut rows = Vec::new();
        let mut corners = Vec::new();
        let mut range = 0;
        for &face in faces {
            corners.clear();
            corners.extend(self.corners_of(face).map(|vertex| {
                let new_row = &mut new_row[vertex as usize];
                if *new_row == UNSEEN {
                    *new_row = rows.len() as u32;
                    rows.push(vertex as usize);
                }
                *new_row
            }));
            selected.push_fan(&corners);
            while self
                .materials
                .get(range + 1)
                .is_some_and(|next| next.0 <= face)
            {
                range += 1;
            }
            let material = self.materials[range].1;
            if selected
                .materials
                .last()
                .is_none_or(|last| last.1 != material)
            {
                let face = selected.face_count() as u32 - 1;
                selected.materials.push((face, material));
            }
        }
        fn of_rows<T: Copy>(table: &[T], rows: &[usize]) -> Vec<T> {
            if table.is_empty() {
                return Vec::new();
            }
            rows.iter().map(|&row| table[row]).collect()
        }
        selected.positions = of_rows(&self.positions, &rows);
        selected.normals = of_rows(&self.normals, &rows);
        selected.texcoords = of_rows(&self.texcoords, &rows);
        selected.second_texcoords = of_rows(&self.second_texcoords, &rows);
        selected.colors = of_rows(&self.colors, &rows);
        selected.opacities = of_rows(&self.opacities, &rows);
        selected
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta_geometry::DVec2;

    #[test]
    fn renumbered_fragments_stand_in_the_order_of_their_new_faces() {
        let corner = |k: u32, face: u32| {
            let point = DVec2::new(f64::from(k), f64::from(face));
            (point, Side::crossing(FaceId(face)))
        };
        let cut = |face: u32| (0..3).map(move |k| corner(k, face));
        let mut fragments = Fragments::new();
        fragments.push_cut(FaceId(0), cut(2).collect::<Vec<_>>().into_iter());
        fragments.push_cut(FaceId(0), cut(1).collect::<Vec<_>>().into_iter());
        fragments.push_whole(FaceId(1));
        let found = fragments.renumbered(|face| FaceId(9 - face.0));
        let mut expected = Fragments::new();
        expected.push_whole(FaceId(8));
        for face in [2, 1] {
            let corners = cut(face).map(|(point, _)| (point, Side::crossing(FaceId(9 - face))));
            expected.push_cut(FaceId(9), corners.collect::<Vec<_>>().into_iter());
        }
        assert_eq!(found, expected);
        // Numbers that only close gaps keep the order.
        let same = fragments.renumbered(|face| face);
        assert_eq!(same, fragments);
    }
}
