//! Modes 1 and 2: indices of triangles, and other sequences of indices.
//!
//! KHR_meshopt_compression, appendix A, "Mode 1: triangles" and "Mode 2: indices".

use super::{ENDS_EARLY, GOES_ON, WRONG_START};

/// What the queues hold before anything was put in: an index that no mesh has, so that a stream that
/// reads it is refused with the indices. (In a view of two bytes it becomes the index 65,535.)
const NEVER: u32 = u32::MAX;

/// Decodes `count` indices, three for each triangle.
pub fn decode_triangles(stream: &[u8], count: usize) -> Result<Vec<u32>, &'static str> {
    match stream.first() {
        Some(0xe1) => {}
        Some(_) => return Err(WRONG_START),
        None => return Err(ENDS_EARLY),
    }
    let (codes, rest) = stream[1..].split_at_checked(count / 3).ok_or(ENDS_EARLY)?;
    let (body, pairs) = rest.split_last_chunk::<16>().ok_or(ENDS_EARLY)?;
    let mut state = Triangles {
        body: Reader { rest: body },
        next: 0,
        last: 0,
        edges: Queue::new([NEVER; 2]),
        vertices: Queue::new(NEVER),
    };
    let mut indices = Vec::with_capacity(count);
    for &code in codes {
        indices.extend(state.triangle(code, pairs)?);
    }
    if !state.body.rest.is_empty() {
        return Err(GOES_ON);
    }
    Ok(indices)
}

/// What the decoder of triangles remembers. The names are the specification's.
struct Triangles<'a> {
    body: Reader<'a>,
    /// The smallest index that was not yet seen.
    next: u32,
    /// The last index that was given in full.
    last: u32,
    edges: Queue<[u32; 2]>,
    vertices: Queue<u32>,
}

impl Triangles<'_> {
    fn triangle(&mut self, code: u8, pairs: &[u8; 16]) -> Result<[u32; 3], &'static str> {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            // On the other side of a recent edge.
            let [a, b] = self.edges.get(high);
            let c = match low {
                0 => self.new_vertex(),
                1..13 => self.vertices.get(low),
                13 | 14 => {
                    let step = if low == 13 { u32::MAX } else { 1 };
                    self.last = self.last.wrapping_add(step);
                    self.last
                }
                _ => self.free_index()?,
            };
            if !(1..13).contains(&low) {
                self.vertices.push(c);
            }
            self.edges.push([c, b]);
            self.edges.push([a, c]);
            return Ok([a, b, c]);
        }
        let pair = match low {
            14 | 15 => {
                let pair = self.body.byte()?;
                if pair == 0 {
                    self.next = 0;
                }
                pair
            }
            _ => pairs[usize::from(low)],
        };
        let (second, third) = (pair >> 4, pair & 15);
        let a = if low == 15 {
            self.free_index()?
        } else {
            self.new_vertex()
        };
        let b = self.corner(second)?;
        let c = self.corner(third)?;
        self.vertices.push(a);
        for (corner, kind) in [(b, second), (c, third)] {
            if kind == 0 || kind == 15 {
                self.vertices.push(corner);
            }
        }
        self.edges.push([b, a]);
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok([a, b, c])
    }

    fn corner(&mut self, kind: u8) -> Result<u32, &'static str> {
        match kind {
            0 => Ok(self.new_vertex()),
            15 => self.free_index(),
            recent => Ok(self.vertices.get(recent - 1)),
        }
    }

    fn new_vertex(&mut self) -> u32 {
        let vertex = self.next;
        self.next = self.next.wrapping_add(1);
        vertex
    }

    /// An index that is given by its difference from the last one given so.
    fn free_index(&mut self) -> Result<u32, &'static str> {
        self.last = self.last.wrapping_add(unzigzag(self.body.number()?));
        Ok(self.last)
    }
}

/// The sixteen things that were put in last.
struct Queue<T> {
    rows: [T; 16],
    /// Where the next one is put.
    end: usize,
}

impl<T: Copy> Queue<T> {
    fn new(filling: T) -> Self {
        Self {
            rows: [filling; 16],
            end: 0,
        }
    }

    fn push(&mut self, row: T) {
        self.rows[self.end & 15] = row;
        self.end = self.end.wrapping_add(1);
    }

    /// The one that was put in last is 0, the one before it 1, and so on.
    fn get(&self, back: u8) -> T {
        let place = self.end.wrapping_sub(1 + usize::from(back));
        self.rows[place & 15]
    }
}

/// Decodes `count` indices in any order.
pub fn decode_sequence(stream: &[u8], count: usize) -> Result<Vec<u32>, &'static str> {
    match stream.first() {
        Some(0xd1) => {}
        Some(_) => return Err(WRONG_START),
        None => return Err(ENDS_EARLY),
    }
    let (body, _) = stream[1..].split_last_chunk::<4>().ok_or(ENDS_EARLY)?;
    if body.len() < count {
        return Err(ENDS_EARLY);
    }
    let mut body = Reader { rest: body };
    let mut last = [0u32; 2];
    let mut indices = Vec::with_capacity(count);
    for _ in 0..count {
        let number = body.number()?;
        let baseline = &mut last[(number & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag(number >> 1));
        indices.push(*baseline);
    }
    if !body.rest.is_empty() {
        return Err(GOES_ON);
    }
    Ok(indices)
}

/// Indices as numbers of two bytes, or of four.
pub fn to_bytes(indices: &[u32], stride: usize) -> Vec<u8> {
    match stride {
        2 => indices
            .iter()
            .flat_map(|&i| (i as u16).to_le_bytes())
            .collect(),
        _ => indices.iter().flat_map(|i| i.to_le_bytes()).collect(),
    }
}

/// 0, 1, 2, 3, … -> 0, -1, 1, -2, …
fn unzigzag(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}

/// What is left of a stream.
struct Reader<'a> {
    rest: &'a [u8],
}

impl Reader<'_> {
    fn byte(&mut self) -> Result<u8, &'static str> {
        let (&byte, rest) = self.rest.split_first().ok_or(ENDS_EARLY)?;
        self.rest = rest;
        Ok(byte)
    }

    /// A number in sevens of bits, the lowest first (unsigned LEB128).
    fn number(&mut self) -> Result<u32, &'static str> {
        let mut number = 0;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            number |= u32::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(number);
            }
        }
        Err("an index has more than 32 bits")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_their_lowest_bits_first() {
        // LEB128. The extension's third example has its highest bits first, unlike its other two.
        let bytes = [0x7f, 0x81, 0x04, 0xff, 0xa0, 0x05, 0xff];
        let mut reader = Reader { rest: &bytes };
        for expected in [0x7f, 0x201, 0x1_507f] {
            assert_eq!(reader.number(), Ok(expected), "{expected:x}");
        }
        assert_eq!(reader.number(), Err(ENDS_EARLY));
    }

    #[test]
    fn a_new_edge_and_a_recent_one_make_two_triangles() {
        // 0xf0 looks up pair 0, all new: (0, 1, 2). 0x00 takes the edge pushed last, (0, 2), and a
        // new vertex.
        let stream = [&[0xe1, 0xf0, 0x00][..], &[0; 16]].concat();
        assert_eq!(decode_triangles(&stream, 6), Ok(vec![0, 1, 2, 0, 2, 3]));
        assert_eq!(decode_triangles(&stream, 3), Err(GOES_ON));
        assert_eq!(decode_triangles(&stream, 9), Err(ENDS_EARLY));
    }
}
