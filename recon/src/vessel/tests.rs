use nalgebra::Vector3;

use super::*;
use crate::phantom_contours::{BentVessel, Cut, numbered, shuffled};
use crate::phantom_images::Dice;
use crate::{ImageLumen, reconstruct_from};

/// Cuts along the whole vessel, unevenly spaced and tilted by up to 30 degrees, in an order of chance.
fn cuts(vessel: &BentVessel, spacing: f64, dice: &mut Dice) -> Vec<Cut> {
    let mut cuts = Vec::new();
    let mut at = 0.0;
    while at < vessel.length {
        let (tilt, way) = (0.52 * dice.uniform(), 6.3 * dice.uniform());
        cuts.push(Cut { at, tilt, way, off: Vector3::zeros() });
        at += spacing * (0.2 + 1.6 * dice.uniform());
    }
    shuffled(cuts.len(), dice).into_iter().map(|i| cuts[i]).collect()
}

/// A cut across the vessel.
fn straight(at: f64) -> Cut {
    Cut { at, tilt: 0.0, way: 0.0, off: Vector3::zeros() }
}

fn exact(vessel: &BentVessel, cuts: &[Cut]) -> Vec<Contour> {
    cuts.iter().map(|cut| vessel.contour(*cut, 32, |_| 0.0)).collect()
}

fn fitted(contours: &[Contour]) -> Result<Fitted, ReconError> {
    Ok(Fitted::to(&contours.iter().collect::<Vec<_>>())?.0)
}

/// Distances of the centreline's points from the true axis, 2 mm at either end left out (m).
fn off_axis(line: &Centreline, vessel: &BentVessel) -> Vec<f64> {
    let inner = line.points.iter().filter(|p| p.at_m > 2e-3 && p.at_m < line.length_m() - 2e-3);
    let near = |place: &Vector3<f64>| {
        let steps = 0..(vessel.length / 2e-3) as usize;
        let distance = |i: &usize| (vessel.axis(*i as f64 * 2e-3) - place).norm();
        steps.min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or(0.0, |i| i as f64 * 2e-3)
    };
    inner.map(|p| vessel.seen_from(&p.point.vector(), near(&p.point.vector())).1).collect()
}

#[test]
fn the_axis_of_vessels_bent_at_random_is_found_from_oblique_uneven_cuts_in_any_order() {
    let mut dice = Dice(21);
    for case in 0..200 {
        let turn = 2.4 * dice.uniform();
        let mut vessel =
            BentVessel::new(0.06 + 0.06 * dice.uniform(), 2e-3 + 2e-3 * dice.uniform(), turn, &mut dice);
        vessel.stenoses.push((0.03, 0.012 + 0.008 * dice.uniform(), 0.8 * dice.uniform()));
        let cuts = cuts(&vessel, 0.8e-3, &mut dice);
        let found = fitted(&exact(&vessel, &cuts)).expect("a vessel");
        let off = off_axis(&found.centreline, &vessel);
        let largest = off.iter().copied().fold(0.0, f64::max);
        assert!(largest < 0.05e-3, "{case}: {:.4} mm, turn {turn}", largest * 1e3);
        assert!((found.centreline.length_m() - vessel.length).abs() < 2e-3, "{case}");
    }
}

#[test]
fn poses_and_borders_that_scatter_leave_the_axis_within_a_tenth_of_a_millimetre() {
    let mut dice = Dice(23);
    for case in 0..30 {
        let vessel = BentVessel::new(0.1, 3.5e-3, 2.0 * dice.uniform(), &mut dice);
        let mut cuts = cuts(&vessel, 0.5e-3, &mut dice);
        for cut in &mut cuts {
            let ((a, b), (c, _)) = (dice.normal_pair(), dice.normal_pair());
            cut.off = Vector3::new(a, b, c) * 0.2e-3;
        }
        let noisy = cuts.iter().map(|cut| vessel.contour(*cut, 32, |_| 0.15e-3 * dice.normal_pair().0));
        let off = off_axis(&fitted(&noisy.collect::<Vec<_>>()).expect("a vessel").centreline, &vessel);
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        assert!(mean < 0.1e-3, "{case}: {:.3} mm", mean * 1e3);
    }
}

