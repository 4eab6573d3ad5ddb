use super::*;
use crate::scene::generate;
use crate::visibility::project;
use veduta_geometry::{Affine, DVec2, signed_area};
use veduta_map::{FaceId, ObjectId};

/// Faces of the given outlines and nearness.
fn faces(outlines: &[(&[[f64; 2]], Affine)]) -> Faces {
    let mut faces = Faces::new();
    for (index, (outline, nearness)) in outlines.iter().enumerate() {
        let plane = faces.push_plane(*nearness);
        let outline: Vec<DVec2> = outline.iter().map(|&point| point.into()).collect();
        faces
            .push(&outline, plane, ObjectId(0), index as u32)
            .expect("an outline with an area");
    }
    faces
}

const LEVEL: Affine = Affine::new(0.0, 0.0, 1.0);
const WHITE: [f32; 4] = [1.0; 4];

/// Area by eq. (1) of what is seen of each face, in pixels, summed over the picture in f64.
fn areas(spans: &Spans, faces: usize) -> Vec<f64> {
    let n = spans.sub_scanlines_per_row();
    let last = n * spans.height();
    let mut areas = vec![0.0; faces];
    for index in 0..=last {
        let weight = if index == 0 || index == last {
            0.5
        } else {
            1.0
        };
        for span in spans.sub_scanline(index) {
            areas[span.face.index()] += weight / f64::from(n) * (span.right - span.left);
        }
    }
    areas
}

#[test]
fn spans_ascend_and_do_not_overlap() {
    for name in ["balls3", "soup", "pierce", "leaves20", "mesh5"] {
        let made = generate::by_name(name).expect("a generated scene");
        let spans = find_spans(&project(&made.scene, &made.camera), 160, 90, 3);
        assert!(spans.len() > 100, "{name}");
        for index in 0..=3 * 90 {
            let mut end = 0.0;
            for span in spans.sub_scanline(index) {
                assert!(
                    span.left >= end && span.right > span.left,
                    "{name}: {span:?}"
                );
                end = span.right;
            }
            assert!(end <= 160.0, "{name} ends at {end}");
        }
    }
}

#[test]
fn the_area_of_a_triangle_converges_with_the_square_of_n() {
    let outline: &[[f64; 2]] = &[[0.13, 0.21], [0.88, 0.34], [0.41, 0.93]];
    let faces = faces(&[(outline, LEVEL)]);
    let exact = signed_area(faces.outline(FaceId(0))) * 32.0 * 32.0;
    let mut errors = Vec::new();
    for n in [1, 4, 16, 64, 256] {
        errors.push((areas(&find_spans(&faces, 32, 32, n), 1)[0] - exact).abs());
    }
    // The trapezoidal rule is of second order where the integrand bends, as it does at vertices.
    for (k, error) in errors.iter().enumerate() {
        assert!(*error < 6.0 / 16.0_f64.powi(k as i32), "{errors:?}");
    }
    assert!(errors[4] < 1e-4, "{errors:?}");
}

#[test]
fn upright_edges_are_exact_at_once() {
    let outline: &[[f64; 2]] = &[[0.137, 0.0], [0.7613, 0.0], [0.7613, 1.0], [0.137, 1.0]];
    let spans = find_spans(&faces(&[(outline, LEVEL)]), 16, 9, 1);
    let (left, right) = (0.137_f64 * 16.0, 0.7613_f64 * 16.0);
    let picture = super::picture(&spans, |_| WHITE);
    for (index, pixel) in picture.pixels.iter().enumerate() {
        let column = (index % 16) as f64;
        let exact = (right.min(column + 1.0) - left.max(column)).max(0.0);
        assert!(
            (f64::from(pixel[0]) - exact).abs() < 1e-6,
            "{index}: {pixel:?}"
        );
    }
}

#[test]
fn a_picture_wholly_covered_is_wholly_opaque() {
    let outline: &[[f64; 2]] = &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for (n, height) in [(1, 1), (3, 7), (5, 32), (2, 33), (7, 64)] {
        let spans = find_spans(&faces(&[(outline, LEVEL)]), 11, height, n);
        let picture = super::picture(&spans, |_| WHITE);
        for pixel in &picture.pixels {
            assert!(
                (pixel[3] - 1.0).abs() < 1e-6,
                "n = {n}, {height} rows: {pixel:?}"
            );
        }
    }
}

#[test]
fn the_sub_scanline_between_two_rows_counts_half_in_both() {
    // Half a row high about the border of rows 0 and 1, met by that one sub-scanline only.
    let outline: &[[f64; 2]] = &[[0.0, 0.2], [1.0, 0.2], [1.0, 0.3], [0.0, 0.3]];
    let spans = find_spans(&faces(&[(outline, LEVEL)]), 1, 4, 2);
    assert_eq!(spans.len(), 1);
    let picture = super::picture(&spans, |_| WHITE);
    let seen: Vec<f32> = picture.pixels.iter().map(|pixel| pixel[0]).collect();
    assert_eq!(seen, [0.25, 0.25, 0.0, 0.0]);
}

