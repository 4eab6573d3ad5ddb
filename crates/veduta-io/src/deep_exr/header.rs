//! The header of a part: attributes, each with its name, its type and its bytes.

use super::bytes::{Bytes, shown};
use super::image::{SampleType, Window};
use super::{DeepProblem, camera_from_matrices};
use veduta::map::Camera;

/// A channel of a deep picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Its name: R, G, B, A, Z, ZBack, or any other; with layers before a dot.
    pub name: String,
    /// What it holds.
    pub sample_type: SampleType,
}

/// How chunks are packed, always without loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DeepCompression {
    /// Not at all.
    None,
    /// Runs of equal bytes.
    Rle,
    /// Deflate, each scanline alone.
    #[default]
    Zips,
}

impl DeepCompression {
    /// Its number in files.
    pub(super) fn code(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Rle => 1,
            Self::Zips => 2,
        }
    }
}

/// An attribute as it is in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attribute {
    /// Its name, such as `worldToCamera`.
    pub name: String,
    /// Its type, such as `m44f`.
    pub kind: String,
    /// Its value, little-endian.
    pub value: Vec<u8>,
}

impl Attribute {
    /// An attribute of any type.
    pub fn new(name: &str, kind: &str, value: Vec<u8>) -> Self {
        Self {
            name: name.to_owned(),
            kind: kind.to_owned(),
            value,
        }
    }
}

/// The header of a deep picture.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepHeader {
    /// The part's name; may be empty.
    pub name: String,
    /// The channels in the order of the file, which is that of their names' bytes.
    pub channels: Vec<Channel>,
    /// The pixels that the picture holds.
    pub data_window: Window,
    /// The frame. Cameras see it, whatever the data window is.
    pub display_window: Window,
    /// How it is packed.
    pub compression: DeepCompression,
    /// Width of a pixel over its height.
    pub pixel_aspect_ratio: f32,
    /// All other attributes but those that say how the file is laid out.
    pub attributes: Vec<Attribute>,
}

/// Attributes that say how the file is laid out, or are fields of [`DeepHeader`].
pub const LAYOUT_ATTRIBUTES: [&str; 12] = [
    "channels",
    "chunkCount",
    "compression",
    "dataWindow",
    "displayWindow",
    "lineOrder",
    "maxSamplesPerPixel",
    "name",
    "pixelAspectRatio",
    "tiles",
    "type",
    "version",
];

const WORLD_TO_CAMERA: &str = "worldToCamera";
const WORLD_TO_NDC: &str = "worldToNDC";

impl DeepHeader {
    /// A header for `width` x `height` pixels that fill the frame. Channels are sorted by name, as
    /// files have them.
    ///
    /// # Panics
    /// If a size is 0 or beyond 2³¹ - 1, or two channels have one name.
    pub fn new(width: u32, height: u32, mut channels: Vec<Channel>) -> Self {
        channels.sort_by(|a, b| a.name.cmp(&b.name));
        assert!(
            channels.is_sorted_by(|a, b| a.name < b.name),
            "channels have names of their own"
        );
        let window = Window::of_size(width, height);
        Self {
            name: String::new(),
            channels,
            data_window: window,
            display_window: window,
            compression: DeepCompression::default(),
            pixel_aspect_ratio: 1.0,
            attributes: Vec::new(),
        }
    }

