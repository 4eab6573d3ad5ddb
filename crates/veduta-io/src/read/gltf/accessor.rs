//! Accessors: typed tables within buffers.
//!
//! glTF 2.0, §3.6.2, with the integer types of KHR_mesh_quantization. An [`Elements`] has been
//! checked against its bytes once; decoding it cannot fail.

use super::buffers::{Buffers, slice};
use super::document::{Accessor, Document, Index};
use super::{Fault, Problem, row};
use rayon::prelude::*;
use std::borrow::Cow;

/// An accessor's elements, all of which are there.
#[derive(Debug)]
pub struct Elements<'a> {
    /// Number of elements.
    pub count: u64,
    /// Number of components of an element.
    pub components: usize,
    component: Component,
    normalized: bool,
    /// The first element starts here. `None`: all are zero.
    bytes: Option<Cow<'a, [u8]>>,
    /// Bytes from one element to the next.
    stride: usize,
    sparse: Option<SparseElements<'a>>,
}

/// Elements that replace some of the others.
#[derive(Debug)]
struct SparseElements<'a> {
    /// The elements they replace, ascending.
    indices: Vec<u64>,
    /// Tightly packed.
    values: &'a [u8],
}

/// Bytes and components of the largest element, a matrix of four by four.
const LARGEST_ELEMENT: usize = 64;

/// Elements that a task decodes at a time.
const ELEMENTS_PER_TASK: usize = 16 * 1024;

/// A table that was decompressed: elements one after the other, in place of those an accessor's view
/// would hold.
#[cfg_attr(not(feature = "draco"), allow(dead_code))]
#[derive(Debug)]
pub struct Decompressed {
    pub component: Component,
    pub components: usize,
    pub count: u64,
    pub bytes: Vec<u8>,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u64, at: &str) -> Result<Self, Fault> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => {
                return Err(Problem::Illegal {
                    found: code.to_string(),
                    expected: "5120 to 5123, 5125 or 5126",
                }
                .at_json(format!("{at}.componentType")));
            }
        })
    }

    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

impl<'a> Elements<'a> {
    /// Finds an accessor's bytes and checks that they are there; `at` is who asks.
    ///
    /// `shapes` are the types that may be found, such as `VEC3`.
    pub fn find(
        document: &'a Document,
        buffers: &'a Buffers<'_>,
        index: Index,
        shapes: &'static str,
        at: &str,
    ) -> Result<Self, Fault> {
        let (accessor, components, at) = accessor_of(document, index, shapes, at)?;
        let component = Component::of(accessor.component_type, &at)?;
        let size = component.size() * components;
        let (bytes, stride) = match accessor.buffer_view {
            None => (None, size),
            Some(view) => {
                let (bytes, view) = buffers.view(view, &at)?;
                let stride = view.byte_stride.unwrap_or(size as u64);
                // Elements that overlap would make many of few bytes.
                if stride < size as u64 {
                    return Err(Problem::Illegal {
                        found: format!("{stride}, for elements of {size} bytes"),
                        expected: "at least the length of an element",
                    }
                    .at_json(format!(
                        "bufferViews[{}].byteStride",
                        accessor.buffer_view.unwrap_or_default()
                    )));
                }
                let needed = match accessor.count {
                    0 => 0,
                    count => (count - 1)
                        .saturating_mul(stride)
                        .saturating_add(size as u64),
                };
                let what = "the accessor, with its offset,";
                let bytes = bytes_at(bytes, accessor.byte_offset, needed, what, &at)?;
                let stride = usize::try_from(stride).unwrap_or(usize::MAX);
                (Some(Cow::Borrowed(bytes)), stride)
            }
        };
        Ok(Self {
            count: accessor.count,
            components,
            component,
            normalized: accessor.normalized,
            bytes,
            stride,
            sparse: sparse(accessor, accessor.count, size, buffers, &at)?,
        })
    }

    /// The elements that a primitive's Draco stream holds for an accessor; whatever the accessor
    /// points to itself is not looked at.
    pub fn decompressed(
        document: &'a Document,
        buffers: &'a Buffers<'_>,
        index: Index,
        shapes: &'static str,
        table: Decompressed,
        at: &str,
    ) -> Result<Self, Fault> {
        let (accessor, components, at) = accessor_of(document, index, shapes, at)?;
        if components != table.components {
            let found = format!("{}, where {} are compressed", components, table.components);
            let expected = "as many components as the compressed attribute has";
            return Err(Problem::Illegal { found, expected }.at_json(format!("{at}.type")));
        }
        let size = table.component.size() * components;
        let sparse = sparse(accessor, table.count, size, buffers, &at)?;
        Ok(Self {
            count: table.count,
            components,
            component: table.component,
            normalized: accessor.normalized,
            bytes: Some(Cow::Owned(table.bytes)),
            stride: size,
            sparse,
        })
    }

