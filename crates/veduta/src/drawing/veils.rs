//! Veils -> shapes from far to near.
//!
//! 1. Coplanar fragments of one object that look alike become a region: its neighbours must not be smoothed
//!    apart, since what is behind would be seen between them.
//! 2. Of two regions that overlap in the picture one is nearer; if they pass through each other, one is cut
//!    along the line in which their planes cross.
//! 3. Far ones are painted before near ones (a topological order). In a circle of three or more the one
//!    farthest away begins; more than [`MOST_ORDERED`] are painted by their mean nearness alone.
//!
//! Opaque faces have cut what they hide already, so that all veils are painted last.

use super::join::{depth_unit, is_coplanar};
use super::subdivision::Subdivision;
use super::{COINCIDENT, Look, Veil, trace};
use crate::dice::PixelGrid;
use crate::scene::Scene;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use veduta_geometry::{Affine, DVec2, cross, signed_area};
use veduta_map::VisibilityMap;

/// More regions than this are not compared with one another, which takes the square of their number.
const MOST_ORDERED: usize = 4096;

/// Overlaps, as shares of the frame, that are not looked at.
const NEGLIGIBLE_AREA: f64 = 1e-12;

/// The difference of depths, as a share of the depth, below which two veils lie in one plane.
const COPLANAR: f64 = 1e-9;

/// Veils that are painted as one.
#[derive(Clone)]
struct Region<'a> {
    look: &'a Look,
    plane: Affine,
    /// Convex, none of which overlap.
    polygons: Vec<Vec<DVec2>>,
    low: DVec2,
    high: DVec2,
}

impl<'a> Region<'a> {
    fn new(look: &'a Look, plane: Affine, polygons: Vec<Vec<DVec2>>) -> Self {
        let points = || polygons.iter().flatten().copied();
        Self {
            look,
            plane,
            low: points().fold(DVec2::INFINITY, DVec2::min),
            high: points().fold(DVec2::NEG_INFINITY, DVec2::max),
            polygons,
        }
    }

    fn mean_nearness(&self) -> f64 {
        let (mut area, mut sum) = (0.0, 0.0);
        for polygon in &self.polygons {
            let own = signed_area(polygon);
            let middle = polygon.iter().sum::<DVec2>() / polygon.len() as f64;
            area += own;
            sum += own * self.plane.at(middle);
        }
        sum / area
    }

    /// The part in which `half_plane` is positive; `None` if there is none.
    fn part(&self, half_plane: &Affine) -> Option<Self> {
        let parts = self
            .polygons
            .iter()
            .map(|polygon| clipped(polygon, half_plane));
        let parts: Vec<_> = parts
            .filter(|part| signed_area(part) > NEGLIGIBLE_AREA)
            .collect();
        (!parts.is_empty()).then(|| Self::new(self.look, self.plane, parts))
    }
}

/// How two regions lie.
enum Relation {
    Apart,
    /// The first is nearer.
    Nearer,
    Farther,
    /// They pass through each other where they overlap.
    Crossing,
}

/// The veils of a map, in the order in which they are painted; `looks` are those of its veil fragments.
pub(super) fn veils(
    scene: &Scene,
    map: &VisibilityMap,
    looks: &[Look],
    grid: &PixelGrid,
) -> Vec<Veil> {
    let mut regions = regions(map, looks);
    let order = if regions.len() <= MOST_ORDERED {
        let pairs = cut_apart(map, &mut regions);
        ordered(&regions, &pairs)
    } else {
        ordered(&regions, &[])
    };
    let veil = |&index: &usize| {
        let Region { look, polygons, .. } = &regions[index];
        Veil {
            object: look.object,
            name: scene.object(look.object).name.clone(),
            material: look.material,
            radiance: look.radiance,
            opacity: look.opacity,
            evenness: look.evenness,
            outlines: outlines(polygons, grid),
        }
    };
    order.par_iter().map(veil).collect()
}

