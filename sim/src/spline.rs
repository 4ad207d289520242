//! A smooth curve in space, walked by its arc length.

use nalgebra::Vector3;

/// Distance between the knots of the final curve (m): fine against every bend of an artery, and it leaves the
/// speed within 1e-4 of one.
const KNOT_SPACING_M: f64 = 4e-3;

/// A step of the nearest point's search after which the next would be below 1e-8 m.
const NEAREST_STEP_M: f64 = 3e-5;

/// A C2 curve through points in space: a cubic spline whose parameter is its arc length.
///
/// Beyond its ends it goes on straight.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    spacing: f64,
    points: Vec<Vector3<f64>>,
    second: Vec<Vector3<f64>>,
    axis: Vector3<f64>,
    /// Arc length at equal steps along `axis`, from the first point's place on; empty when the curve turns back.
    shadow: Vec<f64>,
}

/// Place, first and second derivative with respect to the arc length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet {
    pub(crate) at: Vector3<f64>,
    pub(crate) first: Vector3<f64>,
    pub(crate) second: Vector3<f64>,
}

impl Curve {
    /// The curve through `through` (at least two points, neighbours apart).
    pub(crate) fn through(through: &[Vector3<f64>]) -> Self {
        let mut points = through.to_vec();
        // Each round brings the parameter nearer to the arc length; three leave 1e-5.
        for _ in 0..3 {
            points = resampled(&points);
        }
        let spacing = mean_chord(&points);
        let second = natural_second(&points, &vec![spacing; points.len().saturating_sub(1)]);
        let mut curve = Self { spacing, points, second, axis: Vector3::z(), shadow: Vec::new() };
        curve.cast_shadow();
        curve
    }

    pub(crate) fn length(&self) -> f64 {
        self.spacing * (self.points.len() - 1) as f64
    }

    pub(crate) fn jet(&self, s: f64) -> Jet {
        let inside = s.clamp(0.0, self.length());
        let cell = ((inside / self.spacing) as usize).min(self.points.len() - 2);
        let h = self.spacing;
        let b = inside / h - cell as f64;
        let a = 1.0 - b;
        let (p0, p1) = (self.points[cell], self.points[cell + 1]);
        let (m0, m1) = (self.second[cell], self.second[cell + 1]);
        let at = p0 * a + p1 * b + (m0 * (a * a * a - a) + m1 * (b * b * b - b)) * (h * h / 6.0);
        let first = (p1 - p0) / h + (m1 * (3.0 * b * b - 1.0) - m0 * (3.0 * a * a - 1.0)) * (h / 6.0);
        Jet { at: at + first * (s - inside), first, second: m0 * a + m1 * b }
    }

    /// Arc length of the point of the curve that is nearest to `to`, within its ends, and the way from there to `to`.
    pub(crate) fn nearest(&self, to: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let mut s = self.guess(to);
        for _ in 0..8 {
            let jet = self.jet(s);
            let off = to - jet.at;
            // Newton, held to descent where `to` lies beyond the centre of curvature.
            let step = off.dot(&jet.first) / (1.0 - off.dot(&jet.second)).max(0.5);
            let moved = (s + step).clamp(0.0, self.length());
            let by = moved - s;
            s = moved;
            if by.abs() < NEAREST_STEP_M {
                // What is left is of second order: the tangent and the bend reach it.
                return (s, off - jet.first * by - jet.second * (0.5 * by * by));
            }
        }
        (s, to - self.jet(s).at)
    }

    fn guess(&self, to: &Vector3<f64>) -> f64 {
        if self.shadow.is_empty() {
            let nearest = (0..self.points.len()).min_by(|&a, &b| {
                (self.points[a] - to).norm_squared().total_cmp(&(self.points[b] - to).norm_squared())
            });
            return nearest.unwrap_or(0) as f64 * self.spacing;
        }
        let along = (to - self.points[0]).dot(&self.axis) / self.spacing;
        let cell = (along.max(0.0) as usize).min(self.shadow.len() - 1);
        self.shadow[cell]
    }

