//! Scenes of two programs, as stored maps and as deep pictures, for `benches/peers/deep.py`.
//!
//! The deep pictures are what renderers of samples write: of each pixel, of each face that a sample hit
//! there, one deep sample, with the share of hits as its area. Areas become opacities such that each
//! file *alone* flattens to its own picture (see `veduta::accumulate`); what is lost when two are merged
//! is the merge's doing.

use crate::timing::on_one_thread;
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use veduta::accumulate::Picture;
use veduta::geometry::{DMat4, DVec2, DVec3};
use veduta::map::{
    Camera, FaceId, Fragment, MaterialId, Origin, Projection, SeenScene, VisibilityMap,
};
use veduta::pipeline::{RenderSettings, find_visibility, render_map};
use veduta::scene::{Material, Mesh, MeshId, Object, Scene, generate};
use veduta_io::deep_exr::{
    Channel, DeepCompression, DeepHeader, DeepPixels, DeepWriter, SampleType, Samples,
};
use veduta_io::{PictureOptions, read_picture, write_map, write_picture};

/// Two scenes of one camera.
pub struct Pair {
    parts: [Scene; 2],
    camera: Camera,
    /// Width and height of the pictures in pixels.
    size: [u32; 2],
}

impl Pair {
    /// - `cross`: hills, and balls and thin poles that stand in them;
    /// - `split`: the hills, every other square in the other scene, so that all edges are shared;
    /// - `dense`: the same with about a face for each pixel.
    ///
    /// # Errors
    /// A sentence about a name that is not known.
    pub fn by_name(name: &str) -> Result<Self, String> {
        let (hills, size) = match name {
            "cross" | "split" => ("field100k", [1920, 1080]),
            "dense" => ("field1m", [640, 360]),
            _ => {
                return Err(format!(
                    "there is no pair {name}; there are cross, split, dense"
                ));
            }
        };
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let made = generate::by_name_for_aspect(hills, aspect);
        let made = made.ok_or_else(|| format!("no scene is called {hills}"))?;
        let mut flat = Scene::default();
        for object in &made.scene.objects {
            let mesh = &made.scene.meshes[object.mesh.0 as usize];
            let positions = mesh.positions.clone();
            place(
                &mut flat,
                &object.name,
                positions,
                mesh.triangles.clone(),
                [0.55, 0.6, 0.4],
            );
        }
        let parts = if name == "cross" {
            [flat, balls_and_poles()]
        } else {
            [0, 1].map(|part| every_other_square(&flat, part))
        };
        Ok(Self {
            parts,
            camera: made.camera,
            size,
        })
    }

    /// Writes into `folder`: `a.veduta` and `b.veduta`, `a.exr` and `b.exr` of `samples` by `samples`
    /// samples a pixel, and `both.exr`, the exact picture of both scenes together. What there is to say
    /// of them, as JSON.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, folder: &Path, samples: u32) -> Result<String, String> {
        let mut faces = 0;
        let mut deep_samples = 0;
        for (scene, name) in self.parts.iter().zip(["a", "b"]) {
            let map = find_visibility(scene, &self.camera);
            let seen = SeenScene::of(scene, &map, self.size);
            faces += seen.map.faces.len();
            let stored = folder.join(name).with_extension("veduta");
            write_map(&stored, &seen, &Origin::default()).map_err(|error| error.to_string())?;
            let deep = folder.join(name).with_extension("exr");
            let written = write_deep(&deep, &seen, samples);
            deep_samples += written.map_err(|error| format!("{}: {error}", deep.display()))?;
        }
        let [first, second] = &self.parts;
        let both = united(first, second);
        let settings = RenderSettings {
            width: self.size[0],
            height: self.size[1],
            unlit: true,
            ..RenderSettings::default()
        };
        let picture =
            on_one_thread(|| render_map(&both, &find_visibility(&both, &self.camera), &settings));
        write_picture(
            &folder.join("both.exr"),
            &picture,
            &PictureOptions::default(),
        )
        .map_err(|error| error.to_string())?;
        Ok(format!(
            r#"{{"faces": {faces}, "deepSamples": {deep_samples}, "pixels": {}}}"#,
            u64::from(self.size[0]) * u64::from(self.size[1])
        ))
    }
}

