//! Textures: pictures filtered to the footprint of a pixel.
//!
//! Pyramids of means (Williams, "Pyramidal Parametrics", 1983), looked up trilinearly. A footprint that
//! is longer than wide is looked up several times along its length, each time on the level of its width
//! (as anisotropic filters of graphics hardware do), so that grounds seen at a flat angle stay sharp.
//! All means are taken in linear light.

use crate::scene::{Image, TextureRef, Wrap};
use rayon::prelude::*;
use std::sync::LazyLock;
use veduta_geometry::{DVec2, Vec2, Vec4};

/// A texture at all scales: level `k` has about 1/2^k of the picture's columns and rows.
///
/// Level 0 is the picture itself, decoded at each look-up, since most pictures are larger than what
/// is seen of them.
#[derive(Debug)]
pub struct Pyramid<'a> {
    image: &'a Image,
    opacity: TexelOpacity,
    /// Levels from 1 on.
    levels: Vec<Level>,
}

/// What a material makes of the opacity of texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TexelOpacity {
    /// Nothing: all texels have their colour, and means are taken apart from opacity.
    Ignored,
    /// Texels let through what is behind. Means are of premultiplied colours, so that the colour of
    /// texels that cannot be seen, which is anything, does not bleed into the others.
    Blended,
    /// Texels of at least this opacity are there, the others are not. Means tell how much is there.
    Cut(f32),
}

#[derive(Debug)]
struct Level {
    width: u32,
    height: u32,
    texels: Vec<Vec4>,
}

/// How many times longer than wide a footprint may be before it is taken for wider than it is.
/// Larger costs look-ups at grazing angles; smaller blurs there.
const MAX_ANISOTROPY: f64 = 16.0;

/// Linear values of 8-bit sRGB (IEC 61966-2-1).
static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let value = code as f64 / 255.0;
        let linear = if value <= 0.04045 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        };
        linear as f32
    })
});

fn decode([r, g, b, a]: [u8; 4]) -> Vec4 {
    let linear = &*LINEAR_FROM_SRGB;
    Vec4::new(
        linear[r as usize],
        linear[g as usize],
        linear[b as usize],
        f32::from(a) / 255.0,
    )
}

impl TexelOpacity {
    /// What a texel counts for in means: colour (premultiplied unless opacity is ignored) and opacity.
    #[inline(always)]
    fn apply(self, texel: Vec4) -> Vec4 {
        match self {
            TexelOpacity::Ignored => texel,
            TexelOpacity::Blended => (texel.truncate() * texel.w).extend(texel.w),
            TexelOpacity::Cut(cutoff) if texel.w >= cutoff => texel.truncate().extend(1.0),
            TexelOpacity::Cut(_) => Vec4::ZERO,
        }
    }
}

