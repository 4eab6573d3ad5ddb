//! What a scene file is made of, said once: from it come both the reader and the JSON Schema.
//!
//! A [`Form`] is a kind of value. The `table!` macro makes one of a struct: its fields are the keys,
//! its doc comments the descriptions. So the two cannot disagree about a key, a type or a range, and
//! all faults of a file are found in one pass, which a deserialiser that ends at the first cannot do.
//!
//! Only what a schema cannot say is left to the steps after this one.

use super::source::{Faults, Span};
use crate::read::error::Problem;
use crate::read::files::shortened;
use crate::read::names::closest;
use serde_json::{Map, Value, json};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value of the file with its place.
pub type Node<'a> = Spanned<DeValue<'a>>;

/// A kind of value.
pub trait Form: Sized {
    /// Reads what stands at `key`. `None` where it has another form, which `faults` is told.
    fn read(key: &str, node: &Node<'_>, faults: &mut Faults) -> Option<Self>;

    /// The JSON Schema of it.
    fn schema() -> Value;
}

/// A value without keys.
pub trait Leaf: Sized {
    /// What is expected, for messages; an example in it helps more than a name.
    const EXPECTED: &'static str;

    /// The value. An `Err` is a value of the right form that is out of range in a way that a
    /// schema cannot say.
    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>>;

    /// The JSON Schema of it.
    fn schema() -> Value;
}

/// Of the right form, but out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfRange;

impl<T: Leaf> Form for T {
    fn read(key: &str, node: &Node<'_>, faults: &mut Faults) -> Option<Self> {
        let found = || described(node.get_ref());
        let problem = match T::parse(node.get_ref()) {
            Some(Ok(value)) => return Some(value),
            Some(Err(OutOfRange)) => Problem::OutOfRange {
                key: key.into(),
                found: found().into(),
                expected: T::EXPECTED,
            },
            None => Problem::WrongValue {
                key: key.into(),
                found: found().into(),
                expected: T::EXPECTED,
            },
        };
        faults.add(node.span(), problem);
        None
    }

    fn schema() -> Value {
        <T as Leaf>::schema()
    }
}

/// A value as messages quote it.
pub fn described(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("{:?}", shortened(text)),
        DeValue::Integer(number) => shortened(&number.to_string()),
        DeValue::Float(number) => shortened(&number.to_string()),
        DeValue::Boolean(flag) => flag.to_string(),
        DeValue::Datetime(date) => format!("the date {date}"),
        DeValue::Array(items) => {
            const MOST: usize = 8;
            let mut items: Vec<_> = items
                .iter()
                .take(MOST + 1)
                .map(|item| match item.get_ref() {
                    DeValue::Array(_) => "[…]".into(),
                    item => described(item),
                })
                .collect();
            if items.len() > MOST {
                items[MOST] = "…".into();
            }
            format!("[{}]", shortened(&items.join(", ")))
        }
        DeValue::Table(_) => "a table".into(),
    }
}

/// A value that was given, and where.
#[derive(Clone, Debug)]
pub struct Given<T> {
    pub value: T,
    pub span: Span,
}

/// An array of tables: `[[layer]]`.
#[derive(Debug)]
pub struct List<T>(pub Vec<Given<T>>);

impl<T: Form> Form for List<T> {
    fn read(key: &str, node: &Node<'_>, faults: &mut Faults) -> Option<Self> {
        let Some(rows) = node.get_ref().as_array().filter(|rows| !rows.is_empty()) else {
            let problem = Problem::WrongValue {
                key: key.into(),
                found: described(node.get_ref()).into(),
                expected: "one or more tables, each under the name in double brackets",
            };
            faults.add(node.span(), problem);
            return None;
        };
        let mut list = Vec::with_capacity(rows.len());
        for row in rows.iter() {
            let span = row.span();
            // On from a row that is wrong, to tell of the others as well.
            if let Some(value) = T::read(key, row, faults) {
                list.push(Given { value, span });
            }
        }
        Some(Self(list))
    }

    fn schema() -> Value {
        json!({ "type": "array", "minItems": 1, "items": T::schema() })
    }
}

/// Tables by name, in the order of the file: `[camera.street]`.
#[derive(Debug)]
pub struct Named<K, T>(pub Vec<(Given<K>, T)>);

