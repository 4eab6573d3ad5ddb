//! Drawings: regions have the areas of their fragments, few outlines, and no seams.

#[path = "support/rng.rs"]
mod rng;
#[path = "support/scenes.rs"]
mod scenes;

use rayon::prelude::*;
use std::collections::BTreeMap;
use veduta::dice::PixelGrid;
use veduta::drawing::{Drawing, Evenness, LineKind, Look, Settings, Shape, Stroke, draw};
use veduta::geometry::{DMat4, DVec2, DVec3, signed_area};
use veduta::map::{Camera, FaceId, Faces, Fragments, MaterialId, Projection, VisibilityMap};
use veduta::pipeline::{draw_window, find_visibility};
use veduta::scene::{Material, Mesh, MeshId, Object, Scene, generate};
use veduta::visibility::speculative;

/// A parallel view along +Y of the square from -2 to 2.
fn view_from(eye: DVec3) -> Camera {
    let lens = Projection::Parallel {
        height: 4.0,
        aspect: 1.0,
    };
    Camera::looking(eye, DVec3::ZERO, DVec3::Z, lens, 0.0).expect("a sound camera")
}

fn object(name: &str, mesh: u32) -> Object {
    Object {
        name: name.to_owned(),
        mesh: MeshId(mesh),
        world_from_object: DMat4::IDENTITY,
    }
}

/// A scene of one object for each mesh, all in one material that is not lit.
fn scene_of(meshes: Vec<(&str, Mesh)>) -> Scene {
    let mut scene = Scene {
        materials: vec![Material::default()],
        ..Scene::default()
    };
    for (index, (name, mut mesh)) in meshes.into_iter().enumerate() {
        mesh.materials = vec![(0, MaterialId(0))];
        mesh.check().expect("a sound mesh");
        scene.objects.push(object(name, index as u32));
        scene.meshes.push(mesh);
    }
    scene
}

/// Triangles in the plane y = `depth`; corners are (x, z).
fn upright(depth: f64, corners: &[[f64; 2]], triangles: &[[u32; 3]]) -> Mesh {
    let place = |&[x, z]: &[f64; 2]| DVec3::new(x, depth, z);
    Mesh {
        positions: corners.iter().map(place).collect(),
        triangles: triangles.to_vec(),
        ..Mesh::default()
    }
}

/// The cube from -1 to 1 as 12 triangles.
fn cube() -> Mesh {
    let corner =
        |k: u32| DVec3::from([k & 1, k >> 1 & 1, k >> 2].map(|b| 2.0 * f64::from(b) - 1.0));
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
        ..Mesh::default()
    }
}

fn drawn(scene: &Scene, camera: &Camera, settings: &Settings) -> Drawing {
    let map = find_visibility(scene, camera);
    draw_window(scene, &map, &PixelGrid::of_frame(400, 400), false, settings)
}

fn area(outlines: &[Vec<DVec2>]) -> f64 {
    outlines.iter().map(|outline| signed_area(outline)).sum()
}

/// Corners of each outline of what is seen, ascending.
fn corner_counts(shape: &Shape) -> Vec<usize> {
    let mut counts: Vec<usize> = shape.seen.iter().map(Vec::len).collect();
    counts.sort_unstable();
    counts
}

/// The map of a random scene, and a scene for its names.
fn random_map(seed: u64) -> (scenes::Scene, VisibilityMap, Scene) {
    let random = if seed % 50 == 49 {
        scenes::Scene::large(seed)
    } else {
        scenes::Scene::random(seed)
    };
    let seen = speculative::find(&random.faces, &speculative::Settings::default());
    let map = VisibilityMap {
        camera: view_from(-DVec3::Y),
        faces: random.faces.clone(),
        opaque: seen.opaque,
        veils: seen.veils,
    };
    let objects = random.faces.ids().map(|face| random.faces.object(face).0);
    let count = objects.max().map_or(0, |most| most as usize + 1);
    let scene = scene_of(vec![("random", Mesh::default()); count]);
    (random, map, scene)
}

/// Looks that tell all faces apart, by their colour, or none.
fn looks(map: &VisibilityMap, apart: bool) -> Vec<Look> {
    let look = |fragment: usize| {
        let face = map.opaque.face(fragment);
        let digits = [face.0 % 64, face.0 / 64 % 64, face.0 / 4096];
        Look {
            object: map.faces.object(face),
            material: MaterialId(0),
            radiance: if apart {
                digits.map(|digit| digit as f32)
            } else {
                [1.0; 3]
            },
            evenness: Evenness::Even,
        }
    };
    (0..map.opaque.len()).map(look).collect()
}

