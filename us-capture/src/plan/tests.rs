use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use probepath_frames::Point;

use super::*;
use crate::PixelSpacing;
use crate::phantom::{Wire, ZFiducial};

/// `levels` rows of three Zs each, 15 mm wide, 60 mm long, 15 mm one under the other.
fn phantom(levels: usize) -> WirePhantom {
    let wire = |front: f64, back: f64, level: f64| Wire {
        name: format!("{front} to {back} at {level}"),
        front: Point::new(front, level, 0.0),
        back: Point::new(back, level, 0.06),
    };
    let step = 0.015;
    let row = |level: usize| {
        let side = move |i: usize| (i as f64 - 1.5) * step;
        let y = level as f64 * 0.015;
        let sides = (0..4).map(move |i| wire(side(i), side(i), y));
        sides.chain((0..3).map(move |i| wire(side(i), side(i + 1), y)))
    };
    let z = |level: usize, i: usize| ZFiducial {
        first: 7 * level + i,
        diagonal: 7 * level + 4 + i,
        last: 7 * level + i + 1,
    };
    WirePhantom {
        name: format!("{levels} levels"),
        wires: (0..levels).flat_map(row).collect(),
        zs: (0..levels).flat_map(|level| (0..3).map(move |i| z(level, i))).collect(),
        landmarks: Vec::new(),
    }
}

/// A bath somewhere on a table, the phantom turned in it, under a probe that looks down.
fn bench(phantom: &WirePhantom) -> Bench<'_> {
    let right_angle = std::f64::consts::FRAC_PI_2;
    Bench {
        phantom,
        // FRAMES: the test's phantom lies turned by 20 degrees about the vertical.
        world_from_phantom: Pose::assume(Isometry3::new(Vector3::new(0.1, -0.06, 0.2), Vector3::y() * 0.35)),
        // FRAMES: the test's image stands under the middle of the face, Image y along Probe z.
        probe_from_image: Pose::assume(Isometry3::new(
            Vector3::new(-0.02, 0.001, 0.0),
            Vector3::x() * right_angle,
        )),
        // FRAMES: the test's probe looks down, Probe z along World y.
        upright: Pose::assume(Isometry3::from_parts(
            Vector3::zeros().into(),
            UnitQuaternion::from_scaled_axis(Vector3::x() * -right_angle),
        )),
        setting: Setting {
            depth_m: 0.06,
            focus_m: 0.045,
            window_top_m: 0.0,
            window_height_m: 0.06,
            window_width_m: 0.04,
            spacing: PixelSpacing { x_m: 40e-3 / 640.0, y_m: 60e-3 / 480.0 },
        },
        size: (640, 480),
    }
}

/// Poses as bits, to be compared.
fn bits(poses: &[Pose<World, Probe>]) -> Vec<[u64; 16]> {
    let bits = |pose: &Pose<World, Probe>| {
        let mut all = [0; 16];
        let matrix = pose.isometry().to_homogeneous();
        all.iter_mut().zip(matrix.iter()).for_each(|(bits, x)| *bits = x.to_bits());
        all
    };
    poses.iter().map(bits).collect()
}

#[test]
fn every_pose_shows_enough_wires_keeps_clear_of_them_and_is_reachable() {
    let phantom = phantom(3);
    let bench = bench(&phantom);
    let options = VisitOptions::default();
    let reachable = |pose: &Pose<World, Probe>| pose.origin().vector().x < 0.105;
    let plan = VisitPlan::new(&bench, &options, reachable).unwrap();
    assert_eq!((plan.poses.len(), plan.held_out.len(), plan.sweeps.len()), (24, 12, 2));
    assert!(plan.refused.unreachable > 0, "{}", plan.refused);
    let ends = plan.sweeps.iter().flat_map(|sweep| [sweep.from, sweep.to]);
    let view = information::View::new(&bench, &options);
    for pose in plan.poses.iter().chain(&plan.held_out).copied().chain(ends) {
        assert!(view.wires(&pose).len() >= options.least_wires && reachable(&pose));
        for wire in &phantom.wires {
            let along = |share: f64| {
                let at = Point::from_vector(wire.front.vector() + wire.run() * share);
                pose.inverse() * (bench.world_from_phantom * at)
            };
            // Beneath the face, or beside it.
            let near = (0..=60).map(|i| along(f64::from(i) / 60.0)).filter(|at| {
                at.vector().x.abs() <= options.half_face_m[0] && at.vector().y.abs() <= options.half_face_m[1]
            });
            assert!(near.into_iter().all(|at| at.vector().z > 0.004), "{}", wire.name);
        }
    }
    let (poses, others) = (bits(&plan.poses), bits(&plan.held_out));
    assert!(others.iter().all(|other| !poses.contains(other)));
}

