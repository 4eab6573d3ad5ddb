//! Local processing: pixels made again are, to the bit, those of a picture that is made as a whole.

use veduta::accumulate::Picture;
use veduta::dice::{PixelGrid, Region};
use veduta::map::VisibilityMap;
use veduta::pipeline::{find_visibility, render_region, render_window};
use veduta::scene::generate::by_name;
use veduta::scene::{AlphaMode, Scene};

/// A stretched grid, so that no pixel's border is a border of the frame's by chance.
fn grid() -> PixelGrid {
    PixelGrid {
        origin: [3.7, 1.2].into(),
        ..PixelGrid::of_frame(97, 71)
    }
}

fn seen(name: &str) -> (Scene, VisibilityMap) {
    let generated = by_name(name).expect("a scene");
    let camera = generated.camera.with_aspect(97.0 / 71.0);
    let map = find_visibility(&generated.scene, &camera);
    (generated.scene, map)
}

fn bits(picture: &Picture) -> Vec<[u32; 4]> {
    let pixels = picture.pixels.iter();
    pixels.map(|pixel| pixel.map(f32::to_bits)).collect()
}

/// A picture of one colour, which nothing else has.
fn blank(grid: &PixelGrid) -> Picture {
    Picture {
        width: grid.width,
        height: grid.height,
        pixels: vec![[7.0, 8.0, 9.0, 0.5]; grid.pixel_count()],
    }
}

#[test]
fn windows_made_again_are_the_whole_picture_there_and_nothing_elsewhere() {
    // Flat colours, veils, and colours that go over each face.
    for (name, opacity) in [("bridge", 1.0), ("pierce", 0.4), ("field100k", 1.0)] {
        let (mut scene, mut map) = seen(name);
        if opacity < 1.0 {
            scene.materials.iter_mut().for_each(|material| {
                material.base_color[3] = opacity;
                material.alpha_mode = AlphaMode::Blend;
            });
            map = find_visibility(&scene, &map.camera);
            assert!(!map.veils.is_empty());
        }
        let grid = grid();
        let whole = render_window(&scene, &map, &grid, false);
        let windows = [
            (10..40, 5..50),
            (0..97, 0..71),
            (96..200, 70..300),
            (50..51, 16..17),
            (30..20, 0..71),
        ];
        for (columns, rows) in windows {
            let region = Region::window(&grid, columns.clone(), rows.clone());
            let mut picture = blank(&grid);
            render_region(&scene, &map, &[], &grid, &region, false, &mut picture);
            let (found, whole, blank) = (bits(&picture), bits(&whole), bits(&blank(&grid)));
            for (pixel, found) in found.into_iter().enumerate() {
                let (column, row) = (pixel as u32 % 97, pixel as u32 / 97);
                let is_in = columns.contains(&column) && rows.contains(&row);
                assert_eq!(region.pixels()[pixel], is_in);
                let expected = if is_in { whole[pixel] } else { blank[pixel] };
                assert_eq!(
                    found, expected,
                    "{name}, {columns:?}, {rows:?}: {column}, {row}"
                );
            }
        }
    }
}

#[test]
fn objects_in_another_colour_leave_no_ghost_of_the_old() {
    let (scene, map) = seen("bridge");
    let grid = grid();
    // One after the other, each object's materials change: all of it does, and nothing else.
    let mut seen_at_all = 0;
    for object in 0..scene.objects.len() {
        let mut changed = scene.clone();
        let mesh = &mut changed.meshes[scene.objects[object].mesh.0 as usize];
        for (_, material) in &mut mesh.materials {
            let mut green = scene.material(*material).clone();
            green.base_color = [0.1, 0.9, 0.2, 1.0];
            green.emissive = [0.0, 0.3, 0.0];
            changed.materials.push(green);
            material.0 = changed.materials.len() as u32 - 1;
        }
        mesh.colors.clear();
        let shares_mesh = scene
            .objects
            .iter()
            .filter(|o| o.mesh == scene.objects[object].mesh);
        assert_eq!(shares_mesh.count(), 1, "the others keep their colours");
        let mut picture = render_window(&scene, &map, &grid, false);
        let expected = render_window(&changed, &map, &grid, false);
        let of_object = |face| map.faces.object(face).index() == object;
        let region = Region::of_faces(&map, &grid, of_object);
        render_region(&changed, &map, &[], &grid, &region, false, &mut picture);
        assert!(
            bits(&picture) == bits(&expected),
            "{}",
            scene.objects[object].name
        );
        seen_at_all += usize::from(region.count() > 0);
    }
    assert!(seen_at_all > 3, "{seen_at_all} objects are seen");
}

#[test]
fn an_object_that_moved_leaves_no_ghost_where_it_was() {
    let (before, map_before) = seen("balls3");
    let grid = grid();
    let mut after = before.clone();
    let moved = after.objects.len() - 1;
    let place = &mut after.objects[moved].world_from_object;
    *place = veduta_geometry::DMat4::from_translation([0.4, 0.1, -0.2].into()) * *place;
    let map_after = find_visibility(&after, &map_before.camera);
    let [was, is] = [&map_before, &map_after]
        .map(|map| Region::of_faces(map, &grid, |face| map.faces.object(face).index() == moved));
    let region = was.clone().or(&is);
    assert!(region.count() > was.count() && was.clone().and(&is).count() < was.count());
    let mut picture = render_window(&before, &map_before, &grid, false);
    render_region(&after, &map_after, &[], &grid, &region, false, &mut picture);
    let expected = render_window(&after, &map_after, &grid, false);
    let pairs = picture
        .pixels
        .iter()
        .flatten()
        .zip(expected.pixels.iter().flatten());
    for (found, expected) in pairs {
        // Pixels that the object never touches are those of the other map, in other pieces.
        assert!(
            (found - expected).abs() < 1e-5,
            "{found} and not {expected}"
        );
    }
}