    /// Tabulates arc length against the way along the chord, when the curve never turns far from it: then a
    /// point's nearest is found from its own way along the chord without a search.
    fn cast_shadow(&mut self) {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        self.axis = (last - first).normalize();
        let ways: Vec<f64> = self.points.iter().map(|p| (p - first).dot(&self.axis)).collect();
        if ways.windows(2).any(|w| w[1] - w[0] < 0.5 * self.spacing) {
            return;
        }
        let cells = ((last - first).norm() / self.spacing).ceil() as usize + 1;
        let mut knot = 0;
        for cell in 0..cells {
            let way = (cell as f64 + 0.5) * self.spacing;
            while knot + 2 < ways.len() && ways[knot + 1] < way {
                knot += 1;
            }
            let fraction = ((way - ways[knot]) / (ways[knot + 1] - ways[knot])).clamp(0.0, 1.0);
            self.shadow.push((knot as f64 + fraction) * self.spacing);
        }
    }
}

fn mean_chord(points: &[Vector3<f64>]) -> f64 {
    let total: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    // A chord is shorter than its arc by (curvature h)^2 / 24: 7e-5 of it at a bend of 100 mm radius.
    total / (points.len() - 1) as f64
}

/// Points at equal arc length along the natural cubic spline through `points`.
fn resampled(points: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let chords: Vec<f64> = points.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
    let second = natural_second(points, &chords);
    const FINE: usize = 64;
    let mut fine = vec![points[0]];
    for (i, &h) in chords.iter().enumerate() {
        for k in 1..=FINE {
            let b = k as f64 / FINE as f64;
            let a = 1.0 - b;
            let bend = second[i] * (a * a * a - a) + second[i + 1] * (b * b * b - b);
            fine.push(points[i] * a + points[i + 1] * b + bend * (h * h / 6.0));
        }
    }
    let mut ways = vec![0.0];
    for w in fine.windows(2) {
        ways.push(ways[ways.len() - 1] + (w[1] - w[0]).norm());
    }
    let total = ways[ways.len() - 1];
    let cells = ((total / KNOT_SPACING_M).round() as usize).max(4);
    (0..=cells).map(|i| at_way(&fine, &ways, total * i as f64 / cells as f64)).collect()
}

fn at_way(fine: &[Vector3<f64>], ways: &[f64], way: f64) -> Vector3<f64> {
    let after = ways.partition_point(|&w| w < way).clamp(1, ways.len() - 1);
    let fraction = (way - ways[after - 1]) / (ways[after] - ways[after - 1]);
    fine[after - 1].lerp(&fine[after], fraction)
}

/// Second derivatives at the knots of the natural cubic spline (the tridiagonal system, solved by elimination).
fn natural_second(points: &[Vector3<f64>], chords: &[f64]) -> Vec<Vector3<f64>> {
    let n = points.len();
    let mut second = vec![Vector3::zeros(); n];
    let mut upper = vec![0.0; n];
    for i in 1..n - 1 {
        let (h0, h1) = (chords[i - 1], chords[i]);
        let slope = (points[i + 1] - points[i]) / h1 - (points[i] - points[i - 1]) / h0;
        let pivot = 2.0 * (h0 + h1) - h0 * upper[i - 1];
        upper[i] = h1 / pivot;
        second[i] = (slope * 6.0 - second[i - 1] * h0) / pivot;
    }
    for i in (1..n - 1).rev() {
        second[i] = second[i] - second[i + 1] * upper[i];
    }
    second
}

/// A C2 curve of one number over another, constant beyond its ends.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    from: f64,
    curve: Vec<Vector3<f64>>,
    second: Vec<Vector3<f64>>,
    spacing: f64,
}

impl Profile {
    /// Three numbers at once, at `from`, `from + spacing`, ...; flat at both ends.
    pub(crate) fn new(from: f64, spacing: f64, values: &[Vector3<f64>]) -> Self {
        let mut curve = values.to_vec();
        // The end values held once more on each side: the natural spline through them is nearly flat there, and
        // `at` leads the rest of the slope out (C1 where it meets the constant).
        if let (Some(&first), Some(&last)) = (values.first(), values.last()) {
            curve.insert(0, first);
            curve.push(last);
        }
        let second = natural_second(&curve, &vec![spacing; curve.len() - 1]);
        Self { from: from - spacing, curve, second, spacing }
    }