/// Fragments by object, plane and look, in the order of their first ones. In planes with different numbers
/// only if they are few enough to be compared with one another.
fn regions<'a>(map: &VisibilityMap, looks: &'a [Look]) -> Vec<Region<'a>> {
    let plane_of = |veil: u32| map.faces.plane(map.veils.face(veil as usize));
    let mut veils: Vec<u32> = (0..looks.len() as u32).collect();
    veils.sort_by_key(|&veil| (looks[veil as usize].object, plane_of(veil), veil));
    let mut regions: Vec<(u32, Region)> = Vec::new();
    let is_few = looks.len() <= MOST_ORDERED;
    let face_of = |veil: u32| map.veils.face(veil as usize);
    for of_plane in veils.chunk_by(|&a, &b| {
        looks[a as usize].object == looks[b as usize].object
            && (is_few || plane_of(a) == plane_of(b))
    }) {
        let mut alike: Vec<Vec<u32>> = Vec::new();
        for &veil in of_plane {
            let look = &looks[veil as usize];
            if look.opacity <= 0.0 {
                continue;
            }
            let is_alike = |veils: &&mut Vec<u32>| {
                looks[veils[0] as usize] == *look
                    && is_coplanar(map, face_of(veils[0]), face_of(veil))
            };
            match alike.iter_mut().find(is_alike) {
                Some(veils) => veils.push(veil),
                None => alike.push(vec![veil]),
            }
        }
        regions.extend(alike.iter().map(|veils| {
            let polygon = |&veil: &u32| map.polygon(map.veils.get(veil as usize)).to_vec();
            let plane = map.faces.nearness(plane_of(veils[0]));
            let polygons = veils.iter().map(polygon).collect();
            (
                veils[0],
                Region::new(&looks[veils[0] as usize], *plane, polygons),
            )
        }));
    }
    regions.sort_by_key(|region| region.0);
    regions.into_iter().map(|region| region.1).collect()
}

/// Cuts regions so that no two pass through each other. Pairs that overlap, the farther one first.
fn cut_apart(map: &VisibilityMap, regions: &mut Vec<Region>) -> Vec<[usize; 2]> {
    let mut pairs = Vec::new();
    // What is cut off is put at the end, and compared with all when its turn comes.
    let mut index = 0;
    while index < regions.len() {
        for other in 0..index {
            match relation(map, &regions[other], &regions[index]) {
                Relation::Apart => {}
                Relation::Nearer => pairs.push([index, other]),
                Relation::Farther => pairs.push([other, index]),
                Relation::Crossing => {
                    let before = regions[index].plane.minus(&regions[other].plane);
                    let parts = [before, before.negated()].map(|side| regions[index].part(&side));
                    let [Some(nearer), Some(farther)] = parts else {
                        continue;
                    };
                    regions[index] = nearer;
                    regions.push(farther);
                    pairs.push([other, index]);
                }
            }
        }
        index += 1;
    }
    pairs
}

fn relation(map: &VisibilityMap, one: &Region, other: &Region) -> Relation {
    if one.low.cmpge(other.high).any() || other.low.cmpge(one.high).any() {
        return Relation::Apart;
    }
    let nearer = one.plane.minus(&other.plane);
    // Area in which the one is nearer, and the other is; and in which neither is.
    let (mut one_nearer, mut other_nearer, mut equal) = (0.0, 0.0, 0.0);
    for polygon in &one.polygons {
        for other in &other.polygons {
            let mut overlap = polygon.clone();
            for (k, &from) in other.iter().enumerate() {
                let along = other[(k + 1) % other.len()] - from;
                let side = Affine::new(-along.y, along.x, -cross(along, from));
                overlap = clipped(&overlap, &side);
            }
            if overlap.len() < 3 || signed_area(&overlap) <= NEGLIGIBLE_AREA {
                continue;
            }
            let unit = COPLANAR * depth_unit(&map.camera, one.plane.at(overlap[0]));
            if overlap.iter().all(|&point| nearer.at(point).abs() <= unit) {
                equal += signed_area(&overlap);
            } else {
                one_nearer += signed_area(&clipped(&overlap, &nearer)).max(0.0);
                other_nearer += signed_area(&clipped(&overlap, &nearer.negated())).max(0.0);
            }
        }
    }
    match (one_nearer > NEGLIGIBLE_AREA, other_nearer > NEGLIGIBLE_AREA) {
        (true, true) => Relation::Crossing,
        (true, false) => Relation::Nearer,
        (false, true) => Relation::Farther,
        // Of equal planes the smaller face is before the other.
        (false, false) if equal > 0.0 => Relation::Nearer,
        (false, false) => Relation::Apart,
    }
}

