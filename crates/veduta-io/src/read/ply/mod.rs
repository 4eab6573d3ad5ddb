//! PLY, the Stanford polygon format: text, or binary of either byte order.
//!
//! Bytes -> [`header`] (tables and columns) -> [`rows`] (numbers) -> [`tables`] -> faces. Read are
//! positions, normals, colours and texture coordinates of vertices; faces of any number of corners
//! with colours or texture coordinates of their own; triangle strips. Other tables and columns are
//! passed over, and vertex colours win over face colours.
//!
//! Colours in whole numbers are sRGB, those in fractions linear. Texture coordinates begin at the
//! bottom left of the picture, which a comment `TextureFile` names.

mod header;
mod rows;
mod tables;

use super::budget::Budget;
use super::error::{Fault, Place, Problem, Warnings};
use super::finish::{finish_mesh, push_face};
use super::picture::PictureDecoder;
use super::polygon::{Cut, Polygon, PolygonCutter, usual_rounding};
use super::vertices::Combinations;
use rows::Rows;
use std::collections::HashMap;
use std::path::Path;
use tables::Tables;
use veduta::map::MaterialId;
use veduta::scene::{ImageId, Material, Mesh, MeshId, Object, Scene, TextureRef};
use veduta_geometry::{DMat4, DVec3, Vec2};

pub(crate) use header::MAGIC;

/// Reads a scene of one object, named like the file.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Scene, Fault> {
    let header = header::read(bytes)?;
    let mut rows = Rows::new(bytes, header.encoding, header.length, header.lines);
    let tables = tables::read(&header, &mut rows, budget)?;
    if tables.face_ends.is_empty() && !tables.positions.is_empty() {
        let points = tables.positions.len();
        return Err(Problem::PointCloud { points }.at(Place::Whole));
    }
    let mut mesh = assemble(&tables, warnings);
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut scene = Scene::default();
    let mut material = Material {
        name: name.clone().into_owned(),
        ..Material::default()
    };
    if !mesh.colors.is_empty() {
        material.base_color = [1.0; 4];
    }
    if let Some(texture) = header
        .textures
        .first()
        .filter(|_| !mesh.texcoords.is_empty())
    {
        let decoded = budget
            .files
            .read(&path.parent().unwrap_or(Path::new("")).join(texture))
            .map_err(|error| format!("cannot be read: {}", crate::reason(&error)))
            .and_then(|bytes| PictureDecoder::new().decode(texture, &bytes));
        match decoded {
            Ok(image) => {
                scene.images.push(image);
                material.base_color = [1.0; 4];
                material.base_color_texture = Some(TextureRef::new(ImageId(0)));
            }
            Err(why) => {
                let message = format!("the texture {texture:?} {why}; plain colours are shown");
                warnings.add(Place::Whole, message);
            }
        }
        if header.textures.len() > 1 {
            let message = "names several textures; the first is shown everywhere";
            warnings.add(Place::Whole, message);
        }
    }
    scene.materials.push(material);
    if mesh.triangles.is_empty() {
        return Ok(scene);
    }
    mesh.materials.push((0, MaterialId(0)));
    finish_mesh(&mut mesh, &name, &Place::Whole, warnings)?;
    scene.meshes.push(mesh);
    scene.objects.push(Object {
        name: name.into_owned(),
        mesh: MeshId(0),
        world_from_object: DMat4::IDENTITY,
    });
    Ok(scene)
}

