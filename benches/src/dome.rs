//! A fulldome picture from cube faces: files for other programs, our own times and errors.

use crate::timing::on_one_thread;
use crate::two_pass::{Face, TwoPass};
use cpu_time::ProcessTime;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fs;
use std::path::Path;
use veduta::accumulate::Picture;
use veduta::filter::ewa::plain::{self, Ellipse, WeightTable};
use veduta::filter::ewa::{Ewa, Profile};
use veduta::geometry::{DVec2, DVec3};
use veduta::reproject::{Lens, Need, Orientation, Projection, Reprojection, Views};

/// Points a side of a texel, and of a pixel of the references.
const SAMPLES: u32 = 4;

/// A job: faces of `faces` texels a side to a fisheye of 180 degrees of `width` pixels.
pub struct Job {
    faces: u32,
    width: u32,
}

/// Zone plates around a corner of the cube, an edge and another point, a channel each, whose frequency grows to
/// `frequency` cycles a radian.
fn pattern(direction: DVec3, frequency: f64) -> [f64; 3] {
    CENTRES.map(|centre| {
        let away = 1.0 - direction.dot(DVec3::from(centre).normalize());
        0.5 + 0.5 * (2.0 * PI * frequency * away).cos()
    })
}

const CENTRES: [[f64; 3]; 3] = [[1.0, 1.0, -1.0], [1.0, 0.0, -1.0], [-0.3, 0.5, -0.8]];

impl Job {
    /// From arguments.
    ///
    /// # Errors
    /// A sentence about a number that is none.
    pub fn parse(faces: &str, width: &str) -> Result<Self, String> {
        let number = |given: &str| {
            let number: Option<u32> = given.parse().ok().filter(|n| (1..=16384).contains(n));
            number.ok_or_else(|| format!("{given} is not a number of pixels from 1 to 16384"))
        };
        Ok(Self {
            faces: number(faces)?,
            width: number(width)?,
        })
    }

    fn sources(&self) -> Vec<Projection> {
        let q = FRAC_PI_2;
        let angles = [
            (0.0, 0.0),
            (q, 0.0),
            (PI, 0.0),
            (-q, 0.0),
            (0.0, q),
            (0.0, -q),
        ];
        let face = |(yaw, elevation)| {
            let orientation = Orientation::from_angles(yaw, elevation, 0.0);
            Projection::new(
                Lens::Perspective { fov: q },
                orientation,
                self.faces,
                self.faces,
            )
        };
        angles.map(face).to_vec()
    }

    fn target(&self) -> Projection {
        let lens: Lens = "fisheye:180".parse().expect("a lens");
        Projection::new(lens, Orientation::default(), self.width, self.width)
    }

    /// Cycles a radian: what the faces can just carry at the middle of a face, but not more than 2.5 times what the
    /// picture can.
    fn frequency(&self) -> f64 {
        let carried = 0.25 * f64::from(self.faces);
        carried.min(2.5 * f64::from(self.width) / (2.0 * PI))
    }

    /// The faces in 8 bits, texels one after the other, face by face.
    fn texels(&self, faces: &[Projection]) -> Vec<Vec<[u8; 3]>> {
        let frequency = self.frequency();
        let face = |projection: &Projection| {
            let count = projection.width as usize * projection.height as usize;
            let texel = |index: usize| {
                let corner = corner(index, projection.width);
                mean(SAMPLES, |at| {
                    pattern(
                        projection.direction(corner + at).expect("a face"),
                        frequency,
                    )
                })
                .map(|x| (255.0 * x).round() as u8)
            };
            (0..count).into_par_iter().map(texel).collect()
        };
        faces.iter().map(face).collect()
    }

