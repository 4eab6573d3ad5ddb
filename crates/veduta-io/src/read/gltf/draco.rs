//! Primitives that are compressed by Draco.
//!
//! KHR_draco_mesh_compression. The streams are decoded by the crate `draco-core`, a port of Draco to
//! Rust. What it may allocate is bounded by what is left of the budget.

use super::Problem;
use super::accessor::{Component, Decompressed};
use crate::read::budget::Budget;
use draco_core::{DataType, DecodeLimits, DecoderBuffer, ErrorKind, MeshDecoder, PointIndex};

/// Bytes that a face takes while it is decoded, about: its corners, and three rows of each of the
/// tables that tell which corners lie opposite one another.
const BYTES_PER_FACE: u64 = 64;

/// A decoded primitive.
pub struct Decoded {
    mesh: draco_core::Mesh,
}

impl Decoded {
    /// Decodes a stream.
    pub fn new(stream: &[u8], budget: &Budget) -> Result<Option<Self>, Problem> {
        let left = budget.left();
        let limits = DecodeLimits::default()
            .with_max_decoded_bytes(left)
            .with_max_faces(left / BYTES_PER_FACE);
        let mut buffer = DecoderBuffer::new(stream).with_limits(limits);
        let mut mesh = draco_core::Mesh::new();
        match MeshDecoder::new().decode(&mut buffer, &mut mesh) {
            Ok(()) => Ok(Some(Self { mesh })),
            // It does not tell how much it would have taken, only that it is more than is left.
            Err(error) if error.kind() == ErrorKind::LimitExceeded => {
                Err(budget.refusal(left.saturating_add(1)))
            }
            Err(error) => Err(Problem::Compressed {
                codec: "Draco",
                reason: crate::read::files::shortened(&error.to_string()),
            }),
        }
    }

    /// Number of vertices.
    pub fn vertices(&self) -> u64 {
        self.mesh.num_points() as u64
    }

    /// Number of triangles.
    pub fn triangles(&self) -> u64 {
        self.mesh.num_faces() as u64
    }

    /// The corners of the triangles, three for each.
    pub fn corners(&self) -> Vec<u32> {
        let faces = self.mesh.faces().iter();
        faces.flat_map(|face| face.map(|corner| corner.0)).collect()
    }

    /// The attribute of a number, one element for each vertex; `None` if there is none.
    pub fn attribute(&self, id: u64, budget: &mut Budget) -> Result<Option<Decompressed>, Problem> {
        let id = u32::try_from(id).ok();
        let Some(attribute) = id.and_then(|id| self.mesh.attribute_by_unique_id(id)) else {
            return Ok(None);
        };
        let component = match attribute.data_type() {
            DataType::Int8 => Component::I8,
            DataType::Uint8 => Component::U8,
            DataType::Int16 => Component::I16,
            DataType::Uint16 => Component::U16,
            DataType::Uint32 => Component::U32,
            DataType::Float32 => Component::F32,
            other => {
                return Err(Problem::Illegal {
                    found: format!("compressed as {other:?}"),
                    expected: "a type of number that accessors have",
                });
            }
        };
        let components = usize::from(attribute.num_components());
        let size = component.size() * components;
        let vertices = self.vertices();
        budget.charge(vertices, size)?;
        let values = attribute.buffer().data();
        let stride = usize::try_from(attribute.byte_stride()).unwrap_or(usize::MAX);
        let mut bytes = Vec::with_capacity(vertices as usize * size);
        for vertex in 0..vertices as u32 {
            let value = attribute.mapped_index(PointIndex(vertex)).0 as usize;
            let start = value.checked_mul(stride);
            let element = start.and_then(|start| values.get(start..start.checked_add(size)?));
            let Some(element) = element else {
                return Err(Problem::Compressed {
                    codec: "Draco",
                    reason: format!("vertex {vertex} lacks an attribute"),
                });
            };
            bytes.extend_from_slice(element);
        }
        Ok(Some(Decompressed {
            component,
            components,
            count: vertices,
            bytes,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_that_the_budget_cannot_bear_is_too_large_rather_than_damaged() {
        let glb = include_bytes!("../../../tests/data/draco-sequential.glb");
        let start = glb.windows(5).position(|bytes| bytes == b"DRACO");
        let stream = &glb[start.expect("a stream")..];
        let mut budget = Budget::new();
        let decoded = Decoded::new(stream, &budget);
        assert!(decoded.is_ok_and(|decoded| decoded.is_some_and(|d| d.triangles() == 128)));
        budget.charge(budget.left(), 1).expect("all that is left");
        let refused = Decoded::new(stream, &budget);
        assert!(matches!(refused, Err(Problem::TooLarge { .. })));
    }
}
