//! What has been found seen so far, until it is put in order.
//!
//! Faces are clipped in the order of their place in the frame, so that those which are compared lie
//! together in memory; and mending replaces what was found of a face. Both are easy while fragments
//! lie in piles and an entry for each face tells where. [`Found::into_seen`] sorts once, at the end.

use super::pieces::{Corner, Pieces};
use rayon::prelude::*;
use veduta_geometry::DVec2;
use veduta_map::{FaceId, Faces, Fragments, Seen, Side};

/// Fragments of one task, in the order in which it found them.
#[derive(Default)]
pub(crate) struct Pile {
    /// `corners[start[i]..start[i + 1]]` are fragment `i`; none if the face is seen whole.
    start: Vec<u32>,
    corners: Vec<Corner>,
    /// Which of them are of which face; `pile` is set when the pile is added to [`Found`].
    entries: Vec<Entry>,
    /// Faces cut by a crossing of planes.
    pub pierced: usize,
    /// Faces of which a face in the same plane hid something.
    pub tied: usize,
}

/// Where the fragments of a face are.
#[derive(Clone, Copy)]
pub(crate) struct Entry {
    pub face: FaceId,
    pile: u32,
    first: u32,
    count: u32,
}

/// All piles, and an entry for each face that is seen.
#[derive(Default)]
pub(crate) struct Found {
    piles: Vec<Pile>,
    pub entries: Vec<Entry>,
}

impl Pile {
    /// Adds what is left of a face; nothing if that is nothing.
    pub fn push(&mut self, face: FaceId, pieces: &Pieces) {
        let first = self.start.len() as u32;
        if pieces.touched() {
            for piece in pieces.iter() {
                self.start.push(self.corners.len() as u32);
                self.corners.extend_from_slice(piece);
            }
        } else {
            self.start.push(self.corners.len() as u32);
        }
        let count = self.start.len() as u32 - first;
        if count > 0 {
            self.entries.push(Entry {
                face,
                pile: u32::MAX,
                first,
                count,
            });
        }
    }

    fn fragment(&self, index: u32) -> &[Corner] {
        let start = self.start[index as usize] as usize;
        let end = self
            .start
            .get(index as usize + 1)
            .map_or(self.corners.len(), |&end| end as usize);
        &self.corners[start..end]
    }
}

impl Found {
    /// Adds a task's pile, and an entry for each of its faces.
    pub fn add(&mut self, mut pile: Pile) {
        let index = self.piles.len() as u32;
        let entries = std::mem::take(&mut pile.entries);
        self.entries.extend(entries.iter().map(|&entry| Entry {
            pile: index,
            ..entry
        }));
        self.piles.push(pile);
    }

    /// The fragments of an entry; one without corners is the whole face.
    pub fn fragments(&self, entry: Entry) -> impl Iterator<Item = &[Corner]> {
        let pile = &self.piles[entry.pile as usize];
        (entry.first..entry.first + entry.count).map(|index| pile.fragment(index))
    }

    /// The polygons of an entry.
    pub fn polygons<'a>(
        &'a self,
        faces: &'a Faces,
        entry: Entry,
    ) -> impl Iterator<Item = impl Iterator<Item = DVec2> + 'a> {
        self.fragments(entry).map(move |corners| {
            let whole = if corners.is_empty() {
                faces.outline(entry.face)
            } else {
                &[]
            };
            whole
                .iter()
                .copied()
                .chain(corners.iter().map(|corner| corner.point))
        })
    }

    /// The fragments by face.
    pub fn into_seen(mut self, faces: &Faces) -> Seen {
        self.entries.par_sort_unstable_by_key(|entry| entry.face);
        let veils: Vec<Entry> = self
            .entries
            .iter()
            .copied()
            .filter(|entry| faces.is_veil(entry.face))
            .collect();
        if !veils.is_empty() {
            self.entries.retain(|entry| !faces.is_veil(entry.face));
        }
        Seen {
            opaque: self.in_columns(&self.entries),
            veils: self.in_columns(&veils),
        }
    }

    /// The fragments of `entries`, in their order.
    fn in_columns(&self, entries: &[Entry]) -> Fragments {
        // Lengths first, so that tasks can fill the columns side by side.
        let tasks: Vec<&[Entry]> = entries.chunks(16 * 1024).collect();
        let lengths: Vec<(usize, usize)> = tasks
            .par_iter()
            .map(|entries| {
                let fragments = entries.iter().map(|entry| entry.count as usize).sum();
                let corners = entries.iter().flat_map(|&entry| self.fragments(entry));
                (fragments, corners.map(<[Corner]>::len).sum())
            })
            .collect();
        let fragments = lengths.iter().map(|length| length.0).sum();
        let corners = lengths.iter().map(|length| length.1).sum();
        let mut rows = vec![(FaceId(0), 0); fragments];
        let mut vertices = vec![DVec2::ZERO; corners];
        let mut sides = vec![Side::of_outline(FaceId(0), 0); corners];
        {
            let (mut rows, mut vertices, mut sides) =
                (&mut rows[..], &mut vertices[..], &mut sides[..]);
            let mut first = 0;
            rayon::scope(|scope| {
                for (&entries, &(fragments, corners)) in tasks.iter().zip(&lengths) {
                    let (task_rows, task_vertices, task_sides);
                    (task_rows, rows) = std::mem::take(&mut rows).split_at_mut(fragments);
                    (task_vertices, vertices) = std::mem::take(&mut vertices).split_at_mut(corners);
                    (task_sides, sides) = std::mem::take(&mut sides).split_at_mut(corners);
                    let start = first;
                    first += corners;
                    scope.spawn(move |_| {
                        self.fill(entries, start, task_rows, task_vertices, task_sides);
                    });
                }
            });
        }
        Fragments::from_columns(rows, vertices, sides)
    }

    fn fill(
        &self,
        entries: &[Entry],
        mut start: usize,
        rows: &mut [(FaceId, u32)],
        vertices: &mut [DVec2],
        sides: &mut [Side],
    ) {
        let mut row = 0;
        let mut at = 0;
        for &entry in entries {
            for corners in self.fragments(entry) {
                rows[row] = (entry.face, start as u32);
                row += 1;
                for corner in corners {
                    vertices[at] = corner.point;
                    sides[at] = corner.side;
                    at += 1;
                }
                start += corners.len();
            }
        }
    }
}
