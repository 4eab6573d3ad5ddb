//! How the bytes of a chunk are packed: not at all, as runs of equal bytes (RLE), or by Deflate (ZIPS; ZIP of
//! flat pictures does the same with sixteen lines).
//!
//! Both first sort bytes (those at even places, then those at odd ones) and take differences, since
//! the upper bytes of neighbouring numbers are alike. What does not shrink is stored as it is.

use super::DeepCompression;
use crate::deflate::{MOST_OF_ONE, deflate, inflate};
use std::borrow::Cow;

/// The level of OpenEXR's own writer: higher ones take twice the time to save a few per cent.
const DEFLATE_LEVEL: i32 = 4;

/// Bytes that a run makes at most of one: 128 of two.
const MOST_OF_RUNS: usize = 64;

/// Unpacks a block that must have `size` bytes then. Errors say what is wrong, as a clause.
///
/// Nothing of that size is made before the packed bytes could fill it.
pub fn unpack(
    compression: DeepCompression,
    packed: &[u8],
    size: usize,
) -> Result<Cow<'_, [u8]>, String> {
    if packed.len() == size {
        return Ok(Cow::Borrowed(packed));
    }
    expand(compression, packed, size).map(Cow::Owned)
}

/// Unpacks a block that is known not to be stored as it is; else as [`unpack`].
pub fn expand(compression: DeepCompression, packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let most = match compression {
        DeepCompression::None => 1,
        DeepCompression::Rle => MOST_OF_RUNS,
        DeepCompression::Zips => MOST_OF_ONE,
    };
    let count = packed.len();
    if size > count.saturating_mul(most) {
        return Err(format!("{count} bytes cannot unpack to {size}"));
    }
    let mut unpacked = match compression {
        DeepCompression::None => {
            return Err(format!("{count} bytes where {size} are to be"));
        }
        DeepCompression::Rle => unpack_runs(packed, size)?,
        DeepCompression::Zips => inflate(packed, size)?,
    };
    if unpacked.len() != size {
        return Err(format!(
            "unpacks to {} bytes, not to {size}",
            unpacked.len()
        ));
    }
    undo_differences(&mut unpacked);
    Ok(interleave(&unpacked))
}

/// Packs a block; as it is, where that is no longer.
pub fn pack(compression: DeepCompression, bytes: &[u8]) -> Cow<'_, [u8]> {
    let packed = match compression {
        DeepCompression::None => return Cow::Borrowed(bytes),
        DeepCompression::Rle => pack_runs(&differences(bytes)),
        DeepCompression::Zips => deflate(&differences(bytes), DEFLATE_LEVEL),
    };
    if packed.len() < bytes.len() {
        Cow::Owned(packed)
    } else {
        Cow::Borrowed(bytes)
    }
}

/// Bytes at even places, bytes at odd places; then each less the one before, plus 128.
fn differences(bytes: &[u8]) -> Vec<u8> {
    let (pairs, last) = bytes.as_chunks::<2>();
    let mut sorted: Vec<u8> = Vec::with_capacity(bytes.len());
    sorted.extend(pairs.iter().map(|pair| pair[0]));
    sorted.extend(last);
    sorted.extend(pairs.iter().map(|pair| pair[1]));
    let mut differences = sorted.clone();
    let [_, later @ ..] = &mut differences[..] else {
        return differences;
    };
    for ((difference, &byte), &before) in later.iter_mut().zip(&sorted[1..]).zip(&sorted) {
        *difference = byte.wrapping_sub(before).wrapping_add(128);
    }
    differences
}

fn undo_differences(bytes: &mut [u8]) {
    let mut before = None;
    for byte in bytes {
        if let Some(before) = before {
            *byte = byte.wrapping_add(before).wrapping_sub(128);
        }
        before = Some(*byte);
    }
}

/// The first half to the even places, the second to the odd ones.
fn interleave(bytes: &[u8]) -> Vec<u8> {
    let (even, odd) = bytes.split_at(bytes.len().div_ceil(2));
    let mut together = vec![0; bytes.len()];
    for (place, &byte) in together.iter_mut().step_by(2).zip(even) {
        *place = byte;
    }
    for (place, &byte) in together.iter_mut().skip(1).step_by(2).zip(odd) {
        *place = byte;
    }
    together
}

