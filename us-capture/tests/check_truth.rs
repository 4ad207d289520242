//! The check against known truths: a calibration that did not move passes, one that did is found out.
#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

#[path = "support/calibration_truth.rs"]
mod calibration_truth;

use std::sync::Arc;

use calibration_truth::{Capture, Dice, Truth, captured, zs};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use probepath_frames::{Pose, Span};
use probepath_us_capture::check::{Check, CheckError, CheckOptions, Verdict, check, check_shots};
use probepath_us_capture::fit::{
    FitOptions, Lag, PhantomPlace, Scale, Sighting, fit, speed_of_sound_in_water,
};
use probepath_us_capture::shots::{Shot, Shots};
use probepath_us_capture::{Calibration, CalibrationError, Quality, Setting};

const SIZE: (usize, usize) = (800, 600);
/// Depth of the first row under the face: the window is zoomed, so that water matters most.
const WINDOW_TOP_M: f64 = 0.02;

/// A calibration on the first 60 images of a capture; the rest, `scan` of them, are for the check.
fn calibrated(seed: u64, scan: usize, tilt_rad: f64, scale: Scale) -> (Calibration, Truth) {
    let mut dice = Dice::new(seed);
    let phantom = zs(&mut dice, 3, 1);
    let capture =
        Capture { images: 60 + scan, tracker: (5e-5, 5e-4), dot_px: 0.5, tilt_rad, ..Capture::default() };
    let mut truth = captured(&mut dice, phantom, &capture);
    // 120 ms is the truth.
    let lag = Lag::Estimated { from: Span::ZERO, to: Span::from_milliseconds(250) };
    let place = PhantomPlace::Known(truth.world_from_phantom);
    let options = FitOptions { scale, lag, ..FitOptions::new(truth.spacing, place) };
    let rest = truth.sightings.split_off(60);
    let found = fit(&truth.phantom, &truth.sightings, &truth.track, &options, None).unwrap();
    truth.sightings = rest;
    let setting = Setting {
        depth_m: WINDOW_TOP_M + found.spacing.y_m * 600.0,
        focus_m: 0.03,
        window_top_m: WINDOW_TOP_M,
        window_height_m: found.spacing.y_m * 600.0,
        window_width_m: found.spacing.x_m * 800.0,
        spacing: found.spacing,
    };
    let calibration = Calibration {
        id: "test".into(),
        date: "2026-11-23".into(),
        phantom: truth.phantom.name.clone(),
        probe_from_image: found.probe_from_image,
        setting,
        image_lag: found.lag,
        error: CalibrationError { rms_mm: 0.1, sd_mm: 0.1, held_out: false },
        quality: Some(Quality::of(&found, SIZE)),
    };
    // Through the file, as a check has it.
    (Calibration::from_toml(&calibration.to_toml().unwrap()).unwrap(), truth)
}

/// As they are stored after a scan with tilts: 20 seconds at ten images a second would be 200; 40 have to do.
fn usual(seed: u64) -> (Calibration, Truth) {
    calibrated(seed, 40, 0.3, Scale::Estimated)
}

fn checked_with(
    calibration: &Calibration,
    truth: &Truth,
    options: &CheckOptions,
) -> Result<Check, CheckError> {
    let place = PhantomPlace::Known(truth.world_from_phantom);
    check(calibration, &truth.phantom, &truth.sightings, &truth.track, (SIZE, place), options)
}

/// Of the lags fewer are tried than usual: that is what takes the time.
fn checked(calibration: &Calibration, truth: &Truth) -> Check {
    let options = CheckOptions { lag_reach: Span::from_milliseconds(100), ..CheckOptions::default() };
    checked_with(calibration, truth, &options).unwrap()
}

/// The holder slipped: the image is elsewhere in the probe than the stored pose says.
fn slipped(calibration: &Calibration, by: &Isometry3<f64>) -> Calibration {
    let pose = by.inverse() * calibration.probe_from_image.isometry();
    // FRAMES: the probe's axes as they were, in the probe's as they are.
    Calibration { probe_from_image: Pose::assume(pose), ..calibration.clone() }
}

fn later(calibration: &Calibration, by_s: f64) -> Span {
    Span::from_seconds(calibration.image_lag.seconds() + by_s)
}

fn shift(by_m: Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(by_m.into(), UnitQuaternion::identity())
}

