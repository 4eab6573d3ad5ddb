//! Animations: the keys of nodes at a time -> how the nodes stand then.
//!
//! glTF 2.0, §3.11 and appendix C. Only the keys on both sides of the time are decoded. What is played
//! takes the place of the nodes' own translation, rotation, scale and weights; the rest of the reader
//! does not know of time.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::document::{self, AnimationSampler, Channel, Document};
use super::{Fault, Problem, row};
use crate::read::budget::Budget;
use crate::read::error::{Place, Warnings};
use crate::read::files::shortened;
use crate::read::moment::{Animation, AnimationKind};
use crate::read::names::unique;
use std::collections::HashMap;
use veduta_geometry::{DQuat, DVec3, DVec4};

/// What is played.
#[derive(Clone, Copy, Debug)]
pub struct Played<'a> {
    /// The animation's name; `None` for the first.
    pub name: Option<&'a str>,
    /// The time after its beginning.
    pub seconds: f64,
    /// Whether it begins again when it is over; else it stays as at its end.
    pub repeats: bool,
}

/// How nodes stand that are moved.
#[derive(Debug, Default)]
pub struct Posed {
    nodes: HashMap<usize, PosedNode>,
}

/// What an animation says of a node.
#[derive(Debug, Default)]
pub struct PosedNode {
    pub translation: Option<DVec3>,
    pub rotation: Option<DQuat>,
    pub scale: Option<DVec3>,
    pub weights: Option<Vec<f32>>,
}

impl Posed {
    /// What is said of a node, if anything.
    pub fn node(&self, node: usize) -> Option<&PosedNode> {
        self.nodes.get(&node)
    }
}

/// The animations of a document, with unique names. One whose keys cannot be read is left out, with a
/// warning: who does not play it need not care.
pub fn all(
    document: &Document,
    buffers: &Buffers<'_>,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Vec<Animation>, Fault> {
    let mut taken = HashMap::new();
    let mut all = Vec::with_capacity(document.animations.len());
    for (index, animation) in document.animations.iter().enumerate() {
        let at = format!("animations[{index}]");
        let name = animation.name.as_deref().filter(|name| !name.is_empty());
        let charged = budget.charge(name.map_or(0, str::len) as u64, 2);
        charged.map_err(|problem| problem.at_json(&at))?;
        let name = name.map_or_else(|| format!("animation{index}"), str::to_owned);
        let name = unique(name, &mut taken);
        let end = end_of(document, buffers, animation, &at);
        let seconds = end.unwrap_or_else(|fault| {
            let message = format!("the animation {name:?} cannot be played: {}", fault.problem);
            warnings.add(fault.place, message);
            0.0
        });
        all.push(Animation {
            name,
            kind: AnimationKind::Model,
            seconds,
        });
    }
    Ok(all)
}

/// When the last key of an animation is.
fn end_of(
    document: &Document,
    buffers: &Buffers<'_>,
    animation: &document::Animation,
    at: &str,
) -> Result<f64, Fault> {
    let mut end = 0.0_f64;
    for (number, sampler) in animation.samplers.iter().enumerate() {
        let at = format!("{at}.samplers[{number}].input");
        let times = Elements::find(document, buffers, sampler.input, "SCALAR", &at)?;
        let last = u32::try_from(times.count.saturating_sub(1)).unwrap_or(u32::MAX);
        if times.count > 0 {
            let last: Vec<f64> = times.vectors(Some(&[last]), |[time]: [f32; 1]| f64::from(time));
            end = last
                .into_iter()
                .filter(|time| time.is_finite())
                .fold(end, f64::max);
        }
    }
    Ok(end)
}

/// How nodes stand while an animation is played. `animations` are those of the document.
pub fn pose(
    document: &Document,
    buffers: &Buffers<'_>,
    animations: &[Animation],
    played: Option<Played<'_>>,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Posed, Fault> {
    let mut posed = Posed::default();
    let Some(Played {
        name,
        seconds,
        repeats,
    }) = played
    else {
        return Ok(posed);
    };
    let index = match name {
        None if animations.is_empty() => return Ok(posed),
        None => 0,
        Some(name) => {
            let mut all = animations.iter();
            let found = all.position(|animation| animation.name == name);
            found.ok_or_else(|| no_animation(name, animations).at(Place::Whole))?
        }
    };
    let end = animations[index].seconds;
    let seconds = if repeats && end > 0.0 {
        seconds.rem_euclid(end)
    } else {
        seconds
    };
    let animation = &document.animations[index];
    for (number, channel) in animation.channels.iter().enumerate() {
        let at = format!("animations[{index}].channels[{number}]");
        // Without a node an extension says what moves.
        let Some(node) = channel.target.node else {
            let message = "what it moves is told by an extension, and is left as it is";
            warnings.add(Place::Json(format!("{at}.target")), message);
            continue;
        };
        let (node, row_of_node) = row(&document.nodes, node, "node", &format!("{at}.target"))?;
        if row_of_node.matrix.is_some() && channel.target.path != "weights" {
            let found = format!("node {node}, which has a matrix");
            let expected = "a node with translation, rotation and scale";
            return Err(Problem::Illegal { found, expected }.at_json(format!("{at}.target.node")));
        }
        let sampler = row(&animation.samplers, channel.sampler, "sampler", &at)?;
        let at_sampler = format!("animations[{index}].samplers[{}]", sampler.0);
        let keys = Keys::find(document, buffers, sampler.1, seconds, budget, &at_sampler)?;
        set(
            document,
            buffers,
            channel,
            &keys,
            posed.nodes.entry(node).or_default(),
            &at,
        )?;
    }
    Ok(posed)
}