/// The mesh of the tables' faces.
fn assemble(tables: &Tables, warnings: &mut Warnings) -> Mesh {
    let mut mesh = Mesh::default();
    let mut vertices = Vertices::new(tables, &mut mesh);
    let mut cutter = PolygonCutter::new();
    let (mut points, mut texcoords): (Vec<DVec3>, Vec<Vec2>) = (Vec::new(), Vec::new());
    let mut face = Vec::new();
    let (mut without_area, mut crossing) = (0u64, 0u64);
    let mut start = 0;
    for (row, &end) in tables.face_ends.iter().enumerate() {
        let corners = start..end;
        start = end;
        if corners.len() == 3 {
            let triangle = [0, 1, 2].map(|k| vertices.of(corners.start + k, row, &mut mesh));
            mesh.push_polygon(&triangle);
            continue;
        }
        points.clear();
        points.extend(
            tables.corners[corners.clone()]
                .iter()
                .map(|&vertex| tables.positions[vertex as usize]),
        );
        texcoords.clear();
        texcoords.extend(corners.clone().filter_map(|corner| tables.texcoord(corner)));
        let polygon = Polygon {
            points: &points,
            ring_ends: &[points.len()],
            texcoords: &texcoords,
            rounding: usual_rounding(&points),
        };
        let cut = cutter.cut(&polygon, |part| {
            face.clear();
            face.extend(
                part.iter()
                    .map(|&corner| vertices.of(corners.start + corner, row, &mut mesh)),
            );
            push_face(&mut mesh, &face);
        });
        without_area += u64::from(cut == Cut::NoArea);
        crossing += u64::from(cut == Cut::Crossing);
    }
    for (count, what) in [
        (
            tables.too_few_corners,
            "faces have fewer than 3 corners; they are left out",
        ),
        (without_area, "polygons have no area; they are left out"),
        (
            crossing,
            "faces cross themselves; their triangles may overlap",
        ),
    ] {
        if count > 0 {
            warnings.add(Place::Whole, format!("{count} {what}"));
        }
    }
    mesh
}

/// The vertices of a mesh: those of the file, or where faces have attributes of their own the
/// combinations of both.
struct Vertices<'t> {
    tables: &'t Tables,
    combined: Option<Combined>,
}

struct Combined {
    combinations: Combinations,
    texcoords: HashMap<[u32; 2], u32>,
    colors: HashMap<[u32; 3], u32>,
}

impl<'t> Vertices<'t> {
    fn new(tables: &'t Tables, mesh: &mut Mesh) -> Self {
        let combined = if tables.corner_texcoords.is_empty() && tables.face_colors.is_empty() {
            mesh.positions = tables.positions.clone();
            mesh.normals = tables.normals.clone();
            mesh.texcoords = tables.texcoords.clone();
            mesh.colors = tables.colors.clone();
            None
        } else {
            let mut combinations = Combinations::new(tables.positions.len());
            combinations.begin_mesh();
            Some(Combined {
                combinations,
                texcoords: HashMap::new(),
                colors: HashMap::new(),
            })
        };
        Self { tables, combined }
    }

    /// The vertex at a corner of the face `row`.
    fn of(&mut self, corner: usize, row: usize, mesh: &mut Mesh) -> u32 {
        let tables = self.tables;
        let vertex = tables.corners[corner];
        let Some(combined) = &mut self.combined else {
            return vertex;
        };
        let texcoord = tables.texcoord(corner);
        let color = match tables.colors.get(vertex as usize) {
            Some(color) => Some(*color),
            None => tables.face_colors.get(row).copied(),
        };
        let texcoord_id = texcoord.map_or(0, |uv| {
            let made = combined.texcoords.len() as u32;
            let key = uv.to_array().map(f32::to_bits);
            *combined.texcoords.entry(key).or_insert(made)
        });
        let color_id = color.map_or(0, |color| {
            let made = combined.colors.len() as u32;
            *combined
                .colors
                .entry(color.map(f32::to_bits))
                .or_insert(made)
        });
        let attributes = [texcoord_id, color_id];
        let (made, is_new) = combined.combinations.shared(vertex, attributes);
        if is_new {
            mesh.positions.push(tables.positions[vertex as usize]);
            mesh.normals.extend(tables.normals.get(vertex as usize));
            mesh.texcoords.extend(texcoord);
            mesh.colors.extend(color);
        }
        made
    }
}
