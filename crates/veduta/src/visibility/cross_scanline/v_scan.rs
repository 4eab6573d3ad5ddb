//! The sweep in x: from V-scanline to V-scanline through a strip.
//!
//! Slices that no other slice overlaps are left alone and come out as they went in. Only clusters
//! of overlapping slices are cut, and only between the V-scanlines where they overlap.

use super::emit::{self, Layer};
use super::h_scan::{Entering, Slice, Strip};
use super::split::{Member, Splitter};
use super::{Piece, ROUNDING, StripSeen, Trapezoid};
use veduta_map::{FaceId, Faces};

/// The sweep of one strip after another. It keeps only memory between them.
#[derive(Default)]
pub(super) struct Sweep {
    entering: Entering,
    /// Slices by where they start.
    order: Vec<u32>,
    /// The slices that meet the current V-scanline; after sorting, from top to bottom.
    active: Vec<Active>,
    /// `reach[i]`: the topmost upper bound of `active[i..]`, at both V-scanlines.
    reach: Vec<[f64; 2]>,
    /// Of each slice, whether something in front of it hides a part of it.
    hidden: Vec<bool>,
    splitter: Splitter,
    opaque: Layer,
    veils: Layer,
}

/// A slice that meets the current V-scanline.
#[derive(Clone, Copy)]
struct Active {
    slice: u32,
    /// y of the upper bound at the current V-scanline and at the next.
    top: [f64; 2],
    /// y of the lower bound, likewise.
    bottom: [f64; 2],
    /// Since where it has been alone, if it is.
    alone: Option<Alone>,
}

/// The V-scanline from which on nothing overlaps a slice, and its bounds there.
#[derive(Clone, Copy)]
struct Alone {
    left: f64,
    top: f64,
    bottom: f64,
}

impl Active {
    fn member(&self) -> Member {
        Member {
            slice: self.slice,
            top: self.top,
            bottom: self.bottom,
        }
    }

    /// What has been seen of the slice since it is alone, up to the current V-scanline at `right`.
    fn piece(&self, slice: &Slice, since: Alone, right: f64) -> Piece {
        Piece {
            face: slice.face,
            shape: Trapezoid {
                left: since.left,
                right,
                top: [since.top, self.top[0]],
                bottom: [since.bottom, self.bottom[0]],
                above: slice.top.bound,
                below: slice.bottom.bound,
            },
        }
    }
}

impl Sweep {
    /// Finds what is seen of the `members` of a strip.
    pub fn strip(&mut self, faces: &Faces, strip: Strip, members: &[FaceId]) -> StripSeen {
        self.entering.scan(faces, members, strip);
        self.start();
        let mut x = f64::NEG_INFINITY;
        let mut entered = 0;
        loop {
            self.retire(faces, x);
            if self.active.is_empty() {
                let Some(&next) = self.order.get(entered) else {
                    break;
                };
                x = self.entering.slices[next as usize].left;
            }
            entered = self.admit(entered, x);
            let next = self.next_v_scanline(entered);
            self.between_v_scanlines(faces, x, next);
            x = next;
        }
        self.finish(faces, strip)
    }

    fn start(&mut self) {
        let slices = &self.entering.slices;
        self.order.clear();
        self.order.extend(0..slices.len() as u32);
        // By index where starts are equal, so that the result is that of a stable sort.
        self.order.sort_unstable_by(|&one, &other| {
            slices[one as usize]
                .left
                .total_cmp(&slices[other as usize].left)
                .then(one.cmp(&other))
        });
        self.hidden.clear();
        self.hidden.resize(slices.len(), false);
        self.active.clear();
        self.opaque.clear();
        self.veils.clear();
    }

    /// Takes out the slices that end at `x`.
    fn retire(&mut self, faces: &Faces, x: f64) {
        let Self {
            active,
            entering,
            opaque,
            veils,
            ..
        } = self;
        active.retain_mut(|active| {
            let slice = &entering.slices[active.slice as usize];
            if slice.right > x {
                active.top[0] = active.top[1];
                active.bottom[0] = active.bottom[1];
                return true;
            }
            if let Some(since) = active.alone {
                active.top[0] = active.top[1];
                active.bottom[0] = active.bottom[1];
                layer_of(faces, slice.face, opaque, veils).push(active.piece(slice, since, x));
            }
            false
        });
    }

    /// Takes in the slices that start at `x`. Returns how many have entered by now.
    fn admit(&mut self, mut entered: usize, x: f64) -> usize {
        while let Some(&index) = self.order.get(entered) {
            let slice = &self.entering.slices[index as usize];
            if slice.left > x {
                break;
            }
            let top = slice.top.at(x);
            self.active.push(Active {
                slice: index,
                top: [top; 2],
                bottom: [slice.bottom.at(x).max(top); 2],
                alone: None,
            });
            entered += 1;
        }
        entered
    }