/// A turn about the image's middle, so that nothing but the turn tells.
fn turn(calibration: &Calibration, by_rad: Vector3<f64>) -> Isometry3<f64> {
    let middle = calibration.setting.spacing.point(400.0, 300.0).vector();
    let middle = calibration.probe_from_image.isometry() * nalgebra::Point3::from(middle);
    let about = shift(middle.coords);
    about * UnitQuaternion::from_scaled_axis(by_rad) * about.inverse()
}

#[test]
fn what_did_not_move_holds_and_what_did_is_found_out() {
    let (mut holds, mut slips, mut turns) = (0, 0, 0);
    const CASES: u64 = 100;
    for seed in 0..CASES {
        let (calibration, truth) = usual(seed);
        let same = checked(&calibration, &truth);
        holds += u64::from(same.verdict == Verdict::Holds);
        let mut dice = Dice::new(1000 + seed);
        let by = shift(dice.vector(1.0).normalize() * 1e-3);
        let slip = checked(&slipped(&calibration, &by), &truth);
        slips += u64::from(slip.verdict == Verdict::Moved);
        let axis = dice.vector(1.0).normalize() * 1_f64.to_radians();
        // The holder turns about its screw, 60 mm behind the face.
        let screw = Isometry3::translation(0.0, 0.0, -0.06);
        let by = screw * UnitQuaternion::from_scaled_axis(axis) * screw.inverse();
        let turned = checked(&slipped(&calibration, &by), &truth);
        turns += u64::from(turned.verdict == Verdict::Moved);
        for found in [&same, &slip, &turned].into_iter().filter(|_| seed == 0) {
            println!("{}\n{:?}", found.words, found.report());
        }
        if same.verdict != Verdict::Holds {
            println!("{seed}: {}", same.words);
        }
    }
    println!("of {CASES}: {holds} hold, {slips} slips of 1 mm and {turns} turns of 1 degree found out");
    assert!(100 * holds >= 95 * CASES && 100 * slips >= 99 * CASES && 100 * turns >= 99 * CASES);
}

#[test]
fn the_stated_errors_are_the_true_ones() {
    let (mut squares, mut lags, mut alarms) = (0.0, 0.0, 0.0);
    const CASES: u64 = 150;
    for seed in 0..CASES {
        let (calibration, truth) = usual(5000 + seed);
        let change = checked(&calibration, &truth).change.unwrap();
        squares += change.shift_m.component_div(&change.shift_error_m).norm_squared() / 3.0;
        let (late, error) = change.lag_s.unwrap();
        lags += (late / error).powi(2);
        alarms += f64::from(u8::from(change.chance < 0.05));
    }
    let part = |sum: f64| sum / CASES as f64;
    let (shift, lag, alarms) = (part(squares), part(lags), part(alarms));
    println!("normalised variance: shift {shift:.2}, lag {lag:.2}; a chance below 5 % in {alarms:.3}");
    assert!((0.6..1.5).contains(&shift) && (0.6..1.5).contains(&lag), "{shift} {lag}");
    assert!(alarms < 0.12, "{alarms}");
}

#[test]
fn the_words_say_what_moved() {
    let (calibration, truth) = usual(3);
    for (axis, name) in [(Vector3::x(), "x"), (Vector3::y(), "y"), (Vector3::z(), "z")] {
        let found = checked(&slipped(&calibration, &shift(axis * 1.2e-3)), &truth);
        assert_eq!(found.verdict, Verdict::Moved, "{}", found.words);
        let report = found.report().change.unwrap();
        let along = report.shift_mm[(axis * 3.0).imax()];
        assert!((along - 1.2).abs() < 0.3, "{}", found.words);
        assert!(found.words.contains(&format!("mm along the probe's {name}")), "{}", found.words);
        let turned = checked(&slipped(&calibration, &turn(&calibration, axis * 0.04)), &truth);
        assert!(turned.words.contains(&format!("degrees about the probe's {name}")), "{}", turned.words);
        let degrees = turned.report().change.unwrap().turn_deg[(axis * 3.0).imax()];
        assert!((degrees - 0.04_f64.to_degrees()).abs() < 0.3, "{}", turned.words);
    }
    let late = Calibration { image_lag: later(&calibration, 0.06), ..calibration.clone() };
    let found = checked(&late, &truth);
    assert_eq!(found.verdict, Verdict::Moved, "{}", found.words);
    let change = found.report().change.unwrap().lag_change_ms.unwrap();
    assert!((change + 60.0).abs() < 10.0 && found.words.contains("the lag changed by -"), "{}", found.words);
    assert!(!found.words.contains("the image moved"), "{}", found.words);
}

