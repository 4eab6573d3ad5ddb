//! Deep OpenEXR files, and flat ones with depths.
#![cfg(feature = "exr")]

mod damaged;
mod depth_pictures;
mod files;
mod guests;
mod merging;
mod scenes;

use half::f16;
use std::path::PathBuf;
use tempfile::TempDir;
use veduta_io::deep_exr::{
    Channel, DeepCompression, DeepHeader, DeepImage, DeepPixels, DeepWriter, SampleType, Samples,
};

/// All ways to pack a deep file.
const PACKINGS: [DeepCompression; 3] = [
    DeepCompression::None,
    DeepCompression::Rle,
    DeepCompression::Zips,
];

/// Numbers that repeat in every run (Knuth's multiplier).
struct Random(u64);

impl Random {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % most
    }

    /// From 0 to 1.
    fn unit(&mut self) -> f32 {
        self.below(1 << 24) as f32 / (1 << 24) as f32
    }
}

/// A file of a folder of its own.
struct OneFile {
    _folder: TempDir,
    path: PathBuf,
}

impl OneFile {
    fn new(name: &str) -> Self {
        let folder = TempDir::new().expect("a folder for the test");
        let path = folder.path().join(name);
        Self {
            _folder: folder,
            path,
        }
    }

    fn write(&self, bytes: &[u8]) {
        std::fs::write(&self.path, bytes).expect("may write in the test's folder");
    }
}

/// The channels of a name and a type each.
fn channels<const N: usize>(named: [(&str, SampleType); N]) -> Vec<Channel> {
    let channel = |(name, sample_type): (&str, SampleType)| Channel {
        name: name.to_owned(),
        sample_type,
    };
    named.map(channel).to_vec()
}

/// What the files of `files/` hold: a data window of 11 x 7 pixels from (-3, 5) on, and in it samples by
/// this formula.
fn formula() -> DeepImage {
    let mut header = DeepHeader::new(
        20,
        20,
        channels([
            ("A", SampleType::Half),
            ("R", SampleType::Half),
            ("Z", SampleType::Float),
            ("ZBack", SampleType::Float),
            ("id", SampleType::Uint),
        ]),
    );
    header.data_window.min = [-3, 5];
    header.data_window.max = [7, 11];
    let mut counts = Vec::new();
    let (mut a, mut r, mut z, mut z_back, mut id) = (vec![], vec![], vec![], vec![], vec![]);
    for y in 0..7_u32 {
        for x in 0..11_u32 {
            let count = match (x * 7 + y * 3) % 4 {
                3 => 0,
                count => count,
            };
            counts.push(count);
            for sample in 0..count {
                let depth = (x + y) as f32 + 0.25 * sample as f32;
                a.push(f16::from_f32(0.5));
                r.push(f16::from_f32(0.03125 * (x + y) as f32));
                z.push(depth);
                z_back.push(depth + 0.125);
                id.push(1000 * y + 10 * x + sample);
            }
        }
    }
    let channels = vec![
        Samples::Half(a),
        Samples::Half(r),
        Samples::Float(z),
        Samples::Float(z_back),
        Samples::Uint(id),
    ];
    DeepImage {
        header,
        pixels: DeepPixels::from_counts(11, counts, channels),
    }
}

/// The bytes of a deep file.
fn encoded(image: &DeepImage) -> Vec<u8> {
    let bytes = std::io::Cursor::new(Vec::new());
    let mut writer = DeepWriter::new(bytes, image.header.clone()).expect("memory takes all");
    writer.write(&image.pixels).expect("memory takes all");
    writer.finish().expect("memory takes all").into_inner()
}
