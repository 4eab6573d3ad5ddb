//! Lines of drawings that no fragment's side tells: of veils, of what is hidden, and how hidden ones keep away from
//! others. Lengths are known beforehand: a metre is 100 pixels.

use veduta::dice::PixelGrid;
use veduta::drawing::{Drawing, LineKind, Settings};
use veduta::geometry::{DMat4, DVec3};
use veduta::map::{Camera, MaterialId, Projection};
use veduta::pipeline::{draw_window, find_visibility};
use veduta::scene::{AlphaMode, Material, Mesh, MeshId, Object, Scene};

/// A flat quadrilateral, in the colour of one of the materials.
struct Sheet {
    corners: [DVec3; 4],
    material: u32,
}

const OPAQUE: u32 = 0;
const GLASS: u32 = 1;
const AIR: u32 = 2;

/// What reaches from `x[0]` to `x[1]` and likewise in height, at depth `y[0]` on the left and `y[1]` on the right.
fn sheet(x: [f64; 2], y: [f64; 2], z: [f64; 2], material: u32) -> Sheet {
    let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
    Sheet {
        corners: corners.map(|(side, end)| DVec3::new(x[side], y[side], z[end])),
        material,
    }
}

/// A square around the middle of the frame.
fn square(half: f64, depth: f64) -> Sheet {
    sheet([-half, half], [depth; 2], [-half, half], OPAQUE)
}

/// Draws sheets as they are seen along +Y, 4 metres in 400 pixels.
fn drawn(sheets: &[Sheet], settings: &Settings) -> Drawing {
    let material = |opacity: f32| Material {
        base_color: [0.5, 0.5, 0.5, opacity],
        alpha_mode: AlphaMode::Blend,
        ..Material::default()
    };
    let mut scene = Scene {
        materials: vec![material(1.0), material(0.5), material(0.0)],
        ..Scene::default()
    };
    for (index, sheet) in sheets.iter().enumerate() {
        scene.meshes.push(Mesh {
            positions: sheet.corners.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![(0, MaterialId(sheet.material))],
            ..Mesh::default()
        });
        scene.objects.push(Object {
            name: index.to_string(),
            mesh: MeshId(index as u32),
            world_from_object: DMat4::IDENTITY,
        });
    }
    let lens = Projection::Parallel {
        height: 4.0,
        aspect: 1.0,
    };
    let eye = DVec3::new(0.0, -5.0, 0.0);
    let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Z, lens, 0.0).expect("sound");
    let map = find_visibility(&scene, &camera);
    draw_window(
        &scene,
        &map,
        &PixelGrid::of_frame(400, 400),
        false,
        settings,
    )
}

fn settings() -> Settings {
    Settings {
        lines: vec![LineKind::Silhouette, LineKind::Crease, LineKind::Hidden],
        shapes: false,
        ..Settings::default()
    }
}

/// The length in pixels of all lines of silhouettes, creases, and what is hidden.
fn lengths(drawing: &Drawing) -> [f64; 3] {
    [LineKind::Silhouette, LineKind::Crease, LineKind::Hidden].map(|kind| {
        let strokes = drawing.strokes.iter().filter(|stroke| stroke.kind == kind);
        let of_stroke = strokes.map(|stroke| {
            let sides = stroke.points.len() - usize::from(!stroke.closed);
            let next = stroke.points.iter().cycle().skip(1);
            let sides = stroke.points.iter().zip(next).take(sides);
            sides.map(|(&p, &q)| (q - p).length()).sum::<f64>()
        });
        of_stroke.sum()
    })
}

fn assert_lengths(what: &str, drawing: &Drawing, expected: [f64; 3]) {
    let found = lengths(drawing);
    let is_near = found
        .iter()
        .zip(expected)
        .all(|(f, e)| (f - e).abs() < 1e-6);
    assert!(is_near, "{what}: {found:?} and not {expected:?}");
}

#[test]
fn a_pane_has_an_outline_and_hides_no_line() {
    // A metre each way, half of it before or behind a square of two metres.
    let pane = |depth: f64, material| sheet([0.5, 1.5], [depth; 2], [-0.5, 0.5], material);
    let box_ = || square(1.0, 0.0);
    let before = drawn(&[box_(), pane(-1.0, GLASS)], &settings());
    assert_lengths("before", &before, [800.0 + 400.0, 0.0, 0.0]);
    assert!(
        before
            .strokes
            .iter()
            .all(|stroke| stroke.closed && stroke.points.len() == 4)
    );
    let behind = drawn(&[box_(), pane(1.0, GLASS)], &settings());
    assert_lengths("behind", &behind, [800.0 + 200.0, 0.0, 200.0]);
    // Another pane hides nothing of it.
    let two = drawn(
        &[
            pane(0.0, GLASS),
            sheet([-1.0, 1.0], [-1.0; 2], [-1.0, 1.0], GLASS),
        ],
        &settings(),
    );
    assert_lengths("two panes", &two, [400.0 + 800.0, 0.0, 0.0]);
    // What is not there has no lines.
    let nothing = drawn(&[box_(), pane(-1.0, AIR)], &settings());
    assert_lengths("nothing", &nothing, [800.0, 0.0, 0.0]);
}

