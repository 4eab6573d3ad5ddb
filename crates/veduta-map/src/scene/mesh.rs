use crate::MaterialId;
use crate::scene::TexcoordSet;
use std::ops::Range;
use veduta_geometry::{DVec3, Vec2, Vec3};

/// Faces with shared vertices: triangles, or convex planar polygons given as fans of triangles.
///
/// Faces are counterclockwise seen from their front. Attribute tables are empty or have one row for
/// each position. [`Mesh::check`] tells whether all indices and lengths are right; readers call it,
/// and everything after them relies on it.
///
/// A polygon of more than three corners stays one face only where its attributes are affine over it
/// (flat, without texture, or with texture coordinates that go evenly over it), so that the first
/// triangle of its fan tells its plane and all that goes over it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Object space, in metres.
    pub positions: Vec<DVec3>,
    /// Indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// First triangle of each face, ascending from 0; empty where each triangle is a face. The
    /// triangles of a face are a fan: all begin at one corner, and each goes on where the one before
    /// ended.
    pub fans: Vec<u32>,
    /// Unit normals; empty for flat faces.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, (0, 0) at the top left of the picture (as in glTF); may be empty.
    pub texcoords: Vec<Vec2>,
    /// A second set of texture coordinates, for textures that ask for it
    /// ([`TexcoordSet::Second`]); may be empty.
    pub second_texcoords: Vec<Vec2>,
    /// Linear RGB factors of the material's colour; may be empty.
    pub colors: Vec<[f32; 3]>,
    /// Factors of the material's opacity; empty where all are 1.
    pub opacities: Vec<f32>,
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
    /// The fans do not share out the triangles.
    #[error("face {face} is no fan of triangles")]
    NoFan {
        /// The face.
        face: usize,
    },
    /// Material ranges do not start at face 0 or do not ascend.
    #[error("material ranges must ascend from face 0")]
    MaterialRanges,
}

impl Mesh {
    /// Number of faces.
    pub fn face_count(&self) -> usize {
        if self.fans.is_empty() {
            self.triangles.len()
        } else {
            self.fans.len()
        }
    }

    /// The triangles that a face is a fan of: rows of [`Mesh::triangles`].
    #[inline]
    pub fn triangles_of(&self, face: u32) -> Range<usize> {
        let face = face as usize;
        if self.fans.is_empty() {
            return face..face + 1;
        }
        let end = self.fans.get(face + 1).copied();
        self.fans[face] as usize..end.map_or(self.triangles.len(), |end| end as usize)
    }

    /// The face that a triangle is a part of.
    pub fn face_of_triangle(&self, triangle: u32) -> u32 {
        if self.fans.is_empty() {
            return triangle;
        }
        self.fans.partition_point(|&first| first <= triangle) as u32 - 1
    }

    /// The corners of a face in order around it: rows of [`Mesh::positions`].
    #[inline]
    pub fn corners_of(&self, face: u32) -> impl Iterator<Item = u32> {
        let range = self.triangles_of(face);
        let [first, second, third] = self.triangles[range.start];
        let more = &self.triangles[range.start + 1..range.end];
        [first, second, third]
            .into_iter()
            .chain(more.iter().map(|&[_, _, corner]| corner))
    }

    /// Adds a convex planar polygon as one face. Its fan begins where the first triangle is largest,
    /// so that this tells the plane well.
    ///
    /// # Panics
    /// If there are fewer than three corners, or a corner has no position yet.
    pub fn push_polygon(&mut self, corners: &[u32]) {
        assert!(corners.len() >= 3, "a polygon has three corners at least");
        let corner = |k: usize| corners[k % corners.len()];
        let area = |k: usize| {
            let [p, q, r] = [k, k + 1, k + 2].map(|k| self.positions[corner(k) as usize]);
            (q - p).cross(r - p).length_squared()
        };
        let starts = if corners.len() == 3 {
            0..1
        } else {
            0..corners.len()
        };
        // The first of equals, so that a triangle and a square begin where the file begins them.
        let start = starts.fold((0, -1.0), |best: (usize, f64), k| {
            let area = area(k);
            if area > best.1 { (k, area) } else { best }
        });
        let first = start.0;
        self.push_fan(
            &(first..first + corners.len())
                .map(corner)
                .collect::<Vec<_>>(),
        );
    }

