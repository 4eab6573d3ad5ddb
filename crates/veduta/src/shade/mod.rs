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
//! Where a part lies in the image plane, its [`Ground`] tells: a grid of pixels, or the patches of a picture by another
//! lens ([`PatchedPlaces`]).
//!
//! [`Points`] tells of a face what is not light: where its points are, and how they are turned.
//!
//! Of veils, faces that are not fully opaque, the opacity is evaluated beside the radiance. A part of a
//! pixel has one opacity, that at its centroid.
//!
//! The light is a stand-in, a sun and a plain sky ([`light`]); those of the scene
//! ([`Scene::lights`]) are not looked at.

pub mod light;
mod patched;
mod points;
mod surface;
mod texture;

pub use patched::PatchedPlaces;
pub use points::Points;

use crate::dice::{Part, Parts, PixelGrid};
use crate::scene::{AlphaMode, Material, Scene, TextureRef};
use light::Daylight;
use rayon::prelude::*;
use std::collections::BTreeSet;
use surface::{PicturePoint, Surface, SurfacePoint, Varying, Viewer, opacity_of};
use texture::{Pyramid, TexelOpacity};
use veduta_geometry::{DVec2, Vec3, Vec4};
use veduta_map::{Camera, FaceId, Faces, MaterialId};

/// Radiance of the parts of a band: linear RGB, not multiplied by opacity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Radiance {
    /// Of each of [`Parts::boundary`].
    pub boundary: Vec<[f32; 3]>,
    /// Opacity of those parts that are of veils, which are the last ones.
    pub opacities: Vec<f32>,
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
        self.opacities.clear();
        self.runs.clear();
        self.run_end.clear();
    }
}

/// Pictures of a scene made ready for shading: pyramids of those in use.
pub struct Textures<'a> {
    pyramids: Vec<Pyramid<'a>>,
    /// The pictures of each material: rows of `pyramids`.
    of_material: Vec<Pictures>,
}

/// The pictures of a material.
#[derive(Clone, Copy, Debug, Default)]
struct Pictures {
    color: Option<usize>,
    emission: Option<usize>,
}

impl<'a> Textures<'a> {
    /// Prepares the pictures of `materials`.
    pub fn new(scene: &'a Scene, materials: &BTreeSet<MaterialId>) -> Self {
        // A picture has a pyramid for each use of its opacity.
        let mut wanted: Vec<(usize, TexelOpacity)> = Vec::new();
        let mut row_of = |texture: Option<TextureRef>, opacity: TexelOpacity| {
            let picture = (texture?.image.0 as usize, opacity);
            let row = wanted.iter().position(|&other| other == picture);
            Some(row.unwrap_or_else(|| {
                wanted.push(picture);
                wanted.len() - 1
            }))
        };
        let mut of_material = vec![Pictures::default(); scene.materials.len()];
        for &id in materials {
            let material = scene.material(id);
            let opacity = match material.alpha_mode {
                AlphaMode::Opaque => TexelOpacity::Ignored,
                AlphaMode::Blend => TexelOpacity::Blended,
                AlphaMode::Mask(cutoff) => TexelOpacity::Cut(cutoff / material.base_color[3]),
            };
            of_material[id.index()] = Pictures {
                color: row_of(material.base_color_texture, opacity),
                emission: row_of(material.emissive_texture, TexelOpacity::Ignored),
            };
        }
        let pyramids = wanted.into_par_iter();
        let pyramids = pyramids.map(|(image, opacity)| Pyramid::new(&scene.images[image], opacity));
        Self {
            pyramids: pyramids.collect(),
            of_material,
        }
    }
}

/// Where in the image plane something is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePlace {
    /// The image point.
    pub at: DVec2,
    /// How it changes from a pixel of the picture to the next one in its row.
    pub per_column: DVec2,
    /// How it changes from a pixel to the one below.
    pub per_row: DVec2,
}

/// Tells where in the image plane the parts of a band lie.
pub trait Ground {
    /// The place of a part's centroid; `index` is its row of [`Parts::boundary`].
    fn of_part(&self, index: usize, part: &Part) -> ImagePlace;

    /// The centre of a pixel, counted from the band's first one; `index` is the row of [`Parts::runs`] that
    /// it is in.
    fn of_run(&self, index: usize, pixel: u32) -> ImagePlace;
}

/// A band of a pixel grid that lies on the image plane.
struct BandOfGrid<'a> {
    grid: &'a PixelGrid,
    first_row: u32,
}

impl BandOfGrid<'_> {
    /// What is seen at `from_corner` from the top left corner of a pixel.
    #[inline(always)]
    fn at(&self, pixel: u32, from_corner: DVec2) -> ImagePlace {
        let grid = self.grid;
        let row = self.first_row + pixel / grid.width;
        let corner = DVec2::new(f64::from(pixel % grid.width), f64::from(row));
        let per_pixel = grid.pixels_per_frame.recip();
        ImagePlace {
            at: grid.image_from_pixels(corner + from_corner),
            per_column: DVec2::new(per_pixel.x, 0.0),
            per_row: DVec2::new(0.0, per_pixel.y),
        }
    }
}

