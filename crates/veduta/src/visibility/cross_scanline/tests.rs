use super::{Settings, find};
use crate::visibility::Seen;
use veduta_geometry::{Affine, DVec2, signed_area};
use veduta_map::{FaceId, Faces, Fragment, Fragments, ObjectId, PlaneId, Side};

/// Strips that are odd, even, many and only one.
const STRIPS: [u32; 5] = [1, 2, 3, 7, 64];

fn level(faces: &mut Faces, nearness: f64) -> PlaneId {
    faces.push_plane(Affine::new(0.0, 0.0, nearness))
}

fn add(faces: &mut Faces, outline: &[[f64; 2]], plane: PlaneId) -> FaceId {
    let outline: Vec<DVec2> = outline.iter().map(|&vertex| vertex.into()).collect();
    faces
        .push(&outline, plane, ObjectId(0), 0)
        .expect("a face with area")
}

fn rectangle(faces: &mut Faces, low: [f64; 2], high: [f64; 2], plane: PlaneId) -> FaceId {
    add(
        faces,
        &[low, [high[0], low[1]], high, [low[0], high[1]]],
        plane,
    )
}

fn seen(faces: &Faces, strips: u32) -> Seen {
    find(faces, &Settings { strips })
}

fn whole(fragments: &Fragments) -> Vec<FaceId> {
    fragments
        .iter()
        .filter_map(|fragment| match fragment {
            Fragment::Whole(face) => Some(face),
            Fragment::Cut { .. } => None,
        })
        .collect()
}

fn area(faces: &Faces, fragments: &Fragments, face: FaceId) -> f64 {
    fragments
        .iter()
        .filter(|fragment| fragment.face() == face)
        .map(|fragment| match fragment {
            Fragment::Whole(face) => signed_area(faces.outline(face)),
            Fragment::Cut { vertices, .. } => signed_area(vertices),
        })
        .sum()
}

/// Panics unless the opaque areas of the faces are those, whatever the strips.
#[track_caller]
fn assert_areas(faces: &Faces, expected: &[(FaceId, f64)]) {
    for strips in STRIPS {
        let seen = seen(faces, strips);
        for &(face, expected) in expected {
            let area = area(faces, &seen.opaque, face);
            assert!(
                (area - expected).abs() <= 1e-15,
                "{face:?} has {area}, not {expected}, with {strips} strips"
            );
        }
    }
}

/// The names of all sides of a face's fragments that lie on the line x = `x` or y = `y`.
fn sides_on(seen: &Seen, face: FaceId, is_on: impl Fn(DVec2) -> bool) -> Vec<Side> {
    let mut names = Vec::new();
    for fragment in seen.opaque.iter() {
        let Fragment::Cut {
            face: of,
            vertices,
            sides,
        } = fragment
        else {
            continue;
        };
        for (index, &side) in sides.iter().enumerate() {
            let ends = [vertices[index], vertices[(index + 1) % vertices.len()]];
            if of == face && ends.into_iter().all(&is_on) {
                names.push(side);
            }
        }
    }
    names
}

#[test]
fn without_faces_nothing_is_seen() {
    assert_eq!(seen(&Faces::new(), 4), Seen::default());
}

#[test]
fn a_face_alone_is_seen_whole() {
    let mut faces = Faces::new();
    let plane = level(&mut faces, 1.0);
    let face = add(&mut faces, &[[0.1, 0.2], [0.9, 0.3], [0.4, 0.95]], plane);
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        assert_eq!(whole(&seen.opaque), [face]);
        assert_eq!(seen.opaque.len(), 1);
    }
}

#[test]
fn a_face_in_front_stays_whole_and_hides_its_part_of_the_other() {
    let mut faces = Faces::new();
    let [far, near] = [1.0, 2.0].map(|nearness| level(&mut faces, nearness));
    let behind = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], far);
    let front = add(&mut faces, &[[0.2, 0.2], [0.8, 0.3], [0.3, 0.7]], near);
    let hidden = signed_area(faces.outline(front));
    assert_areas(&faces, &[(front, hidden), (behind, 1.0 - hidden)]);
    for strips in STRIPS {
        assert_eq!(whole(&seen(&faces, strips).opaque), [front]);
    }
}

