use crate::ObjectId;
use crate::scene::{Object, Scene};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use veduta_geometry::DVec3;

/// Where on Earth a scene is.
///
/// Georeferenced coordinates are large: metres from an origin far away. They are taken relative to
/// [`World::origin`] in double precision before anything else is done with them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct World {
    /// Coordinate reference system, such as `EPSG:7415`; `None` for a scene that is nowhere.
    pub crs: Option<String>,
    /// What stands at (0, 0, 0) of the world, in the coordinates of `crs`.
    pub origin: DVec3,
    /// What heights are counted from, such as `NAP`, where `crs` does not say it.
    pub vertical_datum: Option<String>,
}

/// A part of a scene that can be made apart from the others and composited with them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// Its name, with which the names of its objects and materials begin.
    pub name: String,
    /// Of coplanar faces of two layers those of the higher priority are seen. Layers stand in the
    /// scene in descending order of it.
    pub priority: i32,
    /// What its objects give to a picture.
    #[serde(default)]
    pub shown: Shown,
    /// Its objects: rows of [`Scene::objects`](super::Scene::objects).
    pub objects: Range<u32>,
}

/// What the objects of a layer give to a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shown {
    /// They are seen.
    #[default]
    Seen,
    /// They hide what is behind them, whatever the opacity of their materials, and are not seen
    /// themselves: the picture has a hole of their shape.
    Matte,
    /// They are not seen and hide nothing; they cast shadows.
    CasterOnly,
    /// As [`Shown::Matte`], but for the shadows that fall on them.
    ShadowOnly,
}

impl Shown {
    /// Whether objects take part in depth: they hide what is behind them.
    pub fn hides(self) -> bool {
        self != Self::CasterOnly
    }

    /// Whether objects have colour and opacity in pictures.
    pub fn is_seen(self) -> bool {
        self == Self::Seen
    }
}

impl Scene {
    /// What an object gives to a picture.
    pub fn shown(&self, object: ObjectId) -> Shown {
        self.layer_of(object)
            .map_or(Shown::Seen, |layer| layer.shown)
    }

    /// Whether objects are seen, by [`ObjectId`]; `None` where all are.
    pub fn are_seen(&self) -> Option<Vec<bool>> {
        if self.layers.iter().all(|layer| layer.shown.is_seen()) {
            return None;
        }
        let mut are_seen = vec![true; self.objects.len()];
        for layer in self.layers.iter().filter(|layer| !layer.shown.is_seen()) {
            are_seen[layer.objects.start as usize..layer.objects.end as usize].fill(false);
        }
        Some(are_seen)
    }

    /// Lets the objects that `wanted` accepts by their names give `shown` to a picture. Their layers are
    /// divided where not all objects of one are shown alike.
    pub fn show_as(&mut self, shown: Shown, wanted: impl Fn(&str) -> bool) {
        let mut layers: Vec<Layer> = Vec::new();
        for index in 0..self.objects.len() as u32 {
            let object = ObjectId(index);
            let of = self.layer_of(object);
            let name = of.map_or("", |layer| layer.name.as_str());
            let priority = of.map_or(0, |layer| layer.priority);
            let shown = if wanted(&self.object(object).name) {
                shown
            } else {
                self.shown(object)
            };
            match layers.last_mut() {
                Some(last)
                    if (&*last.name, last.priority, last.shown) == (name, priority, shown) =>
                {
                    last.objects.end = index + 1;
                }
                _ => layers.push(Layer {
                    name: name.into(),
                    priority,
                    shown,
                    objects: index..index + 1,
                }),
            }
        }
        self.layers = layers;
    }

    /// The layer of an object, if it is of one.
    pub fn layer_of(&self, object: ObjectId) -> Option<&Layer> {
        // Layers stand in the order of their objects.
        let next = self
            .layers
            .partition_point(|layer| layer.objects.end <= object.0);
        let layer = self.layers.get(next)?;
        layer.objects.contains(&object.0).then_some(layer)
    }

    /// Leaves out the objects of all layers but those that `keep` accepts. Objects of no layer stay.
    ///
    /// Meshes, materials, cameras and lights stay as they are: what is left looks as it does among
    /// the others.
    pub fn keep_layers(&mut self, keep: impl Fn(&Layer) -> bool) {
        let mut kept = vec![true; self.objects.len()];
        for layer in self.layers.iter().filter(|layer| !keep(layer)) {
            kept[layer.objects.start as usize..layer.objects.end as usize].fill(false);
        }
        self.keep_rows(&kept);
        self.layers.retain(&keep);
    }

    /// Leaves out all objects but those that `keep` accepts. All else stays as it is, layers without
    /// objects too.
    pub fn keep_objects(&mut self, keep: impl Fn(&Object) -> bool) {
        let kept: Vec<bool> = self.objects.iter().map(keep).collect();
        self.keep_rows(&kept);
    }

    /// Leaves out all objects but those whose row is `kept`. All else stays as it is, layers without
    /// objects too.
    pub fn keep_rows(&mut self, kept: &[bool]) {
        // How many stay before each object.
        let mut before = vec![0; kept.len() + 1];
        for (index, &is_kept) in kept.iter().enumerate() {
            before[index + 1] = before[index] + u32::from(is_kept);
        }
        for layer in &mut self.layers {
            let moved = |end: u32| before[end as usize];
            layer.objects = moved(layer.objects.start)..moved(layer.objects.end);
        }
        let mut kept = kept.iter();
        self.objects
            .retain(|_| kept.next().copied().unwrap_or(true));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MeshId;
    use veduta_geometry::DMat4;

    fn scene() -> Scene {
        let mut scene = Scene::default();
        for name in ["free", "a/0", "a/1", "b/0", "c/0"] {
            scene.objects.push(Object {
                name: name.into(),
                mesh: MeshId(0),
                world_from_object: DMat4::IDENTITY,
            });
        }
        for (name, objects) in [("a", 1..3), ("b", 3..4), ("c", 4..5)] {
            scene.layers.push(Layer {
                name: name.into(),
                priority: 0,
                shown: Shown::Seen,
                objects,
            });
        }
        scene
    }

    #[test]
    fn objects_shown_as_mattes_are_not_seen_and_the_others_are() {
        let mut scene = scene();
        assert_eq!(scene.are_seen(), None);
        let keys = |scene: &Scene| -> Vec<_> {
            let objects = (0..5).map(ObjectId);
            let key = |object| scene.key_of(object);
            objects
                .map(|o| (key(o).0, key(o).1.to_owned(), key(o).2.to_owned()))
                .collect()
        };
        let before = keys(&scene);
        scene.show_as(Shown::Matte, |name| ["free", "a/1"].contains(&name));
        assert_eq!(scene.are_seen(), Some(vec![false, true, false, true, true]));
        assert_eq!(scene.shown(ObjectId(2)), Shown::Matte);
        assert_eq!(keys(&scene), before, "depth ties are decided as before");
        scene.show_as(Shown::Seen, |_| true);
        assert_eq!(scene.are_seen(), None);
    }

    #[test]
    fn kept_layers_keep_their_objects() {
        let mut scene = scene();
        scene.keep_layers(|layer| layer.name != "b");
        let names: Vec<_> = scene.objects.iter().map(|o| o.name.as_str()).collect();
        assert_eq!(names, ["free", "a/0", "a/1", "c/0"]);
        for layer in &scene.layers {
            for object in &names[layer.objects.start as usize..layer.objects.end as usize] {
                assert!(object.starts_with(&layer.name), "{layer:?}");
            }
        }
        assert_eq!(scene.layers.len(), 2);
    }
}
