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
        let polygon = map.polygon(map.opaque.get(fragment as usize));
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
