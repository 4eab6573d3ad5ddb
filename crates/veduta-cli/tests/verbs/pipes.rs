//! stdout carries the picture and nothing else, and its end is nobody's fault.

use crate::{FACING, Folder, png, program};
use std::process::{Command, Stdio};

#[test]
fn a_picture_goes_into_a_pipe_whole_and_alone() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING} --unlit");
    for (format, output) in [
        ("", "a.png"),
        ("--format exr", "a.exr"),
        ("--format tif", "a.tif"),
    ] {
        folder.told(&format!("{render} -o {output}"));
        let piped = folder
            .veduta(&format!("{render} -o - {format} --verbose"))
            .assert()
            .success();
        assert!(piped.get_output().stdout == folder.read(output), "{output}");
    }
    assert_eq!(png(&folder.read("a.png")).0, 8);
    assert!(!folder.path("-").exists());
}

/// A picture that does not fit into a pipe, read by nobody.
#[cfg(unix)]
#[test]
fn a_reader_that_has_read_enough_is_no_error() {
    let folder = Folder::new();
    folder.told("examples river -q");
    for command in [
        "render town.obj --size 600x600 --format npy -o - | head -c 10 | wc -c",
        "info river.glb --all --json | head -c 10 | wc -c",
        "render town.obj --size 60x60 --preview=kitty | head -c 10 | wc -c",
    ] {
        let script = format!("set -o pipefail; {} {command}", program().display());
        let output = Command::new("bash")
            .args(["-c", &script])
            .current_dir(folder.place())
            .output()
            .expect("bash is there");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success() && stderr.is_empty(),
            "{command}: {stderr}"
        );
        assert_eq!(
            String::from_utf8_lossy(&output.stdout).trim(),
            "10",
            "{command}"
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_and_what_is_no_file_is_written_to_and_stays() {
    let folder = Folder::new();
    let full = std::fs::File::options().write(true).open("/dev/full");
    let output = Command::new(program())
        .current_dir(folder.place())
        .args(["render", "town.obj", "--size", "8x8", "-o", "-"])
        .stdout(full.expect("Linux has it"))
        .stderr(Stdio::piped())
        .output()
        .expect("the program runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(6), "{stderr}");
    assert!(
        stderr.contains("stdout: cannot be written: No space left"),
        "{stderr}"
    );

    // A device through a link, so that the test harms none if it fails.
    std::os::unix::fs::symlink("/dev/full", folder.path("full.png")).expect("may link here");
    let output = folder
        .veduta("render town.obj --size 8x8 -o full.png")
        .assert()
        .code(6);
    let stderr = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
    assert!(
        stderr.contains("full.png: cannot be written: No space left"),
        "{stderr}"
    );

    std::os::unix::fs::symlink("/dev/null", folder.path("null.exr")).expect("may link here");
    folder.told("render town.obj --size 8x8 -o null.exr");
    assert!(folder.path("null.exr").is_symlink());
}

/// On a disk of 64 KiB; needs the right to mount one in a name space of its own.
#[cfg(target_os = "linux")]
#[test]
fn a_picture_that_does_not_fit_on_the_disk_leaves_nothing_of_it() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("small")).expect("may write here");
    let unshared = |script: &str| {
        Command::new("unshare")
            .args(["--user", "--map-root-user", "--mount", "sh", "-c", script])
            .current_dir(folder.place())
            .output()
    };
    let mount = "mount -t tmpfs -o size=64k veduta small";
    if !unshared(mount).is_ok_and(|output| output.status.success()) {
        println!("skipped: no small disk can be mounted here");
        return;
    }
    for suffix in [
        "npy",
        "pfm",
        "exr --compression none",
        "tif --depth float",
        "png --depth 16",
    ] {
        let script = format!(
            "{mount} && echo old > small/a.png
            {} render town.obj --size 1000x900 --background noise.npy -o small/a.{suffix}
            code=$?; ls -A small; cat small/a.png; exit $code",
            program().display()
        );
        // Noise, which no format makes small.
        let mut seed = 1_u32;
        let mut noise = b"PF\n300 300\n-1\n".to_vec();
        for _ in 0..3 * 300 * 300 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            noise.extend(((seed >> 8) as f32 / (1 << 24) as f32).to_le_bytes());
        }
        folder.write("noise.pfm", noise);
        let script = script.replace("noise.npy", "noise.pfm");
        let output = unshared(&script).expect("unshare is there");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(6), "{suffix}: {stderr}");
        assert!(
            stderr.contains("No space left on device"),
            "{suffix}: {stderr}"
        );
        let stdout = String::from_utf8_lossy(&output.stdout);
        assert_eq!(
            stdout, "a.png\nold\n",
            "{suffix}: only the old file is there"
        );
    }
}

/// Progress shows on a terminal, which `script` provides, and nothing of it in a pipe.
#[cfg(target_os = "linux")]
#[test]
fn progress_shows_on_a_terminal_only() {
    let folder = Folder::new();
    let render = format!(
        "{} render town.obj --size 8x8 -o a.png",
        program().display()
    );
    let run = |command: &str| {
        Command::new("script")
            .args(["--quiet", "--return", "--command", command, "/dev/null"])
            .current_dir(folder.place())
            .stdin(Stdio::null())
            .output()
    };
    let Ok(output) = run(&render) else {
        println!("skipped: script(1) is not there to provide a terminal");
        return;
    };
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{shown}");
    assert!(shown.contains("reading"), "{shown:?}");
    assert!(
        shown.ends_with("\x1b[2K"),
        "the line is cleared at the end: {shown:?}"
    );
    for quiet in ["--progress none", "--quiet"] {
        let output = run(&format!("{render} {quiet}")).expect("script is there");
        assert!(output.stdout.is_empty(), "{quiet}");
    }
    folder
        .veduta("render town.obj --size 8x8 -o a.png")
        .assert()
        .success()
        .stdout("")
        .stderr("");
}