#[test]
fn a_hidden_face_is_not_seen_and_leaves_no_trace() {
    let mut faces = Faces::new();
    let [far, near] = [1.0, 2.0].map(|nearness| level(&mut faces, nearness));
    let front = rectangle(&mut faces, [0.1, 0.1], [0.9, 0.9], near);
    add(&mut faces, &[[0.2, 0.2], [0.8, 0.3], [0.3, 0.7]], far);
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        assert_eq!(whole(&seen.opaque), [front]);
        assert_eq!(seen.opaque.len(), 1);
    }
}

#[test]
fn planes_part_in_the_line_in_which_they_cross() {
    let mut faces = Faces::new();
    let rising = faces.push_plane(Affine::new(1.0, 0.5, 0.0));
    let falling = faces.push_plane(Affine::new(-1.0, -0.5, 1.5));
    let right = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], rising);
    let left = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], falling);
    // 2 x + y = 1.5 runs from (0.75, 0) to (0.25, 1).
    assert_areas(&faces, &[(right, 0.5), (left, 0.5)]);
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        let is_on = |point: DVec2| (2.0 * point.x + point.y - 1.5).abs() < 1e-14;
        for (face, other) in [(left, right), (right, left)] {
            let sides = sides_on(&seen, face, is_on);
            assert!(!sides.is_empty());
            assert!(sides.iter().all(|&side| side == Side::crossing(other)));
        }
    }
}

#[test]
fn four_planes_that_meet_in_a_point_get_a_quarter_each() {
    let mut faces = Faces::new();
    let expected: Vec<(FaceId, f64)> = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]
        .into_iter()
        .map(|[a, b]| {
            let plane = faces.push_plane(Affine::new(a, b, -0.5 * (a + b)));
            let face = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], plane);
            (face, 0.25)
        })
        .collect();
    assert_areas(&faces, &expected);
}

#[test]
fn planes_that_cross_at_1e_minus_7_part_where_they_cross() {
    let mut faces = Faces::new();
    let steady = faces.push_plane(Affine::new(0.25, 0.125, 0.5));
    // Exact in binary, so that the crossing is at x = 0.375 as stored.
    let slope = (1e-7f64).log2().round().exp2();
    let grazing = faces.push_plane(Affine::new(0.25 + slope, 0.125, 0.5 - 0.375 * slope));
    let left = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], steady);
    let right = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], grazing);
    assert_areas(&faces, &[(left, 0.375), (right, 0.625)]);
}

#[test]
fn faces_with_a_common_edge_are_both_whole() {
    let mut faces = Faces::new();
    let [one, other] = [1.0, 2.0].map(|nearness| level(&mut faces, nearness));
    let (p, q) = ([0.123, 0.05], [0.77, 0.931]);
    let left = add(&mut faces, &[p, [0.05, 0.9], q], one);
    let right = add(&mut faces, &[q, [0.96, 0.21], p], other);
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        assert_eq!(whole(&seen.opaque), [left, right]);
        assert_eq!(seen.opaque.len(), 2);
    }
}

#[test]
fn a_vertex_in_the_middle_of_an_edge_leaves_neither_gap_nor_overlap() {
    let mut faces = Faces::new();
    let [back, one, other] = [0.0, 1.0, 2.0].map(|nearness| level(&mut faces, nearness));
    let backdrop = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], back);
    let (p, q) = ([0.1, 0.17], [0.9, 0.83]);
    let middle = [0.1 + 0.8 / 3.0, 0.17 + 0.66 / 3.0];
    let above = add(&mut faces, &[p, [0.9, 0.1], q], one);
    let left = add(&mut faces, &[p, middle, [0.2, 0.9]], other);
    let right = add(&mut faces, &[middle, q, [0.2, 0.9]], other);
    let areas = [above, left, right].map(|face| (face, signed_area(faces.outline(face))));
    let rest = 1.0 - areas.iter().map(|area| area.1).sum::<f64>();
    assert_areas(&faces, &areas);
    assert_areas(&faces, &[(backdrop, rest)]);
}

