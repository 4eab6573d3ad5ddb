use super::Projection;
use crate::accumulate::Picture;
use crate::filter::{Kernel, Planes};
use rayon::prelude::*;
use veduta_geometry::{DVec2, DVec3};

/// Pictures of all around, ready to be filtered: planes with aprons at every level of a pyramid.
///
/// The aprons continue a view by what its neighbours show, so that a footprint that reaches over the edge of a cube's face
/// finds there what it would find on a face without an end.
#[derive(Clone, Debug)]
pub struct Views {
    projections: Vec<Projection>,
    /// Of each view its levels, finest first.
    pyramids: Vec<Vec<Planes>>,
    /// How many levels there are to be.
    count: u32,
}

/// How far outside of a view, in texels, a direction that no view shows is still taken from its border: rounding,
/// and pixels at the edge of what was rendered.
const TOLERANCE: f64 = 1.0;

impl Views {
    /// Black views, with room for `count` levels of pyramid and aprons of `apron` texels.
    ///
    /// `channels` is 3 where all views are opaque, and 4 otherwise.
    pub(super) fn new(projections: &[Projection], channels: usize, apron: u32, count: u32) -> Self {
        let finest = projections.iter().map(|view| {
            let planes = Planes::new(view.width, view.height, channels, apron);
            if view.period() == Some(f64::from(view.width)) {
                planes.repeating()
            } else {
                planes
            }
        });
        Self {
            pyramids: finest.map(|planes| vec![planes]).collect(),
            projections: projections.to_vec(),
            count,
        }
    }

    /// By which projections they were made.
    pub fn projections(&self) -> &[Projection] {
        &self.projections
    }

    /// 3 where all views are opaque, else 4.
    pub fn channels(&self) -> usize {
        self.pyramids
            .first()
            .map_or(3, |levels| levels[0].channels())
    }

    /// Sets one row of a view's picture: RGBA in linear light, colour premultiplied by opacity, which is not looked at
    /// where all views are opaque.
    ///
    /// # Panics
    /// If there is no such view or row, or the number of texels is not its width.
    pub fn set_row(&mut self, view: usize, row: u32, texels: &[[f32; 4]]) {
        self.pyramids[view][0].set_row(row, texels);
    }

    /// Sets a view's picture.
    ///
    /// # Panics
    /// If there is no such view or the picture has another size.
    pub fn set(&mut self, view: usize, picture: &Picture) {
        let size = [
            self.pyramids[view][0].width(),
            self.pyramids[view][0].height(),
        ];
        assert_eq!([picture.width, picture.height], size, "the view's size");
        let rows = picture.pixels.chunks_exact(picture.width as usize);
        for (row, texels) in rows.enumerate() {
            self.set_row(view, row as u32, texels);
        }
    }

