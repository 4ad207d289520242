//! Every joint's limits, read back from the commanded positions by finite differences at the tick.

use nalgebra::SVector;
use proptest::prelude::*;

use super::super::spline::Spline;
use super::*;

const DT: f64 = 0.002;
const STEP: f64 = 0.0005;

fn limits(velocity: f64, acceleration: f64, jerk: f64) -> MotionLimits {
    let all = |value| Joints::splat(3, value);
    MotionLimits {
        lower: all(-10.0),
        upper: all(10.0),
        velocity: all(velocity),
        acceleration: all(acceleration),
        jerk: all(jerk),
    }
}

/// A made-up way of three joints over the path, as smooth as a taught one.
fn way(swing: f64, wave: f64) -> Spline<3> {
    let knots = (0..401).map(|i| {
        let s = STEP * f64::from(i);
        let phase = s * std::f64::consts::TAU / wave;
        SVector::from([2.0 * s, swing * phase.sin(), 0.5 * swing * (0.7 * phase).cos() - s])
    });
    Spline::through(STEP, knots.collect()).unwrap()
}

fn postures(way: &Spline<3>) -> Vec<Joints> {
    way.knots().iter().map(|k| Joints::from_slice(k.as_slice()).unwrap()).collect()
}

/// Largest velocity, acceleration and jerk of any joint, as fractions of its limits.
fn read_back(rows: &[SVector<f64, 3>], limits: &MotionLimits) -> [f64; 3] {
    let difference =
        |rows: &[SVector<f64, 3>]| rows.windows(2).map(|p| (p[1] - p[0]) / DT).collect::<Vec<_>>();
    let (v, a, j);
    (v, a, j) = {
        let v = difference(rows);
        let a = difference(&v);
        let j = difference(&a);
        (v, a, j)
    };
    let most =
        |rows: &[SVector<f64, 3>], limit: f64| rows.iter().fold(0.0_f64, |m, r| m.max(r.amax())) / limit;
    [most(&v, limits.velocity[0]), most(&a, limits.acceleration[0]), most(&j, limits.jerk[0])]
}

/// Drives the path with an operator's wishes; the commanded joints and the places.
fn drive(
    way: &Spline<3>,
    limits: &PathLimits,
    wish: impl Fn(usize) -> f64,
) -> (Vec<SVector<f64, 3>>, Vec<f64>) {
    let mut clock = PathClock::new(limits.clone());
    let (mut rows, mut places) = (vec![way.at(0.0)[0]; 4], vec![0.0]);
    for tick in 0..200_000 {
        let s = clock.step(wish(tick), DT);
        rows.push(way.at(s)[0]);
        places.push(s);
        if clock.has_arrived() {
            rows.extend([way.at(s)[0]; 4]);
            return (rows, places);
        }
    }
    panic!("did not arrive: {} of {}", clock.at(), limits.length());
}

/// Drives one made-up path with full speed, a third of it and pauses, changing at any tick, and looks at the limits.
fn drive_with_wishes(swing: f64, wave: f64, joints: &MotionLimits, wanted: PathSpeed, seed: usize) {
    let way = way(swing, wave);
    let limits = PathLimits::new(STEP, &postures(&way), joints, wanted).unwrap();
    let wish = |tick: usize| match ((tick / (50 + seed % 300)) * 7919 + seed) % 4 {
        0 => 0.0,
        1 => wanted.speed / 3.0,
        _ => wanted.speed,
    };
    let (rows, places) = drive(&way, &limits, wish);
    let [v, a, j] = read_back(&rows, joints);
    assert!(v.max(a).max(j) <= 1.0 + 1e-6, "velocity {v}, acceleration {a}, jerk {j}");
    assert!(places.windows(2).all(|p| p[1] >= p[0]), "it went back");
    let short = limits.length() - places[places.len() - 1];
    assert!(short < 0.05e-3, "it stopped {short} m before the end");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_joint_keeps_its_limits_whatever_the_operator_wishes(
        swing in 0.001..0.05f64, wave in 0.02..0.1f64, speed in 0.005..0.3f64,
        velocity in 0.05..1.0f64, acceleration in 0.3..5.0f64, jerk in 3.0..100.0f64,
        seed in 0..1000_usize,
    ) {
        let wanted = PathSpeed { speed, acceleration: 5.0, jerk: 100.0 };
        drive_with_wishes(swing, wave, &limits(velocity, acceleration, jerk), wanted, seed);
    }
}

#[test]
fn driven_hard_it_does_not_end_a_millimetre_short() {
    let wanted = PathSpeed { speed: 0.1045, acceleration: 5.0, jerk: 100.0 };
    drive_with_wishes(0.01177, 0.0981, &limits(0.4145, 4.77, 52.0), wanted, 429);
}

#[test]
fn a_straight_path_is_driven_at_the_wanted_speed_with_one_ramp_at_either_end() {
    let joints = limits(10.0, 100.0, 1000.0);
    let way = way(0.0, 0.1);
    let limits = PathLimits::new(STEP, &postures(&way), &joints, PathSpeed::gentle(0.01)).unwrap();
    let (_, places) = drive(&way, &limits, |_| 0.01);
    let seconds = places.len() as f64 * DT;
    assert!(limits.length() - places[places.len() - 1] < 0.05e-3);
    // 200 mm at 10 mm/s, and what the ramps lose: 2 x half of 0.1 s.
    assert!((seconds - 20.1).abs() < 0.04, "{seconds}");
    let cruising = places.windows(2).filter(|p| ((p[1] - p[0]) / DT - 0.01).abs() < 1e-5).count();
    assert!(cruising as f64 * DT > 19.6, "{cruising}");
}

