//! Laws 2 and 6 on whole scenes: maps are stored, read and composited, and pictures are compared with
//! those of scenes that were rendered as they are.

use std::io::Cursor;
use veduta::composite::composite;
use veduta::dice::{PixelGrid, coverage};
use veduta::map::file::{MapReader, write_map};
use veduta::map::{Origin, SeenScene, VisibilityMap};
use veduta::pipeline::{RenderSettings, find_visibility, render_map};
use veduta::scene::generate::{Generated, by_name};
use veduta::scene::{Mesh, MeshId, Scene};

fn stored_and_read(seen: &SeenScene) -> SeenScene {
    let bytes =
        write_map(Cursor::new(Vec::new()), seen, &Origin::default()).expect("memory takes all");
    let bytes = bytes.into_inner();
    MapReader::new(Cursor::new(bytes))
        .expect("sound")
        .check()
        .expect("sound")
}

/// Deals the faces of each object to `count` scenes, in turn or in blocks.
fn dealt(scene: &Scene, count: u32, in_turn: bool) -> Vec<Scene> {
    (0..count)
        .map(|part| {
            let mut dealt = scene.clone();
            dealt.meshes.clear();
            dealt.objects.clear();
            for object in &scene.objects {
                let mesh: &Mesh = &scene.meshes[object.mesh.0 as usize];
                let total = mesh.face_count() as u32;
                let mine: Vec<u32> = (0..total)
                    .filter(|face| {
                        let of = if in_turn {
                            face % count
                        } else {
                            face * count / total
                        };
                        of == part
                    })
                    .collect();
                if mine.is_empty() {
                    continue;
                }
                let mut object = object.clone();
                object.mesh = MeshId(dealt.meshes.len() as u32);
                object.name = format!("{}/{part}", object.name);
                dealt.objects.push(object);
                dealt.meshes.push(mesh.selected(&mine));
            }
            dealt
        })
        .collect()
}

#[test]
fn scenes_dealt_to_files_composite_to_the_whole_picture() {
    for (name, count) in [
        ("pierce", 2),
        ("balls3", 8),
        ("buildings", 3),
        ("bridge", 4),
        ("field100k", 2),
    ] {
        let Generated { scene, camera, .. } = by_name(name).expect("a scene");
        let size = [192, 128];
        let camera = camera.with_aspect(1.5);
        let settings = RenderSettings {
            width: size[0],
            height: size[1],
            ..RenderSettings::default()
        };
        let whole = find_visibility(&scene, &camera);
        let grid = PixelGrid::of_frame(size[0], size[1]);
        let expected = render_map(&scene, &whole, &settings);
        // Colours that go over a face are evaluated at the middles of its parts, and in how many parts it
        // is seen depends on what cut it.
        let tolerance = if name == "field100k" { 1e-4 } else { 1e-5 };
        // The background tells whether there is a gap or an overlap.
        let areas = |map: &VisibilityMap| {
            let mut areas = vec![0.0; grid.pixel_count()];
            coverage(map, &grid)
                .iter()
                .for_each(|row| areas[row.pixel] += row.area);
            areas
        };
        let expected_areas = areas(&whole);
        for in_turn in [true, false] {
            let maps: Vec<SeenScene> = dealt(&scene, count, in_turn)
                .iter()
                .map(|part| {
                    let seen = SeenScene::of(part, &find_visibility(part, &camera), size);
                    let read = stored_and_read(&seen);
                    assert!(read == seen, "{name}: read(write(map)) = map");
                    read
                })
                .collect();
            let all = composite(&maps).expect("of one camera");
            all.map.check().expect("sound");
            let read = stored_and_read(&all);
            assert!(read == all, "{name}: a composite is stored like any map");
            for (pixel, (found, expected)) in
                areas(&all.map).iter().zip(&expected_areas).enumerate()
            {
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{name}, pixel {pixel}: {found} and {expected}"
                );
            }
            let picture = render_map(&all.scene, &all.map, &settings);
            for (pixel, (found, expected)) in
                picture.pixels.iter().zip(&expected.pixels).enumerate()
            {
                for (found, expected) in found.iter().zip(expected) {
                    assert!(
                        (found - expected).abs() < tolerance,
                        "{name}, pixel {pixel}: {found} and {expected}"
                    );
                }
            }
        }
    }
}
