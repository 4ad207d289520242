//! From the stream of states to a path: contact, progress, smoothing, uniform spacing.

use std::ops::Range;

use nalgebra::{SVector, Vector3};
use probepath_robot::motion::spline::Spline;

use super::beside::Beside;
use super::bins::Bins;
use super::contact::{ContactSign, stretches};
use super::progress::Progress;
use super::resample::uniform;
use super::smooth::smooth;
use super::tube::within;
use super::{Label, Path, PathPoint, TaughtForce};
use crate::{PathError, Sample};

/// Seconds over which places are averaged before contact and progress are read from them.
const STEADY_OVER_S: f64 = 0.2;
/// A hand moves the probe slower than this (m/s); a faster one is a loss of states, when it is also further than
/// [`LEAST_JUMP`].
const FASTEST: f64 = 1.0;
/// (m)
const LEAST_JUMP: f64 = 0.003;
/// Slower than this is a pause (m/s).
const PAUSE_BELOW: f64 = 0.002;
/// A contact over less than this (m) is a touch, no path.
const LEAST_TOUCH: f64 = 0.005;

/// How a recording is cleaned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cleaning {
    /// How contact is told from air.
    pub contact: ContactSign,
    /// Wavelength along the path (m) that keeps half its height; shorter ones are tremor, longer ones the leg.
    pub smooth_over: f64,
    /// Spacing of the points (m).
    pub spacing: f64,
    /// The longest stretch off the skin that is bridged (m).
    pub bridge: f64,
    /// The furthest that smoothing may move a point (m) before the recording is refused.
    pub most_moved: f64,
    /// The shortest path (m).
    pub least_length: f64,
    /// When it is given, the path is the one of least jerk that stays inside it; `smooth_over` then fills in only what
    /// was bridged.
    pub tube: Option<Tube>,
}

/// How far the path may be from what was taught.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tube {
    /// The probe's origin (m).
    pub metres: f64,
    /// The probe's orientation (rad).
    pub radians: f64,
}

impl Tube {
    /// `metres` and one degree.
    pub fn of(metres: f64) -> Self {
        Self { metres, radians: 1f64.to_radians() }
    }

    /// Half widths of origin and rotation vector: the cube inside the ball.
    fn widths(&self) -> SVector<f64, 6> {
        let (m, r) = (self.metres / 3f64.sqrt(), self.radians / 3f64.sqrt());
        SVector::from([m, m, m, r, r, r])
    }
}

impl Default for Cleaning {
    fn default() -> Self {
        Self {
            contact: ContactSign::Motion,
            smooth_over: 0.02,
            spacing: 0.0005,
            bridge: 0.03,
            most_moved: 0.005,
            least_length: 0.01,
            tube: None,
        }
    }
}

impl Cleaning {
    fn check(&self) -> Result<(), PathError> {
        let least = |name, value: f64, least: f64, why| {
            if value.is_finite() && value >= least {
                Ok(())
            } else {
                Err(PathError::Setting { name, value, why })
            }
        };
        least("spacing", self.spacing, 1e-5, "at least 0.00001 m")?;
        least("smooth_over", self.smooth_over, 4.0 * self.spacing, "at least four spacings")?;
        least("bridge", self.bridge, 0.0, "not negative")?;
        least("most_moved", self.most_moved, 0.0, "not negative")?;
        least("least_length", self.least_length, 4.0 * self.spacing, "at least four spacings")?;
        if let Some(Tube { metres, radians }) = self.tube {
            least("tube.metres", metres, 1e-5, "at least 0.00001 m")?;
            least("tube.radians", radians, 1e-5, "at least 0.00001 rad")?;
        }
        let ContactSign::Force { on_n, off_n } = self.contact else { return Ok(()) };
        least("on_n", on_n, 1e-3, "above zero")?;
        least("off_n", off_n, 1e-3, "above zero")?;
        least("on_n", on_n, off_n, "not below off_n")
    }
}

/// A stretch off the skin that was bridged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    /// Where it begins (m along the path).
    pub at: f64,
    /// How long it is (m).
    pub length: f64,
}

/// What cleaning found and did.
#[derive(Clone, Debug, PartialEq)]
pub struct CleaningReport {
    /// States recorded while guided.
    pub samples: usize,
    /// States that the path was made from.
    pub used: usize,
    /// Time before the first contact (s).
    pub approach_s: f64,
    /// Time after the last contact (s).
    pub lift_off_s: f64,
    /// Time in contact without moving (s).
    pub pauses_s: f64,
    /// States in contact that went over what was already done.
    pub doubled_back: usize,
    /// Way on the skin that went back beside what was already done, more than 4 mm from it, and was left out (m).
    pub beside: f64,
    /// Stretches off the skin that were bridged.
    pub bridges: Vec<Bridge>,
    /// How far smoothing moved the points across the path: RMS and largest (m).
    pub moved_rms: f64,
    /// (m)
    pub moved_most: f64,
    /// How far it turned them: largest (rad).
    pub turned_most: f64,
}

