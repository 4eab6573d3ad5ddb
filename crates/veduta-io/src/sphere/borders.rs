//! Do the sides of a cube fit together? Along an edge of the cube two sides show the same directions, so
//! that their outermost pixels are alike; where they are not, a side is turned, mirrored or in another's
//! place. Then all ways to lay the six out are tried for one in which the borders agree.
//!
//! Mirrored pictures are not tried: a mirrored world fits together as well as the world, so that six mirrored
//! sides are also sides of which two that face each other are exchanged.

use crate::tone::srgb_from_linear;
use veduta::accumulate::Picture;
use veduta::reproject::cube::{Side, Turn};

/// How well six sides fit together as they lie, and how well they could.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Mean difference of outermost pixels along the twelve edges, as a share of the range from black to
    /// white in sRGB.
    pub difference: f64,
    /// Mean difference of outermost pixels and those beside them, within sides: what is to be expected.
    pub usual: f64,
    /// The pair of neighbours that fit worst, and their difference.
    pub worst: (Side, Side, f64),
    /// How the sides would have to lie, if that makes the borders agree and they do not as they are.
    pub better: Option<Vec<Change>>,
}

/// A side whose picture should be another's, or be turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The place.
    pub place: Side,
    /// The side whose picture, as it was taken, belongs there.
    pub from: Side,
    /// How that picture should be turned.
    pub turn: Turn,
}

impl Fit {
    /// Whether borders disagree by more than pictures do anyhow.
    pub fn is_bad(&self) -> bool {
        self.difference > LEAST_DIFFERENCE && self.difference > MOST_USUAL * self.usual
    }
}

/// Differences below are noise, of compression or of the exposure of photographs.
const LEAST_DIFFERENCE: f64 = 0.02;
/// By how much borders may differ more than neighbours within a side.
const MOST_USUAL: f64 = 2.5;
/// Another way to lie is one that fits better by this.
const BETTER: f64 = 3.0;
/// Samples along an edge: enough to tell sides apart.
const SAMPLES: usize = 32;
/// What a change must save, so that of equal ways the one with fewest changes is told.
const CHANGE: f64 = 1e-4;

/// Edges of a picture; each from its left or upper end.
const EDGES: [Edge; 4] = [Edge::Top, Edge::Right, Edge::Bottom, Edge::Left];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Edge {
    Top,
    Right,
    Bottom,
    Left,
}

type Samples = [[f32; 3]; SAMPLES];

/// The fit of six sides of one size and of 90 degrees, in the order of [`Side::ALL`].
///
/// # Panics
/// If they are not square or not of one size.
pub fn fit(sides: &[&Picture; 6]) -> Fit {
    let size = sides[0].width;
    assert!(
        sides
            .iter()
            .all(|side| [side.width, side.height] == [size; 2]),
        "sides are squares of one size"
    );
    let edges: Vec<[Samples; 4]> = sides
        .iter()
        .map(|side| EDGES.map(|edge| samples(side, edge, 0)))
        .collect();
    let within = |side: usize, k: usize| {
        let inner = samples(sides[side], EDGES[k], 1.min(size - 1));
        difference(&edges[side][k], &inner, false)
    };
    let usual = (0..24).map(|k| within(k / 4, k % 4)).sum::<f64>() / 24.0;
    let table = Table::of(&edges);
    let joints = joints();
    let as_is = |joint: &Joint| {
        let [a, b] = joint.sides;
        table.at([a, joint.edges[0]], [b, joint.edges[1]], joint.reversed)
    };
    let differences: Vec<f64> = joints.iter().map(as_is).collect();
    let difference = differences.iter().sum::<f64>() / 12.0;
    let worst = (0..12).max_by(|&a, &b| differences[a].total_cmp(&differences[b]));
    let worst = worst.expect("there are twelve");
    let [a, b] = joints[worst].sides.map(|side| Side::ALL[side]);
    let mut fit = Fit {
        difference,
        usual,
        worst: (a, b, differences[worst]),
        better: None,
    };
    if fit.is_bad() {
        let (found, laid) = best(&table, &joints);
        if found * BETTER < difference && (found < LEAST_DIFFERENCE || found < MOST_USUAL * usual) {
            fit.better = Some(laid);
        }
    }
    fit
}

/// Outermost pixels along an edge, or those `inside` rows from it, as means of sRGB from 0 to 1.
fn samples(picture: &Picture, edge: Edge, inside: u32) -> Samples {
    let size = picture.width as usize;
    let inside = inside as usize;
    let pixel = |along: usize| {
        let at = match edge {
            Edge::Top => inside * size + along,
            Edge::Bottom => (size - 1 - inside) * size + along,
            Edge::Left => along * size + inside,
            Edge::Right => along * size + size - 1 - inside,
        };
        let [r, g, b, _] = picture.pixels[at];
        [r, g, b].map(|v| match v.is_finite() {
            true => srgb_from_linear(v.clamp(0.0, 1.0)),
            false => 0.0,
        })
    };
    std::array::from_fn(|k| {
        let first = k * size / SAMPLES;
        let end = ((k + 1) * size / SAMPLES).max(first + 1);
        let mut sum = [0.0; 3];
        for along in first..end {
            let value = pixel(along);
            (0..3).for_each(|channel| sum[channel] += value[channel]);
        }
        sum.map(|value: f32| value / (end - first) as f32)
    })
}

