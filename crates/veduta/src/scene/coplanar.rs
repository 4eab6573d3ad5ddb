//! Faces in one plane: a decal on a wall, two tessellations of a floor, a face given twice.
//!
//! Their nearness differs by rounding only, so comparing it would let now one, now the other win
//! (z-fighting). Faces that lie in the plane of an earlier one, as far as their coordinates can tell,
//! are given that face's plane; then the order of faces decides, everywhere alike.
//!
//! Planes are looked up in a hash table of quantised normals and distances. Most faces are alone in
//! their slot, which a table of counters tells before anything is stored for them.

use crate::scene::Scene;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU8, Ordering};
use veduta_geometry::DVec3;

/// Deviation from a plane, relative to the largest coordinate of a face, that counts as rounding:
/// four units in the last place of single precision, in which most models are stored. More would
/// flatten true relief; less would leave z-fighting where models were converted or transformed.
const ROUNDING: f64 = 4.0 * 0.5 / (1 << 23) as f64;

/// Width of a slot: of a component of the unit normal, and of the distance from the origin as a share
/// of the scene's extent.
const NORMAL_SLOT: f64 = 1.0 / (1 << 12) as f64;
const DISTANCE_SLOT: f64 = 1.0 / (1 << 14) as f64;

/// More than the number of slots on either side of zero: the distance of a plane is at most twice the
/// scene's extent.
const SHIFT: f64 = (1 << 20) as f64;

/// Faces and vertices a task looks at at a time.
const FACES_PER_TASK: usize = 16 * 1024;

/// A face of the scene: index of its object, index in the object's mesh.
pub type FaceIndex = (u32, u32);

