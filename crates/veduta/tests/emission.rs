//! Emission through the whole pipeline.

use veduta::accumulate::Picture;
use veduta::geometry::{DMat4, DVec3, Vec2};
use veduta::map::{Camera, MaterialId, Projection};
use veduta::pipeline::{RenderSettings, find_visibility, render_map};
use veduta::scene::{
    Image, ImageId, Material, Mesh, MeshId, Object, Scene, TexcoordSet, TextureRef, Wrap,
};

/// Width and height of the picture in pixels.
const SIZE: u32 = 64;
/// What the material gives off where its texture is white.
const EMISSIVE: [f32; 3] = [2.0, 0.5, 0.25];

/// A square that fills the frame. Its first texture coordinates are all on the dark half of a picture
/// of two pixels; its second ones go over the picture, whose right half shines.
fn square(texture: Option<TextureRef>, unlit: bool) -> Scene {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let places = [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)];
    Scene {
        objects: vec![Object {
            name: "square".into(),
            mesh: MeshId(0),
            world_from_object: DMat4::IDENTITY,
        }],
        meshes: vec![Mesh {
            positions: corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            texcoords: vec![Vec2::new(0.25, 0.5); 4],
            second_texcoords: places.map(Vec2::from).to_vec(),
            materials: vec![(0, MaterialId(0))],
            ..Mesh::default()
        }],
        materials: vec![Material {
            emissive: if texture.is_some() {
                EMISSIVE
            } else {
                [0.0; 3]
            },
            emissive_texture: texture,
            unlit,
            ..Material::default()
        }],
        images: vec![Image {
            name: "halves".into(),
            width: 2,
            height: 1,
            pixels: vec![[0, 0, 0, 255], [255, 255, 255, 255]],
        }],
        ..Scene::default()
    }
}

fn picture(scene: &Scene) -> Picture {
    let projection = Projection::Parallel {
        height: 2.0,
        aspect: 1.0,
    };
    let eye = DVec3::new(0.0, 0.0, 5.0);
    let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Y, projection, 0.0);
    let map = find_visibility(scene, &camera.expect("a sound camera"));
    let settings = RenderSettings {
        width: SIZE,
        height: SIZE,
        ..RenderSettings::default()
    };
    render_map(scene, &map, &settings)
}

/// What a texture adds to the picture at a share of its width, in the middle of its height.
fn added(texture: TextureRef, across: f64, unlit: bool) -> [f32; 3] {
    let [with, without] = [Some(texture), None].map(|texture| picture(&square(texture, unlit)));
    let pixel = (SIZE / 2 * SIZE) as usize + (across * f64::from(SIZE)) as usize;
    std::array::from_fn(|k| with.pixels[pixel][k] - without.pixels[pixel][k])
}

fn assert_near(found: [f32; 3], expected: [f32; 3]) {
    let off = found.iter().zip(expected).map(|(f, e)| (f - e).abs());
    assert!(
        off.fold(0.0, f32::max) < 1e-5,
        "{found:?} and not {expected:?}"
    );
}

#[test]
fn an_emissive_texture_adds_light_where_its_own_coordinates_put_it() {
    let clamped = TextureRef {
        wrap: [Wrap::Clamp; 2],
        texcoords: TexcoordSet::Second,
        ..TextureRef::new(ImageId(0))
    };
    assert_near(added(clamped, 0.1, false), [0.0; 3]);
    assert_near(added(clamped, 0.9, false), EMISSIVE);
    // In the middle two texels meet.
    let half = added(clamped, 0.5 - 0.5 / f64::from(SIZE), false);
    let at_middle = 0.5 - 2.0 * 0.5 / SIZE as f32;
    assert_near(half, EMISSIVE.map(|part| part * at_middle));
    // By the first coordinates all of the square is on the dark half.
    let first = TextureRef {
        texcoords: TexcoordSet::First,
        ..clamped
    };
    assert_near(added(first, 0.9, false), [0.0; 3]);
}

#[test]
fn what_is_shown_as_it_is_does_not_shine() {
    let texture = TextureRef {
        texcoords: TexcoordSet::Second,
        ..TextureRef::new(ImageId(0))
    };
    assert_eq!(added(texture, 0.9, true), [0.0; 3]);
}
