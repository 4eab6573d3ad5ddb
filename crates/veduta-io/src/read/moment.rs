//! Time in scenes: which moment is shown, and what moves.

/// Frames a second where a scene file tells none: that of film.
pub const USUAL_FRAMES_PER_SECOND: f64 = 24.0;

/// The moment at which a scene is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Moment {
    /// Models stand as their files have them at rest, whatever animations they have; scene files are
    /// as at the beginning.
    #[default]
    Rest,
    /// This many seconds after the beginning.
    Seconds(f64),
    /// At the beginning of a frame, counted from 0, of [`Loaded::frames_per_second`](super::Loaded).
    Frame(u32),
}

impl Moment {
    /// Seconds after the beginning; `None` at rest.
    pub fn seconds(self, frames_per_second: f64) -> Option<f64> {
        match self {
            Moment::Rest => None,
            Moment::Seconds(seconds) => Some(seconds),
            Moment::Frame(frame) => Some(f64::from(frame) / frames_per_second),
        }
    }
}

/// Something that moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// Name of the animation in its model, after those of the layers that show it; or of the layer or
    /// camera that has keys.
    pub name: String,
    /// What moves it.
    pub kind: AnimationKind,
    /// When its last key is, in seconds.
    pub seconds: f64,
}

/// Whose keys move something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnimationKind {
    /// Those of an animation in a model.
    Model,
    /// Those of a layer of a scene file.
    Layer,
    /// Those of a camera of a scene file.
    Camera,
}
