//! Pivot calibration.

use nalgebra::{DMatrix, DVector, Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Flange, Pose, World};

use super::dice::Dice;
use crate::pointer::{PointerError, pivot};

/// Postures about any first one, tilted by up to so much to all sides, whose tip is at `place`, off by `sd_m` an axis.
fn postures(
    dice: &mut Dice,
    count: usize,
    tilt_deg: f64,
    tip: Vector3<f64>,
    sd_m: f64,
) -> (Vec<Pose<World, Flange>>, Vector3<f64>) {
    let (first, place) = (dice.pose().rotation, dice.normal3(0.3));
    let poses = (0..count).map(|_| {
        let tilt = tilt_deg.to_radians();
        let turn =
            Vector3::new(dice.between(-tilt, tilt), dice.between(-tilt, tilt), dice.between(-tilt, tilt));
        let rotation = first * UnitQuaternion::from_scaled_axis(turn);
        let at = place - rotation * tip + dice.normal3(sd_m);
        // FRAMES: a posture made so that the tip is at the place.
        Pose::assume(Isometry3::from_parts(Translation3::from(at), rotation))
    });
    (poses.collect(), place)
}

#[test]
fn a_tip_is_found_exactly_from_exact_postures() {
    let mut dice = Dice::new(1);
    for case in 0..2000 {
        let tip = dice.normal3(0.15);
        let (count, tilt) = (4 + dice.below(30), dice.between(25.0, 90.0));
        let (poses, place) = postures(&mut dice, count, tilt, tip, 0.0);
        match pivot(&poses) {
            Ok(found) => {
                assert!((found.pointer.tip.vector() - tip).norm() < 1e-9, "case {case}");
                assert!((found.place.vector() - place).norm() < 1e-9 && found.rms_m < 1e-9, "case {case}");
                assert_eq!((found.used, found.left_out.len()), (count, 0));
            }
            // Four postures may turn little by chance.
            Err(error) => {
                assert!(matches!(error, PointerError::TurnedTooLittle { .. }) && count < 8, "{error}")
            }
        }
    }
}

#[test]
fn the_tip_is_that_of_the_full_least_squares() {
    let mut dice = Dice::new(2);
    for case in 0..1000 {
        let (tip, count) = (dice.normal3(0.15), 8 + dice.below(40));
        let (poses, _) = postures(&mut dice, count, 40.0, tip, 3e-4);
        let found = pivot(&poses).expect("a tip");
        if !found.left_out.is_empty() {
            continue;
        }
        // R_i tip - place = -p_i, all six unknowns together, by singular values.
        let mut a = DMatrix::zeros(3 * count, 6);
        let mut b = DVector::zeros(3 * count);
        for (i, pose) in poses.iter().enumerate() {
            let rotation = pose.isometry().rotation.to_rotation_matrix();
            a.view_mut((3 * i, 0), (3, 3)).copy_from(rotation.matrix());
            a.view_mut((3 * i, 3), (3, 3)).copy_from(&-nalgebra::Matrix3::identity());
            b.rows_mut(3 * i, 3).copy_from(&-pose.isometry().translation.vector);
        }
        let x = a.clone().svd(true, true).solve(&b, 1e-12).expect("a solution");
        let both = [found.pointer.tip.vector(), found.place.vector()];
        assert!(
            (x.rows(0, 3) - both[0]).norm() < 1e-9 && (x.rows(3, 3) - both[1]).norm() < 1e-9,
            "case {case}"
        );
        let variance = (&a * &x - &b).norm_squared() / (3 * count - 6) as f64;
        let covariance = (a.transpose() * a).try_inverse().expect("full rank") * variance;
        let off = (covariance.view((0, 0), (3, 3)) - found.pointer.covariance_m2).abs().max();
        assert!(off < 1e-9 * found.pointer.covariance_m2.max(), "case {case}: {off}");
    }
}