fn areas_of_faces(faces: &Faces, fragments: &Fragments) -> BTreeMap<FaceId, f64> {
    let mut areas = BTreeMap::new();
    for fragment in fragments.iter() {
        let polygon = match fragment {
            veduta::map::Fragment::Whole(face) => faces.outline(face),
            veduta::map::Fragment::Cut { vertices, .. } => vertices,
        };
        *areas.entry(fragment.face()).or_insert(0.0) += signed_area(polygon);
    }
    areas
}

/// Of a drawing one pixel wide and high, whose areas are shares of the frame.
const FRAME: PixelGrid = PixelGrid {
    width: 1,
    height: 1,
    pixels_per_frame: DVec2::ONE,
    origin: DVec2::ZERO,
};

#[test]
fn regions_have_the_areas_of_their_fragments() {
    let failures: Vec<String> = (0..400u64)
        .into_par_iter()
        .filter_map(|seed| {
            let (random, map, scene) = random_map(seed);
            let settings = Settings {
                trap: 0.0,
                ..Settings::default()
            };
            let expected = areas_of_faces(&map.faces, &map.opaque);
            let apart = draw(&scene, &map, &looks(&map, true), &FRAME, &settings);
            if apart.shapes.len() != expected.len() {
                return Some(format!("{random}: {} shapes", apart.shapes.len()));
            }
            // Looks tell of which face a shape is.
            for shape in &apart.shapes {
                let [low, middle, high] = shape.radiance.map(|digit| digit.round() as u32);
                let face = FaceId(low + 64 * middle + 4096 * high);
                let error = (area(&shape.seen) - expected[&face]).abs();
                if error > 1e-9 {
                    return Some(format!("{random}: {face:?} is off by {error:e}"));
                }
            }
            let joined = draw(&scene, &map, &looks(&map, false), &FRAME, &settings);
            let all: f64 = joined.shapes.iter().map(|shape| area(&shape.seen)).sum();
            let error = (all - expected.values().sum::<f64>()).abs();
            if error > 1e-9 || random.is_covered && (all - 1.0).abs() > 1e-9 {
                return Some(format!("{random}: joined, {all} of the frame is drawn"));
            }
            None
        })
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn the_number_of_threads_makes_no_difference() {
    let (_, map, scene) = random_map(49);
    let draw_with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let settings = Settings {
            lines: vec![LineKind::Silhouette, LineKind::Crease],
            ..Settings::default()
        };
        let grid = PixelGrid::of_frame(640, 480);
        let draw = || draw(&scene, &map, &looks(&map, true), &grid, &settings);
        pool.expect("a pool of threads").install(draw)
    };
    let one = draw_with(1);
    assert!(one.shapes.len() > 100 && !one.strokes.is_empty());
    assert_eq!(one, draw_with(3));
}

#[test]
fn a_cube_is_three_shapes_of_four_corners() {
    let scene = scene_of(vec![("cube", cube())]);
    let drawing = drawn(
        &scene,
        &view_from(DVec3::new(5.0, -7.0, 4.0)),
        &Settings::default(),
    );
    let counts: Vec<_> = drawing.shapes.iter().map(corner_counts).collect();
    assert_eq!(counts, [[4], [4], [4]]);
    assert!(drawing.shapes.iter().all(|shape| shape.faces == 2));
}

#[test]
fn a_wall_behind_a_window_is_one_shape_with_a_hole() {
    // A wall of six triangles around nothing regular: a T-junction on its left side, and another
    // within.
    let corners = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [-1.0, 1.0],
        [-1.0, 0.0],
        [0.5, 0.0],
        [1.0, 0.0],
    ];
    let triangles = [[0, 1, 6], [0, 6, 5], [0, 5, 4], [4, 6, 3], [6, 2, 3]];
    let wall = upright(0.0, &corners, &triangles);
    let pane = [[-0.5, -0.25], [0.5, -0.25], [0.5, 0.25], [-0.5, 0.25]];
    let window = upright(-0.5, &pane, &[[0, 1, 2], [0, 2, 3]]);
    let scene = scene_of(vec![("house/window", window), ("house/wall", wall)]);
    let drawing = drawn(&scene, &view_from(-DVec3::Y), &Settings::default());

    let names: Vec<_> = drawing.groups.iter().map(|group| &*group.name).collect();
    assert_eq!(names, ["house", "wall", "window"], "far to near");
    assert_eq!(drawing.groups[1].parent, Some(0));
    let [wall, window] = &drawing.shapes[..] else {
        panic!("{} shapes", drawing.shapes.len());
    };
    assert_eq!(
        (corner_counts(wall), corner_counts(window)),
        (vec![4, 4], vec![4])
    );
    // 100 pixels a metre.
    assert!((area(&wall.seen) - (4.0 - 0.5) * 1e4).abs() < 1e-6);
    assert!((area(&window.seen) - 0.5 * 1e4).abs() < 1e-6);
    // The wall goes on under the window for four pixels, and nowhere else.
    let beneath = 0.5 * 1e4 - (100.0 - 8.0) * (50.0 - 8.0);
    assert!((area(&wall.painted) - area(&wall.seen) - beneath).abs() < 1e-3);
    assert_eq!(window.painted, window.seen);
    assert!((wall.nearest - 1.0).abs() < 1e-9 && (window.farthest - 0.5).abs() < 1e-9);
}

