//! A small picture in the terminal.
//!
//! Three ways, best first: kitty graphics (all colours, opacity), sixel (252 colours, no partial
//! opacity), half blocks (two pixels a character, any terminal with colours). [`Style::Auto`] chooses
//! by the environment alone: asking the terminal would mean to wait for an answer that may never
//! come, and to read what the user types meanwhile.
//!
//! | way | when |
//! | --- | --- |
//! | none | stdout is no terminal, or `TERM` is `dumb` |
//! | half blocks | inside tmux or screen (`TMUX`, `STY`), which pass on neither of the others by default |
//! | kitty | `KITTY_WINDOW_ID` is set, `TERM` holds `kitty` or `ghostty`, or `TERM_PROGRAM` is `WezTerm` or `ghostty` |
//! | sixel | `TERM` begins with `foot`, `mlterm` or `contour`, or `TERM_PROGRAM` is `iTerm.app` |
//! | half blocks | otherwise |
//!
//! Half blocks are in 24-bit colours where `COLORTERM` is `truecolor` or `24bit`, else in the 6 x 6 x
//! 6 colours of 256.

mod blocks;
mod kitty;
mod sixel;

use clap::ValueEnum;
use std::io::{self, IsTerminal};
use veduta::accumulate::Picture;
use veduta_io::tone::srgb_from_linear;

/// `--preview`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Style {
    /// As the terminal says of itself; nothing in a pipe
    Auto,
    /// Kitty graphics
    Kitty,
    /// Sixel
    Sixel,
    /// Half blocks
    Blocks,
}

/// A way to show pictures, and how much room there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screen {
    way: Way,
    /// Pixels of a way's own, wide and high, that may be filled.
    room: [u32; 2],
    true_color: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Kitty,
    Sixel,
    Blocks,
}

/// The most characters that a preview takes, wide and high: it is small, and the commands before it
/// stay in sight.
const MOST_CHARACTERS: [u32; 2] = [100, 30];

/// Characters of a terminal whose size is unknown.
const USUAL_CHARACTERS: [u32; 2] = [80, 24];

/// Pixels of a character whose size is unknown.
const USUAL_CELL: [u32; 2] = [8, 16];

/// What the environment says of the terminal.
struct Environment {
    is_terminal: bool,
    variable: fn(&str) -> Option<String>,
}

impl Screen {
    /// The screen for `style`; `None` where nothing should be shown.
    pub fn of(style: Style) -> Option<Self> {
        let environment = Environment {
            is_terminal: io::stdout().is_terminal(),
            variable: |name| std::env::var(name).ok(),
        };
        let way = match style {
            Style::Auto => environment.way()?,
            Style::Kitty => Way::Kitty,
            Style::Sixel => Way::Sixel,
            Style::Blocks => Way::Blocks,
        };
        let (characters, cell) = terminal_size();
        // A line stays free for the prompt.
        let characters = [
            characters[0].clamp(1, MOST_CHARACTERS[0]),
            characters[1].saturating_sub(1).clamp(1, MOST_CHARACTERS[1]),
        ];
        let room = match way {
            Way::Blocks => [characters[0], 2 * characters[1]],
            Way::Kitty | Way::Sixel => [0, 1].map(|k| characters[k] * cell[k]),
        };
        Some(Self {
            way,
            room,
            true_color: environment.has_true_color(),
        })
    }

    /// Size in pixels of the preview of a picture of `width` x `height`: as large as there is room
    /// for, and not enlarged.
    pub fn size_of(&self, width: u32, height: u32) -> [u32; 2] {
        let [room_x, room_y] = self.room.map(f64::from);
        let (w, h) = (f64::from(width), f64::from(height));
        let scale = (room_x / w).min(room_y / h).min(1.0);
        [w, h].map(|side| (side * scale).round().max(1.0) as u32)
    }

    /// The bytes that show the picture, which has the size of [`Screen::size_of`].
    pub fn show(&self, picture: &Picture) -> Vec<u8> {
        match self.way {
            Way::Kitty => kitty::encode(picture),
            Way::Sixel => sixel::encode(picture),
            Way::Blocks => blocks::encode(picture, self.true_color),
        }
    }
}

