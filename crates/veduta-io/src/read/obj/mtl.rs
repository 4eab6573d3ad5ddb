//! Material libraries of OBJ files.
//!
//! Kept are `Kd`, `Ke`, `d` or `Tr`, and `map_Kd` with its offset, scale and clamp. Colours are
//! linear. Faces are seen from both sides: OBJ knows no back.

use crate::read::error::{Place, Problem, Warnings};
use crate::read::files::ReadFiles;
use crate::read::picture::PictureDecoder;
use crate::read::text::{Tokens, text};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use veduta::scene::{AlphaMode, Image, ImageId, Material, TextureRef, Wrap};
use veduta_geometry::Vec2;

/// The materials of an OBJ file's libraries, by name.
pub struct Library<'a> {
    folder: &'a Path,
    entries: HashMap<String, Entry>,
    decoder: PictureDecoder,
    /// Pictures by path; nothing for those that cannot be had, which has been warned of.
    decoded: HashMap<PathBuf, Option<ImageId>>,
    /// The pictures decoded so far.
    pub images: Vec<Image>,
    /// The files of libraries and pictures.
    pub files: ReadFiles,
}

/// A material as its library says.
#[derive(Clone, Debug)]
struct Entry {
    diffuse: [f64; 3],
    emission: [f64; 3],
    opacity: f64,
    map: Option<Map>,
}

/// `map_Kd`.
#[derive(Clone, Debug)]
struct Map {
    name: String,
    offset: [f64; 2],
    scale: [f64; 2],
    clamp: bool,
    /// Where it is asked for.
    library: PathBuf,
    line: u64,
}

impl<'a> Library<'a> {
    /// Without materials; names of files are relative to `folder`.
    pub fn new(folder: &'a Path) -> Self {
        Self {
            folder,
            entries: HashMap::new(),
            decoder: PictureDecoder::new(),
            decoded: HashMap::new(),
            images: Vec::new(),
            files: ReadFiles::default(),
        }
    }

    /// Adds the materials of `names`, the rest of a `mtllib` line: one name with spaces in it, or
    /// several. `line` is its place in the OBJ file. A library that is not there is warned of.
    pub fn add(&mut self, names: &str, line: u64, warnings: &mut Warnings) {
        match find(&mut self.files, self.folder, names) {
            Ok((path, bytes)) => self.parse(&path, &bytes, warnings),
            Err(_) if names.contains(' ') => {
                for name in names.split_whitespace() {
                    self.add(name, line, warnings);
                }
            }
            Err(error) => {
                let message = format!(
                    "the material library {names:?} cannot be read: {}; plain colours are shown",
                    crate::reason(&error)
                );
                warnings.add(Place::Line(line), message);
            }
        }
    }

    /// Reads a library. Lines that are wrong are warned of and left out.
    fn parse(&mut self, path: &Path, bytes: &[u8], warnings: &mut Warnings) {
        let mut name = None;
        for (line, number) in bytes.split(|&byte| byte == b'\n').zip(1..) {
            let mut tokens = Tokens(line);
            let Some(keyword) = tokens.next() else {
                continue;
            };
            if keyword == b"newmtl" {
                let entry_name = text(tokens).replace('/', "_");
                self.entries.insert(entry_name.clone(), Entry::default());
                name = Some(entry_name);
                continue;
            }
            let Some(entry) = name.as_ref().and_then(|name| self.entries.get_mut(name)) else {
                continue;
            };
            let read = match keyword.to_ascii_lowercase().as_slice() {
                b"map_kd" => entry.read_map(tokens, path, number),
                b"kd" => color(tokens).map(|color| entry.diffuse = color),
                b"ke" => color(tokens).map(|color| entry.emission = color),
                b"d" => {
                    // `d -halo 0.5`: the option changes opacity with the angle.
                    let mut skipped = Tokens(tokens.0);
                    if skipped.next() == Some(b"-halo") {
                        tokens = skipped;
                    }
                    unit(tokens).map(|opacity| entry.opacity = opacity)
                }
                b"tr" => unit(tokens).map(|opacity| entry.opacity = 1.0 - opacity),
                b"map_d" => {
                    let message = "opacity maps are not supported; left out";
                    warnings.add_in(path.to_owned(), Place::Line(number), message);
                    Ok(())
                }
                _ => Ok(()),
            };
            if let Err(problem) = read {
                let message = format!("{problem}; the line is left out");
                warnings.add_in(path.to_owned(), Place::Line(number), message);
            }
        }
    }

    /// The material called `name`, its picture decoded; `None` if no library has it.
    pub fn material(&mut self, name: &str, warnings: &mut Warnings) -> Option<Material> {
        let entry = self.entries.get(name)?.clone();
        let texture = entry
            .map
            .as_ref()
            .and_then(|map| self.texture(map, warnings));
        let mut diffuse = entry.diffuse;
        if texture.is_some() && diffuse == [0.0; 3] {
            // Exporters that take the map to replace the colour leave it black.
            diffuse = [1.0; 3];
        }
        let [r, g, b] = diffuse.map(|c| c as f32);
        Some(Material {
            name: name.to_owned(),
            base_color: [r, g, b, entry.opacity as f32],
            base_color_texture: texture,
            emissive: entry.emission.map(|c| c as f32),
            alpha_mode: if entry.opacity < 1.0 {
                AlphaMode::Blend
            } else {
                AlphaMode::Opaque
            },
            ..Material::default()
        })
    }

