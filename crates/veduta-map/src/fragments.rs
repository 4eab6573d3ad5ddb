use crate::FaceId;
use veduta_geometry::DVec2;

/// What lies along a side of a cut fragment, before lines are numbered.
///
/// Engines work in parallel and cannot number lines as they go; they name each side by what made
/// it, and [`crate::Lines`] gives equal lines one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(C)]
pub struct Side {
    /// The face that cut here.
    pub face: FaceId,
    /// Which of that face's outline sides (the one that starts at this vertex), or
    /// [`Side::CROSSING`] or [`Side::SCAN`].
    pub kind: u32,
}

impl Side {
    /// The planes of the fragment's own face and of `face` cross here.
    pub const CROSSING: u32 = u32::MAX;
    /// A scanline of an engine; `face` is the fragment's own.
    pub const SCAN: u32 = u32::MAX - 1;

    /// Side `index` of the outline of `face`.
    #[inline(always)]
    pub fn of_outline(face: FaceId, index: usize) -> Self {
        Self {
            face,
            kind: index as u32,
        }
    }

    /// The line in which the fragment's own plane crosses that of `face`.
    #[inline(always)]
    pub fn crossing(face: FaceId) -> Self {
        Self {
            face,
            kind: Self::CROSSING,
        }
    }

    /// A scanline inside `face`.
    #[inline(always)]
    pub fn scan(face: FaceId) -> Self {
        Self {
            face,
            kind: Self::SCAN,
        }
    }
}

/// One fragment: a region in which one face is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fragment<'a> {
    /// The whole outline of the face.
    Whole(FaceId),
    /// A convex, positively wound polygon of the face.
    Cut {
        /// The face.
        face: FaceId,
        /// The polygon.
        vertices: &'a [DVec2],
        /// `sides[i]` runs from `vertices[i]` to the next vertex.
        sides: &'a [Side],
    },
}

impl Fragment<'_> {
    /// The face that is seen.
    pub fn face(&self) -> FaceId {
        match *self {
            Fragment::Whole(face) | Fragment::Cut { face, .. } => face,
        }
    }
}

/// Fragments in ascending order of face.
///
/// A face seen whole costs a number here and no geometry, and most seen faces are seen whole.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fragments {
    /// `(face, first vertex)` of each fragment; whole faces have no vertices.
    entries: Vec<(FaceId, u32)>,
    vertices: Vec<DVec2>,
    sides: Vec<Side>,
}

impl Fragments {
    /// No fragments.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a face that is seen whole.
    ///
    /// # Panics
    /// In debug builds, if faces do not ascend.
    #[inline]
    pub fn push_whole(&mut self, face: FaceId) {
        debug_assert!(
            self.entries.last().is_none_or(|last| last.0 < face),
            "faces ascend"
        );
        self.entries.push((face, self.vertices.len() as u32));
    }

    /// Adds a convex piece of a face.
    ///
    /// # Panics
    /// If `vertices` and `sides` differ in length or are fewer than three; in debug builds, if faces
    /// do not ascend.
    #[inline]
    pub fn push_cut(
        &mut self,
        face: FaceId,
        vertices: impl ExactSizeIterator<Item = (DVec2, Side)>,
    ) {
        assert!(
            vertices.len() >= 3,
            "a fragment has at least three vertices"
        );
        debug_assert!(
            self.entries.last().is_none_or(|last| last.0 <= face),
            "faces ascend"
        );
        self.entries.push((face, self.vertices.len() as u32));
        for (vertex, side) in vertices {
            self.vertices.push(vertex);
            self.sides.push(side);
        }
    }

    /// Fragments from their columns: `(face, first vertex)` of each, then all vertices and sides.
    ///
    /// # Panics
    /// If the columns do not fit: faces or vertices do not ascend, `sides` is not as long as
    /// `vertices`, or a cut fragment has fewer than three vertices.
    pub fn from_columns(
        entries: Vec<(FaceId, u32)>,
        vertices: Vec<DVec2>,
        sides: Vec<Side>,
    ) -> Self {
        assert_eq!(vertices.len(), sides.len(), "a side for each vertex");
        let count = u32::try_from(vertices.len()).expect("at most u32::MAX vertices");
        let after = entries
            .iter()
            .skip(1)
            .copied()
            .chain([(FaceId(u32::MAX), count)]);
        for (&(face, start), (next_face, next_start)) in entries.iter().zip(after) {
            let fits = match next_start.checked_sub(start) {
                Some(0) => face < next_face,
                Some(corners) => corners >= 3 && face <= next_face,
                None => false,
            };
            assert!(
                fits,
                "fragments of {face:?} do not fit: vertices {start}..{next_start}"
            );
        }
        Self {
            entries,
            vertices,
            sides,
        }
    }

    /// The columns, as [`Fragments::from_columns`] takes them.
    pub fn columns(&self) -> (&[(FaceId, u32)], &[DVec2], &[Side]) {
        (&self.entries, &self.vertices, &self.sides)
    }

    /// Number of fragments.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Fragment `index`.
    #[inline]
    pub fn get(&self, index: usize) -> Fragment<'_> {
        let (face, start) = self.entries[index];
        let end = self
            .entries
            .get(index + 1)
            .map_or(self.vertices.len(), |next| next.1 as usize);
        let start = start as usize;
        if start == end {
            Fragment::Whole(face)
        } else {
            Fragment::Cut {
                face,
                vertices: &self.vertices[start..end],
                sides: &self.sides[start..end],
            }
        }
    }

    /// The face of fragment `index`.
    #[inline]
    pub fn face(&self, index: usize) -> FaceId {
        self.entries[index].0
    }

    /// All fragments in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Fragment<'_>> {
        (0..self.len()).map(|index| self.get(index))
    }

    /// Vertices of all cut fragments together.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }
}

/// What is seen of some faces: what an engine finds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// Where opaque faces are seen; these do not overlap.
    pub opaque: Fragments,
    /// Where veils are seen: cut by the opaque faces in front of them, not by one another.
    pub veils: Fragments,
}
