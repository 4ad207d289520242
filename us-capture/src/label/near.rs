//! With a prediction: what tracking, and every pass after the first, uses.

use probepath_frames::{Image, Phantom, Pose};

use super::assign::{Window, one_to_one};
use super::plane::{Match, Plane};
use super::seen::Seen;
use super::{Choice, Labeller, Labels, Refusal};
use crate::PixelSpacing;
use crate::dots::Dot;

/// Places along the phantom that are tried are this far apart (m).
const STEP_M: f64 = 1.5e-3;

impl Labeller {
    /// The wires that made the dots of an image whose plane is about where it is predicted. A dot may be `gate_m`
    /// from where its wire is predicted, and the plane as far from it along the phantom.
    ///
    /// # Errors
    /// When there are too few dots, or too few of them lie where wires are predicted.
    pub fn near(
        &self,
        dots: &[Dot],
        predicted: &Pose<Phantom, Image>,
        spacing: PixelSpacing,
        gate_m: f64,
    ) -> Result<Labels, Refusal> {
        if !predicted.is_finite() || !gate_m.is_finite() || gate_m <= 0.0 {
            return Err(Refusal::NotANumber { what: "the predicted pose, or how far off it may be," });
        }
        let seen = self.enough(dots, spacing)?;
        let window = self.window(&seen, spacing);
        let choice = self.nearest(self.plane(predicted), &seen, &window, gate_m);
        let explained = choice.matches.len();
        // The prediction says half of what dots alone would have to.
        if !self.is_enough(&choice) || choice.worth.score < 0.5 * self.needed(&window) {
            let (needed, gate_mm) = (self.least(), gate_m * 1e3);
            return Err(Refusal::NotNear { dots: dots.len(), explained, needed, gate_mm });
        }
        Ok(self.labels(&choice, dots, &seen))
    }

    /// The best of the planes shifted along the phantom within the gate, settled.
    fn nearest(&self, plane: Plane, seen: &[Seen], window: &Window, gate: f64) -> Choice {
        let steps = ((gate / STEP_M).ceil() as i32).min(20);
        let step = gate / f64::from(steps.max(1));
        let mut best: (f64, Plane, Vec<Match>) = (f64::NEG_INFINITY, plane, Vec::new());
        for k in -steps..=steps {
            let mut shifted = plane;
            shifted.origin.z += f64::from(k) * step;
            let (worth, matches) = self.overlap(&shifted, seen, gate.min(4.0 * self.options.gate_m));
            let worth = worth - 0.05 * f64::from(k.abs()) / f64::from(steps.max(1));
            if worth > best.0 {
                best = (worth, shifted, matches);
            }
        }
        self.settle(best.1, best.2, seen, window)
    }

    /// How many wires have a dot where they are predicted, nearer ones counting more, and which.
    fn overlap(&self, plane: &Plane, seen: &[Seen], gate: f64) -> (f64, Vec<Match>) {
        let mut pairs = Vec::with_capacity(32);
        for (wire, strand) in self.section.strands.iter().enumerate() {
            let Some(crossing) = plane.crossing(strand).filter(|c| c.inside > -2e-3) else { continue };
            for (dot, s) in seen.iter().enumerate() {
                let off = (s.at - crossing.at).norm();
                if off < gate {
                    pairs.push((off, dot, wire));
                }
            }
        }
        let matches = one_to_one(pairs);
        let worth = matches
            .iter()
            .map(|&(dot, wire)| 1.0 - plane.distance(&seen[dot], &self.section.strands[wire]) / gate);
        (worth.sum(), matches)
    }
}