/// How much a picture is off: shares of pixels of which a channel is off by more than 1, 2 and 16 times
/// 1/255, and the largest difference; as JSON.
///
/// # Errors
/// When one cannot be read, or they differ in size.
pub fn difference(exact: &Path, picture: &Path) -> Result<String, String> {
    let read = |path: &Path| -> Result<Picture, String> {
        Ok(read_picture(path)
            .map_err(|error| error.to_string())?
            .picture)
    };
    let (exact, picture) = (read(exact)?, read(picture)?);
    if (exact.width, exact.height) != (picture.width, picture.height) {
        return Err("the pictures differ in size".into());
    }
    let off: Vec<f32> = exact
        .pixels
        .iter()
        .zip(&picture.pixels)
        .map(|(a, b)| (0..4).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max))
        .collect();
    let share = |steps: f32| {
        let beyond = off.iter().filter(|&&off| off > steps / 255.0).count();
        beyond as f64 / off.len() as f64
    };
    let largest = off.iter().copied().fold(0.0, f32::max);
    let [one, two, sixteen] = [1.0, 2.0, 16.0].map(share);
    Ok(format!(
        r#"{{"over1": {one}, "over2": {two}, "over16": {sixteen}, "largest": {largest}}}"#
    ))
}

/// Shades of a colour.
const SHADES: u32 = 32;

/// Adds a mesh of flat colours: each triangle has one of the shades of `tint`, by how it is turned. Unlike
/// colours of vertices, materials let vertices be shared.
fn place(
    scene: &mut Scene,
    name: &str,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    tint: [f32; 3],
) {
    let first = scene.materials.len() as u32;
    for shade in 0..SHADES {
        let light = (shade as f32 + 0.5) / SHADES as f32;
        let [r, g, b] = tint.map(|channel| channel * light);
        scene.materials.push(Material {
            name: format!("{name} {shade}"),
            base_color: [r, g, b, 1.0],
            double_sided: false,
            unlit: true,
            ..Material::default()
        });
    }
    let sun = DVec3::new(-0.45, -0.6, 0.66).normalize();
    let mut materials: Vec<(u32, MaterialId)> = Vec::new();
    for (face, triangle) in (0..).zip(&triangles) {
        let [p, q, r] = triangle.map(|corner| positions[corner as usize]);
        let normal = (q - p).cross(r - p).normalize_or_zero();
        let shade = (0.5 * (1.0 + normal.dot(sun)) * f64::from(SHADES)) as u32;
        let material = MaterialId(first + shade.min(SHADES - 1));
        if materials.last().is_none_or(|last| last.1 != material) {
            materials.push((face, material));
        }
    }
    scene.objects.push(Object {
        name: name.into(),
        mesh: MeshId(scene.meshes.len() as u32),
        world_from_object: DMat4::IDENTITY,
    });
    scene.meshes.push(Mesh {
        positions,
        triangles,
        materials,
        ..Mesh::default()
    });
}

/// 20 balls and 80 poles over the hills, which they all stand in.
fn balls_and_poles() -> Scene {
    let mut scene = Scene::default();
    // Places without order that are the same everywhere: multiples of irrational numbers.
    let place_of = |index: u32| {
        let share = |by: f64| (f64::from(index) * by).fract();
        let (x, y) = (share(0.618_033_988_7), share(0.754_877_666_2));
        let y = 2.6 + 5.5 * y;
        DVec3::new(0.9 * y * (x - 0.5), y, -1.25 + 0.18 * (y - 2.2))
    };
    for index in 0..20 {
        let center = place_of(index) + 0.15 * DVec3::Z;
        let (positions, triangles) = ball(center, 0.16 + 0.01 * f64::from(index), [24, 12]);
        let tint = [[0.8, 0.2, 0.15], [0.2, 0.35, 0.8]][index as usize % 2];
        place(
            &mut scene,
            &format!("ball {index}"),
            positions,
            triangles,
            tint,
        );
    }
    for index in 0..80 {
        let (positions, triangles) = pole(place_of(100 + index), 0.006, 1.4);
        place(
            &mut scene,
            &format!("pole {index}"),
            positions,
            triangles,
            [0.9, 0.85, 0.7],
        );
    }
    scene
}

fn ball(center: DVec3, radius: f64, [columns, rows]: [u32; 2]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    for row in 0..=rows {
        let polar = 0.5 * TAU * f64::from(row) / f64::from(rows);
        for column in 0..columns {
            let around = TAU * f64::from(column) / f64::from(columns);
            let ring = polar.sin();
            let direction = DVec3::new(ring * around.cos(), ring * around.sin(), polar.cos());
            positions.push(center + radius * direction);
        }
    }
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let at = |row: u32, column: u32| row * columns + column % columns;
            let upper = [at(row, column), at(row, column + 1)];
            let lower = [at(row + 1, column), at(row + 1, column + 1)];
            if row > 0 {
                triangles.push([upper[0], lower[0], upper[1]]);
            }
            if row + 1 < rows {
                triangles.push([upper[1], lower[0], lower[1]]);
            }
        }
    }
    (positions, triangles)
}

