//! How errors of a file that people write are shown: each with its line and a caret under the place.
//!
//! ```text
//! town.toml:12:1: unknown key "modle" in [[layer]]; did you mean "model"?
//!    12 | modle = "house.obj"
//!       | ^^^^^
//! ```

use std::fmt::Write;
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};
use veduta_io::{Excerpt, Place, ReadError};

/// The error and all that were found with it, a paragraph each, and `between` them. Carets are red
/// if `colored`.
pub fn with_excerpts(error: &ReadError, between: &str, colored: bool) -> String {
    let mut text = String::new();
    for error in error.all() {
        if !text.is_empty() {
            text += between;
        }
        add(error, colored, &mut text);
    }
    text
}

fn add(error: &ReadError, colored: bool, text: &mut String) {
    // Writing to a string cannot fail.
    let _ = write!(text, "{error}");
    if let (Some(detail), Place::Text { line, .. }) = (&error.detail, &error.place) {
        let Excerpt {
            line: quoted,
            before,
            length,
        } = &detail.excerpt;
        let width = |characters: &mut dyn Iterator<Item = char>| -> usize {
            characters.map(|c| c.width().unwrap_or(0)).sum()
        };
        let indent = width(&mut quoted.chars().take(*before));
        // Past the end of the line a caret is as wide as a letter.
        let under = width(&mut quoted.chars().skip(*before).take(*length)).max(1);
        let number = line.to_string();
        let number_width = number.width().max(5);
        let carets = "^".repeat(under);
        let carets = if colored {
            format!("\x1b[1;31m{carets}\x1b[0m")
        } else {
            carets
        };
        let _ = write!(
            text,
            "\n{number:>number_width$} | {quoted}\n{:>number_width$} | {:indent$}{carets}",
            "", ""
        );
    }
}
