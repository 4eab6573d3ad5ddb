//! Names of lenses, as they are given to verbs and told back.

use super::{FisheyeLaw, Lens, LensPolynomial};
use std::f64::consts::{PI, TAU};
use std::fmt;
use std::str::FromStr;

/// The lenses' names with what may follow them, for help and errors.
pub const LENS_NAMES: &str = "omnimax, omnimax:full (without the arc), domemaster[:FOV], fisheye[:FOV], angular, \
     equisolid[:FOV], stereographic[:FOV], orthographic[:FOV], polynomial:K1,K2,... (radians by powers of the radius), \
     equirect, cylinder[:VERTICAL_FOV], mercator[:LATITUDE], ball, perspective[:VERTICAL_FOV], face, equiangular";

/// Why a lens could not be told from its name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LensError {
    /// There is none of that name.
    #[error("there is no lens {name}; there are {LENS_NAMES}")]
    Unknown {
        /// What was given.
        name: String,
    },
    /// What follows the name is not what that lens takes.
    #[error("lens {name}: {what}")]
    Value {
        /// What was given, whole.
        name: String,
        /// What is wrong, and what would be right.
        what: String,
    },
}

/// The latitude at which Mercator's frame is a square.
const SQUARE_MERCATOR: f64 = 1.484_422_229_745_332_4;

impl FromStr for Lens {
    type Err = LensError;

    /// Angles are in degrees, with or without `deg`.
    fn from_str(given: &str) -> Result<Self, LensError> {
        let (name, value) = match given.split_once(':') {
            Some((name, value)) => (name, Some(value)),
            None => (given, None),
        };
        let wrong = |what: String| LensError::Value {
            name: given.into(),
            what,
        };
        let angle = |usual: f64, most: f64, reaches_most: bool| {
            value
                .map_or(Ok(usual), |value| degrees(value, most, reaches_most))
                .map_err(wrong)
        };
        let none = |lens: Self| match value {
            None => Ok(lens),
            Some(_) => Err(wrong(format!("nothing follows {name}"))),
        };
        let fisheye = |law, usual: f64, most: f64, reaches: bool| {
            angle(usual, most, reaches).map(|fov| Self::Fisheye { law, fov })
        };
        match name {
            "omnimax" => match value {
                None => Ok(Self::OMNIMAX),
                Some("full") => Ok(Self::Omnimax {
                    centre: 0.5,
                    arc: false,
                }),
                Some(_) => Err(wrong("only omnimax and omnimax:full are known".into())),
            },
            "domemaster" => angle(PI, TAU, true).map(|fov| Self::Domemaster { fov }),
            "fisheye" | "equidistant" => fisheye(FisheyeLaw::Equidistant, PI, TAU, true),
            "angular" => none(Self::Fisheye {
                law: FisheyeLaw::Equidistant,
                fov: TAU,
            }),
            "equisolid" => fisheye(FisheyeLaw::Equisolid, PI, TAU, true),
            "stereographic" => fisheye(FisheyeLaw::Stereographic, PI, TAU, false),
            "orthographic" => fisheye(FisheyeLaw::Orthographic, PI, PI, true),
            "polynomial" => {
                let numbers = value.unwrap_or_default().split(',');
                let numbers: Result<Vec<f64>, _> = numbers.map(|k| k.trim().parse()).collect();
                let numbers = numbers.map_err(|_| {
                    wrong("give the coefficients of r, r^2, ... as polynomial:K1,K2,...".into())
                })?;
                LensPolynomial::new(&numbers)
                    .map(Self::Polynomial)
                    .map_err(wrong)
            }
            "equirect" | "equirectangular" => none(Self::Equirect),
            "cylinder" => angle(0.5 * PI, PI, false).map(|fov| Self::Cylinder { fov }),
            "mercator" => {
                angle(SQUARE_MERCATOR, 0.5 * PI, false).map(|latitude| Self::Mercator { latitude })
            }
            "ball" => none(Self::Ball),
            "perspective" => angle(0.5 * PI, PI, false).map(|fov| Self::Perspective { fov }),
            "face" => none(Self::Perspective { fov: 0.5 * PI }),
            "equiangular" => none(Self::Equiangular),
            _ => Err(LensError::Unknown { name: given.into() }),
        }
    }
}

