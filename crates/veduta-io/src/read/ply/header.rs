//! The header of a PLY file: which elements it has, of which properties.

use crate::read::error::{Fault, Place, Problem};
use crate::read::text::{Tokens, next_line, text, wrong_token};

/// What a header says.
#[derive(Debug)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Pictures, from comments `TextureFile NAME`.
    pub textures: Vec<String>,
    /// Where the data begin.
    pub length: usize,
    /// Lines of the header.
    pub lines: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// A table.
#[derive(Debug)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

/// A column.
#[derive(Debug)]
pub struct Property {
    pub name: String,
    pub number: Number,
    /// The type of the number of entries, if each row has a list.
    pub list: Option<Number>,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    /// Length in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }
}

impl Element {
    /// The least bytes that a row takes.
    pub fn least_row(&self, encoding: Encoding) -> usize {
        let column = |property: &Property| match encoding {
            // A digit and a space.
            Encoding::Text => 2,
            _ => property.list.unwrap_or(property.number).bytes(),
        };
        self.properties.iter().map(column).sum()
    }
}

/// The first bytes of a PLY file.
pub const MAGIC: &[u8] = b"ply";

/// Reads the header.
pub fn read(bytes: &[u8]) -> Result<Header, Fault> {
    if !bytes.starts_with(MAGIC) {
        let found = bytes[..bytes.len().min(4)].to_vec();
        let format = "PLY";
        return Err(Problem::WrongMagic { format, found }.at(Place::Whole));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut textures = Vec::new();
    let mut rest = bytes;
    let mut lines = 0;
    loop {
        if rest.is_empty() {
            return Err(Problem::Lacks("end_header; it is cut short").at(Place::Whole));
        }
        lines += 1;
        let line = next_line(&mut rest);
        let read = header_line(line, &mut encoding, &mut elements, &mut textures);
        if read.map_err(|problem| problem.at(Place::Line(lines)))? {
            break;
        }
    }
    let encoding = encoding
        .ok_or_else(|| Problem::Lacks("line \"format …\" in its header").at(Place::Whole))?;
    Ok(Header {
        encoding,
        elements,
        textures,
        length: bytes.len() - rest.len(),
        lines,
    })
}

/// Reads a line; true for the last one.
fn header_line(
    line: &[u8],
    encoding: &mut Option<Encoding>,
    elements: &mut Vec<Element>,
    textures: &mut Vec<String>,
) -> Result<bool, Problem> {
    let mut tokens = Tokens(line);
    match tokens.next().unwrap_or_default() {
        b"end_header" => return Ok(true),
        b"format" => {
            let name = tokens.next().unwrap_or_default();
            *encoding = Some(match name {
                b"ascii" => Encoding::Text,
                b"binary_little_endian" => Encoding::LittleEndian,
                b"binary_big_endian" => Encoding::BigEndian,
                _ => {
                    let expected = "ascii, binary_little_endian or binary_big_endian";
                    return Err(wrong_token(name, expected));
                }
            });
        }
        b"comment" if tokens.next() == Some(b"TextureFile") => textures.push(text(tokens)),
        b"element" => {
            let name = String::from_utf8_lossy(tokens.next().unwrap_or_default()).into_owned();
            let count = tokens.next().unwrap_or_default();
            let number = std::str::from_utf8(count).ok().and_then(|c| c.parse().ok());
            let count = number.ok_or_else(|| wrong_token(count, "the number of elements"))?;
            elements.push(Element {
                name,
                count,
                properties: Vec::new(),
            });
        }
        b"property" => {
            let Some(element) = elements.last_mut() else {
                return Err(Problem::Lacks("element that the property is of"));
            };
            let number = |tokens: &mut Tokens<'_>| {
                let name = tokens.next().unwrap_or_default();
                Number::named(name).ok_or_else(|| wrong_token(name, "a type such as float"))
            };
            let mut after = Tokens(tokens.0);
            let list = if after.next() == Some(b"list") {
                tokens = after;
                Some(number(&mut tokens)?)
            } else {
                None
            };
            let number = number(&mut tokens)?;
            let name = text(tokens);
            element.properties.push(Property { name, number, list });
        }
        // Its own first line, notes of programs, and what later versions may bring.
        _ => {}
    }
    Ok(false)
}
