//! Trapping: shapes reach a little under those painted later, so that no seam is seen between them.
//!
//! Viewers smooth each shape's edge by itself. Where two shapes meet in a pixel, each covers a part of
//! it and both let the background through: halves leave a quarter of it (conflation). If the shape
//! painted first fills the pixel, the later one is laid on that and the pixel is right. Printers have the
//! same trouble with inks out of register, and the same remedy, called a trap.
//!
//! Where later shapes lie, the outline is free: it may run anywhere under them, so it runs where it has few
//! corners. A stretch of border towards later shapes (a *chain*) is replaced by the border of a convex
//! zone around it, as a wall goes on behind the trees before it:
//!
//! ```text
//!        limit :  . - - - - - .  : limit           zone: the convex hull of the chain, `reach` more on
//!              :.'  later      '.:                 the later side, between the limits;
//!     ---------s\  /\  shapes  _ t---------        limit: the border before and after the chain, carried
//!       own      \/  \__/\__/                      on, or a part of the way to where the later shapes
//!       shape                                      end.
//! ```
//!
//! Nothing but the shape itself and later shapes may lie in the zone: elsewhere it would be seen. Fragments
//! are searched from the chain outwards. If there is an *exit*, a side beyond which there is nothing or a
//! shape painted earlier, the chain is cut in two, each with a zone of its own, up to its bisector. A single
//! straight side tries smaller zones, and then does without.
//!
//! A hole full of later shapes vanishes: its zone is its hull, and no outline is left.
//!
//! Thin shapes have exits at their other side. So within an object they are painted first, and reach under
//! the thick ones. Shapes thinner than [`super::UNSEEN`] are not painted, and all others reach under them
//! as if they were painted last: however thin a shape is, it would be seen, since the edges of what
//! lies on top of it let a quarter of it through.
//!
//! What is left open all the same shows the `underpainting`.

use super::subdivision::Subdivision;
use super::{is_on_frame, trace};
use crate::dice::PixelGrid;
use std::f64::consts::{PI, TAU};
use veduta_geometry::{Affine, DVec2, cross, signed_area};

/// Makes traps; lengths are in pixels.
pub(super) struct Trapper<'a> {
    subdivision: &'a Subdivision,
    /// When each fragment is painted.
    rank: &'a [u32],
    /// The vertices of the subdivision in pixels.
    points: Vec<DVec2>,
    reach: f64,
}

/// Which fragments a search has come to; kept from search to search.
#[derive(Default)]
pub(super) struct Reached {
    /// The last search that came to each fragment.
    by: Vec<u32>,
    search: u32,
    fragments: Vec<u32>,
}

/// Areas, in square pixels, that are not worth a trap.
const NEGLIGIBLE_AREA: f64 = 1e-6;

/// Lengths, in pixels, of a side in a zone that are not looked at.
const NEGLIGIBLE_LENGTH: f64 = 1e-6;

/// Distance in pixels within which points of traps are one.
const COINCIDENT: f64 = 1e-6;

/// How far, in pixels, the sides of what is painted may be moved to make them straight: a tenth of the
/// thousandth to which files are written. What is seen of shapes is not moved.
pub(super) const STRAIGHT: f64 = 1e-4;

/// How near to an exit traps may come, in pixels. With more, traps would be missing in pixels that the
/// exit does not touch; with less, thin shapes would look fat.
const NEAR_EXIT: f64 = 0.25;

/// How much of the angle between a chain and an exit at its end its zone leaves open.
const NEAR_EXIT_SHARE: f64 = 0.25;

/// The angle in radians that a border must turn by where a chain begins or ends, for its zone to end where
/// the border would go on.
const FLAT: f64 = 0.5;

/// The length in pixels from which on a chain with an exit is worth cutting in two. Shorter ones lie between
/// shapes of a few pixels, and there are many of them.
const SHORT: f64 = 3.0;

/// How far corners of zones may lie from what they surround, in reaches: sharper ones are cut off.
const SHARPEST: f64 = 3.0;

