//! The eight ways in which a square picture can lie.

use crate::accumulate::Picture;
use rayon::prelude::*;
use std::fmt;

/// How a picture is stored: mirrored left to right or not, then turned clockwise by quarters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turn {
    /// Whether left and right are exchanged.
    pub mirrored: bool,
    /// Quarters of a turn clockwise, 0 to 3, after that.
    pub quarters: u8,
}

impl Turn {
    /// As it is.
    pub const NONE: Self = Self::clockwise(0);
    /// Upside down, turned and not mirrored.
    pub const HALF: Self = Self::clockwise(2);

    /// Turned by quarters, not mirrored.
    pub const fn clockwise(quarters: u8) -> Self {
        Self {
            mirrored: false,
            quarters: quarters % 4,
        }
    }

    /// The turn after this one.
    pub fn then(self, next: Self) -> Self {
        // Turning first and mirroring then is mirroring first and turning the other way.
        let quarters = match next.mirrored {
            true => 4 - self.quarters % 4,
            false => self.quarters,
        };
        Self {
            mirrored: self.mirrored != next.mirrored,
            quarters: (quarters + next.quarters) % 4,
        }
    }

    /// The turn that takes this one back.
    pub fn inverse(self) -> Self {
        let quarters = match self.mirrored {
            true => self.quarters,
            false => (4 - self.quarters % 4) % 4,
        };
        Self {
            mirrored: self.mirrored,
            quarters,
        }
    }

    /// Where the pixel of a turned picture comes from, which was `width` x `height` before.
    fn source(self, [x, y]: [u32; 2], width: u32, height: u32) -> [u32; 2] {
        let [x, y] = match self.quarters % 4 {
            0 => [x, y],
            1 => [y, height - 1 - x],
            2 => [width - 1 - x, height - 1 - y],
            _ => [width - 1 - y, x],
        };
        match self.mirrored {
            true => [width - 1 - x, y],
            false => [x, y],
        }
    }

    /// The picture, turned.
    pub fn of(self, picture: Picture) -> Picture {
        if self == Self::NONE {
            return picture;
        }
        let (w, h) = (picture.width, picture.height);
        let (width, height) = if self.quarters.is_multiple_of(2) {
            (w, h)
        } else {
            (h, w)
        };
        let pixels = (0..height).into_par_iter().flat_map_iter(|y| {
            let picture = &picture;
            (0..width).map(move |x| {
                let [from_x, from_y] = self.source([x, y], w, h);
                picture.pixels[from_y as usize * w as usize + from_x as usize]
            })
        });
        Picture {
            width,
            height,
            pixels: pixels.collect(),
        }
    }
}

impl fmt::Display for Turn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mirrored = if self.mirrored { "mirrored" } else { "" };
        let and = if self.mirrored && !self.quarters.is_multiple_of(4) {
            " and "
        } else {
            ""
        };
        let turned = match self.quarters % 4 {
            0 => "",
            1 => "turned clockwise by 90 degrees",
            2 => "turned by 180 degrees",
            _ => "turned counter-clockwise by 90 degrees",
        };
        write!(f, "{mirrored}{and}{turned}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all_turns() -> impl Iterator<Item = Turn> {
        (0..8).map(|k| Turn {
            mirrored: k >= 4,
            quarters: k % 4,
        })
    }

    /// A picture whose pixels are all different.
    fn numbered(width: u32, height: u32) -> Picture {
        let pixel = |index| [index as f32, 0.0, 0.0, 1.0];
        Picture {
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
        }
    }

    #[test]
    fn turns_are_those_of_a_square() {
        let picture = numbered(3, 2);
        for first in all_turns() {
            let back = first.inverse().of(first.of(picture.clone()));
            assert_eq!(back, picture, "{first:?}");
            for second in all_turns() {
                let at_once = first.then(second).of(picture.clone());
                let one_by_one = second.of(first.of(picture.clone()));
                assert_eq!(at_once, one_by_one, "{first:?} {second:?}");
            }
        }
    }

    #[test]
    fn a_quarter_clockwise_takes_the_top_to_the_right() {
        let turned = Turn::clockwise(1).of(numbered(2, 1));
        assert_eq!((turned.width, turned.height), (1, 2));
        assert_eq!(turned.pixels[0][0], 0.0, "left became top");
    }
}
