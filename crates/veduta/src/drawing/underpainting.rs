//! Underpainting: what lies below the shapes where they have no room to reach under one another.
//!
//! A seam, where two shapes meet, is sound if something that is painted fills every pixel that the seam may
//! pass through: then nothing behind the picture shows there, however a viewer smooths edges. Traps see to
//! that where later shapes leave them room. Below all shapes lies the rest, as painters lay one on the bare
//! canvas:
//!
//! 1. The *ground*: all that is covered, [`INSET`] within its outline so as not to fatten it, in the mean
//!    colour.
//! 2. *Strips*, where seams come to the outline, which the ground does not reach: around each part of a seam that
//!    no shape fills, in one of the two colours, as wide as `depth` to both sides and cut off where nothing is
//!    covered.
//!
//! A seam is filled by a shape where the border of what is painted of it is farther away than `depth`. Borders
//! along the outline do not count: beyond there is nothing to be filled.

use super::parts::{Part, WHOLE, near_segment, positive, union, without};
use super::places::{Places, box_around};
use super::subdivision::Subdivision;
use super::veils::clipped;
use super::{Shape, is_on_frame, trace};
use crate::dice::PixelGrid;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::simplify::SimplifyShape;
use i_overlay::float::single::SingleFloatOverlay;
use i_overlay::mesh::float::outline::offset::OutlineOffset;
use i_overlay::mesh::float::style::OutlineStyle;
use rayon::prelude::*;
use std::collections::BTreeSet;
use veduta_geometry::{Affine, DVec2, cross, signed_area};

/// What lies below all shapes, in the colour of one of them.
pub(super) struct Strips {
    /// When the shape is painted.
    pub shape: u32,
    /// Outlines and holes, in pixels.
    pub outlines: Vec<Vec<DVec2>>,
}

/// What is painted.
pub(super) struct Painted<'a> {
    pub subdivision: &'a Subdivision,
    /// When each fragment is painted; `u32::MAX` if it is not.
    pub rank: &'a [u32],
    /// In the order in which they are painted.
    pub shapes: &'a [Shape],
    /// Where they lie.
    pub covered: &'a Covered,
    pub grid: &'a PixelGrid,
    /// How far around each seam, in pixels, one shape has to fill what is covered.
    pub depth: f64,
}

/// How near to the outline of all that is covered a border runs along it, in pixels: more than what is
/// painted was moved to make it straight.
const ON_RIM: f64 = 1e-3;

/// Lengths in pixels of seams that are not looked at.
const NEGLIGIBLE_LENGTH: f64 = 1e-6;

/// Areas in square pixels of strips that are not worth painting.
const NEGLIGIBLE_AREA: f64 = 1e-6;

/// How far, in pixels, strips that lie within the outline may be moved to have fewer corners.
const ROUGH: f64 = 0.25;

/// How far within the outline of all that is covered the ground ends, in pixels. With less, outlines before
/// the background would look fat; with more, there would be more strips.
const INSET: f64 = 1.0;

/// How far from the outline the ground is sure to be, in pixels: inset corners are cut off, and its outline is
/// made simple.
const FROM_RIM: f64 = 1.5 * INSET + ROUGH;

/// Side in pixels of the squares that strips are made of.
const CELL: f64 = 0.5;

/// How far from a seam, in depths, shapes are looked for that may fill what is around it.
const SEARCHED: f64 = 3.0;

/// A part of a seam at which something may show through.
struct Gap {
    ends: [DVec2; 2],
    /// The shapes that meet there; one of them may be `u32::MAX`.
    shapes: [u32; 2],
}

/// Outlines of the ground in `whole`.
pub(super) fn ground(whole: &Covered) -> Vec<Vec<DVec2>> {
    simplified(whole.0.outline(&OutlineStyle::new(-INSET)), ROUGH)
}

/// Shapes, with outlines and holes of points.
type Shapes = Vec<Vec<Vec<[f64; 2]>>>;

/// All that is covered, in pixels, and a little beyond the frame.
pub(super) struct Covered(Shapes);

impl Covered {
    pub fn of(subdivision: &Subdivision, grid: &PixelGrid) -> Self {
        let edges = 0..subdivision.half_edges().len() as u32;
        let border: Vec<u32> = edges
            .filter(|&edge| subdivision.across(edge).is_none())
            .collect();
        // At the frame it goes on to the frame.
        let beyond = |point: DVec2| {
            let on_frame = |at: f64| {
                let is_at = |side: f64| f64::from((at - side).abs() <= 2.0 * super::COINCIDENT);
                is_at(1.0) - is_at(0.0)
            };
            grid.pixels_from_image(point) + INSET * DVec2::new(on_frame(point.x), on_frame(point.y))
        };
        let loops = trace::loops(subdivision, &border);
        let outlines: Vec<Vec<[f64; 2]>> = loops
            .iter()
            .map(|edges| {
                let points = edges.iter().map(|&edge| beyond(subdivision.ends(edge)[0]));
                points.map(|point| point.to_array()).collect()
            })
            .collect();
        // Loops may touch themselves in points.
        Self(outlines.simplify_shape(FillRule::NonZero))
    }

