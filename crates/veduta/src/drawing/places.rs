use crate::buckets::Buckets;
use std::ops::Range;
use veduta_geometry::DVec2;

/// Which things lie where in the frame, from (0, 0) to (1, 1): by the cells of a grid that their boxes meet.
pub(super) struct Places {
    cells: u32,
    /// By cell, rows of `things`.
    in_cells: Buckets,
    /// A thing once for each row of cells that it meets.
    things: Vec<u32>,
}

/// Most cells along a side: finer grids hold large things too often.
const MOST_CELLS: f64 = 128.0;

impl Places {
    /// Of things in boxes, each from its lowest to its highest coordinates.
    pub fn new(boxes: impl ExactSizeIterator<Item = [DVec2; 2]>) -> Self {
        let cells = (boxes.len() as f64).sqrt().clamp(1.0, MOST_CELLS) as u32;
        let mut things = Vec::new();
        let mut in_rows = Vec::new();
        for (thing, [low, high]) in (0u32..).zip(boxes) {
            let columns = range(cells, low.x, high.x);
            for row in range(cells, low.y, high.y) {
                things.push(thing);
                in_rows.push(row * cells + columns.start..row * cells + columns.end);
            }
        }
        Self {
            cells,
            in_cells: Buckets::new((cells * cells) as usize, &in_rows),
            things,
        }
    }

    /// Those that may lie in a box, ascending.
    pub fn within(&self, [low, high]: [DVec2; 2], near: &mut Vec<u32>) {
        near.clear();
        for row in range(self.cells, low.y, high.y) {
            for column in range(self.cells, low.x, high.x) {
                let rows = self.in_cells.of((row * self.cells + column) as usize);
                near.extend(rows.iter().map(|&row| self.things[row as usize]));
            }
        }
        near.sort_unstable();
        near.dedup();
    }

    /// Those that may lie within `margin` of a segment, ascending.
    pub fn along(&self, from: DVec2, to: DVec2, margin: f64, near: &mut Vec<u32>) {
        near.clear();
        let (top, bottom) = if from.y <= to.y {
            (from, to)
        } else {
            (to, from)
        };
        for row in range(self.cells, top.y - margin, bottom.y + margin) {
            // Where it comes within the margin of the row.
            let x_at = |border: u32, beyond: f64| {
                let y = f64::from(border) / f64::from(self.cells) + beyond;
                let share = ((y - top.y) / (bottom.y - top.y)).clamp(0.0, 1.0);
                // Along the row all of it does.
                (!share.is_nan()).then_some(top.x + share * (bottom.x - top.x))
            };
            let [one, other] = match (x_at(row, -margin), x_at(row + 1, margin)) {
                (Some(one), Some(other)) => [one, other],
                _ => [top.x, bottom.x],
            };
            for column in range(self.cells, one.min(other) - margin, one.max(other) + margin) {
                let rows = self.in_cells.of((row * self.cells + column) as usize);
                near.extend(rows.iter().map(|&row| self.things[row as usize]));
            }
        }
        near.sort_unstable();
        near.dedup();
    }
}

/// The lowest and the highest coordinates of points.
pub(super) fn box_around(points: &[DVec2]) -> [DVec2; 2] {
    let points = points.iter().copied();
    [
        points.clone().fold(DVec2::INFINITY, DVec2::min),
        points.fold(DVec2::NEG_INFINITY, DVec2::max),
    ]
}

/// The cells, across the frame, in which what reaches from `low` to `high` lies.
fn range(cells: u32, low: f64, high: f64) -> Range<u32> {
    let cell = |at: f64| ((at * f64::from(cells)).floor().max(0.0) as u32).min(cells - 1);
    cell(low)..cell(high) + 1
}
