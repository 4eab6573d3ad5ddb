//! Scene files with damage, and whether reader and JSON Schema say the same of them.
//!
//! `VEDUTA_LONG_TESTS=1` makes a hundred times as many random cases.

use crate::damaged::{Random, check, damage};
use crate::scene_file::{CITY, SOUND, folder, read};
use crate::support::{Folder, Glb};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use veduta_io::{Problem, ReadError, scene_file_schema};

/// A document with all keys that there are.
fn rich() -> Value {
    json!({
        "world": { "crs": "EPSG:7415", "origin": [1, 2, 3.5], "vertical_datum": "NAP" },
        "animation": { "fps": 25 },
        "camera": {
            "a": { "keys": [{ "time": 0, "eye": [0, -4, 1] },
                    { "time": "2 s", "look_at": [0, 0, 1] }], "interpolation": "ease",
                "eye": [0, -4, 1], "look_at": [0, 0, 0], "up": [0, 0, 1], "fov": "40deg",
                "shift": [0, 0.25], "near": "1 cm", "size": [640, 480] },
            "b": { "eye": [0, 0, 9], "look_at": [0, 0, 0], "focal_length": "35 mm",
                "sensor_height": "24 mm" },
            "c": { "eye": [0, 0, 9], "look_at": [0, 0, 0], "parallel": 4 },
        },
        "layer": [
            { "name": "one", "model": "part.obj", "up": "z", "priority": 2, "shown": "matte", "at": {
                "translate": [1, 2, 3], "rotate": { "axis": [0, 0, 1], "angle": "30deg" },
                "scale": [1, 2, 1] } },
            { "name": "two", "model": "plain.obj", "instances": "t.csv",
                "at": { "matrix": [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7]] } },
            { "name": "three", "model": "inner.toml", "at": { "scale": 0.5 } },
            { "name": "four", "model": "c.city.json", "lod": "2.2" },
            { "name": "five", "model": "m.glb", "animation": "walk", "repeat": true,
                "interpolation": "step", "keys": [
                    { "time": 0.5, "translate": [1, 2, 3] },
                    { "time": "36 frames", "rotate": { "axis": [0, 0, 1], "angle": "30deg" } },
                    { "time": "2 s", "scale": 2 },
                ] },
        ],
        "material": {
            "one/red": { "color": "#b5523b", "opacity": 0.5, "unlit": true, "double_sided": false,
                "emissive": [2, 1, 0], "texture": { "image": "tiles.png", "repeat": [0.3, 0.3] } },
            "two/**": { "color": [0.1, 0.2, 0.3], "texture": false },
        },
    })
}

fn rich_folder() -> Folder {
    let folder = folder();
    folder.write(
        "t.csv",
        "x,y,z,heading,pitch,roll,scale,name\n1,2,3,4,5,6,7,a\n",
    );
    folder.write("inner.toml", SOUND);
    folder.write("c.city.json", CITY);
    let mut glb = Glb::triangle();
    glb.json["animations"] = json!([{ "name": "walk" }]);
    folder.write("m.glb", glb.bytes());
    folder
}

/// What a key may be made to: of other kinds, out of range, nearly right.
pub fn values() -> Vec<Value> {
    let mut values = vec![
        json!(0),
        json!(1),
        json!(-1),
        json!(2.0),
        json!(0.5),
        json!(1e308),
        json!(-1e308),
        json!(1e-300),
        json!(i64::MAX),
        json!(65_536),
        json!(null),
        json!(true),
        json!(false),
        json!([]),
        json!({}),
        json!([0, 0]),
        json!([0, 0, 0]),
        json!([1, 1, 2]),
        json!([[1]]),
        json!([1, 2, 3, 4]),
        json!([8.0, 6.0]),
        json!([0.5, 6]),
        json!({ "image": "tiles.png" }),
    ];
    values.extend(
        [
            "",
            "x",
            "40deg",
            "40 deg",
            "40",
            "200deg",
            "1e3rad",
            "35 mm",
            "35mm ",
            "-2 m",
            ".5 m",
            "5 M",
            "1e400 m",
            "#fff",
            "#ffff",
            "#b5523B",
            "y",
            "Z",
            "auto",
            "a/b",
            "tab\there",
            "part.obj",
            "2.2",
            "10",
            "s.toml",
            "t.csv",
            "/",
            "\u{0}",
            "EPSG:28992",
            "[",
            "**",
            "\u{661}\u{662}deg",
        ]
        .map(|text| json!(text)),
    );
    values
}

