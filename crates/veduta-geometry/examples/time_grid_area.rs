//! Times the exact areas of triangles in the cells of a grid:
//! `cargo run --release -p veduta-geometry --example time_grid_area`

use std::hint::black_box;
use std::time::Instant;
use veduta_geometry::{Cells, DVec2, GridAreas};

const COLUMNS: u32 = 512;

fn main() {
    println!("triangles of a mesh, {COLUMNS} x {COLUMNS} cells; the best of 20 runs, one thread");
    for side in [0.3, 1.0, 3.0, 10.0, 30.0, 100.0] {
        let triangles = mesh(side);
        let mut grid = GridAreas::new();
        let mut boundary_cells = 0;
        for triangle in &triangles {
            grid.each_cell(triangle, COLUMNS, 0..COLUMNS, |cells| {
                boundary_cells += u64::from(matches!(cells, Cells::Boundary { .. }));
            });
        }
        let areas = best(&mut grid, &triangles, |grid, triangle| {
            let mut sum = 0.0;
            grid.each_cell(triangle, COLUMNS, 0..COLUMNS, |cells| match cells {
                Cells::Boundary { area, .. } => sum += area,
                Cells::Inside { columns, .. } => sum += columns.len() as f64,
            });
            sum
        });
        let moments = best(&mut grid, &triangles, |grid, triangle| {
            let mut sum = 0.0;
            grid.each_cell_with_moments(triangle, COLUMNS, 0..COLUMNS, |cells| match cells {
                Cells::Boundary { area, .. } => sum += area.moment.x + area.moment.y,
                Cells::Inside { columns, .. } => sum += columns.len() as f64,
            });
            sum
        });
        let cells = boundary_cells as f64 / triangles.len() as f64;
        println!(
            "side {side:5} cells: {cells:6.1} boundary cells each; areas {areas:7.1} ns a triangle, \
             {:5.2} ns a cell; with moments {moments:7.1} ns, {:5.2} ns",
            areas / cells,
            moments / cells
        );
    }
}

/// A turned, sheared lattice of triangles, kept where it lies in the grid.
fn mesh(side: f64) -> Vec<[DVec2; 3]> {
    let u = side * DVec2::from_angle(0.3);
    let v = side * DVec2::from_angle(1.2);
    let n = (2.0 * f64::from(COLUMNS) / side) as i32;
    let mut triangles = Vec::new();
    for j in -n..n {
        for i in -n..n {
            let p = u * f64::from(i) + v * f64::from(j);
            for triangle in [[p, p + u, p + v], [p + u, p + u + v, p + v]] {
                let limit = f64::from(COLUMNS);
                if triangle
                    .iter()
                    .all(|p| p.cmpge(DVec2::ZERO).all() && p.max_element() <= limit)
                {
                    triangles.push(triangle);
                }
            }
        }
    }
    triangles
}

/// Nanoseconds a triangle.
fn best(
    grid: &mut GridAreas,
    triangles: &[[DVec2; 3]],
    mut measure: impl FnMut(&mut GridAreas, &[DVec2]) -> f64,
) -> f64 {
    (0..20)
        .map(|_| {
            let start = Instant::now();
            for triangle in triangles {
                black_box(measure(grid, triangle));
            }
            start.elapsed().as_nanos() as f64 / triangles.len() as f64
        })
        .fold(f64::INFINITY, f64::min)
}
