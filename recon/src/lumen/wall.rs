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

/// What an image's echoes say of the thickness, for themselves. Not of its logarithm: how well that is known grows with
/// the thickness, and the mean over many images would lean to those that take it for thicker than it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Told {
    /// One over the variance (1/m2).
    pub(crate) precision: f64,
    /// The thickness, times that (1/m).
    pub(crate) sum: f64,
}

impl Told {
    /// From what was expected and what came of it together with the image: logarithm and its variance.
    pub(crate) fn apart_from(prior: &WallPrior, log: f64, variance: f64) -> Self {
        let before = prior.sd().powi(-2);
        let own = 1.0 / variance - before;
        let thickness = ((log / variance - prior.thickness_m.ln() * before) / own).exp();
        let precision = own / (thickness * thickness);
        let sum = precision * thickness;
        if own > 0.0 && sum.is_finite() { Self { precision, sum } } else { Self::default() }
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
        let mean_m = (thickness_m * before + self.told.sum) / precision;
        let shared_sd = (precision.sqrt() * mean_m).recip().min(UNKNOWN);
        // No more is known than at the beginning.
        let own_sd = ALONG.min((UNKNOWN.powi(2) - shared_sd.powi(2)).max(0.0).sqrt());
        WallPrior { thickness_m: mean_m, own_sd, shared_sd }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_image_says_comes_apart_from_what_was_expected() {
        let prior = WallPrior { thickness_m: 0.8e-3, own_sd: 0.2, shared_sd: 0.3 };
        let (before, own) = (prior.sd().powi(-2), 25.0);
        let truth = 0.5e-3_f64.ln();
        let log = (prior.thickness_m.ln() * before + truth * own) / (before + own);
        let told = Told::apart_from(&prior, log, 1.0 / (before + own));
        let thickness = told.sum / told.precision;
        assert!((thickness - 0.5e-3).abs() < 1e-12, "{thickness}");
        assert!((told.precision * thickness * thickness - own).abs() < 1e-9);
        assert_eq!(Told::apart_from(&prior, log, 1.0), Told::default());
    }

    #[test]
    fn before_the_first_image_nothing_is_known() {
        assert_eq!(Walls::default().prior(0.8e-3).shared_sd, UNKNOWN);
        assert_eq!(Walls::default().prior(0.8e-3).own_sd, 0.0);
        assert!((Walls::default().prior(0.8e-3).thickness_m - 0.8e-3).abs() < 1e-12);
    }
}
