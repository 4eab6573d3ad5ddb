use crate::clip::{Context, Corner, Extent, Found, Grid, by_place, clip_each, listed_of_maps};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use veduta_map::{FaceId, Faces, Fragment, Fragments, Seen};

/// Where each face is seen once all `maps` are seen together.
///
/// Each map is what is seen of some faces of the common table `faces`, each of which belongs to one
/// map; of faces that share a plane the smaller id is seen. `aspect` is width over height of the frame.
///
/// What is left of a face in its map is clipped by the faces *seen* in the others, and by all of each:
/// where such a face is hidden in its own map, something nearer hides this one too. So the lines that
/// cut are the very lines that would have cut if all had been found together, which corners of
/// fragments, rounded as they are, would miss. Maps with holes, where that is not so, come as faces that
/// are their fragments (`pieced`).
pub fn merge(faces: &Faces, maps: &[Seen], aspect: f64) -> Seen {
    Meeting::of(faces, maps, aspect).merge(faces)
}

/// Where maps meet: the cells of the frame in which faces of more than one are seen. Elsewhere all stays
/// as it is.
pub(super) struct Meeting<'a> {
    maps: &'a [Seen],
    /// By [`FaceId`].
    rows: Vec<Row>,
    extents: Vec<Extent>,
    grid: Grid,
    /// Of each cell.
    meets: Vec<bool>,
}

/// Where the fragments of a face are.
#[derive(Clone, Copy)]
pub(super) struct Row {
    /// [`Row::NO_MAP`] for a face of which nothing is seen.
    map: u32,
    /// Of the map's opaque fragments, or of its veils.
    first: u32,
    count: u32,
    /// Whether it touches a cell in which maps meet.
    meets: bool,
}

impl Row {
    const NO_MAP: u32 = u32::MAX;

    const UNSEEN: Self = Self {
        map: Self::NO_MAP,
        first: 0,
        count: 0,
        meets: false,
    };

    pub fn is_seen(&self) -> bool {
        self.map != Self::NO_MAP
    }

    fn fragments(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }

    /// What was found of `face`, whose row this is, in its map; a fragment without corners is all of the
    /// face.
    pub fn corners(
        &self,
        faces: &Faces,
        face: FaceId,
        maps: &[Seen],
    ) -> impl Iterator<Item = impl ExactSizeIterator<Item = Corner>> {
        let seen = &maps[self.map as usize];
        let fragments = if faces.is_veil(face) {
            &seen.veils
        } else {
            &seen.opaque
        };
        self.fragments().map(|index| {
            let (vertices, sides) = match fragments.get(index) {
                Fragment::Whole(_) => (&[][..], &[][..]),
                Fragment::Cut {
                    vertices, sides, ..
                } => (vertices, sides),
            };
            let both = vertices.iter().zip(sides);
            both.map(|(&point, &side)| Corner { point, side })
        })
    }
}

/// Faces for each cell: more than when visibility is found, since most have been hidden already, and a
/// cell is looked at again for each face in it.
const FACES_PER_CELL: usize = 16;

/// Cells at least: with fewer, maps would seem to meet where they only come near.
const FEWEST_CELLS: usize = 64;

/// Faces a task looks at at a time.
const FACES_PER_TASK: usize = 8192;

impl<'a> Meeting<'a> {
    /// Where `maps` meet, which are of faces of the common table.
    pub(super) fn of(faces: &Faces, maps: &'a [Seen], aspect: f64) -> Self {
        let mut rows = rows(faces, maps);
        let seen = rows.iter().filter(|row| row.is_seen()).count();
        let extents = Extent::of_all(faces);
        let cells = (seen / FACES_PER_CELL).clamp(FEWEST_CELLS, 1 << 20) as u32;
        let grid = Grid::choose(seen, aspect, [0.0, 1.0], Some(cells));
        let meets = cells_of_several(faces, &rows, &extents, &grid);
        let tasks = rows.par_chunks_mut(FACES_PER_TASK).enumerate();
        tasks.for_each(|(task, rows)| {
            for (row, face) in rows.iter_mut().zip(task * FACES_PER_TASK..) {
                if !row.is_seen() {
                    continue;
                }
                let outline = faces.outline(FaceId::from_index(face));
                grid.each_row(outline, &extents[face], |line, columns| {
                    let mut cells = columns.map(|column| grid.index(column, line));
                    row.meets = cells.any(|cell| meets[cell]);
                    !row.meets
                });
            }
        });
        Self {
            maps,
            rows,
            extents,
            grid,
            meets,
        }
    }

    /// The faces that may touch one of another map in the picture, ascending, each with its map.
    pub(super) fn faces(&self) -> Vec<(FaceId, u32)> {
        let rows = self.rows.iter().zip(0..);
        rows.filter(|(row, _)| row.meets)
            .map(|(row, face)| (FaceId(face), row.map))
            .collect()
    }

