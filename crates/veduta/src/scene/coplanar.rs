//! Faces in one plane: a decal on a wall, two tessellations of a floor, a face given twice.
//!
//! Their nearness differs by rounding only, so comparing it would let now one, now the other win
//! (z-fighting). Faces that lie in the plane of an earlier one, as far as their coordinates can tell,
//! are given that face's plane; then the order of faces decides, everywhere alike.
//!
//! Planes are looked up by quantised normal and distance. Most faces are alone in their slot, or with
//! the other half of their quadrilateral, which cannot overlap them. A table of flags tells so in one
//! pass over all faces; only the others are compared.

use crate::scene::{Mesh, Object, Scene};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering::Relaxed};
use veduta_geometry::{DMat4, DVec3};
use veduta_map::{FaceId, Faces};

/// Deviation from a plane, relative to the largest coordinate of a face, that counts as rounding:
/// four units in the last place of single precision, in which most models are stored. More would
/// flatten true relief; less would leave z-fighting where models were converted or transformed.
const ROUNDING: f64 = 4.0 * 0.5 / (1 << 23) as f64;

/// Width of a slot: of a component of the unit normal, and of the distance from the origin as a share
/// of the scene's extent.
const NORMAL_SLOT: f64 = 1.0 / (1 << 10) as f64;
const DISTANCE_SLOT: f64 = 1.0 / (1 << 12) as f64;

/// Faces whose plane rounding leaves open by more than this share of a slot are left alone.
const SURE: f64 = 1.0 / 16.0;

/// More than the number of slots on either side of zero: the distance of a plane is at most twice the
/// scene's extent.
const SHIFT: f64 = (1 << 20) as f64;

/// Flags for each face: with fewer, more faces are compared that only share a flag by chance.
const CLAIMS_PER_FACE: usize = 16;

/// Flags of a slot: that a face lies in it, that more than one does.
const CLAIMED: u8 = 1;
const CLAIMED_AGAIN: u8 = 2;

/// The end of a list.
const NO_MORE: u32 = u32::MAX;

/// Faces and vertices a task looks at at a time; even, since halves of quadrilaterals go together.
const FACES_PER_TASK: u32 = 16 * 1024;

/// A face of the scene: index of its object, index in the object's mesh.
pub type FaceIndex = (u32, u32);

/// Which faces of a scene share a plane. It depends on no camera, so that one serves all views.
#[derive(Clone, Debug, Default)]
pub struct PlaneGroups {
    /// Pairs of a face and the first face of its plane, for planes with more than one face; ascending.
    pairs: Vec<(FaceIndex, FaceIndex)>,
}

impl PlaneGroups {
    /// Finds the faces that may overlap in one plane.
    ///
    /// Faces so small that rounding leaves their normal open by more than a slot's width are left
    /// alone: nothing can be said of their plane.
    pub fn of(scene: &Scene) -> Self {
        let objects = scene.objects.iter();
        let placed: Vec<PlacedMesh> = objects
            .map(|object| PlacedMesh::new(scene, object))
            .collect();
        let slots = Slots::for_meshes(&placed);
        let contested = contested_faces(&placed, &slots);
        let pairs = pairs_among(&placed, &slots, &contested);
        Self { pairs }
    }

    /// The same among some faces of several maps: `faces` ascend, each with the number of its map, and
    /// `meshes` are those of the objects and where they stand in the world.
    ///
    /// Faces of one map know their planes already; those are mentioned only where a face of another map
    /// may share them.
    pub(crate) fn among_maps(meshes: &[(&Mesh, DMat4)], faces: &[(FaceIndex, u32)]) -> Self {
        let meshes = meshes.iter();
        let placed: Vec<PlacedMesh> = meshes
            .map(|&(mesh, world_from_object)| PlacedMesh {
                mesh,
                world_from_object,
            })
            .collect();
        let slots = Slots::for_meshes(&placed);
        let contested = contested_by_maps(&placed, &slots, faces);
        let pairs = pairs_among(&placed, &slots, &contested);
        Self { pairs }
    }

