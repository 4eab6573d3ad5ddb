//! Pictures against those of other ways to make them.

use crate::panes::scene_of;
use crate::rng::Rng;
use crate::{
    ASKEW, LENSES, along_ray, ball_around, eye, lens, panes_around, picture_of, projection,
};
use crate::{scene_direction, size_of};
use veduta::accumulate::Picture;
use veduta::geometry::{DMat4, DVec2, DVec3, Vec2};
use veduta::map::{self, MaterialId};
use veduta::pipeline::{self, RenderSettings};
use veduta::reproject::{Lens, Orientation, Projection};
use veduta::scene::{Image, ImageId, Material, Mesh, MeshId, Object, Scene, TextureRef};

#[test]
fn the_cube_may_be_turned_any_way() {
    let mut rng = Rng::new(3);
    let scene = scene_of(&panes_around(&mut rng, 120, true));
    for name in LENSES {
        let lens = lens(name);
        let [width, height] = size_of(lens, 45);
        let [a, b] = [
            eye(DVec3::Z, 0.0),
            eye(DVec3::new(-0.4, 1.0, 0.6), 1.0 + rng.unit()),
        ]
        .map(|eye| {
            let projection = projection(&eye, lens, ASKEW, width, height);
            picture_of(&scene, &eye, &projection)
        });
        for (pixel, (a, b)) in a.pixels.iter().zip(&b.pixels).enumerate() {
            for (a, b) in a.iter().zip(b) {
                let [column, row] = [pixel as u32 % width, pixel as u32 / width];
                assert!((a - b).abs() < 1e-5, "{name}, {column} {row}: {a} and {b}");
            }
        }
    }
}

/// Rays along each side of a pixel.
const RAYS: u32 = 16;

#[test]
fn a_picture_is_that_of_many_rays() {
    let mut rng = Rng::new(4);
    let panes = panes_around(&mut rng, 60, true);
    let scene = scene_of(&panes);
    let eye = eye(DVec3::X, 0.3);
    for name in LENSES {
        let lens = lens(name);
        let [width, height] = size_of(lens, 24);
        let projection = projection(&eye, lens, ASKEW, width, height);
        let picture = picture_of(&scene, &eye, &projection);
        let mut squares = 0.0;
        let mut count = 0;
        for row in 0..height {
            for column in 0..width {
                // Around the pole one needs more rays than anyone has time for.
                let at_pole = lens == Lens::Equirect && (row == 0 || row == height - 1);
                if projection.coverage(column, row) < 1.0 - 1e-9 || at_pole {
                    continue;
                }
                let mut sum = [0.0; 4];
                for ray in 0..RAYS * RAYS {
                    let [i, j] = [ray % RAYS, ray / RAYS].map(f64::from);
                    let within = DVec2::new(i + rng.unit(), j + rng.unit()) / f64::from(RAYS);
                    let corner = DVec2::new(f64::from(column), f64::from(row));
                    let direction = scene_direction(&eye, &projection, corner + within);
                    let seen = along_ray(&panes, direction.expect("covered"));
                    sum = std::array::from_fn(|channel| sum[channel] + seen[channel]);
                }
                let pixel = picture.pixels[(row * width + column) as usize];
                for (found, sum) in pixel.into_iter().zip(sum) {
                    let expected = sum / f64::from(RAYS * RAYS);
                    let off = f64::from(found) - expected;
                    assert!(
                        off.abs() < 0.1,
                        "{name}, {column} {row}: {found} and not {expected}"
                    );
                    squares += off * off;
                    count += 1;
                }
            }
        }
        let rms = (squares / f64::from(count)).sqrt();
        // Of a stratified sample; an edge that is misplaced by a tenth of a pixel would make more.
        assert!(rms < 0.006, "{name}: off by {rms}");
    }
}

/// A ground with a chequered picture and a few walls, in the light.
pub fn lit_ground() -> Scene {
    let texels = [[20, 40, 60, 255], [220, 200, 180, 255]];
    let image = Image {
        name: "squares".into(),
        width: 8,
        height: 8,
        pixels: (0..64)
            .map(|k| texels[(k % 8 / 2 + k / 8 / 2) % 2])
            .collect(),
    };
    let square = |corner: DVec3, along: DVec3, up: DVec3| Mesh {
        positions: vec![corner, corner + along, corner + along + up, corner + up],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        texcoords: [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)]
            .map(Vec2::from)
            .to_vec(),
        materials: vec![(0, MaterialId(0))],
        ..Mesh::default()
    };
    let meshes = vec![
        square(
            DVec3::new(-9.0, -9.0, -1.5),
            18.0 * DVec3::X,
            18.0 * DVec3::Y,
        ),
        square(DVec3::new(-3.0, 4.0, -1.5), 4.0 * DVec3::X, 4.0 * DVec3::Z),
        square(
            DVec3::new(2.0, 3.0, -1.5),
            DVec3::new(1.0, 3.0, 0.0),
            3.0 * DVec3::Z,
        ),
    ];
    let objects = (0..meshes.len()).map(|k| Object {
        name: k.to_string(),
        mesh: MeshId(k as u32),
        world_from_object: DMat4::IDENTITY,
    });
    Scene {
        objects: objects.collect(),
        meshes,
        images: vec![image],
        materials: vec![Material {
            base_color_texture: Some(TextureRef::new(ImageId(0))),
            double_sided: true,
            ..Material::default()
        }],
        ..Scene::default()
    }
}

