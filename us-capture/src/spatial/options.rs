//! What is known before a calibration.

use probepath_frames::{Image, Phantom, Pose, Probe, Span, World};

use crate::PixelSpacing;
use crate::dots::Mask;
use crate::fit::{Fit, FitOptions, Lag, PhantomPlace, Scale};
use crate::label::{Expect, LabelOptions};
use crate::shots::Shots;

/// How far the lag may still wander once it was found (s).
const LAG_WANDERS: Span = Span::from_milliseconds(120);

/// What is known before a calibration, and what is to be found.
#[derive(Clone, Debug, PartialEq)]
pub struct SpatialOptions {
    /// The part of the images that is looked at.
    pub mask: Mask,
    /// The pixels' size, about (a few percent will do); found by trying when nobody knows.
    pub spacing: Option<PixelSpacing>,
    /// What of it is to be found.
    pub scale: Scale,
    /// The time between an image's stamp and its pose.
    pub lag: Lag,
    /// Where the phantom stands; `None`: to be found from the wires alone.
    pub place: Option<PhantomPlace>,
    /// Where the image is on the probe, about: a drawing of the holder, an earlier calibration. Without it the images
    /// have to agree among themselves.
    pub nominal: Option<Pose<Probe, Image>>,
    /// How far off the wires may be from where the first guess has them, nominal or agreed on (m).
    pub nominal_off_m: f64,
    /// What is known of the side the image is seen from: all that tells a mirrored image from a right one. A nominal
    /// place says more, and is used instead.
    pub expect: Expect,
    /// How wires are given to dots.
    pub label: LabelOptions,
    /// How far a dot may be from where the fit predicts its wire (m).
    pub gate_m: f64,
}

/// How far a calibration is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doing {
    /// Looking for dots.
    Looking {
        /// Images done.
        done: usize,
        /// Of how many.
        of: usize,
    },
    /// Labels and fit, once more.
    Fitting {
        /// From one.
        round: usize,
    },
}

impl SpatialOptions {
    /// A phantom that stands about there, or anywhere; everything else to be found.
    pub fn new(place: impl Into<Option<PhantomPlace>>) -> Self {
        let (from, to) = (Span::from_milliseconds(-1000), Span::from_milliseconds(1000));
        Self {
            mask: Mask::whole(),
            spacing: None,
            scale: Scale::Estimated,
            lag: Lag::Estimated { from, to },
            place: place.into(),
            nominal: None,
            nominal_off_m: 6e-3,
            expect: Expect::Anything,
            label: LabelOptions::default(),
            gate_m: 2.5e-3,
        }
    }

    /// The same for the fit; `last` narrows the lag.
    pub(super) fn fit(
        &self,
        shots: &Shots,
        spacing: PixelSpacing,
        place: PhantomPlace,
        last: Option<&Fit>,
    ) -> FitOptions {
        let lag = match (self.lag, last) {
            _ if !shots.stamped => Lag::Known(Span::ZERO),
            (Lag::Estimated { from, to }, Some(last)) => {
                let by = |wander: i64| Span::from_nanoseconds(last.lag.nanoseconds() + wander);
                let (low, high) = (by(-LAG_WANDERS.nanoseconds()), by(LAG_WANDERS.nanoseconds()));
                Lag::Estimated { from: low.max(from), to: high.min(to) }
            }
            (lag, _) => lag,
        };
        FitOptions { scale: self.scale, lag, ..FitOptions::new(spacing, place) }
    }

    /// The lag before anything is known of it.
    pub(super) fn start_lag(&self) -> Span {
        match self.lag {
            Lag::Known(lag) => lag,
            Lag::Estimated { from, to } => Span::ZERO.max(from).min(to),
        }
    }

    pub(super) fn notes(&self, shots: &Shots) -> Vec<String> {
        let mut notes = Vec::new();
        if !shots.stamped {
            notes.push("the images have no stamps: no lag was looked for".into());
        }
        if let Some((number, reason)) = shots.lost_poses.first() {
            let count = shots.lost_poses.len();
            notes.push(format!("{count} poses were not used (the first: image {number}, {reason})"));
        }
        notes
    }
}

/// Where images are thought to be: what a fit says, or what is nominal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prediction {
    pub(super) probe_from_image: Pose<Probe, Image>,
    pub(super) world_from_phantom: Pose<World, Phantom>,
    pub(super) spacing: PixelSpacing,
    pub(super) lag: Span,
}

impl From<&Fit> for Prediction {
    fn from(fit: &Fit) -> Self {
        Self {
            probe_from_image: fit.probe_from_image,
            world_from_phantom: fit.world_from_phantom,
            spacing: fit.spacing,
            lag: fit.lag,
        }
    }
}
