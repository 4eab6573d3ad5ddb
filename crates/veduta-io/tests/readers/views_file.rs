//! Files of views with damage, and whether reader and JSON Schema say the same of them.

use crate::damaged::{Random, damage};
use crate::scene_file_damaged::{is_of_wrong_form, misspell, toml_of, values};
use crate::support::Folder;
use serde_json::{Value, json};
use veduta_io::{FileView, Problem, ReadError, read_views_file, views_file_schema};

/// A document with all keys that there are.
fn rich() -> Value {
    json!({
        "view": [
            { "picture": "a.png", "fov": "60deg", "yaw": -45, "elevation": "10deg", "roll": "0.1rad",
                "shift": [0, 0.5], "turned": 90, "mirrored": true },
            { "picture": "b.####.exr", "lens": "fisheye:200", "direction": [0, 1, 0], "up": [0, 0, 1],
                "circle": [960, 540.5, 520] },
            { "picture": "c.jpg", "lens": "equirect" },
        ],
    })
}

/// Read, or refused with a message of that file.
fn check(read: Result<Vec<FileView>, ReadError>, case: &str) -> bool {
    match read {
        Ok(views) => {
            for view in &views {
                // Whatever was read is a view of any picture.
                for size in [[1, 1], [640, 480]] {
                    let projection = view.view(0, size).projection;
                    assert!(projection.width > 0 && projection.height > 0, "{case}");
                }
            }
            true
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.contains("rig.toml"), "{case}: {message}");
            assert!(
                message.len() < 1000 && !message.contains('\n'),
                "{case}: {message}"
            );
            false
        }
    }
}

#[test]
fn reader_and_schema_agree_on_random_changes() {
    let schema = views_file_schema();
    jsonschema::meta::validate(&schema).expect("the schema is one");
    let schema = jsonschema::validator_for(&schema).expect("the schema is sound");
    let folder = Folder::new();
    let read = |document: &Value| read_views_file(&folder.write("rig.toml", toml_of(document)));
    assert!(schema.is_valid(&rich()));
    assert_eq!(read(&rich()).expect("all keys are known").len(), 3);
    let mut values = values();
    values.extend(["ball", "perspective:60", "fisheye:-5", "equirect:3"].map(|text| json!(text)));
    let (mut accepted, mut refused) = (0, 0);
    for seed in 0..2000 {
        let mut random = Random(seed);
        let mut document = rich();
        for _ in 0..=random.below(2) {
            match random.below(4) {
                0 => misspell(&mut document, &mut random),
                _ => damage(&mut document, &values, &mut random),
            }
        }
        if !document.is_object() {
            continue;
        }
        let case = format!("seed {seed}:\n{}", toml_of(&document));
        let found = read(&document);
        let is_of_right_form = match &found {
            Ok(_) => true,
            Err(error) => {
                assert!(!matches!(error.problem, Problem::Toml(_)), "{case}{error}");
                !is_of_wrong_form(error, "rig.toml")
            }
        };
        let errors: Vec<_> = schema
            .iter_errors(&document)
            .map(|e| e.to_string())
            .collect();
        assert_eq!(
            errors.is_empty(),
            is_of_right_form,
            "{case}{found:?}\nschema: {errors:?}"
        );
        match check(found, &case) {
            true => accepted += 1,
            false => refused += 1,
        }
    }
    assert!(accepted > 100 && refused > 1000, "{accepted} and {refused}");
}

#[test]
fn a_file_of_views_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    let folder = Folder::new();
    let sound = "[[view]]\npicture = 'a.png' # left\nyaw = \"-45deg\"\nlens = 'fisheye:180'\n\
        circle = [32, 32, 30.5]\n";
    let sound = sound.as_bytes();
    let (mut read, mut cases) = (0, 0);
    let mut case = |bytes: &[u8], name: String| {
        cases += 1;
        read += usize::from(check(
            read_views_file(&folder.write("rig.toml", bytes)),
            &name,
        ));
    };
    for end in 0..=sound.len() {
        case(&sound[..end], format!("cut at {end}"));
    }
    for bit in 0..8 * sound.len() {
        let mut bytes = sound.to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        case(&bytes, format!("bit {bit}"));
    }
    assert!(read > 50 && read < cases / 2, "{read} of {cases} were read");
}