/// What a channel says of its node.
fn set(
    document: &Document,
    buffers: &Buffers<'_>,
    channel: &Channel,
    keys: &Keys<'_>,
    posed: &mut PosedNode,
    at: &str,
) -> Result<(), Fault> {
    let vector = |keys: &Keys<'_>| -> Result<DVec3, Fault> {
        let output = keys.output(document, buffers, "VEC3", 1)?;
        let [x, y, z] = keys.value(&output, 0, |v: [f32; 3]| v.map(f64::from));
        Ok(DVec3::new(x, y, z))
    };
    match channel.target.path.as_str() {
        "translation" => posed.translation = Some(vector(keys)?),
        "scale" => posed.scale = Some(vector(keys)?),
        "rotation" => posed.rotation = Some(keys.rotation(document, buffers)?),
        "weights" => {
            let output = keys.output(document, buffers, "SCALAR", 0)?;
            let weights = (0..output.width).map(|target| {
                let [weight] = keys.value(&output, target, |w: [f32; 1]| w.map(f64::from));
                weight as f32
            });
            posed.weights = Some(weights.collect());
        }
        path => {
            return Err(Problem::Illegal {
                found: format!("{:?}", shortened(path)),
                expected: "translation, rotation, scale or weights",
            }
            .at_json(format!("{at}.target.path")));
        }
    }
    Ok(())
}

fn no_animation(name: &str, animations: &[Animation]) -> Problem {
    let names = || animations.iter().map(|animation| animation.name.as_str());
    let help = match names().collect::<Vec<_>>().as_slice() {
        [] => "it has none".to_owned(),
        all => format!("it has: {}", shortened(&all.join(", "))),
    };
    Problem::NoAnimation {
        name: shortened(name),
        help,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// The keys of a sampler on both sides of a time.
struct Keys<'a> {
    sampler: &'a AnimationSampler,
    interpolation: Interpolation,
    /// Number of all keys.
    count: usize,
    /// The key before, and the one after if the time is between two.
    before: usize,
    after: Option<usize>,
    /// From the key before to the one after: their distance in seconds, and how much of it has passed.
    length: f64,
    share: f64,
    /// The sampler's path.
    at: String,
}

/// The values of a sampler's keys.
struct Output<'a> {
    elements: Elements<'a>,
    /// Values of a key: one, or one for each morph target.
    width: usize,
}

impl<'a> Keys<'a> {
    fn find(
        document: &Document,
        buffers: &Buffers<'_>,
        sampler: &'a AnimationSampler,
        seconds: f64,
        budget: &mut Budget,
        at: &str,
    ) -> Result<Self, Fault> {
        let interpolation = match sampler.interpolation.as_deref() {
            Some("STEP") => Interpolation::Step,
            None | Some("LINEAR") => Interpolation::Linear,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => {
                return Err(Problem::Illegal {
                    found: format!("{:?}", shortened(other)),
                    expected: "STEP, LINEAR or CUBICSPLINE",
                }
                .at_json(format!("{at}.interpolation")));
            }
        };
        let at_input = format!("{at}.input");
        let input = Elements::find(document, buffers, sampler.input, "SCALAR", &at_input)?;
        let charged = budget.charge(input.count, size_of::<f64>());
        charged.map_err(|problem| problem.at_json(&at_input))?;
        let times: Vec<f64> = input.vectors(None, |[time]: [f32; 1]| f64::from(time));
        let illegal = |found: String| {
            let expected = "times in seconds that ascend, one at least";
            Problem::Illegal { found, expected }.at_json(&at_input)
        };
        if times.is_empty() {
            return Err(illegal("no times".into()));
        }
        if let Some(key) = (1..times.len()).find(|&key| times[key - 1] >= times[key]) {
            return Err(illegal(format!(
                "{} s after {} s",
                times[key],
                times[key - 1]
            )));
        }
        if let Some(time) = times.iter().find(|time| !time.is_finite()) {
            return Err(illegal(time.to_string()));
        }
        let next = times.partition_point(|&time| time <= seconds);
        let before = next.saturating_sub(1);
        let after = (next > 0 && next < times.len()).then_some(next);
        let length = after.map_or(0.0, |after| times[after] - times[before]);
        let share = if after.is_some() {
            (seconds - times[before]) / length
        } else {
            0.0
        };
        Ok(Self {
            sampler,
            interpolation,
            count: times.len(),
            before,
            after,
            length,
            share,
            at: at.to_owned(),
        })
    }