/// The document as TOML, each of its tables on a line. JSON has no word for NaN, so null is one.
pub fn toml_of(document: &Value) -> String {
    let mut text = String::new();
    for (key, value) in document.as_object().into_iter().flatten() {
        let _ = write!(text, "{} = ", quoted(key));
        add_inline(value, &mut text);
        text.push('\n');
    }
    text
}

fn quoted(text: &str) -> String {
    // TOML's escapes are JSON's, but for the slash, which JSON may escape and serde_json does not.
    json!(text).to_string()
}

fn add_inline(value: &Value, text: &mut String) {
    match value {
        Value::Null => text.push_str("nan"),
        Value::Bool(flag) => {
            let _ = write!(text, "{flag}");
        }
        Value::Number(number) => {
            let _ = write!(text, "{number}");
        }
        Value::String(string) => text.push_str(&quoted(string)),
        Value::Array(items) => {
            text.push('[');
            for item in items {
                add_inline(item, text);
                text.push_str(", ");
            }
            text.push(']');
        }
        Value::Object(fields) => {
            text.push_str("{ ");
            for (index, (key, value)) in fields.iter().enumerate() {
                let comma = if index > 0 { ", " } else { "" };
                let _ = write!(text, "{comma}{} = ", quoted(key));
                add_inline(value, text);
            }
            text.push_str(" }");
        }
    }
}

/// Whether the reader finds fault with the form of `file`, which a schema can tell as well.
pub fn is_of_wrong_form(error: &ReadError, file: &str) -> bool {
    error.file.ends_with(file)
        && error.all().any(|error| {
            matches!(
                error.problem,
                Problem::UnknownKey { .. }
                    | Problem::LacksKey { .. }
                    | Problem::NeedsKey { .. }
                    | Problem::Exclude { .. }
                    | Problem::WrongValue { .. }
                    | Problem::NotYet { .. }
            )
        })
}

fn schema() -> jsonschema::Validator {
    let schema = scene_file_schema();
    jsonschema::meta::validate(&schema).expect("the schema is one");
    jsonschema::validator_for(&schema).expect("the schema is sound")
}

fn rounds() -> usize {
    match std::env::var_os("VEDUTA_LONG_TESTS") {
        Some(_) => 100,
        None => 1,
    }
}

#[test]
fn the_schema_accepts_the_examples_and_all_keys_that_there_are() {
    let schema = schema();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let mut seen = 0;
    for entry in std::fs::read_dir(examples).expect("the examples are there") {
        let path = entry.expect("an example").path();
        if path.extension().is_some_and(|suffix| suffix == "toml") {
            let text = std::fs::read_to_string(&path).expect("can be read");
            let document: Value = toml::from_str(&text).expect("is TOML");
            let errors: Vec<_> = schema
                .iter_errors(&document)
                .map(|e| e.to_string())
                .collect();
            assert!(errors.is_empty(), "{}: {errors:?}", path.display());
            let loaded = veduta_io::read_scene(&path, &Default::default());
            let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
            assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
            seen += 1;
        }
    }
    assert!(seen > 0);

    let document = rich();
    assert!(schema.is_valid(&document));
    let loaded = read(&rich_folder(), &toml_of(&document));
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(loaded.scene.layers.len(), 5, "{:?}", loaded.warnings);
    // No key was forgotten here.
    let (mut known, mut used) = (BTreeSet::new(), BTreeSet::new());
    add_properties(&scene_file_schema(), &mut known);
    add_keys(&document, &mut used);
    let forgotten: Vec<_> = known.difference(&used).collect();
    assert!(forgotten.is_empty(), "{forgotten:?}");
}

