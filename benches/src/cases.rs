//! Scenes to measure on, projected once: what an engine costs begins after projection.

use veduta::map::{Camera, FaceId, Faces};
use veduta::scene::{Scene, generate};
use veduta::visibility::project;

/// A scene at a picture's size.
pub struct Case {
    /// Name of the generated scene.
    pub name: String,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The scene.
    pub scene: Scene,
    /// The camera.
    pub camera: Camera,
    /// The projected faces.
    pub faces: Faces,
    /// Colour of each face, made beforehand so that no method pays for finding it.
    colors: Vec<[f32; 4]>,
}

impl Case {
    /// The generated scene `name` at `width` x `height` pixels; `None` if there is no such scene.
    pub fn new(name: &str, [width, height]: [u32; 2]) -> Option<Self> {
        let aspect = f64::from(width) / f64::from(height);
        let made = generate::by_name_for_aspect(name, aspect)?;
        let faces = project(&made.scene, &made.camera);
        let colors = faces
            .ids()
            .map(|face| {
                let mesh = made.scene.mesh_of(faces.object(face));
                let [corner, ..] = mesh.triangles[faces.source(face) as usize];
                let [r, g, b] = mesh.colors[corner as usize];
                [r, g, b, 1.0]
            })
            .collect();
        Some(Self {
            name: name.to_owned(),
            width,
            height,
            scene: made.scene,
            camera: made.camera,
            faces,
            colors,
        })
    }

    /// `NAME` at its own size or `NAME@WIDTHxHEIGHT`.
    ///
    /// # Errors
    /// A sentence about what is wrong with `text`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, size) = match text.split_once('@') {
            None => (text, None),
            Some((name, size)) => {
                let sides = size
                    .split_once('x')
                    .and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
                let sides =
                    sides.filter(|sides| sides.iter().all(|side| (1..=32768).contains(side)));
                (
                    name,
                    Some(sides.ok_or(format!("{size} is not a size such as 1920x1080"))?),
                )
            }
        };
        if !generate::NAMES.contains(&name) {
            let names = generate::NAMES.join(", ");
            return Err(format!("no scene is called {name}; there are {names}"));
        }
        let natural = || generate::by_name(name).map(|made| made.size);
        size.or_else(natural)
            .and_then(|size| Self::new(name, size))
            .ok_or_else(|| format!("no scene is called {name}"))
    }

    /// Colour of a face.
    #[inline]
    pub fn color(&self, face: FaceId) -> [f32; 4] {
        self.colors[face.index()]
    }

    /// Name and size, as [`Case::parse`] reads them.
    pub fn title(&self) -> String {
        format!("{}@{}x{}", self.name, self.width, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_reads_its_own_title() {
        let case = Case::parse("buildings@640x480").expect("a sound title");
        assert_eq!(case.title(), "buildings@640x480");
        assert_eq!(
            Case::parse("radial").expect("a name").title(),
            "radial@512x512"
        );
    }

    #[test]
    fn wrong_names_and_sizes_are_told() {
        for (text, part) in [
            ("nothing", "no scene is called nothing"),
            ("radial@12", "12 is not a size"),
            ("radial@0x5", "0x5 is not a size"),
            ("radial@9x-1", "9x-1 is not a size"),
        ] {
            let error = Case::parse(text).err().expect("an error");
            assert!(error.contains(part), "{error}");
        }
    }
}
