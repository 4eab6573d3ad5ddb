//! Random scenes of every kind that has ever broken a visibility algorithm.
//!
//! Faces are made in pixels of a small picture, since "a sliver of 3e-5 pixels" is the size that
//! matters, clipped to the frame, and handed over in the image plane.

use super::rng::Rng;
use std::f64::consts::TAU;
use std::fmt;
use veduta::geometry::{Affine, DVec2, DVec3};
use veduta::map::{FaceId, Faces, ObjectId, PlaneId};

/// A scene, and the picture it is measured in.
pub struct Scene {
    pub seed: u64,
    pub kind: &'static str,
    pub width: u32,
    pub height: u32,
    pub faces: Faces,
    /// Whether opaque faces cover the whole frame.
    pub is_covered: bool,
}

impl fmt::Display for Scene {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "seed {} ({}, {} faces, {} x {} pixels)",
            self.seed,
            self.kind,
            self.faces.len(),
            self.width,
            self.height
        )
    }
}

/// A name and what draws it; the number is about how many faces there should be.
type Kind = (&'static str, fn(&mut Canvas, u32));

const KINDS: [Kind; 14] = [
    ("soup", soup),
    ("slivers", slivers),
    ("T-junctions", t_junctions),
    ("mesh", meshes),
    ("pixel corners", pixel_corners),
    ("duplicates", duplicates),
    ("coplanar", coplanar),
    ("grazing", grazing),
    ("piercing", piercing),
    ("wires", wires),
    ("foliage", foliage),
    ("polygons", polygons),
    ("near-vertical", near_vertical),
    ("mixture", mixture),
];

/// Kinds that come with thousands of faces without thousands of faces one behind the other.
const LARGE_KINDS: [Kind; 7] = [
    ("large mesh", meshes),
    ("large foliage", foliage),
    ("large wires", short_wires),
    ("large duplicates", duplicates),
    ("large coplanar", coplanar),
    ("large piercing", piercing),
    ("large slivers", short_slivers),
];

/// How many faces a large scene has more than.
pub const LARGE: usize = 5_000;

impl Scene {
    /// Scene number `seed`. A tenth of them are large.
    pub fn random(seed: u64) -> Self {
        if seed % 10 == 9 {
            Self::large(seed)
        } else {
            Self::small(seed)
        }
    }

    /// A scene of some 5 to 200 faces.
    pub fn small(seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        let (kind, draw) = KINDS[rng.integer(0, KINDS.len() as u32 - 1) as usize];
        let (width, height) = if kind == "slivers" && rng.chance(0.03) {
            (512, 512)
        } else {
            (rng.integer(24, 64), rng.integer(16, 48))
        };
        let faces = rng.magnitude(5.0, 200.0) as u32;
        Self::draw(seed, kind, draw, [width, height], faces, rng)
    }

    /// A scene of more than 5,000 faces, on few pixels.
    pub fn large(seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        let (kind, draw) = LARGE_KINDS[rng.integer(0, LARGE_KINDS.len() as u32 - 1) as usize];
        let size = [rng.integer(12, 24), rng.integer(40, 56)];
        let faces = rng.integer(5_200, 6_000);
        let scene = Self::draw(seed, kind, draw, size, faces, rng);
        assert!(scene.faces.len() > LARGE, "{scene} should have more faces");
        scene
    }

    fn draw(
        seed: u64,
        kind: &'static str,
        draw: fn(&mut Canvas, u32),
        [width, height]: [u32; 2],
        faces: u32,
        mut rng: Rng,
    ) -> Self {
        let is_covered = rng.chance(0.5);
        let has_veils = rng.chance(0.25);
        let mut canvas = Canvas {
            width: f64::from(width),
            height: f64::from(height),
            faces: Faces::new(),
            rng,
        };
        if is_covered && canvas.rng.chance(0.5) {
            canvas.backdrop();
            draw(&mut canvas, faces);
        } else {
            draw(&mut canvas, faces);
            if is_covered {
                canvas.backdrop();
            }
        }
        if has_veils {
            canvas.make_veils();
        }
        Self {
            seed,
            kind,
            width,
            height,
            faces: canvas.faces,
            is_covered,
        }
    }
}

/// The backdrop's [`Faces::source`], by which it is known.
const BACKDROP: u32 = u32::MAX;

/// What scenes are drawn on: coordinates are in pixels, y downwards; z is nearness.
struct Canvas {
    width: f64,
    height: f64,
    faces: Faces,
    rng: Rng,
}

impl Canvas {
    fn size(&self) -> DVec2 {
        DVec2::new(self.width, self.height)
    }

    fn point(&mut self) -> DVec2 {
        DVec2::new(self.rng.unit(), self.rng.unit()) * self.size()
    }

    fn direction(&mut self) -> DVec2 {
        DVec2::from_angle(self.rng.within(0.0, TAU))
    }

    /// The plane through three points.
    fn plane_through(&mut self, points: [DVec3; 3]) -> PlaneId {
        let [p, q, r] =
            points.map(|point| DVec3::new(point.x / self.width, point.y / self.height, point.z));
        let normal = (q - p).cross(r - p);
        let (a, b) = (-normal.x / normal.z, -normal.y / normal.z);
        let nearness = Affine::new(a, b, p.z - a * p.x - b * p.y);
        // Points on one line have no plane; a face there has no area either.
        if normal.z == 0.0 || !(a.abs() + b.abs()).is_finite() {
            return self.faces.push_plane(Affine::new(0.0, 0.0, p.z));
        }
        self.faces.push_plane(nearness)
    }

    /// A plane across the frame, of some slope in either direction.
    fn any_plane(&mut self, slope: f64) -> PlaneId {
        let [a, b] = [0, 0].map(|_| self.rng.within(-slope, slope));
        let c = self.rng.within(0.2, 0.8) - 0.5 * (a + b);
        self.faces.push_plane(Affine::new(a, b, c))
    }

    /// Adds a convex face, clipped to the frame.
    fn add(&mut self, outline: &[DVec2], plane: PlaneId) -> Option<FaceId> {
        let size = self.size();
        let outline: Vec<DVec2> = outline.iter().map(|&vertex| vertex / size).collect();
        let clipped = clipped_to_frame(outline);
        let source = self.faces.len() as u32;
        self.faces.push(&clipped, plane, ObjectId(0), source)
    }

    /// Adds a triangle on the plane through its corners.
    fn triangle(&mut self, corners: [DVec3; 3]) {
        let plane = self.plane_through(corners);
        self.add(&corners.map(|corner| corner.truncate()), plane);
    }

    fn backdrop(&mut self) {
        // Mostly behind everything; sometimes other faces pierce it.
        let plane = if self.rng.chance(0.7) {
            self.faces.push_plane(Affine::new(0.0, 0.0, -1e6))
        } else {
            self.any_plane(0.3)
        };
        let frame = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
        self.faces.push(&frame, plane, ObjectId(1), BACKDROP);
    }

    fn make_veils(&mut self) {
        for face in self.faces.ids() {
            if self.faces.source(face) != BACKDROP && self.rng.chance(0.3) {
                self.faces.set_veil(face);
            }
        }
    }

    /// The points of a grid over the frame, its inner ones moved by up to `jitter` of a cell.
    fn grid(&mut self, columns: u32, rows: u32, jitter: f64) -> Vec<DVec2> {
        let mut points = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                let mut at = DVec2::new(f64::from(column), f64::from(row));
                if column > 0 && column < columns {
                    at.x += self.rng.within(-jitter, jitter);
                }
                if row > 0 && row < rows {
                    at.y += self.rng.within(-jitter, jitter);
                }
                points.push(at / DVec2::new(f64::from(columns), f64::from(rows)) * self.size());
            }
        }
        points
    }

    /// A sphere of `2 rings^2` triangles, all of them, also those that look away.
    fn ball(&mut self, centre: DVec3, radius: f64, rings: u32) {
        let tilt = self.rng.within(0.0, TAU);
        // Nearness of a ball across the frame varies by about 0.5.
        let flatness = 0.5 / self.width.max(self.height);
        let point = |ring: u32, step: u32| {
            let polar = 0.5 * TAU * f64::from(ring) / f64::from(rings);
            let around = TAU * (f64::from(step % rings) + 0.13) / f64::from(rings);
            let (x, y) = (polar.sin() * around.cos(), polar.cos());
            let turned = DVec2::from_angle(tilt).rotate(DVec2::new(x, y));
            let depth = polar.sin() * around.sin() * flatness;
            centre + radius * DVec3::new(turned.x, turned.y, depth)
        };
        for ring in 0..rings {
            for step in 0..rings {
                let [a, b] = [step, step + 1].map(|step| point(ring, step));
                let [c, d] = [step, step + 1].map(|step| point(ring + 1, step));
                if ring > 0 {
                    self.triangle([a, b, d]);
                }
                if ring + 1 < rings {
                    self.triangle([a, d, c]);
                }
            }
        }
    }

    /// A thin convex strip from `from` to `to`.
    fn strip(&mut self, from: DVec2, to: DVec2, thickness: f64, plane: PlaneId) {
        let across = (to - from).perp().normalize_or_zero() * (0.5 * thickness);
        self.add(
            &[from + across, from - across, to - across, to + across],
            plane,
        );
    }
}

