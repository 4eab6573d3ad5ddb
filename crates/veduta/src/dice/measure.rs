//! What dicing measures of parts: their areas, which is enough for pixels, or all moments, by which filters
//! weigh that reach farther.

use super::{Part, Parts};
use std::ops::{AddAssign, Mul, Range};
use veduta_geometry::{CellMoments, Cells, DVec2, GridAreas, GridMoments, Vec2, signed_area};

/// What is measured of a region in a pixel: of regions that do not overlap it adds up.
pub trait Measure: Copy + Default + AddAssign + Mul<f64, Output = Self> {
    /// Of a convex polygon in the unit square; nothing if rounding has turned it over.
    fn of(polygon: &[DVec2]) -> Self;

    /// Of the unit square.
    fn whole() -> Self;

    /// Area in square pixels.
    fn area(&self) -> f64;
}

impl Measure for f64 {
    #[inline]
    fn of(polygon: &[DVec2]) -> Self {
        signed_area(polygon).max(0.0)
    }

    #[inline]
    fn whole() -> Self {
        1.0
    }

    #[inline]
    fn area(&self) -> f64 {
        *self
    }
}

impl<const N: usize> Measure for CellMoments<N> {
    fn of(polygon: &[DVec2]) -> Self {
        let moments = Self::of_polygon(polygon, DVec2::ZERO);
        if moments.area() > 0.0 {
            moments
        } else {
            Self::default()
        }
    }

    fn whole() -> Self {
        Self::whole()
    }

    fn area(&self) -> f64 {
        self.area()
    }
}

/// Parts with what is measured of them: [`Parts`] with areas, [`CellParts`] with moments.
pub trait Diced: Default {
    /// What is measured.
    type Measure: Measure;
    /// What finds it, with its buffers.
    type Finder: Clone + std::fmt::Debug + Default;

    /// The parts.
    fn parts(&self) -> &Parts;

    /// The parts.
    fn parts_mut(&mut self) -> &mut Parts;

    /// Adds a part of the boundary.
    fn push(&mut self, part: Part, measure: Self::Measure);

    /// Takes the boundary of `other`.
    fn append(&mut self, other: &mut Self);

    /// What is measured of a part, by its place in [`Parts::boundary`].
    fn measure(&self, part: usize) -> Self::Measure;

    /// Changes it.
    fn set_measure(&mut self, part: usize, measure: Self::Measure);

    /// Visits the cells of a polygon as [`GridAreas::each_cell`] does, with the measure and the centroid:
    /// the cell's centre, unless `centroids` are asked for.
    fn each_cell(
        finder: &mut Self::Finder,
        polygon: &[DVec2],
        columns: u32,
        rows: Range<u32>,
        centroids: bool,
        visit: impl FnMut(Cells<(Self::Measure, Vec2)>),
    );

    /// Leaves nothing.
    fn clear(&mut self);
}

impl Diced for Parts {
    type Measure = f64;
    type Finder = GridAreas;

    #[inline]
    fn parts(&self) -> &Parts {
        self
    }

    #[inline]
    fn parts_mut(&mut self) -> &mut Parts {
        self
    }

    #[inline]
    fn push(&mut self, part: Part, _area: f64) {
        self.boundary.push(part);
    }

    fn append(&mut self, other: &mut Self) {
        self.boundary.append(&mut other.boundary);
    }

    #[inline]
    fn measure(&self, part: usize) -> f64 {
        f64::from(self.boundary[part].area)
    }

    #[inline]
    fn set_measure(&mut self, part: usize, area: f64) {
        self.boundary[part].area = area as f32;
    }

    #[inline]
    fn each_cell(
        areas: &mut GridAreas,
        polygon: &[DVec2],
        columns: u32,
        rows: Range<u32>,
        centroids: bool,
        mut visit: impl FnMut(Cells<(f64, Vec2)>),
    ) {
        if centroids {
            areas.each_cell_with_moments(polygon, columns, rows, |cells| {
                visit(cells.map(|area| (area.area, area.centroid().as_vec2())));
            });
        } else {
            areas.each_cell(polygon, columns, rows, |cells| {
                visit(cells.map(|area| (area, Vec2::splat(0.5))));
            });
        }
    }

    fn clear(&mut self) {
        self.boundary.clear();
        self.runs.clear();
    }
}

/// Parts with the moments of their boundary. `N` is that of [`CellMoments`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellParts<const N: usize> {
    /// The parts.
    pub parts: Parts,
    /// Of each of [`Parts::boundary`]: moments from the cell's top left corner; from
    /// [`attenuate`](super::attenuate) on of what is seen, as [`Part::area`] is.
    pub moments: Vec<CellMoments<N>>,
}

impl<const N: usize> Diced for CellParts<N> {
    type Measure = CellMoments<N>;
    type Finder = GridMoments<N>;

    fn parts(&self) -> &Parts {
        &self.parts
    }

    fn parts_mut(&mut self) -> &mut Parts {
        &mut self.parts
    }

    fn push(&mut self, part: Part, moments: CellMoments<N>) {
        self.parts.boundary.push(part);
        self.moments.push(moments);
    }

    fn append(&mut self, other: &mut Self) {
        self.parts.append(&mut other.parts);
        self.moments.append(&mut other.moments);
    }

    fn measure(&self, part: usize) -> CellMoments<N> {
        self.moments[part]
    }

    fn set_measure(&mut self, part: usize, moments: CellMoments<N>) {
        self.parts.set_measure(part, moments.area());
        self.moments[part] = moments;
    }

    fn each_cell(
        finder: &mut GridMoments<N>,
        polygon: &[DVec2],
        columns: u32,
        rows: Range<u32>,
        centroids: bool,
        mut visit: impl FnMut(Cells<(CellMoments<N>, Vec2)>),
    ) {
        finder.each_cell(polygon, columns, rows, |cells| {
            visit(cells.map(|moments| {
                let centroid = if centroids {
                    moments.centroid().as_vec2()
                } else {
                    Vec2::splat(0.5)
                };
                (moments, centroid)
            }));
        });
    }

    fn clear(&mut self) {
        self.parts.clear();
        self.moments.clear();
    }
}
