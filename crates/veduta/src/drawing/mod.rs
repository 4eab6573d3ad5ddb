//! Drawing: visibility map + colours -> outlines of regions and lines, for vector pictures.
//!
//! A map is made of convex fragments, many to a wall. A drawing has one shape for the wall, with holes
//! where something stands before it. Nothing here knows light or file formats: the colour of each
//! fragment comes in ([`Look`]), and a [`Drawing`] is what writers of SVG, PDF and GeoJSON write.
//!
//! 1. `subdivision`: fragments share sides, but with T-junctions. Sides are cut at all vertices that lie
//!    on them (found by `near`), and from then on each piece knows who is across.
//! 2. `join`: coplanar neighbours of one object that look alike become a region.
//! 3. `trace`: what is left of the sides of its fragments closes to outlines and holes.
//! 4. `order`: objects as a tree, painted far to near. Regions do not overlap, so any order would do;
//!    this is the one that an illustrator expects.
//! 5. `trap`: against seams, a shape reaches a little under those painted later.
//! 6. `lines`: visible edges as strokes.
//!
//! Outlines are those of the map within 1e-12 of the frame. The result is the same for any number of
//! threads.

mod join;
mod lines;
mod near;
mod order;
mod subdivision;
mod trace;
mod trap;

use crate::dice::PixelGrid;
use crate::scene::{Material, Scene};
use join::Region;
use rayon::prelude::*;
use std::ops::Range;
use subdivision::Subdivision;
use trap::Trapper;
use veduta_geometry::{DVec2, signed_area};
use veduta_map::{Camera, MaterialId, ObjectId, Projection, VisibilityMap};

/// What a fragment looks like. All fragments of a face look the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The object it is of.
    pub object: ObjectId,
    /// Its material.
    pub material: MaterialId,
    /// Radiance (linear Rec.709), the mean where it differs from point to point.
    pub radiance: [f32; 3],
    /// Whether it differs from point to point.
    pub evenness: Evenness,
}

/// Whether a face has one colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evenness {
    /// The same all over.
    Even,
    /// It changes gradually, because of colours or normals at the corners.
    Gradual,
    /// It has a picture on it. Coplanar neighbours are joined whatever their mean colours.
    Picture,
}

/// What a drawing shows, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How far, in pixels, shapes reach under those painted later; 0 for not at all.
    ///
    /// Twice the diagonal of a viewer's pixel is enough: half of what is between a shape and
    /// another that was painted earlier is left to that one. At full size that is 2.8 pixels.
    pub trap: f64,
    /// Whether shapes are made.
    pub shapes: bool,
    /// The lines to draw, if any.
    pub lines: Vec<LineKind>,
    /// The angle in radians between two faces above which their edge is a [`LineKind::Crease`].
    pub crease_angle: f64,
}

impl Default for Settings {
    /// Shapes that reach 4 pixels under others, no lines; creases from 30 degrees.
    fn default() -> Self {
        Self {
            trap: 4.0,
            shapes: true,
            lines: Vec::new(),
            crease_angle: 30f64.to_radians(),
        }
    }
}

/// A visible edge, by what makes it one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LineKind {
    /// What is across is farther away, or nothing: the outline of something before something.
    Silhouette,
    /// An edge of the mesh that has one face only.
    Boundary,
    /// Two faces meet at an angle, along an edge or where they pierce each other.
    Crease,
}

/// A vector picture: shapes and lines, in pixels of a picture of some size (x right, y down).
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width and height of the picture in pixels.
    pub size: [f64; 2],
    /// The tree of objects, parents before children, in the order in which they are painted.
    pub groups: Vec<Group>,
    /// In the order in which they are painted, which is that of their groups.
    pub shapes: Vec<Shape>,
    /// In order of kind; painted last.
    pub strokes: Vec<Stroke>,
    /// Names of the scene's materials, by [`MaterialId`].
    pub material_names: Vec<String>,
}

/// A node of the tree of objects: one for each part of the objects' names between slashes.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The last part of the name.
    pub name: String,
    /// The group that this one is a part of.
    pub parent: Option<u32>,
    /// The shapes of the object of this name, painted before those of the groups below it.
    pub shapes: Range<usize>,
}

