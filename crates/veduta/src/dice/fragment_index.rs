//! Which fragments of a map are seen where.

use rayon::prelude::*;
use veduta_geometry::{Cells, DVec2, GridAreas};
use veduta_map::VisibilityMap;

/// Which fragments are seen where: lists for the cells of a grid over the frame.
pub(super) struct FragmentIndex {
    side: u32,
    /// `fragments[starts[c]..starts[c + 1]]` are seen in cell `c`, ascending.
    starts: Vec<u32>,
    fragments: Vec<u32>,
}

/// Bounds of the number of cells along a side of the index. Fewer would list too much for a patch, more would list
/// large fragments too often.
const INDEX_SIDES: [f64; 2] = [32.0, 1024.0];

impl FragmentIndex {
    pub fn new(map: &VisibilityMap) -> Self {
        let count = map.fragment_count();
        let side = (count as f64).sqrt().clamp(INDEX_SIDES[0], INDEX_SIDES[1]) as u32;
        let mut listed: Vec<(u32, u32)> = (0..count as u32)
            .into_par_iter()
            .with_min_len(1024)
            .fold(
                || (Vec::new(), GridAreas::new(), Vec::new()),
                |(mut listed, mut areas, mut scaled), fragment| {
                    scaled.clear();
                    let polygon = map.polygon(map.fragment(fragment as usize));
                    scaled.extend(polygon.iter().map(|&p| p * f64::from(side)));
                    areas.each_cell(&scaled, side, 0..side, |cells| match cells {
                        Cells::Boundary { column, row, .. } => {
                            listed.push((row * side + column, fragment));
                        }
                        Cells::Inside { row, columns } => {
                            let cells = columns.map(|column| row * side + column);
                            listed.extend(cells.map(|cell| (cell, fragment)));
                        }
                    });
                    (listed, areas, scaled)
                },
            )
            .map(|(listed, ..)| listed)
            .reduce(Vec::new, |mut a, mut b| {
                a.append(&mut b);
                a
            });
        listed.par_sort_unstable();
        let cells = side * side;
        let mut starts = vec![0_u32; cells as usize + 1];
        for &(cell, _) in &listed {
            starts[cell as usize + 1] += 1;
        }
        for cell in 0..cells as usize {
            starts[cell + 1] += starts[cell];
        }
        Self {
            side,
            starts,
            fragments: listed.into_iter().map(|(_, fragment)| fragment).collect(),
        }
    }

    /// Adds the fragments that may be seen in a rectangle of the frame, ascending.
    pub fn find(&self, [min, max]: [DVec2; 2], near: &mut Vec<u32>) {
        let last = self.side - 1;
        let cell = |at: f64| ((at * f64::from(self.side)).max(0.0) as u32).min(last);
        let [columns, rows] = [0, 1].map(|axis| cell(min[axis])..cell(max[axis]) + 1);
        let is_one = columns.len() * rows.len() == 1;
        for row in rows {
            let first = self.starts[(row * self.side + columns.start) as usize] as usize;
            let end = self.starts[(row * self.side + columns.end) as usize] as usize;
            near.extend_from_slice(&self.fragments[first..end]);
        }
        if !is_one {
            near.sort_unstable();
            near.dedup();
        }
    }
}
