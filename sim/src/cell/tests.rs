//! The cell as a whole.

mod guided;
mod press;
mod wires;

use nalgebra::Vector3;
use probepath_frames::{Pose, Probe, World};
use probepath_robot::{Arm, ArmFault, Command, InverseOptions, Joints, State, manipulability};

use crate::arm::error::mean_and_deviation;
use crate::skin::Surface;
use crate::*;

/// A cell without any error: what is told is what is.
fn exact() -> CellConfig {
    CellConfig {
        arm: ArmConfig {
            kinematic_error: KinematicError::Off,
            position_noise_rad: 0.0,
            velocity_noise_rad_s: 0.0,
            ..ArmConfig::default()
        },
        sensor: SensorConfig { force_noise_n: 0.0, torque_noise_n_m: 0.0, drift_n_min: 0.0, latency_ms: 0.0 },
        ..CellConfig::default()
    }
}

/// Tells the arm to go straight from where it is told to be to `to` in `ticks` ticks, then rest for 100 more.
fn go(arm: &mut SimulatedArm, from: &Joints, to: &Joints, ticks: u32) -> State {
    let mut state = None;
    for k in 1..=ticks + 100 {
        let fraction = f64::from(k.min(ticks)) / f64::from(ticks);
        let at = from.zip(to, |a, b| a + (b - a) * fraction);
        state = Some(arm.exchange(&Command::Position(at)).expect("it follows"));
    }
    state.expect("at least one tick")
}

#[test]
fn the_whole_path_over_the_leg_is_reached_far_from_singularities() {
    for (kind, side) in [
        (ArmKind::Ur5e, Side::Left),
        (ArmKind::Ur5e, Side::Right),
        (ArmKind::SevenJoint, Side::Left),
        (ArmKind::SevenJoint, Side::Right),
    ] {
        let mut config = exact();
        config.arm.kind = kind;
        config.subject = SubjectConfig::Leg(LegConfig { side, ..LegConfig::default() });
        let cell = SimulatedCell::new(&config, 3).unwrap();
        let Subject::Leg(leg) = cell.subject() else { panic!("a leg") };
        let nominal = cell.nominal();
        println!("{kind:?} {side:?} starts at {:.2?}", nominal.start);
        let (mut near, mut worst) = (nominal.start, f64::INFINITY);
        for step in 0..=50 {
            for turn_deg in [0.0, 15.0, 30.0] {
                let (skin, up) = leg.skin_at(-0.005 * f64::from(step), f64::to_radians(turn_deg));
                let probe = over(skin.moved(up, 0.02).vector(), up.vector());
                let base = nominal.world_from_base.inverse() * probe;
                let joints = nominal
                    .model()
                    .inverse(&base, &nominal.flange_from_probe, &near, &InverseOptions::default())
                    .unwrap_or_else(|e| panic!("{kind:?} {side:?} {step} {turn_deg}: {e}"));
                let jacobian = nominal.model().jacobian(&joints, &nominal.flange_from_probe);
                worst = worst.min(jacobian.smallest_singular_value());
                if turn_deg == 0.0 {
                    assert!(joints.zip(&near, |a, b| a - b).largest() < 0.6, "it jumps at {step}");
                    near = joints;
                }
            }
        }
        println!("{kind:?} {side:?}: smallest singular value {worst:.3}");
        assert!(worst > 0.08, "{kind:?} {side:?} {worst}");
    }
}

/// A probe at `place` that looks along `-up`, its array across the leg.
fn over(place: Vector3<f64>, up: Vector3<f64>) -> Pose<World, Probe> {
    use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion};
    let z = -up;
    let x = (-Vector3::z()).cross(&z).normalize();
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    // FRAMES: columns are Probe's axes in World.
    Pose::assume(Isometry3::from_parts(place.into(), UnitQuaternion::from_rotation_matrix(&axes)))
}

