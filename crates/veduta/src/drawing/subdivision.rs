use super::near::{NearPoints, Segment};
use rayon::prelude::*;
use std::ops::Range;
use veduta_geometry::DVec2;

/// A directed piece of a polygon's side, from one vertex to the next one that lies on it, whoever's
/// vertex that is. The polygon lies on its left, if x is to the right and y upwards; on the screen, where
/// y is downwards, on its right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HalfEdge {
    pub from: u32,
    pub to: u32,
    /// The same piece run through the other way by a neighbour.
    pub twin: Option<u32>,
    /// The polygon whose side it is a piece of.
    pub polygon: u32,
}

/// Polygons of the plane with what lies across each piece of their sides (de Berg et al.,
/// "Computational Geometry", chapter 2: a planar subdivision, without the table of its cells).
///
/// Polygons that share a side may share it in different pieces (T-junctions): one long side of a big
/// polygon faces several small ones. All vertices that lie on a side within [`Subdivision::tolerance`]
/// cut it into pieces, so that neighbours have the same pieces and finding who is across is a matter of
/// equal vertex numbers. From there on nothing is measured, and nothing can be inconsistent: what is
/// left of a polygon's sides when pieces with twins are taken away always closes.
///
/// The names of lines ([`veduta_map::Lines`]) would not do: where models have T-junctions of their own,
/// and where an engine's cut runs along an edge, two lines with different names lie on one another.
pub(super) struct Subdivision {
    pub vertices: Vec<DVec2>,
    /// By polygon, in the order of its sides.
    half_edges: Vec<HalfEdge>,
    /// `half_edges[start[i]..start[i + 1]]` are those of polygon `i`.
    start: Vec<u32>,
}

/// Polygons a task looks at at a time.
const POLYGONS_PER_TASK: usize = 256;

impl Subdivision {
    /// Finds neighbours. Vertices within `tolerance` of one another become one, and cut the sides that
    /// pass them within `tolerance`.
    ///
    /// It must exceed the error of vertices that were computed (a cut at a flat angle loses digits), and
    /// be far below what can be seen.
    pub fn new(polygons: &[&[DVec2]], tolerance: f64) -> Self {
        let (vertices, numbers) = welded(&polygons.concat(), tolerance);
        let near = NearPoints::new(&vertices);

        let mut rest = &numbers[..];
        let numbers_of = |polygon: &&[DVec2]| {
            let of_polygon;
            (of_polygon, rest) = rest.split_at(polygon.len());
            of_polygon
        };
        let by_polygon: Vec<&[u32]> = polygons.iter().map(numbers_of).collect();
        let pieces: Vec<Vec<[u32; 2]>> = by_polygon
            .par_iter()
            .with_min_len(POLYGONS_PER_TASK)
            .map(|corners| pieces_of(corners, &vertices, &near, tolerance))
            .collect();

        let mut start = vec![0];
        let mut half_edges = Vec::with_capacity(pieces.iter().map(Vec::len).sum());
        for (polygon, pieces) in pieces.iter().enumerate() {
            half_edges.extend(pieces.iter().map(|&[from, to]| HalfEdge {
                from,
                to,
                twin: None,
                polygon: polygon as u32,
            }));
            start.push(u32::try_from(half_edges.len()).expect("at most u32::MAX pieces of sides"));
        }
        find_twins(&mut half_edges);
        Self {
            vertices,
            half_edges,
            start,
        }
    }

    pub fn half_edge(&self, index: u32) -> &HalfEdge {
        &self.half_edges[index as usize]
    }

    /// The half-edges around a polygon, in order.
    pub fn around(&self, polygon: u32) -> Range<u32> {
        self.start[polygon as usize]..self.start[polygon as usize + 1]
    }

    /// The polygon across a half-edge.
    pub fn across(&self, half_edge: u32) -> Option<u32> {
        let twin = self.half_edge(half_edge).twin?;
        Some(self.half_edge(twin).polygon)
    }

