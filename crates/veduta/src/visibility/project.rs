//! Scene -> faces in the image plane.
//!
//! Coplanar faces share one plane, taken from the first of them. Faces that are not fully opaque are
//! marked as veils.
//!
//! Each vertex is projected once, into an image plane without size. Objects and faces are sorted
//! into the classes of Nishita & Nakamae (1979), §4.2: A, wholly inside the view pyramid; B, before
//! the eye and partly inside; C, partly behind the eye; D, outside. Only faces of classes B and C
//! are clipped, in homogeneous coordinates, so that nothing is ever divided by a depth near zero.
//!
//! Neighbours keep bit-equal edges: an edge is clipped from the smaller of its end points, whichever
//! face asks.

use crate::scene::{FaceIndex, Mesh, Object, Opacities, Opacity, PlaneGroups, Scene};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use veduta_geometry::{DVec2, DVec3, DVec4, signed_area};
use veduta_map::{Camera, Faces, ObjectId, image_from_homogeneous};

/// Faces a task projects at a time: enough to hide the cost of a task, few enough to share evenly.
const FACES_PER_TASK: usize = 16 * 1024;

/// Faces projected since the process began; see [`work`](super::work).
pub(super) static PROJECTED: AtomicU64 = AtomicU64::new(0);

/// The faces of `scene` that may be seen through `camera`, clipped to the view pyramid.
///
/// Faces turned away from the eye are left out where their material is single-sided, and so are faces
/// that let all through and objects that only cast shadows. Mattes are opaque. Ids ascend by
/// object in [key order](Scene::key_order), then by face within the object.
pub fn project(scene: &Scene, camera: &Camera) -> Faces {
    let groups = PlaneGroups::of(scene);
    let opacities = Opacities::of(scene);
    let mut faces = Faces::new();
    for object in scene.key_order() {
        if !scene.shown(object).hides() {
            continue;
        }
        let mesh = scene.mesh_of(object);
        let view = ObjectView::new(camera, scene.object(object), mesh);
        if view.class == Class::Outside {
            continue;
        }
        let groups = groups.of_object(object.0);
        let starts: Vec<usize> = (0..mesh.face_count()).step_by(FACES_PER_TASK).collect();
        let parts: Vec<Faces> = starts
            .into_par_iter()
            .map(|start| {
                let end = (start + FACES_PER_TASK).min(mesh.face_count());
                view.project_faces(scene, object, start as u32..end as u32, groups, &opacities)
            })
            .collect();
        // Each is dropped when it is appended, so that there are never two copies of all.
        for part in parts {
            faces.append(&part);
        }
    }
    groups.share_planes(&mut faces);
    PROJECTED.fetch_add(faces.len() as u64, Relaxed);
    faces
}

/// Where something lies with respect to the view pyramid: Nishita & Nakamae's A, B or C, D.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Inside,
    Partly,
    Outside,
}

/// Bits of the sides of the view pyramid that a point is beyond.
fn outcode(point: DVec4, near: f64) -> u32 {
    let [x, y, w, z] = point.to_array();
    u32::from(x < 0.0)
        | u32::from(w - x < 0.0) << 1
        | u32::from(y < 0.0) << 2
        | u32::from(w - y < 0.0) << 3
        | u32::from(z < near) << 4
}

/// An object's vertices as the camera sees them.
struct ObjectView<'a> {
    mesh: &'a Mesh,
    camera: &'a Camera,
    /// Eye-space positions.
    eye: Vec<DVec3>,
    /// Image-plane positions, right only for vertices inside the view pyramid.
    image: Vec<DVec2>,
    /// Sides of the pyramid each vertex is beyond; empty for an object of class A.
    outcodes: Vec<u8>,
    class: Class,
    /// Whether the placement turns the winding of faces.
    mirrored: bool,
}

