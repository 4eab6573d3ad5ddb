//! Scenes made by formula: the test pictures of Tanaka & Takahashi 1991, and harder ones.
//!
//! Each has a name and is the same on every run of one binary. (Between platforms the last bits of
//! sines and cosines may differ.) Faces are unlit and of one colour each, except for the height
//! fields, whose colours blend from vertex to vertex; so a picture of them costs visibility alone.
//! Closed bodies are seen from outside only. Where the paper tells a number of polygons, the scene
//! has as many triangles.
//!
//! | name | what |
//! | --- | --- |
//! | `radial` | 80 thin triangles about a centre |
//! | `mesh0`, `mesh5` | 25 wires across 25, 0.05 px thick and 20 px apart at 512 rows; axis-parallel, and turned by 5 degrees |
//! | `bridge` | a suspension bridge, its hangers and rails thinner than a pixel |
//! | `buildings` | a small town of 151 triangles |
//! | `balls3`, `balls7` | three balls, 10,450 triangles; seven balls, 16,150 |
//! | `pierce` | two balls that pierce each other, 6,724 triangles |
//! | `soup` | 2,000 large random triangles that pierce one another everywhere |
//! | `wires` | 3,000 random wires, 0.05 px thick at 1080 rows |
//! | `leaves20`, `leaves100`, `leaves400` | that many thousand random leaves with gaps between them |
//! | `field100k`, `field1m`, `field10m` | height fields of about that many triangles, seen at a grazing angle |
//! | `layers` | 16 sheets of small triangles, each across the whole picture |

mod balls;
mod bridge;
mod buildings;
mod clutter;
mod field;
mod patchwork;
mod patterns;
mod random;
mod view;

use crate::scene::Scene;
use veduta_map::Camera;

/// A scene made by formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Generated {
    /// The scene.
    pub scene: Scene,
    /// The camera it is made for.
    pub camera: Camera,
    /// Width and height in pixels of the picture it is made for. Other sizes work as well.
    pub size: [u32; 2],
}

/// The names that [`by_name`] knows.
pub const NAMES: &[&str] = &[
    "radial",
    "mesh0",
    "mesh5",
    "bridge",
    "buildings",
    "balls3",
    "balls7",
    "pierce",
    "soup",
    "wires",
    "leaves20",
    "leaves100",
    "leaves400",
    "field100k",
    "field1m",
    "field10m",
    "layers",
];

/// The scene of that name, for a picture of its own [`size`](Generated::size); `None` for a name
/// that is not in [`NAMES`].
pub fn by_name(name: &str) -> Option<Generated> {
    let aspect = match name {
        "radial" | "mesh0" | "mesh5" | "bridge" | "buildings" | "balls3" | "balls7" | "pierce" => {
            1.0
        }
        _ => 16.0 / 9.0,
    };
    by_name_for_aspect(name, aspect)
}