/// A thin upright prism of six sides around `center`.
fn pole(center: DVec3, radius: f64, height: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    for end in [-0.5, 0.5] {
        for side in 0..6 {
            let around = TAU * f64::from(side) / 6.0;
            let out = DVec3::new(radius * around.cos(), radius * around.sin(), end * height);
            positions.push(center + out);
        }
    }
    let mut triangles = Vec::new();
    for side in 0..6 {
        let next = (side + 1) % 6;
        triangles.push([side, next, next + 6]);
        triangles.push([side, next + 6, side + 6]);
    }
    (positions, triangles)
}

/// Every other pair of triangles of each mesh, as on a chessboard of an odd number of columns.
fn every_other_square(scene: &Scene, part: u32) -> Scene {
    let mut dealt = scene.clone();
    for (object, mesh) in dealt.objects.iter_mut().zip(&mut dealt.meshes) {
        object.name = format!("{} {part}", object.name);
        let columns = ((mesh.face_count() / 2) as f64).sqrt() as u32;
        let faces: Vec<u32> = (0..mesh.face_count() as u32)
            .filter(|face| (face / 2 + face / 2 / columns) % 2 == part)
            .collect();
        *mesh = mesh.selected(&faces);
    }
    dealt
}

/// Both scenes as one.
fn united(first: &Scene, second: &Scene) -> Scene {
    let mut both = first.clone();
    let first_material = both.materials.len() as u32;
    both.materials.extend_from_slice(&second.materials);
    for object in &second.objects {
        let mut mesh = second.meshes[object.mesh.0 as usize].clone();
        for (_, material) in &mut mesh.materials {
            material.0 += first_material;
        }
        both.objects.push(Object {
            mesh: MeshId(both.meshes.len() as u32),
            ..object.clone()
        });
        both.meshes.push(mesh);
    }
    both
}

/// Writes the deep picture of `samples` by `samples` samples a pixel; the number of deep samples.
fn write_deep(path: &Path, seen: &SeenScene, samples: u32) -> std::io::Result<usize> {
    let [width, height] = seen.size;
    let channel = |(name, sample_type): (&str, SampleType)| Channel {
        name: name.into(),
        sample_type,
    };
    let types = [
        ("A", SampleType::Half),
        ("B", SampleType::Half),
        ("G", SampleType::Half),
        ("R", SampleType::Half),
        ("Z", SampleType::Float),
    ];
    let mut header = DeepHeader::new(width, height, types.map(channel).to_vec());
    header.compression = DeepCompression::Zips;
    let mut writer = DeepWriter::new(BufWriter::new(File::create(path)?), header)?;
    let mut count = 0;
    let rows = fragments_by_row(&seen.map, height);
    let mut hits = Hits::new(width, samples);
    for (row, fragments) in rows.iter().enumerate() {
        hits.sample(&seen.map, fragments, row as u32, height);
        let pixels = hits.deep_pixels(seen, row as u32, height);
        count += pixels.sample_count();
        writer.write(&pixels)?;
    }
    writer.finish()?.flush()?;
    Ok(count)
}

/// Of each row of pixels, the fragments that touch it.
fn fragments_by_row(map: &VisibilityMap, height: u32) -> Vec<Vec<usize>> {
    let mut rows = vec![Vec::new(); height as usize];
    for (index, fragment) in map.opaque.iter().enumerate() {
        let ys = map.polygon(fragment).iter().map(|point| point.y);
        let top = ys.clone().fold(f64::INFINITY, f64::min);
        let bottom = ys.fold(f64::NEG_INFINITY, f64::max);
        let row = |y: f64| ((y * f64::from(height)) as usize).min(height as usize - 1);
        for row in &mut rows[row(top)..=row(bottom)] {
            row.push(index);
        }
    }
    rows
}

/// What the samples of one row of pixels hit.
struct Hits {
    width: u32,
    /// Samples along each side of a pixel.
    samples: u32,
    /// Lines of samples; [`Hits::NOTHING`] where there is none.
    faces: Vec<u32>,
}

/// The samples of a pixel that hit one face.
struct Hit {
    face: FaceId,
    count: u32,
    /// Sum of their depths.
    depth: f64,
}

impl Hits {
    const NOTHING: u32 = u32::MAX;

    fn new(width: u32, samples: u32) -> Self {
        Self {
            width,
            samples,
            faces: vec![Self::NOTHING; (width * samples * samples) as usize],
        }
    }

