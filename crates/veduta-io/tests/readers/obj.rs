use crate::support::{Folder, small_png};
use veduta::map::MaterialId;
use veduta::scene::{AlphaMode, Scene};
use veduta_geometry::{DVec3, Vec2, Vec3};
use veduta_io::{ErrorKind, Place};

/// Reads an OBJ that must be sound; no warnings.
fn scene(text: &str) -> Scene {
    let loaded = Folder::new().read("m.obj", text);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn groups_become_objects_even_when_they_are_taken_up_again() {
    let text = "o house\ng wall\nf 1 2 3\ng roof\nf 1 3 4\ng wall\nf 2 3 4\no tree\nf 1 2 4\n";
    let scene = scene(&format!("{SQUARE}{text}"));
    let found: Vec<_> = scene
        .objects
        .iter()
        .map(|o| {
            (
                o.name.as_str(),
                scene.meshes[o.mesh.0 as usize].triangles.len(),
            )
        })
        .collect();
    assert_eq!(found, [("house/wall", 2), ("house/roof", 1), ("tree", 1)]);
    // Vertices of other groups are not kept.
    assert_eq!(
        scene.meshes[1].positions,
        [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]
    );
}

#[test]
fn a_file_without_groups_is_named_by_itself() {
    assert_eq!(scene(&format!("{SQUARE}f 1 2 3\n")).objects[0].name, "m");
}

#[test]
fn vertices_are_shared_where_all_their_attributes_are() {
    let text = format!(
        "{SQUARE}vt 0 0\nvt 1 1\nvn 0 0 1\nvn 0 0 2\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/2/1 4/1/2\n"
    );
    let mesh = &scene(&text).meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 3, 4]]);
    // (0, 0) is the bottom left corner in OBJ, and the top left one here.
    assert_eq!(
        mesh.texcoords[2..4],
        [Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.0)]
    );
    assert_eq!(mesh.normals, [Vec3::Z; 5]);
}

#[test]
fn corners_without_attributes_get_plain_ones_beside_corners_with_them() {
    let text = format!("{SQUARE}vt 0.5 0.5\nvn 1 0 0\nf 1/1/1 2/1/1 3/1/1\nf 1 3 4\n");
    let mesh = &scene(&text).meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(mesh.normals[3..], [Vec3::Z; 3], "flat, as the face lies");
    assert_eq!(mesh.texcoords[3..], [Vec2::ZERO; 3]);
}

#[test]
fn concave_polygons_are_cut_within_their_outline() {
    let dart = "v 0 0 5\nv 2 1 5\nv 0 2 5\nv 1 1 5\nf -4 -3 -2 -1\n";
    let mesh = &scene(dart).meshes[0];
    let area = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
        0.5 * (b - a).cross(c - a).z
    };
    let areas: Vec<f64> = mesh.triangles.iter().map(area).collect();
    // The dart has area 1; the fan from its first corner would give 1.5 and -0.5.
    assert_eq!(areas, [0.5, 0.5]);
}

#[test]
fn planar_polygons_stay_one_face_and_bent_ones_become_triangles() {
    let faces = |text: &str| {
        let mesh = &scene(text).meshes[0];
        let corners = |face| mesh.corners_of(face).count();
        (0..mesh.face_count() as u32)
            .map(corners)
            .collect::<Vec<_>>()
    };
    // In national coordinates, with three decimals.
    let wall = "v 84616.468 447423.000 0\nv 84620.468 447426.000 0\nv 84620.468 447426.000 3.2\n\
        v 84618.468 447424.500 4.7\nv 84616.468 447423.000 3.2\nf 1 2 3 4 5\n";
    assert_eq!(faces(wall), [5]);
    let bent = format!("{SQUARE}v 0 1 0.1\nf 1 2 3 5\nf 1 2 3 4\nf 1 2 3\n");
    assert_eq!(faces(&bent), [3, 3, 4, 3]);
    // An L becomes two parts.
    let l = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n";
    assert_eq!(faces(l).len(), 2);
}

#[test]
fn a_polygon_over_which_normals_colours_or_textures_bend_becomes_triangles() {
    let count = |text: &str| scene(text).face_count();
    let normals = "vn 0 0 1\nvn 1 0 1\n";
    assert_eq!(
        count(&format!("{SQUARE}{normals}f 1//1 2//1 3//1 4//1\n")),
        1
    );
    assert_eq!(
        count(&format!("{SQUARE}{normals}f 1//1 2//1 3//2 4//2\n")),
        2
    );
    let colored = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 1 0 0\nv 0 1 0 0 0 1\nf 1 2 3 4\n";
    assert_eq!(count(colored), 2);
    let texcoords = "vt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\nvt 0 1\n";
    let textured = |last| format!("{SQUARE}{texcoords}f 1/1 2/2 3/3 4/{last}\n");
    assert_eq!((count(&textured(4)), count(&textured(5))), (1, 2));
}

