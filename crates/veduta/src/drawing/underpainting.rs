//! Underpainting: what lies below the shapes, so that nothing behind the picture is seen between them.
//!
//! A seam, where two shapes meet, is sound if something that is painted fills every pixel that the seam passes
//! through. Traps see to that where later shapes leave them room. For the rest, as painters lay a ground on
//! the bare canvas and masks keep their brushes off what is to stay bare:
//!
//! 1. The *outline* of all that is covered is the mask of ground, rims and shapes together: viewers smooth it once,
//!    and all that lies within may go beyond it.
//! 2. The *ground* fills all of the frame in the mean colour.
//! 3. *Rims*: where its border is the outline, each shape has a stroke of its own colour below all shapes, so
//!    that pixels that the outline passes through hold nothing of the ground.

use super::subdivision::Subdivision;
use super::{frame_side, trace, trap};
use crate::dice::PixelGrid;
use veduta_geometry::DVec2;

/// How far rims may be moved to have fewer corners, and how long the parts are that have none of their own, in
/// half widths.
const ROUGH: f64 = 1.0 / 7.0;

/// Where the border of a shape is the outline of all that is covered.
pub(super) struct Rim {
    /// When the shape is painted.
    pub shape: u32,
    /// In pixels.
    pub points: Vec<DVec2>,
    /// Whether it goes all the way round.
    pub closed: bool,
}

/// The outline of all that is covered, and what runs along it.
pub(super) struct Outline<'a> {
    subdivision: &'a Subdivision,
    grid: &'a PixelGrid,
    /// Half-edges with nothing across, in closed loops.
    loops: Vec<Vec<u32>>,
}

impl<'a> Outline<'a> {
    pub fn of(subdivision: &'a Subdivision, grid: &'a PixelGrid) -> Self {
        let edges = 0..subdivision.half_edges().len() as u32;
        let border: Vec<u32> = edges
            .filter(|&edge| subdivision.across(edge).is_none())
            .collect();
        Self {
            loops: trace::loops(subdivision, &border),
            subdivision,
            grid,
        }
    }

    /// Whether it is that of the frame.
    pub fn is_frame(&self) -> bool {
        let mut edges = self.loops.iter().flatten();
        edges.all(|&edge| self.frame_side(edge).is_some())
    }

    /// Outlines and holes in pixels, a pixel beyond the frame.
    pub fn polygons(&self) -> Vec<Vec<DVec2>> {
        let polygon = |edges: &Vec<u32>| -> Vec<DVec2> {
            let mut points = Vec::with_capacity(edges.len());
            let before = edges.iter().cycle().skip(edges.len() - 1);
            for (&edge, &before) in edges.iter().zip(before) {
                let [from, to] = self.pixels(edge);
                let side = self.frame_side(edge);
                let goes_on = side.is_some() && side == self.frame_side(before);
                if !goes_on {
                    points.push(from);
                    points.extend(side.map(|outwards| from + outwards));
                }
                points.extend(side.map(|outwards| to + outwards));
            }
            let corners = trace::corners(&points, trap::STRAIGHT);
            corners.into_iter().map(|corner| points[corner]).collect()
        };
        let polygons = self.loops.iter().map(polygon);
        polygons.filter(|polygon| !polygon.is_empty()).collect()
    }

    /// What runs along it off the frame, in the order in which shapes are painted; `rank` tells when each
    /// fragment is, `u32::MAX` if it is not. Strokes are to be `half_width` wide to both sides.
    pub fn rims(&self, rank: &[u32], half_width: f64) -> Vec<Rim> {
        let rough = ROUGH * half_width;
        let mut rims = Vec::new();
        for edges in &self.loops {
            self.push_rims(edges, rank, rough, &mut rims);
        }
        for rim in &mut rims {
            let points = &rim.points;
            let corners = if rim.closed {
                trace::corners(points, rough)
            } else {
                trace::corners_of_chain(points, rough)
            };
            // A loop as narrow as that has no corners.
            if !corners.is_empty() {
                rim.points = corners.into_iter().map(|corner| points[corner]).collect();
            }
        }
        rims.sort_by_key(|rim| rim.shape);
        rims
    }

    fn push_rims(&self, edges: &[u32], rank: &[u32], rough: f64, rims: &mut Vec<Rim>) {
        let shape_of = |edge: u32| {
            let fragment = self.subdivision.half_edge(edge).polygon;
            (self.frame_side(edge).is_none()).then(|| rank[fragment as usize])
        };
        let is_painted = |edge: u32| shape_of(edge).is_some_and(|shape| shape != u32::MAX);
        let begins = |&k: &usize| {
            let before = edges[(k + edges.len() - 1) % edges.len()];
            is_painted(edges[k]) && shape_of(before) != shape_of(edges[k])
        };
        let Some(first) = (0..edges.len()).find(begins) else {
            if is_painted(edges[0]) {
                rims.push(Rim {
                    shape: rank[self.subdivision.half_edge(edges[0]).polygon as usize],
                    points: edges.iter().map(|&edge| self.pixels(edge)[0]).collect(),
                    closed: true,
                });
            }
            return;
        };
        let edges = [&edges[first..], &edges[..first]].concat();
        // How long the last one goes on along other shapes; none if the frame lies between.
        let mut borrowed = None;
        for run in edges.chunk_by(|&a, &b| shape_of(a) == shape_of(b)) {
            let Some(shape) = shape_of(run[0]) else {
                borrowed = None;
                continue;
            };
            let ends = run.iter().map(|&edge| self.pixels(edge));
            let length: f64 = ends.clone().map(|[from, to]| (to - from).length()).sum();
            let to = ends.clone().map(|ends| ends[1]);
            match (rims.last_mut(), &mut borrowed) {
                (Some(last), Some(borrowed))
                    if shape == last.shape || shape == u32::MAX || *borrowed + length <= rough =>
                {
                    last.points.extend(to);
                    if shape != last.shape {
                        *borrowed += length;
                    }
                }
                _ if shape != u32::MAX => {
                    borrowed = Some(0.0);
                    let from = ends.take(1).map(|ends| ends[0]);
                    rims.push(Rim {
                        shape,
                        points: from.chain(to).collect(),
                        closed: false,
                    });
                }
                _ => {}
            }
        }
    }

    fn pixels(&self, edge: u32) -> [DVec2; 2] {
        let ends = self.subdivision.ends(edge);
        ends.map(|end| self.grid.pixels_from_image(end))
    }

    fn frame_side(&self, edge: u32) -> Option<DVec2> {
        frame_side(self.subdivision.ends(edge))
    }
}