impl<'a> ObjectView<'a> {
    fn new(camera: &'a Camera, object: &Object, mesh: &'a Mesh) -> Self {
        let eye_from_object = camera.eye_from_world * object.world_from_object;
        let eye: Vec<DVec3> = mesh
            .positions
            .par_iter()
            .with_min_len(FACES_PER_TASK)
            .map(|&position| eye_from_object.transform_point3(position))
            .collect();
        let mut outcodes: Vec<u8> = eye
            .par_iter()
            .with_min_len(FACES_PER_TASK)
            .map(|&point| outcode(camera.homogeneous(point), camera.near) as u8)
            .collect();
        let beyond_any = outcodes.par_iter().copied().reduce(|| 0, |a, b| a | b);
        let beyond_all = outcodes
            .par_iter()
            .copied()
            .reduce(|| u8::MAX, |a, b| a & b);
        let class = match (beyond_any, beyond_all) {
            (0, _) => Class::Inside,
            (_, 0) => Class::Partly,
            _ => Class::Outside,
        };
        if class == Class::Inside {
            outcodes = Vec::new();
        }
        let image = eye
            .par_iter()
            .with_min_len(FACES_PER_TASK)
            .map(|&point| camera.image_from_eye(point))
            .collect();
        let mirrored = object.world_from_object.determinant() < 0.0;
        Self {
            mesh,
            camera,
            eye,
            image,
            outcodes,
            class,
            mirrored,
        }
    }

    fn project_faces(
        &self,
        scene: &Scene,
        object: ObjectId,
        range: std::ops::Range<u32>,
        groups: &[(FaceIndex, FaceIndex)],
        opacities: &Opacities,
    ) -> Faces {
        let is_seen = scene.shown(object).is_seen();
        let mut faces = Faces::with_capacity(range.len());
        let mut outline = Vec::new();
        let mut polygon = ClipPolygon::default();
        for source in range {
            let corners = || self.mesh.corners_of(source).map(|vertex| vertex as usize);
            let class = self.class_of(corners());
            if class == Class::Outside {
                continue;
            }
            let outline: &[DVec2] = if class == Class::Inside {
                outline.clear();
                outline.extend(corners().map(|vertex| self.image[vertex]));
                &outline
            } else {
                polygon.clip(corners().map(|vertex| self.eye[vertex]), self.camera)
            };
            let area = signed_area(outline);
            // Counterclockwise in the world is negative in an image plane whose y points down.
            let front = (area < 0.0) != self.mirrored;
            if area == 0.0 || !front && !scene.material(self.mesh.material_of(source)).double_sided
            {
                continue;
            }
            let group = groups.binary_search_by_key(&source, |pair| pair.0.1);
            let [p, q, r] = match group {
                Ok(at) => self.spanning_corners(scene, groups[at].1),
                Err(_) => {
                    let triangle = self.mesh.triangles[self.mesh.triangles_of(source).start];
                    triangle.map(|vertex| self.eye[vertex as usize])
                }
            };
            if let Some(nearness) = self.camera.nearness_of_plane(p, (q - p).cross(r - p)) {
                let opacity = opacities.of_face(object, source);
                if opacity == Opacity::Absent {
                    continue;
                }
                let plane = faces.push_plane(nearness);
                let face = faces.push(outline, plane, object, source);
                if let Some(face) = face.filter(|_| opacity == Opacity::Veil && is_seen) {
                    faces.set_veil(face);
                }
            }
        }
        faces
    }

    /// Eye-space corners that span the plane of a face of any object, the same to the bit whoever
    /// asks.
    fn spanning_corners(&self, scene: &Scene, (object, face): FaceIndex) -> [DVec3; 3] {
        let object = ObjectId(object);
        let eye_from_object = self.camera.eye_from_world * scene.object(object).world_from_object;
        let mesh = scene.mesh_of(object);
        mesh.triangles[mesh.triangles_of(face).start]
            .map(|vertex| eye_from_object.transform_point3(mesh.positions[vertex as usize]))
    }

    fn class_of(&self, corners: impl Iterator<Item = usize>) -> Class {
        if self.outcodes.is_empty() {
            return Class::Inside;
        }
        let codes = corners.map(|vertex| self.outcodes[vertex]);
        match codes.fold((0, u8::MAX), |(any, all), code| (any | code, all & code)) {
            (0, _) => Class::Inside,
            (_, 0) => Class::Partly,
            _ => Class::Outside,
        }
    }
}