impl Path {
    /// The path of a recording: approach and lift-off cut off, pauses and doubling back removed, tremor smoothed,
    /// at uniform spacing.
    ///
    /// # Errors
    /// When nothing was guided, a number is not finite, states were lost, no contact is found, the probe was off the
    /// skin for too far, or the hand was too unsteady to be smoothed honestly.
    pub fn clean(
        samples: &[Sample],
        label: Label,
        cleaning: &Cleaning,
    ) -> Result<(Self, CleaningReport), PathError> {
        cleaning.check()?;
        let samples = guided(samples)?;
        let steady = steady(&samples);
        let mut contact = stretches(&samples, &steady, cleaning.contact);
        contact.retain(|range| reach(&steady[range.clone()]) >= LEAST_TOUCH);
        let used = Contact::of(&samples, &steady, contact, cleaning)?;
        used.path(label, cleaning)
    }
}

/// The states that were guided, checked.
fn guided(samples: &[Sample]) -> Result<Vec<Sample>, PathError> {
    let guided: Vec<Sample> = samples.iter().filter(|s| s.guiding).copied().collect();
    if guided.len() < 50 {
        return Err(PathError::TooFewSamples { found: guided.len() });
    }
    if let Some(bad) = guided.iter().find(|s| !s.base_from_probe.is_finite() || !s.wrench.is_finite()) {
        return Err(PathError::SampleNotFinite { at_s: bad.stamp.seconds() });
    }
    for pair in guided.windows(2) {
        let (from_s, at_s) = (pair[0].stamp.seconds(), pair[1].stamp.seconds());
        if pair[1].stamp <= pair[0].stamp {
            return Err(PathError::OutOfOrder { at_s, last_s: from_s });
        }
        let jump = pair[0].base_from_probe.distance(&pair[1].base_from_probe).0;
        if jump > LEAST_JUMP && jump > FASTEST * (at_s - from_s) {
            return Err(PathError::Jump { jump_mm: jump * 1e3, from_s, at_s });
        }
    }
    Ok(guided)
}

pub(super) fn place(sample: &Sample) -> Vector3<f64> {
    sample.base_from_probe.origin().vector()
}

/// The probe's origins, each averaged over a window of time around it.
fn steady(samples: &[Sample]) -> Vec<Vector3<f64>> {
    let (mut from, mut until, mut sum) = (0, 0, Vector3::zeros());
    let near = |a: &Sample, b: &Sample| (a.stamp - b.stamp).seconds().abs() <= STEADY_OVER_S / 2.0;
    let mut means = Vec::with_capacity(samples.len());
    for sample in samples {
        while until < samples.len() && (samples[until].stamp <= sample.stamp || near(&samples[until], sample))
        {
            sum += place(&samples[until]);
            until += 1;
        }
        while !near(&samples[from], sample) {
            sum -= place(&samples[from]);
            from += 1;
        }
        means.push(sum / (until - from) as f64);
    }
    means
}

/// The furthest that any place is from the first (m).
fn reach(places: &[Vector3<f64>]) -> f64 {
    let Some(first) = places.first() else { return 0.0 };
    places.iter().fold(0.0, |most, place| most.max((place - first).norm()))
}

/// What was recorded in contact, and how far along each state is.
pub(super) struct Contact<'a> {
    pub(super) samples: &'a [Sample],
    stretches: Vec<Range<usize>>,
    pub(super) kept: Vec<usize>,
    along: Vec<Option<f64>>,
    pauses_s: f64,
    beside: Beside,
}

impl<'a> Contact<'a> {
    fn of(
        samples: &'a [Sample],
        steady: &[Vector3<f64>],
        stretches: Vec<Range<usize>>,
        cleaning: &Cleaning,
    ) -> Result<Self, PathError> {
        let kept: Vec<usize> = stretches.iter().cloned().flatten().collect();
        if kept.is_empty() {
            return Err(no_contact(samples, cleaning.contact));
        }
        let progress = Progress::of(kept.iter().map(|i| steady[*i]));
        let along = progress.along(kept.iter().map(|i| place(&samples[*i])));
        let pauses_s =
            stretches.iter().map(|range| pauses(&samples[range.clone()], &steady[range.clone()])).sum();
        let places = kept.iter().map(|i| (&samples[*i], steady[*i]));
        let beside = Beside::of(places.zip(progress.doubled()));
        beside.check()?;
        Ok(Self { samples, stretches, kept, along, pauses_s, beside })
    }

