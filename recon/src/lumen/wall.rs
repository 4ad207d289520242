//! How thick the wall is: what the images of a sweep say of it together.
//!
//! One image hardly tells a thick wall from a border farther in; all of them do. Each gives what its echoes say of the
//! thickness, without what was expected beforehand (the logarithm: a Gaussian of some precision), and the product of
//! those is what the next fit expects. How far apart they are, beyond what each states of itself, is what the thickness
//! changes along the vessel (the estimate of moments of DerSimonian and Laird 1986).

use nalgebra::Vector3;

use super::fit::Border;

/// How thick a wall is before any image says otherwise, as the standard deviation of its logarithm: 0.5 to 1.3 mm round
/// 0.8 mm.
const UNKNOWN: f64 = 0.5;
/// How much it changes along one vessel before images say otherwise, likewise; and as how many images that counts.
const ALONG: f64 = 0.2;
const ALONG_COUNTS: f64 = 1.0;
/// Thinner and thicker than any artery's wall (m).
const THINNEST_M: f64 = 0.15e-3;
const THICKEST_M: f64 = 4e-3;
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
    spread: Spread,
    last: Option<Vector3<f64>>,
}

/// How far apart images are that each say something of the thickness: their number (those with speckle of their own), and
/// sums of their precisions, the precisions' squares, and precision times the logarithm and its square.
#[derive(Clone, Copy, Debug, Default)]
struct Spread {
    count: f64,
    precision: f64,
    precision_squared: f64,
    sum: f64,
    squares: f64,
}

impl Spread {
    fn take(&mut self, part: f64, told: &Told) {
        let log = told.sum / told.precision;
        let thickness = log.exp();
        let says_something = told.precision * (UNKNOWN * thickness).powi(2) > 1.0;
        // Written so that NaN says nothing.
        if says_something && (THINNEST_M..THICKEST_M).contains(&thickness) {
            self.count += part;
            self.precision += part * told.precision;
            self.precision_squared += part * told.precision.powi(2);
            self.sum += part * told.sum;
            self.squares += part * told.sum * log;
        }
    }

    /// Variance of the logarithm along the vessel, of a wall that is `mean_m` thick on the whole.
    fn along(&self, mean_m: f64) -> f64 {
        let square = mean_m * mean_m;
        let free = (self.count - 1.0).max(0.0);
        let apart = square * (self.squares - self.sum * self.sum / self.precision) - free;
        let told = apart / (square * (self.precision - self.precision_squared / self.precision));
        if free > 0.0 && told.is_finite() {
            (told.max(0.0) * free + ALONG * ALONG * ALONG_COUNTS) / (free + ALONG_COUNTS)
        } else {
            ALONG * ALONG
        }
    }

    /// One over the number of images that the mean is made of, as they weigh.
    fn unequal(&self) -> f64 {
        if self.precision > 0.0 { self.precision_squared / self.precision.powi(2) } else { 1.0 }
    }
}

impl Walls {
    /// One more, of a lumen with its centre in the World (m).
    pub(crate) fn add(&mut self, border: &Border, centre: Vector3<f64>) {
        let apart = self.last.map_or(0.0, |last| (last - centre).norm());
        let part = (apart / SAME_SPECKLE_M).min(1.0);
        self.take(part, &border.told);
        self.last = Some(centre);
    }

    fn take(&mut self, part: f64, told: &Told) {
        self.told.precision += part * told.precision;
        self.told.sum += part * told.sum;
        self.spread.take(part, told);
    }

    /// What the next image may expect, when `thickness_m` was expected before all.
    pub(crate) fn prior(&self, thickness_m: f64) -> WallPrior {
        let before = (UNKNOWN * thickness_m).powi(-2);
        let precision = before + self.told.precision;
        let mean_m = ((thickness_m.ln() * before + self.told.sum) / precision).exp();
        let along = self.spread.along(mean_m);
        let shared = 1.0 / (precision * mean_m * mean_m) + along * self.spread.unequal();
        let shared_sd = shared.sqrt().min(UNKNOWN);
        // No more is known than at the beginning.
        let own_sd = along.sqrt().min((UNKNOWN.powi(2) - shared_sd.powi(2)).max(0.0).sqrt());
        WallPrior { thickness_m: mean_m, own_sd, shared_sd }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::Dice;

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
            let mut walls = Walls::default();
            walls.take(1.0, &others);
            walls.take(1.0, &odd);
            assert!((walls.prior(0.8e-3).thickness_m - 0.8e-3).abs() < 5e-6, "{own}: {walls:?}");
        }
    }

    /// Images of a vessel whose wall is 0.6 mm thick on the whole and changes by some part of it, each with an error.
    fn walls(dice: &mut Dice, count: usize, along: f64) -> Walls {
        let mut walls = Walls::default();
        for _ in 0..count {
            let (of_wall, of_image) = dice.normal_pair();
            let sd = 0.1 + 0.2 * dice.uniform();
            let precision = (0.6e-3 * sd).powi(-2);
            let log = 0.6e-3_f64.ln() + along * of_wall + sd * of_image;
            walls.take(1.0, &Told { precision, sum: precision * log });
        }
        walls
    }

    #[test]
    fn how_much_the_thickness_changes_along_a_vessel_is_read_from_the_images() {
        let mut dice = Dice(7);
        for (along, within) in [(0.0, 0.0..0.08), (0.15, 0.13..0.17), (0.3, 0.27..0.33)] {
            let (mut held, mut own) = (0, 0.0);
            for _ in 0..1000 {
                let prior = walls(&mut dice, 60, along).prior(0.8e-3);
                own += prior.own_sd / 1000.0;
                held += usize::from((prior.thickness_m / 0.6e-3).ln().abs() < 1.96 * prior.shared_sd);
            }
            assert!(within.contains(&own) && (930..=1000).contains(&held), "{along}: {own}, {held} of 1000");
        }
    }

    #[test]
    fn before_the_first_image_nothing_is_known() {
        assert!((Walls::default().prior(0.8e-3).shared_sd - UNKNOWN).abs() < 1e-12);
        assert!(Walls::default().prior(0.8e-3).own_sd.abs() < 1e-6);
        assert!((Walls::default().prior(0.8e-3).thickness_m - 0.8e-3).abs() < 1e-12);
    }
}
