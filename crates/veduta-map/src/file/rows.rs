//! Batches -> rows, looked over: whatever a table says, what comes out is of the right kind.

use super::FileError;
use super::projected::Projected;
use super::tables::ATTRIBUTES;
use crate::scene::{Image, Mesh};
use crate::{FaceId, Side};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, UInt32Type};
use arrow_array::{
    Array, ArrayRef, BooleanArray, Float32Array, Float64Array, ListArray, RecordBatch,
};
use std::ops::Range;
use veduta_geometry::{Affine, DMat4, DVec2, DVec3, Vec2, Vec3};

/// A batch that was read, and what to say of it if it is not as it should be.
pub struct Rows<'a> {
    pub batch: &'a RecordBatch,
    pub member: &'static str,
    pub index: usize,
}

impl Rows<'_> {
    /// An error about these rows.
    pub fn unsound(&self, what: impl std::fmt::Display) -> FileError {
        FileError::unsound(self.member, format!("batch {}: {what}", self.index))
    }

    fn column<'a, A: Array + 'static>(
        &'a self,
        name: &str,
        cast: impl Fn(&'a ArrayRef) -> Option<&'a A>,
    ) -> Result<&'a A, FileError> {
        let column = self.batch.column_by_name(name).and_then(cast);
        column.ok_or_else(|| self.unsound(format_args!("no column `{name}` of the right type")))
    }

    /// A column without gaps.
    fn full<'a, A: Array + 'static>(
        &'a self,
        name: &str,
        cast: impl Fn(&'a ArrayRef) -> Option<&'a A>,
    ) -> Result<&'a A, FileError> {
        let column = self.column(name, cast)?;
        if column.null_count() > 0 {
            return Err(self.unsound(format_args!("a gap in the column `{name}`")));
        }
        Ok(column)
    }

    pub fn numbers(&self, name: &str) -> Result<&[u32], FileError> {
        let column = self.full(name, |column| column.as_primitive_opt::<UInt32Type>())?;
        Ok(column.values())
    }

    pub fn booleans(&self, name: &str) -> Result<&BooleanArray, FileError> {
        self.full(name, |column| column.as_boolean_opt())
    }

    pub fn reals(&self, name: &str) -> Result<&[f64], FileError> {
        let column = self.full(name, |column| column.as_primitive_opt::<Float64Type>())?;
        if column.values().iter().any(|value| !value.is_finite()) {
            return Err(self.unsound(format_args!("a number in `{name}` is not finite")));
        }
        Ok(column.values())
    }

    /// Numbers of single precision.
    pub fn floats(&self, name: &str) -> Result<&[f32], FileError> {
        let column = self.full(name, |column| column.as_primitive_opt::<Float32Type>())?;
        Ok(column.values())
    }

    pub fn lists(&self, name: &str) -> Result<NumberLists<'_>, FileError> {
        let lists: &ListArray = self.full(name, |column| column.as_list_opt::<i32>())?;
        let numbers = lists.values().as_primitive_opt::<UInt32Type>();
        let numbers = numbers.filter(|numbers| numbers.null_count() == 0);
        let numbers = numbers
            .ok_or_else(|| self.unsound(format_args!("no numbers in the lists `{name}`")))?;
        Ok(NumberLists {
            ends: lists.value_offsets(),
            numbers: numbers.values(),
        })
    }

    /// The points of a tile after those of its vertices.
    pub fn points(&self, projected: &Projected) -> Result<Vec<DVec2>, FileError> {
        let (x, y) = (self.reals("x")?, self.reals("y")?);
        let told = x.iter().zip(y).map(|(&x, &y)| DVec2::new(x, y));
        Ok(projected.image().iter().copied().chain(told).collect())
    }

    /// Adds the faces of a tile to `found`; outlines are of `points`, or, like planes, follow from vertices.
    pub fn faces(
        &self,
        points: &[DVec2],
        projected: &Projected,
        found: &mut FaceRows,
    ) -> Result<(), FileError> {
        let (face, object) = (self.numbers("face")?, self.numbers("object")?);
        let (material, plane) = (self.numbers("material")?, self.numbers("plane")?);
        let opaque = self.booleans("opaque")?;
        let nearness = [self.gappy("a")?, self.gappy("b")?, self.gappy("c")?];
        let (outlines, corners) = (self.lists("outline")?, self.lists("corners")?);
        let (mut places, mut outline) = (Vec::new(), Vec::new());
        for row in 0..face.len() {
            let misfit = |what: &str| self.unsound(format_args!("face {}: {what}", face[row]));
            let corners = corners.of(row);
            if !projected.find(object[row], corners.iter().copied(), &mut places) {
                return Err(misfit("its corners are not there"));
            }
            let nearness = match nearness.map(|column| column.is_valid(row)) {
                [true, true, true] => {
                    let [a, b, c] = nearness.map(|column| column.value(row));
                    Affine::new(a, b, c)
                }
                [false, false, false] => projected
                    .nearness(&places)
                    .ok_or_else(|| misfit("its corners tell no plane"))?,
                _ => return Err(misfit("a part of its plane is missing")),
            };
            match outlines.of(row) {
                [] => projected.outline(&places, &mut outline),
                told => self.outline(told, points, &mut outline)?,
            }
            if !outline.iter().all(|point| point.is_finite()) {
                return Err(misfit("a corner of it has no place in the picture"));
            }
            found.rows.push(FaceRow {
                face: face[row],
                object: object[row],
                material: material[row],
                opaque: opaque.value(row),
                plane: plane[row],
                nearness,
                outline: found.outlines.add(outline.iter().copied()),
                corners: found.corners.add(corners.iter().copied()),
            });
        }
        Ok(())
    }

    /// Real numbers, some of which may be missing.
    fn gappy(&self, name: &str) -> Result<&Float64Array, FileError> {
        let column: &Float64Array =
            self.column(name, |column| column.as_primitive_opt::<Float64Type>())?;
        if column.iter().flatten().any(|value| !value.is_finite()) {
            return Err(self.unsound(format_args!("a number in `{name}` is not finite")));
        }
        Ok(column)
    }

    /// Overwrites `outline` with the points in these rows.
    fn outline(
        &self,
        rows: &[u32],
        points: &[DVec2],
        outline: &mut Vec<DVec2>,
    ) -> Result<(), FileError> {
        outline.clear();
        for &row in rows {
            let point = points.get(row as usize).filter(|point| point.is_finite());
            let missing = || self.unsound("an outline names a point that is not there");
            outline.push(*point.ok_or_else(missing)?);
        }
        Ok(())
    }

    /// Adds the fragments of a tile to `found`; outlines are of `points`.
    pub fn fragments(&self, points: &[DVec2], found: &mut FragmentRows) -> Result<(), FileError> {
        let face = self.numbers("face")?;
        let outlines = self.lists("outline")?;
        let (side_faces, side_kinds) = (self.lists("side_face")?, self.lists("side_kind")?);
        let mut outline = Vec::new();
        for (row, &face) in face.iter().enumerate() {
            self.outline(outlines.of(row), points, &mut outline)?;
            let (faces, kinds) = (side_faces.of(row), side_kinds.of(row));
            let is_whole = outline.is_empty() && faces.is_empty() && kinds.is_empty();
            let fits = outline.len() == faces.len() && faces.len() == kinds.len();
            if !(is_whole || fits && outline.len() >= 3) {
                return Err(
                    self.unsound(format_args!("fragment {row} has no side for each vertex"))
                );
            }
            let sides = faces.iter().zip(kinds).map(|(&face, &kind)| Side {
                face: FaceId(face),
                kind,
            });
            let corners = outline.iter().copied().zip(sides);
            found.rows.push(FragmentRow {
                face,
                corners: found.corners.add(corners),
            });
        }
        Ok(())
    }

    /// The vertices of a tile.
    pub fn vertices(&self) -> Result<Vec<VertexRow>, FileError> {
        let (object, vertex) = (self.numbers("object")?, self.numbers("vertex")?);
        let rows = object.iter().zip(vertex).zip(self.vertex_columns()?);
        Ok(rows
            .map(|((&object, &vertex), at)| VertexRow { object, vertex, at })
            .collect())
    }

    /// What [`vertex_fields`] tell.
    pub fn vertex_columns(&self) -> Result<Vec<Vertex>, FileError> {
        let (x, y, z) = (self.reals("x")?, self.reals("y")?, self.reals("z")?);
        let columns: Result<Vec<&Float32Array>, FileError> = ATTRIBUTES
            .iter()
            .map(|name| self.column(name, |column| column.as_primitive_opt::<Float32Type>()))
            .collect();
        let columns = columns?;
        let vertices = (0..x.len()).map(|row| {
            let mut vertex = Vertex {
                position: DVec3::new(x[row], y[row], z[row]),
                given: 0,
                attributes: [0; ATTRIBUTES.len()],
            };
            for (k, column) in columns.iter().enumerate() {
                if column.is_valid(row) {
                    vertex.given |= 1 << k;
                    vertex.attributes[k] = column.value(row).to_bits();
                }
            }
            vertex
        });
        Ok(vertices.collect())
    }

    /// A batch of objects, without meshes.
    pub fn objects(&self) -> Result<Vec<(String, DMat4)>, FileError> {
        let names = self.full("name", |column| column.as_string_opt::<i32>())?;
        let matrices = self.full("world_from_object", |column| {
            column.as_fixed_size_list_opt()
        })?;
        let values = matrices.values().as_primitive_opt::<Float64Type>();
        let values = values.filter(|values| {
            matrices.value_length() == 16
                && values.null_count() == 0
                && values.len() == 16 * names.len()
        });
        let values = values.ok_or_else(|| self.unsound("the matrices are not 16 numbers each"))?;
        let (matrices, _) = values.values().as_chunks::<16>();
        Ok(names
            .iter()
            .flatten()
            .map(str::to_owned)
            .zip(matrices.iter().map(DMat4::from_cols_array))
            .collect())
    }

    /// An image.
    pub fn image(&self) -> Result<Image, FileError> {
        let (width, height) = (self.numbers("width")?, self.numbers("height")?);
        let name = self.full("name", |column| column.as_string_opt::<i32>())?;
        let bytes = self.full("rgba", |column| column.as_binary_opt::<i64>())?;
        let ([width], [height]) = (width, height) else {
            return Err(self.unsound("not one image"));
        };
        let (pixels, rest) = bytes.value(0).as_chunks::<4>();
        let expected = u64::from(*width) * u64::from(*height);
        if expected == 0 || pixels.len() as u64 != expected || !rest.is_empty() {
            return Err(self.unsound(format_args!("the image is not {width} x {height} pixels")));
        }
        Ok(Image {
            name: name.value(0).to_owned(),
            width: *width,
            height: *height,
            pixels: pixels.to_vec(),
        })
    }
}

