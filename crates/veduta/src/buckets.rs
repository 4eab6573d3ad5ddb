//! Things sorted into numbered buckets, by counting: linear, and in order within each bucket.

use std::ops::Range;

/// The indices of things, by bucket; a thing may be in several.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Buckets {
    /// `items[starts[b]..starts[b + 1]]` are in bucket `b`, ascending.
    starts: Vec<usize>,
    items: Vec<u32>,
}

impl Buckets {
    /// Sorts things into `count` buckets: thing `i` into each of `buckets_of[i]`.
    ///
    /// # Panics
    /// If a range goes beyond the buckets.
    pub fn new(count: usize, buckets_of: &[Range<u32>]) -> Self {
        let mut starts = vec![0; count + 1];
        for bucket in buckets_of.iter().cloned().flatten() {
            starts[bucket as usize + 1] += 1;
        }
        for bucket in 0..count {
            starts[bucket + 1] += starts[bucket];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[count]];
        for (item, buckets) in buckets_of.iter().enumerate() {
            for bucket in buckets.clone() {
                let place = &mut next[bucket as usize];
                items[*place] = item as u32;
                *place += 1;
            }
        }
        Self { starts, items }
    }

    /// Number of buckets.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// What is in a bucket, ascending.
    pub fn of(&self, bucket: usize) -> &[u32] {
        &self.items[self.starts[bucket]..self.starts[bucket + 1]]
    }
}
