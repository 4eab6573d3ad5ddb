//! Help that tells the truth: every example in it is run.

use crate::{Folder, program};
use std::process::Command;

const VERBS: &[&str] = &[
    "render",
    "shade",
    "composite",
    "dome",
    "frames",
    "info",
    "check",
    "diff",
    "examples",
    "completions",
    "man",
    "schema",
];

/// The commands of a help text's examples.
fn examples(text: &str) -> Vec<String> {
    let (_, after) = text.split_once("Examples:\n").expect("help has examples");
    after
        .lines()
        .filter(|line| line.starts_with("      veduta "))
        .map(|line| line.trim().to_owned())
        .collect()
}

#[cfg(unix)]
#[test]
fn every_example_of_every_help_text_works() {
    let folder = Folder::new();
    folder.told("render town.obj --size 64x48 --background #8ab4d8 -o sky.jpg");
    folder.told("render town.obj --size 64x48 --unlit -o flat.png");
    // Nearer, so that another near plane suits it.
    folder.write("hut.obj", "o hut\nv 0 0 2\nv 1 0 2\nv 0 1 2\nf 1 2 3\n");
    folder.told("render town.obj --size 64x48 --unlit --depth 16 -o deep.png");
    // A small one that moves.
    folder.write(
        "voyage.toml",
        "[camera.shore]\neye = [9, -9, 5]\nlook_at = [0, 0, 0]\nsize = [64, 48]\n\
         [[layer]]\nname = \"town\"\nmodel = \"town.obj\"\n\
         [[layer]]\nname = \"hut\"\nmodel = \"hut.obj\"\n\
         keys = [{ time = 0, translate = [0, 0, 0] }, { time = 2, translate = [1, 0, 0] }]\n",
    );
    // The program by its name.
    let path = std::env::var_os("PATH").unwrap_or_default();
    let bin = program().parent().expect("a folder").to_owned();
    let path = std::env::join_paths([bin].into_iter().chain(std::env::split_paths(&path)));
    let path = path.expect("a path");
    let mut helps = vec![folder.told("--help")];
    helps.extend(
        VERBS
            .iter()
            .map(|verb| folder.told(&format!("help {verb}"))),
    );
    let mut done = Vec::new();
    for help in helps {
        let commands = examples(&help);
        assert!(!commands.is_empty(), "{help}");
        for command in commands {
            assert!(
                command.len() + 6 <= 80,
                "a terminal would break {command:?}"
            );
            // Examples of two texts may write the same model.
            for name in ["river.glb", "mesh5.glb", "pierce.obj", "pierce.mtl"] {
                let writes = command.contains(&format!("examples {}", &name[..name.len() - 4]));
                if writes && folder.path(name).exists() {
                    std::fs::remove_file(folder.path(name)).expect("may remove it");
                }
            }
            let output = Command::new("sh")
                .args(["-c", &command])
                .current_dir(folder.place())
                .env("PATH", &path)
                .output()
                .expect("a shell");
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{command}: {stderr}");
            assert!(stderr.is_empty(), "{command}: {stderr}");
            done.push(command);
        }
    }
    assert!(done.len() >= 20, "{done:#?}");
}

#[test]
fn every_verb_is_listed_tested_and_tells_exit_codes() {
    let folder = Folder::new();
    let help = folder.told("--help");
    let (_, commands) = help.split_once("Commands:\n").expect("a list");
    let listed: Vec<&str> = commands
        .lines()
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert_eq!(listed, VERBS);
    for code in [
        "0 fine",
        "1 a check failed",
        "2 usage",
        "3 something named is missing",
        "6 input/output",
        "130 interrupted",
    ] {
        assert!(help.contains(code), "{code}");
    }
}

#[test]
fn misspelt_verbs_and_options_are_met_with_what_was_meant() {
    let folder = Folder::new();
    for (arguments, meant) in [
        ("rendr town.obj -o a.png", "'render'"),
        (
            "render town.obj -o a.png --backgroud #fff",
            "'--background'",
        ),
        ("render town.obj -o a.png --tone filmc", "'filmic'"),
        ("compltions bash", "'completions'"),
    ] {
        let refused = folder.veduta(arguments).assert().code(2);
        let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(stderr.contains(meant), "{arguments}: {stderr}");
    }
}

#[test]
fn completions_and_manual_know_every_verb() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = folder.told(&format!("completions {shell}"));
        for verb in VERBS {
            assert!(text.contains(verb), "{shell}: {verb}");
        }
    }
    folder.told("man -o pages");
    for verb in VERBS {
        let page = String::from_utf8(folder.read(&format!("pages/veduta-{verb}.1"))).expect("text");
        assert!(page.contains(&format!(".TH veduta-{verb} 1")), "{page}");
        assert!(page.contains("Examples:"), "{verb}");
        assert_eq!(page, folder.told(&format!("man {verb}")));
    }
    assert!(folder.told("man").contains(".TH veduta 1"));
    folder.veduta("man rendr").assert().code(2);
    // The pages are there already.
    folder.veduta("man -o pages").assert().code(2);
    folder.told("man -o pages --force");
}
