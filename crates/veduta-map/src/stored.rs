use crate::scene::{ImageId, Layer, Material, Mesh, MeshId, Object, Scene, TextureRef};
use crate::{FaceId, Faces, Fragment, Fragments, MaterialId, ObjectId, Side, VisibilityMap};
use std::collections::{BTreeMap, BTreeSet};

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
}

impl SeenScene {
    /// What `map` shows of `scene`, in normal form.
    ///
    /// # Panics
    /// If `map` is not a map of `scene`.
    pub fn of(scene: &Scene, map: &VisibilityMap, size: [u32; 2]) -> Self {
        let faces = faces_named(map);
        let new_id = |face: FaceId| FaceId::from_index(faces.partition_point(|&f| f < face));
        let mut meshes = SeenMeshes::new(scene, &map.faces, &faces);
        Self {
            map: VisibilityMap {
                camera: map.camera,
                faces: meshes.renumber(&map.faces, &faces),
                opaque: map.opaque.renumbered(new_id),
                veils: map.veils.renumbered(new_id),
            },
            scene: meshes.into_scene(scene),
            size,
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
    /// is: what they hide is not known.
    pub fn selected(&self, wanted: impl Fn(&str) -> bool) -> Self {
        let is_wanted: Vec<bool> = self.scene.objects.iter().map(|o| wanted(&o.name)).collect();
        let faces = &self.map.faces;
        let keep = |face: FaceId| is_wanted[faces.object(face).index()];
        let map = VisibilityMap {
            opaque: self.map.opaque.selected(keep),
            veils: self.map.veils.selected(keep),
            ..self.map.clone()
        };
        Self::of(&self.scene, &map, self.size)
    }
}

impl Fragments {
    /// The fragments of the faces that `wanted` accepts.
    pub fn selected(&self, wanted: impl Fn(FaceId) -> bool) -> Self {
        let mut selected = Self::new();
        for fragment in self.iter().filter(|fragment| wanted(fragment.face())) {
            match fragment {
                Fragment::Whole(face) => selected.push_whole(face),
                Fragment::Cut {
                    face,
                    vertices,
                    sides,
                } => selected.push_cut(face, vertices.iter().copied().zip(sides.iter().copied())),
            }
        }
        selected
    }

    /// The same fragments of faces with other numbers, in their order.
    pub fn renumbered(&self, new_id: impl Fn(FaceId) -> FaceId) -> Self {
        let mut order: Vec<usize> = (0..self.len()).collect();
        // Stable: the fragments of a face stay in order.
        order.sort_by_key(|&index| new_id(self.face(index)));
        let mut renumbered = Self::new();
        for index in order {
            match self.get(index) {
                Fragment::Whole(face) => renumbered.push_whole(new_id(face)),
                Fragment::Cut {
                    face,
                    vertices,
                    sides,
                } => {
                    let side = |side: &Side| Side {
                        face: new_id(side.face),
                        ..*side
                    };
                    let corners = vertices.iter().copied().zip(sides.iter().map(side));
                    renumbered.push_cut(new_id(face), corners);
                }
            }
        }
        renumbered
    }
}

/// What is seen of each object.
struct SeenMeshes {
    /// Of each seen object, its faces (rows of its mesh), ascending.
    faces: BTreeMap<ObjectId, Vec<u32>>,
    meshes: Vec<Mesh>,
    materials: Vec<MaterialId>,
}

impl SeenMeshes {
    fn new(scene: &Scene, table: &Faces, seen: &[FaceId]) -> Self {
        let mut faces: BTreeMap<ObjectId, Vec<u32>> = BTreeMap::new();
        for &face in seen {
            faces
                .entry(table.object(face))
                .or_default()
                .push(table.source(face));
        }
        for sources in faces.values_mut() {
            sources.sort_unstable();
            sources.dedup();
        }
        let mut meshes: Vec<Mesh> = faces
            .iter()
            .map(|(&object, sources)| scene.mesh_of(object).selected(sources))
            .collect();
        let materials: BTreeSet<MaterialId> = meshes
            .iter()
            .flat_map(|mesh| mesh.materials.iter().map(|range| range.1))
            .collect();
        let materials: Vec<MaterialId> = materials.into_iter().collect();
        for mesh in &mut meshes {
            for (_, material) in &mut mesh.materials {
                *material = MaterialId::from_index(row_of(&materials, *material));
            }
        }
        Self {
            faces,
            meshes,
            materials,
        }
    }

    /// The rows `seen` of a table of faces, with objects, sources and planes as they are numbered now.
    fn renumber(&mut self, table: &Faces, seen: &[FaceId]) -> Faces {
        let objects: Vec<ObjectId> = self.faces.keys().copied().collect();
        let planes: BTreeSet<_> = seen.iter().map(|&face| table.plane(face)).collect();
        let planes: Vec<_> = planes.into_iter().collect();
        let mut faces = Faces::with_capacity(seen.len());
        let new_planes: Vec<_> = planes
            .iter()
            .map(|&plane| faces.push_plane(*table.nearness(plane)))
            .collect();
        for &face in seen {
            let object = table.object(face);
            let source = row_of(&self.faces[&object], table.source(face)) as u32;
            let plane = new_planes[row_of(&planes, table.plane(face))];
            let object = ObjectId::from_index(row_of(&objects, object));
            let id = faces
                .push(table.outline(face), plane, object, source)
                .expect("a face of a table has an area");
            if table.is_veil(face) {
                faces.set_veil(id);
            }
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
        let seen: Vec<ObjectId> = self.faces.keys().copied().collect();
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
        let mut selected = Self::default();
        let mut new_row = vec![None; self.positions.len()];
        let mut rows = Vec::new();
        for &face in faces {
            let corners: Vec<u32> = self
                .corners_of(face)
                .map(|vertex| {
                    *new_row[vertex as usize].get_or_insert_with(|| {
                        rows.push(vertex as usize);
                        rows.len() as u32 - 1
                    })
                })
                .collect();
            selected.push_fan(&corners);
            let material = self.material_of(face);
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
