use crate::PlaneId;
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
        /// A point of the line.
        from: DVec2,
        /// Another point of the line.
        to: DVec2,
    },
}
