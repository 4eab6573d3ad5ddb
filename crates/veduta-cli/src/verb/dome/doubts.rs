//! What may be wrong with views: sides of odd sizes, sides that do not fit together, and what none shows.

use super::source::Frame;
use veduta::accumulate::Picture;
use veduta::geometry::{DVec2, DVec3};
use veduta::reproject::{Lens, Projection};
use veduta_io::sphere::{Change, Side, View, fit};

/// Sentences about what seems wrong with the views of a frame.
pub fn of(views: &[View], frame: &Frame) -> Vec<String> {
    let mut doubts = Vec::new();
    let sides: Vec<&View> = views.iter().filter(|view| view.side.is_some()).collect();
    let Some(first) = sides.first() else {
        return doubts;
    };
    let size = |view: &View| view.projection.width;
    if let Some(other) = sides.iter().find(|view| size(view) != size(first)) {
        doubts.push(format!(
            "the sides have different sizes: {} has {} pixels, {} has {}",
            first.name,
            size(first),
            other.name,
            size(other)
        ));
    }
    if size(first) == 1 {
        doubts.push(format!("the side {} has a single pixel", first.name));
    }
    doubts.extend(misfit(&sides, frame));
    doubts
}

/// Whether six sides of 90 degrees fit together.
fn misfit(sides: &[&View], frame: &Frame) -> Option<String> {
    let quarter = Lens::Perspective {
        fov: std::f64::consts::FRAC_PI_2,
    };
    let mut pictures: Vec<Picture> = Vec::with_capacity(6);
    for side in Side::ALL {
        let view = sides.iter().find(|view| view.side == Some(side))?;
        if ![quarter, Lens::Equiangular].contains(&view.projection.lens) {
            return None;
        }
        pictures.push(frame.picture(view));
    }
    let pictures: [&Picture; 6] = std::array::from_fn(|k| &pictures[k]);
    if pictures.iter().any(|side| side.width != pictures[0].width) {
        return None;
    }
    let found = fit(&pictures);
    if !found.is_bad() {
        return None;
    }
    let (a, b, _) = found.worst;
    let mend = match &found.better {
        None => "and in no other way to lay them out they would".to_owned(),
        Some(changes) => format!("they would fit if {}", in_words(changes)),
    };
    Some(format!(
        "the sides do not fit together, {a} and {b} least; {mend}"
    ))
}

/// What to change, in words.
fn in_words(changes: &[Change]) -> String {
    if changes.len() == 6 && changes.iter().all(|change| change.turn.mirrored) {
        return "all were mirrored and front and back, or left and right, exchanged: --handedness right".into();
    }
    let one = |change: &Change| {
        let Change { place, from, turn } = change;
        match (place == from, turn.to_string()) {
            (true, turn) => format!("{place} were {turn}"),
            (false, turn) if turn.is_empty() => format!("{place} were the picture of {from}"),
            (false, turn) => format!("{place} were the picture of {from}, {turn}"),
        }
    };
    changes.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Points along a side of a picture at which it is asked what is seen there: a hundredth of a percent of a
/// picture is not told.
const SAMPLES: u32 = 256;
/// Less than this share of a picture is a rim.
const LEAST_SHARE: f64 = 0.0005;

/// What pictures show that no view shows, and its share of them: by sides of a cube.
pub fn missing(views: &[View], targets: &[Projection]) -> Vec<(String, f64)> {
    let mut counts = [0_u32; 6];
    let mut all = 0_u32;
    for target in targets {
        let size = DVec2::new(f64::from(target.width), f64::from(target.height));
        let step = size / f64::from(SAMPLES);
        for k in 0..SAMPLES * SAMPLES {
            let at = DVec2::new(f64::from(k % SAMPLES) + 0.5, f64::from(k / SAMPLES) + 0.5) * step;
            if !target.covers(at) {
                continue;
            }
            let Some(direction) = target.direction(at) else {
                continue;
            };
            all += 1;
            if !views.iter().any(|view| shows(&view.projection, direction)) {
                counts[side_of(direction).index()] += 1;
            }
        }
    }
    let share = |side: Side| f64::from(counts[side.index()]) / f64::from(all.max(1));
    let are_sides = views.iter().all(|view| view.side.is_some());
    let missing = Side::ALL
        .into_iter()
        .filter(|&side| share(side) > LEAST_SHARE);
    let what = |side: Side| {
        let is_there = views.iter().any(|view| view.side == Some(side));
        match are_sides && !is_there {
            true => format!("the side {side}"),
            false => format!("all that is {}", place(side)),
        }
    };
    missing.map(|side| (what(side), share(side))).collect()
}

/// Where a side is, in words.
fn place(side: Side) -> &'static str {
    match side {
        Side::Front => "in front",
        Side::Right => "to the right",
        Side::Back => "behind",
        Side::Left => "to the left",
        Side::Up => "above",
        Side::Down => "below",
    }
}

/// Whether a view shows a direction, its last half pixel counted generously.
fn shows(view: &Projection, direction: DVec3) -> bool {
    let Some(image) = view.image(direction) else {
        return false;
    };
    let size = DVec2::new(f64::from(view.width), f64::from(view.height));
    let inside = image.cmpge(DVec2::splat(-1.0)).all() && image.cmple(size + 1.0).all();
    inside
        && view
            .lens
            .covers(view.lens_from_image(image.clamp(DVec2::ZERO, size)))
}

/// The side of a cube that a direction goes through.
fn side_of(direction: DVec3) -> Side {
    let [x, y, z] = direction.to_array();
    let most = direction.abs().max_element();
    match () {
        () if -z == most => Side::Front,
        () if z == most => Side::Back,
        () if x == most => Side::Right,
        () if -x == most => Side::Left,
        () if y == most => Side::Up,
        () => Side::Down,
    }
}
