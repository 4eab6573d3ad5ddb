//! How the faces of a mesh hang together.

use crate::talk::grouped;
use std::cmp::Ordering;
use veduta::scene::Mesh;
use veduta_geometry::DVec3;

/// Counts of what is odd in a mesh. None of it hinders a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    pub faces: usize,
    /// Faces whose corners lie on a line or in a point.
    pub without_area: usize,
    /// Edges of one face only: the mesh is not closed there.
    pub open_edges: usize,
    /// Edges of more than two faces: the mesh is no surface there.
    pub crowded_edges: usize,
    /// Vertices that no face uses.
    pub unused_vertices: usize,
}

impl Topology {
    /// Counts. Vertices at bit-equal places are one for edges: files double them where texture
    /// coordinates or normals break.
    pub fn of(mesh: &Mesh) -> Self {
        let places = places(&mesh.positions);
        let mut used = vec![false; mesh.positions.len()];
        let mut edges = Vec::new();
        let mut without_area = 0;
        for face in 0..mesh.face_count() as u32 {
            let corners: Vec<u32> = mesh.corners_of(face).collect();
            let mut around: Vec<u32> = Vec::with_capacity(corners.len());
            for &corner in &corners {
                used[corner as usize] = true;
                around.push(places[corner as usize]);
            }
            // A side without length is no edge, and what then has two sides runs there and back.
            around.dedup();
            while around.len() > 1 && around.first() == around.last() {
                around.pop();
            }
            if around.len() > 2 {
                edges.extend((0..around.len()).map(|k| {
                    let [a, b] = [around[k], around[(k + 1) % around.len()]];
                    [a.min(b), a.max(b)]
                }));
            }
            let area = mesh.triangles[mesh.triangles_of(face)]
                .iter()
                .map(|corners| {
                    let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
                    (b - a).cross(c - a)
                })
                .sum::<DVec3>();
            without_area += usize::from(area == DVec3::ZERO);
        }
        edges.sort_unstable();
        let counts = edges.chunk_by(|a, b| a == b).map(<[_]>::len);
        let (mut open_edges, mut crowded_edges) = (0, 0);
        for count in counts {
            open_edges += usize::from(count == 1);
            crowded_edges += usize::from(count > 2);
        }
        Self {
            faces: mesh.face_count(),
            without_area,
            open_edges,
            crowded_edges,
            unused_vertices: used.iter().filter(|used| !**used).count(),
        }
    }

    /// Whether nothing is odd.
    pub fn is_plain(&self) -> bool {
        let Self {
            faces,
            without_area: 0,
            open_edges: 0,
            crowded_edges: 0,
            unused_vertices: 0,
        } = *self
        else {
            return false;
        };
        faces > 0
    }

    /// What is odd, in words.
    pub fn as_text(&self) -> String {
        let rows = [
            (self.without_area, "faces without area"),
            (self.open_edges, "open edges"),
            (self.crowded_edges, "edges of more than two faces"),
            (self.unused_vertices, "unused vertices"),
        ];
        let told: Vec<String> = rows
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{} {what}", grouped(*count)))
            .collect();
        match told.as_slice() {
            [] => "no faces".into(),
            told => told.join(", "),
        }
    }
}

/// For each position the first one in order that is at the same place.
fn places(positions: &[DVec3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    let at = |index: u32| positions[index as usize];
    let compare = |a: DVec3, b: DVec3| {
        // `partial_cmp` takes -0 for 0; positions of a sound mesh are finite.
        let by = |a: f64, b: f64| a.partial_cmp(&b).unwrap_or(Ordering::Equal);
        by(a.x, b.x).then(by(a.y, b.y)).then(by(a.z, b.z))
    };
    order.sort_unstable_by(|&a, &b| compare(at(a), at(b)).then(a.cmp(&b)));
    let mut places = vec![0; positions.len()];
    for same in order.chunk_by(|&a, &b| compare(at(a), at(b)) == Ordering::Equal) {
        for &index in same {
            places[index as usize] = same[0];
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta::map::MaterialId;

    fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh {
            positions: positions.iter().map(|&p| DVec3::from(p)).collect(),
            triangles: triangles.to_vec(),
            materials: vec![(0, MaterialId(0))],
            ..Mesh::default()
        }
    }

    const CORNERS: [[f64; 3]; 4] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn a_closed_body_is_plain_even_with_corners_of_its_own_for_each_face() {
        assert!(Topology::of(&mesh(&CORNERS, &TETRAHEDRON)).is_plain());
        let apart: Vec<[f64; 3]> = TETRAHEDRON
            .iter()
            .flatten()
            .map(|&corner| {
                CORNERS[corner as usize].map(|value| if value == 0.0 { -0.0 } else { value })
            })
            .collect();
        let rows: Vec<[u32; 3]> = (0..4).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        assert!(Topology::of(&mesh(&apart, &rows)).is_plain());
    }

    #[test]
    fn what_is_odd_is_counted() {
        let mut positions = CORNERS.to_vec();
        positions.extend([[2.0, 2.0, 2.0], [5.0, 5.0, 5.0]]);
        let odd = mesh(
            &positions,
            // The tetrahedron without its last face; a fin on the edge from 0 to 1; a face that is a
            // line; vertex 5 is of no face.
            &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 1, 4], [3, 3, 2]],
        );
        assert_eq!(
            Topology::of(&odd),
            Topology {
                faces: 5,
                without_area: 1,
                // Three of the hole, two of the fin.
                open_edges: 5,
                crowded_edges: 1,
                unused_vertices: 1,
            }
        );
    }

    #[test]
    fn a_polygon_has_no_edges_inside() {
        let mut square = mesh(&[], &[]);
        square.positions = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|[x, y]| DVec3::new(x, y, 0.0))
            .to_vec();
        square.push_polygon(&[0, 1, 2, 3]);
        let found = Topology::of(&square);
        assert_eq!(
            (found.faces, found.open_edges, found.without_area),
            (1, 4, 0)
        );
    }
}