    fn texture(&mut self, map: &Map, warnings: &mut Warnings) -> Option<TextureRef> {
        let path = self.folder.join(&map.name);
        let image = match self.decoded.get(&path) {
            Some(&known) => known,
            None => {
                let decoded = find(&mut self.files, self.folder, &map.name)
                    .map_err(|error| format!("cannot be read: {}", crate::reason(&error)))
                    .and_then(|(_, bytes)| self.decoder.decode(&map.name, &bytes));
                let image = match decoded {
                    Ok(image) => {
                        self.images.push(image);
                        Some(ImageId(self.images.len() as u32 - 1))
                    }
                    Err(message) => {
                        let message = format!(
                            "the texture {:?} {message}; the plain colour is shown",
                            map.name
                        );
                        warnings.add_in(map.library.clone(), Place::Line(map.line), message);
                        None
                    }
                };
                self.decoded.insert(path, image);
                image
            }
        };
        let mut texture = TextureRef::new(image?);
        if map.clamp {
            texture.wrap = [Wrap::Clamp; 2];
        }
        // With v counted from the bottom the map says v' = s v + o; with v counted from the top
        // 1 - v' = s (1 - v) + o.
        let [scale_u, scale_v] = map.scale;
        texture.scale = Vec2::new(scale_u as f32, scale_v as f32);
        texture.offset = Vec2::new(map.offset[0] as f32, (1.0 - scale_v - map.offset[1]) as f32);
        Some(texture)
    }
}

impl Default for Entry {
    fn default() -> Self {
        let [r, g, b, _] = Material::default().base_color.map(f64::from);
        Self {
            diffuse: [r, g, b],
            emission: [0.0; 3],
            opacity: 1.0,
            map: None,
        }
    }
}

impl Entry {
    /// `map_Kd -option value… name with spaces.png`
    fn read_map(
        &mut self,
        mut tokens: Tokens<'_>,
        library: &Path,
        line: u64,
    ) -> Result<(), Problem> {
        let mut map = Map {
            name: String::new(),
            offset: [0.0; 2],
            scale: [1.0; 2],
            clamp: false,
            library: library.to_owned(),
            line,
        };
        loop {
            let mut after = Tokens(tokens.0);
            match after.next() {
                Some(b"-o") => map.offset = up_to_three(&mut after, 0.0)?,
                Some(b"-s") => map.scale = up_to_three(&mut after, 1.0)?,
                Some(b"-t") => {
                    up_to_three(&mut after, 0.0)?;
                }
                Some(b"-clamp") => map.clamp = after.next() == Some(b"on"),
                Some(b"-mm") => {
                    after.next();
                    after.next();
                }
                Some(
                    b"-blendu" | b"-blendv" | b"-cc" | b"-bm" | b"-boost" | b"-texres"
                    | b"-imfchan" | b"-type",
                ) => {
                    after.next();
                }
                _ => break,
            }
            tokens = after;
        }
        map.name = text(tokens);
        if map.name.is_empty() {
            return Err(Problem::Lacks("name of a picture"));
        }
        self.map = Some(map);
        Ok(())
    }
}

/// One to three numbers, of which the third, for solid textures, is dropped.
fn up_to_three(tokens: &mut Tokens<'_>, absent: f64) -> Result<[f64; 2], Problem> {
    let mut values = [tokens.number("a number")?, absent];
    for place in 1..3 {
        let mut after = Tokens(tokens.0);
        let Ok(value) = after.number("a number") else {
            break;
        };
        if let Some(slot) = values.get_mut(place) {
            *slot = value;
        }
        *tokens = after;
    }
    Ok(values)
}

/// A colour: three numbers of at least 0, or one for grey.
fn color(mut tokens: Tokens<'_>) -> Result<[f64; 3], Problem> {
    let red = tokens.number("a colour of one or three numbers")?;
    let green = tokens.number_or(red)?;
    let blue = tokens.number_or(green)?;
    Ok([red, green, blue].map(|c| c.clamp(0.0, f64::from(f32::MAX))))
}

fn unit(mut tokens: Tokens<'_>) -> Result<f64, Problem> {
    Ok(tokens.number("a number from 0 to 1")?.clamp(0.0, 1.0))
}

/// Reads the file called `name`, as written or as the writer's system would have meant it.
fn find(files: &mut ReadFiles, folder: &Path, name: &str) -> std::io::Result<(PathBuf, Vec<u8>)> {
    let path = folder.join(name);
    let first = files.read(&path);
    let error = match first {
        Ok(bytes) => return Ok((path, bytes)),
        Err(error) => error,
    };
    let slashed = name.replace('\\', "/");
    // The whole path may be of another machine; the file itself is then often beside the model.
    let last = slashed.rsplit('/').next().unwrap_or_default().to_owned();
    for other in [slashed, last] {
        let path = folder.join(other);
        if let Ok(bytes) = files.read(&path) {
            return Ok((path, bytes));
        }
    }
    Err(error)
}
