//! The dots, wires and poses of a fit, checked and laid out for the solver.

use nalgebra::{Matrix2, SMatrix, Vector2, Vector3};
use probepath_frames::{Probe, Stamp, Track, World};

use super::model::{Chain, Stand, WireLine};
use super::motion::Moment;
use super::parameters::{COLUMN_SCALE, COUNT, LAG, PLACE_SHIFT, PLACE_TURN, ROW_SCALE, SHEAR, Step, Values};
use super::{FitError, FitOptions, Lag, PhantomPlace, Robust, Scale, Sighting, robust};
use crate::PixelSpacing;
use crate::phantom::WirePhantom;

/// Second derivatives of the cost.
pub(super) type Square = SMatrix<f64, COUNT, COUNT>;

/// Errors are never taken for smaller than this part of what is said of them: exact data has no scale.
const LEAST_SIGMA: f64 = 1e-4;

/// A fit before it is solved.
#[derive(Clone)]
pub(super) struct Problem<'a> {
    pub(super) images: Vec<ImageDots>,
    pub(super) wires: Vec<WireLine>,
    pub(super) track: &'a Track<World, Probe>,
    pub(super) nominal: PixelSpacing,
    pub(super) stand: Stand,
    pub(super) active: [bool; COUNT],
    /// One over the variance of each parameter's prior; zero for none.
    pub(super) prior: Step,
    pub(super) prior_scales: (f64, f64),
    floor_m: f64,
    pub(super) robust: Robust,
    /// How many times larger errors are than the covariances say.
    pub(super) sigma: f64,
    /// The lag at which dots were weighed. Near it the probe goes on as it moves there: a descent along the track
    /// itself would stop in every dent that a tracker's trembling makes.
    lag_s: f64,
}

/// One image's dots.
#[derive(Clone)]
pub(super) struct ImageDots {
    pub(super) stamp: Stamp,
    pub(super) dots: Vec<WeighedDot>,
    /// The track covers it.
    pub(super) inside: bool,
    /// Where the probe was at the lag at which dots were weighed, and how it moved.
    pub(super) moment: Moment,
}

/// A dot, with what turns its error into standard deviations.
#[derive(Clone)]
pub(super) struct WeighedDot {
    pub(super) wire: usize,
    pub(super) at_px: [f64; 2],
    pub(super) covariance_px2: Matrix2<f64>,
    pub(super) whiten: Matrix2<f64>,
}

/// What one or more images say: cost, its slope, its second derivatives (those that are sure to be positive).
#[derive(Clone, Copy)]
pub(super) struct Normal {
    pub(super) cost: f64,
    pub(super) slope: Step,
    pub(super) square: Square,
}

impl Normal {
    pub(super) fn zero() -> Self {
        Self { cost: 0.0, slope: Step::zeros(), square: Square::zeros() }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.cost += other.cost;
        self.slope += other.slope;
        self.square += other.square;
    }
}

impl<'a> Problem<'a> {
    pub(super) fn new(
        phantom: &WirePhantom,
        sightings: &[Sighting],
        track: &'a Track<World, Probe>,
        options: &FitOptions,
    ) -> Result<Self, FitError> {
        let problem = Self {
            images: sightings.iter().map(|s| image(s, phantom)).collect::<Result<_, _>>()?,
            wires: lines(phantom)?,
            track,
            nominal: options.spacing,
            stand: stand(phantom, options),
            active: active(options),
            prior: prior(options),
            prior_scales: options.start_scale(),
            floor_m: options.floor_m,
            robust: options.robust,
            sigma: 1.0,
            lag_s: 0.0,
        };
        problem.check_enough(problem.images.iter().filter(|i| !i.dots.is_empty()))?;
        Ok(problem)
    }

    /// How many parameters are to be found.
    pub(super) fn parameters(&self) -> usize {
        self.active.iter().filter(|a| **a).count()
    }

