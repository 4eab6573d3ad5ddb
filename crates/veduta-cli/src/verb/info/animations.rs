//! What moves in a model or a scene file.

use crate::talk::plain;
use serde_json::{Value, json};
use veduta_io::{Animation, AnimationKind, Loaded};

pub fn as_json(loaded: &Loaded) -> Value {
    let told = loaded.animations.iter().map(|animation| {
        json!({
            "name": animation.name,
            "of": of(animation),
            "seconds": animation.seconds,
        })
    });
    told.collect()
}

/// Whose keys they are.
fn of(animation: &Animation) -> &'static str {
    match animation.kind {
        AnimationKind::Model => "model",
        AnimationKind::Layer => "layer",
        AnimationKind::Camera => "camera",
    }
}

pub fn as_text(loaded: &Loaded) -> String {
    if loaded.animations.is_empty() {
        return String::new();
    }
    let fps = loaded.frames_per_second;
    let count = loaded.animations.len();
    let mut text = format!("  animations {count}, {fps} frames a second\n");
    for animation in &loaded.animations {
        let (name, seconds) = (plain(&animation.name), animation.seconds);
        let frames = seconds * fps;
        text += &format!(
            "    {name}  {}, {seconds:.3} s, {frames:.0} frames\n",
            of(animation)
        );
    }
    text
}
