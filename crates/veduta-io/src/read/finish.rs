//! The last steps of every reader: sound meshes, Z up, everything within reach.

use super::UpAxis;
use super::error::{Fault, Place, Problem, Warnings};
use veduta::scene::{Mesh, Scene};
use veduta_geometry::{DMat4, DVec3, DVec4, Vec2, Vec3};

/// Coordinates of the world stay below this, in metres, so that products of three of them are far
/// from overflow. Larger would let areas and volumes become infinite.
pub(crate) const REACH: f64 = 1e30;

/// Mends what may be mended in a mesh and checks the rest.
///
/// Normals are brought to unit length. Those without direction become those of the faces around;
/// texture coordinates that are not finite become 0, and such colours 1: a broken attribute should
/// not cost the shape.
pub(crate) fn finish_mesh(
    mesh: &mut Mesh,
    name: &str,
    place: &Place,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    mesh.check().map_err(|fault| {
        let name = name.to_owned();
        let fault = Box::new(fault);
        Problem::Mesh { name, fault }.at(place.clone())
    })?;
    let mut mended = |what: &str, count: usize, made: &str| {
        if count > 0 {
            let message = format!("mesh {name:?}: {count} {what}; {made}");
            warnings.add(place.clone(), message);
        }
    };
    mended(
        "normals have no direction",
        mend_normals(mesh),
        "those of the faces around are taken",
    );
    let mut count = 0;
    let texcoords = mesh.texcoords.iter_mut().chain(&mut mesh.second_texcoords);
    for uv in texcoords.filter(|uv| !uv.is_finite()) {
        *uv = Vec2::ZERO;
        count += 1;
    }
    mended("texture coordinates are not finite", count, "0 is taken");
    let mut count = 0;
    for color in &mut mesh.colors {
        if !color.iter().all(|c| c.is_finite()) {
            *color = [1.0; 3];
            count += 1;
        }
    }
    mended("vertex colours are not finite", count, "white is taken");
    let mut count = 0;
    for opacity in mesh.opacities.iter_mut().filter(|a| !a.is_finite()) {
        *opacity = 1.0;
        count += 1;
    }
    mended("vertex opacities are not finite", count, "1 is taken");
    Ok(())
}

/// Makes all normals unit vectors; tells how many had no direction.
fn mend_normals(mesh: &mut Mesh) -> usize {
    let mut lost = Vec::new();
    for (vertex, normal) in mesh.normals.iter_mut().enumerate() {
        match normal.try_normalize() {
            Some(unit) => *normal = unit,
            None => lost.push(vertex as u32),
        }
    }
    if lost.is_empty() {
        return 0;
    }
    let mut sums = vec![DVec3::ZERO; lost.len()];
    for corners in &mesh.triangles {
        let normal = face_normal(mesh, *corners);
        for vertex in corners {
            if let Ok(row) = lost.binary_search(vertex) {
                sums[row] += normal;
            }
        }
    }
    for (&vertex, sum) in lost.iter().zip(&sums) {
        mesh.normals[vertex as usize] = sum.as_vec3().try_normalize().unwrap_or(Vec3::Z);
    }
    lost.len()
}

/// Unit normal of a triangle; zero where it has no area.
pub(crate) fn face_normal(mesh: &Mesh, corners: [u32; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|index| mesh.positions[index as usize]);
    (b - a).cross(c - a).normalize_or_zero()
}

/// Difference of normals that counts as rounding: a polygon whose normals differ by less is flat.
#[cfg(any(feature = "obj", feature = "ply"))]
const SAME_NORMAL: f32 = 1e-5;

/// Adds a face; as triangles where its normals or colours change over it.
#[cfg(any(feature = "obj", feature = "ply"))]
pub(crate) fn push_face(mesh: &mut Mesh, face: &[u32]) {
    let first = face[0] as usize;
    let is_flat = |&vertex: &u32| {
        let vertex = vertex as usize;
        let normals = mesh.normals.get(first).zip(mesh.normals.get(vertex));
        let colors = mesh.colors.get(first).zip(mesh.colors.get(vertex));
        normals.is_none_or(|(n, m)| n.abs_diff_eq(*m, SAME_NORMAL))
            && colors.is_none_or(|(c, d)| c == d)
    };
    if face.len() == 3 || face.iter().all(is_flat) {
        mesh.push_polygon(face);
    } else {
        for k in 2..face.len() {
            mesh.push_polygon(&[face[0], face[k - 1], face[k]]);
        }
    }
}

