//! Which faces of a map are stored together, so that a window of it reads little.

use crate::{FaceId, Fragment, Fragments, VisibilityMap};
use veduta_geometry::DVec2;

/// Faces of a tile: more would make a window read much beyond its border, fewer would compress worse.
const FACES_PER_TILE: usize = 1024;

/// Powers of two of the size of faces that are kept apart: large faces would make the box around their
/// tile as large, and small ones beside them be read in vain.
const SIZE_CLASS: u32 = 3;

/// Size classes; faces smaller than the last are in it.
const SIZE_CLASSES: u32 = 5;

/// Faces that are stored together, with all that is seen of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Left, top, right, bottom of the box around what is seen of them, in the image plane.
    pub bounds: [f64; 4],
    /// Faces whose fragments are stored here, ascending.
    pub faces: Vec<FaceId>,
    /// Opaque fragments, ascending.
    pub opaque: Vec<u32>,
    /// Veils, ascending.
    pub veils: Vec<u32>,
}

/// A box in the image plane.
#[derive(Clone, Copy)]
struct Box2 {
    min: DVec2,
    max: DVec2,
}

impl Box2 {
    const EMPTY: Self = Self {
        min: DVec2::INFINITY,
        max: DVec2::NEG_INFINITY,
    };

    fn add(&mut self, polygon: &[DVec2]) {
        for &vertex in polygon {
            self.min = self.min.min(vertex);
            self.max = self.max.max(vertex);
        }
    }

    /// Where along the order of storage: by size, then along a Z-shaped curve of their middles.
    fn place(&self) -> (u32, u32) {
        let size = (self.max - self.min).max_element().max(f64::MIN_POSITIVE);
        let class = (-size.log2() / f64::from(SIZE_CLASS)).clamp(0.0, f64::from(SIZE_CLASSES - 1));
        let middle = (0.5 * (self.min + self.max)).clamp(DVec2::ZERO, DVec2::splat(1.0));
        let cell = (middle * 65535.0).as_uvec2();
        (class as u32, interleaved(cell.x) | interleaved(cell.y) << 1)
    }
}

/// The lower 16 bits with a zero before each.
fn interleaved(mut bits: u32) -> u32 {
    bits = (bits | bits << 8) & 0x00ff_00ff;
    bits = (bits | bits << 4) & 0x0f0f_0f0f;
    bits = (bits | bits << 2) & 0x3333_3333;
    (bits | bits << 1) & 0x5555_5555
}

/// Shares the faces of a map out among tiles.
pub fn tiles(map: &VisibilityMap) -> Vec<Tile> {
    let mut boxes = vec![Box2::EMPTY; map.faces.len()];
    for fragments in [&map.opaque, &map.veils] {
        for fragment in fragments.iter() {
            boxes[fragment.face().index()].add(map.polygon(fragment));
        }
    }
    // A face without a fragment is only named along sides, and stored where it is named.
    let mut order: Vec<((u32, u32), FaceId)> = map
        .faces
        .ids()
        .filter(|face| boxes[face.index()].min.is_finite())
        .map(|face| (boxes[face.index()].place(), face))
        .collect();
    order.sort_unstable();

    let of_one_class = order.chunk_by(|a, b| a.0.0 == b.0.0);
    let chunks = of_one_class.flat_map(|faces| faces.chunks(FACES_PER_TILE));
    let mut tiles = Vec::new();
    let mut tile_of = vec![u32::MAX; map.faces.len()];
    for chunk in chunks {
        let mut bounds = Box2::EMPTY;
        let mut faces: Vec<FaceId> = chunk.iter().map(|&(_, face)| face).collect();
        faces.sort_unstable();
        for face in &faces {
            let of_face = boxes[face.index()];
            bounds.add(&[of_face.min, of_face.max]);
            tile_of[face.index()] = tiles.len() as u32;
        }
        tiles.push(Tile {
            bounds: [bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y],
            faces,
            opaque: Vec::new(),
            veils: Vec::new(),
        });
    }
    for index in 0..map.opaque.len() {
        tiles[tile_of[map.opaque.face(index).index()] as usize]
            .opaque
            .push(index as u32);
    }
    for index in 0..map.veils.len() {
        tiles[tile_of[map.veils.face(index).index()] as usize]
            .veils
            .push(index as u32);
    }
    tiles
}

impl Tile {
    /// The faces of the tile and those that its fragments name along their sides, ascending: a tile needs
    /// no other.
    pub fn faces_named(&self, map: &VisibilityMap) -> Vec<FaceId> {
        let mut named = self.faces.clone();
        let mut add = |fragments: &Fragments, indices: &[u32]| {
            for &index in indices {
                if let Fragment::Cut { sides, .. } = fragments.get(index as usize) {
                    named.extend(sides.iter().map(|side| side.face));
                }
            }
        };
        add(&map.opaque, &self.opaque);
        add(&map.veils, &self.veils);
        named.sort_unstable();
        named.dedup();
        named
    }
}
