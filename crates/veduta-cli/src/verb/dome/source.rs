//! What the views are: people's files, by layouts, names and conventions, or the test card.

use crate::exit::{Code, Failure};
use crate::talk::{Talk, plain};
use crate::values::{self, FieldOfView};
use crate::verb::frame_names::FrameNames;
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use veduta::accumulate::Picture;
use veduta::reproject::cube::{Layout, LayoutError, Side, Turn, sides_of, turns_of};
use veduta::reproject::{Lens, Orientation};
use veduta_io::sphere::{self, Panorama, SideForm, View, sides_by_names};
use veduta_io::{FileView, LoadedPicture, read_linear_picture, read_picture, read_views_file};

/// What the views are.
#[derive(Debug, Args)]
#[command(next_help_heading = "Views")]
pub struct Source {
    /// Where the sides of a cube lie in one picture; told from its shape by default
    ///
    /// 6x1, 1x6, 3x2, 2x3: strips, in the --order of v360. cross, vertical-cross: seen from inside.
    /// sv3d: cube maps of videos (Spherical Video V2). eac: equi-angular, as YouTube has it. exr: cube maps of
    /// OpenEXR.
    #[arg(long, value_name = "NAME", value_parser = layout_name, conflicts_with = "from")]
    layout: Option<String>,
    /// Which sides the files, or the parts of a strip, are, in their order: letters for right, left, up,
    /// down, front and back; rludfb by default for strips, for files told by their names
    #[arg(long, value_name = "LETTERS", conflicts_with = "from")]
    order: Option<String>,
    /// How many quarters each is turned clockwise, in the same order; 000000 by default
    #[arg(long, value_name = "DIGITS", conflicts_with = "from")]
    rotations: Option<String>,
    /// How the sides of a cube lie: as in a cross (cross, also that of OpenGL), or with the upper and lower
    /// side turned by 180 degrees (video, also that of OpenEXR)
    #[arg(
        long,
        value_name = "NAME",
        default_value = "cross",
        hide_default_value = true
    )]
    convention: Convention,
    /// Of the world that the sides were rendered in, where z is an axis to the front (left) or to
    /// the back (right). Cubes of OpenGL and the like are left-handed; made of right-handed ones they are mirrored
    #[arg(
        long,
        value_name = "HAND",
        default_value = "left",
        hide_default_value = true
    )]
    handedness: Hand,
    /// Pixels on each edge of a side that reach beyond 90 degrees
    #[arg(
        long,
        value_name = "PIXELS",
        default_value_t = 0,
        hide_default_value = true
    )]
    padding: u32,
    /// Field of view of the sides, where it is not 90 degrees
    #[arg(long, value_name = "ANGLE", conflicts_with = "padding")]
    side_fov: Option<FieldOfView>,
    /// The lens of one picture that shows no cube, such as equirect, fisheye:200, ball, or two fisheyes side by
    /// side (dual-fisheye:190); equirect by default for pictures twice as wide as high
    #[arg(long, value_name = "LENS", value_parser = from)]
    from: Option<From>,
    /// Which of two fisheyes stands first; back-front is that of v360
    #[arg(
        long,
        value_name = "ORDER",
        default_value = "back-front",
        hide_default_value = true
    )]
    discs: Discs,
    /// Where the middle of that picture lies, to the right of the front
    #[arg(long, value_name = "ANGLE", default_value = "0", hide_default_value = true, value_parser = values::angle, allow_hyphen_values = true)]
    from_yaw: f64,
    /// How far the middle of that picture lies above the horizon; 90deg for a picture of a dome
    #[arg(long, value_name = "ANGLE", default_value = "0", hide_default_value = true, value_parser = values::angle, allow_hyphen_values = true)]
    from_elevation: f64,
    /// Take numbers of 8 and 16 bits as light as it is, not as sRGB
    #[arg(long)]
    linear: bool,
    /// In place of files a cube to try conventions on, with sides of that many pixels: each tells its
    /// name, what is up, and its neighbours
    #[arg(long, value_name = "PIXELS", num_args = 0..=1, default_missing_value = "1024", value_parser = clap::value_parser!(u32).range(1..=16_384), conflicts_with_all = ["views", "right"])]
    pub test_card: Option<u32>,
}

