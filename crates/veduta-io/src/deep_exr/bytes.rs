use super::{DeepPlace, DeepProblem};

/// Text of a file, short enough to be told in a sentence.
pub fn shown(text: &str) -> String {
    const MOST: usize = 40;
    let start: String = text.chars().take(MOST).collect();
    let more = if start.len() < text.len() { "…" } else { "" };
    format!("{:?}", start + more)
}

/// Reads little-endian numbers from the bytes of a file, and knows where it is.
#[derive(Clone, Debug)]
pub struct Bytes<'a> {
    all: &'a [u8],
    at: usize,
    /// Told in errors.
    pub part: Option<usize>,
    /// Told in errors.
    pub chunk: Option<usize>,
}

impl<'a> Bytes<'a> {
    pub fn new(all: &'a [u8]) -> Self {
        Self {
            all,
            at: 0,
            part: None,
            chunk: None,
        }
    }

    pub fn at(&self) -> usize {
        self.at
    }

    /// Goes to byte `at`, which may lie beyond the end; taking bytes there fails.
    pub fn go_to(&mut self, at: usize) {
        self.at = at;
    }

    /// The same file as if it ended after the `size` bytes from `at` on, where it stands then.
    pub fn within(&self, at: usize, size: usize) -> Self {
        Self {
            all: &self.all[..at + size],
            at,
            ..*self
        }
    }

    pub fn left(&self) -> usize {
        self.all.len().saturating_sub(self.at)
    }

    fn place(&self) -> DeepPlace {
        DeepPlace {
            part: self.part,
            chunk: self.chunk,
            byte: self.at as u64,
        }
    }

    pub fn damaged(&self, what: impl Into<String>) -> DeepProblem {
        DeepProblem::Damaged {
            place: self.place(),
            what: what.into(),
        }
    }

    pub fn unsupported(&self, what: impl Into<String>, mend: &'static str) -> DeepProblem {
        DeepProblem::Unsupported {
            place: self.place(),
            what: what.into(),
            mend,
        }
    }

    /// The next `count` bytes, which are `what`.
    pub fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], DeepProblem> {
        if count > self.left() {
            let left = self.left();
            return Err(self.damaged(format!("{what} of {count} bytes with {left} bytes left")));
        }
        let taken = &self.all[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], DeepProblem> {
        let taken = self.take(N, what)?;
        Ok(taken.try_into().expect("as many bytes as were taken"))
    }

    pub fn u8(&mut self, what: &str) -> Result<u8, DeepProblem> {
        Ok(self.array::<1>(what)?[0])
    }

    pub fn u32(&mut self, what: &str) -> Result<u32, DeepProblem> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub fn i32(&mut self, what: &str) -> Result<i32, DeepProblem> {
        self.array(what).map(i32::from_le_bytes)
    }

    pub fn u64(&mut self, what: &str) -> Result<u64, DeepProblem> {
        self.array(what).map(u64::from_le_bytes)
    }

    pub fn f32(&mut self, what: &str) -> Result<f32, DeepProblem> {
        self.array(what).map(f32::from_le_bytes)
    }

    /// Text that ends with a byte of 0, of at most `most` bytes; the 0 is taken too.
    pub fn name(&mut self, most: usize, what: &str) -> Result<String, DeepProblem> {
        let rest = &self.all[self.at.min(self.all.len())..];
        let Some(length) = rest.iter().take(most + 1).position(|&byte| byte == 0) else {
            return Err(self.damaged(format!("{what} does not end within {most} bytes")));
        };
        let text = String::from_utf8_lossy(&rest[..length]).into_owned();
        self.at += length + 1;
        Ok(text)
    }
}
