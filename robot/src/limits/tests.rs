use probepath_frames::Span;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;

/// A number from `low` to `high`.
fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Limits as arms have them, some tight, for two joints.
fn some_limits(rng: &mut ChaCha8Rng) -> MotionLimits {
    let mut limits = MotionLimits {
        lower: Joints::zeros(2),
        upper: Joints::zeros(2),
        velocity: Joints::zeros(2),
        acceleration: Joints::zeros(2),
        jerk: Joints::zeros(2),
    };
    for joint in 0..2 {
        limits.lower[joint] = between(rng, -6.3, -0.05);
        limits.upper[joint] = between(rng, 0.05, 6.3);
        limits.velocity[joint] = between(rng, 0.2, 3.5);
        limits.acceleration[joint] = between(rng, 1.0, 20.0);
        limits.jerk[joint] = between(rng, 30.0, 2000.0);
    }
    limits
}

/// The check that a reader of an exam makes, from the commanded positions alone.
fn check(limits: &MotionLimits, dt: f64, rows: &[Joints]) {
    for joint in 0..limits.joints() {
        let positions: Vec<f64> = rows.iter().map(|row| row[joint]).collect();
        for q in positions.windows(4) {
            let v = [(q[1] - q[0]) / dt, (q[2] - q[1]) / dt, (q[3] - q[2]) / dt];
            let a = [(v[1] - v[0]) / dt, (v[2] - v[1]) / dt];
            let j = (a[1] - a[0]) / dt;
            assert!(
                q[3] >= limits.lower[joint] - 1e-9 && q[3] <= limits.upper[joint] + 1e-9,
                "position {}",
                q[3]
            );
            assert!(v[2].abs() <= limits.velocity[joint] * (1.0 + 1e-9), "velocity {}", v[2]);
            assert!(a[1].abs() <= limits.acceleration[joint] * (1.0 + 1e-9), "acceleration {}", a[1]);
            assert!(j.abs() <= limits.jerk[joint] * (1.0 + 1e-9), "jerk {j} of {}", limits.jerk[joint]);
        }
    }
}

/// What a bad controller might ask for: jumps, ramps, noise, chatter.
fn some_command(rng: &mut ChaCha8Rng, kind: u32, now: f64) -> f64 {
    match kind {
        0 => between(rng, -8.0, 8.0),
        1 => now + between(rng, -0.02, 0.02),
        2 => now + 0.004,
        3 => now - 0.01,
        _ => {
            if rng.next_u32().is_multiple_of(2) {
                100.0
            } else {
                -100.0
            }
        }
    }
}

#[test]
fn a_hundred_thousand_random_commands_stay_within_every_limit_and_come_to_rest_within_them() {
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    for case in 0..1000 {
        let limits = some_limits(&mut rng);
        let period = Span::from_milliseconds([1, 2, 8][case % 3]);
        let start = limits.lower.zip(&limits.upper, |low, high| low + (high - low) * 0.4);
        let mut limiter = Limiter::at_rest(limits, period, start).unwrap();
        let mut rows = vec![start; 4];
        for _ in 0..10 {
            let kind = rng.next_u32() % 5;
            for _ in 0..10 {
                let mut wanted = *limiter.position();
                for joint in 0..2 {
                    wanted[joint] = some_command(&mut rng, kind, wanted[joint]);
                }
                rows.push(limiter.limit(&wanted).unwrap().position);
            }
        }
        let end = limiter.brakes_at();
        for _ in 0..10_000 {
            if limiter.is_at_rest() {
                break;
            }
            rows.push(limiter.brake());
        }
        assert!(limiter.is_at_rest(), "case {case} did not come to rest");
        assert!(limiter.position().zip(&end, |a, b| a - b).largest() < 1e-9);
        check(&limits, period.seconds(), &rows);
    }
}

#[test]
fn driving_at_a_wall_stops_at_the_wall() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for _ in 0..100 {
        let limits = some_limits(&mut rng);
        let period = Span::from_milliseconds(2);
        let mut limiter = Limiter::at_rest(limits, period, Joints::zeros(2)).unwrap();
        let mut rows = vec![Joints::zeros(2); 4];
        for _ in 0..40_000 {
            let wanted = limiter.position().map(|now| now + 1.0);
            rows.push(limiter.limit(&wanted).unwrap().position);
            if limits.upper.zip(limiter.position(), |wall, now| wall - now).largest() < 1e-6 {
                break;
            }
        }
        let short = limits.upper.zip(limiter.position(), |wall, now| wall - now);
        assert!(short.largest() < 1e-3, "stopped {short:?} short of the wall");
        check(&limits, period.seconds(), &rows);
    }
}

#[test]
fn a_command_within_the_limits_goes_through_to_the_bit() {
    let limits = some_limits(&mut ChaCha8Rng::seed_from_u64(22));
    let mut limiter = Limiter::at_rest(limits, Span::from_milliseconds(2), Joints::zeros(2)).unwrap();
    for tick in 0..5000 {
        let t = f64::from(tick) * 0.002;
        let wanted = Joints::splat(2, 0.02 * (1.0 - t.cos()).powi(3));
        let limited = limiter.limit(&wanted).unwrap();
        assert_eq!(limited.position, wanted);
        assert!(limited.changed <= 0.0);
    }
}

#[test]
fn a_command_that_is_not_finite_is_refused_and_forgotten() {
    let limits = some_limits(&mut ChaCha8Rng::seed_from_u64(23));
    let mut limiter = Limiter::at_rest(limits, Span::from_milliseconds(2), Joints::zeros(2)).unwrap();
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut wanted = Joints::zeros(2);
        wanted[1] = value;
        assert!(matches!(limiter.limit(&wanted), Err(LimitsError::NotFinite { joint: 1, .. })));
        assert!(limiter.is_at_rest());
    }
    assert!(matches!(limiter.limit(&Joints::zeros(3)), Err(LimitsError::Joints { found: 3, joints: 2 })));
}

#[test]
fn a_joint_found_outside_its_range_may_move_back_in() {
    let mut limits = some_limits(&mut ChaCha8Rng::seed_from_u64(24));
    limits.upper = Joints::splat(2, 0.5);
    let mut limiter = Limiter::at_rest(limits, Span::from_milliseconds(2), Joints::splat(2, 0.6)).unwrap();
    for _ in 0..100 {
        assert!(limiter.limit(&Joints::splat(2, 1.0)).unwrap().position.largest() <= 0.6 + 1e-12);
    }
    for _ in 0..1000 {
        let wanted = limiter.position().map(|now| now - 2e-4);
        limiter.limit(&wanted).unwrap();
    }
    assert!(limiter.position()[0] < 0.5 && limiter.position()[1] < 0.5);
}

#[test]
fn limits_that_cannot_be_kept_are_refused() {
    let good = some_limits(&mut ChaCha8Rng::seed_from_u64(25));
    let mut bad = good;
    bad.jerk[1] = f64::NAN;
    assert!(matches!(bad.check(), Err(LimitsError::Rate { joint: 1, what: "jerk", .. })));
    bad = good;
    bad.upper[0] = bad.lower[0];
    assert!(matches!(bad.check(), Err(LimitsError::Range { joint: 0, .. })));
    bad = good;
    bad.acceleration = Joints::splat(3, 1.0);
    assert!(matches!(bad.check(), Err(LimitsError::Joints { found: 3, joints: 2 })));
    assert!(matches!(Limiter::at_rest(good, Span::ZERO, Joints::zeros(2)), Err(LimitsError::Period { .. })));
}
