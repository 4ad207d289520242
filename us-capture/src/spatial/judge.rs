//! What images say of a calibration.

use super::{Reason, Seen, sightings};
use crate::errors::{Chain, Found, Summary};
use crate::fit::{Fit, Sighting};
use crate::phantom::WirePhantom;
use crate::shots::Shots;

/// Bands of depth that errors are given in (m).
const BAND_M: f64 = 10e-3;

/// The errors of a recording's images by a calibration (FIELD.md, section 2).
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// Images in the recording.
    pub images: usize,
    /// Images whose dots were given wires.
    pub labelled: usize,
    /// Labelled images that the track, the lag counted, does not cover: they have no errors.
    pub outside: usize,
    /// Error of the Zs' middle wires.
    pub mid: Summary,
    /// Distance of every dot from its wire.
    pub line: Summary,
    /// Both by depth: where the band begins (m), middles, lines.
    pub by_depth: Vec<(f64, Summary, Summary)>,
    /// Every single error.
    pub found: Found,
    /// Why images were not labelled, by their number.
    pub refused: Vec<(u64, Reason)>,
}

impl Evaluation {
    pub(super) fn of(shots: &Shots, seen: &[Seen], phantom: &WirePhantom, fit: &Fit) -> Self {
        let sightings: Vec<Sighting> = sightings(shots, seen);
        let found = Chain::of(phantom, shots.track(), fit).judge(&sightings);
        let refused = seen.iter().filter_map(|s| s.labels.as_ref().err().map(|why| (s.number, why.clone())));
        Self {
            images: seen.len(),
            labelled: seen.iter().filter(|s| s.labels.is_ok()).count(),
            outside: found.outside,
            mid: found.mid(),
            line: found.line(),
            by_depth: found.by_depth(BAND_M).into_iter().map(|(at, f)| (at, f.mid(), f.line())).collect(),
            refused: refused.collect(),
            found,
        }
    }
}
