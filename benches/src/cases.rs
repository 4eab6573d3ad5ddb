//! Scenes to measure on, projected once: what an engine costs begins after projection.

use veduta::accumulate::Picture;
use veduta::filter::Filter;
use veduta::map::{Camera, FaceId, Faces, Fragments, VisibilityMap};
use veduta::pipeline::{RenderSettings, render_map};
use veduta::scene::{Scene, generate};
use veduta::visibility::{Seen, project, speculative};

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

    /// The exact engine's work.
    pub fn find_exactly(&self) -> Seen {
        let settings = speculative::Settings {
            aspect: f64::from(self.width) / f64::from(self.height),
            ..speculative::Settings::default()
        };
        speculative::find(&self.faces, &settings)
    }

    /// A map of the case's faces in which nothing has been found yet.
    pub fn empty_map(&self) -> VisibilityMap {
        VisibilityMap {
            camera: self.camera,
            faces: self.faces.clone(),
            opaque: Fragments::default(),
            veils: Fragments::default(),
        }
    }

    /// A picture of the case's size in which nothing has been drawn yet.
    pub fn empty_picture(&self) -> Picture {
        Picture {
            width: self.width,
            height: self.height,
            pixels: vec![[0.0; 4]; self.width as usize * self.height as usize],
        }
    }

    /// Fills `map`, made by [`Case::empty_map`].
    pub fn find_into(&self, map: &mut VisibilityMap) {
        let Seen { opaque, veils } = self.find_exactly();
        (map.opaque, map.veils) = (opaque, veils);
    }

    /// Fills `map`, made by [`Case::empty_map`], and makes its picture.
    pub fn picture_exactly(&self, map: &mut VisibilityMap) -> Picture {
        self.find_into(map);
        self.picture_of(map, Filter::Box)
    }

    /// The picture of a map of the case.
    pub fn picture_of(&self, map: &VisibilityMap, filter: Filter) -> Picture {
        let settings = RenderSettings {
            width: self.width,
            height: self.height,
            unlit: true,
            filter,
            ..RenderSettings::default()
        };
        render_map(&self.scene, map, &settings)
    }

    /// Name and size, as [`Case::parse`] reads them.
    pub fn title(&self) -> String {
        format!("{}@{}x{}", self.name, self.width, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::zbuffer::ZBuffer;
    use veduta::visibility::multiscan;

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
    fn all_methods_make_the_same_picture() {
        for title in ["buildings@96x64", "pierce@96x64", "radial@96x96"] {
            let case = Case::parse(title).expect("a sound title");
            let exact = case.picture_exactly(&mut case.empty_map());
            let spans = multiscan::find_spans(&case.faces, case.width, case.height, 128);
            let scanned = multiscan::picture(&spans, |face| case.color(face));
            let mut buffer = ZBuffer::new(32 * case.width, 32 * case.height);
            buffer.find(&case.faces);
            let mut sampled = case.empty_picture();
            buffer.resolve(32, |face| case.color(face), &mut sampled);
            // An edge along the rows is off by half a sub-scanline, or half a row of samples.
            for (method, picture, bound) in
                [("multiscan", scanned, 0.006), ("samples", sampled, 0.03)]
            {
                for (index, (a, b)) in exact.pixels.iter().zip(&picture.pixels).enumerate() {
                    let off = (0..4).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
                    assert!(
                        off < bound,
                        "{title}, {method}, pixel {index}: {a:?} and {b:?}"
                    );
                }
            }
        }
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
