//! What is known before the fit, and what is to be found.

use probepath_frames::{Phantom, Pose, Span, World};

use super::{FitError, speed_of_sound_in_water, water};
use crate::PixelSpacing;

/// A lag at an end of what is allowed may come out this far beyond it (s).
const BEYOND_S: f64 = 0.05;

/// What is known, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Size of a pixel, as the machine or a configuration says it.
    pub spacing: PixelSpacing,
    /// What of it is to be found.
    pub scale: Scale,
    /// The time between an image's stamp and its pose.
    pub lag: Lag,
    /// Where the phantom stands.
    pub place: PhantomPlace,
    /// What no dot is surer than (m, standard deviation): the wires' own places, the beam's thickness.
    pub floor_m: f64,
    /// What outliers count.
    pub robust: Robust,
}

/// What of the pixel's size is to be found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Nothing: the spacing holds.
    Known,
    /// Both sides of the pixel.
    Estimated,
    /// The rows only. A scanner turns time into depth with one speed of sound (1540 m/s for most), and the phantom
    /// stands in water, so that rows are off by the ratio. Columns of a linear array are spaced by its elements, and
    /// are right in any medium.
    SpeedOfSound {
        /// Temperature of the water (Celsius).
        water_celsius: f64,
        /// How well it is known (Celsius, standard deviation): zero takes the factor as it is, infinity finds it
        /// from the dots alone.
        sd_celsius: f64,
        /// The speed the scanner assumes (m/s).
        assumed_m_s: f64,
    },
}

/// The time between an image's stamp and its pose: an image stamped t belongs to the pose at t + lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lag {
    /// It is this.
    Known(Span),
    /// It lies between these.
    Estimated {
        /// The earliest.
        from: Span,
        /// The latest.
        to: Span,
    },
}

/// Where the phantom stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PhantomPlace {
    /// Exactly there.
    Known(Pose<World, Phantom>),
    /// About there: a correction, about the middle of the wires, is found under a Gaussian prior.
    Prior {
        /// Where it is by other means (landmarks, a configuration).
        pose: Pose<World, Phantom>,
        /// How well the middle of its wires is known (m, standard deviation of each coordinate).
        sd_m: f64,
        /// How well it is turned (rad, standard deviation about each axis).
        sd_rad: f64,
    },
    /// Unknown: found from the wires alone. The probe has to turn about more than one axis.
    Free {
        /// Where to start.
        start: Pose<World, Phantom>,
    },
}

/// What outliers count. The limits are in standard deviations of a dot, which are estimated by the median.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Robust {
    /// As much as every other dot.
    None,
    /// Beyond the limit the cost grows linearly.
    Huber(f64),
    /// The cost grows logarithmically from the limit on: a wrong label has nearly no say.
    Cauchy(f64),
}

impl Lag {
    /// What is known, or none where that is possible.
    pub(super) fn start(self) -> Span {
        match self {
            Self::Known(lag) => lag,
            Self::Estimated { from, to } => Span::ZERO.clamp(from, to.max(from)),
        }
    }
}

impl Lag {
    /// A best lag beyond the ends that were allowed is not the best one.
    pub(super) fn check_found(self, lag_s: f64) -> Result<(), FitError> {
        let Self::Estimated { from, to } = self else { return Ok(()) };
        let (from_s, to_s) = (from.seconds(), to.seconds());
        if (from_s - BEYOND_S..=to_s + BEYOND_S).contains(&lag_s) {
            return Ok(());
        }
        Err(FitError::LagBeyond { lag_s, from_s, to_s })
    }
}

impl PhantomPlace {
    /// About there, to 0.5 mm and 0.5 degrees: what landmarks touched with a pointer are good for.
    pub fn prior(pose: Pose<World, Phantom>) -> Self {
        Self::Prior { pose, sd_m: 0.5e-3, sd_rad: 0.5_f64.to_radians() }
    }

    /// Where it is before the fit.
    pub const fn pose(&self) -> Pose<World, Phantom> {
        match self {
            Self::Known(pose) | Self::Prior { pose, .. } | Self::Free { start: pose } => *pose,
        }
    }
}

