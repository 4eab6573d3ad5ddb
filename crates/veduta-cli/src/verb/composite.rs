//! `veduta composite`: several stored maps become one.

use super::look::Look;
use super::output::Output;
use super::stored::{Changes, Stored, open, refuse_place, tell_work};
use super::{tell_of_mattes, tell_shortcomings, unknown_name};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use clap::Args;
use std::path::PathBuf;
use veduta::composite::{CompositeError, composite_spans, hold_out, unite};
use veduta::dice::PixelGrid;
use veduta::map::{Casters, Choice, Origin, SeenScene};
use veduta_io::{Layers, ObjectNames, choose_objects};

/// Put stored maps together by depth
///
/// Maps of one camera become one map, or a picture of it: what is nearer hides what is farther, also
/// where surfaces pass through one another, with edges as exact as if all had been rendered together.
/// Of surfaces in one plane that of the higher priority is seen, else that of the first name.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Composite {
    /// The maps: .veduta
    #[arg(required = true, value_name = "MAP")]
    maps: Vec<PathBuf>,
    /// A map that only hides: where it is seen nothing is, and the picture has a hole of its exact
    /// shape. May be given several times
    #[arg(long, value_name = "MAP")]
    holdout: Vec<PathBuf>,
    /// Take only the objects of these names from the maps; names match with *, ** and ?. May be given
    /// several times
    #[arg(long, value_name = "NAME")]
    only: Vec<ObjectNames>,
    /// Leave out the objects of these names: where they were seen, nothing of their map is. May be given
    /// several times
    #[arg(long, value_name = "NAME")]
    without: Vec<ObjectNames>,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    changes: Changes,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    look: Look,
}

const EXAMPLES: &str = "\
Examples:
  A hut into a town, both seen by one camera:
      veduta render town.obj --eye 9,-9,5 --look-at 0,0,0 -o seen.veduta
      veduta render hut.obj --eye 9,-9,5 --look-at 0,0,0 -o hut.veduta
      veduta composite seen.veduta hut.veduta -o both.veduta
      veduta composite seen.veduta hut.veduta -o both.png
  The hut alone, with holes where the town stands before it:
      veduta composite hut.veduta --holdout seen.veduta -o element.exr
";

impl Composite {
    pub fn run(&self, force: bool, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        let map_place = self.output.map_place();
        let target = match map_place {
            Some(place) => {
                refuse_place(place, force)?;
                None
            }
            None => self.output.target(&self.maps[0], json)?,
        };
        if map_place.is_some() && self.output.has_layers() {
            let message = "a map is of no picture: --aov is not for .veduta";
            return Err(Failure::new(Code::Usage, message));
        }
        if map_place.is_some() {
            self.look.refuse_filter("a map is of no picture")?;
        }
        if map_place.is_none() && target.is_none() {
            let message = "a composite is shown by -o FILE; --preview is for veduta render";
            return Err(Failure::new(Code::Usage, message));
        }
        let mut maps: Vec<Stored> = Vec::new();
        let mut origins: Vec<Origin> = Vec::new();
        talk.begin("reading");
        for (index, path) in self.maps.iter().chain(&self.holdout).enumerate() {
            talk.part(index, self.maps.len() + self.holdout.len());
            let mut map = open(path)?;
            if map_place.is_some() {
                origins.push(map.origin()?);
            }
            maps.push(Stored::read(&mut map)?);
        }
        let count = maps.len();
        talk.begin("compositing");
        let mut seen = self.composite(maps)?;
        self.changes.apply(seen.scene_mut(), self.strict, talk)?;
        let mut told = serde_json::json!({
            "size": seen.size(),
            "maps": count,
            "facesSeen": seen.faces().len(),
        });
        if let Some(place) = map_place {
            talk.begin("writing");
            let origin = self.origin(origins, talk)?;
            seen.write(place, &origin)?;
            told["output"] = place.to_string_lossy().into();
        }
        if let Some(target) = &target {
            let [width, height] = seen.size();
            let development = self.look.development(seen.scene(), self.strict, talk)?;
            let shortcomings = seen.shortcomings();
            tell_shortcomings(
                &self.maps[0],
                seen.scene(),
                &shortcomings,
                self.strict,
                talk,
            )?;
            talk.begin("shading");
            let grid = PixelGrid::of_frame(width, height);
            let (aovs, filter) = (self.output.aovs(), self.look.filter());
            if matches!(seen, Stored::Spans(_)) {
                self.look
                    .refuse_filter("filters weigh exact regions, not spans")?;
            }
            let (mut picture, aovs) = seen
                .picture(&grid, self.look.unlit, filter, aovs)
                .expect("a picture in its own size needs no more sub-scanlines");
            let layers = Layers {
                aovs: &aovs,
                scene: seen.scene(),
                camera: seen.camera(),
                grid,
            };
            tell_of_mattes(&self.maps[0], &layers, self.strict, talk)?;
            talk.begin("developing");
            told["exposure"] = development.develop(&mut picture, !target.linear).into();
            talk.begin("writing");
            target.write(&picture, self.output.has_layers().then_some(&layers))?;
            told["output"] = target.name().into();
        }
        talk.end();
        talk.detail(format_args!("{}", seen.summary()));
        if json {
            told["warnings"] = talk.warnings().into();
            tell_work(&mut told);
            print(&format!("{told}\n"))?;
        }
        Ok(())
    }