    /// Pairs of a face and the first face of its plane, for planes with more than one face; ascending.
    pub fn pairs(&self) -> &[(FaceIndex, FaceIndex)] {
        &self.pairs
    }

    /// The pairs of an object's faces.
    pub fn of_object(&self, object: u32) -> &[(FaceIndex, FaceIndex)] {
        let start = self.pairs.partition_point(|pair| pair.0.0 < object);
        let end = self.pairs.partition_point(|pair| pair.0.0 <= object);
        &self.pairs[start..end]
    }

    /// Gives the faces of each group the plane of the first of them that is in the table.
    pub fn share_planes(&self, faces: &mut Faces) {
        if self.pairs.is_empty() {
            return;
        }
        let mut first_seen: HashMap<FaceIndex, FaceId> = HashMap::new();
        let mut pairs = self.pairs.iter().peekable();
        let mut object = None;
        for face in faces.ids() {
            let index = (faces.object(face).0, faces.source(face));
            // Within an object faces and pairs ascend alike.
            if object != Some(index.0) {
                object = Some(index.0);
                pairs = self.of_object(index.0).iter().peekable();
            }
            while pairs.next_if(|pair| pair.0 < index).is_some() {}
            if let Some(&(_, group)) = pairs.next_if(|pair| pair.0 == index) {
                faces.share_plane(face, *first_seen.entry(group).or_insert(face));
            }
        }
    }
}

/// The faces that are not alone in their slot, ascending; some by chance.
fn contested_faces(placed: &[PlacedMesh], slots: &Slots) -> Vec<FaceIndex> {
    let face_count: usize = placed.iter().map(|object| object.mesh.face_count()).sum();
    let claims: Vec<AtomicU8> = (0..(CLAIMS_PER_FACE * face_count).next_power_of_two())
        .map(|_| AtomicU8::new(0))
        .collect();
    let claims_of = |slot: &Slot| &claims[hash(slot) as usize & (claims.len() - 1)];
    let tasks: Vec<(u32, Range<u32>)> = placed
        .iter()
        .zip(0..)
        .flat_map(|(object, index)| {
            let count = object.mesh.face_count() as u32;
            let starts = (0..count).step_by(FACES_PER_TASK as usize);
            starts.map(move |start| (index, start..(start + FACES_PER_TASK).min(count)))
        })
        .collect();

    tasks.par_iter().for_each(|(object, faces)| {
        let claim = |_, plane: &Plane| {
            slots.of(plane, |slot| {
                let claims = claims_of(&slot);
                if claims.load(Relaxed) & CLAIMED_AGAIN == 0
                    && claims.fetch_or(CLAIMED, Relaxed) & CLAIMED != 0
                {
                    claims.fetch_or(CLAIMED_AGAIN, Relaxed);
                }
            });
        };
        placed[*object as usize].for_each_plane(faces.clone(), slots, claim);
    });
    let contested = tasks.par_iter().map(|(object, faces)| {
        let mut contested = Vec::new();
        let look = |faces: Range<u32>, plane: &Plane| {
            let mut is_contested = false;
            slots.of(plane, |slot| {
                is_contested |= claims_of(&slot).load(Relaxed) & CLAIMED_AGAIN != 0;
            });
            if is_contested {
                contested.extend(faces.map(|face| (*object, face)));
            }
        };
        placed[*object as usize].for_each_plane(faces.clone(), slots, look);
        contested
    });
    contested.collect::<Vec<_>>().concat()
}

