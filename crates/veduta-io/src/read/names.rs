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
}
