//! `veduta composite`: several stored maps become one.

use super::guests::{Depths, GuestInput, kind_name};
use super::look::Look;
use super::output::Output;
use super::stored::{
    Changes, Stored, Trust, laid_on, open, refusal, refuse_filter_of_guests, refuse_place,
    tell_work,
};
use super::{tell_of_mattes, tell_of_nothing, tell_shortcomings, unknown_name};
use crate::exit::{Code, Failure};
use crate::talk::{Talk, print};
use clap::Args;
use serde_json::Value;
use std::path::{Path, PathBuf};
use veduta::composite::{Operator, composite_spans, hold_out, operate, unite};
use veduta::dice::PixelGrid;
use veduta::map::{Casters, Choice, Origin, SeenScene, SeenSpans};
use veduta::scene::Shown;
use veduta_io::{Layers, ObjectNames, choose_objects};

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
    matte: Vec<ObjectNames>,
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
            spans,
            files,
            shown,
            origins,
            told: inputs,
        } = self.read(map_place.is_some(), talk)?;
        talk.begin("compositing");
        let mut seen = if spans.is_empty() {
            self.select(&mut maps)?;
            let seen = self.composite(&maps, &files)?;
            let seen = laid_on(seen, &self.look, self.trust, |reader| reader.read())?;
            Stored::Regions(seen)
        } else {
            self.refuse_regions(&maps)?;
            let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
            let seen = composite_spans(&spans).map_err(|error| refusal(&error, &files))?;
            Stored::Spans(seen)
        };
        drop(maps);
        self.changes.apply(seen.scene_mut(), self.strict, talk)?;
        let mut told = serde_json::json!({
            "size": seen.size(),
            "inputs": inputs,
            "facesSeen": seen.faces().len(),
        });
        if let Some(place) = map_place {
            talk.begin("writing");
            let origin = self.origin(&shown, origins, talk)?;
            seen.write(place, &origin)?;
            told["output"] = place.to_string_lossy().into();
        }
        if let Some(target) = &target {
            let [width, height] = seen.size();
            let development = self.look.development(seen.scene(), self.strict, talk)?;
            let shortcomings = seen.shortcomings();
            tell_shortcomings(
                &self.inputs[0],
                seen.scene(),
                &shortcomings,
                self.strict,
                talk,
            )?;
            talk.begin("shading");
            let grid = PixelGrid::of_frame(width, height);
            let (aovs, filter) = (self.output.aovs(), self.look.filter());
            refuse_filter_of_guests(&self.inputs[0], &seen, &self.look)?;
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
            tell_of_mattes(&self.inputs[0], &layers, self.strict, talk)?;
            tell_of_nothing(&self.inputs[0], &picture, self.strict, talk)?;
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

    /// Reads all maps, then all pictures of other programs, which are seen as the maps are: with the first of
    /// the maps, since that one is shown; with none in an empty one.
    ///
    /// What they are made of is read too, if it `is_stored`.
    fn read(&self, is_stored: bool, talk: &mut Talk) -> Result<Read, Failure> {
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
            if is_stored {
                read.origins.push(map.origin()?);
            }
            read.files.push(path.to_owned());
            let seen = match Stored::read(&mut map)? {
                Stored::Regions(seen) => seen,
                Stored::Spans(seen) => {
                    let n = seen.spans.sub_scanlines_per_row();
                    let exactness = format!("sampled on {n} sub-scanlines a row");
                    read.tell(path, "spans", &exactness, talk);
                    read.spans.push(seen);
                    continue;
                }
            };
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
        read.shown = shown.iter().map(|&path| path.to_owned()).collect();
        if !read.spans.is_empty() {
            if !guests.is_empty() {
                let message = "pictures of other programs are laid between regions, not spans";
                return Err(Failure::new(Code::Usage, message));
            }
            return Ok(read);
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

    /// Fails for what spans cannot be composited with or by.
    fn refuse_regions(&self, maps: &[SeenScene]) -> Result<(), Failure> {
        let usage = |message: &str| Err(Failure::new(Code::Usage, message));
        if !maps.is_empty() {
            return usage(
                "some of the maps hold regions and others spans on sub-scanlines; make all of them \
                 with the same --sampling",
            );
        }
        let of_files = [&self.holdout, &self.inside, &self.outside, &self.atop];
        let of_names = [&self.matte, &self.only, &self.without];
        if of_files.iter().any(|list| !list.is_empty())
            || of_names.iter().any(|list| !list.is_empty())
        {
            return usage(
                "--holdout, --in, --out, --atop, --matte, --only and --without are for maps of regions, \
                 not of spans",
            );
        }
        self.look
            .refuse_background_map_of("a map is laid behind maps of regions, not of spans")
    }

    /// What the composite is made of. What only hides casts no shadow on what is shown.
    fn origin(
        &self,
        shown: &[PathBuf],
        origins: Vec<Origin>,
        talk: &mut Talk,
    ) -> Result<Origin, Failure> {
        let sources = origins.iter().flat_map(|origin| origin.sources.clone());
        let sources = sources.collect();
        let mut embedded = Vec::new();
        let mut readings = Vec::new();
        for (origin, path) in origins.into_iter().zip(shown) {
            let Some(casters) = origin.casters else {
                talk.warn(format!(
                    "{}: does not tell what casts shadows, so that the composite does not either; \
                     make the map again",
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
            self.changes.apply_unheard(scene)?;
        }
        Ok(Origin {
            sources,
            casters: Some(Casters { embedded, readings }),
        })
    }

    /// Leaves the objects asked for in the maps, and in the pictures of other programs that name theirs; a name
    /// that no object has is an error.
    fn select(&self, maps: &mut [SeenScene]) -> Result<(), Failure> {
        let options = [&self.holdout, &self.inside, &self.outside, &self.atop];
        let shown = maps.len() - options.map(Vec::len).iter().sum::<usize>();
        let objects: Vec<&str> = maps
            .iter()
            .flat_map(|seen| &seen.scene.objects)
            .map(|object| object.name.as_str())
            .collect();
        let guests = maps.iter().flat_map(|seen| &seen.guests);
        let of_guests: Vec<&str> = guests
            .flat_map(|guest| guest.objects())
            .map(String::as_str)
            .collect();
        for names in self.only.iter().chain(&self.without).chain(&self.matte) {
            let is_named = |names: &ObjectNames, list: &[&str]| {
                list.iter().any(|&name| names.match_name(name))
            };
            if !is_named(names, &objects) && !is_named(names, &of_guests) {
                let known = [&objects[..], &of_guests[..]].concat();
                let help = unknown_name(names.text(), "objects", known);
                let message = format!("no object of the maps is called {:?}; {help}", names.text());
                return Err(Failure::new(Code::Missing, message));
            }
        }
        if let Some(names) = self
            .matte
            .iter()
            .find(|names| of_guests.iter().any(|&name| names.match_name(name)))
        {
            let message = format!(
                "--matte {:?} names objects of pictures of other programs, which hide by depth only; leave \
                 them out by --without, or make the matte of a map",
                names.text()
            );
            return Err(Failure::new(Code::Unsupported, message));
        }
        let is_of =
            |list: &[ObjectNames], name: &str| list.iter().any(|names| names.match_name(name));
        if !self.matte.is_empty() {
            for seen in maps.iter_mut().take(shown) {
                let is_matte = |name: &str| is_of(&self.matte, name);
                seen.scene.show_as(Shown::Matte, is_matte);
            }
        }
        if self.only.is_empty() && self.without.is_empty() {
            return Ok(());
        }
        let is_kept = |name: &str| {
            (self.only.is_empty() || is_of(&self.only, name)) && !is_of(&self.without, name)
        };
        for seen in maps.iter_mut().take(shown) {
            *seen = seen.selected(is_kept);
        }
        Ok(())
    }
}

/// What the inputs hold.
#[derive(Default)]
struct Read {
    maps: Vec<SeenScene>,
    /// Maps of spans; with them there is no other.
    spans: Vec<SeenSpans>,
    /// Of each map its file.
    files: Vec<PathBuf>,
    /// The files of those that are shown.
    shown: Vec<PathBuf>,
    /// What they are made of, in the order of the files.
    origins: Vec<Origin>,
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