/// `--convention`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Convention {
    Cross,
    Video,
}

/// `--handedness`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Hand {
    Left,
    Right,
}

/// `--discs`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Discs {
    FrontBack,
    BackFront,
}

/// `--from`
#[derive(Clone, Copy, Debug, PartialEq)]
enum From {
    Lens(Lens),
    TwoDiscs(Lens),
}

fn from(text: &str) -> Result<From, String> {
    let lens = |text: &str| text.parse::<Lens>().map_err(|error| error.to_string());
    match text.strip_prefix("dual-") {
        Some(rest) => lens(rest).map(From::TwoDiscs),
        None => lens(text).map(From::Lens),
    }
}

fn layout_name(name: &str) -> Result<String, String> {
    let known = name.parse::<Layout>().map_err(|error| error.to_string());
    known.map(|_| name.to_owned())
}

/// The files of one eye, and what tells how they are views.
#[derive(Debug)]
pub struct Files<'a> {
    names: Vec<FrameNames<'a>>,
    /// Of a file of views: what each of its pictures is.
    rig: Option<Vec<FileView>>,
}

/// The pictures of one frame.
#[derive(Debug)]
pub struct Frame {
    paths: Vec<PathBuf>,
    pictures: Vec<Picture>,
    told: Vec<Option<Panorama>>,
}

impl Frame {
    /// Widths and heights in pixels.
    pub fn sizes(&self) -> Vec<[u32; 2]> {
        let size = |picture: &Picture| [picture.width, picture.height];
        self.pictures.iter().map(size).collect()
    }

    /// The picture of a view.
    pub fn picture(&self, view: &View) -> Picture {
        view.picture(&self.pictures[view.file])
    }

    /// The pictures of views, each with the row of its view. A file's picture is given up with its last view: all of
    /// them would take as much memory as what is made of them.
    pub fn into_pictures(self, views: &[View]) -> impl Iterator<Item = (usize, Picture)> {
        let mut files: Vec<Option<Picture>> = self.pictures.into_iter().map(Some).collect();
        let mut rows: Vec<usize> = (0..views.len()).collect();
        rows.sort_by_key(|&row| views[row].file);
        (0..rows.len()).map(move |place| {
            let row = rows[place];
            let view = &views[row];
            let file = files[view.file]
                .take()
                .expect("is kept up to its last view");
            let picture = view.picture(&file);
            let next = rows.get(place + 1).map(|&next| views[next].file);
            if next == Some(view.file) {
                files[view.file] = Some(file);
            }
            (row, picture)
        })
    }

    /// A file's name.
    pub fn name(&self, file: usize) -> String {
        plain(&self.paths[file].to_string_lossy())
    }
}

impl Source {
    /// The files of `views`; a file of views is read.
    pub fn files<'a>(&self, views: &'a [PathBuf], rig: Option<&'a [FileView]>) -> Files<'a> {
        let paths: Vec<&Path> = match rig {
            Some(rig) => rig.iter().map(|view| view.picture.as_path()).collect(),
            None => views.iter().map(PathBuf::as_path).collect(),
        };
        Files {
            names: paths.into_iter().map(FrameNames::of_input).collect(),
            rig: rig.map(<[FileView]>::to_vec),
        }
    }

    /// The views of a file of views, if the one of `views` is one.
    pub fn rig(&self, views: &[PathBuf]) -> Result<Option<Vec<FileView>>, Failure> {
        let is_rig = |path: &PathBuf| {
            let suffix = path.extension().unwrap_or_default();
            suffix.eq_ignore_ascii_case("toml")
        };
        if !views.iter().any(is_rig) {
            return Ok(None);
        }
        let [path] = views else {
            let message = "a file of views (.toml) names all its pictures; give it alone";
            return Err(Failure::new(Code::Usage, message));
        };
        let of_cubes = [
            (self.layout.is_some(), "--layout"),
            (self.order.is_some(), "--order"),
            (self.rotations.is_some(), "--rotations"),
            (self.from.is_some(), "--from"),
            (self.padding > 0, "--padding"),
            (self.side_fov.is_some(), "--side-fov"),
        ];
        if let Some((_, option)) = of_cubes.into_iter().find(|(is_given, _)| *is_given) {
            let message = format!(
                "{}: tells its lenses itself; leave {option} out",
                path.display()
            );
            return Err(Failure::new(Code::Usage, message));
        }
        Ok(Some(read_views_file(path)?))
    }