    /// Whether the elements can be indices.
    pub fn is_unsigned_integer(&self) -> bool {
        matches!(
            self.component,
            Component::U8 | Component::U16 | Component::U32
        )
    }

    /// All elements as indices. Components must be unsigned integers.
    pub fn indices(&self) -> Vec<u32> {
        match self.component {
            Component::U8 => self.decode(None, |e| u32::from(e[0])),
            Component::U16 => self.decode(None, |e| u32::from(u16::from_le_bytes(first(e)))),
            _ => self.decode(None, |e| u32::from_le_bytes(first(e))),
        }
    }

    /// Elements as vectors of four indices, in the order of `rows`. Components must be unsigned
    /// integers.
    pub fn index_quads(&self, rows: Option<&[u32]>) -> Vec<[u32; 4]> {
        let quad = |element: &[u8], index: fn(&[u8]) -> u32| {
            let mut parts = element.chunks_exact(self.component.size()).map(index);
            std::array::from_fn(|_| parts.next().unwrap_or(0))
        };
        match self.component {
            Component::U8 => self.decode(rows, |e| quad(e, |part| part[0].into())),
            Component::U16 => {
                let index = |part: &[u8]| u16::from_le_bytes(first(part)).into();
                self.decode(rows, |e| quad(e, index))
            }
            _ => self.decode(rows, |e| quad(e, |part| u32::from_le_bytes(first(part)))),
        }
    }

    /// Elements as vectors of `N` components, those that are absent 1, in the order of `rows`, which
    /// ascend; without `rows`, all. Each is turned to what is kept of it by `make`.
    ///
    /// Integers that are normalised become 0 to 1, or -1 to 1 (glTF 2.0, §3.11).
    pub fn vectors<const N: usize, R: Clone + Send>(
        &self,
        rows: Option<&[u32]>,
        make: impl Fn([f32; N]) -> R + Sync,
    ) -> Vec<R> {
        let unit = |scale: f32| if self.normalized { scale } else { 1.0 };
        match self.component {
            Component::F32 => self.components(rows, f32::from_le_bytes, make),
            Component::U8 => {
                let scale = unit(255.0);
                self.components(rows, |[byte]: [u8; 1]| f32::from(byte) / scale, make)
            }
            Component::U16 => {
                let scale = unit(65_535.0);
                let number = |b| f32::from(u16::from_le_bytes(b)) / scale;
                self.components(rows, number, make)
            }
            Component::I8 => {
                let scale = unit(127.0);
                let least = if self.normalized { -1.0 } else { f32::MIN };
                let number = |b| (f32::from(i8::from_le_bytes(b)) / scale).max(least);
                self.components(rows, number, make)
            }
            Component::I16 => {
                let scale = unit(32_767.0);
                let least = if self.normalized { -1.0 } else { f32::MIN };
                let number = |b| (f32::from(i16::from_le_bytes(b)) / scale).max(least);
                self.components(rows, number, make)
            }
            Component::U32 => {
                let scale = unit(u32::MAX as f32);
                self.components(rows, |b| u32::from_le_bytes(b) as f32 / scale, make)
            }
        }
    }

    /// Decodes elements of `B` bytes per component by `number`.
    fn components<const N: usize, const B: usize, R: Clone + Send>(
        &self,
        rows: Option<&[u32]>,
        number: impl Fn([u8; B]) -> f32 + Sync,
        make: impl Fn([f32; N]) -> R + Sync,
    ) -> Vec<R> {
        if self.components != N {
            return self.decode(rows, |element| {
                let parts = element.as_chunks::<B>().0;
                let part = |i| parts.get(i).map_or(1.0, |part| number(*part));
                make(std::array::from_fn(part))
            });
        }
        let read = |parts: &[[u8; B]; N]| make(parts.map(&number));
        // Where nothing lies between elements their length is known here, which makes decoding
        // several times as fast.
        if let (Some(bytes), None, None, true) =
            (&self.bytes, rows, &self.sparse, self.stride == B * N)
        {
            let elements = bytes.as_chunks::<B>().0.as_chunks::<N>().0;
            let elements = elements.par_iter().with_min_len(ELEMENTS_PER_TASK);
            return elements.map(read).collect();
        }
        self.decode(rows, |element| {
            let parts = element.as_chunks::<B>().0.first_chunk();
            read(parts.expect("an element has all its components"))
        })
    }

