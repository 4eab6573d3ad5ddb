use veduta_geometry::DVec2;

/// How many coefficients a polynomial of second degree in x and in y has.
pub(super) const COEFFICIENTS: usize = 9;

/// Of second degree in x and in y.
pub(super) struct Polynomial {
    coefficients: [DVec2; COEFFICIENTS],
}

impl Polynomial {
    /// Through values at the nodes -half, 0 and half of each axis, rows from the top.
    pub fn through(nodes: &[DVec2; 9], half: DVec2) -> Self {
        let along = |a: DVec2, b: DVec2, c: DVec2, half: f64| {
            [
                b,
                (c - a) / (2.0 * half),
                (c - 2.0 * b + a) / (2.0 * half * half),
            ]
        };
        let rows =
            [0, 1, 2].map(|j| along(nodes[3 * j], nodes[3 * j + 1], nodes[3 * j + 2], half.x));
        let mut coefficients = [DVec2::ZERO; COEFFICIENTS];
        for i in 0..3 {
            let of_power = along(rows[0][i], rows[1][i], rows[2][i], half.y);
            for (j, value) in of_power.into_iter().enumerate() {
                coefficients[3 * j + i] = value;
            }
        }
        Self { coefficients }
    }

    pub fn at(&self, DVec2 { x, y }: DVec2) -> DVec2 {
        let c = &self.coefficients;
        let row = |j: usize| c[3 * j] + x * (c[3 * j + 1] + x * c[3 * j + 2]);
        row(0) + y * (row(1) + y * row(2))
    }

    pub fn derivatives(&self, DVec2 { x, y }: DVec2) -> [DVec2; 2] {
        let c = &self.coefficients;
        let along = |j: usize| c[3 * j + 1] + 2.0 * x * c[3 * j + 2];
        let row = |j: usize| c[3 * j] + x * (c[3 * j + 1] + x * c[3 * j + 2]);
        [
            along(0) + y * (along(1) + y * along(2)),
            row(1) + 2.0 * y * row(2),
        ]
    }

    /// How much the derivatives by x and by y change over a pixel, about: along their own axis and the other.
    pub fn changes(&self) -> [DVec2; 2] {
        let c = &self.coefficients;
        let (xx, xy, yy) = (2.0 * c[2].abs(), c[4].abs(), 2.0 * c[6].abs());
        [xx.max(xy), yy.max(xy)]
    }

    /// How far between the nodes it may be beyond them.
    pub fn bend(&self, half: DVec2) -> DVec2 {
        let c = &self.coefficients;
        0.25 * (c[2].abs() * half.x * half.x
            + c[6].abs() * half.y * half.y
            + c[4].abs() * half.x * half.y)
    }

    /// Its mean around each point, over weights that have this variance along each axis.
    pub fn averaged(mut self, variance: f64) -> Self {
        let c = &mut self.coefficients;
        // The mean of x^2 is larger than that of x, squared, by the variance.
        for j in 0..3 {
            let along = c[3 * j + 2];
            c[3 * j] += variance * along;
        }
        for i in 0..3 {
            let along = c[6 + i];
            c[i] += variance * along;
        }
        self
    }

    pub fn coefficients(&self) -> [[f32; COEFFICIENTS]; 2] {
        [
            self.coefficients.map(|c| c.x as f32),
            self.coefficients.map(|c| c.y as f32),
        ]
    }
}
