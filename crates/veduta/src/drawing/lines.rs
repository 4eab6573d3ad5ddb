//! Edges -> strokes.
//!
//! Sides of fragments that lie between two faces are told apart by what the map knows: the planes on
//! either side. Only for edges with a single face the mesh is asked. What is hidden is in no fragment, and those of
//! veils do not part them; that is looked for among all faces, by `hidden`.

use super::join::depth_unit;
use super::subdivision::{HalfEdge, Subdivision};
use super::{COINCIDENT, LineKind, Look, Settings, Stroke, hidden, is_on_frame, spacing, trace};
use crate::dice::PixelGrid;
use crate::scene::{Mesh, MeshId, Scene};
use std::collections::HashMap;
use veduta_geometry::{Affine, DVec2, DVec3};
use veduta_map::{Camera, FaceId, Projection, VisibilityMap};

/// How much the depth of two faces may differ where they meet, as a share of the depth (in parallel
/// projection: of the frame's height), for them to be joined there: a tenth of a millimetre in a
/// hundred metres. Larger joins what only lies close; smaller tears the corners of models whose points
/// were rounded to single precision.
pub(super) const JOINED: f64 = 1e-6;

/// A piece of a side that is to be drawn.
#[derive(Clone, Copy)]
struct Piece {
    kind: LineKind,
    from: u32,
    to: u32,
}

/// The lines asked for, in order of kind but hidden ones first: what is seen is drawn over them.
///
/// A piece that is of several kinds becomes the first of them by [`LineKind`]'s order that is asked for.
pub(super) fn strokes(
    scene: &Scene,
    map: &VisibilityMap,
    veil_looks: &[Look],
    subdivision: &Subdivision,
    grid: &PixelGrid,
    settings: &Settings,
) -> Vec<Stroke> {
    if settings.lines.is_empty() {
        return Vec::new();
    }
    let judge = Judge::new(scene, map, subdivision, settings);
    let edges = subdivision.half_edges();
    let seen = (0u32..).zip(edges).filter_map(|(index, edge)| {
        let kind = judge.kind(index, edge)?;
        Some((kind, subdivision.ends(index)))
    });
    let mut segments: Vec<(LineKind, [DVec2; 2])> = seen.collect();
    if settings.lines.contains(&LineKind::Hidden) || !map.veils.is_empty() {
        let unseen = unseen_veils(map, veil_looks);
        segments.extend(hidden::segments(&judge, map, &unseen, settings.most_before));
    }
    let (pieces, vertices) = each_once(&segments);
    let of_kinds = pieces.chunk_by(|a, b| a.kind == b.kind);
    let mut strokes: Vec<Stroke> = of_kinds
        .flat_map(|pieces| chains(pieces, &vertices, grid))
        .filter(|stroke| !stroke.points.is_empty())
        .collect();
    strokes.sort_by_key(|stroke| stroke.kind != LineKind::Hidden);
    spacing::kept(strokes, settings)
}

/// The veils that are wholly transparent where they are not hidden, ascending.
fn unseen_veils(map: &VisibilityMap, looks: &[Look]) -> Vec<FaceId> {
    let veils = looks.iter().enumerate();
    let transparent = veils.filter(|(_, look)| look.opacity <= 0.0);
    let mut faces: Vec<FaceId> = transparent.map(|(veil, _)| map.veils.face(veil)).collect();
    faces.sort_unstable();
    faces.dedup();
    faces
}

/// How near to one another, in frame heights or widths, lines are one. Larger than the distance within which
/// fragments are neighbours: where that fails, for a cut at a very flat angle, both would be drawn.
const ONE_LINE: f64 = 1e-10;

