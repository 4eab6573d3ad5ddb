//! CityJSON 1.0, 1.1 and 2.0, and CityJSONSeq: a document a line, the first of which has what the
//! others share.
//!
//! Bytes -> [`document`] (the JSON, its arrays of indices [`nested`] as they are) -> for each city
//! object the geometries of one level of detail -> [`surfaces`] (a mesh), which [`look`] gives
//! materials -> scene. Vertices are taken relative to a local origin, which the scene's world keeps.
//!
//! A city object becomes an object of the scene, named by its id behind those of its parents.
//! Faces are seen from both sides. Material colours are taken as linear. Attributes, addresses,
//! extensions, points and lines are passed over.

mod document;
mod lod;
mod look;
mod nested;
mod surfaces;

pub use lod::{LevelOfDetail, LevelOfDetailError};

use super::budget::Budget;
use super::error::{Fault, Place, Problem, Warnings};
use super::files::shortened;
use super::finish::finish_mesh;
use super::names::unique;
use super::polygon::PolygonCutter;
use document::{Appearance, CityObject, Document, Geometry, Transform};
use look::{DocumentLook, Look, at, no_such};
use std::collections::HashMap;
use std::path::Path;
use surfaces::{Losses, MeshBuilder, Rounding, Shared, Wrong, depth_of};
use veduta::scene::{Mesh, MeshId, Object, Scene, World};
use veduta_geometry::{DMat4, DVec3, DVec4};

/// Reads a scene. Of each object the level of detail is shown that comes next to `level` from below,
/// or else from above; without one, the highest.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    level: Option<LevelOfDetail>,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Scene, Fault> {
    // A byte order mark is not JSON, but some editors leave one.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let (first, features) = split_sequence(path, bytes);
    let mut header = parse(first)?;
    check_header(&header)?;
    let transform = transform_of(&header)?;
    let objects = std::mem::take(&mut header.city_objects).0;
    let vertices = std::mem::take(&mut header.vertices);

    let none = Appearance::default();
    let template_vertices = header.templates.as_ref().map(|t| t.vertices.as_slice());
    let template_positions = template_vertices.unwrap_or_default().iter();
    let mut city = City {
        level,
        transform,
        scene: Scene::default(),
        origin: None,
        shared: Shared {
            cutter: PolygonCutter::new(),
            look: Look::new(path.parent().unwrap_or(Path::new(""))),
            losses: Losses::default(),
        },
        templates: header.templates.as_ref().map_or(&[], |t| &t.templates),
        template_look: DocumentLook::new(&header, &none),
        template_builder: MeshBuilder::new(
            template_positions.map(|&p| DVec3::from_array(p)).collect(),
            Rounding::Usual,
        ),
        template_meshes: HashMap::new(),
        names: HashMap::new(),
        budget,
        warnings,
    };
    city.add(&objects, vertices, &mut DocumentLook::new(&header, &none))?;
    for (line, number) in features.split(|&byte| byte == b'\n').zip(2..) {
        if line.trim_ascii().is_empty() {
            continue;
        }
        city.add_feature(line).map_err(|fault| Fault {
            place: match fault.place {
                Place::Json(path) => Place::JsonInLine { line: number, path },
                _ => Place::Line(number),
            },
            problem: fault.problem,
        })?;
    }
    let metadata = header.metadata.as_ref();
    let crs = metadata.and_then(|metadata| metadata.reference_system.as_deref());
    Ok(city.finish(crs))
}

/// The first document, and the lines behind it if the file is a sequence.
fn split_sequence<'b>(path: &Path, bytes: &'b [u8]) -> (&'b [u8], &'b [u8]) {
    let end = bytes.iter().position(|&byte| byte == b'\n');
    let (line, rest) = match end {
        Some(end) => (&bytes[..end], &bytes[end + 1..]),
        None => (bytes, [].as_slice()),
    };
    let is_document = line.trim_ascii().ends_with(b"}") && rest.trim_ascii().starts_with(b"{");
    let suffix = path.extension().unwrap_or_default();
    if is_document || suffix.eq_ignore_ascii_case("jsonl") {
        (line, rest)
    } else {
        (bytes, &[])
    }
}

