//! Rows of tiles -> what is seen: each face once, numbered anew, with the vertices that its mesh needs.

use super::FileError;
use super::manifest::Manifest;
use super::rows::{FaceRows, FragmentRows, VertexRow};
use super::tables::TableName;
use crate::scene::{Mesh, Scene};
use crate::{
    FaceId, Faces, Fragments, MaterialId, ObjectId, PlaneId, SeenScene, Side, VisibilityMap,
};
use veduta_geometry::Affine;

/// Rows of the tiles that were read.
#[derive(Default)]
pub struct SeenRows {
    pub faces: FaceRows,
    pub vertices: Vec<VertexRow>,
    pub opaque: FragmentRows,
    pub veils: FragmentRows,
}

impl SeenRows {
    /// Puts them together with a scene that has no meshes yet.
    ///
    /// # Errors
    /// [`FileError::Unsound`] where they do not fit together.
    pub fn into_seen(
        mut self,
        mut scene: Scene,
        manifest: &Manifest,
    ) -> Result<SeenScene, FileError> {
        // A face stands in each tile that names it, and its vertices with it.
        self.faces.tidy();
        self.vertices.sort_by_key(|row| (row.object, row.vertex));
        self.vertices.dedup();
        let faces = TableName::Faces.member();
        let twice = |what: &str, number: u32| {
            FileError::unsound(faces, format!("{what} {number} is told twice, differently"))
        };
        let rows = &self.faces.rows;
        if let Some(pair) = rows.windows(2).find(|pair| pair[0].face == pair[1].face) {
            return Err(twice("face", pair[0].face));
        }
        let count = rows.len();
        if manifest.sub_scanlines.is_some()
            && let Some(last) = rows.last()
            && last.face as usize + 1 != count
        {
            let what = format!("{count} faces, but the last is {}", last.face);
            return Err(FileError::unsound(faces, what));
        }
        let key = |row: &VertexRow| (row.object, row.vertex);
        if let Some(pair) = self
            .vertices
            .windows(2)
            .find(|pair| key(&pair[0]) == key(&pair[1]))
        {
            return Err(twice("vertex", pair[0].vertex));
        }

        scene.meshes = vec![Mesh::default(); scene.objects.len()];
        for row in &self.vertices {
            let mesh = scene.meshes.get_mut(row.object as usize);
            if !mesh.is_some_and(|mesh| row.at.push_to(mesh)) {
                let what = format!(
                    "vertex {} of object {} does not fit",
                    row.vertex, row.object
                );
                return Err(FileError::unsound(TableName::Vertices.member(), what));
            }
        }
        let table = self.face_table(&mut scene)?;
        for mesh in scene.meshes.iter().filter(|mesh| mesh.face_count() > 0) {
            let sound = mesh.check();
            sound.map_err(|error| FileError::unsound(faces, error.to_string()))?;
        }
        let numbers: Vec<u32> = self.faces.rows.iter().map(|row| row.face).collect();
        let new_id = |face: u32| place_of(face, &numbers, |&face| face).map(FaceId::from_index);
        Ok(SeenScene {
            map: VisibilityMap {
                camera: manifest.camera,
                opaque: fragments(self.opaque, TableName::Opaque, &table, false, new_id)?,
                veils: fragments(self.veils, TableName::Veils, &table, true, new_id)?,
                faces: table,
            },
            scene,
            size: manifest.size,
            has_holes: manifest.has_holes,
            guests: Vec::new(),
        })
    }

