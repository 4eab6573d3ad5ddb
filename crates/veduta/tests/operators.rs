//! Operators on stored maps, and maps with holes: what was cut out hides nothing any more.

use veduta::composite::{Operator, composite, lay_on, operate};
use veduta::dice::PixelGrid;
use veduta::geometry::DVec2;
use veduta::map::{FaceId, SeenScene, VisibilityMap};
use veduta::pipeline::{find_visibility, render_window};
use veduta::scene::Scene;
use veduta::scene::generate::{Generated, by_name};

const SIZE: [u32; 2] = [96, 64];

/// The objects of a scene dealt to maps, in turn.
fn maps(name: &str, count: usize) -> Vec<SeenScene> {
    let Generated { scene, camera, .. } = by_name(name).expect("a scene");
    let camera = camera.with_aspect(1.5);
    (0..count)
        .map(|map| {
            let mut part = scene.clone();
            let mut number = 0..;
            part.objects
                .retain(|_| number.next().unwrap_or(0) % count == map);
            SeenScene::of(&part, &find_visibility(&part, &camera), SIZE)
        })
        .collect()
}

fn picture(seen: &SeenScene) -> Vec<[f32; 4]> {
    seen.map.check().expect("sound");
    let grid = PixelGrid::of_frame(SIZE[0], SIZE[1]);
    render_window(&seen.scene, &seen.map, &grid, false).pixels
}

fn assert_alike(found: &[[f32; 4]], expected: &[[f32; 4]], tolerance: f32, what: &str) {
    for (pixel, (found, expected)) in found.iter().zip(expected).enumerate() {
        for (a, b) in found.iter().zip(expected) {
            assert!(
                (a - b).abs() <= tolerance,
                "{what}, pixel {pixel}: {a} and {b}"
            );
        }
    }
}

/// The name and nearness of what is seen at a point.
fn at(seen: &SeenScene, point: DVec2) -> Option<(&str, f64)> {
    let VisibilityMap { faces, opaque, .. } = &seen.map;
    let face: FaceId = opaque.face(seen.map.opaque_at(point)?);
    let object: &Scene = &seen.scene;
    let name = object.object(faces.object(face)).name.as_str();
    Some((name, faces.face_nearness(face).at(point)))
}

/// Fails if not the same is seen; where coplanar faces share a plane, its last bits may be another's.
fn assert_same(found: Option<(&str, f64)>, expected: Option<(&str, f64)>, what: &str) {
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * a.abs();
    let same = match (found, expected) {
        (Some((a, p)), Some((b, q))) => a == b && near(p, q),
        (a, b) => a.is_none() && b.is_none(),
    };
    assert!(same, "{what}: {found:?} instead of {expected:?}");
}

fn points() -> impl Iterator<Item = DVec2> {
    // Of no pattern that scenes have.
    let golden = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);
    (1..4000).map(move |k| (f64::from(k) * golden).fract())
}

#[test]
fn what_is_in_and_what_is_out_of_a_map_composite_to_it() {
    for name in ["pierce", "balls3", "buildings"] {
        let maps = maps(name, 2);
        let [own, other] = [&maps[0], &maps[1]];
        let others = std::slice::from_ref(other);
        let part = |operator| operate(own, operator, others).expect("of one camera");
        let [inside, outside] = [Operator::In, Operator::Out].map(part);
        assert!(inside.has_holes && outside.has_holes);
        let both = composite(&[inside, outside]).expect("of one camera");
        // Normals and textures are looked up once more often where faces are cut.
        assert_alike(&picture(&both), &picture(own), 1e-4, name);
    }
}

#[test]
fn operators_show_at_each_point_what_porter_and_duff_say() {
    for name in ["pierce", "balls3", "buildings"] {
        let maps = maps(name, 2);
        let [own, other] = [&maps[0], &maps[1]];
        for operator in [Operator::In, Operator::Out, Operator::Atop] {
            let found = operate(own, operator, &maps[1..]).expect("of one camera");
            found.map.check().expect("sound");
            for point in points() {
                let [a, b] = [at(own, point), at(other, point)];
                let expected = match operator {
                    Operator::In => b.and(a),
                    Operator::Out => a.filter(|_| b.is_none()),
                    Operator::Atop => b.and(a.or(b)),
                };
                assert_same(
                    at(&found, point),
                    expected,
                    &format!("{name}, {operator:?}, {point}"),
                );
            }
        }
        let behind = lay_on(own, other).expect("of one camera");
        for point in points() {
            let expected = at(own, point).or(at(other, point));
            assert_same(at(&behind, point), expected, &format!("{name}, {point}"));
        }
    }
}

#[test]
fn what_was_cut_out_of_a_map_hides_nothing() {
    let mut cut_something = 0;
    for name in ["pierce", "balls3", "balls7", "buildings"] {
        let maps = maps(name, 3);
        let out = operate(&maps[0], Operator::Out, &maps[1..2]).expect("of one camera");
        for order in [[&out, &maps[2]], [&maps[2], &out]] {
            let found = composite(&order.map(SeenScene::clone)).expect("of one camera");
            found.map.check().expect("sound");
            for point in points() {
                let near = at(&out, point).into_iter().chain(at(&maps[2], point));
                let expected = near.max_by(|a, b| a.1.total_cmp(&b.1));
                assert_same(at(&found, point), expected, &format!("{name}, {point}"));
                // Nearer than what is seen, and gone.
                let gone = at(&maps[0], point).filter(|_| at(&out, point).is_none());
                cut_something += usize::from(gone.zip(expected).is_some_and(|(g, e)| g.1 > e.1));
            }
        }
    }
    assert!(cut_something > 100, "{cut_something}");
}