impl<'a> Pyramid<'a> {
    /// Takes the means of a picture.
    pub fn new(image: &'a Image, opacity: TexelOpacity) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        loop {
            let (width, height) = levels
                .last()
                .map_or((image.width, image.height), |l| (l.width, l.height));
            if width == 1 && height == 1 {
                return Self {
                    image,
                    opacity,
                    levels,
                };
            }
            let next = match levels.last() {
                Some(level) => halved(width, height, |index| level.texels[index]),
                None => halved(width, height, |index| {
                    opacity.apply(decode(image.pixels[index]))
                }),
            };
            levels.push(next);
        }
    }

    /// Mean colour (linear) and opacity in a footprint around `at`; the colour is premultiplied unless
    /// opacity is [ignored](TexelOpacity::Ignored).
    ///
    /// Coordinates are the picture's, (0, 0) its top left corner and (1, 1) its bottom right one.
    /// The footprint is a parallelogram with sides `along_x` and `along_y`: how `at` changes from a
    /// pixel to the next one along each axis of the image.
    pub fn sample(&self, at: DVec2, along_x: DVec2, along_y: DVec2, wrap: [Wrap; 2]) -> Vec4 {
        let size = DVec2::new(f64::from(self.image.width), f64::from(self.image.height));
        let (u, v) = (along_x * size, along_y * size);
        // Half axes of the ellipse that the unit circle becomes: singular values of (u v).
        let (uu, vv, uv) = (u.length_squared(), v.length_squared(), u.dot(v));
        let (mean, difference) = (0.5 * (uu + vv), 0.5 * (uu - vv));
        let root = (difference * difference + uv * uv).sqrt();
        let long = (mean + root).sqrt();
        let short = (mean - root).max(0.0).sqrt();
        if long.is_nan() || long <= 1.0 {
            return match self.opacity {
                TexelOpacity::Cut(cutoff) => self.cut(at, along_x, along_y, wrap, cutoff),
                _ => self.bilinear(at, 0, wrap),
            };
        }
        let probes = (long / short.max(1.0)).ceil().min(MAX_ANISOTROPY);
        let level = (long / probes).max(short).max(1.0).log2();
        if probes <= 1.0 {
            return self.trilinear(at, level, wrap);
        }
        // The long axis: the eigenvector of u uᵀ + v vᵀ, reached by turning the pixel's axes.
        let (sin, cos) = (0.5 * uv.atan2(difference)).sin_cos();
        let axis = along_x * cos + along_y * sin;
        let count = probes as u32;
        let sum: Vec4 = (0..count)
            .map(|probe| {
                let along = (f64::from(probe) + 0.5) / probes - 0.5;
                self.trilinear(at + axis * along, level, wrap)
            })
            .sum();
        sum / count as f32
    }

    /// Colour and opacity of a cut-out seen so large that texels are larger than pixels: its edge lies
    /// where the interpolated opacity is the cutoff, and is antialiased over the footprint as if opacity
    /// were affine there. (Texels either there or not would show as squares.)
    fn cut(&self, at: DVec2, along_x: DVec2, along_y: DVec2, wrap: [Wrap; 2], cutoff: f32) -> Vec4 {
        let texel = |at| self.bilinear_of(at, 0, wrap, TexelOpacity::Blended);
        let change = |along: DVec2| (texel(at + 0.5 * along).w - texel(at - 0.5 * along).w).abs();
        let here = texel(at);
        let width = change(along_x) + change(along_y);
        let above = here.w - cutoff;
        let there = if width > 0.0 {
            (above / width + 0.5).clamp(0.0, 1.0)
        } else {
            f32::from(above >= 0.0)
        };
        if here.w > 0.0 {
            (here.truncate() / here.w * there).extend(there)
        } else {
            Vec4::ZERO
        }
    }

    fn trilinear(&self, at: DVec2, level: f64, wrap: [Wrap; 2]) -> Vec4 {
        let below = floor(level).min(self.levels.len() as f64);
        let near = self.bilinear(at, below as usize, wrap);
        let part = (level - below) as f32;
        if part > 0.0 && (below as usize) < self.levels.len() {
            near.lerp(self.bilinear(at, below as usize + 1, wrap), part)
        } else {
            near
        }
    }

    fn bilinear(&self, at: DVec2, level: usize, wrap: [Wrap; 2]) -> Vec4 {
        self.bilinear_of(at, level, wrap, self.opacity)
    }

    /// `opacity` is what to make of the opacity of texels of level 0.
    #[inline(always)]
    fn bilinear_of(&self, at: DVec2, level: usize, wrap: [Wrap; 2], opacity: TexelOpacity) -> Vec4 {
        let (width, height) = match level.checked_sub(1) {
            None => (self.image.width, self.image.height),
            Some(above) => (self.levels[above].width, self.levels[above].height),
        };
        let ([left, right], across) = neighbours(at.x, width, wrap[0]);
        let ([upper, lower], down) = neighbours(at.y, height, wrap[1]);
        let texel = |column: u32, row: u32| {
            let index = row as usize * width as usize + column as usize;
            match level.checked_sub(1) {
                None => opacity.apply(decode(self.image.pixels[index])),
                Some(above) => self.levels[above].texels[index],
            }
        };
        let above = texel(left, upper).lerp(texel(right, upper), across);
        let below = texel(left, lower).lerp(texel(right, lower), across);
        above.lerp(below, down)
    }
}

