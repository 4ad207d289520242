//! From two signals to a lag: a scan over all lags, what disagrees left out, then the minimum to the microsecond.

use probepath_frames::{Probe, Span, Stamp, Track, World};

use super::motion::Motion;
use super::refine::refine;
use super::regress::{Regression, Row, regress};
use super::uncertainty::{jitter_s, standard_error};
use super::{LagFound, LagOptions, NoLag, Sample};

/// The least that a plane has to move in the image (px, 5th to 95th percentile).
const LEAST_PLANE_PX: f64 = 3.0;
/// Poses needed, however far they are apart.
const FEWEST_POSES: usize = 10;
/// The scan's step (s): a fraction of any hand's or arm's quickest motion.
const STEP_S: f64 = 0.01;
/// Step of the first, robust scan (s).
const ROBUST_STEP_S: f64 = 0.02;
/// Residuals beyond so many robust standard deviations belong to another line.
const OUTLIER: f64 = 6.0;
/// A lag is as good as the best unless it is so much less likely (log of the likelihoods' ratio, four sigma).
const AS_GOOD: f64 = 8.0;
/// Part of the velocity's power that has to be told apart from noise.
const LEAST_TOLD_APART: f64 = 0.3;

/// The lag between images and poses: an image stamped t belongs to the pose at t + lag.
///
/// Neither the plane's direction in the world nor the image's place on the probe nor its scale has to be known. The
/// order of the signal does not matter.
///
/// # Errors
/// [`NoLag`]: too few images or poses, too little or too uniform motion, no common time, a position that the pose does
/// not explain, a second lag as good, or an answer that is too uncertain.
pub fn lag_of(
    signal: &[Sample],
    poses: &Track<World, Probe>,
    options: &LagOptions,
) -> Result<LagFound, NoLag> {
    let (zero, mut rows) = rows_of(signal, options)?;
    let images = rows.len();
    let motion = motion_of(&rows, poses, zero, options)?;
    let scanned = scan_all(&motion, &mut rows, options);
    let scan = scanned.ok_or_else(|| no_overlap(&rows, poses, zero, options))?;
    let best = &scan.best;
    believable(&scan.lags, best, options)?;
    let fewest = options.fewest_images;
    let uncertain = |lag_s| NoLag::TooUncertain {
        lag_s,
        standard_error_s: f64::INFINITY,
        worst_s: options.worst_standard_error_s,
    };
    let fine = refine(&motion, &rows, best.lag_s, fewest).ok_or_else(|| uncertain(best.lag_s))?;
    let error = standard_error(&motion, &rows, &fine).ok_or_else(|| uncertain(fine.lag_s))?;
    if error.told_apart < LEAST_TOLD_APART {
        return Err(NoLag::TooUniform { told_apart: error.told_apart.max(0.0), least: LEAST_TOLD_APART });
    }
    let (lag_s, worst_s) = (fine.lag_s, options.worst_standard_error_s);
    if error.standard_error_s.is_nan() || error.standard_error_s > worst_s {
        return Err(NoLag::TooUncertain { lag_s, standard_error_s: error.standard_error_s, worst_s });
    }
    Ok(LagFound {
        lag: Span::from_seconds(lag_s),
        standard_error_s: error.standard_error_s,
        correlation: fine.regression.correlation(),
        residual_px: fine.regression.rms_px(),
        stamp_jitter_s: jitter_s(&fine),
        motion_m: motion.size_m,
        images: fine.regression.used.len(),
        outliers: images - rows.len(),
    })
}

