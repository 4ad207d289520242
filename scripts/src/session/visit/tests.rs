use std::sync::Arc;

use probepath_robot::Operator;

use super::*;
use crate::protocol::Protocol;
use crate::session::{CellFile, Opening};

fn session(cell: CellFile, name: &str) -> Session {
    let out = std::env::temp_dir().join(format!("probepath-visit-{name}-{}", std::process::id()));
    Session::open(Opening {
        cell,
        seed: 1,
        out,
        protocol: Protocol { name: "test".into(), text: String::new() },
        date: None,
        operator: Operator::new(),
        progress: Arc::new(()),
    })
    .unwrap()
}

/// Few poses, so that it is quick.
const FEW: VisitOptions =
    VisitOptions { poses: 10, held_out: 4, clearance_m: 12e-3, ..VisitOptions::DEFAULT };

#[test]
fn the_arm_calibrates_by_itself_better_than_half_a_millimetre_and_checks_elsewhere() {
    let mut session = session(CellFile::wire_phantom(), "calibrates");
    let located = session.phantom_as_measured().unwrap();
    let plan = session.plan_calibration(&located, &FEW).unwrap();
    let images = session.visit(&plan.stops, &VisitWish::default()).unwrap();
    let others = session.visit(&plan.others, &VisitWish::default()).unwrap();
    // Three images at each pose; the track covers every one, and the probe was never faster than it may be.
    assert!((10..=12).contains(&others.shots.shots().len()), "{}", others.shots.shots().len());
    let samples = images.shots.track().samples();
    let speeds = samples.windows(10).map(|w| w[0].1.origin().distance(&w[9].1.origin()) / 0.018);
    assert!(speeds.fold(0.0, f64::max) < 0.055);
    let calibrated = session.calibrate(&images, &Default::default()).unwrap();
    let calibrated = session.check_calibration(&calibrated, &others).unwrap();
    let (truth, found) = (session.calibration_error(&calibrated).unwrap(), calibrated.found());
    assert!(truth.mean_mm < 0.25 && truth.p95_mm < 0.5 && truth.in_tissue_mean_mm < 0.25, "{truth:?}");
    assert!(truth.lag_ms.abs() < 2.0, "{truth:?}");
    assert!(found.labelled == found.images && found.mid_rms_mm < 0.47, "{found}");
    session.save_calibration(&calibrated, "calibration.toml").unwrap();
    let stored = probepath_us_capture::Calibration::read(&session.file("calibration.toml")).unwrap();
    assert!(stored.error.held_out && stored.check_setting(&images.setting).is_ok());
    used_for_tissue(&session, &stored);
    session.close().unwrap();
    let exam = probepath_us_capture::exam::Exam::open(&session.exam_path()).unwrap();
    assert!(exam.ticks.iter().any(|tick| tick.phase == "sweep"));
    std::fs::remove_dir_all(&session.opening.out).unwrap();
}

/// The leg's cell with the bench's machine and holder names the calibration, scans with it, and it is near the truth.
fn used_for_tissue(bench: &Session, stored: &probepath_us_capture::Calibration) {
    let machine = bench.cell.file.simulated.machine.clone();
    let simulated = probepath_sim::CellConfig { machine, ..Default::default() };
    let calibration = Some("calibration.toml".into());
    let text = CellFile { calibration, simulated, ..CellFile::default() }.text().unwrap();
    let path = bench.file("leg.toml");
    std::fs::write(&path, text).unwrap();
    let leg = session(CellFile::read(&path).unwrap(), "leg");
    assert_eq!(leg.cell.calibration.as_ref(), Some(stored));
    let truth = leg.truth().unwrap().probe_from_image(&stored.setting);
    let at = |u, v| stored.setting.spacing.point(u, v);
    for (u, v) in [(0.0, 0.0), (300.0, 300.0)] {
        let off_m = (stored.probe_from_image * at(u, v)).distance(&(truth * at(u, v)));
        assert!(off_m < 0.5e-3, "({u}, {v}) is {off_m} m off");
    }
    std::fs::remove_dir_all(&leg.opening.out).unwrap();
}

#[test]
fn a_cell_without_a_phantom_says_so_and_a_visit_too_fast_is_refused() {
    let mut session = session(CellFile::default(), "none");
    assert!(matches!(session.phantom_as_measured(), Err(SessionError::NoPhantom)));
    let fast = VisitWish { speed_m_s: 0.2, ..VisitWish::default() };
    assert!(fast.check().unwrap_err().to_string().contains("between 1 and 50 mm/s"));
    std::fs::remove_dir_all(&session.opening.out).unwrap();
}

#[test]
fn landmarks_touched_find_the_phantom_better_than_a_tape_measure() {
    let mut session = session(CellFile::wire_phantom(), "touches");
    let measured = session.phantom_as_measured().unwrap();
    let touched = session.phantom_by_touch(10).unwrap();
    let truth = session.truth().unwrap().world_from_phantom().unwrap();
    let off = |located: &Located| {
        let wires = located.phantom.wires.iter();
        let away =
            wires.map(|wire| (located.world_from_phantom * wire.front).distance(&(truth * wire.front)));
        away.fold(0.0, f64::max)
    };
    assert!(off(&measured) > 1.5e-3, "{}", off(&measured));
    assert!(off(&touched) < 4.0 * touched.sd_m, "{} m, said {} m", off(&touched), touched.sd_m);
    assert!(touched.sd_m < 1e-3);
    std::fs::remove_dir_all(&session.opening.out).unwrap();
}
