//! Frames of an animation: what has not moved is not found again.
//!
//! Nakamae et al. (1989) keep objects in clusters and recalculate "only moving elements". Here the
//! layers of a scene are shared out to parts, each with what is seen of it alone. Of a new frame
//!
//! 1. the layers are compared with those of the frame before, by their data;
//! 2. parts of which only some layers have changed are split, so that layers stay together as long as
//!    they move together: at first all are one part, then those that stand and those that move;
//! 3. parts that have changed are found again, the others kept;
//! 4. all are composited. That is exact (law 2), so the frame is the one that would have been found of
//!    all layers at once.
//!
//! Through another camera everything is seen otherwise, and all is found at once. So it is where most
//! has changed, since compositing then costs more than it saves ([`MOST_CHANGED`]).

mod same;

use super::find_visibility;
use crate::composite::composite;
use crate::scene::Scene;
use same::Comparison;
use std::collections::HashSet;
use std::ops::Range;
use veduta_map::{Camera, ObjectId, SeenScene};

/// Share of the scene's faces, and of the fragments that were seen, that may change where the rest is
/// kept. Finding goes with both: few faces that pierce one another cost as much as many that do not. A
/// composite costs up to half of finding all (docs/performance.md), so that with a larger share frames
/// would cost more than at once; with a smaller one more is found that stands.
const MOST_CHANGED: f64 = 0.5;

/// Layers that all move at times of their own would each become a part, and a composite of very many
/// maps costs more than it saves: from here on all that has ever moved is one part.
const MOST_PARTS: usize = 8;

/// The frames of an animation, one after the other.
#[derive(Debug)]
pub struct Frames {
    /// Width and height in pixels of the pictures that the frames are for.
    size: [u32; 2],
    last: Option<Last>,
}

/// What is known of the frame before.
#[derive(Debug)]
struct Last {
    scene: Scene,
    camera: Camera,
    units: Vec<Unit>,
    /// The units of each part, ascending.
    parts: Vec<Vec<usize>>,
    /// What is seen of each part alone.
    seen: Vec<SeenScene>,
    /// All parts together, if there are several.
    composite: Option<SeenScene>,
}

/// What is made apart from the others: a layer, or an object of no layer.
#[derive(Clone, Debug, PartialEq)]
struct Unit {
    name: String,
    /// Rows of the scene's objects.
    objects: Range<u32>,
}

/// Units that have always moved together, ascending, and what is seen of them alone unless they have
/// changed since.
type Part = (Vec<usize>, Option<SeenScene>);

/// What [`Frames::next`] is about to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameStep {
    /// The scene is compared with that of the frame before.
    Comparing,
    /// What is seen of what has changed is found.
    Finding,
    /// Parts are composited.
    Compositing,
}

/// How a frame was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameWork {
    /// How much of it was found.
    pub extent: Extent,
    /// The layers that differ from the frame before, in the order of the scene. All, if there was none.
    pub changed: Vec<String>,
    /// The layers that were found: those that have changed, and those that were not known apart from
    /// them.
    pub found: Vec<String>,
}

/// How much of a frame was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Extent {
    /// All, since it is the first.
    First,
    /// All, since the camera has moved, or the layers are others.
    OtherView,
    /// All, since most of it has changed.
    MostChanged,
    /// Some parts; the others were kept, and all composited.
    Parts,
    /// Nothing: it is the frame before.
    Nothing,
}

impl Frames {
    /// Frames for pictures of `size`, width and height in pixels.
    pub fn new(size: [u32; 2]) -> Self {
        Self { size, last: None }
    }