/// Of `faces`, those that are in a slot with one of another map, ascending; some by chance.
fn contested_by_maps(
    placed: &[PlacedMesh],
    slots: &Slots,
    faces: &[(FaceIndex, u32)],
) -> Vec<FaceIndex> {
    const NOBODY: u32 = u32::MAX;
    const SEVERAL: u32 = u32::MAX - 1;
    let claims: Vec<AtomicU32> = (0..(CLAIMS_PER_FACE * faces.len()).next_power_of_two())
        .map(|_| AtomicU32::new(NOBODY))
        .collect();
    let last = claims.len() - 1;
    // Of each face in turn, its number in `faces` and a claim on one of its slots.
    let tasks = faces.par_chunks(FACES_PER_TASK as usize);
    let claimed: Vec<Vec<(u32, u32)>> = tasks
        .enumerate()
        .map(|(task, faces)| {
            let mut claimed = Vec::with_capacity(faces.len());
            for (&((object, face), map), row) in faces.iter().zip(task as u32 * FACES_PER_TASK..) {
                let Some(plane) = placed[object as usize].plane_of(face, slots) else {
                    continue;
                };
                slots.of(&plane, |slot| {
                    let claim = hash(&slot) as usize & last;
                    claimed.push((row, claim as u32));
                    let first = claims[claim].compare_exchange(NOBODY, map, Relaxed, Relaxed);
                    if first.is_err_and(|before| before != map) {
                        claims[claim].store(SEVERAL, Relaxed);
                    }
                });
            }
            claimed
        })
        .collect();
    let mut contested: Vec<u32> = claimed
        .iter()
        .flatten()
        .filter(|&&(_, claim)| claims[claim as usize].load(Relaxed) == SEVERAL)
        .map(|&(row, _)| row)
        .collect();
    contested.dedup();
    contested.iter().map(|&row| faces[row as usize].0).collect()
}

/// Pairs of a face and the first face of its plane among `faces`, for planes with more than one face;
/// ascending.
fn pairs_among(
    placed: &[PlacedMesh],
    slots: &Slots,
    faces: &[FaceIndex],
) -> Vec<(FaceIndex, FaceIndex)> {
    let planes: Vec<(FaceIndex, Plane)> = faces
        .iter()
        .filter_map(|&(object, face)| {
            let plane = placed[object as usize].plane_of(face, slots)?;
            Some(((object, face), plane))
        })
        .collect();
    // First faces by slot, as lists: of each its row in `planes`, and the next of the list.
    let mut heads = vec![NO_MORE; (4 * planes.len()).next_power_of_two()];
    let last_head = heads.len() - 1;
    let head_of = |slot: &Slot| hash(slot) as usize & last_head;
    let mut lists: Vec<(u32, u32)> = Vec::new();
    let mut pairs = Vec::new();
    for (row, (face, plane)) in planes.iter().enumerate() {
        let (object, index) = *face;
        let mut first: Option<u32> = None;
        slots.of(plane, |slot| {
            let mut at = heads[head_of(&slot)];
            while at != NO_MORE {
                let (other, next) = lists[at as usize];
                let plane_of_other = &planes[other as usize].1;
                if placed[object as usize].lies_in(index, plane, plane_of_other) {
                    first = Some(first.map_or(other, |first| first.min(other)));
                }
                at = next;
            }
        });
        if let Some(first) = first {
            pairs.push((*face, planes[first as usize].0));
        } else {
            slots.of(plane, |slot| {
                let head = &mut heads[head_of(&slot)];
                lists.push((row as u32, *head));
                *head = lists.len() as u32 - 1;
            });
        }
    }
    // The first faces share their plane too.
    let mut firsts: Vec<FaceIndex> = pairs.iter().map(|pair| pair.1).collect();
    firsts.sort_unstable();
    firsts.dedup();
    pairs.extend(firsts.into_iter().map(|first| (first, first)));
    pairs.sort_unstable();
    pairs
}

/// An object's mesh in the world.
struct PlacedMesh<'a> {
    mesh: &'a Mesh,
    world_from_object: DMat4,
}

impl<'a> PlacedMesh<'a> {
    fn new(scene: &'a Scene, object: &Object) -> Self {
        Self {
            mesh: &scene.meshes[object.mesh.0 as usize],
            world_from_object: object.world_from_object,
        }
    }

    fn position(&self, vertex: u32) -> DVec3 {
        let position = self.mesh.positions[vertex as usize];
        self.world_from_object.transform_point3(position)
    }

