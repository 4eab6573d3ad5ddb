//! The vertices of a tile as the camera sees them, and what of faces follows from that: files leave it out.
//!
//! Where nothing clips a face, its outline is where its corners are seen; where no other face shares its plane, that
//! follows from three corners. Both are half of what a file would else be, since the last bits of numbers do not
//! compress. They are left out only where they come out the same to the bit, and only additions, multiplications
//! and divisions are needed, which do so on every machine.

use crate::Camera;
use veduta_geometry::{Affine, DMat4, DVec2, DVec3, signed_area};

/// A tile's vertices in its order.
pub struct Projected<'a> {
    camera: &'a Camera,
    /// Object and number of each, ascending.
    rows: Vec<(u32, u32)>,
    /// In eye space.
    eye: Vec<DVec3>,
    /// In the image plane; right only for those before the eye.
    image: Vec<DVec2>,
}

impl<'a> Projected<'a> {
    /// `vertices` have their object and number, ascending, their place in the object's space, and
    /// `world_from_object` tells the place of objects.
    pub fn new<'m>(
        camera: &'a Camera,
        vertices: impl ExactSizeIterator<Item = ((u32, u32), DVec3)>,
        world_from_object: impl Fn(u32) -> &'m DMat4,
    ) -> Self {
        let count = vertices.len();
        let mut rows = Vec::with_capacity(count);
        let mut eye = Vec::with_capacity(count);
        let mut placed: Option<(u32, DMat4)> = None;
        for (row, position) in vertices {
            let (object, _) = row;
            let eye_from_object = match placed {
                Some((last, matrix)) if last == object => matrix,
                _ => camera.eye_from_world * *world_from_object(object),
            };
            placed = Some((object, eye_from_object));
            rows.push(row);
            eye.push(eye_from_object.transform_point3(position));
        }
        let image = eye.iter().map(|&point| camera.image_from_eye(point));
        Self {
            camera,
            rows,
            image: image.collect(),
            eye,
        }
    }

    /// The vertices in the image plane.
    pub fn image(&self) -> &[DVec2] {
        &self.image
    }

    /// Overwrites `rows` with those of a face's corners; `false` if one is not in the tile, or there are not three.
    pub fn find(
        &self,
        object: u32,
        corners: impl Iterator<Item = u32>,
        rows: &mut Vec<usize>,
    ) -> bool {
        rows.clear();
        for vertex in corners {
            match self.rows.binary_search(&(object, vertex)) {
                Ok(row) => rows.push(row),
                Err(_) => return false,
            }
        }
        rows.len() >= 3
    }

    /// Overwrites `outline` with that of a face with corners in these rows that nothing clips, wound as tables of faces
    /// have it.
    pub fn outline(&self, corners: &[usize], outline: &mut Vec<DVec2>) {
        outline.clear();
        outline.extend(corners.iter().map(|&row| self.image[row]));
        let is_turned = signed_area(outline) <= 0.0;
        if is_turned {
            outline.reverse();
        }
    }

    /// The nearness of the plane through the first three of these corners. `None` where they span none, or it is
    /// seen edge-on.
    pub fn nearness(&self, corners: &[usize]) -> Option<Affine> {
        let &[p, q, r] = corners.first_chunk::<3>()?;
        let [p, q, r] = [p, q, r].map(|row| self.eye[row]);
        self.camera.nearness_of_plane(p, (q - p).cross(r - p))
    }
}

/// Whether both are the same bits: zeros have signs.
pub fn same_points(a: &[DVec2], b: &[DVec2]) -> bool {
    let bits = |point: &DVec2| [point.x.to_bits(), point.y.to_bits()];
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| bits(a) == bits(b))
}

/// Whether both are the same bits.
pub fn same_nearness(a: &Affine, b: &Affine) -> bool {
    let bits = |plane: &Affine| [plane.a, plane.b, plane.c].map(f64::to_bits);
    bits(a) == bits(b)
}
