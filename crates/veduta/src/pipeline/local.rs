//! Local processing: some pixels of a picture are made again, and blended into it.
//!
//! Nakamae et al. (1989), "Local processing", do costly work in restricted areas of a stored image alone.
//! Areas are exact here, so each pixel is made whole, of all that it shows: nothing of what was there
//! before is left at its edges.

use super::guests::GuestLayers;
use super::mattes::without_mattes;
use super::{BandBuffers, Blended, material_of};
use crate::accumulate::Picture;
use crate::dice::{self, BAND_ROWS, Bands, PixelGrid, Region};
use crate::scene::Scene;
use crate::shade::light::Daylight;
use crate::shade::{Surfaces, Textures};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeSet;
use veduta_map::{FaceId, Guest, MaterialId, VisibilityMap};

/// Makes the pixels of `region` again in a picture of a map of `scene` with `guests` on `grid`. They are, to
/// the bit, those that [`render_seen`](super::render_seen) makes, and what they cost goes with their number; the
/// others are not touched.
///
/// # Panics
/// If `picture` or `region` are not of the size of `grid`.
pub fn render_region(
    scene: &Scene,
    map: &VisibilityMap,
    guests: &[Guest],
    grid: &PixelGrid,
    region: &Region,
    unlit: bool,
    picture: &mut Picture,
) {
    let size = (picture.width, picture.height, region.pixels().len());
    assert_eq!(
        size,
        (grid.width, grid.height, grid.pixel_count()),
        "picture and region are of the grid"
    );
    let Some(bounds) = region.bounds() else {
        return;
    };
    let guests = (!guests.is_empty()).then(|| GuestLayers::new(scene, map, guests, grid));
    // Mattes hide guests too, and are left out after that.
    let map = match guests {
        Some(_) => Cow::Borrowed(map),
        None => without_mattes(scene, map),
    };
    let map = &*map;
    let bands = Bands::within(map, *grid, bounds);
    let touched = (0..bands.len()).flat_map(|band| bands.fragments(band));
    let faces: BTreeSet<FaceId> = touched
        .map(|&fragment| map.face_of(fragment as usize))
        .collect();
    let materials: BTreeSet<MaterialId> = faces
        .iter()
        .map(|&face| material_of(scene, &map.faces, face))
        .collect();
    let textures = Textures::new(scene, &materials);
    let shown = map.shown_faces();
    let (camera, light) = (&map.camera, Daylight::default());
    let surfaces = Surfaces::new(scene, &textures, camera, &map.faces, &shown, light, unlit);

    let blended = Blended {
        veiled: (!map.veils.is_empty()).then_some(map),
        guests: guests.as_ref(),
    };
    let band_pixels = grid.width as usize * BAND_ROWS as usize;
    let pixels = picture.pixels.par_chunks_mut(band_pixels);
    let is_made = region.pixels().par_chunks(band_pixels);
    pixels.zip(is_made).enumerate().for_each_init(
        || (BandBuffers::default(), Vec::new()),
        |(buffers, made), (band, (pixels, is_made))| {
            if !is_made.contains(&true) {
                return;
            }
            let BandBuffers { dicer, parts, .. } = buffers;
            dice::dice(map, &bands, band, |k| surfaces.varies(k), dicer, parts);
            let first_row = bands.rows(band).start;
            region.clip(parts, first_row);
            if let Some(guests) = &guests {
                guests.touch(bands.rows(band), &mut buffers.guests, parts);
            }
            made.resize(pixels.len(), [0.0; 4]);
            buffers.finish(&surfaces, blended, grid, first_row, made);
            let rows = pixels.iter_mut().zip(&*made).zip(is_made);
            for ((pixel, made), _) in rows.filter(|row| *row.1) {
                *pixel = *made;
            }
        },
    );
}
