use crate::{FACING, Folder};

#[test]
fn sound_files_pass_and_damaged_ones_fail_the_whole() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o a.png"));
    folder.write("broken.obj", "v 0 0 0\nf 1 2 3\n");
    folder.write("broken.png", "no picture");
    let told = folder.told("check town.obj a.png");
    assert!(told.contains("a picture of 8 x 8 pixels"), "{told}");
    assert!(told.contains("2 files, 0 failed"), "{told}");

    let failed = folder
        .veduta("check broken.obj town.obj broken.png gone.glb")
        .assert()
        .code(1)
        .stderr("");
    let told = String::from_utf8_lossy(&failed.get_output().stdout).into_owned();
    for expected in [
        "error: broken.obj:2: refers to vertex 2",
        "error: broken.png: is damaged: ",
        "error: gone.glb: there is no such file",
        "4 files, 3 failed",
    ] {
        assert!(told.contains(expected), "{expected}: {told}");
    }
    folder.veduta("check").assert().code(2);
}

#[test]
fn warnings_fail_only_if_strict_and_quiet_says_what_fails() {
    let folder = Folder::new();
    folder.write(
        "odd.obj",
        "mtllib gone.mtl\nv 0 0 0\nv 0 1 0\nv 0 0 1\nv 5 5 5\nf 1 2 3\nf 1 2 2\n",
    );
    let told = folder.told("check odd.obj");
    assert!(
        told.contains("warning: odd.obj:1: the material library"),
        "{told}"
    );
    assert!(told.contains("3 open edges"), "{told}");
    let strict = folder
        .veduta("check odd.obj town.obj --strict --quiet")
        .assert()
        .code(1);
    let told = String::from_utf8_lossy(&strict.get_output().stdout).into_owned();
    assert!(
        told.contains("gone.mtl") && !told.contains("town.obj"),
        "{told}"
    );
    folder
        .veduta("check town.obj --quiet")
        .assert()
        .success()
        .stdout("");
}

#[test]
fn json_tells_the_counts_of_every_mesh() {
    let folder = Folder::new();
    let told = folder.json("check town.obj");
    assert_eq!(told["failed"], 0);
    let meshes = told["files"][0]["meshes"].as_array().expect("rows");
    let open: u64 = meshes
        .iter()
        .map(|mesh| mesh["openEdges"].as_u64().expect("a count"))
        .sum();
    assert_eq!(open, 8, "two squares: {told}");
}