    /// Decodes each element by `read`, which is given its bytes.
    fn decode<R: Clone + Send>(
        &self,
        rows: Option<&[u32]>,
        read: impl Fn(&[u8]) -> R + Sync,
    ) -> Vec<R> {
        let size = self.component.size() * self.components;
        let mut elements: Vec<R> = match (&self.bytes, rows) {
            (Some(bytes), None) => bytes
                .par_chunks(self.stride)
                .with_min_len(ELEMENTS_PER_TASK)
                .map(|element| read(&element[..size]))
                .collect(),
            (Some(bytes), Some(rows)) => rows
                .par_iter()
                .with_min_len(ELEMENTS_PER_TASK)
                .map(|&row| {
                    let start = row as usize * self.stride;
                    read(&bytes[start..start + size])
                })
                .collect(),
            (None, _) => {
                let count = rows.map_or(self.count as usize, <[u32]>::len);
                vec![read(&[0; LARGEST_ELEMENT][..size]); count]
            }
        };
        if let Some(sparse) = &self.sparse {
            for (&index, value) in sparse.indices.iter().zip(sparse.values.chunks_exact(size)) {
                let row = match rows {
                    None => Ok(index as usize),
                    Some(rows) => rows.binary_search_by(|&row| u64::from(row).cmp(&index)),
                };
                if let Ok(row) = row {
                    elements[row] = read(value);
                }
            }
        }
        elements
    }
}

/// An accessor, the number of components of its elements, and its path.
fn accessor_of<'a>(
    document: &'a Document,
    index: Index,
    shapes: &'static str,
    at: &str,
) -> Result<(&'a Accessor, usize, String), Fault> {
    let (index, accessor) = row(&document.accessors, index, "accessor", at)?;
    let at = format!("accessors[{index}]");
    if !shapes.split(" or ").any(|shape| shape == accessor.shape) {
        let found = format!("{:?}", accessor.shape.chars().take(16).collect::<String>());
        let expected = shapes;
        return Err(Problem::Illegal { found, expected }.at_json(format!("{at}.type")));
    }
    let components = match accessor.shape.as_str() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "MAT4" => 16,
        _ => 4,
    };
    Ok((accessor, components, at))
}

/// The sparse part of an accessor that has `count` elements of `size` bytes.
fn sparse<'a>(
    accessor: &Accessor,
    count: u64,
    size: usize,
    buffers: &'a Buffers<'_>,
    at: &str,
) -> Result<Option<SparseElements<'a>>, Fault> {
    let Some(sparse) = &accessor.sparse else {
        return Ok(None);
    };
    let at_indices = format!("{at}.sparse.indices");
    let component = Component::of(sparse.indices.component_type, &at_indices)?;
    let (bytes, _) = buffers.view(sparse.indices.buffer_view, &at_indices)?;
    let needed = sparse.count.saturating_mul(component.size() as u64);
    let what = "the table of sparse indices, with its offset,";
    let offset = sparse.indices.byte_offset;
    let bytes = bytes_at(bytes, offset, needed, what, &at_indices)?;
    let indices: Vec<u64> = match component {
        Component::U8 => bytes.iter().map(|&b| b.into()).collect(),
        Component::U16 => {
            let words = bytes.as_chunks().0.iter();
            words.map(|&b| u16::from_le_bytes(b).into()).collect()
        }
        Component::U32 => {
            let words = bytes.as_chunks().0.iter();
            words.map(|&b| u32::from_le_bytes(b).into()).collect()
        }
        _ => {
            return Err(Problem::Illegal {
                found: sparse.indices.component_type.to_string(),
                expected: "an unsigned integer type",
            }
            .at_json(format!("{at_indices}.componentType")));
        }
    };
    let ascends = indices.windows(2).all(|pair| pair[0] < pair[1]);
    if !ascends || indices.last().is_some_and(|&last| last >= count) {
        return Err(Problem::Illegal {
            found: "a list that does not ascend or that leaves the accessor".into(),
            expected: "ascending indices below the accessor's count",
        }
        .at_json(at_indices));
    }

    let at_values = format!("{at}.sparse.values");
    let (bytes, _) = buffers.view(sparse.values.buffer_view, &at_values)?;
    let needed = sparse.count.saturating_mul(size as u64);
    let what = "the table of sparse values, with its offset,";
    let offset = sparse.values.byte_offset;
    let values = bytes_at(bytes, offset, needed, what, &at_values)?;
    Ok(Some(SparseElements { indices, values }))
}

/// `needed` bytes from `offset`, or an error that names who needs them.
fn bytes_at<'a>(
    bytes: &'a [u8],
    offset: u64,
    needed: u64,
    what: &'static str,
    at: &str,
) -> Result<&'a [u8], Fault> {
    slice(bytes, offset, needed).ok_or_else(|| {
        Problem::Truncated {
            what,
            needed: offset.saturating_add(needed),
            present: bytes.len() as u64,
        }
        .at_json(at)
    })
}

/// The first bytes of an element.
fn first<const B: usize>(element: &[u8]) -> [u8; B] {
    *element
        .first_chunk()
        .expect("an element holds its component")
}
