//! Pictures of files -> views of the sphere: which part of which file shows what, and through which lens.
//!
//! What is planned here depends on the sizes of pictures only, so that all frames of a sequence share it.

use super::Panorama;
use std::f64::consts::{FRAC_PI_2, PI};
use veduta::accumulate::Picture;
use veduta::reproject::cube::{Cell, Layout, ShapeError, Side, Spacing, Turn};
use veduta::reproject::{Lens, Orientation, Projection};

/// A view of the sphere, and where its picture is found.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// What it is called: the name of its side, or of its file.
    pub name: String,
    /// The side of a cube that it is, if it is one.
    pub side: Option<Side>,
    /// The file, counted among those that the views are made of.
    pub file: usize,
    /// The part of its picture: left, top, width and height in pixels; all of it if `None`.
    pub window: Option<[u32; 4]>,
    /// How that part lies.
    pub turn: Turn,
    /// What is seen where in the view.
    pub projection: Projection,
}

impl View {
    /// The view's picture.
    ///
    /// # Panics
    /// If `file` has another size than the view was planned for.
    pub fn picture(&self, file: &Picture) -> Picture {
        let part = match self.window {
            None => file.clone(),
            Some([left, top, width, height]) => cut(file, [left, top], [width, height]),
        };
        let picture = self.turn.inverse().of(part);
        let expected = [self.projection.width, self.projection.height];
        assert_eq!([picture.width, picture.height], expected, "the view's size");
        picture
    }
}

/// A part of a picture.
fn cut(picture: &Picture, [left, top]: [u32; 2], [width, height]: [u32; 2]) -> Picture {
    let row = |y: u32| {
        let first = (top + y) as usize * picture.width as usize + left as usize;
        &picture.pixels[first..first + width as usize]
    };
    Picture {
        width,
        height,
        pixels: (0..height).flat_map(row).copied().collect(),
    }
}

/// How sides of cubes are made, beyond where they lie.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SideForm {
    /// Field of view in radians where it is not 90 degrees.
    pub fov: Option<f64>,
    /// Pixels on each edge that reach beyond 90 degrees; not together with `fov`.
    pub padding: u32,
    /// Whether the pictures were made in a world in which x is to the right, y upwards and z *backward*,
    /// for an order of sides that expects z forward (OpenGL): then they are mirrored, and front and back exchanged.
    pub right_handed: bool,
    /// Whether the upper and the lower side are turned by 180 degrees, as in videos and OpenEXR.
    pub turned_poles: bool,
}

impl SideForm {
    /// Which side an image really is, and how it lies.
    fn really(&self, side: Side, turn: Turn) -> (Side, Turn) {
        let is_pole = matches!(side, Side::Up | Side::Down);
        let mut turn = turn;
        if self.turned_poles && is_pole {
            turn = Turn::HALF.then(turn);
        }
        if !self.right_handed {
            return (side, turn);
        }
        let mirror = Turn {
            mirrored: true,
            quarters: if is_pole { 2 } else { 0 },
        };
        let side = match side {
            Side::Front => Side::Back,
            Side::Back => Side::Front,
            side => side,
        };
        (side, mirror.then(turn))
    }
}

/// Why pictures are no views.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewsError {
    /// A picture cannot be cut into sides.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A side is no square.
    #[error(
        "has {width} x {height} pixels, and a side of a cube is square; a part of a side, or any other \
         picture, is described in a file of views (.toml)"
    )]
    NoSquare {
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
    },
    /// Padding leaves nothing of a side.
    #[error(
        "has sides of {side} pixels, of which a padding of {padding} on each edge leaves nothing"
    )]
    Padding {
        /// In pixels.
        side: u32,
        /// In pixels.
        padding: u32,
    },
    /// Sides whose angles are even end at 90 degrees.
    #[error(
        "has sides of even angles (eac), which are known without padding and of 90 degrees only"
    )]
    PaddedAngles,
    /// Two discs side by side.
    #[error("has {width} x {height} pixels; two fisheyes side by side are twice as wide as high")]
    TwoDiscs {
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
    },
}