/// A count of 0 to 127 repeats the byte after it once more than that; a count of -1 to -128 is
/// followed by as many bytes as they are.
fn unpack_runs(packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let mut unpacked = Vec::with_capacity(size);
    let mut rest = packed;
    while let Some((&count, after)) = rest.split_first() {
        let count = count as i8;
        let taken = if count < 0 {
            let length = usize::from(count.unsigned_abs());
            let Some(bytes) = after.get(..length) else {
                return Err(format!("a run of {length} bytes ends the block"));
            };
            unpacked.extend_from_slice(bytes);
            length
        } else {
            let Some(&byte) = after.first() else {
                return Err("a run without its byte ends the block".to_owned());
            };
            unpacked.extend(std::iter::repeat_n(byte, count as usize + 1));
            1
        };
        if unpacked.len() > size {
            return Err(format!("its runs are longer than {size} bytes"));
        }
        rest = &after[taken..];
    }
    Ok(unpacked)
}

/// Bytes that a run is at least worth: one of two would take as much place as they do.
const SHORTEST_RUN: usize = 3;
const LONGEST_RUN: usize = 128;

fn pack_runs(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::with_capacity(bytes.len());
    let run_at = |at: usize| {
        let same = bytes[at..].iter().take_while(|&&byte| byte == bytes[at]);
        same.take(LONGEST_RUN).count()
    };
    let mut at = 0;
    while at < bytes.len() {
        let run = run_at(at);
        if run >= SHORTEST_RUN {
            packed.push((run - 1) as u8);
            packed.push(bytes[at]);
            at += run;
            continue;
        }
        let start = at;
        while at < bytes.len() && at - start < LONGEST_RUN && run_at(at) < SHORTEST_RUN {
            at += 1;
        }
        packed.push(((at - start) as u8).wrapping_neg());
        packed.extend_from_slice(&bytes[start..at]);
    }
    packed
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [DeepCompression; 3] = [
        DeepCompression::None,
        DeepCompression::Rle,
        DeepCompression::Zips,
    ];

    fn blocks() -> Vec<Vec<u8>> {
        let mut state = 1_u32;
        let mut random = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let noise: Vec<u8> = (0..999).map(|_| random()).collect();
        let runs = (0..2000).map(|k: u32| (k / 150) as u8).collect();
        let slope = (0..2001_u32)
            .flat_map(|k| (k as f32).to_le_bytes())
            .collect();
        vec![
            vec![],
            vec![7],
            vec![7, 7],
            vec![0; 5000],
            noise,
            runs,
            slope,
        ]
    }

    #[test]
    fn what_is_packed_unpacks_to_what_it_was() {
        for compression in ALL {
            for block in blocks() {
                let packed = pack(compression, &block);
                assert!(packed.len() <= block.len());
                let unpacked = unpack(compression, &packed, block.len());
                assert_eq!(unpacked.as_deref(), Ok(&block[..]), "{compression:?}");
            }
        }
    }

    #[test]
    fn runs_are_as_openexr_writes_them() {
        // Three and more are a run, two are not; a literal is at most 128 long, as is a run.
        assert_eq!(pack_runs(&[5, 5, 5, 1, 1, 2]), [2, 5, 0xfd, 1, 1, 2]);
        assert_eq!(pack_runs(&[9; 130]), [127, 9, 0xfe, 9, 9]);
        assert_eq!(
            unpack_runs(&[2, 5, 0xfd, 1, 1, 2], 6),
            Ok(vec![5, 5, 5, 1, 1, 2])
        );
    }

    #[test]
    fn a_block_that_cannot_be_as_large_as_told_is_refused_before_it_is_made() {
        for compression in ALL {
            let error = unpack(compression, &[1, 2, 3], usize::MAX).expect_err("too large");
            assert!(error.contains("cannot unpack"), "{error}");
        }
        assert!(
            unpack(DeepCompression::Rle, &[127, 1], 100).is_err(),
            "longer than told"
        );
        assert!(
            unpack(DeepCompression::Rle, &[0x80, 1], 100).is_err(),
            "cut short"
        );
        assert!(unpack(DeepCompression::Zips, &[0x78, 1, 1], 100).is_err());
    }
}
