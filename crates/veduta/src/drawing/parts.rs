//! Parts of segments, as shares of their length: from 0 at the start to 1 at the end.

use veduta_geometry::{DVec2, cross};

/// From where to where.
pub(super) type Part = [f64; 2];

/// The whole segment.
pub(super) const WHOLE: Part = [0.0, 1.0];

/// The part of a part in which an affine function with these values at 0 and 1 is positive.
pub(super) fn positive([start, end]: Part, at_start: f64, at_end: f64) -> Option<Part> {
    let part = match (at_start > 0.0, at_end > 0.0) {
        (true, true) => [start, end],
        (false, false) => return None,
        (starts, _) => {
            let zero = at_start / (at_start - at_end);
            if starts {
                [start, end.min(zero)]
            } else {
                [start.max(zero), end]
            }
        }
    };
    (part[0] < part[1]).then_some(part)
}

/// The part of the segment `ends` within `distance` of another.
pub(super) fn near_segment(
    [from, to]: [DVec2; 2],
    other: [DVec2; 2],
    distance: f64,
) -> Option<Part> {
    // What is so near to the other is the union of two discs around its ends and a box along it. It is
    // convex, so that its parts make one.
    let discs = other.map(|centre| in_disc([from, to], centre, distance));
    let side = other[1] - other[0];
    let length = side.length();
    let along = |point: DVec2| side.dot(point - other[0]) / length;
    let beside = |point: DVec2| cross(side, point - other[0]) / length;
    let functions: [[f64; 2]; 4] = [
        [from, to].map(along),
        [from, to].map(|point| length - along(point)),
        [from, to].map(|point| distance + beside(point)),
        [from, to].map(|point| distance - beside(point)),
    ];
    let in_box = functions
        .into_iter()
        .try_fold(WHOLE, |part, [start, end]| positive(part, start, end));
    let parts = discs.into_iter().chain([in_box]).flatten();
    parts.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// The part of a segment in a disc.
fn in_disc([from, to]: [DVec2; 2], centre: DVec2, radius: f64) -> Option<Part> {
    let (along, off) = (to - from, from - centre);
    // |off + share along|² = radius², a quadratic equation in the share.
    let (a, half_b) = (along.length_squared(), along.dot(off));
    let root = (half_b * half_b - a * (off.length_squared() - radius * radius)).sqrt();
    let part = [(-half_b - root) / a, (-half_b + root) / a];
    // Where there is no root this is not a number.
    let part = [part[0].max(0.0), part[1].min(1.0)];
    (!root.is_nan() && part[0] < part[1]).then_some(part)
}

/// The union of parts, ascending.
pub(super) fn union(mut parts: Vec<Part>) -> Vec<Part> {
    parts.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    parts.dedup_by(|next, last| {
        let joins = next[0] <= last[1];
        if joins {
            last[1] = last[1].max(next[1]);
        }
        joins
    });
    parts
}

/// What the ascending `parts` leave of `whole`.
pub(super) fn without(whole: Part, parts: &[Part]) -> Vec<Part> {
    let mut rest = Vec::new();
    let mut start = whole[0];
    for part in parts {
        if part[0] > start {
            rest.push([start, part[0].min(whole[1])]);
        }
        start = start.max(part[1]);
    }
    rest.push([start, whole[1]]);
    rest.retain(|part| part[0] < part[1]);
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_is_near_another_where_its_points_are() {
        let at = |x: f64, y: f64| DVec2::new(x, y);
        let places = [
            [at(0.0, 0.0), at(4.0, 0.0)],
            [at(1.0, -3.0), at(1.5, 3.0)],
            [at(3.5, 0.5), at(9.0, 1.5)],
            [at(2.0, 0.2), at(2.0, 0.2 + 1e-9)],
        ];
        for ends in places {
            for other in places {
                let part = near_segment(ends, other, 0.75);
                for k in 0..=200 {
                    let share = f64::from(k) / 200.0;
                    let point = ends[0].lerp(ends[1], share);
                    let side = other[1] - other[0];
                    let foot =
                        ((point - other[0]).dot(side) / side.length_squared()).clamp(0.0, 1.0);
                    let distance = (other[0] + foot * side - point).length();
                    let is_near = part.is_some_and(|[from, to]| from <= share && share <= to);
                    assert!((distance - 0.75).abs() < 1e-6 || is_near == (distance < 0.75));
                }
            }
        }
    }

    #[test]
    fn what_parts_leave_and_the_parts_are_the_whole() {
        let parts = union(vec![[0.5, 0.75], [0.0, 0.25], [0.625, 1.5], [0.125, 0.375]]);
        assert_eq!(parts, [[0.0, 0.375], [0.5, 1.5]]);
        assert_eq!(without(WHOLE, &parts), [[0.375, 0.5]]);
        assert_eq!(without(WHOLE, &[[0.25, 0.5]]), [[0.0, 0.25], [0.5, 1.0]]);
        assert_eq!(without(WHOLE, &[]), [WHOLE]);
    }
}