    /// Reads the pictures of a frame, several at once.
    pub fn read(
        &self,
        files: &Files<'_>,
        number: u32,
        strict: bool,
        talk: &mut Talk,
    ) -> Result<Frame, Failure> {
        let paths: Vec<PathBuf> = files.names.iter().map(|names| names.path(number)).collect();
        let read = if self.linear {
            read_linear_picture
        } else {
            read_picture
        };
        let loaded: Vec<_> = paths.par_iter().map(|path| read(path)).collect();
        let mut frame = Frame {
            paths,
            pictures: Vec::new(),
            told: Vec::new(),
        };
        for loaded in loaded {
            let LoadedPicture {
                picture,
                panorama,
                warnings,
                ..
            } = loaded?;
            for warning in warnings {
                let name = frame.name(frame.pictures.len());
                talk.warn_once_or_fail(format!("{name}: {warning}"), strict, Code::BadInput)?;
            }
            frame.pictures.push(picture);
            frame.told.push(panorama);
        }
        Ok(frame)
    }

    /// What the pictures of a frame show.
    pub fn views(&self, files: &Files<'_>, frame: &Frame) -> Result<Vec<View>, Failure> {
        let sizes = frame.sizes();
        if let Some(rig) = &files.rig {
            let views = rig.iter().zip(&sizes).enumerate();
            return Ok(views
                .map(|(file, (view, &size))| view.view(file, size))
                .collect());
        }
        let usage = |message: String| Failure::new(Code::Usage, message);
        let form = self.form();
        let ([size], [told]) = (sizes.as_slice(), frame.told.as_slice()) else {
            return self.sides(frame, &sizes, &form);
        };
        let bad = |error: sphere::ViewsError| {
            Failure::new(Code::BadInput, format!("{}: {error}", frame.name(0)))
        };
        let at = Orientation::from_angles(self.from_yaw, self.from_elevation, 0.0);
        let lens = |lens| {
            let name = frame.paths[0].file_stem().unwrap_or_default();
            let name = name.to_string_lossy();
            Ok(vec![sphere::one_lens(
                &name,
                lens,
                at,
                *size,
                told.as_ref(),
            )])
        };
        match self.from {
            Some(From::Lens(given)) => return lens(given),
            Some(From::TwoDiscs(given)) => {
                let sides = match self.discs {
                    Discs::FrontBack => [Side::Front, Side::Back],
                    Discs::BackFront => [Side::Back, Side::Front],
                };
                return sphere::two_discs(given, sides, *size).map_err(bad);
            }
            None => {}
        }
        let [width, height] = *size;
        let layout = match &self.layout {
            Some(name) => {
                let (order, rotations) = (self.order.as_deref(), self.rotations.as_deref());
                let layout = Layout::new(name, order, rotations);
                Some(layout.map_err(|error| usage(error.to_string()))?)
            }
            None if matches!(told, Some(Panorama::ExrCube)) => Layout::new("exr", None, None).ok(),
            None => None,
        };
        if layout.is_none() && (told.is_some() || width == height.saturating_mul(2)) {
            return lens(Lens::Equirect);
        }
        // One side alone, by its name.
        if layout.is_none() && width == height && sides_by_names(&frame.paths).is_ok() {
            return self.sides(frame, &sizes, &form);
        }
        let guessed = || {
            let found = Layout::of_shape(width, height)?;
            match self.order.is_some() || self.rotations.is_some() {
                true => Layout::new(
                    strip_of(&found)?,
                    self.order.as_deref(),
                    self.rotations.as_deref(),
                )
                .ok(),
                false => Some(found),
            }
        };
        let layout = layout.or_else(guessed).ok_or_else(|| {
            usage(format!(
                "{}: a picture of {width} x {height} pixels may be anything; tell its --layout if it \
                 shows a cube, else its lens with --from, such as --from fisheye:180",
                frame.name(0)
            ))
        })?;
        sphere::sides_in_layout(&layout, *size, &form).map_err(bad)
    }

