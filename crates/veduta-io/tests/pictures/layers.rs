//! EXR files with layers, decoded here on their own: nothing of the writer is used to read them.

use crate::OneFile;
use exr::prelude::{AttributeValue, FlatSamples, ReadChannels, ReadLayers};
use std::collections::BTreeMap;
use veduta::accumulate::{AovSettings, Aovs, Picture};
use veduta::dice::{PixelGrid, coverage};
use veduta::filter::Filter;
use veduta::geometry::{DMat4, DVec3};
use veduta::map::{Camera, MaterialId, Projection, VisibilityMap};
use veduta::pipeline::{find_visibility, render_channels};
use veduta::scene::{Material, Mesh, MeshId, Object, Scene};
use veduta_io::{
    ExrCompression, Layers, PictureOptions, Samples, read_picture, stream_layers, write_layers,
};

/// Forty triangles here and there, some as thin as a wire, with names of every kind.
fn scene() -> Scene {
    let mut state = 7_u64;
    let mut unit = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    let mut scene = Scene::default();
    for index in 0..40 {
        let size = if index % 3 == 0 { 0.05 } else { 0.6 };
        let middle = DVec3::new(2.0 * unit() - 1.0, 2.0 * unit() - 1.0, unit());
        let mut corner = |size: f64| {
            middle + DVec3::new(size * (unit() - 0.5), unit() - 0.5, 0.4 * (unit() - 0.5))
        };
        scene.meshes.push(Mesh {
            positions: vec![corner(size), corner(size), corner(size)],
            triangles: vec![[0, 1, 2]],
            materials: vec![(0, MaterialId(index % 4))],
            ..Mesh::default()
        });
        let name = match index {
            3 => "Dach \"Süd\"\\\u{1f3e0}".to_owned(),
            4 => String::new(),
            // Two objects of one name.
            5 | 6 => "pair".to_owned(),
            _ => format!("town/thing {index}"),
        };
        scene.objects.push(Object {
            name,
            mesh: MeshId(index),
            world_from_object: DMat4::IDENTITY,
        });
    }
    for (name, base_color) in [
        ("red", [0.8, 0.1, 0.1, 1.0]),
        ("green", [0.1, 0.8, 0.1, 1.0]),
        ("blue", [0.1, 0.1, 0.8, 1.0]),
        ("", [0.5, 0.5, 0.5, 1.0]),
    ] {
        scene.materials.push(Material {
            name: name.into(),
            base_color,
            ..Material::default()
        });
    }
    scene
}

const SIZE: (u32, u32) = (19, 14);

/// What is made of the scene, with so many ranks.
struct Made {
    scene: Scene,
    map: VisibilityMap,
    picture: Picture,
    aovs: Aovs,
}

fn made(ranks: usize) -> Made {
    let scene = scene();
    let projection = Projection::Parallel {
        height: 2.0,
        aspect: 1.0,
    };
    let eye = DVec3::new(0.0, 0.0, 5.0);
    let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Y, projection, 0.0);
    let map = find_visibility(&scene, &camera.expect("a sound camera"));
    let settings = AovSettings {
        depth: true,
        normal: true,
        position: true,
        albedo: true,
        object: true,
        material: true,
        face: true,
        object_ranks: ranks,
        material_ranks: ranks,
    };
    let grid = PixelGrid::of_frame(SIZE.0, SIZE.1);
    let (picture, aovs) = render_channels(&scene, &map, &grid, false, Filter::Box, settings);
    Made {
        scene,
        map,
        picture,
        aovs,
    }
}

impl Made {
    fn layers(&self) -> Layers<'_> {
        Layers {
            aovs: &self.aovs,
            scene: &self.scene,
            camera: &self.map.camera,
            grid: PixelGrid::of_frame(SIZE.0, SIZE.1),
        }
    }

    fn encoded(&self, options: &PictureOptions) -> Vec<u8> {
        let mut bytes = Vec::new();
        stream_layers(&mut bytes, &self.picture, &self.layers(), options).expect("can be encoded");
        bytes
    }
}

