//! Trapping: shapes reach a little under those painted later, so that no seam is seen between them.
//!
//! Viewers smooth each shape's edge by itself. Where two shapes meet in a pixel, each covers a part of
//! it and both let the background through: halves leave a quarter of it (conflation). If the shape
//! painted first fills the pixel, the later one is laid on that and the pixel is right. Printers have the
//! same trouble with inks out of register, and the same remedy, called a trap.
//!
//! A trap must stay hidden, at outer contours above all, or the picture grows fat by what peeps out from
//! under thin shapes. So it consists of parts of the *fragments* of later shapes, which the map has:
//!
//! ```text
//!     own shape                       zone of the side a-b: up to `width` away from it, on the far side,
//!   ____a__________b____                ended at right angles, or halfway to the next side's zone;
//!       :  f1 | f2 :      later       traps: what f1, f2, f3 … cover of the zone, as far as one gets
//!       :_____|____:      shapes        from a-b through fragments of later shapes;
//!       \ _ . - ' exit                less what is too near to an exit.
//! ```
//!
//! Shapes thinner than [`super::UNSEEN`] are not painted, and all others reach under them as if they
//! were painted last: however thin a shape is, it would be seen, since the edges of what lies on top of
//! it let a quarter of it through.
//!
//! What is left: pixels in which three shapes meet may still let some of the background through (a few
//! dozen in half a million of a city's picture), and a shape thinner than a pixel shows more of its colour
//! between two others than its area would.
//!
//! Beyond a sharp point of the shape, where zones at either side would leave a wedge open, lies one more.
//!
//! An exit is a side beyond which there is nothing, or a shape painted earlier: where the trap would peep
//! out. What is near to it is given up: nearer than half a pixel, and than a quarter of the distance from
//! the own side.

use super::subdivision::Subdivision;
use super::{is_on_frame, trace};
use crate::dice::PixelGrid;
use veduta_geometry::{Affine, DVec2, cross, signed_area};

/// Makes traps; lengths are in pixels.
pub(super) struct Trapper<'a> {
    subdivision: &'a Subdivision,
    /// When each fragment is painted.
    rank: &'a [u32],
    grid: &'a PixelGrid,
    width: f64,
}

/// Areas, in square pixels, that are not worth a trap.
const NEGLIGIBLE_AREA: f64 = 1e-6;

/// Lengths, in pixels, of a side in a zone that are not looked at.
const NEGLIGIBLE_LENGTH: f64 = 1e-6;

/// Distance in pixels within which points of traps are one.
const COINCIDENT: f64 = 1e-6;

/// How far, in pixels, the sides of what is painted may be moved to make them straight: a tenth of the
/// thousandth to which files are written. What is seen of shapes is not moved.
const STRAIGHT: f64 = 1e-4;

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

    /// Whether the zones of two sides that follow one another meet halfway.
    fn meets(&self, other: &Side) -> bool {
        other.is_trapped() && self.along.dot(other.along) > SHARP
    }

    /// Where the shape comes to a point that is too sharp for the zones to meet: a side across it,
    /// whose zone lies beyond the point.
    fn cap(&self, after: &Side, width: f64) -> Option<Side> {
        let is_tip = cross(self.along, after.along) > 0.0;
        if !is_tip || !after.is_trapped() || self.meets(after) {
            return None;
        }
        let out = (self.along - after.along).normalize_or_zero();
        let along = out.perp();
        Some(Side {
            from: self.to - width * along,
            along,
            to: self.to + width * along,
            edges: vec![self.edges[self.edges.len() - 1], after.edges[0]],
        })
    }
}

/// The part of the plane for the trap of a side: where all of these are at least zero.
struct Zone([Affine; 4]);

impl<'a> Trapper<'a> {
    pub fn new(
        subdivision: &'a Subdivision,
        rank: &'a [u32],
        grid: &'a PixelGrid,
        width: f64,
    ) -> Self {
        Self {
            subdivision,
            rank,
            grid,
            width,
        }
    }

    /// What is to be painted of the shape within `loops` of half-edges, whose corners are `seen`.
    pub fn with_trap(&self, loops: &[Vec<u32>], seen: &[Vec<DVec2>]) -> Vec<Vec<DVec2>> {
        let mut traps = Vec::new();
        if self.width > 0.0 {
            for edges in loops {
                self.trap_loop(edges, &mut traps);
            }
        }
        if traps.is_empty() {
            return seen.to_vec();
        }
        let polygons: Vec<&[DVec2]> = seen.iter().chain(&traps).map(Vec::as_slice).collect();
        let union = Subdivision::new(&polygons, COINCIDENT);
        let edges = 0..union.half_edges().len() as u32;
        let border: Vec<u32> = edges
            .filter(|&edge| union.half_edge(edge).twin.is_none())
            .collect();
        trace::loops(&union, &border)
            .iter()
            .filter_map(|edges| {
                let points: Vec<DVec2> = edges.iter().map(|&e| union.ends(e)[0]).collect();
                let corners = trace::corners(&points, STRAIGHT);
                (!corners.is_empty()).then(|| corners.iter().map(|&c| points[c]).collect())
            })
            .collect()
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
        let ends = self.subdivision.ends(edge);
        ends.map(|point| self.grid.pixels_from_image(point))
    }

