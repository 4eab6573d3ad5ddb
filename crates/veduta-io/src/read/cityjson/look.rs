//! What surfaces look like: the file's appearance, else a colour for each kind of surface and object.

use super::document::{Appearance, Document, Geometry, Ordered, Texture};
use super::nested::Item;
use crate::read::error::{Fault, Place, Problem, Warnings};
use crate::read::files::{ReadFiles, shortened};
use crate::read::picture::PictureDecoder;
use crate::tone::linear_from_srgb;
use std::collections::HashMap;
use std::path::Path;
use veduta::map::MaterialId;
use veduta::scene::{AlphaMode, Image, ImageId, Material, TextureRef, Wrap};

/// The materials and pictures of a scene in the making.
pub struct Look<'a> {
    folder: &'a Path,
    pub materials: Vec<Material>,
    pub images: Vec<Image>,
    material_of_name: HashMap<String, Vec<MaterialId>>,
    decoder: PictureDecoder,
    /// Pictures by name; nothing for those that cannot be had.
    decoded: HashMap<String, Option<ImageId>>,
    /// The files of pictures.
    pub files: ReadFiles,
    /// How many pictures cannot be had, and why the first.
    lost: Option<(usize, String)>,
}

/// Materials of one name that a new one is compared with. Without a bound, many would cost their
/// square.
const MOST_ALIKE: usize = 64;

/// The look of one document: of its appearance, what has been made a material already.
pub struct DocumentLook<'d> {
    appearance: &'d Appearance,
    materials: Vec<Option<MaterialId>>,
    textures: Vec<Option<Option<MaterialId>>>,
}

/// The material and texture themes of one geometry.
pub struct GeometryLook<'d> {
    whole: Option<u64>,
    pub materials: Item<'d>,
    pub textures: Item<'d>,
}

impl<'d> DocumentLook<'d> {
    pub fn new(document: &'d Document, none: &'d Appearance) -> Self {
        let appearance = document.appearance.as_ref().unwrap_or(none);
        Self {
            appearance,
            materials: vec![None; appearance.materials.len()],
            textures: vec![None; appearance.textures.len()],
        }
    }

    /// Chooses the appearance's default theme, else the first of the geometry.
    pub fn of(&self, geometry: &'d Geometry) -> GeometryLook<'d> {
        let appearance = self.appearance;
        let material = theme(&geometry.material, &appearance.default_material_theme);
        let texture = theme(&geometry.texture, &appearance.default_texture_theme);
        GeometryLook {
            whole: material.and_then(|material| material.value),
            materials: material.map_or(Item::Nothing, |material| material.values.item()),
            textures: texture.map_or(Item::Nothing, |texture| texture.values.item()),
        }
    }

    /// Texture coordinates from the top left.
    pub fn texcoord(&self, index: u32) -> Option<[f64; 2]> {
        // CityJSON has (0, 0) at the bottom left of the picture.
        let uv = self.appearance.texture_vertices.get(index as usize);
        uv.map(|&[u, v]| [u, 1.0 - v])
    }

    pub fn texcoord_count(&self) -> usize {
        self.appearance.texture_vertices.len()
    }
}

fn theme<'d, T>(themes: &'d Option<Ordered<T>>, default: &Option<String>) -> Option<&'d T> {
    let themes = &themes.as_ref()?.0;
    let is_default = |(name, _): &&(String, T)| Some(name) == default.as_ref();
    let chosen = themes.iter().find(is_default).or(themes.first());
    chosen.map(|(_, theme)| theme)
}

impl<'a> Look<'a> {
    /// Without materials yet; pictures are looked for in `folder`.
    pub fn new(folder: &'a Path) -> Self {
        Self {
            folder,
            materials: Vec::new(),
            images: Vec::new(),
            material_of_name: HashMap::new(),
            decoder: PictureDecoder::new(),
            decoded: HashMap::new(),
            files: ReadFiles::default(),
            lost: None,
        }
    }

