//! Which parts of the sides of a cube around the eye are looked at, and the views that see them.

use super::View;
use crate::reproject::cube::Side;
use veduta_geometry::DVec2;
use veduta_map::Camera;

/// A part of a side of the cube, as a camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SideView {
    /// The side.
    pub side: Side,
    /// Left top and right bottom corner of the part, where the side reaches from (0, 0) to (1, 1).
    pub window: [DVec2; 2],
    /// What is seen in it.
    pub view: View,
}

/// Windows begin and end at multiples of this share of a side, so that rounding moves no border. Less would save
/// hardly anything.
const WINDOW_STEP: f64 = 1.0 / 128.0;

/// A part of a side that is narrower is a border along which a lens's picture ends. Larger would leave parts out;
/// smaller would find sides for the sake of rounding.
const NO_EXTENT: f64 = 1e-9;

impl SideView {
    /// All of a side of the cube around an eye, whose front is that of `eye`.
    pub fn whole(eye: &Camera, side: Side) -> Self {
        Self::part(eye, side, [DVec2::ZERO, DVec2::ONE])
    }

    fn part(eye: &Camera, side: Side, window: [DVec2; 2]) -> Self {
        Self {
            side,
            window,
            view: View::square(eye, side.side_from_eye(), window),
        }
    }
}

/// The views that patches look at. `touched` finds which parts of six whole sides they touch, as
/// [`View::touched`] does for each.
///
/// `eye` tells where the eye stands, where its front is, and the near plane of all.
pub fn side_views(
    eye: &Camera,
    touched: impl FnOnce(&[View; 6]) -> [Option<[DVec2; 2]>; 6],
) -> Vec<SideView> {
    let whole = Side::ALL.map(|side| SideView::whole(eye, side).view);
    let parts = Side::ALL.into_iter().zip(touched(&whole));
    let views = parts.filter_map(|(side, part)| {
        let [min, max] = part.filter(|[min, max]| (*max - *min).min_element() > NO_EXTENT)?;
        let min = (min / WINDOW_STEP).floor() * WINDOW_STEP;
        let max = (max / WINDOW_STEP).ceil() * WINDOW_STEP;
        let whole = |corner: DVec2| corner.clamp(DVec2::ZERO, DVec2::ONE);
        Some(SideView::part(eye, side, [whole(min), whole(max)]))
    });
    views.collect()
}
