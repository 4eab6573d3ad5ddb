use veduta_geometry::{Affine, DVec2};

/// A grid of pixels on the image plane.
///
/// Pixel `(i, j)` covers `[i, i+1) x [j, j+1)` in pixel coordinates, which are
/// `pixels_per_frame * image - origin`. Picture size, zoom, unequal scale, pan and window are all
/// such a map, and none of them needs visibility again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelGrid {
    /// Columns of pixels, at least 1.
    pub width: u32,
    /// Rows of pixels, at least 1.
    pub height: u32,
    /// Pixels along the width and the height of the frame (the unit square); positive.
    pub pixels_per_frame: DVec2,
    /// Where the grid's top left corner lies in the frame, in pixels.
    pub origin: DVec2,
}

impl PixelGrid {
    /// `width` x `height` pixels that fill the frame.
    ///
    /// # Panics
    /// If either is 0.
    pub fn of_frame(width: u32, height: u32) -> Self {
        assert!(width > 0 && height > 0, "a picture has pixels");
        Self {
            width,
            height,
            pixels_per_frame: DVec2::new(f64::from(width), f64::from(height)),
            origin: DVec2::ZERO,
        }
    }

    /// The `width` x `height` pixels of this grid from column `left` and row `top` on. They may lie
    /// outside it, where nothing is seen beyond the frame.
    ///
    /// # Panics
    /// If `width` or `height` is 0.
    pub fn window(&self, left: f64, top: f64, width: u32, height: u32) -> Self {
        assert!(width > 0 && height > 0, "a window has pixels");
        Self {
            width,
            height,
            origin: self.origin + DVec2::new(left, top),
            ..*self
        }
    }

    /// The grid of cells between the centres of pixels that lie within `radius` pixels from the centres
    /// of these: the first begins at `radius` before the first centre, along both axes. `cells` cells
    /// lie along the side of a pixel.
    ///
    /// # Panics
    /// If `radius` or `cells` is 0.
    pub fn between_centres(&self, radius: u32, cells: u32) -> Self {
        assert!(radius > 0 && cells > 0, "a filter reaches the next centre");
        let before = f64::from(radius) - 0.5;
        let across = |pixels: u32| (pixels + 2 * radius - 1) * cells;
        Self {
            width: across(self.width),
            height: across(self.height),
            pixels_per_frame: self.pixels_per_frame * f64::from(cells),
            origin: (self.origin - before) * f64::from(cells),
        }
    }

    /// Pixel coordinates of an image point.
    #[inline(always)]
    pub fn pixels_from_image(&self, image: DVec2) -> DVec2 {
        image * self.pixels_per_frame - self.origin
    }

    /// The image point at pixel coordinates.
    #[inline(always)]
    pub fn image_from_pixels(&self, pixels: DVec2) -> DVec2 {
        (pixels + self.origin) / self.pixels_per_frame
    }

    /// An affine function of the image plane as one of pixel coordinates from `corner` on.
    pub fn affine_in_pixels(&self, function: &Affine, corner: DVec2) -> Affine {
        let DVec2 { x, y } = self.pixels_per_frame;
        let at_corner = function.at(self.image_from_pixels(corner));
        Affine::new(function.a / x, function.b / y, at_corner)
    }

    /// Number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }
}
