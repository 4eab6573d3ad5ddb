use crate::{FaceId, Faces, Fragment, Fragments, LineId, PlaneId, Side};
use std::collections::HashMap;
use veduta_geometry::DVec2;

/// A side of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FrameSide {
    /// x = 0.
    Left,
    /// x = 1.
    Right,
    /// y = 0.
    Top,
    /// y = 1.
    Bottom,
}

/// What made a line of the image plane.
///
/// Neighbouring fragments name the same line; a fragment's vertex is where two lines meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// The edge of a face, and the straight line it lies on. Every face with an edge between these
    /// points names the same line.
    Edge {
        /// The end point that is smaller by (x, y).
        from: DVec2,
        /// The other end point.
        to: DVec2,
    },
    /// The line in which two planes have the same nearness; the smaller id first.
    Crossing {
        /// The two planes.
        planes: [PlaneId; 2],
    },
    /// The border of the picture.
    Frame(FrameSide),
    /// A scanline at which an engine cut a face: not an edge of anything seen. Both sides of it show
    /// the same face.
    Scan {
        /// The end point of the cut that is smaller by (x, y).
        from: DVec2,
        /// The other end point.
        to: DVec2,
    },
}

/// The lines along the sides of fragments, each with one number however many sides it has.
///
/// Made on demand from the sides' names ([`Side`]): most uses of a map need no lines. Numbers are given
/// in the order in which fragments first name a line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lines {
    lines: Vec<Line>,
    /// `sides[start[i]..start[i + 1]]` are the lines along fragment `i`.
    start: Vec<u32>,
    sides: Vec<LineId>,
}

impl Lines {
    /// Numbers the lines of `fragments`.
    ///
    /// # Panics
    /// If a fragment or side names a face that is not in `faces`.
    pub fn of(faces: &Faces, fragments: &Fragments) -> Self {
        let mut lines = Self::default();
        let mut numbers = HashMap::new();
        for fragment in fragments.iter() {
            lines.start.push(lines.sides.len() as u32);
            match fragment {
                Fragment::Whole(face) => {
                    for index in 0..faces.outline(face).len() {
                        lines.push(&mut numbers, outline_line(faces, face, index));
                    }
                }
                Fragment::Cut {
                    face,
                    vertices,
                    sides,
                } => {
                    for (index, &side) in sides.iter().enumerate() {
                        let ends = [vertices[index], vertices[(index + 1) % vertices.len()]];
                        lines.push(&mut numbers, side_line(faces, face, side, ends));
                    }
                }
            }
        }
        lines.start.push(lines.sides.len() as u32);
        lines
    }

    fn push(&mut self, numbers: &mut HashMap<Key, LineId>, line: Line) {
        let next = LineId::from_index(self.lines.len());
        let number = *numbers.entry(Key::of(&line)).or_insert(next);
        if number == next {
            self.lines.push(line);
        }
        self.sides.push(number);
    }

    /// Number of lines.
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// Whether there is no line.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// What made a line.
    pub fn line(&self, id: LineId) -> &Line {
        &self.lines[id.index()]
    }

    /// The lines along the sides of fragment `index`, the one from its first vertex first.
    pub fn along(&self, index: usize) -> &[LineId] {
        &self.sides[self.start[index] as usize..self.start[index + 1] as usize]
    }
}

/// The line along a side of a cut fragment of `face`.
fn side_line(faces: &Faces, face: FaceId, side: Side, ends: [DVec2; 2]) -> Line {
    match side.kind {
        Side::CROSSING => {
            let [mine, other] = [faces.plane(face), faces.plane(side.face)];
            Line::Crossing {
                planes: [mine.min(other), mine.max(other)],
            }
        }
        Side::SCAN => {
            let [from, to] = in_order(ends);
            Line::Scan { from, to }
        }
        index => outline_line(faces, side.face, index as usize),
    }
}

