//! [`Station`]: one contour's place along the vessel, and what each error of the calibration would do there.

use nalgebra::Vector3;
use probepath_us_capture::PlacedBScan;

use super::PARAMETERS;
use crate::{Centreline, Contour};

/// The centres' line is differentiated over this much on either side (m).
const REACH_M: f64 = 8e-3;
/// An image this nearly parallel to the vessel says nothing of its area: cosine of the angle between the image's
/// normal and the vessel.
const LEAST_COSINE: f64 = 0.2;

/// Images farther apart than this are of different sweeps (s).
const LONGEST_S: f64 = 1.0;

/// One contour along the vessel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Station {
    /// Along the centreline (mm).
    pub(crate) at_mm: f64,
    /// What each parameter of the calibration moves the logarithm of the area by, per unit.
    pub(crate) relative: [f64; PARAMETERS],
    /// What it moves the contour along the vessel by (m per unit).
    pub(crate) moved_m: [f64; PARAMETERS],
    /// Tangent of the angle between the image's normal and the vessel.
    pub(crate) oblique: f64,
    /// Standard deviation of what the sizes of all contours near here share (m).
    pub(crate) border_sd_m: f64,
    /// Mean distance of the images (m).
    pub(crate) spacing_m: f64,
    /// With what force the probe pressed (N).
    pub(crate) force_n: Option<f64>,
}

/// How an image answers to a parameter: what moves its contour's centre, and its normal; and how much the picture
/// grows.
#[derive(Clone, Copy, Debug, Default)]
struct Answer {
    centre: Vector3<f64>,
    normal: Vector3<f64>,
    growth: f64,
}

/// A contour on the way to its station.
struct Cut {
    at: f64,
    normal: Vector3<f64>,
    along: Vector3<f64>,
    answers: [Answer; PARAMETERS],
    border_sd_m: f64,
    force_n: Option<f64>,
}

/// An image, and the contour of the vessel in it.
#[derive(Clone, Copy)]
pub(crate) struct Shown<'a> {
    pub(crate) image: &'a PlacedBScan,
    pub(crate) contour: Option<&'a Contour>,
}

