//! Times the way from a visibility map to a picture, on one thread:
//! `cargo run --release -p veduta --example time_pixels`

use std::time::Instant;
use veduta::dice::{Bands, Dicer, Parts, PixelGrid, dice};
use veduta::filter::Filter;
use veduta::geometry::{DMat4, DVec2, DVec3, Vec3};
use veduta::map::{
    Affine, Camera, Faces, Fragments, MaterialId, ObjectId, Projection, VisibilityMap,
};
use veduta::pipeline::{RenderSettings, render_map};
use veduta::scene::{Image, ImageId, Material, Mesh, MeshId, Object, Scene, TextureRef};

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("a thread pool").install(|| {
        for (cells, width, height) in [(45, 512, 512), (336, 1920, 1080)] {
            let scene = scene(cells);
            let map = map_of(&scene);
            println!("{} fragments, {width} x {height}", map.opaque.len());
            let grid = PixelGrid::of_frame(width, height);
            let (mut dicer, mut parts) = (Dicer::default(), Parts::default());
            report("sorted into bands", || drop(Bands::new(&map, grid)));
            let bands = Bands::new(&map, grid);
            for varies in [false, true] {
                let name = if varies {
                    "diced with centroids"
                } else {
                    "diced"
                };
                report(name, || {
                    for band in 0..bands.len() {
                        dice(&map, &bands, band, |_| varies, &mut dicer, &mut parts);
                    }
                });
            }
            let flat = |scene: &Scene| {
                let mut scene = scene.clone();
                scene.meshes[0].normals.clear();
                scene.meshes[0].texcoords.clear();
                scene
            };
            let smooth = |scene: &Scene| {
                let mut scene = scene.clone();
                scene.meshes[0].texcoords.clear();
                scene
            };
            let (sharp, wide) = (Filter::Box, Filter::Mitchell);
            for (name, unlit, filter, scene) in [
                ("picture, unlit", true, sharp, flat(&scene)),
                ("picture, flat faces in light", false, sharp, flat(&scene)),
                ("picture, smooth normals", false, sharp, smooth(&scene)),
                ("filtered, smooth normals", false, wide, smooth(&scene)),
                ("picture, smooth and textured", false, sharp, scene.clone()),
                ("filtered, smooth and textured", false, wide, scene),
            ] {
                let settings = RenderSettings {
                    width,
                    height,
                    unlit,
                    filter,
                    ..RenderSettings::default()
                };
                report(name, || drop(render_map(&scene, &map, &settings)));
            }
        }
    });
}

fn report(name: &str, mut work: impl FnMut()) {
    let mut times: Vec<f64> = (0..15)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!("  {name:30} {:8.2} ms (median {:.2})", times[0], times[7]);
}

/// A waving sheet that fills the frame, in `2 * cells * cells` triangles.
fn scene(cells: u32) -> Scene {
    let mut mesh = Mesh {
        materials: vec![(0, MaterialId(0))],
        ..Mesh::default()
    };
    for j in 0..=cells {
        for i in 0..=cells {
            let uv = DVec2::new(f64::from(i), f64::from(j)) / f64::from(cells);
            let inner = |k: u32| f64::from(u32::from(k > 0 && k < cells));
            let wave = 0.3 / f64::from(cells) * (uv * 40.0).map(f64::sin);
            let flat = uv - 0.5 + DVec2::new(wave.y * inner(i), wave.x * inner(j));
            mesh.positions.push(DVec3::new(flat.x, -flat.y, 0.0));
            mesh.texcoords.push(uv.as_vec2());
            mesh.normals
                .push(Vec3::new(wave.x as f32, wave.y as f32, 1.0).normalize());
        }
    }
    for j in 0..cells {
        for i in 0..cells {
            let first = j * (cells + 1) + i;
            let [p, q, r, s] = [first, first + 1, first + cells + 1, first + cells + 2];
            mesh.triangles.push([p, r, q]);
            mesh.triangles.push([q, r, s]);
        }
    }
    let size = 1024;
    let image = Image {
        name: "pattern".into(),
        width: size,
        height: size,
        pixels: (0..size * size)
            .map(|k| [(k % 251) as u8, (k / size % 241) as u8, 99, 255])
            .collect(),
    };
    Scene {
        objects: vec![Object {
            name: "sheet".into(),
            mesh: MeshId(0),
            world_from_object: DMat4::IDENTITY,
        }],
        meshes: vec![mesh],
        materials: vec![Material {
            base_color_texture: Some(TextureRef::new(ImageId(0))),
            ..Material::default()
        }],
        images: vec![image],
        ..Scene::default()
    }
}

fn map_of(scene: &Scene) -> VisibilityMap {
    let projection = Projection::Parallel {
        height: 1.0,
        aspect: 1.0,
    };
    let camera = Camera::looking(DVec3::Z, DVec3::ZERO, DVec3::Y, projection, 0.0);
    let camera = camera.expect("a sound camera");
    let mut faces = Faces::new();
    let plane = faces.push_plane(Affine::new(0.0, 0.0, 1.0));
    let mut opaque = Fragments::new();
    let mesh = &scene.meshes[0];
    for (source, triangle) in mesh.triangles.iter().enumerate() {
        let outline = triangle.map(|corner| {
            let position = mesh.positions[corner as usize];
            camera.image_from_eye(camera.eye_from_world.transform_point3(position))
        });
        let face = faces.push(&outline, plane, ObjectId(0), source as u32);
        opaque.push_whole(face.expect("no triangle is flat"));
    }
    VisibilityMap {
        camera,
        faces,
        opaque,
        veils: Fragments::new(),
    }
}