#[test]
fn a_scan_that_tells_too_little_says_so() {
    let (calibration, truth) = calibrated(5, 2, 0.3, Scale::Estimated);
    let few = checked(&calibration, &truth);
    assert_eq!((few.verdict, few.change.is_none()), (Verdict::CannotTell, true), "{}", few.words);
    assert!(few.words.contains("capture more images"), "{}", few.words);
    // Hardly a dot in an image, and hardly an image: a fit, but not a sure one.
    let (calibration, mut truth) = calibrated(6, 8, 0.3, Scale::Estimated);
    for (k, sighting) in truth.sightings.iter_mut().enumerate() {
        let mut at = 0;
        sighting.dots.retain(|_| {
            at += 1;
            at % 3 == k % 3
        });
    }
    let weak = checked(&calibration, &truth);
    assert_eq!(weak.verdict, Verdict::CannotTell, "{}", weak.words);
    println!("{}\n{}", few.words, weak.words);
}

/// Never that something holds or moved when it is not so: scans of every length, slips of every size.
#[test]
fn a_verdict_is_never_wrong_about_what_matters() {
    let (mut told, mut wrong) = ([0; 3], 0);
    for seed in 0..150 {
        let mut dice = Dice::new(9000 + seed);
        let scan = dice.between(3.0, 40.0) as usize;
        let (calibration, truth) = calibrated(7000 + seed, scan, dice.between(0.02, 0.3), Scale::Known);
        let by = if seed % 2 == 0 { 0.0 } else { 1.5e-3 };
        let found = checked(&slipped(&calibration, &shift(dice.vector(1.0).normalize() * by)), &truth);
        told[found.verdict as usize] += 1;
        let is_wrong = match found.verdict {
            Verdict::Holds => by > 0.0,
            Verdict::Moved => by <= 0.0,
            Verdict::CannotTell => false,
        };
        if is_wrong {
            println!("{seed}: {by} {}", found.words);
        }
        wrong += u32::from(is_wrong);
    }
    println!("holds, moved, cannot tell: {told:?}; {wrong} wrong");
    assert!(wrong <= 2, "{wrong}");
}

/// The same scene through water: what lies at a depth is drawn at the row of its echo's time.
fn through_water(truth: &mut Truth, spacing_y_m: f64, celsius: f64) {
    let slower = 1540.0 / speed_of_sound_in_water(celsius);
    let row = |v: f64| {
        let depth_m = WINDOW_TOP_M + (v + 0.5) * spacing_y_m;
        (depth_m * slower - WINDOW_TOP_M) / spacing_y_m - 0.5
    };
    for dot in truth.sightings.iter_mut().flat_map(|s: &mut Sighting| &mut s.dots) {
        dot.at_px[1] = row(dot.at_px[1]);
    }
}

#[test]
fn a_calibration_for_tissue_is_checked_in_water() {
    let (mut holds, mut unasked, mut moved) = (0, [0; 3], 0);
    const CASES: u64 = 30;
    for seed in 0..CASES {
        let (calibration, mut truth) = calibrated(300 + seed, 60, 0.3, Scale::Known);
        let celsius = Dice::new(seed).between(15.0, 35.0);
        through_water(&mut truth, calibration.setting.spacing.y_m, celsius);
        let warm = CheckOptions {
            water_celsius: Some(celsius),
            lag_reach: Span::from_milliseconds(100),
            ..CheckOptions::default()
        };
        let found = checked_with(&calibration, &truth, &warm).unwrap();
        holds += u64::from(found.verdict == Verdict::Holds);
        let by = shift(Dice::new(70 + seed).vector(1.0).normalize() * 1e-3);
        let slip = checked_with(&slipped(&calibration, &by), &truth, &warm).unwrap();
        moved += u64::from(slip.verdict == Verdict::Moved);
        let found = checked(&calibration, &truth);
        unasked[found.verdict as usize] += 1;
        // Nobody has water of 80 degrees; the machine is set to another depth.
        let hot = CheckOptions { water_celsius: Some(80.0), ..CheckOptions::default() };
        let refused = checked_with(&calibration, &truth, &hot);
        assert!(matches!(refused, Err(CheckError::OtherRows { .. })), "{refused:?}");
    }
    println!("of {CASES}: {holds} hold, {moved} slips found; without the temperature {unasked:?}");
    assert!(100 * holds >= 95 * CASES && moved == CASES, "{holds} {moved}");
    assert!(unasked[Verdict::Moved as usize] <= 1, "{unasked:?}");
}

