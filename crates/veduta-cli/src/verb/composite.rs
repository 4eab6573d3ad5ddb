//! `veduta composite`: several stored maps become one.

use super::look::Look;
use super::output::Output;
use super::stored::{Changes, open, refuse_place, summary, tell_work};
use super::{tell_of_mattes, tell_shortcomings, unknown_name};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use crate::values::Names;
use clap::Args;
use std::path::PathBuf;
use veduta::composite::{CompositeError, hold_out};
use veduta::dice::PixelGrid;
use veduta::map::SeenScene;
use veduta::map::file::Source;
use veduta::pipeline;
use veduta_io::{Layers, write_map};

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
    only: Vec<Names>,
    /// Leave out the objects of these names: where they were seen, nothing of their map is. May be given
    /// several times
    #[arg(long, value_name = "NAME")]
    without: Vec<Names>,
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
        let mut maps: Vec<SeenScene> = Vec::new();
        let mut sources: Vec<Source> = Vec::new();
        talk.begin("reading");
        for (index, path) in self.maps.iter().chain(&self.holdout).enumerate() {
            talk.part(index, self.maps.len() + self.holdout.len());
            let mut map = open(path)?;
            for source in map.reader().sources() {
                if !sources.contains(source) {
                    sources.push(source.clone());
                }
            }
            maps.push(map.read(|reader| reader.read())?);
        }
        self.select(&mut maps)?;
        talk.begin("compositing");
        let (shown, holdouts) = maps.split_at(self.maps.len());
        let mut seen = hold_out(shown, holdouts).map_err(|error| self.refusal(&error))?;
        self.changes.apply(&mut seen.scene, self.strict, talk)?;
        let mut told = serde_json::json!({
            "size": seen.size,
            "maps": maps.len(),
            "facesSeen": seen.map.faces.len(),
        });
        if let Some(place) = map_place {
            talk.begin("writing");
            write_map(place, &seen, &sources)?;
            told["output"] = place.to_string_lossy().into();
        }
        if let Some(target) = &target {
            let [width, height] = seen.size;
            let development = self.look.development(&seen.scene, self.strict, talk)?;
            let shortcomings = pipeline::shortcomings(&seen.scene, &seen.map);
            tell_shortcomings(&self.maps[0], &seen.scene, &shortcomings, self.strict, talk)?;
            talk.begin("shading");
            let grid = PixelGrid::of_frame(width, height);
            let (aovs, filter) = (self.output.aovs(), self.look.filter());
            let unlit = self.look.unlit;
            let (mut picture, aovs) =
                pipeline::render_channels(&seen.scene, &seen.map, &grid, unlit, filter, aovs);
            let layers = Layers {
                aovs: &aovs,
                scene: &seen.scene,
                camera: &seen.map.camera,
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
        talk.detail(format_args!("{}", summary(&seen)));
        if json {
            told["warnings"] = talk.warnings().into();
            tell_work(&mut told);
            print(&format!("{told}\n"))?;
        }
        Ok(())
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
        let is_of = |list: &[Names], name: &str| list.iter().any(|names| names.match_name(name));
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
            | CompositeError::OtherWorld { index, difference } => format!(
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