/// Large interpenetrating triangles.
fn soup(canvas: &mut Canvas, count: u32) {
    for _ in 0..count {
        let centre = canvas.point();
        let size = canvas.rng.within(0.05, 0.4) * canvas.height;
        let corners = [0; 3].map(|_| {
            let offset = DVec2::new(
                canvas.rng.within(-size, size),
                canvas.rng.within(-size, size),
            );
            (centre + offset).extend(canvas.rng.within(0.2, 0.8))
        });
        canvas.triangle(corners);
    }
}

/// Triangles from 3e-5 to 0.1 pixels thick, some in pairs on planes of their corners, which is extreme, and
/// some on a gentle one.
fn slivers(canvas: &mut Canvas, count: u32) {
    slivers_of_length(canvas, count.min(60), 0.9);
    soup(canvas, count.min(60) / 4);
}

fn short_slivers(canvas: &mut Canvas, count: u32) {
    slivers_of_length(canvas, count, 0.02);
}

fn slivers_of_length(canvas: &mut Canvas, count: u32, length: f64) {
    let first = canvas.faces.len();
    while canvas.faces.len() < first + count as usize {
        let from = canvas.point();
        let mut along = canvas.direction() * canvas.rng.within(0.2, 1.0) * length * canvas.height;
        if canvas.rng.chance(0.2) {
            along.x = 0.0;
        } else if canvas.rng.chance(0.2) {
            along.y = 0.0;
        }
        let thickness = canvas.rng.magnitude(3e-5, 0.1);
        let across = along.perp().normalize_or_zero() * thickness;
        let tip = from + along * canvas.rng.unit() + across;
        let corners = [from, from + along, tip];
        if canvas.rng.chance(0.5) {
            let nearness = [0; 3].map(|_| canvas.rng.within(0.2, 0.8));
            let [p, q, r] = [0, 1, 2].map(|index| corners[index].extend(nearness[index]));
            canvas.triangle([p, q, r]);
            // Its neighbour across the long edge.
            let far = from + along * canvas.rng.unit() - across;
            canvas.triangle([p, q, far.extend(nearness[2])]);
        } else {
            let plane = canvas.any_plane(0.5);
            canvas.add(&corners, plane);
        }
    }
}

