//! The pictures of one frame: read, filtered, finished.

use super::geometry::Geometry;
use super::source::{Files, Frame};
use super::target::{self, Made};
use super::{Dome, GuideArgument, Run, doubts};
use crate::exit::{Code, Failure};
use crate::talk::Talk;
use veduta::accumulate::Picture;
use veduta::reproject::cube::{Side, Turn};
use veduta_io::sphere::{Guide, View, draw_guides, mask, test_card};
use veduta_io::{PictureFormat, tone};

/// One eye's files, and, once the first frame is read, what they show.
pub struct Eye<'a> {
    pub name: &'static str,
    pub files: Option<Files<'a>>,
    pub seen: Option<Seen>,
}

/// What pictures of these sizes show.
pub struct Seen {
    sizes: Vec<[u32; 2]>,
    pub views: Vec<View>,
    pub made: Made,
    geometry: Geometry,
    pub missing: Vec<(String, f64)>,
}

/// Pictures of one eye, and of which side each is.
pub type Pictures = Vec<(Option<Side>, Picture)>;

impl Dome {
    /// Makes the pictures of a frame: for each file's eye those of its sides, or one.
    pub(super) fn frame(
        &self,
        run: &mut Run<'_>,
        number: u32,
        talk: &mut Talk,
    ) -> Result<Vec<Pictures>, Failure> {
        let mut made = Vec::new();
        for eye in &mut run.eyes {
            made.push(self.eye(eye, run.format, number, talk)?);
        }
        let (Some(how), [_, _]) = (self.aim.stereo(), made.as_slice()) else {
            return Ok(made);
        };
        let [right, left] = [made.pop(), made.pop()].map(Option::unwrap_or_default);
        let joined = left.into_iter().zip(right);
        let joined = joined.map(|((side, left), (_, right))| {
            if [left.width, left.height] != [right.width, right.height] {
                let message = "the views of both eyes have different sizes, and so have their pictures; \
                    tell --size";
                return Err(Failure::new(Code::Usage, message));
            }
            Ok((side, target::both(left, &right, how)))
        });
        Ok(vec![joined.collect::<Result<_, _>>()?])
    }

    /// The pictures of one eye: one, or one for each side.
    fn eye(
        &self,
        eye: &mut Eye<'_>,
        format: PictureFormat,
        number: u32,
        talk: &mut Talk,
    ) -> Result<Pictures, Failure> {
        let frame = match &eye.files {
            Some(files) => Some(self.source.read(files, number, self.strict, talk)?),
            None => None,
        };
        let sizes = frame.as_ref().map_or(Vec::new(), Frame::sizes);
        if eye.seen.is_none() {
            let mut views = match (&eye.files, &frame) {
                (Some(files), Some(frame)) => self.source.views(files, frame)?,
                _ => self.card_views()?,
            };
            // Where two views are equally near, the first is taken: the order of files is not to matter.
            views.sort_by_key(|view| view.side);
            eye.seen = Some(self.look(sizes.clone(), views, frame.as_ref(), format, talk)?);
        }
        let seen = eye.seen.as_mut().expect("was just worked out");
        if let Some(k) = (0..sizes.len()).find(|&k| sizes[k] != seen.sizes[k]) {
            let ([w, h], [first_w, first_h]) = (sizes[k], seen.sizes[k]);
            let name = frame.as_ref().map_or(String::new(), |frame| frame.name(k));
            let message = format!(
                "{name}: has {w} x {h} pixels, and {first_w} x {first_h} in the first frame"
            );
            return Err(Failure::new(Code::BadInput, message));
        }
        let (views, geometry) = (&seen.views, &mut seen.geometry);
        let made = match frame {
            Some(frame) => geometry.pictures(frame.into_pictures(views)),
            None => {
                let card =
                    |view: &View| test_card(view.side.expect("is a side"), view.projection.width);
                geometry.pictures(views.iter().map(card).enumerate())
            }
        };
        let mut made: Pictures = seen
            .made
            .pictures
            .iter()
            .map(|(side, _)| *side)
            .zip(made)
            .collect();
        for ((_, projection), (_, picture)) in seen.made.pictures.iter().zip(&mut made) {
            self.finish(picture, projection, format);
        }
        if let Some(layout) = &seen.made.layout {
            let size = made[0].1.width;
            let joined = layout.join(size, |side| {
                let found = made.iter().find(|(of, _)| *of == Some(side));
                found.expect("all sides are made").1.clone()
            });
            return Ok(vec![(None, joined)]);
        }
        Ok(made)
    }

    /// The views of the test card; none where only guides are drawn.
    fn card_views(&self) -> Result<Vec<View>, Failure> {
        let Some(size) = self.source.test_card else {
            return Ok(Vec::new());
        };
        let files = Side::ALL.map(|side| (side, Turn::NONE, [size; 2]));
        let views = veduta_io::sphere::sides_in_files(&files, &Default::default());
        views.map_err(|(_, error)| Failure::new(Code::Usage, error.to_string()))
    }

    /// Works out what is seen where, and tells what seems wrong.
    fn look(
        &self,
        sizes: Vec<[u32; 2]>,
        views: Vec<View>,
        frame: Option<&Frame>,
        format: PictureFormat,
        talk: &mut Talk,
    ) -> Result<Seen, Failure> {
        let finest = match views.is_empty() {
            // As fine as a picture of guides alone needs to be.
            true => 180_f64.to_radians() / 2048.0,
            false => veduta_io::sphere::finest_pixel(&views),
        };
        let made = self.aim.made(finest, format)?;
        if let Some(frame) = frame {
            for doubt in doubts::of(&views, frame) {
                talk.warn_once_or_fail(doubt, self.strict, Code::BadInput)?;
            }
        }
        let targets: Vec<_> = made
            .pictures
            .iter()
            .map(|(_, projection)| *projection)
            .collect();
        let projections: Vec<_> = views.iter().map(|view| view.projection).collect();
        let geometry = Geometry::new(&projections, &targets, &self.filtering);
        let missing = match views.is_empty() {
            true => Vec::new(),
            false => doubts::missing(&views, geometry.missing()),
        };
        for (what, share) in &missing {
            let share = 100.0 * share;
            let message = format!(
                "no view shows {what}, which is {share:.1} % of the picture and stays clear"
            );
            talk.warn_once_or_fail(message, self.strict, Code::BadInput)?;
        }
        Ok(Seen {
            sizes,
            views,
            made,
            geometry,
            missing,
        })
    }

    /// Mask, guides and background.
    fn finish(
        &self,
        picture: &mut Picture,
        projection: &veduta::reproject::Projection,
        format: PictureFormat,
    ) {
        if let Some([fov, soft]) = self.mask {
            mask(picture, projection, fov, soft);
        }
        let guides = self.guides.iter().map(|guide| match guide {
            GuideArgument::Alignment => Guide::Alignment,
            GuideArgument::SafeArea => Guide::SafeArea,
        });
        let guides: Vec<Guide> = guides.collect();
        if !guides.is_empty() {
            draw_guides(picture, projection, &guides);
        }
        // What is around a dome is dark, also where a format cannot leave it open.
        let black = (format == PictureFormat::Jpeg).then_some([0.0; 3]);
        if let Some(color) = self.background.map_or(black, |behind| behind.0) {
            tone::lay_on(picture, color);
        }
    }
}
