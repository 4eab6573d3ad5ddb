//! Where the sides of a cube lie in one picture: strips, crosses, and those of video and OpenEXR.

use super::{Side, Turn};
use crate::accumulate::Picture;
use std::fmt;
use std::str::FromStr;

/// Where the sides of a cube lie in one picture, a grid of square cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    columns: u32,
    rows: u32,
    cells: Vec<Cell>,
    spacing: Spacing,
}

/// A side in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Column from the left, counted from 0.
    pub column: u32,
    /// Row from the top.
    pub row: u32,
    /// What lies there.
    pub side: Side,
    /// How it lies there, from how a [`Side`] lies by itself.
    pub turn: Turn,
}

/// What is even along the edges of a side's picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spacing {
    /// The plane, as of any perspective picture.
    #[default]
    Plane,
    /// The angle (equi-angular cube maps).
    Angle,
    /// The plane; and the outermost pixels' centres, not their borders, lie on the cube's edges, as in
    /// environment maps of OpenEXR.
    PlaneWithBorder,
}

/// Why a name is that of no layout.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// No layout has the name.
    #[error("expected one of {}", Layout::NAMES.join(", "))]
    UnknownName,
    /// The order does not name each side once.
    #[error(
        "expected each of the letters r, l, u, d, f and b (right, left, up, down, front, back) once, such as rludfb"
    )]
    Order,
    /// The rotations are not six digits of quarters.
    #[error(
        "expected six digits from 0 to 3, quarters clockwise, in the order of the sides, such as 000000"
    )]
    Rotations,
    /// The layout has its own order.
    #[error(
        "the sides of {0} have one order; --order and --rotations are for 6x1, 1x6, 3x2 and 2x3"
    )]
    FixedOrder(&'static str),
}

/// Why a picture cannot be cut into sides.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "has {width} x {height} pixels, which are not {columns} x {rows} equal squares; \
     crop it, or name its layout with --layout"
)]
pub struct ShapeError {
    /// Of the picture, in pixels.
    pub width: u32,
    /// Of the picture, in pixels.
    pub height: u32,
    /// Of the layout.
    pub columns: u32,
    /// Of the layout.
    pub rows: u32,
}

/// The order of sides in strips, unless told: that of v360, and of OpenGL with the front along +z.
pub const USUAL_ORDER: &str = "rludfb";

/// Names of layouts that have one order, with their shape and what lies where: for each row the letters
/// of the sides, with . for what is empty, and below each its quarters clockwise.
const FIXED: &[(&str, &[&str], &[&str], Spacing)] = &[
    (
        "cross",
        &[".u..", "lfrb", ".d.."],
        &["0000", "0000", "0000"],
        Spacing::Plane,
    ),
    (
        // Folded downwards, so that the back stands on its head.
        "vertical-cross",
        &[".u.", "lfr", ".d.", ".b."],
        &["000", "000", "000", "020"],
        Spacing::Plane,
    ),
    (
        // Spherical Video V2, cubemap layout 0: the top of the upper side is forward, of the lower back.
        "sv3d",
        &["rlu", "dfb"],
        &["002", "200"],
        Spacing::Plane,
    ),
    (
        // As in videos of YouTube: the second row is a strip that is turned by a quarter.
        "eac",
        &["lfr", "dbu"],
        &["000", "313"],
        Spacing::Angle,
    ),
    (
        // ENVMAP_CUBE: +x (to the left of +z, which is the front) -x +y -y +z -z, the upper and the lower
        // side towards the back.
        "exr",
        &["l", "r", "u", "d", "f", "b"],
        &["0", "0", "2", "2", "0", "0"],
        Spacing::PlaneWithBorder,
    ),
];

impl Layout {
    /// The names of all layouts.
    pub const NAMES: [&str; 9] = [
        "6x1",
        "1x6",
        "3x2",
        "2x3",
        "cross",
        "vertical-cross",
        "sv3d",
        "eac",
        "exr",
    ];