    /// The material of the document's texture `index`; none if its picture cannot be had.
    pub fn textured(
        &mut self,
        look: &mut DocumentLook<'_>,
        index: u32,
    ) -> Result<Option<MaterialId>, Problem> {
        let count = look.textures.len();
        let Some(known) = look.textures.get_mut(index as usize) else {
            return Err(no_such("texture", index.into(), count));
        };
        if let Some(known) = *known {
            return Ok(known);
        }
        let texture = &look.appearance.textures[index as usize];
        let material = self.image(&texture.image).map(|image| {
            let mut reference = TextureRef::new(image);
            reference.wrap = [wrap(texture); 2];
            self.material(Material {
                name: texture.image.replace('/', "_"),
                base_color: [1.0; 4],
                base_color_texture: Some(reference),
                ..Material::default()
            })
        });
        *known = Some(material);
        Ok(material)
    }

    /// The material of a surface without texture: that which its geometry's theme names, else that
    /// of its `kind`.
    pub fn plain(
        &mut self,
        look: &mut DocumentLook<'_>,
        geometry: &GeometryLook<'_>,
        value: Item<'_>,
        kind: &str,
    ) -> Result<MaterialId, Problem> {
        let Some(index) = geometry.whole.or(value.number().map(u64::from)) else {
            return Ok(self.of_kind(kind));
        };
        let count = look.materials.len();
        let place = usize::try_from(index).unwrap_or(usize::MAX);
        let Some(known) = look.materials.get_mut(place) else {
            return Err(no_such("material", index, count));
        };
        if let Some(known) = *known {
            return Ok(known);
        }
        let found = &look.appearance.materials[place];
        let color = |color: [f64; 3]| color.map(|c| c.clamp(0.0, 1.0) as f32);
        // The habit of X3D, from which these materials come.
        let [r, g, b] = color(found.diffuse.unwrap_or([0.8; 3]));
        let opacity = 1.0 - found.transparency.clamp(0.0, 1.0) as f32;
        let material = self.material(Material {
            name: found.name.replace('/', "_"),
            base_color: [r, g, b, opacity],
            emissive: color(found.emissive.unwrap_or([0.0; 3])),
            alpha_mode: if opacity < 1.0 {
                AlphaMode::Blend
            } else {
                AlphaMode::Opaque
            },
            ..Material::default()
        });
        *known = Some(material);
        Ok(material)
    }

    /// The material for a kind of surface or object.
    fn of_kind(&mut self, kind: &str) -> MaterialId {
        let [r, g, b] = color_of(kind).map(|byte| linear_from_srgb(f32::from(byte) / 255.0));
        self.material(Material {
            name: shortened(kind).replace('/', "_"),
            base_color: [r, g, b, 1.0],
            ..Material::default()
        })
    }

    /// The row of a material; equal ones share a row.
    fn material(&mut self, material: Material) -> MaterialId {
        let ids = match self.material_of_name.get_mut(&material.name) {
            Some(ids) => ids,
            None => self
                .material_of_name
                .entry(material.name.clone())
                .or_default(),
        };
        let mut alike = ids.iter().take(MOST_ALIKE);
        let known = alike.find(|id| self.materials[id.index()] == material);
        if let Some(&known) = known {
            return known;
        }
        let id = MaterialId::from_index(self.materials.len());
        ids.push(id);
        self.materials.push(material);
        id
    }

    fn image(&mut self, name: &str) -> Option<ImageId> {
        if let Some(&known) = self.decoded.get(name) {
            return known;
        }
        let decoded = if name.contains("://") {
            Err("is not a path to a file; download it and put it beside the model".into())
        } else {
            self.files
                .read(&self.folder.join(name))
                .map_err(|error| format!("cannot be read: {}", crate::reason(&error)))
                .and_then(|bytes| self.decoder.decode(name, &bytes))
        };
        let image = match decoded {
            Ok(image) => {
                self.images.push(image);
                Some(ImageId(self.images.len() as u32 - 1))
            }
            Err(why) => {
                let why = format!("the texture {:?} {why}", shortened(name));
                self.lost.get_or_insert((0, why)).0 += 1;
                None
            }
        };
        self.decoded.insert(name.to_owned(), image);
        image
    }

