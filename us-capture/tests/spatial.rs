//! The whole calibration on drawn images whose truth is known: blobs where the image's plane cuts the wires, clutter,
//! noise, a lag, a tracker that errs.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

#[path = "support/calibration_truth.rs"]
mod calibration_truth;
#[path = "support/drawn.rs"]
mod drawn;

use std::sync::Arc;

use calibration_truth::Truth;
use drawn::{SIZE, options, shots, truth};
use probepath_frames::Span;
use probepath_us_capture::shots::{Shot, Shots};
use probepath_us_capture::spatial::{Spatial, SpatialError, SpatialOptions};

/// How far points of the image are from where they truly are, at most (m).
fn off_m(found: &Spatial, truth: &Truth) -> f64 {
    let corners = [(0.0, 0.0), (819.0, 0.0), (0.0, 615.0), (819.0, 615.0)];
    let off = |(u, v): (f64, f64)| {
        let ours = found.fit.probe_from_image * found.fit.spacing.point(u, v);
        ours.distance(&(truth.probe_from_image * truth.spacing.point(u, v)))
    };
    corners.map(off).into_iter().fold(0.0, f64::max)
}

#[test]
fn images_of_a_phantom_calibrate_by_themselves_within_their_standard_error() {
    for seed in 1..=6 {
        let (mut dice, truth) = truth(seed, 60);
        let shots = shots(&mut dice, &truth, 6);
        let found = Spatial::calibrate(&shots, &truth.phantom, &options(&mut dice, &truth), &|_| {}).unwrap();
        let promised = found.fit.uncertainty.standard_error_map(SIZE.0, SIZE.1);
        let off = off_m(&found, &truth);
        assert!(
            off < 4.0 * promised.p95_m() && off < 1e-3,
            "seed {seed}: {off}, promised {}",
            promised.p95_m()
        );
        let lag_s = found.fit.lag.seconds();
        assert!((lag_s - truth.lag_s).abs() < 4e-3, "seed {seed}: lag {lag_s} instead of {}", truth.lag_s);
        let wrong = wrong_labels(&found, &truth);
        assert_eq!(wrong, 0, "seed {seed}: dots with another wire's label");
        assert!(found.evaluation.labelled >= 55, "seed {seed}: {} labelled", found.evaluation.labelled);
    }
}

/// Labelled dots that are farther from where their wire was drawn than any noise puts them.
fn wrong_labels(found: &Spatial, truth: &Truth) -> usize {
    let wrong = |(image, seen): (usize, &probepath_us_capture::spatial::Seen)| {
        let Ok(labels) = &seen.labels else { return 0 };
        let drawn =
            |wire: usize| truth.sightings[image].dots.iter().find(|d| d.wire == wire).map(|d| d.at_px);
        let far = |(wire, dot): (usize, &Option<probepath_us_capture::dots::Dot>)| {
            let Some(dot) = dot else { return false };
            drawn(wire).is_none_or(|at| (at[0] - dot.at_px[0]).hypot(at[1] - dot.at_px[1]) > 12.0)
        };
        labels.dots.iter().enumerate().filter(|d| far(*d)).count()
    };
    found.seen.iter().enumerate().map(wrong).sum()
}

#[test]
fn a_phantom_that_stands_anywhere_is_found_from_the_wires_alone() {
    let (mut dice, truth) = truth(11, 60);
    let shots = shots(&mut dice, &truth, 4);
    let options = SpatialOptions { place: None, ..options(&mut dice, &truth) };
    let found = Spatial::calibrate(&shots, &truth.phantom, &options, &|_| {}).unwrap();
    assert!(off_m(&found, &truth) < 2e-3, "{}", off_m(&found, &truth));
}

#[test]
fn pixels_whose_size_nobody_knows_are_measured() {
    let (mut dice, truth) = truth(12, 60);
    let shots = shots(&mut dice, &truth, 4);
    let options = SpatialOptions { spacing: None, ..options(&mut dice, &truth) };
    let found = Spatial::calibrate(&shots, &truth.phantom, &options, &|_| {}).unwrap();
    assert!(off_m(&found, &truth) < 1e-3, "{}", off_m(&found, &truth));
}

#[test]
fn images_it_has_not_used_are_judged_with_the_same_labels() {
    let (mut dice, truth) = truth(13, 120);
    let all = shots(&mut dice, &truth, 4);
    let half = |from: usize| {
        let part = all.shots().chunks(30).skip(from).step_by(2).flatten().cloned().collect();
        Shots::new(SIZE, part, truth.track.clone()).unwrap()
    };
    let found = Spatial::calibrate(&half(0), &truth.phantom, &options(&mut dice, &truth), &|_| {}).unwrap();
    let held = found.evaluate(&half(1), &|_| {}).unwrap();
    assert!(held.evaluation.labelled >= 55 && held.evaluation.mid.count > 100);
    assert!(held.evaluation.mid.rms_m < 0.4e-3 && held.evaluation.line.rms_m < 0.3e-3);
}

#[test]
fn what_cannot_be_calibrated_is_refused_with_the_reason() {
    let (mut dice, truth) = truth(21, 12);
    let good = shots(&mut dice, &truth, 0);
    let options = options(&mut dice, &truth);
    let calibrate = |shots: &Shots| Spatial::calibrate(shots, &truth.phantom, &options, &|_| {}).unwrap_err();
    let nothing: Arc<[u8]> = vec![0_u8; SIZE.0 * SIZE.1].into();
    let dark = good.shots().iter().map(|s| Shot { pixels: Ok(nothing.clone()), ..s.clone() }).collect();
    let black = Shots::new(SIZE, dark, truth.track.clone()).unwrap();
    let SpatialError::TooFewImages { labelled: 0, refused, .. } = calibrate(&black) else {
        unreachable!("black images show no wire")
    };
    assert_eq!(refused.0.keys().collect::<Vec<_>>(), [&"no_dots"]);

    let still = truth.track.samples()[0].1;
    let mut track = probepath_frames::Track::new(Span::from_seconds(1.0));
    for (stamp, _) in truth.track.samples() {
        track.push(*stamp, still).unwrap();
    }
    let stood = Shots::new(SIZE, good.shots().to_vec(), track).unwrap();
    assert!(matches!(calibrate(&stood), SpatialError::StoodStill { .. }));

    let mut few = good.shots().to_vec();
    few.truncate(3);
    let few = Shots::new(SIZE, few, truth.track.clone()).unwrap();
    assert!(matches!(calibrate(&few), SpatialError::TooFewImages { images: 3, .. }));
}