/// A region of one look.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Row of [`Drawing::groups`].
    pub group: u32,
    /// The object.
    pub object: ObjectId,
    /// Its material.
    pub material: MaterialId,
    /// How many faces it is made of.
    pub faces: usize,
    /// Radiance (linear Rec.709), the mean if it is not even.
    pub radiance: [f32; 3],
    /// Whether it really has one colour.
    pub evenness: Evenness,
    /// Where it is seen: outlines wound positively and holes the other way, none of which cross.
    pub seen: Vec<Vec<DVec2>>,
    /// What is to be painted: `seen`, and a little under the shapes that are painted later. To be filled
    /// where the winding number is not zero. Nothing, if it is too thin to be seen.
    pub painted: Vec<Vec<DVec2>>,
    /// Depth of its nearest point: metres from the eye's plane, along the direction in which it looks.
    pub nearest: f64,
    /// Depth of its farthest point.
    pub farthest: f64,
}

/// A visible edge, as long as it goes on without a fork.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// What makes it one.
    pub kind: LineKind,
    /// Corners; the first is not repeated at the end.
    pub points: Vec<DVec2>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
}

/// Distance, in frame heights or widths, within which points are one and a line is straight: 4e-9 pixels
/// at 4000 pixels across. Less would tell points apart that were computed in two ways (cuts at flat
/// angles lose four of sixteen digits); more would be seen in areas, which are kept to 1e-9.
const COINCIDENT: f64 = 1e-12;

/// Draws what is seen: the fragments of `map` with the looks of each, in a picture of `grid`.
///
/// `scene` must be the one that the map was made of.
///
/// # Panics
/// If there are not as many looks as fragments.
pub fn draw(
    scene: &Scene,
    map: &VisibilityMap,
    looks: &[Look],
    grid: &PixelGrid,
    settings: &Settings,
) -> Drawing {
    assert_eq!(looks.len(), map.opaque.len(), "a look for each fragment");
    let polygons: Vec<&[DVec2]> = (0..looks.len() as u32)
        .map(|fragment| join::polygon_of(map, fragment))
        .collect();
    let subdivision = Subdivision::new(&polygons, COINCIDENT);
    let strokes = lines::strokes(scene, map, &subdivision, grid, settings);
    let (groups, shapes) = if settings.shapes {
        shapes(scene, map, &subdivision, looks, grid, settings.trap)
    } else {
        Default::default()
    };
    Drawing {
        size: [f64::from(grid.width), f64::from(grid.height)],
        groups,
        shapes,
        strokes,
        material_names: names(&scene.materials),
    }
}

fn names(materials: &[Material]) -> Vec<String> {
    let names = materials.iter().map(|material| material.name.clone());
    names.collect()
}

fn shapes(
    scene: &Scene,
    map: &VisibilityMap,
    subdivision: &Subdivision,
    looks: &[Look],
    grid: &PixelGrid,
    trap: f64,
) -> (Vec<Group>, Vec<Shape>) {
    let regions = join::join(map, subdivision, looks);
    let order::Painting {
        groups,
        order,
        group_of,
    } = order::painting(scene, map, &regions);
    // When each fragment is painted.
    let mut rank = vec![0u32; looks.len()];
    for (place, &region) in (0u32..).zip(&order) {
        for &fragment in &regions[region as usize].fragments {
            rank[fragment as usize] = place;
        }
    }
    let outlines: Vec<Outlines> = order
        .par_iter()
        .map(|&region| outlines(subdivision, &rank, &regions[region as usize], grid))
        .collect();
    for (outlines, &region) in outlines.iter().zip(&order) {
        if outlines.is_unseen() {
            for &fragment in &regions[region as usize].fragments {
                rank[fragment as usize] = u32::MAX;
            }
        }
    }
    let trapper = Trapper::new(subdivision, &rank, grid, trap);
    let shapes = outlines.into_par_iter().zip(&order).zip(&group_of);
    let shapes = shapes.map(|((outlines, &region), &group)| {
        let painted = if outlines.is_unseen() {
            Vec::new()
        } else {
            trapper.with_trap(&outlines.loops, &outlines.seen)
        };
        let region = &regions[region as usize];
        shape(map, looks, region, group, outlines.seen, painted)
    });
    (groups, shapes.collect())
}