impl Ground for BandOfGrid<'_> {
    #[inline(always)]
    fn of_part(&self, _index: usize, part: &Part) -> ImagePlace {
        self.at(part.pixel, part.centroid.as_dvec2())
    }

    #[inline(always)]
    fn of_run(&self, _index: usize, pixel: u32) -> ImagePlace {
        self.at(pixel, DVec2::splat(0.5))
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
    /// Opacities of the fragments of veils, which are the last ones; of those that vary it is unused.
    opacities: Vec<f32>,
}

impl<'a> Surfaces<'a> {
    /// Looks at what `camera` sees of `scene`: `shown` are the faces of the fragments that
    /// [`Parts`] refer to, opaque ones first, each kind ascending. `textures` hold the pictures of all their materials. With
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
        let first_veil = shown.partition_point(|&face| !faces.is_veil(face));
        let veils = shown[first_veil..].iter();
        let opacities = veils.map(|&face| viewer.constant_opacity(face).unwrap_or(1.0));
        Self {
            scene,
            textures,
            light,
            unlit,
            surfaces,
            varying,
            opacities: opacities.collect(),
        }
    }

    /// The opacity of a fragment, if it is the same at all points of it and so is the radiance.
    pub fn constant_opacity(&self, fragment: u32) -> Option<f32> {
        let first_veil = self.surfaces.len() - self.opacities.len();
        let veil = (fragment as usize).checked_sub(first_veil)?;
        Some(self.opacities[veil])
    }

    /// Whether radiance differs from point to point of any fragment.
    pub fn vary(&self) -> bool {
        !self.varying.is_empty()
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
        self.shade_on(&BandOfGrid { grid, first_row }, parts, radiance);
    }

    /// [`Surfaces::shade`] for parts that lie on any ground.
    pub fn shade_on(&self, ground: &impl Ground, parts: &Parts, radiance: &mut Radiance) {
        radiance.clear();
        for (index, part) in parts.boundary.iter().enumerate() {
            let (light, opacity) = match self.surfaces[part.fragment as usize] {
                Surface::Constant(light) => (light, self.constant_opacity(part.fragment)),
                Surface::Varying(row) => {
                    let place = ground.of_part(index, part);
                    let (light, opacity) = self.look(&self.varying[row as usize], &place);
                    let is_veil = self.constant_opacity(part.fragment).is_some();
                    (light, is_veil.then_some(opacity))
                }
            };
            radiance.boundary.push(light);
            radiance.opacities.extend(opacity);
        }
        for (index, run) in parts.runs.iter().enumerate() {
            match self.surfaces[run.fragment as usize] {
                Surface::Constant(value) => radiance.runs.push(value),
                Surface::Varying(row) => {
                    let face = &self.varying[row as usize];
                    let pixels = run.pixels().map(|pixel| pixel as u32);
                    let places = pixels.map(|pixel| ground.of_run(index, pixel));
                    radiance
                        .runs
                        .extend(places.map(|place| self.look(face, &place).0));
                }
            }
            radiance.run_end.push(radiance.runs.len());
        }
    }

    /// Radiance and opacity of a face at a place of the image plane.
    fn look(&self, face: &Varying, place: &ImagePlace) -> ([f32; 3], f32) {
        let material = self.scene.material(face.material);
        let pictures = &self.textures.of_material[face.material.index()];
        let point = face.at(place.at);
        let (color, opacity) = self.color(material, pictures, &point, place);
        let radiance = if self.unlit || material.unlit {
            color
        } else {
            color * self.light.on(point.normal) + self.emission(material, pictures, &point, place)
        };
        (radiance.into(), opacity)
    }

    /// The material's colour and opacity at a point: its own, times the texture's, times the vertices'.
    fn color(
        &self,
        material: &Material,
        pictures: &Pictures,
        point: &SurfacePoint,
        seen_at: &ImagePlace,
    ) -> (Vec3, f32) {
        let [r, g, b, _] = material.base_color;
        let color = Vec3::new(r, g, b) * point.color;
        let opacity = opacity_of(material, point.opacity);
        match (material.base_color_texture, pictures.color, &point.picture) {
            (Some(texture), Some(picture), Some(place)) => {
                let texel = self.texel(&texture, picture, place, seen_at);
                match material.alpha_mode {
                    AlphaMode::Opaque => (color * texel.truncate(), opacity),
                    _ if texel.w > 0.0 => (color * texel.truncate() / texel.w, opacity * texel.w),
                    _ => (Vec3::ZERO, 0.0),
                }
            }
            _ => (color, opacity),
        }
    }

    /// What the material gives off at a point: its own radiance, times the texture's.
    fn emission(
        &self,
        material: &Material,
        pictures: &Pictures,
        point: &SurfacePoint,
        seen_at: &ImagePlace,
    ) -> Vec3 {
        let emission = Vec3::from(material.emissive);
        let place = &point.emissive_picture;
        match (material.emissive_texture, pictures.emission, place) {
            (Some(texture), Some(picture), Some(place)) => {
                emission * self.texel(&texture, picture, place, seen_at).truncate()
            }
            _ => emission,
        }
    }

    /// Mean of a picture in the footprint of a pixel.
    fn texel(
        &self,
        texture: &TextureRef,
        picture: usize,
        place: &PicturePoint,
        seen_at: &ImagePlace,
    ) -> Vec4 {
        let along = |change: DVec2| place.along_x * change.x + place.along_y * change.y;
        self.textures.pyramids[picture].sample(
            place.at,
            along(seen_at.per_column),
            along(seen_at.per_row),
            texture.wrap,
        )
    }
}