    /// Where the next slice starts or ends.
    fn next_v_scanline(&self, entered: usize) -> f64 {
        let start = self.order.get(entered).map_or(f64::INFINITY, |&index| {
            self.entering.slices[index as usize].left
        });
        self.active.iter().fold(start, |next, active| {
            next.min(self.entering.slices[active.slice as usize].right)
        })
    }

    /// Handles what lies between the neighbouring V-scanlines `left` and `right`.
    fn between_v_scanlines(&mut self, faces: &Faces, left: f64, right: f64) {
        for active in &mut self.active {
            let slice = &self.entering.slices[active.slice as usize];
            active.top[1] = slice.top.at(right);
            active.bottom[1] = slice.bottom.at(right).max(active.top[1]);
        }
        self.sort_active();
        self.look_ahead();
        let mut first = 0;
        while first < self.active.len() {
            let end = self.end_of_cluster(first);
            if end - first == 1 {
                self.leave_alone(faces, first, left);
            } else {
                self.split_cluster(faces, first..end, left, right);
            }
            first = end;
        }
        self.opaque.close(right);
        self.veils.close(right);
    }

    /// Sorts by the middle of the upper bound. Insertion, because little changes from one V-scanline
    /// to the next.
    fn sort_active(&mut self) {
        for index in 1..self.active.len() {
            let moved = self.active[index];
            let key = moved.top[0] + moved.top[1];
            let mut place = index;
            while place > 0 {
                let above = &self.active[place - 1];
                if above.top[0] + above.top[1] <= key {
                    break;
                }
                self.active[place] = self.active[place - 1];
                place -= 1;
            }
            self.active[place] = moved;
        }
    }

    fn look_ahead(&mut self) {
        self.reach.clear();
        self.reach.resize(self.active.len(), [f64::INFINITY; 2]);
        let mut topmost = [f64::INFINITY; 2];
        for (reach, active) in self.reach.iter_mut().zip(&self.active).rev() {
            topmost = [topmost[0].min(active.top[0]), topmost[1].min(active.top[1])];
            *reach = topmost;
        }
    }

    /// The end of the shortest run from `first` on that nothing further down overlaps.
    ///
    /// Everything above must be compared with everything below, at both ends: a steep sliver may
    /// cross several slices that do not overlap one another.
    fn end_of_cluster(&self, first: usize) -> usize {
        let mut bottom = self.active[first].bottom;
        let mut end = first + 1;
        while end < self.active.len()
            && (self.reach[end][0] < bottom[0] - ROUNDING
                || self.reach[end][1] < bottom[1] - ROUNDING)
        {
            let next = self.active[end].bottom;
            bottom = [bottom[0].max(next[0]), bottom[1].max(next[1])];
            end += 1;
        }
        end
    }

    /// The slice goes on by itself; if the piece before was cut from it, it goes on with that.
    fn leave_alone(&mut self, faces: &Faces, index: usize, left: f64) {
        let active = &mut self.active[index];
        if active.alone.is_some() {
            return;
        }
        let slice = &self.entering.slices[active.slice as usize];
        let layer = layer_of(faces, slice.face, &mut self.opaque, &mut self.veils);
        let before = layer.take(slice, left);
        active.alone = Some(match before {
            Some(shape) => Alone {
                left: shape.left,
                top: shape.top[0],
                bottom: shape.bottom[0],
            },
            None => Alone {
                left,
                top: active.top[0],
                bottom: active.bottom[0],
            },
        });
    }

    fn split_cluster(
        &mut self,
        faces: &Faces,
        cluster: std::ops::Range<usize>,
        left: f64,
        right: f64,
    ) {
        for active in &mut self.active[cluster.clone()] {
            if let Some(since) = active.alone.take() {
                let slice = &self.entering.slices[active.slice as usize];
                layer_of(faces, slice.face, &mut self.opaque, &mut self.veils)
                    .push(active.piece(slice, since, left));
            }
        }
        self.splitter.split(
            faces,
            &self.entering.slices,
            self.active[cluster].iter().map(Active::member),
            [left, right],
            &mut self.hidden,
            [&mut self.opaque, &mut self.veils],
        );
    }

    fn finish(&mut self, faces: &Faces, strip: Strip) -> StripSeen {
        // Every piece has ended, since nothing reaches to infinity.
        self.opaque.close(f64::INFINITY);
        self.veils.close(f64::INFINITY);
        let mut hidden: Vec<FaceId> = self
            .entering
            .slices
            .iter()
            .zip(&self.hidden)
            .filter_map(|(slice, &hidden)| hidden.then_some(slice.face))
            .collect();
        // The slices of a face are neighbours.
        hidden.dedup();
        let emit = |layer: &Layer| emit::pieces(faces, strip, &self.entering, layer.closed());
        StripSeen {
            opaque: emit(&self.opaque),
            veils: emit(&self.veils),
            hidden,
        }
    }
}

fn layer_of<'a>(
    faces: &Faces,
    face: FaceId,
    opaque: &'a mut Layer,
    veils: &'a mut Layer,
) -> &'a mut Layer {
    if faces.is_veil(face) { veils } else { opaque }
}