#[test]
fn the_same_question_gives_the_same_plan() {
    let phantom = phantom(2);
    let bench = bench(&phantom);
    let plan = || VisitPlan::new(&bench, &VisitOptions::default(), |_| true).unwrap();
    let (once, again) = (plan(), plan());
    assert_eq!(bits(&once.poses), bits(&again.poses));
    assert_eq!(bits(&once.held_out), bits(&again.held_out));
    assert_eq!(once.expected, again.expected);
}

#[test]
fn tilting_is_what_determines_the_calibration() {
    let phantom = phantom(2);
    let bench = bench(&phantom);
    let expected = |tilt_deg: f64, turn_deg: f64| {
        let options = VisitOptions {
            tilt_rad: f64::to_radians(tilt_deg),
            turn_rad: f64::to_radians(turn_deg),
            ..VisitOptions::default()
        };
        VisitPlan::new(&bench, &options, |_| true).unwrap().expected
    };
    let (upright, tilted) = (expected(1.0, 1.0), expected(18.0, 10.0));
    assert!(upright.point_mean_m > 3.0 * tilted.point_mean_m, "{upright}; {tilted}");
    assert!(tilted.point_mean_m < 0.2e-3 && tilted.point_p95_m > tilted.point_mean_m, "{tilted}");
}

#[test]
fn a_chosen_plan_promises_more_than_poses_picked_blindly() {
    let phantom = phantom(2);
    let bench = bench(&phantom);
    let options = VisitOptions { held_out: 0, ..VisitOptions::default() };
    let plan = VisitPlan::new(&bench, &options, |_| true).unwrap();
    let own = expected(&bench, &options, &plan.poses);
    let mut candidates = Candidates::new(&bench, &options, 6).unwrap();
    let all: Vec<usize> = candidates.free().collect();
    for start in 0..20 {
        let picked = (0..24).map(|i| all[(start * 31 + i * all.len() / 24) % all.len()]);
        let poses: Vec<_> = picked.filter_map(|i| candidates.pose(i)).collect();
        assert!(expected(&bench, &options, &poses).point_mean_m > own.point_mean_m);
    }
    assert!(candidates.take(all[0], &|_| true));
}

#[test]
fn the_lag_is_told_by_the_sweeps_and_by_nothing_at_rest() {
    let phantom = phantom(2);
    let bench = bench(&phantom);
    let plan = VisitPlan::new(&bench, &VisitOptions::default(), |_| true).unwrap();
    assert!(plan.expected.lag_s < 0.5e-3, "{}", plan.expected);
    assert!(expected(&bench, &VisitOptions::default(), &plan.poses).lag_s > 0.49);
}

#[test]
fn no_plan_says_what_became_of_the_poses() {
    let phantom = phantom(2);
    let mut bench = bench(&phantom);
    let refused = VisitPlan::new(&bench, &VisitOptions::default(), |_| false).unwrap_err();
    assert!(matches!(refused, NoPlan::TooFew { found: 0, wanted: 24, refused } if refused.unreachable > 100));
    let many = VisitOptions { least_wires: 50, fewest_wires: 50, ..VisitOptions::default() };
    let refused = VisitPlan::new(&bench, &many, |_| true).unwrap_err();
    assert!(refused.to_string().contains("too few wires"), "{refused}");
    let nan = VisitOptions { dot_sd_m: [f64::NAN, 1e-4], ..VisitOptions::default() };
    let refused = VisitPlan::new(&bench, &nan, |_| true).unwrap_err();
    assert!(matches!(refused, NoPlan::Option { field: "dot_sd_mm (along a row)", .. }), "{refused}");
    // FRAMES: the phantom stands on end, its wires along the beam.
    bench.world_from_phantom = Pose::assume(Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2));
    let refused = VisitPlan::new(&bench, &VisitOptions::default(), |_| true).unwrap_err();
    assert!(matches!(refused, NoPlan::NoDirection { .. }), "{refused}");
}
