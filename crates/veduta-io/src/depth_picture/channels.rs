//! Which channels of a file hold colour, opacity and depth.
//!
//! OpenEXR names only R, G, B, A and Z. Programs put layers before them ("ViewLayer.Combined.R"), write
//! them small, or name the layer rather than the channel ("depth.Z", "Depth.V"); and not every Z is a
//! depth: "Normal.Z" and "P.z" are coordinates, which is seen by the X and Y beside them.

use super::DepthProblem;

/// A channel with the layers it is in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FullName {
    pub name: String,
    /// Which it is: its part, and the channel in that.
    pub place: [usize; 2],
}

/// The channels that are to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    pub depth: [usize; 2],
    pub depth_name: String,
    /// Red, green, blue.
    pub colors: [[usize; 2]; 3],
    pub opacity: Option<[usize; 2]>,
}

/// A name in small letters, cut at its last dot.
struct Cut<'a> {
    full: &'a FullName,
    layer: String,
    base: String,
}

impl<'a> Cut<'a> {
    fn new(full: &'a FullName) -> Self {
        let small = full.name.to_ascii_lowercase();
        let (layer, base) = small.rsplit_once('.').unwrap_or(("", &small));
        Self {
            full,
            layer: layer.to_owned(),
            base: base.to_owned(),
        }
    }

    /// The innermost layer.
    fn last_layer(&self) -> &str {
        self.layer.rsplit('.').next().unwrap_or_default()
    }

    /// The outermost layer.
    fn first_layer(&self) -> &str {
        self.layer.split('.').next().unwrap_or_default()
    }
}

const DEPTHS: [&str; 4] = ["depth", "zdepth", "z", "deep"];

impl Found {
    /// Chooses among `names`, which are in the file's order. `asked` is the channel of depth, if the user
    /// names it.
    ///
    /// # Errors
    /// When there is no depth, more than one equally good, or no colour.
    pub fn of(names: &[FullName], asked: Option<&str>) -> Result<Self, DepthProblem> {
        let cut: Vec<Cut> = names.iter().map(Cut::new).collect();
        let depth = match asked {
            Some(asked) => named(&cut, asked)?,
            None => depth(&cut)?,
        };
        let (colors, opacity) = colors(&cut, depth)?;
        Ok(Self {
            depth: depth.full.place,
            depth_name: depth.full.name.clone(),
            colors,
            opacity,
        })
    }
}

/// All names, for messages; a file can have hundreds.
fn told<'a>(names: impl Iterator<Item = &'a Cut<'a>>) -> String {
    const MOST: usize = 12;
    let names: Vec<&str> = names.map(|cut| cut.full.name.as_str()).collect();
    match names.len() {
        0 => "none".to_owned(),
        count if count > MOST => {
            format!("{} and {} more", names[..MOST].join(", "), count - MOST)
        }
        _ => names.join(", "),
    }
}

fn named<'a>(cut: &'a [Cut<'a>], asked: &str) -> Result<&'a Cut<'a>, DepthProblem> {
    let found = cut.iter().find(|cut| cut.full.name == asked);
    found.ok_or_else(|| DepthProblem::NoSuchChannel {
        asked: asked.to_owned(),
        found: told(cut.iter()),
    })
}

/// How surely a channel is one of depth, the surest first; `None` if it is not.
fn rank(of: &Cut, cut: &[Cut]) -> Option<u8> {
    let has_sibling = |base: &str| cut.iter().any(|c| c.layer == of.layer && c.base == base);
    let in_depth = DEPTHS.contains(&of.last_layer());
    match of.base.as_str() {
        "z" if has_sibling("x") && has_sibling("y") => None,
        "z" if of.layer.is_empty() => Some(0),
        "z" if in_depth => Some(1),
        "depth" | "zdepth" if of.layer.is_empty() => Some(1),
        // A layer of one channel: Blender's compositor calls that V, others Y or R.
        "v" | "y" | "r" if in_depth => Some(2),
        "z" | "depth" | "zdepth" => Some(3),
        _ => None,
    }
}

fn depth<'a>(cut: &'a [Cut<'a>]) -> Result<&'a Cut<'a>, DepthProblem> {
    let ranked: Vec<(u8, &Cut)> = cut
        .iter()
        .filter_map(|of| Some((rank(of, cut)?, of)))
        .collect();
    let best = ranked.iter().map(|&(rank, _)| rank).min();
    let best: Vec<&Cut> = ranked
        .iter()
        .filter(|&&(rank, _)| Some(rank) == best)
        .map(|&(_, of)| of)
        .collect();
    match best[..] {
        [] => Err(DepthProblem::NoDepth {
            found: told(cut.iter()),
        }),
        [depth] => Ok(depth),
        _ => Err(DepthProblem::SeveralDepths {
            found: told(best.into_iter()),
        }),
    }
}

/// Places of red, green and blue, and of opacity.
type Colors = ([[usize; 2]; 3], Option<[usize; 2]>);

