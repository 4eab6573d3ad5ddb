//! The example scene of our own: a suspension bridge over a river between a town and its suburb.
//!
//! Our own making; it may be used for anything. It is made to be hard to antialias and pleasant to
//! look at: hangers, rails and rigging that are thinner than a pixel, roofs that pierce walls, water
//! that pierces the banks.

use veduta::map::MaterialId;
use veduta::scene::{Material, Mesh, MeshId, Object, Scene};
use veduta_geometry::{DMat4, DVec3};
use veduta_io::tone::linear_from_srgb;

// The bridge runs along X over a river along Y. Metres, Z up, water at z = 0.
/// Half of the model's extent.
const HALF_X: f64 = 420.0;
const HALF_Y: f64 = 270.0;
/// Of the terrain's grid.
const CELL: f64 = 12.0;
const UNDERSIDE_Z: f64 = -36.0;
/// Of a tower's axis from the middle.
const TOWER_X: f64 = 150.0;
const TOWER_TOP: f64 = 128.0;
/// Where the cables enter the anchorages.
const ANCHOR_X: f64 = 290.0;
const DECK_Z: f64 = 34.0;
const DECK_HALF_WIDTH: f64 = 8.0;
/// Of the cables and legs from the bridge's axis.
const CABLE_Y: f64 = 9.0;
const HANGER_DISTANCE: f64 = 7.5;
const HANGER_WIDTH: f64 = 0.22;

/// Names and sRGB colours.
const MATERIALS: &[(&str, u32)] = &[
    ("water", 0x3f7890),
    ("water_side", 0x2c5f7d),
    ("earth", 0x7d6552),
    ("sand", 0xcfbd8e),
    ("meadow", 0x8f9a5e),
    ("grass", 0x728a4c),
    ("wood", 0x5a7543),
    ("rock", 0x9a938a),
    ("leaves_light", 0x557a42),
    ("leaves_dark", 0x3f6339),
    ("wall_cream", 0xeadfc8),
    ("wall_ochre", 0xd9b67c),
    ("wall_rose", 0xd9a590),
    ("wall_white", 0xeeeae2),
    ("roof_red", 0xb4573b),
    ("roof_brown", 0x8f4b38),
    ("roof_slate", 0x5d6670),
    ("steel", 0xb8412f),
    ("steel_dark", 0x7d2f26),
    ("stone", 0xc4bcae),
    ("road", 0x6c6a6c),
    ("wire", 0x54383a),
    ("lamp", 0x4a4d52),
    ("sail", 0xf4f0e4),
    ("hull", 0x7a3f2c),
];

/// The scene.
pub fn scene() -> Scene {
    let mut model = Model::new();
    terrain(&mut model);
    water(&mut model);
    deck(&mut model);
    for side in [-1.0, 1.0] {
        tower(&mut model, side * TOWER_X);
    }
    cables_and_hangers(&mut model);
    town(&mut model);
    for (number, (x, y, heading)) in [
        (-30.0, -170.0, -2.4),
        (75.0, -80.0, -2.1),
        (40.0, 170.0, 2.2),
    ]
    .into_iter()
    .enumerate()
    {
        model.object(&format!("boat {}", number + 1));
        boat(&mut model, DVec3::new(x, y, 0.0), heading);
    }
    model.finish()
}

/// The scene as it grows, object by object.
struct Model {
    scene: Scene,
    mesh: Mesh,
    name: String,
}

impl Model {
    fn new() -> Self {
        let materials = MATERIALS.iter().map(|&(name, hex)| {
            let [r, g, b] = [16, 8, 0].map(|shift| {
                let light = linear_from_srgb(((hex >> shift) & 255) as f32 / 255.0);
                // Four digits are enough, and read well.
                (light * 10_000.0).round() / 10_000.0
            });
            Material {
                name: name.to_owned(),
                base_color: [r, g, b, 1.0],
                ..Material::default()
            }
        });
        Self {
            scene: Scene {
                materials: materials.collect(),
                ..Scene::default()
            },
            mesh: Mesh::default(),
            name: String::new(),
        }
    }

    /// Begins an object.
    fn object(&mut self, name: &str) {
        self.end_object();
        self.name = name.to_owned();
    }

