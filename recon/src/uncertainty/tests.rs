//! The intervals against scans whose errors were drawn, and the derivatives against errors that were made.

use rayon::prelude::*;

use super::*;
use crate::phantom_images::Dice;
use crate::phantom_scans::{Sweep, Vessel, Wrong};
use crate::{LumenReconstruction, LumenSettings, reconstruct_from};

/// A vessel of random size and bend with two stenoses.
fn vessel(dice: &mut Dice) -> Vessel {
    let mut within = |low: f64, high: f64| low + (high - low) * dice.uniform();
    Vessel {
        radius: within(2.8, 4.2),
        stenoses: vec![
            (within(26.0, 30.0), within(14.0, 22.0), within(0.5, 0.85)),
            (within(62.0, 66.0), within(14.0, 22.0), within(0.5, 0.85)),
        ],
        bend: within(0.0, 1.0 / 120.0),
    }
}

/// Errors as of a scan with a fitted calibration.
fn budget() -> ErrorBudget {
    let mut budget = ErrorBudget { border_sd_m: 0.05e-3, ..ErrorBudget::default() };
    let sd = [4e-3, 4e-3, 4e-3, 0.15e-3, 0.15e-3, 0.25e-3, 4e-3, 4e-3, 2e-3, 3e-3];
    budget.calibration =
        std::array::from_fn(|i| std::array::from_fn(|k| if i == k { sd[i] * sd[i] } else { 0.0 }));
    // The fit of a calibration leaves turn and shift bound to one another.
    for (i, k, r) in [(0, 5, -0.7), (1, 3, 0.5), (6, 3, -0.4)] {
        budget.calibration[i][k] = r * sd[i] * sd[k];
        budget.calibration[k][i] = budget.calibration[i][k];
    }
    budget
}

fn sweep(dice: &mut Dice) -> Sweep {
    Sweep {
        tilt: 0.4 * dice.uniform(),
        toward: std::f64::consts::TAU * dice.uniform(),
        budget: budget(),
        ..Sweep::default()
    }
}

fn reconstructed(vessel: &Vessel, sweep: &Sweep, wrong: &Wrong, dice: &mut Dice) -> LumenReconstruction {
    let (images, lumens) = sweep.scan(vessel, wrong, dice);
    let settings = LumenSettings { errors: sweep.budget.clone(), ..LumenSettings::default() };
    reconstruct_from(&images, lumens, &settings).expect("a lumen")
}

/// Sections held by their intervals, sections; the same for stenoses' percent area.
fn coverage(seed: u64) -> [f64; 4] {
    let mut dice = Dice(seed);
    let (vessel, sweep) = (vessel(&mut dice), sweep(&mut dice));
    let wrong = sweep.draw(&mut dice);
    let found = reconstructed(&vessel, &sweep, &wrong, &mut dice);
    let mut counts = [0.0; 4];
    for section in &found.sections {
        let Some(measure) = section.measure else { continue };
        let [low, high] = measure.area_interval_mm2;
        let at = vessel.nearest(&(section.centre.vector() * 1e3), sweep.from + section.at_mm);
        let truth = vessel.area_at(at);
        counts[0] += f64::from(u8::from((low..=high).contains(&truth)));
        counts[1] += 1.0;
    }
    for &(at, _, part) in &vessel.stenoses {
        let near = found.stenoses.iter().find(|stenosis| (stenosis.at_mm - at).abs() < 4.0);
        let held = near.is_some_and(|stenosis| {
            let [low, high] = stenosis.percent_area_interval;
            (low..=high).contains(&(100.0 * part))
        });
        counts[2] += f64::from(u8::from(held));
        counts[3] += 1.0;
    }
    counts
}

#[test]
fn the_intervals_hold_the_truth_as_often_as_they_say() {
    let counts: Vec<[f64; 4]> = (1..=120_u64).into_par_iter().map(coverage).collect();
    let sum = |k: usize| counts.iter().map(|c| c[k]).sum::<f64>();
    let (areas, stenoses) = (sum(0) / sum(1), sum(2) / sum(3));
    assert!((0.93..=0.97).contains(&areas), "{areas}");
    assert!((0.92..=0.98).contains(&stenoses), "{stenoses}");
}

#[test]
fn what_an_error_of_the_calibration_does_to_an_area_is_what_its_derivative_says() {
    (0..3_u64).into_par_iter().for_each(|case| {
        let mut dice = Dice(100 + case);
        let vessel = Vessel { stenoses: Vec::new(), ..vessel(&mut dice) };
        let quiet = ErrorBudget { pose_sd_m: 0.0, pose_sd_rad: 0.0, ..budget() };
        let sweep = Sweep { speckle_mm: 1e-3, budget: quiet, ..sweep(&mut dice) };
        for k in 0..PARAMETERS {
            let step = [2e-3, 2e-3, 2e-3, 2e-4, 2e-4, 2e-4, 2e-3, 2e-3, 2e-3, 2e-3][k];
            let moved = |step: f64| {
                let mut wrong = Wrong::default();
                wrong.parameters[k] = step;
                reconstructed(&vessel, &sweep, &wrong, &mut Dice(7))
            };
            let (plus, minus) = (moved(step), moved(-step));
            let (images, lumens) = sweep.scan(&vessel, &Wrong::default(), &mut Dice(7));
            let pairs = images.iter().zip(&lumens);
            let shown: Vec<Shown<'_>> =
                pairs.map(|(image, lumen)| Shown { image, contour: lumen.lumen.as_ref().ok() }).collect();
            let stations = stations(&shown, &moved(0.0).centreline);
            for at in [20_usize, 50, 90, 130, 160] {
                let area =
                    |found: &LumenReconstruction| found.sections[at].measure.expect("measured").area_mm2;
                let brute = (area(&plus) / area(&minus)).ln() / (2.0 * step);
                let ours = Near::of(&stations, 0.5 * at as f64).expect("stations").mean(|s| s.relative)[k];
                // Per unit of a parameter; the areas' own smoothing leaves some tenths of a percent over the steps.
                let within = 0.04 * ours.abs() + [0.03, 0.03, 0.03, 0.6, 0.6, 0.6, 0.03, 0.03, 0.03, 0.03][k];
                assert!((brute - ours).abs() < within, "case {case}, parameter {k}, {at}: {brute} {ours}");
            }
        }
    });
}
