//! Names of files -> the sides of a cube that they show.
//!
//! People and programs call the six files in a few ways: by words, by short words, by letters, by axes of
//! OpenGL, by numbers. All files of a cube are named in one way, so each way is tried on all of them, the
//! plainest first.

use std::path::Path;
use veduta::reproject::cube::Side;

/// Words, the usual ones and those of sky boxes of games.
const WORDS: &[(&str, Side)] = &[
    ("front", Side::Front),
    ("right", Side::Right),
    ("back", Side::Back),
    ("rear", Side::Back),
    ("left", Side::Left),
    ("top", Side::Up),
    ("up", Side::Up),
    ("bottom", Side::Down),
    ("down", Side::Down),
    ("ft", Side::Front),
    ("rt", Side::Right),
    ("bk", Side::Back),
    ("lf", Side::Left),
    ("dn", Side::Down),
];

/// Axes as OpenGL has them: with +z before the viewer, +x is to the right and +y above.
const AXES: &[(&str, Side)] = &[
    ("posx", Side::Right),
    ("negx", Side::Left),
    ("posy", Side::Up),
    ("negy", Side::Down),
    ("posz", Side::Front),
    ("negz", Side::Back),
    ("px", Side::Right),
    ("nx", Side::Left),
    ("py", Side::Up),
    ("ny", Side::Down),
    ("pz", Side::Front),
    ("nz", Side::Back),
    ("+x", Side::Right),
    ("-x", Side::Left),
    ("+y", Side::Up),
    ("-y", Side::Down),
    ("+z", Side::Front),
    ("-z", Side::Back),
];

/// Letters; b is the back, as that is what d is not.
const LETTERS: &[(&str, Side)] = &[
    ("f", Side::Front),
    ("r", Side::Right),
    ("b", Side::Back),
    ("l", Side::Left),
    ("u", Side::Up),
    ("t", Side::Up),
    ("d", Side::Down),
];

/// Numbers in the order of OpenGL, +x -x +y -y +z -z.
const NUMBERS: &[(&str, Side)] = &[
    ("0", Side::Right),
    ("1", Side::Left),
    ("2", Side::Up),
    ("3", Side::Down),
    ("4", Side::Front),
    ("5", Side::Back),
];

/// Why files are not the sides of a cube by their names.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NamesError {
    /// A file's name tells no side.
    #[error(
        "{0}: its name tells no side of a cube (front, right, back, left, up, down; f, r, b, l, u, d; \
         px, nx, py, ny, pz, nz; 0 to 5); name the sides in the order of the files, such as --order frblud"
    )]
    NoSide(String),
    /// Two files are the same side.
    #[error(
        "{first} and {second} are both the side {side} by their names; name the sides in the order of the files, such as --order frblud"
    )]
    Twice {
        /// One file.
        first: String,
        /// The other.
        second: String,
        /// What both are.
        side: Side,
    },
}

