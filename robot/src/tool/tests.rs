use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Base, Direction, Pose, Probe, Span, Wrench};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;

fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn normal3(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| (0..12).map(|_| between(rng, 0.0, 1.0)).sum::<f64>() - 6.0)
}

fn vector(rng: &mut ChaCha8Rng, most: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| between(rng, -most, most))
}

fn down() -> Direction<Base> {
    Direction::z().reversed()
}

fn held(turn: Vector3<f64>) -> Pose<Base, Probe> {
    // FRAMES: a made-up probe, tilted about its own axes.
    Pose::assume(Isometry3::new(Vector3::new(0.4, 0.0, 0.3), turn))
}

fn tool(rng: &mut ChaCha8Rng) -> Tool {
    Tool {
        weight_n: between(rng, 3.0, 15.0),
        centre_m: vector(rng, 0.08),
        bias: Wrench::new(vector(rng, 5.0), vector(rng, 0.5)),
    }
}

const NOISE: (f64, f64) = (0.02, 0.001);

fn read(rng: &mut ChaCha8Rng, tool: &Tool, turn: Vector3<f64>) -> ToolReading {
    let base_from_probe = held(turn);
    let noise = Wrench::new(normal3(rng) * NOISE.0, normal3(rng) * NOISE.1);
    ToolReading { base_from_probe, wrench: tool.in_air(&base_from_probe, &down()) + noise }
}

#[test]
fn a_thousand_tools_are_found_within_their_standard_errors() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut squares, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
    for _ in 0..1000 {
        let truth = tool(&mut rng);
        let poses = 6 + (rng.next_u64() % 7) as usize;
        let readings: Vec<_> = (0..poses)
            .map(|_| {
                let turn = vector(&mut rng, 1.0);
                read(&mut rng, &truth, turn)
            })
            .collect();
        let Ok(fit) = identify(&readings, &down()) else { continue };
        let off = [
            (fit.tool.weight_n - truth.weight_n) / fit.weight_error_n,
            (fit.tool.centre_m.x - truth.centre_m.x) / fit.centre_error_m.x,
            (fit.tool.centre_m.z - truth.centre_m.z) / fit.centre_error_m.z,
            (fit.tool.bias.force.y - truth.bias.force.y) / fit.bias_error.force.y,
            (fit.tool.bias.torque.z - truth.bias.torque.z) / fit.bias_error.torque.z,
        ];
        squares += off.iter().map(|o| o * o).sum::<f64>();
        count += 5.0;
        worst = worst.max((fit.tool.weight_n - truth.weight_n).abs());
    }
    // Few poses have few degrees of freedom, so the spread is Student's, a little wider than one.
    let spread = f64::sqrt(squares / count);
    assert!(count > 4500.0 && (0.8..1.3).contains(&spread), "{spread} of {count}");
    assert!(worst < 0.3, "{worst} N");
}

#[test]
fn few_poses_and_poses_too_alike_are_refused_and_the_missing_tilt_is_named() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let truth = tool(&mut rng);
    let mut readings = |turns: &[[f64; 3]]| {
        turns.iter().map(|turn| read(&mut rng, &truth, Vector3::from(*turn))).collect::<Vec<_>>()
    };
    let five = readings(&[[0.3, 0.0, 0.0]; 5]);
    assert!(matches!(identify(&five, &down()), Err(ToolError::TooFew { given: 5, wanted: 6 })));
    let about_x = readings(&[
        [0.5, 0.0, 0.0],
        [-0.5, 0.0, 0.0],
        [0.2, 0.0, 0.0],
        [-0.2, 0.02, 0.0],
        [0.4, 0.0, 0.0],
        [0.0, 0.0, 0.0],
    ]);
    let refused = identify(&about_x, &down()).unwrap_err();
    assert!(matches!(refused, ToolError::Alike { axis: "y", .. }), "{refused}");
    assert!(refused.to_string().contains("tilted about its y"), "{refused}");
    let about_y =
        about_x.iter().enumerate().map(|(i, _)| [0.0, 0.2 * i as f64 - 0.5, 0.0]).collect::<Vec<_>>();
    let refused = identify(&readings(&about_y), &down()).unwrap_err();
    assert!(matches!(refused, ToolError::Alike { axis: "x", .. }), "{refused}");
    let none = readings(&[[0.1, 0.1, 0.0]; 6]);
    assert!(matches!(identify(&none, &down()), Err(ToolError::Alike { .. })));
}

