//! The plane of one image among the wires, refined by the distances of its dots from their wires.

use nalgebra::{Matrix2, Matrix2x3, Rotation3, SMatrix, SVector, Vector2, Vector3};

use super::section::{Section, Strand};
use super::seen::Seen;

/// Six of the pose, two of the scale.
const FREE: usize = 8;
/// Parts of the normal equations.
type Square = SMatrix<f64, FREE, FREE>;
type Column = SVector<f64, FREE>;

/// Where the image is in the section's axes, and by how much (logarithm) its two axes are longer than was said.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub turn: Rotation3<f64>,
    pub origin: Vector3<f64>,
    pub stretch: Vector2<f64>,
}

/// A dot and the wire that may have made it: indices.
pub(super) type Match = (usize, usize);

/// How much is believed before any dot is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Belief {
    /// The image is across the wires within this (standard deviation of the sine of the tilt).
    pub tilt_sd: f64,
    /// The pixel size is right within this (relative).
    pub scale_sd: f64,
    /// A wire is where the phantom's file says within this (m).
    pub place_sd_m: f64,
}

/// Of a wire crossing the plane: where in the image (m), and how obliquely (cosine to the plane's normal).
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub at: Vector2<f64>,
    pub upright: f64,
    /// How far inside its ends (m): negative is beyond them.
    pub inside: f64,
}

impl Plane {
    fn stretched(&self, at: Vector2<f64>) -> Vector3<f64> {
        Vector3::new(at.x * self.stretch.x.exp(), at.y * self.stretch.y.exp(), 0.0)
    }

    /// Where a place in the image lies, in the section's axes.
    pub fn place(&self, at: Vector2<f64>) -> Vector3<f64> {
        self.turn * self.stretched(at) + self.origin
    }

    /// Where a wire's line crosses the image.
    pub fn crossing(&self, strand: &Strand) -> Option<Crossing> {
        let front = self.turn.inverse_transform_vector(&(strand.front - self.origin));
        let direction = self.turn.inverse_transform_vector(&strand.direction);
        if direction.z.abs() < 0.1 {
            return None;
        }
        let along = -front.z / direction.z;
        let cross = front + direction * along;
        let at = Vector2::new(cross.x * (-self.stretch.x).exp(), cross.y * (-self.stretch.y).exp());
        let inside = along.min(strand.length - along);
        Some(Crossing { at, upright: direction.z.abs(), inside })
    }

    /// How a dot is off its wire: the two distances across the wire, and their covariance with the belief in its place.
    fn off(&self, seen: &Seen, strand: &Strand, belief: &Belief) -> (Vector2<f64>, Matrix2<f64>) {
        let p = self.place(seen.at) - strand.front;
        let [a, b] = &strand.across;
        let across = self.across(strand);
        let image = across.fixed_columns::<2>(0).into_owned();
        let place = Matrix2::identity() * belief.place_sd_m.powi(2);
        (Vector2::new(a.dot(&p), b.dot(&p)), image * seen.covariance * image.transpose() + place)
    }

    /// Takes the image's vectors to the two distances across a wire.
    fn across(&self, strand: &Strand) -> Matrix2x3<f64> {
        let [a, b] = &strand.across;
        let rows = [a, b].map(|n| self.turn.inverse_transform_vector(n).transpose());
        Matrix2x3::from_rows(&rows)
    }

    /// Square of how many standard deviations a dot is off a wire, and the determinant of their covariance (m⁴).
    pub fn misfit(&self, seen: &Seen, strand: &Strand, belief: &Belief) -> (f64, f64) {
        let (off, covariance) = self.off(seen, strand, belief);
        let inverse = covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
        ((off.transpose() * inverse * off).x, covariance.determinant())
    }

    /// How far a dot is from its wire (m).
    pub fn distance(&self, seen: &Seen, strand: &Strand) -> f64 {
        let p = self.place(seen.at) - strand.front;
        Vector2::new(strand.across[0].dot(&p), strand.across[1].dot(&p)).norm()
    }

    /// A few steps of Gauss-Newton on the distances of dots from their wires, robust (Huber); dots that are cut have
    /// no say.
    pub fn refine(
        &mut self,
        section: &Section,
        seen: &[Seen],
        matches: &[Match],
        belief: &Belief,
        steps: usize,
    ) {
        for _ in 0..steps {
            let (mut square, mut column) = self.prior(section, belief);
            for &(dot, wire) in matches.iter().filter(|&&(dot, _)| !seen[dot].cut) {
                self.add(&seen[dot], &section.strands[wire], belief, (&mut square, &mut column));
            }
            let Some(factor) = square.cholesky() else { return };
            self.step(&factor.solve(&column));
        }
    }

    /// What is believed of the tilt, the scale, and (hardly anything) of the place.
    fn prior(&self, section: &Section, belief: &Belief) -> (Square, Column) {
        let (mut square, mut column) = (Square::zeros(), Column::zeros());
        let r = self.turn.matrix();
        for axis in 0..2 {
            let mut j = Column::zeros();
            // The normal is the third column; turned by w (in the image) it moves by turn · (w × z).
            (j[0], j[1]) = (-r[(axis, 1)], r[(axis, 0)]);
            let w = belief.tilt_sd.powi(-2);
            square += j * j.transpose() * w;
            column -= j * (w * r[(axis, 2)]);
            let w = belief.scale_sd.powi(-2);
            square[(6 + axis, 6 + axis)] += w;
            column[6 + axis] -= w * self.stretch[axis];
        }
        let middle = (section.reach.0 + section.reach.1) / 2.0;
        for (i, weight) in [(3, 1e-6), (4, 1e-6), (5, 1.0)] {
            square[(i, i)] += weight;
            column[i] -= if i == 5 { weight * (self.origin.z - middle) } else { 0.0 };
        }
        (square, column)
    }

    fn add(&self, seen: &Seen, strand: &Strand, belief: &Belief, into: (&mut Square, &mut Column)) {
        let (off, covariance) = self.off(seen, strand, belief);
        let Some(mut weight) = covariance.try_inverse() else { return };
        let sigmas = (off.transpose() * weight * off).x.max(0.0).sqrt();
        weight *= if sigmas > 2.0 { 2.0 / sigmas } else { 1.0 };
        let (across, q) = (self.across(strand), self.stretched(seen.at));
        let mut j = SMatrix::<f64, 2, FREE>::zeros();
        j.fixed_columns_mut::<3>(0).copy_from(&(-across * q.cross_matrix()));
        for (row, n) in strand.across.iter().enumerate() {
            j.fixed_view_mut::<1, 3>(row, 3).copy_from(&n.transpose());
            j[(row, 6)] = across[(row, 0)] * q.x;
            j[(row, 7)] = across[(row, 1)] * q.y;
        }
        let weighted = j.transpose() * weight;
        *into.0 += weighted * j;
        *into.1 -= weighted * off;
    }

    fn step(&mut self, by: &Column) {
        let turn = Vector3::new(by[0], by[1], by[2]);
        // A longer turn than this is a step out of where the linear model holds.
        let turn = turn * (0.3 / turn.norm()).min(1.0);
        self.turn *= Rotation3::new(turn);
        self.origin += Vector3::new(by[3], by[4], by[5]);
        self.stretch += Vector2::new(by[6], by[7]);
        self.stretch = self.stretch.map(|s| s.clamp(-0.3, 0.3));
    }
}