/// Cuts segments where they touch one another, so that what coincides has the same vertices, and keeps of each
/// piece the first kind: what is seen goes before what is hidden. In order of kind.
fn each_once(segments: &[(LineKind, [DVec2; 2])]) -> (Vec<Piece>, Vec<DVec2>) {
    // As polygons of two corners, there and back.
    let polygons: Vec<&[DVec2]> = segments.iter().map(|segment| &segment.1[..]).collect();
    let cut = Subdivision::new(&polygons, ONE_LINE);
    let mut pieces: Vec<Piece> = Vec::new();
    for (index, &(kind, _)) in (0u32..).zip(segments) {
        let edges = cut.around(index).map(|edge| *cut.half_edge(edge));
        let forth = edges.filter(|edge| edge.from < edge.to);
        pieces.extend(forth.map(|HalfEdge { from, to, .. }| Piece { kind, from, to }));
    }
    pieces.sort_by_key(|piece| (piece.from, piece.to, piece.kind));
    pieces.dedup_by_key(|piece| (piece.from, piece.to));
    pieces.sort_by_key(|piece| piece.kind);
    (pieces, cut.vertices)
}

/// Cosine of the angle up to which two normals at one place are one: a degree, far more than rounding and far
/// less than any edge that is meant.
const SAME_NORMAL: f32 = 0.9998;

/// Says what kind of line a side is.
pub(super) struct Judge<'a> {
    scene: &'a Scene,
    map: &'a VisibilityMap,
    subdivision: &'a Subdivision,
    /// Ascending.
    wanted: Vec<LineKind>,
    crease_angle: f64,
    /// By mesh, how many faces its edges have; only looked up in. Empty if nobody will ask.
    face_counts: HashMap<MeshId, FaceCounts>,
}

/// What lies along a side of the face that is nearer there.
enum Meeting {
    /// Something farther away, or nothing.
    Step,
    /// Another face that it is joined to, with the angle between the two in radians.
    Joint { other: FaceId, angle: f64 },
}

impl<'a> Judge<'a> {
    fn new(
        scene: &'a Scene,
        map: &'a VisibilityMap,
        subdivision: &'a Subdivision,
        settings: &Settings,
    ) -> Self {
        let mut wanted = settings.lines.clone();
        wanted.sort_unstable();
        let mut face_counts = HashMap::new();
        if wanted.contains(&LineKind::Boundary) {
            // Of all faces if what is hidden or veiled may be asked for.
            let mut faces: Vec<FaceId> =
                (0..map.opaque.len()).map(|k| map.opaque.face(k)).collect();
            if wanted.contains(&LineKind::Hidden) || !map.veils.is_empty() {
                faces = map.faces.ids().collect();
            }
            for face in faces {
                let object = scene.object(map.faces.object(face));
                let mesh = &scene.meshes[object.mesh.0 as usize];
                let counts = face_counts.entry(object.mesh);
                counts.or_insert_with(|| FaceCounts::of(mesh));
            }
        }
        Self {
            scene,
            map,
            subdivision,
            wanted,
            crease_angle: settings.crease_angle,
            face_counts,
        }
    }

    pub fn wants(&self, kind: LineKind) -> bool {
        self.wanted.contains(&kind)
    }

    /// Whether the edge between two faces at that angle is to be drawn.
    pub fn is_crease(&self, faces: [FaceId; 2], angle: f64) -> bool {
        self.wants(LineKind::Crease) && angle > self.crease_angle && !self.is_smooth(faces)
    }

    /// Whether two faces share an edge across which light changes gradually: both have the same normals there.
    /// However large their angle, the edge then stands for a rounding.
    fn is_smooth(&self, faces: [FaceId; 2]) -> bool {
        let objects = faces.map(|face| self.map.faces.object(face));
        let mesh = self.scene.mesh_of(objects[0]);
        if objects[0] != objects[1] || mesh.normals.is_empty() {
            return false;
        }
        let [one, other] = faces.map(|face| mesh.corners_of(self.map.faces.source(face)));
        let other: Vec<u32> = other.collect();
        let at = |corner: u32| mesh.positions[corner as usize];
        let normal = |corner: u32| mesh.normals[corner as usize];
        let shared = one.filter(|&corner| {
            let same = other.iter().find(|&&other| at(other) == at(corner));
            same.is_some_and(|&same| normal(corner).dot(normal(same)) > SAME_NORMAL)
        });
        shared.count() > 1
    }