#[test]
fn the_order_of_the_images_changes_nothing() {
    let mut dice = Dice(22);
    for _ in 0..20 {
        let vessel = BentVessel::new(0.08, 3.5e-3, 2.0 * dice.uniform(), &mut dice);
        let cuts = cuts(&vessel, 1.0e-3, &mut dice);
        let noisy = cuts.iter().map(|cut| vessel.contour(*cut, 32, |_| 0.1e-3 * dice.normal_pair().0));
        let lumens: Vec<ImageLumen> = numbered(noisy.collect::<Vec<_>>());
        let settings = LumenSettings::default();
        let once = reconstruct_from(&[], lumens.clone(), &settings).expect("a vessel");
        let mixed = shuffled(lumens.len(), &mut dice).into_iter().map(|i| lumens[i].clone()).collect();
        let again = reconstruct_from(&[], mixed, &settings).expect("a vessel");
        assert_eq!(once.vessels, again.vessels);
        assert_eq!(once.warnings, again.warnings);
    }
}

#[test]
fn there_and_back_is_one_vessel_from_where_the_sweep_began() {
    let vessel = BentVessel::new(0.09, 3.5e-3, 1.8, &mut Dice(4));
    let there = (0..=60).map(|i| f64::from(i) * 1.5e-3);
    let cuts: Vec<Cut> = there.clone().chain(there.rev().map(|at| at - 0.4e-3)).map(straight).collect();
    let found = fitted(&exact(&vessel, &cuts)).expect("a vessel");
    assert!((found.centreline.length_m() - 0.09).abs() < 1e-3, "{}", found.centreline.length_m());
    assert!((found.centreline.points[0].point.vector() - vessel.axis(0.0)).norm() < 1e-3);
    assert!(found.warnings(4e-3).is_empty(), "{:?}", found.warnings(4e-3));
}

#[test]
fn sweeps_that_lie_apart_are_told_and_those_that_do_not_are_not() {
    let mut dice = Dice(5);
    for case in 0..20 {
        let vessel = BentVessel::new(0.08, 3.5e-3, 1.5 * dice.uniform(), &mut dice);
        let off = Vector3::new(dice.uniform() - 0.5, dice.uniform() - 0.5, dice.uniform() - 0.5);
        let off = off.normalize() * if case % 2 == 0 { 1.2e-3 } else { 0.2e-3 };
        let sweep =
            |from: f64, off| (0..50).map(move |i| Cut { off, ..straight(from + f64::from(i) * 1e-3) });
        let cuts: Vec<Cut> = sweep(0.0, Vector3::zeros()).chain(sweep(0.02, off)).collect();
        let noisy = cuts.iter().map(|cut| vessel.contour(*cut, 32, |_| 0.1e-3 * dice.normal_pair().0));
        let found = fitted(&noisy.collect::<Vec<_>>()).expect("a vessel");
        let told = found.warnings(4e-3).iter().find_map(|warning| match warning {
            ReconWarning::SweepsDisagree { by_mm, from_mm, to_mm } => Some((*by_mm, *from_mm, *to_mm)),
            _ => None,
        });
        // What lies along the vessel cannot be seen.
        let across = (0..=25).map(|i| {
            let at = 0.025 + f64::from(i) * 1e-3;
            let along = (vessel.axis(at + 1e-3) - vessel.axis(at - 1e-3)).normalize();
            (off - along * off.dot(&along)).norm() * 1e3
        });
        let across = across.sum::<f64>() / 26.0;
        match told {
            Some((by, from, to)) => {
                assert!(across > 0.4 && (by - off.norm() * 1e3).abs() < 0.6, "{case}: {by} of {across}");
                assert!((from - 20.0).abs() < 3.0 && (to - 50.0).abs() < 3.0, "{case}: {from} to {to}");
            }
            None => assert!(across < 0.8, "{case}: {across}"),
        }
    }
}

#[test]
fn contours_whose_pose_jumped_do_not_bend_the_vessel() {
    let vessel = BentVessel::new(0.08, 3.5e-3, 1.2, &mut Dice(6));
    let mut cuts: Vec<Cut> = (0..=100).map(|i| straight(f64::from(i) * 0.8e-3)).collect();
    cuts[30].off = Vector3::new(0.0, 0.02, 0.01);
    cuts[31].off = Vector3::new(0.0, 0.02, 0.01);
    cuts[60].off = Vector3::new(1.5e-3, 0.0, 1.0e-3);
    let lumens = numbered(exact(&vessel, &cuts));
    let found = reconstruct_from(&[], lumens, &LumenSettings::default()).expect("a vessel");
    assert_eq!(found.counts.without_lumen, 2, "{:?}", found.counts);
    let off = off_axis(&found.centreline, &vessel);
    assert!(off.iter().copied().fold(0.0, f64::max) < 0.2e-3);
}