/// Regions far to near; `pairs` name a farther and a nearer one.
fn ordered(regions: &[Region], pairs: &[[usize; 2]]) -> Vec<usize> {
    let mut keys: Vec<(f64, usize)> = (0..regions.len())
        .map(|index| (regions[index].mean_nearness(), index))
        .collect();
    keys.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut place = vec![0; regions.len()];
    for (at, key) in keys.iter().enumerate() {
        place[key.1] = at;
    }
    let mut nearer_than: Vec<Vec<usize>> = vec![Vec::new(); regions.len()];
    let mut farther = vec![0usize; regions.len()];
    for &[far, near] in pairs {
        nearer_than[far].push(near);
        farther[near] += 1;
    }
    // By their places: those with nothing left behind them.
    let mut ready: BinaryHeap<Reverse<usize>> = (0..regions.len())
        .filter(|&index| farther[index] == 0)
        .map(|index| Reverse(place[index]))
        .collect();
    let mut is_done = vec![false; regions.len()];
    let mut order = Vec::with_capacity(regions.len());
    let mut next_of_circle = 0;
    while order.len() < regions.len() {
        let at = match ready.pop() {
            Some(Reverse(at)) => at,
            None => {
                while is_done[keys[next_of_circle].1] {
                    next_of_circle += 1;
                }
                next_of_circle
            }
        };
        let index = keys[at].1;
        if std::mem::replace(&mut is_done[index], true) {
            continue;
        }
        order.push(index);
        for &near in &nearer_than[index] {
            farther[near] -= 1;
            if farther[near] == 0 && !is_done[near] {
                ready.push(Reverse(place[near]));
            }
        }
    }
    order
}

/// The outlines of polygons that do not overlap, in pixels.
fn outlines(polygons: &[Vec<DVec2>], grid: &PixelGrid) -> Vec<Vec<DVec2>> {
    let polygons: Vec<&[DVec2]> = polygons.iter().map(Vec::as_slice).collect();
    let subdivision = Subdivision::new(&polygons, COINCIDENT);
    let edges = 0..subdivision.half_edges().len() as u32;
    let border: Vec<u32> = edges
        .filter(|&edge| subdivision.across(edge).is_none())
        .collect();
    let loops = trace::loops(&subdivision, &border);
    let outlines = loops.iter().map(|edges| {
        let points: Vec<DVec2> = edges.iter().map(|&e| subdivision.ends(e)[0]).collect();
        let corners = trace::corners(&points, COINCIDENT);
        let in_pixels = |corner: usize| grid.pixels_from_image(points[corner]);
        corners.into_iter().map(in_pixels).collect::<Vec<_>>()
    });
    outlines.filter(|outline| !outline.is_empty()).collect()
}

/// The part of a convex polygon in which `half_plane` is at least zero (Sutherland & Hodgman, 1974).
fn clipped(polygon: &[DVec2], half_plane: &Affine) -> Vec<DVec2> {
    let mut part = Vec::with_capacity(polygon.len() + 1);
    for (index, &here) in polygon.iter().enumerate() {
        let there = polygon[(index + 1) % polygon.len()];
        let (d_here, d_there) = (half_plane.at(here), half_plane.at(there));
        if d_here >= 0.0 {
            part.push(here);
        }
        if d_here < 0.0 && d_there > 0.0 || d_here > 0.0 && d_there < 0.0 {
            part.push(here + (there - here) * (d_here / (d_here - d_there)));
        }
    }
    part
}