/// A face clipped to the view pyramid; reused from face to face to spare allocations.
#[derive(Default)]
struct ClipPolygon {
    corners: Vec<DVec4>,
    clipped: Vec<DVec4>,
    outline: Vec<DVec2>,
}

impl ClipPolygon {
    /// The part of the face inside the view pyramid; fewer than three vertices if none is.
    fn clip(&mut self, corners: impl Iterator<Item = DVec3>, camera: &Camera) -> &[DVec2] {
        self.corners.clear();
        self.corners
            .extend(corners.map(|point| camera.homogeneous(point)));
        // Near first: what is left has positive w, so that the sides mean what they say.
        self.clip_side(|p| p.w - camera.near, |p| p);
        // Points on a side of the frame get its coordinate exactly.
        self.clip_side(|p| p.x, |p| DVec4::new(0.0, p.y, p.z, p.w));
        self.clip_side(|p| p.z - p.x, |p| DVec4::new(p.z, p.y, p.z, p.w));
        self.clip_side(|p| p.y, |p| DVec4::new(p.x, 0.0, p.z, p.w));
        self.clip_side(|p| p.z - p.y, |p| DVec4::new(p.x, p.z, p.z, p.w));
        self.outline.clear();
        for &corner in &self.corners {
            let point = image_from_homogeneous(corner);
            if self.outline.last() != Some(&point) {
                self.outline.push(point);
            }
        }
        while self.outline.len() > 1 && self.outline.first() == self.outline.last() {
            self.outline.pop();
        }
        &self.outline
    }

    /// Keeps what has `distance >= 0`; `snap` puts the new points on the side exactly.
    fn clip_side(&mut self, distance: impl Fn(DVec4) -> f64, snap: impl Fn(DVec4) -> DVec4) {
        self.clipped.clear();
        for (index, &p) in self.corners.iter().enumerate() {
            let q = self.corners[(index + 1) % self.corners.len()];
            let (dp, dq) = (distance(p), distance(q));
            if dp >= 0.0 {
                self.clipped.push(p);
            }
            if (dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0) {
                // From the smaller end point, so that the neighbour finds the same point.
                let forward = p.to_array() < q.to_array();
                let ((p, dp), (q, dq)) = if forward {
                    ((p, dp), (q, dq))
                } else {
                    ((q, dq), (p, dp))
                };
                self.clipped.push(snap(p + (q - p) * (dp / (dp - dq))));
            }
        }
        std::mem::swap(&mut self.corners, &mut self.clipped);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, MeshId};
    use veduta_geometry::DMat4;
    use veduta_map::FaceId;
    use veduta_map::{MaterialId, Projection};

    fn scene_of(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, double_sided: bool) -> Scene {
        let mesh = Mesh {
            positions,
            triangles,
            materials: vec![(0, MaterialId(0))],
            ..Mesh::default()
        };
        Scene {
            objects: vec![Object {
                name: "object".into(),
                mesh: MeshId(0),
                world_from_object: DMat4::IDENTITY,
            }],
            meshes: vec![mesh],
            materials: vec![Material {
                double_sided,
                ..Material::default()
            }],
            ..Scene::default()
        }
    }

    /// Looks along +Y from the origin, 90 degrees.
    fn camera() -> Camera {
        let projection = Projection::Perspective {
            tan_half_height: 1.0,
            aspect: 1.0,
        };
        Camera::looking(DVec3::ZERO, DVec3::Y, DVec3::Z, projection, 0.1).expect("a sound camera")
    }

    fn area(faces: &Faces) -> f64 {
        faces
            .ids()
            .map(|face| signed_area(faces.outline(face)))
            .sum()
    }

    #[test]
    fn a_floor_that_reaches_behind_the_eye_ends_at_the_near_plane_and_the_frame() {
        let floor = [(-1e3, -1e3), (1e3, -1e3), (1e3, 1e3), (-1e3, 1e3)];
        let positions = floor.map(|(x, y)| DVec3::new(x, y, -1.0)).to_vec();
        let faces = project(
            &scene_of(positions, vec![[0, 1, 2], [0, 2, 3]], true),
            &camera(),
        );
        // The horizon of a floor that ends at 1000 m lies half a thousandth below the middle.
        assert!(
            (area(&faces) - (0.5 - 0.0005)).abs() < 1e-12,
            "area {}",
            area(&faces)
        );
    }