/// The largest whole number up to `x`, for numbers that an `i64` holds. [`f64::floor`] is a function
/// call on processors that Rust builds for by default.
#[inline(always)]
fn floor(x: f64) -> f64 {
    let cut = x as i64 as f64;
    if cut > x { cut - 1.0 } else { cut }
}

/// The two texels whose centres lie around coordinate `at` of a side of `size` texels, and how far
/// from the first to the second it lies.
fn neighbours(at: f64, size: u32, wrap: Wrap) -> ([u32; 2], f32) {
    let last = f64::from(size) - 1.0;
    let texel = match wrap {
        Wrap::Repeat => at - floor(at),
        Wrap::Mirror => {
            let phase = at - 2.0 * floor(0.5 * at);
            if phase > 1.0 { 2.0 - phase } else { phase }
        }
        Wrap::Clamp => at.clamp(0.0, 1.0),
    } * f64::from(size)
        - 0.5;
    let first = floor(texel);
    let pair = match wrap {
        Wrap::Repeat => [
            if first < 0.0 { last } else { first.min(last) },
            if first + 1.0 > last { 0.0 } else { first + 1.0 },
        ],
        // A mirrored picture meets itself at its sides: the texel beyond is the same one.
        Wrap::Mirror | Wrap::Clamp => [first.clamp(0.0, last), (first + 1.0).clamp(0.0, last)],
    };
    (pair.map(|texel| texel as u32), (texel - first) as f32)
}

/// The next level: half the columns and rows, rounded up, each texel the mean over its exact share.
fn halved(width: u32, height: u32, texel: impl Fn(usize) -> Vec4 + Sync) -> Level {
    let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
    let columns: Vec<Shares> = (0..half_width)
        .map(|i| shares(i, width, half_width))
        .collect();
    let texels = (0..half_height)
        .into_par_iter()
        .flat_map_iter(|row| {
            let rows = shares(row, height, half_height);
            let texel = &texel;
            columns.iter().map(move |column| {
                let mut sum = Vec4::ZERO;
                for (j, share_y) in rows.each() {
                    for (i, share_x) in column.each() {
                        let index = j as usize * width as usize + i as usize;
                        sum += texel(index) * (share_x * share_y);
                    }
                }
                sum
            })
        })
        .collect();
    Level {
        width: half_width,
        height: half_height,
        texels,
    }
}

/// Up to three texels of a finer level below one of the next, with their shares of it.
struct Shares {
    first: u32,
    share: [f32; 3],
}

impl Shares {
    fn each(&self) -> impl Iterator<Item = (u32, f32)> {
        (self.first..)
            .zip(self.share)
            .filter(|(_, share)| *share > 0.0)
    }
}

fn shares(index: u32, size: u32, half: u32) -> Shares {
    // In units of 1/half of a fine texel, so that all borders are integers.
    let (size, half, index) = (u64::from(size), u64::from(half), u64::from(index));
    let (start, end) = (index * size, (index + 1) * size);
    let first = start / half;
    let share = [0, 1, 2].map(|k| {
        let (from, to) = ((first + k) * half, (first + k + 1) * half);
        end.min(to).saturating_sub(start.max(from)) as f32 / size as f32
    });
    Shares {
        first: first as u32,
        share,
    }
}

