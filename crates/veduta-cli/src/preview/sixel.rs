//! Sixel graphics: DEC STD 070, chapter 9; six rows of pixels a character.

use super::shown;
use std::io::Write;
use veduta::accumulate::Picture;

/// Levels of red, green and blue: 252 colours, of the 256 that terminals have. Green has most: there
/// the eye sees best.
const LEVELS: [u32; 3] = [6, 7, 6];

/// The picture in a fixed palette, its errors diffused to neighbours (Floyd & Steinberg, 1976).
/// Pixels that are covered by less than half are left as they are on the screen.
pub fn encode(picture: &Picture) -> Vec<u8> {
    let width = picture.width as usize;
    let indices = quantise(picture);
    // P2 = 1: what is not drawn stays. Square pixels.
    let mut out = format!("\x1bP0;1q\"1;1;{};{}", picture.width, picture.height).into_bytes();
    let colors = LEVELS.iter().product::<u32>() as usize;
    for index in 0..colors {
        // In percent.
        let [r, g, b] = level_of(index).map(|level| (100.0 * level).round() as u32);
        write(&mut out, format_args!("#{index};2;{r};{g};{b}"));
    }
    for band in indices.chunks(6 * width) {
        let mut used = vec![false; colors];
        for &index in band.iter().flatten() {
            used[index] = true;
        }
        let used = (0..colors).filter(|&index| used[index]);
        for (count, color) in used.enumerate() {
            if count > 0 {
                // Back to the left, for the next colour.
                out.push(b'$');
            }
            write(&mut out, format_args!("#{color}"));
            let sixel = |x: usize| {
                let rows = band.chunks(width).enumerate();
                rows.filter(|(_, row)| row[x] == Some(color))
                    .fold(0u8, |bits, (y, _)| bits | 1 << y)
            };
            let mut x = 0;
            while x < width {
                let bits = sixel(x);
                let length = (x..width).take_while(|&x| sixel(x) == bits).count();
                let character = char::from(b'?' + bits);
                match length {
                    1..=3 => (0..length).for_each(|_| out.push(character as u8)),
                    _ => write(&mut out, format_args!("!{length}{character}")),
                }
                x += length;
            }
        }
        out.push(b'-');
    }
    out.extend(b"\x1b\\\n");
    out
}

fn write(out: &mut Vec<u8>, text: std::fmt::Arguments<'_>) {
    out.write_fmt(text).expect("memory takes all");
}

/// The colour of an index of the palette, sRGB from 0 to 1.
fn level_of(index: usize) -> [f32; 3] {
    let [_, green, blue] = LEVELS.map(|levels| levels as usize);
    let steps = [index / (green * blue), index / blue % green, index % blue];
    [0, 1, 2].map(|channel| steps[channel] as f32 / (LEVELS[channel] - 1) as f32)
}

/// The palette's index for each pixel; `None` for those that are not drawn.
fn quantise(picture: &Picture) -> Vec<Option<usize>> {
    let width = picture.width as usize;
    let mut indices = Vec::with_capacity(picture.pixels.len());
    // The errors of this row and the next, with a pixel more on each side.
    let mut errors = [vec![[0.0f32; 3]; width + 2], vec![[0.0f32; 3]; width + 2]];
    for row in picture.pixels.chunks(width) {
        for (x, &pixel) in row.iter().enumerate() {
            let Some(color) = shown(pixel) else {
                indices.push(None);
                continue;
            };
            let mut index = 0;
            for channel in 0..3 {
                let wanted = (color[channel] + errors[0][x + 1][channel]).clamp(0.0, 1.0);
                let most = (LEVELS[channel] - 1) as f32;
                let step = (wanted * most).round();
                index = index * LEVELS[channel] as usize + step as usize;
                let error = wanted - step / most;
                for (row, x, share) in [
                    (0, x + 2, 7.0),
                    (1, x, 3.0),
                    (1, x + 1, 5.0),
                    (1, x + 2, 1.0),
                ] {
                    errors[row][x][channel] += error * share / 16.0;
                }
            }
            indices.push(Some(index));
        }
        errors.swap(0, 1);
        errors[1].fill([0.0; 3]);
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a terminal draws: colours in percent, or nothing.
    fn decode(bytes: &[u8]) -> (usize, usize, Vec<Option<[u32; 3]>>) {
        let text = std::str::from_utf8(bytes).expect("all is ASCII");
        let body = text
            .strip_prefix("\x1bP0;1q\"1;1;")
            .and_then(|rest| rest.strip_suffix("\x1b\\\n"))
            .expect("a sixel string");
        let mut rest = body.chars().peekable();
        let number = |rest: &mut std::iter::Peekable<std::str::Chars<'_>>| {
            let mut value = 0;
            while let Some(digit) = rest.peek().and_then(|c| c.to_digit(10)) {
                value = 10 * value + digit;
                rest.next();
            }
            value
        };
        let width = number(&mut rest) as usize;
        rest.next();
        let height = number(&mut rest) as usize;
        let mut palette = vec![[0; 3]; 256];
        let mut pixels = vec![None; width * height];
        let (mut x, mut top, mut color) = (0, 0, 0);
        while let Some(command) = rest.next() {
            let mut length = 1;
            let mut drawn = command;
            match command {
                '#' => {
                    color = number(&mut rest) as usize;
                    if rest.peek() == Some(&';') {
                        let values = [0; 4].map(|_| {
                            rest.next();
                            number(&mut rest)
                        });
                        assert_eq!(values[0], 2, "RGB");
                        palette[color] = [values[1], values[2], values[3]];
                    }
                    continue;
                }
                '$' => {
                    x = 0;
                    continue;
                }
                '-' => {
                    x = 0;
                    top += 6;
                    continue;
                }
                '!' => {
                    length = number(&mut rest) as usize;
                    drawn = rest.next().expect("what is repeated");
                }
                _ => {}
            }
            let bits = drawn as u8 - b'?';
            assert!(bits < 64, "{drawn:?}");
            for _ in 0..length {
                for y in (0..6).filter(|y| bits >> y & 1 == 1) {
                    let pixel: &mut Option<[u32; 3]> = &mut pixels[(top + y) * width + x];
                    assert_eq!(*pixel, None, "each pixel is drawn once");
                    *pixel = Some(palette[color]);
                }
                x += 1;
            }
        }
        (width, height, pixels)
    }

    #[test]
    fn what_a_terminal_draws_is_the_picture() {
        let (width, height) = (40_u32, 21_u32);
        let pixel = |k: u32| {
            let (x, y) = (k % width, k / width);
            match (x < 20, y < 10) {
                (true, true) => [0.0; 4],
                (true, false) => [0.0, 0.0, 1.0, 1.0],
                // The middle grey of sRGB.
                (false, _) => [0.214, 0.214, 0.214, 1.0],
            }
        };
        let picture = Picture {
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
        };
        let (w, h, drawn) = decode(&encode(&picture));
        assert_eq!((w, h), (width as usize, height as usize));
        let mut sum = 0;
        for (k, drawn) in drawn.iter().enumerate() {
            match picture.pixels[k] {
                [.., 0.0] => assert_eq!(*drawn, None),
                [0.0, ..] => assert_eq!(*drawn, Some([0, 0, 100])),
                _ => sum += drawn.expect("is drawn").iter().sum::<u32>(),
            }
        }
        // No single colour of the palette is that grey, but their mean is: 50 percent.
        let mean = f64::from(sum) / f64::from(3 * 20 * height);
        assert!((mean - 50.0).abs() < 1.5, "{mean}");
    }
}
