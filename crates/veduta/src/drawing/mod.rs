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
//! 4. `order`: objects as a tree, painted far to near, as an illustrator expects. Regions do not overlap, so
//!    that any order would do; within an object thin shapes come first.
//! 5. `trap`: against seams, a shape reaches a little under those painted later.
//! 6. `underpainting`: what lies below all of them, where they have no room for that, and their common outline.
//! 7. `veils`: regions of faces that are not fully opaque, painted on top of the others far to near.
//! 8. `lines`: visible edges as strokes; by `hidden` those that are not, and those of veils, with `crossings` where
//!    faces pierce each other; by `spacing` hidden ones keep away from other lines.
//!
//! Outlines are those of the map within 1e-12 of the frame. The result is the same for any number of
//! threads.

mod crossings;
mod hidden;
mod join;
mod lines;
mod near;
mod order;
mod places;
mod spacing;
mod subdivision;
mod trace;
mod trap;
mod underpainting;
mod veils;

use crate::dice::PixelGrid;
use crate::scene::{Material, Scene};
use join::Region;
use rayon::prelude::*;
use std::ops::Range;
use subdivision::Subdivision;
use trap::{Reached, Trapper};
use underpainting::Outline;
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
    /// How much it hides of what is behind, the mean where that differs: 1 for opaque faces.
    pub opacity: f32,
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
    /// Against seams in a viewer that shows the picture at its size or larger 2 are enough, 4 at half its size.
    pub trap: f64,
    /// Which faces become one shape.
    pub joining: Joining,
    /// Whether shapes are made.
    pub shapes: bool,
    /// The lines to draw, if any. [`LineKind::Hidden`] needs a map whose table has all faces of the scene,
    /// which those that were stored have not.
    pub lines: Vec<LineKind>,
    /// The angle in radians between two faces above which their edge is a [`LineKind::Crease`].
    pub crease_angle: f64,
    /// The most faces behind which [`LineKind::Hidden`] are drawn: the quantitative invisibility of Appel (1967).
    pub most_before: usize,
    /// How near, in pixels, hidden lines may come to lines beside them; parts that come nearer are left out. 0 for
    /// all.
    pub hidden_spacing: f64,
    /// The length in pixels that hidden lines need to be drawn.
    pub shortest_hidden: f64,
}

impl Default for Settings {
    /// Shapes of one colour that reach 2 pixels under others, no lines; creases from 30 degrees, and all that is
    /// hidden.
    fn default() -> Self {
        Self {
            trap: 2.0,
            joining: Joining::Colors,
            shapes: true,
            lines: Vec::new(),
            crease_angle: 30f64.to_radians(),
            most_before: usize::MAX,
            hidden_spacing: 0.0,
            shortest_hidden: 0.0,
        }
    }
}

/// Which faces become one shape, if they look alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Joining {
    /// Neighbours in one plane.
    Surfaces,
    /// All of one object, wherever they are, if they have one colour ([`Evenness::Even`]); else
    /// neighbours in one plane. Files become smaller, and there is nothing between neighbours of one
    /// colour that could be seen.
    Colors,
}

/// An edge, by what makes it one. Those of faces that are not fully opaque are seen as others are, and hide none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LineKind {
    /// What is across is farther away, or nothing: the outline of something before something.
    Silhouette,
    /// An edge of the mesh that has one face only.
    Boundary,
    /// Two faces meet at an angle, along an edge or where they pierce each other.
    Crease,
    /// An edge of one of the other kinds that are drawn, where it is hidden.
    Hidden,
}

/// A vector picture: shapes and lines, in pixels of a picture of some size (x right, y down).
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width and height of the picture in pixels.
    pub size: [f64; 2],
    /// What is painted before all shapes, so that nothing else is seen between them; none without traps or
    /// without shapes.
    pub underpainting: Option<Underpainting>,
    /// The tree of objects, parents before children, in the order in which they are painted.
    pub groups: Vec<Group>,
    /// In the order in which they are painted, which is that of their groups.
    pub shapes: Vec<Shape>,
    /// Shapes of faces that are not fully opaque, far to near; painted after all others.
    pub veils: Vec<Veil>,
    /// Painted last: hidden ones, then the others in order of kind.
    pub strokes: Vec<Stroke>,
    /// Names of the scene's materials, by [`MaterialId`].
    pub material_names: Vec<String>,
}

/// What lies under all shapes, so that nothing behind the picture is seen between them.
///
/// Underpainting and shapes are to be laid on one another first and then shown through the outline as one
/// picture (a mask, not a clip of each of them), so that viewers smooth it once.
#[derive(Clone, Debug, PartialEq)]
pub struct Underpainting {
    /// What is to be seen of it and of the shapes, not of veils and lines: outlines and holes of all that is
    /// covered, wound as those of shapes are, a pixel beyond the frame. `None`, if that is the whole frame.
    pub outline: Option<Vec<Vec<DVec2>>>,
    /// The mean radiance of all shapes (linear Rec.709); it fills the frame.
    pub radiance: [f32; 3],
    /// Strokes along the outline, laid on that.
    pub rims: Vec<Rim>,
    /// Their width in pixels.
    pub rim_width: f64,
}

