use super::Projection;
use super::aprons::Apron;
use crate::accumulate::Picture;
use crate::filter::Texels;
use rayon::prelude::*;
use veduta_geometry::{DVec2, DVec3};

/// Pictures of all around, ready to be filtered: texels with aprons at every level of a pyramid.
///
/// The aprons continue a view by what its neighbours show, so that a footprint that reaches over the edge of a cube's face
/// finds there what it would find on a face without an end.
#[derive(Clone, Debug)]
pub struct Views {
    projections: Vec<Projection>,
    /// Of each view its levels, finest first.
    pyramids: Vec<Vec<Texels>>,
    /// How many levels there are to be.
    count: u32,
    /// Of each level that was completed once: what aprons are made from, in two steps, of each view. It is the same for
    /// all frames.
    aprons: Vec<[Vec<Apron>; 2]>,
}

/// How wide a gap between views is closed by their borders, texels to each side: angles of views that were told in few
/// digits leave one.
const GAP: f64 = 1.0;

/// How far outside of a view, in texels, a direction lies by rounding.
const ROUNDING: f64 = 1e-9;

impl Views {
    /// Black views, with room for `count` levels of pyramid and aprons of `apron` texels.
    pub(super) fn new(projections: &[Projection], apron: u32, count: u32) -> Self {
        let finest = projections.iter().map(|view| {
            let texels = Texels::new(view.width, view.height, apron);
            if view.period() == Some(f64::from(view.width)) {
                texels.repeating()
            } else {
                texels
            }
        });
        Self {
            pyramids: finest.map(|texels| vec![texels]).collect(),
            projections: projections.to_vec(),
            count,
            aprons: Vec::new(),
        }
    }

    /// By which projections they were made.
    pub fn projections(&self) -> &[Projection] {
        &self.projections
    }

    /// A row of a view's picture, to be filled: RGBA in linear light, colour premultiplied by opacity.
    ///
    /// # Panics
    /// If there is no such view or row.
    pub fn row_mut(&mut self, view: usize, row: u32) -> &mut [[f32; 4]] {
        self.pyramids[view][0].row_mut(row)
    }

    /// Sets a view's picture.
    ///
    /// # Panics
    /// If there is no such view or the picture has another size.
    pub fn set(&mut self, view: usize, picture: &Picture) {
        let finest = &mut self.pyramids[view][0];
        let size = [finest.width(), finest.height()];
        assert_eq!([picture.width, picture.height], size, "the view's size");
        let rows = picture.pixels.chunks_exact(picture.width as usize);
        for (row, texels) in rows.enumerate() {
            finest.row_mut(row as u32).copy_from_slice(texels);
        }
    }

    /// Makes aprons and pyramids of the pictures that were set; to be called again after others are.
    pub fn complete(&mut self) {
        self.pyramids
            .iter_mut()
            .for_each(|levels| levels.truncate(1));
        self.fill_aprons(0);
        for level in 1..self.count as usize {
            self.pyramids.par_iter_mut().for_each(|levels| {
                let finer = &levels[level - 1];
                levels.push(finer.halved(finer.apron()));
            });
            self.fill_aprons(level);
        }
    }

    /// The levels of a view, finest first.
    #[inline]
    pub(super) fn pyramid(&self, view: usize) -> &[Texels] {
        &self.pyramids[view]
    }

    /// Fills the aprons of a level.
    fn fill_aprons(&mut self, level: usize) {
        let Self {
            projections,
            pyramids,
            aprons,
            ..
        } = self;
        if aprons.len() == level {
            aprons.push(Apron::of_level(projections, pyramids, level));
        }
        for step in &aprons[level] {
            let found: Vec<Vec<[f32; 4]>> = step
                .par_iter()
                .map(|apron| apron.texels(pyramids, level))
                .collect();
            let of_views = pyramids.par_iter_mut().zip(step).zip(found);
            of_views.for_each(|((levels, apron), found)| apron.fill(&mut levels[level], &found));
        }
    }
}

/// The view that shows a direction, and where: of several the one whose axis is nearest.
///
/// Where none does, but two end within [`GAP`] of it, one of these.
pub(super) fn find(projections: &[Projection], direction: DVec3) -> Option<(usize, DVec2)> {
    let within = |view: &Projection, margin: f64| {
        let image = view.image(direction)?;
        let size = DVec2::new(f64::from(view.width), f64::from(view.height));
        let inside = image.cmpge(DVec2::splat(-margin)).all() && image.cmple(size + margin).all();
        let shown = !view.lens.is_round() || {
            let pixels = view.pixels_per_unit();
            view.lens_from_image(image).length() <= 1.0 + margin / pixels
        };
        (inside && shown).then_some(image)
    };
    [(ROUNDING, 1), (GAP, 2)]
        .into_iter()
        .find_map(|(margin, least)| {
            let mut best: Option<(usize, DVec2)> = None;
            let (mut nearness, mut count) = (f64::NEG_INFINITY, 0);
            for (index, view) in projections.iter().enumerate() {
                let along = view.axis().dot(direction);
                if (along > nearness || least > 1)
                    && let Some(image) = within(view, margin)
                {
                    count += 1;
                    if along > nearness {
                        nearness = along;
                        best = Some((index, image));
                    }
                }
            }
            best.filter(|_| count >= least)
        })
}
