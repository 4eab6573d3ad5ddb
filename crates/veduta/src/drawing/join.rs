use super::subdivision::Subdivision;
use super::{Evenness, Joining, Look};
use std::ops::Range;
use veduta_geometry::{DVec2, signed_area};
use veduta_map::{Camera, FaceId, Projection, VisibilityMap};

/// Faces that are drawn as one, since they look alike.
#[derive(Clone, Debug, Default)]
pub(super) struct Region {
    /// Ascending.
    pub faces: Vec<FaceId>,
    /// All fragments of the faces, ascending.
    pub fragments: Vec<u32>,
}

/// A face that is seen.
struct Seen {
    face: FaceId,
    fragments: Range<u32>,
    /// Share of the frame.
    area: f64,
}

/// How much the depth of two planes may differ, as a share of the depth (in parallel projection: of the
/// frame's height), for them to count as one: a millimetre in a hundred metres. Corners of flat polygons,
/// stored in single precision, are off by less; no relief that can be seen is flattened, since colours
/// have to be alike too.
const COPLANAR: f64 = 1e-5;

/// How much the colours of flat faces may differ, as a share of the brightest channel: less than a step of
/// 8-bit sRGB, which is 9e-3 at white and more below. Those of faces in one plane differ by the rounding of normals.
const SAME_COLOR: f32 = 6e-3;

/// Joins faces to regions; in the order of their first faces.
///
/// Each region grows from its largest face, by neighbours that lie in that face's plane and look like
/// it, and if that is asked for by all others of its object that look like it. They are compared with this
/// one face, not with one another: however long the chain, nothing drifts. A region may be seen in
/// several places.
pub(super) fn join(
    map: &VisibilityMap,
    subdivision: &Subdivision,
    looks: &[Look],
    joining: Joining,
) -> Vec<Region> {
    let seen = seen_faces(map);
    let mut row_of_fragment = vec![0u32; map.opaque.len()];
    for (row, face) in seen.iter().enumerate() {
        for fragment in face.fragments.clone() {
            row_of_fragment[fragment as usize] = row as u32;
        }
    }
    let mut by_area: Vec<u32> = (0..seen.len() as u32).collect();
    by_area.sort_by(|&a, &b| seen[b as usize].area.total_cmp(&seen[a as usize].area));

    let look_of = |row: u32| &looks[seen[row as usize].fragments.start as usize];
    let alike = Alike::new(seen.len() as u32, look_of);
    let mut taken = vec![false; seen.len()];
    let mut regions = Vec::new();
    for first in by_area {
        if std::mem::replace(&mut taken[first as usize], true) {
            continue;
        }
        let first = &seen[first as usize];
        let look = &looks[first.fragments.start as usize];
        let mut rows = vec![row_of_fragment[first.fragments.start as usize]];
        if joining == Joining::Colors && look.evenness == Evenness::Even {
            alike.each(look, look_of, |row| {
                if !std::mem::replace(&mut taken[row as usize], true) {
                    rows.push(row);
                }
            });
        }
        let mut next = 0;
        while let Some(&row) = rows.get(next) {
            next += 1;
            let own = seen[row as usize].fragments.clone();
            let edges = own.flat_map(|fragment| subdivision.around(fragment));
            for neighbour in edges.filter_map(|edge| subdivision.across(edge)) {
                let row = row_of_fragment[neighbour as usize];
                if !taken[row as usize]
                    && is_alike(look, &looks[neighbour as usize])
                    && is_coplanar(map, first.face, seen[row as usize].face)
                {
                    taken[row as usize] = true;
                    rows.push(row);
                }
            }
        }
        rows.sort_unstable();
        let faces = rows.iter().map(|&row| &seen[row as usize]);
        regions.push(Region {
            faces: faces.clone().map(|seen| seen.face).collect(),
            fragments: faces.flat_map(|seen| seen.fragments.clone()).collect(),
        });
    }
    regions.sort_by_key(|region| region.faces[0]);
    regions
}

fn seen_faces(map: &VisibilityMap) -> Vec<Seen> {
    let mut seen: Vec<Seen> = Vec::new();
    for (index, fragment) in (0u32..).zip(map.opaque.iter()) {
        let area = signed_area(map.polygon(fragment));
        match seen.last_mut() {
            Some(last) if last.face == fragment.face() => {
                last.fragments.end = index + 1;
                last.area += area;
            }
            _ => seen.push(Seen {
                face: fragment.face(),
                fragments: index..index + 1,
                area,
            }),
        }
    }
    seen
}

/// Rows of seen faces, sorted to find those that look like one.
struct Alike {
    by_red: Vec<u32>,
}

impl Alike {
    fn new<'a>(rows: u32, look_of: impl Fn(u32) -> &'a Look) -> Self {
        let mut by_red: Vec<u32> = (0..rows).collect();
        by_red.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(&look_of);
            let by_object = a.object.cmp(&b.object);
            by_object.then(a.radiance[0].total_cmp(&b.radiance[0]))
        });
        Self { by_red }
    }

    /// Visits the rows that look like `look`.
    fn each<'a>(&self, look: &Look, look_of: impl Fn(u32) -> &'a Look, mut visit: impl FnMut(u32)) {
        let least = look.radiance[0] - SAME_COLOR * brightest(look);
        let start = self.by_red.partition_point(|&row| {
            let other = look_of(row);
            other.object < look.object || other.object == look.object && other.radiance[0] < least
        });
        let most = look.radiance[0] + SAME_COLOR * brightest(look);
        for &row in &self.by_red[start..] {
            let other = look_of(row);
            if other.object != look.object || other.radiance[0] > most {
                break;
            }
            if is_alike(look, other) {
                visit(row);
            }
        }
    }
}

fn brightest(look: &Look) -> f32 {
    look.radiance.iter().copied().fold(0.0, f32::max)
}

fn is_alike(a: &Look, b: &Look) -> bool {
    let brightest = brightest(a);
    let same_color = || {
        let channels = a.radiance.iter().zip(b.radiance);
        channels.fold(true, |same, (a, b)| {
            same && (a - b).abs() <= SAME_COLOR * brightest
        })
    };
    (a.object, a.material, a.evenness) == (b.object, b.material, b.evenness)
        && (a.evenness == Evenness::Picture || same_color())
}

/// Whether `face` lies in the plane of `first`.
pub(super) fn is_coplanar(map: &VisibilityMap, first: FaceId, face: FaceId) -> bool {
    let faces = &map.faces;
    let plane = faces.face_nearness(first);
    let difference = faces.face_nearness(face).minus(plane);
    faces.plane(first) == faces.plane(face)
        || faces.outline(face).iter().all(|&point| {
            difference.at(point).abs() <= COPLANAR * depth_unit(&map.camera, plane.at(point))
        })
}

/// The change of nearness that a point moves by as much as it is deep (in parallel projection: by the
/// frame's height), to first order.
pub(super) fn depth_unit(camera: &Camera, nearness: f64) -> f64 {
    match camera.projection {
        // d(1/z) = dz/z² = (dz/z) (1/z).
        Projection::Perspective { .. } => nearness.abs(),
        Projection::Parallel { height, .. } => height,
    }
}

/// The polygon of a fragment.
pub(super) fn polygon_of(map: &VisibilityMap, fragment: u32) -> &[DVec2] {
    map.polygon(map.opaque.get(fragment as usize))
}
