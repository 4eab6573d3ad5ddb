//! Kitty graphics: <https://sw.kovidgoyal.net/kitty/graphics-protocol/>.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use veduta::accumulate::Picture;
use veduta_io::{PictureFormat, PictureOptions, stream_picture};

/// Bytes of base64 that one escape sequence may carry.
const CHUNK: usize = 4096;

/// The picture as a PNG in escape sequences, drawn at the cursor, and a line feed.
pub fn encode(picture: &Picture) -> Vec<u8> {
    let mut png = Vec::new();
    let options = PictureOptions::default();
    stream_picture(&mut png, PictureFormat::Png, picture, &options)
        .expect("a small PNG fits in memory");
    let text = STANDARD.encode(png);
    let chunks: Vec<&[u8]> = text.as_bytes().chunks(CHUNK).collect();
    let mut out = Vec::new();
    for (index, chunk) in chunks.iter().enumerate() {
        let more = u8::from(index + 1 < chunks.len());
        let keys = match index {
            // Transmit and show (a=T) a PNG (f=100), and do not answer (q=2).
            0 => format!("a=T,f=100,q=2,m={more}"),
            _ => format!("m={more}"),
        };
        out.extend(b"\x1b_G");
        out.extend(keys.as_bytes());
        out.push(b';');
        out.extend(*chunk);
        out.extend(b"\x1b\\");
    }
    out.push(b'\n');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chunks_are_a_png_of_the_picture() {
        let (width, height) = (90_u32, 70_u32);
        let noise = |k: u32| (k.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        let picture = Picture {
            width,
            height,
            pixels: (0..width * height)
                .map(|k| [noise(k), noise(k + 7), noise(k + 99), 1.0])
                .collect(),
        };
        let out = String::from_utf8(encode(&picture)).expect("all is ASCII");
        let commands: Vec<&str> = out
            .strip_suffix('\n')
            .expect("a line feed")
            .split_terminator("\x1b\\")
            .collect();
        assert!(commands.len() > 2, "noise takes several chunks");
        let mut text = String::new();
        for (index, command) in commands.iter().enumerate() {
            let command = command.strip_prefix("\x1b_G").expect("a graphics command");
            let (keys, chunk) = command.split_once(';').expect("keys and data");
            let last = index + 1 == commands.len();
            assert!(keys.ends_with(if last { "m=0" } else { "m=1" }), "{keys}");
            assert_eq!(keys.starts_with("a=T,f=100,"), index == 0);
            assert!(chunk.len() <= CHUNK);
            text.push_str(chunk);
        }
        let png = STANDARD.decode(text).expect("base64");
        let reader = png::Decoder::new(std::io::Cursor::new(png)).read_info();
        let reader = reader.expect("a PNG");
        assert_eq!((reader.info().width, reader.info().height), (width, height));
    }
}