/// Most fragments that are searched for a zone before its chain is cut in two.
const MOST_SEARCHED: usize = 20_000;

/// Mean thickness of a shape: that of a long strip with the same area and border.
pub(super) fn thickness(outlines: &[Vec<DVec2>]) -> f64 {
    let (mut area, mut border) = (0.0, 0.0);
    for outline in outlines {
        area += signed_area(outline);
        let next = outline.iter().cycle().skip(1);
        let lengths = outline.iter().zip(next).map(|(&p, &q)| (q - p).length());
        border += lengths.sum::<f64>();
    }
    if border > 0.0 {
        2.0 * area / border
    } else {
        0.0
    }
}

/// A straight part of a shape's border, all of it towards later shapes, or none of it.
struct Side {
    from: DVec2,
    along: DVec2,
    to: DVec2,
    /// Half-edges, if what is across is painted later.
    edges: Vec<u32>,
}

impl Side {
    fn is_trapped(&self) -> bool {
        !self.edges.is_empty()
    }

    fn length(&self) -> f64 {
        (self.to - self.from).length()
    }
}

/// Sides towards later shapes, one after the other.
#[derive(Clone, Copy)]
struct Chain<'a> {
    sides: &'a [Side],
    /// Where its zone ends: to the left of a line through its start, and to the right of one through its
    /// end. None if it is closed.
    limits: Option<[DVec2; 2]>,
}

impl Chain<'_> {
    fn start(&self) -> DVec2 {
        self.sides[0].from
    }

    fn end(&self) -> DVec2 {
        self.sides[self.sides.len() - 1].to
    }
}

impl<'a> Trapper<'a> {
    pub fn new(
        subdivision: &'a Subdivision,
        rank: &'a [u32],
        grid: &PixelGrid,
        reach: f64,
    ) -> Self {
        let vertices = subdivision.vertices.iter();
        Self {
            subdivision,
            rank,
            points: vertices
                .map(|&vertex| grid.pixels_from_image(vertex))
                .collect(),
            reach,
        }
    }

    /// What is to be painted of the shape within `loops` of half-edges.
    pub fn painted(&self, loops: &[Vec<u32>], reached: &mut Reached) -> Vec<Vec<DVec2>> {
        reached.by.resize(self.rank.len(), 0);
        let mut painted = Vec::new();
        for edges in loops {
            let mut outline = self.outline(edges, reached);
            let is_repeated = |a: DVec2, b: DVec2| (a - b).length() <= COINCIDENT;
            outline.dedup_by(|a, b| is_repeated(*a, *b));
            while let [first, .., last] = outline[..]
                && is_repeated(first, last)
            {
                outline.pop();
            }
            let corners = trace::corners(&outline, STRAIGHT);
            if !corners.is_empty() {
                painted.push(corners.into_iter().map(|c| outline[c]).collect());
            }
        }
        painted
    }

    /// Whether what is across a half-edge is painted later.
    fn is_trapped(&self, edge: u32) -> bool {
        let across = self.subdivision.across(edge);
        across.is_some_and(|fragment| self.rank[fragment as usize] > self.own_rank(edge))
    }

    fn own_rank(&self, edge: u32) -> u32 {
        self.rank[self.subdivision.half_edge(edge).polygon as usize]
    }

    fn pixels(&self, edge: u32) -> [DVec2; 2] {
        let edge = self.subdivision.half_edge(edge);
        [edge.from, edge.to].map(|vertex| self.points[vertex as usize])
    }