/// All keys that a schema knows.
fn add_properties(schema: &Value, keys: &mut BTreeSet<String>) {
    for (name, part) in schema.as_object().into_iter().flatten() {
        if name == "properties" {
            keys.extend(
                part.as_object()
                    .into_iter()
                    .flatten()
                    .map(|(key, _)| key.clone()),
            );
        }
        add_properties(part, keys);
    }
    for part in schema.as_array().into_iter().flatten() {
        add_properties(part, keys);
    }
}

/// All keys of a document.
fn add_keys(document: &Value, keys: &mut BTreeSet<String>) {
    for (key, value) in document.as_object().into_iter().flatten() {
        keys.insert(key.clone());
        add_keys(value, keys);
    }
    for value in document.as_array().into_iter().flatten() {
        add_keys(value, keys);
    }
}

#[test]
fn reader_and_schema_agree_on_random_changes() {
    let schema = schema();
    let folder = rich_folder();
    let values = values();
    let cases = 3000 * rounds();
    let (mut accepted, mut refused) = (0, 0);
    for seed in 0..cases {
        let mut random = Random(seed as u64);
        let mut document = rich();
        for _ in 0..=random.below(2) {
            if random.below(4) == 0 {
                misspell(&mut document, &mut random);
            } else {
                damage(&mut document, &values, &mut random);
            }
        }
        if !document.is_object() {
            continue;
        }
        let text = toml_of(&document);
        let case = format!("seed {seed}:\n{text}");
        let loaded = read(&folder, &text);
        let is_of_right_form = match &loaded {
            Ok(_) => true,
            Err(error) => {
                assert!(!matches!(error.problem, Problem::Toml(_)), "{case}{error}");
                !is_of_wrong_form(error, "s.toml")
            }
        };
        let verdict = loaded
            .as_ref()
            .map_or_else(ToString::to_string, |_| "read".into());
        let errors: Vec<_> = schema
            .iter_errors(&document)
            .map(|e| e.to_string())
            .collect();
        assert_eq!(
            errors.is_empty(),
            is_of_right_form,
            "{case}reader: {verdict}\nschema: {errors:?}"
        );
        if check_one(loaded, &case) {
            accepted += 1;
        } else {
            refused += 1;
        }
    }
    assert!(
        accepted > cases / 20 && refused > cases / 2,
        "{accepted} and {refused}"
    );
}

/// Read soundly, or refused with a message of some file in the folder.
fn check_one(loaded: Result<veduta_io::Loaded, ReadError>, case: &str) -> bool {
    let file = match &loaded {
        Ok(_) => String::new(),
        Err(error) => error
            .file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into(),
    };
    check(&file, loaded, case)
}

/// Drops, doubles or changes a letter of a key somewhere in the document.
pub fn misspell(document: &mut Value, random: &mut Random) {
    let mut place = document;
    loop {
        match place {
            Value::Object(fields) if !fields.is_empty() => {
                let chosen = random.below(fields.len());
                let key = fields.keys().nth(chosen).cloned().unwrap_or_default();
                if random.below(3) == 0
                    || !matches!(fields[&key], Value::Object(_) | Value::Array(_))
                {
                    let value = fields.remove(&key).unwrap_or_default();
                    let mut letters: Vec<char> = key.chars().collect();
                    let at = random.below(letters.len().max(1));
                    match random.below(3) {
                        0 if !letters.is_empty() => {
                            letters.remove(at);
                        }
                        1 => letters.insert(at, 'q'),
                        _ => letters.push('s'),
                    }
                    fields.insert(letters.into_iter().collect(), value);
                    return;
                }
                place = &mut fields[&key];
            }
            Value::Array(items) if !items.is_empty() => {
                let chosen = random.below(items.len());
                place = &mut items[chosen];
            }
            _ => return,
        }
    }
}