    /// Takes note that a face has another plane than before.
    pub(super) fn plane_changed(&mut self, faces: &Faces, face: FaceId) {
        self.extents[face.index()] = Extent::of(faces, face);
    }

    /// Where each face is seen once all maps are seen together.
    pub(super) fn merge(&self, faces: &Faces) -> Seen {
        let context = Context {
            faces,
            extents: &self.extents,
            grid: &self.grid,
        };
        let row = |face: FaceId| &self.rows[face.index()];
        let lists = listed_of_maps(
            &context,
            |face| row(face).meets && !faces.is_veil(face),
            &self.meets,
            |face| row(face).map,
        );
        let (meeting, apart): (Vec<FaceId>, Vec<FaceId>) = faces
            .ids()
            .filter(|&face| row(face).is_seen())
            .partition(|&face| row(face).meets);
        let mut found = Found::default();
        let mut clip = |seen: &[FaceId]| {
            let piles = clip_each(&context, seen, |clipper, (), face, pile| {
                let row = row(face);
                clipper.resume(face, row.corners(faces, face, self.maps));
                if row.meets {
                    clipper.subtract_others(face, &lists, row.map);
                }
                clipper.store(face, pile);
            });
            piles.into_iter().for_each(|pile| found.add(pile));
        };
        clip(&by_place(&context, &meeting));
        clip(&apart);
        found.into_seen(faces)
    }
}

/// Where the fragments of each face are.
pub(super) fn rows(faces: &Faces, maps: &[Seen]) -> Vec<Row> {
    let mut rows = vec![Row::UNSEEN; faces.len()];
    for (map, seen) in (0..).zip(maps) {
        let mut add = |fragments: &Fragments, veils: bool| {
            for index in 0..fragments.len() {
                let face = fragments.face(index);
                debug_assert_eq!(faces.is_veil(face), veils, "{face:?} is in the other list");
                let row = &mut rows[face.index()];
                debug_assert!(!row.is_seen() || row.map == map, "{face:?} is of two maps");
                if !row.is_seen() {
                    (row.map, row.first) = (map, index as u32);
                }
                row.count += 1;
            }
        };
        add(&seen.opaque, false);
        add(&seen.veils, true);
    }
    rows
}

/// Of each cell of the grid, whether faces of several maps touch it.
fn cells_of_several(faces: &Faces, rows: &[Row], extents: &[Extent], grid: &Grid) -> Vec<bool> {
    const NOBODY: u32 = u32::MAX;
    const SEVERAL: u32 = u32::MAX - 1;
    // The outcome is the same whoever comes first.
    let owners: Vec<AtomicU32> = (0..grid.cells()).map(|_| AtomicU32::new(NOBODY)).collect();
    let tasks = rows.par_chunks(FACES_PER_TASK).enumerate();
    tasks.for_each(|(task, rows)| {
        for (row, face) in rows.iter().zip(task * FACES_PER_TASK..) {
            if !row.is_seen() {
                continue;
            }
            let outline = faces.outline(FaceId::from_index(face));
            grid.each_row(outline, &extents[face], |line, columns| {
                for column in columns {
                    let owner = &owners[grid.index(column, line)];
                    let before = owner.load(Relaxed);
                    if before == row.map || before == SEVERAL {
                        continue;
                    }
                    let first = owner.compare_exchange(NOBODY, row.map, Relaxed, Relaxed);
                    if first.is_err_and(|before| before != row.map) {
                        owner.store(SEVERAL, Relaxed);
                    }
                }
                true
            });
        }
    });
    let owners = owners.into_iter().map(AtomicU32::into_inner);
    owners.map(|owner| owner == SEVERAL).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta_geometry::{Affine, DVec2};
    use veduta_map::{ObjectId, Side};

    #[test]
    fn where_maps_do_not_meet_fragments_stay_bit_for_bit() {
        let mut faces = Faces::new();
        let plane = faces.push_plane(Affine::new(0.0, 0.0, 1.0));
        let triangle = [[0.1, 0.1], [0.3, 0.1], [0.1, 0.3]].map(DVec2::from);
        let maps: Vec<Seen> = [0.0, 0.6]
            .iter()
            .map(|&by| {
                let outline = triangle.map(|corner| corner + by);
                let face = faces
                    .push(&outline, plane, ObjectId(0), 0)
                    .expect("has an area");
                let mut seen = Seen::default();
                let sides = [0, 1, 2].map(|index| Side::of_outline(face, index));
                let half = [outline[0], outline[1], 0.5 * (outline[1] + outline[2])];
                seen.opaque.push_cut(face, half.into_iter().zip(sides));
                seen
            })
            .collect();
        let merged = merge(&faces, &maps, 1.0);
        assert_eq!(merged.opaque.get(0), maps[0].opaque.get(0));
        assert_eq!(merged.opaque.get(1), maps[1].opaque.get(0));
        assert_eq!(merged.opaque.len(), 2);
        let meeting = Meeting::of(&faces, &maps, 1.0);
        assert_eq!(meeting.faces(), []);
    }
}
