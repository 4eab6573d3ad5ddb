use super::*;

/// Cuts a polygon, and checks that its parts are convex, wound like it, and add up to it.
fn parts_of(rings: &[Vec<DVec3>], texcoords: &[Vec2], rounding: f64) -> Vec<Vec<usize>> {
    let (points, ring_ends) = joined(rings);
    let polygon = Polygon {
        points: &points,
        ring_ends: &ring_ends,
        texcoords,
        rounding,
    };
    let mut parts: Vec<Vec<usize>> = Vec::new();
    let cut = PolygonCutter::new().cut(&polygon, |part| parts.push(part.to_vec()));
    assert_eq!(cut, Cut::Sound, "{rings:?}");
    let outline = vector_area(&rings[0]);
    let holes: f64 = rings[1..].iter().map(|r| vector_area(r).length()).sum();
    let mut sum = 0.0;
    for part in &parts {
        let corners: Vec<DVec3> = part.iter().map(|&k| points[k]).collect();
        let area = vector_area(&corners);
        // Corners on a line, but for rounding, may give a part without area.
        let facing = area.dot(outline.normalize());
        assert!(
            facing > -1e-12 * outline.length(),
            "{part:?} is turned over"
        );
        assert_convex(&corners, outline.normalize());
        sum += area.length();
    }
    // Convex parts of the right sign that add up to the whole do not overlap.
    let whole = outline.length() - holes;
    assert!((sum - whole).abs() <= 1e-9 * whole, "{sum} is not {whole}");
    parts
}

fn joined(rings: &[Vec<DVec3>]) -> (Vec<DVec3>, Vec<usize>) {
    let ends = rings.iter().scan(0, |end, ring| {
        *end += ring.len();
        Some(*end)
    });
    (rings.concat(), ends.collect())
}

fn vector_area(corners: &[DVec3]) -> DVec3 {
    let edges = corners.windows(2);
    let twice: DVec3 = edges
        .map(|e| (e[0] - corners[0]).cross(e[1] - corners[0]))
        .sum();
    0.5 * twice
}

fn assert_convex(corners: &[DVec3], normal: DVec3) {
    let n = corners.len();
    let extent = (0..n).fold(0.0_f64, |e, k| e.max((corners[k] - corners[0]).length()));
    for k in 0..n {
        let [p, q, r] = [k, k + 1, k + 2].map(|k| corners[k % n]);
        let turn = (q - p).cross(r - q).dot(normal);
        assert!(
            turn >= -1e-9 * extent * extent,
            "{corners:?} turns right at {q}"
        );
    }
}

fn flat(points: &[(f64, f64)]) -> Vec<DVec3> {
    points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect()
}

fn square(x: f64, y: f64, side: f64) -> Vec<DVec3> {
    flat(&[(x, y), (x + side, y), (x + side, y + side), (x, y + side)])
}

/// On tilted planes, in all orders of coordinates, turned over, and far away.
fn poses(rings: &[Vec<DVec3>]) -> Vec<Vec<Vec<DVec3>>> {
    let mut poses = Vec::new();
    for shift in 0..3 {
        for far in [DVec3::ZERO, DVec3::new(84_616.0, 447_423.0, 16.0)] {
            for turned in [false, true] {
                let place = |p: &DVec3| {
                    // Slopes of a few bits keep the corners exactly in one plane.
                    let p = [p.x, p.y, 0.25 * p.x - 0.5 * p.y];
                    DVec3::new(p[shift % 3], p[(shift + 1) % 3], p[(shift + 2) % 3]) + far
                };
                let pose = rings.iter().map(|ring| {
                    let mut ring: Vec<DVec3> = ring.iter().map(place).collect();
                    if turned {
                        ring.reverse();
                    }
                    ring
                });
                poses.push(pose.collect());
            }
        }
    }
    poses
}

/// Checks all poses; the number of parts in each.
fn count_of_parts(rings: &[Vec<DVec3>]) -> Vec<usize> {
    let poses = poses(rings);
    poses
        .iter()
        .map(|rings| parts_of(rings, &[], 1e-6).len())
        .collect()
}

#[test]
fn convex_polygons_stay_whole() {
    let hexagon: Vec<(f64, f64)> = vec![
        (0.0, 0.0),
        (1.0, 0.0),
        // Straight on.
        (2.0, 0.0),
        (3.0, 1.0),
        (2.0, 3.0),
        (0.0, 2.0),
    ];
    assert_eq!(count_of_parts(&[flat(&hexagon)]), [1; 12]);
}

