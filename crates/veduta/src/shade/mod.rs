//! Shading: pixel parts -> radiance.
//!
//! Each part gets the radiance of its face at its centroid, so that a pixel with an edge in it mixes
//! two right colours; pixels that one face fills are evaluated at their centres. Colours are linear
//! Rec.709.
//!
//! 1. [`Textures`] makes pyramids of the pictures in use (`texture.rs`).
//! 2. [`Surfaces`] looks once at each seen face. Most have one colour all over (no texture, no
//!    interpolated normal): it is worked out here, and their parts cost a look-up. The others are made
//!    ready for evaluation anywhere (`surface.rs`).
//! 3. [`Surfaces::shade`] evaluates the parts of a band.
//!
//! [`Points`] tells of a face what is not light: where its points are, and how they are turned.
//!
//! The light is a stand-in, a sun and a plain sky ([`light`]); those of the scene
//! ([`Scene::lights`]) are not looked at. Nor is opacity: all that is diced is opaque.

pub mod light;
mod points;
mod surface;
mod texture;

pub use points::Points;

use crate::dice::{Parts, PixelGrid};
use crate::scene::{ImageId, Material, Scene, TextureRef};
use light::Daylight;
use rayon::prelude::*;
use std::collections::BTreeSet;
use surface::{PicturePoint, Surface, SurfacePoint, Varying, Viewer};
use texture::Pyramid;
use veduta_geometry::{DVec2, Vec3};
use veduta_map::{Camera, FaceId, Faces, MaterialId};

/// Radiance of the parts of a band: linear RGB.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Radiance {
    /// Of each of [`Parts::boundary`].
    pub boundary: Vec<[f32; 3]>,
    /// Of [`Parts::runs`], one after the other.
    runs: Vec<[f32; 3]>,
    /// Where in `runs` each run's end.
    run_end: Vec<usize>,
}

impl Radiance {
    /// Radiance of a run: a single value for all its pixels, or one for each.
    pub fn of_run(&self, run: usize) -> &[[f32; 3]] {
        let start = run
            .checked_sub(1)
            .map_or(0, |previous| self.run_end[previous]);
        &self.runs[start..self.run_end[run]]
    }

    fn clear(&mut self) {
        self.boundary.clear();
        self.runs.clear();
        self.run_end.clear();
    }
}

/// Pictures of a scene made ready for shading: pyramids of those in use.
pub struct Textures<'a> {
    /// By image.
    pyramids: Vec<Option<Pyramid<'a>>>,
}

impl<'a> Textures<'a> {
    /// Prepares the pictures of `materials`.
    pub fn new(scene: &'a Scene, materials: &BTreeSet<MaterialId>) -> Self {
        let images: BTreeSet<ImageId> = materials
            .iter()
            .flat_map(|&material| {
                let material = scene.material(material);
                [material.base_color_texture, material.emissive_texture]
            })
            .flatten()
            .map(|texture| texture.image)
            .collect();
        let pyramids = scene.images.par_iter().enumerate().map(|(index, image)| {
            let is_used = images.contains(&ImageId(index as u32));
            is_used.then(|| Pyramid::new(image))
        });
        Self {
            pyramids: pyramids.collect(),
        }
    }
}

/// The faces that a picture shows, made ready for shading.
pub struct Surfaces<'a> {
    scene: &'a Scene,
    textures: &'a Textures<'a>,
    light: Daylight,
    unlit: bool,
    /// Of each fragment.
    surfaces: Vec<Surface>,
    varying: Vec<Varying>,
}

impl<'a> Surfaces<'a> {
    /// Looks at what `camera` sees of `scene`: `shown` are the faces of the fragments that
    /// [`Parts`] refer to, ascending. `textures` hold the pictures of all their materials. With
    /// `unlit`, materials show their colour as it is.
    pub fn new(
        scene: &'a Scene,
        textures: &'a Textures<'a>,
        camera: &Camera,
        faces: &Faces,
        shown: &[FaceId],
        light: Daylight,
        unlit: bool,
    ) -> Self {
        let viewer = Viewer::new(scene, camera, faces);
        let shining = (!unlit).then_some(&light);
        let mut surfaces: Vec<Surface> = shown
            .par_iter()
            .with_min_len(256)
            .map(|&face| match viewer.constant(face, shining) {
                Some(radiance) => Surface::Constant(radiance),
                None => Surface::Varying(0),
            })
            .collect();

        // A face that is seen in pieces gets one row.
        let mut varying: Vec<FaceId> = Vec::new();
        for (&face, surface) in shown.iter().zip(&mut surfaces) {
            if let Surface::Varying(row) = surface {
                if varying.last() != Some(&face) {
                    varying.push(face);
                }
                *row = varying.len() as u32 - 1;
            }
        }
        let varying = varying.par_iter().map(|&face| viewer.varying(face));
        let varying = varying.collect();
        Self {
            scene,
            textures,
            light,
            unlit,
            surfaces,
            varying,
        }
    }