    /// The largest coordinate.
    fn extent(&self) -> f64 {
        let sizes = (0..self.mesh.positions.len() as u32)
            .into_par_iter()
            .with_min_len(FACES_PER_TASK as usize)
            .map(|vertex| self.position(vertex).abs().max_element());
        sizes.reduce(|| 0.0, f64::max)
    }

    fn plane_of(&self, face: u32, slots: &Slots) -> Option<Plane> {
        let triangle = self.mesh.triangles[self.mesh.triangles_of(face).start];
        Plane::of(triangle.map(|vertex| self.position(vertex)), slots)
    }

    /// The planes of `faces` that are sure; once for the two halves of a quadrilateral, which are one
    /// after the other in most files.
    fn for_each_plane(
        &self,
        faces: Range<u32>,
        slots: &Slots,
        mut visit: impl FnMut(Range<u32>, &Plane),
    ) {
        let mut next = faces.start;
        while next < faces.end {
            let face = next;
            next += 1;
            let Some(plane) = self.plane_of(face, slots) else {
                continue;
            };
            if next < faces.end
                && let Some(corner) = self.corner_beyond_shared_edge(face, next)
                && plane.is_near(self.position(corner), plane.tolerance)
            {
                next += 1;
            }
            visit(face..next, &plane);
        }
    }

    /// Whether all of a face, whose plane is `own`, lies in `plane`.
    fn lies_in(&self, face: u32, own: &Plane, plane: &Plane) -> bool {
        let tolerance = own.tolerance.max(plane.tolerance);
        let mut corners = self.mesh.corners_of(face);
        corners.all(|corner| plane.is_near(self.position(corner), tolerance))
    }

    /// The corner of the triangle `other` that lies across the edge that it shares with `face`, if both
    /// are triangles with an edge in common, run through in opposite directions: then, in one plane,
    /// they do not overlap. Vertices need not be shared: flat shading gives each face its own.
    fn corner_beyond_shared_edge(&self, face: u32, other: u32) -> Option<u32> {
        let [p, q, r] = self.only_triangle_of(face)?;
        let [a, b, c] = self.only_triangle_of(other)?;
        let is_same = |a: u32, b: u32| {
            a == b || self.mesh.positions[a as usize] == self.mesh.positions[b as usize]
        };
        for (from, to) in [(p, q), (q, r), (r, p)] {
            for (start, end, corner) in [(a, b, c), (b, c, a), (c, a, b)] {
                if is_same(from, end) && is_same(to, start) {
                    return Some(corner);
                }
            }
        }
        None
    }

    fn only_triangle_of(&self, face: u32) -> Option<[u32; 3]> {
        let range = self.mesh.triangles_of(face);
        (range.len() == 1).then(|| self.mesh.triangles[range.start])
    }
}

/// A face's plane, and how sure it is.
struct Plane {
    origin: DVec3,
    normal: DVec3,
    distance: f64,
    /// How far a point may lie off the plane by rounding.
    tolerance: f64,
    /// The same for the components of the normal and for the distance.
    normal_tolerance: f64,
    distance_tolerance: f64,
}

impl Plane {
    fn of(corners: [DVec3; 3], slots: &Slots) -> Option<Self> {
        let [p, q, r] = corners;
        let (u, v) = (q - p, r - p);
        let cross = u.cross(v);
        let longest_squared = u
            .length_squared()
            .max(v.length_squared())
            .max((r - q).length_squared());
        let largest = p.abs().max(q.abs()).max(r.abs()).max_element();
        let tolerance = ROUNDING * largest;
        // What fine meshes are made of is told without a root.
        let most = SURE * NORMAL_SLOT;
        if tolerance * tolerance * longest_squared >= most * most * cross.length_squared() {
            return None;
        }
        let twice_area = cross.length();
        let normal_tolerance = tolerance * longest_squared.sqrt() / twice_area;
        let distance_tolerance = tolerance + normal_tolerance * largest;
        if distance_tolerance >= SURE * slots.distance {
            return None;
        }
        // Of the two normals the one whose largest component is positive.
        let normal = cross / twice_area;
        let size = normal.abs();
        let largest = (0..3)
            .max_by(|&a, &b| size[a].total_cmp(&size[b]))
            .unwrap_or(0);
        let normal = if normal[largest] < 0.0 {
            -normal
        } else {
            normal
        };
        Some(Self {
            origin: p,
            normal,
            distance: normal.dot(p),
            tolerance,
            normal_tolerance,
            distance_tolerance,
        })
    }

