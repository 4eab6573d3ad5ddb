//! The tables of a scene file. What is said here is what the schema says.

use super::form::{Fields, Form, Given, Key, Layout, List, Named, Node, described, table};
use super::source::Faults;
use super::value::{
    Angle, CameraName, Color, Direction, Emission, FieldOfView, FilePath, Flag, FramesPerSecond,
    Interpolation, Length, LensLength, Lod, Matrix, Name, Opacity, PictureSize, Played, Priority,
    Repeat, Scale, Shift, Text, Time, Up, Vector,
};
use crate::read::error::Problem;
use serde_json::{Value, json};
use toml::de::DeValue;
use veduta::scene::Shown;

table! {
    /// A scene of Veduta: models in layers, cameras, and changes to materials.
    /// World axes: x to the east, y to the north, z up, in metres.
    "a scene file" => struct Document {
        /// Where on Earth the scene is. Needed when several georeferenced models meet.
        optional world: World,
        /// How time is counted. What moves has keys: layers and cameras.
        optional animation: Animation,
        /// Cameras by name. The first is the one that is used when none is asked for.
        optional camera: Named<CameraName, Camera>,
        /// The parts of the scene, each of which can be made apart from the others.
        required layer: List<Layer>,
        /// Changes to the materials that the models bring, by their names: of layer "city" those of
        /// "city/roofs". In a name, * stands for any characters but a slash, ** for any names, ? for
        /// one character, [ab] for one of several. Later ones win.
        optional material: Named<Text, MaterialChange>,
    }
    not_yet light air
}

table! {
    /// Changes to a scene that is there already.
    "a file of changes" => struct Changes {
        /// Changes to materials, by their names, as in scene files.
        optional material: Named<Text, MaterialChange>,
    }
}

table! {
    /// Where on Earth the scene is.
    "[world]" => struct World {
        /// Coordinate reference system, such as "EPSG:7415".
        optional crs: Text,
        /// What stands at [0, 0, 0] of the scene, in the coordinates of crs.
        optional origin: Vector,
        /// What heights are counted from, such as "NAP", if crs does not say it.
        optional vertical_datum: Text,
    }
    needs (origin, crs) (vertical_datum, crs)
}

table! {
    /// How time is counted.
    "[animation]" => struct Animation {
        /// Frames a second; 24 by default. Frame 0 is at 0 seconds.
        optional fps: FramesPerSecond,
    }
}

table! {
    /// A camera. Its field of view is told by one of fov, focal_length and parallel; fov is 35deg
    /// if none is there.
    "[camera.NAME]" => struct Camera {
        /// Where the eye stands, in metres of the scene.
        required eye: Vector,
        /// What it looks at.
        required look_at: Vector,
        /// What is upwards in the picture; [0, 0, 1] by default, [0, 1, 0] for a view straight up or
        /// down.
        optional up: Direction,
        /// Vertical field of view, such as "40deg".
        optional fov: FieldOfView,
        /// Focal length of the lens, such as "35 mm".
        optional focal_length: LensLength,
        /// Height of the sensor; "24 mm" by default, which is that of small-format film.
        optional sensor_height: LensLength,
        /// A parallel projection, with this height of the frame in metres.
        optional parallel: Length,
        /// Shift of the lens: how far the frame is moved, in its widths to the right and its heights
        /// upwards. With [0, 0.25] a quarter more is seen above, and uprights stay upright.
        optional shift: Shift,
        /// Distance before which nothing is shown.
        optional near: Length,
        /// Width and height of the picture in pixels, where no other size is asked for.
        optional size: PictureSize,
        /// Where it is at which times, ascending. What lies between two keys is interpolated.
        optional keys: List<CameraKey>,
        /// How it goes from key to key: evenly (linear, the default), gently (ease) or at once (step).
        optional interpolation: Interpolation,
    }
    exclude (fov, focal_length) (fov, parallel) (focal_length, parallel)
    needs (sensor_height, focal_length) (interpolation, keys)
}

table! {
    /// Where a camera is at a time. What no key names stays as the camera has it.
    "keys" => struct CameraKey {
        /// When: seconds, or with a unit, such as "1.5 s" or "36 frames".
        required time: Time,
        /// Where the eye stands.
        optional eye: Vector,
        /// What it looks at.
        optional look_at: Vector,
    }
}

