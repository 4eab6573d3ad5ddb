use rayon::prelude::*;
use veduta_geometry::{DVec2, cross};

/// Points, sorted to answer one question: which of them lie near a segment?
///
/// A k-d tree (Bentley, "Multidimensional binary search trees", 1975) without pointers: the middle of
/// each range of the table is its node. Unlike a grid it does not mind that half of a picture's vertices
/// lie on the horizon.
pub(super) struct NearPoints {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy)]
struct Node {
    point: DVec2,
    index: u32,
}

/// Points of a range that is sorted by one task.
const SORTED_ALONE: usize = 8 * 1024;

impl NearPoints {
    pub fn new(points: &[DVec2]) -> Self {
        let node = |(index, &point)| Node {
            point,
            index: index as u32,
        };
        let mut nodes: Vec<Node> = points.par_iter().enumerate().map(node).collect();
        sort(&mut nodes, 0);
        Self { nodes }
    }

    /// Visits the points within `distance` of the segment, in no order that means anything, but always
    /// the same.
    pub fn each(&self, segment: Segment, distance: f64, visit: &mut impl FnMut(u32)) {
        each_of(&self.nodes, 0, &segment, [0.0, 1.0], distance, visit);
    }
}

/// A segment between two points, which may be one.
#[derive(Clone, Copy)]
pub(super) struct Segment {
    pub from: DVec2,
    pub to: DVec2,
}

impl Segment {
    /// Where the foot of the perpendicular from `point` lies: 0 at the start, 1 at the end. NaN if the
    /// segment is a point.
    pub fn share(&self, point: DVec2) -> f64 {
        let along = self.to - self.from;
        (point - self.from).dot(along) / along.length_squared()
    }

    /// Distance of a point from the line through the segment; NaN if that is a point.
    pub fn distance_from_line(&self, point: DVec2) -> f64 {
        let along = self.to - self.from;
        cross(along, point - self.from).abs() / along.length()
    }

    fn is_near(&self, point: DVec2, distance: f64) -> bool {
        let share = self.share(point);
        if share > 0.0 && share < 1.0 {
            self.distance_from_line(point) <= distance
        } else {
            let nearer = if share >= 1.0 { self.to } else { self.from };
            (point - nearer).length_squared() <= distance * distance
        }
    }
}

fn sort(nodes: &mut [Node], axis: usize) {
    if nodes.len() < 2 {
        return;
    }
    let middle = nodes.len() / 2;
    let by_axis = |a: &Node, b: &Node| {
        let [a_key, b_key] = [a, b].map(|node| node.point[axis]);
        a_key.total_cmp(&b_key).then(a.index.cmp(&b.index))
    };
    let (before, _, after) = nodes.select_nth_unstable_by(middle, by_axis);
    let axis = 1 - axis;
    if before.len() > SORTED_ALONE {
        rayon::join(|| sort(before, axis), || sort(after, axis));
    } else {
        sort(before, axis);
        sort(after, axis);
    }
}

/// Goes down the tree with the part of the segment that may have points near it: `part` of its length.
fn each_of(
    nodes: &[Node],
    axis: usize,
    segment: &Segment,
    part: [f64; 2],
    distance: f64,
    visit: &mut impl FnMut(u32),
) {
    if nodes.is_empty() || part[0] > part[1] {
        return;
    }
    let middle = nodes.len() / 2;
    let node = nodes[middle];
    if segment.is_near(node.point, distance) {
        visit(node.index);
    }
    // Twice as far as asked for: rounding must not lose a point.
    let margin = 2.0 * distance;
    let (start, rise) = (segment.from[axis], segment.to[axis] - segment.from[axis]);
    let up_to = part_below(part, start, rise, node.point[axis] + margin);
    let from = part_below(part, -start, -rise, margin - node.point[axis]);
    each_of(&nodes[..middle], 1 - axis, segment, up_to, distance, visit);
    each_of(
        &nodes[middle + 1..],
        1 - axis,
        segment,
        from,
        distance,
        visit,
    );
}

/// The part in which `start + share * rise <= limit`.
fn part_below([first, last]: [f64; 2], start: f64, rise: f64, limit: f64) -> [f64; 2] {
    if rise == 0.0 {
        return if start <= limit {
            [first, last]
        } else {
            [1.0, 0.0]
        };
    }
    let share = (limit - start) / rise;
    if rise > 0.0 {
        [first, last.min(share)]
    } else {
        [first.max(share), last]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_finds_what_looking_at_every_point_finds() {
        // A lattice with its points moved a little, many on one line, and some twice.
        let mut points: Vec<DVec2> = (0..900)
            .map(|k| {
                let (column, row) = (f64::from(k % 30), f64::from(k / 30));
                DVec2::new(column + 0.013 * row, row * row / 30.0)
            })
            .collect();
        points.extend((0..300).map(|k| DVec2::new(f64::from(k) * 0.1, 7.5)));
        points.extend_from_within(100..150);
        let tree = NearPoints::new(&points);
        let mut found_any = 0;
        for k in 0..200 {
            let from = points[k * 5];
            let to = if k % 7 == 0 {
                from
            } else {
                points[(k * 37 + 11) % points.len()]
            };
            let segment = Segment { from, to };
            for distance in [0.0, 1e-9, 0.2] {
                let mut found = Vec::new();
                tree.each(segment, distance, &mut |index| found.push(index));
                found.sort_unstable();
                let near = |index: &u32| segment.is_near(points[*index as usize], distance);
                let expected: Vec<u32> = (0..points.len() as u32).filter(near).collect();
                assert_eq!(found, expected, "{from} to {to}, {distance}");
                found_any += found.len();
            }
        }
        assert!(found_any > 2000);
    }
}