/// A column of lists.
pub struct NumberLists<'a> {
    ends: &'a [i32],
    numbers: &'a [u32],
}

impl<'a> NumberLists<'a> {
    pub fn of(&self, row: usize) -> &'a [u32] {
        &self.numbers[self.ends[row] as usize..self.ends[row + 1] as usize]
    }
}

/// Lists of rows, one after the other: one of its own for each row would be most of what reading costs.
#[derive(Debug)]
pub struct Lists<T>(Vec<T>);

impl<T> Default for Lists<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Lists<T> {
    /// Adds a list, and tells where it stands.
    fn add(&mut self, values: impl Iterator<Item = T>) -> Range<usize> {
        let first = self.0.len();
        self.0.extend(values);
        first..self.0.len()
    }

    /// The list that stands there.
    pub fn of(&self, place: &Range<usize>) -> &[T] {
        &self.0[place.clone()]
    }
}

/// Rows of `faces.arrow`.
#[derive(Debug, Default)]
pub struct FaceRows {
    pub rows: Vec<FaceRow>,
    pub outlines: Lists<DVec2>,
    pub corners: Lists<u32>,
}

/// A row of `faces.arrow`.
#[derive(Clone, Debug)]
pub struct FaceRow {
    pub face: u32,
    pub object: u32,
    pub material: u32,
    pub opaque: bool,
    pub plane: u32,
    pub nearness: Affine,
    /// Among [`FaceRows::outlines`].
    pub outline: Range<usize>,
    /// Among [`FaceRows::corners`].
    pub corners: Range<usize>,
}

