//! How the channels beside the light are made: shares of faces -> points, colours, mattes.

use super::material_of;
use crate::accumulate::{self, AovSettings, Aovs, Matte};
use crate::dice::{self, Parts, PixelGrid, Share};
use crate::scene::Scene;
use crate::shade::light::Daylight;
use crate::shade::{Points, Radiance, Surfaces, Textures};
use std::collections::HashMap;
use veduta_geometry::DVec2;
use veduta_map::{Camera, FaceId, Faces};

/// What is needed to make channels from the parts of a band, whatever found the parts.
pub struct AovMaker<'a> {
    settings: AovSettings,
    scene: &'a Scene,
    faces: &'a Faces,
    /// The faces of the fragments that parts refer to, ascending.
    shown: &'a [FaceId],
    points: Option<Points<'a>>,
    albedo: Option<Surfaces<'a>>,
    /// Of each object the first of its name.
    objects: Vec<u32>,
    /// Of each material the first of its name.
    materials: Vec<u32>,
}

/// What a thread keeps from band to band.
#[derive(Default)]
pub struct AovBuffers {
    shares: Vec<Share>,
    areas: Vec<(u32, f64)>,
    radiance: Radiance,
    sums: Vec<[f64; 4]>,
    pixels: Vec<[f32; 4]>,
}

impl<'a> AovMaker<'a> {
    /// Makes ready what `settings` ask for of the faces `shown`. `textures` hold the pictures of all
    /// their materials.
    pub fn new(
        scene: &'a Scene,
        textures: &'a Textures<'a>,
        camera: &'a Camera,
        faces: &'a Faces,
        shown: &'a [FaceId],
        settings: AovSettings,
    ) -> Self {
        let of_points = settings.depth || settings.position || settings.normal;
        let names_of = |ranks: usize, names: &mut dyn Iterator<Item = &'a str>| {
            if ranks > 0 { firsts(names) } else { Vec::new() }
        };
        let mut objects = scene.objects.iter().map(|object| object.name.as_str());
        let mut materials = scene
            .materials
            .iter()
            .map(|material| material.name.as_str());
        Self {
            settings,
            scene,
            faces,
            shown,
            points: of_points.then(|| Points::new(scene, camera, faces, shown, settings.normal)),
            albedo: settings.albedo.then(|| {
                let light = Daylight::default();
                Surfaces::new(scene, textures, camera, faces, shown, light, true)
            }),
            objects: names_of(settings.object_ranks, &mut objects),
            materials: names_of(settings.material_ranks, &mut materials),
        }
    }

    /// Whether the centroids of a fragment's parts are looked at.
    pub fn varies(&self, fragment: u32) -> bool {
        let colors_vary = |colors: &Surfaces| colors.varies(fragment);
        self.points.is_some() || self.albedo.as_ref().is_some_and(colors_vary)
    }

    /// Makes the channels of a band that begins at `first_row` and has `pixels` pixels.
    pub fn make(
        &self,
        parts: &Parts,
        grid: &PixelGrid,
        first_row: u32,
        pixels: usize,
        buffers: &mut AovBuffers,
    ) -> Aovs {
        let mut aovs = Aovs::new(&self.settings, pixels);
        dice::sum_by_face(parts, self.shown, &mut buffers.shares);
        for share in dice::largest(&buffers.shares) {
            self.tell_of_face(share, grid, first_row, &mut aovs);
        }
        if let (Some(colors), Some(albedo)) = (&self.albedo, &mut aovs.albedo) {
            colors.shade(parts, grid, first_row, &mut buffers.radiance);
            buffers.pixels.resize(pixels, [0.0; 4]);
            let mixed = &mut buffers.pixels;
            accumulate::box_filter(parts, &buffers.radiance, &mut buffers.sums, mixed);
            for (albedo, &[r, g, b, _]) in albedo.iter_mut().zip(&*mixed) {
                *albedo = [r, g, b];
            }
        }
        let (shares, areas) = (&buffers.shares, &mut buffers.areas);
        if let Some(Matte { ranks, rows, most }) = &mut aovs.object_matte {
            let thing_of = |face| self.objects[self.faces.object(face).index()];
            *most = accumulate::rank(shares, thing_of, *ranks, areas, rows);
        }
        if let Some(Matte { ranks, rows, most }) = &mut aovs.material_matte {
            let thing_of = |face| self.materials[material_of(self.scene, self.faces, face).index()];
            *most = accumulate::rank(shares, thing_of, *ranks, areas, rows);
        }
        aovs
    }

    /// Sets the channels that tell of one face only.
    fn tell_of_face(&self, share: &Share, grid: &PixelGrid, first_row: u32, aovs: &mut Aovs) {
        let (pixel, face) = (share.pixel as usize, share.face);
        if let Some(points) = &self.points {
            let (column, row) = (share.pixel % grid.width, share.pixel / grid.width);
            let corner = DVec2::new(f64::from(column), f64::from(first_row + row));
            let image = grid.image_from_pixels(corner + share.centroid());
            let eye = points.eye_point(face, image);
            if let Some(depth) = &mut aovs.depth {
                depth[pixel] = eye.z as f32;
            }
            if let Some(position) = &mut aovs.position {
                position[pixel] = points.world_point(eye).as_vec3().to_array();
            }
            if let Some(normal) = &mut aovs.normal {
                normal[pixel] = points.normal(share.fragment, image).to_array();
            }
        }
        if let Some(object) = &mut aovs.object {
            object[pixel] = self.faces.object(face).0;
        }
        if let Some(material) = &mut aovs.material {
            material[pixel] = material_of(self.scene, self.faces, face).0;
        }
        if let Some(number) = &mut aovs.face {
            number[pixel] = self.faces.source(face);
        }
    }
}

/// Of each name the row in which it stands first.
fn firsts<'a>(names: impl Iterator<Item = &'a str>) -> Vec<u32> {
    let mut rows = HashMap::new();
    names
        .enumerate()
        .map(|(row, name)| *rows.entry(name).or_insert(row as u32))
        .collect()
}