#[test]
fn coplanar_neighbours_of_other_objects_or_colours_stay_apart() {
    let corners = [
        [-1.0, -1.0],
        [0.0, -1.0],
        [0.0, 1.0],
        [-1.0, 1.0],
        [1.0, -1.0],
        [1.0, 1.0],
    ];
    let left = upright(0.0, &corners[..4], &[[0, 1, 2], [0, 2, 3]]);
    let right = upright(0.0, &corners, &[[1, 4, 5], [1, 5, 2]]);
    let both = upright(0.0, &corners, &[[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]]);
    let one = scene_of(vec![("a", both.clone())]);
    let two = scene_of(vec![("a", left), ("b", right)]);
    let mut two_colors = scene_of(vec![("a", both)]);
    two_colors.meshes[0].materials.push((2, MaterialId(1)));
    two_colors.materials.push(Material {
        base_color: [1.0, 0.0, 0.0, 1.0],
        ..Material::default()
    });
    for (scene, expected) in [(&one, 1), (&two, 2), (&two_colors, 2)] {
        let drawing = drawn(scene, &view_from(-DVec3::Y), &Settings::default());
        assert_eq!(drawing.shapes.len(), expected);
        assert!(
            drawing
                .shapes
                .iter()
                .all(|shape| corner_counts(shape) == [4])
        );
    }
}

/// Of each kind of line, whether strokes are closed and how many points they have.
fn strokes(scene: &Scene, camera: &Camera, kinds: &[LineKind]) -> Vec<(LineKind, bool, usize)> {
    let settings = Settings {
        lines: kinds.to_vec(),
        shapes: false,
        ..Settings::default()
    };
    let drawing = drawn(scene, camera, &settings);
    assert!(drawing.shapes.is_empty());
    let told = |stroke: &Stroke| (stroke.kind, stroke.closed, stroke.points.len());
    drawing.strokes.iter().map(told).collect()
}

#[test]
fn a_cube_has_a_silhouette_of_six_corners_and_three_creases_that_meet() {
    use LineKind::{Boundary, Crease, Silhouette};
    let scene = scene_of(vec![("cube", cube())]);
    let camera = view_from(DVec3::new(5.0, -7.0, 4.0));
    let crease = (Crease, false, 2);
    assert_eq!(
        strokes(&scene, &camera, &[Crease, Silhouette]),
        [(Silhouette, true, 6), crease, crease, crease]
    );
    assert_eq!(strokes(&scene, &camera, &[Boundary]), []);
}

#[test]
fn a_sheet_before_a_wall_has_a_boundary_and_a_silhouette() {
    use LineKind::{Boundary, Silhouette};
    let square = |half: f64| [[-half, -half], [half, -half], [half, half], [-half, half]];
    let triangles = [[0, 1, 2], [0, 2, 3]];
    // The wall is larger than the frame: what is cut off by it is no edge.
    let wall = upright(0.0, &square(9.0), &triangles);
    for (depth, silhouette) in [(-0.5, true), (0.0, false)] {
        let sheet = upright(depth, &square(0.5), &triangles);
        let scene = scene_of(vec![("sheet", sheet), ("wall", wall.clone())]);
        let camera = view_from(-DVec3::Y);
        assert_eq!(
            strokes(&scene, &camera, &[Boundary]),
            [(Boundary, true, 4)],
            "{depth}"
        );
        let expected: &[_] = if silhouette {
            &[(Silhouette, true, 4)]
        } else {
            &[]
        };
        assert_eq!(strokes(&scene, &camera, &[Silhouette]), expected, "{depth}");
    }
}

/// The share of the background that is seen in a pixel.
#[derive(Debug, Default)]
struct Leak {
    share: f64,
    pixel: (usize, usize),
    /// Shapes in that pixel: number, samples that are seen, and that are painted.
    shapes: Vec<(usize, u32, u32)>,
}

