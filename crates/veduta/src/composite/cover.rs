use super::merge::rows;
use crate::clip::{Context, Corner, Extent, Found, Grid, by_place, clip_each, listed_of_maps};
use veduta_map::{FaceId, Faces, Seen};

/// Which side of a cover is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// What lies where the cover is.
    Inside,
    /// What lies where it is not.
    Outside,
}

/// What lies of `seen` inside or outside the region that some faces cover together, nearer or not.
///
/// `is_cover` accepts those faces, of which none is seen in `seen`; opaque or not, overlapping or not.
/// The two sides of a cover add up to `seen`: they are the two parts of the same cuts. `aspect` is width
/// over height of the frame.
pub fn cover(
    faces: &Faces,
    seen: &Seen,
    is_cover: impl Fn(FaceId) -> bool + Sync,
    keep: Keep,
    aspect: f64,
) -> Seen {
    let maps = std::slice::from_ref(seen);
    let rows = rows(faces, maps);
    let extents = Extent::of_all(faces);
    let grid = Grid::choose(faces.len(), aspect, [0.0, 1.0], None);
    let context = Context {
        faces,
        extents: &extents,
        grid: &grid,
    };
    let everywhere = vec![true; grid.cells()];
    let list = listed_of_maps(&context, is_cover, &everywhere, |_| 0);
    let row = |face: FaceId| &rows[face.index()];
    let of_map: Vec<FaceId> = faces.ids().filter(|&face| row(face).is_seen()).collect();
    let in_order = by_place(&context, &of_map);
    let piles = clip_each(
        &context,
        &in_order,
        |clipper, inside: &mut Vec<Vec<Corner>>, face, pile| {
            let before = || row(face).corners(faces, face, maps);
            inside.clear();
            clipper.resume(face, before());
            clipper.subtract_covered(face, &list, inside);
            match keep {
                Keep::Outside => {}
                // All of it: in the pieces in which it was, not in those of the cover.
                Keep::Inside if clipper.pieces.is_empty() => clipper.resume(face, before()),
                Keep::Inside => {
                    clipper.resume(face, inside.iter().map(|piece| piece.iter().copied()));
                }
            }
            clipper.store(face, pile);
        },
    );
    let mut found = Found::default();
    piles.into_iter().for_each(|pile| found.add(pile));
    found.into_seen(faces)
}
