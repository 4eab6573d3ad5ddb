//! Keys: where a layer or a camera is at some times -> where it is at any.
//!
//! Each word of the keys (translate, rotate, scale; eye, look_at) goes its own way over the keys that
//! name it. Before the first and after the last of them it stays as it is there; a word that no key
//! names stays as it is without keys.

use super::document::{CameraKey, Layer, Placement, PlacementKey, Rotation};
use super::form::{Given, List};
use super::source::Faults;
use super::value::{Interpolation, Time};
use crate::read::error::Problem;
use veduta::geometry::{DMat4, DQuat, DVec3};

/// What moves a layer.
#[derive(Debug)]
pub struct LayerKeys {
    translate: Track<DVec3>,
    rotate: Track<Turn>,
    scale: Track<DVec3>,
    interpolation: Interpolation,
    /// Whether it begins again after `end`.
    repeats: bool,
    /// When the last key is, in seconds.
    pub end: f64,
}

/// What moves a camera.
#[derive(Debug)]
pub struct CameraKeys {
    eye: Track<DVec3>,
    look_at: Track<DVec3>,
    interpolation: Interpolation,
    /// When the last key is, in seconds.
    pub end: f64,
}

/// The values that keys give to one word, ascending in time, which is in seconds.
#[derive(Debug)]
struct Track<T>(Vec<(f64, T)>);

/// A turn by an angle about an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turn {
    axis: DVec3,
    /// Radians.
    angle: f64,
}

/// A value that lies between two others.
trait Between: Copy {
    /// `self` where `share` is 0, `to` where it is 1.
    fn between(self, to: Self, share: f64) -> Self;
}

impl Between for DVec3 {
    fn between(self, to: Self, share: f64) -> Self {
        self.lerp(to, share)
    }
}

impl Between for Turn {
    /// About one axis the angle goes evenly, by any number of turns; else the shortest way leads from
    /// one to the other.
    fn between(self, to: Self, share: f64) -> Self {
        if self.axis == to.axis {
            let angle = self.angle + share * (to.angle - self.angle);
            return Self { angle, ..self };
        }
        let (axis, angle) = self
            .quaternion()
            .slerp(to.quaternion(), share)
            .to_axis_angle();
        Self { axis, angle }
    }
}

impl Turn {
    fn of(rotation: &Rotation) -> Self {
        Self {
            axis: rotation.axis.value.0,
            angle: rotation.angle.value.0,
        }
    }

    fn quaternion(self) -> DQuat {
        DQuat::from_axis_angle(self.axis, self.angle)
    }
}

impl<T: Between> Track<T> {
    /// The value at a time; `None` if no key gives one.
    fn at(&self, seconds: f64, interpolation: Interpolation) -> Option<T> {
        let next = self.0.partition_point(|key| key.0 <= seconds);
        let Some(&(start, before)) = next.checked_sub(1).map(|index| &self.0[index]) else {
            return self.0.first().map(|first| first.1);
        };
        let Some(&(end, after)) = self.0.get(next) else {
            return Some(before);
        };
        let share = (seconds - start) / (end - start);
        Some(match interpolation {
            Interpolation::Step => before,
            Interpolation::Linear => before.between(after, share),
            Interpolation::Ease => before.between(after, share * share * (3.0 - 2.0 * share)),
        })
    }
}

impl LayerKeys {
    /// The keys of a layer, if it has some that are sound.
    pub fn of(layer: &Layer, frames_per_second: f64, faults: &mut Faults) -> Option<Self> {
        let keys = layer.keys.as_ref()?;
        if let Some(matrix) = layer.at.as_ref().and_then(|at| at.value.matrix.as_ref()) {
            let message = "a layer that has keys is placed by translate, rotate and scale, which can \
                go from one key to the next; a matrix cannot";
            faults.senseless(matrix.span.clone(), message);
        }
        let times = times(&keys.value, |key| &key.time, frames_per_second, faults);
        let mut track = Self {
            translate: Track(Vec::new()),
            rotate: Track(Vec::new()),
            scale: Track(Vec::new()),
            interpolation: layer
                .interpolation
                .as_ref()
                .map_or_else(Interpolation::default, |i| i.value),
            repeats: layer.repeat.as_ref().is_some_and(|repeat| repeat.value.0),
            end: times.last().copied().unwrap_or(0.0),
        };
        for (key, &time) in keys.value.0.iter().zip(&times) {
            let PlacementKey {
                time: _,
                translate,
                rotate,
                scale,
            } = &key.value;
            if translate.is_none() && rotate.is_none() && scale.is_none() {
                let message = "a key says where the layer is: it has translate, rotate or scale";
                faults.senseless(key.span.clone(), message);
            }
            track
                .translate
                .0
                .extend(translate.as_ref().map(|by| (time, by.value.0)));
            track
                .rotate
                .0
                .extend(rotate.as_ref().map(|turn| (time, Turn::of(&turn.value))));
            if let Some(scale) = scale {
                let before = track.scale.0.last().map(|before: &(f64, DVec3)| before.1);
                if before.is_some_and(|before| (before * scale.value.0).min_element() < 0.0) {
                    let message = "between this key and the one before the scale would go through 0, \
                        which leaves nothing of the layer; mirror it in both or in none";
                    faults.senseless(scale.span.clone(), message);
                }
                track.scale.0.push((time, scale.value.0));
            }
        }
        if track.repeats && track.end == 0.0 {
            let message = "what repeats needs a key after 0 s, at which it begins again";
            faults.senseless(keys.span.clone(), message);
            return None;
        }
        Some(track)
    }