/// The channels of a file by name, and the texts of its header.
struct Decoded {
    channels: BTreeMap<String, FlatSamples>,
    texts: BTreeMap<String, String>,
}

fn decoded(bytes: &[u8]) -> Decoded {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(bytes))
        .expect("an EXR");
    let layer = image.layer_data;
    let channels = layer.channel_data.list.into_iter();
    let texts = layer.attributes.other.into_iter();
    Decoded {
        channels: channels
            .map(|channel| (channel.name.to_string(), channel.sample_data))
            .collect(),
        texts: texts
            .filter_map(|(name, value)| match value {
                AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
                _ => None,
            })
            .collect(),
    }
}

impl Decoded {
    fn floats(&self, name: &str) -> Vec<f32> {
        match &self.channels[name] {
            FlatSamples::F32(samples) => samples.clone(),
            FlatSamples::F16(samples) => samples.iter().map(|sample| sample.to_f32()).collect(),
            FlatSamples::U32(_) => panic!("{name} has whole numbers"),
        }
    }

    fn numbers(&self, name: &str) -> &[u32] {
        match &self.channels[name] {
            FlatSamples::U32(samples) => samples,
            _ => panic!("{name} has no whole numbers"),
        }
    }

    /// By name what each thing covers of each pixel, as a compositing program finds it: from the
    /// header's manifest alone.
    fn cryptomatte(&self, layer: &str) -> BTreeMap<String, Vec<f64>> {
        let key = format!("{:08x}", murmur(layer.as_bytes()));
        let text = |what: &str| &self.texts[&format!("cryptomatte/{}/{what}", &key[..7])];
        assert_eq!(text("name"), layer);
        assert_eq!(text("hash"), "MurmurHash3_32");
        assert_eq!(text("conversion"), "uint32_to_float32");
        let manifest: BTreeMap<String, String> =
            serde_json::from_str(text("manifest")).expect("JSON");
        let pairs: Vec<(Vec<f32>, Vec<f32>)> = (0..)
            .map_while(|number| {
                let name = |letter: &str| format!("{layer}{number:02}.{letter}");
                self.channels.contains_key(&name("R")).then(|| {
                    let [r, g, b, a] =
                        ["R", "G", "B", "A"].map(|letter| self.floats(&name(letter)));
                    [(r, g), (b, a)]
                })
            })
            .flatten()
            .collect();
        let mut mattes = BTreeMap::new();
        for (name, id) in &manifest {
            let id = f32::from_bits(u32::from_str_radix(id, 16).expect("hexadecimal digits"));
            assert_eq!(id, id_of(murmur(name.as_bytes())), "{name}");
            let mut matte = vec![0.0; (SIZE.0 * SIZE.1) as usize];
            for (ids, areas) in &pairs {
                for (sum, (found, area)) in matte.iter_mut().zip(ids.iter().zip(areas)) {
                    if *found == id {
                        *sum += f64::from(*area);
                    }
                }
            }
            mattes.insert(name.clone(), matte);
        }
        mattes
    }
}

/// MurmurHash3_32 of seed 0, byte by byte.
fn murmur(bytes: &[u8]) -> u32 {
    let mix = |word: u32| {
        word.wrapping_mul(0xcc9e2d51)
            .rotate_left(15)
            .wrapping_mul(0x1b873593)
    };
    let (mut hash, mut word) = (0_u32, 0_u32);
    for (at, &byte) in bytes.iter().enumerate() {
        word |= u32::from(byte) << (8 * (at % 4));
        if at % 4 == 3 {
            hash = (hash ^ mix(word))
                .rotate_left(13)
                .wrapping_mul(5)
                .wrapping_add(0xe6546b64);
            word = 0;
        }
    }
    hash ^= mix(word) ^ bytes.len() as u32;
    hash = (hash ^ (hash >> 16)).wrapping_mul(0x85ebca6b);
    hash = (hash ^ (hash >> 13)).wrapping_mul(0xc2b2ae35);
    hash ^ (hash >> 16)
}

