//! Which faces of a map are stored together, so that a window of it reads little.

use crate::{FaceId, Fragment, Fragments, VisibilityMap};
use veduta_geometry::DVec2;

/// Faces of a tile at most: more would make a window read much beyond its border, fewer would compress
/// worse.
const FACES_PER_TILE: usize = 768;

/// Side of the windows, as a share of the frame's, that tiles are cut for. A larger one would leave tiles
/// long, a smaller one would cut large faces apart from small ones at any price.
const WINDOW: f64 = 0.125;

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

    /// How likely a window somewhere in the frame is to touch it, but for a factor.
    fn exposure(&self) -> f64 {
        let sides = self.max - self.min + WINDOW;
        sides.x * sides.y
    }
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
    let mut shown: Vec<FaceId> = map
        .faces
        .ids()
        .filter(|face| boxes[face.index()].min.is_finite())
        .collect();
    let mut tiles = Vec::new();
    let mut tile_of = vec![u32::MAX; map.faces.len()];
    share_out(&mut shown, &boxes, &mut |faces| {
        let bounds = around(faces, &boxes);
        for face in &*faces {
            tile_of[face.index()] = tiles.len() as u32;
        }
        faces.sort_unstable();
        tiles.push(Tile {
            bounds: [bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y],
            faces: faces.to_vec(),
            opaque: Vec::new(),
            veils: Vec::new(),
        });
    });
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

/// Calls `take` with the faces of each tile.
///
/// Faces are parted in two, and each part again, until few enough are left: by where their middles lie
/// along x or along y, or the largest from the others, whichever makes windows read least. (In the order
/// of a curve through the frame, cut into equal lengths, tiles are large where a piece crosses from one
/// quarter to another: on a terrain, windows read twice as much.)
fn share_out(faces: &mut [FaceId], boxes: &[Box2], take: &mut impl FnMut(&mut [FaceId])) {
    if faces.len() <= FACES_PER_TILE {
        if !faces.is_empty() {
            take(faces);
        }
        return;
    }
    let of = |face: FaceId| &boxes[face.index()];
    let x = |face: FaceId| of(face).min.x + of(face).max.x;
    let y = |face: FaceId| of(face).min.y + of(face).max.y;
    let smallness = |face: FaceId| -(of(face).max - of(face).min).max_element();
    let half = faces.len() / 2;
    let ways: [(&dyn Fn(FaceId) -> f64, usize); 4] = [
        (&x, half),
        (&y, half),
        (&smallness, half),
        (&smallness, FACES_PER_TILE),
    ];
    let part = |faces: &mut [FaceId], (key, first): (&dyn Fn(FaceId) -> f64, usize)| {
        faces.select_nth_unstable_by(first, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    };
    let mut parted = faces.to_vec();
    let bytes_read = |way: (&dyn Fn(FaceId) -> f64, usize)| {
        part(&mut parted, way);
        let (first, second) = parted.split_at(way.1);
        let read = |faces: &[FaceId]| faces.len() as f64 * around(faces, boxes).exposure();
        read(first) + read(second)
    };
    let costs = ways.map(bytes_read);
    let best = (0..ways.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    let way = ways[best.expect("there are some")];
    drop(parted);
    part(faces, way);
    let first = way.1;
    let (first, second) = faces.split_at_mut(first);
    share_out(first, boxes, take);
    share_out(second, boxes, take);
}

/// The box around what is seen of some faces.
fn around(faces: &[FaceId], boxes: &[Box2]) -> Box2 {
    let mut all = Box2::EMPTY;
    for face in faces {
        let Box2 { min, max } = boxes[face.index()];
        all.add(&[min, max]);
    }
    all
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