    /// Sides of a cube, a file each.
    fn sides(
        &self,
        frame: &Frame,
        sizes: &[[u32; 2]],
        form: &SideForm,
    ) -> Result<Vec<View>, Failure> {
        let usage = |message: String| Failure::new(Code::Usage, message);
        if self.layout.is_some() || self.from.is_some() {
            let message = "--layout and --from are for one picture; several are the sides of a cube, or named \
                in a file of views (.toml)";
            return Err(usage(message.into()));
        }
        let sides = match &self.order {
            Some(order) => {
                let sides: Option<Vec<Side>> = order.chars().map(Side::of_letter).collect();
                let sides = sides.filter(|sides| {
                    sides.len() == sizes.len()
                        && (1..sides.len()).all(|k| !sides[..k].contains(&sides[k]))
                });
                sides.ok_or_else(|| {
                    usage(format!(
                        "--order {order}: expected a letter of r, l, u, d, f and b for each of the {} files, \
                         each once",
                        sizes.len()
                    ))
                })?
            }
            None => sides_by_names(&frame.paths).map_err(|error| usage(error.to_string()))?,
        };
        let turns = match self.rotations.as_deref() {
            None => vec![Turn::NONE; sizes.len()],
            Some(digits) => {
                // Missing sides have no digit.
                let padded = format!("{digits:0<6}");
                let turns = turns_of(&padded)
                    .ok()
                    .filter(|_| digits.len() == sizes.len());
                let count = sizes.len();
                let expected =
                    || format!("--rotations {digits}: expected {count} digits from 0 to 3");
                turns.ok_or_else(|| usage(expected()))?[..count].to_vec()
            }
        };
        let files: Vec<_> = sides
            .into_iter()
            .zip(turns)
            .zip(sizes)
            .map(|((side, turn), &size)| (side, turn, size))
            .collect();
        sphere::sides_in_files(&files, form).map_err(|(file, error)| {
            Failure::new(Code::BadInput, format!("{}: {error}", frame.name(file)))
        })
    }

    fn form(&self) -> SideForm {
        SideForm {
            fov: self.side_fov.map(|fov| fov.0),
            padding: self.padding,
            right_handed: self.handedness == Hand::Right,
            turned_poles: self.convention == Convention::Video,
        }
    }

    /// Checks what can be checked before any file is read.
    pub fn check(&self) -> Result<(), Failure> {
        let usage = |error: LayoutError| Failure::new(Code::Usage, error.to_string());
        if let Some(name) = &self.layout {
            Layout::new(name, self.order.as_deref(), self.rotations.as_deref()).map_err(usage)?;
        }
        if let Some(order) = self.order.as_deref().filter(|order| order.len() >= 6) {
            sides_of(order).map_err(usage)?;
        }
        Ok(())
    }
}

impl Files<'_> {
    /// Whether each frame has files of its own.
    pub fn are_numbered(&self) -> bool {
        self.names.iter().any(FrameNames::has_number)
    }

    /// The numbers of frames of which at least one file is there.
    pub fn numbers_there(&self) -> Result<BTreeSet<u32>, Failure> {
        let mut found = BTreeSet::new();
        for names in &self.names {
            let there = names.numbers_there().map_err(|error| {
                let pattern = plain(&names.pattern.to_string_lossy());
                let message = format!("{pattern}: its folder {}", veduta_io::reason(&error));
                Failure::new(Code::InputOutput, message)
            })?;
            found.extend(there);
        }
        Ok(found)
    }

    /// The first pattern, for messages.
    pub fn first(&self) -> &Path {
        self.names
            .first()
            .map_or(Path::new(""), |names| names.pattern)
    }
}

/// The name of a layout that is a strip.
fn strip_of(layout: &Layout) -> Option<&'static str> {
    let strips = [
        ("6x1", [6, 1]),
        ("1x6", [1, 6]),
        ("3x2", [3, 2]),
        ("2x3", [2, 3]),
    ];
    let found = strips
        .into_iter()
        .find(|(_, shape)| *shape == layout.shape());
    Some(found?.0)
}
