use super::near::Segment;
use super::subdivision::Subdivision;
use std::f64::consts::TAU;
use veduta_geometry::{DVec2, cross};

/// Joins the half-edges of `border` to closed loops, each used once.
///
/// `border` must close: as many of them begin at a vertex as end there, which is so for the half-edges
/// of any polygons without those that are twins of one another. Where a loop comes to a vertex
/// that several leave, it takes the one with which it encloses the smallest angle: areas that touch in a
/// point become two loops, and no loop crosses itself or another.
///
/// Loops of positive area are outlines, the others holes.
pub(super) fn loops(subdivision: &Subdivision, border: &[u32]) -> Vec<Vec<u32>> {
    let mut leaving: Vec<(u32, u32)> = border
        .iter()
        .map(|&edge| (subdivision.half_edge(edge).from, edge))
        .collect();
    leaving.sort_unstable();
    let mut used = vec![false; leaving.len()];
    let leaving_from = |vertex: u32| {
        let start = leaving.partition_point(|row| row.0 < vertex);
        let end = start + leaving[start..].partition_point(|row| row.0 == vertex);
        start..end
    };

    let mut loops = Vec::new();
    for first in 0..leaving.len() {
        if used[first] {
            continue;
        }
        let mut round = Vec::new();
        let mut row = first;
        loop {
            used[row] = true;
            let edge = leaving[row].1;
            round.push(edge);
            let [before, corner] = subdivision.ends(edge);
            // Its start may be taken again: that closes the loop.
            let open = leaving_from(subdivision.half_edge(edge).to)
                .filter(|&next| !used[next] || next == first);
            let angle = |next: &usize| {
                let [_, after] = subdivision.ends(leaving[*next].1);
                enclosed_angle(before - corner, after - corner)
            };
            let next = open.min_by(|a, b| angle(a).total_cmp(&angle(b)));
            row = next.expect("as many half-edges leave a vertex as come to it");
            if row == first {
                break;
            }
        }
        loops.push(round);
    }
    loops
}

/// The angle within a polygon at a corner, from its next side to the one before; 0 exclusive to 2π.
fn enclosed_angle(to_before: DVec2, to_after: DVec2) -> f64 {
    let angle = cross(to_after, to_before).atan2(to_after.dot(to_before));
    if angle > 0.0 { angle } else { angle + TAU }
}

/// Which points of a closed polygon are corners: without the others no side moves by more than
/// `tolerance`. Ascending; none, if there are fewer than three.
pub(super) fn corners(points: &[DVec2], tolerance: f64) -> Vec<usize> {
    let by_place = |&a: &usize, &b: &usize| {
        let (p, q) = (points[a], points[b]);
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y))
    };
    // An extreme point lies on no straight side.
    let Some(first) = (0..points.len()).min_by(by_place) else {
        return Vec::new();
    };
    let turned: Vec<DVec2> = (0..=points.len())
        .map(|step| points[(first + step) % points.len()])
        .collect();
    let mut kept = corners_of_chain(&turned, tolerance);
    kept.pop();
    if kept.len() < 3 {
        return Vec::new();
    }
    for step in &mut kept {
        *step = (first + *step) % points.len();
    }
    kept.sort_unstable();
    kept
}

/// [`corners`] of an open chain of points, whose ends are always kept.
pub(super) fn corners_of_chain(points: &[DVec2], tolerance: f64) -> Vec<usize> {
    let mut kept = vec![0];
    let mut last = 0;
    for next in 2..points.len() {
        let side = Segment {
            from: points[last],
            to: points[next],
        };
        let is_straight = points[last + 1..next].iter().all(|&point| {
            let share = side.share(point);
            share > 0.0 && share < 1.0 && side.distance_from_line(point) <= tolerance
        });
        if !is_straight {
            last = next - 1;
            kept.push(last);
        }
    }
    if points.len() > 1 {
        kept.push(points.len() - 1);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta_geometry::signed_area;

    fn points(corners: &[(f64, f64)]) -> Vec<DVec2> {
        corners.iter().copied().map(DVec2::from).collect()
    }

    #[test]
    fn squares_that_touch_in_a_corner_are_two_loops() {
        let squares = [
            points(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]),
            points(&[(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)]),
        ];
        let polygons: Vec<&[DVec2]> = squares.iter().map(Vec::as_slice).collect();
        let subdivision = Subdivision::new(&polygons, 1e-12);
        let border: Vec<u32> = (0..8).collect();
        let loops = loops(&subdivision, &border);
        assert_eq!(loops.iter().map(Vec::len).collect::<Vec<_>>(), [4, 4]);
    }

    #[test]
    fn a_ring_of_polygons_is_an_outline_and_a_hole() {
        // Four trapezoids around a square, one of them cut in two: a T-junction at its neighbours.
        let at = |x: f64, y: f64| DVec2::new(x, y);
        let rings = [
            vec![at(0.0, 0.0), at(3.0, 0.0), at(2.0, 1.0), at(1.0, 1.0)],
            vec![at(3.0, 0.0), at(3.0, 3.0), at(2.0, 2.0), at(2.0, 1.0)],
            vec![at(3.0, 3.0), at(0.0, 3.0), at(0.5, 2.5), at(2.5, 2.5)],
            vec![at(2.5, 2.5), at(0.5, 2.5), at(1.0, 2.0), at(2.0, 2.0)],
            vec![at(0.0, 3.0), at(0.0, 0.0), at(1.0, 1.0), at(1.0, 2.0)],
        ];
        let polygons: Vec<&[DVec2]> = rings.iter().map(Vec::as_slice).collect();
        let subdivision = Subdivision::new(&polygons, 1e-12);
        let border: Vec<u32> = (0..subdivision.half_edges().len() as u32)
            .filter(|&edge| subdivision.half_edge(edge).twin.is_none())
            .collect();
        let outlines: Vec<Vec<DVec2>> = loops(&subdivision, &border)
            .iter()
            .map(|edges| {
                let points: Vec<DVec2> = edges.iter().map(|&e| subdivision.ends(e)[0]).collect();
                let kept = corners(&points, 1e-12);
                kept.into_iter().map(|index| points[index]).collect()
            })
            .collect();
        let sizes: Vec<_> = outlines.iter().map(Vec::len).collect();
        assert_eq!(sizes, [4, 4]);
        let mut areas: Vec<f64> = outlines
            .iter()
            .map(|outline| signed_area(outline))
            .collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas, [-1.0, 9.0]);
    }

    #[test]
    fn points_on_a_straight_side_are_no_corners() {
        let square = points(&[
            (0.5, 0.0),
            (1.0, 0.0),
            (1.0, 0.3),
            (1.0, 0.6),
            (1.0, 1.0),
            (0.0, 1.0),
            (0.0, 0.5 + 1e-13),
            (0.0, 0.0),
        ]);
        assert_eq!(corners(&square, 1e-12), [1, 4, 5, 7]);
        assert!(
            corners(&square[1..5], 1e-12).is_empty(),
            "no area, no corners"
        );
    }
}
