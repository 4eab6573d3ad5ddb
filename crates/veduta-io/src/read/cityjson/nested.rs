//! Arrays of arrays of indices, to any depth, in little memory.
//!
//! What an array means is told by the geometry's type, which may stand behind it. So arrays are kept
//! as they are, four bytes for each number and bracket, which is about what the text takes.

use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};
use std::fmt;

/// A number, null, or an array of such.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nested(Vec<u32>);

const OPEN: u32 = u32::MAX;
const CLOSE: u32 = u32::MAX - 1;
const NULL: u32 = u32::MAX - 2;

/// A part of [`Nested`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Item<'a> {
    Nothing,
    Number(u32),
    Array(Items<'a>),
}

impl Nested {
    pub fn item(&self) -> Item<'_> {
        Items(&self.0).next().unwrap_or(Item::Nothing)
    }

    /// All numbers, whatever they are in.
    pub fn numbers(&self) -> impl Iterator<Item = u32> {
        self.0.iter().copied().filter(|&token| token < NULL)
    }
}

impl<'a> Item<'a> {
    /// What is in an array; nothing in anything else.
    pub fn items(self) -> Items<'a> {
        match self {
            Item::Array(items) => items,
            _ => Items(&[]),
        }
    }

    pub fn number(self) -> Option<u32> {
        match self {
            Item::Number(number) => Some(number),
            _ => None,
        }
    }
}

/// The items of an array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Items<'a>(&'a [u32]);

impl<'a> Iterator for Items<'a> {
    type Item = Item<'a>;

    fn next(&mut self) -> Option<Item<'a>> {
        let (&first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(match first {
            NULL => Item::Nothing,
            OPEN => {
                let mut depth = 1;
                let is_end = |&token: &u32| {
                    depth += i64::from(token == OPEN) - i64::from(token == CLOSE);
                    depth == 0
                };
                let end = rest.iter().position(is_end).unwrap_or(rest.len());
                self.0 = rest.get(end + 1..).unwrap_or_default();
                Item::Array(Items(&rest[..end]))
            }
            number => Item::Number(number),
        })
    }
}

impl<'de> Deserialize<'de> for Nested {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut tokens = Vec::new();
        Tokens(&mut tokens).deserialize(deserializer)?;
        // Millions of these are kept.
        tokens.shrink_to_fit();
        Ok(Self(tokens))
    }
}

/// Appends what it reads.
struct Tokens<'a>(&'a mut Vec<u32>);

impl<'de> DeserializeSeed<'de> for Tokens<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Tokens<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an index from 0, null or an array of such")
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<(), E> {
        match u32::try_from(number) {
            Ok(number) if number < NULL => {
                self.0.push(number);
                Ok(())
            }
            _ => Err(E::custom(format_args!("the index {number} is too large"))),
        }
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        self.0.push(NULL);
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        self.0.push(OPEN);
        while items.next_element_seed(Tokens(self.0))?.is_some() {}
        self.0.push(CLOSE);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes an item as JSON.
    fn text(item: Item<'_>) -> String {
        match item {
            Item::Nothing => "null".into(),
            Item::Number(number) => number.to_string(),
            Item::Array(items) => {
                let items: Vec<_> = items.map(text).collect();
                format!("[{}]", items.join(","))
            }
        }
    }

    #[test]
    fn arrays_of_any_depth_are_kept() {
        for json in [
            "[[[0,1,2],[3]],[],[null,4294967292]]",
            "null",
            "7",
            "[]",
            "[[]]",
        ] {
            let nested: Nested = serde_json::from_str(json).expect(json);
            assert_eq!(text(nested.item()), json);
        }
        for json in ["[-1]", "[0.5]", "[\"a\"]", "[{}]", "[4294967293]", "[true]"] {
            assert!(serde_json::from_str::<Nested>(json).is_err(), "{json}");
        }
    }
}
