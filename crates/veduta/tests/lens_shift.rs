//! What a camera with a shifted lens sees is a part of what a wider one sees that looks the same way.

use veduta::accumulate::Picture;
use veduta::dice::PixelGrid;
use veduta::geometry::{DMat4, DVec2, DVec3, Vec3};
use veduta::map::{Camera, MaterialId, Projection};
use veduta::pipeline::{find_visibility, render_window};
use veduta::scene::{
    Image, ImageId, Material, Mesh, MeshId, Object, Scene, TextureRef, Wrap, generate,
};

/// Size of the shifted camera's picture.
const SIZE: [u32; 2] = [120, 90];
/// How much wider and higher the other camera sees.
const WIDER: u32 = 3;
/// Law 1: colours are stored in single precision.
const TOLERANCE: f32 = 1e-5;

/// To all sides, as far as the wider camera sees; and not by whole pixels.
const SHIFTS: [[f64; 2]; 5] = [
    [0.0, 0.25],
    [1.0, 0.0],
    [-0.333, -0.71],
    [0.125, -0.004],
    [-1.0, 1.0],
];

fn wider(camera: &Camera) -> Camera {
    let mut wider = *camera;
    match &mut wider.projection {
        Projection::Perspective {
            tan_half_height: size,
            ..
        }
        | Projection::Parallel { height: size, .. } => *size *= f64::from(WIDER),
    }
    wider
}

/// Fails unless the pictures are equal, and shows something.
fn assert_shifted_is_window(name: &str, scene: &Scene, camera: &Camera) {
    let [width, height] = SIZE;
    let camera = camera.with_aspect(f64::from(width) / f64::from(height));
    let wide_map = find_visibility(scene, &wider(&camera));
    let wide_grid = PixelGrid::of_frame(WIDER * width, WIDER * height);
    let mut covered = 0;
    for shift in SHIFTS.map(DVec2::from) {
        let shifted = Camera { shift, ..camera };
        let map = find_visibility(scene, &shifted);
        let own = PixelGrid::of_frame(width, height);
        let picture = render_window(scene, &map, &own, false);
        // The frame without shift lies in the middle of the wide one.
        let corner = 0.5 * f64::from(WIDER - 1) + DVec2::new(shift.x, -shift.y);
        let corner = corner * own.pixels_per_frame;
        let window = wide_grid.window(corner.x, corner.y, width, height);
        let expected = render_window(scene, &wide_map, &window, false);
        let differences = differences(&picture, &expected);
        assert!(
            differences < TOLERANCE,
            "{name}, shift {shift}: pictures differ by {differences}"
        );
        covered += expected
            .pixels
            .iter()
            .filter(|pixel| pixel[3] > 0.0)
            .count();
    }
    assert!(
        covered > 1000,
        "{name}: of all shifts {covered} pixels are covered"
    );
}

fn differences(a: &Picture, b: &Picture) -> f32 {
    let values = |picture: &Picture| picture.pixels.as_flattened().to_vec();
    let pairs = values(a).into_iter().zip(values(b));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// A textured floor that reaches behind the eye, and a smooth, lit tent.
///
/// They are two scenes: where one stands on the other the floor's fragments, and with them the
/// places at which its texture is looked at, are cut otherwise in another frame.
fn floor_and_tent() -> [Scene; 2] {
    let corners = [(-40.0, -40.0), (40.0, -40.0), (40.0, 40.0), (-40.0, 40.0)];
    let floor = Mesh {
        positions: corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        texcoords: corners
            .map(|(x, y)| (DVec2::new(x, y) / 4.0).as_vec2())
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        materials: vec![(0, MaterialId(0))],
        ..Mesh::default()
    };
    let peak = DVec3::new(0.0, 0.0, 9.0);
    let feet = [(-6.0, -6.0), (6.0, -6.0), (6.0, 6.0), (-6.0, 6.0)];
    let feet = feet.map(|(x, y)| DVec3::new(x, y, 0.0));
    let tent = Mesh {
        positions: [&feet[..], &[peak]].concat(),
        normals: feet
            .iter()
            .map(|foot| foot.as_vec3().normalize())
            .chain([Vec3::Z])
            .collect(),
        triangles: vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        materials: vec![(0, MaterialId(1))],
        ..Mesh::default()
    };
    let pixels = (0..16_u8).map(|k| [k * 16, 255 - k * 8, 40, 255]);
    let object = |mesh: u32| Object {
        name: format!("object {mesh}"),
        mesh: MeshId(mesh),
        world_from_object: DMat4::IDENTITY,
    };
    let both = Scene {
        objects: vec![],
        meshes: vec![floor, tent],
        materials: vec![
            Material {
                base_color_texture: Some(TextureRef {
                    wrap: [Wrap::Mirror; 2],
                    ..TextureRef::new(ImageId(0))
                }),
                ..Material::default()
            },
            Material::default(),
        ],
        images: vec![Image {
            name: "stripes".into(),
            width: 4,
            height: 4,
            pixels: pixels.collect(),
        }],
        ..Scene::default()
    };
    [0, 1].map(|mesh| Scene {
        objects: vec![object(mesh)],
        ..both.clone()
    })
}

#[test]
fn a_shifted_camera_sees_a_window_of_what_a_wider_one_sees() {
    for name in ["bridge", "pierce", "buildings"] {
        let made = generate::by_name(name).expect("a scene of the generator");
        assert_shifted_is_window(name, &made.scene, &made.camera);
    }
}

#[test]
fn textures_and_smooth_normals_shift_along_in_both_projections() {
    let [floor, tent] = floor_and_tent();
    for projection in [
        Projection::Perspective {
            tan_half_height: 0.3,
            aspect: 1.0,
        },
        Projection::Parallel {
            height: 12.0,
            aspect: 1.0,
        },
    ] {
        let eye = DVec3::new(9.0, -14.0, 6.0);
        let camera = Camera::looking(eye, DVec3::Z * 3.0, DVec3::Z, projection, 0.1);
        let camera = camera.expect("a sound camera");
        assert_shifted_is_window("floor", &floor, &camera);
        assert_shifted_is_window("tent", &tent, &camera);
    }
}

#[test]
fn uprights_stay_upright_where_a_turned_camera_makes_them_lean() {
    let projection = Projection::Perspective {
        tan_half_height: 0.4,
        aspect: 1.0,
    };
    let eye = DVec3::new(0.0, -20.0, 2.0);
    let looking = |at| Camera::looking(eye, at, DVec3::Z, projection, 0.1).expect("a sound camera");
    let level = looking(DVec3::new(0.0, 0.0, 2.0));
    let rising = Camera {
        shift: DVec2::new(0.0, 0.4),
        ..level
    };
    let turned = looking(DVec3::new(0.0, 0.0, 8.0));
    let lean = |camera: &Camera| {
        let at = |z| {
            let corner = DVec3::new(5.0, 0.0, z);
            camera.image_from_eye(camera.eye_from_world.transform_point3(corner))
        };
        at(14.0).x - at(0.0).x
    };
    assert!(lean(&rising).abs() < 1e-15, "{}", lean(&rising));
    assert!(lean(&turned) < -0.01, "{}", lean(&turned));
    // What was at the upper edge of the frame now is 0.4 of its height lower.
    let ridge = DVec3::new(0.0, 0.0, 10.0);
    let at = |camera: &Camera| camera.image_from_eye(camera.eye_from_world.transform_point3(ridge));
    assert!((at(&rising) - at(&level) - DVec2::new(0.0, 0.4)).length() < 1e-15);
}