/// Where the border of a shape is the outline of all that is covered: strokes with round ends and joins.
#[derive(Clone, Debug, PartialEq)]
pub struct Rim {
    /// Radiance of the shape (linear Rec.709).
    pub radiance: [f32; 3],
    /// In pixels.
    pub chains: Vec<Chain>,
}

/// A line from point to point.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Corners; the first is not repeated at the end.
    pub points: Vec<DVec2>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
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

/// A region of one look that is not fully opaque.
#[derive(Clone, Debug, PartialEq)]
pub struct Veil {
    /// The object.
    pub object: ObjectId,
    /// Its name.
    pub name: String,
    /// Its material.
    pub material: MaterialId,
    /// Radiance (linear Rec.709), not multiplied by the opacity; the mean if it is not even.
    pub radiance: [f32; 3],
    /// How much it hides of what is behind it: above 0, up to 1; the mean if it is not even.
    pub opacity: f32,
    /// Whether it really has one colour and opacity.
    pub evenness: Evenness,
    /// Outlines wound positively and holes the other way.
    pub outlines: Vec<Vec<DVec2>>,
}

/// A line, as long as it goes on without a fork.
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

/// Draws what is seen: the fragments of `map` with the looks of each, veils last, in a picture of `grid`.
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
    assert_eq!(
        looks.len(),
        map.fragment_count(),
        "a look for each fragment"
    );
    let (looks, veil_looks) = looks.split_at(map.opaque.len());
    let polygons: Vec<&[DVec2]> = (0..looks.len() as u32)
        .map(|fragment| join::polygon_of(map, fragment))
        .collect();
    let subdivision = Subdivision::new(&polygons, COINCIDENT);
    let strokes = lines::strokes(scene, map, veil_looks, &subdivision, grid, settings);
    let (groups, shapes, underpainting) = if settings.shapes {
        shapes(scene, map, &subdivision, looks, grid, settings)
    } else {
        Default::default()
    };
    let veils = if settings.shapes {
        veils::veils(scene, map, veil_looks, grid)
    } else {
        Vec::new()
    };
    Drawing {
        size: [f64::from(grid.width), f64::from(grid.height)],
        underpainting,
        groups,
        shapes,
        veils,
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
    settings: &Settings,
) -> (Vec<Group>, Vec<Shape>, Option<Underpainting>) {
    let regions = join::join(map, subdivision, looks, settings.joining);
    let outlines: Vec<Outlines> = {
        let mut region_of = vec![0u32; looks.len()];
        for (index, region) in (0u32..).zip(&regions) {
            for &fragment in &region.fragments {
                region_of[fragment as usize] = index;
            }
        }
        let of = |region| Outlines::of(subdivision, &region_of, region, grid);
        regions.par_iter().map(of).collect()
    };
    let thickness: Vec<f64> = outlines
        .iter()
        .map(|outlines| trap::thickness(&outlines.seen))
        .collect();
    let order::Painting {
        groups,
        order,
        group_of,
    } = order::painting(scene, map, &regions, &thickness);
    // When each fragment is painted.
    let mut rank = vec![0u32; looks.len()];
    for (place, &region) in (0u32..).zip(&order) {
        for &fragment in &regions[region as usize].fragments {
            rank[fragment as usize] = place;
        }
    }
    for fragment in outlines.iter().flat_map(|outlines| &outlines.unseen) {
        rank[*fragment as usize] = u32::MAX;
    }
    let trapper = Trapper::new(subdivision, &rank, grid, settings.trap);
    let of_regions = order.par_iter();
    let painted: Vec<Vec<Vec<DVec2>>> = of_regions
        .map_init(Reached::default, |reached, &region| {
            trapper.painted(&outlines[region as usize].loops, reached)
        })
        .collect();
    let rows = order.par_iter().zip(&group_of).zip(painted);
    let shapes: Vec<Shape> = rows
        .map(|((&region, &group), painted)| {
            let seen = outlines[region as usize].seen.clone();
            shape(map, looks, &regions[region as usize], group, seen, painted)
        })
        .collect();
    let has_underpainting = settings.trap > 0.0 && !shapes.is_empty();
    let underpainting = has_underpainting.then(|| {
        let outline = Outline::of(subdivision, grid);
        let half_width = RIM * settings.trap;
        let rims = outline.rims(&rank, half_width);
        Underpainting {
            outline: (!outline.is_frame()).then(|| outline.polygons()),
            radiance: mean_radiance(&shapes),
            rims: of_shapes(rims, &shapes),
            rim_width: 2.0 * half_width,
        }
    });
    (groups, shapes, underpainting)
}

fn mean_radiance(shapes: &[Shape]) -> [f32; 3] {
    let (mut area, mut sum) = (0.0, [0.0; 3]);
    for shape in shapes {
        let of_shape: f64 = shape.seen.iter().map(|outline| signed_area(outline)).sum();
        area += of_shape;
        for (sum, channel) in sum.iter_mut().zip(shape.radiance) {
            *sum += of_shape * f64::from(channel);
        }
    }
    sum.map(|sum| if area > 0.0 { (sum / area) as f32 } else { 0.0 })
}

