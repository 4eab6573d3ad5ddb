use super::cryptomatte::{Cryptomatte, collisions};
use super::{Channel, WriteProblem};
use crate::Samples;
use exr::meta::header::LayerAttributes;
use veduta::accumulate::{Aovs, Picture};
use veduta::dice::PixelGrid;
use veduta::map::{Camera, Projection};
use veduta::scene::Scene;
use veduta_geometry::{DMat4, DVec2, DVec3, DVec4};

/// What an EXR tells of its pixels beside R, G, B and A, and of the camera that saw them.
///
/// | of [`Aovs`] | channels | stored as |
/// | --- | --- | --- |
/// | `depth` | `Z` | f32 |
/// | `normal` | `N.X`, `N.Y`, `N.Z` | as the picture's light |
/// | `position` | `P.X`, `P.Y`, `P.Z` | f32 |
/// | `albedo` | `albedo.R`, `albedo.G`, `albedo.B` | as the picture's light |
/// | `object`, `material`, `face` | `id.object`, `id.material`, `id.face`: row + 1, and 0 for nothing | u32 |
/// | `object_matte` | `CryptoObject00.R` …: Cryptomatte | f32 |
/// | `material_matte` | `CryptoMaterial00.R` … | f32 |
///
/// The camera goes into the attributes `worldToCamera` (x right, y up, z forward) and `worldToNDC` (0 to
/// 1 over the picture, x right, y down; z from 0 at the near plane to 1 in the distance, in
/// parallel projection metres from the near plane), for vectors that stand to the left of the matrix.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    /// The channels, of as many pixels as the picture has.
    pub aovs: &'a Aovs,
    /// The scene they were made of, for names.
    pub scene: &'a Scene,
    /// Who saw it.
    pub camera: &'a Camera,
    /// Where the picture's pixels lie in the camera's frame.
    pub grid: PixelGrid,
}

impl<'a> Layers<'a> {
    /// Pairs of objects or of materials whose names are different but have the same Cryptomatte id, so
    /// that their mattes cannot be told apart. Of 10,000 names that happens to one scene in a hundred.
    pub fn collisions(&self) -> Vec<[&'a str; 2]> {
        let mut found = Vec::new();
        if self.aovs.object_matte.is_some() {
            found.extend(collisions(object_names(self.scene)));
        }
        if self.aovs.material_matte.is_some() {
            found.extend(collisions(material_names(self.scene)));
        }
        found
    }

    /// Fails if the channels have other pixels than the picture.
    pub(super) fn check(&self, picture: &Picture) -> Result<(), WriteProblem> {
        let Aovs {
            depth,
            normal,
            position,
            albedo,
            object,
            material,
            face,
            object_matte,
            material_matte,
        } = self.aovs;
        fn length<T>(channel: &Option<Vec<T>>) -> Option<usize> {
            channel.as_ref().map(Vec::len)
        }
        let mattes = [object_matte, material_matte].map(|matte| {
            let matte = matte.as_ref()?;
            Some(matte.rows.len().checked_div(matte.ranks).unwrap_or(0))
        });
        let lengths = [
            length(depth),
            length(normal),
            length(position),
            length(albedo),
            length(object),
            length(material),
            length(face),
        ];
        let expected = picture.pixels.len();
        match lengths
            .into_iter()
            .chain(mattes)
            .flatten()
            .find(|&found| found != expected)
        {
            None => Ok(()),
            Some(found) => Err(WriteProblem::Encode(format!(
                "a layer has {found} pixels, and the picture {expected}"
            ))),
        }
    }

    pub(super) fn add_channels(&self, samples: Samples, channels: &mut Vec<Channel<'a>>) {
        let aovs = self.aovs;
        if let Some(depth) = &aovs.depth {
            channels.push(Channel::of_floats("Z", |pixel| depth[pixel]));
        }
        let axes = ["X", "Y", "Z"].into_iter().enumerate();
        for (k, axis) in axes {
            if let Some(normal) = &aovs.normal {
                let value = move |pixel: usize| normal[pixel][k];
                channels.push(Channel::of_light(format!("N.{axis}"), samples, value));
            }
            if let Some(position) = &aovs.position {
                let value = move |pixel: usize| position[pixel][k];
                channels.push(Channel::of_floats(format!("P.{axis}"), value));
            }
        }
        if let Some(albedo) = &aovs.albedo {
            for (k, letter) in ["R", "G", "B"].into_iter().enumerate() {
                let value = move |pixel: usize| albedo[pixel][k];
                channels.push(Channel::of_light(
                    format!("albedo.{letter}"),
                    samples,
                    value,
                ));
            }
        }
        for (name, numbers) in [
            ("id.object", &aovs.object),
            ("id.material", &aovs.material),
            ("id.face", &aovs.face),
        ] {
            if let Some(numbers) = numbers {
                // NOTHING becomes 0.
                let value = |pixel: usize| numbers[pixel].wrapping_add(1);
                channels.push(Channel::of_numbers(name, value));
            }
        }
        for cryptomatte in self.cryptomattes() {
            cryptomatte.add_channels(channels);
        }
    }