    fn is_near(&self, point: DVec3, tolerance: f64) -> bool {
        self.normal.dot(point - self.origin).abs() <= tolerance
    }
}

/// A quantised plane.
type Slot = [i64; 4];

#[derive(Clone, Copy)]
struct Slots {
    distance: f64,
}

impl Slots {
    fn for_meshes(placed: &[PlacedMesh]) -> Self {
        let extent = placed.iter().map(PlacedMesh::extent).fold(0.0, f64::max);
        Self {
            distance: (extent * DISTANCE_SLOT).max(f64::MIN_POSITIVE),
        }
    }

    /// The slots that a plane may be in: more than one where it is near the border of slots.
    fn of(&self, plane: &Plane, mut visit: impl FnMut(Slot)) {
        let values = [
            plane.normal.x,
            plane.normal.y,
            plane.normal.z,
            plane.distance,
        ];
        let widths = [NORMAL_SLOT, NORMAL_SLOT, NORMAL_SLOT, self.distance];
        let [n, d] = [plane.normal_tolerance, plane.distance_tolerance];
        let tolerances = [n, n, n, d];
        // Shifted to be positive, so that a conversion rounds down without a call.
        let slot = |k: usize, value: f64| (value / widths[k] + SHIFT) as i64;
        let ends: [[i64; 2]; 4] = std::array::from_fn(|k| {
            [
                slot(k, values[k] - tolerances[k]),
                slot(k, values[k] + tolerances[k]),
            ]
        });
        if ends.iter().all(|[low, high]| low == high) {
            visit(ends.map(|[low, _]| low));
            return;
        }
        for choice in 0..16_usize {
            let end = |k: usize| choice >> k & 1;
            let is_new = (0..4).all(|k| end(k) == 0 || ends[k][0] != ends[k][1]);
            if is_new {
                visit(std::array::from_fn(|k| ends[k][end(k)]));
            }
        }
    }
}

