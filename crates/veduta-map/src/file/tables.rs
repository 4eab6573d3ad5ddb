//! The tables of a file: their columns, and a seen scene -> batches.

use super::FileError;
use super::projected::{Projected, same_nearness, same_points};
use super::tiles::Tile;
use crate::scene::{Image, Mesh, Object, Scene};
use crate::{FaceId, Fragment, Fragments, ObjectId, VisibilityMap};
use arrow_array::builder::{FixedSizeListBuilder, Float64Builder, ListBuilder, UInt32Builder};
use arrow_array::{
    ArrayRef, BooleanArray, Float32Array, Float64Array, LargeBinaryArray, RecordBatch, StringArray,
    UInt32Array,
};
use arrow_schema::{ArrowError, DataType, Field, Schema};
use std::collections::HashMap;
use std::sync::Arc;
use veduta_geometry::{Affine, DVec2, DVec3};

/// A member that holds a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableName {
    /// Points of the image plane, by tile.
    Points,
    /// Corners of faces in their object's space, by tile.
    Vertices,
    /// Faces, by tile.
    Faces,
    /// Where opaque faces are seen, by tile.
    Opaque,
    /// Where faces that are not fully opaque are seen, by tile.
    Veils,
    /// Objects.
    Objects,
    /// Pictures, each a batch.
    Images,
    /// How many samples the pixels of guests have, by band; only in files with guests.
    GuestPixels,
    /// Samples of guests, by band; only in files with guests.
    GuestSamples,
}

use TableName::{
    Faces, GuestPixels, GuestSamples, Images, Objects, Opaque, Points, Veils, Vertices,
};

impl TableName {
    /// Tables whose batches are tiles, in the order in which they stand in a file.
    pub const OF_TILES: [Self; 5] = [Points, Vertices, Faces, Opaque, Veils];

    /// Those of them that tell of faces; the others tell where these are seen.
    pub const OF_FACES: [Self; 3] = [Points, Vertices, Faces];

    /// Tables whose batches are bands of guests.
    pub const OF_GUESTS: [Self; 2] = [GuestPixels, GuestSamples];

    /// Name of the member.
    pub fn member(self) -> &'static str {
        match self {
            Points => "points.arrow",
            Vertices => "vertices.arrow",
            Faces => "faces.arrow",
            Opaque => "opaque.arrow",
            Veils => "veils.arrow",
            Objects => "objects.arrow",
            Images => "images.arrow",
            GuestPixels => "guest_pixels.arrow",
            GuestSamples => "guest_samples.arrow",
        }
    }

    pub fn schema(self) -> Schema {
        let number = |name: &str| Field::new(name, DataType::UInt32, false);
        let real = |name: &str| Field::new(name, DataType::Float64, false);
        let numbers = numbers_field;
        let fields = match self {
            Points => vec![real("x"), real("y")],
            Vertices => {
                let mut fields = vec![number("object"), number("vertex")];
                fields.extend(vertex_fields());
                fields
            }
            Faces => vec![
                number("face"),
                number("object"),
                number("material"),
                Field::new("opaque", DataType::Boolean, false),
                number("plane"),
                Field::new("a", DataType::Float64, true),
                Field::new("b", DataType::Float64, true),
                Field::new("c", DataType::Float64, true),
                numbers("outline"),
                numbers("corners"),
            ],
            Opaque | Veils => vec![
                number("face"),
                numbers("outline"),
                numbers("side_face"),
                numbers("side_kind"),
            ],
            Objects => vec![
                Field::new("name", DataType::Utf8, false),
                Field::new("world_from_object", matrix_type(), false),
            ],
            Images => vec![
                Field::new("name", DataType::Utf8, false),
                number("width"),
                number("height"),
                Field::new("rgba", DataType::LargeBinary, false),
            ],
            GuestPixels => vec![number("samples")],
            GuestSamples => {
                let full = |name: &str| Field::new(name, DataType::Float32, false);
                let mut fields = vec![real("near"), real("far")];
                fields.extend(["opacity", "r", "g", "b"].map(full));
                fields.push(number("object"));
                fields
            }
        };
        Schema::new(fields)
    }

    pub(super) fn batch(self, columns: Vec<ArrayRef>) -> RecordBatch {
        RecordBatch::try_new(Arc::new(self.schema()), columns)
            .expect("columns are as the schema says")
    }
}