    /// The layout of that name; strips with an order of sides and the quarters by which each is turned.
    ///
    /// # Errors
    /// When there is none of that name, or order or rotations are none, or cannot be chosen.
    pub fn new(
        name: &str,
        order: Option<&str>,
        rotations: Option<&str>,
    ) -> Result<Self, LayoutError> {
        let grid = match name {
            "6x1" => Some([6, 1]),
            "1x6" => Some([1, 6]),
            "3x2" => Some([3, 2]),
            "2x3" => Some([2, 3]),
            _ => None,
        };
        if let Some([columns, rows]) = grid {
            let sides = sides_of(order.unwrap_or(USUAL_ORDER))?;
            let turns = turns_of(rotations.unwrap_or("000000"))?;
            let cells = sides.into_iter().zip(turns).zip(0..);
            let cells = cells.map(|((side, turn), k)| Cell {
                column: k % columns,
                row: k / columns,
                side,
                turn,
            });
            return Ok(Self {
                columns,
                rows,
                cells: cells.collect(),
                spacing: Spacing::Plane,
            });
        }
        let fixed = FIXED.iter().find(|fixed| fixed.0 == name);
        let &(name, sides, quarters, spacing) = fixed.ok_or(LayoutError::UnknownName)?;
        if order.is_some() || rotations.is_some() {
            return Err(LayoutError::FixedOrder(name));
        }
        let mut cells = Vec::with_capacity(6);
        for (row, (letters, quarters)) in (0..).zip(sides.iter().zip(quarters)) {
            for (column, (letter, digit)) in (0..).zip(letters.chars().zip(quarters.bytes())) {
                cells.extend(Side::of_letter(letter).map(|side| Cell {
                    column,
                    row,
                    side,
                    turn: Turn::clockwise(digit - b'0'),
                }));
            }
        }
        Ok(Self {
            columns: 1 + cells.iter().map(|cell| cell.column).max().unwrap_or(0),
            rows: 1 + cells.iter().map(|cell| cell.row).max().unwrap_or(0),
            cells,
            spacing,
        })
    }

    /// The cross of four columns and three rows, as seen from inside.
    pub fn cross() -> Self {
        Self::new("cross", None, None).expect("one of the names")
    }

    /// The layout that a picture of that shape most likely has: a strip, or a cross.
    pub fn of_shape(width: u32, height: u32) -> Option<Self> {
        let (w, h) = (u64::from(width), u64::from(height));
        let name = match () {
            () if w == 6 * h => "6x1",
            () if 6 * w == h => "1x6",
            () if 2 * w == 3 * h => "3x2",
            () if 3 * w == 2 * h => "2x3",
            () if 3 * w == 4 * h => "cross",
            () if 4 * w == 3 * h => "vertical-cross",
            () => return None,
        };
        Self::new(name, None, None).ok()
    }

    /// What is even along the edges of its sides.
    pub fn spacing(&self) -> Spacing {
        self.spacing
    }

    /// Columns and rows.
    pub fn shape(&self) -> [u32; 2] {
        [self.columns, self.rows]
    }

    /// The sides and where they lie, row by row.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// The side of the cells of a picture, in pixels.
    ///
    /// # Errors
    /// When it cannot be cut into squares.
    pub fn cell_side(&self, width: u32, height: u32) -> Result<u32, ShapeError> {
        let side = width / self.columns;
        if side > 0 && side * self.columns == width && height == side * self.rows {
            return Ok(side);
        }
        Err(ShapeError {
            width,
            height,
            columns: self.columns,
            rows: self.rows,
        })
    }

    /// The sides of a picture, each as it lies by itself, in the order of the cells.
    ///
    /// # Errors
    /// When it cannot be cut into squares.
    pub fn cut(&self, picture: &Picture) -> Result<Vec<(Side, Picture)>, ShapeError> {
        let side = self.cell_side(picture.width, picture.height)?;
        let cut = |cell: &Cell| {
            let mut pixels = Vec::with_capacity(side as usize * side as usize);
            for y in 0..side {
                let row = u64::from(cell.row * side + y) * u64::from(picture.width);
                let first = row as usize + (cell.column * side) as usize;
                pixels.extend_from_slice(&picture.pixels[first..first + side as usize]);
            }
            let stored = Picture {
                width: side,
                height: side,
                pixels,
            };
            (cell.side, cell.turn.inverse().of(stored))
        };
        Ok(self.cells.iter().map(cut).collect())
    }