    /// Writes into a folder: `faces.gbrp`, all faces side by side in planes of 8 bits as ffmpeg reads them; `box.f32`
    /// and `gauss.f32`, the pattern through a pixel's area and through the paper's kernel, planes of R, G and B, not a number
    /// where the picture shows nothing; `alias.u8`, where the pattern is above 1.25 times what the picture can carry.
    ///
    /// # Errors
    /// A sentence about a file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), String> {
        let texels = self.texels(&self.sources());
        let mut planes = Vec::new();
        let side = self.faces as usize;
        for channel in [1, 2, 0] {
            for row in 0..side {
                for face in &texels {
                    planes.extend(
                        face[row * side..(row + 1) * side]
                            .iter()
                            .map(|t| t[channel]),
                    );
                }
            }
        }
        save(folder, "faces.gbrp", &planes)?;
        let (target, frequency) = (self.target(), self.frequency());
        let count = self.width as usize * self.width as usize;
        let reference = |kernel: fn(DVec2) -> f64, reach: f64| -> Vec<[f64; 3]> {
            let pixel = |index: usize| {
                let centre = corner(index, self.width) + 0.5;
                if target.lens_from_image(centre).length() > 1.0 - 3.0 / target.pixels_per_unit() {
                    return [f64::NAN; 3];
                }
                let samples = (2.0 * reach * f64::from(2 * SAMPLES)) as u32;
                let (mut sum, mut weights) = ([0.0; 3], 0.0);
                for k in 0..samples * samples {
                    let part = DVec2::new((k % samples).into(), (k / samples).into()) + 0.5;
                    let away = (2.0 * part / f64::from(samples) - 1.0) * reach;
                    let weight = kernel(away);
                    if weight > 0.0 {
                        let direction = target.direction(centre + away).expect("inside");
                        for (sum, value) in sum.iter_mut().zip(pattern(direction, frequency)) {
                            *sum += weight * value;
                        }
                        weights += weight;
                    }
                }
                sum.map(|sum| sum / weights)
            };
            (0..count).into_par_iter().map(pixel).collect()
        };
        let planar = |pixels: &[[f64; 3]]| -> Vec<u8> {
            let channel = |k: usize| pixels.iter().flat_map(move |p| (p[k] as f32).to_le_bytes());
            (0..3).flat_map(channel).collect()
        };
        save(folder, "box.f32", &planar(&reference(|_| 1.0, 0.5)))?;
        let gauss = |away: DVec2| {
            let r2 = away.length_squared();
            if r2 < 1.0 { (-2.0 * r2).exp() } else { 0.0 }
        };
        save(folder, "gauss.f32", &planar(&reference(gauss, 1.0)))?;
        let carried = 1.25 * f64::from(self.width) / (2.0 * PI);
        let above = |centre: [f64; 3]| {
            let centre = DVec3::from(centre).normalize();
            (0..count).map(move |index| {
                let direction = target.direction(corner(index, self.width) + 0.5);
                let across = direction.map_or(0.0, |d| d.cross(centre).length());
                u8::from(frequency * across > carried)
            })
        };
        let mask: Vec<u8> = CENTRES.into_iter().flat_map(above).collect();
        save(folder, "alias.u8", &mask)
    }

    /// Our picture by a profile, planes of R, G and B in `own.f32`, and CPU seconds of all threads as JSON: `map`, finding
    /// where pixels lie; `first` and `prepare`, from faces in 8 bits to texels with aprons for the first and for further
    /// frames; `filter`, to a picture in 8 bits. `wall` is the time that `filter` took by the clock.
    ///
    /// # Errors
    /// A sentence about a profile that is none or a file that cannot be written.
    pub fn own(&self, profile: &str, threads: usize, folder: &Path) -> Result<String, String> {
        let profile = match profile {
            "auto" => Profile::Auto,
            "gaussian" => Profile::Gaussian,
            "sharp" => Profile::Sharp,
            "robidoux" => Profile::Robidoux,
            "mitchell" => Profile::Mitchell,
            _ => return Err(format!("there is no profile {profile}")),
        };
        let ewa = Ewa {
            profile,
            ..Ewa::default()
        };
        let planar = |face: Vec<[u8; 3]>| [0, 1, 2].map(|k| face.iter().map(|t| t[k]).collect());
        let faces: Vec<[Vec<u8>; 3]> = self
            .texels(&self.sources())
            .into_iter()
            .map(planar)
            .collect();
        let work = || {
            let (sources, target) = (self.sources(), self.target());
            let start = ProcessTime::now();
            let reprojection = Reprojection::new(&sources, &target, &ewa);
            let map = start.elapsed().as_secs_f64();
            let (mut views, needs) = (reprojection.views(), reprojection.needs());
            let (mut first, mut prepare) = (None, f64::INFINITY);
            let (mut filter, mut wall) = (f64::INFINITY, f64::INFINITY);
            for _ in 0..4 {
                let start = ProcessTime::now();
                fill(&mut views, &faces, &needs);
                views.complete();
                let time = start.elapsed().as_secs_f64();
                prepare = time.min(prepare);
                first.get_or_insert(time);
                let (start, begin) = (ProcessTime::now(), std::time::Instant::now());
                let mut bytes = vec![[0_u8; 3]; (self.width * self.width) as usize];
                bytes
                    .par_chunks_mut((16 * self.width) as usize)
                    .enumerate()
                    .for_each(|(band, bytes)| {
                        let mut pixels = vec![[0.0; 4]; bytes.len()];
                        reprojection.band(&views, band, &mut pixels);
                        for (bytes, pixel) in bytes.iter_mut().zip(pixels) {
                            *bytes = eight_bits(pixel);
                        }
                    });
                filter = start.elapsed().as_secs_f64().min(filter);
                wall = begin.elapsed().as_secs_f64().min(wall);
            }
            let first = first.unwrap_or_default();
            let times = [map, first, prepare, filter, wall];
            (reprojection.picture(&views), times)
        };
        let (picture, [map, first, prepare, filter, wall]) = if threads == 1 {
            on_one_thread(work)
        } else {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map_err(|error| error.to_string())?.install(work)
        };
        save(folder, "own.f32", &planes(&picture))?;
        Ok(format!(
            "{{\"map\": {map:.4}, \"first\": {first:.4}, \"prepare\": {prepare:.4}, \"filter\": {filter:.4}, \"wall\": {wall:.4}}}"
        ))
    }

    /// The picture in two passes ([`TwoPass`]), planes of R, G and B in `own.f32`, and as JSON CPU seconds of one thread:
    /// `map`, finding where pixels lie; `filter`, to a picture in f32; and the `bottleneck`.
    ///
    /// # Errors
    /// A sentence about a picture that is too small, or a file that cannot be written.
    pub fn two_pass(&self, folder: &Path) -> Result<String, String> {
        // Faces that go on beyond their edges stand for aprons.
        const APRON: u32 = 16;
        if self.width < 64 {
            return Err("two passes are for pictures of 64 pixels and more".into());
        }
        let side = self.faces + 2 * APRON;
        let fov = 2.0 * (f64::from(side) / f64::from(self.faces)).atan();
        let lens = Lens::Perspective { fov };
        let wide = |face: &Projection| Projection::new(lens, face.orientation, side, side);
        let sources: Vec<Projection> = self.sources().iter().map(wide).collect();
        let face = |texels: Vec<[u8; 3]>| Face {
            side: side as usize,
            texels: texels.into_iter().map(from_eight_bits).collect(),
        };
        let faces = self.texels(&sources).into_iter().map(face);
        let faces: Vec<Face> = faces.collect();
        let (pixels, bottleneck, [map, filter]) = on_one_thread(|| {
            let start = ProcessTime::now();
            let two_pass = TwoPass::new(&sources, &self.target());
            let map = start.elapsed().as_secs_f64();
            let mut filter = f64::INFINITY;
            for _ in 0..4 {
                let start = ProcessTime::now();
                std::hint::black_box(two_pass.picture(&faces));
                filter = start.elapsed().as_secs_f64().min(filter);
            }
            let pixels = two_pass.picture(&faces);
            (pixels, two_pass.bottleneck(), [map, filter])
        });
        let (width, height) = (self.width, self.width);
        let picture = Picture {
            width,
            height,
            pixels,
        };
        save(folder, "own.f32", &planes(&picture))?;
        Ok(format!(
            "{{\"map\": {map:.4}, \"filter\": {filter:.4}, \"bottleneck\": {bottleneck:.2}}}"
        ))
    }

    /// CPU seconds of the filter as the paper prints it: scan of the box, table of weights, one face, derivatives by
    /// differences, faces in 8 bits.
    pub fn printed(&self) -> f64 {
        let (sources, target, texels) =
            (self.sources(), self.target(), self.texels(&self.sources()));
        let table = WeightTable::new(|q| (-2.0 * q).exp());
        let side = self.faces as i32;
        on_one_thread(|| {
            let start = ProcessTime::now();
            let mut sum = 0.0;
            for index in 0..self.width as usize * self.width as usize {
                let centre = corner(index, self.width) + 0.5;
                if !target.covers(centre) {
                    continue;
                }
                let Some(direction) = target.direction(centre) else {
                    continue;
                };
                let along = |view: &Projection| view.orientation.forward().dot(direction);
                let face = (0..6).fold(0, |best, k| {
                    if along(&sources[k]) > along(&sources[best]) {
                        k
                    } else {
                        best
                    }
                });
                let texel = |x: f64, y: f64| {
                    let direction = target.direction(centre + DVec2::new(x, y))?;
                    sources[face].image(direction)
                };
                let at = [
                    texel(0.0, 0.0),
                    texel(0.25, 0.0),
                    texel(-0.25, 0.0),
                    texel(0.0, 0.25),
                    texel(0.0, -0.25),
                ];
                let [Some(at), Some(east), Some(west), Some(south), Some(north)] = at else {
                    continue;
                };
                let (x, y) = (2.0 * (east - west), 2.0 * (south - north));
                let f = (x.x * y.y - y.x * x.y).powi(2);
                let equation = [
                    (x.y * x.y + y.y * y.y) / f,
                    -2.0 * (x.x * x.y + y.x * y.y) / f,
                    (x.x * x.x + y.x * y.x) / f,
                ];
                let ellipse = Ellipse {
                    centre: [at.x - 0.5, at.y - 0.5],
                    equation,
                };
                let read = |column: i32, row: i32| {
                    let place = row.clamp(0, side - 1) * side + column.clamp(0, side - 1);
                    texels[face][place as usize].map(f32::from)
                };
                if let Some([r, ..]) = plain::mean(read, &ellipse, |q| table.at(q)) {
                    sum += r;
                }
            }
            std::hint::black_box(sum);
            start.elapsed().as_secs_f64()
        })
    }
}