    /// The kind of a half-edge; `None` where no line is to be drawn, and for the second of twins.
    fn kind(&self, index: u32, edge: &HalfEdge) -> Option<LineKind> {
        if edge.twin.is_some_and(|twin| twin < index) {
            return None;
        }
        let (face, meeting) = self.meeting(index, edge)?;
        let ends = self.subdivision.ends(index);
        let is = |kind: LineKind| match (kind, &meeting) {
            (LineKind::Silhouette, Meeting::Step) => true,
            (LineKind::Crease, Meeting::Joint { other, angle }) => {
                self.is_crease([face, *other], *angle)
            }
            (LineKind::Boundary, Meeting::Step) => self.is_boundary(face, ends),
            (LineKind::Boundary, Meeting::Joint { other, .. }) => {
                self.is_boundary(face, ends) || self.is_boundary(*other, ends)
            }
            _ => false,
        };
        self.wanted.iter().copied().find(|&kind| is(kind))
    }

    /// The nearer face along a half-edge, and what it meets there. `None` within a face, and on the
    /// frame.
    fn meeting(&self, index: u32, edge: &HalfEdge) -> Option<(FaceId, Meeting)> {
        let face = self.map.opaque.face(edge.polygon as usize);
        let ends @ [from, to] = self.subdivision.ends(index);
        let Some(across) = self.subdivision.across(index) else {
            return (!is_on_frame(ends)).then_some((face, Meeting::Step));
        };
        let other = self.map.opaque.face(across as usize);
        if other == face {
            return None;
        }
        let middle = 0.5 * (from + to);
        let [plane, other_plane] = [face, other].map(|face| self.map.faces.face_nearness(face));
        let step = plane.at(middle) - other_plane.at(middle);
        let camera = &self.map.camera;
        let nearer = if step >= 0.0 { face } else { other };
        if step.abs() > JOINED * depth_unit(camera, plane.at(middle)) {
            return Some((nearer, Meeting::Step));
        }
        let angle = normal_of(camera, plane).angle_between(normal_of(camera, other_plane));
        Some((face, Meeting::Joint { other, angle }))
    }

    /// Whether the side lies on an edge of `face` that belongs to no other face of its mesh.
    pub fn is_boundary(&self, face: FaceId, ends: [DVec2; 2]) -> bool {
        let mesh = self.scene.object(self.map.faces.object(face)).mesh;
        self.edge_is(face, ends, |edge| {
            self.face_counts[&mesh].of_edge(&self.scene.meshes[mesh.0 as usize], edge) == 1
        })
    }

    /// Whether the side lies on an edge of `face`, and not on a cut.
    pub fn is_edge(&self, face: FaceId, ends: [DVec2; 2]) -> bool {
        self.edge_is(face, ends, |_| true)
    }

    /// Whether `is` says so of an edge of `face` on which the side lies.
    fn edge_is(&self, face: FaceId, ends: [DVec2; 2], is: impl Fn([u32; 2]) -> bool) -> bool {
        let object = self.scene.object(self.map.faces.object(face));
        let mesh = &self.scene.meshes[object.mesh.0 as usize];
        let camera = &self.map.camera;
        let eye_from_object = camera.eye_from_world * object.world_from_object;
        let corners: Vec<u32> = mesh.corners_of(self.map.faces.source(face)).collect();
        (0..corners.len()).any(|k| {
            let edge = [corners[k], corners[(k + 1) % corners.len()]];
            let in_eye = edge
                .map(|corner| eye_from_object.transform_point3(mesh.positions[corner as usize]));
            ends.iter().all(|&end| is_on_edge(camera, in_eye, end)) && is(edge)
        })
    }
}

/// How far, as the sine of an angle or a share of the frame's height, a point of a side may lie from the
/// edge that it is a part of.
const ON_EDGE: f64 = 1e-9;

/// Whether the image point lies on the line that the edge between two eye-space points is seen as. Right
/// for points behind the eye, too.
fn is_on_edge(camera: &Camera, [v0, v1]: [DVec3; 2], image: DVec2) -> bool {
    let (origin, direction) = camera.eye_ray(image);
    match camera.projection {
        Projection::Perspective { .. } => {
            let normal = v0.cross(v1);
            normal.dot(direction).abs() <= ON_EDGE * normal.length() * direction.length()
        }
        Projection::Parallel { height, .. } => {
            let (along, to_point) = (v1 - v0, origin - v0);
            let along = along.truncate();
            let off = veduta_geometry::cross(along, to_point.truncate());
            off.abs() <= ON_EDGE * height * along.length()
        }
    }
}