    /// Whether radiance differs from point to point of a fragment.
    #[inline(always)]
    pub fn varies(&self, fragment: u32) -> bool {
        matches!(self.surfaces[fragment as usize], Surface::Varying(_))
    }

    /// The radiance of a fragment, if it is the same at all points of it.
    pub fn constant(&self, fragment: u32) -> Option<[f32; 3]> {
        match self.surfaces[fragment as usize] {
            Surface::Constant(radiance) => Some(radiance),
            Surface::Varying(_) => None,
        }
    }

    /// Radiance of `parts`, of the band of `grid` that starts at row `first_row`. `radiance` is
    /// overwritten.
    pub fn shade(&self, parts: &Parts, grid: &PixelGrid, first_row: u32, radiance: &mut Radiance) {
        radiance.clear();
        let corner = |pixel: u32| {
            let row = first_row + pixel / grid.width;
            DVec2::new(f64::from(pixel % grid.width), f64::from(row))
        };
        radiance.boundary.extend(parts.boundary.iter().map(|part| {
            match self.surfaces[part.fragment as usize] {
                Surface::Constant(radiance) => radiance,
                Surface::Varying(row) => {
                    let place = corner(part.pixel) + part.centroid.as_dvec2();
                    self.radiance(&self.varying[row as usize], grid, place)
                }
            }
        }));
        for run in &parts.runs {
            match self.surfaces[run.fragment as usize] {
                Surface::Constant(value) => radiance.runs.push(value),
                Surface::Varying(row) => {
                    let face = &self.varying[row as usize];
                    let first = corner(run.pixel) + 0.5;
                    radiance.runs.extend((0..run.length).map(|step| {
                        self.radiance(face, grid, first + DVec2::new(f64::from(step), 0.0))
                    }));
                }
            }
            radiance.run_end.push(radiance.runs.len());
        }
    }

    /// Radiance of a face at a place of the grid.
    fn radiance(&self, face: &Varying, grid: &PixelGrid, place: DVec2) -> [f32; 3] {
        let material = self.scene.material(face.material);
        let point = face.at(grid.image_from_pixels(place));
        let color = self.color(material, &point, grid);
        let radiance = if self.unlit || material.unlit {
            color
        } else {
            color * self.light.on(point.normal) + self.emission(material, &point, grid)
        };
        radiance.into()
    }

    /// The material's colour at a point: its own, times the texture's, times the vertices'.
    fn color(&self, material: &Material, point: &SurfacePoint, grid: &PixelGrid) -> Vec3 {
        let [r, g, b, _] = material.base_color;
        let color = Vec3::new(r, g, b) * point.color;
        match (material.base_color_texture, &point.picture) {
            (Some(texture), Some(place)) => color * self.texel(&texture, place, grid),
            _ => color,
        }
    }

    /// What the material gives off at a point: its own radiance, times the texture's.
    fn emission(&self, material: &Material, point: &SurfacePoint, grid: &PixelGrid) -> Vec3 {
        let emission = Vec3::from(material.emissive);
        match (material.emissive_texture, &point.emissive_picture) {
            (Some(texture), Some(place)) => emission * self.texel(&texture, place, grid),
            _ => emission,
        }
    }

    /// Mean colour of a texture in the footprint of a pixel.
    fn texel(&self, texture: &TextureRef, place: &PicturePoint, grid: &PixelGrid) -> Vec3 {
        let pyramid = self.textures.pyramids[texture.image.0 as usize]
            .as_ref()
            .expect("pyramids of all pictures in use are made");
        let pixel = grid.pixels_per_frame;
        let texel = pyramid.sample(
            place.at,
            place.along_x / pixel.x,
            place.along_y / pixel.y,
            texture.wrap,
        );
        texel.truncate()
    }
}
