//! What stands in for [`draco`](super::draco) in builds without it: no primitive is compressed. One
//! that may be read uncompressed is; a file that requires the extension is refused.

use super::Problem;
use super::accessor::Decompressed;
use crate::read::budget::Budget;

/// There is none.
pub enum Decoded {}

impl Decoded {
    pub fn new(_: &[u8], _: &Budget) -> Result<Option<Self>, Problem> {
        Ok(None)
    }

    pub fn vertices(&self) -> u64 {
        match *self {}
    }

    pub fn triangles(&self) -> u64 {
        match *self {}
    }

    pub fn corners(&self) -> Vec<u32> {
        match *self {}
    }

    pub fn attribute(&self, _: u64, _: &mut Budget) -> Result<Option<Decompressed>, Problem> {
        match *self {}
    }
}
