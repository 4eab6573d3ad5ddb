//! Geometries -> a mesh.

use super::document::Geometry;
use super::look::{DocumentLook, GeometryLook, Look, no_such};
use super::nested::{Item, Items};
use crate::read::error::{Place, Problem, Warnings};
use crate::read::polygon::{Cut, Polygon, PolygonCutter, usual_rounding};
use crate::read::vertices::Combinations;
use veduta::map::MaterialId;
use veduta::scene::Mesh;
use veduta_geometry::{DVec3, Vec2};

/// How the coordinates of vertices were rounded.
#[derive(Clone, Copy, Debug)]
pub enum Rounding {
    /// To whole numbers, which are multiplied by this, in metres.
    Scale(f64),
    /// As the texts of numbers usually are.
    Usual,
}

/// Makes meshes of the geometries that share a table of vertices.
pub struct MeshBuilder {
    pub positions: Vec<DVec3>,
    rounding: Rounding,
    combinations: Combinations,
    mesh: Mesh,
    // The surface in work: its corners, ring by ring.
    vertices: Vec<u32>,
    texcoords: Vec<u32>,
    ring_ends: Vec<usize>,
    points: Vec<DVec3>,
    point_texcoords: Vec<Vec2>,
    face: Vec<u32>,
}

/// What all meshes of a scene share.
pub struct Shared<'f> {
    pub cutter: PolygonCutter,
    pub look: Look<'f>,
    pub losses: Losses,
}

/// Surfaces that are not shown as the file has them: how many, and the first.
#[derive(Debug, Default)]
pub struct Losses {
    pub no_area: Loss,
    pub crossing: Loss,
    pub no_texcoords: Loss,
    pub points_and_lines: Loss,
    pub levels: Loss,
}

#[derive(Debug, Default)]
pub struct Loss {
    count: u64,
    first: Option<String>,
}

impl Loss {
    pub fn add(&mut self, place: impl FnOnce() -> String) {
        self.count += 1;
        self.first.get_or_insert_with(place);
    }
}

impl Losses {
    pub fn report(self, warnings: &mut Warnings) {
        for (loss, what) in [
            (
                self.points_and_lines,
                "points and lines have no surface; they are left out",
            ),
            (self.no_area, "a surface has no area; it is left out"),
            (
                self.crossing,
                "a surface crosses itself; its faces may overlap",
            ),
            (
                self.no_texcoords,
                "a surface has not as many texture coordinates as corners; it is shown plain",
            ),
            (
                self.levels,
                "is no level of detail, such as \"2\" or \"2.2\"; it counts as the lowest",
            ),
        ] {
            if let Some(first) = loss.first {
                let message = format!("{what} (such places: {})", loss.count);
                warnings.add(Place::Json(first), message);
            }
        }
    }
}

/// A wrong value, and the indices that lead to it in a geometry's `boundaries`.
pub struct Wrong {
    pub problem: Problem,
    pub path: Vec<usize>,
}

/// What a geometry's surfaces are in: how many arrays lie around each of them.
pub fn depth_of(kind: &str) -> Option<u32> {
    match kind {
        "MultiSurface" | "CompositeSurface" => Some(1),
        "Solid" => Some(2),
        "MultiSolid" | "CompositeSolid" => Some(3),
        _ => None,
    }
}

/// What is told of a surface, or of all surfaces in an array.
#[derive(Clone, Copy)]
struct Told<'d> {
    semantics: Item<'d>,
    material: Item<'d>,
    texture: Item<'d>,
}

/// What all surfaces of a geometry share.
struct Whole<'g, 'd, 'f> {
    geometry: &'d Geometry,
    look: &'g mut DocumentLook<'d>,
    geometry_look: GeometryLook<'d>,
    shared: &'g mut Shared<'f>,
    /// Type of the city object.
    kind: &'g str,
    /// The lowest point of a building whose surfaces are not told apart.
    lowest: Option<f64>,
    place: &'g dyn Fn() -> String,
}

impl MeshBuilder {
    pub fn new(positions: Vec<DVec3>, rounding: Rounding) -> Self {
        Self {
            combinations: Combinations::new(positions.len()),
            positions,
            rounding,
            mesh: Mesh::default(),
            vertices: Vec::new(),
            texcoords: Vec::new(),
            ring_ends: Vec::new(),
            points: Vec::new(),
            point_texcoords: Vec::new(),
            face: Vec::new(),
        }
    }

    /// Begins a mesh.
    pub fn begin(&mut self) {
        self.combinations.begin_mesh();
        self.mesh = Mesh::default();
    }

    /// The mesh since [`Self::begin`]; without faces if there were none.
    pub fn finish(&mut self) -> Mesh {
        std::mem::take(&mut self.mesh)
    }