/// Picture coordinates of texture coordinates: KHR_texture_transform, whose rotation is
/// counterclockwise as one looks at the picture, where v points down.
pub fn picture_from_uv(texture: &TextureRef, uv: Vec2) -> DVec2 {
    let (sin, cos) = texture.rotation.sin_cos();
    let scaled = texture.scale * uv;
    let turned = Vec2::new(
        cos * scaled.x + sin * scaled.y,
        cos * scaled.y - sin * scaled.x,
    );
    (texture.offset + turned).as_dvec2()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
        Image {
            name: String::new(),
            width,
            height,
            pixels: (0..height)
                .flat_map(|j| (0..width).map(move |i| (i, j)))
                .map(|(i, j)| pixel(i, j))
                .collect(),
        }
    }

    fn checker(width: u32, height: u32) -> Image {
        image(width, height, |i, j| {
            let value = if (i + j) % 2 == 0 { 255 } else { 0 };
            [value, value, value, 255]
        })
    }

    const ALL: [Wrap; 2] = [Wrap::Repeat; 2];

    #[test]
    fn every_level_has_the_mean_of_the_picture() {
        for (width, height) in [(8, 8), (7, 5), (1, 9), (13, 2)] {
            let image = image(width, height, |i, j| [(37 * i + 11 * j) as u8, 90, 3, 255]);
            let pyramid = Pyramid::new(&image, TexelOpacity::Ignored);
            let mean = |sum: Vec4, count: usize| sum / count as f32;
            let whole: Vec4 = image.pixels.iter().map(|&pixel| decode(pixel)).sum();
            let expected = mean(whole, image.pixels.len());
            for level in &pyramid.levels {
                let found = mean(level.texels.iter().copied().sum(), level.texels.len());
                assert!(
                    (found - expected).abs().max_element() < 1e-6,
                    "{width} x {height}"
                );
            }
            let last = pyramid.levels.last().expect("more than one texel");
            assert_eq!(last.texels.len(), 1);
        }
    }

    #[test]
    fn a_small_checkerboard_is_grey_in_linear_light() {
        let image = checker(64, 64);
        let pyramid = Pyramid::new(&image, TexelOpacity::Ignored);
        for footprint in [4.0, 20.0, 200.0] {
            let step = footprint / 64.0;
            let (x, y) = (DVec2::new(step, 0.0), DVec2::new(0.0, step));
            let found = pyramid.sample(DVec2::new(0.3, 0.7), x, y, ALL);
            assert!((found - Vec4::new(0.5, 0.5, 0.5, 1.0)).abs().max_element() < 1e-6);
        }
    }

    #[test]
    fn a_long_footprint_blurs_along_its_length_only() {
        // Stripes of 4 columns: averaged along them they stay, averaged across they are grey.
        let image = image(64, 64, |i, _| {
            if i / 4 % 2 == 0 {
                [255; 4]
            } else {
                [0, 0, 0, 255]
            }
        });
        let pyramid = Pyramid::new(&image, TexelOpacity::Ignored);
        let (short, long) = (1.0 / 64.0, 16.0 / 64.0);
        let centre_of_white = DVec2::new(10.0 / 64.0, 0.5);
        for turned in [false, true] {
            let turn = |p: DVec2, q: DVec2| if turned { (q, p) } else { (p, q) };
            let (x, y) = turn(DVec2::new(short, 0.0), DVec2::new(0.0, long));
            assert!(pyramid.sample(centre_of_white, x, y, ALL).x > 0.99);
            let (x, y) = turn(DVec2::new(long, 0.0), DVec2::new(0.0, short));
            assert!((pyramid.sample(centre_of_white, x, y, ALL).x - 0.5).abs() < 0.01);
        }
    }

    #[test]
    fn the_world_beyond_the_picture_is_as_its_wrap_says() {
        let image = image(4, 1, |i, _| {
            [
                [10, 0, 0, 255],
                [80, 0, 0, 255],
                [160, 0, 0, 255],
                [240, 0, 0, 255],
            ][i as usize]
        });
        let pyramid = Pyramid::new(&image, TexelOpacity::Ignored);
        let red = |u: f64, wrap| {
            pyramid
                .sample(DVec2::new(u, 0.5), DVec2::ZERO, DVec2::ZERO, [wrap; 2])
                .x
        };
        let texel = |i: usize| LINEAR_FROM_SRGB[[10, 80, 160, 240][i]];
        for (wrap, at_minus_one, at_four) in [
            (Wrap::Repeat, 3, 0),
            (Wrap::Mirror, 0, 3),
            (Wrap::Clamp, 0, 3),
        ] {
            assert_eq!(red(-0.125, wrap), texel(at_minus_one), "{wrap:?}");
            assert_eq!(red(1.125, wrap), texel(at_four), "{wrap:?}");
        }
        assert_eq!(red(-0.375, Wrap::Mirror), texel(1));
        assert_eq!(red(-0.375, Wrap::Clamp), texel(0));
        // Half way over the seam of a repeated picture.
        let seam = 0.5 * (texel(0) + texel(3));
        assert!((red(1.0, Wrap::Repeat) - seam).abs() < 1e-6);
    }

    #[test]
    fn a_texture_transform_turns_as_its_extension_says() {
        // KHR_texture_transform: 90° turn the point right of the origin to above it.
        let texture = TextureRef {
            rotation: std::f32::consts::FRAC_PI_2,
            scale: Vec2::new(2.0, 1.0),
            offset: Vec2::new(0.0, 5.0),
            ..TextureRef::new(crate::scene::ImageId(0))
        };
        let turned = picture_from_uv(&texture, Vec2::new(1.0, 0.0));
        assert!((turned - DVec2::new(0.0, 3.0)).length() < 1e-6);
    }

    #[test]
    fn a_texel_seen_large_has_its_own_colour() {
        let image = checker(4, 4);
        let pyramid = Pyramid::new(&image, TexelOpacity::Ignored);
        let step = DVec2::splat(1e-4);
        for (i, expected) in [(0, 1.0), (1, 0.0), (2, 1.0)] {
            let at = DVec2::new((f64::from(i) + 0.5) / 4.0, 0.125);
            assert_eq!(pyramid.sample(at, step, step, ALL).x, expected);
        }
    }

    #[test]
    fn what_cannot_be_seen_of_a_picture_has_no_colour() {
        // Left half red, right half a green that is not there.
        let image = image(8, 8, |i, _| {
            if i < 4 {
                [255, 0, 0, 255]
            } else {
                [0, 255, 0, 0]
            }
        });
        for opacity in [TexelOpacity::Blended, TexelOpacity::Cut(0.5)] {
            let pyramid = Pyramid::new(&image, opacity);
            for footprint in [0.01, 0.3, 1.0] {
                let (x, y) = (DVec2::new(footprint, 0.0), DVec2::new(0.0, footprint));
                let found = pyramid.sample(DVec2::splat(0.5), x, y, ALL);
                let expected = Vec4::new(0.5, 0.0, 0.0, 0.5);
                assert!((found - expected).abs().max_element() < 1e-6, "{found}");
            }
        }
    }

    #[test]
    fn a_cut_out_seen_large_has_a_sharp_edge_where_opacity_is_the_cutoff() {
        let image = image(2, 1, |i, _| [200, 0, 0, [0, 255][i as usize]]);
        let pyramid = Pyramid::new(&image, TexelOpacity::Cut(0.25));
        let step = 1e-3;
        let opacity = |u: f64| {
            let at = DVec2::new(u, 0.5);
            let (x, y) = (DVec2::new(step, 0.0), DVec2::new(0.0, step));
            pyramid.sample(at, x, y, [Wrap::Clamp; 2]).w
        };
        // Opacity rises from 0 at u = 1/4 to 1 at u = 3/4.
        for (pixels, expected) in [
            (-1.0, 0.0),
            (-0.25, 0.25),
            (0.0, 0.5),
            (0.25, 0.75),
            (1.0, 1.0),
        ] {
            let found = opacity(0.375 + pixels * step);
            assert!(
                (found - expected).abs() < 1e-3,
                "{found} at {pixels} pixels"
            );
        }
    }
}