    /// Warns of pictures that cannot be had, in one sentence: there may be thousands.
    pub fn report(&self, warnings: &mut Warnings) {
        if let Some((count, first)) = &self.lost {
            let others = match count - 1 {
                0 => String::new(),
                others => format!(", nor can {others} others"),
            };
            let message = format!("{first}{others}; plain colours are shown");
            warnings.add(Place::Whole, message);
        }
    }
}

pub fn no_such(what: &'static str, index: u64, count: usize) -> Problem {
    Problem::NoSuch { what, index, count }
}

/// A problem in a document, at a path into it.
pub fn at(problem: Problem, path: impl FnOnce() -> String) -> Fault {
    problem.at(Place::Json(path()))
}

fn wrap(texture: &Texture) -> Wrap {
    match texture.wrap_mode.as_deref() {
        Some("mirror") => Wrap::Mirror,
        // A border colour of its own cannot be told from the picture's edge from afar.
        Some("clamp" | "border" | "none") => Wrap::Clamp,
        _ => Wrap::Repeat,
    }
}

/// A colour (sRGB) for a kind of semantic surface or city object: those of a Dutch town on a fair day.
///
/// Told apart at a glance are roofs, walls, water, greenery, roads and other ground. Kinds of
/// extensions are shown in light grey.
fn color_of(kind: &str) -> [u8; 3] {
    match kind {
        "RoofSurface" => [0xb4, 0x5d, 0x43],
        "WallSurface" | "Building" | "BuildingPart" | "BuildingStorey" | "BuildingUnit" => {
            [0xe2, 0xd6, 0xc0]
        }
        "InteriorWallSurface" | "CeilingSurface" | "BuildingRoom" => [0xee, 0xe9, 0xdf],
        "FloorSurface" | "BuildingFurniture" => [0xb0, 0x8d, 0x66],
        "GroundSurface" | "OuterFloorSurface" | "OuterCeilingSurface" => [0x9a, 0x92, 0x86],
        "Window" => [0x5d, 0x7b, 0x90],
        "Door" => [0x7c, 0x54, 0x38],
        "BuildingInstallation" | "BuildingConstructiveElement" | "ClosureSurface" => {
            [0xcf, 0xc4, 0xb1]
        }
        "Road" | "TrafficArea" => [0x74, 0x74, 0x7a],
        "AuxiliaryTrafficArea" | "TransportSquare" => [0xa8, 0xa3, 0x99],
        "TransportationMarking" => [0xf0, 0xf0, 0xee],
        "TransportationHole" => [0x50, 0x4e, 0x4c],
        "Railway" => [0x6a, 0x60, 0x59],
        "WaterBody" | "WaterSurface" | "Waterway" | "WaterClosureSurface" => [0x5b, 0x92, 0xbf],
        "WaterGroundSurface" => [0x6d, 0x77, 0x6a],
        "PlantCover" => [0x6f, 0x9b, 0x4d],
        "SolitaryVegetationObject" => [0x4e, 0x7d, 0x39],
        "LandUse" => [0xbc, 0xb9, 0x88],
        "TINRelief" => [0xa4, 0xa8, 0x7d],
        _ if kind.starts_with("Bridge") => [0xb8, 0xaf, 0xa1],
        _ if kind.starts_with("Tunnel") => [0x8c, 0x88, 0x83],
        "OtherConstruction" => [0xc6, 0xba, 0xa7],
        "CityFurniture" => [0x6d, 0x6d, 0x73],
        _ => [0xb9, 0xb6, 0xb2],
    }
}