    fn end_object(&mut self) {
        let mesh = std::mem::take(&mut self.mesh);
        if mesh.triangles.is_empty() {
            return;
        }
        self.scene.objects.push(Object {
            name: std::mem::take(&mut self.name),
            mesh: MeshId(self.scene.meshes.len() as u32),
            world_from_object: DMat4::IDENTITY,
        });
        self.scene.meshes.push(mesh);
    }

    fn finish(mut self) -> Scene {
        self.end_object();
        self.scene
    }

    /// Adds a vertex. Millimetres are enough, and keep files small.
    fn vertex(&mut self, point: DVec3) -> u32 {
        // Adding 0 leaves no "-0".
        let rounded = (point * 1000.0).round() / 1000.0 + DVec3::ZERO;
        self.mesh.positions.push(rounded);
        self.mesh.positions.len() as u32 - 1
    }

    /// A face over vertices that exist already, counterclockwise seen from its front.
    fn face(&mut self, material: &'static str, corners: &[u32]) {
        let row = MATERIALS.iter().position(|(name, _)| *name == material);
        let id = MaterialId::from_index(row.expect("a name of the list"));
        let materials = &mut self.mesh.materials;
        if materials.last().is_none_or(|&(_, last)| last != id) {
            let face = self.mesh.face_count() as u32;
            self.mesh.materials.push((face, id));
        }
        self.mesh.push_polygon(corners);
    }

    /// A planar polygon with vertices of its own.
    fn polygon(&mut self, material: &'static str, corners: &[DVec3]) {
        let corners: Vec<u32> = corners.iter().map(|&corner| self.vertex(corner)).collect();
        self.face(material, &corners);
    }

    /// A prism without floor over a convex base in the plane z = `bottom`, counterclockwise seen
    /// from above.
    fn prism(&mut self, base: &[[f64; 2]], bottom: f64, top: f64, wall: &'static str) {
        let mut ring = |z| -> Vec<u32> {
            base.iter()
                .map(|&[x, y]| self.vertex(DVec3::new(x, y, z)))
                .collect()
        };
        let (lower, upper) = (ring(bottom), ring(top));
        for k in 0..base.len() {
            let next = (k + 1) % base.len();
            self.face(wall, &[lower[k], lower[next], upper[next], upper[k]]);
        }
        self.face(wall, &upper);
    }

    /// A box with a floor.
    fn block(&mut self, min: DVec3, max: DVec3, material: &'static str) {
        let base = [
            [min.x, min.y],
            [max.x, min.y],
            [max.x, max.y],
            [min.x, max.y],
        ];
        self.prism(&base, min.z, max.z, material);
        let floor: Vec<DVec3> = base
            .iter()
            .rev()
            .map(|&[x, y]| DVec3::new(x, y, min.z))
            .collect();
        self.polygon(material, &floor);
    }

    /// A square rod, `width` thick, without caps.
    fn rod(&mut self, from: DVec3, to: DVec3, width: f64, material: &'static str) {
        let along = (to - from).normalize();
        let upright = along.z.abs() > 0.9;
        let side = along.cross(if upright { DVec3::X } else { DVec3::Z });
        let side = side.normalize();
        let up = side.cross(along);
        let around = [side + up, up - side, -side - up, side - up].map(|d| 0.5 * width * d);
        let mut ring = |end| around.map(|offset| self.vertex(end + offset));
        let (here, there) = (ring(from), ring(to));
        for k in 0..4 {
            let next = (k + 1) % 4;
            self.face(material, &[here[next], here[k], there[k], there[next]]);
        }
    }
}

