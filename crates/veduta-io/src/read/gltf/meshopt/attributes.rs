//! Mode 0: elements as differences of their bytes from those of the element before.
//!
//! KHR_meshopt_compression, appendix A, "Mode 0: attributes", versions 0 and 1. Elements come in
//! blocks of up to 256; in a block the first bytes of all elements stand together, then the second
//! ones, and so on, in groups of 16 that have as many bits each as they need.

use super::{ENDS_EARLY, GOES_ON, WRONG_START};

/// Elements of a group.
const GROUP: usize = 16;
/// Most elements of a block.
const BLOCK: usize = 256;
/// Most bytes of a block.
const BLOCK_BYTES: usize = 8192;

/// Bits of a difference, by the group's header; for version 0, and for the control modes 0 and 1 of
/// version 1.
const WIDTHS: [[u32; 4]; 3] = [[0, 2, 4, 8], [0, 1, 2, 4], [1, 2, 4, 8]];

/// How the bytes of a channel, which are four, follow from those of the element before.
#[derive(Clone, Copy, Debug)]
enum Channel {
    /// Each byte by itself.
    Bytes,
    /// Two numbers of two bytes.
    Words,
    /// Bits of one number of four bytes that changed, rotated to the left by so many.
    Bits(u32),
}

impl Channel {
    fn of(code: u8) -> Result<Self, &'static str> {
        match (code & 15, code >> 4) {
            (0, 0) => Ok(Self::Bytes),
            (1, 0) => Ok(Self::Words),
            (2, rotation) => Ok(Self::Bits(rotation.into())),
            _ => Err("a channel has an unknown mode"),
        }
    }
}

/// Decodes `count` elements of `stride` bytes, a multiple of 4 up to 256.
pub fn decode(stream: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, &'static str> {
    let version = match stream.first() {
        Some(0xa0) => 0,
        Some(0xa1) => 1,
        Some(_) => return Err(WRONG_START),
        None => return Err(ENDS_EARLY),
    };
    // At the end: the element before the first one, and the modes of the channels.
    let modes = if version == 0 { 0 } else { stride / 4 };
    let least = if version == 0 { 32 } else { 24 };
    let tail = (stride + modes).max(least);
    let Some(body) = (stream.len() - 1).checked_sub(tail) else {
        return Err(ENDS_EARLY);
    };
    let (body, tail) = stream[1..].split_at(body);
    let (tail, modes) = tail.split_at(tail.len() - modes);
    let mut previous = tail[tail.len() - stride..].to_vec();
    let channels: Vec<Channel> = match version {
        0 => vec![Channel::Bytes; stride / 4],
        _ => modes
            .iter()
            .map(|&code| Channel::of(code))
            .collect::<Result<_, _>>()?,
    };

    let mut elements = vec![0; count * stride];
    let per_block = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK);
    let mut body = Reader { rest: body };
    // Differences of a channel: four rows, one for each byte.
    let mut deltas = [[0; BLOCK]; 4];
    for block in elements.chunks_mut(per_block * stride) {
        let block_count = block.len() / stride;
        let controls = match version {
            0 => &[],
            _ => body.take(stride / 4)?,
        };
        for (index, &channel) in channels.iter().enumerate() {
            for (byte, row) in deltas.iter_mut().enumerate() {
                let widths = match controls.get(index).map(|bits| bits >> (2 * byte) & 3) {
                    None => WIDTHS[0],
                    Some(2) => {
                        row.fill(0);
                        continue;
                    }
                    Some(3) => {
                        row[..block_count].copy_from_slice(body.take(block_count)?);
                        continue;
                    }
                    Some(control) => WIDTHS[1 + usize::from(control)],
                };
                body.groups(widths, &mut row[..block_count.next_multiple_of(GROUP)])?;
            }
            let previous = &mut previous[4 * index..][..4];
            let places = block[4 * index..].chunks_mut(stride).map(|c| &mut c[..4]);
            channel.add_up(&deltas, previous, places);
        }
    }
    if !body.rest.is_empty() {
        return Err(GOES_ON);
    }
    Ok(elements)
}