    /// The part in a rectangle.
    fn within(&self, [low, high]: [DVec2; 2]) -> Vec<Vec<[f64; 2]>> {
        let sides = [
            Affine::new(1.0, 0.0, -low.x),
            Affine::new(-1.0, 0.0, high.x),
            Affine::new(0.0, 1.0, -low.y),
            Affine::new(0.0, -1.0, high.y),
        ];
        // Of outlines that are not convex, parts hang together by lines along the rectangle, which enclose
        // nothing.
        let clipped = self.0.iter().flatten().map(|outline| {
            let outline: Vec<DVec2> = outline.iter().copied().map(DVec2::from).collect();
            let clip = |part: Vec<DVec2>, side| clipped(&part, side);
            let part = sides.iter().fold(outline, clip);
            part.iter().map(|point| point.to_array()).collect()
        });
        clipped.filter(|part: &Vec<_>| part.len() > 2).collect()
    }
}

/// Outlines of shapes, with fewer corners within a tolerance.
fn simplified(shapes: Shapes, tolerance: f64) -> Vec<Vec<DVec2>> {
    let outlines = shapes.into_iter().flatten().filter_map(|outline| {
        let points: Vec<DVec2> = outline.into_iter().map(DVec2::from).collect();
        let corners = trace::corners(&points, tolerance);
        let outline: Vec<DVec2> = corners.into_iter().map(|corner| points[corner]).collect();
        (signed_area(&outline).abs() > NEGLIGIBLE_AREA).then_some(outline)
    });
    outlines.collect()
}

/// The strips, by shape in the order in which these are painted.
pub(super) fn strips(painted: &Painted) -> Vec<Strips> {
    let borders = Borders::new(painted);
    let gaps: Vec<Gap> = (0..painted.subdivision.half_edges().len() as u32)
        .into_par_iter()
        .map_init(Vec::new, |near, edge| borders.gaps(edge, near))
        .flatten_iter()
        .collect();
    let by_shape = assigned(&gaps, painted.shapes.len());
    let strips = by_shape.par_iter().map(|(shape, of_shape)| Strips {
        shape: *shape,
        outlines: painted.strips(of_shape),
    });
    strips
        .filter(|strips| !strips.outlines.is_empty())
        .collect()
}

/// Gaps by the shape in whose colour they are filled: that of the two that has more of them.
fn assigned(gaps: &[Gap], count: usize) -> Vec<(u32, Vec<&Gap>)> {
    let mut length = vec![0.0; count];
    for gap in gaps {
        let [from, to] = gap.ends;
        for shape in gap.shapes.into_iter().filter(|&shape| shape != u32::MAX) {
            length[shape as usize] += (to - from).length();
        }
    }
    let mut of_shapes: Vec<(u32, &Gap)> = Vec::with_capacity(gaps.len());
    for gap in gaps {
        let shapes = gap.shapes.into_iter().filter(|&shape| shape != u32::MAX);
        let longest = shapes.max_by(|&a, &b| {
            let by_length = length[a as usize].total_cmp(&length[b as usize]);
            by_length.then(b.cmp(&a))
        });
        of_shapes.extend(longest.map(|shape| (shape, gap)));
    }
    of_shapes.sort_by_key(|row| row.0);
    of_shapes
        .chunk_by(|a, b| a.0 == b.0)
        .map(|rows| (rows[0].0, rows.iter().map(|row| row.1).collect()))
        .collect()
}

/// Borders of what is painted, but those along the outline of all that is covered and off the frame.
struct Borders<'a> {
    painted: &'a Painted<'a>,
    rim: Rim,
    segments: Vec<Border>,
    places: Places,
    /// Of what the places are told, from pixels.
    scale: f64,
    /// Around each shape.
    boxes: Vec<[DVec2; 2]>,
}

struct Border {
    shape: u32,
    ends: [DVec2; 2],
}

