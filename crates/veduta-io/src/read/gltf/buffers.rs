//! Buffers and files beside: the bytes that accessors and images point into.

use super::document::{Buffer, BufferView, Document, Index};
use super::{Fault, Problem, row};
use crate::read::budget::Budget;
use crate::read::files::shortened;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Reads what URIs name, each only once.
pub struct Files {
    folder: PathBuf,
    read: HashMap<PathBuf, Rc<Vec<u8>>>,
}

impl Files {
    /// URIs are relative to `folder`.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            read: HashMap::new(),
        }
    }

    /// The bytes that a URI stands for: those it holds, or those of the file it names.
    pub fn bytes_of(&mut self, uri: &str, budget: &mut Budget) -> Result<Rc<Vec<u8>>, Problem> {
        if let Some(data) = uri.strip_prefix("data:") {
            return Ok(decode_data_uri(data)?.into());
        }
        // A single letter before the colon is a drive.
        if uri.find(':').is_some_and(|colon| colon > 1) {
            return Err(Problem::RemoteUri(shortened(uri)));
        }
        let path = self.folder.join(percent_decoded(uri).as_ref());
        if let Some(bytes) = self.read.get(&path) {
            return Ok(Rc::clone(bytes));
        }
        let bytes: Rc<Vec<u8>> = match budget.files.read(&path) {
            Ok(bytes) => bytes.into(),
            Err(source) => return Err(Problem::NotThere { path, source }),
        };
        budget.add_input(bytes.len());
        self.read.insert(path, Rc::clone(&bytes));
        Ok(bytes)
    }
}

/// The bytes of a data URI, without its scheme (RFC 2397).
fn decode_data_uri(rest: &str) -> Result<Vec<u8>, Problem> {
    let Some((kind, data)) = rest.split_once(',') else {
        return Err(Problem::DataUri("it has no comma".into()));
    };
    if kind.ends_with(";base64") {
        // Both paddings are found in the wild.
        const FORGIVING: GeneralPurposeConfig =
            GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
        GeneralPurpose::new(&STANDARD, FORGIVING)
            .decode(data)
            .map_err(|error| Problem::DataUri(error.to_string()))
    } else {
        Ok(percent_decoded_bytes(data).into_owned())
    }
}

/// `%20` -> a space, and so on; a `%` without two digits stays.
fn percent_decoded(text: &str) -> Cow<'_, str> {
    match percent_decoded_bytes(text) {
        Cow::Borrowed(_) => Cow::Borrowed(text),
        Cow::Owned(bytes) => Cow::Owned(String::from_utf8_lossy(&bytes).into_owned()),
    }
}

fn percent_decoded_bytes(text: &str) -> Cow<'_, [u8]> {
    if !text.contains('%') {
        return Cow::Borrowed(text.as_bytes());
    }
    let mut decoded = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let digits = after
            .get(..2)
            .filter(|digits| digits.iter().all(u8::is_ascii_hexdigit));
        let code = (byte == b'%')
            .then_some(digits)
            .flatten()
            .and_then(|digits| u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok());
        match code {
            Some(code) => {
                decoded.push(code);
                rest = &after[2..];
            }
            None => {
                decoded.push(byte);
                rest = after;
            }
        }
    }
    Cow::Owned(decoded)
}

/// The document's buffers.
pub struct Buffers<'a> {
    document: &'a Document,
    /// `None` for a buffer that is nowhere, which is an error as soon as it is used.
    bytes: Vec<Option<Bytes<'a>>>,
    /// For each view, its bytes if it was compressed; empty if none was.
    decompressed: Vec<Option<Vec<u8>>>,
}

/// Bytes of a buffer.
enum Bytes<'a> {
    /// In the file itself.
    Inside(&'a [u8]),
    /// In a data URI or a file beside.
    Outside(Rc<Vec<u8>>),
}