#[test]
fn it_slows_down_for_a_bend_and_hurries_again_after_it() {
    let joints = limits(10.0, 2.0, 20.0);
    let bend = |s: f64| 0.004 * (-((s - 0.1) / 0.004).powi(2)).exp();
    let knots = (0..401).map(|i| SVector::from([bend(STEP * f64::from(i)), STEP * f64::from(i), 0.0]));
    let way = Spline::through(STEP, knots.collect()).unwrap();
    let wanted = PathSpeed { speed: 0.1, acceleration: 1.0, jerk: 10.0 };
    let limits = PathLimits::new(STEP, &postures(&way), &joints, wanted).unwrap();
    let (place, slowest) = limits.slowest();
    assert!((place - 0.1).abs() < 0.01 && slowest < 0.06, "{place} {slowest}");
    let (rows, places) = drive(&way, &limits, |_| 0.1);
    assert!(read_back(&rows, &joints).iter().all(|part| *part <= 1.0));
    let speed_at = |s: f64| {
        let i = places.iter().position(|p| *p >= s).unwrap();
        (places[i] - places[i - 1]) / DT
    };
    assert!(speed_at(0.05) > 0.099 && speed_at(0.16) > 0.099);
    assert!(speed_at(0.1) < 0.06);
}

#[test]
fn four_thousand_postures_are_timed_quickly_and_the_same_each_time() {
    let joints = limits(1.0, 5.0, 50.0);
    let way = way(0.01, 0.03);
    let postures: Vec<Joints> =
        (0..4000).map(|i| Joints::from_slice(way.at(5e-5 * f64::from(i))[0].as_slice()).unwrap()).collect();
    let time = || PathLimits::new(5e-5, &postures, &joints, PathSpeed::gentle(0.05)).unwrap();
    assert_eq!(time(), time());
}

#[test]
fn four_postures_are_enough_and_a_uniform_speed_needs_none() {
    let joints = limits(1.0, 5.0, 50.0);
    let some: Vec<Joints> = (0..4).map(|i| Joints::splat(3, 1e-3 * f64::from(i))).collect();
    let limits = PathLimits::new(STEP, &some, &joints, PathSpeed::gentle(0.01)).unwrap();
    assert!((limits.slowest().1 - 0.01).abs() < 1e-12);
    let mut clock =
        PathClock::new(PathLimits::uniform(2.0, PathSpeed { speed: 1.0, ..PathSpeed::gentle(1.0) }).unwrap());
    while !clock.has_arrived() {
        assert!(clock.step(1.0, DT) <= 2.0);
    }
    assert!(clock.at() > 1.99);
}

#[test]
fn numbers_that_cannot_be_are_refused() {
    let joints = limits(1.0, 5.0, 50.0);
    let some = vec![Joints::zeros(3); 5];
    let time =
        |step, postures: &[Joints], speed| PathLimits::new(step, postures, &joints, PathSpeed::gentle(speed));
    assert!(matches!(time(0.0, &some, 0.01), Err(TimingError::NotPositive { name: "step", .. })));
    assert!(matches!(time(STEP, &some, f64::NAN), Err(TimingError::NotPositive { name: "speed", .. })));
    assert_eq!(time(STEP, &some[..3], 0.01), Err(TimingError::TooFew { found: 3 }));
    let mut bad = some.clone();
    bad[2] = Joints::zeros(2);
    assert_eq!(time(STEP, &bad, 0.01), Err(TimingError::Posture { index: 2 }));
    bad[2] = Joints::splat(3, f64::NAN);
    assert_eq!(time(STEP, &bad, 0.01), Err(TimingError::Posture { index: 2 }));
}

#[test]
fn a_wish_that_is_no_number_is_a_pause() {
    let way = way(0.001, 0.1);
    let limits =
        PathLimits::new(STEP, &postures(&way), &limits(1.0, 5.0, 50.0), PathSpeed::gentle(0.01)).unwrap();
    let mut clock = PathClock::new(limits);
    for _ in 0..500 {
        clock.step(0.01, DT);
    }
    for _ in 0..500 {
        clock.step(f64::NAN, DT);
    }
    assert!(clock.is_at_rest() && !clock.has_arrived() && clock.at() > 0.005);
}

#[test]
fn a_speed_follows_a_wish_that_jumps_within_its_bounds_and_a_wish_that_is_no_number_is_rest() {
    let mut ramp = SpeedRamp::at_rest(0.8, 8.0);
    let wish = |tick: usize| if (tick / 130).is_multiple_of(2) { 0.1 } else { -0.1 };
    let speeds: Vec<f64> = (0..2000).map(|tick| ramp.step(wish(tick), DT)).collect();
    let rates: Vec<f64> = speeds.windows(2).map(|p| (p[1] - p[0]) / DT).collect();
    assert!(speeds.iter().all(|v| v.abs() <= 0.1 + 1e-12) && speeds.iter().any(|v| *v < -0.099));
    assert!(rates.iter().all(|a| a.abs() <= 0.8 + 1e-9));
    assert!(rates.windows(2).all(|p| (p[1] - p[0]).abs() / DT <= 8.0 + 1e-6));
    for _ in 0..500 {
        ramp.step(f64::NAN, DT);
    }
    assert!(ramp.step(f64::NAN, DT) == 0.0);
}