    /// Adds the surfaces of a geometry of a city object of type `kind`. `place` tells where it
    /// stands in the file.
    pub fn add<'d>(
        &mut self,
        geometry: &'d Geometry,
        kind: &str,
        look: &mut DocumentLook<'d>,
        shared: &mut Shared<'_>,
        place: &dyn Fn() -> String,
    ) -> Result<(), Wrong> {
        let Some(depth) = depth_of(&geometry.kind) else {
            return Ok(());
        };
        let geometry_look = look.of(geometry);
        let semantics = geometry.semantics.as_ref();
        let told = Told {
            semantics: semantics.map_or(Item::Nothing, |semantics| semantics.values.item()),
            material: geometry_look.materials,
            texture: geometry_look.textures,
        };
        let is_whole_building = matches!(kind, "Building" | "BuildingPart");
        let lowest = (is_whole_building && geometry.semantics.is_none()).then(|| {
            let vertices = geometry.boundaries.numbers();
            let positions = vertices.filter_map(|v| self.positions.get(v as usize));
            positions.fold(f64::INFINITY, |lowest, p| lowest.min(p.z))
        });
        let mut whole = Whole {
            geometry,
            look,
            geometry_look,
            shared,
            kind,
            lowest,
            place,
        };
        let mut path = Vec::new();
        let boundaries = geometry.boundaries.item();
        self.descend(&mut whole, depth, boundaries, told, &mut path)
            .map_err(|problem| Wrong { problem, path })
    }

    /// Goes down through the arrays around surfaces. Where it fails, `path` leads to the place.
    fn descend(
        &mut self,
        whole: &mut Whole<'_, '_, '_>,
        depth: u32,
        item: Item<'_>,
        told: Told<'_>,
        path: &mut Vec<usize>,
    ) -> Result<(), Problem> {
        let Item::Array(items) = item else {
            let found = "no array".into();
            let expected = "arrays of shells, surfaces and rings as the geometry's type has them";
            return Err(Problem::Illegal { found, expected });
        };
        if depth == 0 {
            return self.surface(whole, items, told, path);
        }
        // What is told of an array holds for all that is in it.
        let inner = |told: Item<'_>| matches!(told, Item::Array(_));
        let (mut semantics, mut materials, mut textures) = (
            told.semantics.items(),
            told.material.items(),
            told.texture.items(),
        );
        for (index, item) in items.enumerate() {
            let mut next = told;
            if inner(told.semantics) {
                next.semantics = semantics.next().unwrap_or(Item::Nothing);
            }
            if inner(told.material) {
                next.material = materials.next().unwrap_or(Item::Nothing);
            }
            if inner(told.texture) {
                next.texture = textures.next().unwrap_or(Item::Nothing);
            }
            path.push(index);
            self.descend(whole, depth - 1, item, next, path)?;
            path.pop();
        }
        Ok(())
    }

    /// Adds a surface: an outline, and rings around holes.
    fn surface(
        &mut self,
        whole: &mut Whole<'_, '_, '_>,
        rings: Items<'_>,
        told: Told<'_>,
        path: &mut Vec<usize>,
    ) -> Result<(), Problem> {
        self.gather(rings, path)?;
        let textured = match self.gather_texcoords(rings, told.texture, whole)? {
            Some(texture) => whole.shared.look.textured(whole.look, texture)?,
            None => None,
        };
        if textured.is_none() {
            self.texcoords.clear();
        }
        let material = match textured {
            Some(material) => material,
            None => self.plain(whole, told)?,
        };
        self.point_texcoords.clear();
        for &texcoord in &self.texcoords {
            let Some([u, v]) = whole.look.texcoord(texcoord) else {
                let count = whole.look.texcoord_count();
                return Err(no_such("texture coordinate", texcoord.into(), count));
            };
            self.point_texcoords.push(Vec2::new(u as f32, v as f32));
        }
        self.cut(material, whole);
        Ok(())
    }

    /// Gathers the corners of a surface.
    fn gather(&mut self, rings: Items<'_>, path: &mut Vec<usize>) -> Result<(), Problem> {
        self.vertices.clear();
        self.points.clear();
        self.ring_ends.clear();
        for (ring_index, ring) in rings.enumerate() {
            let Item::Array(corners) = ring else {
                path.push(ring_index);
                let found = "no array".into();
                let expected = "a ring: an array of indices of vertices";
                return Err(Problem::Illegal { found, expected });
            };
            for (index, corner) in corners.enumerate() {
                let vertex = corner.number();
                let position = vertex.and_then(|v| self.positions.get(v as usize));
                if let (Some(vertex), Some(&position)) = (vertex, position) {
                    self.vertices.push(vertex);
                    self.points.push(position);
                    continue;
                }
                path.extend([ring_index, index]);
                return Err(match vertex {
                    Some(vertex) => no_such("vertex", vertex.into(), self.positions.len()),
                    None => Problem::Illegal {
                        found: "no number".into(),
                        expected: "the index of a vertex",
                    },
                });
            }
            self.ring_ends.push(self.points.len());
        }
        Ok(())
    }

    /// Gathers the texture coordinates of a surface, one for each corner; its texture.
    fn gather_texcoords(
        &mut self,
        rings: Items<'_>,
        told: Item<'_>,
        whole: &mut Whole<'_, '_, '_>,
    ) -> Result<Option<u32>, Problem> {
        self.texcoords.clear();
        let mut texture = None;
        let mut told_rings = told.items();
        for ring in rings {
            let mut told_ring = told_rings.next().unwrap_or(Item::Nothing).items();
            let Some(found) = told_ring.next().and_then(Item::number) else {
                break;
            };
            texture.get_or_insert(found);
            let numbers = told_ring.map_while(Item::number);
            self.texcoords.extend(numbers.take(ring.items().count()));
        }
        if texture.is_some() && self.texcoords.len() != self.vertices.len() {
            whole.shared.losses.no_texcoords.add(whole.place);
            return Ok(None);
        }
        Ok(texture)
    }

    /// The material of a surface without texture.
    fn plain(&self, whole: &mut Whole<'_, '_, '_>, told: Told<'_>) -> Result<MaterialId, Problem> {
        let mut kind = whole.kind;
        if let (Some(index), Some(semantics)) =
            (told.semantics.number(), whole.geometry.semantics.as_ref())
        {
            let Some(surface) = semantics.surfaces.get(index as usize) else {
                let count = semantics.surfaces.len();
                return Err(no_such("semantic surface", index.into(), count));
            };
            kind = &surface.kind;
        } else if let Some(lowest) = whole.lowest {
            kind = self.part_of_building(lowest);
        }
        let geometry = &whole.geometry_look;
        whole
            .shared
            .look
            .plain(whole.look, geometry, told.material, kind)
    }

    /// What the surface is to a building that does not tell: told by its slope and height, since
    /// not every file winds its surfaces outwards.
    fn part_of_building(&self, lowest: f64) -> &'static str {
        /// Cosine of the steepest slope of a roof, 75 degrees.
        const STEEPEST: f64 = 0.26;
        /// How far a floor may lie above a building's lowest point, in metres.
        const UNEVEN: f64 = 0.1;
        let outline = self.ring_ends.first().copied().unwrap_or(0);
        let outline = &self.points[..outline];
        let Some(&origin) = outline.first() else {
            return "WallSurface";
        };
        let normal: DVec3 = outline
            .windows(2)
            .map(|edge| (edge[0] - origin).cross(edge[1] - origin))
            .sum();
        if normal.z.abs() < STEEPEST * normal.length() {
            "WallSurface"
        } else if outline.iter().all(|p| p.z <= lowest + UNEVEN) {
            "GroundSurface"
        } else {
            "RoofSurface"
        }
    }

    /// Cuts the surface to faces.
    fn cut(&mut self, material: MaterialId, whole: &mut Whole<'_, '_, '_>) {
        let polygon = Polygon {
            points: &self.points,
            ring_ends: &self.ring_ends,
            texcoords: &self.point_texcoords,
            // Each coordinate is half a unit off at most, that is a point half a diagonal, and the
            // plane as much.
            rounding: match self.rounding {
                Rounding::Scale(scale) => 3f64.sqrt() * scale,
                Rounding::Usual => usual_rounding(&self.points),
            },
        };
        let (mesh, combinations, face) = (&mut self.mesh, &mut self.combinations, &mut self.face);
        let (vertices, texcoords) = (&self.vertices, &self.texcoords);
        let first = mesh.face_count() as u32;
        let emit = |corners: &[usize]| {
            face.clear();
            for &corner in corners {
                let texcoord = texcoords.get(corner).copied().unwrap_or(u32::MAX);
                let (vertex, is_new) = combinations.shared(vertices[corner], [texcoord, 0]);
                if is_new {
                    let uv = polygon.texcoords.get(corner);
                    if uv.is_some() || !mesh.texcoords.is_empty() {
                        mesh.texcoords.resize(mesh.positions.len(), Vec2::ZERO);
                        mesh.texcoords.push(uv.copied().unwrap_or(Vec2::ZERO));
                    }
                    mesh.positions.push(polygon.points[corner]);
                }
                face.push(vertex);
            }
            mesh.push_polygon(face);
        };
        match whole.shared.cutter.cut(&polygon, emit) {
            Cut::Sound => {}
            Cut::NoArea => whole.shared.losses.no_area.add(whole.place),
            Cut::Crossing => whole.shared.losses.crossing.add(whole.place),
        }
        let mesh = &mut self.mesh;
        let is_other = |&(_, last): &(u32, MaterialId)| last != material;
        if mesh.face_count() as u32 > first && mesh.materials.last().is_none_or(is_other) {
            mesh.materials.push((first, material));
        }
    }
}
