//! Deep files with damage of every small kind: each is read or refused, in bounded memory.
//!
//! `VEDUTA_DAMAGE=20` makes twenty times as many cases.

use crate::{OneFile, PACKINGS, Random, depth_pictures, encoded, formula};
use peak_alloc::PeakAlloc;
use veduta_io::deep_exr::{DeepFile, DeepProblem};
use veduta_io::depth_picture::{DepthOptions, read_depth_picture};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What all tests together may take: the 256 MiB that any file may unpack to, and the scenes of the
/// tests beside these.
const MOST_MEMORY: usize = 512 << 20;

const SOUND: [(&str, &[u8]); 4] = [
    ("scanlines", include_bytes!("files/scan_zips.exr")),
    ("tiles", include_bytes!("files/tile_zips_one.exr")),
    ("levels", include_bytes!("files/tile_rle_mip_up.exr")),
    ("parts", include_bytes!("files/parts.exr")),
];

fn sound_files() -> Vec<(String, Vec<u8>)> {
    let ours = PACKINGS.map(|compression| {
        let mut image = formula();
        image.header.compression = compression;
        (format!("ours, {compression:?}"), encoded(&image))
    });
    let theirs = SOUND.map(|(name, bytes)| (name.to_owned(), bytes.to_vec()));
    ours.into_iter().chain(theirs).collect()
}

fn effort() -> usize {
    let asked = std::env::var("VEDUTA_DAMAGE").ok();
    asked.and_then(|number| number.parse().ok()).unwrap_or(1)
}

/// Reads all deep parts, whole and flat; if that fails, the error must be one clear sentence.
fn read(bytes: &[u8], case: &str) -> Result<(), DeepProblem> {
    let read = || {
        let file = DeepFile::from_bytes(bytes.to_vec())?;
        for part in 0..file.headers().len() {
            let image = file.read(part)?;
            let window = image.header.data_window;
            assert_eq!(image.pixels.width() as u64, window.width(), "{case}");
            assert_eq!(image.pixels.rows() as u64, window.height(), "{case}");
            let samples = image.pixels.sample_count();
            assert!(
                image.pixels.channels().iter().all(|c| c.len() == samples),
                "{case}"
            );
            let picture = image.flatten()?;
            let (of_file, _) = file.flatten(part)?;
            let same = |(a, b): (&f32, &f32)| a == b || (a.is_nan() && b.is_nan());
            let [a, b] = [&picture, &of_file].map(|picture| picture.pixels.iter().flatten());
            assert!(a.zip(b).all(same), "{case}");
        }
        Ok(())
    };
    let result: Result<(), DeepProblem> = read();
    if let Err(problem) = &result {
        let message = problem.to_string();
        assert!(
            message.len() < 1000 && !message.contains('\n'),
            "{case}: {message}"
        );
    }
    let peak = MEMORY.peak_usage();
    assert!(peak < MOST_MEMORY, "{case}: {peak} bytes");
    result
}

#[test]
fn files_cut_short_anywhere_are_refused() {
    for (name, sound) in sound_files() {
        assert!(read(&sound, &name).is_ok(), "{name}");
        for end in 0..sound.len() {
            let case = format!("{name} cut at {end}");
            // The last chunk of a file of several levels or parts may be one that is not read.
            let may_be_read = name == "levels" || name == "parts";
            let refused = read(&sound[..end], &case).is_err();
            assert!(refused || (may_be_read && end > sound.len() / 4), "{case}");
        }
    }
}