    /// What `camera` sees of `scene`, the scene of the next frame. `begin` is told of each step.
    ///
    /// It is what [`find_visibility`] finds, but for the order of its faces and the number of their
    /// fragments.
    pub fn next(
        &mut self,
        mut scene: Scene,
        camera: &Camera,
        mut begin: impl FnMut(FrameStep),
    ) -> (&SeenScene, FrameWork) {
        begin(FrameStep::Comparing);
        let units = units_of(&scene);
        let names = |of: &dyn Fn(usize) -> bool| -> Vec<String> {
            let rows = (0..units.len()).filter(|&unit| of(unit));
            rows.map(|unit| units[unit].name.clone()).collect()
        };
        let (extent, changed, mut parts) = match self.last.take() {
            None => (Extent::First, vec![true; units.len()], Vec::new()),
            Some(last) => {
                let changed = last.changed(&scene, &units);
                if last.camera != *camera
                    || last.scene.world != scene.world
                    || !same_names(&last.units, &units)
                {
                    (Extent::OtherView, changed, Vec::new())
                } else if !changed.contains(&true) {
                    let last = self.last.insert(Last { scene, ..last });
                    let work = FrameWork {
                        extent: Extent::Nothing,
                        changed: Vec::new(),
                        found: Vec::new(),
                    };
                    return (last.relit(), work);
                } else if changed_share(&scene, &units, &changed).max(seen_share(
                    last.seen(),
                    &units,
                    &changed,
                )) > MOST_CHANGED
                {
                    (Extent::MostChanged, changed, Vec::new())
                } else {
                    let seen = last.seen.into_iter().map(Some);
                    let parts = last.parts.into_iter().zip(seen);
                    let parts = split(parts, &changed, &scene, &units);
                    (Extent::Parts, changed, parts)
                }
            }
        };
        if parts.is_empty() {
            parts.push(((0..units.len()).collect(), None));
        }

        begin(FrameStep::Finding);
        let mut found = vec![false; units.len()];
        let mut seen = Vec::with_capacity(parts.len());
        for (part, known) in &mut parts {
            seen.push(known.take().unwrap_or_else(|| {
                part.iter().for_each(|&unit| found[unit] = true);
                seen_of(&mut scene, &units, part, camera, self.size)
            }));
        }
        let composite = (seen.len() > 1).then(|| {
            begin(FrameStep::Compositing);
            composite(&seen).expect("all parts were seen through one camera")
        });
        let work = FrameWork {
            extent,
            changed: names(&|unit| changed[unit]),
            found: names(&|unit| found[unit]),
        };
        let last = self.last.insert(Last {
            scene,
            camera: *camera,
            units,
            parts: parts.into_iter().map(|part| part.0).collect(),
            seen,
            composite,
        });
        (last.relit(), work)
    }
}

impl Last {
    /// Of each unit, whether it differs from the one of that row before.
    fn changed(&self, scene: &Scene, units: &[Unit]) -> Vec<bool> {
        let mut comparison = Comparison::of(&self.scene, scene);
        let same = units.iter().enumerate().map(|(row, unit)| {
            let before = self.units.get(row);
            before.is_some_and(|before| {
                before.name == unit.name
                    && comparison.same_objects(before.objects.clone(), unit.objects.clone())
            })
        });
        same.map(|same| !same).collect()
    }

    /// All that was seen.
    fn seen(&self) -> &SeenScene {
        self.composite.as_ref().unwrap_or(&self.seen[0])
    }

    /// All that is seen, with the lights that the scene has now.
    fn relit(&mut self) -> &SeenScene {
        let seen = match &mut self.composite {
            Some(composite) => composite,
            None => &mut self.seen[0],
        };
        seen.scene.lights.clone_from(&self.scene.lights);
        seen
    }
}

/// The layers of a scene, and its objects of no layer.
fn units_of(scene: &Scene) -> Vec<Unit> {
    let mut units = Vec::new();
    let mut object = 0;
    let count = scene.objects.len() as u32;
    while object < count {
        let id = ObjectId(object);
        let layer = scene.layer_of(id);
        let unit = Unit {
            name: unit_name(scene, id).to_owned(),
            objects: layer.map_or(object..object + 1, |layer| layer.objects.clone()),
        };
        object = unit.objects.end;
        units.push(unit);
    }
    units
}

