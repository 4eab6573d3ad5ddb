//! How guests get into pictures.

use crate::dice::{GuestBuffers, GuestDicer, GuestLight, Parts, PixelGrid};
use crate::scene::Scene;
use std::ops::Range;
use veduta_map::{Guest, VisibilityMap};

/// The guests of a picture.
pub(super) struct GuestLayers<'a> {
    dicer: GuestDicer<'a>,
    map: &'a VisibilityMap,
    /// Of each fragment, whether it is of a matte; `None` where none is.
    mattes: Option<Vec<bool>>,
}

impl<'a> GuestLayers<'a> {
    pub fn new(
        scene: &Scene,
        map: &'a VisibilityMap,
        guests: &'a [Guest],
        grid: &PixelGrid,
    ) -> Self {
        let mattes = scene.are_seen().map(|are_seen| {
            let faces = (0..map.fragment_count()).map(|fragment| map.face_of(fragment));
            faces
                .map(|face| !are_seen[map.faces.object(face).index()])
                .collect()
        });
        Self {
            dicer: GuestDicer::new(map, guests, *grid),
            map,
            mattes,
        }
    }

    /// Makes the parts of a band ready for [`GuestLayers::lay`], before they are shaded.
    pub fn touch(&self, rows: Range<u32>, buffers: &mut GuestBuffers, parts: &mut Parts) {
        let opaque = self.map.opaque.len();
        let is_veil = |fragment: u32| fragment as usize >= opaque;
        let veils = parts.boundary.iter().rev();
        let veils = veils.take_while(|part| is_veil(part.fragment)).count();
        self.dicer.touch(rows, buffers, parts, veils);
        if let Some(mattes) = &self.mattes {
            parts.runs.retain(|run| !mattes[run.fragment as usize]);
        }
    }

    /// Lays the guests between the parts of a band: see [`GuestDicer::lay`].
    pub fn lay(
        &self,
        first_row: u32,
        opacities: &[f32],
        buffers: &mut GuestBuffers,
        parts: &mut Parts,
        light: &mut Vec<GuestLight>,
        attenuate: impl FnOnce(&mut Parts),
    ) {
        self.dicer
            .lay(first_row, opacities, buffers, parts, light, attenuate);
        if let Some(mattes) = &self.mattes {
            let of_mattes = parts.boundary.iter_mut();
            of_mattes
                .filter(|part| mattes[part.fragment as usize])
                .for_each(|part| part.area = 0.0);
        }
    }
}