    /// The values of all keys; `width` of each, or as many as there are if that is 0.
    fn output<'d>(
        &self,
        document: &'d Document,
        buffers: &'d Buffers<'_>,
        shapes: &'static str,
        width: usize,
    ) -> Result<Output<'d>, Fault> {
        let at = format!("{}.output", self.at);
        let elements = Elements::find(document, buffers, self.sampler.output, shapes, &at)?;
        let keys = (self.count * self.values_per_key()) as u64;
        let found = elements.count;
        let fits = match width {
            0 => found % keys == 0,
            width => found == keys * width as u64,
        };
        if !fits {
            let found = format!("{found} values, for {} times", self.count);
            let expected = "as many values for each time, three times as many for CUBICSPLINE";
            return Err(Problem::Illegal { found, expected }.at_json(at));
        }
        // No index below may be beyond what rows are counted in.
        if u32::try_from(found).is_err() {
            let found = format!("{found} values");
            let expected = "fewer than 2^32";
            return Err(Problem::Illegal { found, expected }.at_json(at));
        }
        let width = (found / keys) as usize;
        Ok(Output { elements, width })
    }

    /// Values that the output has of a key: with CUBICSPLINE the tangent before, the value, the tangent
    /// after.
    fn values_per_key(&self) -> usize {
        if self.interpolation == Interpolation::CubicSpline {
            3
        } else {
            1
        }
    }

    /// The value at the time, component by component. `number` is which of a key's values is asked for.
    fn value<const N: usize, const M: usize>(
        &self,
        output: &Output<'_>,
        number: usize,
        make: impl Fn([f32; M]) -> [f64; N] + Sync,
    ) -> [f64; N] {
        let of = |key: usize, which: usize| {
            let row = (key * self.values_per_key() + which) * output.width + number;
            let row = u32::try_from(row).expect("rows have been counted");
            output.elements.vectors(Some(&[row]), &make)[0]
        };
        // Of a spline the value stands between its tangents.
        let value = self.values_per_key() / 2;
        let p = of(self.before, value);
        let Some(after) = self
            .after
            .filter(|_| self.interpolation != Interpolation::Step)
        else {
            return p;
        };
        let q = of(after, value);
        let s = self.share;
        if self.interpolation == Interpolation::Linear {
            return std::array::from_fn(|k| p[k] + s * (q[k] - p[k]));
        }
        // Hermite's spline (appendix C.5); tangents are for a second.
        let (out, into) = (of(self.before, 2), of(after, 0));
        let (s2, s3) = (s * s, s * s * s);
        std::array::from_fn(|k| {
            (2.0 * s3 - 3.0 * s2 + 1.0) * p[k]
                + self.length * (s3 - 2.0 * s2 + s) * out[k]
                + (3.0 * s2 - 2.0 * s3) * q[k]
                + self.length * (s3 - s2) * into[k]
        })
    }

    /// A rotation at the time: on the shortest arc between two keys (appendix C.4).
    fn rotation(&self, document: &Document, buffers: &Buffers<'_>) -> Result<DQuat, Fault> {
        let output = self.output(document, buffers, "VEC4", 1)?;
        let make = |q: [f32; 4]| q.map(f64::from);
        let unit = |q: [f64; 4]| {
            let q = DVec4::from_array(q);
            let unit = q.try_normalize().map(DQuat::from_vec4);
            unit.ok_or_else(|| {
                let found = format!("{q}");
                let expected = "quaternions of length 1";
                Problem::Illegal { found, expected }.at_json(format!("{}.output", self.at))
            })
        };
        let Some(after) = self
            .after
            .filter(|_| self.interpolation == Interpolation::Linear)
        else {
            return unit(self.value(&output, 0, make));
        };
        let [p, q] = [self.before, after].map(|key| {
            let row = u32::try_from(key).expect("keys have been counted");
            output.elements.vectors(Some(&[row]), make)[0]
        });
        Ok(unit(p)?.slerp(unit(q)?, self.share))
    }
}