    /// The index of a channel.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels
            .iter()
            .position(|channel| channel.name == name)
    }

    /// The types of the channels in their order.
    pub fn sample_types(&self) -> impl Iterator<Item = SampleType> {
        self.channels.iter().map(|channel| channel.sample_type)
    }

    /// Bytes of one sample in all channels.
    pub(super) fn bytes_of_sample(&self) -> usize {
        self.sample_types().map(SampleType::bytes).sum()
    }

    /// The attribute of that name.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes
            .iter()
            .find(|attribute| attribute.name == name)
    }

    /// Sets an attribute, in place of one of its name.
    pub fn set_attribute(&mut self, attribute: Attribute) {
        self.attributes.retain(|other| other.name != attribute.name);
        self.attributes.push(attribute);
    }

    /// The names of ids, packed as OpenEXR packs them (type `idmanifest`).
    pub fn id_manifest(&self) -> Option<&[u8]> {
        let manifest = self.attributes.iter().find(|a| a.kind == "idmanifest")?;
        Some(&manifest.value)
    }

    /// `worldToCamera`: from world to camera space (x right, y up, z forward), for row vectors.
    pub fn world_to_camera(&self) -> Option<[f32; 16]> {
        self.matrix(WORLD_TO_CAMERA)
    }

    /// `worldToNDC`: from the world to the unit square of the frame (x right, y down), for row vectors.
    pub fn world_to_ndc(&self) -> Option<[f32; 16]> {
        self.matrix(WORLD_TO_NDC)
    }

    fn matrix(&self, name: &str) -> Option<[f32; 16]> {
        let attribute = self.attribute(name)?;
        let (numbers, rest) = attribute.value.as_chunks::<4>();
        let numbers: [[u8; 4]; 16] = numbers.try_into().ok()?;
        (attribute.kind == "m44f" && rest.is_empty()).then(|| numbers.map(f32::from_le_bytes))
    }

    /// The camera, if the file tells it in both matrices.
    pub fn camera(&self) -> Option<Camera> {
        camera_from_matrices(&self.world_to_camera()?, &self.world_to_ndc()?)
    }

    /// Tells the camera in both matrices, which are of single precision.
    pub fn set_camera(&mut self, camera: &Camera) {
        let matrices = super::matrices_of_camera(camera);
        for (name, matrix) in [WORLD_TO_CAMERA, WORLD_TO_NDC].into_iter().zip(matrices) {
            let value = matrix.iter().flat_map(|number| number.to_le_bytes());
            self.set_attribute(Attribute::new(name, "m44f", value.collect()));
        }
    }
}

/// What the chunks of a part are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// A row of pixels each.
    Scanlines,
    /// A tile each; those of the full resolution come first.
    Tiles {
        /// Width in pixels, at least 1.
        width: u32,
        /// Height in pixels, at least 1.
        height: u32,
        /// All of them, those of smaller resolutions too.
        count: u64,
    },
}

/// A part's header, as far as it is needed to find its chunks.
#[derive(Clone, Debug)]
pub enum PartHeader {
    /// It is deep.
    Deep { header: DeepHeader, layout: Layout },
    /// It is flat, and has this many chunks.
    Flat { chunks: u64 },
}

impl PartHeader {
    /// Chunks in the part's table.
    pub fn chunk_count(&self) -> u64 {
        match self {
            Self::Flat { chunks } => *chunks,
            Self::Deep {
                layout: Layout::Tiles { count, .. },
                ..
            } => *count,
            Self::Deep { header, .. } => header.data_window.height(),
        }
    }
}

const CONVERT: &str = "write it anew with compression none, rle or zips";
const OTHER_PROGRAM: &str = "convert it with another program";

/// Reads the attributes of a part. `None` for the empty header that ends those of several parts.
///
/// `most_name` is the longest name that the file's version allows.
pub fn read_part(
    bytes: &mut Bytes,
    most_name: usize,
    several: bool,
) -> Result<Option<PartHeader>, DeepProblem> {
    let mut attributes = Vec::new();
    loop {
        let name = bytes.name(most_name, "an attribute's name")?;
        if name.is_empty() {
            break;
        }
        let kind = bytes.name(most_name, "an attribute's type")?;
        let size = bytes.i32("an attribute's size")?;
        let Ok(size) = usize::try_from(size) else {
            return Err(bytes.damaged(format!(
                "attribute {} has a size of {size} bytes",
                shown(&name)
            )));
        };
        let at = bytes.at();
        let value = bytes.take(size, "an attribute's value")?;
        attributes.push(Found {
            name,
            kind,
            at,
            value,
        });
    }
    if attributes.is_empty() {
        return Ok(None);
    }
    let found = Attributes {
        bytes: bytes.clone(),
        attributes,
    };
    found.part(several).map(Some)
}

/// An attribute and where its value is.
struct Found<'a> {
    name: String,
    kind: String,
    at: usize,
    value: &'a [u8],
}

/// The attributes of a part, with the file they are in.
struct Attributes<'a> {
    /// The file, after them.
    bytes: Bytes<'a>,
    attributes: Vec<Found<'a>>,
}

