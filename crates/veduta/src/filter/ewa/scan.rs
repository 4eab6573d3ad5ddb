use super::Ewa;
use super::footprint::Footprints;
use super::lanes::{LANES, Vector};
use super::profile::{Gaussian, Mixture, Round, Weigh};
use crate::filter::{PADDING, Texels};

/// What rounding may add to a mean of a hundred texels, relative; a mean nearer than this to the texel in its middle is
/// taken to be that texel.
const ROUNDING: f32 = 1e-6;

/// Reach of footprints that [`means`] takes, texels: eight columns and as many rows, which the padding holds.
pub(crate) const MOST_OF_EIGHT: f32 = 0.5 * PADDING as f32;

/// The weighted means of the texels in eight footprints, whose base is texel `base`. None may reach farther than
/// [`MOST_OF_EIGHT`], and the box around each must begin within the texels and their apron.
///
/// All eight scan as many rows and columns as the largest of them: the processor foresees where a loop ends that ends
/// where the last one did. That and eight at once halve the time.
#[inline(always)]
pub(crate) fn means<V: Vector>(
    token: V::Token,
    ewa: &Ewa,
    texels: &Texels,
    base: [i32; 2],
    footprints: &Footprints,
) -> [[f32; 4]; LANES] {
    let share = V::of(token, footprints.round);
    if share.all_at_most(V::all(token, 0.0)) {
        eight::<V, _>(token, &Gaussian, texels, base, footprints)
    } else if V::all(token, 1.0).all_at_most(share) {
        let round = Round::of(ewa.profile);
        eight::<V, _>(token, &round, texels, base, footprints)
    } else {
        let mut means = [[0.0; 4]; LANES];
        for (lane, mean) in means.iter_mut().enumerate() {
            *mean = self::mean::<V>(token, ewa, texels, base, footprints, lane);
        }
        means
    }
}

#[inline(always)]
fn eight<V: Vector, W: Weigh>(
    token: V::Token,
    weigh: &W,
    texels: &Texels,
    base: [i32; 2],
    of: &Footprints,
) -> [[f32; 4]; LANES] {
    let most = |counts: &[i32; LANES]| counts.iter().copied().fold(0, i32::max);
    let [columns, rows] = [most(&of.count[0]), most(&of.count[1])];
    match columns {
        ..=4 => eight_of::<V, W, 2, 2>(token, weigh, texels, base, of, rows),
        5..=6 => eight_of::<V, W, 3, 1>(token, weigh, texels, base, of, rows),
        _ => eight_of::<V, W, 4, 1>(token, weigh, texels, base, of, rows),
    }
}

#[inline(always)]
fn eight_of<V: Vector, W: Weigh, const PAIRS: usize, const ROWS: usize>(
    token: V::Token,
    weigh: &W,
    texels: &Texels,
    base: [i32; 2],
    of: &Footprints,
    rows: i32,
) -> [[f32; 4]; LANES] {
    let mut means = [[0.0; 4]; LANES];
    for (two, means) in means.chunks_exact_mut(2).enumerate() {
        let (a, b) = (2 * two, 2 * two + 1);
        let mut sums = [Sums::<V>::new(token); 2];
        sums[0].add::<W, PAIRS, ROWS>(token, weigh, texels, base, of, a, 0, rows);
        sums[1].add::<W, PAIRS, ROWS>(token, weigh, texels, base, of, b, 0, rows);
        let middles = [middle(texels, base, of, a), middle(texels, base, of, b)];
        let found = quotients(token, sums, middles).array();
        means.as_flattened_mut().copy_from_slice(&found);
    }
    means
}

/// The weighted mean of the texels in one footprint, lane `lane` of `footprints`, whose base is texel `base`.
///
/// The box around it must lie within the texels and their apron.
#[inline(always)]
pub(crate) fn mean<V: Vector>(
    token: V::Token,
    ewa: &Ewa,
    texels: &Texels,
    base: [i32; 2],
    footprints: &Footprints,
    lane: usize,
) -> [f32; 4] {
    let share = footprints.round[lane];
    // The Gaussian goes beyond no texel.
    if share <= 0.0 {
        return one::<V, _>(token, &Gaussian, texels, base, footprints, lane);
    }
    let mean = if share < 1.0 {
        let mixture = Mixture::new(share);
        one::<V, _>(token, &mixture, texels, base, footprints, lane)
    } else {
        let round = Round::of(ewa.profile);
        one::<V, _>(token, &round, texels, base, footprints, lane)
    };
    if ewa.clamp {
        clamped(mean, texels, base, footprints, lane)
    } else {
        mean
    }
}

#[inline(always)]
fn one<V: Vector, W: Weigh>(
    token: V::Token,
    weigh: &W,
    texels: &Texels,
    base: [i32; 2],
    of: &Footprints,
    lane: usize,
) -> [f32; 4] {
    let mut sums = Sums::<V>::new(token);
    let mut done = 0;
    while done < of.count[0][lane] {
        let rows = of.count[1][lane];
        sums.add::<W, 4, 1>(token, weigh, texels, base, of, lane, done, rows);
        done += LANES as i32;
    }
    let middle = middle(texels, base, of, lane);
    let [r, g, b, a, ..] = quotients(token, [sums; 2], [middle; 2]).array();
    [r, g, b, a]
}