    /// The planes of a view for setting samples without the way over RGBA.
    ///
    /// # Panics
    /// If there is no such view.
    pub fn planes_mut(&mut self, view: usize) -> &mut Planes {
        &mut self.pyramids[view][0]
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
    pub(super) fn pyramid(&self, view: usize) -> &[Planes] {
        &self.pyramids[view]
    }

    fn fill_aprons(&mut self, level: usize) {
        // First a narrow ring, in which interpolation near a neighbour's edge has only that neighbour's texels; then
        // all, with the ring of the neighbours to interpolate in.
        let apron = self.pyramids.first().map_or(0, |levels| levels[0].apron());
        for (width, ring) in [(RING.min(apron), 0), (apron, RING.min(apron))] {
            let kernel = Kernel::cubic(0.0, 0.5);
            let aprons: Vec<Vec<_>> = (0..self.projections.len())
                .into_par_iter()
                .map(|view| self.apron(level, view, width as i32, ring as i32, &kernel))
                .collect();
            for (levels, apron) in self.pyramids.iter_mut().zip(aprons) {
                for (column, row, texel) in apron {
                    levels[level].set(column, row, texel);
                }
            }
        }
    }

    /// Texels around a view's picture, `width` of them on each side, and those within that the lens does not show,
    /// from views that do, which may be read `ring` texels beyond their borders.
    fn apron(
        &self,
        level: usize,
        view: usize,
        width: i32,
        ring: i32,
        kernel: &Kernel,
    ) -> Vec<(i32, i32, [f32; 4])> {
        let scale = f64::from(1_u32 << level);
        let (projection, planes) = (&self.projections[view], &self.pyramids[view][level]);
        let [columns, rows] = [planes.width() as i32, planes.height() as i32];
        let mut found = Vec::new();
        for row in -width..rows + width {
            let within = (0..rows).contains(&row);
            let mut column = -width;
            while column < columns + width {
                let at = scale * (DVec2::new(f64::from(column), f64::from(row)) + 0.5);
                if within && (0..columns).contains(&column) {
                    if !projection.lens.is_round() {
                        column = columns;
                        continue;
                    }
                    if projection.lens.covers(projection.lens_from_image(at)) {
                        column += 1;
                        continue;
                    }
                }
                let other = projection
                    .direction(at)
                    .and_then(|direction| find(&self.projections, direction));
                let texel = match other {
                    Some((other, image)) => {
                        let planes = &self.pyramids[other][level];
                        interpolate(planes, image / scale - 0.5, ring, kernel)
                    }
                    // Nobody shows it: the border is continued.
                    None => {
                        let inside = nearest_covered(projection, at) / scale;
                        planes.texel(
                            (inside.x.floor() as i32).clamp(0, columns - 1),
                            (inside.y.floor() as i32).clamp(0, rows - 1),
                        )
                    }
                };
                found.push((column, row, texel));
                column += 1;
            }
        }
        found
    }
}

/// Width of the first ring of an apron: what cubic interpolation reaches over a border.
const RING: u32 = 2;

/// The view that shows a direction, and where: of several the one whose axis is nearest.
///
/// Where none does, one that ends within [`TOLERANCE`] of it.
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
    [1e-9, TOLERANCE].into_iter().find_map(|margin| {
        let mut best: Option<(usize, DVec2)> = None;
        let mut nearness = f64::NEG_INFINITY;
        for (index, view) in projections.iter().enumerate() {
            let along = view.axis().dot(direction);
            if along > nearness
                && let Some(image) = within(view, margin)
            {
                nearness = along;
                best = Some((index, image));
            }
        }
        best
    })
}

/// The image point in the picture that is nearest to one outside.
fn nearest_covered(projection: &Projection, image: DVec2) -> DVec2 {
    let size = DVec2::new(f64::from(projection.width), f64::from(projection.height));
    let inside = image.clamp(DVec2::splat(0.5), size - 0.5);
    if !projection.lens.is_round() {
        return inside;
    }
    let point = projection.lens_from_image(inside);
    let most = 1.0 - 0.5 / projection.pixels_per_unit();
    projection.image_from_lens(point.clamp_length_max(most.max(0.0)))
}

/// The picture at `at`, in texels with centres at whole numbers, by cubic interpolation of texels that lie at most
/// `ring` outside of it. Equal texels give that value exactly, and no value is beyond those of the texels.
fn interpolate(planes: &Planes, at: DVec2, ring: i32, kernel: &Kernel) -> [f32; 4] {
    let [columns, rows] = [planes.width() as i32, planes.height() as i32];
    let corner = at.floor();
    let part = at - corner;
    let [column, row] = [corner.x as i32, corner.y as i32];
    let clamped = |k: i32, size: i32| k.clamp(-ring, size - 1 + ring);
    let weights = |part: f64| [-1, 0, 1, 2].map(|k| kernel.at(part - f64::from(k)) as f32);
    let [across, down] = [weights(part.x), weights(part.y)];
    let first = planes.texel(clamped(column, columns), clamped(row, rows));
    let (mut sum, mut low, mut high) = ([0.0_f32; 4], first, first);
    for (j, down) in down.into_iter().enumerate() {
        for (i, across) in across.into_iter().enumerate() {
            let texel = planes.texel(
                clamped(column + i as i32 - 1, columns),
                clamped(row + j as i32 - 1, rows),
            );
            for channel in 0..4 {
                // Differences, so that a constant is not rounded.
                sum[channel] += across * down * (texel[channel] - first[channel]);
                low[channel] = low[channel].min(texel[channel]);
                high[channel] = high[channel].max(texel[channel]);
            }
        }
    }
    std::array::from_fn(|k| (first[k] + sum[k]).clamp(low[k], high[k]))
}