#[test]
fn of_coplanar_faces_the_smaller_id_is_seen() {
    let mut faces = Faces::new();
    let plane = faces.push_plane(Affine::new(0.3, -0.2, 0.7));
    let first = rectangle(&mut faces, [0.0, 0.0], [0.5, 0.5], plane);
    let second = rectangle(&mut faces, [0.25, 0.25], [0.75, 0.75], plane);
    assert_areas(&faces, &[(first, 0.25), (second, 0.1875)]);
}

#[test]
fn of_equal_faces_only_the_first_is_seen() {
    let mut faces = Faces::new();
    let outline = [[0.1, 0.1], [0.9, 0.2], [0.5, 0.8]];
    // Planes of their own, which differ by nothing.
    let first = [0; 3].map(|_| {
        let plane = faces.push_plane(Affine::new(0.1, 0.2, 0.3));
        add(&mut faces, &outline, plane)
    })[0];
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        assert_eq!(whole(&seen.opaque), [first]);
        assert_eq!(seen.opaque.len(), 1);
    }
}

#[test]
fn veils_hide_nothing_and_are_hidden_by_opaque_faces_only() {
    let mut faces = Faces::new();
    let [back, middle, front] = [1.0, 2.0, 3.0].map(|nearness| level(&mut faces, nearness));
    let backdrop = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], back);
    let opaque = rectangle(&mut faces, [0.0, 0.0], [0.5, 1.0], middle);
    let far_veil = rectangle(&mut faces, [0.25, 0.0], [0.75, 1.0], back);
    let near_veil = rectangle(&mut faces, [0.25, 0.25], [0.75, 0.75], front);
    let lost_veil = rectangle(&mut faces, [0.0, 0.0], [0.25, 0.25], back);
    for veil in [far_veil, near_veil, lost_veil] {
        faces.set_veil(veil);
    }
    assert_areas(&faces, &[(backdrop, 0.5), (opaque, 0.5)]);
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        // It lies on the backdrop, whose plane it has, and is hidden where the opaque face is.
        assert!((area(&faces, &seen.veils, far_veil) - 0.25).abs() < 1e-15);
        assert_eq!(area(&faces, &seen.veils, lost_veil), 0.0);
        assert_eq!(whole(&seen.veils), [near_veil]);
        assert_eq!(whole(&seen.opaque), [opaque]);
    }
}

#[test]
fn a_veil_that_pierces_an_opaque_face_is_seen_in_front_of_it() {
    let mut faces = Faces::new();
    let level = level(&mut faces, 0.5);
    let slope = faces.push_plane(Affine::new(0.0, 1.0, 0.0));
    rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], level);
    let veil = rectangle(&mut faces, [0.2, 0.0], [0.8, 1.0], slope);
    faces.set_veil(veil);
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        assert!((area(&faces, &seen.veils, veil) - 0.3).abs() <= 1e-15);
    }
}

#[test]
fn a_veil_in_the_plane_of_an_opaque_face_is_seen_before_it() {
    let mut faces = Faces::new();
    let plane = level(&mut faces, 1.0);
    rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], plane);
    let decal = rectangle(&mut faces, [0.2, 0.2], [0.8, 0.8], plane);
    faces.set_veil(decal);
    for strips in STRIPS {
        assert_eq!(whole(&seen(&faces, strips).veils), [decal]);
    }
    let found = crate::visibility::speculative::find(&faces, &Default::default());
    assert_eq!(whole(&found.veils), [decal]);
}

