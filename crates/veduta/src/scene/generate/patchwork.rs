//! Meshes of flat-coloured faces, and the bodies that the scenes are built of.

use crate::scene::{Material, Mesh, MeshId, Object, Scene};
use veduta_geometry::{DMat4, DVec3};
use veduta_map::MaterialId;

/// A linear colour.
pub(super) type Color = [f32; 3];

/// The linear colour of an sRGB hex colour.
pub(super) fn srgb(hex: u32) -> Color {
    [16, 8, 0].map(|shift| {
        let value = ((hex >> shift) & 255) as f32 / 255.0;
        if value <= 0.04045 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    })
}

/// A colour between `from` (at 0) and `to` (at 1).
pub(super) fn mix(from: Color, to: Color, share: f32) -> Color {
    [0, 1, 2].map(|k| from[k] + (to[k] - from[k]) * share)
}

/// A colour of the given hue in turns, from red over green and blue back to red; never garish.
pub(super) fn hue(turns: f64) -> Color {
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|phase| {
        let wave = 0.5 + 0.5 * (std::f64::consts::TAU * (turns - phase)).cos();
        (0.08 + 0.72 * wave * wave) as f32
    })
}

/// `color` on a face with the given normal, under a sun from the front left and a blue sky.
///
/// Baked into the face's colour: generated scenes are unlit, so that they cost visibility alone.
pub(super) fn daylight(color: Color, normal: DVec3) -> Color {
    let sun = DVec3::new(-0.45, -0.6, 0.66).normalize();
    let normal = normal.normalize_or_zero();
    let direct = 0.8 * normal.dot(sun).max(0.0);
    let sky = 0.14 + 0.1 * normal.z;
    let light = [
        direct + sky,
        direct * 0.95 + sky,
        direct * 0.86 + sky * 1.25,
    ];
    [0, 1, 2].map(|k| color[k] * light[k] as f32)
}

/// Whether the inside of a body can be seen.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Sides {
    /// A closed body: faces turned away are never seen.
    Outer,
    /// A sheet.
    Both,
}

/// Faces of one flat colour each, sewn into a mesh.
///
/// Corners are not shared, because the mesh keeps colours by corner; neighbours still meet, since
/// equal corners are bit-equal.
#[derive(Default)]
pub(super) struct Patchwork {
    mesh: Mesh,
}

impl Patchwork {
    /// Nothing yet.
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// A triangle, counterclockwise seen from its front.
    pub(super) fn triangle(&mut self, corners: [DVec3; 3], color: Color) {
        let first = u32::try_from(self.mesh.positions.len()).expect("at most u32::MAX corners");
        self.mesh.positions.extend(corners);
        self.mesh.colors.extend([color; 3]);
        self.mesh.triangles.push([first, first + 1, first + 2]);
    }

    /// A planar quadrilateral as two triangles of one colour.
    pub(super) fn quad(&mut self, [a, b, c, d]: [DVec3; 4], color: Color) {
        self.triangle([a, b, c], color);
        self.triangle([a, c, d], color);
    }

