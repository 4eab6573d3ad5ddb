//! Stored maps: what writing, reading and compositing them costs beside finding what is seen.

use crate::cases::Case;
use crate::timing::{least_times, milliseconds};
use std::hint::black_box;
use std::io::Cursor;
use veduta::composite::composite;
use veduta::dice::PixelGrid;
use veduta::geometry::DVec2;
use veduta::map::file::{MapReader, write_map};
use veduta::map::{Origin, SeenScene};
use veduta::pipeline::{find_visibility, render_window};
use veduta::scene::{MeshId, Scene};

/// Rounds of measuring.
const ROUNDS: u32 = 3;

/// Times in milliseconds, and what they are of.
#[derive(Clone, Copy, Debug)]
pub struct StoredTimes {
    /// Finding what is seen of all faces, projection included.
    pub find: f64,
    /// Compositing the maps of two halves of the faces.
    pub two: f64,
    /// Compositing eight maps at once.
    pub eight: f64,
    /// Compositing eight maps, each with what there was before.
    pub chain: f64,
    /// Writing the map of all faces into memory.
    pub write: f64,
    /// Reading it.
    pub read: f64,
    /// Bytes of the file.
    pub bytes: usize,
    /// Bytes of a face that is stored.
    pub bytes_per_face: f64,
    /// The largest share of the bytes that a window of a sixteenth of the frame reads, over 49 places.
    pub window: f64,
    /// Share of the fragments that touch that window.
    pub in_window: f64,
    /// Pixels of a map that was just made, at `ZOOM` times the size.
    pub pixels: f64,
    /// Pixels of the stored map at that scale.
    pub zoom: f64,
}

/// Scale of x and of y.
const ZOOM: [f64; 2] = [1.5, 1.25];

/// Measures a case whose faces are dealt to files in blocks, as parts of a model would be.
pub fn stored_times(case: &Case) -> StoredTimes {
    let size = [case.width, case.height];
    let seen = |scene: &Scene| SeenScene::of(scene, &find_visibility(scene, &case.camera), size);
    let all = seen(&case.scene);
    let maps =
        |count: u32| -> Vec<SeenScene> { dealt(&case.scene, count).iter().map(seen).collect() };
    let (halves, eighths) = (maps(2), maps(8));
    let bytes = written(&all);
    let read =
        |bytes: &[u8]| MapReader::new(Cursor::new(bytes.to_vec())).and_then(|mut map| map.read());
    let merged = |maps: &[SeenScene]| composite(maps).expect("maps of one camera");
    let fresh = find_visibility(&case.scene, &case.camera);
    let frame = DVec2::from(ZOOM) * DVec2::new(case.width.into(), case.height.into());
    let grid = PixelGrid {
        pixels_per_frame: frame,
        ..PixelGrid::of_frame(frame.x as u32, frame.y as u32)
    };
    let [find, two, eight, chain, write, read, pixels, zoom] = least_times(
        ROUNDS,
        [
            &mut || drop(black_box(find_visibility(&case.scene, &case.camera))),
            &mut || drop(black_box(merged(&halves))),
            &mut || drop(black_box(merged(&eighths))),
            &mut || {
                let next = |sum: SeenScene, map: &SeenScene| merged(&[sum, map.clone()]);
                black_box(eighths[1..].iter().fold(eighths[0].clone(), next));
            },
            &mut || drop(black_box(written(&all))),
            &mut || drop(black_box(read(&bytes).expect("sound"))),
            &mut || drop(black_box(render_window(&case.scene, &fresh, &grid, true))),
            &mut || drop(black_box(render_window(&all.scene, &all.map, &grid, true))),
        ],
    )
    .map(milliseconds);
    let [window, in_window] = worst_window(&all, &bytes);
    StoredTimes {
        find,
        two,
        eight,
        chain,
        write,
        read,
        bytes: bytes.len(),
        bytes_per_face: bytes.len() as f64 / all.map.faces.len().max(1) as f64,
        window,
        in_window,
        pixels,
        zoom,
    }
}

/// Of the windows of a sixteenth of the frame the one that reads most: shares of the bytes, and of the
/// faces that touch it.
fn worst_window(seen: &SeenScene, bytes: &[u8]) -> [f64; 2] {
    let boxes: Vec<[DVec2; 2]> = seen
        .map
        .opaque
        .iter()
        .map(|fragment| {
            let polygon = seen.map.polygon(fragment).iter();
            polygon.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[min, max], &p| {
                [min.min(p), max.max(p)]
            })
        })
        .collect();
    let mut worst = [0.0, 0.0];
    for place in 0..49 {
        let min = DVec2::new(f64::from(place % 7), f64::from(place / 7)) / 8.0;
        let max = min + 0.25;
        let mut reader = MapReader::new(Cursor::new(bytes)).expect("sound");
        reader.read_window([min, max]).expect("sound");
        let share = reader.bytes_read() as f64 / bytes.len() as f64;
        if share > worst[0] {
            let touches = |[low, high]: &[DVec2; 2]| low.cmple(max).all() && high.cmpge(min).all();
            let inside = boxes.iter().filter(|bounds| touches(bounds)).count();
            worst = [share, inside as f64 / boxes.len() as f64];
        }
    }
    worst
}

fn written(seen: &SeenScene) -> Vec<u8> {
    let out = write_map(Cursor::new(Vec::new()), seen, &Origin::default());
    out.expect("memory takes all").into_inner()
}

/// The faces of each object, dealt to `count` scenes in blocks.
fn dealt(scene: &Scene, count: u32) -> Vec<Scene> {
    let part = |part: u32| {
        let mut dealt = scene.clone();
        dealt.meshes.clear();
        dealt.objects.clear();
        for object in &scene.objects {
            let mesh = &scene.meshes[object.mesh.0 as usize];
            let total = mesh.face_count() as u64;
            let border = |part: u32| (total * u64::from(part) / u64::from(count)) as u32;
            let faces: Vec<u32> = (border(part)..border(part + 1)).collect();
            if !faces.is_empty() {
                let mut object = object.clone();
                object.mesh = MeshId(dealt.meshes.len() as u32);
                dealt.objects.push(object);
                dealt.meshes.push(mesh.selected(&faces));
            }
        }
        dealt
    };
    (0..count).map(part).collect()
}
