//! What a face looks like from the eye, made ready for evaluation at any point of it.

use crate::scene::{AlphaMode, Material, Scene, TextureRef};
use crate::shade::light::Daylight;
use crate::shade::texture::picture_from_uv;
use veduta_geometry::{DMat3, DMat4, DVec2, DVec3, Vec3};
use veduta_map::{Affine, Camera, FaceId, Faces, MaterialId, ObjectId, Projection};

/// How the radiance of a face goes over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// It is the same everywhere.
    Constant([f32; 3]),
    /// It differs from point to point: row of the table of [`Varying`].
    Varying(u32),
}

/// A face whose radiance differs from point to point.
#[derive(Clone, Debug)]
pub struct Varying {
    pub material: MaterialId,
    corners: Corners,
    /// Turned to the eye's side of the face.
    face_normal: Vec3,
    /// At the corners, in world space; not normalised.
    normals: Option<[Vec3; 3]>,
    /// Coordinates at the corners in the picture of the colour.
    picture: Option<[DVec2; 3]>,
    /// Those in the picture of the emission; boxed because few faces have one.
    emissive_picture: Option<Box<[DVec2; 3]>>,
    colors: Option<[Vec3; 3]>,
    opacities: Option<[f32; 3]>,
}

/// A point of a face as shading sees it.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Unit normal in world space, on the eye's side.
    pub normal: Vec3,
    /// Factor of the material's colour.
    pub color: Vec3,
    /// Factor of the material's opacity.
    pub opacity: f32,
    /// Place in the texture of the colour, if there is one.
    pub picture: Option<PicturePoint>,
    /// Place in the texture of the emission, if there is one.
    pub emissive_picture: Option<PicturePoint>,
}

/// A place in a texture and the footprint of a pixel there.
#[derive(Clone, Copy, Debug)]
pub struct PicturePoint {
    /// Picture coordinates.
    pub at: DVec2,
    /// Change of `at` per unit of image x.
    pub along_x: DVec2,
    /// Change of `at` per unit of image y.
    pub along_y: DVec2,
}

/// Barycentric coordinates of a triangle, as functions of the image plane, up to a common factor.
/// Those of the first triangle of a larger face serve all of it.
///
/// In perspective a point on the ray with direction d, z = 1, is `z d = Σ w_i V_i`, so that
/// `w / z = [V0 V1 V2]⁻¹ d`: these are affine in the image plane, since d is, and their sum is 1/z.
/// In parallel projection the coordinates themselves are affine. That holds for corners behind
/// the eye, too, so a face that the near plane cut needs no other corners.
#[derive(Clone, Copy, Debug)]
struct Corners {
    weights: [Affine; 3],
    /// No weight is less on the face: zero on a triangle.
    least: f64,
}

impl Corners {
    fn new(camera: &Camera, corners: [DVec3; 3], is_triangle: bool) -> Self {
        let (scale, ahead) = (camera.image_scale(), camera.principal_point());
        let [v0, v1, v2] = corners;
        // Each row c is a function c · (X, Y, 1) with X = (x - ahead.x) / scale.x, Y likewise.
        let (rows, whole) = match camera.projection {
            Projection::Perspective { .. } => {
                let rows = [v1.cross(v2), v2.cross(v0), v0.cross(v1)];
                (rows, v0.dot(rows[0]))
            }
            Projection::Parallel { .. } => {
                let flat = corners.map(|v| DVec3::new(v.x, v.y, 1.0));
                let [f0, f1, f2] = flat;
                let rows = [f1.cross(f2), f2.cross(f0), f0.cross(f1)];
                (rows, f0.dot(rows[0]))
            }
        };
        let weights = rows.map(|row| {
            let (a, b) = (row.x / scale.x / whole, row.y / scale.y / whole);
            Affine::new(a, b, row.z / whole - (a * ahead.x + b * ahead.y))
        });
        let least = if is_triangle { 0.0 } else { f64::NEG_INFINITY };
        Self { weights, least }
    }

    /// Barycentric coordinates at an image point, and their sum's inverse (the depth).
    ///
    /// Rounding may put a point of a sliver outside it, and far away along it; such a point is
    /// moved to the triangle. A triangle seen edge-on, of which nothing should be seen, gives its
    /// middle.
    #[inline]
    fn at(&self, image: DVec2) -> ([f64; 3], f64) {
        let weights = self.weights.map(|weight| weight.at(image).max(self.least));
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 && sum.is_finite() {
            let depth = 1.0 / sum;
            (weights.map(|weight| weight * depth), depth)
        } else {
            ([1.0 / 3.0; 3], 0.0)
        }
    }
}

