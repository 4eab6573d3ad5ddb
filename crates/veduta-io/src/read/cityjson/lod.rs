//! Levels of detail.

use std::fmt;
use std::str::FromStr;

/// A level of detail of a city model: `2`, or refined, `2.2` (Biljecki et al., "An improved LOD
/// specification for 3D building models", 2016).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelOfDetail {
    /// From 0, footprints, to 4, interiors.
    pub level: u8,
    /// The digit behind the point; `None` for any, where a level is chosen.
    pub refinement: Option<u8>,
}

impl LevelOfDetail {
    /// Whether a geometry of the level `other` is not more detailed than this choice.
    pub(crate) fn allows(self, other: LevelOfDetail) -> bool {
        let refinement = self.refinement.unwrap_or(u8::MAX);
        other.key() <= (self.level, refinement)
    }

    /// Ascends with detail.
    pub(crate) fn key(self) -> (u8, u8) {
        (self.level, self.refinement.unwrap_or(0))
    }
}

/// A text that is no level of detail.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no level of detail, such as 2 or 2.2")]
pub struct LevelOfDetailError(String);

impl FromStr for LevelOfDetail {
    type Err = LevelOfDetailError;

    fn from_str(text: &str) -> Result<Self, LevelOfDetailError> {
        let (level, refinement) = match text.split_once('.') {
            None => (text, None),
            Some((level, refinement)) => (level, Some(refinement)),
        };
        let number = |text: &str| {
            let is_plain = text.bytes().all(|byte| byte.is_ascii_digit());
            text.parse()
                .ok()
                .filter(|_| is_plain)
                .ok_or_else(|| LevelOfDetailError(super::shortened(text)))
        };
        Ok(Self {
            level: number(level)?,
            refinement: refinement.map(number).transpose()?,
        })
    }
}

impl fmt::Display for LevelOfDetail {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.level)?;
        match self.refinement {
            None => Ok(()),
            Some(refinement) => write!(f, ".{refinement}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_read_written_and_compared() {
        let level = |text: &str| text.parse::<LevelOfDetail>().expect(text);
        for text in ["0", "2", "2.2", "1.3"] {
            assert_eq!(level(text).to_string(), text);
        }
        for text in ["", "x", "2.", ".2", "2.2.1", "-1", "+1", "300"] {
            assert!(text.parse::<LevelOfDetail>().is_err(), "{text}");
        }
        assert!(level("2").allows(level("2.3")) && level("2").allows(level("1")));
        assert!(level("2.2").allows(level("2")) && !level("2.2").allows(level("2.3")));
        assert!(!level("1.3").allows(level("2")));
    }
}
