use std::ops::Range;
use veduta_geometry::DVec2;

/// A picture of another program: of each pixel of a grid, what is seen in it and how near.
///
/// Where in a pixel a sample lies is not known: it is taken to be all over it, with its opacity. It has its
/// colours already, so that no light changes them.
///
/// Columns rather than a struct for each sample, because there are millions of them. Invariants, kept by
/// [`Guest::new`]:
///
/// - `ends` ascends, has an entry for each pixel, and its last is the number of samples;
/// - all columns have that length, and all numbers are finite;
/// - nothing is farther than it is near, and opacities are 0 to 1;
/// - objects are rows of `objects`, or [`Guest::NO_OBJECT`].
#[derive(Clone, Debug, PartialEq)]
pub struct Guest {
    name: String,
    kind: GuestKind,
    grid: GuestGrid,
    samples: GuestSamples,
    objects: Vec<String>,
}

/// What a guest was, and so how exact it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GuestKind {
    /// A deep picture: of each pixel all that is seen in it.
    Deep,
    /// A flat picture with one depth in each pixel.
    Depth,
    /// A flat picture at one depth.
    Card,
}

impl GuestKind {
    /// How exact a composite with it is, in words for the user.
    pub fn exactness(self) -> &'static str {
        match self {
            Self::Deep => {
                "each sample as a square of its pixel: opacities exact, no place within a pixel"
            }
            Self::Depth => {
                "one depth a pixel: exact inside of surfaces, edges as a flat picture has them"
            }
            Self::Card => "exact: a plane that carries the picture",
        }
    }
}

/// The pixels of a guest on the frame, which is divided into equal ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct GuestGrid {
    /// Pixels along the width and the height of the frame, at least 1.
    pub frame: [u32; 2],
    /// Column and row of the guest's first pixel, from the frame's left top one; it may lie outside.
    pub first: [i32; 2],
    /// Columns and rows of the guest, at least 1.
    pub size: [u32; 2],
}

impl GuestGrid {
    /// The corners, left top and right bottom, of a pixel in the image plane. Neighbours have equal ones.
    #[inline]
    pub fn corners(&self, column: u32, row: u32) -> [DVec2; 2] {
        [0, 1].map(|step| DVec2::new(self.line(0, column + step), self.line(1, row + step)))
    }

    /// Where the border before column (axis 0) or row (axis 1) `index` lies.
    #[inline]
    pub fn line(&self, axis: usize, index: u32) -> f64 {
        (f64::from(self.first[axis]) + f64::from(index)) / f64::from(self.frame[axis])
    }

    /// The columns (axis 0) or rows (axis 1) that overlap what lies between two places of the image plane.
    pub fn between(&self, axis: usize, [low, high]: [f64; 2]) -> Range<u32> {
        let size = self.size[axis];
        let place = |at: f64| at * f64::from(self.frame[axis]) - f64::from(self.first[axis]);
        // Rounding may let the floor be one off; lines are compared as they are.
        let mut first = place(low).floor().clamp(0.0, f64::from(size)) as u32;
        while first < size && self.line(axis, first + 1) <= low {
            first += 1;
        }
        while first > 0 && self.line(axis, first) > low {
            first -= 1;
        }
        let mut end = (place(high).ceil().clamp(0.0, f64::from(size)) as u32).max(first);
        while end > first && self.line(axis, end - 1) >= high {
            end -= 1;
        }
        while end < size && self.line(axis, end) < high {
            end += 1;
        }
        first..end
    }

    /// Number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

/// The samples of a guest, in columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GuestSamples {
    /// Of each pixel, rows from the top, where its samples end and those of the next begin.
    pub ends: Vec<u32>,
    /// Nearness of the nearest point. Samples of a pixel come in any order.
    pub near: Vec<f64>,
    /// Nearness of the farthest point: that of the nearest for a surface, less for what fills a depth.
    pub far: Vec<f64>,
    /// Share of the light from behind that is held back, 0 to 1.
    pub opacity: Vec<f32>,
    /// Linear RGB, multiplied by the opacity.
    pub color: Vec<[f32; 3]>,
    /// Object, by its row; [`Guest::NO_OBJECT`] for none.
    pub object: Vec<u32>,
}

