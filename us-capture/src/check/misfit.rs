//! Whether the stored calibration explains the scan's dots, whatever the scan's own fit makes of them.
//!
//! Errors that a whole recording shares (a bent wire, a tracker's field, a phantom that is not as its file says) are in
//! no covariance: two recordings may differ by more than their errors allow, where hardly a dot tells them apart.

use nalgebra::{Translation3, Vector3};
use probepath_frames::{Phantom, Pose, Span, World};

use super::change::deeper;
use super::{CheckOptions, Scan};
use crate::errors::{Chain, Found, Summary};
use crate::fit::{Fit, Lag, PhantomPlace};
use crate::{PixelMap, PixelSpacing};

/// Fewer middle wires than this do not show that a calibration holds along the wires.
const ENOUGH_MIDS: usize = 10;

/// A probe that turned by this (rad) about two axes tells where its image is, also where no wire was seen.
const TILTED_RAD: f64 = 15.0 * std::f64::consts::PI / 180.0;

/// The errors of the scan's dots by the stored calibration, and by the scan's own fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Middle wires, by the stored calibration.
    pub mid: Summary,
    /// The same by the scan's own fit.
    pub own_mid: Summary,
    /// Distances from the wires, by the stored calibration.
    pub line: Summary,
    /// The same by the scan's own fit.
    pub own_line: Summary,
    /// From the least to the greatest angle of the probe about its axes, the second largest of the three (rad).
    pub turned_rad: f64,
}

impl Misfit {
    /// Rows are as high as stored or as the scan has them in its medium, whichever explains the dots better: rows that
    /// nothing explains are refused before.
    pub(super) fn of(scan: &Scan<'_>, fit: &Fit) -> Self {
        let own = Chain::of(scan.phantom, scan.track, fit).judge(scan.sightings);
        let stored = scan.calibration.setting.spacing;
        let shown = PixelSpacing { x_m: stored.x_m, y_m: fit.spacing.y_m };
        let [same, medium] = [stored, shown].map(|spacing| judged(scan, fit, spacing));
        let better = if square(&medium) < square(&same) { medium } else { same };
        Self {
            mid: better.mid(),
            own_mid: own.mid(),
            line: better.line(),
            own_line: own.line(),
            turned_rad: turned(scan, fit.lag),
        }
    }

    /// How far the stored calibration is off where the phantom was seen: what its errors have beyond those of the
    /// scan's own fit (m), of middle wires or of all, whichever is more.
    pub fn excess_m(&self) -> f64 {
        let beyond =
            |stored: &Summary, own: &Summary| (stored.rms_m.powi(2) - own.rms_m.powi(2)).max(0.0).sqrt();
        beyond(&self.mid, &self.own_mid).max(beyond(&self.line, &self.own_line))
    }

    /// Whether the dots show that the stored calibration is within the tolerance where they are, in a scan that hardly
    /// turned. One that did is believed: the dots' mean hides turns (of 100 turns of 1 degree, 6 were held to be none).
    pub(super) fn is_explained(&self, options: &CheckOptions) -> bool {
        // The two lags may each take a few images out of the track; more than that were not judged.
        let judged = 10 * self.line.count >= 9 * self.own_line.count;
        let flat = self.turned_rad < TILTED_RAD;
        flat && judged && self.mid.count >= ENOUGH_MIDS && self.excess_m() <= options.tolerance_m
    }
}

fn square(found: &Found) -> f64 {
    found.mid().rms_m.powi(2) + found.line().rms_m.powi(2)
}

/// The errors by the stored pose, lag and place, with these pixels.
fn judged(scan: &Scan<'_>, fit: &Fit, spacing: PixelSpacing) -> Found {
    let stored = scan.calibration;
    let up = Translation3::from(-deeper(&stored.setting, spacing));
    // FRAMES: the stored image, its first row as deep as it was in the scan's medium.
    let probe_from_image = Pose::assume(stored.probe_from_image.isometry() * up);
    let lag = match scan.lag {
        Lag::Known(lag) => lag,
        _ => stored.image_lag,
    };
    let pixels = PixelMap::of(&probe_from_image, spacing);
    let world_from_phantom = place(scan.place, fit);
    Chain { phantom: scan.phantom, track: scan.track, world_from_phantom, lag, pixels }.judge(scan.sightings)
}

/// Where the phantom is said to stand; where nobody says, as the scan found it.
const fn place(place: PhantomPlace, fit: &Fit) -> Pose<World, Phantom> {
    match place {
        PhantomPlace::Known(pose) | PhantomPlace::Prior { pose, .. } => pose,
        PhantomPlace::Free { .. } => fit.world_from_phantom,
    }
}

/// The second largest of the angles that the probe turned about its own three axes.
fn turned(scan: &Scan<'_>, lag: Span) -> f64 {
    let at = |stamp| Some(scan.track.at(stamp + lag).ok()?.isometry().rotation);
    let poses: Vec<_> = scan.sightings.iter().filter_map(|s| at(s.stamp)).collect();
    let Some(home) = poses.get(poses.len() / 2) else { return 0.0 };
    let turns = poses.iter().map(|pose| (home.inverse() * pose).scaled_axis());
    let (least, most) = turns.fold((Vector3::zeros(), Vector3::zeros()), |(least, most), turn| {
        (turn.inf(&least), turn.sup(&most))
    });
    let mut ranges: [f64; 3] = (most - least).into();
    ranges.sort_unstable_by(f64::total_cmp);
    let [_, second, _] = ranges;
    second
}
