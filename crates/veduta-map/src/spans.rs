use crate::scene::Scene;
use crate::{Camera, FaceId, Faces, Fragments, SeenScene, VisibilityMap};
use std::ops::RangeInclusive;
use veduta_geometry::DVec2;

/// A visible segment of a sub-scanline.
///
/// `left < right`, both in pixels from the picture's left border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// The face seen.
    pub face: FaceId,
    /// Where the segment begins.
    pub left: f64,
    /// Where it ends.
    pub right: f64,
}

/// The spans of some sub-scanlines that follow one another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpanBand {
    /// The first of its sub-scanlines.
    pub first: u32,
    /// The spans of all, one sub-scanline after the other.
    pub spans: Vec<Span>,
    /// Where those of each end.
    pub ends: Vec<u32>,
}

impl SpanBand {
    /// The sub-scanline after its last.
    pub fn end(&self) -> u32 {
        self.first + self.ends.len() as u32
    }

    /// The spans of sub-scanline `index`, which must be one of the band's.
    #[inline]
    pub fn sub_scanline(&self, index: u32) -> &[Span] {
        let k = (index - self.first) as usize;
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.spans[start as usize..self.ends[k] as usize]
    }
}

/// What is seen along every sub-scanline of a picture: what multiscan finds, in place of a map.
///
/// Each row has sub-scanlines on its borders, which it shares with its neighbours, and others evenly
/// between them: n + 1 in all, where n is the paper's (Nakamae et al. 1989). As they are found, all rows
/// have as many, and sub-scanline `k` lies `k / n` pixels below the picture's upper border. Of a scaled
/// picture rows may have more or fewer: [`Spans::on_grid`].
///
/// Spans of a sub-scanline ascend in x and do not overlap; where there is none the background is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Spans {
    width: u32,
    height: u32,
    per_row: u32,
    /// The sub-scanline on the upper border of each row, and that on the lower border of the last.
    borders: Vec<u32>,
    /// Ascending, without gaps.
    bands: Vec<SpanBand>,
}

/// Part of a sub-scanline by which a row's border may miss it and still lie on it. Without, the last bits of
/// a scale such as 0.8 would take a sub-scanline from one row and give it to the next.
const ROUNDING: f64 = 1e-9;

/// A picture of spans cannot be enlarged further than they are close.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "with {per_row} sub-scanlines a row a picture can be made up to {per_row} times as high, not {scale} \
     times; make it with more of them, or exactly"
)]
pub struct TooFewSubScanlines {
    /// Sub-scanlines of each row as it was found.
    pub per_row: u32,
    /// How much higher the picture was to become.
    pub scale: f64,
}

impl Spans {
    /// The spans of a picture of `width` x `height` pixels with `per_row` sub-scanlines for each row.
    ///
    /// # Panics
    /// If one of these is 0, or `bands` are not the sub-scanlines from 0 to `per_row * height`.
    pub fn new(width: u32, height: u32, per_row: u32, bands: Vec<SpanBand>) -> Self {
        assert!(
            width > 0 && height > 0,
            "a picture of {width} x {height} has no pixels"
        );
        assert!(per_row > 0, "a row has at least one sub-scanline");
        let mut next = 0;
        for band in &bands {
            assert_eq!(band.first, next, "bands follow one another");
            next = band.end();
        }
        assert_eq!(next, per_row * height + 1, "all sub-scanlines are there");
        Self {
            width,
            height,
            per_row,
            borders: (0..=height).map(|row| row * per_row).collect(),
            bands,
        }
    }

    /// Width of the picture in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height of the picture in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Sub-scanlines of each row as it was found: the paper's n, and its n_0 once it is scaled.
    pub fn sub_scanlines_per_row(&self) -> u32 {
        self.per_row
    }

    /// The sub-scanlines of a row, those on both its borders included. Of a row outside the frame it is
    /// only one, without an extent along y.
    #[inline]
    pub fn lines_of_row(&self, row: u32) -> RangeInclusive<u32> {
        self.borders[row as usize]..=self.borders[row as usize + 1]
    }

    /// Number of sub-scanlines.
    pub fn line_count(&self) -> u32 {
        self.bands.last().map_or(0, SpanBand::end)
    }