#[test]
fn concave_polygons_become_few_parts() {
    // A dart, an L, a comb of three teeth.
    for (shape, most) in [
        (flat(&[(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (1.0, 1.0)]), 2),
        (
            flat(&[
                (0.0, 0.0),
                (2.0, 0.0),
                (2.0, 1.0),
                (1.0, 1.0),
                (1.0, 2.0),
                (0.0, 2.0),
            ]),
            2,
        ),
        (
            flat(&[
                (0.0, 0.0),
                (5.0, 0.0),
                (5.0, 2.0),
                (4.0, 0.5),
                (3.0, 2.0),
                (2.0, 0.5),
                (1.0, 2.0),
            ]),
            4,
        ),
    ] {
        for shift in 0..shape.len() {
            let mut shape = shape.clone();
            shape.rotate_left(shift);
            let counts = count_of_parts(&[shape.clone()]);
            assert!(
                counts.iter().all(|&c| c <= most),
                "{counts:?} for {shape:?}"
            );
        }
    }
}

#[test]
fn holes_stay_open_however_they_are_wound() {
    let outline = square(0.0, 0.0, 10.0);
    let mut other_way = square(6.0, 6.0, 2.0);
    other_way.reverse();
    let counts = count_of_parts(&[
        outline,
        square(1.0, 1.0, 2.0),
        other_way,
        square(6.0, 1.0, 3.0),
    ]);
    assert!(counts.iter().all(|&count| count <= 12), "{counts:?}");
}

#[test]
fn holes_may_touch_corners_sides_and_one_another() {
    let outline = || square(0.0, 0.0, 8.0);
    // A diamond with a corner on the outline's left side, another on a corner of the outline.
    let diamond = |x: f64, y: f64, r: f64| flat(&[(x - r, y), (x, y - r), (x + r, y), (x, y + r)]);
    count_of_parts(&[outline(), diamond(2.0, 4.0, 2.0)]);
    count_of_parts(&[outline(), diamond(2.0, 4.0, 2.0), diamond(6.0, 4.0, 2.0)]);
    count_of_parts(&[outline(), diamond(4.0, 2.0, 2.0), diamond(4.0, 6.0, 2.0)]);
    count_of_parts(&[outline(), flat(&[(0.0, 0.0), (3.0, 1.0), (1.0, 3.0)])]);
    // A hole whose corner lies on the side of another hole.
    count_of_parts(&[outline(), square(1.0, 1.0, 2.0), diamond(4.0, 2.0, 1.0)]);
    // Touching all four sides.
    count_of_parts(&[outline(), diamond(4.0, 4.0, 4.0)]);
}

#[test]
fn bridges_spikes_and_repeated_corners_are_harmless() {
    let bridged = flat(&[
        (0.0, 0.0),
        (3.0, 0.0),
        (3.0, 3.0),
        (0.0, 3.0),
        (0.0, 0.0),
        (1.0, 1.0),
        (1.0, 2.0),
        (2.0, 2.0),
        (2.0, 1.0),
        (1.0, 1.0),
    ]);
    let sum: f64 = {
        let mut sum = 0.0;
        let polygon = Polygon {
            points: &bridged,
            ring_ends: &[10],
            texcoords: &[],
            rounding: 1e-9,
        };
        let cut = PolygonCutter::new().cut(&polygon, |part| {
            let corners: Vec<DVec3> = part.iter().map(|&k| bridged[k]).collect();
            sum += vector_area(&corners).z;
        });
        assert_eq!(cut, Cut::Sound);
        sum
    };
    assert_eq!(sum, 8.0);
    let spiked = flat(&[
        (0.0, 0.0),
        (0.0, 0.0),
        (2.0, 0.0),
        (5.0, 0.0),
        (2.0, 0.0),
        (2.0, 2.0),
        (2.0, 2.0),
        (0.0, 2.0),
        (0.0, 0.0),
    ]);
    assert_eq!(count_of_parts(&[spiked]), [1; 12]);
    // Two squares that touch at a corner, as one ring.
    let pinched = flat(&[
        (0.0, 0.0),
        (1.0, 0.0),
        (1.0, 1.0),
        (2.0, 1.0),
        (2.0, 2.0),
        (1.0, 2.0),
        (1.0, 1.0),
        (0.0, 1.0),
    ]);
    assert_eq!(count_of_parts(&[pinched]), [2; 12]);
}

#[test]
fn bent_polygons_become_triangles() {
    let mut bent = square(0.0, 0.0, 1.0);
    bent[2].z = 1e-3;
    let parts = parts_of_bent(&bent, 1e-4);
    assert_eq!(parts, [vec![0, 1, 2], vec![0, 2, 3]]);
    assert_eq!(parts_of_bent(&bent, 1e-2).len(), 1, "within rounding");
}

fn parts_of_bent(points: &[DVec3], rounding: f64) -> Vec<Vec<usize>> {
    let polygon = Polygon {
        points,
        ring_ends: &[points.len()],
        texcoords: &[],
        rounding,
    };
    let mut parts = Vec::new();
    PolygonCutter::new().cut(&polygon, |part| parts.push(part.to_vec()));
    parts
}

#[test]
fn a_texture_that_goes_unevenly_cuts_a_polygon() {
    let points = flat(&[(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]);
    let even: Vec<Vec2> = points
        .iter()
        .map(|p| Vec2::new(0.3 + 0.5 * p.x as f32, 0.7 * p.x as f32 - p.y as f32))
        .collect();
    assert_eq!(
        parts_of(std::slice::from_ref(&points), &even, 1e-9).len(),
        1
    );
    let mut uneven = even;
    uneven[3].x += 0.01;
    assert_eq!(parts_of(&[points], &uneven, 1e-9).len(), 2);
}

/// Numbers that repeat in every run (Knuth's multiplier).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A star around a point, as stars are drawn on millimetre paper.
fn star(random: &mut Random, n: usize, center: (f64, f64), least: f64, most: f64) -> Vec<DVec3> {
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / n as f64;
        let radius = least + (most - least) * random.unit();
        let at = [
            center.0 + radius * angle.cos(),
            center.1 + radius * angle.sin(),
        ];
        let [x, y] = at.map(|c| (c * 1024.0).round() / 1024.0);
        DVec3::new(x, y, 0.0)
    };
    (0..n).map(corner).collect()
}

#[test]
fn random_stars_with_stars_as_holes_are_covered_once() {
    for seed in 0..60 {
        let mut random = Random(seed);
        let n = 5 + seed as usize;
        let mut rings = vec![star(&mut random, n, (0.0, 0.0), 10.0, 20.0)];
        for k in 0..seed % 5 {
            let angle = k as f64 * 1.2566;
            let center = (4.0 * angle.cos(), 4.0 * angle.sin());
            rings.push(star(&mut random, 3 + n / 4, center, 0.5, 1.5));
        }
        count_of_parts(&rings);
    }
}

#[test]
fn a_hole_a_millimetre_outside_is_taken_to_touch() {
    // On paper the hole touches the slanted side; in whole millimetres it sticks out of it.
    let outline = flat(&[(0.0, 0.0), (9.001, 0.0), (9.001, 7.001), (3.0, 10.003)]);
    let sticks_out = flat(&[(0.6, 2.001), (3.0, 2.0), (3.0, 4.0)]);
    let (points, ring_ends) = joined(&[outline, sticks_out]);
    let polygon = Polygon {
        points: &points,
        ring_ends: &ring_ends,
        texcoords: &[],
        rounding: 2e-3,
    };
    let mut sum = 0.0;
    let cut = PolygonCutter::new().cut(&polygon, |part| {
        let corners: Vec<DVec3> = part.iter().map(|&k| points[k]).collect();
        assert!(vector_area(&corners).z > 0.0);
        sum += vector_area(&corners).z;
    });
    assert_eq!(cut, Cut::Sound);
    let whole = vector_area(&points[..4]).z - vector_area(&points[4..]).length();
    assert!((sum - whole).abs() < 0.05, "{sum} is not {whole}");
}

#[test]
fn what_has_no_area_has_no_faces_and_what_crosses_itself_is_told() {
    let cut = |points: &[DVec3]| {
        let polygon = Polygon {
            points,
            ring_ends: &[points.len()],
            texcoords: &[],
            rounding: 1e-6,
        };
        let mut count = 0;
        let cut = PolygonCutter::new().cut(&polygon, |_| count += 1);
        (cut, count)
    };
    assert_eq!(cut(&[DVec3::ONE; 6]), (Cut::NoArea, 0));
    assert_eq!(cut(&[]), (Cut::NoArea, 0));
    let line = flat(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (1.0, 0.0)]);
    assert_eq!(cut(&line), (Cut::NoArea, 0));
    let bow = flat(&[(0.0, 0.0), (3.0, 3.0), (3.0, 0.0), (0.0, 2.0), (-1.0, 1.0)]);
    let (cut, count) = cut(&bow);
    assert!(cut == Cut::Crossing && count > 0);
}