    /// Adds a convex planar polygon as one face, whose fan begins at its first corner.
    ///
    /// # Panics
    /// If there are fewer than three corners.
    pub fn push_fan(&mut self, corners: &[u32]) {
        assert!(corners.len() >= 3, "a polygon has three corners at least");
        if corners.len() > 3 && self.fans.is_empty() {
            self.fans = (0..self.triangles.len() as u32).collect();
        }
        if corners.len() > 3 || !self.fans.is_empty() {
            self.fans.push(self.triangles.len() as u32);
        }
        for pair in corners[1..].windows(2) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }

    /// The texture coordinates of a set; may be empty.
    pub fn texcoords_of(&self, set: TexcoordSet) -> &[Vec2] {
        match set {
            TexcoordSet::First => &self.texcoords,
            TexcoordSet::Second => &self.second_texcoords,
        }
    }

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
            ("second texture coordinates", self.second_texcoords.len()),
            ("colours", self.colors.len()),
            ("opacities", self.opacities.len()),
        ] {
            if found != 0 && found != vertices {
                return Err(MeshError::AttributeLength {
                    attribute,
                    found,
                    vertices,
                });
            }
        }
        self.check_fans()?;
        let ascends = self.materials.windows(2).all(|pair| pair[0].0 < pair[1].0);
        if self.materials.first().is_none_or(|range| range.0 != 0) || !ascends {
            return Err(MeshError::MaterialRanges);
        }
        Ok(())
    }

    fn check_fans(&self) -> Result<(), MeshError> {
        let mut expected = 0;
        for face in 0..self.fans.len() {
            let range = self.triangles_of(face as u32);
            let is_fan = range.start == expected
                && range.start < range.end
                && range.end <= self.triangles.len()
                && self.triangles[range.clone()]
                    .windows(2)
                    .all(|pair| pair[0][0] == pair[1][0] && pair[0][2] == pair[1][1]);
            if !is_fan {
                return Err(MeshError::NoFan { face });
            }
            expected = range.end;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pentagon() -> Mesh {
        let mut mesh = Mesh {
            materials: vec![(0, MaterialId(0))],
            ..Mesh::default()
        };
        for k in 0..5 {
            let angle = f64::from(k) * std::f64::consts::TAU / 5.0;
            let position = DVec3::new(angle.cos(), angle.sin(), 0.0);
            mesh.positions.push(position);
        }
        // Two corners on a straight side: the worst start of a fan.
        mesh.positions
            .push(0.5 * (mesh.positions[0] + mesh.positions[1]));
        mesh.push_polygon(&[0, 1, 2]);
        mesh.push_polygon(&[0, 5, 1, 2, 3, 4]);
        mesh
    }

    #[test]
    fn a_polygon_is_one_face_with_all_its_corners() {
        let mesh = pentagon();
        mesh.check().expect("sound");
        assert_eq!((mesh.face_count(), mesh.triangles.len()), (2, 5));
        assert_eq!(mesh.triangles_of(1), 1..5);
        assert_eq!(mesh.face_of_triangle(4), 1);
        let mut corners: Vec<u32> = mesh.corners_of(1).collect();
        let first = corners.iter().position(|&corner| corner == 0).expect("0");
        corners.rotate_left(first);
        assert_eq!(corners, [0, 5, 1, 2, 3, 4]);
        let [p, q, r] = mesh.triangles[1].map(|corner| mesh.positions[corner as usize]);
        assert!((q - p).cross(r - p).length() > 0.5, "a good first triangle");
    }

    #[test]
    fn triangles_that_are_no_fan_are_refused() {
        for fans in [vec![1], vec![0, 0], vec![0, 9], vec![0], vec![0, 2]] {
            let mesh = Mesh { fans, ..pentagon() };
            assert!(
                matches!(mesh.check(), Err(MeshError::NoFan { .. })),
                "{:?}",
                mesh.fans
            );
        }
    }
}