    /// Where the layer's model stands at a time, if it stands `at` that place but for the keys.
    pub fn world_from_model(&self, at: Option<&Placement>, seconds: f64) -> DMat4 {
        let seconds = if self.repeats {
            seconds.rem_euclid(self.end)
        } else {
            seconds
        };
        let rest = at.map_or(Parts::default(), Parts::of);
        let moved = Parts {
            translate: self
                .translate
                .at(seconds, self.interpolation)
                .or(rest.translate),
            rotate: self.rotate.at(seconds, self.interpolation).or(rest.rotate),
            scale: self.scale.at(seconds, self.interpolation).or(rest.scale),
        };
        moved.world_from_model()
    }
}

/// What a placement is made of.
#[derive(Default)]
struct Parts {
    translate: Option<DVec3>,
    rotate: Option<Turn>,
    scale: Option<DVec3>,
}

impl Parts {
    fn of(at: &Placement) -> Self {
        Self {
            translate: at.translate.as_ref().map(|by| by.value.0),
            rotate: at.rotate.as_ref().map(|turn| Turn::of(&turn.value)),
            scale: at.scale.as_ref().map(|scale| scale.value.0),
        }
    }

    /// Scale, then rotation, then translation.
    fn world_from_model(&self) -> DMat4 {
        DMat4::from_scale_rotation_translation(
            self.scale.unwrap_or(DVec3::ONE),
            self.rotate.map_or(DQuat::IDENTITY, Turn::quaternion),
            self.translate.unwrap_or(DVec3::ZERO),
        )
    }
}

/// Where a layer's model stands that has no keys.
pub fn world_from_model(at: &Placement) -> DMat4 {
    match &at.matrix {
        Some(matrix) => matrix.value.0,
        None => Parts::of(at).world_from_model(),
    }
}

impl CameraKeys {
    /// The keys of a camera that are sound.
    pub fn of(
        keys: &List<CameraKey>,
        interpolation: Interpolation,
        frames_per_second: f64,
        faults: &mut Faults,
    ) -> Self {
        let times = times(keys, |key| &key.time, frames_per_second, faults);
        let mut track = Self {
            eye: Track(Vec::new()),
            look_at: Track(Vec::new()),
            interpolation,
            end: times.last().copied().unwrap_or(0.0),
        };
        for (key, &time) in keys.0.iter().zip(&times) {
            let CameraKey {
                time: _,
                eye,
                look_at,
            } = &key.value;
            if eye.is_none() && look_at.is_none() {
                let message = "a key says where the camera is: it has eye or look_at";
                faults.senseless(key.span.clone(), message);
            }
            track
                .eye
                .0
                .extend(eye.as_ref().map(|eye| (time, eye.value.0)));
            track
                .look_at
                .0
                .extend(look_at.as_ref().map(|at| (time, at.value.0)));
        }
        track
    }

    /// Where the eye stands at a time; `None` if no key says so.
    pub fn eye(&self, seconds: f64) -> Option<DVec3> {
        self.eye.at(seconds, self.interpolation)
    }

    /// What the camera looks at at a time; `None` if no key says so.
    pub fn look_at(&self, seconds: f64) -> Option<DVec3> {
        self.look_at.at(seconds, self.interpolation)
    }
}

/// The times of keys in seconds, which must ascend.
fn times<T>(
    keys: &List<T>,
    time_of: impl Fn(&T) -> &Given<Time>,
    frames_per_second: f64,
    faults: &mut Faults,
) -> Vec<f64> {
    let mut times: Vec<f64> = Vec::with_capacity(keys.0.len());
    for key in &keys.0 {
        let time = time_of(&key.value);
        let seconds = time.value.seconds(frames_per_second);
        if let Some(&before) = times.last()
            && seconds <= before
        {
            let message = format!(
                "keys stand in the order of their times: this one is at {seconds} s, the one before \
                 at {before} s"
            );
            faults.add(time.span.clone(), Problem::Senseless(message));
        }
        times.push(seconds);
    }
    times
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn values_go_evenly_by_steps_or_gently() {
        let track = Track(vec![(1.0, DVec3::ZERO), (3.0, DVec3::X), (4.0, DVec3::Y)]);
        let x = |seconds, interpolation| track.at(seconds, interpolation).expect("has keys").x;
        for (seconds, step, linear, ease) in [
            (0.0, 0.0, 0.0, 0.0),
            (1.0, 0.0, 0.0, 0.0),
            (1.5, 0.0, 0.25, 0.15625),
            (2.0, 0.0, 0.5, 0.5),
            (3.0, 1.0, 1.0, 1.0),
            (9.0, 0.0, 0.0, 0.0),
        ] {
            assert_eq!(x(seconds, Interpolation::Step), step, "{seconds}");
            assert_eq!(x(seconds, Interpolation::Linear), linear, "{seconds}");
            assert_eq!(x(seconds, Interpolation::Ease), ease, "{seconds}");
        }
        assert!(
            Track::<DVec3>(Vec::new())
                .at(1.0, Interpolation::Step)
                .is_none()
        );
    }

    #[test]
    fn turns_about_one_axis_may_be_whole_and_others_take_the_shortest_way() {
        let turn = |axis, angle| Turn { axis, angle };
        let half = turn(DVec3::Z, 0.0).between(turn(DVec3::Z, 4.0 * PI), 0.25);
        assert!((half.angle - PI).abs() < 1e-15, "{half:?}");
        let quarter = turn(DVec3::X, 0.0).between(turn(DVec3::Z, 0.5 * PI), 0.5);
        let expected = DQuat::from_rotation_z(0.25 * PI);
        assert!(quarter.quaternion().angle_between(expected) < 1e-7);
    }
}