/// Parses the JSON; the error names the path of the value that is wrong.
fn parse(json: &[u8]) -> Result<Document, Fault> {
    if let Ok(document) = serde_json::from_slice(json) {
        return Ok(document);
    }
    // Once more, with the path, which sound files should not wait for.
    let mut deserializer = serde_json::Deserializer::from_slice(json);
    let error = match serde_path_to_error::deserialize::<_, Document>(&mut deserializer) {
        Err(error) => error,
        // What stands behind the document is wrong.
        Ok(document) => match deserializer.end() {
            Ok(()) => return Ok(document),
            Err(error) => return Err(not_valid(&error).at(Place::Whole)),
        },
    };
    let path = error.path().to_string();
    let problem = not_valid(error.inner());
    Err(match path.as_str() {
        "." | "?" => problem.at(Place::Whole),
        _ => at(problem, || path),
    })
}

fn not_valid(error: &serde_json::Error) -> Problem {
    Problem::NotValid {
        format: "CityJSON",
        found: error.to_string(),
    }
}

fn check_header(header: &Document) -> Result<(), Fault> {
    if header.kind != "CityJSON" {
        let found = format!("{:?}", shortened(&header.kind));
        let expected = "\"CityJSON\"; the first line of a sequence, too, has this type";
        return Err(at(Problem::Illegal { found, expected }, || "type".into()));
    }
    let version = header.version.as_deref().unwrap_or("0");
    if !["1.0", "1.1", "2.0"]
        .iter()
        .any(|known| version.starts_with(known))
    {
        let found = format!("CityJSON {}", shortened(version).escape_debug());
        let expected = "CityJSON 1.0, 1.1 or 2.0";
        return Err(at(Problem::Version { found, expected }, || {
            "version".into()
        }));
    }
    Ok(())
}

fn transform_of(header: &Document) -> Result<Option<Transform>, Fault> {
    let Some(transform) = header.transform else {
        // In CityJSON 1.0 vertices could be plain coordinates.
        if header
            .version
            .as_deref()
            .is_some_and(|v| v.starts_with("1.0"))
        {
            return Ok(None);
        }
        return Err(Problem::Lacks("transform").at(Place::Whole));
    };
    if transform.scale.iter().any(|&scale| scale <= 0.0) {
        let found = format!("{:?}", transform.scale);
        let expected = "three numbers above 0";
        let problem = Problem::Illegal { found, expected };
        return Err(at(problem, || "transform.scale".into()));
    }
    Ok(Some(transform))
}

/// A scene in the making.
struct City<'h, 'f, 'r> {
    level: Option<LevelOfDetail>,
    transform: Option<Transform>,
    scene: Scene,
    /// Known once there are vertices.
    origin: Option<DVec3>,
    shared: Shared<'f>,
    templates: &'h [Geometry],
    template_look: DocumentLook<'h>,
    template_builder: MeshBuilder,
    /// By row of the templates and type of the object, which may tell the colour; nothing where
    /// there are no faces.
    template_meshes: HashMap<(usize, String), Option<MeshId>>,
    names: HashMap<String, u32>,
    budget: &'r mut Budget,
    warnings: &'r mut Warnings,
}

/// Origins are multiples of this many metres, to be read and typed easily.
const ORIGIN_STEP: f64 = 100.0;

