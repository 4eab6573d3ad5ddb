//! How light becomes colour: filter, exposure, tone, background.

use crate::exit::{Code, Failure};
use crate::talk::Talk;
use crate::values::{self, Background};
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use std::path::Path;
use veduta::accumulate::Picture;
use veduta::filter::Filter;
use veduta::reproject::Projection;
use veduta::scene::Scene;
use veduta_io::read_picture;
use veduta_io::tone::{self, Exposure, Tone};

/// How light becomes colour.
#[derive(Debug, Args)]
#[command(next_help_heading = "Look")]
pub struct Look {
    /// Show the colours of materials as they are, without light
    #[arg(long)]
    pub unlit: bool,
    /// How what is seen around a pixel's centre is weighed. All but box reach into the neighbours
    ///
    /// Weights are exact, as areas are: no samples. Deep pictures and the channels of --aov keep the areas of
    /// pixels. mitchell and catmull-rom have lobes below 0: beside edges, colours may be a little below 0 and
    /// opacities above 1. Linear formats keep that, others cut it off. Beyond the frame nothing is known: at
    /// its border, a pixel is the mean of what its filter reaches inside.
    #[arg(long, value_name = "NAME", default_value = "box")]
    filter: FilterArgument,
    /// none, a colour such as #8ab4d8, a picture, which is scaled to the frame, or (for shade and
    /// composite) a stored map of the same camera, all of which lies behind everything
    #[arg(long, value_name = "COLOUR|FILE", default_value = "none")]
    background: Background,
    /// auto, or doublings of light; by default auto for lit pictures for a display, else 0
    #[arg(long, value_name = "EV", value_parser = values::exposure, allow_hyphen_values = true)]
    exposure: Option<Exposure>,
    /// How highlights are rolled off; by default filmic for lit pictures for a display, else none
    #[arg(long, value_name = "CURVE")]
    tone: Option<ToneArgument>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ToneArgument {
    /// Cut off what is brighter than white
    None,
    /// Leave middle tones, roll off highlights above 0.6 (the shoulder of Reinhard et al. 2002)
    Filmic,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FilterArgument {
    /// Exact area in the pixel
    Box,
    /// 1 at the centre, 0 at the next one
    Triangle,
    /// Soft: standard deviation half a pixel, ends at two
    Gaussian,
    /// The compromise of Mitchell & Netravali (1988): reaches two pixels, a little ringing
    Mitchell,
    /// The sharpest: reaches two pixels, more ringing
    CatmullRom,
    /// The softest: reaches two pixels
    BSpline,
}

/// What pictures are laid on.
#[derive(Debug)]
enum Backdrop {
    None,
    Color([f32; 3]),
    Picture(Picture),
}

/// How the pictures of one scene are developed.
#[derive(Debug)]
pub struct Development {
    backdrop: Backdrop,
    within: Option<Projection>,
    exposure: Option<Exposure>,
    tone: Option<Tone>,
    unlit: bool,
}

impl Look {
    /// How pixels are weighed.
    pub fn filter(&self) -> Filter {
        match self.filter {
            FilterArgument::Box => Filter::Box,
            FilterArgument::Triangle => Filter::Triangle,
            FilterArgument::Gaussian => Filter::Gaussian,
            FilterArgument::Mitchell => Filter::Mitchell,
            FilterArgument::CatmullRom => Filter::CatmullRom,
            FilterArgument::BSpline => Filter::BSpline,
        }
    }

    /// The stored map that lies behind everything, if there is one.
    pub fn background_map(&self) -> Option<&Path> {
        match &self.background {
            Background::Map(path) => Some(path),
            _ => None,
        }
    }

    /// Fails for a stored map as background where that has no meaning, and tells why.
    pub fn refuse_background_map_of(&self, why: &str) -> Result<(), Failure> {
        match self.background_map() {
            None => Ok(()),
            Some(path) => {
                let message = format!("{}: {why}", path.display());
                Err(Failure::new(Code::Usage, message))
            }
        }
    }

    /// Fails for a stored map as background, for a verb that works with scenes.
    pub fn refuse_background_map(&self) -> Result<(), Failure> {
        let Some(path) = self.background_map() else {
            return Ok(());
        };
        let message = format!(
            "{}: a stored map is laid behind stored maps: make one of the scene (-o scene.veduta), then \
             `veduta composite scene.veduta --background {} -o …`",
            path.display(),
            path.display()
        );
        Err(Failure::new(Code::Usage, message))
    }

    /// Whether pixels are weighed by area.
    pub fn is_by_area(&self) -> bool {
        self.filter == FilterArgument::Box
    }

    /// Fails if a filter is asked for that has no meaning for what is made, and tells why.
    pub fn refuse_filter(&self, why: &str) -> Result<(), Failure> {
        if self.is_by_area() {
            return Ok(());
        }
        let message = format!("{why}; leave --filter out");
        Err(Failure::new(Code::Usage, message))
    }

    /// Reads what the look needs, before the work rather than after it.
    pub fn development(
        &self,
        scene: &Scene,
        strict: bool,
        talk: &mut Talk,
    ) -> Result<Development, Failure> {
        let backdrop = match &self.background {
            // A map is part of what is shown when the picture is made.
            Background::None | Background::Map(_) => Backdrop::None,
            Background::Color(color) => Backdrop::Color(*color),
            Background::Picture(path) => {
                let loaded = read_picture(path)?;
                for warning in loaded.warnings {
                    let message = format!("{}: {warning}", path.display());
                    talk.warn_or_fail(message, strict, Code::BadInput)?;
                }
                Backdrop::Picture(loaded.picture)
            }
        };
        let has_materials = !scene.materials.is_empty();
        Ok(Development {
            backdrop,
            within: None,
            exposure: self.exposure,
            tone: self.tone.map(|tone| match tone {
                ToneArgument::None => Tone::None,
                ToneArgument::Filmic => Tone::Filmic,
            }),
            // Pictures of other programs, which have no materials here, are lit.
            unlit: self.unlit || has_materials && scene.materials.iter().all(|m| m.unlit),
        })
    }
}

impl Development {
    /// Applies exposure, tone and background; tells the exposure in EV.
    ///
    /// Only a lit picture for a display is exposed and toned unasked: linear formats are for further
    /// work, and unlit colours are to come through as they are.
    pub fn develop(&self, picture: &mut Picture, for_display: bool) -> f32 {
        let ev = tone::exposure_of(picture, self.exposure_asked(for_display));
        self.develop_at(picture, ev, for_display);
        ev
    }

    /// Whether the picture tells the exposure.
    pub fn exposes_itself(&self, for_display: bool) -> bool {
        self.exposure_asked(for_display) == Exposure::Auto
    }

    /// Only a lit picture for a display is exposed unasked.
    fn exposure_asked(&self, for_display: bool) -> Exposure {
        self.exposure.unwrap_or(if for_display && !self.unlit {
            Exposure::Auto
        } else {
            Exposure::Ev(0.0)
        })
    }

    /// The colour behind a vector picture, if there is one.
    pub fn plain_background(&self) -> Result<Option<[f32; 3]>, Failure> {
        match &self.backdrop {
            Backdrop::None => Ok(None),
            Backdrop::Color(color) => Ok(Some(*color)),
            Backdrop::Picture(_) => {
                let message = "a vector picture has a background of one colour, or none";
                Err(Failure::new(Code::Usage, message))
            }
        }
    }

    /// Exposes all pictures as `whole` would be exposed, of which they are parts.
    pub fn expose_as(&mut self, whole: &Picture, for_display: bool) {
        let ev = tone::exposure_of(whole, self.exposure_asked(for_display));
        self.exposure = Some(Exposure::Ev(ev));
    }

    /// Lays backgrounds only where the lens of that picture looks: what is beyond stays clear.
    pub fn within(&mut self, projection: Projection) {
        self.within = Some(projection);
    }

    /// [`Development::develop`] with an exposure that is known.
    pub fn develop_at(&self, picture: &mut Picture, ev: f32, for_display: bool) {
        if ev != 0.0 {
            tone::expose(picture, ev);
        }
        let curve = self.tone.unwrap_or(if for_display && !self.unlit {
            Tone::Filmic
        } else {
            Tone::None
        });
        tone::apply_tone(picture, curve);
        let rims = match (&self.backdrop, &self.within) {
            (Backdrop::Color(_) | Backdrop::Picture(_), Some(lens)) => rims(picture, lens),
            _ => Vec::new(),
        };
        match &self.backdrop {
            Backdrop::None => {}
            Backdrop::Color(color) => tone::lay_on(picture, *color),
            Backdrop::Picture(behind) => tone::lay_on_picture(picture, behind),
        }
        for Rim { pixel, own, share } in rims {
            let whole = &mut picture.pixels[pixel];
            for (channel, own) in whole.iter_mut().zip(own) {
                *channel = own + (*channel - own) * share;
            }
        }
    }
}

/// A pixel of which a part lies beyond the lens.
struct Rim {
    pixel: usize,
    /// What it shows before anything is laid behind it.
    own: [f32; 4],
    /// Of what is laid behind it, the share that the lens sees.
    share: f32,
}

/// The pixels that the lens does not fill.
fn rims(picture: &Picture, lens: &Projection) -> Vec<Rim> {
    // A preview is smaller than the picture.
    let scale = f64::from(lens.width) / f64::from(picture.width);
    let width = picture.width as usize;
    let of_pixel = |(pixel, &own): (usize, &[f32; 4])| {
        let place = [pixel % width, pixel / width];
        let [column, row] = place.map(|at| ((at as f64 + 0.5) * scale) as u32);
        let covered = lens.coverage(column, row) as f32;
        let open = 1.0 - own[3];
        let share = ((covered - own[3]) / open).clamp(0.0, 1.0);
        (covered < 1.0 && open > 0.0).then_some(Rim { pixel, own, share })
    };
    let pixels = picture.pixels.par_iter().enumerate();
    pixels.filter_map(of_pixel).collect()
}
