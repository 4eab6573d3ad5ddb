use super::WriteProblem;
use std::io::Write;
use veduta::accumulate::Picture;

/// Writes the array: version 1.0 of the format (NEP 1), little-endian f32, rows from the top.
pub fn write(writer: &mut impl Write, picture: &Picture) -> Result<(), WriteProblem> {
    let (height, width) = (picture.height, picture.width);
    let description =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}, 4), }}");
    // Magic, version and length take 10 bytes; the header ends in a newline at a multiple of 64.
    let length = (10 + description.len() + 1).next_multiple_of(64) - 10;
    writer.write_all(b"\x93NUMPY\x01\x00")?;
    writer.write_all(&(length as u16).to_le_bytes())?;
    writer.write_all(format!("{description:<0$}\n", length - 1).as_bytes())?;
    for row in picture.pixels.chunks(picture.width.max(1) as usize) {
        let bytes: Vec<u8> = row
            .iter()
            .flatten()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        writer.write_all(&bytes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_as_numpy_writes_it() {
        let picture = Picture {
            width: 3,
            height: 2,
            pixels: vec![[0.25, -1.0, 2.0, 0.5]; 6],
        };
        let mut bytes = Vec::new();
        write(&mut bytes, &picture).expect("memory takes all");
        let mut expected = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, \
            'shape': (2, 3, 4), }"
            .to_vec();
        expected.resize(127, b' ');
        expected.push(b'\n');
        assert_eq!(bytes[..128], expected);
        assert_eq!(bytes.len(), 128 + 6 * 16);
        assert_eq!(bytes[128..132], 0.25f32.to_le_bytes());
    }
}
