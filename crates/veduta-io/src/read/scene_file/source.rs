//! The text of a file that people write, and the errors found in it: each points at its place.

use crate::read::error::{Detail, Excerpt, Place, Problem, ReadError};
use std::ops::Range;
use std::path::Path;

/// Bytes of the text.
pub type Span = Range<usize>;

/// Errors of one file that are told at once; nobody mends more before trying again.
const MOST_TOLD: usize = 20;
/// Errors that are kept until they are sorted.
const MOST_KEPT: usize = 1000;

/// A text file.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl<'a> Source<'a> {
    /// The bytes as text.
    ///
    /// # Errors
    /// At the first byte that is not UTF-8.
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Result<Self, ReadError> {
        let sound = match str::from_utf8(bytes) {
            Ok(text) => return Ok(Self { path, text }),
            Err(error) => error.valid_up_to(),
        };
        let text = str::from_utf8(&bytes[..sound]).expect("is valid up to there");
        let found = format!("the byte {:#04x}", bytes[sound]);
        let expected = "text in UTF-8; save the file in that encoding";
        let problem = Problem::Illegal { found, expected };
        Err(Self { path, text }.error(sound..sound, problem))
    }

    /// Line and column of a byte, both counted from 1; columns count characters.
    pub fn place(&self, offset: usize) -> Place {
        let before = &self.text[..self.boundary(offset)];
        let start = before.rfind('\n').map_or(0, |end| end + 1);
        Place::Text {
            line: 1 + before.matches('\n').count() as u64,
            column: 1 + before[start..].chars().count() as u64,
        }
    }

    /// An error about a part of the text.
    pub fn error(&self, span: Span, problem: Problem) -> ReadError {
        ReadError {
            file: self.path.into(),
            place: self.place(span.start),
            problem,
            detail: Some(Box::new(Detail {
                excerpt: self.excerpt(span),
                further: Vec::new(),
            })),
        }
    }

    /// The line that `span` begins in, cut to what fits a terminal.
    fn excerpt(&self, span: Span) -> Excerpt {
        let start = self.boundary(span.start);
        let end = self.boundary(span.end.max(start));
        let text = self.text;
        let line_start = text[..start].rfind('\n').map_or(0, |end| end + 1);
        let line_end = text[start..].find(['\r', '\n']);
        let line_end = line_end.map_or(text.len(), |length| start + length);
        let before = text[line_start..start].chars().count();
        let length = text[start..end.min(line_end)].chars().count();

        const WIDTH: usize = 96;
        const LEAD: usize = 40;
        // So that `LEAD` characters stay before the place.
        let cut = if before + length <= WIDTH {
            0
        } else {
            before.saturating_sub(LEAD)
        };
        let mut line: String = text[line_start..line_end]
            .chars()
            .skip(cut)
            .take(WIDTH)
            .map(|character| {
                if character.is_control() {
                    ' '
                } else {
                    character
                }
            })
            .collect();
        if cut > 0 {
            line = line.chars().skip(1).collect();
            line.insert(0, '…');
        }
        let before = before - cut;
        Excerpt {
            line,
            before,
            length: length.clamp(1, WIDTH.saturating_sub(before).max(1)),
        }
    }

    /// The nearest place at or before `offset` where a character begins.
    fn boundary(&self, offset: usize) -> usize {
        let mut offset = offset.min(self.text.len());
        while !self.text.is_char_boundary(offset) {
            offset -= 1;
        }
        offset
    }
}

/// What is wrong in a file, as it is found.
#[derive(Debug, Default)]
pub struct Faults {
    rows: Vec<(Span, Problem)>,
}

impl Faults {
    pub fn add(&mut self, span: Span, problem: Problem) {
        if self.rows.len() < MOST_KEPT {
            self.rows.push((span, problem));
        }
    }

    /// A sentence about something that has the right form, but makes no sense.
    pub fn senseless(&mut self, span: Span, message: impl Into<String>) {
        self.add(span, Problem::Senseless(message.into()));
    }

    /// The first errors in the order of the text; nothing if there are none.
    pub fn finish(mut self, source: &Source<'_>) -> Result<(), ReadError> {
        self.rows.sort_by_key(|(span, _)| span.start);
        let mut errors = self
            .rows
            .into_iter()
            .take(MOST_TOLD)
            .map(|(span, problem)| source.error(span, problem));
        let Some(mut first) = errors.next() else {
            return Ok(());
        };
        if let Some(detail) = &mut first.detail {
            detail.further = errors.collect();
        }
        Err(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn excerpt(text: &str, span: Span) -> (Place, Excerpt) {
        let path = Path::new("f");
        let source = Source { path, text };
        (source.place(span.start), source.excerpt(span))
    }

    #[test]
    fn places_count_lines_and_characters_from_one() {
        let text = "a = 1\r\n\u{e9}\u{e9} = x\nlast";
        let at = text.find('x').expect("is there");
        let (place, excerpt) = excerpt(text, at..at + 1);
        assert_eq!(place, Place::Text { line: 2, column: 6 });
        assert_eq!(excerpt.line, "\u{e9}\u{e9} = x");
        assert_eq!((excerpt.before, excerpt.length), (5, 1));
    }

    #[test]
    fn a_place_at_the_end_of_the_text_has_a_caret_too() {
        let (place, excerpt) = excerpt("a = ", 4..4);
        assert_eq!(place, Place::Text { line: 1, column: 5 });
        assert_eq!((excerpt.before, excerpt.length), (4, 1));
        assert_eq!(excerpt.line, "a = ");
    }

    #[test]
    fn a_long_line_is_cut_around_the_place() {
        let text = format!("{}here{}", "x".repeat(1000), "y".repeat(1000));
        let (_, excerpt) = excerpt(&text, 1000..1004);
        let shown: String = excerpt.line.chars().skip(excerpt.before).collect();
        assert!(shown.starts_with("here"), "{excerpt:?}");
        assert!(excerpt.line.chars().count() <= 96 && excerpt.line.starts_with('…'));
    }

    #[test]
    fn bytes_that_are_no_text_are_told_with_their_place() {
        let error = Source::new(Path::new("f"), b"a = 1\nb = \xff").expect_err("is no text");
        assert_eq!(error.place, Place::Text { line: 2, column: 5 });
        assert!(error.to_string().contains("0xff"), "{error}");
    }
}
