use crate::dice::Share;
use veduta_map::FaceId;

/// Which things are seen in each pixel of a picture, and how much of it each covers. Things are
/// objects or materials; those of one name are one thing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matte {
    /// Things that are kept of a pixel.
    pub ranks: usize,
    /// `ranks` rows for each pixel, the largest area first, of equal areas the smaller thing; free
    /// ones last. Where [`Matte::most`] is at most `ranks`, the areas of a pixel sum up to its opacity.
    pub rows: Vec<Rank>,
    /// The most things that a pixel shows. Of what is beyond `ranks` the smallest is left out.
    pub most: usize,
}

/// A thing and how much of a pixel it covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rank {
    /// Row of the thing in its table, the first of that name; [`Rank::NOTHING`] for none.
    pub thing: u32,
    /// Exact area in square pixels.
    pub area: f32,
}

impl Rank {
    /// No thing.
    pub const NOTHING: u32 = u32::MAX;

    /// A row that is free.
    pub const FREE: Self = Self {
        thing: Self::NOTHING,
        area: 0.0,
    };
}

/// Ranks the things of a band's pixels; `shares` are as [`sum_by_face`](crate::dice::sum_by_face)
/// makes them. `rows`, `ranks` for each of the band's pixels, are overwritten; `sums` is a buffer.
/// Returns the most things that a pixel shows.
pub fn rank(
    shares: &[Share],
    thing_of: impl Fn(FaceId) -> u32,
    ranks: usize,
    sums: &mut Vec<(u32, f64)>,
    rows: &mut [Rank],
) -> usize {
    rows.fill(Rank::FREE);
    let mut most = 0;
    for of_pixel in shares.chunk_by(|a, b| a.pixel == b.pixel) {
        sums.clear();
        sums.extend(
            of_pixel
                .iter()
                .map(|share| (thing_of(share.face), share.area)),
        );
        // A stable sort: the shares of a thing are summed in the order of faces.
        sums.sort_by_key(|&(thing, _)| thing);
        sums.dedup_by(|next, first| {
            let same = next.0 == first.0;
            if same {
                first.1 += next.1;
            }
            same
        });
        sums.sort_by(|a, b| b.1.total_cmp(&a.1));
        most = most.max(sums.len());
        let first = of_pixel[0].pixel as usize * ranks;
        for (row, &(thing, area)) in rows[first..first + ranks].iter_mut().zip(&*sums) {
            *row = Rank {
                thing,
                area: area as f32,
            };
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta_geometry::DVec2;

    #[test]
    fn things_are_ranked_by_what_all_their_faces_cover() {
        let share = |pixel: u32, face: u32, area: f64| Share {
            pixel,
            face: FaceId(face),
            fragment: face,
            area,
            moment: DVec2::ZERO,
        };
        let shares = [
            share(0, 1, 0.25),
            share(0, 2, 0.375),
            share(0, 11, 0.25),
            share(0, 21, 0.125),
            share(2, 21, 0.5),
            share(2, 31, 0.5),
        ];
        let mut rows = vec![Rank::FREE; 3 * 2];
        // Faces of ten belong to one thing.
        let most = rank(&shares, |face| face.0 / 10, 2, &mut Vec::new(), &mut rows);
        assert_eq!(most, 3);
        let told: Vec<_> = rows.iter().map(|row| (row.thing, row.area)).collect();
        let free = (Rank::NOTHING, 0.0);
        assert_eq!(
            told,
            [(0, 0.625), (1, 0.25), free, free, (2, 0.5), (3, 0.5)],
            "the smallest of three is left out; of equals the smaller thing comes first"
        );
    }
}
