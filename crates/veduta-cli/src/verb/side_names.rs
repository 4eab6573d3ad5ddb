//! The sides of a cube in names of files.

use veduta::reproject::cube::Side;

/// How a side is called.
type Naming = fn(Side) -> String;

/// What stands in a name for a side, and how it is called there.
const SIDE_NAMES: [(&str, Naming); 3] = [
    ("{side}", |side| side.name().to_owned()),
    ("{letter}", |side| side.letter().to_string()),
    ("{axis}", |side| {
        let axis = match side {
            Side::Front => "pz",
            Side::Right => "px",
            Side::Back => "nz",
            Side::Left => "nx",
            Side::Up => "py",
            Side::Down => "ny",
        };
        axis.to_owned()
    }),
];

/// Whether a name has a place for that of a side.
pub fn has_place(name: &str) -> bool {
    SIDE_NAMES.iter().any(|(place, _)| name.contains(place))
}

/// The name with a side in all its places.
pub fn named(name: &str, side: Side) -> String {
    let places = SIDE_NAMES.iter();
    places.fold(name.to_owned(), |name, (place, called)| {
        name.replace(place, &called(side))
    })
}
