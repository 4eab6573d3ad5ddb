use crate::dice::PixelGrid;
use veduta_geometry::DVec2;
use veduta_map::VisibilityMap;

/// Lays fragments on a pixel grid, in a buffer that it keeps.
#[derive(Clone, Debug, Default)]
pub struct Placer {
    polygon: Vec<DVec2>,
    clipped: Vec<DVec2>,
}

impl Placer {
    /// The polygon of a fragment in pixels, clipped to the columns of the grid.
    #[inline(always)]
    pub fn place(&mut self, map: &VisibilityMap, grid: &PixelGrid, fragment: u32) -> &[DVec2] {
        let polygon = map.polygon(map.fragment(fragment as usize));
        let width = f64::from(grid.width);
        let mut outside = false;
        self.polygon.clear();
        self.polygon.extend(polygon.iter().map(|&vertex| {
            let placed = grid.pixels_from_image(vertex);
            outside |= placed.x < 0.0 || placed.x > width;
            placed
        }));
        if outside {
            clip_column(&self.polygon, 0.0, 1.0, &mut self.clipped);
            clip_column(&self.clipped, width, -1.0, &mut self.polygon);
        }
        &self.polygon
    }
}

/// Clips fragments to single pixels, in a buffer that it keeps.
#[derive(Clone, Debug, Default)]
pub struct PixelClip {
    polygon: Vec<DVec2>,
    clipped: Vec<DVec2>,
}

impl PixelClip {
    /// What of a fragment lies in the pixel whose top left corner is at `pixel` of `grid`, measured from
    /// that corner. Rounding may make nothing of a sliver.
    pub fn clip(
        &mut self,
        map: &VisibilityMap,
        grid: &PixelGrid,
        fragment: u32,
        pixel: DVec2,
    ) -> &[DVec2] {
        let polygon = map.polygon(map.fragment(fragment as usize));
        // From the pixel's corner: clipping at 0 and 1 is exact there.
        let placed = polygon.iter().map(|&p| grid.pixels_from_image(p) - pixel);
        self.clip_placed(placed)
    }

    /// What of a convex polygon lies in the unit square.
    pub fn clip_placed(&mut self, polygon: impl Iterator<Item = DVec2>) -> &[DVec2] {
        self.polygon.clear();
        self.polygon.extend(polygon);
        for (axis, border, sign) in [(0, 0.0, 1.0), (0, 1.0, -1.0), (1, 0.0, 1.0), (1, 1.0, -1.0)] {
            clip_axis(&self.polygon, axis, border, sign, &mut self.clipped);
            std::mem::swap(&mut self.polygon, &mut self.clipped);
        }
        &self.polygon
    }
}

/// What of a polygon lies at `sign * (p[axis] - border) >= 0` (Sutherland and Hodgman).
fn clip_axis(polygon: &[DVec2], axis: usize, border: f64, sign: f64, kept: &mut Vec<DVec2>) {
    kept.clear();
    let Some(&last) = polygon.last() else {
        return;
    };
    let mut p = last;
    for &q in polygon {
        let (a, b) = (sign * (p[axis] - border), sign * (q[axis] - border));
        if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
            let mut at = p + (q - p) * (a / (a - b));
            at[axis] = border;
            kept.push(at);
        }
        if b >= 0.0 {
            kept.push(q);
        }
        p = q;
    }
}

/// What of a polygon lies at `sign * (x - border) >= 0` (Sutherland and Hodgman).
fn clip_column(polygon: &[DVec2], border: f64, sign: f64, kept: &mut Vec<DVec2>) {
    kept.clear();
    let Some(&last) = polygon.last() else {
        return;
    };
    let mut p = last;
    for &q in polygon {
        let (a, b) = (sign * (p.x - border), sign * (q.x - border));
        if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
            // From the upper end, so that both neighbours of an edge find the same point.
            let (u, v, c, d) = if p.y <= q.y {
                (p, q, a, b)
            } else {
                (q, p, b, a)
            };
            kept.push(DVec2::new(border, u.y + (v.y - u.y) * (c / (c - d))));
        }
        if b >= 0.0 {
            kept.push(q);
        }
        p = q;
    }
}
