//! TEMPORARY until the filter is there: point samples.

use crate::exit::Failure;
use clap::Args;
use rayon::prelude::*;
use veduta::accumulate::Picture;
use veduta::geometry::DVec2;
use veduta::reproject::Projection;

#[derive(Debug, Args)]
pub struct Filtering {}

pub struct Geometry {
    views: Vec<Projection>,
    targets: Vec<Projection>,
}

impl Geometry {
    pub fn new(
        views: &[Projection],
        targets: &[Projection],
        _: &Filtering,
    ) -> Result<Self, Failure> {
        Ok(Self {
            views: views.to_vec(),
            targets: targets.to_vec(),
        })
    }

    pub fn pictures(&mut self, views: &[Picture]) -> Vec<Picture> {
        self.targets
            .iter()
            .map(|target| {
                let pixel = |k: u32| {
                    let (x, y) = (k % target.width, k / target.width);
                    let coverage = target.coverage(x, y) as f32;
                    let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let found = (|| {
                        let direction = target.direction(at)?;
                        let mut best = (f64::NEG_INFINITY, None);
                        for (view, picture) in self.views.iter().zip(views) {
                            let along = view.axis().dot(direction);
                            let Some(image) = view.image(direction) else {
                                continue;
                            };
                            let size = DVec2::new(f64::from(view.width), f64::from(view.height));
                            let inside = image.cmpge(DVec2::ZERO - 1e-6).all()
                                && image.cmple(size + 1e-6).all();
                            if inside
                                && view.lens.covers(view.lens_from_image(image))
                                && along > best.0
                            {
                                let p = (image - 0.5).clamp(DVec2::ZERO, size - 1.0);
                                let i = p.floor();
                                let f = p - i;
                                let texel = |dx: f64, dy: f64| {
                                    let q = (i + DVec2::new(dx, dy)).min(size - 1.0);
                                    picture.pixels
                                        [q.y as usize * view.width as usize + q.x as usize]
                                };
                                let mix = |a: [f32; 4], b: [f32; 4], t: f64| -> [f32; 4] {
                                    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t as f32)
                                };
                                let top = mix(texel(0.0, 0.0), texel(1.0, 0.0), f.x);
                                let low = mix(texel(0.0, 1.0), texel(1.0, 1.0), f.x);
                                best = (along, Some(mix(top, low, f.y)));
                            }
                        }
                        best.1
                    })();
                    found.unwrap_or([0.0; 4]).map(|v| v * coverage)
                };
                Picture {
                    width: target.width,
                    height: target.height,
                    pixels: (0..target.width * target.height)
                        .into_par_iter()
                        .map(pixel)
                        .collect(),
                }
            })
            .collect()
    }
}