/// The images in the order of their stamps, in seconds after the first.
fn rows_of(signal: &[Sample], options: &LagOptions) -> Result<(Stamp, Vec<Row>), NoLag> {
    let bad = |s: &&Sample| !s.position_px.is_finite() || !s.sd_px.is_finite() || s.sd_px < 0.0;
    if let Some(bad) = signal.iter().find(bad) {
        return Err(NoLag::NotFinite { at_s: bad.stamp.seconds() });
    }
    let needed = options.fewest_images.max(8);
    if signal.len() < needed {
        return Err(NoLag::TooFewImages { images: signal.len(), needed });
    }
    let mut sorted = signal.to_vec();
    sorted.sort_by_key(|s| s.stamp);
    let mut positions: Vec<f64> = sorted.iter().map(|s| s.position_px).collect();
    positions.sort_by(f64::total_cmp);
    let at = |part: usize| positions.get(positions.len() * part / 20).copied().unwrap_or_default();
    let moved_px = at(19) - at(1);
    if moved_px < LEAST_PLANE_PX {
        return Err(NoLag::PlaneStill { moved_px, least_px: LEAST_PLANE_PX });
    }
    let zero = sorted.first().map_or(Stamp::ZERO, |s| s.stamp);
    let worst = weight_floor(&sorted);
    let row = |s: &Sample| Row {
        time_s: (s.stamp - zero).seconds(),
        position: s.position_px,
        weight: 1.0 / (worst + s.sd_px.powi(2)),
    };
    Ok((zero, sorted.iter().map(row).collect()))
}

/// Variance (px²) that every image has beside its own: what is left in a real recording comes from stamps and poses
/// and is much the same for all, so an image counts less only when its line is far worse than the usual one.
fn weight_floor(samples: &[Sample]) -> f64 {
    let mut variances: Vec<f64> = samples.iter().map(|s| s.sd_px.powi(2)).collect();
    variances.sort_by(f64::total_cmp);
    variances.get(variances.len() / 2).copied().unwrap_or_default().max(0.01)
}

fn motion_of(
    rows: &[Row],
    poses: &Track<World, Probe>,
    zero: Stamp,
    options: &LagOptions,
) -> Result<Motion, NoLag> {
    let margin = options.most_lag.seconds() + 1.0;
    let last = rows.last().map_or(0.0, |r| r.time_s);
    let range = (-margin, last + margin);
    let there = poses.samples().iter().filter(|(s, _)| (range.0..=range.1).contains(&(*s - zero).seconds()));
    let there = there.count();
    if poses.samples().len() < FEWEST_POSES {
        return Err(NoLag::TooFewPoses { poses: poses.samples().len(), needed: FEWEST_POSES });
    }
    // Every coordinate costs a degree of freedom: at least five images for each.
    let most = (rows.len() / 5).clamp(1, 6);
    let motion = Motion::of(poses, zero, range, most).filter(|_| there >= FEWEST_POSES);
    let motion = motion.ok_or_else(|| no_overlap(rows, poses, zero, options))?;
    if motion.size_m.is_nan() || motion.size_m < options.least_motion_m || motion.dimension() == 0 {
        let (moved_mm, least_mm) = (motion.size_m * 1e3, options.least_motion_m * 1e3);
        return Err(NoLag::ProbeStill { moved_mm, least_mm });
    }
    Ok(motion)
}

/// Every lag that was tried with what it explains (R²), and the best.
struct Scan {
    lags: Vec<(f64, f64)>,
    best: Best,
}

struct Best {
    lag_s: f64,
    regression: Regression,
}

impl Scan {
    /// `None` when no lag has half of the images inside the poses.
    fn run(motion: &Motion, rows: &[Row], options: &LagOptions) -> Option<Self> {
        let mut tried = Vec::new();
        let mut best: Option<Best> = None;
        for lag_s in lags(options, STEP_S) {
            let Some(regression) = regress(motion, rows, lag_s, fewest(rows, options)) else { continue };
            tried.push((lag_s, regression.explained));
            if best.as_ref().is_none_or(|b| regression.explained > b.regression.explained) {
                best = Some(Best { lag_s, regression });
            }
        }
        Some(Self { lags: tried, best: best? })
    }
}

/// The scan of those images that agree with its best lag; the others are taken out. `None` when no lag has half of
/// the images inside the poses.
fn scan_all(motion: &Motion, rows: &mut Vec<Row>, options: &LagOptions) -> Option<Scan> {
    let images = rows.len();
    let mut best = robust_scan(motion, rows, options)?;
    loop {
        let kept = agreeing(rows, &best);
        let settled = kept.len() == rows.len() || kept.len() * 3 < images * 2;
        if !settled {
            *rows = kept;
        }
        let scan = Scan::run(motion, rows, options)?;
        if settled {
            return Some(scan);
        }
        best = scan.best;
    }
}