/// Normal, in eye space and away from the eye, of the plane with that nearness.
pub(super) fn normal_of(camera: &Camera, plane: &Affine) -> DVec3 {
    // The inverse of [`Camera::nearness_of_plane`].
    let (scale, ahead) = (camera.image_scale(), camera.principal_point());
    let slope = DVec2::new(plane.a * scale.x, plane.b * scale.y);
    match camera.projection {
        Projection::Perspective { .. } => slope.extend(plane.at(ahead)),
        Projection::Parallel { .. } => slope.extend(1.0),
    }
}

/// How many faces of a mesh have each edge. Corners in the same place are one: flat shading gives each
/// face its own.
struct FaceCounts(HashMap<[[u64; 3]; 2], u32>);

impl FaceCounts {
    fn of(mesh: &Mesh) -> Self {
        let mut counts = HashMap::new();
        for face in 0..mesh.face_count() as u32 {
            let corners: Vec<u32> = mesh.corners_of(face).collect();
            for k in 0..corners.len() {
                let edge = [corners[k], corners[(k + 1) % corners.len()]];
                *counts.entry(Self::key(mesh, edge)).or_insert(0) += 1;
            }
        }
        Self(counts)
    }

    fn of_edge(&self, mesh: &Mesh, edge: [u32; 2]) -> u32 {
        self.0.get(&Self::key(mesh, edge)).copied().unwrap_or(0)
    }

    fn key(mesh: &Mesh, edge: [u32; 2]) -> [[u64; 3]; 2] {
        let mut ends = edge.map(|corner| {
            let position = mesh.positions[corner as usize];
            // Zero has two signs.
            position.to_array().map(|value| (value + 0.0).to_bits())
        });
        ends.sort_unstable();
        ends
    }
}

/// Joins pieces of one kind to strokes that end where lines end or fork.
fn chains(pieces: &[Piece], vertices: &[DVec2], grid: &PixelGrid) -> Vec<Stroke> {
    let mut at_vertex: Vec<(u32, u32)> = (0u32..)
        .zip(pieces)
        .flat_map(|(index, piece)| [(piece.from, index), (piece.to, index)])
        .collect();
    at_vertex.sort_unstable();
    let around = |vertex: u32| {
        let start = at_vertex.partition_point(|row| row.0 < vertex);
        let count = at_vertex[start..].partition_point(|row| row.0 == vertex);
        &at_vertex[start..start + count]
    };
    let mut used = vec![false; pieces.len()];
    let mut strokes = Vec::new();
    // First the chains that end somewhere, then the rings.
    let ends = at_vertex.iter().filter(|row| around(row.0).len() != 2);
    let starts: Vec<(u32, u32)> = ends.chain(&at_vertex).copied().collect();
    for (start, first) in starts {
        if used[first as usize] {
            continue;
        }
        let (mut chain, mut piece) = (vec![start], first);
        loop {
            used[piece as usize] = true;
            let Piece { from, to, .. } = pieces[piece as usize];
            let last = chain[chain.len() - 1];
            let vertex = if from == last { to } else { from };
            chain.push(vertex);
            let next = match around(vertex) {
                two @ [_, _] => two.iter().find(|row| !used[row.1 as usize]),
                _ => None,
            };
            match next {
                Some(&(_, next)) => piece = next,
                None => break,
            }
        }
        strokes.push(stroke(pieces[first as usize].kind, &chain, vertices, grid));
    }
    strokes
}

fn stroke(kind: LineKind, chain: &[u32], vertices: &[DVec2], grid: &PixelGrid) -> Stroke {
    let closed = chain.len() > 3 && chain.first() == chain.last();
    let mut points: Vec<DVec2> = chain.iter().map(|&v| vertices[v as usize]).collect();
    if closed {
        points.pop();
    }
    let corners = if closed {
        trace::corners(&points, COINCIDENT)
    } else {
        trace::corners_of_chain(&points, COINCIDENT)
    };
    Stroke {
        kind,
        points: corners
            .into_iter()
            .map(|corner| grid.pixels_from_image(points[corner]))
            .collect(),
        closed,
    }
}
