//! Compositing of what multiscan found, sub-scanline by sub-scanline.

use super::CompositeError;
use super::unite::{UnitedScenes, refuse_other_views};
use crate::scene::PlaneGroups;
use crate::sweep::{LeftEnd, Segment, Sweep};
use rayon::prelude::*;
use veduta_map::scene::Scene;
use veduta_map::{FaceId, Faces, SeenSpans, Span, SpanBand, Spans};

/// What is seen of all pictures together, along the sub-scanlines that they have in common: Nakamae et al.
/// (1989), "Compositing 3D images", of all at once. The three cases of a sample span are those of the
/// sweep that finds spans: what stays in front, what begins in front, what comes through.
///
/// Spans are compared by the planes of their faces, so that a composite of composites is that of all.
/// Camera is the first picture's, lights those of all.
///
/// # Errors
/// [`CompositeError`] for pictures of different cameras, places in the world, sizes or numbers of
/// sub-scanlines.
pub fn composite_spans(pictures: &[SeenSpans]) -> Result<SeenSpans, CompositeError> {
    let views = pictures
        .iter()
        .map(|seen| (&seen.camera, &seen.scene.world));
    refuse_other_views(views)?;
    let first = &pictures[0];
    for (index, other) in pictures.iter().enumerate().skip(1) {
        let sampling = |spans: &Spans| {
            let (width, height) = (spans.width(), spans.height());
            (width, height, spans.sub_scanlines_per_row())
        };
        let (expected, found) = (sampling(&first.spans), sampling(&other.spans));
        if expected != found {
            let words =
                |(width, height, n)| format!("{width} x {height} pixels with {n} sub-scanlines");
            let difference = format!("{} instead of {}", words(found), words(expected));
            return Err(CompositeError::OtherSampling { index, difference });
        }
    }
    let scenes: Vec<&Scene> = pictures.iter().map(|seen| &seen.scene).collect();
    let united = UnitedScenes::of(&scenes);
    let tables: Vec<&Faces> = pictures.iter().map(|seen| &seen.faces).collect();
    let (mut faces, new_ids) = united.faces(&tables);
    let scene = united.into_scene();
    PlaneGroups::of(&scene).share_planes(&mut faces);

    let merged: Vec<SpanBand> = bands_of(first.spans.line_count())
        .into_par_iter()
        .map_init(Merger::default, |merger, [start, end]| {
            let mut band = SpanBand {
                first: start,
                ..SpanBand::default()
            };
            for line in start..end {
                merger.merge(pictures, &faces, &new_ids, line, &mut band.spans);
                let end =
                    u32::try_from(band.spans.len()).expect("at most u32::MAX spans in a band");
                band.ends.push(end);
            }
            band
        })
        .collect();
    let (width, height, n) = (
        first.spans.width(),
        first.spans.height(),
        first.spans.sub_scanlines_per_row(),
    );
    let spans = Spans::new(width, height, n, merged);
    Ok(SeenSpans::of(&scene, &first.camera, faces, &spans))
}

/// Sub-scanlines that a task merges.
const LINES_PER_BAND: u32 = 64;

fn bands_of(lines: u32) -> Vec<[u32; 2]> {
    let starts = (0..lines).step_by(LINES_PER_BAND as usize);
    let band = |start| [start, lines.min(start + LINES_PER_BAND)];
    starts.map(band).collect()
}

/// Merges a sub-scanline at a time. Kept from one to the next to spare allocations.
#[derive(Default)]
struct Merger {
    segments: Vec<Segment>,
    left_ends: Vec<LeftEnd>,
    sweep: Sweep,
}

