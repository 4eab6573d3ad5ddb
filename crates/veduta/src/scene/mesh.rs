use veduta_geometry::{DVec3, Vec2, Vec3};
use veduta_map::MaterialId;

/// Triangles with shared vertices.
///
/// Faces are counterclockwise seen from their front. Attribute tables are empty or have one row for
/// each position. [`Mesh::check`] tells whether all indices and lengths are right; readers call it,
/// and everything after them relies on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Object space, in metres.
    pub positions: Vec<DVec3>,
    /// Indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals; empty for flat faces.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, (0, 0) at the top left of the picture (as in glTF); may be empty.
    pub texcoords: Vec<Vec2>,
    /// Linear RGB factors of the material's colour; may be empty.
    pub colors: Vec<[f32; 3]>,
    /// `(first face, material)`, ascending from face 0: each material holds up to the next row.
    pub materials: Vec<(u32, MaterialId)>,
}

/// Why a mesh is unsound.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// An index points past the vertices.
    #[error("triangle {triangle} refers to vertex {index}, but there are {vertices} vertices")]
    IndexOutOfRange {
        /// The triangle.
        triangle: usize,
        /// The index found.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} is at {position}, which is not finite")]
    NotFinite {
        /// The vertex.
        vertex: usize,
        /// Its position.
        position: DVec3,
    },
    /// An attribute table has another length than the positions.
    #[error("{attribute} has {found} rows, but there are {vertices} vertices")]
    AttributeLength {
        /// Which table.
        attribute: &'static str,
        /// Its length.
        found: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// Material ranges do not start at face 0 or do not ascend.
    #[error("material ranges must ascend from face 0")]
    MaterialRanges,
}

impl Mesh {
    /// The material of a face.
    pub fn material_of(&self, face: u32) -> MaterialId {
        let after = self.materials.partition_point(|range| range.0 <= face);
        self.materials[after - 1].1
    }

    /// Checks indices, lengths and coordinates.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        for (vertex, &position) in self.positions.iter().enumerate() {
            if !position.is_finite() {
                return Err(MeshError::NotFinite { vertex, position });
            }
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            for &index in corners {
                if index as usize >= vertices {
                    return Err(MeshError::IndexOutOfRange {
                        triangle,
                        index,
                        vertices,
                    });
                }
            }
        }
        for (attribute, found) in [
            ("normals", self.normals.len()),
            ("texture coordinates", self.texcoords.len()),
            ("colours", self.colors.len()),
        ] {
            if found != 0 && found != vertices {
                return Err(MeshError::AttributeLength {
                    attribute,
                    found,
                    vertices,
                });
            }
        }
        let ascends = self.materials.windows(2).all(|pair| pair[0].0 < pair[1].0);
        if self.materials.first().is_none_or(|range| range.0 != 0) || !ascends {
            return Err(MeshError::MaterialRanges);
        }
        Ok(())
    }
}
