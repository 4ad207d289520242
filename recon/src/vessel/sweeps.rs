//! Whether several sweeps over the same stretch agree.
//!
//! A sweep is a run of images in one direction. Where two run over the same stretch, each one's contours are moved as
//! a whole until they lie best on the surface of all; the difference of these movements is what the poses disagree by.

use nalgebra::{Matrix3, Vector3};

use crate::ReconWarning;
use crate::centreline::Centreline;
use crate::surface::{Samples, Tube};

/// A sweep has turned when it is this far back from where it came to (m).
const BACK_M: f64 = 3e-3;
/// What is shorter, or has fewer contours, is no sweep (m).
const LEAST_M: f64 = 4e-3;
const LEAST: usize = 8;
/// Sweeps that are farther apart than this do not agree (m).
const AGREE_M: f64 = 0.5e-3;
/// Movements along the vessel are hardly seen: nothing but a lot of images may say so (m).
const UNSEEN_M: f64 = 1e-3;

/// The sweeps that disagree most, when any do by more than half a millimetre.
pub(super) fn disagreement(line: &Centreline, tube: &Tube, samples: &[Samples]) -> Option<ReconWarning> {
    let sweeps = sweeps(samples);
    let mut worst: Option<(f64, (f64, f64))> = None;
    for (i, first) in sweeps.iter().enumerate() {
        for second in &sweeps[i + 1..] {
            let (from, to) = (first.from.max(second.from), first.to.min(second.to));
            if to - from < LEAST_M {
                continue;
            }
            let moved = |sweep: &Sweep<'_>| moved(line, tube, sweep, (from, to));
            let Some(by) = moved(first).zip(moved(second)).map(|(a, b)| (a - b).norm()) else { continue };
            if by > AGREE_M && worst.is_none_or(|(most, _)| by > most) {
                worst = Some((by, (from, to)));
            }
        }
    }
    worst.map(|(by, (from, to))| ReconWarning::SweepsDisagree {
        by_mm: by * 1e3,
        from_mm: from.max(0.0) * 1e3,
        to_mm: to * 1e3,
    })
}

/// A run of contours in one direction.
struct Sweep<'a> {
    from: f64,
    to: f64,
    contours: Vec<&'a Samples>,
}

/// The sweeps, in the order of their images.
fn sweeps(samples: &[Samples]) -> Vec<Sweep<'_>> {
    let mut ordered: Vec<&Samples> = samples.iter().collect();
    ordered.sort_by_key(|contour| contour.turn);
    let (mut sweeps, mut run) = (Vec::new(), Run::default());
    for contour in ordered {
        if let Some(turned) = run.turned(contour.at) {
            let rest = run.contours.split_off(turned);
            sweeps.push(std::mem::take(&mut run).contours);
            rest.into_iter().for_each(|contour| run.push(contour));
        }
        run.push(contour);
    }
    sweeps.push(run.contours);
    sweeps.into_iter().filter_map(Sweep::of).collect()
}

/// Contours in the order of their images, and which of them lie farthest along either way.
#[derive(Default)]
struct Run<'a> {
    contours: Vec<&'a Samples>,
    low: Option<(usize, f64)>,
    high: Option<(usize, f64)>,
}

impl<'a> Run<'a> {
    fn push(&mut self, contour: &'a Samples) {
        let here = (self.contours.len(), contour.at);
        if self.low.is_none_or(|low| contour.at <= low.1) {
            self.low = Some(here);
        }
        if self.high.is_none_or(|high| contour.at >= high.1) {
            self.high = Some(here);
        }
        self.contours.push(contour);
    }

    /// Where the sweep turned, when a further contour at `at` shows that it did.
    fn turned(&self, at: f64) -> Option<usize> {
        let (low, high) = (self.low?, self.high?);
        // The later extreme is where it came to.
        let (end, back) = if high.0 > low.0 { (high.0, high.1 - at) } else { (low.0, at - low.1) };
        (high.1 - low.1 >= BACK_M && back > BACK_M).then_some(end + 1)
    }
}

impl<'a> Sweep<'a> {
    /// When they are enough, over a length.
    fn of(contours: Vec<&'a Samples>) -> Option<Self> {
        let from = contours.iter().map(|contour| contour.at).fold(f64::INFINITY, f64::min);
        let to = contours.iter().map(|contour| contour.at).fold(f64::NEG_INFINITY, f64::max);
        (contours.len() >= LEAST && to - from >= LEAST_M).then_some(Self { from, to, contours })
    }
}

/// By how much a sweep lies off the surface of all, over a stretch.
fn moved(line: &Centreline, tube: &Tube, sweep: &Sweep<'_>, (from, to): (f64, f64)) -> Option<Vector3<f64>> {
    let (mut matrix, mut right, mut weights) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for contour in sweep.contours.iter().filter(|contour| (from..=to).contains(&contour.at)) {
        let axes = line.at(contour.at)?;
        for point in &contour.points {
            let out = axes.up.vector() * point.turn.0 + axes.side.vector() * point.turn.1;
            let off = point.r - tube.shape().radius(point.at, point.turn);
            matrix += out * out.transpose() * point.weight;
            right += out * (off * point.weight);
            weights += point.weight;
        }
    }
    let least = 1e-3 * weights + 1.0 / (UNSEEN_M * UNSEEN_M);
    Some((matrix + Matrix3::identity() * least).cholesky()?.solve(&right))
}