    /// The outline of a loop with its traps.
    fn outline(&self, edges: &[u32], reached: &mut Reached) -> Vec<DVec2> {
        let mut sides = self.sides(edges);
        let mut outline = Vec::new();
        if self.reach == 0.0 {
            outline.extend(sides.iter().map(|side| side.from));
            return outline;
        }
        let Some(fixed) = sides.iter().position(|side| !side.is_trapped()) else {
            let whole = Chain {
                sides: &sides,
                limits: None,
            };
            self.cover(whole, reached, &mut outline);
            return outline;
        };
        // No chain goes on from the last side to the first.
        sides.rotate_left(fixed);
        let mut next = 0;
        for run in sides.chunk_by(|a, b| a.is_trapped() == b.is_trapped()) {
            let first = next;
            next += run.len();
            if !run[0].is_trapped() {
                outline.extend(run.iter().flat_map(|side| [side.from, side.to]));
                continue;
            }
            let limits = [
                self.limit_at_start(&sides[first - 1], &run[0]),
                self.limit_at_end(&run[run.len() - 1], &sides[next % sides.len()]),
            ];
            let chain = Chain {
                sides: run,
                limits: Some(limits),
            };
            self.cover(chain, reached, &mut outline);
        }
        outline
    }

    /// Cuts a loop where it turns, and where what is across begins or ends to be painted later.
    fn sides(&self, edges: &[u32]) -> Vec<Side> {
        let points: Vec<DVec2> = edges.iter().map(|&edge| self.pixels(edge)[0]).collect();
        let mut starts_side = vec![false; edges.len()];
        for corner in trace::corners(&points, COINCIDENT) {
            starts_side[corner] = true;
        }
        for (index, &edge) in edges.iter().enumerate() {
            let before = edges[(index + edges.len() - 1) % edges.len()];
            starts_side[index] |= self.is_trapped(before) != self.is_trapped(edge);
        }
        let Some(first) = starts_side.iter().position(|&starts| starts) else {
            return Vec::new();
        };
        let mut sides: Vec<Side> = Vec::new();
        for step in 0..edges.len() {
            let index = (first + step) % edges.len();
            let [from, to] = self.pixels(edges[index]);
            if starts_side[index] {
                sides.push(Side {
                    from,
                    along: DVec2::ZERO,
                    to,
                    edges: Vec::new(),
                });
            }
            let side = sides.last_mut().expect("the first of them starts a side");
            side.to = to;
            if self.is_trapped(edges[index]) {
                side.edges.push(edges[index]);
            }
        }
        for side in &mut sides {
            side.along = (side.to - side.from).normalize_or_zero();
        }
        sides
    }

    /// The direction from the start of a chain in which its zone ends: the border before it carried on, or
    /// three quarters of the way to where later shapes end, whichever is less far round.
    fn limit_at_start(&self, before: &Side, first: &Side) -> DVec2 {
        let exit = self.last_later(first.edges[0], first.from, false);
        let angle_to = |direction: DVec2| angle(direction, first.along);
        let turn = limit(angle_to(before.along), exit.map(angle_to));
        DVec2::from_angle(-turn).rotate(first.along)
    }

    /// The same at the end of a chain.
    fn limit_at_end(&self, last: &Side, after: &Side) -> DVec2 {
        let exit = self.last_later(last.edges[last.edges.len() - 1], last.to, true);
        let angle_to = |direction: DVec2| angle(-last.along, direction);
        let turn = limit(angle_to(-after.along), exit.map(angle_to));
        DVec2::from_angle(turn).rotate(-last.along)
    }

    /// Goes around an end of a half-edge of a chain, from what is across it through later fragments to
    /// the last of them. The direction in which that one ends; `None` on the frame.
    fn last_later(&self, edge: u32, pivot: DVec2, at_end: bool) -> Option<DVec2> {
        let own_rank = self.own_rank(edge);
        let mut twin = self.subdivision.half_edge(edge).twin?;
        // A vertex has fewer fragments around it than there are.
        for _ in 0..self.rank.len() {
            let around = self
                .subdivision
                .around(self.subdivision.half_edge(twin).polygon);
            let count = around.end - around.start;
            let step = if at_end { count - 1 } else { 1 };
            let side = around.start + (twin - around.start + step) % count;
            if is_on_frame(self.subdivision.ends(side)) {
                return None;
            }
            match self.subdivision.half_edge(side).twin {
                Some(next)
                    if self.rank[self.subdivision.half_edge(next).polygon as usize] > own_rank =>
                {
                    twin = next;
                }
                _ => {
                    let [from, to] = self.pixels(side);
                    let other = if at_end { from } else { to };
                    return Some((other - pivot).normalize_or_zero());
                }
            }
        }
        None
    }

