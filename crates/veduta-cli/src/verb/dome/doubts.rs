//! What may be wrong with views: sides of odd sizes, sides that do not fit together, and what none shows.

use super::source::Frame;
use veduta::accumulate::Picture;
use veduta::reproject::Lens;
use veduta::reproject::cube::{Side, Turn};
use veduta_io::sphere::{Change, View, fit};

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
    let one = |change: &Change| {
        let Change { place, from, turn } = change;
        match (place == from, turn.to_string()) {
            (true, turn) => format!("{place} were {turn}"),
            (false, turn) if turn.is_empty() => format!("{place} were the picture of {from}"),
            (false, turn) => format!("{place} were the picture of {from}, {turn}"),
        }
    };
    let mut words = changes.iter().map(one).collect::<Vec<_>>().join(", ");
    // Two that face each other, exchanged.
    if let [a, b] = changes
        && a.turn == Turn::NONE
        && b.turn == Turn::NONE
    {
        words += ", or if all six were mirrored";
    }
    words
}

/// Less than this share of a picture is the rim of a lens.
const LEAST_SHARE: f64 = 0.0005;

/// What pictures show that no view shows, and its share of them; `found` by names of sides of a cube.
pub fn missing(views: &[View], found: Vec<(&str, f64)>) -> Vec<(String, f64)> {
    let are_sides = views.iter().all(|view| view.side.is_some());
    let what = |name: &str| {
        let is_there = views.iter().any(|view| view.name == name);
        match are_sides && !is_there {
            true => format!("the side {name}"),
            false => format!("all that is {}", place(name)),
        }
    };
    let found = found.into_iter().filter(|(_, share)| *share > LEAST_SHARE);
    found.map(|(name, share)| (what(name), share)).collect()
}

/// Where a side is, in words.
fn place(name: &str) -> &'static str {
    match name {
        "front" => "in front",
        "right" => "to the right",
        "back" => "behind",
        "left" => "to the left",
        "up" => "above",
        _ => "below",
    }
}