    /// The faces in their order, numbered anew; they are added to the meshes of their objects.
    fn face_table(&self, scene: &mut Scene) -> Result<Faces, FileError> {
        let unsound = |what: String| FileError::unsound(TableName::Faces.member(), what);
        let rows = &self.faces.rows;
        let mut table = Faces::with_capacity(rows.len());
        let mut planes: Vec<(u32, Affine)> =
            rows.iter().map(|row| (row.plane, row.nearness)).collect();
        planes.sort_by_key(|&(plane, _)| plane);
        planes.dedup();
        if let Some(pair) = planes.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let what = format!("plane {} is told twice, differently", pair[0].0);
            return Err(unsound(what));
        }
        let ids: Vec<PlaneId> = planes
            .iter()
            .map(|&(_, nearness)| table.push_plane(nearness))
            .collect();
        // Vertices ascend, and those of the faces at hand were read with them.
        let mut of_objects: Vec<&[VertexRow]> = vec![&[]; scene.objects.len()];
        for rows in self.vertices.chunk_by(|a, b| a.object == b.object) {
            of_objects[rows[0].object as usize] = rows;
        }
        let mut corners = Vec::new();
        for row in rows {
            let misfit = |what: &str| unsound(format!("face {}: {what}", row.face));
            if row.material as usize >= scene.materials.len() {
                return Err(misfit("its material is not there"));
            }
            let mesh = scene.meshes.get_mut(row.object as usize);
            let mesh = mesh.ok_or_else(|| misfit("its object is not there"))?;
            let vertices = of_objects[row.object as usize];
            let corner = |&vertex: &u32| {
                let place = place_of(vertex, vertices, |row| row.vertex);
                place.map(|index| index as u32)
            };
            corners.clear();
            for number in self.faces.corners.of(&row.corners) {
                let corner = corner(number);
                corners.push(corner.ok_or_else(|| misfit("its corners are not there"))?);
            }
            let source = mesh.face_count() as u32;
            mesh.push_fan(&corners);
            let material = MaterialId(row.material);
            if mesh.materials.last().is_none_or(|last| last.1 != material) {
                mesh.materials.push((source, material));
            }
            let outline = self.faces.outlines.of(&row.outline);
            if outline.len() < 3 {
                return Err(misfit("its outline is not a polygon"));
            }
            // The table would turn it, and its sides would be others.
            let area = veduta_geometry::signed_area(outline);
            if area.is_nan() || area <= 0.0 {
                return Err(misfit("its outline has no area or is not wound clockwise"));
            }
            let object = ObjectId(row.object);
            let plane = place_of(row.plane, &planes, |&(plane, _)| plane);
            let plane = ids[plane.expect("planes of all faces")];
            let id = table.push(outline, plane, object, source);
            let id = id.ok_or_else(|| misfit("its outline has no area"))?;
            if !row.opaque {
                table.set_veil(id);
            }
        }
        Ok(table)
    }
}

/// Where in rows, whose numbers ascend, one with this number stands. In what is read as a whole that is its number.
fn place_of<T>(number: u32, rows: &[T], number_of: impl Fn(&T) -> u32) -> Option<usize> {
    let there = number as usize;
    match rows.get(there).is_some_and(|row| number_of(row) == number) {
        true => Some(there),
        false => rows.binary_search_by_key(&number, number_of).ok(),
    }
}

/// Fragments in the order of their faces.
fn fragments(
    mut found: FragmentRows,
    name: TableName,
    faces: &Faces,
    veils: bool,
    new_id: impl Fn(u32) -> Option<FaceId>,
) -> Result<Fragments, FileError> {
    let unsound = |what: String| FileError::unsound(name.member(), what);
    // All fragments of a face stand in one tile, in order.
    found.rows.sort_by_key(|row| row.face);
    let mut fragments = Fragments::new();
    let mut cut = Vec::new();
    let mut last: Option<(FaceId, bool)> = None;
    for row in &found.rows {
        let missing = || unsound(format!("face {} is not there", row.face));
        let face = new_id(row.face).ok_or_else(missing)?;
        if faces.is_veil(face) != veils {
            return Err(unsound(format!(
                "face {} belongs to the other table",
                row.face
            )));
        }
        let whole = row.corners.is_empty();
        if last.is_some_and(|(before, was_whole)| before == face && (whole || was_whole)) {
            return Err(unsound(format!(
                "face {} is seen whole and again",
                row.face
            )));
        }
        last = Some((face, whole));
        if whole {
            fragments.push_whole(face);
            continue;
        }
        cut.clear();
        for &(vertex, side) in found.corners.of(&row.corners) {
            let cutter = new_id(side.face.0).ok_or_else(missing)?;
            let is_kind =
                side.kind >= Side::SCAN || (side.kind as usize) < faces.outline(cutter).len();
            if !is_kind {
                return Err(unsound(format!(
                    "face {} has no side {}",
                    side.face.0, side.kind
                )));
            }
            let side = Side {
                face: cutter,
                ..side
            };
            cut.push((vertex, side));
        }
        fragments.push_cut(face, cut.iter().copied());
    }
    Ok(fragments)
}
