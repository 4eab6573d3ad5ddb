//! Names that tell objects apart.

use std::collections::HashMap;

/// `name`, or with `#` and a number where it has been `seen` before.
pub(crate) fn unique(name: String, seen: &mut HashMap<String, u32>) -> String {
    let mut number = match seen.get(&name) {
        None => {
            seen.insert(name.clone(), 1);
            return name;
        }
        Some(&number) => number,
    };
    loop {
        number += 1;
        let numbered = format!("{name}#{number}");
        if !seen.contains_key(&numbered) {
            seen.insert(name, number);
            seen.insert(numbered.clone(), 1);
            return numbered;
        }
    }
}

/// The name that is most likely meant by `found`, which is none of `known`: the one that the fewest
/// slips of the finger make of it, if they are few for its length.
///
/// The first of equals. Capitals do not count.
#[cfg(feature = "toml")]
pub fn closest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // The cost grows with the product of the lengths.
    const LONGEST: usize = 200;
    let length = found.chars().count();
    if length > LONGEST {
        return None;
    }
    let most = 1 + length / 5;
    let lower = found.to_lowercase();
    let mut best: Option<(usize, &str)> = None;
    for name in known {
        if name.len() > 4 * LONGEST {
            continue;
        }
        let slips = strsim::osa_distance(&lower, &name.to_lowercase());
        if slips <= most && best.is_none_or(|(fewest, _)| slips < fewest) {
            best = Some((slips, name));
        }
    }
    best.map(|(_, name)| name)
}

/// The name of a file in the same folder as `path`, where nothing stands, that may be meant.
#[cfg(feature = "toml")]
pub(crate) fn neighbour(path: &std::path::Path) -> Option<String> {
    /// A folder with more is no place to guess in.
    const MOST: usize = 1000;
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(std::path::Path::new("."));
    let entries = std::fs::read_dir(folder).ok()?.take(MOST);
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect();
    names.sort();
    let found = path.file_name()?.to_str()?;
    closest(found, names.iter().map(String::as_str))
        .filter(|name| *name != found)
        .map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_is_given_twice() {
        let mut seen = HashMap::new();
        let given = ["a", "a", "a#2", "a", "a#2", "b"];
        let names: Vec<_> = given.map(|name| unique(name.into(), &mut seen)).into();
        assert_eq!(names, ["a", "a#2", "a#2#2", "a#3", "a#2#3", "b"]);
    }

    #[cfg(feature = "toml")]
    #[test]
    fn a_slip_of_the_finger_is_seen_and_another_word_is_not() {
        let known = ["translate", "rotate", "scale", "matrix", "at"];
        for (found, meant) in [
            ("tranlsate", Some("translate")),
            ("Scale", Some("scale")),
            ("rotaet", Some("rotate")),
            ("path", None),
            ("metrix", Some("matrix")),
            ("position", None),
            ("", None),
        ] {
            assert_eq!(closest(found, known), meant, "{found}");
        }
    }
}