    pub(super) fn check_enough<'b>(
        &self,
        images: impl Iterator<Item = &'b ImageDots>,
    ) -> Result<(), FitError> {
        let (mut count, mut dots) = (0, 0);
        for image in images {
            count += 1;
            dots += image.dots.len();
        }
        let parameters = self.parameters();
        let needed = parameters.div_ceil(2) + 3;
        if count < 3 || dots < needed {
            return Err(FitError::TooFew { dots, images: count, parameters, needed });
        }
        Ok(())
    }

    /// Decides which images take part at this lag, and weighs every dot as it lies now.
    pub(super) fn weigh(&mut self, values: &Values) -> Result<(), FitError> {
        self.choose_images(values.lag_s)?;
        let (nominal, floor) = (self.nominal, Matrix2::identity() * self.floor_m * self.floor_m);
        let mut squared = Vec::new();
        for image in self.images.iter_mut().filter(|i| i.inside) {
            let chain = Chain::new(values, nominal, &self.stand, &image.moment.after(0.0));
            for dot in &mut image.dots {
                let wire = &self.wires[dot.wire];
                let covariance = chain.covariance(&dot.covariance_px2, wire) + floor;
                dot.whiten = whitening(&covariance).ok_or(FitError::Diverged)?;
                squared.push((dot.whiten * chain.off(dot.at_px, wire)).norm_squared());
            }
        }
        let scale = robust::scale(&mut squared, self.parameters()).filter(|s| s.is_finite());
        self.sigma = scale.ok_or(FitError::Diverged)?.max(LEAST_SIGMA);
        Ok(())
    }

    /// Weighs every dot by what is said of it; all images have to be inside.
    pub(super) fn weigh_as_said(&mut self, values: &Values) -> Result<(), FitError> {
        self.weigh(values)?;
        self.sigma = 1.0;
        self.robust = Robust::None;
        let (inside, images) = (self.images.iter().filter(|i| i.inside).count(), self.images.len());
        if inside < images {
            return Err(FitError::OutsideTrack { inside, images, lag_s: values.lag_s });
        }
        Ok(())
    }

    fn choose_images(&mut self, lag_s: f64) -> Result<(), FitError> {
        self.lag_s = lag_s;
        for image in &mut self.images {
            let moment = Moment::at(self.track, image.stamp, lag_s);
            image.inside = !image.dots.is_empty() && moment.is_some();
            image.moment = moment.unwrap_or_else(Moment::rest);
        }
        let inside = self.images.iter().filter(|i| i.inside).count();
        if inside == 0 {
            return Err(FitError::OutsideTrack { inside, images: self.images.len(), lag_s });
        }
        self.check_enough(self.images.iter().filter(|i| i.inside))
    }

    fn chain<'b>(&self, image: &ImageDots, values: &'b Values) -> Chain<'b> {
        Chain::new(values, self.nominal, &self.stand, &image.moment.after(values.lag_s - self.lag_s))
    }

    /// The cost alone; `None` when it is no number.
    pub(super) fn cost(&self, values: &Values) -> Option<f64> {
        let mut cost = self.prior_cost(values);
        for image in self.images.iter().filter(|i| i.inside) {
            let chain = self.chain(image, values);
            for dot in &image.dots {
                let error = dot.whiten * chain.off(dot.at_px, &self.wires[dot.wire]);
                cost += self.robust.cost(error.norm_squared() / (self.sigma * self.sigma)).0;
            }
        }
        cost.is_finite().then_some(cost)
    }

    fn prior_cost(&self, values: &Values) -> f64 {
        let off = values.off_prior(self.prior_scales);
        self.prior.component_mul(&off).dot(&off) / 2.0
    }

    /// What the prior says.
    pub(super) fn prior_normal(&self, values: &Values) -> Normal {
        let off = values.off_prior(self.prior_scales);
        let slope = self.prior.component_mul(&off);
        Normal { cost: slope.dot(&off) / 2.0, slope, square: Square::from_diagonal(&self.prior) }
    }

    /// What one image says.
    pub(super) fn image_normal(&self, image: &ImageDots, values: &Values) -> Normal {
        let chain = self.chain(image, values);
        let mut normal = Normal::zero();
        for dot in &image.dots {
            let row = chain.row(dot.at_px, &self.wires[dot.wire], &image.moment.twist);
            let white = dot.whiten / self.sigma;
            let error = white * row.off;
            let (cost, weight) = self.robust.cost(error.norm_squared());
            normal.cost += cost;
            for k in 0..2 {
                let by = row.by[0] * white[(k, 0)] + row.by[1] * white[(k, 1)];
                normal.slope.axpy(weight * error[k], &by, 1.0);
                normal.square.ger(weight, &by, &by, 1.0);
            }
        }
        normal
    }

    /// Every dot of the images that take part: how far it is from its wire (m), and that in standard deviations
    /// squared.
    pub(super) fn errors(&self, values: &Values) -> Vec<(Vector2<f64>, f64)> {
        let mut errors = Vec::new();
        for image in self.images.iter().filter(|i| i.inside) {
            let chain = self.chain(image, values);
            errors.extend(image.dots.iter().map(|dot| {
                let off = chain.off(dot.at_px, &self.wires[dot.wire]);
                (off, (dot.whiten * off).norm_squared() / (self.sigma * self.sigma))
            }));
        }
        errors
    }
}

