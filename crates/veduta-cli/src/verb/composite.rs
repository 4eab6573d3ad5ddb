//! `veduta composite`: several stored maps become one.

use super::guests::{Depths, GuestInput, kind_name};
use super::look::Look;
use super::output::Output;
use super::stored::{
    Changes, Trust, laid_on, open, refusal, refuse_filter_of_guests, refuse_place, summary,
    tell_work,
};
use super::{tell_of_mattes, tell_shortcomings, unknown_name};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use crate::values::Names;
use clap::Args;
use serde_json::Value;
use std::path::{Path, PathBuf};
use veduta::composite::{Operator, hold_out, operate};
use veduta::dice::PixelGrid;
use veduta::map::SeenScene;
use veduta::map::file::Source;
use veduta::pipeline;
use veduta::scene::Shown;
use veduta_io::{Layers, write_map};

/// Put stored maps, and pictures of other programs, together by depth
///
/// Maps of one camera become one map, or a picture of it: what is nearer hides what is farther, also
/// where surfaces pass through one another, with edges as exact as if all had been rendered together.
/// Of surfaces in one plane that of the higher priority is seen, else that of the first name.
///
/// Pictures of other programs are deep OpenEXR, OpenEXR with a depth in each pixel, and any picture at a
/// depth, such as card.png@12m. Their samples fill their pixels: our surfaces cut them exactly, by outline
/// and by depth, and are seen through them. Where a file tells its camera, it must be that of the maps.
///
/// Then, if asked for, the operators of Porter & Duff: of what the maps show that is kept which lies where
/// another map shows something (--in), where it shows nothing (--out), or the first on that other
/// map (--atop). Areas are exact, and depth plays no part. At last all is laid on --background.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Composite {
    /// Stored maps: .veduta; pictures of other programs: .exr, or any picture at a depth, FILE@DEPTH
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// A map that only hides: where it is seen nothing is, and the picture has a hole of its exact
    /// shape. May be given several times
    #[arg(long, value_name = "MAP")]
    holdout: Vec<PathBuf>,
    /// Keep what lies where this map shows something, nearer or not; where one of them does, if it is
    /// given several times
    #[arg(long = "in", value_name = "MAP", conflicts_with = "atop")]
    inside: Vec<PathBuf>,
    /// Keep what lies where this map shows nothing. May be given several times
    #[arg(long = "out", value_name = "MAP", conflicts_with = "atop")]
    outside: Vec<PathBuf>,
    /// Show this map, and on it what lies where it shows something, nearer or not. May be given several
    /// times
    #[arg(long, value_name = "MAP")]
    atop: Vec<PathBuf>,
    /// Let the objects of these names hide what is behind them, but give nothing themselves: a hole of
    /// their shape. What is not opaque hides nothing. Names match with *, ** and ?. May be given several
    /// times
    #[arg(long, value_name = "NAME")]
    matte: Vec<Names>,
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
    trust: Trust,
    #[command(flatten)]
    depths: Depths,
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
  The town where the hut is seen, where it is not, and over the hut's own shape:
      veduta composite seen.veduta --in hut.veduta -o inside.png
      veduta composite seen.veduta --out hut.veduta -o outside.png
      veduta composite seen.veduta --atop hut.veduta -o atop.png
  The town before the hut, which lies behind all of it:
      veduta composite seen.veduta --background hut.veduta -o before.png
  The town with a picture of another program among its houses, and one at 11 metres:
      veduta render hut.obj --eye 9,-9,5 --look-at 0,0,0 -o pic.exr --aov depth
      veduta render hut.obj --eye 9,-9,5 --look-at 0,0,0 -o card.png
      veduta composite seen.veduta pic.exr --depth-kind planar -o among.png
      veduta composite seen.veduta card.png@11m -o card-in-town.png
";