/// Cells whose neighbours have vertices in the middle of a common edge.
fn t_junctions(canvas: &mut Canvas, count: u32) {
    for _ in 0..count.div_ceil(8) {
        let origin = canvas.point();
        let along = if canvas.rng.chance(0.5) {
            DVec2::X
        } else {
            canvas.direction()
        } * (0.4 * canvas.height);
        let side = along.perp();
        let plane = canvas.any_plane(0.4);
        canvas.add(&[origin, origin + along, origin - side], plane);
        let parts = canvas.rng.integer(2, 7);
        let mut previous = origin;
        for part in 1..=parts {
            let next = if part == parts {
                origin + along
            } else {
                origin + along * (f64::from(part) / f64::from(parts))
            };
            let plane = if canvas.rng.chance(0.5) {
                plane
            } else {
                canvas.any_plane(0.4)
            };
            canvas.add(&[previous, origin + side, next], plane);
            previous = next;
        }
    }
}

/// Meshes over the whole frame, with common edges and vertices, one behind the other.
fn meshes(canvas: &mut Canvas, count: u32) {
    let layers = canvas.rng.integer(1, 3);
    for _ in 0..layers {
        let cells = (f64::from(count) / f64::from(2 * layers)).sqrt().ceil() as u32;
        let points = canvas.grid(cells, cells, 0.3);
        let depth = canvas.rng.within(0.3, 0.7);
        let roughness = canvas.rng.magnitude(1e-3, 0.2);
        let corners: Vec<DVec3> = points
            .iter()
            .map(|point| point.extend(depth + canvas.rng.within(-roughness, roughness)))
            .collect();
        for [a, b, c, d] in cells_of(cells, cells) {
            let [a, b, c, d] = [a, b, c, d].map(|index| corners[index]);
            canvas.triangle([a, b, d]);
            canvas.triangle([a, d, c]);
        }
    }
}

