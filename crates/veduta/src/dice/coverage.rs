use crate::dice::{Bands, Dicer, Parts, PixelGrid};
use rayon::prelude::*;
use veduta_geometry::Cells;
use veduta_map::{FaceId, VisibilityMap};

/// How much of a pixel shows a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coverage {
    /// The pixel: row * width + column.
    pub pixel: usize,
    /// The face.
    pub face: FaceId,
    /// Area in square pixels.
    pub area: f64,
}

/// The exact areas that opaque faces cover of pixels, ascending by pixel and face, one row for each
/// pair. This is what laws are measured on; pictures are made from [`crate::dice::dice`].
pub fn coverage(map: &VisibilityMap, grid: &PixelGrid) -> Vec<Coverage> {
    let bands = Bands::new(map, *grid);
    let of_bands: Vec<Vec<Coverage>> = (0..bands.len())
        .into_par_iter()
        .map(|band| coverage_of_band(map, &bands, band))
        .collect();
    of_bands.concat()
}

fn coverage_of_band(map: &VisibilityMap, bands: &Bands, band: usize) -> Vec<Coverage> {
    let grid = bands.grid();
    let mut dicer = Dicer::<Parts>::default();
    let mut rows = Vec::new();
    let opaque = bands.fragments(band).iter();
    for &fragment in opaque.take_while(|&&fragment| (fragment as usize) < map.opaque.len()) {
        let face = map.opaque.face(fragment as usize);
        let polygon = dicer.placer.place(map, grid, fragment);
        let mut push = |column: u32, row: u32, area| {
            rows.push(Coverage {
                pixel: row as usize * grid.width as usize + column as usize,
                face,
                area,
            });
        };
        dicer
            .finder
            .each_cell(polygon, grid.width, bands.rows(band), |cells| match cells {
                Cells::Boundary { column, row, area } => push(column, row, area),
                Cells::Inside { row, columns } => columns.for_each(|column| push(column, row, 1.0)),
            });
    }
    summed(rows)
}

/// Rows ascending by pixel and face, one for each of both.
pub(super) fn summed(mut rows: Vec<Coverage>) -> Vec<Coverage> {
    // A stable sort: fragments of a face are summed in their order.
    rows.sort_by_key(|row| (row.pixel, row.face));
    rows.dedup_by(|next, first| {
        let same = (next.pixel, next.face) == (first.pixel, first.face);
        if same {
            first.area += next.area;
        }
        same
    });
    rows
}
