//! What is seen where, for all pictures of one eye, and the filter that makes them.

use clap::{Args, ValueEnum};
use veduta::accumulate::Picture;
use veduta::filter::ewa::{Ewa, Profile};
use veduta::reproject::{Projection, Reprojection, Views};

/// How the texels of the views become pixels.
#[derive(Debug, Args)]
#[command(next_help_heading = "Filter")]
pub struct Filtering {
    /// How texels are weighed within the footprint of a pixel
    #[arg(long, value_name = "NAME", default_value = "auto")]
    kernel: Kernel,
    /// How exact footprints of many texels are: two levels of a pyramid stand in for them, the finer the more
    /// exact; full weighs every texel
    #[arg(long, value_name = "HOW", default_value = "good")]
    precision: Precision,
}

/// `--kernel`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kernel {
    /// Robidoux where views are magnified, gaussian where they are reduced
    Auto,
    /// That of Greene & Heckbert: soft, and nothing gets darker or brighter than the views are
    Gaussian,
    /// As sharp as pixels of exact area, with dark lines beside bright edges
    Sharp,
    /// ImageMagick's: nearly as sharp, and edges stay clean
    Robidoux,
    /// Mitchell & Netravali's
    Mitchell,
}

/// `--precision`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Precision {
    /// For a first look
    Draft,
    /// For pictures
    Good,
    /// For masters
    Master,
    /// Every texel
    Full,
}

impl Filtering {
    fn ewa(&self) -> Ewa {
        Ewa {
            profile: match self.kernel {
                Kernel::Auto => Profile::Auto,
                Kernel::Gaussian => Profile::Gaussian,
                Kernel::Sharp => Profile::Sharp,
                Kernel::Robidoux => Profile::Robidoux,
                Kernel::Mitchell => Profile::Mitchell,
            },
            pyramid: match self.precision {
                Precision::Draft => Some(2.0),
                Precision::Good => Some(3.0),
                Precision::Master => Some(4.0),
                Precision::Full => None,
            },
            ..Ewa::default()
        }
    }
}

/// What is seen where in the pictures of one eye: for all frames of a sequence.
pub struct Geometry {
    pictures: Vec<Reprojection>,
    /// The room for the views' pictures, from frame to frame.
    views: Views,
}

impl Geometry {
    /// Works out where the pixels of `targets`, of which there is one at least, lie in `views`.
    pub fn new(views: &[Projection], targets: &[Projection], filtering: &Filtering) -> Self {
        let ewa = filtering.ewa();
        let pictures = targets.iter();
        let pictures = pictures.map(|target| Reprojection::new(views, target, &ewa));
        let pictures: Vec<Reprojection> = pictures.collect();
        Self {
            views: Reprojection::views_of(&pictures),
            pictures,
        }
    }

    /// What no view shows: names of sides of a cube, and their shares of all pictures.
    pub fn missing(&self) -> Vec<(&'static str, f64)> {
        let mut sums: Vec<(&'static str, f64)> = Vec::new();
        for picture in &self.pictures {
            for (name, share) in picture.missing().toward {
                let share = share / self.pictures.len() as f64;
                match sums.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, sum)) => *sum += share,
                    None => sums.push((name, share)),
                }
            }
        }
        sums.sort_by(|a, b| b.1.total_cmp(&a.1));
        sums
    }

    /// Makes the pictures of a frame from those of its views, each with the row of its view, in any order.
    pub fn pictures(&mut self, views: impl Iterator<Item = (usize, Picture)>) -> Vec<Picture> {
        for (view, picture) in views {
            self.views.set(view, &picture);
        }
        self.views.complete();
        let pictures = self.pictures.iter();
        pictures
            .map(|picture| picture.picture(&self.views))
            .collect()
    }
}