fn same_names(some: &[Unit], others: &[Unit]) -> bool {
    some.iter()
        .map(|unit| &unit.name)
        .eq(others.iter().map(|unit| &unit.name))
}

/// The changed faces as a share of all.
fn changed_share(scene: &Scene, units: &[Unit], changed: &[bool]) -> f64 {
    let [mut of_all, mut of_changed] = [0; 2];
    for (unit, &has_changed) in units.iter().zip(changed) {
        let faces = face_count(scene, unit);
        of_all += faces;
        of_changed += if has_changed { faces } else { 0 };
    }
    of_changed as f64 / of_all.max(1) as f64
}

/// The fragments of changed units as a share of all that was seen.
fn seen_share(seen: &SeenScene, units: &[Unit], changed: &[bool]) -> f64 {
    let changed = units.iter().zip(changed).filter(|row| *row.1);
    let names: HashSet<&str> = changed.map(|(unit, _)| unit.name.as_str()).collect();
    let objects = (0..seen.scene.objects.len()).map(ObjectId::from_index);
    let has_changed: Vec<bool> = objects
        .map(|object| names.contains(unit_name(&seen.scene, object)))
        .collect();
    let map = &seen.map;
    let of_changed = (0..map.fragment_count())
        .filter(|&fragment| has_changed[map.faces.object(map.face_of(fragment)).index()]);
    of_changed.count() as f64 / map.fragment_count().max(1) as f64
}

/// The name of an object's layer, or its own if it is of none.
fn unit_name(scene: &Scene, object: ObjectId) -> &str {
    let layer = scene.layer_of(object);
    layer.map_or(&scene.object(object).name, |layer| &layer.name)
}

fn face_count(scene: &Scene, unit: &Unit) -> usize {
    let objects = unit.objects.clone().map(ObjectId);
    objects
        .map(|object| scene.mesh_of(object).face_count())
        .sum()
}

/// Splits the parts into what has changed and what has not. Only parts that have not changed at all
/// stay known.
fn split(
    parts: impl Iterator<Item = Part>,
    changed: &[bool],
    scene: &Scene,
    units: &[Unit],
) -> Vec<Part> {
    let mut split: Vec<Part> = Vec::new();
    for part in parts {
        let (moved, stood): (Vec<usize>, Vec<usize>) =
            part.0.iter().partition(|&&unit| changed[unit]);
        if moved.is_empty() {
            split.push(part);
        } else {
            let halves = [stood, moved].into_iter().filter(|half| !half.is_empty());
            split.extend(halves.map(|half| (half, None)));
        }
    }
    if split.len() > MOST_PARTS {
        let faces = |part: &Part| -> usize {
            let units = part.0.iter().map(|&unit| &units[unit]);
            units.map(|unit| face_count(scene, unit)).sum()
        };
        // The largest is what stands still, as far as anything does.
        let largest = (0..split.len()).max_by_key(|&part| faces(&split[part]));
        let largest = split.swap_remove(largest.expect("there are parts"));
        let mut others: Vec<usize> = split.into_iter().flat_map(|part| part.0).collect();
        others.sort_unstable();
        return vec![largest, (others, None)];
    }
    split
}

/// What is seen of a part alone.
fn seen_of(
    scene: &mut Scene,
    units: &[Unit],
    part: &[usize],
    camera: &Camera,
    size: [u32; 2],
) -> SeenScene {
    if part.len() == units.len() {
        let map = find_visibility(scene, camera);
        return SeenScene::of(scene, &map, size);
    }
    // For as long as that takes the others are taken out: a copy of the scene would cost more.
    let (objects, layers) = (scene.objects.clone(), scene.layers.clone());
    let mut is_of = vec![false; objects.len()];
    for &unit in part {
        let Range { start, end } = units[unit].objects;
        is_of[start as usize..end as usize].fill(true);
    }
    scene.keep_rows(&is_of);
    let map = find_visibility(scene, camera);
    let seen = SeenScene::of(scene, &map, size);
    (scene.objects, scene.layers) = (objects, layers);
    seen
}