/// The sides that files show, by their names.
///
/// # Errors
/// When a name tells none, or two tell the same.
pub fn sides_by_names(files: &[impl AsRef<Path>]) -> Result<Vec<Side>, NamesError> {
    let mut first_error = None;
    // Numbers tell sides only where there are all of them.
    let ways = [WORDS, AXES, LETTERS, NUMBERS];
    let ways = &ways[..if files.len() == 6 { 4 } else { 3 }];
    for way in ways {
        match by(way, files) {
            Ok(sides) => return Ok(sides),
            // One that is told twice is nearer to the truth than none.
            Err(error @ NamesError::Twice { .. }) => first_error = Some(error),
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    Err(first_error.unwrap_or(NamesError::NoSide(String::new())))
}

fn by(way: &[(&str, Side)], files: &[impl AsRef<Path>]) -> Result<Vec<Side>, NamesError> {
    let shown = |at: usize| files[at].as_ref().display().to_string();
    let mut sides = Vec::with_capacity(files.len());
    for (at, file) in files.iter().enumerate() {
        let stem = file.as_ref().file_stem().unwrap_or_default();
        let side = side_in(&stem.to_string_lossy().to_lowercase(), way);
        let side = side.ok_or_else(|| NamesError::NoSide(shown(at)))?;
        if let Some(before) = sides.iter().position(|other| *other == side) {
            return Err(NamesError::Twice {
                first: shown(before),
                second: shown(at),
                side,
            });
        }
        sides.push(side);
    }
    Ok(sides)
}

/// The side that a name tells: by a part of it that stands alone, the last such, or by its end.
fn side_in(stem: &str, way: &[(&str, Side)]) -> Option<Side> {
    let known = |part: &str| Some(way.iter().find(|(word, _)| *word == part)?.1);
    let parts = stem.split(|c: char| !c.is_alphanumeric() && c != '+' && c != '-');
    // A minus is also a hyphen: `town-front`.
    let alone = parts.flat_map(|part| [Some(part), part.rsplit_once('-').map(|both| both.1)]);
    let alone: Vec<&str> = alone.flatten().collect();
    if let Some(side) = alone.into_iter().rev().find_map(known) {
        return Some(side);
    }
    // `skyft`, `roomFront`; a single letter at the end means nothing.
    let ends = way
        .iter()
        .filter(|(word, _)| word.len() > 1 && stem.ends_with(word));
    Some(ends.max_by_key(|(word, _)| word.len())?.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_ways_to_name_six_files_are_understood() {
        use Side::{Back, Down, Front, Left, Right, Up};
        let all = [Front, Right, Back, Left, Up, Down];
        for (files, sides) in [
            (
                [
                    "front.png",
                    "right.png",
                    "back.png",
                    "left.png",
                    "top.png",
                    "bottom.png",
                ],
                all,
            ),
            (
                [
                    "a/F.exr", "a/R.exr", "a/B.exr", "a/L.exr", "a/U.exr", "a/D.exr",
                ],
                all,
            ),
            (
                [
                    "pano_f.jpg",
                    "pano_r.jpg",
                    "pano_b.jpg",
                    "pano_l.jpg",
                    "pano_u.jpg",
                    "pano_d.jpg",
                ],
                all,
            ),
            (
                [
                    "nightft.tif",
                    "nightrt.tif",
                    "nightbk.tif",
                    "nightlf.tif",
                    "nightup.tif",
                    "nightdn.tif",
                ],
                all,
            ),
            (
                [
                    "town-front.1.png",
                    "town-right.1.png",
                    "town-rear.1.png",
                    "town-left.1.png",
                    "town-up.1.png",
                    "town-down.1.png",
                ],
                all,
            ),
            (
                ["px.hdr", "nx.hdr", "py.hdr", "ny.hdr", "pz.hdr", "nz.hdr"],
                [Right, Left, Up, Down, Front, Back],
            ),
            (
                [
                    "posx.jpg", "negx.jpg", "posy.jpg", "negy.jpg", "posz.jpg", "negz.jpg",
                ],
                [Right, Left, Up, Down, Front, Back],
            ),
            (
                ["+X.png", "-X.png", "+Y.png", "-Y.png", "+Z.png", "-Z.png"],
                [Right, Left, Up, Down, Front, Back],
            ),
            (
                [
                    "s_0.png", "s_1.png", "s_2.png", "s_3.png", "s_4.png", "s_5.png",
                ],
                [Right, Left, Up, Down, Front, Back],
            ),
            (
                [
                    "RoomFront.png",
                    "RoomRight.png",
                    "RoomBack.png",
                    "RoomLeft.png",
                    "RoomTop.png",
                    "RoomBottom.png",
                ],
                all,
            ),
        ] {
            assert_eq!(sides_by_names(&files), Ok(sides.to_vec()), "{files:?}");
        }
        // A few sides will do, but numbers only if all are there.
        assert_eq!(sides_by_names(&["px.png", "nx.png"]), Ok(vec![Right, Left]));
        assert!(sides_by_names(&["0.png", "1.png"]).is_err());
    }

    #[test]
    fn names_that_tell_none_or_the_same_are_told() {
        let error = sides_by_names(&["front.png", "town.png"]).expect_err("town is no side");
        assert!(error.to_string().contains("town.png"), "{error}");
        let error = sides_by_names(&["a_front.png", "b_front.png"]).expect_err("one is too many");
        assert!(error.to_string().contains("b_front.png"), "{error}");
    }
}