impl FitOptions {
    /// Both sides of the pixel and a lag between -1 and 1 s to be found; a floor of 0.3 mm; outliers by Cauchy.
    pub const fn new(spacing: PixelSpacing, place: PhantomPlace) -> Self {
        let (from, to) = (Span::from_milliseconds(-1000), Span::from_milliseconds(1000));
        Self {
            spacing,
            scale: Scale::Estimated,
            lag: Lag::Estimated { from, to },
            place,
            floor_m: 3e-4,
            robust: Robust::Cauchy(5.0),
        }
    }

    /// The factors of columns and rows to start from.
    pub(super) fn start_scale(&self) -> (f64, f64) {
        match self.scale {
            Scale::Known | Scale::Estimated => (1.0, 1.0),
            Scale::SpeedOfSound { water_celsius, assumed_m_s, .. } => {
                (1.0, speed_of_sound_in_water(water_celsius) / assumed_m_s)
            }
        }
    }

    /// The size of a pixel to start from.
    pub(super) fn start_spacing(&self) -> PixelSpacing {
        let (columns, rows) = self.start_scale();
        PixelSpacing { x_m: self.spacing.x_m * columns, y_m: self.spacing.y_m * rows }
    }

    /// How well the factor of the rows is known; infinite for not at all.
    pub(super) fn row_scale_sd(&self) -> f64 {
        match self.scale {
            Scale::Known => 0.0,
            Scale::Estimated => f64::INFINITY,
            Scale::SpeedOfSound { water_celsius, sd_celsius, assumed_m_s } => {
                water::speed_slope(water_celsius) * sd_celsius / assumed_m_s
            }
        }
    }

    pub(super) fn check(&self) -> Result<(), FitError> {
        check("spacing.x_m", self.spacing.x_m, 1e-7..=1e-2, "between 0.1 micrometres and 1 cm")?;
        check("spacing.y_m", self.spacing.y_m, 1e-7..=1e-2, "between 0.1 micrometres and 1 cm")?;
        check("floor_m", self.floor_m, 1e-9..=1e-2, "above zero and up to 1 cm")?;
        self.check_scale()?;
        self.check_lag()?;
        self.check_place()?;
        match self.robust {
            Robust::None => Ok(()),
            Robust::Huber(limit) | Robust::Cauchy(limit) => {
                check("robust limit", limit, 0.5..=1e3, "between 0.5 and 1000 standard deviations")
            }
        }
    }

    fn check_scale(&self) -> Result<(), FitError> {
        let Scale::SpeedOfSound { water_celsius, sd_celsius, assumed_m_s } = self.scale else {
            return Ok(());
        };
        check("water_celsius", water_celsius, 0.0..=95.0, "between 0 and 95 degrees Celsius")?;
        check("sd_celsius", sd_celsius, 0.0..=f64::INFINITY, "zero or more")?;
        check("assumed_m_s", assumed_m_s, 1000.0..=2000.0, "between 1000 and 2000 m/s")
    }

    fn check_lag(&self) -> Result<(), FitError> {
        const WITHIN: std::ops::RangeInclusive<f64> = -10.0..=10.0;
        let wanted = "between -10 and 10 s";
        match self.lag {
            Lag::Known(lag) => check("lag_s", lag.seconds(), WITHIN, wanted),
            Lag::Estimated { from, to } => {
                check("lag.from_s", from.seconds(), WITHIN, wanted)?;
                check("lag.to_s", to.seconds(), from.seconds()..=10.0, "after lag.from_s, and at most 10 s")
            }
        }
    }

    fn check_place(&self) -> Result<(), FitError> {
        if !self.place.pose().is_finite() {
            return Err(FitError::Option { field: "place", found: f64::NAN, wanted: "finite numbers" });
        }
        let PhantomPlace::Prior { sd_m, sd_rad, .. } = self.place else { return Ok(()) };
        check("place.sd_m", sd_m, 1e-9..=10.0, "above zero and up to 10 m")?;
        check("place.sd_rad", sd_rad, 1e-9..=4.0, "above zero and up to 4 rad")
    }
}

fn check(
    field: &'static str,
    found: f64,
    within: std::ops::RangeInclusive<f64>,
    wanted: &'static str,
) -> Result<(), FitError> {
    if within.contains(&found) { Ok(()) } else { Err(FitError::Option { field, found, wanted }) }
}
