//! What a camera sees at a point of its picture.

use crate::exit::{Code, Failure};
use crate::talk::plain;
use crate::values::Size;
use serde_json::{Value, json};
use std::fmt::Write;
use std::str::FromStr;
use veduta::dice::{PixelGrid, coverage};
use veduta::map::{FaceId, ObjectId, VisibilityMap};
use veduta::pipeline;
use veduta::scene::Scene;
use veduta_geometry::{DVec2, DVec3};

/// A point of a picture in pixels, x right, y down, from the top left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot(DVec2);

impl FromStr for Spot {
    type Err = String;

    /// `12,7` is the middle of a pixel, `12.5,7.0` a point.
    fn from_str(text: &str) -> Result<Self, String> {
        let coordinate = |text: &str| -> Option<f64> {
            let text = text.trim();
            if let Ok(pixel) = text.parse::<u32>() {
                return Some(f64::from(pixel) + 0.5);
            }
            text.parse().ok().filter(|number: &f64| number.is_finite())
        };
        text.split_once(',')
            .and_then(|(x, y)| Some(Self(DVec2::new(coordinate(x)?, coordinate(y)?))))
            .ok_or_else(|| "expected X,Y in pixels, such as 640,480 or 640.25,480.75".into())
    }
}

/// What is seen.
#[derive(Debug)]
pub struct Picked {
    spot: DVec2,
    pixel: [u32; 2],
    /// At the point itself; `None` for the background.
    seen: Option<Seen>,
    /// What that is seen through, nearest first.
    through: Vec<Seen>,
    /// Which opaque faces cover how much of the pixel, largest first.
    shares: Vec<Share>,
    /// Linear light of the pixel, premultiplied, with its opacity.
    light: [f32; 4],
    /// What the world's origin is, where the world is somewhere.
    origin: Option<(String, DVec3)>,
}

#[derive(Debug)]
struct Seen {
    object: String,
    face: u32,
    material: String,
    /// World coordinates, in metres.
    position: DVec3,
    /// Unit normal of the face, in world space, towards the eye.
    normal: DVec3,
    /// Along the line of sight's axis, in metres.
    depth: f64,
    /// From the eye, or, in parallel projection, from the plane it stands in, in metres.
    distance: f64,
}

#[derive(Debug)]
struct Share {
    object: String,
    face: u32,
    /// In square pixels.
    area: f64,
}

/// Finds what `map`, which is of `scene`, shows at `spot` of a picture of that size.
pub fn pick(scene: &Scene, map: &VisibilityMap, size: Size, spot: Spot) -> Result<Picked, Failure> {
    let Spot(spot) = spot;
    let (width, height) = (f64::from(size.width), f64::from(size.height));
    if spot.min_element() < 0.0 || spot.x >= width || spot.y >= height {
        let message = format!(
            "--pick {},{} lies outside the picture of {width} x {height} pixels; give its size by --size",
            spot.x, spot.y
        );
        return Err(Failure::new(Code::Usage, message));
    }
    let frame = PixelGrid::of_frame(size.width, size.height);
    let corner = spot.floor();
    let pixel = frame.window(corner.x, corner.y, 1, 1);
    let image = frame.image_from_pixels(spot);
    let seen = map
        .opaque_at(image)
        .map(|fragment| seen_at(scene, map, map.opaque.face(fragment), &frame, spot));
    let veils = map.veils_at(image).into_iter();
    let through = veils.map(|veil| seen_at(scene, map, map.veils.face(veil), &frame, spot));
    let mut shares: Vec<Share> = coverage(map, &pixel)
        .into_iter()
        .map(|row| Share {
            object: scene.object(map.faces.object(row.face)).name.clone(),
            face: map.faces.source(row.face),
            area: row.area,
        })
        .collect();
    // Stable: of equal areas the smaller face comes first.
    shares.sort_by(|a, b| b.area.total_cmp(&a.area));
    let picture = pipeline::render_window(scene, map, &pixel, false);
    let world = &scene.world;
    Ok(Picked {
        spot,
        pixel: [corner.x as u32, corner.y as u32],
        seen,
        through: through.collect(),
        shares,
        light: picture.pixels[0],
        origin: world.crs.clone().map(|crs| (crs, world.origin)),
    })
}

fn seen_at(
    scene: &Scene,
    map: &VisibilityMap,
    face: FaceId,
    frame: &PixelGrid,
    spot: DVec2,
) -> Seen {
    let camera = &map.camera;
    let image = frame.image_from_pixels(spot);
    let nearness = map.faces.face_nearness(face).at(image);
    let eye = camera.eye_from_image(image, nearness);
    let world_from_eye = camera.eye_from_world.inverse();
    let position = world_from_eye.transform_point3(eye);
    let (origin, _) = camera.eye_ray(image);
    let object = map.faces.object(face);
    let source = map.faces.source(face);
    let towards_eye = world_from_eye.transform_vector3(origin - eye);
    let normal = normal_of(scene, object, source);
    Seen {
        object: scene.object(object).name.clone(),
        face: source,
        material: scene.material_of(object, source).name.clone(),
        position,
        normal: if normal.dot(towards_eye) < 0.0 {
            -normal
        } else {
            normal
        },
        depth: eye.z,
        distance: (eye - origin).length(),
    }
}

