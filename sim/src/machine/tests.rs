use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use probepath_frames::{Pose, Probe, Span, Stamp};
use probepath_robot::{Arm, Command, InverseOptions};
use probepath_us_capture::{BScan, BScanSource, SourceFault};

use crate::*;

/// The phantom bench with little noise and a machine of `rate_hz`.
fn bench(rate_hz: f64, knobs: MachineKnobs) -> CellConfig {
    let mut config = CellConfig::phantom();
    config.machine.rate_hz = rate_hz;
    config.knobs.machine = knobs;
    config
}

/// Moves the cell on by `ticks`, polling each; gives what came, and the last fault.
fn watch(
    cell: &SimulatedCell,
    machine: &mut SimulatedMachine,
    ticks: u64,
) -> (Vec<BScan>, Option<SourceFault>) {
    let mut arm = cell.arm();
    let (mut bscans, mut fault) = (Vec::new(), None);
    for _ in 0..ticks {
        let now = arm.exchange(&Command::Stay).unwrap().stamp;
        match machine.poll(now) {
            Ok(bscan) => bscans.extend(bscan),
            Err(broken) => fault = Some(broken),
        }
    }
    (bscans, fault)
}

#[test]
fn bscans_come_evenly_in_time_numbered_and_late_by_the_latency() {
    let cell = SimulatedCell::new(&bench(50.0, MachineKnobs::default()), 1).unwrap();
    let (bscans, _) = watch(&cell, &mut cell.machine(), 250);
    assert!((21..=23).contains(&bscans.len()), "{}", bscans.len());
    for (i, bscan) in bscans.iter().enumerate() {
        assert_eq!((bscan.number, bscan.width(), bscan.height()), (i as u64, 640, 480));
        assert_eq!(bscan.arrived - bscan.formed, Span::from_milliseconds(60));
    }
    assert!(bscans.windows(2).all(|w| w[1].formed - w[0].formed == Span::from_milliseconds(20)));
}

#[test]
fn an_unknown_latency_shows_in_the_stamps_as_on_a_real_machine() {
    let knobs = MachineKnobs { unknown_latency_ms: 30.0, ..MachineKnobs::default() };
    let cell = SimulatedCell::new(&bench(50.0, knobs), 1).unwrap();
    let exact = SimulatedCell::new(&bench(50.0, MachineKnobs::default()), 1).unwrap();
    let (late, _) = watch(&cell, &mut cell.machine(), 100);
    let (right, _) = watch(&exact, &mut exact.machine(), 100);
    assert_eq!(late[0].formed - right[0].formed, Span::from_milliseconds(30));
    assert_eq!(cell.nominal().image_latency, Span::from_milliseconds(60));
    assert_eq!(cell.truth().image_latency(), Span::from_milliseconds(90));
}

#[test]
fn dropped_bscans_leave_gaps_in_the_numbers_whoever_polls() {
    let knobs = MachineKnobs { dropped: 0.3, ..MachineKnobs::default() };
    let cell = SimulatedCell::new(&bench(100.0, knobs), 1).unwrap();
    let mut other = cell.machine();
    let (bscans, _) = watch(&cell, &mut cell.machine(), 400);
    let last = bscans.last().unwrap().number;
    let lost = last + 1 - bscans.len() as u64;
    assert!((12..=34).contains(&lost), "{lost} of {last}");
    assert_eq!(other.waiting(cell.now()), bscans.len());
    assert_eq!(other.drop_until(cell.now()), bscans.len());
    assert_eq!(other.poll(cell.now()).unwrap().map(|b| b.number), None);
}

#[test]
fn a_stall_and_a_lost_connection_are_as_long_as_they_say() {
    let stall = Some(Interval { from_s: 0.1, lasts_s: 0.2 });
    let knobs = MachineKnobs { stall, connection_lost_at_s: Some(0.5), ..MachineKnobs::default() };
    let cell = SimulatedCell::new(&bench(50.0, knobs), 1).unwrap();
    let (bscans, fault) = watch(&cell, &mut cell.machine(), 300);
    let widest = bscans.windows(2).map(|w| (w[1].formed - w[0].formed).nanoseconds()).max().unwrap();
    assert!((200_000_000..=240_000_000).contains(&widest), "{widest}");
    assert!(bscans.last().unwrap().arrived < Stamp::ZERO + Span::from_milliseconds(500));
    assert!(matches!(fault, Some(SourceFault::ConnectionLost { .. })), "{fault:?}");
}