    pub(super) fn used(&self) -> impl Iterator<Item = (&Sample, f64)> {
        self.kept.iter().zip(&self.along).filter_map(|(i, s)| Some((&self.samples[*i], (*s)?)))
    }

    /// Smoothed, resampled and reported.
    fn path(&self, label: Label, cleaning: &Cleaning) -> Result<(Path, CleaningReport), PathError> {
        let step = cleaning.spacing;
        let bins = Bins::of(self, step)?;
        let bridges = bins.bridges(cleaning)?;
        let cutoff = cleaning.smooth_over / step;
        let smooth = smooth(&bins.values, cutoff).ok_or_else(|| bins.too_short(cleaning))?;
        let smoothed = match cleaning.tube {
            None => smooth,
            Some(tube) => within(&bins.values, &tube.widths(), cutoff)
                .ok_or(PathError::Tube { tube_mm: tube.metres * 1e3, tube_deg: tube.radians.to_degrees() })?,
        };
        let curve = Spline::through(step, smoothed).ok_or_else(|| bins.too_short(cleaning))?;
        let moved = bins.moved(&curve, cleaning)?;
        let points: Vec<PathPoint> =
            uniform(&curve, cleaning.spacing).iter().map(|u| bins.point(&curve, &moved, *u)).collect();
        let length = cleaning.spacing * (points.len() - 1) as f64;
        if length < cleaning.least_length {
            return Err(bins.too_short(cleaning));
        }
        let report = self.report(bridges, &points);
        Ok((Path::new(label, cleaning.spacing, points, Some(self.force()))?, report))
    }

    fn force(&self) -> TaughtForce {
        let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for (sample, _) in self.used() {
            let force = -sample.wrench.force.z;
            (n, sum, squares) = (n + 1.0, sum + force, squares + force * force);
            (least, most) = (least.min(force), most.max(force));
        }
        let mean = sum / n;
        TaughtForce { mean, sd: (squares / n - mean * mean).max(0.0).sqrt(), least, most }
    }

    fn report(&self, bridges: Vec<Bridge>, points: &[PathPoint]) -> CleaningReport {
        let moved: Vec<(f64, f64)> = points.iter().filter_map(|p| p.moved).collect();
        let squares: f64 = moved.iter().map(|(m, _)| m * m).sum();
        let seconds = |from: usize, until: usize| match (self.samples.get(from), self.samples.get(until)) {
            (Some(a), Some(b)) => (b.stamp - a.stamp).seconds(),
            _ => 0.0,
        };
        let (first, last) =
            (self.stretches.first().map_or(0, |r| r.start), self.stretches.last().map_or(0, |r| r.end));
        let used = self.used().count();
        CleaningReport {
            samples: self.samples.len(),
            used,
            approach_s: seconds(0, first),
            lift_off_s: seconds(last.saturating_sub(1), self.samples.len() - 1),
            pauses_s: self.pauses_s,
            doubled_back: self.kept.len() - used,
            beside: self.beside.length,
            bridges,
            moved_rms: (squares / moved.len().max(1) as f64).sqrt(),
            moved_most: moved.iter().fold(0.0, |most, (m, _)| most.max(*m)),
            turned_most: moved.iter().fold(0.0, |most, (_, t)| most.max(*t)),
        }
    }
}

fn no_contact(samples: &[Sample], sign: ContactSign) -> PathError {
    let seconds = match samples {
        [first, .., last] => (last.stamp - first.stamp).seconds(),
        _ => 0.0,
    };
    let how = match sign {
        ContactSign::Motion => "a descent along the probe's axis, then at least 5 mm along the skin".into(),
        ContactSign::Force { on_n, .. } => format!("a force above {on_n} N along the probe's axis"),
    };
    PathError::NoContact { seconds, how }
}

/// Seconds without motion: what was moved is looked at once for every [`STEADY_OVER_S`], so that tremor is none.
fn pauses(samples: &[Sample], steady: &[Vector3<f64>]) -> f64 {
    let (mut from, mut sum) = (0, 0.0);
    for (i, sample) in samples.iter().enumerate() {
        let dt = (sample.stamp - samples[from].stamp).seconds();
        if dt < STEADY_OVER_S {
            continue;
        }
        if (steady[i] - steady[from]).norm() < PAUSE_BELOW * dt {
            sum += dt;
        }
        from = i;
    }
    sum
}