    /// One picture of six sides, clear where nothing lies.
    ///
    /// `face` gives a side, `side` pixels wide and high.
    pub fn join(&self, side: u32, mut face: impl FnMut(Side) -> Picture) -> Picture {
        let (width, height) = (self.columns * side, self.rows * side);
        let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
        for cell in &self.cells {
            let stored = cell.turn.of(face(cell.side));
            for (y, row) in (0..).zip(stored.pixels.chunks(side as usize)) {
                let first = (cell.row * side + y) as usize * width as usize;
                let first = first + (cell.column * side) as usize;
                pixels[first..first + side as usize].copy_from_slice(row);
            }
        }
        Picture {
            width,
            height,
            pixels,
        }
    }
}

impl FromStr for Layout {
    type Err = LayoutError;

    fn from_str(name: &str) -> Result<Self, LayoutError> {
        Self::new(name, None, None)
    }
}

/// Six letters of [`Side::letter`], each once.
///
/// # Errors
/// When they are not.
pub fn sides_of(order: &str) -> Result<[Side; 6], LayoutError> {
    let sides: Option<Vec<Side>> = order.chars().map(Side::of_letter).collect();
    let sides = sides.ok_or(LayoutError::Order)?;
    let sides: [Side; 6] = sides.try_into().map_err(|_| LayoutError::Order)?;
    match Side::ALL.iter().all(|side| sides.contains(side)) {
        true => Ok(sides),
        false => Err(LayoutError::Order),
    }
}

/// Six digits of quarters clockwise.
///
/// # Errors
/// When they are not.
pub fn turns_of(rotations: &str) -> Result<[Turn; 6], LayoutError> {
    let turn = |digit: char| Some(Turn::clockwise(digit.to_digit(4)? as u8));
    let turns: Option<Vec<Turn>> = rotations.chars().map(turn).collect();
    let turns = turns.ok_or(LayoutError::Rotations)?;
    turns.try_into().map_err(|_| LayoutError::Rotations)
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {} sides", self.columns, self.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_layout_has_each_side_once_and_is_cut_as_it_is_joined() {
        let face = |side: Side| Picture {
            width: 2,
            height: 2,
            pixels: (0..4)
                .map(|k| [side.index() as f32, k as f32, 0.0, 1.0])
                .collect(),
        };
        for name in Layout::NAMES {
            let layout: Layout = name.parse().expect(name);
            let joined = layout.join(2, face);
            let [columns, rows] = layout.shape();
            assert_eq!((joined.width, joined.height), (2 * columns, 2 * rows));
            let mut found = layout.cut(&joined).expect("is of its shape");
            found.sort_by_key(|(side, _)| *side);
            let expected: Vec<_> = Side::ALL.map(|side| (side, face(side))).into();
            assert_eq!(found, expected, "{name}");
        }
    }

    #[test]
    fn orders_and_rotations_are_checked() {
        let layout = |order, rotations| Layout::new("3x2", Some(order), Some(rotations));
        let cells = layout("frblud", "000013").expect("is one").cells;
        assert_eq!(cells[5].side, Side::Down);
        assert_eq!(cells[5].turn, Turn::clockwise(3));
        assert_eq!((cells[5].column, cells[5].row), (2, 1));
        for order in ["", "rludf", "rludff", "rludfx", "rludfbb"] {
            assert_eq!(layout(order, "000000"), Err(LayoutError::Order), "{order}");
        }
        for rotations in ["", "00000", "000004", "0000000"] {
            let refused = layout("rludfb", rotations);
            assert_eq!(refused, Err(LayoutError::Rotations), "{rotations}");
        }
        let cross = Layout::new("cross", Some("rludfb"), None);
        assert_eq!(cross, Err(LayoutError::FixedOrder("cross")));
    }

    #[test]
    fn pictures_of_no_whole_squares_are_refused() {
        let strip: Layout = "6x1".parse().expect("a layout");
        for (width, height) in [(7, 1), (6, 2), (1, 1), (5, 1)] {
            assert!(strip.cell_side(width, height).is_err(), "{width}x{height}");
        }
        assert_eq!(strip.cell_side(6, 1), Ok(1));
        assert_eq!(Layout::of_shape(400, 300), "cross".parse().ok());
        assert_eq!(Layout::of_shape(400, 200), None);
    }
}