/// 0 up to `from`, 1 from `to` on, smooth between.
fn smoothstep(from: f64, to: f64, value: f64) -> f64 {
    let t = ((value - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Height of the ground, below 0 in the river.
fn ground(x: f64, y: f64) -> f64 {
    let axis = 22.0 * (y / 120.0).sin();
    let half_width = 168.0 + 9.0 * (y / 47.0 + 1.0).sin();
    let inland = (x - axis).abs() - half_width;
    if inland < 0.0 {
        return (0.4 * inland).max(-26.0);
    }
    let rolling = (x / 53.0 + y / 71.0).sin() + (x / 37.0 - y / 43.0 + 2.0).cos();
    let hill = if x < 0.0 {
        // The town climbs a hill, highest behind it.
        118.0 * smoothstep(30.0, 300.0, inland + 0.28 * y)
    } else {
        18.0 * smoothstep(20.0, 160.0, inland) + 62.0 * smoothstep(80.0, 330.0, inland * 0.5 + y)
    };
    let natural = 0.45 * inland.min(14.0) + hill + 2.6 * rolling * smoothstep(10.0, 90.0, inland);
    // Levelled where the road comes ashore.
    let road = (-(y / 36.0).powi(2)).exp() * smoothstep(ANCHOR_X - 42.0, ANCHOR_X - 6.0, x.abs());
    natural + (DECK_Z - 1.4 - natural) * road
}

/// The land and its cut sides, down to a level underside.
fn terrain(model: &mut Model) {
    let (columns, rows) = (
        (2.0 * HALF_X / CELL) as usize,
        (2.0 * HALF_Y / CELL) as usize,
    );
    let at = |column: usize, row: usize| {
        let x = -HALF_X + CELL * column as f64;
        let y = -HALF_Y + CELL * row as f64;
        DVec3::new(x, y, ground(x, y))
    };
    model.object("land");
    let mut first = Vec::with_capacity(rows + 1);
    for row in 0..=rows {
        first.push(model.mesh.positions.len());
        for column in 0..=columns {
            model.vertex(at(column, row));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let corner = |i: usize, j: usize| {
                (
                    at(column + i, row + j),
                    (first[row + j] + column + i) as u32,
                )
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            for face in [[a, b, c], [a, c, d]] {
                let [p, q, r] = face.map(|(point, _)| point);
                let normal = (q - p).cross(r - p).normalize();
                let middle = (p + q + r) / 3.0;
                model.face(cover(middle, normal), &face.map(|(_, vertex)| vertex));
            }
        }
    }

    model.object("cut sides");
    let border = (0..columns)
        .map(|k| [at(k, 0), at(k + 1, 0)])
        .chain((0..rows).map(|k| [at(columns, k), at(columns, k + 1)]))
        .chain((0..columns).rev().map(|k| [at(k + 1, rows), at(k, rows)]))
        .chain((0..rows).rev().map(|k| [at(0, k + 1), at(0, k)]));
    for [from, to] in border {
        let down = |point: DVec3| DVec3::new(point.x, point.y, UNDERSIDE_Z);
        model.polygon("earth", &[down(from), down(to), to, from]);
        // The river's water, cut as well.
        let level = |point: DVec3| DVec3::new(point.x, point.y, 0.0);
        let shore = || level(from + (to - from) * (from.z / (from.z - to.z)));
        match (from.z < 0.0, to.z < 0.0) {
            (true, true) => model.polygon("water_side", &[from, to, level(to), level(from)]),
            (true, false) => model.polygon("water_side", &[from, shore(), level(from)]),
            (false, true) => model.polygon("water_side", &[shore(), to, level(to)]),
            (false, false) => {}
        }
    }
}

/// What grows on the ground at `point`.
fn cover(point: DVec3, normal: DVec3) -> &'static str {
    let patches = (point.x / 41.0).sin() * (point.y / 33.0).cos() + (point.x + point.y) / 900.0;
    match () {
        () if point.z < 3.2 => "sand",
        () if normal.z < 0.78 => "rock",
        () if patches > 0.35 => "meadow",
        () if patches > -0.25 => "grass",
        () => "wood",
    }
}

/// Water with low waves that runs into the banks.
fn water(model: &mut Model) {
    model.object("river");
    const STEP: f64 = 15.0;
    const COLUMNS: usize = 28;
    let rows = (2.0 * HALF_Y / STEP) as usize;
    let first = model.mesh.positions.len();
    for row in 0..=rows {
        for column in 0..=COLUMNS {
            let x = STEP * (column as f64 - 0.5 * COLUMNS as f64);
            let y = -HALF_Y + STEP * row as f64;
            let waves = (x / 19.0 + y / 31.0).sin() + (x / 27.0 - y / 13.0).cos();
            // Level where the model is cut.
            let calm = smoothstep(0.0, 30.0, HALF_Y - y.abs());
            model.vertex(DVec3::new(x, y, 0.3 * waves * calm));
        }
    }
    for row in 0..rows {
        for column in 0..COLUMNS {
            let corner = first + row * (COLUMNS + 1) + column;
            let [a, b, c, d] = [0, 1, COLUMNS + 2, COLUMNS + 1].map(|k| (corner + k) as u32);
            model.face("water", &[a, b, c]);
            model.face("water", &[a, c, d]);
        }
    }
}

/// The roadway, from one end of the model to the other, with rails and lamps.
fn deck(model: &mut Model) {
    model.object("deck");
    let half = DECK_HALF_WIDTH;
    model.block(
        DVec3::new(-HALF_X, -half, DECK_Z - 3.0),
        DVec3::new(HALF_X, half, DECK_Z - 0.3),
        "steel_dark",
    );
    model.block(
        DVec3::new(-HALF_X, -half + 0.8, DECK_Z - 0.3),
        DVec3::new(HALF_X, half - 0.8, DECK_Z),
        "road",
    );
    for y in [-half + 0.4, half - 0.4] {
        for z in [DECK_Z + 0.6, DECK_Z + 1.2] {
            let ends = [-HALF_X, HALF_X].map(|x| DVec3::new(x, y, z));
            model.rod(ends[0], ends[1], 0.12, "wire");
        }
    }
    for lamp in -10..=10 {
        let x = 37.5 * f64::from(lamp) + 11.0;
        for y in [-half + 0.8, half - 0.8] {
            let (foot, top) = (DVec3::new(x, y, DECK_Z), DVec3::new(x, y, DECK_Z + 8.0));
            model.rod(foot, top, 0.3, "lamp");
            let arm = DVec3::new(x, y * 0.7, DECK_Z + 8.4);
            model.rod(top, arm, 0.25, "lamp");
        }
    }
    model.object("anchorages");
    for side in [-1.0, 1.0] {
        let ends = [side * (ANCHOR_X - 5.0), side * (ANCHOR_X + 18.0)];
        for y in [-CABLE_Y - 3.0, CABLE_Y - 1.0] {
            model.block(
                DVec3::new(ends[0].min(ends[1]), y, 0.0),
                DVec3::new(ends[0].max(ends[1]), y + 4.0, DECK_Z + 4.0),
                "stone",
            );
        }
    }
}

/// Two legs that grow thinner in steps, braced, on a pier.
fn tower(model: &mut Model, x: f64) {
    model.object(if x < 0.0 { "west tower" } else { "east tower" });
    let mut upright = |y: f64, half: [f64; 2], bottom: f64, top: f64, material| {
        model.block(
            DVec3::new(x - half[0], y - half[1], bottom),
            DVec3::new(x + half[0], y + half[1], top),
            material,
        );
    };
    upright(0.0, [9.0, 18.0], -26.0, 7.0, "stone");
    for y in [-CABLE_Y - 1.5, CABLE_Y + 1.5] {
        let steps = [7.0, DECK_Z - 3.0, 66.0, 98.0, TOWER_TOP + 2.0];
        for (step, ends) in steps.windows(2).enumerate() {
            let half = 3.6 - 0.5 * step as f64;
            upright(y, [half, 0.75 * half], ends[0], ends[1], "steel");
        }
    }
    for (bottom, top) in [(26.0, 31.0), (62.0, 67.0), (94.0, 99.0), (121.0, 126.0)] {
        upright(0.0, [1.6, CABLE_Y + 0.5], bottom, top, "steel");
    }
}

/// Height of the cables' axis: parabolas between the towers and from there to the anchorages.
fn cable_height(x: f64) -> f64 {
    let x = x.abs();
    if x <= TOWER_X {
        let lowest = DECK_Z + 5.0;
        lowest + (TOWER_TOP - lowest) * (x / TOWER_X).powi(2)
    } else {
        let share = (x - TOWER_X) / (ANCHOR_X - TOWER_X);
        TOWER_TOP + (DECK_Z + 3.0 - TOWER_TOP) * share - 24.0 * share * (1.0 - share)
    }
}

fn cables_and_hangers(model: &mut Model) {
    let pieces = (ANCHOR_X / HANGER_DISTANCE) as i32;
    let x_of = |piece: i32| ANCHOR_X * f64::from(piece) / f64::from(pieces);
    for (name, y) in [("south cable", -CABLE_Y), ("north cable", CABLE_Y)] {
        model.object(name);
        let at = |piece| DVec3::new(x_of(piece), y, cable_height(x_of(piece)));
        for piece in -pieces..pieces {
            model.rod(at(piece), at(piece + 1), 0.9, "steel");
        }
        for piece in -pieces + 1..pieces {
            let top = at(piece);
            if top.z > DECK_Z + 1.0 && (top.x.abs() - TOWER_X).abs() > 3.0 {
                let foot = DVec3::new(top.x, y, DECK_Z - 2.0);
                model.rod(foot, top, HANGER_WIDTH, "wire");
            }
        }
    }
}

/// The same numbers on every run: SplitMix64 (Steele, Lea and Flood, 2014).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.unit() * choices.len() as f64) as usize]
    }
}

/// Houses in the town and its suburb, trees between them, and a church above.
fn town(model: &mut Model) {
    let mut random = Random(1991);
    let church = DVec3::new(-262.0, 88.0, ground(-262.0, 88.0));
    let mut taken: Vec<(DVec3, f64)> = vec![(church, 30.0)];
    let mut claim = |random: &mut Random, radius: f64, houses: bool| {
        let x = random.between(-HALF_X + 10.0, HALF_X - 10.0);
        let y = random.between(-HALF_Y + 10.0, HALF_Y - 10.0);
        let point = DVec3::new(x, y, ground(x, y));
        let inland = x.abs() - 190.0;
        let crowded = if x < 0.0 { 0.95 } else { 0.55 };
        let wanted = if houses {
            random.unit() < crowded * (1.0 - smoothstep(40.0, 190.0, inland + 0.15 * y.abs()))
        } else {
            random.unit() < 0.25 + 0.75 * smoothstep(40.0, 160.0, inland)
        };
        let free = point.z > 4.0
            && y.abs() > radius + 15.0
            && taken
                .iter()
                .all(|&(other, room)| (other - point).truncate().length() > room + radius);
        (wanted && free).then(|| {
            taken.push((point, radius));
            point
        })
    };

    model.object("houses");
    for _ in 0..9000 {
        if let Some(place) = claim(&mut random, 9.5, true) {
            house(model, &mut random, place);
        }
    }
    model.object("church");
    gabled(
        model,
        church,
        0.25,
        [22.0, 10.0],
        [17.0, 28.0],
        "wall_white",
        "roof_slate",
    );
    let belfry = church + 25.0 * DVec3::new(0.25_f64.cos(), 0.25_f64.sin(), 0.0);
    let base = around(belfry, 0.25, [6.0, 6.0]);
    model.prism(&base, church.z - 12.0, church.z + 42.0, "wall_white");
    spire(
        model,
        &around(belfry, 0.25, [7.0, 7.0]),
        church.z + 42.0,
        DVec3::new(belfry.x, belfry.y, church.z + 82.0),
        "roof_slate",
    );

    model.object("trees");
    for _ in 0..2600 {
        if let Some(place) = claim(&mut random, 4.0, false) {
            tree(model, &mut random, place);
        }
    }
}

/// A rectangle about `center` with its half sides, turned by `heading`, counterclockwise.
fn around(center: DVec3, heading: f64, half: [f64; 2]) -> [[f64; 2]; 4] {
    let (sin, cos) = heading.sin_cos();
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[along, across]| {
        let (u, v) = (along * half[0], across * half[1]);
        [center.x + u * cos - v * sin, center.y + u * sin + v * cos]
    })
}