/// Unit normal of a face in world space, to either side.
fn normal_of(scene: &Scene, object: ObjectId, face: u32) -> DVec3 {
    let mesh = scene.mesh_of(object);
    let place = scene.object(object).world_from_object;
    let [a, b, c] = mesh.triangles[mesh.triangles_of(face).start]
        .map(|corner| place.transform_point3(mesh.positions[corner as usize]));
    (b - a).cross(c - a).normalize_or_zero()
}

impl Picked {
    pub fn as_json(&self) -> Value {
        let told = |seen: &Seen| {
            let mut told = json!({
                "object": seen.object,
                "face": seen.face,
                "material": seen.material,
                "position": seen.position.to_array(),
                "normal": seen.normal.to_array(),
                "depth": seen.depth,
                "distance": seen.distance,
            });
            if let Some((crs, origin)) = &self.origin {
                told["crs"] = crs.as_str().into();
                told["coordinates"] = json!((*origin + seen.position).to_array());
            }
            told
        };
        let shares: Vec<Value> = self
            .shares
            .iter()
            .map(|share| json!({ "object": share.object, "face": share.face, "area": share.area }))
            .collect();
        json!({
            "pick": self.spot.to_array(),
            "pixel": self.pixel,
            "seen": self.seen.as_ref().map(told),
            "through": self.through.iter().map(told).collect::<Vec<Value>>(),
            "faces": shares,
            "background": self.background(),
            "light": self.light,
        })
    }

    /// Area of the pixel in which nothing is seen. Rounding may leave less than nothing.
    fn background(&self) -> f64 {
        let covered: f64 = self.shares.iter().map(|share| share.area).sum();
        (1.0 - covered).max(0.0)
    }

    pub fn as_text(&self) -> String {
        let mut text = String::new();
        self.write_text(&mut text).expect("strings grow");
        text
    }

    fn write_text(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "  at        {}, {} px", self.spot.x, self.spot.y)?;
        match &self.seen {
            None => writeln!(text, "  seen      nothing but the background")?,
            Some(seen) => {
                let DVec3 { x, y, z } = seen.position;
                writeln!(text, "  object    {}", plain(&seen.object))?;
                writeln!(
                    text,
                    "  face      {}, counted from 0 in the object",
                    seen.face
                )?;
                writeln!(text, "  material  {}", plain(&seen.material))?;
                writeln!(text, "  position  {x:.6}, {y:.6}, {z:.6} m")?;
                if let Some((crs, origin)) = &self.origin {
                    let DVec3 { x, y, z } = *origin + seen.position;
                    writeln!(text, "  in {crs:10}  {x:.3}, {y:.3}, {z:.3}")?;
                }
                let DVec3 { x, y, z } = seen.normal;
                writeln!(text, "  faces     {x:.4}, {y:.4}, {z:.4}")?;
                writeln!(
                    text,
                    "  depth     {:.6} m along the view; {:.6} m from the eye",
                    seen.depth, seen.distance
                )?;
            }
        }
        for veil in &self.through {
            let (object, material) = (plain(&veil.object), plain(&veil.material));
            writeln!(
                text,
                "  through   {object}, face {}, {material}, {:.6} m from the eye",
                veil.face, veil.distance
            )?;
        }
        let [column, row] = self.pixel;
        writeln!(text, "  pixel     {column}, {row} shows")?;
        for share in self.shares.iter().take(MOST_SHARES) {
            let name = plain(&share.object);
            writeln!(text, "    {:10.6}  {name}, face {}", share.area, share.face)?;
        }
        if self.shares.len() > MOST_SHARES {
            let rest: f64 = self.shares[MOST_SHARES..].iter().map(|row| row.area).sum();
            let count = self.shares.len() - MOST_SHARES;
            writeln!(text, "    {rest:10.6}  {count} more faces")?;
        }
        let background = self.background();
        if background > 1e-9 {
            writeln!(text, "    {background:10.6}  the background")?;
        }
        let [r, g, b, _] = self.light;
        writeln!(
            text,
            "  light     {r:.6} {g:.6} {b:.6}, linear, of the whole pixel"
        )
    }
}

/// Faces of a pixel that are listed for people.
const MOST_SHARES: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_mean_pixels_and_others_points() {
        let at = |x, y| Ok(Spot(DVec2::new(x, y)));
        assert_eq!("12,7".parse(), at(12.5, 7.5));
        assert_eq!("12.0, 7.25".parse(), at(12.0, 7.25));
        assert_eq!("0,0.0".parse(), at(0.5, 0.0));
        for text in ["12", "1,2,3", "a,b", "nan,1", ""] {
            assert!(text.parse::<Spot>().is_err(), "{text}");
        }
    }
}