    #[test]
    fn neighbours_keep_bit_equal_edges_when_clipped() {
        let positions = vec![
            DVec3::new(-3.0, 1.0, -2.0),
            DVec3::new(3.1, -0.5, 2.7),
            DVec3::new(-2.0, 5.0, 2.0),
            DVec3::new(4.0, 3.0, -3.0),
        ];
        let faces = project(
            &scene_of(positions, vec![[0, 1, 2], [1, 0, 3]], true),
            &camera(),
        );
        assert_eq!(faces.len(), 2);
        let [a, b] = [FaceId(0), FaceId(1)].map(|face| faces.outline(face));
        let shared = a.iter().filter(|point| b.contains(point)).count();
        assert_eq!(shared, 2, "the common edge, clipped: {a:?} and {b:?}");
    }

    #[test]
    fn faces_turned_away_are_left_out_only_when_single_sided() {
        // Counterclockwise seen from the eye at the origin, looking along +Y.
        let positions = [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, z)| DVec3::new(x, 4.0, z));
        for (triangle, double_sided, seen) in [
            ([0, 1, 2], false, 1),
            ([0, 2, 1], false, 0),
            ([0, 2, 1], true, 1),
        ] {
            let scene = scene_of(positions.to_vec(), vec![triangle], double_sided);
            assert_eq!(
                project(&scene, &camera()).len(),
                seen,
                "{triangle:?} {double_sided}"
            );
        }
    }

    #[test]
    fn a_mirrored_object_keeps_its_front() {
        let positions = [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, z)| DVec3::new(x, 4.0, z));
        let mut scene = scene_of(positions.to_vec(), vec![[0, 1, 2]], false);
        scene.objects[0].world_from_object = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        assert_eq!(project(&scene, &camera()).len(), 1);
    }

    #[test]
    fn of_two_tessellations_of_a_wall_the_earlier_object_is_seen() {
        // A square at an angle, as two triangles and, as another object, turned by one corner: no two
        // triangles are alike, and no coordinate is exact.
        let turn = veduta_geometry::DQuat::from_rotation_z(0.5);
        let corner = |x: f64, z: f64| {
            (turn * DVec3::new(x, 0.0, z) + 5.0 * DVec3::Y)
                .as_vec3()
                .as_dvec3()
        };
        let positions = vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ];
        let mut scene = scene_of(positions, vec![[0, 1, 2], [0, 2, 3]], true);
        let other = Mesh {
            triangles: vec![[1, 2, 3], [1, 3, 0]],
            ..scene.meshes[0].clone()
        };
        scene.meshes.push(other);
        scene.objects.push(Object {
            mesh: MeshId(1),
            ..scene.objects[0].clone()
        });
        let faces = project(&scene, &camera());
        assert_eq!(faces.len(), 4);
        assert!(
            faces
                .ids()
                .all(|face| faces.plane(face) == faces.plane(FaceId(0)))
        );
        let seen = crate::visibility::speculative::find(&faces, &Default::default());
        let whole: Vec<_> = seen.opaque.iter().collect();
        assert_eq!(
            whole,
            [0, 1].map(|face| veduta_map::Fragment::Whole(FaceId(face)))
        );
    }

    #[test]
    fn what_is_outside_the_pyramid_is_not_there() {
        let positions = [(20.0, 1.0), (21.0, 1.0), (20.0, 2.0)].map(|(x, z)| DVec3::new(x, 4.0, z));
        assert!(
            project(
                &scene_of(positions.to_vec(), vec![[0, 1, 2]], true),
                &camera()
            )
            .is_empty()
        );
        let behind = [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, z)| DVec3::new(x, -4.0, z));
        assert!(project(&scene_of(behind.to_vec(), vec![[0, 1, 2]], true), &camera()).is_empty());
    }
}
