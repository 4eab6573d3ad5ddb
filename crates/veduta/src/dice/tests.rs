use super::*;
use std::collections::BTreeMap;
use veduta_geometry::{DVec2, DVec3, signed_area};
use veduta_map::{Affine, Camera, FaceId, Faces, Fragments, ObjectId, Projection, Side};

/// A map in which each polygon is a face that is seen whole.
fn map_of(polygons: &[Vec<DVec2>]) -> VisibilityMap {
    let mut faces = Faces::new();
    let plane = faces.push_plane(Affine::new(0.0, 0.0, 1.0));
    let mut opaque = Fragments::new();
    for (source, polygon) in polygons.iter().enumerate() {
        if let Some(face) = faces.push(polygon, plane, ObjectId(0), source as u32) {
            opaque.push_whole(face);
        }
    }
    let projection = Projection::Parallel {
        height: 1.0,
        aspect: 1.0,
    };
    let camera = Camera::looking(DVec3::Z, DVec3::ZERO, DVec3::Y, projection, 0.0);
    VisibilityMap {
        camera: camera.expect("a sound camera"),
        faces,
        opaque,
        veils: Fragments::new(),
    }
}

/// A small generator with a fixed seed (SplitMix64), so that cases can be run again.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * 2.0_f64.powi(-53)
    }
}

