//! The data of a PLY file, number by number.

use super::header::{Encoding, Number};
use crate::read::error::{Fault, Place, Problem};
use crate::read::text::{Tokens, next_line, number};

/// Reads one number after another.
pub enum Rows<'b> {
    Text {
        rest: &'b [u8],
        /// What is left of the line.
        line: Tokens<'b>,
        number: u64,
    },
    Binary {
        bytes: &'b [u8],
        at: usize,
        is_big_endian: bool,
    },
}

impl<'b> Rows<'b> {
    /// Of a file whose header has so many bytes and lines.
    pub fn new(bytes: &'b [u8], encoding: Encoding, length: usize, lines: u64) -> Self {
        match encoding {
            Encoding::Text => Self::Text {
                rest: &bytes[length..],
                line: Tokens(&[]),
                number: lines,
            },
            _ => Self::Binary {
                bytes,
                at: length,
                is_big_endian: encoding == Encoding::BigEndian,
            },
        }
    }

    /// Where the next number is, or in a text the last one was.
    pub fn place(&self) -> Place {
        match self {
            Self::Text { number, .. } => Place::Line(*number),
            Self::Binary { at, .. } => Place::Byte(*at as u64),
        }
    }

    /// Bytes that are left.
    pub fn left(&self) -> usize {
        match self {
            Self::Text { rest, line, .. } => line.0.len() + rest.len(),
            Self::Binary { bytes, at, .. } => bytes.len() - at,
        }
    }

    /// The next number.
    #[inline]
    pub fn next(&mut self, kind: Number) -> Result<f64, Fault> {
        let place = self.place();
        match self {
            Self::Binary {
                bytes,
                at,
                is_big_endian,
            } => {
                let length = kind.bytes();
                let Some(found) = bytes.get(*at..*at + length) else {
                    let problem = Problem::Truncated {
                        what: "the next number",
                        needed: length as u64,
                        present: (bytes.len() - *at) as u64,
                    };
                    return Err(problem.at(place));
                };
                *at += length;
                // Little endian, in the first bytes.
                let mut word = [0; 8];
                word[..length].copy_from_slice(found);
                if *is_big_endian {
                    word[..length].reverse();
                }
                let [a, b, c, d, ..] = word;
                Ok(match kind {
                    Number::I8 => f64::from(a as i8),
                    Number::U8 => f64::from(a),
                    Number::I16 => f64::from(i16::from_le_bytes([a, b])),
                    Number::U16 => f64::from(u16::from_le_bytes([a, b])),
                    Number::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
                    Number::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
                    Number::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
                    Number::F64 => f64::from_le_bytes(word),
                })
            }
            Self::Text {
                rest,
                line,
                number: line_number,
            } => loop {
                if let Some(word) = line.next() {
                    let value = number(word, "a number");
                    return value.map_err(|problem| problem.at(Place::Line(*line_number)));
                }
                if rest.is_empty() {
                    let problem = Problem::Truncated {
                        what: "the next number",
                        needed: 1,
                        present: 0,
                    };
                    return Err(problem.at(place));
                }
                *line = Tokens(next_line(rest));
                *line_number += 1;
            },
        }
    }
}