    /// Appends the outline of a chain's trap, without the chain's ends.
    fn cover(&self, chain: Chain, reached: &mut Reached, outline: &mut Vec<DVec2>) {
        let count = chain.sides.len();
        // A single side may have a smaller trap.
        let reaches: &[f64] = if count == 1 { &[1.0, 0.5] } else { &[1.0] };
        for share in reaches {
            let reach = share * self.reach;
            if let Some(zone) = Zone::around(&chain, reach)
                && self.is_free(&chain, &zone, NEAR_EXIT.min(0.5 * reach), reached)
            {
                outline.extend(&zone.outer);
                return;
            }
        }
        let length: f64 = chain.sides.iter().map(|side| side.length()).sum();
        if count < 2 || length < SHORT {
            outline.extend(chain.sides.iter().flat_map(|side| [side.from, side.to]));
            return;
        }
        let (one, other) = chain.sides.split_at(count / 2);
        let middle = between(&one[one.len() - 1], &other[0]);
        let [start, end] = chain.limits.unwrap_or_else(|| {
            let limit = between(&other[other.len() - 1], &one[0]);
            [limit, limit]
        });
        for (sides, limits) in [(one, [start, middle]), (other, [middle, end])] {
            let limits = Some(limits);
            self.cover(Chain { sides, limits }, reached, outline);
        }
    }

    /// Whether nothing but the chain's shape and later ones lies in a zone, and near to it.
    fn is_free(&self, chain: &Chain, zone: &Zone, distance: f64, reached: &mut Reached) -> bool {
        let own_rank = self.own_rank(chain.sides[0].edges[0]);
        reached.begin();
        for &edge in chain.sides.iter().flat_map(|side| &side.edges) {
            reached.push(self.subdivision.half_edge(edge).polygon);
            if let Some(across) = self.subdivision.across(edge) {
                reached.push(across);
            }
        }
        let mut next = 0;
        while let Some(&fragment) = reached.fragments.get(next) {
            next += 1;
            if next > MOST_SEARCHED {
                return false;
            }
            let edges = self.subdivision.around(fragment);
            let corners = edges.clone().map(|edge| self.pixels(edge)[0]);
            let rounding = if zone.has_no_room_for(corners) {
                // It is as if what lies beyond lay along the zone's border.
                2.0 * COINCIDENT
            } else {
                -COINCIDENT
            };
            for edge in edges {
                if !zone.meets(self.pixels(edge), distance, rounding) {
                    continue;
                }
                match self.subdivision.across(edge) {
                    // Beyond the frame there is no picture for a trap to be seen in.
                    None if is_on_frame(self.subdivision.ends(edge)) => {}
                    Some(across) if self.rank[across as usize] >= own_rank => reached.push(across),
                    _ => return false,
                }
            }
        }
        true
    }
}

impl Reached {
    fn begin(&mut self) {
        self.search += 1;
        self.fragments.clear();
    }

    fn push(&mut self, fragment: u32) {
        let by = &mut self.by[fragment as usize];
        if *by != self.search {
            *by = self.search;
            self.fragments.push(fragment);
        }
    }
}

/// The angle by which `from` is turned to `to`: 0 to 2π.
fn angle(from: DVec2, to: DVec2) -> f64 {
    let angle = cross(from, to).atan2(from.dot(to));
    if angle < 0.0 { angle + TAU } else { angle }
}

/// How far round from a chain its zone reaches at its end: to the border carried on, and not as far as an
/// exit.
fn limit(border: f64, exit: Option<f64>) -> f64 {
    let exit = exit.map_or(PI, |exit| (1.0 - NEAR_EXIT_SHARE) * exit);
    // If the border hardly turns, what it leaves of the zone is too narrow.
    let border = if border < FLAT { PI } else { border };
    border.min(exit).min(PI)
}

