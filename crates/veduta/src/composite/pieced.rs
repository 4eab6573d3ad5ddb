//! Maps with holes.
//!
//! Where a face of a whole map is unseen, something nearer hides it. So others may be clipped by the
//! whole face, and its sides are the exact lines that cut. Not so where something was cut out of a map or
//! left out of it: there only fragments tell what is known. They become faces of their own for the time of
//! a clip, and what is found goes back to the faces that they are of.

use veduta_map::{FaceId, Faces, Fragment, Fragments, Seen, Side};

/// Maps of common faces, some of them cut into faces that are their fragments.
pub struct Pieced {
    /// In the order of the faces that they are of.
    pub faces: Faces,
    pub maps: Vec<Seen>,
    /// Of each face, what it is of.
    origin: Vec<Origin>,
}

/// What a face is of.
struct Origin {
    face: FaceId,
    /// If it is a fragment that is not all of its face: what lies along its sides.
    sides: Option<Vec<Side>>,
}

/// Face, map, and of a map with holes the fragment: whether of a veil, and which. A face of a map without holes
/// has one row.
type Row = (FaceId, usize, Option<(bool, usize)>);

impl Pieced {
    /// Makes faces of the fragments of the maps of which `has_holes` says so. The others' stay, less the
    /// faces that they do not show or name.
    pub fn new(faces: &Faces, maps: &[Seen], has_holes: &[bool]) -> Self {
        let mut rows: Vec<Row> = Vec::new();
        for (index, map) in maps.iter().enumerate() {
            for (is_veil, fragments) in [(false, &map.opaque), (true, &map.veils)] {
                for (number, fragment) in fragments.iter().enumerate() {
                    if has_holes[index] {
                        rows.push((fragment.face(), index, Some((is_veil, number))));
                        continue;
                    }
                    rows.push((fragment.face(), index, None));
                    if let Fragment::Cut { sides, .. } = fragment {
                        rows.extend(sides.iter().map(|side| (side.face, index, None)));
                    }
                }
            }
        }
        rows.sort_unstable();
        rows.dedup();
        let mut pieced = Self {
            faces: Faces::with_capacity(rows.len()),
            maps: Vec::new(),
            origin: Vec::new(),
        };
        for &plane in faces.planes() {
            pieced.faces.push_plane(plane);
        }
        let mut new_ids = vec![None; faces.len()];
        let mut of_holed: Vec<[Fragments; 2]> = maps.iter().map(|_| Default::default()).collect();
        for (face, index, fragment) in rows {
            let (outline, sides) = match fragment {
                None => (faces.outline(face), None),
                Some((is_veil, number)) => {
                    let map = &maps[index];
                    let fragments = if is_veil { &map.veils } else { &map.opaque };
                    match fragments.get(number) {
                        Fragment::Whole(_) => (faces.outline(face), None),
                        Fragment::Cut {
                            vertices, sides, ..
                        } => (vertices, Some(sides.to_vec())),
                    }
                }
            };
            // Rounding may have left a sliver without area, which shows nothing.
            if veduta_geometry::signed_area(outline) <= 0.0 {
                continue;
            }
            let (plane, object) = (faces.plane(face), faces.object(face));
            let id = pieced
                .faces
                .push(outline, plane, object, faces.source(face));
            let id = id.expect("it has an area");
            if faces.is_veil(face) {
                pieced.faces.set_veil(id);
            }
            pieced.origin.push(Origin { face, sides });
            match fragment {
                None => new_ids[face.index()] = Some(id),
                Some((is_veil, _)) => of_holed[index][usize::from(is_veil)].push_whole(id),
            }
        }
        let new_id = |face: FaceId| new_ids[face.index()].expect("all faces named were added");
        for (map, of_holed) in maps.iter().zip(of_holed) {
            let [opaque, veils] = of_holed;
            let is_whole = opaque.is_empty() && veils.is_empty();
            pieced.maps.push(if is_whole {
                Seen {
                    opaque: map.opaque.renumbered(new_id),
                    veils: map.veils.renumbered(new_id),
                }
            } else {
                Seen { opaque, veils }
            });
        }
        pieced
    }

    /// The face that a face is, or is a fragment of.
    pub fn origin(&self, face: FaceId) -> FaceId {
        self.origin[face.index()].face
    }

    /// What was found of these faces as fragments of those before.
    pub fn put_together(&self, seen: &Seen) -> Seen {
        Seen {
            opaque: self.fragments_before(&seen.opaque),
            veils: self.fragments_before(&seen.veils),
        }
    }

    fn fragments_before(&self, found: &Fragments) -> Fragments {
        let mut before = Fragments::new();
        for fragment in found.iter() {
            let Origin { face, sides } = &self.origin[fragment.face().index()];
            match (fragment, sides) {
                (Fragment::Whole(_), None) => before.push_whole(*face),
                (Fragment::Whole(piece), Some(sides)) => {
                    let outline = self.faces.outline(piece).iter().copied();
                    before.push_cut(*face, outline.zip(sides.iter().copied()));
                }
                (
                    Fragment::Cut {
                        vertices, sides, ..
                    },
                    _,
                ) => {
                    let sides = sides.iter().map(|&side| self.side_before(*face, side));
                    before.push_cut(*face, vertices.iter().copied().zip(sides));
                }
            }
        }
        before
    }

    /// A line that a fragment of `own` has along a side, as the faces before name it.
    fn side_before(&self, own: FaceId, side: Side) -> Side {
        let origin = &self.origin[side.face.index()];
        let before = match &origin.sides {
            Some(sides) if side.kind < Side::SCAN => sides[side.kind as usize],
            _ => Side {
                face: origin.face,
                ..side
            },
        };
        // Where another face's plane crosses a third is a line that has no name here.
        let is_of_others = before.kind == Side::CROSSING && origin.sides.is_some();
        if before.kind == Side::SCAN || is_of_others && origin.face != own {
            return Side::scan(own);
        }
        before
    }
}