#[test]
fn faces_that_pierce_each_other_are_cut_where_their_planes_cross() {
    let outline: &[[f64; 2]] = &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    // They cross at x = 0.3 + 0.2 y.
    let falling = Affine::new(-1.0, 0.2, 1.3);
    let rising = Affine::new(1.0, -0.2, 0.7);
    for pair in [[falling, rising], [rising, falling]] {
        let faces = faces(&[(outline, pair[0]), (outline, pair[1])]);
        let spans = find_spans(&faces, 50, 10, 4);
        for index in 0..40 {
            let crossing = 50.0 * (0.3 + 0.2 * f64::from(index) / 40.0);
            let [left, right] = spans.sub_scanline(index) else {
                panic!("not two spans: {:?}", spans.sub_scanline(index));
            };
            assert_eq!(left.face, FaceId(u32::from(pair[0] == rising)));
            assert!((left.right - crossing).abs() < 1e-12 && left.right == right.left);
            assert_eq!((left.left, right.right), (0.0, 50.0));
        }
    }
}

#[test]
fn of_faces_in_one_plane_the_first_is_seen() {
    let wide: &[[f64; 2]] = &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let narrow: &[[f64; 2]] = &[[0.25, 0.0], [0.5, 0.0], [0.5, 1.0], [0.25, 1.0]];
    let tilted = Affine::new(0.37, -0.11, 0.9);
    let areas_of = |outlines: [&[[f64; 2]]; 2]| {
        let faces = faces(&outlines.map(|outline| (outline, tilted)));
        areas(&find_spans(&faces, 4, 4, 1), 2)
    };
    assert_eq!(areas_of([wide, narrow]), [16.0, 0.0]);
    assert_eq!(areas_of([narrow, wide]), [4.0, 12.0]);
}

#[test]
fn veils_are_left_out() {
    let outline: &[[f64; 2]] = &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut faces = faces(&[(outline, LEVEL), (outline, Affine::new(0.0, 0.0, 2.0))]);
    faces.set_veil(FaceId(1));
    assert_eq!(areas(&find_spans(&faces, 4, 4, 2), 2), [16.0, 0.0]);
}

/// The nearest face at a point, found by looking at all of them.
fn nearest_at(faces: &Faces, point: DVec2) -> Option<FaceId> {
    let inside = |face: &FaceId| {
        let outline = faces.outline(*face);
        (0..outline.len()).all(|k| {
            let (from, to) = (outline[k], outline[(k + 1) % outline.len()]);
            veduta_geometry::cross(to - from, point - from) > 0.0
        })
    };
    faces.ids().filter(inside).max_by(|a, b| {
        let nearness = [a, b].map(|face| faces.face_nearness(*face).at(point));
        nearness[0].total_cmp(&nearness[1])
    })
}

#[test]
fn the_middle_of_each_span_shows_the_nearest_face() {
    for name in ["soup", "pierce", "buildings", "bridge"] {
        let made = generate::by_name(name).expect("a generated scene");
        let faces = project(&made.scene, &made.camera);
        let (width, height) = (48, 27);
        let spans = find_spans(&faces, width, height, 2);
        let mut looked_at = 0;
        // Every fifth: looking at all faces for all spans would take minutes.
        for index in (1..2 * height).step_by(5) {
            let y = f64::from(index) / f64::from(2 * height);
            let mut end = 0.0;
            for span in spans.sub_scanline(index) {
                let mut check = |left: f64, right: f64, face| {
                    if right - left > 1e-6 {
                        looked_at += 1;
                        let point = DVec2::new(0.5 * (left + right) / f64::from(width), y);
                        assert_eq!(nearest_at(&faces, point), face, "{name} at {point}");
                    }
                };
                check(end, span.left, None);
                check(span.left, span.right, Some(span.face));
                end = span.right;
            }
        }
        assert!(looked_at > 30, "{name}: only {looked_at} spans");
    }
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    for name in ["soup", "balls7"] {
        let made = generate::by_name(name).expect("a generated scene");
        let faces = project(&made.scene, &made.camera);
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a pool of threads").install(|| {
                let spans = find_spans(&faces, 200, 150, 3);
                let color = |face: FaceId| [face.0 as f32 * 0.013, 0.5, 0.25, 1.0];
                let picture = super::picture(&spans, color);
                (spans, picture)
            })
        };
        let one = with_threads(1);
        for threads in [2, 5] {
            assert!(
                with_threads(threads) == one,
                "{name} with {threads} threads"
            );
        }
    }
}

#[test]
fn wires_along_the_rows_are_lost_or_too_bright() {
    // Tanaka & Takahashi (1991), §5.2 and Fig. 6: seven sub-scanlines between those on the pixels'
    // borders still miss some of the 0.05 px wires, and those they meet are an eighth of a pixel.
    let made = generate::by_name("mesh0").expect("a generated scene");
    let spans = find_spans(&project(&made.scene, &made.camera), 512, 512, 8);
    let picture = super::picture(&spans, |_| WHITE);
    // Between two wires of the other set, light summed over the wire's rows or columns.
    let across = |wire: u32, along_rows: bool| {
        let centre = 256.0 + (f64::from(wire) - 12.0) * 20.1;
        let around = centre as usize - 2..centre as usize + 3;
        around
            .map(|k| {
                let pixel = if along_rows {
                    k * 512 + 246
                } else {
                    246 * 512 + k
                };
                picture.pixels[pixel][0]
            })
            .sum::<f32>()
    };
    let rows: Vec<f32> = (0..25).map(|wire| across(wire, true)).collect();
    let columns: Vec<f32> = (0..25).map(|wire| across(wire, false)).collect();
    assert!(
        columns.iter().all(|light| (light - 0.05).abs() < 1e-6),
        "{columns:?}"
    );
    let lost = rows.iter().filter(|light| **light == 0.0).count();
    let bright = rows
        .iter()
        .filter(|light| (**light - 0.125).abs() < 1e-6)
        .count();
    assert!(lost >= 5 && bright >= 5 && lost + bright == 25, "{rows:?}");
}
