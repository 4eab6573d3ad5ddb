//! The six sides of a cube around the viewer.

use crate::reproject::Orientation;
use std::fmt;
use veduta_geometry::{DMat3, DVec3};

/// A side of the cube around the viewer.
///
/// Its picture lies as in a horizontal cross seen from inside: the lower edge of [`Side::Up`] joins the
/// front, and so does the upper edge of [`Side::Down`]; the others stand upright.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// Before the viewer.
    Front,
    /// To the right.
    Right,
    /// Behind.
    Back,
    /// To the left.
    Left,
    /// Above.
    Up,
    /// Below.
    Down,
}

impl Side {
    /// All, in the order in which they are told.
    pub const ALL: [Self; 6] = [
        Self::Front,
        Self::Right,
        Self::Back,
        Self::Left,
        Self::Up,
        Self::Down,
    ];

    /// Its name, which is also a name for its file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Right => "right",
            Self::Back => "back",
            Self::Left => "left",
            Self::Up => "up",
            Self::Down => "down",
        }
    }

    /// The letter of `order` strings: r, l, u, d, f or b, as in the filter v360 of FFmpeg.
    pub fn letter(self) -> char {
        match self {
            Self::Front => 'f',
            Self::Right => 'r',
            Self::Back => 'b',
            Self::Left => 'l',
            Self::Up => 'u',
            Self::Down => 'd',
        }
    }

    /// The side of that letter.
    pub fn of_letter(letter: char) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|side| side.letter() == letter.to_ascii_lowercase())
    }

    /// Where it looks, what is to the right in its picture, and what is upwards there; each as its
    /// components to the right, upwards and forward of the viewer.
    pub fn axes(self) -> [[i8; 3]; 3] {
        match self {
            Self::Front => [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
            Self::Right => [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
            Self::Back => [[0, 0, -1], [-1, 0, 0], [0, 1, 0]],
            Self::Left => [[-1, 0, 0], [0, 0, 1], [0, 1, 0]],
            Self::Up => [[0, 1, 0], [1, 0, 0], [0, 0, -1]],
            Self::Down => [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
        }
    }

    /// How its picture is turned in the dome's world ([`Orientation`]).
    pub fn orientation(self) -> Orientation {
        // The dome's world has its third axis backward.
        let world =
            |[right, up, forward]: [i8; 3]| DVec3::from([right, up, -forward].map(f64::from));
        let [forward, _, up] = self.axes();
        Orientation::looking(world(forward), world(up)).expect("the axes of a cube")
    }

    /// Directions of the side's own eye space (x right, y down, z forward) from those of the viewer. Only signs
    /// and places of coordinates change, so that nothing is rounded.
    pub fn side_from_eye(self) -> DMat3 {
        let eye = |[right, up, forward]: [i8; 3]| DVec3::from([right, -up, forward].map(f64::from));
        let [forward, right, up] = self.axes();
        let down = up.map(|component| -component);
        DMat3::from_cols(eye(right), eye(down), eye(forward)).transpose()
    }

    /// Its place in [`Side::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_seen_from_inside() {
        let cross = |a: [i8; 3], b: [i8; 3]| {
            [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ]
        };
        for side in Side::ALL {
            let [forward, right, up] = side.axes();
            // Right, up and forward are left-handed in this order, for the viewer and on each side.
            assert_eq!(cross(right, up), forward, "{side}");
        }
    }
}
