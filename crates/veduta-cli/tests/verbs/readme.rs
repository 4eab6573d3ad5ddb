//! The README keeps its word: its commands are run as a newcomer runs them.

use crate::{Folder, program};
use std::fs;
use std::path::Path;
use std::process::Command;

fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// The lines of blocks of shell that start with the program's name, without what is said of them.
fn commands(text: &str) -> Vec<String> {
    let blocks = text.split("```sh\n").skip(1);
    let blocks = blocks.map(|block| block.split("```").next().unwrap_or_default());
    blocks
        .flat_map(str::lines)
        .filter(|line| line.starts_with("veduta "))
        .map(|line| {
            line.split("  #")
                .next()
                .unwrap_or_default()
                .trim()
                .to_owned()
        })
        .collect()
}

#[cfg(unix)]
#[test]
fn every_command_of_the_readme_works_in_a_fresh_copy() {
    let folder = Folder::new();
    fs::create_dir(folder.path("examples")).expect("may write in the test's folder");
    for entry in fs::read_dir(repository().join("examples")).expect("the repository has it") {
        let file = entry.expect("an entry").path();
        let name = file.file_name().expect("a file").to_owned();
        fs::copy(&file, folder.path("examples").join(name)).expect("may write there");
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let bin = program().parent().expect("a folder").to_owned();
    let path = std::env::join_paths([bin].into_iter().chain(std::env::split_paths(&path)));
    let path = path.expect("a path");
    let readme = fs::read_to_string(repository().join("README.md")).expect("there is a README");
    let commands = commands(&readme);
    assert!(commands.len() >= 12, "{commands:#?}");
    for command in commands {
        let output = Command::new("sh")
            .args(["-c", &command])
            .current_dir(folder.place())
            .env("PATH", &path)
            .output()
            .expect("a shell");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success() && stderr.is_empty(),
            "{command}: {stderr}"
        );
    }
}

#[test]
fn every_picture_and_page_that_the_readme_shows_is_there() {
    let readme = fs::read_to_string(repository().join("README.md")).expect("there is a README");
    let mut count = 0;
    for link in readme.split("](").skip(1) {
        let target = link.split([')', '#']).next().unwrap_or_default();
        if !target.contains("://") {
            count += 1;
            assert!(repository().join(target).exists(), "{target}");
        }
    }
    assert!(count > 8, "{count}");
}
