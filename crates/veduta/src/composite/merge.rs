use crate::clip::{CellLists, Context, Corner, Extent, Found, Grid, by_place, clip_each, listed};
use std::ops::Range;
use veduta_map::{FaceId, Faces, Fragment, Fragments, Seen};

/// Where each face is seen once all `maps` are seen together.
///
/// Each map is what is seen of some faces of the common table `faces`, each of which belongs to one
/// map; of faces that share a plane the smaller id is seen. `aspect` is width over height of the frame.
///
/// What is left of a face in its map is clipped by the faces *seen* in the others, and by all of each:
/// where such a face is hidden in its own map, something nearer hides this one too. So the lines that
/// cut are the very lines that would have cut if all had been found together, which corners of
/// fragments, rounded as they are, would miss.
pub fn merge(faces: &Faces, maps: &[Seen], aspect: f64) -> Seen {
    let rows: Vec<Row> = rows(faces, maps);
    let mut row_of = vec![NOT_SEEN; faces.len()];
    for (row, index) in rows.iter().zip(0..) {
        row_of[row.face.index()] = index;
    }
    let extents = Extent::of_all(faces);
    let grid = Grid::choose(rows.len(), aspect, [0.0, 1.0], None);
    let context = Context {
        faces,
        extents: &extents,
        grid: &grid,
    };
    let is_of = |face: FaceId, map: usize| {
        let row = row_of[face.index()];
        row != NOT_SEEN && rows[row as usize].map == map
    };
    let lists: Vec<CellLists> = (0..maps.len())
        .map(|map| listed(&context, |face| is_of(face, map)))
        .collect();
    // Of each map, the others' lists.
    let others: Vec<Vec<&CellLists>> = (0..lists.len())
        .map(|map| {
            let others = lists.iter().enumerate().filter(|&(other, _)| other != map);
            others.map(|(_, list)| list).collect()
        })
        .collect();
    let seen: Vec<FaceId> = rows.iter().map(|row| row.face).collect();
    let in_order = by_place(&context, &seen);
    let piles = clip_each(
        &context,
        &in_order,
        |clipper, corners: &mut Vec<Vec<Corner>>, face, pile| {
            let row = &rows[row_of[face.index()] as usize];
            let seen = &maps[row.map];
            let fragments = if faces.is_veil(face) {
                &seen.veils
            } else {
                &seen.opaque
            };
            corners.resize_with(row.fragments.len(), Vec::new);
            for (corners, index) in corners.iter_mut().zip(row.fragments.clone()) {
                corners.clear();
                if let Fragment::Cut {
                    vertices, sides, ..
                } = fragments.get(index)
                {
                    let both = vertices.iter().zip(sides);
                    corners.extend(both.map(|(&point, &side)| Corner { point, side }));
                }
            }
            clipper.resume(face, corners.iter().map(Vec::as_slice));
            clipper.subtract_listed(face, &others[row.map], |_| true);
            clipper.store(face, pile);
        },
    );
    let mut found = Found::default();
    piles.into_iter().for_each(|pile| found.add(pile));
    found.into_seen(faces)
}

/// Where fragments of a face are.
struct Row {
    face: FaceId,
    map: usize,
    /// Of the map's opaque fragments, or of its veils.
    fragments: Range<usize>,
}

const NOT_SEEN: u32 = u32::MAX;

/// The seen faces of all maps, ascending.
fn rows(faces: &Faces, maps: &[Seen]) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for (map, seen) in maps.iter().enumerate() {
        let mut add = |fragments: &Fragments, veils: bool| {
            for index in 0..fragments.len() {
                let face = fragments.face(index);
                debug_assert_eq!(faces.is_veil(face), veils, "{face:?} is in the other list");
                match rows.last_mut() {
                    Some(last) if last.face == face && last.map == map => last.fragments.end += 1,
                    _ => rows.push(Row {
                        face,
                        map,
                        fragments: index..index + 1,
                    }),
                }
            }
        };
        add(&seen.opaque, false);
        add(&seen.veils, true);
    }
    rows.sort_unstable_by_key(|row| row.face);
    rows
}