#[test]
fn the_paper_arm_is_as_accurate_as_the_paper_says() {
    for seed in 0..8 {
        let mut config = exact();
        config.arm.kinematic_error = KinematicError::Paper;
        // Some of these postures reach into the table; nobody lies on it.
        config.arm.stops_above_n = 1e4;
        let cell = SimulatedCell::new(&config, seed).unwrap();
        let mut arm = cell.arm();
        let mut stream = crate::random::Stream::new(seed, "postures of the test");
        let (mut from, mut errors, mut places) = (cell.nominal().start, Vec::new(), Vec::new());
        for _ in 0..60 {
            let mut to = cell.nominal().start;
            to.as_mut_slice().iter_mut().for_each(|q| *q += stream.uniform(-0.6, 0.6));
            go(&mut arm, &from, &to, 400);
            let (truth, model) = (cell.truth().now().world_from_probe, cell.nominal().world_from_probe(&to));
            errors.push(truth.origin().distance(&model.origin()));
            places.push((truth.origin(), model.origin()));
            from = to;
        }
        let (accuracy, _) = mean_and_deviation(&errors);
        let between: Vec<f64> = places
            .iter()
            .enumerate()
            .flat_map(|(i, a)| {
                places[..i].iter().map(move |b| (a.0.distance(&b.0) - a.1.distance(&b.1)).abs())
            })
            .collect();
        println!(
            "seed {seed}: accuracy {:.2} mm, inter-distance {:.2} mm",
            accuracy * 1e3,
            mean_and_deviation(&between).0 * 1e3
        );
        assert!((0.46e-3..=0.75e-3).contains(&accuracy), "{accuracy}");
    }
}

#[test]
fn a_posture_reached_from_any_side_repeats_as_the_figures_say() {
    for (error, expected) in [(KinematicError::Paper, 0.20e-3), (KinematicError::UrESeries, 0.03e-3)] {
        let mut config = exact();
        config.arm.kinematic_error = error;
        let cell = SimulatedCell::new(&config, 4).unwrap();
        let mut arm = cell.arm();
        let mut stream = crate::random::Stream::new(1, "sides");
        let home = cell.nominal().start;
        let mut from = home;
        let reached: Vec<_> = (0..60)
            .map(|_| {
                let mut away = home;
                away.as_mut_slice().iter_mut().for_each(|q| *q += stream.uniform(-0.1, 0.1));
                go(&mut arm, &from, &away, 60);
                go(&mut arm, &away, &home, 60);
                from = home;
                cell.truth().now().world_from_probe.origin().vector()
            })
            .collect();
        let middle = reached.iter().sum::<Vector3<f64>>() / reached.len() as f64;
        let distances: Vec<f64> = reached.iter().map(|p| (p - middle).norm()).collect();
        let (mean, deviation) = mean_and_deviation(&distances);
        let repeatability = mean + 3.0 * deviation;
        println!("{error:?}: repeatability {:.3} mm", repeatability * 1e3);
        assert!((repeatability / expected - 1.0).abs() < 0.35, "{repeatability}");
    }
}

#[test]
fn without_errors_the_probe_is_where_the_model_says() {
    let cell = SimulatedCell::new(&exact(), 4).unwrap();
    let to = cell.nominal().start.map(|q| q + 0.1);
    let state = go(&mut cell.arm(), &cell.nominal().start, &to, 200);
    let (metres, angle) =
        cell.truth().now().world_from_probe.distance(&cell.nominal().world_from_probe(&state.position));
    assert!(metres < 1e-9 && angle < 1e-8, "{metres} {angle}");
    assert!(state.position.zip(&to, |a, b| a - b).largest() < 1e-6);
}

#[test]
fn what_is_no_command_is_refused_and_the_next_one_is_taken() {
    let cell = SimulatedCell::new(&exact(), 1).unwrap();
    let mut arm = cell.arm();
    let start = cell.nominal().start;
    let mut nan = start;
    nan[2] = f64::NAN;
    let refused = arm.exchange(&Command::Position(nan)).unwrap_err();
    assert!(matches!(&refused, ArmFault::Refused { why, .. } if why.contains("joint 2")), "{refused}");
    assert!(matches!(arm.exchange(&Command::Position(Joints::zeros(5))), Err(ArmFault::Refused { .. })));
    assert!(arm.exchange(&Command::Position(start)).is_ok());
    let jump = arm.exchange(&Command::Position(start.map(|q| q + 0.1)));
    assert!(matches!(jump, Err(ArmFault::ProtectiveStop { .. })), "{jump:?}");
    assert!(matches!(arm.exchange(&Command::Stay), Err(ArmFault::ProtectiveStop { .. })));
    assert!(cell.arm().exchange(&Command::Stay).is_ok(), "a new connection goes on");
}