/// Pairs of a face and the first face of its plane, for planes with more than one face; ascending.
///
/// Faces so small that rounding leaves their normal open by more than a slot's width are left alone:
/// nothing can be said of their plane.
pub fn coplanar_faces(scene: &Scene) -> Vec<(FaceIndex, FaceIndex)> {
    let positions: Vec<Vec<DVec3>> = scene
        .objects
        .iter()
        .map(|object| {
            let positions = &scene.meshes[object.mesh.0 as usize].positions;
            let place = |&position: &DVec3| object.world_from_object.transform_point3(position);
            positions
                .par_iter()
                .with_min_len(FACES_PER_TASK)
                .map(place)
                .collect()
        })
        .collect();
    let largest = |points: &Vec<DVec3>| {
        let sizes = points
            .par_iter()
            .with_min_len(FACES_PER_TASK)
            .map(|p| p.abs().max_element());
        sizes.reduce(|| 0.0, f64::max)
    };
    let extent = positions.iter().map(largest).fold(0.0, f64::max);
    let slots = Slots {
        distance: (extent * DISTANCE_SLOT).max(f64::MIN_POSITIVE),
    };
    let mut faces: Vec<(FaceIndex, Plane)> = Vec::new();
    for (object, (placed, positions)) in scene.objects.iter().zip(&positions).enumerate() {
        let triangles = &scene.meshes[placed.mesh.0 as usize].triangles;
        let parts: Vec<Vec<(FaceIndex, Plane)>> = triangles
            .par_chunks(FACES_PER_TASK)
            .enumerate()
            .map(|(chunk, triangles)| {
                let first = chunk * FACES_PER_TASK;
                let plane_of = |(face, triangle): (usize, &[u32; 3])| {
                    let corners = triangle.map(|vertex| positions[vertex as usize]);
                    let plane = Plane::of(corners, slots.distance)?;
                    Some(((object as u32, (first + face) as u32), plane))
                };
                triangles.iter().enumerate().filter_map(plane_of).collect()
            })
            .collect();
        faces.extend(parts.into_iter().flatten());
    }
    if faces.is_empty() {
        return Vec::new();
    }

    let counters: Vec<AtomicU8> = (0..(16 * faces.len()).next_power_of_two())
        .map(|_| AtomicU8::new(0))
        .collect();
    let counter = |slot: &Slot| &counters[hash(slot) as usize & (counters.len() - 1)];
    faces.par_iter().for_each(|(_, plane)| {
        slots.of(plane, |slot| {
            let counter = counter(&slot);
            if counter.load(Ordering::Relaxed) < 2 {
                counter.fetch_add(1, Ordering::Relaxed);
            }
        });
    });

    let mut first_faces: HashMap<Slot, Vec<usize>> = HashMap::new();
    let mut pairs = Vec::new();
    for (index, (face, plane)) in faces.iter().enumerate() {
        let mut is_alone = true;
        slots.of(plane, |slot| {
            is_alone &= counter(&slot).load(Ordering::Relaxed) < 2
        });
        if is_alone {
            continue;
        }
        let mut first = None;
        slots.of(plane, |slot| {
            let here = first_faces.get(&slot).into_iter().flatten();
            let found = here.copied().find(|&other| faces[other].1.contains(plane));
            first = first.into_iter().chain(found).min();
        });
        if let Some(first) = first {
            pairs.push((*face, faces[first].0));
        } else {
            slots.of(plane, |slot| {
                first_faces.entry(slot).or_default().push(index)
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

/// A face's plane, and how sure it is.
struct Plane {
    corners: [DVec3; 3],
    normal: DVec3,
    distance: f64,
    /// How far a point may lie off the plane by rounding.
    tolerance: f64,
    /// The same for the components of the normal and for the distance.
    normal_tolerance: f64,
    distance_tolerance: f64,
}

impl Plane {
    fn of(corners: [DVec3; 3], distance_slot: f64) -> Option<Self> {
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
        let unsure = 16.0 * tolerance * tolerance * longest_squared;
        if unsure >= NORMAL_SLOT * NORMAL_SLOT * cross.length_squared() {
            return None;
        }
        let twice_area = cross.length();
        let normal_tolerance = tolerance * longest_squared.sqrt() / twice_area;
        let distance_tolerance = tolerance + normal_tolerance * largest;
        if 4.0 * distance_tolerance >= distance_slot {
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
        let distance = normal.dot(p);
        Some(Self {
            corners,
            normal,
            distance,
            tolerance,
            normal_tolerance,
            distance_tolerance,
        })
    }

    /// Whether all of `other` lies in this plane.
    fn contains(&self, other: &Plane) -> bool {
        let tolerance = self.tolerance.max(other.tolerance);
        other
            .corners
            .iter()
            .all(|&corner| (self.normal.dot(corner - self.corners[0])).abs() <= tolerance)
    }
}

/// A quantised plane.
type Slot = [i64; 4];

#[derive(Clone, Copy)]
struct Slots {
    distance: f64,
}

impl Slots {
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

    fn tilted(offset: f64) -> DMat4 {
        let turn = DQuat::from_axis_angle(DVec3::new(0.3, 1.0, 0.2).normalize(), 0.7);
        DMat4::from_rotation_translation(
            turn,
            DVec3::new(5.0, -7.0, 3.0) + turn * DVec3::Z * offset,
        )
    }

    #[test]
    fn two_tessellations_of_a_tilted_square_share_one_plane() {
        let pairs = coplanar_faces(&scene(&[(3, tilted(0.0)), (5, tilted(0.0))]));
        assert_eq!(pairs.len(), 2 * (9 + 25));
        assert!(pairs.iter().all(|pair| pair.1 == (0, 0)), "{pairs:?}");
    }

    #[test]
    fn a_sheet_a_millimetre_above_another_has_its_own_plane() {
        let pairs = coplanar_faces(&scene(&[(1, tilted(0.0)), (1, tilted(0.001))]));
        assert!(pairs.iter().all(|pair| pair.0.0 == pair.1.0), "{pairs:?}");
    }

    #[test]
    fn a_face_alone_in_its_plane_is_not_mentioned() {
        let mut scene = scene(&[(1, tilted(0.0)), (1, tilted(1.0))]);
        for mesh in &mut scene.meshes {
            mesh.triangles.truncate(1);
        }
        assert!(coplanar_faces(&scene).is_empty());
    }
}