#[test]
fn panes_that_meet_at_an_angle_have_a_crease() {
    // A tent towards the eye, and two that pass through each other: the line in the middle is a metre.
    let meeting = [
        sheet([-0.5, 0.0], [0.0, -0.5], [-0.5, 0.5], GLASS),
        sheet([0.0, 0.5], [-0.5, 0.0], [-0.5, 0.5], GLASS),
    ];
    assert_lengths(
        "meeting",
        &drawn(&meeting, &settings()),
        [400.0, 100.0, 0.0],
    );
    for other in [GLASS, OPAQUE] {
        let piercing = [
            sheet([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5], GLASS),
            sheet([-0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], other),
        ];
        // They have one outline in the picture.
        assert_lengths(
            "piercing",
            &drawn(&piercing, &settings()),
            [400.0, 100.0, 0.0],
        );
    }
    // At a flat angle they have none.
    let flat = [
        sheet([-0.5, 0.5], [-0.05, 0.05], [-0.5, 0.5], GLASS),
        sheet([-0.5, 0.5], [0.05, -0.05], [-0.5, 0.5], GLASS),
    ];
    assert_lengths("flat", &drawn(&flat, &settings()), [400.0, 0.0, 0.0]);
}

#[test]
fn where_hidden_faces_pierce_each_other_there_is_a_hidden_line() {
    let crossed = |half: f64| sheet([-half, half], [-half, half], [-0.5, 0.5], OPAQUE);
    let other = sheet([-0.8, 0.8], [0.8, -0.8], [-0.5, 0.5], OPAQUE);
    let drawing = drawn(&[square(1.0, -2.0), crossed(0.6), other], &settings());
    // Their outlines share the sides above and below.
    let outlines = 2.0 * (160.0 + 100.0) + 2.0 * 100.0;
    assert_lengths("behind", &drawing, [800.0, 0.0, outlines + 100.0]);
    // Half of it behind the wall. What is seen are creases, and outlines: of the one in front.
    let wall = sheet([-1.0, 1.0], [-2.0; 2], [0.0, 1.0], OPAQUE);
    let crossing = [
        sheet([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5], OPAQUE),
        sheet([-0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], OPAQUE),
        wall,
    ];
    let drawing = drawn(&crossing, &settings());
    assert_lengths("half", &drawing, [600.0 + 200.0, 50.0, 200.0 + 50.0]);
}

#[test]
fn hidden_lines_keep_away_from_others() {
    let wall = || square(1.0, -1.0);
    let scene = || {
        [
            wall(),
            // A pixel within the wall's outline, and of these the second a pixel within the first.
            square(0.99, 0.0),
            square(0.5, 0.1),
            square(0.49, 0.2),
            square(0.4, 0.3),
            square(0.005, 0.4),
        ]
    };
    assert_lengths(
        "all",
        &drawn(&scene(), &settings()),
        [800.0, 0.0, 792.0 + 400.0 + 392.0 + 320.0 + 4.0],
    );
    let mut apart = settings();
    apart.hidden_spacing = 2.0;
    apart.shortest_hidden = 6.0;
    assert_lengths(
        "apart",
        &drawn(&scene(), &apart),
        [800.0, 0.0, 400.0 + 320.0],
    );
    apart.hidden_spacing = 0.0;
    assert_lengths(
        "none short",
        &drawn(&scene(), &apart),
        [800.0, 0.0, 792.0 + 400.0 + 392.0 + 320.0],
    );
    // A part that comes too near is left out alone: the upper half of the left and right side.
    let near_above = [
        wall(),
        sheet([-0.5, 0.5], [0.0; 2], [-0.5, 0.5], OPAQUE),
        sheet([-0.49, 0.49], [1.0; 2], [0.0, 1.5], OPAQUE),
    ];
    apart.hidden_spacing = 2.0;
    assert_lengths(
        "in part",
        &drawn(&near_above, &apart),
        [800.0 + 98.0 + 100.0, 0.0, 400.0 + 98.0 + 100.0],
    );
}

#[test]
fn lines_behind_many_faces_are_left_out_if_told() {
    let scene = [square(1.0, -1.0), square(0.9, 0.0), square(0.5, 1.0)];
    for (most_before, hidden) in [(0, 0.0), (1, 720.0), (2, 720.0 + 400.0)] {
        let settings = Settings {
            most_before,
            ..settings()
        };
        let drawing = drawn(&scene, &settings);
        assert_lengths("behind", &drawing, [800.0, 0.0, hidden]);
        // And in one piece, whatever there is before them.
        assert_eq!(drawing.strokes.len(), 1 + most_before);
    }
}