#[test]
fn an_arm_that_is_told_to_stay_brakes_to_rest() {
    let cell = SimulatedCell::new(&exact(), 1).unwrap();
    let mut arm = cell.arm();
    let mut to = cell.nominal().start;
    for _ in 0..200 {
        to[0] += 0.0008;
        arm.exchange(&Command::Position(to)).unwrap();
    }
    let mut speeds = vec![0.4];
    for _ in 0..150 {
        speeds.push(arm.exchange(&Command::Stay).unwrap().velocity[0]);
    }
    assert!(speeds.windows(2).all(|w| (w[1] - w[0]).abs() < 0.017), "it jerks");
    assert!(speeds[150].abs() < 1e-9);
}

#[test]
fn each_knob_of_the_arm_fails_as_it_says() {
    let mut config = exact();
    config.knobs.arm.connection_lost_at_tick = Some(5);
    let cell = SimulatedCell::new(&config, 1).unwrap();
    let mut arm = cell.arm();
    let outcomes: Vec<_> = (0..7).map(|_| arm.exchange(&Command::Stay)).collect();
    assert!(outcomes[..4].iter().all(Result::is_ok));
    assert!(
        outcomes[4..].iter().all(|o| matches!(o, Err(ArmFault::ConnectionLost { tick: 5, .. }))),
        "{outcomes:?}"
    );
    assert!(cell.arm().exchange(&Command::Stay).is_ok());

    let mut config = exact();
    config.knobs.arm.protective_stop_at_tick = Some(3);
    let mut arm = SimulatedCell::new(&config, 1).unwrap().arm();
    assert!(arm.exchange(&Command::Stay).is_ok() && arm.exchange(&Command::Stay).is_ok());
    assert!(matches!(arm.exchange(&Command::Stay), Err(ArmFault::ProtectiveStop { tick: 3, .. })));

    let mut config = exact();
    config.knobs.arm.skipped = Some(Ticks { from_tick: 4, count: 3 });
    config.knobs.arm.wrench_not_a_number = Some(Ticks { from_tick: 9, count: 1 });
    let mut arm = SimulatedCell::new(&config, 1).unwrap().arm();
    let states: Vec<_> = (0..8).map(|_| arm.exchange(&Command::Stay).unwrap()).collect();
    let ticks: Vec<_> = states.iter().map(|s| s.tick).collect();
    assert_eq!(ticks, [1, 2, 3, 7, 8, 9, 10, 11]);
    let finite: Vec<_> = states.iter().map(|s| s.wrench.is_finite()).collect();
    assert_eq!(finite, [true, true, true, true, true, false, true, true]);
    assert_eq!(states[3].stamp - states[2].stamp, probepath_frames::Span::from_milliseconds(8));
}

#[test]
fn a_configuration_that_nothing_can_have_is_refused_by_name() {
    let mut config = exact();
    config.machine.rate_hz = f64::NAN;
    let error = SimulatedCell::new(&config, 1).unwrap_err().to_string();
    assert!(error.contains("machine.rate_hz") && error.contains("NaN"), "{error}");
}

#[test]
fn the_surface_that_the_skin_lies_on_is_the_subjects() {
    let cell = SimulatedCell::new(&CellConfig::phantom(), 1).unwrap();
    let Subject::Phantom(phantom) = cell.subject() else { panic!("a phantom") };
    let above = probepath_frames::Point::new(0.0, phantom.top_y() - 0.01, 0.0);
    assert!((cell.subject().surface(above).0 - 0.01).abs() < 1e-12);
    assert!(
        manipulability(
            &cell.nominal().model().jacobian(&cell.nominal().start, &cell.nominal().flange_from_probe)
        ) > 0.01
    );
}

#[test]
fn a_configuration_goes_to_a_file_and_back() {
    for config in [CellConfig::default(), CellConfig::phantom(), CellConfig::wire_phantom()] {
        let text = toml::to_string(&config).unwrap();
        assert_eq!(toml::from_str::<CellConfig>(&text).unwrap(), config);
    }
}

#[test]
fn a_short_file_is_enough_and_a_wrong_word_is_refused() {
    let text = "[arm]\nkind = \"seven_joint\"\nkinematic_error = \"paper\"\n[machine]\nwindow = \"whole\"\n\
                [knobs.machine]\nstall = { from_s = 3.0, lasts_s = 0.5 }\n";
    let config: CellConfig = toml::from_str(text).unwrap();
    assert_eq!(config.arm.kinematic_error, KinematicError::Paper);
    assert_eq!((config.machine.window, config.arm.kind), (Window::Whole, ArmKind::SevenJoint));
    let wrong = toml::from_str::<CellConfig>("[machine]\nrate = 25.0\n").unwrap_err().to_string();
    assert!(wrong.contains("rate_hz"), "{wrong}");
}