#[test]
fn smoothing_groups_give_normals_to_faces_without_them() {
    // A roof of two slopes: smooth in one group, creased between two, flat without.
    let roof = "v -1 0 0\nv -1 1 0\nv 0 0 1\nv 0 1 1\nv 1 0 0\nv 1 1 0\n";
    let (left, right) = ("f 1 3 4 2\n", "f 3 5 6 4\n");
    let normals = |text: String| scene(&format!("{roof}{text}")).meshes[0].normals.clone();
    assert!(normals(format!("{left}{right}")).is_empty());
    assert!(normals(format!("s off\n{left}s 0\n{right}")).is_empty());

    let slope = Vec3::new(1.0, 0.0, 1.0).normalize();
    let close = |a: Vec3, b: Vec3| a.abs_diff_eq(b, 1e-6);
    let smooth = normals(format!("s 1\n{left}{right}"));
    assert_eq!(smooth.len(), 6, "vertices are shared");
    assert_eq!(smooth.iter().filter(|&&n| close(n, Vec3::Z)).count(), 2);
    let creased = normals(format!("s 1\n{left}s 2\n{right}"));
    assert_eq!(creased.len(), 8);
    assert_eq!(creased.iter().filter(|&&n| close(n, slope)).count(), 4);
    // Normals of the file come first, and polygons that are not bent by theirs stay whole.
    let given = scene(&format!("{roof}vn 0 0 1\ns 1\nf 1//1 3//1 4//1 2//1\n"));
    assert_eq!(given.meshes[0].normals, [Vec3::Z; 4]);
    assert_eq!(
        scene(&format!("{roof}s 1\n{left}s 2\n{right}")).face_count(),
        2
    );
}

#[test]
fn a_smooth_surface_is_smooth_across_groups_and_materials() {
    let roof = "v -1 0 0\nv -1 1 0\nv 0 0 1\nv 0 1 1\nv 1 0 0\nv 1 1 0\n";
    let scene = scene(&format!("{roof}s 1\ng a\nf 1 3 4 2\ng b\nf 3 5 6 4\n"));
    for mesh in &scene.meshes {
        let up = mesh.normals.iter().filter(|n| n.abs_diff_eq(Vec3::Z, 1e-6));
        assert_eq!(up.count(), 2);
    }
}

#[test]
fn a_thousand_smoothing_groups_at_one_corner_are_told_apart() {
    let mut text = String::from(SQUARE);
    for group in 1..=1000 {
        text.push_str(&format!("s {group}\nf 1 2 3\nf 1 3 2\n"));
    }
    // Two faces that turn their backs on each other leave no direction.
    let mesh = &scene(&text).meshes[0];
    assert_eq!(mesh.normals.len(), 3000);
}

#[test]
fn lines_are_read_in_all_their_spellings() {
    let text = "\u{feff}# no mark\r\nv\t0 0 0 # origin\r\nv 1 0 0 1.0\r\n  v 0 1 \\\r\n 0\r\n\r\n\
        f 1// \\\r\n2// 3//\r\ns 1\r\nusemtl\r\n";
    let scene = scene(text);
    assert_eq!(scene.meshes[0].positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(scene.face_count(), 1);
}

#[test]
fn vertex_colours_are_kept() {
    let mesh = &scene("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 1.0 0 0 1\nf 1 2 3\n").meshes[0];
    assert_eq!(mesh.colors, [[1.0, 0.0, 0.0], [1.0; 3], [0.0, 0.0, 1.0]]);
}

#[test]
fn materials_come_from_the_library_with_their_textures() {
    let folder = Folder::new();
    folder.write("tile a.png", small_png());
    folder.write(
        "my lib.mtl",
        "newmtl red\nKd 0.5 0.1 0.2\nKe 1 2 3\nnewmtl glass\nKd 1 1 1\nd 0.25\n\
         newmtl tiled\nKd 0 0 0\nmap_Kd -s 2 4 -o 0.25 0.5 1 -clamp on C:\\textures\\tile a.png\n",
    );
    let text = format!(
        "mtllib my lib.mtl\n{SQUARE}usemtl red\nf 1 2 3\nusemtl glass\nf 1 3 4\nusemtl tiled\n\
         f 1 2 4\nusemtl red\nf 2 3 4\n"
    );
    let loaded = folder.read("m.obj", text).expect("a sound file");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let scene = &loaded.scene;
    let ids: Vec<_> = (0..4)
        .map(|face| scene.meshes[0].material_of(face))
        .collect();
    assert_eq!(ids, [0, 1, 2, 0].map(MaterialId));
    let [red, glass, tiled] = &scene.materials[..] else {
        panic!("three materials: {:?}", scene.materials);
    };
    assert_eq!(
        (red.base_color, red.emissive),
        ([0.5, 0.1, 0.2, 1.0], [1.0, 2.0, 3.0])
    );
    assert!(red.double_sided);
    assert_eq!(
        (glass.base_color[3], glass.alpha_mode),
        (0.25, AlphaMode::Blend)
    );
    assert_eq!(
        tiled.base_color, [1.0; 4],
        "black below a texture is an exporter's habit"
    );
    let texture = tiled.base_color_texture.expect("a texture");
    assert_eq!(texture.scale, Vec2::new(2.0, 4.0));
    // At the bottom (v = 0 in OBJ, 1 here) the map says 0.5: from the top, that is 0.5.
    let bottom = texture.offset.y + texture.scale.y * 1.0;
    assert_eq!(bottom, 1.0 - 0.5);
    assert_eq!(scene.images[0].pixels.len(), 2);
}

#[test]
fn what_is_missing_or_not_supported_is_warned_of_and_left_out() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl paint\nKd 1 x 0\nmap_Kd gone.png\n");
    let text = format!(
        "mtllib a.mtl\nmtllib gone.mtl\n{SQUARE}usemtl paint\nf 1 2 3\nusemtl other\nf 1 2 4\n\
         l 1 2\np 1\ncurv 0 1 1 2\nnonsense\nf 1 2\n"
    );
    let loaded = folder.read("m.obj", text).expect("a readable file");
    let texts: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    for expected in [
        "a.mtl:2: \"x\" where a number should stand; the line is left out",
        "a.mtl:3: the texture \"gone.png\" cannot be read",
        "m.obj:2: the material library \"gone.mtl\" cannot be read",
        "m.obj: no library has the material \"other\"",
        "m.obj:11: points and lines have no faces",
        "m.obj:13: curves",
        "m.obj:14: unknown word \"nonsense\"",
        "m.obj:15: a face has fewer than 3 corners",
    ] {
        assert!(
            texts.iter().any(|text| text.contains(expected)),
            "{expected} not in {texts:#?}"
        );
    }
    assert_eq!(texts.len(), 8, "{texts:#?}");
    assert_eq!(loaded.scene.face_count(), 2);
}