/// What a side of `size` pixels shows.
///
/// # Errors
/// When the form leaves nothing of it.
pub fn side_projection(
    side: Side,
    size: u32,
    spacing: Spacing,
    form: &SideForm,
) -> Result<Projection, ViewsError> {
    if 2 * u64::from(form.padding) >= u64::from(size) {
        let (side, padding) = (size, form.padding);
        return Err(ViewsError::Padding { side, padding });
    }
    let is_plain = form.fov.is_none() && form.padding == 0;
    let lens = match spacing {
        Spacing::Angle if is_plain => Lens::Equiangular,
        Spacing::Angle => return Err(ViewsError::PaddedAngles),
        _ if is_plain => Lens::Perspective { fov: FRAC_PI_2 },
        _ => {
            let size = f64::from(size);
            let padded = 2.0 * (size / (size - 2.0 * f64::from(form.padding))).atan();
            Lens::Perspective {
                fov: form.fov.unwrap_or(padded),
            }
        }
    };
    let projection = Projection::new(lens, side.orientation(), size, size);
    // A border needs two samples; one lies in the middle either way.
    Ok(match spacing {
        Spacing::PlaneWithBorder if size > 1 => projection.sampled_on_border(),
        _ => projection,
    })
}

/// A file each for some sides of a cube: the side by its name, how it lies, width and height.
///
/// # Errors
/// With the number of the file that is no side.
pub fn sides_in_files(
    files: &[(Side, Turn, [u32; 2])],
    form: &SideForm,
) -> Result<Vec<View>, (usize, ViewsError)> {
    let view = |(file, &(side, turn, [width, height])): (usize, &(Side, Turn, [u32; 2]))| {
        if width != height {
            return Err((file, ViewsError::NoSquare { width, height }));
        }
        let (side, turn) = form.really(side, turn);
        let projection = side_projection(side, width, Spacing::Plane, form);
        Ok(View {
            name: side.name().to_owned(),
            side: Some(side),
            file,
            window: None,
            turn,
            projection: projection.map_err(|error| (file, error))?,
        })
    };
    files.iter().enumerate().map(view).collect()
}

/// All sides of a cube in one file.
///
/// # Errors
/// When the picture cannot be cut so.
pub fn sides_in_layout(
    layout: &Layout,
    [width, height]: [u32; 2],
    form: &SideForm,
) -> Result<Vec<View>, ViewsError> {
    let size = layout.cell_side(width, height)?;
    let view = |cell: &Cell| {
        let (side, turn) = form.really(cell.side, cell.turn);
        Ok(View {
            name: side.name().to_owned(),
            side: Some(side),
            file: 0,
            window: Some([cell.column * size, cell.row * size, size, size]),
            turn,
            projection: side_projection(side, size, layout.spacing(), form)?,
        })
    };
    layout.cells().iter().map(view).collect()
}

/// A picture through one lens, which looks where `orientation` says; a disc lies in its middle, as large
/// as fits.
///
/// Of an equirectangular picture the part of the sphere and how the camera stood are taken from what the
/// file tells. Where the camera looked to (its compass) is left out: the middle of the picture stays the
/// front.
pub fn one_lens(
    name: &str,
    lens: Lens,
    orientation: Orientation,
    [width, height]: [u32; 2],
    told: Option<&Panorama>,
) -> View {
    let plain = Projection::new(lens, orientation, width, height);
    let projection = match (lens, told) {
        #[cfg(feature = "xmp")]
        (Lens::Equirect, Some(Panorama::Gpano(told))) => {
            let orientation = told.level().within(&orientation);
            let [across, down] = told.part();
            let whole = |size: u32, [start, end]: [f64; 2]| f64::from(size) / (end - start);
            let full = [whole(width, across), whole(height, down)];
            let [full_width, full_height] = full.map(|size| size.round().clamp(1.0, 1e9) as u32);
            let (left, top) = (across[0] * full[0], down[0] * full[1]);
            Projection::new(lens, orientation, full_width, full_height)
                .cropped(left, top, width, height)
        }
        (Lens::Equirect, Some(Panorama::ExrLatLong { .. })) if width > 1 && height > 1 => {
            plain.sampled_on_border()
        }
        _ => plain,
    };
    View {
        name: name.to_owned(),
        side: None,
        file: 0,
        window: None,
        turn: Turn::NONE,
        projection,
    }
}