impl<'a> Attributes<'a> {
    /// The attribute of that name and type.
    fn find(&self, name: &str, kind: &str) -> Result<Option<Bytes<'a>>, DeepProblem> {
        let Some(found) = self.attributes.iter().find(|a| a.name == name) else {
            return Ok(None);
        };
        let value = self.bytes.within(found.at, found.value.len());
        if found.kind != kind {
            let other = shown(&found.kind);
            return Err(value.damaged(format!("attribute {name:?} is {other}, not {kind:?}")));
        }
        Ok(Some(value))
    }

    fn need(&self, name: &str, kind: &str) -> Result<Bytes<'a>, DeepProblem> {
        let missing = || self.bytes.damaged(format!("attribute {name:?} is missing"));
        self.find(name, kind)?.ok_or_else(missing)
    }

    fn text(&self, name: &str) -> Option<String> {
        let found = self.attributes.iter().find(|a| a.name == name)?;
        let text = String::from_utf8_lossy(found.value);
        (found.kind == "string").then(|| text.into_owned())
    }

    fn chunk_count(&self) -> Result<Option<u64>, DeepProblem> {
        let Some(mut value) = self.find("chunkCount", "int")? else {
            return Ok(None);
        };
        let count = value.i32("the number of chunks")?;
        let count = u64::try_from(count).ok();
        let error = || value.damaged("the number of chunks is negative");
        Ok(Some(count.ok_or_else(error)?))
    }

    fn part(&self, several: bool) -> Result<PartHeader, DeepProblem> {
        let is_tiled = match self.text("type").as_deref() {
            Some("deepscanline") => false,
            Some("deeptile") => true,
            Some("scanlineimage" | "tiledimage") if several => {
                let missing = || self.bytes.damaged("attribute \"chunkCount\" is missing");
                let chunks = self.chunk_count()?.ok_or_else(missing)?;
                return Ok(PartHeader::Flat { chunks });
            }
            Some(flat @ ("scanlineimage" | "tiledimage")) => {
                let what = format!("the file says that it is deep, but its part is a {flat}");
                return Err(self.bytes.damaged(what));
            }
            Some(other) => {
                let what = format!("a part of type {}", shown(other));
                return Err(self.bytes.unsupported(what, OTHER_PROGRAM));
            }
            None => return Err(self.bytes.damaged("attribute \"type\" is missing")),
        };
        if let Some(mut value) = self.find("version", "int")? {
            let version = value.i32("the version of the part")?;
            if version != 1 {
                let what = format!("deep data of version {version}");
                return Err(value.unsupported(what, OTHER_PROGRAM));
            }
        }
        let data_window = self.window("dataWindow")?;
        let header = DeepHeader {
            name: self.text("name").unwrap_or_default(),
            channels: self.channels()?,
            data_window,
            display_window: self.window("displayWindow")?,
            compression: self.compression()?,
            pixel_aspect_ratio: self.need("pixelAspectRatio", "float")?.f32("a number")?,
            attributes: self.others(),
        };
        let mut line_order = self.need("lineOrder", "lineOrder")?;
        // Chunks are found by the table, in whatever order they are.
        let order = line_order.u8("the order of lines")?;
        if order > 2 {
            return Err(line_order.damaged(format!("the order of lines is {order}, not 0, 1 or 2")));
        }
        let layout = if is_tiled {
            self.tiles(&data_window)?
        } else {
            Layout::Scanlines
        };
        let part = PartHeader::Deep { header, layout };
        match self.chunk_count()? {
            Some(told) if told != part.chunk_count() => {
                let due = part.chunk_count();
                let what = format!("{told} chunks are told, but its data window has {due}");
                Err(self.bytes.damaged(what))
            }
            _ => Ok(part),
        }
    }

    fn window(&self, name: &str) -> Result<Window, DeepProblem> {
        let mut value = self.need(name, "box2i")?;
        let min = [value.i32("a column")?, value.i32("a row")?];
        let max = [value.i32("a column")?, value.i32("a row")?];
        let window = Window { min, max };
        let most = u64::from(i32::MAX.unsigned_abs());
        if [window.width(), window.height()]
            .iter()
            .any(|size| !(1..=most).contains(size))
        {
            return Err(value.damaged(format!("{name} from {min:?} to {max:?} is no window")));
        }
        Ok(window)
    }

    fn compression(&self) -> Result<DeepCompression, DeepProblem> {
        let mut value = self.need("compression", "compression")?;
        let what = match value.u8("the compression")? {
            0 => return Ok(DeepCompression::None),
            1 => return Ok(DeepCompression::Rle),
            2 => return Ok(DeepCompression::Zips),
            3 => "deep data with compression zip".to_owned(),
            4 => "deep data with compression piz".to_owned(),
            5 => "deep data with compression pxr24".to_owned(),
            6 | 7 => "deep data with compression b44".to_owned(),
            8 | 9 => "deep data with compression dwa".to_owned(),
            10 | 11 => "deep data with compression htj2k".to_owned(),
            12 => "deep data with compression lj2k".to_owned(),
            13 => "deep data with compression zstd".to_owned(),
            other => format!("deep data with compression {other}, newer than this reader"),
        };
        Err(value.unsupported(what, CONVERT))
    }

    fn channels(&self) -> Result<Vec<Channel>, DeepProblem> {
        let mut value = self.need("channels", "chlist")?;
        let mut channels: Vec<Channel> = Vec::new();
        loop {
            let name = value.name(255, "a channel's name")?;
            if name.is_empty() {
                break;
            }
            let sample_type = match value.i32("a channel's type")? {
                0 => SampleType::Uint,
                1 => SampleType::Half,
                2 => SampleType::Float,
                other => {
                    return Err(value.damaged(format!("channel {} has type {other}", shown(&name))));
                }
            };
            value.take(4, "a channel's flags")?;
            let sampling = [value.i32("its sampling")?, value.i32("its sampling")?];
            if sampling != [1, 1] {
                let what = format!(
                    "deep channel {} with a sampling of {sampling:?}",
                    shown(&name)
                );
                return Err(value.damaged(what));
            }
            if channels.last().is_some_and(|last| last.name >= name) {
                return Err(value.damaged(format!("channel {} is out of order", shown(&name))));
            }
            channels.push(Channel { name, sample_type });
        }
        if channels.is_empty() {
            return Err(value.damaged("it has no channels"));
        }
        Ok(channels)
    }

    fn tiles(&self, window: &Window) -> Result<Layout, DeepProblem> {
        let mut value = self.need("tiles", "tiledesc")?;
        let [width, height] = [value.u32("a tile's width")?, value.u32("a tile's height")?];
        let mode = value.u8("the tiles' mode")?;
        let size = [u64::from(width), u64::from(height)];
        let most = u64::from(i32::MAX.unsigned_abs());
        if size.iter().any(|side| !(1..=most).contains(side)) {
            return Err(value.damaged(format!("tiles of {width} x {height} pixels")));
        }
        let of = [window.width(), window.height()];
        let round_up = match mode >> 4 {
            0 => false,
            1 => true,
            _ => return Err(value.damaged(format!("tiles of mode {mode:#04x}"))),
        };
        let levels = |size: u64| {
            let halvings = size.ilog2();
            u32::from(round_up && !size.is_power_of_two()) + halvings + 1
        };
        let level_size = |size: u64, level: u32| match round_up {
            false => (size >> level).max(1),
            true => size.div_ceil(1 << level),
        };
        let tiles_along = |axis: usize, level| level_size(of[axis], level).div_ceil(size[axis]);
        // At most 64 levels each way of at most 2^62 tiles: the sums saturate rather than overflow.
        let sum = |counts: &mut dyn Iterator<Item = u64>| counts.fold(0, u64::saturating_add);
        let count = match mode & 15 {
            0 => tiles_along(0, 0) * tiles_along(1, 0),
            1 => sum(&mut (0..levels(of[0].max(of[1])))
                .map(|level| tiles_along(0, level).saturating_mul(tiles_along(1, level)))),
            2 => {
                let along = |axis| sum(&mut (0..levels(of[axis])).map(|l| tiles_along(axis, l)));
                along(0).saturating_mul(along(1))
            }
            _ => return Err(value.damaged(format!("tiles of mode {mode:#04x}"))),
        };
        Ok(Layout::Tiles {
            width,
            height,
            count,
        })
    }

    /// Those that are no fields of the header.
    fn others(&self) -> Vec<Attribute> {
        let others = self
            .attributes
            .iter()
            .filter(|found| !LAYOUT_ATTRIBUTES.contains(&found.name.as_str()));
        others
            .map(|found| Attribute::new(&found.name, &found.kind, found.value.to_vec()))
            .collect()
    }
}