/// Presses the probe onto the middle of the phantom, and gives the machine's next B-scans.
fn pressed(config: &CellConfig, count: usize) -> Vec<BScan> {
    let cell = SimulatedCell::new(config, 2).unwrap();
    let Subject::Phantom(phantom) = cell.subject() else { panic!("a phantom") };
    let nominal = cell.nominal();
    let columns = [Vector3::x(), -Vector3::z(), Vector3::y()];
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
        Matrix3::from_columns(&columns),
    ));
    let place = Vector3::new(0.0, phantom.top_y() + 0.001, 0.0);
    // FRAMES: Probe x on World x, Probe z on World y (down).
    let probe = Pose::<probepath_frames::World, Probe>::assume(Isometry3::from_parts(place.into(), turn));
    let base = nominal.world_from_base.inverse() * probe;
    let tool = nominal.flange_from_probe;
    let to = nominal.model().inverse(&base, &tool, &nominal.start, &InverseOptions::default()).unwrap();
    let mut arm = cell.arm();
    for k in 1..=1000 {
        let at = nominal.start.zip(&to, |a, b| a + (b - a) * f64::from(k) / 1000.0);
        arm.exchange(&Command::Position(at)).unwrap();
    }
    let mut machine = cell.machine();
    let (mut now, mut bscans) = (cell.now(), Vec::new());
    while bscans.len() < count {
        bscans.extend(machine.poll(now).unwrap());
        now = arm.exchange(&Command::Position(to)).unwrap().stamp;
    }
    bscans
}

/// Mean grey of a patch of 40 x 40 pixels around a column and a row.
fn grey(bscan: &BScan, column: usize, row: usize) -> f64 {
    let patch = (row - 20..row + 20).flat_map(|r| (column - 20..column + 20).map(move |c| r * 640 + c));
    patch.map(|i| f64::from(bscan.pixels()[i])).sum::<f64>() / 1600.0
}

#[test]
fn the_picture_is_of_where_the_probe_truly_is() {
    let bscan = &pressed(&bench(25.0, MachineKnobs::default()), 1)[0];
    // The vessel's axis, 34 mm under the top, the probe pressed 1 mm in, the window from 16 mm down over 30 mm.
    let row = ((34.0 - 1.0 - 16.0) / 30.0 * 480.0) as usize;
    let (lumen, left, right) = (grey(bscan, 320, row), grey(bscan, 120, row), grey(bscan, 520, row));
    assert!(lumen < left - 30.0 && lumen < right - 30.0, "{lumen} {left} {right}");
}

#[test]
fn without_contact_there_is_no_picture() {
    let cell = SimulatedCell::new(&bench(50.0, MachineKnobs::default()), 1).unwrap();
    let air = &watch(&cell, &mut cell.machine(), 60).0[0];
    let skin = &pressed(&bench(50.0, MachineKnobs::default()), 1)[0];
    assert!(grey(air, 120, 240) < 0.5 * grey(skin, 120, 240));
}

#[test]
fn a_frozen_machine_shows_the_last_picture_again_with_new_numbers() {
    let frozen = Some(Interval { from_s: 2.10, lasts_s: 0.12 });
    let bscans = pressed(&bench(25.0, MachineKnobs { frozen, ..MachineKnobs::default() }), 8);
    let same: Vec<_> = bscans.windows(2).map(|w| w[0].pixels() == w[1].pixels()).collect();
    assert_eq!(same.iter().filter(|same| **same).count(), 3, "{same:?}");
    assert!(bscans.windows(2).all(|w| w[1].number == w[0].number + 1));
}

#[test]
fn the_same_seed_gives_the_same_pictures_however_they_are_polled() {
    let config = bench(50.0, MachineKnobs::default());
    let (a, b) = (pressed(&config, 3), pressed(&config, 3));
    assert_eq!(a, b);
}
