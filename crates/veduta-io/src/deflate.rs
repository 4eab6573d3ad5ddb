//! Deflate with the frame of zlib, as OpenEXR and PDF pack bytes.
//!
//! By libdeflate, as OpenEXR itself does: about twice as quick as the codecs written in Rust at the same
//! length, and packing is half of what writing a picture costs. The same bytes on every machine.

use libdeflater::{CompressionLvl, Compressor};
#[cfg(feature = "exr")]
use libdeflater::{DecompressionError, Decompressor};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// Bytes that Deflate makes at most of one.
#[cfg(feature = "exr")]
pub const MOST_OF_ONE: usize = 1032;

thread_local! {
    /// By level. Their tables take longer to make than a small block takes to pack.
    static COMPRESSORS: RefCell<BTreeMap<i32, Compressor>> = RefCell::default();
}

/// Packs bytes at a level from 1, quick, to 12, short.
///
/// # Panics
/// For other levels.
pub fn deflate(bytes: &[u8], level: i32) -> Vec<u8> {
    COMPRESSORS.with_borrow_mut(|compressors| {
        let compressor = compressors.entry(level).or_insert_with(|| {
            Compressor::new(CompressionLvl::new(level).expect("a level that there is"))
        });
        let mut packed = vec![0; compressor.zlib_compress_bound(bytes.len())];
        let length = compressor
            .zlib_compress(bytes, &mut packed)
            .expect("the bound is enough");
        packed.truncate(length);
        packed
    })
}

/// Unpacks bytes that must be `size` then, which [`MOST_OF_ONE`] has been asked of. Errors say what is wrong,
/// as a clause.
#[cfg(feature = "exr")]
pub fn inflate(packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let count = packed.len();
    let mut unpacked = vec![0; size];
    match Decompressor::new().zlib_decompress(packed, &mut unpacked) {
        Ok(length) if length == size => Ok(unpacked),
        Ok(length) => Err(format!("unpacks to {length} bytes, not to {size}")),
        Err(DecompressionError::InsufficientSpace) => {
            Err(format!("unpacks to more than {size} bytes"))
        }
        Err(DecompressionError::BadData) => Err(format!("{count} bytes do not inflate")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "exr")]
    #[test]
    fn what_is_packed_inflates_and_nothing_else_does() {
        let bytes: Vec<u8> = (0..5000_u32).map(|k| (k * k / 7) as u8).collect();
        for level in [1, 4, 12] {
            let packed = deflate(&bytes, level);
            assert!(packed.len() < bytes.len());
            assert_eq!(inflate(&packed, bytes.len()).as_ref(), Ok(&bytes));
            for size in [0, bytes.len() - 1, bytes.len() + 1] {
                inflate(&packed, size).expect_err("another size");
            }
            inflate(&packed[..packed.len() - 5], bytes.len()).expect_err("cut short");
        }
        assert_eq!(inflate(&deflate(&[], 4), 0), Ok(Vec::new()));
    }

    #[test]
    fn another_program_inflates_it() {
        let bytes: Vec<u8> = (0..70_000_u32).map(|k| (k / 9) as u8).collect();
        let inflated = miniz_oxide::inflate::decompress_to_vec_zlib(&deflate(&bytes, 4));
        assert_eq!(inflated.expect("sound"), bytes);
    }
}