/// The stations of a vessel's contours, along it. The images come in the order they were formed.
pub(crate) fn stations(shown: &[Shown<'_>], line: &Centreline) -> Vec<Station> {
    let mut cuts: Vec<Cut> = (0..shown.len()).filter_map(|i| cut(shown, i, line)).collect();
    cuts.sort_by(|a, b| a.at.total_cmp(&b.at));
    let spacing_m = line.length_m() / cuts.len().max(1) as f64;
    (0..cuts.len()).map(|i| station(&cuts, i, spacing_m)).collect()
}

fn cut(shown: &[Shown<'_>], i: usize, line: &Centreline) -> Option<Cut> {
    let Shown { image, contour } = shown.get(i)?;
    let contour = (*contour)?;
    let near = line.at(line.nearest_m(&contour.centre.vector())?)?;
    Some(Cut {
        at: near.at_m,
        normal: image.world_from_image.z_axis().vector(),
        along: near.tangent.vector(),
        answers: answers(shown, i, contour)?,
        border_sd_m: 1e-3 * contour.common_size_sd_mm,
        // What the skin does to the probe is negative along its z where the probe presses.
        force_n: image.wrench.map(|wrench| -wrench.force.z).filter(|force| force.is_finite()),
    })
}

/// What each parameter does to an image, in the order of [`super::ErrorBudget::PARAMETERS`].
fn answers(shown: &[Shown<'_>], i: usize, contour: &Contour) -> Option<[Answer; PARAMETERS]> {
    let image = shown.get(i)?.image;
    let (column, row) = contour.centre_pixel;
    let place = image.bscan.setting.spacing.point(column, row).vector();
    let world = image.world_from_image.isometry().rotation;
    let probe = image.world_from_probe.isometry().rotation;
    let axis = |k: usize| Vector3::from_fn(|i, _| if i == k { 1.0 } else { 0.0 });
    let turn = |k: usize| Answer {
        centre: world * axis(k).cross(&place),
        normal: world * axis(k).cross(&Vector3::z()),
        growth: 0.0,
    };
    let shift = |k: usize| Answer { centre: probe * axis(k), ..Answer::default() };
    let scale = |off: Vector3<f64>, growth: f64| Answer { centre: world * off, growth, ..Answer::default() };
    Some([
        turn(0),
        turn(1),
        turn(2),
        shift(0),
        shift(1),
        shift(2),
        scale(Vector3::new(place.x, 0.0, 0.0), 1.0),
        scale(Vector3::new(0.0, place.y, 0.0), 1.0),
        scale(Vector3::new(place.y, 0.0, 0.0), 0.0),
        late(shown, i, &place),
    ])
}

/// What a lag of a second too much does: everything is where the probe was to be a second later.
fn late(shown: &[Shown<'_>], i: usize, place: &Vector3<f64>) -> Answer {
    let neighbours = (shown.get(i.saturating_sub(1)), shown.get(i + 1).or(shown.get(i)));
    let (Some(Shown { image: a, .. }), Some(Shown { image: b, .. })) = neighbours else {
        return Answer::default();
    };
    let seconds = (b.bscan.formed - a.bscan.formed).seconds();
    // Between two sweeps nothing says how fast the probe went.
    if seconds <= 0.0 || seconds > LONGEST_S {
        return Answer::default();
    }
    let at = |image: &PlacedBScan| image.world_from_image.isometry() * nalgebra::Point3::from(*place);
    let normal = |image: &PlacedBScan| image.world_from_image.z_axis().vector();
    Answer { centre: (at(b) - at(a)) / seconds, normal: (normal(b) - normal(a)) / seconds, growth: 0.0 }
}

fn station(cuts: &[Cut], i: usize, spacing_m: f64) -> Station {
    let cut = &cuts[i];
    let cosine = cut.normal.dot(&cut.along);
    let steep = cosine.signum() * cosine.abs().max(LEAST_COSINE);
    let effect = |k: usize| {
        // How the line of the centres turns: the change along the vessel of what moves them, across it.
        let drift = drift(cuts, i, k);
        let turned = drift - cut.along * drift.dot(&cut.along);
        let answer = &cut.answers[k];
        answer.growth + (answer.normal.dot(&cut.along) + cut.normal.dot(&turned)) / steep
    };
    Station {
        at_mm: cut.at * 1e3,
        relative: std::array::from_fn(effect),
        moved_m: std::array::from_fn(|k| cut.answers[k].centre.dot(&cut.along)),
        oblique: (1.0 - cosine * cosine).max(0.0).sqrt() / steep.abs(),
        border_sd_m: cut.border_sd_m,
        spacing_m,
        force_n: cut.force_n,
    }
}

/// The slope along the vessel of what parameter `k` moves the centres by (least squares over the neighbours).
fn drift(cuts: &[Cut], i: usize, k: usize) -> Vector3<f64> {
    let at = cuts[i].at;
    let from = cuts.partition_point(|cut| cut.at < at - REACH_M);
    let to = cuts.partition_point(|cut| cut.at <= at + REACH_M);
    let near = &cuts[from..to];
    let count = near.len() as f64;
    let mean = near
        .iter()
        .fold((0.0, Vector3::zeros()), |(x, y), cut| (x + cut.at / count, y + cut.answers[k].centre / count));
    let (xx, xy) = near.iter().fold((0.0, Vector3::zeros()), |(xx, xy), cut| {
        let off = cut.at - mean.0;
        (xx + off * off, xy + (cut.answers[k].centre - mean.1) * off)
    });
    if xx > 1e-9 { xy / xx } else { Vector3::zeros() }
}