/// Columns of vertices that are empty where the mesh has no such attribute.
pub const ATTRIBUTES: [&str; 11] = [
    "nx", "ny", "nz", "u", "v", "u2", "v2", "r", "g", "b", "opacity",
];

fn list_of(values: DataType) -> DataType {
    DataType::List(Arc::new(Field::new_list_field(values, false)))
}

/// A column of lists of numbers.
pub fn numbers_field(name: &str) -> Field {
    Field::new(name, list_of(DataType::UInt32), false)
}

/// Columns that tell a vertex: its place and its attributes.
pub fn vertex_fields() -> impl Iterator<Item = Field> {
    let real = |name| Field::new(name, DataType::Float64, false);
    let short = |name| Field::new(name, DataType::Float32, true);
    let attributes = ATTRIBUTES.into_iter().map(short);
    ["x", "y", "z"].into_iter().map(real).chain(attributes)
}

fn matrix_type() -> DataType {
    DataType::FixedSizeList(
        Arc::new(Field::new_list_field(DataType::Float64, false)),
        16,
    )
}

/// Lists of numbers, one after the other.
pub struct ListColumn(ListBuilder<UInt32Builder>);

impl ListColumn {
    pub fn new() -> Self {
        let field = Field::new_list_field(DataType::UInt32, false);
        Self(ListBuilder::new(UInt32Builder::new()).with_field(field))
    }

    pub fn push(&mut self, numbers: impl Iterator<Item = u32>) {
        self.0.append_value(numbers.map(Some));
    }

    pub fn finish(mut self) -> ArrayRef {
        Arc::new(self.0.finish())
    }
}

/// What the tables of a tile are made of, which name each other's rows.
pub struct TileRows<'a> {
    map: &'a VisibilityMap,
    scene: &'a Scene,
    tile: &'a Tile,
    /// The faces, ascending.
    faces: Vec<FaceId>,
    /// Object and number of the vertices, ascending.
    vertices: Vec<(ObjectId, u32)>,
}

impl<'a> TileRows<'a> {
    pub fn new(map: &'a VisibilityMap, scene: &'a Scene, tile: &'a Tile) -> Self {
        let faces = tile.faces_named(map);
        let mut vertices: Vec<(ObjectId, u32)> = Vec::new();
        for &face in &faces {
            let object = map.faces.object(face);
            let corners = scene.mesh_of(object).corners_of(map.faces.source(face));
            vertices.extend(corners.map(|corner| (object, corner)));
        }
        vertices.sort_unstable();
        vertices.dedup();
        Self {
            map,
            scene,
            tile,
            faces,
            vertices,
        }
    }

    /// The batch of one of the tables.
    pub fn batch(&self, table: TableName) -> RecordBatch {
        if table == Vertices {
            return self.vertex_rows();
        }
        let projected = self.projected();
        let mut points = PointRows::after(projected.image());
        // Points are counted in this order.
        let faces = self.face_rows(&projected, &mut points);
        if table == Faces {
            return faces;
        }
        let opaque = fragment_rows(Opaque, &self.map.opaque, &self.tile.opaque, &mut points);
        if table == Opaque {
            return opaque;
        }
        let veils = fragment_rows(Veils, &self.map.veils, &self.tile.veils, &mut points);
        match table {
            Veils => veils,
            _ => points.finish(),
        }
    }

