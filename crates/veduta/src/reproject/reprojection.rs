use super::mapping::Mapping;
use super::run::Filtering;
use super::tiles::{Band, Cutter, Found, TILE};
use super::{Projection, Views};
use crate::accumulate::Picture;
use crate::filter::ewa::{Ewa, LEAST_APRON, vectorized};
use rayon::prelude::*;
use std::ops::Range;
use veduta_geometry::DVec2;

/// Widest apron; footprints that reach farther use a pyramid, or go around.
const MOST_APRON: u32 = 48;

/// From given views to a given picture: all that does not depend on what the views show. To be kept for the further frames
/// of a sequence.
#[derive(Clone, Debug)]
pub struct Reprojection {
    sources: Vec<Projection>,
    target: Projection,
    ewa: Ewa,
    bands: Vec<Band>,
    found: Found,
}

/// What of a view a picture is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Need {
    /// Share of the picture's pixels that come from the view, 0 to 1.
    pub share: f64,
    /// The texels that are read, `[left, top, right, bottom]`, right and bottom excluded; `None` if none are, so that the
    /// view need not be made.
    pub window: Option<[u32; 4]>,
}

/// What of the picture no view shows; it is transparent there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Missing {
    /// Share of the picture's pixels, 0 to 1.
    pub share: f64,
    /// Of that, the part to each side of the world, largest first: name and share of the picture's pixels. A cube's face of
    /// that name would show it.
    pub toward: Vec<(&'static str, f64)>,
}

impl Reprojection {
    /// Finds where each pixel of `target` lies in views by the projections `sources`.
    pub fn new(sources: &[Projection], target: &Projection, ewa: &Ewa) -> Self {
        let tops: Vec<u32> = (0..target.height).step_by(TILE as usize).collect();
        let cut = |top: u32| {
            let cutter = Cutter {
                mapping: Mapping { sources, target },
                ewa,
                top,
                band: Band::default(),
            };
            cutter.run(TILE.min(target.height - top))
        };
        let bands: Vec<Band> = tops.into_par_iter().map(cut).collect();
        let mut found = Found {
            pixels: vec![0.0; sources.len()],
            windows: vec![None; sources.len()],
            ..Found::default()
        };
        for band in &bands {
            found.add(&band.found);
        }
        Self {
            sources: sources.to_vec(),
            target: *target,
            ewa: *ewa,
            bands,
            found,
        }
    }

    /// The projection of the picture that is made.
    pub fn target(&self) -> &Projection {
        &self.target
    }

    /// What is needed of each view.
    pub fn needs(&self) -> Vec<Need> {
        let views = self
            .found
            .pixels
            .iter()
            .zip(&self.found.windows)
            .zip(&self.sources);
        views
            .map(|((&pixels, window), source)| {
                let size = DVec2::new(f64::from(source.width), f64::from(source.height));
                let window = window.map(|[low, high]| {
                    // A texel more on each side: weights of the pyramid and of aprons.
                    let low = (low.floor() - 1.0).clamp(DVec2::ZERO, size);
                    let high = (high.ceil() + 2.0).clamp(DVec2::ZERO, size);
                    [low.x, low.y, high.x, high.y].map(|x| x as u32)
                });
                Need {
                    share: pixels / self.found.covered.max(1e-300),
                    window,
                }
            })
            .collect()
    }

