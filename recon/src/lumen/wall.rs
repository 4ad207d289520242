//! How thick the wall is: what the images of a sweep say of it together.
//!
//! One image hardly tells a thick wall from a border farther in; all of them do. Each gives what its echoes say of the
//! thickness, without what was expected beforehand (the logarithm: a Gaussian of some precision), and the product of
//! those is what the next fit expects.

use nalgebra::Vector3;

use super::fit::Border;

/// How thick a wall is before any image says otherwise, as the standard deviation of its logarithm: 0.5 to 1.3 mm round
/// 0.8 mm.
const UNKNOWN: f64 = 0.5;
/// How thick it is here and there along one vessel, likewise.
const ALONG: f64 = 0.2;
/// Images nearer to each other than this see the same speckle (m): the beam's thickness.
const SAME_SPECKLE_M: f64 = 2.5e-3;

/// What a wall's thickness is likely to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WallPrior {
    /// The thickness (m).
    pub(crate) thickness_m: f64,
    /// Standard deviation of an image's own about it, of the logarithm.
    pub(crate) own_sd: f64,
    /// Standard deviation of it, shared by all images, of the logarithm.
    pub(crate) shared_sd: f64,
}

impl WallPrior {
    /// Before any image.
    pub(crate) const fn unknown(thickness_m: f64) -> Self {
        Self { thickness_m, own_sd: 0.0, shared_sd: UNKNOWN }
    }

    /// Standard deviation of the logarithm in one image, from both.
    pub(crate) fn sd(&self) -> f64 {
        self.own_sd.hypot(self.shared_sd)
    }
}

/// What an image's echoes say of the thickness, for themselves: of its logarithm, but weighed by how well the thickness
/// is known. How well the logarithm is known grows with the thickness, and the mean over many images would lean to those
/// that take it for thicker than it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Told {
    /// One over the variance (1/m2).
    pub(crate) precision: f64,
    /// The thickness's logarithm, times that (1/m2).
    pub(crate) sum: f64,
}

impl Told {
    /// From what was expected and what came of it together with the image: logarithm and its variance. An image that
    /// says next to nothing of the thickness counts for next to nothing, wherever alone it would go.
    pub(crate) fn apart_from(prior: &WallPrior, log: f64, variance: f64) -> Self {
        let (before, square) = (prior.sd().powi(-2), (2.0 * log).exp());
        let precision = (1.0 / variance - before) / square;
        let sum = (log / variance - prior.thickness_m.ln() * before) / square;
        if precision > 0.0 && sum.is_finite() { Self { precision, sum } } else { Self::default() }
    }
}

/// What the images so far say together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Walls {
    told: Told,
    last: Option<Vector3<f64>>,
}

impl Walls {
    /// One more, of a lumen with its centre in the World (m).
    pub(crate) fn add(&mut self, border: &Border, centre: Vector3<f64>) {
        let apart = self.last.map_or(0.0, |last| (last - centre).norm());
        let part = (apart / SAME_SPECKLE_M).min(1.0);
        self.told.precision += part * border.told.precision;
        self.told.sum += part * border.told.sum;
        self.last = Some(centre);
    }

    /// What the next image may expect, when `thickness_m` was expected before all.
    pub(crate) fn prior(&self, thickness_m: f64) -> WallPrior {
        let before = (UNKNOWN * thickness_m).powi(-2);
        let precision = before + self.told.precision;
        let mean_m = ((thickness_m.ln() * before + self.told.sum) / precision).exp();
        let shared_sd = (precision.sqrt() * mean_m).recip().min(UNKNOWN);
        // No more is known than at the beginning.
        let own_sd = ALONG.min((UNKNOWN.powi(2) - shared_sd.powi(2)).max(0.0).sqrt());
        WallPrior { thickness_m: mean_m, own_sd, shared_sd }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes of an expectation and an image that says `thickness_m`, as surely as the logarithm's information `own`.
    fn told(prior: &WallPrior, thickness_m: f64, own: f64) -> Told {
        let before = prior.sd().powi(-2);
        let log = (prior.thickness_m.ln() * before + thickness_m.ln() * own) / (before + own);
        Told::apart_from(prior, log, 1.0 / (before + own))
    }

    #[test]
    fn what_an_image_says_comes_apart_from_what_was_expected() {
        let prior = WallPrior { thickness_m: 0.8e-3, own_sd: 0.2, shared_sd: 0.3 };
        for truth in [0.75e-3, 0.8e-3, 0.85e-3] {
            let told = told(&prior, truth, 25.0);
            let thickness = (told.sum / told.precision).exp();
            assert!((thickness - truth).abs() < 1e-12, "{thickness} {truth}");
            assert!((told.precision * truth * truth / 25.0 - 1.0).abs() < 0.05);
        }
        assert_eq!(Told::apart_from(&prior, prior.thickness_m.ln(), 1.0), Told::default());
    }

    #[test]
    fn an_image_that_says_next_to_nothing_moves_the_others_hardly() {
        let prior = WallPrior::unknown(0.8e-3);
        let others = told(&prior, 0.8e-3, 400.0);
        for own in [1e-9, 1e-6, 1e-3, 0.03, 0.3] {
            // A wall fitted at 0.6 mm although next to nothing speaks for it: alone it would be of no thickness at all.
            let odd = Told::apart_from(&prior, 0.6e-3_f64.ln(), 1.0 / (4.0 + own));
            assert!(odd.precision < 4e-3 * others.precision, "{own}: {odd:?}");
            let walls = Walls {
                told: Told { precision: others.precision + odd.precision, sum: others.sum + odd.sum },
                last: None,
            };
            assert!((walls.prior(0.8e-3).thickness_m - 0.8e-3).abs() < 5e-6, "{own}: {walls:?}");
        }
    }

    #[test]
    fn before_the_first_image_nothing_is_known() {
        assert!((Walls::default().prior(0.8e-3).shared_sd - UNKNOWN).abs() < 1e-12);
        assert!(Walls::default().prior(0.8e-3).own_sd.abs() < 1e-6);
        assert!((Walls::default().prior(0.8e-3).thickness_m - 0.8e-3).abs() < 1e-12);
    }
}
