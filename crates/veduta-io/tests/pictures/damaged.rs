//! Picture files with damage of every small kind: each is read or refused, in bounded memory.
//!
//! `VEDUTA_DAMAGE=20` makes twenty times as many cases.

use crate::{OneFile, encoded, sample_picture};
use peak_alloc::PeakAlloc;
use veduta_io::{ExrCompression, PICTURE_SUFFIXES, PictureOptions, Samples, read_picture};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What all tests together may take: for each thread the 8 M pixels that any file may ask for, as
/// f32 and as decoded samples of up to 8 bytes a channel, and the tests' own.
const MOST_MEMORY: usize = 3 << 29;

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
}

/// How many times the usual number of cases is tried.
fn effort() -> usize {
    let asked = std::env::var("VEDUTA_DAMAGE").ok();
    asked.and_then(|number| number.parse().ok()).unwrap_or(1)
}

/// Whether the bytes are a picture; if not, the error must be one clear sentence.
fn reads(file: &OneFile, bytes: &[u8], case: &str) -> bool {
    file.write(bytes);
    match read_picture(&file.path) {
        Ok(loaded) => {
            let picture = loaded.picture;
            let pixels = picture.width as usize * picture.height as usize;
            assert!(
                pixels > 0 && picture.pixels.len() == pixels,
                "{case}: {pixels}"
            );
            true
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.contains("picture."), "{case}: {message}");
            assert!(
                message.len() < 1000 && !message.contains('\n'),
                "{case}: {message}"
            );
            false
        }
    }
}

fn damage_all_ways(suffix: &str, options: &PictureOptions) {
    let sound = encoded(suffix, &sample_picture(), options);
    let file = OneFile::new(&format!("picture.{suffix}"));
    assert!(reads(&file, &sound, "undamaged"));
    let mut refused = 0;
    let ends = 200.min(sound.len());
    for k in 0..ends {
        let end = k * sound.len() / ends;
        let case = format!("{suffix} cut at {end}");
        refused += usize::from(!reads(&file, &sound[..end], &case));
    }
    assert!(
        refused * 2 > ends,
        "{suffix}: {refused} of {ends} cuts are seen"
    );

    // Headers are where damage does most harm.
    let head = sound.len().min(400);
    let mut random = Random(suffix.len() as u64);
    refused = 0;
    let cases = 300 * effort();
    for case in 0..cases {
        let mut bytes = sound.clone();
        for _ in 0..=random.below(3) {
            let at = match random.below(4) {
                0 => random.below(bytes.len()),
                _ => random.below(head),
            };
            match random.below(4) {
                0 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random.below(5)],
                1 => bytes[at..].iter_mut().take(4).for_each(|byte| *byte = 0xff),
                _ => bytes[at] ^= 1 << random.below(8),
            }
        }
        let case = format!("{suffix} {options:?}, case {case}");
        refused += usize::from(!reads(&file, &bytes, &case));
    }
    assert!(
        refused > 0,
        "{suffix}: no damage of {cases} kinds is noticed"
    );
    let peak = MEMORY.peak_usage();
    assert!(peak < MOST_MEMORY, "{suffix}: {peak} bytes");
}

#[test]
fn damaged_pictures_are_read_or_refused() {
    for suffix in PICTURE_SUFFIXES {
        damage_all_ways(suffix, &PictureOptions::default());
    }
}

#[test]
fn damaged_pictures_of_rarer_kinds_are_read_or_refused() {
    let floats = PictureOptions {
        samples: Some(Samples::F32),
        ..PictureOptions::default()
    };
    damage_all_ways("tif", &floats);
}

#[test]
fn damaged_exr_of_all_compressions_and_layouts_is_read_or_refused() {
    use ExrCompression::{None, Piz, Rle, Zip, Zips};
    for exr_compression in [None, Rle, Zips, Zip, Piz] {
        for exr_tile in [Option::None, Some(16)] {
            for samples in [Samples::F16, Samples::F32] {
                let options = PictureOptions {
                    samples: Some(samples),
                    exr_compression,
                    exr_tile,
                    ..PictureOptions::default()
                };
                damage_all_ways("exr", &options);
            }
        }
    }
}

#[test]
fn a_header_that_asks_for_the_moon_is_refused_at_once() {
    let npy = |shape: &str| {
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes
    };
    let mut png = encoded("png", &sample_picture(), &PictureOptions::default());
    png[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    for (suffix, bytes) in [
        (
            "npy",
            npy("(18446744073709551615, 18446744073709551615, 4)"),
        ),
        ("npy", npy("(4294967295, 4294967295)")),
        ("npy", npy("(65535, 65535, 4)")),
        ("npy", npy("(4000, 4000, 4)")),
        ("pfm", b"PF\n1e30 1e30\n-1\n".to_vec()),
        ("pfm", b"PF\n65535 65535\n-1\n".to_vec()),
        ("pfm", b"PF\n-3 7\n-1\n".to_vec()),
        ("pfm", b"PF\n0 7\n-1\n".to_vec()),
        ("png", png),
    ] {
        let file = OneFile::new(&format!("picture.{suffix}"));
        let start = String::from_utf8_lossy(&bytes[..bytes.len().min(90)]).into_owned();
        assert!(!reads(&file, &bytes, &start), "{start}");
    }
}