impl Channel {
    /// Puts the channel's bytes of a block's elements to their `places`; `previous` are those of the
    /// element before, and afterwards of the last one.
    fn add_up<'a>(
        self,
        deltas: &[[u8; BLOCK]; 4],
        previous: &mut [u8],
        places: impl Iterator<Item = &'a mut [u8]>,
    ) {
        let [p, q, r, s] = deltas;
        let mut last = [previous[0], previous[1], previous[2], previous[3]];
        let rows = p.iter().zip(q).zip(r).zip(s);
        for (place, (((&p, &q), &r), &s)) in places.zip(rows) {
            let delta = [p, q, r, s];
            last = match self {
                Self::Bytes => std::array::from_fn(|byte| {
                    let code = delta[byte];
                    last[byte].wrapping_add((code >> 1) ^ (code & 1).wrapping_neg())
                }),
                Self::Words => {
                    let next = |at: usize| {
                        let code = u16::from_le_bytes([delta[at], delta[at + 1]]);
                        let before = u16::from_le_bytes([last[at], last[at + 1]]);
                        let difference = (code >> 1) ^ (code & 1).wrapping_neg();
                        before.wrapping_add(difference).to_le_bytes()
                    };
                    let ([a, b], [c, d]) = (next(0), next(2));
                    [a, b, c, d]
                }
                Self::Bits(rotation) => {
                    let changed = u32::from_le_bytes(delta).rotate_right(rotation);
                    (u32::from_le_bytes(last) ^ changed).to_le_bytes()
                }
            };
            place.copy_from_slice(&last);
        }
        previous.copy_from_slice(&last);
    }
}

/// What is left of the stream's body.
struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], &'static str> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or(ENDS_EARLY)?;
        self.rest = rest;
        Ok(taken)
    }

    /// Reads the groups of a row; their headers, two bits each, stand before them.
    fn groups(&mut self, widths: [u32; 4], row: &mut [u8]) -> Result<(), &'static str> {
        let groups = row.as_chunks_mut::<GROUP>().0;
        let headers = self.take(groups.len().div_ceil(4))?;
        for (index, group) in groups.iter_mut().enumerate() {
            let header = headers[index / 4] >> (2 * (index % 4)) & 3;
            match widths[usize::from(header)] {
                0 => group.fill(0),
                8 => group.copy_from_slice(self.take(GROUP)?),
                width => self.narrow_group(width, group)?,
            }
        }
        Ok(())
    }

    /// Reads a group of differences of 1, 2 or 4 bits. Where all bits are set, the difference is a
    /// byte that follows the group.
    fn narrow_group(&mut self, width: u32, group: &mut [u8; GROUP]) -> Result<(), &'static str> {
        let packed = self.take(2 * width as usize)?;
        let per_byte = 8 / width as usize;
        let all_set = (1 << width) - 1;
        for (index, value) in group.iter_mut().enumerate() {
            let place = (index % per_byte) as u32;
            // Single bits start at the lowest, wider ones at the highest.
            let shift = if width == 1 {
                place
            } else {
                8 - width * (place + 1)
            };
            *value = packed[index / per_byte] >> shift & all_set;
        }
        for value in group.iter_mut().filter(|value| **value == all_set) {
            let (&wide, rest) = self.rest.split_first().ok_or(ENDS_EARLY)?;
            *value = wide;
            self.rest = rest;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_group_that_the_specification_decodes_is_decoded() {
        let bytes = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
        let mut group = [0; GROUP];
        let mut reader = Reader { rest: &bytes };
        reader.narrow_group(4, &mut group).expect("ten bytes");
        let deltas = group.map(|code| ((code >> 1) ^ (code & 1).wrapping_neg()) as i8);
        let expected = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0];
        assert_eq!(deltas, expected);
        assert!(reader.rest.is_empty());
    }
}
