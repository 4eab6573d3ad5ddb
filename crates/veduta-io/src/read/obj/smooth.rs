//! Smoothing groups -> normals.

use super::parse::{NONE, Parsed};
use std::collections::HashMap;
use veduta_geometry::{DVec3, Vec3};

/// Gives the corners of smoothing groups that have no normal that of the faces around, of the same
/// group and at the same position, each weighted by its angle there (Thürmer & Wüthrich,
/// "Computing vertex normals from polygonal facets", 1998).
pub fn give_normals(parsed: &mut Parsed) {
    let mut sums = Sums::new(parsed.positions.len());
    let first_row = parsed.normals.len();
    for index in 0..parsed.runs.len() {
        let run = parsed.runs[index];
        if run.smoothing == 0 {
            continue;
        }
        let end = parsed.runs.get(index + 1);
        let end = end.map_or(parsed.faces.len(), |next| next.first);
        for face in run.first..end {
            let corners = parsed.faces.corners_mut(face);
            let n = corners.len();
            let point = |position: u32| parsed.positions[position as usize];
            let origin = point(corners[0].position);
            let normal: DVec3 = corners
                .windows(2)
                .map(|e| (point(e[0].position) - origin).cross(point(e[1].position) - origin))
                .sum();
            let normal = normal.normalize_or_zero();
            for k in 0..n {
                if corners[k].normal != NONE {
                    continue;
                }
                let at = point(corners[k].position);
                let before = point(corners[(k + n - 1) % n].position) - at;
                let after = point(corners[(k + 1) % n].position) - at;
                // The angle between them, in a form that is right for small ones too.
                let angle = before.cross(after).length().atan2(before.dot(after));
                let row = sums.row(corners[k].position, run.smoothing);
                sums.rows[row as usize].sum += normal * angle;
                corners[k].normal = first_row as u32 + row;
            }
        }
    }
    let unit = |row: &Row| row.sum.normalize_or(DVec3::Z).as_vec3();
    parsed
        .normals
        .extend(sums.rows.iter().map(unit).collect::<Vec<Vec3>>());
}

/// Sums of normals by position and smoothing group.
struct Sums {
    /// For each position: its newest row.
    newest: Vec<u32>,
    rows: Vec<Row>,
    /// Rows of positions in more groups than are looked through.
    rare: HashMap<(u32, u32), u32>,
}

struct Row {
    group: u32,
    /// The row made before it at the same position.
    older: u32,
    sum: DVec3,
}

/// Rows of a position that are looked through; the others are found in a table.
const MOST_OLDER: usize = 8;

impl Sums {
    fn new(positions: usize) -> Self {
        Self {
            newest: vec![NONE; positions],
            rows: Vec::new(),
            rare: HashMap::new(),
        }
    }

    fn row(&mut self, position: u32, group: u32) -> u32 {
        let newest = &mut self.newest[position as usize];
        let mut row = *newest;
        let mut count = 0;
        while row != NONE && self.rows[row as usize].group != group {
            row = self.rows[row as usize].older;
            count += 1;
        }
        if row != NONE {
            return row;
        }
        let made = self.rows.len() as u32;
        let mut older = NONE;
        if count < MOST_OLDER {
            older = std::mem::replace(newest, made);
        } else {
            let known = *self.rare.entry((position, group)).or_insert(made);
            if known != made {
                return known;
            }
        }
        let sum = DVec3::ZERO;
        self.rows.push(Row { group, older, sum });
        made
    }
}
