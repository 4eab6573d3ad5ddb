use super::place::PixelClip;
use crate::dice::PixelGrid;
use veduta_geometry::{Affine, DVec2};
use veduta_map::{Camera, FaceId, Projection, VisibilityMap};

/// Depths of a face where it is seen in a pixel: planar distance in metres along the line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthRange {
    /// Of its nearest point.
    pub front: f64,
    /// Of its farthest point.
    pub back: f64,
}

impl DepthRange {
    /// The smallest range that holds both.
    pub fn with(self, other: Self) -> Self {
        Self {
            front: self.front.min(other.front),
            back: self.back.max(other.back),
        }
    }
}

/// The depth at a nearness of `camera`, in metres.
///
/// In perspective it is positive and finite. At grazing angles rounding may put a nearness on the wrong
/// side of 0 or before the near plane, where no face is: it is moved back.
#[inline]
pub fn depth_of_nearness(camera: &Camera, nearness: f64) -> f64 {
    match camera.projection {
        Projection::Perspective { .. } => {
            // 1e-30 m⁻¹ is farther than anything, and its reciprocal still is a single-precision number.
            1.0 / nearness.clamp(1e-30, 1.0 / camera.near.clamp(1e-30, 1e30))
        }
        Projection::Parallel { .. } => -nearness,
    }
}

/// Finds depths of parts of fragments, in buffers that it keeps.
///
/// A fragment is convex and its nearness affine, so that the nearest and farthest points of a part are
/// corners of it: of the fragment's polygon clipped by the pixel.
#[derive(Clone, Debug, Default)]
pub struct Depths {
    clip: PixelClip,
}

impl Depths {
    /// Depths of a [fragment](VisibilityMap::fragment) in the pixel at `column`, `row` of
    /// `grid`, of which it covers something.
    pub fn of_part(
        &mut self,
        map: &VisibilityMap,
        grid: &PixelGrid,
        fragment: u32,
        column: u32,
        row: u32,
    ) -> DepthRange {
        let pixel = DVec2::new(f64::from(column), f64::from(row));
        let polygon = self.clip.clip(map, grid, fragment, pixel);
        let nearness = map.faces.face_nearness(map.face_of(fragment as usize));
        let nearness_at = |p: &DVec2| nearness.at(grid.image_from_pixels(*p + pixel));
        if polygon.is_empty() {
            // A sliver that rounding made nothing of: it is somewhere in the pixel.
            return of_square(&map.camera, grid, nearness, pixel);
        }
        range_of(&map.camera, polygon.iter().map(nearness_at))
    }

    /// Depths of a face in a pixel that it fills.
    pub fn of_pixel(
        &self,
        map: &VisibilityMap,
        grid: &PixelGrid,
        face: FaceId,
        column: u32,
        row: u32,
    ) -> DepthRange {
        let pixel = DVec2::new(f64::from(column), f64::from(row));
        of_square(&map.camera, grid, map.faces.face_nearness(face), pixel)
    }
}

fn of_square(camera: &Camera, grid: &PixelGrid, nearness: &Affine, pixel: DVec2) -> DepthRange {
    let corners = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
    let nearness_at = |corner| nearness.at(grid.image_from_pixels(pixel + corner));
    range_of(camera, corners.into_iter().map(nearness_at))
}

fn range_of(camera: &Camera, nearness: impl Iterator<Item = f64>) -> DepthRange {
    let extremes = (f64::INFINITY, f64::NEG_INFINITY);
    let (least, most) = nearness.fold(extremes, |(least, most), q| (least.min(q), most.max(q)));
    DepthRange {
        front: depth_of_nearness(camera, most),
        back: depth_of_nearness(camera, least),
    }
}