impl<'a> Buffers<'a> {
    /// Fetches all buffers; `bin` is the GLB's binary chunk.
    pub fn fetch(
        document: &'a Document,
        bin: Option<&'a [u8]>,
        files: &mut Files,
        budget: &mut Budget,
    ) -> Result<Self, Fault> {
        let mut all = Vec::with_capacity(document.buffers.len());
        for (index, buffer) in document.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                Some(uri) if !is_fallback(buffer) => {
                    let at = |problem: Problem| problem.at_json(format!("buffers[{index}].uri"));
                    Some(Bytes::Outside(files.bytes_of(uri, budget).map_err(at)?))
                }
                None if index == 0 && !is_fallback(buffer) => bin.map(Bytes::Inside),
                _ => None,
            };
            if let Some(bytes) = &bytes {
                let present = bytes.as_slice().len() as u64;
                if present < buffer.byte_length {
                    let problem = Problem::Truncated {
                        what: "the buffer",
                        needed: buffer.byte_length,
                        present,
                    };
                    return Err(problem.at_json(format!("buffers[{index}].byteLength")));
                }
            }
            all.push(bytes);
        }
        let buffers = Self {
            document,
            bytes: all,
            decompressed: Vec::new(),
        };
        #[cfg(feature = "meshopt")]
        let buffers = buffers.decompress(budget)?;
        Ok(buffers)
    }

    /// Decompresses the views that are compressed.
    #[cfg(feature = "meshopt")]
    fn decompress(mut self, budget: &mut Budget) -> Result<Self, Fault> {
        use super::meshopt::Compressed;
        use rayon::prelude::*;

        let views = &self.document.buffer_views;
        if !views.iter().any(|view| view.extensions.meshopt().is_some()) {
            return Ok(self);
        }
        let mut compressed = Vec::with_capacity(views.len());
        for (index, view) in views.iter().enumerate() {
            compressed.push(match view.extensions.meshopt() {
                None => None,
                Some((name, extension)) => {
                    let at = format!("bufferViews[{index}].extensions.{name}");
                    let buffer = self.buffer(extension.buffer, &at)?;
                    let found = Compressed::find(extension, buffer, budget, &at)?;
                    Some((found, at))
                }
            });
        }
        let decompressed: Vec<Result<_, Fault>> = compressed
            .par_iter()
            .map(|view| {
                let Some((view, at)) = view else {
                    return Ok(None);
                };
                view.decompress().map(Some).map_err(|reason| {
                    let (codec, reason) = ("meshopt", reason.to_owned());
                    Problem::Compressed { codec, reason }.at_json(at)
                })
            })
            .collect();
        // One after the other, so that the first error is told however the threads ran.
        self.decompressed = decompressed.into_iter().collect::<Result<_, _>>()?;
        Ok(self)
    }

    /// The bytes of a buffer; `at` is who asks.
    fn buffer(&self, index: Index, at: &str) -> Result<&[u8], Fault> {
        let (buffer, _) = row(&self.document.buffers, index, "buffer", at)?;
        match &self.bytes[buffer] {
            Some(bytes) => Ok(bytes.as_slice()),
            None => Err(Problem::NoBinChunk.at_json(format!("buffers[{buffer}]"))),
        }
    }

    /// The bytes of a view; `at` is who asks.
    pub fn view(&self, index: Index, at: &str) -> Result<(&[u8], &'a BufferView), Fault> {
        let (index, view) = row(&self.document.buffer_views, index, "bufferView", at)?;
        if let Some(Some(bytes)) = self.decompressed.get(index) {
            return Ok((bytes, view));
        }
        let at = format!("bufferViews[{index}]");
        let bytes = self.buffer(view.buffer, &at)?;
        match slice(bytes, view.byte_offset, view.byte_length) {
            Some(bytes) => Ok((bytes, view)),
            None => Err(Problem::Truncated {
                what: "the view, with its offset,",
                needed: view.byte_offset.saturating_add(view.byte_length),
                present: bytes.len() as u64,
            }
            .at_json(at)),
        }
    }
}

/// Whether a buffer is for readers that cannot decompress: it need not exist.
#[cfg(feature = "meshopt")]
fn is_fallback(buffer: &Buffer) -> bool {
    let extensions = &buffer.extensions;
    let said = [&extensions.meshopt_khr, &extensions.meshopt_ext];
    said.into_iter()
        .flatten()
        .any(|extension| extension.fallback)
}

#[cfg(not(feature = "meshopt"))]
fn is_fallback(_: &Buffer) -> bool {
    false
}

/// `length` bytes from `offset`, if they are all there.
pub fn slice(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(start..end)
}

impl Bytes<'_> {
    fn as_slice(&self) -> &[u8] {
        match self {
            Bytes::Inside(bytes) => bytes,
            Bytes::Outside(bytes) => bytes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_decode_with_and_without_padding() {
        for uri in [
            "application/octet-stream;base64,AAEC/w==",
            ";base64,AAEC/w",
            ",%00%01%02%FF",
        ] {
            assert_eq!(decode_data_uri(uri).expect(uri), [0, 1, 2, 255]);
        }
        assert!(decode_data_uri("application/octet-stream;base64").is_err());
        assert!(decode_data_uri(";base64,A*").is_err());
    }

    #[test]
    fn percent_signs_that_start_no_code_stay() {
        assert_eq!(percent_decoded("a%20b%2"), "a b%2");
        assert_eq!(percent_decoded("100%"), "100%");
        assert_eq!(percent_decoded("%zz"), "%zz");
    }
}