    /// The end points of a half-edge.
    pub fn ends(&self, half_edge: u32) -> [DVec2; 2] {
        let HalfEdge { from, to, .. } = *self.half_edge(half_edge);
        [from, to].map(|vertex| self.vertices[vertex as usize])
    }

    /// All half-edges.
    pub fn half_edges(&self) -> &[HalfEdge] {
        &self.half_edges
    }
}

/// The different points of `points`, and for each of `points` its number among them. Points within
/// `tolerance` become the first of them by (x, y).
fn welded(points: &[DVec2], tolerance: f64) -> (Vec<DVec2>, Vec<u32>) {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let at = |index: u32| points[index as usize];
    order.par_sort_unstable_by(|&a, &b| {
        let (p, q) = (at(a), at(b));
        p.x.total_cmp(&q.x)
            .then(p.y.total_cmp(&q.y))
            .then(a.cmp(&b))
    });
    let mut distinct: Vec<DVec2> = Vec::new();
    let mut numbers = vec![0; points.len()];
    for &index in &order {
        if distinct.last() != Some(&at(index)) {
            distinct.push(at(index));
        }
        numbers[index as usize] = distinct.len() as u32 - 1;
    }

    let near = NearPoints::new(&distinct);
    let first_near: Vec<u32> = distinct
        .par_iter()
        .zip(0..distinct.len() as u32)
        .map(|(&point, own)| {
            let mut first = own;
            let place = Segment {
                from: point,
                to: point,
            };
            near.each(place, tolerance, &mut |other| first = first.min(other));
            first
        })
        .collect();
    let mut vertices = Vec::new();
    let mut vertex_of: Vec<u32> = Vec::with_capacity(distinct.len());
    for (own, &first) in first_near.iter().enumerate() {
        // The first one near may itself have gone to another.
        let vertex = if first as usize == own {
            vertices.push(distinct[own]);
            vertices.len() as u32 - 1
        } else {
            vertex_of[first as usize]
        };
        vertex_of.push(vertex);
    }
    for number in &mut numbers {
        *number = vertex_of[*number as usize];
    }
    (vertices, numbers)
}

/// The sides of a polygon, each cut at the vertices that lie on it.
fn pieces_of(
    corners: &[u32],
    vertices: &[DVec2],
    near: &NearPoints,
    tolerance: f64,
) -> Vec<[u32; 2]> {
    let mut pieces = Vec::with_capacity(corners.len());
    let mut on_side: Vec<(f64, u32)> = Vec::new();
    for (index, &from) in corners.iter().enumerate() {
        let to = corners[(index + 1) % corners.len()];
        if from == to {
            continue;
        }
        let side = Segment {
            from: vertices[from as usize],
            to: vertices[to as usize],
        };
        on_side.clear();
        near.each(side, tolerance, &mut |vertex| {
            if vertex != from && vertex != to {
                on_side.push((side.share(vertices[vertex as usize]), vertex));
            }
        });
        on_side.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut last = from;
        for &(_, vertex) in &on_side {
            pieces.push([last, vertex]);
            last = vertex;
        }
        pieces.push([last, to]);
    }
    pieces
}

/// Pairs each half-edge with one that runs the other way between the same vertices.
fn find_twins(half_edges: &mut [HalfEdge]) {
    // Of two polygons that overlap by rounding there may be several each way: they pair in order.
    let mut by_ends: Vec<(u32, u32, bool, u32)> = half_edges
        .par_iter()
        .zip(0..half_edges.len() as u32)
        .map(|(edge, index)| {
            let (low, high) = (edge.from.min(edge.to), edge.from.max(edge.to));
            (low, high, edge.from > edge.to, index)
        })
        .collect();
    by_ends.par_sort_unstable();
    for same_ends in by_ends.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let backwards = same_ends.partition_point(|key| !key.2);
        let (forth, back) = same_ends.split_at(backwards);
        for (&(.., one), &(.., other)) in forth.iter().zip(back) {
            half_edges[one as usize].twin = Some(other);
            half_edges[other as usize].twin = Some(one);
        }
    }
}
