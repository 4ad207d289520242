//! The images with their candidates and the probe's poses at every lag that is tried.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3, Vector4};
use probepath_frames::{Pose, Probe, Span, Track, World};

use super::{AgreeOptions, Agreement, Candidates, Labels, Verdict};
use crate::dots::Dot;
use crate::phantom::{Wire, WirePhantom};

/// Lags are tried this far apart.
const LAG_STEP: Span = Span::from_milliseconds(50);
/// No image brings more candidates than this.
const MOST: usize = 12;

/// One candidate of one image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub phantom_from_image: Isometry3<f64>,
    /// How it stands against the image's best: 1 for the best.
    pub weight: f64,
}

/// An image that has candidates and a pose.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub candidates: Vec<Candidate>,
    /// The probe in the world, a pose per lag; `None` where the track does not reach.
    pub poses: Vec<Option<Isometry3<f64>>>,
    image: usize,
}

/// All of them.
#[derive(Clone, Debug)]
pub(super) struct Views<'a> {
    pub views: Vec<View>,
    pub lags: Vec<Span>,
    /// Three places in the image's plane around the middle of the dots (m): planes are compared there.
    pub probes: [Point3<f64>; 3],
    pub gate_m: f64,
    pub images: &'a [Candidates],
}

impl<'a> Views<'a> {
    pub fn of(
        phantom: &WirePhantom,
        images: &'a [Candidates],
        track: &Track<World, Probe>,
        options: &AgreeOptions,
    ) -> Self {
        let steps = (options.widest_lag.seconds().abs() / LAG_STEP.seconds()).floor().min(100.0) as i64;
        let mut lags: Vec<_> =
            (-steps..=steps).map(|k| Span::from_nanoseconds(k * LAG_STEP.nanoseconds())).collect();
        // The smallest first: where lags do not matter, none is found.
        lags.sort_by_key(|l| l.nanoseconds().abs());
        let view = |(image, c): (usize, &Candidates)| {
            // At either end of the track the last pose has to do: it says which twin as well.
            let asked = |lag: &Span| track.span().map(|(a, b)| (c.stamp + *lag).clamp(a, b));
            let within = track.at(c.stamp).is_ok();
            let at = |lag: &Span| asked(lag).filter(|_| within).and_then(|stamp| track.at(stamp).ok());
            let poses: Vec<_> = lags.iter().map(|lag| at(lag).map(|p| *p.isometry())).collect();
            let there = !c.labels.is_empty() && poses.iter().any(Option::is_some);
            there.then(|| View { candidates: candidates(c), poses, image })
        };
        let views = images.iter().enumerate().filter_map(view).collect();
        Self { views, lags, probes: probes(phantom, images), gate_m: options.gate_m, images }
    }

    /// Images with candidates and a pose.
    pub fn labelled(&self) -> usize {
        self.views.len()
    }

    /// The same images of the phantom with one axis reversed: the planes are reversed with it, and looked at from
    /// the other side, which leaves every dot where it is.
    pub fn of_mirrored_phantom(&self) -> Self {
        let mut mirrored = self.clone();
        for candidate in mirrored.views.iter_mut().flat_map(|v| &mut v.candidates) {
            candidate.phantom_from_image = reversed(&candidate.phantom_from_image);
        }
        mirrored
    }

    pub fn needed(&self, options: &AgreeOptions) -> usize {
        ((self.labelled() as f64 * options.least_share).ceil() as usize).max(3)
    }

    pub fn is_enough(&self, verdict: &Verdict, options: &AgreeOptions) -> bool {
        // A wrong phantom finds its support among each image's poorer candidates.
        verdict.support >= self.needed(options) && verdict.worth > 0.5 * verdict.support as f64
    }

    /// How far a candidate's plane is from where `x` (image on the probe) and `y` (phantom in the world) put it (m).
    pub fn off(&self, pose: &Isometry3<f64>, c: &Candidate, x: &Isometry3<f64>, y: &Isometry3<f64>) -> f64 {
        let (seen, placed) = (y * c.phantom_from_image, pose * x);
        let square: f64 = self.probes.iter().map(|q| (seen * q - placed * q).norm_squared()).sum();
        (square / 3.0).sqrt()
    }

    /// Of a view, the candidate that agrees best within `gate`: which, how far off, what it is worth.
    pub fn best(
        &self,
        view: &View,
        lag: usize,
        (x, y): (&Isometry3<f64>, &Isometry3<f64>),
        gate: f64,
    ) -> Option<(usize, f64, f64)> {
        let pose = view.poses[lag]?;
        let judged = view.candidates.iter().enumerate().map(|(i, c)| {
            let off = self.off(&pose, c, x, y);
            (i, off, c.weight * (1.0 - (off / gate).powi(2)))
        });
        judged.filter(|j| j.1 < gate).max_by(|a, b| a.2.total_cmp(&b.2))
    }