/// Mean difference of two edges, the second from its other end if `reversed`.
fn difference(a: &Samples, b: &Samples, reversed: bool) -> f64 {
    let of = |k: usize| {
        let other = b[if reversed { SAMPLES - 1 - k } else { k }];
        let channels = (0..3).map(|channel| f64::from((a[k][channel] - other[channel]).abs()));
        channels.sum::<f64>()
    };
    (0..SAMPLES).map(of).sum::<f64>() / (3 * SAMPLES) as f64
}

/// Differences of all pairs of edges, both ways round.
struct Table(Vec<f64>);

impl Table {
    fn of(edges: &[[Samples; 4]]) -> Self {
        let all: Vec<&Samples> = edges.iter().flatten().collect();
        let rows = all.iter().flat_map(|a| {
            let pair = move |b: &&Samples| [difference(a, b, false), difference(a, b, true)];
            all.iter().flat_map(pair)
        });
        Self(rows.collect())
    }

    fn at(&self, [a, a_edge]: [usize; 2], [b, b_edge]: [usize; 2], reversed: bool) -> f64 {
        self.0[((a * 4 + a_edge) * 24 + b * 4 + b_edge) * 2 + usize::from(reversed)]
    }
}

/// An edge of the cube: two sides, their edges there, and whether these run against each other.
struct Joint {
    sides: [usize; 2],
    edges: [usize; 2],
    reversed: bool,
}

/// The twelve edges of the cube.
fn joints() -> Vec<Joint> {
    let negative = |axis: [i8; 3]| axis.map(|v| -v);
    // Where an edge leads, and along what it runs.
    let edge = |side: Side, k: usize| {
        let [_, right, up] = side.axes();
        match EDGES[k] {
            Edge::Top => (up, right),
            Edge::Bottom => (negative(up), right),
            Edge::Right => (right, negative(up)),
            Edge::Left => (negative(right), negative(up)),
        }
    };
    let mut found = Vec::with_capacity(12);
    for a in 0..6 {
        for b in a + 1..6 {
            let [first, second] = [a, b].map(|side| Side::ALL[side]);
            let to = |from: Side, to: Side| (0..4).find(|&k| edge(from, k).0 == to.axes()[0]);
            if let (Some(a_edge), Some(b_edge)) = (to(first, second), to(second, first)) {
                found.push(Joint {
                    sides: [a, b],
                    edges: [a_edge, b_edge],
                    reversed: edge(first, a_edge).1 != edge(second, b_edge).1,
                });
            }
        }
    }
    found
}

/// For a turned picture: which edge of the picture before each of its edges was, and whether it runs the
/// other way.
fn turned_edges(turn: Turn) -> [(usize, bool); 4] {
    let corners = turn.of(Picture {
        width: 2,
        height: 2,
        pixels: (0..4).map(|k| [k as f32, 0.0, 0.0, 1.0]).collect(),
    });
    let corner = |k: usize| corners.pixels[k][0] as usize;
    // The corners at both ends of each edge.
    const ENDS: [[usize; 2]; 4] = [[0, 1], [1, 3], [2, 3], [0, 2]];
    ENDS.map(|[start, end]| {
        let found = [corner(start), corner(end)];
        let reversed = [found[1], found[0]];
        let edge = ENDS
            .iter()
            .position(|ends| *ends == found || *ends == reversed);
        (edge.expect("edges become edges"), !ENDS.contains(&found))
    })
}

/// The way to lay the sides out in which borders fit best: the mean difference, and what changes.
fn best(table: &Table, joints: &[Joint]) -> (f64, Vec<Change>) {
    let turns = [0, 1, 2, 3].map(|quarters| {
        let turn = Turn::clockwise(quarters);
        (turn, turned_edges(turn))
    });
    let mut search = Search {
        table,
        joints,
        turns: &turns,
        laid: [None; 6],
        best: (f64::INFINITY, [(0, 0); 6]),
    };
    search.place(0, 0.0);
    let (_, laid) = search.best;
    let mut sum = 0.0;
    for joint in joints {
        sum += search.cost(joint, laid[joint.sides[0]], laid[joint.sides[1]]);
    }
    let changes = laid
        .iter()
        .enumerate()
        .filter(|(k, (from, turn))| from != k || *turn != 0);
    let changes = changes.map(|(k, &(from, turn))| Change {
        place: Side::ALL[k],
        from: Side::ALL[from],
        turn: turns[turn].0,
    });
    (sum / 12.0, changes.collect())
}