fn house(model: &mut Model, random: &mut Random, place: DVec3) {
    let half = [random.between(5.0, 7.5), random.between(3.6, 5.0)];
    let eaves = random.between(6.0, 12.0);
    // Along the river or across it, as streets would have it.
    let heading = random.of(&[0.0, 0.5 * std::f64::consts::PI]) + random.between(-0.12, 0.12);
    let wall = random.of(&[
        "wall_cream",
        "wall_ochre",
        "wall_rose",
        "wall_white",
        "wall_cream",
    ]);
    let roof = random.of(&["roof_red", "roof_red", "roof_brown", "roof_slate"]);
    gabled(
        model,
        place,
        heading,
        half,
        [eaves, eaves + 0.9 * half[1]],
        wall,
        roof,
    );
}

/// A house with a ridge along its first side. The roof reaches beyond the walls and pierces them.
fn gabled(
    model: &mut Model,
    place: DVec3,
    heading: f64,
    half: [f64; 2],
    [eaves, ridge]: [f64; 2],
    wall: &'static str,
    roof: &'static str,
) {
    let at = |[x, y]: [f64; 2], z: f64| DVec3::new(x, y, place.z + z);
    let [a, b, c, d] = around(place, heading, half);
    let middle = |[px, py]: [f64; 2], [qx, qy]: [f64; 2]| [0.5 * (px + qx), 0.5 * (py + qy)];
    // Down into the slope that it stands on.
    const FOOT: f64 = -12.0;
    for [from, to] in [[a, b], [c, d]] {
        model.polygon(
            wall,
            &[at(from, FOOT), at(to, FOOT), at(to, eaves), at(from, eaves)],
        );
    }
    for [from, to] in [[b, c], [d, a]] {
        let top = at(middle(from, to), ridge);
        model.polygon(
            wall,
            &[
                at(from, FOOT),
                at(to, FOOT),
                at(to, eaves),
                top,
                at(from, eaves),
            ],
        );
    }
    let slope = (ridge - eaves) / half[1];
    let beyond = 0.8;
    let [e, f, g, h] = around(place, heading, [half[0] + beyond, half[1] + beyond]);
    let (low, high) = (eaves - slope * beyond + 0.3, ridge + 0.3);
    let ends = [middle(h, e), middle(f, g)];
    model.polygon(
        roof,
        &[at(e, low), at(f, low), at(ends[1], high), at(ends[0], high)],
    );
    model.polygon(
        roof,
        &[at(g, low), at(h, low), at(ends[0], high), at(ends[1], high)],
    );
}

