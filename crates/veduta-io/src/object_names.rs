use std::str::FromStr;

/// Names of objects, as a pattern: a star stands for a part of one name, two for any names, a question
/// mark for a letter.
#[derive(Clone, Debug)]
pub struct ObjectNames(glob::Pattern);

impl FromStr for ObjectNames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let pattern = glob::Pattern::new(text);
        pattern
            .map(Self)
            .map_err(|error| format!("no pattern of names: {}", error.msg))
    }
}

impl ObjectNames {
    /// Whether an object of this name is meant.
    pub fn match_name(&self, name: &str) -> bool {
        let options = glob::MatchOptions {
            case_sensitive: true,
            require_literal_separator: true,
            require_literal_leading_dot: false,
        };
        self.0.matches_with(name, options)
    }

    /// The pattern.
    pub fn text(&self) -> &str {
        self.0.as_str()
    }
}