    /// The sub-scanlines, some at a time.
    pub fn bands(&self) -> &[SpanBand] {
        &self.bands
    }

    /// The spans of sub-scanline `index`.
    ///
    /// # Panics
    /// If there is no such sub-scanline.
    #[inline]
    pub fn sub_scanline(&self, index: u32) -> &[Span] {
        let after = self.bands.partition_point(|band| band.first <= index);
        self.bands[after - 1].sub_scanline(index)
    }

    /// The faces seen, ascending.
    pub fn faces(&self) -> Vec<FaceId> {
        let runs = |band: &SpanBand| {
            let runs = band.spans.chunk_by(|a, b| a.face == b.face);
            runs.map(|spans| spans[0].face).collect::<Vec<_>>()
        };
        let mut faces: Vec<FaceId> = self.bands.iter().flat_map(runs).collect();
        faces.sort_unstable();
        faces.dedup();
        faces
    }

    /// Number of spans.
    pub fn len(&self) -> usize {
        self.bands.iter().map(|band| band.spans.len()).sum()
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The same picture on another grid of pixels: `frame` pixels along the width and the height of the
    /// whole, of which `width` x `height` are shown from `origin` on.
    ///
    /// Nakamae et al. (1989), "Regeneration of images with scaling": x is multiplied; along y a row
    /// takes those of the stored sub-scanlines that come to lie in it, `[n0 I / T] - [n0 I / T - n0 / T]`
    /// of them by eq. (7), where I is the row, counted from 1, and T the scale along y. It reads as if
    /// the first lay on the row's upper border and the last on its lower one, so that edges move by up
    /// to a stored sub-scanline, which is T / n0 of the new pixels.
    ///
    /// # Errors
    /// [`TooFewSubScanlines`] where a row would have none.
    pub fn on_grid(
        &self,
        frame: DVec2,
        origin: DVec2,
        [width, height]: [u32; 2],
    ) -> Result<Self, TooFewSubScanlines> {
        let last = self.line_count() - 1;
        // n_0 / T.
        let per_row = f64::from(last) / frame.y;
        if per_row < 1.0 {
            return Err(TooFewSubScanlines {
                per_row: self.per_row,
                scale: frame.y / f64::from(self.height),
            });
        }
        let border = |row: u32| {
            let line = (per_row * (f64::from(row) + origin.y) + ROUNDING).floor();
            line.clamp(0.0, f64::from(last)) as u32
        };
        let scale = frame.x / f64::from(self.width);
        let moved = |x: f64| (scale * x - origin.x).clamp(0.0, f64::from(width));
        let move_band = |band: &SpanBand| {
            let mut moved_band = SpanBand {
                first: band.first,
                ..SpanBand::default()
            };
            for line in band.first..band.end() {
                for span in band.sub_scanline(line) {
                    let (left, right) = (moved(span.left), moved(span.right));
                    if left < right {
                        let face = span.face;
                        moved_band.spans.push(Span { face, left, right });
                    }
                }
                moved_band.ends.push(moved_band.spans.len() as u32);
            }
            moved_band
        };
        Ok(Self {
            width,
            height,
            per_row: self.per_row,
            borders: (0..=height).map(border).collect(),
            bands: self.bands.iter().map(move_band).collect(),
        })
    }

    fn renumbered(&self, new_id: impl Fn(FaceId) -> FaceId) -> Self {
        let mut renumbered = self.clone();
        for span in renumbered.bands.iter_mut().flat_map(|band| &mut band.spans) {
            span.face = new_id(span.face);
        }
        renumbered
    }
}

/// What multiscan found, with what is seen of its scene: all that pictures are made of.
///
/// Normal form as of [`SeenScene`]: faces are those that spans are of.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenSpans {
    /// The camera.
    pub camera: Camera,
    /// What is seen along sub-scanlines, as it was found; not scaled.
    pub spans: Spans,
    /// The faces that spans are of.
    pub faces: Faces,
    /// What is seen.
    pub scene: Scene,
}