/// A pyramid.
fn spire(model: &mut Model, base: &[[f64; 2]], bottom: f64, top: DVec3, material: &'static str) {
    let tip = model.vertex(top);
    let ring: Vec<u32> = base
        .iter()
        .map(|&[x, y]| model.vertex(DVec3::new(x, y, bottom)))
        .collect();
    for k in 0..ring.len() {
        model.face(material, &[ring[k], ring[(k + 1) % ring.len()], tip]);
    }
}

fn tree(model: &mut Model, random: &mut Random, place: DVec3) {
    let (radius, height) = (random.between(2.6, 4.4), random.between(9.0, 17.0));
    let turn = random.between(0.0, 1.0);
    let base: Vec<[f64; 2]> = (0..6)
        .map(|k| {
            let angle = (f64::from(k) + turn) * std::f64::consts::TAU / 6.0;
            [
                place.x + radius * angle.cos(),
                place.y + radius * angle.sin(),
            ]
        })
        .collect();
    let leaves = random.of(&["leaves_light", "leaves_dark"]);
    let tip = DVec3::new(place.x, place.y, place.z + height);
    spire(model, &base, place.z - 1.0, tip, leaves);
}

/// A two-masted boat with its rigging.
fn boat(model: &mut Model, place: DVec3, heading: f64) {
    let (sin, cos) = heading.sin_cos();
    let at = |along: f64, across: f64, z: f64| {
        place + DVec3::new(along * cos - across * sin, along * sin + across * cos, z)
    };
    let outline = [
        (-16.0, -3.4),
        (6.0, -3.8),
        (20.0, 0.0),
        (6.0, 3.8),
        (-16.0, 3.4),
    ];
    let base = outline.map(|(along, across)| {
        let point = at(along, across, 0.0);
        [point.x, point.y]
    });
    model.prism(&base, -2.0, 3.0, "hull");
    for (mast, top) in [(-6.0, 27.0), (6.0, 32.0)] {
        model.rod(at(mast, 0.0, 3.0), at(mast, 0.0, top), 0.5, "hull");
        model.polygon(
            "sail",
            &[
                at(mast - 0.6, 0.0, 5.0),
                at(mast - 10.0, 1.8, 5.5),
                at(mast - 0.6, 0.0, top - 2.0),
            ],
        );
        for side in [-3.4, 3.4] {
            for spread in [-2.0, 0.0, 2.0] {
                model.rod(
                    at(mast + spread, side, 3.0),
                    at(mast, 0.0, top - 3.0),
                    0.12,
                    "wire",
                );
            }
        }
    }
    model.polygon(
        "sail",
        &[at(19.0, 0.0, 4.5), at(7.5, 1.5, 5.5), at(6.2, 0.0, 29.0)],
    );
    model.rod(at(20.0, 0.0, 3.0), at(6.0, 0.0, 32.0), 0.12, "wire");
}