#[test]
fn every_flipped_bit_is_refused_or_read() {
    for (name, sound) in sound_files() {
        let mut refused = 0;
        let mut bytes = sound.clone();
        for bit in 0..8 * bytes.len() {
            bytes[bit / 8] ^= 1 << (bit % 8);
            refused += usize::from(read(&bytes, &format!("{name}, bit {bit}")).is_err());
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        assert!(refused > sound.len(), "{name}: {refused} flips are noticed");
    }
}

#[test]
fn numbers_beyond_reason_are_refused_without_being_believed() {
    for (name, sound) in sound_files() {
        let mut random = Random(1);
        let mut refused = 0;
        let cases = 3000 * effort();
        for case in 0..cases {
            let mut bytes = sound.clone();
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len());
                let number: &[u8] = match random.below(6) {
                    0 => &[0xff, 0xff, 0xff, 0x7f],
                    1 => &[0xff; 4],
                    2 => &[0xff; 8],
                    3 => &[0, 0, 0, 0x80],
                    4 => &[0; 8],
                    _ => &[0, 0, 0, 1],
                };
                for (byte, &new) in bytes[at..].iter_mut().zip(number) {
                    *byte = new;
                }
            }
            refused += usize::from(read(&bytes, &format!("{name}, case {case}")).is_err());
        }
        assert!(refused > cases / 4, "{name}: {refused} of {cases}");
    }
}

#[test]
fn damaged_pictures_with_depths_are_read_or_refused() {
    let options = DepthOptions::default();
    let file = OneFile::new("depth.exr");
    for (name, sound) in depth_pictures::sound_files() {
        let read = |bytes: &[u8], case: &str| {
            file.write(bytes);
            let read = read_depth_picture(&file.path, &options);
            if let Err(error) = &read {
                let message = error.to_string();
                assert!(
                    message.len() < 1000 && !message.contains('\n'),
                    "{name}, {case}: {message}"
                );
            }
            let peak = MEMORY.peak_usage();
            assert!(peak < MOST_MEMORY, "{name}, {case}: {peak} bytes");
            read.is_ok()
        };
        assert!(read(&sound, "sound"));
        let mut random = Random(1);
        let (mut refused, cases) = (0, 800 * effort());
        for case in 0..cases {
            let mut bytes = sound.clone();
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len());
                match random.below(4) {
                    0 => bytes[at..].iter_mut().take(4).for_each(|byte| *byte = 0xff),
                    1 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random.below(5)],
                    2 => bytes.truncate(at.max(1)),
                    _ => bytes[at] ^= 1 << random.below(8),
                }
                if bytes.len() < 8 {
                    break;
                }
            }
            refused += usize::from(!read(&bytes, &format!("case {case}")));
        }
        assert!(refused > cases / 4, "{name}: {refused} of {cases}");
    }
}

#[test]
fn errors_tell_the_part_the_chunk_and_the_byte() {
    let sound = encoded(&formula());
    let file = DeepFile::from_bytes(sound.clone()).expect("a sound file");
    assert!(file.read(0).is_ok());
    let message = read(&sound[..sound.len() - 1], "cut")
        .expect_err("cut")
        .to_string();
    assert!(
        message.contains("is damaged in part 0, chunk 6, at byte"),
        "{message}"
    );
    // The table's entry of row 2 is the third number before the seven of its end.
    let mut unwritten = sound.clone();
    let first = (0..sound.len() - 8).find(|&at| {
        let place = u64::from_le_bytes(sound[at..at + 8].try_into().expect("eight bytes"));
        place == at as u64 + 56
    });
    let table = first.expect("a table whose first entry points behind it");
    unwritten[table + 16..table + 24].fill(0);
    let message = read(&unwritten, "unwritten")
        .expect_err("unwritten")
        .to_string();
    assert!(
        message.contains("in part 0, chunk 2, at byte") && message.contains("never written"),
        "{message}"
    );
}

#[test]
fn a_small_file_cannot_unpack_to_a_large_picture() {
    // A row of 2^20 pixels in a table of nothing: 8 MiB are allowed, 2^31 pixels are not.
    let image = {
        let mut image = formula();
        image.header.compression = veduta_io::deep_exr::DeepCompression::Zips;
        image
    };
    let sound = encoded(&image);
    let mark = b"dataWindow\0box2i\0";
    let at = sound.windows(mark.len()).position(|part| part == mark);
    let right = at.expect("the attribute") + mark.len() + 4 + 8;
    let mut wide = sound.clone();
    wide[right..right + 4].copy_from_slice(&(i32::MAX / 2).to_le_bytes());
    let message = read(&wide, "wide").expect_err("too wide").to_string();
    assert!(message.contains("cannot unpack to"), "{message}");
}
