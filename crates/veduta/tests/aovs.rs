//! Channels beside the light: closed forms, and the exact coverage that `dice::coverage` finds on its
//! own way.

use std::collections::BTreeMap;
use veduta::accumulate::{AovSettings, Aovs, Matte, Picture, Rank};
use veduta::dice::{PixelGrid, coverage};
use veduta::filter::Filter;
use veduta::geometry::{DMat4, DVec2, DVec3, Vec3};
use veduta::map::{Camera, MaterialId, Projection, VisibilityMap};
use veduta::pipeline::{self, RenderSettings, Sampling, find_visibility, render_channels};
use veduta::scene::{Material, Mesh, MeshId, Object, Scene, generate};

const ALL: AovSettings = AovSettings {
    depth: true,
    normal: true,
    position: true,
    albedo: true,
    object: true,
    material: true,
    face: true,
    object_ranks: 64,
    material_ranks: 64,
};

/// A name, corners, and a colour.
type Square = (&'static str, [[f64; 3]; 4], [f32; 3]);

/// An object of each square.
fn squares(squares: &[Square]) -> Scene {
    let mut scene = Scene::default();
    for (row, &(name, corners, [r, g, b])) in squares.iter().enumerate() {
        let mut mesh = Mesh {
            positions: corners.map(DVec3::from).to_vec(),
            materials: vec![(0, MaterialId(row as u32))],
            ..Mesh::default()
        };
        mesh.push_polygon(&[0, 1, 2, 3]);
        scene.meshes.push(mesh);
        scene.objects.push(Object {
            name: name.into(),
            mesh: MeshId(row as u32),
            world_from_object: DMat4::IDENTITY,
        });
        scene.materials.push(Material {
            name: name.into(),
            base_color: [r, g, b, 1.0],
            ..Material::default()
        });
    }
    scene
}

/// From ten metres above, north upwards, a frame of two metres.
fn from_above() -> Camera {
    let projection = Projection::Parallel {
        height: 2.0,
        aspect: 1.0,
    };
    let eye = DVec3::new(0.0, 0.0, 10.0);
    Camera::looking(eye, DVec3::ZERO, DVec3::Y, projection, 0.0).expect("a sound camera")
}

/// A wall of height 1 over the left five eighths of the frame, and under all of it but the lowest row
/// of 2 x 4 pixels a ramp that goes down to the right.
fn wall_and_ramp() -> Scene {
    let rectangle = |right: f64, bottom: f64, height: fn(f64) -> f64| {
        [(-1.0, bottom), (right, bottom), (right, 1.0), (-1.0, 1.0)].map(|(x, y)| [x, y, height(x)])
    };
    squares(&[
        ("wall", rectangle(0.25, -0.5, |_| 1.0), [1.0, 0.0, 0.0]),
        ("ramp", rectangle(1.0, -0.5, |x| -x), [0.0, 0.5, 0.0]),
    ])
}

/// Whether a channel was made, which it was.
fn made<T>(channel: &Option<T>) -> &T {
    channel.as_ref().expect("it was asked for")
}

#[test]
fn a_pixel_tells_of_the_face_that_covers_most_of_it() {
    let scene = wall_and_ramp();
    let grid = PixelGrid::of_frame(2, 4);
    let settings = RenderSettings {
        width: 2,
        height: 4,
        aovs: ALL,
        ..RenderSettings::default()
    };
    let map = find_visibility(&scene, &from_above());
    let exact = render_channels(&scene, &map, &grid, false, Filter::Box, ALL).1;
    // In the second row all edges are upright, so that multiscan is exact too.
    let sampling = Sampling::Multiscan(2);
    let multiscan = RenderSettings {
        sampling,
        ..settings
    };
    let multiscan = pipeline::render(&scene, &from_above(), &multiscan, |_| {}).aovs;
    for (aovs, rows) in [(&multiscan, 1..2), (&exact, 0..3)] {
        for row in rows {
            let y = 0.75 - 0.5 * row as f64;
            let (left, right) = (2 * row, 2 * row + 1);
            let near = |found: [f32; 3], expected: DVec3| {
                let off = (Vec3::from(found) - expected.as_vec3()).length();
                assert!(off < 1e-5, "{found:?} and not {expected}");
            };
            // The wall fills the pixel; the ramp is seen from x = 1/4 to 1 in the other.
            near(made(&aovs.position)[left], DVec3::new(-0.5, y, 1.0));
            near(made(&aovs.position)[right], DVec3::new(0.625, y, -0.625));
            assert!((made(&aovs.depth)[left] - 9.0).abs() < 1e-5);
            assert!((made(&aovs.depth)[right] - 10.625).abs() < 1e-5);
            near(made(&aovs.normal)[left], DVec3::Z);
            near(
                made(&aovs.normal)[right],
                DVec3::new(1.0, 0.0, 1.0).normalize(),
            );
            near(made(&aovs.albedo)[left], DVec3::X);
            near(made(&aovs.albedo)[right], DVec3::new(0.25, 0.5 * 0.75, 0.0));
            assert_eq!([left, right].map(|pixel| made(&aovs.object)[pixel]), [0, 1]);
            assert_eq!(
                [left, right].map(|pixel| made(&aovs.material)[pixel]),
                [0, 1]
            );
            assert_eq!([left, right].map(|pixel| made(&aovs.face)[pixel]), [0, 0]);
            for matte in [made(&aovs.object_matte), made(&aovs.material_matte)] {
                assert_eq!(areas(matte, left), BTreeMap::from([(0, 1.0)]));
                assert_eq!(areas(matte, right), BTreeMap::from([(0, 0.25), (1, 0.75)]));
                assert_eq!(matte.most, 2);
                assert_eq!(
                    matte.rows[right * matte.ranks].thing,
                    1,
                    "the larger is first"
                );
            }
        }
    }
    for pixel in [6, 7] {
        assert_eq!(made(&exact.depth)[pixel], Aovs::FARTHEST);
        for channel in [&exact.position, &exact.normal, &exact.albedo] {
            assert_eq!(made(channel)[pixel], [0.0; 3]);
        }
        for channel in [&exact.object, &exact.material, &exact.face] {
            assert_eq!(made(channel)[pixel], Aovs::NOTHING);
        }
        assert_eq!(areas(made(&exact.object_matte), pixel), BTreeMap::new());
    }
}

/// What each thing covers of a pixel.
fn areas(matte: &Matte, pixel: usize) -> BTreeMap<u32, f32> {
    let rows = &matte.rows[pixel * matte.ranks..(pixel + 1) * matte.ranks];
    let taken: Vec<&Rank> = rows.iter().filter(|row| **row != Rank::FREE).collect();
    assert!(taken.is_sorted_by(|a, b| a.area >= b.area), "{taken:?}");
    let areas: BTreeMap<u32, f32> = taken.iter().map(|row| (row.thing, row.area)).collect();
    assert_eq!(areas.len(), taken.len(), "a thing has one rank: {taken:?}");
    areas
}

#[test]
fn things_of_one_name_are_one_thing() {
    let [a, b] = [[-1.0, 0.0], [0.0, 1.0]].map(|[left, right]: [f64; 2]| {
        [(left, -1.0), (right, -1.0), (right, 1.0), (left, 1.0)].map(|(x, y)| [x, y, 0.0])
    });
    let scene = squares(&[("half", a, [1.0; 3]), ("half", b, [0.5; 3])]);
    let map = find_visibility(&scene, &from_above());
    let aovs = render_channels(
        &scene,
        &map,
        &PixelGrid::of_frame(1, 1),
        false,
        Filter::Box,
        ALL,
    )
    .1;
    assert_eq!(
        areas(made(&aovs.object_matte), 0),
        BTreeMap::from([(0, 1.0)])
    );
}

/// Scenes with piercing faces, tiny ones, and ones seen nearly edge-on, at sizes at which a pixel shows
/// many.
fn cases() -> Vec<(&'static str, Scene, Camera, PixelGrid)> {
    [
        ("pierce", 40),
        ("balls3", 60),
        ("buildings", 90),
        ("leaves20", 33),
        ("radial", 50),
    ]
    .into_iter()
    .map(|(name, height)| {
        let case = generate::by_name(name).expect("a scene");
        let width = (f64::from(height) * case.camera.aspect()).round() as u32;
        (
            name,
            case.scene,
            case.camera,
            PixelGrid::of_frame(width, height),
        )
    })
    .collect()
}

/// The faces of each pixel with their exact areas.
fn faces_of_pixels(map: &VisibilityMap, grid: &PixelGrid) -> Vec<Vec<(veduta::map::FaceId, f64)>> {
    let mut of_pixels = vec![Vec::new(); grid.pixel_count()];
    for row in coverage(map, grid) {
        of_pixels[row.pixel].push((row.face, row.area));
    }
    of_pixels
}

#[test]
fn depth_position_and_normal_are_of_a_largest_face_and_lie_on_it() {
    for (name, scene, camera, grid) in cases() {
        let map = find_visibility(&scene, &camera);
        let (picture, aovs) = render_channels(&scene, &map, &grid, false, Filter::Box, ALL);
        let of_pixels = faces_of_pixels(&map, &grid);
        let mut seen = 0;
        for (pixel, shown) in of_pixels.iter().enumerate() {
            let most = shown.iter().map(|&(_, area)| area).fold(0.0, f64::max);
            let depth = made(&aovs.depth)[pixel];
            // What single precision rounds to nothing may count or not.
            if most < 1e-30 {
                continue;
            }
            seen += 1;
            let found = [made(&aovs.object)[pixel], made(&aovs.face)[pixel]];
            let face = shown.iter().find(|&&(face, area)| {
                let told = [map.faces.object(face).0, map.faces.source(face)];
                told == found && area > most - 1e-6
            });
            let &(face, _) = face.unwrap_or_else(|| panic!("{name}, pixel {pixel}: {found:?}"));

            let position = Vec3::from(made(&aovs.position)[pixel]).as_dvec3();
            let eye = camera.eye_from_world.transform_point3(position);
            let rounding = 1e-5 * (position.length() + eye.length());
            assert!(
                (eye.z - f64::from(depth)).abs() < rounding,
                "{name}, pixel {pixel}"
            );
            let corner = DVec2::new(
                (pixel % grid.width as usize) as f64,
                (pixel / grid.width as usize) as f64,
            );
            let place = grid.pixels_from_image(camera.image_from_eye(eye)) - corner;
            let off = (place - 0.5).abs().max_element() - 0.5;
            assert!(off < 1e-2, "{name}, pixel {pixel}: {off} outside");
            // Neither before nor behind what the face has.
            let plane = map.faces.face_nearness(face);
            let depths = map
                .faces
                .outline(face)
                .iter()
                .map(|&vertex| camera.eye_from_image(vertex, plane.at(vertex)).z);
            let (least, farthest) =
                depths.fold((f64::INFINITY, 0.0f64), |(a, b), z| (a.min(z), b.max(z)));
            let depth = f64::from(depth);
            assert!(least * (1.0 - 1e-6) <= depth && depth <= farthest * (1.0 + 1e-6));

            let normal = Vec3::from(made(&aovs.normal)[pixel]);
            assert!(
                (normal.length() - 1.0).abs() < 1e-5,
                "{name}, pixel {pixel}"
            );
        }
        assert!(
            seen * 4 > of_pixels.len(),
            "{name}: {seen} pixels show something"
        );
        for (pixel, light) in picture.pixels.iter().enumerate() {
            let nothing = made(&aovs.object)[pixel] == Aovs::NOTHING;
            assert_eq!(nothing, light[3] == 0.0, "{name}, pixel {pixel}");
            assert_eq!(nothing, made(&aovs.depth)[pixel] == Aovs::FARTHEST);
        }
    }
}

#[test]
fn mattes_are_the_exact_coverage_and_sum_up_to_opacity() {
    let mut overlapping = 0;
    for (name, scene, camera, grid) in cases() {
        let map = find_visibility(&scene, &camera);
        let (picture, aovs) = render_channels(&scene, &map, &grid, false, Filter::Box, ALL);
        let of_pixels = faces_of_pixels(&map, &grid);
        let matte = made(&aovs.object_matte);
        for (pixel, shown) in of_pixels.iter().enumerate() {
            let mut expected = BTreeMap::new();
            for &(face, area) in shown {
                let object = &scene.object(map.faces.object(face)).name;
                *expected.entry(object.as_str()).or_insert(0.0) += area;
            }
            let found = areas(matte, pixel);
            overlapping += usize::from(found.len() > 1);
            let named = |name: &str| scene.objects.iter().position(|object| object.name == name);
            for (thing, area) in expected {
                let row = named(thing).expect("an object") as u32;
                let off = f64::from(found.get(&row).copied().unwrap_or(0.0)) - area;
                assert!(off.abs() < 1e-6, "{name}, pixel {pixel}, {thing}: {off}");
            }
            let sum: f64 = found.values().map(|&area| f64::from(area)).sum();
            let opacity = f64::from(picture.pixels[pixel][3]);
            assert!(
                (sum - opacity).abs() < 1e-6,
                "{name}, pixel {pixel}: {sum}, {opacity}"
            );
        }
        assert!(matte.most <= matte.ranks);
    }
    assert!(
        overlapping > 100,
        "{overlapping} pixels show several objects"
    );
}

#[test]
fn albedo_is_the_picture_without_light() {
    for (name, scene, camera, grid) in cases() {
        let map = find_visibility(&scene, &camera);
        let aovs = render_channels(&scene, &map, &grid, false, Filter::Box, ALL).1;
        let unlit: Picture = pipeline::render_window(&scene, &map, &grid, true);
        for (albedo, &[r, g, b, _]) in made(&aovs.albedo).iter().zip(&unlit.pixels) {
            let off = (Vec3::from(*albedo) - Vec3::new(r, g, b))
                .abs()
                .max_element();
            assert!(off < 1e-5, "{name}: {albedo:?}");
        }
    }
}

#[test]
fn strips_and_threads_change_no_channel() {
    let case = generate::by_name("leaves20").expect("a scene");
    let settings = RenderSettings {
        width: 120,
        height: 77,
        aovs: ALL,
        ..RenderSettings::default()
    };
    let rendered = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("a thread pool");
        pool.install(|| pipeline::render(&case.scene, &case.camera, &settings, |_| {}).aovs)
    };
    // More faces than pixels: strip by strip.
    let strips = rendered(1);
    assert!(strips == rendered(3));

    let map = find_visibility(&case.scene, &case.camera);
    let grid = PixelGrid::of_frame(settings.width, settings.height);
    assert!(map.faces.len() > grid.pixel_count());
    let whole = render_channels(&case.scene, &map, &grid, false, Filter::Box, ALL).1;
    let count = grid.pixel_count();
    let same = (0..count).filter(|&pixel| made(&strips.face)[pixel] == made(&whole.face)[pixel]);
    // Where two faces cover about as much, the last digits decide.
    assert!(same.count() * 1000 > count * 999);
    for pixel in 0..count {
        let [a, b] = [&strips, &whole].map(|aovs| areas(made(&aovs.object_matte), pixel));
        for thing in a.keys().chain(b.keys()) {
            let area = |of: &BTreeMap<u32, f32>| of.get(thing).copied().unwrap_or(0.0);
            assert!(
                (area(&a) - area(&b)).abs() < 1e-6,
                "pixel {pixel}, object {thing}"
            );
        }
    }
}