/// Looks at projected faces from the eye that sees them.
pub struct Viewer<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    faces: &'a Faces,
    world_from_eye: DMat3,
    objects: Vec<ObjectView>,
}

struct ObjectView {
    eye_from_object: DMat4,
    /// Inverse transpose: keeps normals at right angles under unequal scale.
    world_normal_from_object: DMat3,
}

impl<'a> Viewer<'a> {
    pub fn new(scene: &'a Scene, camera: &'a Camera, faces: &'a Faces) -> Self {
        let eye_from_world = camera.eye_from_world;
        let view = |object: &crate::scene::Object| ObjectView {
            eye_from_object: eye_from_world * object.world_from_object,
            world_normal_from_object: DMat3::from_mat4(object.world_from_object)
                .inverse()
                .transpose(),
        };
        Self {
            scene,
            camera,
            faces,
            world_from_eye: DMat3::from_mat4(eye_from_world).transpose(),
            objects: scene.objects.iter().map(view).collect(),
        }
    }

    /// The face's radiance in that light, or without `light` its colour, if it is the same everywhere.
    pub fn constant(&self, face: FaceId, light: Option<&Daylight>) -> Option<[f32; 3]> {
        let (object, source) = (self.faces.object(face), self.faces.source(face));
        let mesh = self.scene.mesh_of(object);
        let material = self.scene.material_of(object, source);
        let light = light.filter(|_| !material.unlit);
        let emissive_texture = material.emissive_texture.filter(|_| light.is_some());
        let textures = [material.base_color_texture, emissive_texture];
        let placed = |texture: &TextureRef| !mesh.texcoords_of(texture.texcoords).is_empty();
        if textures.iter().flatten().any(placed) {
            return None;
        }
        if self.faces.is_veil(face) {
            self.constant_opacity(face)?;
        }
        let [r, g, b, _] = material.base_color;
        let mut color = Vec3::new(r, g, b);
        if !mesh.colors.is_empty() {
            let corners = self.corners(object, source);
            color *= Vec3::from(all_equal(corners.map(|corner| mesh.colors[corner]))?);
        }
        let Some(light) = light else {
            return Some(color.into());
        };
        let normal = self.constant_normal(face)?;
        let radiance = color * light.on(normal) + Vec3::from(material.emissive);
        Some(radiance.into())
    }

    /// The opacity of a face without textures, if it is the same everywhere.
    pub fn constant_opacity(&self, face: FaceId) -> Option<f32> {
        let (object, source) = (self.faces.object(face), self.faces.source(face));
        let mesh = self.scene.mesh_of(object);
        let material = self.scene.material_of(object, source);
        let of_corners = if mesh.opacities.is_empty() {
            1.0
        } else {
            let corners = self.corners(object, source);
            all_equal(corners.map(|corner| mesh.opacities[corner]))?
        };
        Some(opacity_of(material, of_corners))
    }

    /// The face's unit normal in world space, on the eye's side, if it is the same everywhere.
    pub fn constant_normal(&self, face: FaceId) -> Option<Vec3> {
        let (object, source) = (self.faces.object(face), self.faces.source(face));
        let mesh = self.scene.mesh_of(object);
        let face_normal = |viewer: &Self| viewer.face_normal(&viewer.eye_corners(object, source));
        if mesh.normals.is_empty() {
            return Some(face_normal(self));
        }
        let corners = self.corners(object, source);
        let normal = all_equal(corners.map(|corner| mesh.normals[corner]))?;
        let turned = self.objects[object.index()].world_normal_from_object * normal.as_dvec3();
        Some(on_side_of(turned.as_vec3(), face_normal(self)))
    }