/// Samples along each side of a pixel.
const SAMPLES: usize = 8;

/// How much of the background a viewer lets through at most, in pixels that are covered and have covered
/// neighbours: each shape's share of a pixel's samples is its opacity there, and shapes are laid one
/// on the other, as viewers do that smooth each shape by itself. Outlines are scaled by `zoom`.
fn largest_leak(drawing: &Drawing, zoom: f64, outlines: impl Fn(&Shape) -> &[Vec<DVec2>]) -> Leak {
    let [width, height] = drawing.size.map(|side| (side * zoom) as usize);
    let mut through = vec![1.0; width * height];
    let mut covered = vec![0u32; width * height];
    for shape in &drawing.shapes {
        for (pixel, samples) in samples_in(&shape.seen, zoom, width, height) {
            covered[pixel] += samples;
        }
        for (pixel, samples) in samples_in(outlines(shape), zoom, width, height) {
            through[pixel] *= 1.0 - f64::from(samples) / (SAMPLES * SAMPLES) as f64;
        }
    }
    let is_full = |x: usize, y: usize| covered[y * width + x] >= (SAMPLES * SAMPLES) as u32;
    let mut largest = Leak::default();
    for (x, y) in (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y))) {
        let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
        if around.clone().all(|(x, y)| is_full(x, y)) {
            let share = through[y * width + x];
            if share > largest.share {
                largest.share = share;
                largest.pixel = (x, y);
            }
        }
    }
    let (x, y) = largest.pixel;
    for (index, shape) in drawing.shapes.iter().enumerate() {
        let counts = [&shape.seen[..], outlines(shape)]
            .map(|outlines| samples_in(outlines, zoom, width, height));
        let [seen, painted] =
            counts.map(|counts| counts.get(&(y * width + x)).copied().unwrap_or(0));
        if seen + painted > 0 {
            largest.shapes.push((index, seen, painted));
        }
    }
    largest
}

/// The pixels in which samples have a winding number other than zero, and how many.
fn samples_in(
    outlines: &[Vec<DVec2>],
    zoom: f64,
    width: usize,
    height: usize,
) -> BTreeMap<usize, u32> {
    let scale = zoom * SAMPLES as f64;
    let mut counts = BTreeMap::new();
    // Of each row of samples, where sides cross it and which way.
    let mut crossings: BTreeMap<usize, Vec<(f64, i32)>> = BTreeMap::new();
    for outline in outlines {
        for (&from, &to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            let (from, to) = (from * scale - 0.5, to * scale - 0.5);
            let (top, bottom, turn) = if from.y < to.y {
                (from, to, 1)
            } else {
                (to, from, -1)
            };
            let rows = top.y.ceil().max(0.0) as usize..bottom.y.ceil().max(0.0) as usize;
            for row in rows {
                let share = (row as f64 - top.y) / (bottom.y - top.y);
                let x = top.x + share * (bottom.x - top.x);
                crossings.entry(row).or_default().push((x, turn));
            }
        }
    }
    for (row, mut crossings) in crossings {
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut winding = 0;
        for pair in crossings.windows(2) {
            winding += pair[0].1;
            if winding != 0 && row / SAMPLES < height {
                let [first, end] = [pair[0].0, pair[1].0].map(|x| x.ceil().max(0.0) as usize);
                for column in first..end.min(width * SAMPLES) {
                    let pixel = row / SAMPLES * width + column / SAMPLES;
                    *counts.entry(pixel).or_insert(0) += 1;
                }
            }
        }
    }
    counts
}

#[test]
fn no_background_is_seen_between_neighbours() {
    for name in ["buildings", "balls3", "pierce"] {
        let generate::Generated { scene, camera, .. } =
            generate::by_name_for_aspect(name, 1.0).expect("a known scene");
        let map = find_visibility(&scene, &camera);
        let grid = PixelGrid::of_frame(160, 160);
        let drawing = draw_window(&scene, &map, &grid, true, &Settings::default());
        for zoom in [0.75, 1.0, 3.0] {
            let leak = largest_leak(&drawing, zoom, |shape| &shape.painted);
            // Known limit: in a few pixels in which three shapes of the town meet, the first of them does
            // not reach all of the pixel. Without traps it is a quarter, along all edges.
            let most = match name {
                "buildings" if zoom <= 1.0 => 0.03,
                _ => 1.0 / 255.0,
            };
            assert!(leak.share <= most, "{name} at {zoom}: {leak:?}");
        }
        // Without traps it is: this is what is being tested.
        assert!(
            largest_leak(&drawing, 1.0, |shape| &shape.seen).share > 0.1,
            "{name}"
        );
    }
}