/// Left top corner of a pixel by its number.
fn corner(index: usize, width: u32) -> DVec2 {
    let (column, row) = (index as u32 % width, index as u32 / width);
    DVec2::new(column.into(), row.into())
}

/// The mean over a pixel's area of `samples` x `samples` points.
fn mean(samples: u32, value: impl Fn(DVec2) -> [f64; 3]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for k in 0..samples * samples {
        let at =
            (DVec2::new((k % samples).into(), (k / samples).into()) + 0.5) / f64::from(samples);
        for (sum, value) in sum.iter_mut().zip(value(at)) {
            *sum += value / f64::from(samples * samples);
        }
    }
    sum
}

/// From planes of 8 bits to the texels of views, as far as they are needed.
fn fill(views: &mut Views, faces: &[[Vec<u8>; 3]], needs: &[Need]) {
    for (index, [r, g, b]) in faces.iter().enumerate() {
        let Some([left, top, right, bottom]) = needs[index].window else {
            continue;
        };
        let width = views.projections()[index].width as usize;
        for row in top..bottom {
            let start = row as usize * width;
            let all = start + left as usize..start + right as usize;
            let texels = &mut views.row_mut(index, row)[left as usize..right as usize];
            let bytes = r[all.clone()].iter().zip(&g[all.clone()]).zip(&b[all]);
            for (texel, ((&r, &g), &b)) in texels.iter_mut().zip(bytes) {
                *texel = from_eight_bits([r, g, b]);
            }
        }
    }
}

/// From 8 bits to a texel.
fn from_eight_bits(bytes: [u8; 3]) -> [f32; 4] {
    let [r, g, b] = bytes.map(|byte| f32::from(byte) * (1.0 / 255.0));
    [r, g, b, 1.0]
}

/// From a pixel to 8 bits.
fn eight_bits(pixel: [f32; 4]) -> [u8; 3] {
    // Added to this, a number is rounded to a whole one, in the last bits; in vectors, unlike `as u8`.
    const WHOLE: f32 = 8_388_608.0;
    let [r, g, b, _] = pixel.map(|x| (255.0 * x.clamp(0.0, 1.0) + WHOLE).to_bits() as u8);
    [r, g, b]
}

/// Planes of R, G and B of a picture, as bytes.
fn planes(picture: &Picture) -> Vec<u8> {
    let channel = |k: usize| picture.pixels.iter().flat_map(move |p| p[k].to_le_bytes());
    (0..3).flat_map(channel).collect()
}

fn save(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), String> {
    let path = folder.join(name);
    fs::write(&path, bytes).map_err(|error| format!("{}: {error}", path.display()))
}