/// The scene of that name for a picture of another shape; `None` for a name that is not in
/// [`NAMES`].
///
/// The view is as high as ever and `aspect` times as wide. Random faces are strewn over all of it.
///
/// # Panics
/// If `aspect`, the width over the height, is not positive and finite.
pub fn by_name_for_aspect(name: &str, aspect: f64) -> Option<Generated> {
    assert!(
        aspect > 0.0 && aspect.is_finite(),
        "a picture's width over its height is positive, not {aspect}"
    );
    Some(match name {
        "radial" => patterns::radial(aspect),
        "mesh0" => patterns::wire_mesh(0.0, aspect),
        "mesh5" => patterns::wire_mesh(5.0, aspect),
        "bridge" => bridge::suspension_bridge(aspect),
        "buildings" => buildings::town(aspect),
        "balls3" => balls::three(aspect),
        "balls7" => balls::seven(aspect),
        "pierce" => balls::piercing(aspect),
        "soup" => clutter::soup(2_000, aspect),
        "wires" => clutter::wires(3_000, aspect),
        "leaves20" => clutter::foliage(20_000, aspect),
        "leaves100" => clutter::foliage(100_000, aspect),
        "leaves400" => clutter::foliage(400_000, aspect),
        "field100k" => field::height_field(224, aspect),
        "field1m" => field::height_field(708, aspect),
        "field10m" => field::height_field(2236, aspect),
        "layers" => clutter::layers(60, aspect),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Bounds;
    use veduta_geometry::{DVec2, DVec3};

    /// All but the largest, which takes a second and half a gigabyte.
    fn all() -> impl Iterator<Item = (&'static str, Generated)> {
        NAMES
            .iter()
            .filter(|name| **name != "field10m")
            .map(|name| (*name, by_name(name).expect("a name of the list")))
    }

    #[test]
    fn scenes_have_the_numbers_of_polygons_that_the_paper_tells() {
        for (name, faces) in [
            ("radial", 80),
            ("buildings", 151),
            ("balls3", 10_450),
            ("balls7", 16_150),
            ("pierce", 6_724),
            ("mesh0", 100),
            ("mesh5", 100),
            ("soup", 2_000),
            ("wires", 6_000),
            ("leaves20", 20_000),
            ("leaves100", 100_000),
            ("leaves400", 400_000),
            ("field100k", 100_352),
            ("field1m", 1_002_528),
            ("layers", 16 * 2 * 106 * 60),
        ] {
            let made = by_name(name).expect("a name of the list");
            assert_eq!(made.scene.face_count(), faces, "{name}");
        }
        assert!(by_name("no such scene").is_none());
    }

    #[test]
    fn scenes_are_sound_and_the_same_each_time() {
        for (name, made) in all() {
            for mesh in &made.scene.meshes {
                assert_eq!(mesh.check(), Ok(()), "{name}");
                let degenerate = mesh.triangles.iter().filter(|corners| {
                    let [a, b, c] = corners.map(|index| mesh.positions[index as usize]);
                    (b - a).cross(c - a) == DVec3::ZERO
                });
                assert_eq!(degenerate.count(), 0, "{name} has faces without area");
                let dull = mesh.colors.iter().flatten();
                assert!(
                    dull.clone().all(|value| (0.0..=1.0).contains(value)),
                    "{name}"
                );
            }
            assert_eq!(
                by_name(name).as_ref(),
                Some(&made),
                "{name} differs when made again"
            );
        }
    }

    /// Images of all corners, with their depths.
    fn images(made: &Generated) -> Vec<(DVec2, f64)> {
        let meshes = made.scene.meshes.iter();
        meshes
            .flat_map(|mesh| &mesh.positions)
            .map(|&position| {
                let eye = made.camera.eye_from_world.transform_point3(position);
                (made.camera.image_from_eye(eye), eye.z)
            })
            .collect()
    }

    #[test]
    fn patterns_and_foliage_lie_inside_the_picture() {
        for name in ["radial", "mesh0", "pierce", "leaves20"] {
            let made = by_name(name).expect("a name of the list");
            for (image, depth) in images(&made) {
                assert!(depth > made.camera.near, "{name}: {depth}");
                let inside = image.min_element() > 0.0 && image.max_element() < 1.0;
                assert!(inside, "{name} has a corner at {image}");
            }
        }
    }

    #[test]
    fn every_scene_is_before_the_eye_and_fills_its_picture() {
        for (name, made) in all().filter(|(name, _)| *name != "bridge") {
            let images = images(&made);
            assert!(
                images.iter().all(|(_, depth)| *depth > made.camera.near),
                "{name}"
            );
            let low = images
                .iter()
                .fold(DVec2::MAX, |low, (image, _)| low.min(*image));
            let high = images
                .iter()
                .fold(DVec2::MIN, |high, (image, _)| high.max(*image));
            let spread = high.min(DVec2::ONE) - low.max(DVec2::ZERO);
            assert!(spread.min_element() > 0.5, "{name} covers {low} to {high}");
        }
    }

    #[test]
    fn the_mesh_has_wires_a_twentieth_of_a_pixel_thick_in_both_directions() {
        let made = by_name("mesh0").expect("a name of the list");
        let mesh = &made.scene.meshes[0];
        let pixels = |index: u32| {
            let position = mesh.positions[index as usize];
            let eye = made.camera.eye_from_world.transform_point3(position);
            512.0 * made.camera.image_from_eye(eye)
        };
        let mut thin = [0, 0];
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(pixels);
            let size = a.max(b).max(c) - a.min(b).min(c);
            let across = if size.x < size.y { 0 } else { 1 };
            assert!((size[across] - 0.05).abs() < 1e-9, "{size}");
            thin[across] += 1;
        }
        assert_eq!(thin, [50, 50]);
    }

    #[test]
    fn bodies_seen_from_outside_only_have_their_fronts_outside() {
        // A ball's faces look away from its centre; the volume inside blocks is positive.
        for name in ["balls3", "balls7", "pierce"] {
            let made = by_name(name).expect("a name of the list");
            let balls = made
                .scene
                .objects
                .iter()
                .filter(|o| o.name.starts_with("ball"));
            for object in balls {
                let mesh = &made.scene.meshes[object.mesh.0 as usize];
                let count = mesh.positions.len() as f64;
                let centre = mesh.positions.iter().sum::<DVec3>() / count;
                for corners in &mesh.triangles {
                    let [a, b, c] = corners.map(|index| mesh.positions[index as usize]);
                    let outward = (b - a).cross(c - a).dot(a - centre);
                    assert!(outward > 0.0, "{name}: {}", object.name);
                }
            }
        }
        let volume = |mesh: &crate::scene::Mesh| -> f64 {
            let faces = mesh.triangles.iter();
            faces
                .map(|corners| {
                    let [a, b, c] = corners.map(|index| mesh.positions[index as usize]);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum()
        };
        let made = by_name("bridge").expect("a name of the list");
        for (name, expected) in [
            // A block and the roadway on it; four blocks.
            ("deck", 1800.0 * (25.0 * 2.8 + 23.0 * 0.4)),
            ("anchorages", 4.0 * 40.0 * 6.2 * 90.0),
        ] {
            let object = made.scene.objects.iter().find(|object| object.name == name);
            let mesh = object.expect("an object of the bridge").mesh;
            let found = volume(&made.scene.meshes[mesh.0 as usize]);
            assert!(
                (found - expected).abs() < 1e-6 * expected,
                "{name}: {found}"
            );
        }
    }

    #[test]
    fn rods_have_their_fronts_outside() {
        for to in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.3, -0.5, 0.4)] {
            let mut rod = patchwork::Patchwork::new();
            rod.rod(-to, to, 0.1, [1.0; 3]);
            let mut scene = Scene::default();
            rod.place(&mut scene, "rod", patchwork::Sides::Outer);
            let mesh = &scene.meshes[0];
            assert_eq!(mesh.triangles.len(), 8);
            for corners in &mesh.triangles {
                let [a, b, c] = corners.map(|index| mesh.positions[index as usize]);
                let mean = (a + b + c) / 3.0;
                let outward = mean - to * mean.dot(to) / to.length_squared();
                assert!((b - a).cross(c - a).dot(outward) > 0.0, "along {to}");
            }
        }
    }

    #[test]
    fn the_bridge_stands_between_its_banks() {
        let made = by_name("bridge").expect("a name of the list");
        let bounds = Bounds::of_scene(&made.scene).expect("faces");
        assert!(bounds.min.z < 0.0 && bounds.max.z > 150.0);
        let eye = |point| made.camera.eye_from_world.transform_point3(point);
        for tower in [-250.0, 250.0] {
            let top = made
                .camera
                .image_from_eye(eye(DVec3::new(tower, 0.0, 181.0)));
            let inside = top.min_element() > 0.02 && top.max_element() < 0.98;
            assert!(inside, "the tower's top is seen at {top}");
        }
    }
}
