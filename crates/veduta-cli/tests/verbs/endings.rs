//! However it ends, no partial file is left.

use crate::{FACING, Folder, program};
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

/// Runs `veduta` with a limit on the size of files, of 512 or 1024 bytes each block, in a shell.
#[cfg(unix)]
fn limited(folder: &Folder, blocks: usize, before: &str, arguments: &str) -> std::process::Output {
    let script = format!("{before} ulimit -f {blocks} && exec \"$0\" {arguments}");
    let run = Command::new("sh")
        .current_dir(folder.place())
        .args(["-c", &script])
        .arg(program())
        .output();
    run.expect("there is a shell")
}

#[cfg(unix)]
#[test]
fn a_map_that_cannot_be_written_to_its_end_leaves_the_old_one() {
    use std::os::unix::process::ExitStatusExt;
    let folder = Folder::new();
    folder.told("examples radial -o radial.obj");
    let render = format!("render radial.obj {FACING} --self-contained --force -o town.veduta");
    folder.told(&render);
    let new = folder.read("town.veduta");
    folder.told(&format!("render town.obj {FACING} --force -o town.veduta"));
    let (old, before) = (folder.read("town.veduta"), folder.files());
    for blocks in [0, 1, 4, new.len() / 1024 - 1] {
        // Who writes beyond the limit is ended by a signal, as by a kill in the midst of it.
        let killed = limited(&folder, blocks, "", &render);
        // Or, where that is ignored, told that there is no room.
        let refused = limited(&folder, blocks, "trap '' XFSZ;", &render);
        assert_eq!(
            folder.files(),
            before,
            "{blocks} blocks: nothing is left over"
        );
        assert!(
            folder.read("town.veduta") == old,
            "{blocks} blocks: the old map is there"
        );
        assert!(
            killed.status.signal().is_some(),
            "{blocks} blocks: {killed:?}"
        );
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(6), "{blocks} blocks: {said}");
        assert!(said.contains("town.veduta: "), "{blocks} blocks: {said}");
    }
    folder.told(&render);
    assert!(
        folder.read("town.veduta") == new,
        "without a limit it is written"
    );
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