    fn projected(&self) -> Projected<'a> {
        let vertices = self.vertices.iter().map(|&(object, vertex)| {
            let mesh = self.scene.mesh_of(object);
            ((object.0, vertex), mesh.positions[vertex as usize])
        });
        Projected::new(&self.map.camera, vertices, |object| {
            &self.scene.object(ObjectId(object)).world_from_object
        })
    }

    fn face_rows(&self, projected: &Projected, points: &mut PointRows) -> RecordBatch {
        let (table, faces) = (&self.map.faces, &self.faces);
        let (mut outlines, mut corners) = (ListColumn::new(), ListColumn::new());
        let mut materials = Vec::with_capacity(faces.len());
        let mut planes = Vec::with_capacity(faces.len());
        let (mut rows, mut follows) = (Vec::new(), Vec::new());
        for &face in faces {
            let mesh = self.scene.mesh_of(table.object(face));
            let source = table.source(face);
            let object = table.object(face).0;
            let are_there = projected.find(object, mesh.corners_of(source), &mut rows);
            assert!(are_there, "a tile has the corners of all of its faces");
            let outline = table.outline(face);
            projected.outline(&rows, &mut follows);
            if same_points(&follows, outline) {
                outlines.push(std::iter::empty());
            } else {
                outlines.push(outline.iter().map(|&point| points.row_of(point)));
            }
            let nearness = *table.face_nearness(face);
            let follows = projected.nearness(&rows);
            let follows = follows.is_some_and(|plane| same_nearness(&plane, &nearness));
            planes.push((!follows).then_some(nearness));
            corners.push(mesh.corners_of(source));
            materials.push(mesh.material_of(source).0);
        }
        let plane = |of: fn(&Affine) -> f64| -> ArrayRef {
            let told = planes.iter().map(|plane| plane.as_ref().map(of));
            Arc::new(Float64Array::from_iter(told))
        };
        let opaque: BooleanArray = faces
            .iter()
            .map(|&face| Some(!table.is_veil(face)))
            .collect();
        Faces.batch(vec![
            numbers(faces.iter().map(|face| face.0)),
            numbers(faces.iter().map(|&face| table.object(face).0)),
            numbers(materials.into_iter()),
            Arc::new(opaque),
            numbers(faces.iter().map(|&face| table.plane(face).0)),
            plane(|plane| plane.a),
            plane(|plane| plane.b),
            plane(|plane| plane.c),
            outlines.finish(),
            corners.finish(),
        ])
    }

    fn vertex_rows(&self) -> RecordBatch {
        let rows = &self.vertices;
        let meshes: Vec<(&Mesh, usize)> = rows
            .iter()
            .map(|&(object, vertex)| (self.scene.mesh_of(object), vertex as usize))
            .collect();
        let mut columns = vec![
            numbers(rows.iter().map(|row| row.0.0)),
            numbers(rows.iter().map(|row| row.1)),
        ];
        columns.extend(vertex_columns(&meshes));
        Vertices.batch(columns)
    }
}

/// Points of the image plane, each once: neighbours name the same. The first are those of vertices, which stand
/// in no table.
struct PointRows {
    points: Vec<DVec2>,
    of_vertices: usize,
    rows: HashMap<[u64; 2], u32>,
}

impl PointRows {
    fn after(vertices: &[DVec2]) -> Self {
        let mut points = Self {
            points: vertices.to_vec(),
            of_vertices: vertices.len(),
            rows: HashMap::with_capacity(2 * vertices.len()),
        };
        for (&point, row) in vertices.iter().zip(0..) {
            points.rows.entry(Self::key(point)).or_insert(row);
        }
        points
    }

    fn key(point: DVec2) -> [u64; 2] {
        [point.x.to_bits(), point.y.to_bits()]
    }

    fn row_of(&mut self, point: DVec2) -> u32 {
        *self.rows.entry(Self::key(point)).or_insert_with(|| {
            self.points.push(point);
            self.points.len() as u32 - 1
        })
    }