impl FaceRows {
    /// Puts rows in the order of their faces, each once; a face that is told again, differently, stays.
    pub fn tidy(&mut self) {
        let Self {
            rows,
            outlines,
            corners,
        } = self;
        rows.sort_by_key(|row| row.face);
        let told = |row: &FaceRow| {
            let places = (row.face, row.object, row.material, row.opaque, row.plane);
            (places, row.nearness)
        };
        rows.dedup_by(|a, b| {
            told(a) == told(b)
                && outlines.of(&a.outline) == outlines.of(&b.outline)
                && corners.of(&a.corners) == corners.of(&b.corners)
        });
    }
}

/// Rows of `opaque.arrow` or `veils.arrow`.
#[derive(Debug, Default)]
pub struct FragmentRows {
    pub rows: Vec<FragmentRow>,
    pub corners: Lists<(DVec2, Side)>,
}

/// A row of `opaque.arrow` or `veils.arrow`.
#[derive(Clone, Debug)]
pub struct FragmentRow {
    pub face: u32,
    /// Among [`FragmentRows::corners`]: vertices with the sides that begin at them; none where the face is seen whole.
    pub corners: Range<usize>,
}

/// A row of `vertices.arrow`.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexRow {
    pub object: u32,
    pub vertex: u32,
    pub at: Vertex,
}