impl GuestSamples {
    /// Adds a sample to the pixel that is being made.
    pub fn push(&mut self, [near, far]: [f64; 2], opacity: f32, color: [f32; 3], object: u32) {
        self.near.push(near);
        self.far.push(far);
        self.opacity.push(opacity);
        self.color.push(color);
        self.object.push(object);
    }

    /// Ends the pixel that is being made.
    pub fn end_pixel(&mut self) {
        self.ends.push(self.near.len() as u32);
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.near.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.near.is_empty()
    }
}

/// Why there is no such guest.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GuestError {
    /// A side of the grid or of the frame is 0.
    #[error("it has no pixels")]
    NoPixels,
    /// The ends of pixels do not ascend to the number of samples, one for each pixel.
    #[error("its pixels do not end where its samples do")]
    Ends,
    /// Columns differ in length.
    #[error("its columns differ in length")]
    Columns,
    /// A sample is not as it may be.
    #[error("sample {sample} {what}")]
    Sample {
        /// The sample, counted from 0 through all pixels.
        sample: usize,
        /// What is wrong with it.
        what: &'static str,
    },
}

impl Guest {
    /// Belongs to no object.
    pub const NO_OBJECT: u32 = u32::MAX;

    /// Nearness of what lies behind everything.
    pub const BEHIND_ALL: f64 = f64::MIN;

    /// A guest; `name` is for messages, `objects` names what samples belong to.
    ///
    /// # Errors
    /// The first invariant that does not hold.
    pub fn new(
        name: String,
        kind: GuestKind,
        grid: GuestGrid,
        samples: GuestSamples,
        objects: Vec<String>,
    ) -> Result<Self, GuestError> {
        if grid.size.contains(&0) || grid.frame.contains(&0) {
            return Err(GuestError::NoPixels);
        }
        let count = samples.len();
        let lengths = [
            samples.far.len(),
            samples.opacity.len(),
            samples.color.len(),
            samples.object.len(),
        ];
        if lengths.iter().any(|&length| length != count) {
            return Err(GuestError::Columns);
        }
        let ends = &samples.ends;
        let ends_there = ends.last().is_some_and(|&end| end as usize == count);
        if ends.len() != grid.pixel_count() || !ends.is_sorted() || !ends_there {
            return Err(GuestError::Ends);
        }
        for sample in 0..count {
            let fail = |what| Err(GuestError::Sample { sample, what });
            let [near, far] = [samples.near[sample], samples.far[sample]];
            if !near.is_finite() || !far.is_finite() {
                return fail("has no finite nearness");
            }
            if far > near {
                return fail("is nearer at its back than at its front");
            }
            if !(0.0..=1.0).contains(&samples.opacity[sample]) {
                return fail("has an opacity beyond 0 to 1");
            }
            if !samples.color[sample]
                .iter()
                .all(|channel| channel.is_finite())
            {
                return fail("has no finite colour");
            }
            let object = samples.object[sample];
            if object != Self::NO_OBJECT && object as usize >= objects.len() {
                return fail("is of an object that is not there");
            }
        }
        Ok(Self {
            name,
            kind,
            grid,
            samples,
            objects,
        })
    }

    /// What it is called: the name of its file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it was.
    pub fn kind(&self) -> GuestKind {
        self.kind
    }

    /// Its pixels.
    pub fn grid(&self) -> &GuestGrid {
        &self.grid
    }

    /// Its samples.
    pub fn samples(&self) -> &GuestSamples {
        &self.samples
    }

    /// Names of what samples belong to.
    pub fn objects(&self) -> &[String] {
        &self.objects
    }

    /// The guest without the samples of objects whose names `keep` does not want. Samples of no object stay.
    pub fn selected(&self, keep: impl Fn(&str) -> bool) -> Self {
        let is_kept: Vec<bool> = self.objects.iter().map(|name| keep(name)).collect();
        let all = &self.samples;
        let mut samples = GuestSamples::default();
        for pixel in 0..self.grid.pixel_count() {
            for sample in self.samples_of(pixel) {
                let object = all.object[sample];
                if object == Self::NO_OBJECT || is_kept[object as usize] {
                    let depths = [all.near[sample], all.far[sample]];
                    samples.push(depths, all.opacity[sample], all.color[sample], object);
                }
            }
            samples.end_pixel();
        }
        Self {
            samples,
            ..self.clone()
        }
    }