impl SeenSpans {
    /// What `spans` of `faces` show of `scene`, in normal form.
    ///
    /// # Panics
    /// If the spans are not of the faces, or these not of the scene.
    pub fn of(scene: &Scene, camera: &Camera, faces: Faces, spans: &Spans) -> Self {
        let shown = spans.faces();
        // Spans have no regions: that a face is seen at all is what its number stands for here.
        let map = as_whole_faces(*camera, faces, shown.iter().copied());
        let seen = SeenScene::of(scene, &map, [spans.width, spans.height]);
        let new_id = |face: FaceId| FaceId::from_index(shown.partition_point(|&f| f < face));
        Self {
            camera: *camera,
            spans: spans.renumbered(new_id),
            faces: seen.map.faces,
            scene: seen.scene,
        }
    }

    /// Its faces as if each were seen whole: the form in which tables hold them.
    pub(crate) fn as_map(&self) -> VisibilityMap {
        as_whole_faces(self.camera, self.faces.clone(), self.faces.ids())
    }
}

fn as_whole_faces(
    camera: Camera,
    faces: Faces,
    shown: impl Iterator<Item = FaceId>,
) -> VisibilityMap {
    let (mut opaque, mut veils) = (Fragments::new(), Fragments::new());
    for face in shown {
        if faces.is_veil(face) {
            veils.push_whole(face);
        } else {
            opaque.push_whole(face);
        }
    }
    VisibilityMap {
        camera,
        faces,
        opaque,
        veils,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 4 x `height` pixels, of which a face covers the two middle columns.
    fn stripe(height: u32, per_row: u32) -> Spans {
        let count = height * per_row + 1;
        let span = Span {
            face: FaceId(0),
            left: 1.0,
            right: 3.0,
        };
        let band = |lines: std::ops::Range<u32>| SpanBand {
            first: lines.start,
            spans: lines.clone().map(|_| span).collect(),
            ends: (1..=lines.len() as u32).collect(),
        };
        let bands = vec![band(0..count / 2), band(count / 2..count)];
        Spans::new(4, height, per_row, bands)
    }

    fn counts(spans: &Spans) -> Vec<u32> {
        let rows = 0..spans.height();
        rows.map(|row| spans.lines_of_row(row).count() as u32 - 1)
            .collect()
    }

    #[test]
    fn rows_take_as_many_sub_scanlines_as_equation_7_says() {
        let spans = stripe(24, 3);
        for (scale, height, expected) in [
            (1.0, 24, vec![3, 3, 3, 3, 3, 3]),
            // The paper's examples. For 0.8 it prints 3, 4, 4, 3, 4, 4, which is what comes of its equation
            // if rounding takes 15 for a little less.
            (1.2, 28, vec![2, 3, 2, 3, 2, 3]),
            (0.8, 19, vec![3, 4, 4, 4, 3, 4, 4, 4]),
            (3.0, 72, vec![1, 1, 1]),
        ] {
            let frame = DVec2::new(4.0, 24.0 * scale);
            let scaled = spans.on_grid(frame, DVec2::ZERO, [4, height]);
            let found = counts(&scaled.expect("is not too large"));
            assert_eq!(found[..expected.len()], expected, "T_y = {scale}");
            for (row, &n) in (1..).zip(&found) {
                let place = 3.0 * f64::from(row) / scale;
                let floor = |line: f64| (line + ROUNDING).floor();
                let by_paper = floor(place) - floor(place - 3.0 / scale);
                assert_eq!(f64::from(n), by_paper, "row {row} of {scale}");
            }
        }
        let error = spans.on_grid(DVec2::new(4.0, 73.0), DVec2::ZERO, [4, 73]);
        assert_eq!(error.expect_err("is too large").per_row, 3);
    }

    #[test]
    fn x_is_multiplied_and_cut_at_the_window() {
        let scaled = stripe(2, 2)
            .on_grid(DVec2::new(6.0, 2.0), DVec2::new(2.0, -1.0), [2, 3])
            .expect("is not too large");
        let span = scaled.sub_scanline(0)[0];
        // 1 to 3 becomes 1.5 to 4.5, and from 2 on 0 to 2.5, of which two pixels are shown.
        assert_eq!((span.left, span.right), (0.0, 2.0));
        // The row above the frame has no extent.
        assert_eq!(counts(&scaled), [0, 2, 2]);
        assert_eq!(scaled.len(), 5);
        let beside = scaled.on_grid(DVec2::new(2.0, 3.0), DVec2::new(2.0, 0.0), [1, 1]);
        assert!(beside.expect("is not too large").is_empty());
    }
}
