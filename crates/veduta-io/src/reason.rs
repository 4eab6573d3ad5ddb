use std::io::{Error, ErrorKind};

/// What the operating system said of a file, for people: in plain words and without its number.
pub fn reason(error: &Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".to_owned(),
        ErrorKind::IsADirectory => "it is a folder".to_owned(),
        _ => {
            let told = error.to_string();
            match told.rfind(" (os error ") {
                Some(end) => told[..end].to_owned(),
                None => told,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_the_system_are_told_without_numbers() {
        let missing = std::fs::read("no such folder/no such file").expect_err("it is not there");
        assert_eq!(reason(&missing), "there is no such file");
        let full = Error::from_raw_os_error(28);
        let told = reason(&full);
        assert!(!told.is_empty() && full.to_string().starts_with(&told));
        assert!(!told.contains("os error"), "{told}");
        assert_eq!(reason(&Error::other("it is a pipe")), "it is a pipe");
    }
}
