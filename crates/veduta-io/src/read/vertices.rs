//! Vertices of a mesh where a file counts positions and attributes apart.

/// Finds the vertices of one mesh after another that corners share: a vertex is a combination of a
/// position and its attributes.
#[derive(Debug)]
pub(crate) struct Combinations {
    /// For each position: the mesh that last used it, and its newest vertex there.
    newest: Vec<(u32, u32)>,
    /// For each vertex of the current mesh: its attributes, and the vertex made before it at the
    /// same position.
    vertices: Vec<([u32; 2], u32)>,
    mesh: u32,
}

/// The index of nothing.
const NONE: u32 = u32::MAX;

/// Older vertices of a position that are looked at before a new one is made. Real models have a few;
/// without a bound, a thousand combinations at one position would cost their square.
const MOST_OLDER: usize = 64;

impl Combinations {
    /// For meshes of a file with so many positions.
    pub fn new(positions: usize) -> Self {
        Self {
            newest: vec![(NONE, NONE); positions],
            vertices: Vec::new(),
            mesh: 0,
        }
    }

    /// Begins the next mesh.
    pub fn begin_mesh(&mut self) {
        self.mesh += 1;
        self.vertices.clear();
    }

    /// The vertex for a position with attributes, and whether it is new; vertices count from 0.
    #[inline]
    pub fn shared(&mut self, position: u32, attributes: [u32; 2]) -> (u32, bool) {
        let (mesh, newest) = self.newest[position as usize];
        let newest = if mesh == self.mesh { newest } else { NONE };
        let mut known = newest;
        for _ in 0..MOST_OLDER {
            if known == NONE {
                break;
            }
            let (found, older) = self.vertices[known as usize];
            if found == attributes {
                return (known, false);
            }
            known = older;
        }
        let made = self.vertices.len() as u32;
        self.vertices.push((attributes, newest));
        self.newest[position as usize] = (self.mesh, made);
        (made, true)
    }

    /// A new vertex that no other corner shares.
    #[cfg(feature = "obj")]
    pub fn own(&mut self) -> u32 {
        self.vertices.push(([NONE; 2], NONE));
        self.vertices.len() as u32 - 1
    }
}
