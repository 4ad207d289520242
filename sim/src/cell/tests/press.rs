//! Pressing on the skin, through the arm.

use super::*;

/// Presses the probe straight down onto the phantom's flat top, `depth_mm` deep, and rests there; gives the mean
/// force along the probe's z that the sensor reads over a second.
fn pressed(config: &CellConfig, depth_mm: f64) -> (SimulatedCell, f64) {
    let cell = SimulatedCell::new(config, 2).unwrap();
    let Subject::Phantom(phantom) = cell.subject() else { panic!("a phantom") };
    let nominal = cell.nominal();
    let place = Vector3::new(0.0, phantom.top_y() + depth_mm * 1e-3, 0.0);
    let base = nominal.world_from_base.inverse() * over(place, -Vector3::y());
    let to = nominal
        .model()
        .inverse(&base, &nominal.flange_from_probe, &nominal.start, &InverseOptions::default())
        .unwrap();
    let mut arm = cell.arm();
    go(&mut arm, &nominal.start, &to, 1500);
    let read: f64 = (0..500).map(|_| arm.exchange(&Command::Position(to)).unwrap().wrench.force.z).sum();
    (cell, read / 500.0)
}

fn bench() -> CellConfig {
    CellConfig { skin: SkinConfig::even(1.5), arm: exact().arm, ..CellConfig::phantom() }
}

#[test]
fn a_static_press_reads_stiffness_times_depth_and_is_negative_along_z() {
    for depth_mm in [1.0, 2.0, 4.0] {
        let (cell, read) = pressed(&bench(), depth_mm);
        // Noise of 0.08 N over 500 readings, and at most 0.05 N/min of drift for 8 s.
        assert!((read + 1.5 * depth_mm).abs() < 0.02, "{depth_mm} mm: {read} N");
        let truth = cell.truth().now();
        assert!((truth.skin.force.z + 1.5 * depth_mm).abs() < 1e-3 && truth.hand.force.norm() < 1e-12);
    }
}

#[test]
fn the_world_feels_the_skin_push_up_and_the_table_far_away_does_not_push() {
    let (cell, _) = pressed(&bench(), 3.0);
    let moment = cell.truth().now();
    let in_world = moment.world_from_probe.isometry().rotation * moment.skin.force;
    assert!(in_world.y < -4.4 && in_world.x.abs() < 0.05 && in_world.z.abs() < 0.05, "{in_world}");
    assert!(cell.truth().moments()[0].skin.force.norm() < 1e-12);
}

#[test]
fn a_push_beyond_the_arms_own_limit_stops_it() {
    let config = CellConfig { arm: ArmConfig { stops_above_n: 3.0, ..bench().arm }, ..bench() };
    let cell = SimulatedCell::new(&config, 2).unwrap();
    let nominal = cell.nominal();
    let place = Vector3::new(0.0, 0.0, 0.0);
    let base = nominal.world_from_base.inverse() * over(place, -Vector3::y());
    let to = nominal
        .model()
        .inverse(&base, &nominal.flange_from_probe, &nominal.start, &InverseOptions::default())
        .unwrap();
    let mut arm = cell.arm();
    let fault = (0..3000).find_map(|k| {
        let at = nominal.start.zip(&to, |a, b| a + (b - a) * f64::from(k) / 3000.0);
        arm.exchange(&Command::Position(at)).err()
    });
    let Some(ArmFault::ProtectiveStop { why, .. }) = fault else { panic!("{fault:?}") };
    assert!(why.contains("it stops above 3 N"), "{why}");
}