/// Triangles of a shaken lattice of `cells` x `cells` quads that fill the frame.
fn full_frame(cells: usize, random: &mut Random) -> Vec<Vec<DVec2>> {
    let step = 1.0 / cells as f64;
    let mut points = Vec::new();
    for j in 0..=cells {
        for i in 0..=cells {
            let mut shake = |k: usize| match k {
                0 => 0.0,
                _ if k == cells => 1.0,
                _ => (k as f64 + 0.4 * (random.unit() - 0.5)) * step,
            };
            points.push(DVec2::new(shake(i), shake(j)));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..cells {
        for i in 0..cells {
            let first = j * (cells + 1) + i;
            let [p, q, r, s] =
                [first, first + 1, first + cells + 1, first + cells + 2].map(|k| points[k]);
            triangles.push(vec![p, q, r]);
            triangles.push(vec![q, s, r]);
        }
    }
    triangles
}

fn by_pixel_and_face(map: &VisibilityMap, grid: &PixelGrid) -> BTreeMap<(usize, FaceId), f64> {
    coverage(map, grid)
        .into_iter()
        .map(|row| ((row.pixel, row.face), row.area))
        .collect()
}

fn assert_equal(
    found: &BTreeMap<(usize, FaceId), f64>,
    expected: &BTreeMap<(usize, FaceId), f64>,
    tolerance: f64,
) {
    for key in found.keys().chain(expected.keys()) {
        let [a, b] = [found, expected].map(|areas| areas.get(key).copied().unwrap_or(0.0));
        assert!(
            (a - b).abs() <= tolerance,
            "pixel and face {key:?}: {a} and not {b}"
        );
    }
}

#[test]
fn abutting_faces_fill_every_pixel() {
    let mut random = Random(1);
    for (cells, width, height) in [(3, 40, 25), (30, 64, 64), (100, 37, 53), (1, 5, 100)] {
        let map = map_of(&full_frame(cells, &mut random));
        let mut sums = vec![0.0; width * height];
        for row in coverage(&map, &PixelGrid::of_frame(width as u32, height as u32)) {
            sums[row.pixel] += row.area;
        }
        for (pixel, sum) in sums.iter().enumerate() {
            assert!(
                (sum - 1.0).abs() < 1e-12,
                "{cells} cells, pixel {pixel}: {sum}"
            );
        }
    }
}

#[test]
fn the_pixels_of_a_face_add_up_to_its_area() {
    let mut random = Random(2);
    let map = map_of(&full_frame(12, &mut random));
    let mut sums = vec![0.0; map.faces.len()];
    for row in coverage(&map, &PixelGrid::of_frame(101, 67)) {
        sums[row.face.index()] += row.area;
    }
    for face in map.faces.ids() {
        let area = signed_area(map.faces.outline(face)) * 101.0 * 67.0;
        assert!((sums[face.index()] - area).abs() < 1e-11);
    }
}

#[test]
fn a_wire_is_equally_bright_lying_and_upright() {
    let size = 512;
    let thickness = 0.05 / f64::from(size);
    let (mut lying, mut upright) = (Vec::new(), Vec::new());
    for k in 0..25 {
        let at = (20.0 * f64::from(k) + 7.97) / f64::from(size);
        let wire = [
            (0.0, at),
            (1.0, at),
            (1.0, at + thickness),
            (0.0, at + thickness),
        ];
        lying.push(wire.map(DVec2::from).to_vec());
        upright.push(wire.map(|(x, y)| DVec2::new(y, x)).to_vec());
    }
    let grid = PixelGrid::of_frame(size, size);
    let [lying, upright] = [lying, upright].map(|wires| {
        let mut pixels = vec![0.0; grid.pixel_count()];
        for row in coverage(&map_of(&wires), &grid) {
            pixels[row.pixel] += row.area;
        }
        pixels
    });
    let mut wire_pixels = 0;
    for row in 0..size as usize {
        for column in 0..size as usize {
            let (a, b) = (
                lying[row * size as usize + column],
                upright[column * size as usize + row],
            );
            assert!((a - b).abs() < 1e-12);
            wire_pixels += usize::from(a > 0.0);
        }
        // Each wire lies in two rows, 0.03 and 0.02.
        let across: f64 = upright[row * size as usize..][..40].iter().sum();
        assert!((across - 0.1).abs() < 1e-11, "row {row}: {across}");
    }
    assert_eq!(wire_pixels, 25 * 2 * size as usize);
}

#[test]
fn a_larger_picture_shrunk_is_the_smaller_one() {
    let mut random = Random(3);
    for (across, down) in [(2, 2), (1, 3), (5, 1)] {
        let map = map_of(&full_frame(9, &mut random));
        let (width, height) = (41, 33);
        let mut summed = BTreeMap::new();
        for row in coverage(&map, &PixelGrid::of_frame(width * across, height * down)) {
            let (i, j) = (
                row.pixel % (width * across) as usize / across as usize,
                row.pixel / (width * across) as usize / down as usize,
            );
            let pixel = j * width as usize + i;
            *summed.entry((pixel, row.face)).or_insert(0.0) += row.area / f64::from(across * down);
        }
        let expected = by_pixel_and_face(&map, &PixelGrid::of_frame(width, height));
        assert_equal(&summed, &expected, 1e-12);
    }
}

#[test]
fn a_window_shows_what_the_whole_shows_there() {
    let mut random = Random(4);
    let map = map_of(&full_frame(5, &mut random));
    let whole = PixelGrid::of_frame(60, 50);
    let of_whole = by_pixel_and_face(&map, &whole);
    // Inside, over each corner of the frame, larger than it, and beside it.
    for (left, top, width, height) in [
        (17, 11, 9, 20),
        (-5, -3, 30, 20),
        (40, 30, 40, 40),
        (-4, 45, 10, 20),
        (-10, -10, 80, 70),
        (70, 3, 10, 10),
    ] {
        let window = whole.window(f64::from(left), f64::from(top), width, height);
        let mut expected = BTreeMap::new();
        for (&(pixel, face), &area) in &of_whole {
            let (i, j) = (pixel as i32 % 60 - left, pixel as i32 / 60 - top);
            if (0..width as i32).contains(&i) && (0..height as i32).contains(&j) {
                expected.insert(((j * width as i32 + i) as usize, face), area);
            }
        }
        assert_equal(&by_pixel_and_face(&map, &window), &expected, 1e-12);
    }
}

#[test]
fn a_deep_zoom_into_a_corner_still_fills_its_pixels() {
    let mut random = Random(5);
    let map = map_of(&full_frame(7, &mut random));
    let grid = PixelGrid {
        width: 64,
        height: 64,
        pixels_per_frame: DVec2::splat(1e6),
        origin: DVec2::new(428_571.0, 428_500.0),
    };
    let mut sums = vec![0.0; grid.pixel_count()];
    for row in coverage(&map, &grid) {
        sums[row.pixel] += row.area;
    }
    // An ulp of a million pixels is 1e-10.
    assert!(sums.iter().all(|sum| (sum - 1.0_f64).abs() < 1e-9));
}

#[test]
fn parts_are_the_coverage_in_the_order_of_fragments() {
    let mut random = Random(6);
    let mut map = map_of(&full_frame(11, &mut random));
    // Two halves of a face, which count as one face and as two fragments.
    let polygon = map.faces.outline(FaceId(0)).to_vec();
    let middle = 0.5 * (polygon[1] + polygon[2]);
    let mut cut = Fragments::new();
    for half in [
        [polygon[0], polygon[1], middle],
        [polygon[0], middle, polygon[2]],
    ] {
        let side = Side::scan(FaceId(0));
        cut.push_cut(FaceId(0), half.map(|vertex| (vertex, side)).into_iter());
    }
    for face in map.faces.ids().skip(1) {
        cut.push_whole(face);
    }
    map.opaque = cut;

    let grid = PixelGrid::of_frame(50, 70);
    let bands = Bands::new(&map, grid);
    let (mut dicer, mut parts) = (Dicer::default(), Parts::default());
    let mut found = BTreeMap::new();
    for band in 0..bands.len() {
        let first = bands.rows(band).start as usize * 50;
        dice(
            &map,
            &bands,
            band,
            |fragment| fragment % 2 == 0,
            &mut dicer,
            &mut parts,
        );
        let mut last_of_pixel = BTreeMap::new();
        for part in &parts.boundary {
            let previous = last_of_pixel.insert(part.pixel, part.fragment);
            assert!(
                previous < Some(part.fragment),
                "a fragment has one part in a pixel, in order"
            );
            let key = (
                first + part.pixel as usize,
                map.opaque.face(part.fragment as usize),
            );
            *found.entry(key).or_insert(0.0) += f64::from(part.area);
        }
        for run in &parts.runs {
            for pixel in run.pixels() {
                let key = (first + pixel, map.opaque.face(run.fragment as usize));
                *found.entry(key).or_insert(0.0) += 1.0;
            }
        }
    }
    assert_equal(&found, &by_pixel_and_face(&map, &grid), 1e-7);
}

#[test]
fn centroids_of_the_parts_of_a_face_average_to_its_own() {
    let triangle = vec![(0.11, 0.07), (0.93, 0.41), (0.28, 0.88)];
    let triangle: Vec<DVec2> = triangle.into_iter().map(DVec2::from).collect();
    let map = map_of(std::slice::from_ref(&triangle));
    let grid = PixelGrid::of_frame(31, 23);
    let bands = Bands::new(&map, grid);
    let (mut dicer, mut parts) = (Dicer::default(), Parts::default());
    let (mut area, mut moment) = (0.0, DVec2::ZERO);
    for band in 0..bands.len() {
        let corner = |pixel: u32| {
            let row = bands.rows(band).start + pixel / 31;
            DVec2::new(f64::from(pixel % 31), f64::from(row))
        };
        dice(&map, &bands, band, |_| true, &mut dicer, &mut parts);
        for part in &parts.boundary {
            area += f64::from(part.area);
            moment += f64::from(part.area) * (corner(part.pixel) + part.centroid.as_dvec2());
        }
        for run in &parts.runs {
            for step in 0..run.length {
                area += 1.0;
                moment += corner(run.pixel + step) + 0.5;
            }
        }
    }
    let centroid = grid.image_from_pixels(moment / area);
    let expected = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    assert!((centroid - expected).length() < 1e-7);
}

#[test]
fn parts_of_spans_have_the_areas_of_the_paper() {
    use crate::visibility::multiscan::{find_spans, picture};
    let made = crate::scene::generate::by_name("balls3").expect("a generated scene");
    let faces = crate::visibility::project(&made.scene, &made.camera);
    for n in [1, 3] {
        let (width, height) = (97_u32, 50_u32);
        let spans = find_spans(&faces, width, height, n);
        // A colour that tells faces apart.
        let color = |face: FaceId| [(face.0 % 7) as f32, (face.0 % 5) as f32, 1.0, 1.0];
        let expected = picture(&spans, color);
        let mut parts = Parts::default();
        dice_spans(
            &spans,
            0..height,
            |face| face.0,
            &mut SpanDicer::default(),
            &mut parts,
        );
        assert!(!parts.runs.is_empty(), "some pixels are filled");
        let mut found = vec![[0.0_f32; 4]; (width * height) as usize];
        let mut add = |pixel: usize, fragment: u32, area: f32| {
            for (sum, value) in found[pixel].iter_mut().zip(color(FaceId(fragment))) {
                *sum += area * value;
            }
        };
        for part in &parts.boundary {
            assert!(part.centroid.min_element() >= 0.0 && part.centroid.max_element() <= 1.0);
            add(part.pixel as usize, part.fragment, part.area);
        }
        for run in &parts.runs {
            run.pixels().for_each(|pixel| add(pixel, run.fragment, 1.0));
        }
        for (a, b) in found.iter().flatten().zip(expected.pixels.iter().flatten()) {
            assert!((a - b).abs() < 2e-5, "{a} and {b}");
        }
    }
}