impl Environment {
    fn way(&self) -> Option<Way> {
        let variable = |name: &str| (self.variable)(name).unwrap_or_default();
        let (term, program) = (variable("TERM"), variable("TERM_PROGRAM"));
        if !self.is_terminal || term == "dumb" {
            return None;
        }
        let is_set = |name: &str| !variable(name).is_empty();
        if is_set("TMUX") || is_set("STY") {
            return Some(Way::Blocks);
        }
        let is_kitty = is_set("KITTY_WINDOW_ID")
            || ["kitty", "ghostty"].iter().any(|name| term.contains(name))
            || ["WezTerm", "ghostty"].contains(&program.as_str());
        let is_sixel = ["foot", "mlterm", "contour"]
            .iter()
            .any(|name| term.starts_with(name))
            || program == "iTerm.app";
        Some(match () {
            () if is_kitty => Way::Kitty,
            () if is_sixel => Way::Sixel,
            () => Way::Blocks,
        })
    }

    fn has_true_color(&self) -> bool {
        let color = (self.variable)("COLORTERM").unwrap_or_default();
        color == "truecolor" || color == "24bit"
    }
}

/// Characters of the terminal, wide and high, and pixels of a character.
fn terminal_size() -> ([u32; 2], [u32; 2]) {
    #[cfg(unix)]
    if let Ok(size) = rustix::termios::tcgetwinsize(io::stdout()) {
        let (columns, rows) = (u32::from(size.ws_col), u32::from(size.ws_row));
        if columns > 0 && rows > 0 {
            let cell = [
                u32::from(size.ws_xpixel) / columns,
                u32::from(size.ws_ypixel) / rows,
            ];
            let known = cell[0] > 0 && cell[1] > 0;
            return ([columns, rows], if known { cell } else { USUAL_CELL });
        }
    }
    (USUAL_CHARACTERS, USUAL_CELL)
}

/// sRGB of the surface of a pixel, 0 to 1; `None` where less than half of it is covered.
fn shown([r, g, b, alpha]: [f32; 4]) -> Option<[f32; 3]> {
    (alpha >= 0.5)
        .then(|| [r, g, b].map(|channel| srgb_from_linear((channel / alpha).clamp(0.0, 1.0))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_is_chosen_by_what_the_terminal_says_of_itself() {
        fn way(is_terminal: bool, variable: fn(&str) -> Option<String>) -> Option<Way> {
            Environment {
                is_terminal,
                variable,
            }
            .way()
        }
        macro_rules! variables {
            ($($name:literal = $value:literal),*) => {
                |name| match name {
                    $($name => Some($value.to_owned()),)*
                    _ => None,
                }
            };
        }
        let kitty: fn(&str) -> Option<String> = variables!("TERM" = "xterm-kitty");
        assert_eq!(way(true, kitty), Some(Way::Kitty));
        assert_eq!(way(false, kitty), None, "nothing in a pipe");
        assert_eq!(way(true, variables!("TERM" = "dumb")), None);
        assert_eq!(
            way(true, variables!("TERM" = "xterm-kitty", "TMUX" = "/tmp/x")),
            Some(Way::Blocks)
        );
        assert_eq!(
            way(
                true,
                variables!("TERM" = "xterm-256color", "TERM_PROGRAM" = "WezTerm")
            ),
            Some(Way::Kitty)
        );
        assert_eq!(
            way(true, variables!("TERM" = "foot-extra")),
            Some(Way::Sixel)
        );
        assert_eq!(
            way(true, variables!("TERM" = "xterm-256color")),
            Some(Way::Blocks)
        );
    }

    #[test]
    fn previews_keep_their_shape_and_are_not_enlarged() {
        let screen = Screen {
            way: Way::Blocks,
            room: [80, 46],
            true_color: true,
        };
        assert_eq!(screen.size_of(1280, 960), [61, 46]);
        assert_eq!(screen.size_of(1000, 100), [80, 8]);
        assert_eq!(screen.size_of(10, 10), [10, 10]);
        assert_eq!(screen.size_of(60_000, 1), [80, 1]);
    }
}