/// Corners of the cells of a grid: upper left, upper right, lower left, lower right.
fn cells_of(columns: u32, rows: u32) -> impl Iterator<Item = [usize; 4]> {
    let index = move |column: u32, row: u32| (row * (columns + 1) + column) as usize;
    (0..rows).flat_map(move |row| {
        (0..columns).map(move |column| {
            [
                index(column, row),
                index(column + 1, row),
                index(column, row + 1),
                index(column + 1, row + 1),
            ]
        })
    })
}

/// Rectangles and triangles with vertices on corners and middles of pixels.
fn pixel_corners(canvas: &mut Canvas, count: u32) {
    for _ in 0..count {
        let step = if canvas.rng.chance(0.7) { 1.0 } else { 0.5 };
        let mut corner = || (canvas.point() / step).round() * step;
        let (p, q, r) = (corner(), corner(), corner());
        let slope = if canvas.rng.chance(0.5) { 0.0 } else { 0.5 };
        let plane = canvas.any_plane(slope);
        if canvas.rng.chance(0.6) {
            canvas.add(&[p, DVec2::new(q.x, p.y), q, DVec2::new(p.x, q.y)], plane);
        } else {
            canvas.add(&[p, q, r], plane);
        }
    }
}

/// The same faces two or three times over, on the same planes or on copies of them.
fn duplicates(canvas: &mut Canvas, count: u32) {
    let copies = canvas.rng.integer(2, 3);
    let first = canvas.faces.len();
    if count < LARGE as u32 && canvas.rng.chance(0.5) {
        soup(canvas, count / copies);
    } else {
        meshes(canvas, (count + 200) / copies);
    }
    let originals: Vec<FaceId> = canvas.faces.ids().skip(first).collect();
    for _ in 1..copies {
        for &original in &originals {
            let outline = canvas.faces.outline(original).to_vec();
            let mut plane = canvas.faces.plane(original);
            if canvas.rng.chance(0.5) {
                let nearness = *canvas.faces.nearness(plane);
                plane = canvas.faces.push_plane(nearness);
            }
            let source = canvas.faces.len() as u32;
            canvas.faces.push(&outline, plane, ObjectId(0), source);
        }
    }
}