/// The matrix that turns an error of this covariance into one of the identity.
fn whitening(covariance: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let root = covariance.try_inverse()?.cholesky()?;
    Some(root.l().transpose())
}

fn image(sighting: &Sighting, phantom: &WirePhantom) -> Result<ImageDots, FitError> {
    let image = sighting.image;
    let weighed = |seen: &super::SeenWire| {
        let wire = seen.wire;
        if wire >= phantom.wires.len() {
            return Err(FitError::NoSuchWire { image, wire, wires: phantom.wires.len() });
        }
        if !seen.at_px.iter().all(|x| x.is_finite() && x.abs() < 1e6) {
            return Err(FitError::Dot { image, wire, what: "a place that is no pixel" });
        }
        let c = &seen.covariance_px2;
        let good =
            c.iter().all(|x| x.is_finite()) && c[(0, 0)] >= 0.0 && c.determinant() >= 0.0 && c[(1, 1)] >= 0.0;
        if !good {
            return Err(FitError::Dot { image, wire, what: "a covariance that is none" });
        }
        let covariance_px2 = (c + c.transpose()) / 2.0;
        Ok(WeighedDot { wire, at_px: seen.at_px, covariance_px2, whiten: Matrix2::identity() })
    };
    let dots = sighting.dots.iter().map(weighed).collect::<Result<_, _>>()?;
    Ok(ImageDots { stamp: sighting.stamp, dots, inside: true, moment: Moment::rest() })
}

fn lines(phantom: &WirePhantom) -> Result<Vec<WireLine>, FitError> {
    let line = |wire| {
        WireLine::of(wire).ok_or(FitError::Option {
            field: "length of a wire of the phantom",
            found: wire.length_m(),
            wanted: "above zero",
        })
    };
    phantom.wires.iter().map(line).collect()
}

fn stand(phantom: &WirePhantom, options: &FitOptions) -> Stand {
    let middles = phantom.wires.iter().map(|w| (w.front.vector() + w.back.vector()) / 2.0);
    let middle = middles.sum::<Vector3<f64>>() / phantom.wires.len().max(1) as f64;
    Stand { phantom_from_world: options.place.pose().isometry().inverse(), middle }
}

fn active(options: &FitOptions) -> [bool; COUNT] {
    let row_scale = options.row_scale_sd() > 0.0;
    std::array::from_fn(|index| match index {
        COLUMN_SCALE => options.scale == Scale::Estimated,
        ROW_SCALE => row_scale,
        SHEAR => false,
        LAG => matches!(options.lag, Lag::Estimated { .. }),
        PLACE_TURN.. => !matches!(options.place, PhantomPlace::Known(_)),
        _ => true,
    })
}

fn prior(options: &FitOptions) -> Step {
    let mut prior = Step::zeros();
    let information = |sd: f64| if sd > 0.0 { 1.0 / (sd * sd) } else { 0.0 };
    prior[ROW_SCALE] = information(options.row_scale_sd());
    if let PhantomPlace::Prior { sd_m, sd_rad, .. } = options.place {
        prior.fixed_rows_mut::<3>(PLACE_TURN).fill(information(sd_rad));
        prior.fixed_rows_mut::<3>(PLACE_SHIFT).fill(information(sd_m));
    }
    prior
}