#[test]
fn veils_over_the_background_are_whole() {
    let mut faces = Faces::new();
    let plane = level(&mut faces, 1.0);
    let veils = [[0.1, 0.1], [0.3, 0.3]]
        .map(|low| rectangle(&mut faces, low, [low[0] + 0.5, low[1] + 0.5], plane));
    for veil in veils {
        faces.set_veil(veil);
    }
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        assert_eq!(whole(&seen.veils), veils);
        assert!(seen.opaque.is_empty());
    }
}

#[test]
fn edges_on_scanlines_name_the_sides_along_them() {
    let mut faces = Faces::new();
    let [far, near] = [1.0, 2.0].map(|nearness| level(&mut faces, nearness));
    let behind = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], far);
    // Its upper side lies on an H-scanline of four strips, and covers a part of one side only.
    let front = rectangle(&mut faces, [0.25, 0.25], [0.5, 0.75], near);
    let seen = seen(&faces, 4);
    let above = sides_on(&seen, behind, |point| {
        point.y == 0.25 && (0.25..=0.5).contains(&point.x)
    });
    assert_eq!(above, [Side::of_outline(front, 0)]);
    let right = sides_on(&seen, behind, |point| {
        point.x == 0.5 && (0.25..=0.75).contains(&point.y)
    });
    assert_eq!(right, [Side::of_outline(front, 1); 2]);
    let own = sides_on(&seen, behind, |point| point.x == 1.0);
    assert_eq!(own, [Side::of_outline(behind, 1); 4]);
}

#[test]
fn edges_that_lean_by_their_last_bits_do_not_bend_what_is_behind() {
    // Near-vertical edges that cross within the last bits of x: pieces of such a stretch may not be
    // joined with their neighbours, or the neighbours' bounds go astray.
    let lean = 2e-15;
    let mut faces = Faces::new();
    let [back, one, other] = [0.0, 1.0, 2.0].map(|nearness| level(&mut faces, nearness));
    let backdrop = add(
        &mut faces,
        &[[0.0, 0.0], [1.0, 0.1], [1.0, 0.9], [0.0, 1.0]],
        back,
    );
    let outline = [[0.3, 0.2], [0.6, 0.2], [0.6 + lean, 0.7], [0.3 + lean, 0.7]];
    let first = add(&mut faces, &outline, one);
    let outline = [[0.5, 0.3], [0.6 + lean, 0.3], [0.6, 0.8], [0.5 + lean, 0.8]];
    let second = add(&mut faces, &outline, other);
    for strips in STRIPS {
        let seen = seen(&faces, strips);
        for (face, expected) in [(first, 0.15 - 0.04), (second, 0.05), (backdrop, 0.9 - 0.16)] {
            let area = area(&faces, &seen.opaque, face);
            assert!(
                (area - expected).abs() <= 1e-14,
                "{face:?} has {area}, not {expected}, with {strips} strips"
            );
        }
    }
}

#[test]
fn a_side_too_short_to_be_divided_keeps_its_corners() {
    // The backdrop shows through a slit, the end of which is an edge on the middle H-scanline.
    let slit = 5e-13;
    let mut faces = Faces::new();
    let [far, near] = [1.0, 2.0].map(|nearness| level(&mut faces, nearness));
    let backdrop = rectangle(&mut faces, [0.0, 0.0], [1.0, 1.0], far);
    rectangle(&mut faces, [0.25, 0.25], [0.75, 0.5], near);
    rectangle(&mut faces, [0.25, 0.5], [0.5, 1.0], near);
    rectangle(&mut faces, [0.5 + slit, 0.5], [0.75, 1.0], near);
    assert_areas(&faces, &[(backdrop, 1.0 - 0.375 + 0.5 * slit)]);
}

#[test]
#[should_panic(expected = "at least one strip")]
fn zero_strips_are_refused() {
    seen(&Faces::new(), 0);
}
