use super::WriteProblem;
use std::io::Write;
use veduta::accumulate::Picture;

/// Writes a Portable Float Map: little-endian f32 RGB, rows from the bottom, as Debevec's HDR Shop
/// defined it. It has no place for opacity: colour is premultiplied, so the picture is on black.
pub fn write(writer: &mut impl Write, picture: &Picture) -> Result<(), WriteProblem> {
    // A scale below 0 means little-endian.
    write!(writer, "PF\n{} {}\n-1.0\n", picture.width, picture.height)?;
    for row in picture.pixels.chunks(picture.width.max(1) as usize).rev() {
        let bytes: Vec<u8> = row
            .iter()
            .flat_map(|&[r, g, b, _]| [r, g, b])
            .flat_map(f32::to_le_bytes)
            .collect();
        writer.write_all(&bytes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stand_from_the_bottom_up_after_three_lines_of_text() {
        let picture = Picture {
            width: 1,
            height: 2,
            pixels: vec![[1.0, 2.0, 3.0, 1.0], [0.5, 0.25, 0.0, 0.5]],
        };
        let mut bytes = Vec::new();
        write(&mut bytes, &picture).expect("memory takes all");
        let (text, numbers) = bytes.split_at(b"PF\n1 2\n-1.0\n".len());
        assert_eq!(text, b"PF\n1 2\n-1.0\n");
        let numbers: Vec<f32> = numbers
            .as_chunks()
            .0
            .iter()
            .map(|&bytes| f32::from_le_bytes(bytes))
            .collect();
        assert_eq!(numbers, [0.5, 0.25, 0.0, 1.0, 2.0, 3.0]);
    }
}