/// The colours: of the base layer, else of the layer that is the whole picture by its name, else of the
/// first that has any; those of the depth's own outermost layer before others.
fn colors(cut: &[Cut], depth: &Cut) -> Result<Colors, DepthProblem> {
    let of_layer = |layer: &str, bases: &[&str]| {
        let is = |c: &&Cut| c.layer == layer && bases.contains(&c.base.as_str());
        cut.iter().find(is).map(|c| c.full.place)
    };
    let colors_of = |layer: &str| {
        let red = of_layer(layer, &["r", "red"]);
        let green = of_layer(layer, &["g", "green"]);
        let blue = of_layer(layer, &["b", "blue"]);
        match (red, green, blue) {
            (Some(red), Some(green), Some(blue)) => Some([red, green, blue]),
            _ => of_layer(layer, &["y", "luminance"]).map(|grey| [grey; 3]),
        }
    };
    let rank = |c: &Cut| match c.last_layer() {
        "" => 0,
        "combined" => 1,
        "rgba" | "rgb" | "beauty" | "color" | "colour" | "image" | "composite" => 2,
        _ => 3,
    };
    let has_color = |c: &&Cut| {
        // Depth in a channel called R, G and B is no colour; coordinates have no such names.
        let is_depth = c.layer == depth.layer && !depth.layer.is_empty();
        !is_depth && colors_of(&c.layer).is_some()
    };
    // The first of equals, which is the first in the file.
    let best = cut.iter().filter(has_color).min_by_key(|c| {
        let is_stranger = c.first_layer() != depth.first_layer();
        (rank(c), is_stranger)
    });
    let no_color = || DepthProblem::NoColor {
        found: told(cut.iter()),
    };
    let best = best.ok_or_else(no_color)?;
    let colors = colors_of(&best.layer).ok_or_else(no_color)?;
    Ok((colors, of_layer(&best.layer, &["a", "alpha"])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(names: &[&str], asked: Option<&str>) -> Result<[String; 3], DepthProblem> {
        let names: Vec<FullName> = names
            .iter()
            .enumerate()
            .map(|(index, name)| FullName {
                name: (*name).to_owned(),
                place: [0, index],
            })
            .collect();
        let found = Found::of(&names, asked)?;
        let name = |place: [usize; 2]| names[place[1]].name.clone();
        let opacity = found.opacity.map_or("none".to_owned(), name);
        Ok([found.depth_name, name(found.colors[0]), opacity])
    }

    #[test]
    fn channels_of_common_programs_are_found() {
        for (program, names, expected) in [
            ("OpenEXR", "A B G R Z", "Z R A"),
            ("Nuke", "A B G R depth.Z", "depth.Z R A"),
            (
                "Blender, several layers",
                "ViewLayer.Combined.A ViewLayer.Combined.B ViewLayer.Combined.G \
                 ViewLayer.Combined.R ViewLayer.Depth.Z ViewLayer.Normal.X ViewLayer.Normal.Y \
                 ViewLayer.Normal.Z",
                "ViewLayer.Depth.Z ViewLayer.Combined.R ViewLayer.Combined.A",
            ),
            (
                "Blender's compositor",
                "Depth.V Image.A Image.B Image.G Image.R",
                "Depth.V Image.R Image.A",
            ),
            ("small letters", "a b g r z", "z r a"),
            ("a position beside", "A B G P.x P.y P.z R Z", "Z R A"),
            ("V-Ray", "A B G R Z zDepth.R", "Z R A"),
            ("grey without opacity", "Y Z", "Z Y none"),
            ("a word", "B G R depth", "depth R none"),
            (
                "diffuse light before the picture",
                "beauty.R beauty.G beauty.B beauty.A direct.R direct.G direct.B Z",
                "Z beauty.R beauty.A",
            ),
        ] {
            let names: Vec<&str> = names.split_whitespace().collect();
            let found = found(&names, None).unwrap_or_else(|error| panic!("{program}: {error}"));
            assert_eq!(found.join(" "), expected, "{program}");
        }
    }

    #[test]
    fn what_cannot_be_chosen_is_asked_for() {
        let layers = [
            "a.Depth.Z",
            "b.Depth.Z",
            "a.R",
            "a.G",
            "a.B",
            "b.R",
            "b.G",
            "b.B",
        ];
        let error = found(&layers, None).expect_err("two depths");
        assert!(
            error.to_string().contains("a.Depth.Z, b.Depth.Z"),
            "{error}"
        );
        let of_b = found(&layers, Some("b.Depth.Z")).expect("asked for");
        assert_eq!(of_b[1], "b.R", "colours of the same layer");
        let error = found(&["R", "G", "B", "N.X", "N.Y", "N.Z"], None).expect_err("a normal");
        assert!(matches!(error, DepthProblem::NoDepth { .. }), "{error}");
        let error = found(&layers, Some("c")).expect_err("not there");
        assert!(matches!(error, DepthProblem::NoSuchChannel { .. }));
        let error = found(&["Z"], None).expect_err("no colour");
        assert!(matches!(error, DepthProblem::NoColor { .. }));
    }
}