/// One plane tessellated in several ways, with other faces in between.
fn coplanar(canvas: &mut Canvas, count: u32) {
    let tessellations = canvas.rng.integer(2, 4);
    let plane = canvas.any_plane(0.5);
    let centre = 0.5 * canvas.size();
    for _ in 0..tessellations {
        let cells = (f64::from(count) / f64::from(2 * tessellations))
            .sqrt()
            .ceil() as u32;
        let points = canvas.grid(cells, cells, 0.3);
        let turn = if canvas.rng.chance(0.3) {
            DVec2::X
        } else {
            0.7 * canvas.direction()
        };
        let points: Vec<DVec2> = points
            .iter()
            .map(|&point| centre + turn.rotate(point - centre))
            .collect();
        for [a, b, c, d] in cells_of(cells, cells) {
            let [a, b, c, d] = [a, b, c, d].map(|index| points[index]);
            canvas.add(&[a, b, d], plane);
            canvas.add(&[a, d, c], plane);
        }
    }
    soup(canvas, count.min(40) / 8);
}

/// Large faces whose planes differ by slopes of 1e-7 to 1e-2, so that they cross at grazing angles.
fn grazing(canvas: &mut Canvas, count: u32) {
    let [a, b] = [0, 0].map(|_| canvas.rng.within(-0.3, 0.3));
    for _ in 0..count.min(30) {
        let slope = canvas.rng.magnitude(1e-7, 1e-2);
        let direction = canvas.direction() * slope;
        let through = canvas.point() / canvas.size();
        let tilted = Affine::new(
            a + direction.x,
            b + direction.y,
            0.5 - direction.dot(through),
        );
        let plane = canvas.faces.push_plane(tilted);
        let centre = canvas.point();
        let radius = canvas.rng.within(0.2, 0.7) * canvas.height;
        regular_polygon(canvas, centre, radius, 4, plane);
    }
}

fn regular_polygon(canvas: &mut Canvas, centre: DVec2, radius: f64, sides: u32, plane: PlaneId) {
    let turn = canvas.rng.unit();
    let outline: Vec<DVec2> = (0..sides)
        .map(|k| {
            centre + radius * DVec2::from_angle(TAU * (f64::from(k) + turn) / f64::from(sides))
        })
        .collect();
    canvas.add(&outline, plane);
}

/// Balls that pierce one another.
fn piercing(canvas: &mut Canvas, count: u32) {
    let balls = canvas.rng.integer(2, 3);
    let rings = (f64::from(count) / f64::from(2 * balls)).sqrt().ceil() as u32;
    let rings = if count > 1_000 {
        rings + 2
    } else {
        rings.max(3)
    };
    // Mostly inside the frame, so that there are as many faces as asked for.
    let size = canvas.width.min(canvas.height);
    for _ in 0..balls {
        let offset = DVec2::new(
            canvas.rng.within(-0.15, 0.15),
            canvas.rng.within(-0.15, 0.15),
        );
        let centre = canvas.size() * 0.5 + offset * size;
        let radius = canvas.rng.within(0.2, 0.35) * size;
        let depth = canvas.rng.within(0.45, 0.55);
        canvas.ball(centre.extend(depth), radius, rings);
    }
}

/// Wires 0.05 pixels wide: a mesh of them, axis-parallel or at 5 degrees, and some across.
fn wires(canvas: &mut Canvas, count: u32) {
    let angle = if canvas.rng.chance(0.5) {
        0.0
    } else {
        5f64.to_radians()
    };
    let turn = DVec2::from_angle(angle);
    let centre = 0.5 * canvas.size();
    let half = 0.45 * canvas.height;
    let mesh = count.min(40) / 4;
    for along in [turn, turn.perp()] {
        for wire in 0..mesh {
            let offset = half * (2.0 * (f64::from(wire) + 0.5) / f64::from(mesh) - 1.0);
            let middle = centre + along.perp() * offset;
            let plane = canvas.any_plane(0.3);
            canvas.strip(middle - along * half, middle + along * half, 0.05, plane);
        }
    }
    wires_of_length(canvas, count.min(100) / 2, 0.8);
}

fn short_wires(canvas: &mut Canvas, count: u32) {
    wires_of_length(canvas, count, 0.05);
}

