use crate::{FaceId, ObjectId, PlaneId};
use veduta_geometry::{Affine, DVec2};

/// Faces projected into the image plane: convex outlines with their planes.
///
/// Parallel arrays rather than a struct for each face, because the engines run through outlines
/// and planes of millions of faces and look at the rest only where a face is seen.
///
/// Invariants, kept by [`Faces::push`]:
///
/// - outlines are convex, positively wound, of positive area, with at least three vertices, all
///   inside the frame (the unit square);
/// - two faces with a common edge have bit-equal end points there;
/// - a point of the image plane is seen on a face at the nearness of the face's plane;
/// - face ids ascend in key order: see [`FaceId`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faces {
    /// `outline_start[f]..outline_start[f + 1]` are the vertices of face `f`.
    outline_start: Vec<u32>,
    vertices: Vec<DVec2>,
    plane: Vec<PlaneId>,
    object: Vec<ObjectId>,
    /// Index of the face in its object's mesh.
    source: Vec<u32>,
    planes: Vec<Affine>,
    /// Faces that are not fully opaque; empty when all are.
    veil: Vec<bool>,
}

impl Faces {
    /// No faces.
    pub fn new() -> Self {
        Self::default()
    }

    /// Room for `faces` triangles with a plane each.
    pub fn with_capacity(faces: usize) -> Self {
        let mut outline_start = Vec::with_capacity(faces + 1);
        outline_start.push(0);
        Self {
            outline_start,
            vertices: Vec::with_capacity(3 * faces),
            plane: Vec::with_capacity(faces),
            object: Vec::with_capacity(faces),
            source: Vec::with_capacity(faces),
            planes: Vec::with_capacity(faces),
            veil: Vec::new(),
        }
    }

    /// Adds a plane.
    pub fn push_plane(&mut self, nearness: Affine) -> PlaneId {
        let id = PlaneId::from_index(self.planes.len());
        self.planes.push(nearness);
        id
    }

    /// Adds a face with the given outline, which may be wound either way.
    ///
    /// Returns `None`, and adds nothing, for an outline without area: such a face is never seen.
    pub fn push(
        &mut self,
        outline: &[DVec2],
        plane: PlaneId,
        object: ObjectId,
        source: u32,
    ) -> Option<FaceId> {
        let start = self.vertices.len();
        if veduta_geometry::signed_area(outline) > 0.0 {
            self.vertices.extend_from_slice(outline);
        } else {
            self.vertices.extend(outline.iter().rev());
            // Measured from another vertex: the last bits of a sliver's area may say otherwise now.
            let area = veduta_geometry::signed_area(&self.vertices[start..]);
            if area <= 0.0 || !area.is_finite() {
                self.vertices.truncate(start);
                return None;
            }
        }
        Some(self.end_row(plane, object, source))
    }

    /// Adds a face of another table, with what is to be said of it here.
    ///
    /// # Panics
    /// If the plane is not one of this table.
    pub fn push_row(
        &mut self,
        other: &Self,
        face: FaceId,
        plane: PlaneId,
        object: ObjectId,
        source: u32,
    ) -> FaceId {
        self.vertices.extend_from_slice(other.outline(face));
        let id = self.end_row(plane, object, source);
        if other.is_veil(face) {
            self.set_veil(id);
        }
        id
    }

    /// Adds a face whose outline was put at the end of the vertices.
    fn end_row(&mut self, plane: PlaneId, object: ObjectId, source: u32) -> FaceId {
        assert!(
            plane.index() < self.planes.len(),
            "a face needs a plane of this table"
        );
        if self.outline_start.is_empty() {
            self.outline_start.push(0);
        }
        let id = FaceId::from_index(self.plane.len());
        self.outline_start
            .push(u32::try_from(self.vertices.len()).expect("at most u32::MAX vertices"));
        self.plane.push(plane);
        self.object.push(object);
        self.source.push(source);
        if !self.veil.is_empty() {
            self.veil.push(false);
        }
        id
    }

    /// Gives `face` the plane of `other`: they are coplanar, and the smaller id is seen.
    pub fn share_plane(&mut self, face: FaceId, other: FaceId) {
        self.plane[face.index()] = self.plane[other.index()];
    }

    /// Declares that a face is not fully opaque: it hides nothing, and opaque faces hide it.
    pub fn set_veil(&mut self, face: FaceId) {
        self.veil.resize(self.plane.len(), false);
        self.veil[face.index()] = true;
    }

    /// Whether the face is not fully opaque.
    #[inline(always)]
    pub fn is_veil(&self, face: FaceId) -> bool {
        !self.veil.is_empty() && self.veil[face.index()]
    }

    /// Whether `face` is seen where it lies in one plane with `other`: a veil before an opaque face, so that
    /// a decal is seen on its wall; otherwise the smaller id.
    #[inline(always)]
    pub fn wins_tie(&self, face: FaceId, other: FaceId) -> bool {
        (!self.is_veil(face), face) < (!self.is_veil(other), other)
    }

    /// Appends all of `other`, in its order, with planes of its own.
    pub fn append(&mut self, other: &Faces) {
        if self.outline_start.is_empty() {
            self.outline_start.push(0);
        }
        let first_vertex = self.vertices.len() as u32;
        let first_plane = self.planes.len() as u32;
        u32::try_from(self.vertices.len() + other.vertices.len())
            .expect("at most u32::MAX vertices");
        self.vertices.extend_from_slice(&other.vertices);
        self.outline_start.extend(
            other
                .outline_start
                .iter()
                .skip(1)
                .map(|start| start + first_vertex),
        );
        self.plane.extend(
            other
                .plane
                .iter()
                .map(|plane| PlaneId(plane.0 + first_plane)),
        );
        self.object.extend_from_slice(&other.object);
        self.source.extend_from_slice(&other.source);
        if !self.veil.is_empty() || !other.veil.is_empty() {
            self.veil
                .resize(self.plane.len() - other.plane.len(), false);
            self.veil.extend_from_slice(&other.veil);
            self.veil.resize(self.plane.len(), false);
        }
        self.planes.extend_from_slice(&other.planes);
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.plane.len()
    }

    /// Whether there is no face.
    pub fn is_empty(&self) -> bool {
        self.plane.is_empty()
    }

    /// All ids, ascending.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = FaceId> + use<> {
        (0..self.plane.len() as u32).map(FaceId)
    }

    /// Vertices of the face's outline, positively wound.
    #[inline(always)]
    pub fn outline(&self, face: FaceId) -> &[DVec2] {
        let start = self.outline_start[face.index()] as usize;
        let end = self.outline_start[face.index() + 1] as usize;
        &self.vertices[start..end]
    }

    /// The face's plane.
    #[inline(always)]
    pub fn plane(&self, face: FaceId) -> PlaneId {
        self.plane[face.index()]
    }

    /// Nearness of a plane as an affine function of the image plane.
    #[inline(always)]
    pub fn nearness(&self, plane: PlaneId) -> &Affine {
        &self.planes[plane.index()]
    }

    /// Nearness of the face's plane.
    #[inline(always)]
    pub fn face_nearness(&self, face: FaceId) -> &Affine {
        &self.planes[self.plane[face.index()].index()]
    }

    /// The object the face belongs to.
    #[inline]
    pub fn object(&self, face: FaceId) -> ObjectId {
        self.object[face.index()]
    }

    /// Index of the face in its object's mesh.
    #[inline]
    pub fn source(&self, face: FaceId) -> u32 {
        self.source[face.index()]
    }

    /// All planes, by [`PlaneId`].
    pub fn planes(&self) -> &[Affine] {
        &self.planes
    }
}