/// Turns a scene in the axes of its file to the world, in which Z is up and the front is -Y.
pub(crate) fn turn_up(scene: &mut Scene, up: UpAxis) {
    let world_from_file = match up {
        UpAxis::Z => return,
        // (x, y, z) -> (x, -z, y)
        UpAxis::Y => DMat4::from_cols(DVec4::X, DVec4::Z, -DVec4::Y, DVec4::W),
    };
    for object in &mut scene.objects {
        object.world_from_object = world_from_file * object.world_from_object;
    }
    for (_, camera) in &mut scene.cameras {
        // A rotation's inverse is its transpose, exactly.
        camera.eye_from_world *= world_from_file.transpose();
    }
    for light in &mut scene.lights {
        light.world_from_light = world_from_file * light.world_from_light;
    }
}

/// Checks that no object is placed where arithmetic fails.
pub(crate) fn check_reach(scene: &Scene) -> Result<(), Problem> {
    let extents: Vec<DVec3> = scene
        .meshes
        .iter()
        .map(|mesh| {
            let largest = |m: DVec3, p: &DVec3| m.max(p.abs());
            mesh.positions.iter().fold(DVec3::ZERO, largest)
        })
        .collect();
    for object in &scene.objects {
        let [x, y, z, w] = [0, 1, 2, 3].map(|c| object.world_from_object.col(c).truncate().abs());
        let extent = extents[object.mesh.0 as usize];
        let reach = (x * extent.x + y * extent.y + z * extent.z + w).max_element();
        let largest = extent.max_element().max(reach);
        if !(object.world_from_object.is_finite() && largest < REACH) {
            return Err(Problem::TooFar {
                what: format!("object {:?}", object.name),
                reach: largest,
                limit: REACH,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;
    use veduta::map::MaterialId;
    use veduta::scene::{MeshId, Object};

    fn triangle() -> Mesh {
        Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]],
            materials: vec![(0, MaterialId(0))],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_lost_normal_becomes_that_of_its_face() {
        let mut mesh = triangle();
        mesh.normals = vec![Vec3::ZERO, Vec3::new(0.0, 0.0, -2.0), Vec3::NAN];
        let mut warnings = Warnings::new(PathBuf::from("m"));
        finish_mesh(&mut mesh, "m", &Place::Whole, &mut warnings).expect("can be mended");
        assert_eq!(mesh.normals, [Vec3::Z, -Vec3::Z, Vec3::Z]);
        let warnings = warnings.finish();
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].message.contains("2 normals"), "{}", warnings[0]);
    }

    #[test]
    fn y_up_is_turned_so_that_the_front_faces_minus_y() {
        let mut scene = Scene {
            objects: vec![Object {
                name: String::new(),
                mesh: MeshId(0),
                world_from_object: DMat4::IDENTITY,
            }],
            meshes: vec![triangle()],
            ..Scene::default()
        };
        turn_up(&mut scene, UpAxis::Y);
        let turn = scene.objects[0].world_from_object;
        assert_eq!(turn.transform_point3(DVec3::Y), DVec3::Z);
        assert_eq!(turn.transform_point3(DVec3::Z), -DVec3::Y);
        assert_eq!(turn.transform_point3(DVec3::X), DVec3::X);
        assert_eq!(turn.determinant(), 1.0);
    }

    #[test]
    fn what_a_transform_throws_out_of_the_world_is_refused() {
        for scale in [1e31, f64::MAX, f64::INFINITY, f64::NAN] {
            let scene = Scene {
                objects: vec![Object {
                    name: "far".into(),
                    mesh: MeshId(0),
                    world_from_object: DMat4::from_scale(DVec3::splat(scale)),
                }],
                meshes: vec![triangle()],
                ..Scene::default()
            };
            assert!(check_reach(&scene).is_err(), "scale {scale}");
        }
    }
}