#[test]
fn a_star_that_turns_left_everywhere_is_not_convex() {
    let pentagram: Vec<DVec3> = (0..5)
        .map(|k| {
            let angle = std::f64::consts::TAU * 2.0 * f64::from(k) / 5.0;
            DVec3::new(angle.cos(), angle.sin(), 0.0)
        })
        .collect();
    let polygon = Polygon {
        points: &pentagram,
        ring_ends: &[5],
        texcoords: &[],
        rounding: 1e-6,
    };
    let mut most = 0;
    PolygonCutter::new().cut(&polygon, |part| most = most.max(part.len()));
    assert_eq!(most, 3);
}

#[test]
fn intricate_polygons_end_in_time() {
    // A comb of many teeth, and a sieve.
    let teeth = 3000;
    let mut outline = vec![DVec3::ZERO, DVec3::new(f64::from(teeth), 0.0, 0.0)];
    for k in (0..2 * teeth).rev() {
        let height = if k % 2 == 0 {
            10.0
        } else {
            1.0 + 0.001 * f64::from(k)
        };
        outline.push(DVec3::new(0.5 * f64::from(k), height, 0.0));
    }
    let start = std::time::Instant::now();
    let parts = parts_of(&[outline], &[], 1e-9);
    assert!(parts.len() > teeth as usize);
    let holes = (0..900).map(|k| {
        let (i, j) = (f64::from(k % 30), f64::from(k / 30));
        flat(&[(i, j), (i + 0.5, j + 0.1), (i + 0.4, j + 0.6)])
    });
    let sieve: Vec<_> = std::iter::once(square(-1.0, -1.0, 32.0))
        .chain(holes)
        .collect();
    assert!(parts_of(&sieve, &[], 1e-9).len() > 900);
    assert!(start.elapsed().as_secs() < 30);
}