impl Merger {
    fn merge(
        &mut self,
        pictures: &[SeenSpans],
        faces: &Faces,
        new_ids: &[Vec<FaceId>],
        line: u32,
        merged: &mut Vec<Span>,
    ) {
        self.segments.clear();
        self.left_ends.clear();
        let spans = &pictures[0].spans;
        let width = f64::from(spans.width());
        for (picture, new_ids) in pictures.iter().zip(new_ids) {
            for span in picture.spans.sub_scanline(line) {
                let face = new_ids[span.face.index()];
                self.left_ends.push(LeftEnd {
                    x: span.left / width,
                    face,
                    slot: self.segments.len() as u32,
                });
                self.segments.push(Segment {
                    face,
                    right: span.right / width,
                    nearness: *faces.face_nearness(face),
                });
            }
        }
        self.left_ends.sort_unstable_by(LeftEnd::order);
        let y = f64::from(line) / f64::from(spans.line_count() - 1);
        let start = merged.len();
        self.sweep
            .along(y, &self.left_ends, &self.segments, |face, left, right| {
                let (left, right) = (left * width, right * width);
                // What a span of another picture had cut in two for nothing is one again.
                if let Some(last) = merged[start..].last_mut()
                    && last.face == face
                    && last.right == left
                {
                    last.right = right;
                } else if left < right {
                    merged.push(Span { face, left, right });
                }
            });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::generate::{Generated, by_name};
    use crate::visibility::{multiscan, project};
    use veduta_map::scene::MeshId;

    fn found(scene: &Scene, made: &Generated, n: u32) -> SeenSpans {
        let faces = project(scene, &made.camera);
        let spans = multiscan::find_spans(&faces, 90, 60, n);
        SeenSpans::of(scene, &made.camera, faces, &spans)
    }

    /// The faces of each object dealt to `count` scenes in turn.
    fn dealt(scene: &Scene, count: u32) -> Vec<Scene> {
        let part = |part: u32| {
            let mut dealt = scene.clone();
            dealt.meshes.clear();
            dealt.objects.clear();
            for object in &scene.objects {
                let mesh = &scene.meshes[object.mesh.0 as usize];
                let faces = 0..mesh.face_count() as u32;
                let mine: Vec<u32> = faces.filter(|face| face % count == part).collect();
                if !mine.is_empty() {
                    let mut object = object.clone();
                    object.mesh = MeshId(dealt.meshes.len() as u32);
                    object.name = format!("{}/{part}", object.name);
                    dealt.objects.push(object);
                    dealt.meshes.push(mesh.selected(&mine));
                }
            }
            dealt
        };
        (0..count).map(part).collect()
    }

    /// Length along which each of two pictures shows something else, over all sub-scanlines. Of faces what
    /// tells them is their first corner.
    fn difference(a: &SeenSpans, b: &SeenSpans) -> f64 {
        let corner = |seen: &SeenSpans, face: FaceId| {
            let mesh = seen.scene.mesh_of(seen.faces.object(face));
            let first = mesh.corners_of(seen.faces.source(face)).next();
            mesh.positions[first.expect("three corners") as usize]
        };
        let mut sum = 0.0;
        for line in 0..a.spans.line_count() {
            let of_line =
                |seen: &SeenSpans| -> Vec<Span> { seen.spans.sub_scanline(line).to_vec() };
            let (of_a, of_b) = (of_line(a), of_line(b));
            let mut common = 0.0;
            for span in &of_a {
                for other in &of_b {
                    let length = span.right.min(other.right) - span.left.max(other.left);
                    if length > 0.0 && corner(a, span.face) == corner(b, other.face) {
                        common += length;
                    }
                }
            }
            let length = |spans: &[Span]| spans.iter().map(|s| s.right - s.left).sum::<f64>();
            sum += length(&of_a) + length(&of_b) - 2.0 * common;
        }
        sum
    }

    #[test]
    fn pictures_of_parts_composite_to_the_picture_of_all() {
        for (name, count) in [("pierce", 2), ("balls3", 5), ("buildings", 3), ("soup", 4)] {
            let made = by_name(name).expect("a generated scene");
            let parts = dealt(&made.scene, count);
            let mut all = made.scene.clone();
            all.meshes = parts.iter().flat_map(|part| part.meshes.clone()).collect();
            all.objects.clear();
            for object in parts.iter().flat_map(|part| &part.objects) {
                let mut object = object.clone();
                object.mesh = MeshId(all.objects.len() as u32);
                all.objects.push(object);
            }
            let whole = found(&all, &made, 3);
            let pictures: Vec<SeenSpans> = parts.iter().map(|p| found(p, &made, 3)).collect();
            let together = composite_spans(&pictures).expect("of one camera");
            let (first, rest) = pictures.split_at(1);
            let grouped = [
                composite_spans(rest).expect("of one camera"),
                first[0].clone(),
            ];
            let grouped = composite_spans(&grouped).expect("of one camera");
            for (how, found) in [("at once", &together), ("grouped", &grouped)] {
                let off = difference(found, &whole);
                assert!(off < 1e-6, "{name} {how}: {off} pixels differ");
            }
        }
    }

    #[test]
    fn pictures_sampled_otherwise_are_refused() {
        let made = by_name("pierce").expect("a generated scene");
        let pictures = [found(&made.scene, &made, 3), found(&made.scene, &made, 4)];
        let error = composite_spans(&pictures).expect_err("3 and 4").to_string();
        assert!(
            error.contains("picture 1") && error.contains("with 4 sub-scanlines"),
            "{error}"
        );
    }
}