impl<'a> Borders<'a> {
    fn new(painted: &'a Painted<'a>) -> Self {
        let [from, to] = painted.frame();
        let scale = 1.0 / (to - from).max_element();
        let rim = Rim::new(painted, scale);
        let of_shape = |(index, shape): (usize, &Shape)| {
            let sides = shape.painted.iter().flat_map(|outline| {
                let next = outline.iter().cycle().skip(1);
                outline.iter().zip(next).map(|(&from, &to)| [from, to])
            });
            let borders = sides.filter_map(|ends| {
                let ends = painted.within_frame(ends)?;
                let shape = index as u32;
                (!rim.contains(ends)).then_some(Border { shape, ends })
            });
            borders.collect::<Vec<_>>()
        };
        let segments: Vec<Vec<Border>> = painted
            .shapes
            .par_iter()
            .enumerate()
            .map(of_shape)
            .collect();
        let segments: Vec<Border> = segments.into_iter().flatten().collect();
        let boxes = segments.iter().map(|border| box_around(&border.ends));
        let places = Places::new(boxes.map(|corners| corners.map(|corner| corner * scale)));
        let around = |shape: &Shape| box_around(&shape.painted.concat());
        Self {
            painted,
            rim,
            segments,
            places,
            scale,
            boxes: painted.shapes.par_iter().map(around).collect(),
        }
    }

    /// Where something may show through along a half-edge.
    fn gaps(&self, edge: u32, near: &mut Vec<u32>) -> Vec<Gap> {
        let Painted {
            subdivision, rank, ..
        } = self.painted;
        let half_edge = subdivision.half_edge(edge);
        let Some(twin) = half_edge.twin.filter(|&twin| twin > edge) else {
            return Vec::new();
        };
        let polygons = [half_edge.polygon, subdivision.half_edge(twin).polygon];
        let shapes = polygons.map(|polygon| rank[polygon as usize]);
        let below = shapes[0].min(shapes[1]);
        let ends @ [from, to] = self.painted.pixels(edge);
        let length = (to - from).length();
        // Where neither is painted there is nothing that could be seen.
        if shapes[0] == shapes[1] || length <= NEGLIGIBLE_LENGTH {
            return Vec::new();
        }
        let beside_ground = self.rim.parts_near(ends, self.painted.depth + FROM_RIM);
        if beside_ground.is_empty() {
            return Vec::new();
        }
        let margin = SEARCHED * self.painted.depth;
        let [scaled_from, scaled_to] = ends.map(|end| end * self.scale);
        self.places
            .along(scaled_from, scaled_to, margin * self.scale, near);
        let near_border = self.parts_near_border(below, ends, near);
        // The part of each that is near the border.
        let rest = without(WHOLE, &near_border);
        let mut gaps: Vec<Part> = beside_ground
            .iter()
            .flat_map(|&part| without(part, &rest))
            .collect();
        if !gaps.is_empty() {
            let mut others: Vec<u32> = near
                .iter()
                .map(|&border| self.segments[border as usize].shape)
                .filter(|&shape| shape < below)
                .collect();
            others.sort_unstable();
            others.dedup();
            for other in others {
                gaps = self.left_by(other, ends, &gaps, near);
            }
        }
        gaps.into_iter()
            .filter(|part| (part[1] - part[0]) * length > NEGLIGIBLE_LENGTH)
            .map(|part| Gap {
                ends: part.map(|share| from.lerp(to, share)),
                shapes,
            })
            .collect()
    }

    /// The parts of a segment that lie near the border of a shape.
    fn parts_near_border(&self, shape: u32, ends: [DVec2; 2], near: &[u32]) -> Vec<Part> {
        let borders = near.iter().map(|&border| &self.segments[border as usize]);
        let of_shape = borders.filter(|border| border.shape == shape);
        let parts =
            of_shape.filter_map(|border| near_segment(ends, border.ends, self.painted.depth));
        union(parts.collect())
    }

    /// The parts of `gaps` around which a shape leaves something open.
    fn left_by(
        &self,
        shape: u32,
        [from, to]: [DVec2; 2],
        gaps: &[Part],
        near: &[u32],
    ) -> Vec<Part> {
        let [low, high] = self.boxes[shape as usize];
        if from.max(to).cmplt(low).any() || from.min(to).cmpgt(high).any() {
            return gaps.to_vec();
        }
        let mut filled = Vec::new();
        let near_border = self.parts_near_border(shape, [from, to], near);
        for &gap in gaps {
            filled.extend(without(gap, &near_border).into_iter().filter(|part| {
                let middle = from.lerp(to, 0.5 * (part[0] + part[1]));
                is_in(&self.painted.shapes[shape as usize].painted, middle)
            }));
        }
        let filled = union(filled);
        let left = gaps.iter().map(|&gap| without(gap, &filled));
        left.flatten().collect()
    }
}

/// Whether the winding number of outlines around a point is not zero.
fn is_in(outlines: &[Vec<DVec2>], point: DVec2) -> bool {
    let mut winding = 0;
    for outline in outlines {
        for (&from, &to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            let is_upwards = to.y > from.y;
            if (from.y > point.y) != (to.y > point.y)
                && (cross(to - from, point - from) > 0.0) == is_upwards
            {
                winding += if is_upwards { 1 } else { -1 };
            }
        }
    }
    winding != 0
}