impl City<'_, '_, '_> {
    fn add_feature(&mut self, line: &[u8]) -> Result<(), Fault> {
        let mut feature = parse(line)?;
        if feature.kind != "CityJSONFeature" {
            let found = format!("{:?}", shortened(&feature.kind));
            let expected = "\"CityJSONFeature\"";
            return Err(at(Problem::Illegal { found, expected }, || "type".into()));
        }
        let objects = std::mem::take(&mut feature.city_objects).0;
        let vertices = std::mem::take(&mut feature.vertices);
        let none = Appearance::default();
        self.add(&objects, vertices, &mut DocumentLook::new(&feature, &none))
    }

    /// Adds the objects of a document.
    fn add<'d>(
        &mut self,
        objects: &'d [(String, CityObject)],
        vertices: Vec<[f64; 3]>,
        look: &mut DocumentLook<'d>,
    ) -> Result<(), Fault> {
        let rounding = match self.transform {
            Some(transform) => Rounding::Scale(transform.scale.into_iter().fold(0.0, f64::max)),
            None => Rounding::Usual,
        };
        let mut builder = MeshBuilder::new(self.place(vertices), rounding);
        let parents: HashMap<&str, &str> = objects
            .iter()
            .filter_map(|(id, object)| Some((id.as_str(), object.parents.first()?.as_str())))
            .collect();
        let shown = self.choose(objects)?;
        for ((id, object), shown) in objects.iter().zip(&shown) {
            if shown.is_empty() {
                continue;
            }
            let object_place = || format!("CityObjects.{id}");
            let name = self
                .path(id, &parents)
                .map_err(|problem| at(problem, object_place))?;
            builder.begin();
            for &index in shown {
                let geometry = &object.geometry[index];
                let place = || format!("CityObjects.{id}.geometry[{index}]");
                builder
                    .add(geometry, &object.kind, look, &mut self.shared, &place)
                    .map_err(|wrong| in_boundaries(wrong, &place()))?;
            }
            if let Some(mesh) = self.keep(builder.finish(), &name, object_place)? {
                self.show(&name, mesh, DMat4::IDENTITY);
            }
            for &index in shown {
                let geometry = &object.geometry[index];
                if geometry.kind != INSTANCE {
                    continue;
                }
                let place = || format!("CityObjects.{id}.geometry[{index}]");
                let placed = self.instance(geometry, &object.kind, &builder.positions, &place)?;
                if let Some((mesh, world_from_template)) = placed {
                    self.show(&name, mesh, world_from_template);
                }
            }
        }
        Ok(())
    }

    /// Coordinates in the file -> positions around the origin.
    fn place(&mut self, vertices: Vec<[f64; 3]>) -> Vec<DVec3> {
        let (scale, translate) = match self.transform {
            Some(Transform { scale, translate }) => {
                (DVec3::from_array(scale), DVec3::from_array(translate))
            }
            None => (DVec3::ONE, DVec3::ZERO),
        };
        let place = |vertex: [f64; 3]| DVec3::from_array(vertex) * scale;
        let Some(&first) = vertices.first() else {
            return Vec::new();
        };
        let origin = *self.origin.get_or_insert_with(|| {
            let first = place(first);
            let grow = |(low, high): (DVec3, DVec3), &vertex: &[f64; 3]| {
                let point = place(vertex);
                (low.min(point), high.max(point))
            };
            let (low, high) = vertices.iter().fold((first, first), grow);
            // Heights stay as they are.
            let middle = (0.5 * (low + high) + translate) * DVec3::new(1.0, 1.0, 0.0);
            let origin = (middle / ORIGIN_STEP).round() * ORIGIN_STEP;
            if origin.is_finite() {
                origin
            } else {
                DVec3::ZERO
            }
        });
        let rest = translate - origin;
        vertices.into_iter().map(|v| place(v) + rest).collect()
    }

    /// For each object, which of its geometries are shown: those of one level of detail, and none
    /// of a whole whose parts are more detailed.
    fn choose(&mut self, objects: &[(String, CityObject)]) -> Result<Vec<Vec<usize>>, Fault> {
        let mut chosen: Vec<Option<LevelOfDetail>> = Vec::with_capacity(objects.len());
        let mut shown = Vec::with_capacity(objects.len());
        for (id, object) in objects {
            let mut levels = Vec::new();
            for (index, geometry) in object.geometry.iter().enumerate() {
                let place = || format!("CityObjects.{id}.geometry[{index}]");
                if let Some(level) = self.level_of(geometry, place)? {
                    levels.push((index, level));
                }
            }
            let allowed = |level: &LevelOfDetail| self.level.is_none_or(|most| most.allows(*level));
            let of_all = || levels.iter().map(|&(_, level)| level);
            let best = of_all().filter(allowed).max_by_key(|level| level.key());
            let best = best.or_else(|| of_all().min_by_key(|level| level.key()));
            let is_best = |level: LevelOfDetail| best.is_some_and(|best| best.key() == level.key());
            let indices = levels.iter().filter(|(_, level)| is_best(*level));
            shown.push(indices.map(|&(index, _)| index).collect::<Vec<usize>>());
            chosen.push(best);
        }
        let row_of: HashMap<&str, usize> = objects
            .iter()
            .enumerate()
            .map(|(row, (id, _))| (id.as_str(), row))
            .collect();
        for ((_, object), part_level) in objects.iter().zip(&chosen) {
            let parent = object.parents.first().map(String::as_str);
            let parent = parent.and_then(|parent| row_of.get(parent).copied());
            let (Some(parent), Some(part_level)) = (parent, part_level) else {
                continue;
            };
            let is_finer = chosen[parent].is_some_and(|level| level.key() < part_level.key());
            if object.kind.ends_with("Part") && is_finer {
                shown[parent].clear();
            }
        }
        Ok(shown)
    }

    /// The level of detail of a geometry that has surfaces.
    fn level_of(
        &mut self,
        geometry: &Geometry,
        place: impl Fn() -> String,
    ) -> Result<Option<LevelOfDetail>, Fault> {
        if matches!(geometry.kind.as_str(), "MultiPoint" | "MultiLineString") {
            self.shared.losses.points_and_lines.add(place);
            return Ok(None);
        }
        if geometry.kind != INSTANCE && depth_of(&geometry.kind).is_none() {
            let found = format!("{:?}", shortened(&geometry.kind));
            let expected = "a type of geometry of CityJSON, such as Solid or MultiSurface";
            let problem = Problem::Illegal { found, expected };
            return Err(at(problem, || format!("{}.type", place())));
        }
        let mut leveled = geometry;
        if geometry.kind == INSTANCE {
            // A template that does not exist is an error later on.
            let row = geometry.template.and_then(|row| usize::try_from(row).ok());
            leveled = row
                .and_then(|row| self.templates.get(row))
                .unwrap_or(geometry);
        }
        let level = leveled.lod.as_ref().map(|lod| lod.to_string().parse());
        Ok(Some(match level {
            Some(Ok(level)) => level,
            lost => {
                if lost.is_some() {
                    let lod = || format!("{}.lod", place());
                    self.shared.losses.levels.add(lod);
                }
                LevelOfDetail {
                    level: 0,
                    refinement: None,
                }
            }
        }))
    }

    /// The mesh of a template's instance, and where it stands.
    fn instance(
        &mut self,
        geometry: &Geometry,
        kind: &str,
        positions: &[DVec3],
        place: &dyn Fn() -> String,
    ) -> Result<Option<(MeshId, DMat4)>, Fault> {
        let lacks = |what| at(Problem::Lacks(what), place);
        let index = geometry.template.ok_or_else(|| lacks("template"))?;
        let templates = self.templates;
        let row = usize::try_from(index).unwrap_or(usize::MAX);
        let Some(template) = templates.get(row) else {
            let problem = no_such("template", index, templates.len());
            return Err(at(problem, || format!("{}.template", place())));
        };
        let matrix = geometry.transformation_matrix.as_deref().unwrap_or(&[]);
        let Ok(rows) = <[f64; 16]>::try_from(matrix) else {
            let found = format!("{} numbers", matrix.len());
            let expected = "the 16 numbers of a 4 x 4 matrix";
            let problem = Problem::Illegal { found, expected };
            return Err(at(problem, || format!("{}.transformationMatrix", place())));
        };
        // The file gives the matrix row by row.
        let matrix = DMat4::from_cols_array(&rows).transpose();
        if matrix.row(3) != DVec4::W {
            let found = format!("a matrix whose last row is {}", matrix.row(3));
            let expected = "[0, 0, 0, 1] there";
            let problem = Problem::Illegal { found, expected };
            return Err(at(problem, || format!("{}.transformationMatrix", place())));
        }
        let mut boundaries = geometry.boundaries.numbers();
        let anchor = boundaries.next().ok_or_else(|| lacks("boundaries"))?;
        let Some(&anchor) = positions.get(anchor as usize) else {
            let problem = no_such("vertex", anchor.into(), positions.len());
            return Err(at(problem, || format!("{}.boundaries[0]", place())));
        };
        let key = (row, kind.to_owned());
        let mesh = match self.template_meshes.get(&key) {
            Some(&known) => known,
            None => {
                let template_place = || format!("geometry-templates.templates[{row}]");
                let (builder, look) = (&mut self.template_builder, &mut self.template_look);
                builder.begin();
                builder
                    .add(template, kind, look, &mut self.shared, &template_place)
                    .map_err(|wrong| in_boundaries(wrong, &template_place()))?;
                let mesh = builder.finish();
                // One template may be asked for in the colours of many kinds.
                self.budget
                    .charge(
                        mesh.positions.len() as u64 + mesh.triangles.len() as u64,
                        64,
                    )
                    .map_err(|problem| at(problem, place))?;
                let id = self.keep(mesh, "template", template_place)?;
                self.template_meshes.insert(key, id);
                id
            }
        };
        Ok(mesh.map(|mesh| (mesh, DMat4::from_translation(anchor) * matrix)))
    }

    /// The names from an object's topmost parent to itself, joined by `/`.
    fn path(&mut self, id: &str, parents: &HashMap<&str, &str>) -> Result<String, Problem> {
        let mut ids = vec![id];
        while let Some(&parent) = parents.get(ids[ids.len() - 1]) {
            // No chain is longer than the list of those that have parents.
            if ids.len() > parents.len() {
                return Err(Problem::Cycle);
            }
            // Long chains together grow as the square of the file.
            self.budget.charge(parent.len() as u64 + 16, 2)?;
            ids.push(parent);
        }
        let names: Vec<String> = ids.iter().rev().map(|id| id.replace('/', "_")).collect();
        Ok(names.join("/"))
    }

    /// Adds a mesh to the scene; none if it has no faces.
    fn keep(
        &mut self,
        mut mesh: Mesh,
        name: &str,
        place: impl Fn() -> String,
    ) -> Result<Option<MeshId>, Fault> {
        if mesh.triangles.is_empty() {
            return Ok(None);
        }
        finish_mesh(&mut mesh, name, &Place::Json(place()), self.warnings)?;
        self.scene.meshes.push(mesh);
        Ok(Some(MeshId(self.scene.meshes.len() as u32 - 1)))
    }

    fn show(&mut self, name: &str, mesh: MeshId, world_from_object: DMat4) {
        let name = unique(name.to_owned(), &mut self.names);
        self.scene.objects.push(Object {
            name,
            mesh,
            world_from_object,
        });
    }

    fn finish(self, crs: Option<&str>) -> Scene {
        self.shared.losses.report(self.warnings);
        self.shared.look.report(self.warnings);
        self.budget.files.append(self.shared.look.files.finish());
        let crs = crs.map(crs_name);
        if crs.as_deref().is_some_and(|crs| GEOGRAPHIC.contains(&crs)) {
            let message = "coordinates are degrees, which are shown as if they were metres; \
                project the file to a system in metres";
            let place = Place::Json("metadata.referenceSystem".into());
            self.warnings.add(place, message);
        }
        Scene {
            materials: self.shared.look.materials,
            images: self.shared.look.images,
            world: World {
                crs,
                origin: self.origin.unwrap_or(DVec3::ZERO),
                ..World::default()
            },
            ..self.scene
        }
    }
}