/// Two fisheyes side by side, as of cameras with a lens in front and one behind.
///
/// # Errors
/// When the picture is not twice as wide as high.
pub fn two_discs(
    lens: Lens,
    [left, right]: [Side; 2],
    [width, height]: [u32; 2],
) -> Result<Vec<View>, ViewsError> {
    if width % 2 != 0 || width / 2 != height {
        return Err(ViewsError::TwoDiscs { width, height });
    }
    let view = |(side, column): (Side, u32)| View {
        name: side.name().to_owned(),
        side: None,
        file: 0,
        window: Some([column * height, 0, height, height]),
        turn: Turn::NONE,
        projection: Projection::new(lens, side.orientation(), height, height),
    };
    Ok([(left, 0), (right, 1)].map(view).into())
}

/// Angle across a pixel in the middle of a view's lens, in radians: the finest of all views.
pub fn finest_pixel(views: &[View]) -> f64 {
    let pixel = |view: &View| {
        let lens = view.projection.lens;
        let middle = view
            .projection
            .image_from_lens(veduta::geometry::DVec2::ZERO);
        match lens {
            // In the middle of a ball stands who looks: what matters is around.
            Lens::Ball => Some(PI / f64::from(view.projection.width)),
            _ => {
                let ray = view.projection.ray(middle)?;
                Some(ray.derivatives[0].length())
            }
        }
    };
    views.iter().filter_map(pixel).fold(PI, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta::geometry::DVec3;

    #[test]
    fn padded_sides_see_more_than_a_quarter() {
        let projection = |form: &SideForm| side_projection(Side::Front, 8, Spacing::Plane, form);
        let padded = SideForm {
            padding: 2,
            ..SideForm::default()
        };
        let plain = projection(&SideForm::default()).expect("is one");
        let wide = projection(&padded).expect("is one");
        // The middle four pixels of the padded side see what all of a plain one sees.
        let at = |x: f64| veduta::geometry::DVec2::new(x, 4.0);
        let [a, b] = [wide.direction(at(2.0)), plain.direction(at(0.0))];
        assert!((a.expect("ahead") - b.expect("ahead")).length() < 1e-12);
        let form = SideForm {
            padding: 4,
            ..SideForm::default()
        };
        assert!(matches!(projection(&form), Err(ViewsError::Padding { .. })));
    }

    #[test]
    fn right_handed_worlds_are_mirrored_and_look_back() {
        // The formulas of OpenGL for the direction of a texel of the image named +x, at s and t from -1 to 1,
        // read in a world whose front is -z.
        let gl = |name: Side, s: f64, t: f64| match name {
            Side::Right => DVec3::new(1.0, -t, -s),
            Side::Left => DVec3::new(-1.0, -t, s),
            Side::Up => DVec3::new(s, 1.0, t),
            Side::Down => DVec3::new(s, -1.0, -t),
            Side::Front => DVec3::new(s, -t, 1.0),
            Side::Back => DVec3::new(-s, -t, -1.0),
        };
        let form = SideForm {
            right_handed: true,
            ..SideForm::default()
        };
        let file = Picture {
            width: 2,
            height: 2,
            pixels: (0..4).map(|k| [k as f32, 0.0, 0.0, 1.0]).collect(),
        };
        for name in Side::ALL {
            let files = [(name, Turn::NONE, [2, 2])];
            let view = &sides_in_files(&files, &form).expect("is a side")[0];
            let picture = view.picture(&file);
            for k in 0..4 {
                let at = veduta::geometry::DVec2::new((k % 2) as f64 + 0.5, (k / 2) as f64 + 0.5);
                let seen = view.projection.direction(at).expect("in the picture");
                let texel = picture.pixels[k][0] as u32;
                let [s, t] = [texel % 2, texel / 2].map(|i| f64::from(i) - 0.5);
                let expected = gl(name, s, t).normalize();
                assert!((seen - expected).length() < 1e-12, "{name} {k}");
            }
        }
    }
}
