use std::ops::Range;
use veduta_geometry::DVec3;

/// Where on Earth a scene is.
///
/// Georeferenced coordinates are large: metres from an origin far away. They are taken relative to
/// [`World::origin`] in double precision before anything else is done with them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// Coordinate reference system, such as `EPSG:7415`; `None` for a scene that is nowhere.
    pub crs: Option<String>,
    /// What stands at (0, 0, 0) of the world, in the coordinates of `crs`.
    pub origin: DVec3,
    /// What heights are counted from, such as `NAP`, where `crs` does not say it.
    pub vertical_datum: Option<String>,
}

/// A part of a scene that can be made apart from the others and composited with them.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its name, with which the names of its objects and materials begin.
    pub name: String,
    /// Of coplanar faces of two layers those of the higher priority are seen. Layers stand in the
    /// scene in descending order of it.
    pub priority: i32,
    /// Its objects: rows of [`Scene::objects`](super::Scene::objects).
    pub objects: Range<u32>,
}