/// The area found at a stenosis of 75 % beside the true one (%), mean of so many vessels.
fn bias_percent(length: f64, spacing: f64, noise: f64, vessels: u32) -> f64 {
    let mut dice = Dice(77);
    let mut one = || {
        let mut vessel = BentVessel::new(0.05, 3.935e-3, 0.6, &mut dice);
        vessel.stenoses.push((0.025, length, 0.75));
        let first = spacing * dice.uniform();
        let cuts = (0..(0.05 / spacing) as u32).map(|i| straight(first + f64::from(i) * spacing));
        let contours: Vec<Contour> = cuts
            .map(|cut| {
                let (size, _) = dice.normal_pair();
                vessel.contour(cut, 32, |_| noise * size)
            })
            .collect();
        let found = fitted(&contours).expect("a vessel");
        let near = (0..100).map(|i| 0.02 + f64::from(i) * 1e-4);
        let least = near.map(|at| found.tube.shape().area(at)).fold(f64::INFINITY, f64::min);
        let exact = std::f64::consts::PI * vessel.radius_at(0.025).powi(2);
        100.0 * (least / exact - 1.0)
    };
    (0..vessels).map(|_| one()).sum::<f64>() / f64::from(vessels)
}

#[test]
fn smoothing_widens_a_stenosis_by_no_more_than_the_surface_says() {
    // Length, spacing, the error of single contours (mm), vessels; the bound on the area (%).
    let bounds = [
        (5.0, 0.5, 0.0, 10, 1.0),
        (6.0, 0.5, 0.0, 10, 1.0),
        (8.0, 0.5, 0.0, 10, 0.5),
        (10.0, 1.0, 0.0, 10, 0.5),
        (15.0, 2.0, 0.0, 10, 1.5),
        (20.0, 0.5, 0.05, 40, 1.0),
    ];
    for (length, spacing, noise, vessels, bound) in bounds {
        let bias = bias_percent(length * 1e-3, spacing * 1e-3, noise * 1e-3, vessels);
        assert!(bias.abs() < bound, "{length} mm, an image each {spacing} mm: {bias:+.2} %");
    }
}

#[test]
fn poses_that_jump_to_another_place_leave_a_stretch_that_is_not_measured() {
    let vessel = BentVessel::new(0.08, 3.5e-3, 0.2, &mut Dice(9));
    let mut cuts: Vec<Cut> = (0..=100).map(|i| straight(f64::from(i) * 0.8e-3)).collect();
    let across = (vessel.axis(0.041) - vessel.axis(0.039)).normalize().cross(&Vector3::x()).normalize();
    cuts.iter_mut().skip(50).for_each(|cut| cut.off = across * 0.012);
    let found =
        reconstruct_from(&[], numbered(exact(&vessel, &cuts)), &LumenSettings::default()).expect("a vessel");
    assert!(
        found.warnings.iter().any(|warning| matches!(warning, ReconWarning::Gap { .. })),
        "{:?}",
        found.warnings
    );
    assert!(found.sections.iter().any(|section| section.measure.is_none()));
    assert!(found.closed_surface().scalars("area_mm2").is_some_and(|areas| areas.iter().any(|a| a.is_nan())));
}

#[test]
fn what_makes_no_vessel_is_an_error_that_says_why() {
    let vessel = BentVessel::new(0.08, 3.5e-3, 0.2, &mut Dice(10));
    let settings = LumenSettings::default();
    let make = |cuts: &[Cut]| reconstruct_from(&[], numbered(exact(&vessel, cuts)), &settings);
    assert!(matches!(make(&[straight(0.01)]), Err(ReconError::TooFew { seen: 1, images: 1, .. })));
    let same = vec![straight(0.01); 30];
    assert!(matches!(make(&same), Err(ReconError::NoLength { .. })));
    let everywhere: Vec<Cut> = (0..20)
        .map(|i| Cut { off: Vector3::new(f64::from(i % 5), f64::from(i / 5), 0.0), ..straight(0.01) })
        .collect();
    assert!(matches!(make(&everywhere), Err(ReconError::NoFit { .. })));
    let mut lost = numbered(exact(&vessel, &[straight(0.0), straight(1e-3), straight(2e-3), straight(3e-3)]));
    for image in &mut lost {
        let Ok(contour) = &mut image.lumen else { continue };
        contour.centre = probepath_frames::Point::new(f64::NAN, 0.0, 0.0);
    }
    assert!(reconstruct_from(&[], lost, &settings).is_err());
}
