//! Points at uniform spacing along the arc of a curve whose parameter is not its length.

use nalgebra::{SVector, Vector3};
use probepath_robot::motion::spline::Spline;

/// Places and half weights of the three-point Gauss-Legendre rule on -1..1.
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.774_596_669_241_483_4, 5.0 / 18.0)];

/// The parameters of points `spacing` apart along the arc of the curve's first three coordinates, from its start
/// on; what is left at the end is shorter than `spacing`.
pub(super) fn uniform(curve: &Spline<6>, spacing: f64) -> Vec<f64> {
    let pieces = curve.knots().len() - 1;
    let (mut found, mut behind) = (vec![0.0], 0.0);
    for piece in 0..pieces {
        let (from, until) = (curve.step() * piece as f64, curve.step() * (piece + 1) as f64);
        let length = arc(curve, from, until);
        while found.len() as f64 * spacing <= behind + length * (1.0 + 1e-12) {
            let wanted = found.len() as f64 * spacing - behind;
            found.push(invert(curve, from, until, wanted, length));
        }
        behind += length;
    }
    found
}

fn speed(curve: &Spline<6>, u: f64) -> f64 {
    let first: SVector<f64, 6> = curve.at(u)[1];
    Vector3::new(first[0], first[1], first[2]).norm()
}

/// Length of the arc between two parameters within one piece (m).
fn arc(curve: &Spline<6>, from: f64, until: f64) -> f64 {
    let (middle, half) = ((from + until) / 2.0, (until - from) / 2.0);
    GAUSS.iter().map(|(x, w)| w * speed(curve, middle + half * x)).sum::<f64>() * (until - from)
}

/// The parameter `wanted` metres after `from` within the piece `from..until`, which is `length` long.
fn invert(curve: &Spline<6>, from: f64, until: f64, wanted: f64, length: f64) -> f64 {
    let mut u = from + (until - from) * (wanted / length.max(1e-12)).clamp(0.0, 1.0);
    for _ in 0..4 {
        let rate = speed(curve, u).max(1e-9);
        u = (u + (wanted - arc(curve, from, u)) / rate).clamp(from, until);
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_driven_unevenly_is_cut_evenly() {
        let knots = (0..200)
            .map(|i| {
                let u = f64::from(i) * 0.01;
                let angle = u + 0.3 * (2.0 * u).sin();
                SVector::from([0.1 * angle.cos(), 0.1 * angle.sin(), 0.0, 0.0, 0.0, 0.0])
            })
            .collect();
        let curve = Spline::through(0.01, knots).unwrap();
        let places: Vec<_> = uniform(&curve, 0.0005).iter().map(|u| curve.at(*u)[0]).collect();
        assert!(places.len() > 300);
        let chord = 2.0 * 0.1 * (0.0005_f64 / 0.2).sin();
        for pair in places.windows(2) {
            assert!(((pair[1] - pair[0]).norm() - chord).abs() < 1e-9, "{}", (pair[1] - pair[0]).norm());
        }
    }
}