/// Thickness in pixels of shapes that are not painted: they would change no pixel by a step of 8 bits.
const UNSEEN: f64 = 1.0 / 256.0;

/// The border of a region.
struct Outlines {
    /// Of half-edges, each closed.
    loops: Vec<Vec<u32>>,
    /// The corners of those that have an area, in pixels.
    seen: Vec<Vec<DVec2>>,
}

impl Outlines {
    fn is_unseen(&self) -> bool {
        trap::thickness(&self.seen) < UNSEEN
    }
}

fn outlines(
    subdivision: &Subdivision,
    rank: &[u32],
    region: &Region,
    grid: &PixelGrid,
) -> Outlines {
    let loops = trace::loops(subdivision, &border(subdivision, rank, region));
    let corners = |edges: &Vec<u32>| {
        let points: Vec<DVec2> = edges.iter().map(|&e| subdivision.ends(e)[0]).collect();
        let corners = trace::corners(&points, COINCIDENT);
        let in_pixels = |corner: usize| grid.pixels_from_image(points[corner]);
        (!corners.is_empty()).then(|| corners.into_iter().map(in_pixels).collect())
    };
    let seen = loops.iter().filter_map(corners).collect();
    Outlines { loops, seen }
}

/// The half-edges between a region and others.
fn border(subdivision: &Subdivision, rank: &[u32], region: &Region) -> Vec<u32> {
    let own_rank = rank[region.fragments[0] as usize];
    let edges = region.fragments.iter();
    let edges = edges.flat_map(|&fragment| subdivision.around(fragment));
    let is_border = |edge: &u32| {
        let across = subdivision.across(*edge);
        across.is_none_or(|fragment| rank[fragment as usize] != own_rank)
    };
    edges.filter(is_border).collect()
}

fn shape(
    map: &VisibilityMap,
    looks: &[Look],
    region: &Region,
    group: u32,
    seen: Vec<Vec<DVec2>>,
    painted: Vec<Vec<DVec2>>,
) -> Shape {
    let first = &looks[region.fragments[0] as usize];
    let mut area = 0.0;
    let mut radiance = [0.0; 3];
    let (mut nearest, mut farthest) = (f64::INFINITY, f64::NEG_INFINITY);
    for &fragment in &region.fragments {
        let polygon = join::polygon_of(map, fragment);
        let own_area = signed_area(polygon);
        area += own_area;
        for (sum, channel) in radiance.iter_mut().zip(looks[fragment as usize].radiance) {
            *sum += own_area * f64::from(channel);
        }
        let plane = map.faces.face_nearness(map.opaque.face(fragment as usize));
        for &point in polygon {
            let depth = depth_of(&map.camera, plane.at(point));
            nearest = nearest.min(depth);
            farthest = farthest.max(depth);
        }
    }
    Shape {
        group,
        object: first.object,
        material: first.material,
        faces: region.faces.len(),
        radiance: radiance.map(|sum| (sum / area) as f32),
        evenness: first.evenness,
        seen,
        painted,
        nearest,
        farthest,
    }
}

/// Whether a side of a fragment lies on the border of the picture.
fn is_on_frame(ends: [DVec2; 2]) -> bool {
    // Points of the border may have become one with others beside it.
    let near = |axis: usize, border: f64| {
        ends.iter()
            .all(|end| (end[axis] - border).abs() <= 2.0 * COINCIDENT)
    };
    (0..2).any(|axis| near(axis, 0.0) || near(axis, 1.0))
}

/// Depth in metres of what has that nearness.
fn depth_of(camera: &Camera, nearness: f64) -> f64 {
    match camera.projection {
        Projection::Perspective { .. } => 1.0 / nearness,
        Projection::Parallel { .. } => -nearness,
    }
}