/// Pixels along the side of the squares in which means are compared.
const SQUARE: u32 = 8;

#[test]
fn filtered_pictures_of_the_cubes_faces_have_the_same_means() {
    let scene = ball_around(&mut Rng::new(7), 10, 14);
    let eye = eye(DVec3::Z, 0.2);
    for name in ["domemaster", "omnimax:full", "equirect", "ball"] {
        let lens = lens(name);
        let [width, height] = size_of(lens, 96);
        let projection = projection(&eye, lens, ASKEW, width, height);
        let exact = picture_of(&scene, &eye, &projection);
        let (filtered, faces) =
            pipeline::render_filtered(&scene, &eye, &projection, 192, true, |_| {});
        assert!(faces.len() > 3, "{name}: {faces:?}");
        let mut worst = 0.0_f64;
        let mut count = 0;
        for top in (0..height - SQUARE).step_by(SQUARE as usize) {
            for left in (0..width - SQUARE).step_by(SQUARE as usize) {
                let pixels = (0..SQUARE * SQUARE).map(|k| (left + k % SQUARE, top + k / SQUARE));
                let inside = |(x, y): (u32, u32)| projection.coverage(x, y) == 1.0;
                // Along a pole's row and a ball's rim, a footprint is no ellipse.
                let middle = projection.lens_from_image(DVec2::new(
                    f64::from(left + SQUARE / 2),
                    f64::from(top + SQUARE / 2),
                ));
                let is_plain = match name {
                    "ball" => middle.length() < 0.8,
                    "equirect" => middle.y.abs() < 0.35,
                    _ => true,
                };
                if !is_plain || !pixels.clone().all(inside) {
                    continue;
                }
                for channel in 0..4 {
                    let mean = |picture: &Picture| {
                        let values = pixels.clone().map(|(x, y)| {
                            f64::from(picture.pixels[(y * width + x) as usize][channel])
                        });
                        values.sum::<f64>() / f64::from(SQUARE * SQUARE)
                    };
                    worst = worst.max((mean(&exact) - mean(&filtered)).abs());
                    count += 1;
                }
            }
        }
        assert!(count > 100 && worst < 0.02, "{name}: off by {worst}");
    }
}

#[test]
fn a_perspective_lens_makes_what_a_camera_makes() {
    let scene = lit_ground();
    let mut camera = eye(DVec3::X, -0.2);
    let fov = 1.2_f64;
    let lens = Lens::Perspective { fov };
    let projection = Projection::new(lens, Orientation::default(), 90, 60);
    let surroundings = pipeline::find_surroundings(&scene, &camera, &projection, |_| {});
    let found = pipeline::render_surroundings(&scene, &surroundings, &projection, false).picture;
    camera.projection = map::Projection::Perspective {
        tan_half_height: (0.5 * fov).tan(),
        aspect: 1.5,
    };
    let settings = RenderSettings {
        width: 90,
        height: 60,
        ..RenderSettings::default()
    };
    let expected = pipeline::render(&scene, &camera, &settings, |_| {}).picture;
    let mut squares = 0.0;
    for (a, b) in found.pixels.iter().zip(&expected.pixels) {
        for (a, b) in a.iter().zip(b) {
            squares += f64::from(a - b).powi(2);
        }
    }
    let rms = (squares / (4.0 * 90.0 * 60.0)).sqrt();
    assert!(rms < 0.004, "off by {rms}");
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let scene = scene_of(&panes_around(&mut Rng::new(5), 80, true));
    let eye = eye(DVec3::Z, 0.5);
    let projection = projection(&eye, lens("fisheye:200"), ASKEW, 70, 70);
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a thread pool").install(|| {
            let picture = picture_of(&scene, &eye, &projection);
            let bits = |pixel: &[f32; 4]| pixel.map(f32::to_bits);
            picture.pixels.iter().map(bits).collect::<Vec<_>>()
        })
    };
    assert!(with_threads(1) == with_threads(3));
}
