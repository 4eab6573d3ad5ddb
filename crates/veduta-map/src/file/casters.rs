//! The casters of a map, as tables of their own: a whole scene, mesh by mesh, which only those read who
//! ask for it.
//!
//! Rows of all meshes follow one another in batches of bounded size, so that neither a scene of many
//! small meshes nor one of a large one needs more memory than a batch beside the scene itself. Images
//! that are seen too are not stored twice.

use super::FileError;
use super::manifest::{CastersTold, EmbeddedScene};
use super::read::MapReader;
use super::rows::{Rows, Vertex};
use super::tables::{self, ListColumn, TableName};
use super::write::TableWriter;
use crate::Casters;
use crate::MaterialId;
use crate::scene::{Image, Mesh, MeshId, Object, Scene};
use arrow_array::{ArrayRef, BooleanArray, RecordBatch};
use arrow_schema::{DataType, Field, Schema};
use std::collections::HashMap;
use std::io::{Read, Seek, Write};
use std::ops::Range;
use std::sync::Arc;

/// A member that holds a table of casters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CasterTable {
    /// Meshes: how many rows of the next two are theirs, and the materials of their faces.
    Meshes,
    /// Vertices of all meshes.
    Vertices,
    /// Triangles of all meshes.
    Triangles,
    /// Objects.
    Objects,
    /// Images that are not among those of what is seen, each a batch.
    Images,
}

use CasterTable::{Images, Meshes, Objects, Triangles, Vertices};

/// Rows of a batch.
const ROWS_PER_BATCH: usize = 1 << 16;

impl CasterTable {
    const ALL: [Self; 5] = [Meshes, Vertices, Triangles, Objects, Images];

    fn member(self) -> &'static str {
        match self {
            Meshes => "caster-meshes.arrow",
            Vertices => "caster-vertices.arrow",
            Triangles => "caster-triangles.arrow",
            Objects => "caster-objects.arrow",
            Images => "caster-images.arrow",
        }
    }

    fn schema(self) -> Schema {
        let number = |name: &str| Field::new(name, DataType::UInt32, false);
        let fields = match self {
            Meshes => vec![
                number("vertices"),
                number("triangles"),
                Field::new("polygons", DataType::Boolean, false),
                tables::numbers_field("material_from"),
                tables::numbers_field("material"),
            ],
            Vertices => {
                let mut fields = vec![number("mesh")];
                fields.extend(tables::vertex_fields());
                fields
            }
            Triangles => ["mesh", "face", "p", "q", "r"].map(number).to_vec(),
            Objects => {
                let mut fields = vec![number("mesh")];
                fields.extend(
                    TableName::Objects
                        .schema()
                        .fields
                        .iter()
                        .map(|f| (**f).clone()),
                );
                fields
            }
            Images => return TableName::Images.schema(),
        };
        Schema::new(fields)
    }

    fn batch(self, columns: Vec<ArrayRef>) -> RecordBatch {
        let batch = RecordBatch::try_new(Arc::new(self.schema()), columns);
        batch.expect("columns are as the schema says")
    }
}

/// Members of casters, all of which a file has or none.
pub fn members() -> [&'static str; 5] {
    CasterTable::ALL.map(CasterTable::member)
}

/// Writes what is embedded of `casters`, if anything; what the manifest tells of them. `seen` are the
/// images of what is seen.
pub fn write_casters<W: Write + Seek>(
    writer: &mut TableWriter<W>,
    casters: &Casters,
    seen: &[Image],
) -> Result<CastersTold, FileError> {
    let embedded = match &casters.embedded {
        Some(scene) => Some(write_scene(writer, scene, seen)?),
        None => None,
    };
    Ok(CastersTold {
        embedded,
        readings: casters.readings.clone(),
    })
}