    /// The height of a line of samples in the image plane.
    fn y_of(&self, row: u32, line: u32, height: u32) -> f64 {
        let line = (f64::from(line) + 0.5) / f64::from(self.samples);
        (f64::from(row) + line) / f64::from(height)
    }

    fn sample(&mut self, map: &VisibilityMap, fragments: &[usize], row: u32, height: u32) {
        let across = self.width * self.samples;
        self.faces.fill(Self::NOTHING);
        for &index in fragments {
            let fragment: Fragment = map.opaque.get(index);
            for line in 0..self.samples {
                let y = self.y_of(row, line, height);
                let Some([left, right]) = reach(map.polygon(fragment), y) else {
                    continue;
                };
                let after = |x: f64| ((x * f64::from(across) + 0.5) as u32).min(across);
                let start = line * across;
                let hit = start + after(left)..start + after(right);
                self.faces[hit.start as usize..hit.end as usize].fill(fragment.face().0);
            }
        }
    }

    fn deep_pixels(&self, seen: &SeenScene, row: u32, height: u32) -> DeepPixels {
        let (map, scene) = (&seen.map, &seen.scene);
        let across = self.width * self.samples;
        let is_parallel = matches!(map.camera.projection, Projection::Parallel { .. });
        let mut counts = Vec::with_capacity(self.width as usize);
        let mut columns = [(); 4].map(|()| Samples::new(SampleType::Half));
        let mut depths = Samples::new(SampleType::Float);
        let mut hits: Vec<Hit> = Vec::new();
        for pixel in 0..self.width {
            hits.clear();
            for line in 0..self.samples {
                let y = self.y_of(row, line, height);
                for sample in pixel * self.samples..(pixel + 1) * self.samples {
                    let face = self.faces[(line * across + sample) as usize];
                    if face == Self::NOTHING {
                        continue;
                    }
                    let face = FaceId(face);
                    let x = (f64::from(sample) + 0.5) / f64::from(across);
                    let nearness = map.faces.face_nearness(face).at(DVec2::new(x, y));
                    let depth = if is_parallel {
                        -nearness
                    } else {
                        1.0 / nearness
                    };
                    match hits.iter_mut().find(|hit| hit.face == face) {
                        Some(hit) => {
                            hit.count += 1;
                            hit.depth += depth;
                        }
                        None => hits.push(Hit {
                            face,
                            count: 1,
                            depth,
                        }),
                    }
                }
            }
            let mean = |hit: &Hit| hit.depth / f64::from(hit.count);
            hits.sort_by(|a, b| mean(a).total_cmp(&mean(b)));
            counts.push(hits.len() as u32);
            let mut left = self.samples * self.samples;
            for hit in &hits {
                let opacity = f64::from(hit.count) / f64::from(left);
                left -= hit.count;
                let (object, source) = (map.faces.object(hit.face), map.faces.source(hit.face));
                let [r, g, b, _] = scene.material_of(object, source).base_color.map(f64::from);
                let values = [opacity, opacity * b, opacity * g, opacity * r];
                for (column, value) in columns.iter_mut().zip(values) {
                    column.push(value);
                }
                depths.push(mean(hit));
            }
        }
        let [a, b, g, r] = columns;
        DeepPixels::from_counts(self.width as usize, counts, vec![a, b, g, r, depths])
    }
}

/// Where a line across the picture enters and leaves a convex polygon.
fn reach(polygon: &[DVec2], y: f64) -> Option<[f64; 2]> {
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut from = *polygon.last()?;
    for &to in polygon {
        if (from.y <= y) != (to.y <= y) {
            let x = from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y));
            left = left.min(x);
            right = right.max(x);
        }
        from = to;
    }
    (left < right).then_some([left, right])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_reaches_from_side_to_side_of_a_polygon() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(DVec2::from);
        assert_eq!(reach(&square, 1.0), Some([0.0, 2.0]));
        assert_eq!(reach(&square, 3.0), None);
    }

    #[test]
    fn every_triangle_is_in_one_of_the_two_parts() {
        let pair = Pair::by_name("split").expect("a name");
        let counts = pair.parts.each_ref().map(Scene::face_count);
        assert_eq!(counts.iter().sum::<usize>(), 100_352);
        assert_eq!(counts[0], counts[1]);
    }

    #[test]
    fn balls_and_poles_face_outwards() {
        for (positions, triangles) in [ball(DVec3::ZERO, 1.0, [8, 4]), pole(DVec3::ZERO, 0.1, 1.0)]
        {
            for triangle in triangles {
                let [p, q, r] = triangle.map(|corner| positions[corner as usize]);
                assert!((q - p).cross(r - p).dot(p + q + r) > 0.0, "{triangle:?}");
            }
        }
    }
}
