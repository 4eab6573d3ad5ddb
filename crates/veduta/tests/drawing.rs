//! Drawings: regions have the areas of their fragments, few outlines, and no seams.

#[path = "support/rng.rs"]
mod rng;
#[path = "support/scenes.rs"]
mod scenes;

use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use veduta::dice::PixelGrid;
use veduta::drawing::{
    Chain, Drawing, Evenness, LineKind, Look, Rim, Settings, Shape, Stroke, draw,
};
use veduta::geometry::{DMat4, DVec2, DVec3, signed_area};
use veduta::map::{Camera, FaceId, Faces, Fragments, MaterialId, Projection, VisibilityMap};
use veduta::pipeline::{draw_window, find_visibility, render_window};
use veduta::scene::{AlphaMode, Material, Mesh, MeshId, Object, Scene, generate};
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
        let face = map.face_of(fragment);
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
            opacity: 1.0,
        }
    };
    (0..map.fragment_count()).map(look).collect()
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
    // The wall goes on under the window, and nowhere else.
    assert_eq!(wall.painted.len(), 1);
    assert!((area(&wall.painted) - 4.0 * 1e4).abs() < 1e-3);
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
fn a_cube_hides_three_edges() {
    use LineKind::{Crease, Hidden, Silhouette};
    let scene = scene_of(vec![("cube", cube())]);
    let camera = view_from(DVec3::new(5.0, -7.0, 4.0));
    let three = |kind: LineKind| [(kind, false, 2); 3];
    assert_eq!(
        strokes(&scene, &camera, &[Crease, Silhouette, Hidden]),
        [&three(Hidden)[..], &[(Silhouette, true, 6)], &three(Crease)].concat()
    );
    // From the front each of its far edges lies behind a near one, which is drawn.
    let ahead = view_from(-DVec3::Y);
    assert_eq!(
        strokes(&scene, &ahead, &[Silhouette, Crease, Hidden]),
        [(Silhouette, true, 4)]
    );
}

/// Cubes turned at random and smaller ones among them, some of which overlap in the picture, none in space.
fn cubes(seed: u64) -> (Scene, Vec<DMat4>) {
    let mut rng = rng::Rng::new(seed);
    let mut places = Vec::new();
    for place in 0..8 {
        let turn = DMat4::from_rotation_z(rng.within(0.1, 3.0))
            * DMat4::from_rotation_x(rng.within(0.1, 3.0));
        let at = DVec3::from([place & 1, place >> 1 & 1, place >> 2].map(|b| f64::from(b) - 0.5));
        let size = rng.within(0.1, 0.28);
        places.push(DMat4::from_translation(at) * turn * DMat4::from_scale(DVec3::splat(size)));
    }
    let mut scene = scene_of(vec![("cube", cube())]);
    let one = scene.objects[0].clone();
    let object = |&world_from_object: &DMat4| Object {
        world_from_object,
        ..one.clone()
    };
    scene.objects = places.iter().map(object).collect();
    (scene, places)
}

/// The edges of the cube from -1 to 1.
fn cube_edges() -> Vec<[DVec3; 2]> {
    let mut edges = Vec::new();
    for axis in 0..3 {
        for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            let mut ends = [DVec3::ZERO; 2];
            for (end, along) in ends.iter_mut().zip([-1.0, 1.0]) {
                end[axis] = along;
                end[(axis + 1) % 3] = a;
                end[(axis + 2) % 3] = b;
            }
            edges.push(ends);
        }
    }
    edges
}

/// Whether a segment passes through the cube from -1 to 1, and not only touches it.
fn passes_through_cube(from: DVec3, to: DVec3) -> bool {
    let (mut start, mut end) = (0.0, 1.0);
    for axis in 0..3 {
        let (at, along) = (from[axis], to[axis] - from[axis]);
        let [one, other] = [-1.0, 1.0].map(|side| (side - at) / along);
        start = f64::max(start, one.min(other));
        end = f64::min(end, one.max(other));
    }
    end - start > 1e-9
}

fn distance_from_stroke(point: DVec2, stroke: &Stroke) -> f64 {
    let count = stroke.points.len();
    let sides = if stroke.closed { count } else { count - 1 };
    let distance = |k: usize| {
        let (from, to) = (stroke.points[k], stroke.points[(k + 1) % count]);
        let along = to - from;
        let share = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (from + share * along - point).length()
    };
    (0..sides).map(distance).fold(f64::INFINITY, f64::min)
}

