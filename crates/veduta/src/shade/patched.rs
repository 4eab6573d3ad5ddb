use super::{Ground, ImagePlace};
use crate::dice::{Part, PatchedBand, PatchedParts, PatchedView};
use veduta_geometry::{DVec2, DVec3};

/// Where the parts of a band of a patched picture are looked at.
pub struct PatchedPlaces<'a> {
    /// The view that they are parts of.
    pub view: &'a PatchedView<'a>,
    /// The band.
    pub band: &'a PatchedBand<'a>,
    /// Its parts in the view.
    pub parts: &'a PatchedParts,
}

impl PatchedPlaces<'_> {
    #[inline(always)]
    fn at(&self, patch: u32, point: DVec2) -> ImagePlace {
        let directions = self.band.patches[patch as usize].look(point);
        let view = self.view.view();
        let [here, along_x, along_y] = directions.map(|direction| view.homogeneous(direction));
        let at = here.truncate() / here.z;
        // Quotient rule.
        let along = |change: DVec3| (change.truncate() - at * change.z) / here.z;
        ImagePlace {
            at,
            per_column: along(along_x),
            per_row: along(along_y),
        }
    }
}

impl Ground for PatchedPlaces<'_> {
    fn of_part(&self, index: usize, part: &Part) -> ImagePlace {
        let point = self.band.corner(part.pixel) + part.centroid.as_dvec2();
        self.at(self.parts.patch_of_part(index), point)
    }

    fn of_run(&self, index: usize, pixel: u32) -> ImagePlace {
        let point = self.band.corner(pixel) + 0.5;
        self.at(self.parts.patch_of_run(index), point)
    }
}
