//! Writes the hot-air balloon of the example scene:
//! `cargo run --release -p veduta-io --example write_example_balloon -- examples`
//!
//! The folder gets `balloon.obj` and `balloon.mtl`, byte for byte those of the repository. The model
//! is our own making and may be used for anything. Y is up, as is the habit of OBJ; the basket's
//! floor stands on the origin.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::Path;
use veduta_geometry::DVec3;

const GORES: usize = 16;
const RINGS: usize = 12;
/// The envelope, in metres: its largest radius, and where its middle and its mouth are.
const RADIUS: f64 = 9.0;
const MIDDLE: f64 = 17.0;
const MOUTH: f64 = 6.0;
/// Radius of the mouth, as a share of the largest.
const MOUTH_SHARE: f64 = 0.22;
const BASKET_HALF: f64 = 0.8;
const BASKET_HEIGHT: f64 = 1.3;
/// Half the width of a rope: far less than a pixel in most pictures.
const ROPE_HALF: f64 = 0.02;

const MATERIALS: &[(&str, [f64; 3])] = &[
    ("gore_odd", [0.62, 0.09, 0.05]),
    ("gore_even", [0.86, 0.78, 0.58]),
    ("rope", [0.10, 0.08, 0.06]),
    ("wicker", [0.25, 0.13, 0.05]),
];

#[derive(Default)]
struct Model {
    vertices: String,
    count: usize,
    faces: String,
}

impl Model {
    fn vertex(&mut self, point: DVec3) -> usize {
        // Whole millimetres, and no minus before a zero.
        let [x, y, z] = point
            .to_array()
            .map(|value| (value * 1e3).round() / 1e3 + 0.0);
        let _ = writeln!(self.vertices, "v {x} {y} {z}");
        self.count += 1;
        self.count
    }

    fn face(&mut self, corners: &[usize]) {
        let corners: Vec<_> = corners.iter().map(usize::to_string).collect();
        let _ = writeln!(self.faces, "f {}", corners.join(" "));
    }

    fn material(&mut self, name: &str) {
        let _ = writeln!(self.faces, "usemtl {name}");
    }

    fn object(&mut self, name: &str) {
        let _ = writeln!(self.faces, "o {name}");
    }

    /// A box around `middle` with these half-sizes.
    fn cuboid(&mut self, middle: DVec3, half: DVec3) {
        let corners: Vec<usize> = (0..8)
            .map(|corner| {
                let side = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
                self.vertex(middle + half * DVec3::new(side(0), side(1), side(2)))
            })
            .collect();
        for side in [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ] {
            self.face(&side.map(|corner| corners[corner]));
        }
    }
}

/// Radius and height of the envelope at `share` of the way from the mouth to the top: a ball above,
/// drawn out to a cone below.
fn profile(share: f64) -> (f64, f64) {
    let angle = PI * share;
    let height = MIDDLE - angle.cos() * if share < 0.5 { MIDDLE - MOUTH } else { RADIUS };
    let round = angle.sin();
    let radius = if share < 0.5 {
        round.max(MOUTH_SHARE + (1.0 - MOUTH_SHARE) * 2.0 * share * round)
    } else {
        round
    };
    (RADIUS * radius, height)
}

fn point_at(turn: f64, radius: f64, height: f64) -> DVec3 {
    DVec3::new(radius * turn.cos(), height, radius * turn.sin())
}

fn model() -> Model {
    let mut model = Model::default();
    let rings: Vec<Vec<usize>> = (0..RINGS)
        .map(|ring| {
            let (radius, height) = profile(ring as f64 / RINGS as f64);
            (0..GORES)
                .map(|gore| {
                    let turn = TAU * gore as f64 / GORES as f64;
                    model.vertex(point_at(turn, radius.max(RADIUS * MOUTH_SHARE), height))
                })
                .collect()
        })
        .collect();
    let top = model.vertex(DVec3::new(0.0, MIDDLE + RADIUS, 0.0));
    model.object("envelope");
    for (kind, name) in ["gore_even", "gore_odd"].into_iter().enumerate() {
        model.material(name);
        for gore in (kind..GORES).step_by(2) {
            let next = (gore + 1) % GORES;
            for pair in rings.windows(2) {
                model.face(&[pair[0][gore], pair[1][gore], pair[1][next], pair[0][next]]);
            }
            let last = &rings[RINGS - 1];
            model.face(&[last[gore], top, last[next]]);
        }
    }
    model.object("ropes");
    model.material("rope");
    for corner in 0..4 {
        let turn = TAU * (f64::from(corner) + 0.5) / 4.0;
        let low = point_at(turn, BASKET_HALF * 2f64.sqrt(), BASKET_HEIGHT);
        let high = point_at(turn, RADIUS * MOUTH_SHARE, MOUTH);
        // Two crossed strips, so that a rope is as wide from everywhere.
        let around = point_at(turn + 0.5 * PI, ROPE_HALF, 0.0);
        let across = (high - low).cross(around).normalize() * ROPE_HALF;
        for half in [around, across] {
            let corners = [low - half, low + half, high + half, high - half];
            let corners = corners.map(|point| model.vertex(point));
            model.face(&corners);
        }
    }
    model.object("basket");
    model.material("wicker");
    let half = DVec3::new(BASKET_HALF, 0.5 * BASKET_HEIGHT, BASKET_HALF);
    model.cuboid(DVec3::Y * half.y, half);
    model
}

fn main() -> Result<(), std::io::Error> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    let folder = Path::new(&folder);
    let maker = "# Made by crates/veduta-io/examples/write_example_balloon.rs.";
    let model = model();
    let text = format!(
        "{maker} Metres, Y up.\nmtllib balloon.mtl\n{}{}",
        model.vertices, model.faces
    );
    std::fs::write(folder.join("balloon.obj"), text)?;
    let mut library = format!("{maker} Kd is linear.\n");
    for (name, [r, g, b]) in MATERIALS {
        let _ = writeln!(library, "newmtl {name}\nKd {r} {g} {b}");
    }
    std::fs::write(folder.join("balloon.mtl"), library)
}
