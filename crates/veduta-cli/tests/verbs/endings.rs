//! However it ends, no partial file is left.

use crate::{Folder, program};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

#[cfg(unix)]
#[test]
fn killed_while_it_writes_it_leaves_no_partial_file() {
    use std::os::unix::process::ExitStatusExt;
    for (signal, ends) in [("INT", Some(130)), ("TERM", Some(130)), ("KILL", None)] {
        let folder = Folder::new();
        folder.write("a.png", "old");
        let before = folder.files();
        let mut running = Command::new(program())
            .current_dir(folder.place())
            .args(["render", "town.obj", "--size", "5000x5000", "--depth", "16"])
            .args(["-o", "a.png", "--progress", "json"])
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program runs");
        let stderr = BufReader::new(running.stderr.take().expect("is piped"));
        let begins = |line: &str| line.contains("\"writing\"") && line.contains("false");
        let begun = stderr
            .lines()
            .any(|line| begins(&line.expect("the program writes text")));
        assert!(begun, "it never begins to write");
        // Into the writing, which takes a second or so.
        std::thread::sleep(std::time::Duration::from_millis(50));
        let kill = Command::new("kill")
            .args([&format!("-{signal}"), &running.id().to_string()])
            .status()
            .expect("kill is there");
        assert!(kill.success());
        let status = running.wait().expect("the program ends");
        assert_eq!(status.code(), ends, "SIG{signal}");
        if signal == "KILL" {
            assert_eq!(status.signal(), Some(9));
        }
        assert_eq!(folder.read("a.png"), b"old", "SIG{signal}");
        let left: Vec<_> = folder
            .files()
            .into_iter()
            .filter(|name| !before.contains(name))
            .collect();
        let named = |name: &String| name.starts_with(".a.png.") && name.ends_with(".part");
        if signal == "KILL" && !left.is_empty() && left.iter().all(named) {
            println!("skipped for SIGKILL: this file system has no files without name");
        } else {
            assert!(left.is_empty(), "SIG{signal}: {left:?}");
        }
    }
}

#[test]
fn files_other_than_pictures_are_replaced_only_with_leave() {
    let folder = Folder::new();
    folder.write("a.obj", "old");
    folder.write("b.mtl", "old");
    for output in ["a.obj", "b.obj"] {
        let refused = folder
            .veduta(&format!("examples radial -o {output}"))
            .assert()
            .code(2);
        let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(
            stderr.contains("exists already; --force replaces it"),
            "{stderr}"
        );
    }
    assert_eq!(
        (folder.read("a.obj"), folder.read("b.mtl")),
        (b"old".to_vec(), b"old".to_vec())
    );
    assert!(!folder.path("b.obj").exists());
    folder.told("examples radial -o a.obj --force");
    assert!(folder.read("a.obj").starts_with(b"# Written by veduta"));
}
