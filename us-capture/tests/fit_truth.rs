//! The fit against known truths: seeded phantoms, calibrations, ways of the probe, lags, errors of dots and poses.
#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

#[path = "support/calibration_truth.rs"]
mod calibration_truth;

use calibration_truth::{Capture, Dice, Truth, captured, single_wires, zs};
use probepath_frames::{Pose, Span};
use probepath_us_capture::fit::{Fit, FitError, FitOptions, Lag, Parameter, PhantomPlace, fit};
use probepath_us_capture::phantom::WirePhantom;

const PLACE: (f64, f64) = (0.5e-3, 0.0087);

/// Pixels all over an image.
fn pixels() -> impl Iterator<Item = (f64, f64)> {
    (0..20).map(|k| (f64::from(k % 5) * 200.0, f64::from(k / 5) * 200.0))
}

/// Root mean square distance of the reconstructed points from where they are, in the probe (m).
fn true_error(truth: &Truth, found: &Fit) -> f64 {
    let map = found.pixels();
    rms(pixels().map(|(u, v)| map.at(u, v).distance(&(truth.probe_from_image * truth.spacing.point(u, v)))))
}

fn stated_error(found: &Fit) -> f64 {
    rms(pixels().map(|(u, v)| found.uncertainty.standard_error(u, v)))
}

fn rms(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let (count, sum) = numbers.into_iter().fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x * x));
    f64::sqrt(sum / count)
}

fn options(truth: &Truth) -> FitOptions {
    FitOptions::new(truth.spacing, PhantomPlace::prior(truth.world_from_phantom))
}

fn fitted(truth: &Truth, options: &FitOptions) -> Result<Fit, FitError> {
    fit(&truth.phantom, &truth.sightings, &truth.track, options, None)
}

#[test]
fn without_noise_the_truth_is_found_whatever_the_lag() {
    for seed in 0..30 {
        let mut dice = Dice::new(seed);
        let phantom = zs(&mut dice, 2 + seed as usize % 4, 1 + seed as usize % 2);
        let lag_s = dice.between(-0.9, 0.9);
        let truth =
            captured(&mut dice, phantom, &Capture { poses_every_s: 2e-3, lag_s, ..Capture::default() });
        let found = fitted(&truth, &options(&truth)).unwrap();
        assert!(true_error(&truth, &found) < 3e-7, "seed {seed}: {}", true_error(&truth, &found));
        assert!((found.lag.seconds() - lag_s).abs() < 1e-6, "seed {seed}: {:?}, not {lag_s}", found.lag);
        let (metres, angle) = found.world_from_phantom.distance(&truth.world_from_phantom);
        assert!(metres < 1e-6 && angle < 1e-5, "seed {seed}: the phantom moved {metres} m, {angle} rad");
    }
}

/// A phantom that stands elsewhere than said, by the prior's standard deviations, is found where it stands when the
/// probe turns enough.
#[test]
fn the_phantoms_place_is_corrected() {
    for seed in 0..10 {
        let mut dice = Dice::new(seed);
        let phantom = zs(&mut dice, 3, 1);
        let mut truth = captured(
            &mut dice,
            phantom,
            &Capture { tilt_rad: 0.35, poses_every_s: 2e-3, ..Capture::default() },
        );
        let stands = truth.world_from_phantom;
        truth.world_from_phantom = Pose::assume(*stands.isometry() * dice.motion(PLACE.0, PLACE.1));
        let found = fitted(&truth, &options(&truth)).unwrap();
        let off = found.world_from_phantom.distance(&stands);
        assert!(off.0 < 1e-5 && off.1 < 1e-4, "seed {seed}: {off:?}");
        assert!(true_error(&truth, &found) < 1e-5);
    }
}

#[test]
fn a_phantom_that_stands_anywhere_near_is_found_from_the_wires_alone() {
    for seed in 0..10 {
        let mut dice = Dice::new(seed);
        let phantom = zs(&mut dice, 4, 1);
        let mut truth = captured(
            &mut dice,
            phantom,
            &Capture { tilt_rad: 0.35, poses_every_s: 2e-3, ..Capture::default() },
        );
        let stands = truth.world_from_phantom;
        truth.world_from_phantom = Pose::assume(*stands.isometry() * dice.motion(10e-3, 0.1));
        let options =
            FitOptions { place: PhantomPlace::Free { start: truth.world_from_phantom }, ..options(&truth) };
        let found = fitted(&truth, &options).unwrap();
        let off = found.world_from_phantom.distance(&stands);
        assert!(off.0 < 1e-5 && off.1 < 1e-4, "seed {seed}: {off:?}");
    }
}

/// Single wires have no Zs, so no linear start: one by hand will do.
#[test]
fn single_wires_in_any_layout_are_fitted_from_a_start() {
    for seed in 0..20 {
        let mut dice = Dice::new(seed);
        let phantom = single_wires(&mut dice, 7);
        let truth = captured(&mut dice, phantom, &Capture { poses_every_s: 2e-3, ..Capture::default() });
        assert!(matches!(fitted(&truth, &options(&truth)), Err(FitError::NoStart { .. })));
        let start = Pose::assume(*truth.probe_from_image.isometry() * dice.motion(5e-3, 0.1));
        let found =
            fit(&truth.phantom, &truth.sightings, &truth.track, &options(&truth), Some(start)).unwrap();
        assert!(true_error(&truth, &found) < 3e-7, "seed {seed}: {}", true_error(&truth, &found));
    }
}

