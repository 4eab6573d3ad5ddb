use std::ops::Range;

/// Texels right of and rows below the apron, which vector loads may read and weigh with 0.
pub(crate) const PADDING: usize = 8;

/// A picture as the elliptical filter reads it: RGBA, texel after texel, with an *apron* of further texels around.
///
/// Light is linear, and colour premultiplied by opacity. Texels are counted from the picture's left top corner, so that
/// those of the apron have negative numbers, or numbers beyond the size. Who makes the texels fills the apron; then a
/// footprint that reaches over the border needs no case of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Texels {
    width: u32,
    height: u32,
    apron: u32,
    repeats: bool,
    /// From a row to the next, texels.
    stride: usize,
    /// The four channels lie together, so that the weighted sum of texels is one of vectors and needs no sum over lanes.
    texels: Vec<[f32; 4]>,
}

impl Texels {
    /// Texels of 0 for a picture of `width` by `height`.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn new(width: u32, height: u32, apron: u32) -> Self {
        assert!(width > 0 && height > 0, "a picture has texels");
        let stride = (width + 2 * apron) as usize + PADDING;
        let rows = (height + 2 * apron) as usize + PADDING;
        Self {
            width,
            height,
            apron,
            repeats: false,
            stride,
            texels: vec![[0.0; 4]; rows * stride],
        }
    }

    /// Texels whose columns repeat: right of the last comes the first again, as in a panorama all around.
    pub fn repeating(mut self) -> Self {
        self.repeats = true;
        self
    }

    /// Whether columns repeat.
    pub fn repeats(&self) -> bool {
        self.repeats
    }

    /// Width without the apron.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height without the apron.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// How far the apron reaches, texels.
    pub fn apron(&self) -> u32 {
        self.apron
    }

    /// Columns of the picture and its apron.
    pub fn columns(&self) -> Range<i32> {
        let apron = self.apron as i32;
        -apron..self.width as i32 + apron
    }

    /// Rows of the picture and its apron.
    pub fn rows(&self) -> Range<i32> {
        let apron = self.apron as i32;
        -apron..self.height as i32 + apron
    }

    /// Where a texel lies in [`all`](Self::all); the next row follows in a [`stride`](Self::stride).
    #[inline(always)]
    pub(crate) fn place(&self, column: i32, row: i32) -> usize {
        let row = (row + self.apron as i32) as usize;
        (row * self.stride).wrapping_add_signed((column + self.apron as i32) as isize)
    }

    #[inline(always)]
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    #[inline(always)]
    pub(crate) fn all(&self) -> &[[f32; 4]] {
        &self.texels
    }

    /// A texel.
    #[inline]
    pub fn texel(&self, column: i32, row: i32) -> [f32; 4] {
        self.texels[self.place(column, row)]
    }

    /// Sets a texel.
    #[inline]
    pub fn set(&mut self, column: i32, row: i32, texel: [f32; 4]) {
        let place = self.place(column, row);
        self.texels[place] = texel;
    }

    /// A row of the picture, `width` texels, to be filled.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row_mut(&mut self, row: u32) -> &mut [[f32; 4]] {
        assert!(row < self.height, "a row of the picture");
        let start = self.place(0, row as i32);
        &mut self.texels[start..start + self.width as usize]
    }

    /// Fills the apron of a texture that goes on beyond its borders by rules of its own, along columns and along rows.
    pub fn continue_by(&mut self, [across, down]: [Wrap; 2]) {
        let (columns, rows) = (self.columns(), self.rows());
        let (width, height) = (self.width as i32, self.height as i32);
        for row in rows {
            for column in columns.clone() {
                if (0..width).contains(&column) && (0..height).contains(&row) {
                    continue;
                }
                let texel = match (across.texel(column, width), down.texel(row, height)) {
                    (Some(column), Some(row)) => self.texel(column, row),
                    _ => [0.0; 4],
                };
                self.set(column, row, texel);
            }
        }
    }

    /// The picture at half the size: each texel the mean of 4 x 4 with weights 1 3 3 1, which is smooth enough
    /// that footprints of a few texels tell no difference.
    ///
    /// Of an odd side, the last texel lies half in the apron. The apron of the result is not filled.
    ///
    /// # Panics
    /// If the apron is narrower than 2 texels, which the weights reach.
    pub fn halved(&self, apron: u32) -> Self {
        assert!(self.apron >= 2, "an apron for the weights");
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut half = Self::new(width, height, apron);
        // An odd number of columns does not repeat after half of them.
        half.repeats = self.repeats && self.width.is_multiple_of(2);
        // Four rows in one, from column -1 on.
        let mut down = vec![[0.0; 4]; 2 * width as usize + 2];
        for row in 0..height {
            let of_row = |offset: i32| {
                let start = self.place(-1, 2 * row as i32 + offset);
                &self.texels[start..start + down.len()]
            };
            let [a, b, c, d] = [-1, 0, 1, 2].map(of_row);
            for (column, texel) in down.iter_mut().enumerate() {
                *texel = weighted([a[column], b[column], c[column], d[column]]);
            }
            for (column, texel) in half.row_mut(row).iter_mut().enumerate() {
                *texel = weighted([0, 1, 2, 3].map(|k| down[2 * column + k]));
            }
        }
        half
    }
}

