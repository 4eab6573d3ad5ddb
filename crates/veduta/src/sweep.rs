//! Along a sub-scanline: which of the segments of faces is in front, and from where to where. Multiscan
//! finds visible segments by it, and compositing those of several pictures.

use std::cmp::Ordering;
use veduta_geometry::{Affine, DVec2};
use veduta_map::FaceId;

/// What a face covers of a sub-scanline, from its [`LeftEnd`] on.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    pub face: FaceId,
    /// Where it ends, in the image plane.
    pub right: f64,
    /// Of the face's plane.
    pub nearness: Affine,
}

impl AsRef<Segment> for Segment {
    fn as_ref(&self) -> &Segment {
        self
    }
}

/// A segment's left end, for sorting; equal ends are in the order of faces.
#[derive(Clone, Copy, Debug)]
pub struct LeftEnd {
    pub x: f64,
    pub face: FaceId,
    /// Index of the segment in the table of all.
    pub slot: u32,
}

impl LeftEnd {
    #[inline]
    pub fn order(&self, other: &Self) -> Ordering {
        self.x.total_cmp(&other.x).then(self.face.cmp(&other.face))
    }
}

/// The run along one sub-scanline. Kept from one to the next to spare allocations.
#[derive(Default)]
pub struct Sweep {
    /// Slots of the segments that have begun; some may have ended unseen.
    begun: Vec<u32>,
}

/// The segment in front, and up to where that is known.
#[derive(Clone, Copy)]
struct Front {
    slot: u32,
    /// Where it came to the front.
    from: f64,
    /// Where it ends, or another comes through it first.
    until: f64,
    /// The one that comes through, if any.
    successor: Option<u32>,
}

impl Sweep {
    /// Calls `seen(face, left, right)` for each visible segment at height `y`, from left to right,
    /// in units of the image plane.
    ///
    /// At each event the front is compared with the newcomer alone; all that have begun are looked
    /// at only when the front changes. Along x slopes of successive fronts grow wherever one comes
    /// through another, so that rounding cannot make two of them alternate.
    pub fn along<S: AsRef<Segment>>(
        &mut self,
        y: f64,
        left_ends: &[LeftEnd],
        active: &[S],
        mut seen: impl FnMut(FaceId, f64, f64),
    ) {
        self.begun.clear();
        let mut front: Option<Front> = None;
        for left_end in left_ends {
            let (x, slot) = (left_end.x, left_end.slot);
            let newcomer = active[slot as usize].as_ref();
            if x >= newcomer.right {
                continue;
            }
            while let Some(past) = front.filter(|front| front.until <= x) {
                front = self.succeed(past, y, active, &mut seen);
            }
            match &mut front {
                None => {
                    // Whatever began before has ended, or it would be in front.
                    self.begun.clear();
                    self.begun.push(slot);
                    front = Some(Front {
                        slot,
                        from: x,
                        until: newcomer.right,
                        successor: None,
                    });
                }
                Some(present) => {
                    self.begun.push(slot);
                    let holder = active[present.slot as usize].as_ref();
                    if in_front(newcomer, holder, x, y) {
                        seen(holder.face, present.from, x);
                        front = Some(self.put_in_front(slot, x, y, active));
                    } else {
                        present.expect(slot, newcomer, holder, x, y, active);
                    }
                }
            }
        }
        while let Some(past) = front {
            front = self.succeed(past, y, active, &mut seen);
        }
    }

    /// Ends a front's span; the next front.
    fn succeed<S: AsRef<Segment>>(
        &mut self,
        past: Front,
        y: f64,
        active: &[S],
        seen: &mut impl FnMut(FaceId, f64, f64),
    ) -> Option<Front> {
        let x = past.until;
        seen(active[past.slot as usize].as_ref().face, past.from, x);
        if let Some(successor) = past.successor {
            return Some(self.put_in_front(successor, x, y, active));
        }
        self.begun
            .retain(|&slot| active[slot as usize].as_ref().right > x);
        let (&first, others) = self.begun.split_first()?;
        let nearest = others.iter().fold(first, |nearest, &slot| {
            let [a, b] = [slot, nearest].map(|slot| active[slot as usize].as_ref());
            if in_front(a, b, x, y) { slot } else { nearest }
        });
        Some(self.put_in_front(nearest, x, y, active))
    }

    /// Makes `slot` the front from `x` on.
    fn put_in_front<S: AsRef<Segment>>(
        &mut self,
        slot: u32,
        x: f64,
        y: f64,
        active: &[S],
    ) -> Front {
        let holder = active[slot as usize].as_ref();
        let mut front = Front {
            slot,
            from: x,
            until: holder.right,
            successor: None,
        };
        self.begun.retain(|&other| {
            let behind = active[other as usize].as_ref();
            if behind.right <= x {
                return false;
            }
            if other != slot {
                front.expect(other, behind, holder, x, y, active);
            }
            true
        });
        front
    }
}

impl Front {
    /// Notes where `behind`, which is behind `holder` at `x`, comes through it.
    #[inline]
    fn expect<S: AsRef<Segment>>(
        &mut self,
        slot: u32,
        behind: &Segment,
        holder: &Segment,
        x: f64,
        y: f64,
        active: &[S],
    ) {
        let lead = holder.nearness.minus(&behind.nearness);
        if lead.a >= 0.0 {
            return;
        }
        // A lead that rounding made negative is lost here and now.
        let crossing = (x - lead.at(DVec2::new(x, y)) / lead.a).max(x);
        if crossing >= behind.right || crossing > self.until {
            return;
        }
        if crossing < self.until {
            self.until = crossing;
            self.successor = Some(slot);
        } else if let Some(rival) = self.successor {
            // Several come through at one point: the steepest is in front right of it.
            let rival = active[rival as usize].as_ref();
            let steeper = behind.nearness.minus(&rival.nearness).a;
            if steeper > 0.0 || (steeper == 0.0 && behind.face < rival.face) {
                self.successor = Some(slot);
            }
        }
    }
}

/// Whether `a` is in front of `b` just right of `x`.
///
/// Of faces that meet at `x` the one that rises is; of faces that share a plane the smaller id.
#[inline]
fn in_front(a: &Segment, b: &Segment, x: f64, y: f64) -> bool {
    let lead = a.nearness.minus(&b.nearness);
    let ahead = lead.at(DVec2::new(x, y));
    if ahead != 0.0 {
        ahead > 0.0
    } else if lead.a != 0.0 {
        lead.a > 0.0
    } else {
        a.face < b.face
    }
}
