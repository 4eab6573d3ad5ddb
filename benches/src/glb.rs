//! A binary glTF of an exchanged scene: what loading costs when it is done as a user does it, by
//! `veduta-io`, with all the checks that a foreign file needs.

use crate::exchange::Exchange;
use std::io::{self, Write};
use veduta::geometry::DVec3;

/// Component type of f32 in glTF.
const FLOAT: u32 = 5126;

/// Writes `scene` as a GLB in eye space with y up: x right, y up, z towards the eye.
///
/// Triangles share no vertices, since glTF keeps colours by vertex and these are flat. Positions are
/// rounded to f32, the only numbers that glTF has for them.
///
/// # Errors
/// When `out` cannot be written, or the scene is too large for the format's 4 GiB.
pub fn write(scene: &Exchange, out: &mut impl Write) -> io::Result<()> {
    let mut bytes: Vec<u8> = Vec::new();
    let [
        mut views,
        mut accessors,
        mut meshes,
        mut nodes,
        mut materials,
    ] = [const { Vec::<String>::new() }; 5];
    for double_sided in [false, true] {
        let faces: Vec<usize> = (0..scene.triangles.len())
            .filter(|&face| scene.double_sided[face] == double_sided)
            .collect();
        if faces.is_empty() {
            continue;
        }
        let count = 3 * faces.len();
        let corners = || {
            let corners = faces.iter().flat_map(|&face| scene.triangles[face]);
            // Half a turn about x: eye space has y down and z forward.
            corners.map(|corner| scene.positions[corner as usize] * DVec3::new(1.0, -1.0, -1.0))
        };
        let low = corners().fold(DVec3::MAX, DVec3::min).as_vec3();
        let high = corners().fold(DVec3::MIN, DVec3::max).as_vec3();
        let (start, length) = (bytes.len(), 12 * count);
        let positions = corners().flat_map(|position| position.as_vec3().to_array());
        bytes.extend(positions.flat_map(f32::to_le_bytes));
        let colors = faces.iter().flat_map(|&face| [scene.colors[face]; 3]);
        bytes.extend(colors.flatten().flat_map(f32::to_le_bytes));

        let (first, index) = (accessors.len(), meshes.len());
        for offset in [start, start + length] {
            views.push(format!(
                r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}}}"#
            ));
        }
        accessors.push(format!(
            r#"{{"bufferView":{first},"componentType":{FLOAT},"count":{count},"type":"VEC3","min":{:?},"max":{:?}}}"#,
            low.to_array(),
            high.to_array()
        ));
        accessors.push(format!(
            r#"{{"bufferView":{},"componentType":{FLOAT},"count":{count},"type":"VEC3"}}"#,
            first + 1
        ));
        meshes.push(format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":{first},"COLOR_0":{}}},"material":{index}}}]}}"#,
            first + 1
        ));
        nodes.push(format!(r#"{{"mesh":{index}}}"#));
        materials.push(format!(
            r#"{{"doubleSided":{double_sided},"extensions":{{"KHR_materials_unlit":{{}}}}}}"#
        ));
    }
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["KHR_materials_unlit"],"scene":0,"scenes":[{{"nodes":{:?}}}],"nodes":[{}],"meshes":[{}],"materials":[{}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]}}"#,
        (0..nodes.len()).collect::<Vec<_>>(),
        nodes.join(","),
        meshes.join(","),
        materials.join(","),
        accessors.join(","),
        views.join(","),
        bytes.len()
    );
    json.push_str(&" ".repeat(json.len().next_multiple_of(4) - json.len()));

    let length = |length: usize| u32::try_from(length).map_err(io::Error::other);
    let total = length(12 + 8 + json.len() + 8 + bytes.len())?;
    out.write_all(b"glTF")?;
    for number in [2, total, length(json.len())?] {
        out.write_all(&number.to_le_bytes())?;
    }
    out.write_all(b"JSON")?;
    out.write_all(json.as_bytes())?;
    out.write_all(&length(bytes.len())?.to_le_bytes())?;
    out.write_all(b"BIN\0")?;
    out.write_all(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::Case;
    use veduta_io::{ReadOptions, read_scene};

    #[test]
    fn what_is_written_is_read_without_warnings_and_with_all_faces() {
        let case = Case::parse("bridge").expect("a sound title");
        let path = std::env::temp_dir().join(format!("veduta-bench-{}.glb", std::process::id()));
        let mut bytes = Vec::new();
        write(&Exchange::new(&case), &mut bytes).expect("memory takes all");
        std::fs::write(&path, bytes).expect("the temporary folder can be written");
        let loaded = read_scene(&path, &ReadOptions::default());
        std::fs::remove_file(&path).expect("the file was just written");
        let loaded = loaded.expect("a sound file");
        assert_eq!(loaded.warnings.len(), 0, "{:?}", loaded.warnings);
        assert_eq!(loaded.scene.face_count(), case.scene.face_count());
    }
}