#[test]
fn wrong_lines_are_refused_with_their_number() {
    let cases = [
        (
            "v 1 2\n",
            5,
            "the line ends where three numbers should stand",
        ),
        ("v 1 nan 2\n", 5, "\"nan\" where three numbers should stand"),
        (
            "v 1 1e999 2\n",
            5,
            "\"1e999\" where three numbers should stand",
        ),
        ("vt x\n", 5, "\"x\" where a number should stand"),
        ("f 1 2 5\n", 5, "refers to vertex 5, but 4 stand before it"),
        ("f 1 2 0\n", 5, "refers to vertex 0, but 4 stand before it"),
        (
            "f 1 2 -5\n",
            5,
            "refers to vertex -5, but 4 stand before it",
        ),
        (
            "f 1/1 2/1 3/1\n",
            5,
            "refers to texture coordinate 1, but 0 stand before it",
        ),
        (
            "vn 0 0 1\n\nf 1//1 2//1 3//2\n",
            7,
            "refers to normal 2, but 1 stand before it",
        ),
        (
            "f 1 2 3.5\n",
            5,
            "\"3.5\" where a corner such as 1, 1/2, 1//3 or 1/2/3 should stand",
        ),
        ("f 1 2 /3\n", 5, "\"/3\" where a corner"),
        (
            "f 1 2 99999999999999999999999\n",
            5,
            "refers to vertex 9223372036854775807",
        ),
        ("f \\\n1 \\\n2 x\n", 5, "\"x\" where a corner"),
    ];
    for (wrong, line, expected) in cases {
        let error = Folder::new().read("m.obj", format!("{SQUARE}{wrong}"));
        let error = error.expect_err(wrong);
        assert_eq!(
            (&error.place, error.kind()),
            (&Place::Line(line), ErrorKind::BadInput)
        );
        let message = error.to_string();
        let expected = format!("m.obj:{line}: {expected}");
        assert!(
            message.contains(&expected),
            "{message:?} does not contain {expected:?}"
        );
    }
}

#[test]
fn a_file_that_is_no_obj_is_refused() {
    let error = Folder::new()
        .read("m.obj", b"\x89PNG\r\n\x1a\n\0\0\0")
        .expect_err("a PNG");
    assert!(
        error
            .to_string()
            .contains("has no vertices; it may be no OBJ file"),
        "{error}"
    );
}

#[test]
fn long_names_cannot_be_multiplied_into_much_memory() {
    let mut text = format!("{SQUARE}o {}\n", "x".repeat(1 << 20));
    for group in 0..10_000 {
        text.push_str(&format!("g {group}\nf 1 2 3\n"));
    }
    let error = Folder::new()
        .read("m.obj", text)
        .expect_err("ten gigabytes of names");
    assert!(
        error.to_string().contains("bytes more of memory"),
        "{error}"
    );
}
