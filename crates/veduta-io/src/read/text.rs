//! Words and numbers of text formats, read from bytes without copies.

use super::error::Problem;
use super::files::shortened;
use memchr::memchr;

/// Cuts the next line off `rest`, without its end.
pub(crate) fn next_line<'a>(rest: &mut &'a [u8]) -> &'a [u8] {
    let end = memchr(b'\n', rest).unwrap_or(rest.len());
    let line = &rest[..end];
    *rest = rest.get(end + 1..).unwrap_or_default();
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// The words of a line.
pub(crate) struct Tokens<'a>(pub &'a [u8]);

impl<'a> Iterator for Tokens<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let is_space = |byte: &u8| matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c);
        let start = self.0.iter().position(|byte| !is_space(byte))?;
        let rest = &self.0[start..];
        let end = rest.iter().position(is_space).unwrap_or(rest.len());
        self.0 = &rest[end..];
        Some(&rest[..end])
    }
}

#[cfg(any(feature = "obj", feature = "stl"))]
impl<'a> Tokens<'a> {
    /// The next word, unless a comment starts there.
    pub fn next_value(&mut self) -> Option<&'a [u8]> {
        self.next().filter(|token| !token.starts_with(b"#"))
    }

    pub fn number(&mut self, expected: &'static str) -> Result<f64, Problem> {
        number(self.next_value().unwrap_or_default(), expected)
    }

    /// The next number, or `absent` at the end of the line.
    #[cfg(feature = "obj")]
    pub fn number_or(&mut self, absent: f64) -> Result<f64, Problem> {
        match self.next_value() {
            None => Ok(absent),
            Some(token) => number(token, "a number"),
        }
    }

    pub fn three_numbers(&mut self) -> Result<[f64; 3], Problem> {
        Ok([
            self.number("three numbers")?,
            self.number("three numbers")?,
            self.number("three numbers")?,
        ])
    }
}

/// A finite number.
#[inline]
pub(crate) fn number(token: &[u8], expected: &'static str) -> Result<f64, Problem> {
    if let Some(number) = plain_decimal(token) {
        return Ok(number);
    }
    std::str::from_utf8(token)
        .ok()
        .and_then(|text| text.parse().ok())
        .filter(|number: &f64| number.is_finite())
        .ok_or_else(|| wrong_token(token, expected))
}

/// The value of digits with at most a sign and a point, if it is found exactly without effort.
///
/// Up to 15 digits and the power of ten below them are exact in f64, so their quotient is rounded
/// once, as it should be (Clinger, "How to read floating point numbers accurately", 1990). Most
/// numbers of OBJ files are such, and most time would go into them.
#[inline]
fn plain_decimal(token: &[u8]) -> Option<f64> {
    const POWERS: [f64; 16] = [
        1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
    ];
    let (negative, digits) = match token.strip_prefix(b"-") {
        Some(digits) => (true, digits),
        None => (false, token),
    };
    // One of the 16 bytes may be the point.
    if digits.len() > 16 {
        return None;
    }
    let mut value = 0u64;
    let mut count = 0;
    let mut point = None;
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                value = value * 10 + u64::from(byte - b'0');
                count += 1;
            }
            b'.' if point.is_none() => point = Some(count),
            _ => return None,
        }
    }
    if count == 0 || count > 15 {
        return None;
    }
    let magnitude = value as f64 / POWERS[count - point.unwrap_or(count)];
    Some(if negative { -magnitude } else { magnitude })
}

pub(crate) fn wrong_token(token: &[u8], expected: &'static str) -> Problem {
    let found = match token {
        b"" => String::new(),
        _ => shortened(&String::from_utf8_lossy(token)),
    };
    Problem::Token { found, expected }
}

/// The rest of a line, which may hold spaces.
pub(crate) fn text(tokens: Tokens<'_>) -> String {
    String::from_utf8_lossy(tokens.0.trim_ascii()).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_way_to_a_number_equals_the_general_one() {
        let mut state = 3u64;
        for _ in 0..200_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let digits = (state >> 33) as usize % 15 + 1;
            let point = (state >> 40) as usize % (digits + 1);
            let mut text = format!("{:015}", (state >> 12) % 10u64.pow(15))[..digits].to_owned();
            text.insert(point, '.');
            if state & 2048 != 0 {
                text.insert(0, '-');
            }
            let quick = plain_decimal(text.as_bytes()).expect(&text);
            let general: f64 = text.parse().expect(&text);
            assert_eq!(quick.to_bits(), general.to_bits(), "{text}");
        }
    }

    #[test]
    fn numbers_are_read_in_all_their_spellings_and_nothing_else_is() {
        for (text, value) in [
            ("1", 1.0),
            ("-.5", -0.5),
            ("2.", 2.0),
            ("+3", 3.0),
            ("-0", -0.0),
            ("1e-3", 1e-3),
            ("6.02E23", 6.02e23),
            ("0.1234567890123456789", 0.123_456_789_012_345_68),
        ] {
            assert_eq!(number(text.as_bytes(), "").expect(text), value, "{text}");
        }
        for text in [
            "", ".", "-", "1,5", "nan", "inf", "-inf", "1e999", "0x10", "1.2.3", "1\u{e9}",
        ] {
            assert!(number(text.as_bytes(), "a number").is_err(), "{text}");
        }
    }
}