impl<K: Leaf, T: Form> Form for Named<K, T> {
    fn read(key: &str, node: &Node<'_>, faults: &mut Faults) -> Option<Self> {
        let table = as_table(key, node, faults)?;
        let mut rows = Vec::with_capacity(table.len());
        for (name, node) in in_order(table) {
            let value = DeValue::String(name.get_ref().as_ref().into());
            let called = K::read(
                &format!("a name in {key}"),
                &Spanned::new(name.span(), value),
                faults,
            );
            let read = T::read(
                &format!("{key}.{}", name.get_ref().escape_debug()),
                node,
                faults,
            );
            if let (Some(value), Some(read)) = (called, read) {
                let span = name.span();
                rows.push((Given { value, span }, read));
            }
        }
        Some(Self(rows))
    }

    fn schema() -> Value {
        json!({
            "type": "object",
            "propertyNames": <K as Leaf>::schema(),
            "additionalProperties": T::schema(),
        })
    }
}

fn as_table<'n, 't>(key: &str, node: &'n Node<'t>, faults: &mut Faults) -> Option<&'n DeTable<'t>> {
    let table = node.get_ref().as_table();
    if table.is_none() {
        let problem = Problem::WrongValue {
            key: key.into(),
            found: described(node.get_ref()).into(),
            expected: "a table",
        };
        faults.add(node.span(), problem);
    }
    table
}

/// The rows of a table as they stand in the file.
fn in_order<'n, 't>(
    table: &'n DeTable<'t>,
) -> Vec<(&'n Spanned<toml::de::DeString<'t>>, &'n Node<'t>)> {
    let mut rows: Vec<_> = table.iter().collect();
    rows.sort_by_key(|(key, _)| key.span().start);
    rows
}

/// What a table may hold: the part of `table!` that needs no macro.
pub struct Layout {
    /// How messages call it.
    pub called: &'static str,
    pub about: &'static [&'static str],
    pub keys: &'static [Key],
    /// Pairs of keys of which one may be there.
    pub exclude: &'static [(&'static str, &'static str)],
    /// Pairs of keys of which the first is nothing without the second.
    pub needs: &'static [(&'static str, &'static str)],
    /// Keys that will mean something in a later version.
    pub not_yet: &'static [&'static str],
}

/// A key of a table.
pub struct Key {
    pub name: &'static str,
    pub about: &'static [&'static str],
    pub required: bool,
    pub schema: fn() -> Value,
}

/// A table of the file whose keys are known to be allowed.
pub struct Fields<'n, 't> {
    table: &'n DeTable<'t>,
}

impl<'n, 't> Fields<'n, 't> {
    /// Checks the keys of a table.
    pub fn of(key: &str, node: &'n Node<'t>, layout: &Layout, faults: &mut Faults) -> Option<Self> {
        let table = as_table(key, node, faults)?;
        // A key that is misspelt is not missing as well.
        let mut meant = Vec::new();
        for (found, _) in table.iter() {
            let found_name = found.get_ref().as_ref();
            if layout.keys.iter().all(|known| known.name != found_name) {
                meant.extend(layout.closest(found_name));
                faults.add(found.span(), layout.unknown(found_name));
            }
        }
        let is_missing = |key: &str| !table.contains_key(key) && !meant.contains(&key);
        for key in layout.keys.iter().filter(|key| key.required) {
            if is_missing(key.name) {
                let problem = Problem::LacksKey {
                    table: layout.called,
                    key: key.name,
                };
                faults.add(node.span(), problem);
            }
        }
        let place = |name: &str| Some(table.get_key_value(name)?.0.span());
        for &(one, other) in layout.exclude {
            if let (Some(a), Some(b)) = (place(one), place(other)) {
                let (at, first, second) = if a.start < b.start {
                    (b, one, other)
                } else {
                    (a, other, one)
                };
                faults.add(at, Problem::Exclude { first, second });
            }
        }
        for &(key, other) in layout.needs {
            if let (Some(at), true) = (place(key), is_missing(other)) {
                faults.add(at, Problem::NeedsKey { key, other });
            }
        }
        Some(Self { table })
    }