/// A search of all ways to lay the sides out, a place after the other, given up where it is worse than the
/// best so far.
struct Search<'a> {
    table: &'a Table,
    joints: &'a [Joint],
    turns: &'a [(Turn, [(usize, bool); 4])],
    /// Of each place the side whose picture is there, and the number of its turn.
    laid: [Option<(usize, usize)>; 6],
    /// The sum of differences, and how the sides lie.
    best: (f64, [(usize, usize); 6]),
}

impl Search<'_> {
    fn cost(&self, joint: &Joint, a: (usize, usize), b: (usize, usize)) -> f64 {
        let edge = |(_, turn): (usize, usize), k: usize| self.turns[turn].1[joint.edges[k]];
        let ((a_edge, a_reversed), (b_edge, b_reversed)) = (edge(a, 0), edge(b, 1));
        let reversed = joint.reversed != (a_reversed != b_reversed);
        self.table.at([a.0, a_edge], [b.0, b_edge], reversed)
    }

    fn place(&mut self, place: usize, so_far: f64) {
        if so_far >= self.best.0 {
            return;
        }
        if place == 6 {
            self.best = (so_far, self.laid.map(|laid| laid.expect("all are laid")));
            return;
        }
        for from in 0..6 {
            if self.laid[..place]
                .iter()
                .flatten()
                .any(|laid| laid.0 == from)
            {
                continue;
            }
            for turn in 0..self.turns.len() {
                let here = (from, turn);
                let mut sum = so_far;
                if from != place || turn != 0 {
                    sum += CHANGE;
                }
                for joint in self.joints.iter().filter(|joint| joint.sides[1] == place) {
                    if let Some(before) = self.laid[joint.sides[0]] {
                        sum += self.cost(joint, before, here);
                    }
                }
                self.laid[place] = Some(here);
                self.place(place + 1, sum);
                self.laid[place] = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sides of a smooth world without symmetries.
    fn world() -> [Picture; 6] {
        Side::ALL.map(|side| {
            let size = 40;
            let [forward, right, up] = side.axes().map(|axis| axis.map(f64::from));
            let pixel = |k: u32| {
                let s = (f64::from(k % size) + 0.5) / f64::from(size) * 2.0 - 1.0;
                let t = 1.0 - (f64::from(k / size) + 0.5) / f64::from(size) * 2.0;
                let d: [f64; 3] = std::array::from_fn(|i| forward[i] + s * right[i] + t * up[i]);
                let length = d.iter().map(|v| v * v).sum::<f64>().sqrt();
                let [x, y, z] = d.map(|v| v / length);
                let wave = |v: f64| (0.5 + 0.5 * v.sin()) as f32;
                [
                    wave(3.0 * x + y),
                    wave(2.0 * y - z + 0.5 * x * x),
                    wave(4.0 * z + x * y),
                    1.0,
                ]
            };
            Picture {
                width: size,
                height: size,
                pixels: (0..size * size).map(pixel).collect(),
            }
        })
    }

    fn fit_of(sides: &[Picture; 6]) -> Fit {
        fit(&sides.each_ref())
    }

    #[test]
    fn the_cube_has_twelve_edges_and_sides_of_one_world_fit() {
        assert_eq!(joints().len(), 12);
        let found = fit_of(&world());
        assert!(!found.is_bad() && found.better.is_none(), "{found:?}");
        assert!(found.difference < 2.0 * found.usual, "{found:?}");
    }

    #[test]
    fn a_turned_side_is_told_with_the_turn_that_mends_it() {
        for side in Side::ALL {
            for quarters in 1..4 {
                let mut sides = world();
                let turn = Turn::clockwise(quarters);
                sides[side.index()] = turn.of(sides[side.index()].clone());
                let found = fit_of(&sides);
                let mend = Change {
                    place: side,
                    from: side,
                    turn: turn.inverse(),
                };
                assert_eq!(found.better, Some(vec![mend]), "{side} {quarters}");
            }
        }
    }

    #[test]
    fn exchanged_sides_are_told() {
        let mut sides = world();
        sides.swap(Side::Left.index(), Side::Right.index());
        let found = fit_of(&sides).better.expect("could fit");
        let pairs: Vec<_> = found
            .iter()
            .map(|change| (change.place, change.from))
            .collect();
        assert_eq!(
            pairs,
            [(Side::Right, Side::Left), (Side::Left, Side::Right)]
        );

        // A world in which each picture is mirrored is a mirrored world with two sides exchanged.
        let flip = Turn {
            mirrored: true,
            quarters: 0,
        };
        let mirrored = fit_of(&world().map(|side| flip.of(side)));
        assert_eq!(mirrored.better.expect("could fit").len(), 2);
    }

    #[test]
    fn noise_and_single_pixels_are_not_accused() {
        let mut state = 1_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        for size in [1, 2, 33] {
            let sides = Side::ALL.map(|_| Picture {
                width: size,
                height: size,
                pixels: (0..size * size)
                    .map(|_| [noise(), noise(), noise(), 1.0])
                    .collect(),
            });
            let found = fit_of(&sides);
            assert_eq!(found.better, None, "{size}");
        }
    }
}