    pub(super) fn add_attributes(&self, attributes: &mut LayerAttributes) {
        for cryptomatte in self.cryptomattes() {
            cryptomatte.add_attributes(attributes);
        }
        let [world_to_camera, world_to_ndc] = matrices(self.camera, &self.grid);
        attributes.world_to_camera = Some(world_to_camera);
        attributes.world_to_normalized_device = Some(world_to_ndc);
    }

    fn cryptomattes(&self) -> impl Iterator<Item = Cryptomatte<'a>> {
        let aovs = self.aovs;
        let objects = aovs.object_matte.as_ref().map(|matte| {
            Cryptomatte::new("CryptoObject", matte, object_names(self.scene).collect())
        });
        let materials = aovs.material_matte.as_ref().map(|matte| {
            Cryptomatte::new(
                "CryptoMaterial",
                matte,
                material_names(self.scene).collect(),
            )
        });
        objects.into_iter().chain(materials)
    }
}

fn object_names(scene: &Scene) -> impl Iterator<Item = &str> {
    scene.objects.iter().map(|object| told(&object.name))
}

fn material_names(scene: &Scene) -> impl Iterator<Item = &str> {
    scene.materials.iter().map(|material| told(&material.name))
}

/// A name that can be picked from a list.
fn told(name: &str) -> &str {
    if name.is_empty() {
        "(without name)"
    } else {
        name
    }
}

/// `worldToCamera` and `worldToNDC`. Our matrices stand to the left of vectors and are stored column by
/// column, which is the same numbers.
fn matrices(camera: &Camera, grid: &PixelGrid) -> [[f32; 16]; 2] {
    let turn = DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0));
    let world_to_camera = turn * camera.eye_from_world;
    let size = DVec2::new(grid.width.into(), grid.height.into());
    let scale = camera.image_scale() * grid.pixels_per_frame / size;
    let ahead = grid.pixels_from_image(camera.principal_point()) / size;
    let x = DVec4::new(scale.x, 0.0, 0.0, 0.0);
    let y = DVec4::new(0.0, scale.y, 0.0, 0.0);
    let (z, w) = match camera.projection {
        Projection::Perspective { .. } => (
            DVec4::new(ahead.x, ahead.y, 1.0, 1.0),
            DVec4::new(0.0, 0.0, -camera.near, 0.0),
        ),
        Projection::Parallel { .. } => (
            DVec4::new(0.0, 0.0, 1.0, 0.0),
            DVec4::new(ahead.x, ahead.y, -camera.near, 1.0),
        ),
    };
    let world_to_ndc = DMat4::from_cols(x, y, z, w) * camera.eye_from_world;
    [world_to_camera, world_to_ndc].map(|matrix| matrix.as_mat4().to_cols_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_get_to_their_place_in_the_picture_by_the_matrix() {
        for projection in [
            Projection::Perspective {
                tan_half_height: 0.4,
                aspect: 1.5,
            },
            Projection::Parallel {
                height: 3.0,
                aspect: 1.5,
            },
        ] {
            let eye = DVec3::new(3.0, -5.0, 2.0);
            let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.25);
            let mut camera = camera.expect("a sound camera");
            camera.shift = DVec2::new(0.1, -0.2);
            // A window of a larger picture.
            let grid = PixelGrid::of_frame(60, 40).window(10.0, -5.0, 32, 24);
            let [to_camera, to_ndc] = matrices(&camera, &grid);
            // A row vector times a matrix whose rows are stored one after the other.
            let times = |point: DVec3, matrix: [f32; 16]| -> [f64; 4] {
                let row = [point.x, point.y, point.z, 1.0];
                std::array::from_fn(|column| {
                    (0..4)
                        .map(|k| row[k] * f64::from(matrix[4 * k + column]))
                        .sum()
                })
            };
            for point in [DVec3::ZERO, DVec3::new(0.5, 0.25, -0.75)] {
                let in_eye = camera.eye_from_world.transform_point3(point);
                let [x, y, z, w] = times(point, to_camera);
                let expected = DVec3::new(in_eye.x, -in_eye.y, in_eye.z);
                assert!((DVec3::new(x, y, z) - expected).length() < 1e-5 && w == 1.0);
                let [x, y, z, w] = times(point, to_ndc);
                let pixels = grid.pixels_from_image(camera.image_from_eye(in_eye));
                let expected = pixels / DVec2::new(32.0, 24.0);
                assert!((DVec2::new(x, y) / w - expected).length() < 1e-5, "{point}");
                assert!((z - (in_eye.z - camera.near)).abs() < 1e-5);
            }
        }
    }
}
