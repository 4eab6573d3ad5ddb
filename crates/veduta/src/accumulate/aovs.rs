use super::{Matte, Rank};

/// What is told of each pixel of a picture besides its light: "arbitrary output variables", as
/// compositing programs want them. Each channel is there or not, in rows from the top.
///
/// Depth, normal, position and the three numbers are those of *one* face, the one that covers most of
/// the pixel (of equals the first), however little that is: they are not filtered, since the
/// mean of two depths is the depth of neither. The point is the centroid of what is seen of
/// that face in the pixel, so that it always lies on it. Albedo and mattes are exact areas.
///
/// In pixels that show nothing depth is [`Aovs::FARTHEST`], the numbers are [`Aovs::NOTHING`], and all
/// else is 0, as the picture's opacity is there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aovs {
    /// Depth in metres along the line of sight's axis (not along the ray), larger is farther.
    pub depth: Option<Vec<f32>>,
    /// Unit normal in world space, towards the eye; interpolated where the model has normals.
    pub normal: Option<Vec<[f32; 3]>>,
    /// Position in world space, in metres from the world's origin.
    pub position: Option<Vec<[f32; 3]>>,
    /// Colour without light, textures and all: linear Rec.709, premultiplied.
    pub albedo: Option<Vec<[f32; 3]>>,
    /// Row of the object in [`Scene::objects`](crate::scene::Scene::objects).
    pub object: Option<Vec<u32>>,
    /// Row of the material in [`Scene::materials`](crate::scene::Scene::materials).
    pub material: Option<Vec<u32>>,
    /// Number of the face in its object's mesh.
    pub face: Option<Vec<u32>>,
    /// What objects cover.
    pub object_matte: Option<Matte>,
    /// What materials cover.
    pub material_matte: Option<Matte>,
}

/// Which channels of [`Aovs`] are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovSettings {
    /// [`Aovs::depth`].
    pub depth: bool,
    /// [`Aovs::normal`].
    pub normal: bool,
    /// [`Aovs::position`].
    pub position: bool,
    /// [`Aovs::albedo`].
    pub albedo: bool,
    /// [`Aovs::object`].
    pub object: bool,
    /// [`Aovs::material`].
    pub material: bool,
    /// [`Aovs::face`].
    pub face: bool,
    /// Ranks of [`Aovs::object_matte`]; 0 for none.
    pub object_ranks: usize,
    /// Ranks of [`Aovs::material_matte`]; 0 for none.
    pub material_ranks: usize,
}

impl AovSettings {
    /// Whether nothing is asked for.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl Aovs {
    /// Depth of what shows nothing, in metres. Finite, since an infinity would spread through every
    /// filter that follows; the number is Blender's.
    pub const FARTHEST: f32 = 1e10;

    /// Number of what shows nothing.
    pub const NOTHING: u32 = u32::MAX;

    /// Channels of `pixels` pixels that show nothing.
    pub fn new(settings: &AovSettings, pixels: usize) -> Self {
        fn channel<T: Clone>(wanted: bool, pixels: usize, value: T) -> Option<Vec<T>> {
            wanted.then(|| vec![value; pixels])
        }
        let matte = |ranks: usize| {
            (ranks > 0).then(|| Matte {
                ranks,
                rows: vec![Rank::FREE; ranks * pixels],
                most: 0,
            })
        };
        Self {
            depth: channel(settings.depth, pixels, Self::FARTHEST),
            normal: channel(settings.normal, pixels, [0.0; 3]),
            position: channel(settings.position, pixels, [0.0; 3]),
            albedo: channel(settings.albedo, pixels, [0.0; 3]),
            object: channel(settings.object, pixels, Self::NOTHING),
            material: channel(settings.material, pixels, Self::NOTHING),
            face: channel(settings.face, pixels, Self::NOTHING),
            object_matte: matte(settings.object_ranks),
            material_matte: matte(settings.material_ranks),
        }
    }

    /// Overwrites the pixels from `first` on with those of `part`, which must have the same channels.
    ///
    /// # Panics
    /// If `part` goes beyond the picture, or has a channel that this has not.
    pub fn put(&mut self, first: usize, part: &Aovs) {
        fn put<T: Copy>(whole: &mut Option<Vec<T>>, first: usize, part: &Option<Vec<T>>) {
            if let Some(part) = part {
                let whole = whole.as_mut().expect("the same channels");
                whole[first..first + part.len()].copy_from_slice(part);
            }
        }
        fn put_matte(whole: &mut Option<Matte>, first: usize, part: &Option<Matte>) {
            if let Some(part) = part {
                let whole = whole.as_mut().expect("the same channels");
                let first = first * whole.ranks;
                whole.rows[first..first + part.rows.len()].copy_from_slice(&part.rows);
                whole.most = whole.most.max(part.most);
            }
        }
        put(&mut self.depth, first, &part.depth);
        put(&mut self.normal, first, &part.normal);
        put(&mut self.position, first, &part.position);
        put(&mut self.albedo, first, &part.albedo);
        put(&mut self.object, first, &part.object);
        put(&mut self.material, first, &part.material);
        put(&mut self.face, first, &part.face);
        put_matte(&mut self.object_matte, first, &part.object_matte);
        put_matte(&mut self.material_matte, first, &part.material_matte);
    }
}
