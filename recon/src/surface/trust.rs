//! How far each contour is to be believed: less when its size or its place is not its neighbours'.

use super::bends::Bends;
use super::samples::Samples;
use crate::centreline::add;
use crate::spline::Banded;

/// How often contours that stand apart lose weight.
const ROUNDS: usize = 6;
/// What poses may be off by, one by one, before a contour's place is doubted (m).
const PLACE_SD_M: f64 = 0.15e-3;

/// From curves of the mean radii and of the places across the vessel, which outliers do not pull (Huber). The bends
/// follow the curve of the radii.
pub(super) fn of(bends: &mut Bends, contours: &[Samples]) -> Option<Vec<f64>> {
    let mut trust = vec![1.0; contours.len()];
    let knots = *bends.knots();
    for _ in 0..ROUNDS {
        let curves = curves(bends, contours, &trust)?;
        bends.follow(&curves[0]);
        for (trust, contour) in trust.iter_mut().zip(contours) {
            let (first, along) = knots.basis(contour.at);
            let off: [f64; 3] = std::array::from_fn(|k| {
                let expected: f64 = along.iter().zip(&curves[k][first..]).map(|(a, b)| a * b).sum();
                contour.means[k] - expected
            });
            let size = 2.0 * contour.own_sd / off[0].abs().max(1e-9);
            let place = 2.0 * contour.own_sd.hypot(PLACE_SD_M) / off[1].hypot(off[2]).max(1e-9);
            *trust = size.min(place).min(1.0);
        }
    }
    Some(trust)
}

fn curves(bends: &Bends, contours: &[Samples], trust: &[f64]) -> Option<[Vec<f64>; 3]> {
    let knots = bends.knots();
    let size = knots.coefficients();
    let mut matrix = Banded::new(size, 3);
    let mut rights: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; size]);
    for (contour, trust) in contours.iter().zip(trust) {
        let (first, along) = knots.basis(contour.at);
        let weight = trust * contour.points.iter().map(|point| point.weight).sum::<f64>();
        add(&mut matrix, first, &along, weight);
        for (right, mean) in rights.iter_mut().zip(contour.means) {
            right[first..].iter_mut().zip(&along).for_each(|(sum, along)| *sum += weight * along * mean);
        }
    }
    for (at, weight) in knots.bend_integral() {
        let (first, bend) = knots.bend(at);
        add(&mut matrix, first, &bend, weight * bends.weight(at));
    }
    (0..size).for_each(|i| matrix.add(i, i, 1e4));
    let factor = matrix.factor()?;
    Some(rights.map(|right| factor.solve(right)))
}