    fn trap_loop(&self, edges: &[u32], traps: &mut Vec<Vec<DVec2>>) {
        let sides = self.sides(edges);
        for (index, side) in sides.iter().enumerate() {
            if side.is_trapped() {
                let before = &sides[(index + sides.len() - 1) % sides.len()];
                let after = &sides[(index + 1) % sides.len()];
                self.trap_side(side, &Zone::new(side, before, after, self.width), traps);
                if let Some(cap) = side.cap(after, self.width) {
                    self.trap_side(&cap, &Zone::new(&cap, &cap, &cap, self.width), traps);
                }
            }
        }
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

    fn trap_side(&self, side: &Side, zone: &Zone, traps: &mut Vec<Vec<DVec2>>) {
        let own_rank = self.own_rank(side.edges[0]);
        let across = |&edge: &u32| self.subdivision.across(edge);
        let mut reached: Vec<u32> = side.edges.iter().filter_map(across).collect();
        reached.dedup();
        let mut next = 0;
        while let Some(&fragment) = reached.get(next) {
            next += 1;
            let edges = self.subdivision.around(fragment);
            let mut part: Vec<DVec2> = edges.clone().map(|edge| self.pixels(edge)[0]).collect();
            for half_plane in &zone.0 {
                part = clipped(&part, half_plane);
            }
            // Far enough from all exits by share, and in pixels: together a little less than far enough
            // from each by either, but convex.
            let mut parts = [part.clone(), part];
            let mut has_exit = false;
            // However thin the part is, what lies beyond it may be reached through it.
            for edge in edges {
                let ends = self.pixels(edge);
                if !zone.meets(ends) {
                    continue;
                }
                let is_exit = match self.subdivision.across(edge) {
                    // Beyond the frame there is no picture for a trap to be seen in.
                    None => !is_on_frame(self.subdivision.ends(edge)),
                    Some(across) if self.rank[across as usize] > own_rank => {
                        if !reached.contains(&across) {
                            reached.push(across);
                        }
                        false
                    }
                    Some(across) => self.rank[across as usize] < own_rank,
                };
                // Along the side itself no distance can be kept.
                let is_along = ends
                    .iter()
                    .all(|&end| zone.0[0].at(end).abs() <= COINCIDENT);
                if is_exit && !is_along {
                    has_exit = true;
                    for (part, far) in parts.iter_mut().zip(far_from_exit(side, ends)) {
                        *part = clipped(part, &far);
                    }
                }
            }
            // Without exits both are the same.
            let count = if has_exit { 2 } else { 1 };
            let parts = parts.into_iter().take(count);
            traps.extend(parts.filter(|part| signed_area(part) > NEGLIGIBLE_AREA));
        }
    }
}

/// Distance from the line through `point` along the unit vector `along`, positive on the side to
/// which polygons wound positively lie.
fn distance_from(point: DVec2, along: DVec2) -> Affine {
    Affine::new(-along.y, along.x, -cross(along, point))
}

/// How near to an exit traps may come: as a share of the distance from the side, and in pixels; the less
/// of the two. With more, traps would be missing in pixels that the exit does not touch; with less, thin
/// shapes would look fat.
const NEAR_EXIT: (f64, f64) = (0.25, 0.5);

/// Where a trap of the side keeps its distance from an exit, as a share and in pixels: where the functions
/// are at least zero.
fn far_from_exit(side: &Side, [from, to]: [DVec2; 2]) -> [Affine; 2] {
    let from_side = distance_from(side.from, side.along);
    let from_exit = distance_from(from, (to - from).normalize_or_zero());
    let (share, pixels) = NEAR_EXIT;
    [
        // The distance from the side is negative where its trap lies.
        Affine::new(
            from_exit.a + share * from_side.a,
            from_exit.b + share * from_side.b,
            from_exit.c + share * from_side.c,
        ),
        Affine::new(from_exit.a, from_exit.b, from_exit.c - pixels),
    ]
}

/// How sharply two sides may turn (the cosine) for their zones to meet halfway. Where they turn by more
/// than 120 degrees, the corner would reach too far.
const SHARP: f64 = -0.5;

impl Zone {
    fn new(side: &Side, before: &Side, after: &Side, width: f64) -> Self {
        let away = distance_from(side.from, side.along).negated();
        let meeting = |neighbour: &Side| {
            let across = if side.meets(neighbour) {
                (side.along + neighbour.along).normalize_or_zero()
            } else {
                side.along
            };
            // Along `across`, from where they meet.
            move |corner: DVec2| Affine::new(across.x, across.y, -across.dot(corner))
        };
        Self([
            away,
            Affine::new(-away.a, -away.b, width - away.c),
            meeting(before)(side.from),
            meeting(after)(side.to).negated(),
        ])
    }

    /// Whether a part of a segment lies in the zone.
    fn meets(&self, [from, to]: [DVec2; 2]) -> bool {
        let mut part = [0.0, 1.0];
        for (index, half_plane) in self.0.iter().enumerate() {
            // A little more on the own side: what lies along it does so but for rounding.
            let margin = if index == 0 { COINCIDENT } else { 0.0 };
            let [start, end] = [from, to].map(|end| half_plane.at(end) + margin);
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
