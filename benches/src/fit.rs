//! The straight line through measured times.

/// `intercept + slope * x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Value at 0.
    pub intercept: f64,
    /// Change per unit of x.
    pub slope: f64,
}

impl Line {
    /// The line with the least squares of *relative* errors through `(x, y)`, y positive: times
    /// scatter by a share of themselves, and the longest must not decide alone.
    ///
    /// # Panics
    /// Unless there are two points with different x.
    pub fn through(points: &[(f64, f64)]) -> Self {
        let [mut w, mut wx, mut wy, mut wxx, mut wxy] = [0.0; 5];
        for &(x, y) in points {
            let weight = 1.0 / (y * y);
            w += weight;
            wx += weight * x;
            wy += weight * y;
            wxx += weight * x * x;
            wxy += weight * x * y;
        }
        let determinant = w * wxx - wx * wx;
        assert!(
            determinant > 0.0,
            "a line needs two points with different x"
        );
        let slope = (w * wxy - wx * wy) / determinant;
        Self {
            intercept: (wy - slope * wx) / w,
            slope,
        }
    }

    /// Where the line has the value `y`.
    pub fn x_of(&self, y: f64) -> f64 {
        (y - self.intercept) / self.slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_on_a_line_give_that_line() {
        let line = Line::through(&[(1.0, 5.0), (2.0, 7.0), (16.0, 35.0)]);
        assert!((line.intercept - 3.0).abs() < 1e-9 && (line.slope - 2.0).abs() < 1e-9);
        assert!((line.x_of(13.0) - 5.0).abs() < 1e-9);
    }
}
