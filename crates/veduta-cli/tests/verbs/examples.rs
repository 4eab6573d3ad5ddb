use crate::Folder;
use std::path::Path;

#[test]
fn the_list_names_every_example_and_each_name_is_one() {
    let folder = Folder::new();
    let told = folder.json("examples");
    let rows = told.as_array().expect("rows");
    assert!(rows.len() > 10);
    let listed = folder.told("examples");
    for row in rows {
        let name = row["name"].as_str().expect("a name");
        assert!(listed.contains(name), "{name}");
        // Those of up to a few thousand faces.
        if ["balls7", "radial", "mesh5", "buildings"].contains(&name) {
            let made = folder.json(&format!("examples {name}"));
            let inside = folder.json(&format!("info {name}.glb"));
            assert_eq!(made["faces"], inside["faces"], "{name}");
            assert_eq!(inside["cameras"][0]["name"], "view");
        }
    }
    let refused = folder.veduta("examples rivver").assert().code(2);
    let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(stderr.contains("veduta examples lists them"), "{stderr}");
    folder
        .veduta("examples radial -o radial.stl")
        .assert()
        .code(2);
}

#[test]
fn both_formats_show_the_same_picture() {
    let folder = Folder::new();
    for name in ["balls3", "buildings", "river"] {
        folder.told(&format!("examples {name}"));
        folder.told(&format!("examples {name} -o {name}.obj"));
        let unlit = if name == "river" { "" } else { "--unlit" };
        for suffix in ["glb", "obj"] {
            let view = format!("--size 200x150 --exposure 0 {unlit}");
            folder.told(&format!("render {name}.{suffix} {view} -o {suffix}.png"));
        }
        // Single precision moves edges by a little.
        folder.told("diff glb.png obj.png --tolerance 0.02");
    }
}

#[test]
fn the_repository_s_model_is_what_the_command_writes() {
    let folder = Folder::new();
    folder.told("examples river -o bridge.obj");
    for name in ["bridge.obj", "bridge.mtl"] {
        let kept = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../examples")
            .join(name);
        let kept = std::fs::read(&kept).expect("the repository has it");
        assert!(
            folder.read(name) == kept,
            "{name} differs; `veduta examples river -o examples/bridge.obj --force` writes it anew"
        );
    }
}