fn wires_of_length(canvas: &mut Canvas, count: u32, length: f64) {
    for _ in 0..count {
        let from = canvas.point();
        let to = from + canvas.direction() * (canvas.rng.unit() * length * canvas.height);
        let plane = canvas.any_plane(0.3);
        canvas.strip(from, to, 0.05, plane);
    }
}

/// Many small leaves, triangles and quadrangles, with gaps.
fn foliage(canvas: &mut Canvas, count: u32) {
    for _ in 0..count {
        let centre = canvas.point();
        let size =
            canvas.rng.within(0.4, 1.2) * (canvas.width * canvas.height / f64::from(count)).sqrt();
        let depth = canvas.rng.within(0.2, 0.8);
        if canvas.rng.chance(0.5) {
            let plane = canvas.any_plane(0.5);
            regular_polygon(canvas, centre, size, 4, plane);
        } else {
            let corners = [0; 3].map(|_| {
                let offset = DVec2::new(
                    canvas.rng.within(-size, size),
                    canvas.rng.within(-size, size),
                );
                (centre + offset).extend(depth + canvas.rng.within(-0.02, 0.02))
            });
            canvas.triangle(corners);
        }
    }
}

/// Convex faces of many sides.
fn polygons(canvas: &mut Canvas, count: u32) {
    for _ in 0..count.min(60) {
        let centre = canvas.point();
        let radius = canvas.rng.within(0.05, 0.5) * canvas.height;
        let sides = canvas.rng.integer(3, 9);
        let plane = canvas.any_plane(1.0);
        regular_polygon(canvas, centre, radius, sides, plane);
    }
}

/// Edges that are vertical, or nearly: off by a few of the last bits, or by 1e-12 to 1e-6 pixels.
fn near_vertical(canvas: &mut Canvas, count: u32) {
    for _ in 0..count.min(60) {
        let p = canvas.point();
        let q = canvas.point();
        let mut lean = || match canvas.rng.integer(0, 2) {
            0 => 0.0,
            1 => f64::from(canvas.rng.integer(0, 4)) * 4e-15,
            _ => canvas.rng.magnitude(1e-12, 1e-6),
        };
        let outline = [
            p,
            DVec2::new(q.x, p.y),
            DVec2::new(q.x + lean(), q.y),
            DVec2::new(p.x + lean(), q.y),
        ];
        let plane = canvas.any_plane(0.5);
        canvas.add(&outline, plane);
    }
}

/// A little of several kinds.
fn mixture(canvas: &mut Canvas, count: u32) {
    for _ in 0..4 {
        // All kinds but this one.
        let kind = canvas.rng.integer(0, KINDS.len() as u32 - 2);
        KINDS[kind as usize].1(canvas, count / 4 + 1);
    }
}

/// Cuts a convex outline off at the sides of the frame. Where an edge meets the frame is computed
/// from its smaller end, so that neighbours meet there too.
fn clipped_to_frame(mut outline: Vec<DVec2>) -> Vec<DVec2> {
    for (axis, bound, inwards) in [(0, 0.0, 1.0), (0, 1.0, -1.0), (1, 0.0, 1.0), (1, 1.0, -1.0)] {
        let is_inside = |point: DVec2| (point[axis] - bound) * inwards >= 0.0;
        let mut clipped = Vec::with_capacity(outline.len() + 1);
        for (index, &end) in outline.iter().enumerate() {
            let start = outline[(index + outline.len() - 1) % outline.len()];
            if is_inside(start) != is_inside(end) {
                let (p, q) = if (start.x, start.y) < (end.x, end.y) {
                    (start, end)
                } else {
                    (end, start)
                };
                let along = (bound - p[axis]) / (q[axis] - p[axis]);
                let mut crossing = p + (q - p) * along;
                crossing[axis] = bound;
                clipped.push(crossing);
            }
            if is_inside(end) {
                clipped.push(end);
            }
        }
        outline = clipped;
    }
    outline
}