#[test]
fn another_phantom_and_options_that_are_no_use_are_refused() {
    let (calibration, mut truth) = usual(4);
    let wrong = [
        CheckOptions { tolerance_m: f64::NAN, ..CheckOptions::default() },
        CheckOptions { false_alarm: 1.0, ..CheckOptions::default() },
        CheckOptions { lag_reach: Span::ZERO, ..CheckOptions::default() },
        CheckOptions { water_celsius: Some(295.0), ..CheckOptions::default() },
    ];
    for options in &wrong {
        let refused = checked_with(&calibration, &truth, options);
        assert!(matches!(refused, Err(CheckError::Option { .. })), "{refused:?}");
    }
    truth.phantom.name = "another".into();
    let refused = checked_with(&calibration, &truth, &CheckOptions::default());
    assert!(matches!(refused, Err(CheckError::OtherPhantom { .. })));
}

/// The dots as a picture: a bright spot each, on weak speckle.
fn drawn(dice: &mut Dice, sighting: &Sighting) -> Arc<[u8]> {
    let mut pixels: Vec<f64> = (0..SIZE.0 * SIZE.1).map(|_| dice.between(0.0, 12.0)).collect();
    for dot in &sighting.dots {
        let [u, v] = dot.at_px;
        for (x, y) in (-14..15).flat_map(|x| (-10..11).map(move |y| (x, y))) {
            let (column, row) = (u.round() + f64::from(x), v.round() + f64::from(y));
            if (0.0..SIZE.0 as f64).contains(&column) && (0.0..SIZE.1 as f64).contains(&row) {
                let off = ((column - u) / 5.0).powi(2) + ((row - v) / 3.0).powi(2);
                pixels[row as usize * SIZE.0 + column as usize] += 200.0 * (-0.5 * off).exp();
            }
        }
    }
    pixels.into_iter().map(|grey| grey.min(255.0) as u8).collect()
}

fn shots(truth: &Truth, draw: impl FnMut(&Sighting) -> Arc<[u8]>) -> Shots {
    let pictures = truth.sightings.iter().map(draw);
    let numbered = truth.sightings.iter().zip(pictures);
    let shots = numbered.map(|(s, p)| Shot { number: s.image as u64, stamp: s.stamp, pixels: Ok(p) });
    Shots::new(SIZE, shots.collect(), truth.track.clone()).unwrap()
}

#[test]
fn a_check_from_pictures_to_the_verdict() {
    let (calibration, truth) = usual(11);
    let place = PhantomPlace::Known(truth.world_from_phantom);
    let mut dice = Dice::new(1);
    let pictures = shots(&truth, |sighting| drawn(&mut dice, sighting));
    let options = CheckOptions::default();
    let ask = |calibration: &Calibration, shots: &Shots| {
        check_shots(shots, calibration, &truth.phantom, place, &options, &|_| {})
    };
    let same = ask(&calibration, &pictures).unwrap();
    println!("{} ({} of {})", same.words, same.labelled, same.images);
    assert_eq!((same.verdict, same.images), (Verdict::Holds, 40), "{}", same.words);
    assert!(same.labelled >= 38, "{:?}", same.refused);
    // A millimetre, and so far that no wire is where it is predicted.
    for by in [1e-3, 25e-3] {
        let slip = ask(&slipped(&calibration, &shift(Vector3::new(0.6, 0.0, 0.8) * by)), &pictures).unwrap();
        println!("{} ({} of {})", slip.words, slip.labelled, slip.images);
        assert_eq!(slip.verdict, Verdict::Moved, "{}", slip.words);
        let moved = slip.change.unwrap().shift_m.norm();
        assert!((moved - by).abs() < 0.3e-3, "{moved}");
    }
    let late = later(&calibration, -0.3);
    let found = ask(&Calibration { image_lag: late, ..calibration.clone() }, &pictures).unwrap();
    println!("{} ({} of {})", found.words, found.labelled, found.images);
    assert_eq!(found.verdict, Verdict::Moved, "{}", found.words);
    assert!((found.change.unwrap().lag_s.unwrap().0 - 0.3).abs() < 0.01);
    let dark: Arc<[u8]> = vec![0; SIZE.0 * SIZE.1].into();
    let nothing = ask(&calibration, &shots(&truth, |_| Arc::clone(&dark))).unwrap();
    println!("{}", nothing.words);
    assert_eq!((nothing.verdict, nothing.labelled), (Verdict::CannotTell, 0));
    let mut wide = calibration.clone();
    wide.setting.window_width_m *= 1.1;
    assert!(matches!(ask(&wide, &pictures), Err(CheckError::OtherSize { .. })));
}