/// The lag that leaves least in three quarters of the images, by least absolute residuals: images that show another line do not lead it away.
fn robust_scan(motion: &Motion, rows: &[Row], options: &LagOptions) -> Option<Best> {
    let mut best: Option<(f64, Best)> = None;
    for lag_s in lags(options, ROBUST_STEP_S) {
        let regression = regress(motion, rows, lag_s, fewest(rows, options));
        let Some(regression) = regression.and_then(|r| r.least_absolute(rows)) else { continue };
        let left = regression.upper_quartile_px();
        if best.as_ref().is_none_or(|(least, _)| left < *least) {
            best = Some((left, Best { lag_s, regression }));
        }
    }
    best.map(|(_, best)| best)
}

/// Half of the images have to lie inside the poses.
fn fewest(rows: &[Row], options: &LagOptions) -> usize {
    options.fewest_images.max(rows.len() / 2)
}

/// The lags to try.
fn lags(options: &LagOptions, step_s: f64) -> impl Iterator<Item = f64> {
    let steps = (options.most_lag.seconds().abs() / step_s).ceil() as i64;
    (-steps..=steps).map(move |step| step as f64 * step_s)
}

/// The rows without those that the best lag leaves far out.
fn agreeing(rows: &[Row], best: &Best) -> Vec<Row> {
    let residuals = &best.regression.residuals;
    let mut sizes: Vec<f64> = residuals.iter().map(|e| e.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let spread = 1.4826 * sizes.get(sizes.len() / 2).copied().unwrap_or_default();
    let mut keep = vec![true; rows.len()];
    for (i, e) in best.regression.used.iter().zip(residuals.iter()) {
        keep[*i] = e.abs() <= OUTLIER * spread.max(0.05);
    }
    rows.iter().zip(keep).filter_map(|(row, keep)| keep.then_some(*row)).collect()
}

fn believable(lags: &[(f64, f64)], best: &Best, options: &LagOptions) -> Result<(), NoLag> {
    let correlation = best.regression.correlation();
    if correlation < options.least_correlation {
        return Err(NoLag::Unrelated { correlation, least: options.least_correlation });
    }
    let at =
        |tried: Option<&(f64, f64)>| tried.is_some_and(|(lag, _)| (lag - best.lag_s).abs() < STEP_S / 2.0);
    if at(lags.first()) || at(lags.last()) {
        return Err(NoLag::AtTheEnd { lag_s: best.lag_s, most_lag_s: options.most_lag.seconds() });
    }
    match next_best(lags, best) {
        Some((other_s, less)) if less < AS_GOOD => Err(NoLag::Ambiguous { lag_s: best.lag_s, other_s }),
        _ => Ok(()),
    }
}

/// The best of the other minima, and how much less likely it is (log of the likelihoods' ratio, with as many
/// independent images as the residuals' correlation leaves).
fn next_best(lags: &[(f64, f64)], best: &Best) -> Option<(f64, f64)> {
    let is_peak = |w: &&[(f64, f64)]| w[1].1 >= w[0].1 && w[1].1 >= w[2].1;
    let other = lags
        .windows(3)
        .filter(is_peak)
        .map(|w| w[1])
        .filter(|(lag, _)| (lag - best.lag_s).abs() > 1.5 * STEP_S)
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let ratio = (1.0 - other.1) / (1.0 - best.regression.explained).max(1e-12);
    Some((other.0, 0.5 * independent(&best.regression) * ratio.max(1.0).ln()))
}

/// As many independent residuals as these are worth, by the correlation of neighbours.
fn independent(regression: &Regression) -> f64 {
    let e = regression.residuals.as_slice();
    let neighbours: f64 = e.windows(2).map(|w| w[0] * w[1]).sum();
    let rho = (neighbours / regression.residuals.norm_squared()).clamp(0.0, 0.98);
    e.len() as f64 * (1.0 - rho) / (1.0 + rho)
}

fn no_overlap(rows: &[Row], poses: &Track<World, Probe>, zero: Stamp, options: &LagOptions) -> NoLag {
    let (first, last) = poses.span().unwrap_or((Stamp::ZERO, Stamp::ZERO));
    NoLag::NoOverlap {
        images_from_s: zero.seconds(),
        images_until_s: zero.seconds() + rows.last().map_or(0.0, |r| r.time_s),
        poses_from_s: first.seconds(),
        poses_until_s: last.seconds(),
        most_lag_s: options.most_lag.seconds(),
    }
}