table! {
    /// A part of the scene.
    "[[layer]]" => struct Layer {
        /// Its name, with which the names of its objects and materials begin: "city/roofs".
        required name: Name,
        /// A model, or another scene file.
        required model: FilePath,
        /// The axis of the model's file that points upwards; what is usual in the format by default.
        optional up: Up,
        /// The level of detail of a city model, such as "2.2": of each object the most detailed up to
        /// that; the most detailed of all by default.
        optional lod: Lod,
        /// How the model is placed in the scene.
        optional at: Placement,
        /// Where the model is at which times, ascending. What lies between two keys is interpolated,
        /// word by word: before the first key that names a word and after the last it stays as it is
        /// there, and what no key names stays as at has it.
        optional keys: List<PlacementKey>,
        /// How it goes from key to key: evenly (linear, the default), gently (ease) or at once (step).
        optional interpolation: Interpolation,
        /// The animation of a glTF model that is played, by its name, or true for its first; none by
        /// default, so that the model stands at rest.
        optional animation: Played,
        /// Keys and animation begin again when they are over; else all stays as at their end.
        optional repeat: Flag,
        /// Of faces in one plane those of the layer with the higher priority are seen; 0 by default.
        optional priority: Priority,
        /// Whether it is seen. A matte hides what is behind it and gives nothing itself: the picture has
        /// a hole of its shape. What is caster-only hides nothing and will cast shadows, what is
        /// shadow-only is a matte that will catch them, once there are any.
        optional shown: Shown,
        /// A table (CSV) of places at which the model stands: a header with the columns x, y, z and
        /// any of heading, pitch, roll, scale, name; metres and degrees. heading turns clockwise seen
        /// from above; pitch lifts the model's +y, roll lowers its +x. at comes before.
        optional instances: FilePath,
    }
    needs (interpolation, keys)
}

table! {
    /// How a model is placed: scaled, then rotated, then moved; or by a matrix.
    "at" => struct Placement {
        /// Where the model's origin comes to lie, in metres.
        optional translate: Vector,
        /// A turn about an axis through the model's origin.
        optional rotate: Rotation,
        /// A factor, or one each along x, y and z.
        optional scale: Scale,
        /// All at once: three rows of four numbers, of which the last of each row is the translation.
        optional matrix: Matrix,
    }
    exclude (matrix, translate) (matrix, rotate) (matrix, scale)
}

table! {
    /// Where a layer's model is at a time, in the words of at.
    "keys" => struct PlacementKey {
        /// When: seconds, or with a unit, such as "1.5 s" or "36 frames".
        required time: Time,
        /// Where the model's origin comes to lie, in metres.
        optional translate: Vector,
        /// A turn about an axis through the model's origin. Between keys with one axis the angle goes
        /// evenly, by whole turns too; else the shortest way is taken.
        optional rotate: Rotation,
        /// A factor, or one each along x, y and z.
        optional scale: Scale,
    }
}

table! {
    /// A turn about an axis.
    "rotate" => struct Rotation {
        /// The axis.
        required axis: Direction,
        /// By how much; counterclockwise seen from where the axis points to.
        required angle: Angle,
    }
}

table! {
    /// What becomes different of a material. What is not named stays as the model has it.
    "[material.\"GLOB\"]" => struct MaterialChange {
        /// Colour; "#rrggbb" is sRGB, an array is linear. A texture is multiplied with it.
        optional color: Color,
        /// From 0, not there, to 1, opaque.
        optional opacity: Opacity,
        /// A picture on the surface, where the model has texture coordinates; false for none.
        optional texture: TextureChange,
        /// Shows its colour as it is, whatever the light.
        optional unlit: Flag,
        /// Seen from both sides.
        optional double_sided: Flag,
        /// Radiance that it gives off by itself; "#rrggbb" is sRGB, an array is linear.
        optional emissive: Emission,
    }
}

table! {
    /// A picture on a surface.
    "texture" => struct Texture {
        /// A PNG or JPEG.
        required image: FilePath,
        /// How often it repeats in a unit of texture coordinates, along u and v; [1, 1] by default.
        optional repeat: Repeat,
    }
}

/// Another picture on a surface, or none.
#[derive(Debug)]
pub enum TextureChange {
    None,
    Picture(Texture),
}

impl Form for TextureChange {
    fn read(key: &str, node: &Node<'_>, faults: &mut Faults) -> Option<Self> {
        match node.get_ref() {
            DeValue::Boolean(false) => Some(Self::None),
            DeValue::Table(_) => Texture::read(key, node, faults).map(Self::Picture),
            other => {
                let problem = Problem::WrongValue {
                    key: key.into(),
                    found: described(other).into(),
                    expected: "a picture, such as { image = \"tiles.jpg\" }, or false",
                };
                faults.add(node.span(), problem);
                None
            }
        }
    }

    fn schema() -> Value {
        json!({ "anyOf": [{ "const": false }, Texture::schema()] })
    }
}
