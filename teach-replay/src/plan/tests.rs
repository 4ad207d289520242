//! Plans that are possible, and plans that are refused with place and reason.

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Base, Direction, Point, Pose};
use probepath_robot::{Plane, Workspace};

use super::*;
use crate::replay::plant::{arm, home, path};
use crate::{Label, PathPoint, Side};

#[test]
fn a_path_within_reach_is_planned_and_says_how_close_it_came() {
    let plan = Plan::new(&path(), &arm(), &home(), &PlanSettings::default()).unwrap();
    let report = plan.report();
    assert!(report.least_singular.0 > 0.02 && report.least_margin.0 > 0.1, "{report:?}");
    assert!((report.path_s - 15.0).abs() < 0.2 && report.approach_s > 1.0, "{report:?}");
    assert!((report.slowest.1 - 0.01).abs() < 1e-12);
}

/// The path moved in the base.
fn moved(by: Vector3<f64>, turn: Vector3<f64>) -> Path {
    let path = path();
    let label = Label { study: "S-003".into(), side: Side::Left, date: "2026-11-22".into() };
    let moving = Isometry3::new(by, turn);
    let points = path.points().iter().map(|p| PathPoint {
        // FRAMES: the made-up probe, elsewhere in the base.
        base_from_probe: Pose::assume(moving * p.base_from_probe.isometry()),
        ..*p
    });
    Path::new(label, path.spacing(), points.collect(), None).unwrap()
}

fn refused(path: &Path, settings: &PlanSettings) -> PlanError {
    Plan::new(path, &arm(), &home(), settings).map(|plan| *plan.report()).unwrap_err()
}

#[test]
fn a_path_out_of_reach_is_refused_at_the_place_where_it_leaves_it() {
    let far = refused(&moved(Vector3::new(0.9, 0.0, 0.0), Vector3::zeros()), &PlanSettings::default());
    assert_eq!(far.place, Place::Standoff);
    assert!(matches!(far.refusal, Refusal::Unreachable(_)), "{far}");
    // Radially outward at the edge of what is reached: its beginning is within, its end is not.
    let turn = Vector3::new(0.0, 0.0, -std::f64::consts::FRAC_PI_2);
    let edge = refused(&moved(Vector3::new(0.70, 0.62, 0.0), turn), &PlanSettings::default());
    let Place::Path { at_mm, .. } = edge.place else { panic!("{edge}") };
    assert!(at_mm > 1.0 && at_mm < 150.0, "{edge}");
}

#[test]
fn a_path_through_the_table_is_refused_with_the_plane() {
    let table = Plane { through: Point::<Base>::new(0.0, 0.0, 0.115), inward: Direction::z() };
    let settings = PlanSettings { workspace: Workspace::new().and(table), ..PlanSettings::default() };
    let why = refused(&path(), &settings);
    assert!(matches!(why.refusal, Refusal::Workspace { plane: 0, .. }), "{why}");
    assert!(why.to_string().contains("mm along the path"), "{why}");
}

#[test]
fn a_path_near_a_joint_limit_or_a_singularity_is_refused_with_the_number() {
    let mut arm = arm();
    let plan = Plan::new(&path(), &arm, &home(), &PlanSettings::default()).unwrap();
    let margin = plan.report().least_margin.0;
    let settings = PlanSettings { joint_margin: margin + 0.01, ..PlanSettings::default() };
    let why = refused(&path(), &settings);
    assert!(matches!(why.refusal, Refusal::JointLimit { .. }), "{why}");
    let settings = PlanSettings { least_singular: 0.9, ..PlanSettings::default() };
    assert!(matches!(refused(&path(), &settings).refusal, Refusal::Singular { .. }));
    arm.limits.jerk[2] = f64::NAN;
    let why = Plan::new(&path(), &arm, &home(), &PlanSettings::default()).unwrap_err();
    assert!(matches!(why.refusal, Refusal::Limits(_)), "{why}");
}

#[test]
fn settings_that_cannot_be_are_refused_by_name() {
    for settings in [
        PlanSettings { standoff: f64::NAN, ..PlanSettings::default() },
        PlanSettings { air_speed: 3.0, ..PlanSettings::default() },
        PlanSettings { share: 0.0, ..PlanSettings::default() },
        PlanSettings { joint_margin: -1.0, ..PlanSettings::default() },
    ] {
        assert!(matches!(refused(&path(), &settings).refusal, Refusal::Setting { .. }));
    }
    let fast = PlanSettings { speed: PathSpeed::gentle(f64::INFINITY), ..PlanSettings::default() };
    assert!(matches!(refused(&path(), &fast).refusal, Refusal::Timing(_)));
}
