//! Letters and digits of strokes, for test cards: they need no font and have any size.

use veduta::geometry::DVec2;

/// Width and height of the grid that letters are drawn on.
const WIDTH: f64 = 4.0;
const HEIGHT: f64 = 6.0;
/// From a letter to the next.
const ADVANCE: f64 = 5.5;

/// Of each letter its strokes, as corners of one digit for x and one for y, from the left top corner.
const LETTERS: &[(char, &str)] = &[
    ('A', "0602204246 0444"),
    ('B', "0600 0030414233 0333 3344453606"),
    ('C', "4130100105163645"),
    ('D', "0600 002042442606"),
    ('E', "40000646 0333"),
    ('F', "400006 0333"),
    ('G', "41301001051636454323"),
    ('H', "0006 4046 0343"),
    ('I', "2026 1030 1636"),
    ('K', "0006 400346"),
    ('L', "000646"),
    ('N', "06004640"),
    ('O', "103041453616050110"),
    ('P', "06003041423303"),
    ('R', "06003041423303 2346"),
    ('T', "0040 2026"),
    ('U', "000516364540"),
    ('W', "0016233640"),
    ('0', "103041453616050110"),
    ('1', "112026 1636"),
    ('2', "01103041420646"),
    ('3', "011030414233 1333 334445361605"),
    ('4', "36300444"),
    ('5', "400003334445361605"),
    ('6', "4130100105163645443303"),
    ('7', "004016"),
    ('8', "13020110304142331304051636454433"),
    ('9', "0516364541301001021343"),
    ('-', "0343"),
];

/// A straight stroke between two points.
pub type Stroke = [DVec2; 2];

/// The strokes of a text, `height` high and centred at `centre`; y goes down. What has no letter is left out.
pub fn strokes(text: &str, centre: DVec2, height: f64) -> Vec<Stroke> {
    let unit = height / HEIGHT;
    let count = text.chars().count() as f64;
    let size = DVec2::new((count - 1.0) * ADVANCE + WIDTH, HEIGHT);
    let mut found = Vec::new();
    for (place, letter) in text.chars().enumerate() {
        let known = LETTERS.iter().find(|(known, _)| *known == letter);
        let Some((_, lines)) = known else {
            continue;
        };
        let left = place as f64 * ADVANCE;
        for line in lines.split(' ') {
            let corners: Vec<DVec2> = line
                .as_bytes()
                .chunks_exact(2)
                .map(|at| {
                    let [x, y] = [at[0], at[1]].map(|digit| f64::from(digit - b'0'));
                    centre + unit * (DVec2::new(left + x, y) - 0.5 * size)
                })
                .collect();
            found.extend(corners.windows(2).map(|pair| [pair[0], pair[1]]));
        }
    }
    found
}

/// Distance of a point from the nearest stroke; infinite if there is none.
pub fn distance(strokes: &[Stroke], at: DVec2) -> f64 {
    let to = |[a, b]: &Stroke| {
        let along = *b - *a;
        let share = (at - *a).dot(along) / along.length_squared();
        (at - *a - along * share.clamp(0.0, 1.0)).length()
    };
    strokes.iter().map(to).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_stands_around_its_centre() {
        let centre = DVec2::new(3.0, 5.0);
        for text in [
            "FRONT",
            "RIGHT",
            "BACK",
            "LEFT",
            "UP",
            "DOWN",
            "0123456789-",
        ] {
            let strokes = strokes(text, centre, 2.0);
            let corners = strokes.iter().flatten();
            let (low, high) = corners.fold((centre, centre), |(low, high), corner| {
                (low.min(*corner), high.max(*corner))
            });
            assert!((high.y - low.y - 2.0).abs() < 1e-12, "{text}");
            assert!(
                (0.5 * (high + low) - centre).length() < 0.2,
                "{text}: {low} {high}"
            );
            for stroke in &strokes {
                assert_eq!(distance(std::slice::from_ref(stroke), stroke[0]), 0.0);
            }
        }
        assert_eq!(distance(&[], centre), f64::INFINITY);
    }
}