    /// The face made ready for evaluation from point to point.
    pub fn varying(&self, face: FaceId) -> Varying {
        let (object, source) = (self.faces.object(face), self.faces.source(face));
        let mesh = self.scene.mesh_of(object);
        let material = mesh.material_of(source);
        let textures = self.scene.material(material);
        let is_triangle = mesh.triangles_of(source).len() == 1;
        let corners = self.corners(object, source);
        let eye_corners = self.eye_corners(object, source);
        let turn = &self.objects[object.index()].world_normal_from_object;
        let has = |rows: usize| (rows > 0).then_some(corners);
        let picture = |texture: Option<TextureRef>| {
            let texture = texture?;
            let texcoords = mesh.texcoords_of(texture.texcoords);
            let corners = has(texcoords.len())?;
            Some(corners.map(|corner| picture_from_uv(&texture, texcoords[corner])))
        };
        Varying {
            material,
            corners: Corners::new(self.camera, eye_corners, is_triangle),
            face_normal: self.face_normal(&eye_corners),
            normals: has(mesh.normals.len()).map(|corners| {
                // Normalised here: an object scaled unequally would weigh its corners otherwise.
                corners.map(|corner| {
                    (*turn * mesh.normals[corner].as_dvec3())
                        .normalize_or_zero()
                        .as_vec3()
                })
            }),
            picture: picture(textures.base_color_texture),
            emissive_picture: picture(textures.emissive_texture).map(Box::new),
            colors: has(mesh.colors.len())
                .map(|corners| corners.map(|corner| Vec3::from(mesh.colors[corner]))),
            opacities: has(mesh.opacities.len())
                .map(|corners| corners.map(|corner| mesh.opacities[corner])),
        }
    }

    /// Corners of the face that span it, all three of a triangle: rows of its mesh.
    fn corners(&self, object: ObjectId, source: u32) -> [usize; 3] {
        let mesh = self.scene.mesh_of(object);
        mesh.triangles[mesh.triangles_of(source).start].map(|corner| corner as usize)
    }

    /// Those corners in eye space.
    fn eye_corners(&self, object: ObjectId, source: u32) -> [DVec3; 3] {
        let mesh = self.scene.mesh_of(object);
        let eye_from_object = &self.objects[object.index()].eye_from_object;
        self.corners(object, source)
            .map(|corner| eye_from_object.transform_point3(mesh.positions[corner]))
    }

    /// Unit normal of a face in world space, on the eye's side.
    fn face_normal(&self, corners: &[DVec3; 3]) -> Vec3 {
        let [v0, v1, v2] = *corners;
        let normal = (v1 - v0).cross(v2 - v0).normalize_or_zero();
        let away = match self.camera.projection {
            Projection::Perspective { .. } => normal.dot(v0) > 0.0,
            Projection::Parallel { .. } => normal.z > 0.0,
        };
        let normal = self.world_from_eye * normal;
        (if away { -normal } else { normal }).as_vec3()
    }
}

/// The opacity of a material without texture where that of the corners is `of_corners`.
pub fn opacity_of(material: &Material, of_corners: f32) -> f32 {
    let opacity = material.base_color[3] * of_corners;
    match material.alpha_mode {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Mask(cutoff) => f32::from(opacity >= cutoff),
        AlphaMode::Blend => opacity.clamp(0.0, 1.0),
    }
}

/// The value, if all three are the same.
fn all_equal<T: Copy + PartialEq>([a, b, c]: [T; 3]) -> Option<T> {
    (a == b && b == c).then_some(a)
}

/// `normal` as a unit vector, turned to the side of the face that `face_normal` points to.
///
/// Models have normals that point inwards, or faces wound the wrong way; this makes both look right,
/// and the back of a face too. Where the normal is missing (zero) the face's is taken.
#[inline]
fn on_side_of(normal: Vec3, face_normal: Vec3) -> Vec3 {
    let normal = if normal.dot(face_normal) < 0.0 {
        -normal
    } else {
        normal
    };
    normal.try_normalize().unwrap_or(face_normal)
}

impl Varying {
    /// The face at an image point.
    #[inline]
    pub fn at(&self, image: DVec2) -> SurfacePoint {
        let ([w0, w1, w2], depth) = self.corners.at(image);
        let mean = |[a, b, c]: [Vec3; 3]| a * w0 as f32 + b * w1 as f32 + c * w2 as f32;
        let place = |&[p, q, r]: &[DVec2; 3]| {
            let at = p * w0 + q * w1 + r * w2;
            // Quotient rule: at = Σ p_i b_i / Σ b_i, with affine b_i.
            let [b0, b1, b2] = self.corners.weights;
            let along =
                |d0: f64, d1: f64, d2: f64| ((p - at) * d0 + (q - at) * d1 + (r - at) * d2) * depth;
            PicturePoint {
                at,
                along_x: along(b0.a, b1.a, b2.a),
                along_y: along(b0.b, b1.b, b2.b),
            }
        };
        SurfacePoint {
            normal: self.normal_of([w0, w1, w2]),
            color: self.colors.map_or(Vec3::ONE, mean),
            opacity: self.opacities.map_or(1.0, |[a, b, c]| {
                a * w0 as f32 + b * w1 as f32 + c * w2 as f32
            }),
            picture: self.picture.as_ref().map(place),
            emissive_picture: self.emissive_picture.as_deref().map(place),
        }
    }