#[test]
fn the_stated_covariance_is_the_true_one() {
    // With the variance estimated from 3 N - 6 numbers, error' covariance^-1 error / 3 follows F(3, 3 N - 6), whose
    // mean is (3 N - 6) / (3 N - 8).
    let mut dice = Dice::new(3);
    for count in [6, 10, 50] {
        let (mut sum, mut within, mut cases) = (0.0, 0, 0);
        for _ in 0..3000 {
            let tip = dice.normal3(0.15);
            let (poses, _) = postures(&mut dice, count, 35.0, tip, 3e-4);
            let Ok(found) = pivot(&poses) else { continue };
            let error = found.pointer.tip.vector() - tip;
            let inverse = found.pointer.covariance_m2.try_inverse().expect("full rank");
            let squared = (error.transpose() * inverse * error)[0];
            sum += squared / 3.0;
            within += usize::from(squared < 7.815);
            cases += 1;
        }
        let freedom = (3 * count - 6) as f64;
        let mean = sum / f64::from(cases) * (freedom - 2.0) / freedom;
        assert!((mean - 1.0).abs() < 0.12, "{count} postures: {mean}");
        assert!(cases > 2800, "{cases}");
        if count == 50 {
            // By then it is chi squared: 95 % below 7.815.
            let part = within as f64 / f64::from(cases);
            assert!((part - 0.945).abs() < 0.02, "{part}");
        }
    }
}

#[test]
fn a_posture_in_which_the_ball_slipped_is_left_out() {
    let mut dice = Dice::new(4);
    for case in 0..500 {
        let (tip, count) = (dice.normal3(0.15), 12 + dice.below(20));
        let (mut poses, _) = postures(&mut dice, count, 40.0, tip, 2e-4);
        let bad = dice.below(count);
        let slip = Isometry3::from_parts(
            Translation3::from(dice.normal3(1.0).normalize() * 0.01),
            UnitQuaternion::identity(),
        );
        // FRAMES: the same posture, 10 mm beside.
        poses[bad] = Pose::assume(slip * poses[bad].isometry());
        let found = pivot(&poses).expect("a tip");
        assert!(found.left_out.contains(&bad), "case {case}: {:?}", found.left_out);
        assert!((found.pointer.tip.vector() - tip).norm() < 2e-3, "case {case}");
    }
}

#[test]
fn postures_that_turn_too_little_are_refused_with_the_angle() {
    let mut dice = Dice::new(5);
    for tilt in [0.0, 1.0, 3.0, 5.0] {
        let (poses, _) = postures(&mut dice, 30, tilt, Vector3::new(0.0, 0.0, 0.15), 2e-4);
        let error = pivot(&poses).expect_err("refused");
        let PointerError::TurnedTooLittle { swing_deg, widest_deg, .. } = error else { panic!("{error}") };
        assert!(swing_deg < 5.0 && widest_deg < 3.5 * tilt + 1e-6, "{error}");
        assert!(error.to_string().contains("tilt the pointer by 20 degrees"), "{error}");
    }
    // All about one axis, however far: what is along it never shows.
    let about_z = (0..20).map(|i| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * (0.3 * f64::from(i)));
        // FRAMES: a pointer that is only spun about its own axis.
        Pose::<World, Flange>::assume(Isometry3::from_parts(Translation3::identity(), turn))
    });
    let error = pivot(&about_z.collect::<Vec<_>>()).expect_err("refused");
    let PointerError::TurnedTooLittle { direction, swing_deg, widest_deg, .. } = error else {
        panic!("{error}")
    };
    assert!(direction[2].abs() > 0.999 && swing_deg < 1e-3 && widest_deg > 170.0);
}

#[test]
fn a_ball_that_wanders_is_refused_and_so_are_too_few_postures_and_nan() {
    let mut dice = Dice::new(6);
    let (poses, _) = postures(&mut dice, 30, 40.0, Vector3::new(0.0, 0.0, 0.15), 5e-3);
    assert!(matches!(pivot(&poses), Err(PointerError::Slipped { of: 30, .. })));
    let few = PointerError::TooFewPostures { found: 3, least: 4 };
    assert_eq!(pivot(&poses[..3]), Err(few));
    let mut broken = poses;
    // FRAMES: no posture at all.
    broken[7] = Pose::assume(Isometry3::translation(f64::NAN, 0.0, 0.0));
    assert_eq!(pivot(&broken), Err(PointerError::NotFinite { what: "posture 8".into() }));
}