/// An angle above 0 and up to `most` (radians), or below it.
fn degrees(value: &str, most: f64, reaches_most: bool) -> Result<f64, String> {
    let number = value.strip_suffix("deg").unwrap_or(value).trim();
    let angle = number
        .parse()
        .map_err(|_| format!("{value} is not an angle in degrees"))
        .map(f64::to_radians)?;
    // Degrees that are `most` may come out a rounding above it.
    let angle: f64 = if (angle - most).abs() < 1e-12 {
        most
    } else {
        angle
    };
    if angle > 0.0 && (angle < most || reaches_most && angle == most) {
        return Ok(angle);
    }
    let bound = if reaches_most { "at most" } else { "below" };
    let most = most.to_degrees();
    Err(format!(
        "{value} is not above 0 and {bound} {most:.0} degrees"
    ))
}

impl fmt::Display for Lens {
    /// The name by which [`FromStr`] gives the same lens again (but for the centre of Omnimax).
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let angled = |f: &mut fmt::Formatter<'_>, name: &str, angle: f64| {
            // To 1e-9 degrees, so that 180 is not 179.99999999999997.
            let degrees = (angle.to_degrees() * 1e9).round() / 1e9;
            write!(f, "{name}:{degrees}")
        };
        match self {
            Self::Omnimax { arc: true, .. } => f.write_str("omnimax"),
            Self::Omnimax { arc: false, .. } => f.write_str("omnimax:full"),
            Self::Domemaster { fov } => angled(f, "domemaster", *fov),
            Self::Fisheye { law, fov } => {
                let name = match law {
                    FisheyeLaw::Equidistant => "fisheye",
                    FisheyeLaw::Equisolid => "equisolid",
                    FisheyeLaw::Stereographic => "stereographic",
                    FisheyeLaw::Orthographic => "orthographic",
                };
                angled(f, name, *fov)
            }
            Self::Polynomial(polynomial) => {
                f.write_str("polynomial")?;
                for (index, k) in polynomial.coefficients().iter().enumerate() {
                    write!(f, "{}{k}", if index == 0 { ':' } else { ',' })?;
                }
                Ok(())
            }
            Self::Equirect => f.write_str("equirect"),
            Self::Cylinder { fov } => angled(f, "cylinder", *fov),
            Self::Mercator { latitude } => angled(f, "mercator", *latitude),
            Self::Ball => f.write_str("ball"),
            Self::Perspective { fov } => angled(f, "perspective", *fov),
            Self::Equiangular => f.write_str("equiangular"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_back() {
        for name in [
            "omnimax",
            "omnimax:full",
            "domemaster:180",
            "fisheye:220",
            "equisolid:180",
            "stereographic:270",
            "orthographic:170",
            "polynomial:1.4,0,-0.1",
            "equirect",
            "cylinder:90",
            "mercator:80",
            "ball",
            "perspective:60",
            "equiangular",
        ] {
            let lens: Lens = name.parse().expect(name);
            assert_eq!(lens.to_string(), name);
        }
        assert_eq!("angular".parse::<Lens>(), "fisheye:360deg".parse());
        assert_eq!(
            "mercator".parse::<Lens>().map(|l| l.aspect() > 0.999),
            Ok(true)
        );
    }

    #[test]
    fn errors_tell_what_would_be_right() {
        let error = |name: &str| name.parse::<Lens>().expect_err(name).to_string();
        assert!(error("fish").contains("fisheye[:FOV]"));
        assert!(error("fisheye:400").contains("at most 360 degrees"));
        assert!(error("stereographic:360").contains("below 360"));
        assert!(error("fisheye:wide").contains("not an angle"));
        assert!(error("equirect:3").contains("nothing follows equirect"));
        assert!(error("polynomial").contains("polynomial:K1,K2"));
        assert!(error("polynomial:1,-3").contains("must grow"));
        assert!(error("polynomial:4").contains("more than 180"));
        assert!(error("perspective:nan").contains("above 0"));
    }
}