/// The direction away from the shape where two of its sides meet, halfway between them.
fn between(one: &Side, other: &Side) -> DVec2 {
    let turn = cross(one.along, other.along).atan2(one.along.dot(other.along));
    DVec2::from_angle(0.5 * turn).rotate(-one.along.perp())
}

/// Distance from the line through `point` along the unit vector `along`, positive on the side to
/// which polygons wound positively lie.
fn distance_from(point: DVec2, along: DVec2) -> Affine {
    Affine::new(-along.y, along.x, -cross(along, point))
}

/// The function `by` greater.
fn raised(function: &Affine, by: f64) -> Affine {
    Affine::new(function.a, function.b, function.c + by)
}

/// A convex part of the plane for the trap of a chain.
struct Zone {
    half_planes: Vec<HalfPlane>,
    /// The part of its border that becomes the shape's outline, from the chain's start to its end.
    outer: Vec<DVec2>,
}

/// One side of a line, or on it: where `inside` is at least zero, which is the distance from the line.
#[derive(Clone, Copy)]
struct HalfPlane {
    inside: Affine,
    kind: Border,
}

/// What lies along a border of a zone.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Border {
    /// Later shapes; it may be moved outwards.
    Free,
    /// Later shapes.
    Cap,
    /// The shape, or the line at which the zone of the next chain begins.
    Own,
}

/// A corner of a zone, and what lies along the side that starts there: a row of its half-planes.
#[derive(Clone, Copy)]
struct Corner {
    at: DVec2,
    side: usize,
}

impl Zone {
    /// The zone of a chain; `None` if the chain winds so that it has none.
    fn around(chain: &Chain, reach: f64) -> Option<Self> {
        let mut points: Vec<DVec2> = chain.sides.iter().map(|side| side.from).collect();
        if chain.limits.is_some() {
            points.push(chain.end());
        }
        let mut half_planes = hull_half_planes(&points, chain.limits.is_none(), reach);
        if let Some([at_start, at_end]) = chain.limits {
            let limits = [
                distance_from(chain.start(), at_start),
                distance_from(chain.end(), at_end).negated(),
            ];
            let contains = |half_plane: &Affine| {
                points
                    .iter()
                    .all(|&point| half_plane.at(point) >= -COINCIDENT)
            };
            if !limits.iter().all(contains) {
                return None;
            }
            half_planes.extend(limits.map(|inside| HalfPlane {
                inside,
                kind: Border::Own,
            }));
            // No farther to the sides than the trap is deep and half of it.
            let [first, last] = [&chain.sides[0], &chain.sides[chain.sides.len() - 1]];
            let caps = [
                distance_from(first.from, -first.along.perp()),
                distance_from(last.to, last.along.perp()),
            ];
            let caps = caps.map(|cap| raised(&cap, 1.5 * reach));
            let caps = caps.into_iter().filter(contains);
            half_planes.extend(caps.map(|inside| HalfPlane {
                inside,
                kind: Border::Cap,
            }));
        }
        half_planes.extend(frame_around(&points, 2.0 * SHARPEST * reach));
        let corners = with_fewer_corners(corners_of(&half_planes)?, &half_planes, reach);
        let outer = outer_border(&corners, &half_planes)?;
        Some(Self {
            half_planes: corners
                .iter()
                .map(|corner| half_planes[corner.side])
                .collect(),
            outer,
        })
    }

    /// Whether a polygon lies along the shape or a limit, thinner than rounding.
    fn has_no_room_for(&self, corners: impl Iterator<Item = DVec2> + Clone) -> bool {
        self.half_planes.iter().any(|half_plane| {
            let is_along = |point| half_plane.inside.at(point).abs() <= COINCIDENT;
            half_plane.kind == Border::Own && corners.clone().all(is_along)
        })
    }