    /// The samples of a pixel (row * columns + column).
    #[inline]
    pub fn samples_of(&self, pixel: usize) -> Range<usize> {
        let ends = &self.samples.ends;
        let start = pixel.checked_sub(1).map_or(0, |before| ends[before]);
        start as usize..ends[pixel] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> GuestGrid {
        GuestGrid {
            frame: [7, 3],
            first: [-1, 1],
            size: [4, 2],
        }
    }

    fn samples() -> GuestSamples {
        let mut samples = GuestSamples::default();
        for pixel in 0..8 {
            for k in 0..pixel % 3 {
                samples.push([2.0, 1.0], 0.5, [k as f32; 3], Guest::NO_OBJECT);
            }
            samples.end_pixel();
        }
        samples
    }

    fn guest(samples: GuestSamples) -> Result<Guest, GuestError> {
        Guest::new("a".into(), GuestKind::Deep, grid(), samples, Vec::new())
    }

    #[test]
    fn what_breaks_an_invariant_is_no_guest() {
        assert!(guest(samples()).is_ok());
        let broken = |change: fn(&mut GuestSamples)| {
            let mut samples = samples();
            change(&mut samples);
            guest(samples).expect_err("broken")
        };
        let sample = |what| GuestError::Sample { sample: 1, what };
        assert_eq!(broken(|s| s.ends[7] = 3), GuestError::Ends);
        assert_eq!(broken(|s| s.ends[2] = 9), GuestError::Ends);
        assert_eq!(broken(|s| s.far.truncate(2)), GuestError::Columns);
        assert_eq!(
            broken(|s| s.near[1] = f64::NAN),
            sample("has no finite nearness")
        );
        let backwards = sample("is nearer at its back than at its front");
        assert_eq!(broken(|s| s.far[1] = 3.0), backwards);
        assert_eq!(
            broken(|s| s.opacity[1] = 1.5),
            sample("has an opacity beyond 0 to 1")
        );
        assert_eq!(
            broken(|s| s.color[1][2] = f32::INFINITY),
            sample("has no finite colour")
        );
        assert_eq!(
            broken(|s| s.object[1] = 0),
            sample("is of an object that is not there")
        );
        let grid = GuestGrid {
            size: [0, 2],
            ..grid()
        };
        let none = Guest::new("a".into(), GuestKind::Card, grid, samples(), Vec::new());
        assert_eq!(none, Err(GuestError::NoPixels));
    }

    #[test]
    fn of_objects_that_are_not_wanted_no_sample_is_left() {
        let mut samples = GuestSamples::default();
        for pixel in 0..8 {
            for object in [0, 1, Guest::NO_OBJECT] {
                samples.push([2.0, 1.0], 0.5, [pixel as f32; 3], object);
            }
            samples.end_pixel();
        }
        let names = vec!["a/b".to_owned(), "c".to_owned()];
        let guest = Guest::new("a".into(), GuestKind::Deep, grid(), samples, names);
        let guest = guest.expect("sound").selected(|name| name != "c");
        for pixel in 0..8 {
            let objects = guest.samples_of(pixel).map(|k| guest.samples().object[k]);
            assert_eq!(objects.collect::<Vec<_>>(), [0, Guest::NO_OBJECT]);
        }
        assert_eq!(guest.objects().len(), 2);
    }

    #[test]
    fn pixels_divide_the_frame() {
        let grid = grid();
        for row in 0..2 {
            for column in 0..4 {
                let [low, high] = grid.corners(column, row);
                assert_eq!(low.x, (f64::from(column) - 1.0) / 7.0);
                assert_eq!(high.y, (f64::from(row) + 2.0) / 3.0);
                // What lies in it, and what it only touches.
                assert_eq!(grid.between(0, [low.x, high.x]), column..column + 1);
                assert_eq!(grid.between(1, [low.y, high.y]), row..row + 1);
            }
        }
        assert_eq!(grid.between(0, [0.0, 1.0]), 1..4);
        assert_eq!(grid.between(0, [0.9, 1.0]), 4..4);
        assert_eq!(grid.between(1, [0.0, 0.3]), 0..0);
    }
}