/// The specification's words: mantissa and sign of the hash, the exponent kept within 1 to 254.
fn id_of(hash: u32) -> f32 {
    let exponent = ((hash >> 23) & 0xff).clamp(1, 254);
    f32::from_bits((hash & 0x807f_ffff) | (exponent << 23))
}

/// What each thing covers of each pixel, by its name.
fn exact(made: &Made, name_of: impl Fn(usize, u32) -> String) -> BTreeMap<String, Vec<f64>> {
    let mut mattes = BTreeMap::new();
    for row in coverage(&made.map, &PixelGrid::of_frame(SIZE.0, SIZE.1)) {
        let faces = &made.map.faces;
        let name = name_of(faces.object(row.face).index(), faces.source(row.face));
        let matte = mattes
            .entry(name)
            .or_insert_with(|| vec![0.0; (SIZE.0 * SIZE.1) as usize]);
        matte[row.pixel] += row.area;
    }
    mattes
}

fn named(name: &str) -> String {
    if name.is_empty() {
        "(without name)".into()
    } else {
        name.into()
    }
}

#[test]
fn a_cryptomatte_tells_the_exact_coverage_of_every_name() {
    let made = made(40);
    let file = decoded(&made.encoded(&PictureOptions::default()));
    let alpha = file.floats("A");
    let objects = exact(&made, |object, _| named(&made.scene.objects[object].name));
    let materials = exact(&made, |object, face| {
        let material = made.scene.meshes[object].material_of(face);
        named(&made.scene.materials[material.index()].name)
    });
    for (layer, expected) in [("CryptoObject", objects), ("CryptoMaterial", materials)] {
        let found = file.cryptomatte(layer);
        assert!(expected.len() > 3, "{layer}: {}", expected.len());
        for (name, expected) in &expected {
            for (pixel, (found, expected)) in found[name].iter().zip(expected).enumerate() {
                let off = (found - expected).abs();
                assert!(
                    off < 1e-6,
                    "{layer}, {name}, pixel {pixel}: {found}, {expected}"
                );
            }
        }
        for (pixel, &alpha) in alpha.iter().enumerate() {
            let sum: f64 = found.values().map(|matte| matte[pixel]).sum();
            assert!(
                (sum - f64::from(alpha)).abs() < 1e-6,
                "{layer}, pixel {pixel}: {sum}, {alpha}"
            );
        }
    }
    let names = made.scene.objects.iter().map(|object| named(&object.name));
    let of_manifest: Vec<String> = file.cryptomatte("CryptoObject").into_keys().collect();
    let expected: std::collections::BTreeSet<String> = names.collect();
    assert_eq!(of_manifest, expected.into_iter().collect::<Vec<_>>());
    assert!(made.layers().collisions().is_empty());
}

#[test]
fn where_ranks_do_not_suffice_the_smallest_are_left_out() {
    let (few, all) = (made(2), made(40));
    assert_eq!(
        few.aovs.object_matte.as_ref().map(|matte| matte.ranks),
        Some(2)
    );
    let [few, all] = [&few, &all].map(|made| decoded(&made.encoded(&PictureOptions::default())));
    assert!(!few.channels.contains_key("CryptoObject01.R"));
    let [few, all] = [&few, &all].map(|file| file.cryptomatte("CryptoObject"));
    let mut left_out = 0;
    for pixel in 0..(SIZE.0 * SIZE.1) as usize {
        let mut all: Vec<f64> = all.values().map(|matte| matte[pixel]).collect();
        all.sort_by(|a, b| b.total_cmp(a));
        let found: f64 = few.values().map(|matte| matte[pixel]).sum();
        assert!((found - all[0] - all[1]).abs() < 1e-6, "pixel {pixel}");
        left_out += usize::from(all[2] > 0.0);
    }
    assert!(left_out > 10, "{left_out} pixels show more than two");
}