    /// Whether a part of a segment lies in the zone, or within a distance of it under later shapes, or
    /// within `rounding` of the shape and of limits: a negative one leaves out what lies along those.
    fn meets(&self, [from, to]: [DVec2; 2], distance: f64, rounding: f64) -> bool {
        let mut part = [0.0, 1.0];
        for half_plane in &self.half_planes {
            let margin = match half_plane.kind {
                Border::Own => rounding,
                Border::Free | Border::Cap => distance,
            };
            let [start, end] = [from, to].map(|end| half_plane.inside.at(end) + margin);
            if start < 0.0 && end < 0.0 {
                return false;
            }
            if start < 0.0 || end < 0.0 {
                let share = start / (start - end);
                if start < 0.0 {
                    part[0] = f64::max(part[0], share);
                } else {
                    part[1] = f64::min(part[1], share);
                }
            }
        }
        (part[1] - part[0]) * (to - from).length() > NEGLIGIBLE_LENGTH
    }
}

/// The half-planes of the hull of a chain's points, moved outwards by `reach` where later shapes lie.
///
/// Sides of the hull that run as the chain does have later shapes outside, the others the shape itself.
fn hull_half_planes(points: &[DVec2], closed: bool, reach: f64) -> Vec<HalfPlane> {
    let hull = hull(points);
    let is_outline = signed_area(points) > 0.0;
    let is_free = |from: usize, to: usize| if closed { is_outline } else { to > from };
    let side = |k: usize| [hull[k % hull.len()], hull[(k + 1) % hull.len()]];
    let mut half_planes = Vec::new();
    for k in 0..hull.len() {
        let [from, to] = side(k);
        let along = (points[to] - points[from]).normalize_or_zero();
        let free = is_free(from, to);
        half_planes.push(HalfPlane {
            inside: raised(
                &distance_from(points[from], along),
                if free { reach } else { 0.0 },
            ),
            kind: if free { Border::Free } else { Border::Own },
        });
        let [_, next] = side(k + 1);
        let after = (points[next] - points[to]).normalize_or_zero();
        // The corner lies one by the sine of half its angle away.
        let is_sharp = (along - after).length() > 2.0 * (1.0 - SHARPEST.powi(-2)).sqrt();
        if free && is_free(to, next) && is_sharp && hull.len() > 2 {
            let tip = (along + after).normalize_or(along);
            half_planes.push(HalfPlane {
                inside: raised(&distance_from(points[to], tip), reach),
                kind: Border::Cap,
            });
        }
    }
    half_planes
}

/// Corners of the convex hull, wound positively, as rows of `points` (Andrew, 1979).
fn hull(points: &[DVec2]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        let (p, q) = (points[a], points[b]);
        p.x.total_cmp(&q.x)
            .then(p.y.total_cmp(&q.y))
            .then(a.cmp(&b))
    });
    order.dedup_by(|a, b| points[*a] == points[*b]);
    let half = |order: &mut dyn Iterator<Item = usize>| {
        let mut half: Vec<usize> = Vec::new();
        for next in order {
            while let [.., before, last] = half[..]
                && cross(points[last] - points[before], points[next] - points[last]) <= 0.0
            {
                half.pop();
            }
            half.push(next);
        }
        half.pop();
        half
    };
    let mut hull = half(&mut order.iter().copied());
    hull.extend(half(&mut order.iter().rev().copied()));
    hull
}

/// A box around points that bounds all zones.
fn frame_around(points: &[DVec2], margin: f64) -> [HalfPlane; 4] {
    let low = points.iter().copied().fold(DVec2::INFINITY, DVec2::min) - margin;
    let high = points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max) + margin;
    let sides = [
        (low, DVec2::X),
        (high, DVec2::Y),
        (high, -DVec2::X),
        (low, -DVec2::Y),
    ];
    sides.map(|(point, along)| HalfPlane {
        inside: distance_from(point, along),
        kind: Border::Cap,
    })
}

