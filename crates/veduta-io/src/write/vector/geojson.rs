//! Positions are pixels with y upwards, so that programs for maps, whose y is north, show the picture
//! upright: x from the left and y from the bottom edge of the picture. RFC 7946 means longitude and
//! latitude by its positions; programs take plain numbers for what they are, and so does this.

use super::outline::{Point, Rounding, twice_area};
use super::{VectorOptions, srgb8};
use std::fmt::Write;
use veduta::drawing::{Drawing, Evenness, Group};
use veduta::map::MaterialId;
use veduta_geometry::DVec2;

/// GeoJSON text: a feature a line.
pub fn encode(drawing: &Drawing, options: &VectorOptions) -> String {
    let rounding = Rounding::new(options.decimals);
    let mut text = String::from("{\"type\":\"FeatureCollection\",\"features\":[");
    let mut is_first = true;
    let shapes = drawing.shapes.iter().map(|shape| Feature {
        object: path_of(&drawing.groups, shape.group),
        material: shape.material,
        radiance: shape.radiance,
        opacity: 1.0,
        evenness: shape.evenness,
        outlines: &shape.seen,
        more: format!(
            "\"faces\":{},\"nearest\":{},\"farthest\":{},",
            shape.faces, shape.nearest, shape.farthest
        ),
    });
    let veils = drawing.veils.iter().map(|veil| Feature {
        object: veil.name.clone(),
        material: veil.material,
        radiance: veil.radiance,
        opacity: veil.opacity,
        evenness: veil.evenness,
        outlines: &veil.outlines,
        more: String::new(),
    });
    for feature in shapes.chain(veils) {
        let rings = rounding.rings(feature.outlines);
        if rings.is_empty() {
            continue;
        }
        text.push_str(if is_first { "\n" } else { ",\n" });
        is_first = false;
        let [r, g, b] = srgb8(feature.radiance);
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "{{\"type\":\"Feature\",\"properties\":{{\"object\":{},\"material\":{},{}\
             \"color\":\"#{r:02x}{g:02x}{b:02x}\",\"color_is_mean\":{},\"opacity\":{}\
             }},\"geometry\":{{\"type\":\"MultiPolygon\",\"coordinates\":[",
            serde_json::Value::from(feature.object),
            serde_json::Value::from(&*drawing.material_names[feature.material.index()]),
            feature.more,
            feature.evenness != Evenness::Even,
            feature.opacity,
        );
        let height = (drawing.size[1] * 10f64.powi(options.decimals.into())).round() as i64;
        for (index, polygon) in polygons(rings).iter().enumerate() {
            text.push_str(if index == 0 { "[" } else { ",[" });
            for (index, ring) in polygon.iter().enumerate() {
                text.push_str(if index == 0 { "[" } else { ",[" });
                // Turned round, since turning y over turns the winding; the first point closes the ring.
                let corners = ring.iter().rev().chain(ring.last());
                for (index, &[x, y]) in corners.enumerate() {
                    text.push_str(if index == 0 { "[" } else { ",[" });
                    push_number(&mut text, rounding, x);
                    text.push(',');
                    push_number(&mut text, rounding, height - y);
                    text.push(']');
                }
                text.push(']');
            }
            text.push(']');
        }
        text.push_str("]}}");
    }
    text.push_str("\n]}\n");
    text
}

/// A shape or a veil.
struct Feature<'a> {
    object: String,
    material: MaterialId,
    radiance: [f32; 3],
    opacity: f32,
    evenness: Evenness,
    outlines: &'a [Vec<DVec2>],
    /// Properties that only shapes have.
    more: String,
}

/// JSON wants a digit before the point.
fn push_number(text: &mut String, rounding: Rounding, value: i64) {
    let start = text.len();
    rounding.push(text, value);
    let digits = start + usize::from(value < 0);
    if text[digits..].starts_with('.') {
        text.insert(digits, '0');
    }
}

/// The names from the root to a group, parted by slashes: the object's name.
fn path_of(groups: &[Group], group: u32) -> String {
    let group = &groups[group as usize];
    match group.parent {
        Some(parent) => format!("{}/{}", path_of(groups, parent), group.name),
        None => group.name.clone(),
    }
}

/// Outlines, each with its holes: a hole belongs to the smallest outline around it.
fn polygons(rings: Vec<Vec<Point>>) -> Vec<Vec<Vec<Point>>> {
    let (outlines, holes): (Vec<_>, Vec<_>) =
        rings.into_iter().partition(|ring| twice_area(ring) > 0);
    let mut polygons: Vec<Vec<Vec<Point>>> = outlines.into_iter().map(|ring| vec![ring]).collect();
    for hole in holes {
        let around = polygons
            .iter_mut()
            .filter(|polygon| is_within(&hole, &polygon[0]));
        if let Some(polygon) = around.min_by_key(|polygon| twice_area(&polygon[0])) {
            polygon.push(hole);
        }
    }
    polygons
}

/// Whether a ring lies within another. They may touch, but do not cross: points on the border tell
/// nothing, others do.
fn is_within(ring: &[Point], outline: &[Point]) -> bool {
    let votes = ring.iter().map(|&point| place(point, outline));
    votes.flatten().next().unwrap_or(true)
}

/// Whether a point lies inside of a ring; `None` on its border.
fn place(point: Point, ring: &[Point]) -> Option<bool> {
    let [x, y] = point.map(i128::from);
    let mut inside = false;
    for (p, q) in ring.iter().zip(ring.iter().cycle().skip(1)) {
        let [px, py, qx, qy] = [p[0], p[1], q[0], q[1]].map(i128::from);
        let turn = (qx - px) * (y - py) - (qy - py) * (x - px);
        let in_box = px.min(qx) <= x && x <= px.max(qx) && py.min(qy) <= y && y <= py.max(qy);
        if turn == 0 && in_box {
            return None;
        }
        // Does a ray to the right cross the side?
        if (py > y) != (qy > y) && (turn > 0) == (qy > py) {
            inside = !inside;
        }
    }
    Some(inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(min: i64, max: i64) -> Vec<Point> {
        vec![[min, min], [max, min], [max, max], [min, max]]
    }

    fn hole(min: i64, max: i64) -> Vec<Point> {
        let mut ring = square(min, max);
        ring.reverse();
        ring
    }

    #[test]
    fn holes_go_to_the_smallest_outline_around_them() {
        let rings = vec![
            square(0, 100),
            hole(10, 90),
            square(20, 80),
            hole(30, 70),
            hole(2, 5),
        ];
        let nested = polygons(rings);
        assert_eq!(
            nested,
            [
                vec![square(0, 100), hole(10, 90), hole(2, 5)],
                vec![square(20, 80), hole(30, 70)]
            ]
        );
    }

    #[test]
    fn points_are_inside_outside_or_on_the_border() {
        let ring = [[0, 0], [10, 0], [10, 10], [5, 5], [0, 10]];
        for (point, expected) in [
            ([5, 2], Some(true)),
            ([5, 7], Some(false)),
            ([1, 5], Some(true)),
            ([-1, 0], Some(false)),
            ([5, 5], None),
            ([5, 0], None),
            ([0, 3], None),
        ] {
            assert_eq!(place(point, &ring), expected, "{point:?}");
        }
    }
}