fn hash(slot: &Slot) -> u64 {
    slot.iter().fold(0, |hash: u64, &value| {
        (hash.rotate_left(23) ^ value as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    }) >> 20
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, MeshId, Object};
    use veduta_geometry::{DMat4, DQuat};

    /// A flat square of `cells` x `cells` pairs of triangles around the origin, of side 2.
    fn square(cells: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for k in 0..(cells + 1) * (cells + 1) {
            let (i, j) = (f64::from(k % (cells + 1)), f64::from(k / (cells + 1)));
            let flat = [i, j].map(|x| 2.0 * x / f64::from(cells) - 1.0);
            mesh.positions.push(DVec3::new(flat[0], flat[1], 0.0));
        }
        for j in 0..cells {
            for i in 0..cells {
                let p = j * (cells + 1) + i;
                mesh.triangles.push([p, p + 1, p + cells + 2]);
                mesh.triangles.push([p, p + cells + 2, p + cells + 1]);
            }
        }
        mesh
    }

    fn scene(placed: &[(u32, DMat4)]) -> Scene {
        let mut scene = Scene::default();
        for (index, &(cells, world_from_object)) in placed.iter().enumerate() {
            let mut mesh = square(cells);
            for position in &mut mesh.positions {
                // As a model's file would have it: in single precision, in the world's axes.
                *position = world_from_object
                    .transform_point3(*position)
                    .as_vec3()
                    .as_dvec3();
            }
            scene.meshes.push(mesh);
            scene.objects.push(Object {
                name: format!("square {index}"),
                mesh: MeshId(index as u32),
                world_from_object: DMat4::IDENTITY,
            });
        }
        scene
    }

    fn pairs(scene: &Scene) -> Vec<(FaceIndex, FaceIndex)> {
        PlaneGroups::of(scene).pairs().to_vec()
    }

    fn tilted(offset: f64) -> DMat4 {
        let turn = DQuat::from_axis_angle(DVec3::new(0.3, 1.0, 0.2).normalize(), 0.7);
        DMat4::from_rotation_translation(
            turn,
            DVec3::new(5.0, -7.0, 3.0) + turn * DVec3::Z * offset,
        )
    }

    #[test]
    fn two_tessellations_of_a_tilted_square_share_one_plane() {
        let pairs = pairs(&scene(&[(3, tilted(0.0)), (5, tilted(0.0))]));
        assert_eq!(pairs.len(), 2 * (9 + 25));
        assert!(pairs.iter().all(|pair| pair.1 == (0, 0)), "{pairs:?}");
    }

    #[test]
    fn a_sheet_a_millimetre_above_another_has_its_own_plane() {
        let pairs = pairs(&scene(&[(1, tilted(0.0)), (1, tilted(0.001))]));
        assert!(pairs.is_empty(), "{pairs:?}");
    }

    #[test]
    fn a_face_alone_in_its_plane_is_not_mentioned() {
        let mut scene = scene(&[(1, tilted(0.0)), (1, tilted(1.0))]);
        for mesh in &mut scene.meshes {
            mesh.triangles.truncate(1);
        }
        assert!(pairs(&scene).is_empty());
    }

    #[test]
    fn two_halves_of_a_square_need_no_common_plane_but_a_decal_on_them_does() {
        let halves = scene(&[(1, tilted(0.0))]);
        assert_eq!(pairs(&halves), []);
        let with_decal = scene(&[
            (1, tilted(0.0)),
            (1, tilted(0.0) * DMat4::from_scale(DVec3::splat(0.5))),
        ]);
        assert_eq!(pairs(&with_decal).len(), 4);
        let twice = scene(&[(1, tilted(0.0)), (1, tilted(0.0))]);
        assert_eq!(pairs(&twice).len(), 4);
    }

    #[test]
    fn among_maps_only_faces_of_different_ones_are_compared() {
        let scene = scene(&[(2, tilted(0.0)), (3, tilted(0.0)), (2, tilted(1.0))]);
        let objects = scene.objects.iter();
        let meshes: Vec<(&Mesh, DMat4)> = objects
            .map(|object| {
                (
                    &scene.meshes[object.mesh.0 as usize],
                    object.world_from_object,
                )
            })
            .collect();
        let pairs_of = |map: fn(u32) -> u32| {
            let faces: Vec<(FaceIndex, u32)> = (0..3)
                .flat_map(|object| {
                    let count = meshes[object as usize].0.face_count() as u32;
                    (0..count).map(move |face| ((object, face), map(object)))
                })
                .collect();
            PlaneGroups::among_maps(&meshes, &faces).pairs().to_vec()
        };
        assert_eq!(pairs_of(|_| 7), [], "of one map");
        assert_eq!(pairs_of(|object| object % 2).len(), 8 + 18);
        assert!(
            pairs_of(|object| object)
                .iter()
                .all(|pair| pair.1 == (0, 0))
        );
    }

    #[test]
    fn a_polygon_shares_its_plane_with_triangles_that_lie_in_it() {
        let mut scene = scene(&[(1, tilted(0.0)), (2, tilted(0.0))]);
        let mesh = &mut scene.meshes[0];
        mesh.triangles.clear();
        mesh.push_polygon(&[0, 1, 3, 2]);
        let pairs = pairs(&scene);
        assert_eq!(pairs.len(), 1 + 8);
        assert!(pairs.iter().all(|pair| pair.1 == (0, 0)), "{pairs:?}");
    }
}
