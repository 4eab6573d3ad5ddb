use super::Projection;
use super::lens::Ray;
use super::views::find;
use veduta_geometry::DVec2;

/// From the picture to be made into the views: the exact mapping at a point.
pub(super) struct Mapping<'a> {
    pub sources: &'a [Projection],
    pub target: &'a Projection,
}

/// Where an image point lies in a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub view: usize,
    /// Texels, with centres at whole numbers.
    pub texel: DVec2,
    /// Of `texel`, by x and by y of the image point.
    pub derivatives: [DVec2; 2],
}

impl Mapping<'_> {
    /// The place of an image point in the view that shows it best.
    pub fn place(&self, image: DVec2) -> Option<Place> {
        let ray = self.target.ray(image)?;
        let (view, at) = find(self.sources, ray.direction)?;
        Some(self.placed(view, at, &ray))
    }

    /// The place of an image point in a view, be it in its frame or not.
    pub fn place_in(&self, view: usize, image: DVec2) -> Option<Place> {
        let ray = self.target.ray(image)?;
        let at = self.sources[view].image(ray.direction)?;
        Some(self.placed(view, at, &ray))
    }

    /// Where an image point lies in a view, as texel; of those a full turn apart, the nearest to `near`.
    pub fn texel_near(&self, view: usize, image: DVec2, near: DVec2) -> Option<DVec2> {
        let at = self.sources[view].image(self.target.direction(image)?)? - 0.5;
        Some(self.nearest(view, at, near))
    }

    /// Texels of a view are continuous but where it closes around; of those that are one, the nearest to `near`.
    pub fn nearest(&self, view: usize, mut texel: DVec2, near: DVec2) -> DVec2 {
        if let Some(period) = self.sources[view].period() {
            texel.x -= ((texel.x - near.x) / period).round() * period;
        }
        texel
    }

    fn placed(&self, view: usize, at: DVec2, ray: &Ray) -> Place {
        let none = [DVec2::splat(f64::INFINITY); 2];
        // How the direction changes along the view's own x and y; what a step of the picture is in these.
        let derivatives = self.sources[view].ray(at).map_or(none, |source| {
            let [a, b] = source.derivatives;
            let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
            let determinant = aa * bb - ab * ab;
            ray.derivatives.map(|step| {
                let (sa, sb) = (step.dot(a), step.dot(b));
                DVec2::new(bb * sa - ab * sb, aa * sb - ab * sa) / determinant
            })
        });
        Place {
            view,
            texel: at - 0.5,
            derivatives,
        }
    }
}