#[test]
fn edges_are_hidden_where_a_ray_from_the_eye_meets_something_before() {
    let mut counts = [0; 2];
    let mut failures = Vec::new();
    for seed in 0..12 {
        let (scene, places) = cubes(seed);
        let eye = DVec3::new(4.0, -9.0, 5.0);
        let lens = if seed % 2 == 0 {
            Projection::Parallel {
                height: 2.6,
                aspect: 1.0,
            }
        } else {
            Projection::Perspective {
                tan_half_height: 0.13,
                aspect: 1.0,
            }
        };
        let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Z, lens, 0.1).expect("sound");
        let settings = Settings {
            lines: vec![LineKind::Silhouette, LineKind::Crease, LineKind::Hidden],
            shapes: false,
            ..Settings::default()
        };
        let drawing = drawn(&scene, &camera, &settings);
        let image = |world: DVec3| {
            let image = camera.image_from_eye(camera.eye_from_world.transform_point3(world));
            assert!(
                (image - 0.5).abs().max_element() < 0.5,
                "seed {seed}: all in the frame"
            );
            image * 400.0
        };
        // The law: what is seen and what is hidden of an edge are all of it.
        let edges = cube_edges();
        let of_places = places.iter().flat_map(|place| {
            edges
                .iter()
                .map(|ends| ends.map(|end| place.transform_point3(end)))
        });
        let all: f64 = of_places
            .map(|[from, to]| (image(to) - image(from)).length())
            .sum();
        let length = |stroke: &Stroke| {
            let next = stroke.points.iter().cycle().skip(1);
            let sides = stroke.points.len() - usize::from(!stroke.closed);
            let lengths = stroke.points.iter().zip(next).take(sides);
            lengths.map(|(&p, &q)| (q - p).length()).sum::<f64>()
        };
        let drawn: f64 = drawing.strokes.iter().map(length).sum();
        if (drawn - all).abs() > 400.0 * 1e-9 {
            failures.push(format!("seed {seed}: {drawn} of {all}"));
        }

        for (own, place) in places.iter().enumerate() {
            for [from, to] in &edges {
                for k in 0..20 {
                    let point =
                        place.transform_point3(from.lerp(*to, (f64::from(k) + 0.37) / 20.0));
                    let towards_eye = match lens {
                        Projection::Parallel { .. } => point + eye,
                        Projection::Perspective { .. } => eye,
                    };
                    let hides = |place: &DMat4| {
                        let cube_from_world = place.inverse();
                        let [point, eye] =
                            [point, towards_eye].map(|p| cube_from_world.transform_point3(p));
                        passes_through_cube(point, eye)
                    };
                    let is_hidden = places.iter().any(hides);
                    let place = image(point);
                    let nearest = |hidden: bool| {
                        let strokes = drawing.strokes.iter();
                        let strokes =
                            strokes.filter(|stroke| (stroke.kind == LineKind::Hidden) == hidden);
                        let distances = strokes.map(|stroke| distance_from_stroke(place, stroke));
                        distances.fold(f64::INFINITY, f64::min)
                    };
                    if nearest(is_hidden) > 1e-6 {
                        failures.push(format!(
                            "seed {seed}, cube {own}: {place} is hidden: {is_hidden}"
                        ));
                    }
                    counts[usize::from(is_hidden)] += 1;
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(counts.iter().all(|&count| count > 3000), "{counts:?}");
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

/// Whether the winding number of outlines around a point is not zero.
fn is_in(outlines: &[Vec<DVec2>], point: DVec2) -> bool {
    let mut winding = 0;
    for outline in outlines {
        for (from, to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            let turn = (to.x - from.x) * (point.y - from.y) - (to.y - from.y) * (point.x - from.x);
            if (from.y > point.y) != (to.y > point.y) && (turn > 0.0) == (to.y > from.y) {
                winding += if to.y > from.y { 1 } else { -1 };
            }
        }
    }
    winding != 0
}

#[test]
fn veils_laid_on_one_another_show_what_pixels_show() {
    let triangles = [[0, 1, 2], [0, 2, 3]];
    let upright = |depth: f64, half: f64| {
        let square = [[-half, -half], [half, -half], [half, half], [-half, half]];
        upright(depth, &square, &triangles)
    };
    // A pane askew through two others, and a wall that is small enough to look past.
    let mut askew = upright(0.0, 1.0);
    for position in &mut askew.positions {
        position.y = 0.9 * position.x - 0.3 * position.z;
    }
    let mut scene = scene_of(vec![
        ("askew", askew),
        ("near", upright(-0.5, 1.2)),
        ("far", upright(0.3, 1.5)),
        ("wall", upright(2.0, 1.7)),
    ]);
    scene.materials = [
        [0.9, 0.1, 0.1, 0.5],
        [0.1, 0.8, 0.2, 0.25],
        [0.2, 0.3, 0.9, 0.75],
        [0.7, 0.7, 0.6, 1.0],
    ]
    .map(|base_color| Material {
        base_color,
        alpha_mode: AlphaMode::Blend,
        unlit: true,
        ..Material::default()
    })
    .to_vec();
    for (index, mesh) in scene.meshes.iter_mut().enumerate() {
        mesh.materials = vec![(0, MaterialId(index as u32))];
    }
    let map = find_visibility(&scene, &view_from(-DVec3::Y));
    let grid = PixelGrid::of_frame(80, 80);
    let drawing = draw_window(&scene, &map, &grid, false, &Settings::default());
    // Of two that pass through each other one is cut, and two triangles are one pane.
    assert_eq!(drawing.veils.len(), 5);
    assert!(drawing.veils.iter().all(|veil| veil.outlines.len() == 1));
    let picture = render_window(&scene, &map, &grid, false);
    let mut compared = 0;
    for (index, pixel) in picture.pixels.iter().enumerate() {
        let corner = DVec2::new((index % 80) as f64, (index / 80) as f64);
        let laid_at = |point: DVec2| -> Vec<usize> {
            let veils = drawing.veils.iter().map(|veil| &veil.outlines);
            let shapes = drawing.shapes.iter().map(|shape| &shape.seen).chain(veils);
            let shapes = shapes
                .enumerate()
                .filter(|(_, outlines)| is_in(outlines, point));
            shapes.map(|shape| shape.0).collect()
        };
        let laid = laid_at(corner + 0.5);
        let around = [[-0.01, -0.01], [1.01, -0.01], [1.01, 1.01], [-0.01, 1.01]];
        if around
            .iter()
            .any(|&at| laid_at(corner + DVec2::from(at)) != laid)
        {
            continue;
        }
        let mut expected = [0.0; 4];
        for shape in laid {
            let (radiance, opacity) = match shape.checked_sub(drawing.shapes.len()) {
                None => (drawing.shapes[shape].radiance, 1.0),
                Some(veil) => (drawing.veils[veil].radiance, drawing.veils[veil].opacity),
            };
            let [r, g, b] = radiance;
            for (below, own) in expected.iter_mut().zip([r, g, b, 1.0]) {
                *below += opacity * (own - *below);
            }
        }
        let off = pixel.iter().zip(expected).map(|(p, e)| (p - e).abs());
        assert!(
            off.fold(0.0, f32::max) < 1e-5,
            "{corner}: {pixel:?} and not {expected:?}"
        );
        compared += usize::from(expected[3] > 0.0);
    }
    assert!(compared > 3000, "{compared}");
}

/// Samples along each side of a pixel.
const SAMPLES: usize = 8;

/// What a viewer makes of a drawing. Each path's share of a pixel's samples is its opacity there, and paths are
/// laid one on the other, as viewers do that smooth each path by itself.
struct Viewed {
    width: usize,
    /// Of each pixel, the share that shapes are seen in.
    covered: Vec<f64>,
    /// The share that is painted.
    opacity: Vec<f64>,
    /// The share in which nothing but the ground is painted.
    ground: Vec<f64>,
}

/// Shapes alone, as they are seen, or else all that is painted; scaled by `zoom`.
fn viewed(drawing: &Drawing, zoom: f64, with_traps: bool) -> Viewed {
    let [width, height] = drawing.size.map(|side| (side * zoom).round() as usize);
    let shares = |outlines: &[Vec<DVec2>]| {
        let samples = samples_in(outlines, zoom, width, height).into_iter();
        samples.map(|(pixel, samples)| (pixel, f64::from(samples) / (SAMPLES * SAMPLES) as f64))
    };
    let mut covered = vec![0.0; width * height];
    // Of what is laid on nothing.
    let mut through = vec![1.0; width * height];
    for shape in &drawing.shapes {
        for (pixel, share) in shares(&shape.seen) {
            covered[pixel] += share;
        }
        let outlines = if with_traps {
            &shape.painted
        } else {
            &shape.seen
        };
        for (pixel, share) in shares(outlines) {
            through[pixel] *= 1.0 - share;
        }
    }
    let mut opacity: Vec<f64> = through.iter().map(|through| 1.0 - through).collect();
    if with_traps && let Some(beneath) = &drawing.underpainting {
        for chain in beneath.rims.iter().flat_map(|rim| &rim.chains) {
            for (pixel, samples) in
                samples_along(chain, 0.5 * beneath.rim_width, zoom, width, height)
            {
                through[pixel] *= 1.0 - f64::from(samples) / (SAMPLES * SAMPLES) as f64;
            }
        }
        // The ground is everywhere; the outline is smoothed once.
        opacity.fill(1.0);
        if let Some(outline) = &beneath.outline {
            opacity.fill(0.0);
            for (pixel, share) in shares(outline) {
                opacity[pixel] = share;
            }
        }
    }
    Viewed {
        width,
        covered,
        opacity,
        ground: through,
    }
}

impl Viewed {
    /// The pixel in which most of `of` is, and how much, of those that `is_meant` of what is covered.
    fn most(&self, of: impl Fn(usize) -> f64, is_meant: impl Fn(f64) -> bool) -> (f64, [usize; 2]) {
        let pixels = 0..self.covered.len();
        let meant = pixels.filter(|&pixel| is_meant(self.covered[pixel]));
        let most = meant.max_by(|&a, &b| of(a).total_cmp(&of(b)));
        let most = most.expect("there are such pixels");
        (of(most), [most % self.width, most / self.width])
    }
}

/// The pixels in which samples lie within `reach` of a chain, and how many.
fn samples_along(
    chain: &Chain,
    reach: f64,
    zoom: f64,
    width: usize,
    height: usize,
) -> BTreeMap<usize, u32> {
    let scale = zoom * SAMPLES as f64;
    let mut samples = BTreeSet::new();
    let closing = if chain.closed { 0 } else { 1 };
    let next = chain.points.iter().cycle().skip(1);
    let sides = chain.points.iter().zip(next);
    for (&from, &to) in sides.take(chain.points.len() - closing) {
        let along = to - from;
        let [low, high] = [from.min(to) - reach, from.max(to) + reach].map(|at| at * scale);
        let last = DVec2::new(width as f64, height as f64) * SAMPLES as f64 - 1.0;
        let [low, high] = [low, high].map(|at| at.clamp(DVec2::ZERO, last));
        for row in low.y as usize..=high.y as usize {
            for column in low.x as usize..=high.x as usize {
                let point = (DVec2::new(column as f64, row as f64) + 0.5) / scale;
                let share = (point - from).dot(along) / along.length_squared();
                let foot = from + along * share.clamp(0.0, 1.0);
                if (point - foot).length() <= reach {
                    samples.insert([row, column]);
                }
            }
        }
    }
    let mut counts = BTreeMap::new();
    for [row, column] in samples {
        let pixel = row / SAMPLES * width + column / SAMPLES;
        *counts.entry(pixel).or_insert(0) += 1;
    }
    counts
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
    // One sample of each pixel may lie on the other side for rounding.
    let sample = 1.001 / (SAMPLES * SAMPLES) as f64;
    let is_whole = |covered: f64| covered >= 1.0 - 1e-9;
    let is_part = |covered: f64| covered > 0.0 && !is_whole(covered);
    for name in ["buildings", "balls3", "pierce"] {
        let generate::Generated { scene, camera, .. } =
            generate::by_name_for_aspect(name, 1.0).expect("a known scene");
        let map = find_visibility(&scene, &camera);
        let grid = PixelGrid::of_frame(160, 160);
        let drawing = draw_window(&scene, &map, &grid, true, &Settings::default());
        for zoom in [1.0, 2.3, 4.0] {
            let viewed = viewed(&drawing, zoom, true);
            let leak = |pixel: usize| 1.0 - viewed.opacity[pixel];
            let (most, pixel) = viewed.most(leak, is_whole);
            assert!(most <= 1.0 / 255.0, "{name} at {zoom}: {most} in {pixel:?}");
            if drawing
                .underpainting
                .iter()
                .all(|beneath| beneath.outline.is_none())
            {
                continue;
            }
            // Nor is the outline drawn too wide or too narrow.
            let off = |pixel: usize| (viewed.opacity[pixel] - viewed.covered[pixel]).abs();
            let (most, pixel) = viewed.most(off, is_part);
            assert!(
                most <= sample,
                "{name} at {zoom}: off by {most} in {pixel:?}"
            );
            // And in colours of what is there.
            let (most, pixel) = viewed.most(|pixel| viewed.ground[pixel], is_part);
            assert!(
                most <= 1.0 / 255.0,
                "{name} at {zoom}: {most} ground in {pixel:?}"
            );
        }
        // Without traps it is: this is what is being tested.
        let bare = viewed(&drawing, 1.0, false);
        let leak = |pixel: usize| 1.0 - bare.opacity[pixel];
        assert!(bare.most(leak, is_whole).0 > 0.1, "{name}");
    }
}

#[test]
fn a_trap_ends_before_what_is_painted_earlier_beyond_a_sliver() {
    // A trap went on beyond a sliver thinner than rounding: its far side was taken for the zone's border.
    let sides = [-0.3, -1e-10, 0.0, 1.0];
    let strip = |k: usize| {
        let [left, right] = [sides[k], sides[k + 1]];
        let corners = [[left, -1.0], [right, -1.0], [right, 1.0], [left, 1.0]];
        upright(0.0, &corners, &[[0, 1, 2], [0, 2, 3]])
    };
    let mut scene = scene_of(vec![("a", strip(0)), ("b", strip(1)), ("c", strip(2))]);
    scene
        .objects
        .iter_mut()
        .for_each(|object| object.name = "strips".to_owned());
    scene.materials = [
        [0.9, 0.1, 0.1, 1.0],
        [0.1, 0.9, 0.1, 1.0],
        [0.1, 0.1, 0.9, 1.0],
    ]
    .map(|base_color| Material {
        base_color,
        unlit: true,
        ..Material::default()
    })
    .to_vec();
    for (index, mesh) in scene.meshes.iter_mut().enumerate() {
        mesh.materials = vec![(0, MaterialId(index as u32))];
    }
    let drawing = drawn(&scene, &view_from(-DVec3::Y), &Settings::default());
    let extent = |material: u32| {
        let shapes = drawing.shapes.iter();
        let mut own = shapes.filter(|shape| shape.material == MaterialId(material));
        let points = own.next().expect("a shape").painted.iter().flatten();
        let of_x = points.map(|point| point.x);
        of_x.fold([f64::INFINITY, 0.0], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
    };
    assert!(extent(0)[1] > 201.0, "a trap under what is painted later");
    assert!(extent(2)[0] > 199.999, "{}", extent(2)[0]);
}

#[test]
fn what_fills_the_frame_has_no_outline() {
    let square = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
    let wall = upright(0.0, &square, &[[0, 1, 2], [0, 2, 3]]);
    let drawing = drawn(
        &scene_of(vec![("wall", wall)]),
        &view_from(-DVec3::Y),
        &Settings::default(),
    );
    let beneath = drawing.underpainting.expect("there are shapes");
    assert_eq!((beneath.outline, beneath.rims), (None, Vec::new()));
    let nothing = drawn(
        &scene_of(Vec::new()),
        &view_from(-DVec3::Y),
        &Settings::default(),
    );
    assert_eq!(nothing.underpainting, None);
}

#[test]
fn the_outline_goes_on_beyond_the_frame() {
    // A square cut by the frame, and askew so that it meets it at an angle: its outline off the frame must not
    // move.
    let corners = [[0.5, -0.5], [3.0, -1.5], [3.0, 1.5], [0.5, 0.5]];
    let sheet = upright(0.0, &corners, &[[0, 1, 2], [0, 2, 3]]);
    let drawing = drawn(
        &scene_of(vec![("sheet", sheet)]),
        &view_from(-DVec3::Y),
        &Settings::default(),
    );
    let beneath = drawing.underpainting.expect("there are shapes");
    let outline = beneath.outline.expect("it does not fill the frame");
    // 100 pixels a metre; a column of a pixel beyond the frame, 220 high.
    let seen = area(&drawing.shapes[0].seen);
    assert!((area(&outline) - seen - 220.0).abs() < 1e-6);
    assert_eq!(outline[0].len(), 6);
    let [Rim { chains, .. }] = &beneath.rims[..] else {
        panic!("{} rims", beneath.rims.len());
    };
    let sizes: Vec<_> = chains
        .iter()
        .map(|chain| (chain.points.len(), chain.closed))
        .collect();
    assert_eq!(sizes, [(4, false)]);
}
