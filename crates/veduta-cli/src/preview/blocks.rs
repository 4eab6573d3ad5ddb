//! Half blocks: two pixels a character, the upper one in the colour of the text, the lower one in that
//! of its background.

use super::shown;
use std::fmt::Write;
use veduta::accumulate::Picture;

/// Lines of half blocks. Pixels that are covered by less than half are left as the terminal is.
pub fn encode(picture: &Picture, true_color: bool) -> Vec<u8> {
    let mut text = String::new();
    let width = picture.width as usize;
    for rows in picture.pixels.chunks(2 * width) {
        let (upper, lower) = rows.split_at(width);
        // Colours hold until others are set.
        let mut last = [None; 2];
        for (x, &upper) in upper.iter().enumerate() {
            let upper = shown(upper);
            let lower = lower.get(x).and_then(|&pixel| shown(pixel));
            let (front, back, character) = match (upper, lower) {
                (None, None) => (None, None, ' '),
                (Some(_), _) => (upper, lower, '▀'),
                (None, Some(_)) => (lower, None, '▄'),
            };
            let wanted = [front, back].map(|color| color.map(|color| code(color, true_color)));
            if last
                .iter()
                .zip(&wanted)
                .any(|(was, is)| was.is_some() && is.is_none())
            {
                text.push_str("\x1b[0m");
                last = [None; 2];
            }
            for (layer, kind) in [38, 48].into_iter().enumerate() {
                if let Some(code) = wanted[layer]
                    && last[layer] != wanted[layer]
                {
                    match code {
                        Color::True([r, g, b]) => {
                            push(&mut text, format_args!("\x1b[{kind};2;{r};{g};{b}m"))
                        }
                        Color::Indexed(index) => {
                            push(&mut text, format_args!("\x1b[{kind};5;{index}m"))
                        }
                    }
                }
            }
            last = wanted;
            text.push(character);
        }
        text.push_str("\x1b[0m\n");
    }
    text.into_bytes()
}

fn push(text: &mut String, what: std::fmt::Arguments<'_>) {
    text.write_fmt(what).expect("strings grow");
}

#[derive(Clone, Copy, PartialEq)]
enum Color {
    True([u8; 3]),
    /// Of the 256 colours; 16 to 231 are a cube of 6 x 6 x 6.
    Indexed(u8),
}

/// Levels of the cube's colours, of 255.
const CUBE: [f32; 6] = [0.0, 95.0, 135.0, 175.0, 215.0, 255.0];

fn code(color: [f32; 3], true_color: bool) -> Color {
    let color = color.map(|channel| 255.0 * channel);
    if true_color {
        return Color::True(color.map(|channel| channel.round() as u8));
    }
    let [r, g, b] = color.map(|channel| {
        let distance = |level: &usize| (CUBE[*level] - channel).abs();
        let nearest = (0..6).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.unwrap_or(0) as u8
    });
    Color::Indexed(16 + 36 * r + 6 * g + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(rows: &[&[[f32; 4]]], true_color: bool) -> String {
        let picture = Picture {
            width: rows[0].len() as u32,
            height: rows.len() as u32,
            pixels: rows.concat(),
        };
        String::from_utf8(encode(&picture, true_color)).expect("text")
    }

    const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
    const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];
    const NOTHING: [f32; 4] = [0.0; 4];

    #[test]
    fn each_character_shows_two_pixels() {
        let text = encoded(&[&[RED, NOTHING, NOTHING], &[BLUE, RED, NOTHING]], true);
        assert_eq!(
            text,
            "\x1b[38;2;255;0;0m\x1b[48;2;0;0;255m▀\x1b[0m\x1b[38;2;255;0;0m▄\x1b[0m \x1b[0m\n"
        );
    }

    #[test]
    fn an_odd_last_row_leaves_the_lower_half_alone() {
        let text = encoded(&[&[RED, RED]], false);
        assert_eq!(text, "\x1b[38;5;196m▀▀\x1b[0m\n");
    }

    #[test]
    fn half_covered_pixels_have_the_colour_of_their_surface() {
        let half = [0.5, 0.0, 0.0, 0.5];
        assert_eq!(encoded(&[&[half]], true), encoded(&[&[RED]], true));
    }
}