fn write_scene<W: Write + Seek>(
    writer: &mut TableWriter<W>,
    scene: &Scene,
    seen: &[Image],
) -> Result<EmbeddedScene, FileError> {
    let mut write = |table: CasterTable, batches: &mut dyn Iterator<Item = RecordBatch>| {
        writer.write(table.member(), &table.schema(), batches)
    };
    let meshes = &scene.meshes;
    let rows_of = |of: fn(&Mesh) -> usize| Batches::new(meshes.iter().map(of).collect());
    write(Meshes, &mut meshes.chunks(ROWS_PER_BATCH).map(mesh_rows))?;
    let vertices = rows_of(|mesh| mesh.positions.len());
    write(
        Vertices,
        &mut vertices.map(|rows| vertex_rows(meshes, &rows)),
    )?;
    let triangles = rows_of(|mesh| mesh.triangles.len());
    write(
        Triangles,
        &mut triangles.map(|rows| triangle_rows(meshes, &rows)),
    )?;
    write(
        Objects,
        &mut scene.objects.chunks(ROWS_PER_BATCH).map(object_rows),
    )?;

    let mut known: HashMap<&str, Vec<u32>> = HashMap::new();
    for (image, row) in seen.iter().zip(0..) {
        known.entry(&image.name).or_default().push(row);
    }
    let mut further: Vec<&Image> = Vec::new();
    let places = scene.images.iter().map(|image| {
        let alike = known.get(image.name.as_str()).into_iter().flatten();
        let place = alike.copied().find(|&row| seen[row as usize] == *image);
        place.unwrap_or_else(|| {
            further.push(image);
            (seen.len() + further.len() - 1) as u32
        })
    });
    let images = places.collect();
    write(Images, &mut further.into_iter().map(tables::image_row))?;
    Ok(EmbeddedScene {
        world: scene.world.clone(),
        layers: scene.layers.clone(),
        lights: scene.lights.clone(),
        cameras: scene.cameras.clone(),
        materials: scene.materials.clone(),
        images,
    })
}

/// Cuts the rows of all meshes into batches.
struct Batches {
    counts: Vec<usize>,
    mesh: usize,
    row: usize,
}

impl Batches {
    fn new(counts: Vec<usize>) -> Self {
        Self {
            counts,
            mesh: 0,
            row: 0,
        }
    }
}

impl Iterator for Batches {
    type Item = Vec<(u32, Range<usize>)>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut batch = Vec::new();
        let mut room = ROWS_PER_BATCH;
        while room > 0
            && let Some(&count) = self.counts.get(self.mesh)
        {
            let rows = self.row..count.min(self.row + room);
            room -= rows.len();
            self.row = rows.end;
            if !rows.is_empty() {
                batch.push((self.mesh as u32, rows));
            }
            if self.row == count {
                self.mesh += 1;
                self.row = 0;
            }
        }
        (!batch.is_empty()).then_some(batch)
    }
}

fn mesh_rows(meshes: &[Mesh]) -> RecordBatch {
    let [mut from, mut materials] = [(); 2].map(|()| ListColumn::new());
    for mesh in meshes {
        from.push(mesh.materials.iter().map(|range| range.0));
        materials.push(mesh.materials.iter().map(|range| range.1.0));
    }
    let counts = |of: fn(&Mesh) -> usize| tables::numbers(meshes.iter().map(|m| of(m) as u32));
    let polygons: BooleanArray = meshes
        .iter()
        .map(|mesh| Some(!mesh.fans.is_empty()))
        .collect();
    Meshes.batch(vec![
        counts(|mesh| mesh.positions.len()),
        counts(|mesh| mesh.triangles.len()),
        Arc::new(polygons),
        from.finish(),
        materials.finish(),
    ])
}

fn vertex_rows(meshes: &[Mesh], rows: &[(u32, Range<usize>)]) -> RecordBatch {
    let mut numbers = Vec::new();
    let mut places = Vec::new();
    for (mesh, rows) in rows {
        numbers.extend(rows.clone().map(|_| *mesh));
        places.extend(rows.clone().map(|row| (&meshes[*mesh as usize], row)));
    }
    let mut columns = vec![tables::numbers(numbers.into_iter())];
    columns.extend(tables::vertex_columns(&places));
    Vertices.batch(columns)
}