/// The line along a side of a face's outline.
fn outline_line(faces: &Faces, face: FaceId, index: usize) -> Line {
    let outline = faces.outline(face);
    let [from, to] = in_order([outline[index], outline[(index + 1) % outline.len()]]);
    // Clipping puts vertices on the frame exactly.
    if from.x == to.x && (from.x == 0.0 || from.x == 1.0) {
        Line::Frame(if from.x == 0.0 {
            FrameSide::Left
        } else {
            FrameSide::Right
        })
    } else if from.y == to.y && (from.y == 0.0 || from.y == 1.0) {
        Line::Frame(if from.y == 0.0 {
            FrameSide::Top
        } else {
            FrameSide::Bottom
        })
    } else {
        Line::Edge { from, to }
    }
}

fn in_order([p, q]: [DVec2; 2]) -> [DVec2; 2] {
    if (p.x, p.y) <= (q.x, q.y) {
        [p, q]
    } else {
        [q, p]
    }
}

/// What makes two lines the same: equal to the bit.
#[derive(PartialEq, Eq, Hash)]
enum Key {
    Edge([u64; 4]),
    Crossing([PlaneId; 2]),
    Frame(FrameSide),
    Scan([u64; 4]),
}

impl Key {
    fn of(line: &Line) -> Self {
        let bits = |from: DVec2, to: DVec2| [from.x, from.y, to.x, to.y].map(f64::to_bits);
        match *line {
            Line::Edge { from, to } => Self::Edge(bits(from, to)),
            Line::Crossing { planes } => Self::Crossing(planes),
            Line::Frame(side) => Self::Frame(side),
            Line::Scan { from, to } => Self::Scan(bits(from, to)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Affine, ObjectId};

    /// The left half of the frame, as two triangles in planes of their own.
    fn left_half() -> Faces {
        let corners =
            [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
        let mut faces = Faces::new();
        for (source, triangle) in [[0, 1, 2], [0, 2, 3]].into_iter().enumerate() {
            let plane = faces.push_plane(Affine::new(0.0, source as f64, 1.0));
            let outline = triangle.map(|corner: usize| corners[corner]);
            faces
                .push(&outline, plane, ObjectId(0), source as u32)
                .expect("a triangle with area");
        }
        faces
    }

    #[test]
    fn neighbours_name_the_same_line_and_the_frame_is_one_line_a_side() {
        let faces = left_half();
        let mut fragments = Fragments::new();
        fragments.push_whole(FaceId(0));
        fragments.push_whole(FaceId(1));
        let lines = Lines::of(&faces, &fragments);
        assert_eq!(lines.along(0).len(), 3);
        let shared: Vec<_> = lines
            .along(0)
            .iter()
            .filter(|line| lines.along(1).contains(line))
            .collect();
        let diagonal = Line::Edge {
            from: DVec2::ZERO,
            to: DVec2::new(0.5, 1.0),
        };
        assert_eq!(shared.len(), 1);
        assert_eq!(*lines.line(*shared[0]), diagonal);
        let frame = (0..lines.len() as u32)
            .filter(|&id| matches!(lines.line(LineId(id)), Line::Frame(_)))
            .count();
        assert_eq!(frame, 3, "left, top and bottom");
        assert_eq!(lines.len(), 5);
    }

    #[test]
    fn both_faces_of_a_crossing_name_one_line() {
        let faces = left_half();
        let mut fragments = Fragments::new();
        for (face, other) in [(0, 1), (1, 0)] {
            let [face, other] = [face, other].map(FaceId);
            let corners = faces
                .outline(face)
                .iter()
                .enumerate()
                .map(|(index, &vertex)| {
                    let side = if index == 0 {
                        Side::crossing(other)
                    } else {
                        Side::of_outline(face, index)
                    };
                    (vertex, side)
                });
            fragments.push_cut(face, corners);
        }
        let lines = Lines::of(&faces, &fragments);
        assert_eq!(lines.along(0)[0], lines.along(1)[0]);
        let planes = [PlaneId(0), PlaneId(1)];
        assert_eq!(*lines.line(lines.along(0)[0]), Line::Crossing { planes });
    }
}