#[test]
fn layers_come_back_whatever_the_encoding() {
    let made = made(6);
    let aovs = &made.aovs;
    fn of<T>(channel: &Option<Vec<T>>) -> &[T] {
        channel.as_deref().expect("it was asked for")
    }
    for (compression, tile, half) in [
        (ExrCompression::Zip, None, false),
        (ExrCompression::None, Some(8), false),
        (ExrCompression::Rle, None, false),
        (ExrCompression::Zips, Some(5), true),
        (ExrCompression::Piz, Some(16), true),
        (ExrCompression::Piz, None, false),
    ] {
        let options = PictureOptions {
            samples: half.then_some(Samples::F16),
            exr_compression: compression,
            exr_tile: tile,
            ..PictureOptions::default()
        };
        let case = format!("{compression:?} {tile:?} {half}");
        let file = decoded(&made.encoded(&options));
        assert_eq!(
            file.channels.len(),
            4 + 1 + 3 + 3 + 3 + 3 + 12 + 12,
            "{case}"
        );
        assert_eq!(file.floats("Z"), of(&aovs.depth), "{case}");
        for (k, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
            let along = |channel: &Option<Vec<[f32; 3]>>| -> Vec<f32> {
                of(channel).iter().map(|value| value[k]).collect()
            };
            assert_eq!(
                file.floats(&format!("P.{axis}")),
                along(&aovs.position),
                "{case}"
            );
            // Halves are right to 11 bits.
            let most = if half { 1.0 / 2048.0 } else { 0.0 };
            let letter = ["R", "G", "B"][k];
            for (name, expected) in [
                (format!("N.{axis}"), along(&aovs.normal)),
                (format!("albedo.{letter}"), along(&aovs.albedo)),
            ] {
                for (found, expected) in file.floats(&name).iter().zip(expected) {
                    assert!(
                        (found - expected).abs() <= most,
                        "{case}, {name}: {found}, {expected}"
                    );
                }
            }
        }
        for (name, numbers) in [
            ("id.object", &aovs.object),
            ("id.material", &aovs.material),
            ("id.face", &aovs.face),
        ] {
            let expected: Vec<u32> = of(numbers)
                .iter()
                .map(|&row| if row == Aovs::NOTHING { 0 } else { row + 1 })
                .collect();
            assert_eq!(file.numbers(name), expected, "{case}");
            assert!(expected.contains(&0) && expected.iter().any(|&id| id > 0));
        }
        // Who looks for a picture only finds it.
        let place = OneFile::new("picture.exr");
        write_layers(&place.path, &made.picture, &made.layers(), &options).expect("can be written");
        assert_eq!(
            std::fs::read(&place.path).expect("is there"),
            made.encoded(&options)
        );
        let read = read_picture(&place.path).expect("can be read").picture;
        for (a, b) in read
            .pixels
            .iter()
            .flatten()
            .zip(made.picture.pixels.iter().flatten())
        {
            assert!(
                (a - b).abs() <= if half { 1.0 / 1024.0 } else { 0.0 },
                "{case}"
            );
        }
    }
}

#[test]
fn every_encoding_gives_the_same_bytes() {
    let made = made(6);
    let first = made.encoded(&PictureOptions::default());
    // Ten runs would agree by chance once in 40,000^10.
    for _ in 0..10 {
        assert!(made.encoded(&PictureOptions::default()) == first);
    }
}

#[test]
fn layers_of_another_size_are_refused() {
    let mut made = made(6);
    made.aovs.face.as_mut().expect("it was asked for").pop();
    let options = PictureOptions::default();
    let refused = stream_layers(&mut Vec::new(), &made.picture, &made.layers(), &options);
    let message = refused.expect_err("a pixel is missing").to_string();
    assert!(
        message.contains("a layer has 265 pixels, and the picture 266"),
        "{message}"
    );
}