fn triangle_rows(meshes: &[Mesh], rows: &[(u32, Range<usize>)]) -> RecordBatch {
    let mut columns: [Vec<u32>; 5] = Default::default();
    for (number, rows) in rows {
        let mesh = &meshes[*number as usize];
        for row in rows.clone() {
            let [p, q, r] = mesh.triangles[row];
            let face = mesh.face_of_triangle(row as u32);
            for (column, value) in columns.iter_mut().zip([*number, face, p, q, r]) {
                column.push(value);
            }
        }
    }
    let columns = columns.map(|column| tables::numbers(column.into_iter()));
    Triangles.batch(columns.to_vec())
}

fn object_rows(objects: &[Object]) -> RecordBatch {
    let mut columns = vec![tables::numbers(objects.iter().map(|object| object.mesh.0))];
    columns.extend(tables::object_rows(objects).columns().iter().cloned());
    Objects.batch(columns)
}

impl<R: Read + Seek> MapReader<R> {
    /// What casts; `None` where the file does not tell.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn read_casters(&mut self) -> Result<Option<Casters>, FileError> {
        let Some(CastersTold { embedded, readings }) = self.manifest().casters.clone() else {
            return Ok(None);
        };
        let embedded = match embedded {
            Some(told) => Some(self.read_scene(told)?),
            None => None,
        };
        Ok(Some(Casters { embedded, readings }))
    }

    fn read_scene(&mut self, told: EmbeddedScene) -> Result<Scene, FileError> {
        let mut scene = Scene {
            world: told.world,
            layers: told.layers,
            lights: told.lights,
            cameras: told.cameras,
            materials: told.materials,
            ..Scene::default()
        };
        let mut meshes = Vec::new();
        self.read_all(Meshes.member(), |rows| {
            rows.add_meshes(&mut scene.meshes, &mut meshes)
        })?;
        let mut filled = 0;
        self.read_all(Vertices.member(), |rows| {
            rows.add_vertices(&mut scene.meshes, &meshes, &mut filled)
        })?;
        let mut filled = 0;
        self.read_all(Triangles.member(), |rows| {
            rows.add_triangles(&mut scene.meshes, &meshes, &mut filled)
        })?;
        for (index, (mesh, told)) in scene.meshes.iter().zip(&meshes).enumerate() {
            told.check(index, mesh, scene.materials.len())?;
        }
        self.read_all(Objects.member(), |rows| {
            rows.add_objects(scene.meshes.len(), &mut scene.objects)
        })?;

        let mut images = Vec::new();
        for table in [TableName::Images.member(), Images.member()] {
            self.read_all(table, |rows| {
                images.push(rows.image()?);
                Ok(())
            })?;
        }
        for place in told.images {
            let image = images.get(place as usize).cloned();
            let missing = || FileError::unsound(Images.member(), format!("no image {place} in it"));
            scene.images.push(image.ok_or_else(missing)?);
        }
        super::read::check_scene(&scene)?;
        Ok(scene)
    }
}

/// What is told of a mesh beside its rows.
struct MeshRow {
    vertices: u32,
    triangles: u32,
    polygons: bool,
}

impl MeshRow {
    fn check(&self, index: usize, mesh: &Mesh, materials: usize) -> Result<(), FileError> {
        let unsound = |what: String| {
            let what = format!("mesh {index}: {what}");
            Err(FileError::unsound(Meshes.member(), what))
        };
        for (what, told, found) in [
            ("vertices", self.vertices, mesh.positions.len()),
            ("triangles", self.triangles, mesh.triangles.len()),
        ] {
            if found != told as usize {
                return unsound(format!("has {found} {what}, not {told}"));
            }
        }
        let is_there = |(_, material): &(u32, MaterialId)| material.index() < materials;
        if !mesh.materials.iter().all(is_there) {
            return unsound("a material is not there".into());
        }
        if mesh.face_count() > 0
            && let Err(error) = mesh.check()
        {
            return unsound(error.to_string());
        }
        Ok(())
    }
}