/// A thousand small calibrations of every kind: errors over stated errors are as normal numbers are.
#[test]
fn a_thousand_calibrations_err_as_they_state() {
    let (mut ratios, mut lags) = (Vec::new(), Vec::new());
    for seed in 0..1000 {
        let mut dice = Dice::new(10_000 + seed);
        let phantom = zs(&mut dice, 2 + seed as usize % 3, 1 + seed as usize % 2);
        let capture = Capture {
            images: 20 + seed as usize % 20,
            tilt_rad: dice.between(0.15, 0.4),
            lag_s: dice.between(-0.2, 0.2),
            tracker: (dice.between(0.0, 1e-4), dice.between(0.0, 1e-3)),
            dot_px: dice.between(0.2, 1.5),
            wrong: dice.between(0.0, 0.03),
            ..Capture::default()
        };
        let (error, stated, lag) = run(&mut dice, phantom, &capture);
        ratios.push(error / stated);
        lags.push(lag);
    }
    let beyond = |limit: f64, numbers: &[f64]| numbers.iter().filter(|x| x.abs() > limit).count();
    // Of a thousand normal numbers 46 lie beyond two standard deviations, and 3 beyond three.
    assert!((0.9..1.12).contains(&rms(ratios.iter().copied())) && beyond(3.0, &ratios) <= 4);
    assert!((0.9..1.12).contains(&rms(lags.iter().copied())) && beyond(3.0, &lags) <= 10);
    assert!((30..70).contains(&beyond(2.0, &lags)));
}

/// A calibration on a phantom that stands a little off: true and stated error over the image (m), and the lag's error
/// in standard errors.
fn run(dice: &mut Dice, phantom: WirePhantom, capture: &Capture) -> (f64, f64, f64) {
    let mut truth = captured(dice, phantom, capture);
    truth.world_from_phantom =
        Pose::assume(*truth.world_from_phantom.isometry() * dice.motion(PLACE.0, PLACE.1));
    let lag = Lag::Estimated { from: Span::from_milliseconds(-300), to: Span::from_milliseconds(300) };
    let found = fitted(&truth, &FitOptions { lag, ..options(&truth) }).unwrap();
    let sd = found.uncertainty.standard_error_of(Parameter::LAG).unwrap();
    (true_error(&truth, &found), stated_error(&found), (found.lag.seconds() - truth.lag_s) / sd)
}

/// Two hundred runs of each kind, errors shared by the dots of an image among them: what is stated is what was found,
/// within 30 %.
#[test]
fn the_stated_error_is_the_true_one() {
    let dots_only = Capture { dot_px: 0.5, images: 40, ..Capture::default() };
    let tracked = Capture { tracker: (0.15e-3, 2.6e-3), ..dots_only };
    let hardly_turned = Capture { tilt_rad: 0.05, wrong: 0.03, ..tracked };
    let few = Capture { images: 12, ..tracked };
    for (capture, rows) in [(dots_only, 3), (tracked, 3), (hardly_turned, 3), (few, 5)] {
        let (mut errors, mut stated, mut lags) = (Vec::new(), Vec::new(), Vec::new());
        for seed in 0..200 {
            let mut dice = Dice::new(1000 + seed);
            let phantom = zs(&mut dice, rows, 1);
            let (error, said, lag) = run(&mut dice, phantom, &capture);
            errors.push(error);
            stated.push(said);
            lags.push(lag);
        }
        let (points, lag) = (rms(stated) / rms(errors), 1.0 / rms(lags));
        println!("{capture:?}: stated over true {points:.2} over the image, {lag:.2} of the lag");
        assert!((0.77..1.3).contains(&points), "{capture:?}: {points}");
        assert!((0.77..1.3).contains(&lag), "{capture:?}: {lag}");
    }
}

#[test]
fn images_at_one_place_promise_no_more_than_one_of_them() {
    let mut dice = Dice::new(77);
    let phantom = zs(&mut dice, 3, 1);
    let capture = Capture { tracker: (1e-4, 1e-3), dot_px: 0.3, ..Capture::default() };
    let truth = captured(&mut dice, phantom, &capture);
    let error = |times: usize| {
        let sightings: Vec<_> = truth.sightings.iter().flat_map(|s| vec![s.clone(); times]).collect();
        let options = FitOptions::new(truth.spacing, PhantomPlace::prior(truth.world_from_phantom));
        let found = fit(&truth.phantom, &sightings, &truth.track, &options, None).unwrap();
        found.uncertainty.standard_error_map(800, 600).mean_m()
    };
    let (once, four_times) = (error(1), error(4));
    assert!((four_times / once - 1.0).abs() < 0.15, "{once} once, {four_times} four times");
}