impl Composite {
    pub fn run(&self, force: bool, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        let map_place = self.output.map_place();
        let target = match map_place {
            Some(place) => {
                refuse_place(place, force)?;
                None
            }
            None => self.output.target(&self.inputs[0], json)?,
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
        let Read {
            mut maps,
            files,
            sources,
            told: inputs,
        } = self.read(talk)?;
        self.select(&mut maps)?;
        talk.begin("compositing");
        let mut seen = self.composite(&maps, &files)?;
        drop(maps);
        seen = laid_on(seen, &self.look, self.trust, |reader| reader.read())?;
        self.changes.apply(&mut seen.scene, self.strict, talk)?;
        let mut told = serde_json::json!({
            "size": seen.size,
            "inputs": inputs,
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
            tell_shortcomings(
                &self.inputs[0],
                &seen.scene,
                &shortcomings,
                self.strict,
                talk,
            )?;
            talk.begin("shading");
            let grid = PixelGrid::of_frame(width, height);
            let (aovs, filter) = (self.output.aovs(), self.look.filter());
            refuse_filter_of_guests(&self.inputs[0], &seen, &self.look)?;
            let unlit = self.look.unlit;
            let (mut picture, aovs) = pipeline::render_seen(&seen, &grid, unlit, filter, aovs);
            let layers = Layers {
                aovs: &aovs,
                scene: &seen.scene,
                camera: &seen.map.camera,
                grid,
            };
            tell_of_mattes(&self.inputs[0], &layers, self.strict, talk)?;
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

    /// Reads all maps, then all pictures of other programs, which are seen as the maps are: with the first of
    /// the maps, since that one is shown; with none in an empty one.
    fn read(&self, talk: &mut Talk) -> Result<Read, Failure> {
        talk.begin("reading");
        let mut pictures = Vec::new();
        let mut shown: Vec<&Path> = Vec::new();
        for input in &self.inputs {
            match GuestInput::of(input)? {
                Some(picture) => pictures.push(picture),
                None => shown.push(input),
            }
        }
        let operands = [&self.holdout, &self.inside, &self.outside, &self.atop];
        let operands = operands.into_iter().flatten().map(PathBuf::as_path);
        let files: Vec<&Path> = shown.iter().copied().chain(operands).collect();
        let mut read = Read::default();
        let all = files.len() + pictures.len();
        for (index, &path) in files.iter().enumerate() {
            talk.part(index, all);
            let mut map = open(path)?;
            for source in map.reader().sources() {
                if !read.sources.contains(source) {
                    read.sources.push(source.clone());
                }
            }
            let seen = map.read(|reader| reader.read())?;
            let seen = match read.maps.first() {
                Some(first) => self.trust.apply(path, seen, first)?,
                None => seen,
            };
            read.tell(path, "map", "exact", talk);
            for guest in &seen.guests {
                read.tell(
                    Path::new(guest.name()),
                    kind_name(guest.kind()),
                    guest.kind().exactness(),
                    talk,
                );
            }
            read.files.push(path.to_owned());
            read.maps.push(seen);
        }
        let mut camera = read.maps.first().map(|seen| seen.map.camera);
        let mut guests = Vec::new();
        for (index, picture) in pictures.iter().enumerate() {
            talk.part(files.len() + index, all);
            let loaded =
                self.depths
                    .read(picture, camera, self.trust.camera(), self.strict, talk)?;
            camera.get_or_insert(loaded.camera);
            let kind = loaded.guest.kind();
            read.tell(&picture.path, kind_name(kind), kind.exactness(), talk);
            guests.push(loaded.guest);
        }
        if shown.is_empty() {
            let camera = camera.expect("an input is a map or has told a camera");
            let size = guests.first().map_or([1, 1], |guest| guest.grid().frame);
            read.files.insert(0, self.inputs[0].clone());
            read.maps.insert(0, SeenScene::of_nothing(camera, size));
        }
        read.maps[0].guests.extend(guests);
        Ok(read)
    }

    /// What becomes of the maps of `files`: those that are shown, then those that are told by options.
    fn composite(&self, maps: &[SeenScene], files: &[PathBuf]) -> Result<SeenScene, Failure> {
        let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
        let options = [&self.holdout, &self.inside, &self.outside, &self.atop];
        let shown = maps.len() - options.map(Vec::len).iter().sum::<usize>();
        let (depth, rest) = maps.split_at(shown + self.holdout.len());
        let (shown, holdouts) = depth.split_at(shown);
        let mut seen = hold_out(shown, holdouts).map_err(|error| refusal(&error, &files))?;
        let (inside, rest) = rest.split_at(self.inside.len());
        let (outside, atop) = rest.split_at(self.outside.len());
        let mut first = depth.len();
        for (operator, others) in [
            (Operator::In, inside),
            (Operator::Out, outside),
            (Operator::Atop, atop),
        ] {
            if !others.is_empty() {
                seen = operate(&seen, operator, others).map_err(|error| {
                    let of_others = &files[first..first + others.len()];
                    refusal(&error, &[&files[..1], of_others].concat())
                })?;
            }
            first += others.len();
        }
        Ok(seen)
    }

    /// Leaves the objects asked for in the maps; a name that no object has is an error.
    fn select(&self, maps: &mut [SeenScene]) -> Result<(), Failure> {
        let options = [&self.holdout, &self.inside, &self.outside, &self.atop];
        let shown = maps.len() - options.map(Vec::len).iter().sum::<usize>();
        let objects = || maps.iter().flat_map(|seen| &seen.scene.objects);
        for names in self.only.iter().chain(&self.without).chain(&self.matte) {
            if !objects().any(|object| names.match_name(&object.name)) {
                let known = objects().map(|object| object.name.as_str());
                let help = unknown_name(names.text(), "objects", known.collect::<Vec<_>>());
                let message = format!("no object of the maps is called {:?}; {help}", names.text());
                return Err(Failure::new(Code::Missing, message));
            }
        }
        let is_of = |list: &[Names], name: &str| list.iter().any(|names| names.match_name(name));
        if !self.matte.is_empty() {
            for seen in maps.iter_mut().take(shown) {
                let is_matte = |name: &str| is_of(&self.matte, name);
                seen.scene.show_as(Shown::Matte, is_matte);
            }
        }
        if self.only.is_empty() && self.without.is_empty() {
            return Ok(());
        }
        for seen in maps.iter_mut().take(shown) {
            *seen = seen.selected(|name| {
                (self.only.is_empty() || is_of(&self.only, name)) && !is_of(&self.without, name)
            });
        }
        Ok(())
    }
}

/// What the inputs hold.
#[derive(Default)]
struct Read {
    maps: Vec<SeenScene>,
    /// Of each map its file.
    files: Vec<PathBuf>,
    sources: Vec<Source>,
    /// What is told of each input.
    told: Vec<Value>,
}

impl Read {
    fn tell(&mut self, file: &Path, kind: &str, exactness: &str, talk: &mut Talk) {
        talk.detail(format_args!("{}: {kind}, {exactness}", file.display()));
        self.told.push(serde_json::json!({
            "file": file.to_string_lossy(),
            "kind": kind,
            "exactness": exactness,
        }));
    }
}