    /// A quadrilateral of `color` in daylight.
    pub(super) fn lit_quad(&mut self, corners: [DVec3; 4], color: Color) {
        let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]);
        self.quad(corners, daylight(color, normal));
    }

    /// A triangle of `color` in daylight.
    pub(super) fn lit_triangle(&mut self, corners: [DVec3; 3], color: Color) {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        self.triangle(corners, daylight(color, normal));
    }

    /// Upright walls over a base polygon, counterclockwise seen from above.
    pub(super) fn walls(&mut self, base: &[[f64; 2]], bottom: f64, top: f64, color: Color) {
        for (k, &[x, y]) in base.iter().enumerate() {
            let [next_x, next_y] = base[(k + 1) % base.len()];
            self.lit_quad(
                [
                    DVec3::new(x, y, bottom),
                    DVec3::new(next_x, next_y, bottom),
                    DVec3::new(next_x, next_y, top),
                    DVec3::new(x, y, top),
                ],
                color,
            );
        }
    }

    /// A level roof over a convex base polygon, counterclockwise seen from above.
    pub(super) fn roof(&mut self, base: &[[f64; 2]], height: f64, color: Color) {
        let at = |[x, y]: [f64; 2]| DVec3::new(x, y, height);
        for k in 1..base.len() - 1 {
            self.lit_triangle([at(base[0]), at(base[k]), at(base[k + 1])], color);
        }
    }

    /// A box without a floor: 10 triangles.
    pub(super) fn house(&mut self, min: DVec3, max: DVec3, wall: Color, roof: Color) {
        let base = rectangle(min.x, min.y, max.x, max.y);
        self.walls(&base, min.z, max.z, wall);
        self.roof(&base, max.z, roof);
    }

    /// A closed box: 12 triangles.
    pub(super) fn block(&mut self, min: DVec3, max: DVec3, color: Color) {
        self.house(min, max, color, color);
        self.lit_quad(
            [
                DVec3::new(min.x, min.y, min.z),
                DVec3::new(min.x, max.y, min.z),
                DVec3::new(max.x, max.y, min.z),
                DVec3::new(max.x, min.y, min.z),
            ],
            color,
        );
    }

    /// A square rod between two points, `width` thick, without caps: 8 triangles.
    pub(super) fn rod(&mut self, from: DVec3, to: DVec3, width: f64, color: Color) {
        let along = to - from;
        let side = along
            .cross(if along.z.abs() > 0.9 * along.length() {
                DVec3::X
            } else {
                DVec3::Z
            })
            .normalize();
        let up = side.cross(along).normalize();
        let around = [side + up, up - side, -side - up, side - up].map(|d| 0.5 * width * d);
        for k in 0..4 {
            // Counterclockwise seen from outside: `around` turns against `along`.
            let (here, next) = (around[k], around[(k + 1) % 4]);
            self.lit_quad([from + next, from + here, to + here, to + next], color);
        }
    }

    /// A ball about `center`, cut by `meridians` and into `bands` between its tilted poles:
    /// `2 * meridians * (bands - 1)` triangles.
    pub(super) fn ball(
        &mut self,
        center: DVec3,
        radius: f64,
        meridians: u32,
        bands: u32,
        mut color: impl FnMut(u32, u32) -> Color,
    ) {
        // Poles turned out of the picture's vertical, so that no row of edges is horizontal in it.
        let (tilt_cos, tilt_sin) = (0.8, 0.6);
        let point = |meridian: u32, band: u32| {
            // The angles of the last meridian are the first's, so that the seam closes bit for bit.
            let longitude = std::f64::consts::TAU * (f64::from(meridian % meridians) + 0.13)
                / f64::from(meridians);
            let polar = std::f64::consts::PI * f64::from(band) / f64::from(bands);
            // At both poles the sine is exactly 0, so that all meridians meet in one point.
            let ring = if band == bands { 0.0 } else { polar.sin() };
            let (x, y, z) = (ring * longitude.cos(), ring * longitude.sin(), polar.cos());
            center
                + radius * DVec3::new(x * tilt_cos - z * tilt_sin, y, x * tilt_sin + z * tilt_cos)
        };
        for band in 0..bands {
            for meridian in 0..meridians {
                let [a, b] = [band, band + 1].map(|band| point(meridian, band));
                let [d, c] = [band, band + 1].map(|band| point(meridian + 1, band));
                let color = color(meridian, band);
                if band > 0 {
                    self.lit_triangle([a, c, d], color);
                }
                if band + 1 < bands {
                    self.lit_triangle([a, b, c], color);
                }
            }
        }
    }

    /// Puts what was sewn into `scene` as an object of its own.
    pub(super) fn place(self, scene: &mut Scene, name: &str, sides: Sides) {
        place(scene, name, self.mesh, sides);
    }
}

/// Adds `mesh` to `scene` as an object with an unlit white material, so that only the mesh's own
/// colours show.
pub(super) fn place(scene: &mut Scene, name: &str, mut mesh: Mesh, sides: Sides) {
    let material = MaterialId::from_index(scene.materials.len());
    scene.materials.push(Material {
        name: name.to_owned(),
        base_color: [1.0; 4],
        double_sided: sides == Sides::Both,
        unlit: true,
        ..Material::default()
    });
    mesh.materials = vec![(0, material)];
    scene.objects.push(Object {
        name: name.to_owned(),
        mesh: MeshId(u32::try_from(scene.meshes.len()).expect("at most u32::MAX meshes")),
        world_from_object: DMat4::IDENTITY,
    });
    scene.meshes.push(mesh);
}

/// The corners of a rectangle, counterclockwise seen from above.
pub(super) fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> [[f64; 2]; 4] {
    [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
}

/// The unit normal of a height field whose slopes along x and y are given.
pub(super) fn normal_of_slopes(along_x: f64, along_y: f64) -> DVec3 {
    DVec3::new(-along_x, -along_y, 1.0).normalize()
}