/// The outline of all that is covered.
struct Rim {
    segments: Vec<[DVec2; 2]>,
    places: Places,
    scale: f64,
}

impl Rim {
    fn new(painted: &Painted, scale: f64) -> Self {
        let edges = 0..painted.subdivision.half_edges().len() as u32;
        let is_rim = |edge: &u32| {
            painted.subdivision.across(*edge).is_none()
                && !is_on_frame(painted.subdivision.ends(*edge))
        };
        let segments: Vec<_> = edges
            .filter(is_rim)
            .map(|edge| painted.pixels(edge))
            .collect();
        let boxes = segments.iter().map(|ends| box_around(ends));
        Self {
            places: Places::new(boxes.map(|corners| corners.map(|corner| corner * scale))),
            segments,
            scale,
        }
    }

    /// The parts of a segment within a distance of it.
    fn parts_near(&self, ends: [DVec2; 2], distance: f64) -> Vec<Part> {
        let [from, to] = ends.map(|end| end * self.scale);
        let mut near = Vec::new();
        self.places
            .along(from, to, distance * self.scale, &mut near);
        let near = near.iter().map(|&segment| self.segments[segment as usize]);
        let parts = near.filter_map(|segment| near_segment(ends, segment, distance));
        union(parts.collect())
    }

    /// Whether all of a segment lies on it.
    fn contains(&self, ends: [DVec2; 2]) -> bool {
        let rest = without(WHOLE, &self.parts_near(ends, ON_RIM));
        let length = (ends[1] - ends[0]).length();
        rest.iter()
            .all(|part| (part[1] - part[0]) * length <= ON_RIM)
    }
}

impl Painted<'_> {
    fn pixels(&self, edge: u32) -> [DVec2; 2] {
        let ends = self.subdivision.ends(edge);
        ends.map(|end| self.grid.pixels_from_image(end))
    }

    /// The lowest and the highest coordinates of the frame.
    fn frame(&self) -> [DVec2; 2] {
        let corners = [DVec2::ZERO, DVec2::ONE];
        box_around(&corners.map(|corner| self.grid.pixels_from_image(corner)))
    }

    /// The part of a segment within the frame and not along it.
    fn within_frame(&self, [from, to]: [DVec2; 2]) -> Option<[DVec2; 2]> {
        let [low, high] = self.frame();
        let functions = [
            [from, to].map(|point| point.x - low.x - ON_RIM),
            [from, to].map(|point| high.x - point.x - ON_RIM),
            [from, to].map(|point| point.y - low.y - ON_RIM),
            [from, to].map(|point| high.y - point.y - ON_RIM),
        ];
        let part = functions
            .into_iter()
            .try_fold(WHOLE, |part, [start, end]| positive(part, start, end))?;
        Some(part.map(|share| from.lerp(to, share)))
    }

    /// The outlines of strips around gaps.
    fn strips(&self, gaps: &[&Gap]) -> Vec<Vec<DVec2>> {
        // Made of cells, by row and column: gaps may be many thousands in a few pixels.
        let mut cells: BTreeSet<[i64; 2]> = BTreeSet::new();
        for gap in gaps {
            let [from, to] = gap.ends.map(|end| end / CELL);
            let steps = (to - from).length().ceil().max(1.0);
            // Half a step farther, for what lies between a point and the next.
            let reach = self.depth / CELL + 0.5;
            for step in 0..=steps as u32 {
                let point = from.lerp(to, f64::from(step) / steps);
                let [low, high] = [(point - reach).floor(), (point + reach).ceil()];
                for row in low.y as i64..high.y as i64 {
                    cells.extend((low.x as i64..high.x as i64).map(|column| [row, column]));
                }
            }
        }
        let cells: Vec<[i64; 2]> = cells.into_iter().collect();
        let rectangles: Vec<Vec<[f64; 2]>> = cells
            .chunk_by(|a, b| a[0] == b[0] && a[1] + 1 == b[1])
            .map(|run| {
                let ([row, first], [_, last]) = (run[0], run[run.len() - 1]);
                let sides = [first, last + 1, row, row + 1];
                let [left, right, top, bottom] = sides.map(|at| at as f64 * CELL);
                vec![[left, top], [right, top], [right, bottom], [left, bottom]]
            })
            .collect();
        let corners: Vec<DVec2> = rectangles.concat().into_iter().map(DVec2::from).collect();
        let covered = self.covered.within(box_around(&corners));
        let strips = rectangles.simplify_shape(FillRule::NonZero);
        let strips = strips.overlay(&covered, OverlayRule::Intersect, FillRule::NonZero);
        simplified(strips, ON_RIM)
    }
}
