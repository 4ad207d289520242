//! What an outlier counts, and how large errors are when outliers do not count.

use super::Robust;

/// Median of the length of a vector of two standard normal numbers: the root of 2 ln 2.
const MEDIAN_OF_TWO: f64 = 1.177_410_022_515_474_6;

impl Robust {
    /// Cost of a dot whose squared error is `squared` standard deviations squared, and its derivative by that square,
    /// twice: the weight.
    pub(super) fn cost(self, squared: f64) -> (f64, f64) {
        match self {
            Self::None => (squared / 2.0, 1.0),
            Self::Huber(limit) if squared <= limit * limit => (squared / 2.0, 1.0),
            Self::Huber(limit) => {
                let error = squared.sqrt();
                (limit * (error - limit / 2.0), limit / error)
            }
            Self::Cauchy(limit) => {
                let part = squared / (limit * limit);
                (limit * limit / 2.0 * part.ln_1p(), 1.0 / (1.0 + part))
            }
        }
    }

    /// Mean curvature of the cost over the two directions of a dot: what of its weight an error really feels.
    pub(super) fn curvature(self, squared: f64) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Huber(limit) if squared <= limit * limit => 1.0,
            Self::Huber(limit) => limit / squared.sqrt() / 2.0,
            Self::Cauchy(limit) => {
                let part = squared / (limit * limit);
                let weight = 1.0 / (1.0 + part);
                weight - part * weight * weight
            }
        }
    }
}

/// Standard deviation of errors in the plane by the median of their squared lengths, for `dots` dots and
/// `parameters` parameters. Emptied into order.
pub(super) fn scale(squared: &mut [f64], parameters: usize) -> Option<f64> {
    if squared.is_empty() {
        return None;
    }
    let numbers = 2.0 * squared.len() as f64;
    let middle = squared.len() / 2;
    let (_, median, _) = squared.select_nth_unstable_by(middle, f64::total_cmp);
    // The fit follows the dots a little: a parameter takes one number's worth of error away.
    let freedom = (numbers / (numbers - parameters as f64).max(1.0)).sqrt();
    Some(median.sqrt() / MEDIAN_OF_TWO * freedom)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Robust; 3] = [Robust::None, Robust::Huber(1.7), Robust::Cauchy(2.4)];

    #[test]
    fn a_weight_is_twice_the_slope_of_the_cost() {
        for robust in ALL {
            for squared in [0.01, 0.5, 2.0, 2.8, 3.0, 20.0, 1e4] {
                let step = 1e-5 * squared;
                let rise = robust.cost(squared + step).0 - robust.cost(squared - step).0;
                let weight = robust.cost(squared).1;
                assert!((rise / step - weight).abs() < 1e-6 * weight, "{robust:?} at {squared}");
            }
        }
    }

    #[test]
    fn the_curvature_is_the_mean_second_derivative_in_the_plane() {
        for robust in ALL {
            for error in [0.3, 1.0, 2.0, 7.0] {
                let at = |x: f64, y: f64| robust.cost(x * x + y * y).0;
                let step = 1e-4;
                let second = |plus: f64, minus: f64| (plus - 2.0 * at(error, 0.0) + minus) / (step * step);
                let along = second(at(error + step, 0.0), at(error - step, 0.0));
                let across = second(at(error, step), at(error, -step));
                let found = robust.curvature(error * error);
                assert!(((along + across) / 2.0 - found).abs() < 1e-4, "{robust:?} at {error}: {found}");
            }
        }
    }
}