    /// The normal alone of [`Varying::at`].
    pub fn normal_at(&self, image: DVec2) -> Vec3 {
        self.normal_of(self.corners.at(image).0)
    }

    /// The normal at barycentric coordinates.
    #[inline]
    fn normal_of(&self, [w0, w1, w2]: [f64; 3]) -> Vec3 {
        self.normals.map_or(self.face_normal, |[a, b, c]| {
            let mean = a * w0 as f32 + b * w1 as f32 + c * w2 as f32;
            on_side_of(mean, self.face_normal)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [Projection; 2] = [
        Projection::Perspective {
            tan_half_height: 0.4,
            aspect: 1.5,
        },
        Projection::Parallel {
            height: 3.0,
            aspect: 1.5,
        },
    ];

    fn camera(projection: Projection) -> Camera {
        Camera {
            eye_from_world: DMat4::IDENTITY,
            projection,
            near: 0.1,
            shift: DVec2::new(0.3, -0.6),
        }
    }

    /// Eye-space triangles: before the eye, wound either way, and with corners behind the eye.
    fn triangles() -> [[DVec3; 3]; 3] {
        let [a, b, c] = [(-0.7, -0.6, 2.0), (0.9, -0.3, 3.0), (0.1, 0.8, 2.5)].map(DVec3::from);
        let behind = DVec3::new(0.2, 1.5, -1.0);
        [[a, b, c], [c, b, a], [a, b, behind]]
    }

    #[test]
    fn a_point_of_a_triangle_gets_its_barycentric_coordinates() {
        for projection in BOTH {
            let camera = camera(projection);
            for triangle in triangles() {
                let corners = Corners::new(&camera, triangle, true);
                for expected in [[0.2, 0.5, 0.3], [0.9, 0.05, 0.05], [0.6, 0.35, 0.05]] {
                    let [v0, v1, v2] = triangle;
                    let point = v0 * expected[0] + v1 * expected[1] + v2 * expected[2];
                    assert!(point.z > 0.0);
                    let (found, _) = corners.at(camera.image_from_eye(point));
                    let off = DVec3::from(found) - DVec3::from(expected);
                    assert!(off.length() < 1e-12, "{found:?} and not {expected:?}");
                }
            }
        }
    }

    #[test]
    fn a_pixels_footprint_is_the_change_from_pixel_to_pixel() {
        for projection in BOTH {
            let camera = camera(projection);
            for triangle in triangles() {
                let face = Varying {
                    material: MaterialId(0),
                    corners: Corners::new(&camera, triangle, true),
                    face_normal: -Vec3::Z,
                    normals: None,
                    picture: Some([(0.0, 0.3), (1.0, 0.1), (0.4, 2.0)].map(DVec2::from)),
                    emissive_picture: None,
                    colors: None,
                    opacities: None,
                };
                let at = |p| face.at(p).picture.expect("it has a texture");
                let [v0, v1, v2] = triangle;
                let image = camera.image_from_eye(v0 * 0.5 + v1 * 0.3 + v2 * 0.2);
                let (here, h) = (at(image), 1e-5);
                let slope = |step: DVec2| (at(image + step).at - at(image - step).at) / (2.0 * h);
                assert!((here.along_x - slope(DVec2::new(h, 0.0))).length() < 1e-6);
                assert!((here.along_y - slope(DVec2::new(0.0, h))).length() < 1e-6);
            }
        }
    }

    #[test]
    fn a_triangle_seen_edge_on_is_evaluated_in_its_middle() {
        for projection in BOTH {
            let line = [0.0, 1.0, 2.0].map(|t| DVec3::new(t, t, 1.0));
            let (weights, _) =
                Corners::new(&camera(projection), line, true).at(DVec2::new(0.2, 0.7));
            assert_eq!(weights, [1.0 / 3.0; 3]);
        }
    }
}