/// What texels of a footprint sum up to.
#[derive(Clone, Copy)]
struct Sums<V> {
    /// RGBA times weight, of texels in even and in odd columns.
    colour: V,
    /// Weights, of every eighth column.
    weight: V,
}

impl<V: Vector> Sums<V> {
    #[inline(always)]
    fn new(token: V::Token) -> Self {
        Self {
            colour: V::all(token, 0.0),
            weight: V::all(token, 0.0),
        }
    }

    /// Adds 2 `PAIRS` columns of `rows` rows, from the footprint's column `done` on.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the innermost loop")]
    fn add<W: Weigh, const PAIRS: usize, const ROWS: usize>(
        &mut self,
        token: V::Token,
        weigh: &W,
        texels: &Texels,
        base: [i32; 2],
        of: &Footprints,
        lane: usize,
        done: i32,
        rows: i32,
    ) {
        let [a, b, c] = &of.equation;
        let a = V::all(token, a[lane]);
        let b = V::all(token, b[lane]);
        let c = V::all(token, c[lane]);
        let (columns, row) = shape::<V, ROWS>(token);
        let x = columns + V::all(token, of.start[0][lane] + done as f32);
        let y = row + V::all(token, of.start[1][lane]);
        // q = x (a x + b y) + c y^2, and by how much it grows with `ROWS` rows: as in the paper, but down.
        let (bx, cy) = (b * x, c * y);
        let mut q = x.mul_add(a * x, y * (bx + cy));
        let step = V::all(token, ROWS as f32);
        let c = c * step;
        let mut dq = (bx + c + (cy + cy)) * step;
        let ddq = (c + c) * step;
        let (column, row) = (of.first[0][lane] + done, of.first[1][lane]);
        let mut at = texels.place(base[0] + column, base[1] + row);
        let mut colours = [self.colour; PAIRS];
        colours[1..].fill(V::all(token, 0.0));
        let mut left = rows;
        while left > 0 {
            let weights = weigh.weights(token, q);
            for row in 0..ROWS {
                let texels_of_row = &texels.all()[at..at + 2 * PAIRS];
                for (pair, colour) in colours.iter_mut().enumerate() {
                    let two = V::two(token, &texels_of_row[2 * pair..2 * pair + 2]);
                    *colour = weights.spread(PAIRS * row + pair).mul_add(two, *colour);
                }
                at += texels.stride();
            }
            self.weight = self.weight + weights;
            q = q + dq;
            dq = dq + ddq;
            left -= ROWS as i32;
        }
        self.colour = colours[0];
        for colour in &colours[1..] {
            self.colour = self.colour + *colour;
        }
    }
}

/// Columns and rows of the texels of eight lanes: even columns in the first half and odd ones in the second, so that
/// [`Vector::spread`] gives the weights of two neighbours.
#[inline(always)]
fn shape<V: Vector, const ROWS: usize>(token: V::Token) -> (V, V) {
    if ROWS == 1 {
        let columns = V::of(token, [0.0, 2.0, 4.0, 6.0, 1.0, 3.0, 5.0, 7.0]);
        (columns, V::all(token, 0.0))
    } else {
        let columns = V::of(token, [0.0, 2.0, 0.0, 2.0, 1.0, 3.0, 1.0, 3.0]);
        (
            columns,
            V::of(token, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0]),
        )
    }
}

/// The texel that is nearest to the middle of a footprint.
#[inline(always)]
fn middle(texels: &Texels, base: [i32; 2], of: &Footprints, lane: usize) -> [f32; 4] {
    texels.texel(base[0] + of.middle[0][lane], base[1] + of.middle[1][lane])
}

/// The means of two footprints, one after the other.
#[inline(always)]
fn quotients<V: Vector>(token: V::Token, [a, b]: [Sums<V>; 2], middles: [[f32; 4]; 2]) -> V {
    let mean = V::halves(a.colour, b.colour).over(V::halves(a.weight, b.weight).quarters());
    // Equal texels shall give just that value, which rounded sums do not.
    let (zero, middle) = (V::all(token, 0.0), V::two(token, &middles));
    let off = (mean - middle).max(middle - mean);
    let rounding = middle.max(zero - middle) * V::all(token, ROUNDING);
    off.below(rounding, middle, mean)
}

/// A mean between the darkest and the lightest of the texels in its footprint.
fn clamped(
    mut mean: [f32; 4],
    texels: &Texels,
    base: [i32; 2],
    of: &Footprints,
    lane: usize,
) -> [f32; 4] {
    let [u, v] = of.centre.map(|centre| centre[lane]);
    let [a, b, c] = of.equation.map(|coefficient| coefficient[lane]);
    let [first_column, first_row] = of.first.map(|first| first[lane]);
    let [columns, rows] = of.count.map(|count| count[lane]);
    let (mut low, mut high) = ([f32::INFINITY; 4], [f32::NEG_INFINITY; 4]);
    for row in first_row..first_row + rows {
        for column in first_column..first_column + columns {
            let (x, y) = (column as f32 - u, row as f32 - v);
            if a * x * x + y * (b * x + c * y) < 1.0 {
                let texel = texels.texel(base[0] + column, base[1] + row);
                for k in 0..4 {
                    low[k] = low[k].min(texel[k]);
                    high[k] = high[k].max(texel[k]);
                }
            }
        }
    }
    for (k, mean) in mean.iter_mut().enumerate() {
        *mean = mean.max(low[k]).min(high[k]);
    }
    mean
}