impl Rows<'_> {
    fn add_meshes(&self, meshes: &mut Vec<Mesh>, told: &mut Vec<MeshRow>) -> Result<(), FileError> {
        let (vertices, triangles) = (self.numbers("vertices")?, self.numbers("triangles")?);
        let polygons = self.booleans("polygons")?;
        let (from, materials) = (self.lists("material_from")?, self.lists("material")?);
        for row in 0..vertices.len() {
            let (from, materials) = (from.of(row), materials.of(row));
            if from.len() != materials.len() {
                return Err(self.unsound(format_args!("row {row} has no face for each material")));
            }
            let materials = materials.iter().copied().map(MaterialId);
            meshes.push(Mesh {
                materials: from.iter().copied().zip(materials).collect(),
                ..Mesh::default()
            });
            told.push(MeshRow {
                vertices: vertices[row],
                triangles: triangles[row],
                polygons: polygons.value(row),
            });
        }
        Ok(())
    }

    /// The mesh of a row; meshes ascend.
    fn next_mesh(
        &self,
        row: usize,
        found: u32,
        last: &mut u32,
        count: usize,
    ) -> Result<usize, FileError> {
        if found < *last || found as usize >= count {
            return Err(self.unsound(format_args!("row {row}: mesh {found} is not the next")));
        }
        *last = found;
        Ok(found as usize)
    }

    fn add_vertices(
        &self,
        meshes: &mut [Mesh],
        told: &[MeshRow],
        last: &mut u32,
    ) -> Result<(), FileError> {
        let of_mesh = self.numbers("mesh")?;
        let vertices: Vec<Vertex> = self.vertex_columns()?;
        for (row, vertex) in vertices.into_iter().enumerate() {
            let mesh = self.next_mesh(row, of_mesh[row], last, told.len())?;
            if !vertex.push_to(&mut meshes[mesh]) {
                let what = "has other attributes than those before it";
                return Err(self.unsound(format_args!("row {row} {what}")));
            }
        }
        Ok(())
    }

    fn add_triangles(
        &self,
        meshes: &mut [Mesh],
        told: &[MeshRow],
        last: &mut u32,
    ) -> Result<(), FileError> {
        let (of_mesh, face) = (self.numbers("mesh")?, self.numbers("face")?);
        let (p, q, r) = (self.numbers("p")?, self.numbers("q")?, self.numbers("r")?);
        for row in 0..of_mesh.len() {
            let number = self.next_mesh(row, of_mesh[row], last, told.len())?;
            let mesh = &mut meshes[number];
            let triangle = mesh.triangles.len() as u32;
            let is_next = if told[number].polygons {
                let faces = mesh.fans.len() as u32;
                if face[row] == faces {
                    mesh.fans.push(triangle);
                }
                face[row] == faces || Some(face[row]) == faces.checked_sub(1)
            } else {
                face[row] == triangle
            };
            if !is_next {
                let what = format_args!("row {row}: face {} is not the next", face[row]);
                return Err(self.unsound(what));
            }
            mesh.triangles.push([p[row], q[row], r[row]]);
        }
        Ok(())
    }

    fn add_objects(&self, meshes: usize, objects: &mut Vec<Object>) -> Result<(), FileError> {
        let of_mesh = self.numbers("mesh")?;
        for (row, (name, world_from_object)) in self.objects()?.into_iter().enumerate() {
            let mesh = MeshId(of_mesh[row]);
            if mesh.0 as usize >= meshes {
                return Err(self.unsound(format_args!("row {row}: its mesh is not there")));
            }
            objects.push(Object {
                name,
                mesh,
                world_from_object,
            });
        }
        Ok(())
    }
}