    fn finish(self) -> RecordBatch {
        let points = &self.points[self.of_vertices..];
        let column = |of: fn(&DVec2) -> f64| -> ArrayRef {
            Arc::new(Float64Array::from_iter_values(points.iter().map(of)))
        };
        Points.batch(vec![column(|point| point.x), column(|point| point.y)])
    }
}

/// A column of numbers.
pub fn numbers(values: impl Iterator<Item = u32>) -> ArrayRef {
    Arc::new(UInt32Array::from_iter_values(values))
}

fn fragment_rows(
    table: TableName,
    fragments: &Fragments,
    indices: &[u32],
    points: &mut PointRows,
) -> RecordBatch {
    let [mut outlines, mut side_faces, mut side_kinds] = [(); 3].map(|()| ListColumn::new());
    for &index in indices {
        let (vertices, sides) = match fragments.get(index as usize) {
            Fragment::Whole(_) => (&[][..], &[][..]),
            Fragment::Cut {
                vertices, sides, ..
            } => (vertices, sides),
        };
        outlines.push(vertices.iter().map(|&point| points.row_of(point)));
        side_faces.push(sides.iter().map(|side| side.face.0));
        side_kinds.push(sides.iter().map(|side| side.kind));
    }
    let faces = indices
        .iter()
        .map(|&index| fragments.face(index as usize).0);
    table.batch(vec![
        numbers(faces),
        outlines.finish(),
        side_faces.finish(),
        side_kinds.finish(),
    ])
}

/// The columns of [`vertex_fields`], of rows of meshes.
pub fn vertex_columns(rows: &[(&Mesh, usize)]) -> Vec<ArrayRef> {
    let position = |of: fn(DVec3) -> f64| -> ArrayRef {
        let rows = rows.iter().map(|&(mesh, row)| of(mesh.positions[row]));
        Arc::new(Float64Array::from_iter_values(rows))
    };
    let mut columns = vec![position(|p| p.x), position(|p| p.y), position(|p| p.z)];
    for attribute in 0..ATTRIBUTES.len() {
        let column: Float32Array = rows
            .iter()
            .map(|&(mesh, row)| attribute_of(mesh, row, attribute))
            .collect();
        columns.push(Arc::new(column));
    }
    columns
}

/// Attribute `attribute` of [`ATTRIBUTES`] at a vertex.
fn attribute_of(mesh: &Mesh, row: usize, attribute: usize) -> Option<f32> {
    match attribute {
        0..3 => mesh.normals.get(row).map(|n| n[attribute]),
        3..5 => mesh.texcoords.get(row).map(|uv| uv[attribute - 3]),
        5..7 => mesh.second_texcoords.get(row).map(|uv| uv[attribute - 5]),
        7..10 => mesh.colors.get(row).map(|rgb| rgb[attribute - 7]),
        _ => mesh.opacities.get(row).copied(),
    }
}

/// A batch of objects.
pub fn object_rows(objects: &[Object]) -> RecordBatch {
    let names = StringArray::from_iter_values(objects.iter().map(|object| &object.name));
    let field = Field::new_list_field(DataType::Float64, false);
    let mut matrices = FixedSizeListBuilder::new(Float64Builder::new(), 16).with_field(field);
    for object in objects {
        let columns = object.world_from_object.to_cols_array();
        matrices.values().append_slice(&columns);
        matrices.append(true);
    }
    Objects.batch(vec![Arc::new(names), Arc::new(matrices.finish())])
}

/// The batch of an image.
pub fn image_row(image: &Image) -> RecordBatch {
    Images.batch(vec![
        Arc::new(StringArray::from_iter_values([&image.name])),
        numbers([image.width].into_iter()),
        numbers([image.height].into_iter()),
        Arc::new(LargeBinaryArray::from_iter_values([image
            .pixels
            .as_flattened()])),
    ])
}

impl From<ArrowError> for FileError {
    fn from(error: ArrowError) -> Self {
        match error {
            ArrowError::IoError(_, source) => Self::Io {
                what: "a table",
                source,
            },
            other => Self::unsound("a table", other.to_string()),
        }
    }
}