/// What a texture shows beyond its border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    Repeat,
    /// The texture again, every other time turned over.
    Mirror,
    /// The texels of the border.
    Clamp,
    /// Nothing: black, and transparent where there is opacity.
    Black,
}

impl Wrap {
    /// The texel, of `size`, that is shown at a number beyond them.
    fn texel(self, k: i32, size: i32) -> Option<i32> {
        match self {
            Self::Repeat => Some(k.rem_euclid(size)),
            Self::Mirror => {
                let k = k.rem_euclid(2 * size);
                Some(k.min(2 * size - 1 - k))
            }
            Self::Clamp => Some(k.clamp(0, size - 1)),
            Self::Black => (0..size).contains(&k).then_some(k),
        }
    }
}

/// `(a + 3 b + 3 c + d) / 8`, rounded so that four equal values give that value.
#[inline(always)]
fn weighted([a, b, c, d]: [[f32; 4]; 4]) -> [f32; 4] {
    // In this order the sums of equal values are 2, 4 and 8 times one of them, and nothing is rounded.
    std::array::from_fn(|k| ((a[k] + d[k]) + (b[k] + c[k]) + 2.0 * (b[k] + c[k])) * 0.125)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_where_they_were_set_and_rows_are_set_whole() {
        let mut texels = Texels::new(3, 2, 2);
        for row in texels.rows() {
            for column in texels.columns() {
                texels.set(column, row, [column as f32, row as f32, 1.0, 0.5]);
            }
        }
        texels.row_mut(1).fill([7.0; 4]);
        for row in texels.rows() {
            for column in texels.columns() {
                let set = row == 1 && (0..3).contains(&column);
                let expected = if set {
                    [7.0; 4]
                } else {
                    [column as f32, row as f32, 1.0, 0.5]
                };
                assert_eq!(texels.texel(column, row), expected, "{column} {row}");
            }
        }
    }

    #[test]
    fn textures_go_on_as_they_are_told() {
        for (wrap, expected) in [
            (Wrap::Repeat, [2.0, 3.0, 1.0, 2.0, 3.0, 1.0, 2.0]),
            (Wrap::Mirror, [2.0, 1.0, 1.0, 2.0, 3.0, 3.0, 2.0]),
            (Wrap::Clamp, [1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0]),
            (Wrap::Black, [0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0]),
        ] {
            let mut texels = Texels::new(3, 1, 2);
            texels
                .row_mut(0)
                .copy_from_slice(&[1.0, 2.0, 3.0].map(|x| [x; 4]));
            texels.continue_by([wrap, Wrap::Clamp]);
            for row in texels.rows() {
                let found: Vec<f32> = texels.columns().map(|k| texels.texel(k, row)[0]).collect();
                assert_eq!(found, expected, "{wrap:?}");
            }
        }
    }

    #[test]
    fn halving_keeps_constants_and_slopes() {
        for value in [0.1_f32, 1.0 / 3.0, 0.7, 123.456, 5e-5] {
            let mut texels = Texels::new(5, 4, 3);
            for row in texels.rows() {
                for column in texels.columns() {
                    texels.set(column, row, [value, 0.0, 0.0, 0.0]);
                }
            }
            let half = texels.halved(1);
            assert_eq!((half.width(), half.height()), (3, 2));
            assert_eq!(half.texel(2, 1)[0], value);
        }
        let mut slope = Texels::new(8, 8, 3);
        for row in slope.rows() {
            for column in slope.columns() {
                slope.set(column, row, [(3 * column + row) as f32, 0.0, 0.0, 0.0]);
            }
        }
        // The centre of texel (1, 2) is at (2.5, 4.5) in the finer picture.
        assert_eq!(slope.halved(1).texel(1, 2)[0], 12.0);
    }
}