/// The corners of what all half-planes share; the last four of them are a box around it. `None` if it has
/// no area.
fn corners_of(half_planes: &[HalfPlane]) -> Option<Vec<Corner>> {
    let (rest, frame) = half_planes.split_at(half_planes.len() - 4);
    let mut corners: Vec<Corner> = (0..4)
        .map(|k| Corner {
            at: crossing(&frame[(k + 3) % 4].inside, &frame[k].inside),
            side: rest.len() + k,
        })
        .collect();
    for (side, half_plane) in rest.iter().enumerate() {
        let mut kept = Vec::with_capacity(corners.len() + 1);
        for (k, &here) in corners.iter().enumerate() {
            let there = corners[(k + 1) % corners.len()].at;
            let (d_here, d_there) = (half_plane.inside.at(here.at), half_plane.inside.at(there));
            if d_here >= 0.0 {
                kept.push(here);
            }
            if d_here < 0.0 && d_there > 0.0 || d_here > 0.0 && d_there < 0.0 {
                let at = here.at + (there - here.at) * (d_here / (d_here - d_there));
                let side = if d_here > 0.0 { side } else { here.side };
                kept.push(Corner { at, side });
            } else if d_here == 0.0
                && d_there < 0.0
                && let Some(last) = kept.last_mut()
            {
                last.side = side;
            }
        }
        corners = kept;
    }
    let outline: Vec<DVec2> = corners.iter().map(|corner| corner.at).collect();
    (signed_area(&outline) > NEGLIGIBLE_AREA).then_some(corners)
}

/// Where two lines cross.
fn crossing(one: &Affine, other: &Affine) -> DVec2 {
    let turn = one.a * other.b - one.b * other.a;
    DVec2::new(
        one.b * other.c - one.c * other.b,
        one.c * other.a - one.a * other.c,
    ) / turn
}

/// Leaves out free sides, the flattest corners first, as long as nothing moves outwards by more than
/// half of `reach`.
fn with_fewer_corners(
    mut corners: Vec<Corner>,
    half_planes: &[HalfPlane],
    reach: f64,
) -> Vec<Corner> {
    while corners.len() > 3 {
        let count = corners.len();
        // Where the neighbours of side `k` meet, and how far beyond it.
        let without = |k: usize| {
            let own = &half_planes[corners[k].side];
            let before = &half_planes[corners[(k + count - 1) % count].side];
            let after = &half_planes[corners[(k + 1) % count].side];
            if own.kind != Border::Free {
                return None;
            }
            let at = crossing(&before.inside, &after.inside);
            let is_near = half_planes.iter().all(|half_plane| {
                let slack = match half_plane.kind {
                    Border::Free => 0.5 * reach,
                    Border::Cap | Border::Own => COINCIDENT,
                };
                half_plane.inside.at(at) >= -slack
            });
            let beyond = -own.inside.at(at);
            (is_near && beyond >= 0.0).then_some((beyond, k, at))
        };
        let flattest = (0..count).filter_map(without);
        let Some((_, k, at)) = flattest.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            break;
        };
        corners[(k + 1) % count].at = at;
        corners.remove(k);
    }
    corners
}

/// The corners along later shapes; `None` if those are not in one stretch.
fn outer_border(corners: &[Corner], half_planes: &[HalfPlane]) -> Option<Vec<DVec2>> {
    let count = corners.len();
    let is_outer = |k: usize| half_planes[corners[k % count].side].kind != Border::Own;
    let mut starts = (0..count).filter(|&k| is_outer(k) && !is_outer(k + count - 1));
    let Some(first) = starts.next() else {
        // Outside of everything, or a hole that is filled.
        return Some(if is_outer(0) {
            corners.iter().map(|corner| corner.at).collect()
        } else {
            Vec::new()
        });
    };
    if starts.next().is_some() {
        return None;
    }
    let length = (0..count)
        .take_while(|&step| is_outer(first + step))
        .count();
    let outer = (0..=length).map(|step| corners[(first + step) % count].at);
    Some(outer.collect())
}
