//! Layers, Cryptomatte and deep pictures as OpenEXR's own Python module reads them.

use crate::Folder;
use std::process::Command;

/// Exits with 77 where the module is not installed, which the test tells.
const SCRIPT: &str = r#"
import json, sys
try:
    import numpy as np, OpenEXR
except ImportError as error:
    print(error)
    sys.exit(77)

def opened(name):
    file = OpenEXR.File(name, separate_channels=True)
    return file.header(), {name: channel.pixels for name, channel in file.channels().items()}

def close(found, expected, tolerance, what):
    worst = np.abs(np.asarray(found, float) - expected).max()
    assert worst <= tolerance, f"{what}: off by {worst}"

header, layers = opened("layers.exr")
red, alpha = layers["R"], layers["A"]
seen = alpha > 0
assert 0 < seen.sum() < seen.size and ((0 < alpha) & (alpha < 1)).any()
# The wall stands 5 m before the eye, the box a metre before it; both look at it.
depth = layers["Z"][seen]
close(depth, np.where(depth < 4.5, 4, 5), 1e-5, "depth")
assert {4, 5} == set(depth.round())
for axis, value in zip("XYZ", [0, -1, 0]):
    close(layers[f"N.{axis}"][seen], value, 1e-3, f"normal {axis}")
close(layers["P.Y"][seen], depth - 5, 1e-5, "position")
assert layers["id.object"].dtype == np.uint32
assert (layers["id.object"][seen] > 0).all() and (layers["id.object"][~seen] == 0).all()

def murmur3(text):
    "MurmurHash3_x86_32, as Cryptomatte's specification tells it."
    data, mask = text.encode(), 0xffffffff
    rotate = lambda x, r: ((x << r) | (x >> (32 - r))) & mask
    scramble = lambda k: (rotate((k * 0xcc9e2d51) & mask, 15) * 0x1b873593) & mask
    h, whole = 0, len(data) // 4 * 4
    for at in range(0, whole, 4):
        h ^= scramble(int.from_bytes(data[at:at + 4], "little"))
        h = (rotate(h, 13) * 5 + 0xe6546b64) & mask
    if data[whole:]:
        h ^= scramble(int.from_bytes(data[whole:], "little"))
    h ^= len(data)
    for shift, factor in ((16, 0x85ebca6b), (13, 0xc2b2ae35)):
        h = ((h ^ (h >> shift)) * factor) & mask
    return h ^ (h >> 16)

for name in ["CryptoObject", "CryptoMaterial"]:
    [key] = [k[:-5] for k, v in header.items() if k.startswith("cryptomatte/") and k.endswith("/name") and v == name]
    assert key == "cryptomatte/" + ("%08x" % murmur3(name))[:7], key
    manifest = {int(code, 16): text for text, code in json.loads(header[key + "/manifest"]).items()}
    for code, text in manifest.items():
        assert murmur3(text) == code, text
    coverage, ranks = np.zeros(alpha.shape), 0
    while f"{name}{ranks:02}.R" in layers:
        for ids, share in ["RG", "BA"]:
            ids = layers[f"{name}{ranks:02}.{ids}"]
            share = layers[f"{name}{ranks:02}.{share}"]
            assert set(ids[share > 0].view(np.uint32).tolist()) <= set(manifest)
            coverage += share
        ranks += 1
    assert ranks > 0
    close(coverage, alpha, 1e-5, f"coverage of {name}")

header, deep = opened("deep.exr")
_, flat = opened("flat.exr")
rows, columns = flat["A"].shape
for row in range(rows):
    for column in range(columns):
        pixel = {name: deep[name][row, column] for name in ["R", "A", "Z"]}
        light, let_through = 0.0, 1.0
        if pixel["A"] is not None:
            for k in np.argsort(pixel["Z"], kind="stable"):
                light += let_through * float(pixel["R"][k])
                let_through *= 1 - float(pixel["A"][k])
        close(light, flat["R"][row, column], 1e-5, "flattened light")
        close(1 - let_through, flat["A"][row, column], 1e-5, "flattened opacity")
print("checked")
"#;

#[test]
fn openexr_reads_layers_cryptomatte_and_deep_pictures_as_they_are() {
    let folder = Folder::new();
    // Edges lie within pixels.
    let render = "render town.obj --eye 0,-5,0 --look-at 0,0,0 --parallel 4 --size 9x9 --unlit";
    folder.told(&format!(
        "{render} --depth float --aov depth,normal,position,object,crypto-object,crypto-material -o layers.exr"
    ));
    folder.told(&format!("{render} --depth float -o flat.exr"));
    folder.told(&format!("{render} --depth float --deep -o deep.exr"));
    let checked = Command::new("python3")
        .args(["-c", SCRIPT])
        .current_dir(folder.path("."))
        .output();
    match checked {
        Ok(output) if output.status.code() == Some(77) => {
            let why = String::from_utf8_lossy(&output.stdout).into_owned();
            println!("skipped: OpenEXR's Python module is not installed: {why}");
        }
        Ok(output) => {
            let told = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{told}");
        }
        Err(error) => println!("skipped: python3 cannot be run: {error}"),
    }
}
