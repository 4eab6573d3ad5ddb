use crate::clip::{CellLists, Context, Extent, Found, Grid, by_place, clip_each, listed};
use veduta_geometry::DVec2;
use veduta_map::{FaceId, Faces, Fragment, Fragments, ObjectId, Seen, Side};

/// Where each face is seen once all `maps` are seen together.
///
/// Each map is what is seen of some faces of the common table `faces`, each of which belongs to one
/// map; of faces that share a plane the smaller id is seen. `aspect` is width over height of the frame.
///
/// Clipping by what is seen is enough: a fragment that is hidden in its map is hidden by something
/// nearer there.
pub fn merge(faces: &Faces, maps: &[Seen], aspect: f64) -> Seen {
    let pieces = SeenPieces::of(faces, maps);
    let extents = Extent::of_all(&pieces.outlines);
    let grid = Grid::choose(pieces.outlines.len(), aspect, [0.0, 1.0], None);
    let context = Context {
        faces: &pieces.outlines,
        extents: &extents,
        grid: &grid,
    };
    let lists: Vec<CellLists> = (0..maps.len() as u32)
        .map(|map| listed(&context, |piece| pieces.map[piece.index()] == map))
        .collect();
    // Of each map, the others' lists.
    let others: Vec<Vec<&CellLists>> = (0..lists.len())
        .map(|map| {
            let others = lists.iter().enumerate().filter(|&(other, _)| other != map);
            others.map(|(_, list)| list).collect()
        })
        .collect();
    let all: Vec<FaceId> = pieces.outlines.ids().collect();
    let in_order = by_place(&context, &all);
    let piles = clip_each(&context, &in_order, |clipper, (): &mut (), piece, pile| {
        clipper.clip(piece, &others[pieces.map[piece.index()] as usize]);
        clipper.store(piece, pile);
    });
    let mut found = Found::default();
    piles.into_iter().for_each(|pile| found.add(pile));
    let clipped = found.into_seen(&pieces.outlines);
    Seen {
        opaque: pieces.named(&clipped.opaque),
        veils: pieces.named(&clipped.veils),
    }
}

/// The fragments of all maps, as faces that can be clipped.
struct SeenPieces<'a> {
    /// Polygons of the fragments, in the order of their faces.
    outlines: Faces,
    /// Of each fragment.
    fragments: Vec<Fragment<'a>>,
    map: Vec<u32>,
}

impl<'a> SeenPieces<'a> {
    fn of(faces: &Faces, maps: &'a [Seen]) -> Self {
        let mut fragments: Vec<(Fragment<'a>, u32)> = Vec::new();
        for (seen, map) in maps.iter().zip(0..) {
            let both = seen.opaque.iter().chain(seen.veils.iter());
            fragments.extend(both.map(|fragment| (fragment, map)));
        }
        // Stable: fragments of a face stay in order.
        fragments.sort_by_key(|(fragment, _)| fragment.face());
        let mut pieces = Self {
            outlines: Faces::with_capacity(fragments.len()),
            fragments: Vec::with_capacity(fragments.len()),
            map: Vec::with_capacity(fragments.len()),
        };
        for &plane in faces.planes() {
            pieces.outlines.push_plane(plane);
        }
        for (fragment, map) in fragments {
            let face = fragment.face();
            let polygon: &[DVec2] = match fragment {
                Fragment::Whole(face) => faces.outline(face),
                Fragment::Cut { vertices, .. } => vertices,
            };
            let plane = faces.plane(face);
            // A fragment without area, but for rounding, shows nothing.
            let Some(piece) = pieces.outlines.push(polygon, plane, ObjectId(0), 0) else {
                continue;
            };
            if faces.is_veil(face) {
                pieces.outlines.set_veil(piece);
            }
            pieces.fragments.push(fragment);
            pieces.map.push(map);
        }
        pieces
    }

    /// What is left of fragments, as fragments of their faces.
    fn named(&self, clipped: &Fragments) -> Fragments {
        let mut named = Fragments::new();
        for left in clipped.iter() {
            let fragment = self.fragments[left.face().index()];
            let face = fragment.face();
            match (left, fragment) {
                (Fragment::Whole(_), Fragment::Whole(_)) => named.push_whole(face),
                (
                    Fragment::Whole(_),
                    Fragment::Cut {
                        vertices, sides, ..
                    },
                ) => named.push_cut(face, vertices.iter().copied().zip(sides.iter().copied())),
                (
                    Fragment::Cut {
                        face: piece,
                        vertices,
                        sides,
                    },
                    _,
                ) => {
                    let sides = sides.iter().map(|&side| self.side(face, piece, side));
                    named.push_cut(face, vertices.iter().copied().zip(sides));
                }
            }
        }
        named
    }

    /// The name of a side of what is left of `piece`, which is of `face`.
    fn side(&self, face: FaceId, piece: FaceId, side: Side) -> Side {
        let cutter = self.fragments[side.face.index()];
        if side.kind == Side::CROSSING {
            return Side::crossing(cutter.face());
        }
        match cutter {
            Fragment::Whole(whole) => Side {
                face: whole,
                ..side
            },
            Fragment::Cut { sides, .. } => {
                let along = sides[side.kind as usize];
                let is_own = side.face == piece;
                if is_own || along.kind < Side::SCAN {
                    along
                } else {
                    // Beyond such a side of another fragment its face goes on, or one that is nearer:
                    // where this one is seen on one side of the line, it is on the other.
                    Side::scan(face)
                }
            }
        }
    }
}