    /// The value of a key, if it is there and right.
    pub fn read<T: Form>(&self, key: &str, faults: &mut Faults) -> Option<Given<T>> {
        let node = self.table.get(key)?;
        let value = T::read(key, node, faults)?;
        let span = node.span();
        Some(Given { value, span })
    }
}

impl Layout {
    fn unknown(&self, found: &str) -> Problem {
        if let Some(key) = self.not_yet.iter().find(|key| **key == found) {
            return Problem::NotYet { key };
        }
        let help = match self.closest(found) {
            Some(meant) => format!("did you mean {meant:?}?"),
            None => {
                let known: Vec<_> = self.keys.iter().map(|key| key.name).collect();
                format!("it may have {}", known.join(", "))
            }
        };
        Problem::UnknownKey {
            found: shortened(found).into(),
            table: self.called,
            help: help.into(),
        }
    }

    fn closest(&self, found: &str) -> Option<&'static str> {
        closest(found, self.keys.iter().map(|key| key.name))
    }

    /// The JSON Schema of the table.
    pub fn schema(&self) -> Value {
        let mut properties = Map::new();
        for key in self.keys {
            let mut schema = (key.schema)();
            schema["description"] = paragraph(key.about).into();
            properties.insert(key.name.into(), schema);
        }
        let required = self.keys.iter().filter(|key| key.required);
        let mut schema = json!({
            "type": "object",
            "description": paragraph(self.about),
            "properties": properties,
            "required": required.map(|key| key.name).collect::<Vec<_>>(),
            "additionalProperties": false,
        });
        if !self.exclude.is_empty() {
            let both = |pair: &(&str, &str)| json!({ "not": { "required": [pair.0, pair.1] } });
            schema["allOf"] = self.exclude.iter().map(both).collect();
        }
        if !self.needs.is_empty() {
            let mut needs = Map::new();
            for (key, other) in self.needs {
                needs.insert((*key).into(), json!([other]));
            }
            schema["dependentRequired"] = needs.into();
        }
        schema
    }
}

/// The lines of a doc comment as one text.
fn paragraph(lines: &[&str]) -> String {
    let lines: Vec<_> = lines.iter().map(|line| line.trim()).collect();
    lines.join(" ")
}

/// Makes a [`Form`] of a struct.
///
/// Each field is `required` or `optional`, and is held as `Given` or `Option<Given>`. After the
/// struct may follow `exclude`, `needs` and `not_yet`, as in [`Layout`].
macro_rules! table {
    (
        $(#[doc = $about:literal])+
        $called:literal => struct $Name:ident {
            $($(#[doc = $doc:literal])+ $presence:ident $key:ident: $Type:ty,)+
        }
        $(exclude $(($one:ident, $other:ident))+)?
        $(needs $(($needy:ident, $needed:ident))+)?
        $(not_yet $($later:ident)+)?
    ) => {
        $(#[doc = $about])+
        #[derive(Debug)]
        pub struct $Name {
            $($(#[doc = $doc])+ pub $key: table!(@field $presence $Type),)+
        }

        impl $Name {
            const LAYOUT: Layout = Layout {
                called: $called,
                about: &[$($about),+],
                keys: &[$(Key {
                    name: stringify!($key),
                    about: &[$($doc),+],
                    required: table!(@required $presence),
                    schema: <$Type as Form>::schema,
                }),+],
                exclude: &[$($((stringify!($one), stringify!($other))),+)?],
                needs: &[$($((stringify!($needy), stringify!($needed))),+)?],
                not_yet: &[$($(stringify!($later)),+)?],
            };
        }

        impl Form for $Name {
            fn read(key: &str, node: &Node<'_>, faults: &mut Faults) -> Option<Self> {
                let fields = Fields::of(key, node, &Self::LAYOUT, faults)?;
                $(let $key: Option<Given<$Type>> = fields.read(stringify!($key), faults);)+
                Some(Self { $($key: table!(@held $presence $key),)+ })
            }

            fn schema() -> Value {
                Self::LAYOUT.schema()
            }
        }
    };
    (@field required $Type:ty) => { Given<$Type> };
    (@field optional $Type:ty) => { Option<Given<$Type>> };
    (@required required) => { true };
    (@required optional) => { false };
    (@held required $key:ident) => { $key? };
    (@held optional $key:ident) => { $key };
}
pub(super) use table;