    /// Makes one of all: of regions, or of spans.
    fn composite(&self, maps: Vec<Stored>) -> Result<Stored, Failure> {
        let (mut regions, mut spans) = (Vec::new(), Vec::new());
        for map in maps {
            match map {
                Stored::Regions(seen) => regions.push(seen),
                Stored::Spans(seen) => spans.push(seen),
            }
        }
        if spans.is_empty() {
            self.select(&mut regions)?;
            let (shown, holdouts) = regions.split_at(self.maps.len());
            let seen = hold_out(shown, holdouts).map_err(|error| self.refusal(&error))?;
            return Ok(Stored::Regions(seen));
        }
        let usage = |message: &str| Err(Failure::new(Code::Usage, message));
        if !regions.is_empty() {
            return usage(
                "some of the maps hold regions and others spans on sub-scanlines; make all of them \
                 with the same --sampling",
            );
        }
        if !(self.holdout.is_empty() && self.only.is_empty() && self.without.is_empty()) {
            return usage("--holdout, --only and --without are for maps of regions, not of spans");
        }
        let seen = composite_spans(&spans).map_err(|error| self.refusal(&error))?;
        Ok(Stored::Spans(seen))
    }

    /// What the composite is made of. What only hides casts no shadow on what is shown.
    fn origin(&self, origins: Vec<Origin>, talk: &mut Talk) -> Result<Origin, Failure> {
        let sources = origins.iter().flat_map(|origin| origin.sources.clone());
        let sources = sources.collect();
        let mut embedded = Vec::new();
        let mut readings = Vec::new();
        for (origin, path) in origins.into_iter().zip(&self.maps) {
            let Some(casters) = origin.casters else {
                talk.warn(format!(
                    "{}: does not tell what casts shadows, so that the composite does not either;                      make the map again",
                    path.display()
                ));
                let casters = None;
                return Ok(Origin { sources, casters });
            };
            embedded.extend(casters.embedded);
            readings.extend(casters.readings);
        }
        let text = |names: &[ObjectNames]| -> Vec<String> {
            names.iter().map(|names| names.text().to_owned()).collect()
        };
        let choice = Choice {
            only: text(&self.only),
            without: text(&self.without),
        };
        if choice != Choice::default() {
            for scene in &mut embedded {
                let chosen = choose_objects(scene, &choice);
                chosen.map_err(|problem| Failure::new(Code::Usage, problem))?;
            }
            for reading in &mut readings {
                reading.choices.push(choice.clone());
            }
        }
        let mut embedded = match embedded.len() {
            0 | 1 => embedded.pop(),
            _ => Some(unite(&embedded.iter().collect::<Vec<_>>())),
        };
        if let Some(scene) = &mut embedded {
            self.changes.apply_to_casters(scene)?;
        }
        Ok(Origin {
            sources,
            casters: Some(Casters { embedded, readings }),
        })
    }

    /// Leaves the objects asked for in the maps; a name that no object has is an error.
    fn select(&self, maps: &mut [SeenScene]) -> Result<(), Failure> {
        let objects = || maps.iter().flat_map(|seen| &seen.scene.objects);
        for names in self.only.iter().chain(&self.without) {
            if !objects().any(|object| names.match_name(&object.name)) {
                let known = objects().map(|object| object.name.as_str());
                let help = unknown_name(names.text(), "objects", known.collect::<Vec<_>>());
                let message = format!("no object of the maps is called {:?}; {help}", names.text());
                return Err(Failure::new(Code::Missing, message));
            }
        }
        if self.only.is_empty() && self.without.is_empty() {
            return Ok(());
        }
        let is_of =
            |list: &[ObjectNames], name: &str| list.iter().any(|names| names.match_name(name));
        for seen in maps.iter_mut().take(self.maps.len()) {
            *seen = seen.selected(|name| {
                (self.only.is_empty() || is_of(&self.only, name)) && !is_of(&self.without, name)
            });
        }
        Ok(())
    }

    /// What is wrong, with the names of the files.
    fn refusal(&self, error: &CompositeError) -> Failure {
        let message = match error {
            CompositeError::OtherCamera { index, difference }
            | CompositeError::OtherWorld { index, difference }
            | CompositeError::OtherSampling { index, difference } => format!(
                "{}: cannot be composited with {}: {difference}",
                self.maps
                    .iter()
                    .chain(&self.holdout)
                    .nth(*index)
                    .unwrap_or(&self.maps[0])
                    .display(),
                self.maps[0].display()
            ),
            other => other.to_string(),
        };
        Failure::new(Code::BadInput, message)
    }
}