    pub fn judge(&self, x: Isometry3<f64>, y: Isometry3<f64>, lag: usize) -> Verdict {
        let best = |v: &View| self.best(v, lag, (&x, &y), self.gate_m);
        let (mut worth, mut support, mut square) = (0.0, 0, 0.0);
        for (_, off, value) in self.views.iter().filter_map(best) {
            worth += value;
            support += 1;
            square += off * off;
        }
        let spread_m = if support == 0 { f64::INFINITY } else { (square / support as f64).sqrt() };
        Verdict { probe_from_image: x, world_from_phantom: y, lag: self.lags[lag], worth, support, spread_m }
    }

    /// Whether two verdicts put the image at different places on the probe, or the phantom in the world.
    pub fn differ(&self, a: &Verdict, b: &Verdict) -> bool {
        let far = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
            a.rotation.angle_to(&b.rotation) > 0.4
                || self.probes.iter().any(|q| (a * q - b * q).norm() > 20e-3)
        };
        far(&a.probe_from_image, &b.probe_from_image)
    }

    pub fn agreement(&self, best: &Verdict, margin: f64) -> Agreement {
        let lag = self.lags.iter().position(|l| *l == best.lag).unwrap_or(0);
        let mut chosen = vec![None; self.images.len()];
        for view in &self.views {
            let places = (&best.probe_from_image, &best.world_from_phantom);
            chosen[view.image] = self.best(view, lag, places, self.gate_m).map(|b| b.0);
        }
        Agreement {
            chosen,
            // FRAMES: found as the pose that takes the image's points to the probe in every image.
            probe_from_image: Pose::assume(best.probe_from_image),
            // FRAMES: as given, or found with it as the pose that takes the phantom's points to the world.
            world_from_phantom: Pose::assume(best.world_from_phantom),
            lag: best.lag,
            spread_m: best.spread_m,
            margin,
        }
    }
}

fn candidates(of: &Candidates) -> Vec<Candidate> {
    let best = of.labels.first().map_or(0.0, |l| l.score);
    let candidate = |l: &Labels| Candidate {
        phantom_from_image: *l.phantom_from_image.isometry(),
        weight: ((l.score - best) / 20.0).min(0.0).exp(),
    };
    of.labels.iter().take(MOST).map(candidate).collect()
}

/// The middle of all dots, and a centimetre to its right and below.
fn probes(phantom: &WirePhantom, images: &[Candidates]) -> [Point3<f64>; 3] {
    let best = images.iter().filter_map(|i| i.labels.first());
    let at: Vec<_> = best.flat_map(|labels| crossings(phantom, labels)).collect();
    let at = at.iter().sum::<Vector3<f64>>() / at.len().max(1) as f64;
    [at, at + Vector3::x() * 0.01, at + Vector3::y() * 0.01].map(Point3::from)
}

/// Where the labelled wires cross the image's plane (m, in the image).
fn crossings(phantom: &WirePhantom, labels: &Labels) -> Vec<Vector3<f64>> {
    let image_from_phantom = labels.phantom_from_image.inverse();
    let crossing = |(wire, _): (&Wire, &Option<Dot>)| {
        let (a, b) = (image_from_phantom * wire.front, image_from_phantom * wire.back);
        let (a, b) = (a.vector(), b.vector());
        ((b.z - a.z).abs() > 1e-4).then(|| a + (b - a) * (a.z / (a.z - b.z)))
    };
    phantom.wires.iter().zip(&labels.dots).filter(|w| w.1.is_some()).filter_map(crossing).collect()
}

/// A plane of the phantom with its x axis reversed, seen from the other side.
fn reversed(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let r = pose.rotation.to_rotation_matrix().into_inner();
    let flip = |v: Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
    let (x, y) = (flip(r.column(0).into()), flip(r.column(1).into()));
    let turned = nalgebra::Matrix3::from_columns(&[x, y, x.cross(&y)]);
    let turn = nalgebra::Rotation3::from_matrix_unchecked(turned);
    Isometry3::from_parts(
        Translation3::from(flip(pose.translation.vector)),
        UnitQuaternion::from_rotation_matrix(&turn),
    )
}

/// The mean of rotations that are not far apart.
pub(super) fn mean_rotation(of: &[UnitQuaternion<f64>]) -> UnitQuaternion<f64> {
    let Some(first) = of.first() else { return UnitQuaternion::identity() };
    let along = |q: &UnitQuaternion<f64>| {
        if q.coords.dot(&first.coords) < 0.0 { -q.coords } else { q.coords }
    };
    let sum: Vector4<f64> = of.iter().map(along).sum();
    UnitQuaternion::from_quaternion(Quaternion::from(sum))
}

/// The mean of rigid motions: of their rotations, and, by component, the median of where they take `centre`.
pub(super) fn mean(of: &[Isometry3<f64>], centre: &Point3<f64>) -> Isometry3<f64> {
    let turn = mean_rotation(&of.iter().map(|m| m.rotation).collect::<Vec<_>>());
    let median = |axis: usize| {
        let mut at: Vec<f64> = of.iter().map(|m| (m * centre)[axis]).collect();
        at.sort_by(f64::total_cmp);
        at.get(at.len() / 2).copied().unwrap_or(0.0)
    };
    let to = Vector3::new(median(0), median(1), median(2));
    Isometry3::from_parts(Translation3::from(to - turn * centre.coords), turn)
}