#[test]
fn a_scene_file_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    let folder = rich_folder();
    let sound = SOUND.as_bytes();
    let read_bytes = |bytes: &[u8]| {
        let path = folder.write("s.toml", bytes);
        veduta_io::read_scene(&path, &Default::default())
    };
    let (mut read, mut cases) = (0, 0);
    let mut case = |bytes: &[u8], name: String| {
        cases += 1;
        read += usize::from(check_one(read_bytes(bytes), &name));
    };
    for end in 0..=sound.len() {
        case(&sound[..end], format!("cut at {end}"));
    }
    for bit in 0..8 * sound.len() {
        let mut bytes = sound.to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        case(&bytes, format!("bit {bit}"));
    }
    assert!(
        read > 100 && read < cases / 2,
        "{read} of {cases} were read"
    );
}

#[test]
fn a_table_of_places_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    let folder = folder();
    let table = "# a\nx,y,z,heading,scale,name\n1,2.5,-3,40,1.5,\"a, b\"\n\n0,0,1e1,0,1,c\n";
    let scene = "[[layer]]\nname = \"p\"\nmodel = \"part.obj\"\ninstances = \"t.csv\"\n";
    let path = folder.write("s.toml", scene);
    let (mut read, mut cases) = (0, 0);
    let mut case = |bytes: &[u8], name: String| {
        folder.write("t.csv", bytes);
        cases += 1;
        let loaded = veduta_io::read_scene(&path, &Default::default());
        read += usize::from(check_one(loaded, &name));
    };
    let sound = table.as_bytes();
    for end in 0..=sound.len() {
        case(&sound[..end], format!("cut at {end}"));
    }
    for bit in 0..8 * sound.len() {
        let mut bytes = sound.to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        case(&bytes, format!("bit {bit}"));
    }
    assert!(read > 50 && read < cases, "{read} of {cases} were read");
}

#[test]
fn scene_files_of_random_pieces_are_read_or_refused() {
    let pieces = [
        "[world]\n",
        "[camera.c]\n",
        "[[layer]]\n",
        "[material.\"*\"]\n",
        "name = ",
        "model = ",
        "eye = ",
        "look_at = ",
        "at = ",
        "fov = ",
        "[",
        "]",
        "{",
        "}",
        ",",
        "\"",
        "'",
        "\n",
        "=",
        ".",
        "\"part.obj\"",
        "\"a\"",
        "[0, -4, 0]",
        "[0, 0, 0]",
        "1",
        "-2.5",
        "\"40deg\"",
        "nan",
        "2020-01-01",
        "true",
        "#",
        "\"\"\"",
        "\u{feff}",
        "\r\n",
        "\u{1f3db}",
        "\\u0000",
    ];
    let folder = folder();
    for seed in 0..3000 * rounds() {
        let mut random = Random(seed as u64);
        let mut text = String::new();
        if random.below(2) == 0 {
            text.push_str(SOUND);
        }
        for _ in 0..random.below(40) {
            let mut at = random.below(text.len() + 1);
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            text.insert_str(at, pieces[random.below(pieces.len())]);
        }
        check_one(read(&folder, &text), &format!("seed {seed}: {text:?}"));
    }
}

#[test]
fn nested_brackets_without_end_are_refused() {
    let folder = folder();
    for bracket in ["[", "{a = ", "a.", "[["] {
        let text = format!("at = {}", bracket.repeat(100_000));
        assert!(!check_one(read(&folder, &text), bracket));
    }
    let many = "x = 1\n".repeat(20_000);
    assert!(!check_one(read(&folder, &many), "many errors"));
}