    /// Values and slopes at `x`.
    pub(crate) fn at(&self, x: f64) -> (Vector3<f64>, Vector3<f64>) {
        let h = self.spacing;
        let cells = (self.curve.len() - 1) as f64;
        let t = (x - self.from) / h;
        // The way is slowed smoothly to rest over the first and last cell, so that value and slope stay C1.
        let (slowed, rate) = slowed(t, cells);
        let cell = (slowed as usize).min(self.curve.len() - 2);
        let b = slowed - cell as f64;
        let a = 1.0 - b;
        let (p0, p1) = (self.curve[cell], self.curve[cell + 1]);
        let (m0, m1) = (self.second[cell], self.second[cell + 1]);
        let value = p0 * a + p1 * b + (m0 * (a * a * a - a) + m1 * (b * b * b - b)) * (h * h / 6.0);
        let slope = (p1 - p0) / h + (m1 * (3.0 * b * b - 1.0) - m0 * (3.0 * a * a - 1.0)) * (h / 6.0);
        (value, slope * rate)
    }
}

/// `t` inside, and a parabola that comes to rest over half a cell before each end; with its rate.
fn slowed(t: f64, cells: f64) -> (f64, f64) {
    if t > cells / 2.0 {
        let (from_end, rate) = slowed(cells - t, cells);
        return (cells - from_end, rate);
    }
    match t {
        // Rest at 0.5 - 0.25: the parabola t -> (t + 0.5)^2 / 2 meets the line at t = 0.5 with slope one.
        t if t < -0.5 => (0.0, 0.0),
        t if t < 0.5 => ((t + 0.5) * (t + 0.5) / 2.0, t + 0.5),
        t => (t, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bend() -> Curve {
        let points: Vec<_> = (0..12)
            .map(|i| {
                let z = -0.04 * f64::from(i);
                Vector3::new(0.02 * (z * 12.0).sin(), 0.01 * (z * 20.0).cos(), z)
            })
            .collect();
        Curve::through(&points)
    }

    #[test]
    fn the_parameter_is_the_arc_length() {
        let curve = bend();
        let steps = 20_000;
        let mut way = 0.0;
        let mut worst: f64 = 0.0;
        for i in 0..steps {
            let s = curve.length() * f64::from(i) / f64::from(steps);
            let next = curve.length() * f64::from(i + 1) / f64::from(steps);
            way += (curve.jet(next).at - curve.jet(s).at).norm();
            worst = worst.max((way - next).abs());
        }
        assert!(worst < 2e-5, "off by {worst} m over {} m", curve.length());
    }

    #[test]
    fn its_derivatives_are_those_of_finite_differences() {
        let curve = bend();
        for i in 0..400 {
            let s = 0.003 + (curve.length() - 0.006) * f64::from(i) / 400.0;
            let (before, here, after) = (curve.jet(s - 1e-5), curve.jet(s), curve.jet(s + 1e-5));
            assert!(((after.at - before.at) / 2e-5 - here.first).norm() < 1e-6);
            assert!(((after.first - before.first) / 2e-5 - here.second).norm() < 1e-2);
            assert!((after.second - before.second).norm() < 1e-1, "the bend jumps");
        }
    }

    #[test]
    fn the_nearest_point_is_the_nearest_of_a_fine_search() {
        let curve = bend();
        for i in 0..2000_u32 {
            let s = curve.length() * f64::from(i) / 2000.0;
            let angle = f64::from(i) * 2.4;
            let off = Vector3::new(angle.cos(), angle.sin(), 0.3 * (angle * 3.0).sin()) * 8e-3;
            let point = curve.jet(s).at + off;
            let (at, way) = curve.nearest(&point);
            let found = (curve.jet(at).at - point).norm();
            assert!((way.norm() - found).abs() < 1e-9);
            let searched = (0..400)
                .map(|k| {
                    (curve.jet((s - 0.02 + 1e-4 * f64::from(k)).clamp(0.0, curve.length())).at - point).norm()
                })
                .fold(f64::MAX, f64::min);
            assert!(found <= searched + 1e-9, "{found} against {searched} at {s}");
        }
    }

    #[test]
    fn a_profile_is_flat_beyond_its_ends_and_smooth_between() {
        let profile = Profile::new(-0.2, 0.1, &[1.0, 2.0, 1.5, 3.0].map(|v| Vector3::new(v, -v, 2.0 * v)));
        assert!(profile.at(-5.0).1.norm() == 0.0 && profile.at(5.0).1.norm() == 0.0);
        for i in 0..2000 {
            let x = -0.5 + 1e-3 * f64::from(i);
            let (before, after) = (profile.at(x - 1e-6), profile.at(x + 1e-6));
            assert!(((after.0 - before.0) / 2e-6 - profile.at(x).1).norm() < 1e-2, "at {x}");
        }
    }
}