/// Where a vertex is, and what it looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct Vertex {
    pub position: DVec3,
    /// Bit `k` tells whether there is an attribute `k`.
    given: u16,
    /// As bits, so that equal rows are equal whatever they hold.
    attributes: [u32; ATTRIBUTES.len()],
}

impl Vertex {
    /// Adds the vertex to a mesh; `false` if it has other attributes than those before it.
    pub fn push_to(&self, mesh: &mut Mesh) -> bool {
        let attributes: [Option<f32>; ATTRIBUTES.len()] = std::array::from_fn(|k| {
            let is_given = self.given & 1 << k != 0;
            is_given.then(|| f32::from_bits(self.attributes[k]))
        });
        let [nx, ny, nz, u, v, u2, v2, r, g, b, opacity] = attributes;
        mesh.positions.push(self.position);
        mesh.normals.extend(all([nx, ny, nz]).map(Vec3::from));
        mesh.texcoords.extend(all([u, v]).map(Vec2::from));
        mesh.second_texcoords.extend(all([u2, v2]).map(Vec2::from));
        mesh.colors.extend(all([r, g, b]));
        mesh.opacities.extend(opacity);
        let count = mesh.positions.len();
        let lengths = [
            mesh.normals.len(),
            mesh.texcoords.len(),
            mesh.second_texcoords.len(),
            mesh.colors.len(),
            mesh.opacities.len(),
        ];
        lengths.iter().all(|&length| length == 0 || length == count)
    }
}

fn all<const N: usize>(values: [Option<f32>; N]) -> Option<[f32; N]> {
    let present = values.iter().all(Option::is_some);
    present.then(|| values.map(Option::unwrap_or_default))
}