#[test]
fn a_pose_that_was_touched_is_named_and_no_number_is_refused() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let truth = tool(&mut rng);
    let mut readings: Vec<_> = (0..9)
        .map(|i| {
            let turn = Vector3::new(0.6 * f64::sin(f64::from(i)), 0.6 * f64::cos(1.7 * f64::from(i)), 0.0);
            read(&mut rng, &truth, turn)
        })
        .collect();
    readings[4].wrench.force.z -= 3.0;
    assert!(matches!(identify(&readings, &down()), Err(ToolError::Outlier { pose: 4, .. })));
    readings[2].wrench.torque.x = f64::NAN;
    assert!(matches!(identify(&readings, &down()), Err(ToolError::NotFinite { pose: 2 })));
}

const PERIOD: Span = Span::from_milliseconds(2);

#[test]
fn drift_is_seen_in_the_air_and_zeroed_there() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let truth = tool(&mut rng);
    let mut watch = ZeroWatch::new(truth, down(), ZeroSettings::default(), PERIOD);
    let drift = Wrench::new(Vector3::new(0.1, 0.0, -0.4), Vector3::zeros());
    let mut air = Air::Settling;
    for _ in 0..400 {
        let reading = read(&mut rng, &truth, Vector3::new(0.2, 0.1, 0.0));
        air = watch.step(&(reading.wrench + drift), &reading.base_from_probe);
    }
    let Air::Free { drift_n, too_far: true } = air else { panic!("{air:?}") };
    assert!((drift_n - 0.412).abs() < 0.01, "{drift_n}");
    let zeroed = watch.zero().unwrap();
    assert!((zeroed.bias.force - truth.bias.force - drift.force).norm() < 0.01);
    assert!((zeroed.weight_n - truth.weight_n).abs() < 1e-12);
}

#[test]
fn no_zero_is_taken_on_the_skin_or_just_off_it_or_on_the_move() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let truth = tool(&mut rng);
    let mut watch = ZeroWatch::new(truth, down(), ZeroSettings::default(), PERIOD);
    let press = Wrench::new(Vector3::new(0.0, 0.0, -5.0), Vector3::zeros());
    let mut go = |watch: &mut ZeroWatch, height: f64, pressed: bool| {
        let reading = read(&mut rng, &truth, Vector3::zeros());
        // FRAMES: the same probe, lifted.
        let place =
            Pose::<Base, Base>::assume(Isometry3::translation(0.0, 0.0, height)) * reading.base_from_probe;
        let skin = if pressed { press } else { Wrench::zero() };
        watch.step(&(reading.wrench + skin), &place)
    };
    for _ in 0..400 {
        go(&mut watch, 0.0, true);
    }
    let refused = watch.zero().unwrap_err();
    assert!(refused.to_string().contains("lift it off"), "{refused}");
    // The skin lets go, and the probe stays where it was: a soft touch may be left.
    for _ in 0..400 {
        assert!(matches!(go(&mut watch, 0.002, false), Air::Touched { .. }));
    }
    assert!(watch.zero().is_err());
    for tick in 0..400 {
        assert!(!matches!(go(&mut watch, 0.01 + 1e-4 * f64::from(tick), false), Air::Free { .. }));
    }
    assert!(watch.zero().is_err());
    for _ in 0..400 {
        go(&mut watch, 0.05, false);
    }
    assert!(watch.zero().is_ok());
    let nan = Wrench::new(Vector3::repeat(f64::NAN), Vector3::zeros());
    assert!(matches!(watch.step(&nan, &held(Vector3::zeros())), Air::Touched { .. }));
    assert!(watch.zero().is_err());
}
