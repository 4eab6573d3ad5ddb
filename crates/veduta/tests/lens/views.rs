//! Pictures of maps that are kept: any perspective views of one eye.

use crate::panes::scene_of;
use crate::rng::Rng;
use crate::{ASKEW, LENSES, ball_around, eye, lens, panes_around, picture_of, projection, size_of};
use veduta::geometry::{DMat3, DMat4, DVec2, DVec3};
use veduta::map::{self, Camera, SeenScene};
use veduta::pipeline::{self, LensPicture, SeenViews};
use veduta::reproject::Projection;
use veduta::reproject::patches::{View, ViewError};
use veduta::scene::Scene;

/// The picture of what cameras of one eye see, from maps as they are kept.
fn picture_of_cameras(
    scene: &Scene,
    eye: &Camera,
    cameras: &[Camera],
    projection: &Projection,
) -> LensPicture {
    let kept: Vec<SeenScene> = cameras
        .iter()
        .map(|camera| SeenScene::of(scene, &pipeline::find_visibility(scene, camera), [8, 8]))
        .collect();
    let views = kept.iter().map(|seen| {
        let view = View::new(eye, &seen.map.camera).expect("of the same eye");
        SeenViews {
            scene: &seen.scene,
            views: vec![(view, &seen.map)],
        }
    });
    let views: Vec<SeenViews> = views.collect();
    pipeline::render_views(&views, projection, true)
}

/// Cameras of the sides of the cube around an eye.
fn sides_of(scene: &Scene, eye: &Camera) -> Vec<Camera> {
    let found = pipeline::find_all_around(scene, eye, |_| {});
    found
        .sides
        .iter()
        .map(|seen| *seen.part.view.camera())
        .collect()
}

fn most_different(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn maps_that_were_kept_make_the_picture_of_the_scene() {
    let scene = scene_of(&panes_around(&mut Rng::new(11), 90, true));
    let eye = eye(DVec3::new(1.0, 2.0, -0.7), 0.8);
    let sides = sides_of(&scene, &eye);
    for name in LENSES {
        let lens = lens(name);
        let [width, height] = size_of(lens, 40);
        let projection = projection(&eye, lens, ASKEW, width, height);
        let direct = picture_of(&scene, &eye, &projection);
        let kept = picture_of_cameras(&scene, &eye, &sides, &projection);
        // Windows of sides are cut at other places than whole sides.
        let off = most_different(&kept.picture.pixels, &direct.pixels);
        assert!(off < 1e-5, "{name}: off by {off}");
        assert_eq!(kept.unseen, 0.0, "{name}");
    }
}

/// A camera at the origin that looks at a point, with a frame of its own.
fn camera(look_at: DVec3, fov: f64, aspect: f64, shift: DVec2) -> Camera {
    let projection = map::Projection::Perspective {
        tan_half_height: (0.5 * fov).tan(),
        aspect,
    };
    let up = DVec3::new(0.1, 0.2, 1.0);
    let camera = Camera::looking(DVec3::ZERO, look_at, up, projection, 1e-3);
    Camera {
        shift,
        ..camera.expect("a sound camera")
    }
}

#[test]
fn frames_that_overlap_show_each_direction_once_whatever_their_order() {
    let scene = ball_around(&mut Rng::new(12), 9, 13);
    let eye = eye(DVec3::Z, 0.3);
    let cameras = [
        camera(DVec3::new(0.2, 1.0, 0.3), 1.3, 1.4, DVec2::ZERO),
        camera(DVec3::new(0.9, 0.7, 0.1), 1.5, 1.0, DVec2::new(0.2, -0.1)),
        camera(DVec3::new(0.3, 0.8, 0.9), 0.9, 2.0, DVec2::ZERO),
        // Within the first.
        camera(DVec3::new(0.2, 1.0, 0.2), 0.4, 1.0, DVec2::ZERO),
    ];
    let orders = [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]];
    for name in ["domemaster", "equirect", "ball", "perspective:130"] {
        let lens = lens(name);
        let [width, height] = size_of(lens, 50);
        let projection = projection(&eye, lens, ASKEW, width, height);
        let whole = picture_of(&scene, &eye, &projection);
        let made = orders.map(|order| {
            let cameras = order.map(|k| cameras[k]);
            picture_of_cameras(&scene, &eye, &cameras, &projection)
        });
        let mut shown = 0.0;
        for (pixel, expected) in made[0].picture.pixels.iter().zip(&whole.pixels) {
            // All around is full, so that opacity is the share of a pixel that is shown.
            assert!(pixel[3] < 1.0 + 1e-6, "{name}: {pixel:?}");
            shown += f64::from(pixel[3]);
            if pixel[3] > 1.0 - 1e-6 {
                let off = most_different(&[*pixel], &[*expected]);
                assert!(off < 1e-5, "{name}: {pixel:?} and not {expected:?}");
            }
        }
        let all: f64 = whole.pixels.iter().map(|pixel| f64::from(pixel[3])).sum();
        let unseen = made[0].unseen;
        assert!(
            (1.0 - shown / all - unseen).abs() < 1e-6,
            "{name}: {unseen}"
        );
        assert!(unseen > 0.1, "{name}: the views are but a part");
        for other in &made[1..] {
            let off = most_different(&made[0].picture.pixels, &other.picture.pixels);
            assert!(off < 1e-5, "{name}: off by {off}");
            assert!((other.unseen - unseen).abs() < 1e-9, "{name}");
        }
    }
}

#[test]
fn a_map_given_twice_is_shown_once() {
    let scene = ball_around(&mut Rng::new(13), 8, 11);
    let eye = eye(DVec3::Z, 0.0);
    let sides = sides_of(&scene, &eye);
    let projection = projection(&eye, lens("fisheye:200"), ASKEW, 40, 40);
    let once = picture_of_cameras(&scene, &eye, &sides, &projection);
    let twice = [sides.clone(), sides].concat();
    let twice = picture_of_cameras(&scene, &eye, &twice, &projection);
    assert!(once.picture.pixels == twice.picture.pixels);
    assert_eq!([once.unseen, twice.unseen], [0.0; 2]);
}

#[test]
fn views_are_of_one_eye_and_quarters_are_exact() {
    let eye = eye(DVec3::new(0.3, -1.0, 0.2), 0.7);
    let other = Camera {
        eye_from_world: eye.eye_from_world * DMat4::from_translation(DVec3::new(0.0, 0.25, 0.0)),
        ..eye
    };
    let refused = View::new(&eye, &other);
    let Err(ViewError::OtherEye { distance }) = refused else {
        panic!("{refused:?}");
    };
    assert!((distance - 0.25).abs() < 1e-12);
    let parallel = Camera {
        projection: map::Projection::Parallel {
            height: 1.0,
            aspect: 1.0,
        },
        ..eye
    };
    assert_eq!(View::new(&eye, &parallel), Err(ViewError::Parallel));
    // A quarter to the right, with the rounding of sines; it sees what is to the right of the eye's middle ahead.
    let quarter = DMat3::from_rotation_y(-std::f64::consts::FRAC_PI_2);
    let right = Camera {
        eye_from_world: DMat4::from_mat3(quarter) * eye.eye_from_world,
        ..eye
    };
    let view = View::new(&eye, &right).expect("of the same eye");
    assert_eq!(view.homogeneous(DVec3::X), DVec3::new(0.5, 0.5, 1.0));
}