/// The rims of each shape in one, in the order of shapes.
fn of_shapes(rims: Vec<underpainting::Rim>, shapes: &[Shape]) -> Vec<Rim> {
    let mut of_shapes: Vec<Rim> = Vec::new();
    let mut last = None;
    for underpainting::Rim {
        shape,
        points,
        closed,
    } in rims
    {
        if last != Some(shape) {
            last = Some(shape);
            of_shapes.push(Rim {
                radiance: shapes[shape as usize].radiance,
                chains: Vec::new(),
            });
        }
        let own = of_shapes.last_mut();
        own.expect("one was pushed")
            .chains
            .push(Chain { points, closed });
    }
    of_shapes
}

/// How far rims reach to both sides, in reaches of traps. With traps of 2 pixels that is the diagonal of a
/// pixel and a quarter more, by which rims may be moved: all that the outline passes through is filled.
const RIM: f64 = 0.875;

/// Thickness in pixels of what is not painted: it would change no pixel by a step of 8 bits.
const UNSEEN: f64 = 1.0 / 256.0;

/// The border of a region.
#[derive(Default)]
struct Outlines {
    /// Of half-edges, each closed, around what is thick enough to be painted.
    loops: Vec<Vec<u32>>,
    /// The fragments that are not.
    unseen: Vec<u32>,
    /// The corners of all loops that have an area, in pixels.
    seen: Vec<Vec<DVec2>>,
}

impl Outlines {
    fn of(subdivision: &Subdivision, region_of: &[u32], region: &Region, grid: &PixelGrid) -> Self {
        let mut outlines = Self::default();
        for part in connected_parts(subdivision, region_of, region) {
            let loops = trace::loops(subdivision, &border(subdivision, region_of, &part));
            let corners = |edges: &Vec<u32>| {
                let points: Vec<DVec2> = edges.iter().map(|&e| subdivision.ends(e)[0]).collect();
                let corners = trace::corners(&points, COINCIDENT);
                let in_pixels = |corner: usize| grid.pixels_from_image(points[corner]);
                (!corners.is_empty()).then(|| corners.into_iter().map(in_pixels).collect())
            };
            let seen: Vec<Vec<DVec2>> = loops.iter().filter_map(corners).collect();
            if trap::thickness(&seen) < UNSEEN {
                outlines.unseen.extend(part);
            } else {
                outlines.loops.extend(loops);
            }
            outlines.seen.extend(seen);
        }
        outlines
    }
}

/// The fragments of a region, by the parts in which it is seen.
fn connected_parts(subdivision: &Subdivision, region_of: &[u32], region: &Region) -> Vec<Vec<u32>> {
    let place = |fragment: u32| region.fragments.binary_search(&fragment);
    let own = region_of[region.fragments[0] as usize];
    let mut taken = vec![false; region.fragments.len()];
    let mut parts = Vec::new();
    for (first, &fragment) in region.fragments.iter().enumerate() {
        if std::mem::replace(&mut taken[first], true) {
            continue;
        }
        let mut part = vec![fragment];
        let mut next = 0;
        while let Some(&fragment) = part.get(next) {
            next += 1;
            let edges = subdivision.around(fragment);
            for across in edges.filter_map(|edge| subdivision.across(edge)) {
                if region_of[across as usize] == own
                    && let Ok(place) = place(across)
                    && !std::mem::replace(&mut taken[place], true)
                {
                    part.push(across);
                }
            }
        }
        part.sort_unstable();
        parts.push(part);
    }
    parts
}

/// The half-edges between a part of a region and what is not of the region.
fn border(subdivision: &Subdivision, region_of: &[u32], fragments: &[u32]) -> Vec<u32> {
    let own = region_of[fragments[0] as usize];
    let edges = fragments.iter();
    let edges = edges.flat_map(|&fragment| subdivision.around(fragment));
    let is_border = |edge: &u32| {
        let across = subdivision.across(*edge);
        across.is_none_or(|fragment| region_of[fragment as usize] != own)
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
    frame_side(ends).is_some()
}

/// The direction out of the picture, if a side of a fragment lies on its border.
fn frame_side(ends: [DVec2; 2]) -> Option<DVec2> {
    // Points of the border may have become one with others beside it.
    let near = |axis: usize, border: f64| {
        ends.iter()
            .all(|end| (end[axis] - border).abs() <= 2.0 * COINCIDENT)
    };
    let sides = [(0, DVec2::X), (1, DVec2::Y)];
    sides.into_iter().find_map(|(axis, outwards)| {
        let is_first = near(axis, 0.0).then_some(-outwards);
        is_first.or(near(axis, 1.0).then_some(outwards))
    })
}

/// Depth in metres of what has that nearness.
fn depth_of(camera: &Camera, nearness: f64) -> f64 {
    match camera.projection {
        Projection::Perspective { .. } => 1.0 / nearness,
        Projection::Parallel { .. } => -nearness,
    }
}