const INSTANCE: &str = "GeometryInstance";

/// Common systems of longitude and latitude.
const GEOGRAPHIC: &[&str] = &[
    "EPSG:4326",
    "EPSG:4979",
    "EPSG:4258",
    "EPSG:4937",
    "OGC:CRS84",
];

/// `https://www.opengis.net/def/crs/EPSG/0/7415` or `urn:ogc:def:crs:EPSG::7415` -> `EPSG:7415`;
/// other names as they are.
fn crs_name(name: &str) -> String {
    let parts: Vec<&str> = match name.split_once("/def/crs/") {
        Some((_, parts)) => parts.split('/').collect(),
        None => match name.strip_prefix("urn:ogc:def:crs:") {
            Some(parts) => parts.split(':').collect(),
            None => return name.to_owned(),
        },
    };
    match parts[..] {
        [authority, _, code] if !authority.is_empty() && !code.is_empty() => {
            format!("{authority}:{code}")
        }
        _ => name.to_owned(),
    }
}

/// Says where in a geometry's boundaries something is wrong.
fn in_boundaries(wrong: Wrong, geometry: &str) -> Fault {
    let indices = wrong.path.iter().map(|index| format!("[{index}]"));
    let path: String = indices.collect();
    at(wrong.problem, || format!("{geometry}.boundaries{path}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reference_systems_have_short_names() {
        for (long, short) in [
            ("https://www.opengis.net/def/crs/EPSG/0/7415", "EPSG:7415"),
            ("urn:ogc:def:crs:EPSG::28992", "EPSG:28992"),
            ("EPSG:7415", "EPSG:7415"),
            ("urn:ogc:def:crs:", "urn:ogc:def:crs:"),
        ] {
            assert_eq!(crs_name(long), short);
        }
    }
}