    /// What no view shows.
    pub fn missing(&self) -> Missing {
        let names = ["right", "left", "up", "down", "back", "front"];
        let share = |pixels: f64| pixels / self.found.covered.max(1e-300);
        let mut toward: Vec<(&'static str, f64)> = names
            .into_iter()
            .zip(self.found.missing.map(share))
            .filter(|&(_, share)| share > 0.0)
            .collect();
        toward.sort_by(|a, b| b.1.total_cmp(&a.1));
        Missing {
            share: toward.iter().map(|(_, share)| share).sum(),
            toward,
        }
    }

    /// Black views with room for what this picture needs of them: to be set, completed, and given to
    /// [`picture`](Self::picture).
    pub fn views(&self) -> Views {
        Self::views_of(std::slice::from_ref(self))
    }

    /// The same with room for several pictures of the same views, such as the sides of a cube.
    ///
    /// # Panics
    /// If there is no picture, or they are of other views.
    pub fn views_of(pictures: &[Self]) -> Views {
        let sources = &pictures.first().expect("a picture").sources;
        let are_of_them = |picture: &Self| picture.sources == *sources;
        assert!(
            pictures.iter().all(are_of_them),
            "pictures of the same views"
        );
        let apron = pictures.iter().map(Self::apron).max();
        let levels = pictures.iter().map(Self::levels).max();
        Views::new(sources, apron.unwrap_or(LEAST_APRON), levels.unwrap_or(1))
    }

    /// The picture: RGBA in linear light, colour premultiplied by opacity, which is 0 where no view shows anything and the
    /// share of the pixel along the rim of a disc.
    ///
    /// # Panics
    /// If the views are not those of [`views`](Self::views), or not complete.
    pub fn picture(&self, views: &Views) -> Picture {
        let Projection { width, height, .. } = self.target;
        let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
        pixels
            .par_chunks_mut((width * TILE) as usize)
            .enumerate()
            .for_each(|(index, pixels)| self.band(views, index, pixels));
        Picture {
            width,
            height,
            pixels,
        }
    }

    /// How many bands of rows there are, which can be made one by one.
    pub fn band_count(&self) -> usize {
        self.bands.len()
    }

    /// The rows of a band.
    pub fn rows_of_band(&self, band: usize) -> Range<u32> {
        let top = band as u32 * TILE;
        top..(top + TILE).min(self.target.height)
    }

    /// Makes the pixels of a band, its rows from the top: as [`picture`](Self::picture).
    ///
    /// # Panics
    /// If there is no such band, or not as many pixels as it has.
    pub fn band(&self, views: &Views, band: usize, pixels: &mut [[f32; 4]]) {
        let rows = self.rows_of_band(band).len();
        assert_eq!(
            pixels.len(),
            rows * self.target.width as usize,
            "a band's pixels"
        );
        let (ewa, width, band) = (&self.ewa, self.target.width, &self.bands[band]);
        vectorized(Filtering {
            ewa,
            views,
            band,
            width,
            pixels,
        });
    }

    fn apron(&self) -> u32 {
        // Between the places at which it was measured, a footprint may be a little larger; one that is so by more uses
        // the pyramid. Centres lie up to 2.5 texels outside.
        let reach = (1.1 * self.found.reach).ceil() as u32 + 4;
        reach.clamp(LEAST_APRON, MOST_APRON)
    }

    fn levels(&self) -> u32 {
        let large = self.found.reach > (MOST_APRON - 4) as f32;
        let level = self.ewa.level(1.2 * self.found.minor);
        let most = self.sources.iter().map(|view| view.width.max(view.height));
        let all = most
            .max()
            .map_or(1, |side| 1 + side.next_power_of_two().ilog2());
        if large || !level.is_finite() {
            return all;
        }
        // Two levels, and the coarser one for what is a little larger than measured.
        let needed = if level > 0.0 {
            level.ceil() as u32 + 2
        } else {
            1
        };
        needed.min(all)
    }
}

/// One picture from several views, each with its own projection: all steps at once.
///
/// # Panics
/// If a picture has not the size of its projection.
pub fn reproject(
    views: &[(Projection, Picture)],
    target: &Projection,
    ewa: &Ewa,
) -> (Picture, Missing) {
    let sources: Vec<Projection> = views.iter().map(|(projection, _)| *projection).collect();
    let reprojection = Reprojection::new(&sources, target, ewa);
    let mut texels = reprojection.views();
    for (index, (_, picture)) in views.iter().enumerate() {
        texels.set(index, picture);
    }
    texels.complete();
    (reprojection.picture(&texels), reprojection.missing())
}

impl Found {
    fn add(&mut self, other: &Self) {
        for (sum, pixels) in self.pixels.iter_mut().zip(&other.pixels) {
            *sum += pixels;
        }
        for (window, other) in self.windows.iter_mut().zip(&other.windows) {
            *window = match (*window, *other) {
                (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
                (one, other) => one.or(other),
            };
        }
        for (sum, pixels) in self.missing.iter_mut().zip(other.missing) {
            *sum += pixels;
        }
        self.covered += other.covered;
        self.reach = self.reach.max(other.reach);
        self.minor = self.minor.max(other.minor);
    }
}
