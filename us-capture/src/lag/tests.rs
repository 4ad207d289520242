//! Thousands of recordings with a known lag: what is found against what it is said to be worth.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Probe, Span, Stamp, Track, World};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// What disturbs a recording.
#[derive(Clone, Copy, Debug, Default)]
struct Disturbance {
    /// Noise of the line (px).
    line_px: f64,
    /// How much of it the next image shares.
    line_memory: f64,
    /// Noise of the images' stamps (s).
    jitter_s: f64,
    /// Noise of the poses (m).
    pose_m: f64,
    /// Part of the images that show another line.
    outliers: f64,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

fn vector(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(rng))
}

/// Frequency, phase, reach (m), turn (rad).
type Wave = (f64, f64, Vector3<f64>, Vector3<f64>);

/// A hand that bobs the probe: a few sines in directions of their own, a turn with them.
struct Hand(Vec<Wave>);

impl Hand {
    fn new(rng: &mut ChaCha8Rng) -> Self {
        let main = vector(rng).normalize();
        let wave = |rng: &mut ChaCha8Rng, share: f64| {
            let hertz = rng.random_range(0.15..1.2);
            let phase = rng.random_range(0.0..TAU);
            (hertz, phase, (main + 0.3 * vector(rng)) * 0.008 * share, vector(rng) * 0.02 * share)
        };
        Self([1.0, 0.6, 0.4, 0.3].map(|share| wave(rng, share)).to_vec())
    }

    fn at(&self, t: f64) -> Pose<World, Probe> {
        let sum = |part: fn(&Wave) -> Vector3<f64>| {
            self.0.iter().map(|w| part(w) * (TAU * w.0 * t + w.1).sin()).sum::<Vector3<f64>>()
        };
        // FRAMES: the motion that the test makes up.
        Pose::assume(Isometry3::new(sum(|w| w.2) + Vector3::new(0.1, 0.2, 0.3), sum(|w| w.3)))
    }
}

fn stamp(t: f64) -> Stamp {
    Stamp::from_nanoseconds((t * 1e9).round() as i64)
}

fn track(at: impl Fn(f64) -> Pose<World, Probe>, times: impl Iterator<Item = f64>) -> Track<World, Probe> {
    let mut track = Track::new(Span::from_milliseconds(300));
    for t in times {
        track.push(stamp(t), at(t)).unwrap();
    }
    track
}

/// Ten to twenty seconds of it: the images' samples, the poses, the true lag.
fn recording(rng: &mut ChaCha8Rng, d: Disturbance) -> (Vec<Sample>, Track<World, Probe>, f64) {
    let hand = Hand::new(rng);
    let lag = rng.random_range(-0.5..0.5);
    let length = rng.random_range(10.0..20.0);
    let pose_hz = rng.random_range(20.0..100.0);
    let noises: Vec<Vector3<f64>> =
        (0..(length * pose_hz) as usize + 1).map(|_| vector(rng) * d.pose_m).collect();
    let mut poses = Track::new(Span::from_milliseconds(300));
    for (i, noise) in noises.iter().enumerate() {
        let t = i as f64 / pose_hz;
        let mut moved = *hand.at(t).isometry();
        moved.translation.vector += noise;
        // FRAMES: the same pose with noise.
        poses.push(stamp(t + 100.0), Pose::assume(moved)).unwrap();
    }
    // The plane's distance along a beam, 10 000 pixels a metre, seen from a point 80 mm off the marker.
    let normal_of_plane = hand.0[0].2.normalize() + 0.3 * vector(rng);
    let seen_from = vector(rng).normalize() * 0.08;
    let image_hz = rng.random_range(8.0..25.0);
    let (mut samples, mut memory) = (Vec::new(), 0.0);
    for i in 0..((length - 1.2) * image_hz) as usize {
        let formed = 0.6 + i as f64 / image_hz;
        let pose = hand.at(formed);
        let from = pose.isometry().translation.vector + pose.isometry().rotation * seen_from;
        memory = d.line_memory * memory + (1.0 - d.line_memory.powi(2)).sqrt() * normal(rng);
        let mut position_px = 300.0 + 10_000.0 * normal_of_plane.dot(&from) + d.line_px * memory;
        if rng.random::<f64>() < d.outliers {
            position_px = rng.random_range(-1000.0..3000.0);
        }
        let shown = formed - lag + d.jitter_s * normal(rng);
        samples.push(Sample { stamp: stamp(shown + 100.0), position_px, sd_px: 0.3 });
    }
    (samples, poses, lag)
}

/// Mean square of error over stated standard error, the largest error (s), and how many were refused.
fn honesty(cases: u64, d: Disturbance) -> (f64, f64, f64) {
    let (mut squares, mut worst, mut count): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for seed in 0..cases {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (samples, poses, lag) = recording(&mut rng, d);
        let Ok(found) = lag_of(&samples, &poses, &LagOptions::default()) else { continue };
        let error = found.lag.seconds() - lag;
        squares += (error / found.standard_error_s).powi(2);
        worst = worst.max(error.abs());
        count += 1.0;
    }
    eprintln!(
        "{d:?}: normalised error variance {:.2}, worst {:.4} s, {} of {cases} answered",
        squares / count,
        worst,
        count
    );
    (squares / count, worst, 1.0 - count / cases as f64)
}

/// With 400 recordings each (2400, 26 s) the normalised error variances are 1.15, 0.73, 1.33, 1.28, 1.17 and 1.30, the
/// worst errors 7, 14, 12, 6, 8 and 13 ms, and 2385 are answered. A chi square of 100 is within 0.28 of its mean with
/// 95 %, and the bounds leave room for that.
#[test]
fn the_stated_error_is_the_true_one() {
    let clean = Disturbance { line_px: 1.0, ..Disturbance::default() };
    for d in [
        clean,
        Disturbance { line_memory: 0.8, ..clean },
        Disturbance { jitter_s: 0.008, ..clean },
        Disturbance { pose_m: 1e-4, ..clean },
        Disturbance { outliers: 0.1, ..clean },
        Disturbance { line_px: 3.0, line_memory: 0.6, jitter_s: 0.005, pose_m: 2e-4, outliers: 0.05 },
    ] {
        let (variance, worst, refused) = honesty(100, d);
        assert!((0.5..1.6).contains(&variance), "{d:?}: {variance}");
        assert!(worst < 0.05 && refused < 0.05, "{d:?}: worst {worst} s, {refused} refused");
    }
}

/// Images every 80 ms of a plane at `depth_m` under a probe that moves as it says, both on one clock.
fn plain(
    depth_m: impl Fn(f64) -> f64,
    poses: Track<World, Probe>,
    lag_s: f64,
) -> (Vec<Sample>, Track<World, Probe>) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let image = |i: i32| {
        let formed = 1.0 + f64::from(i) * 0.08;
        let position_px = 300.0 - 1e4 * depth_m(formed) + 0.3 * normal(&mut rng);
        Sample { stamp: stamp(formed - lag_s), position_px, sd_px: 0.3 }
    };
    ((0..150).map(image).collect(), poses)
}

fn up_and_down(depth_m: impl Fn(f64) -> f64, noise_m: f64) -> Track<World, Probe> {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let noise: Vec<f64> = (0..600).map(|_| noise_m * normal(&mut rng)).collect();
    let at = |t: f64| {
        let off = noise.get((t / 0.025).round() as usize).copied().unwrap_or_default();
        // FRAMES: the motion that the test makes up.
        Pose::assume(Isometry3::translation(0.0, 0.0, depth_m(t) + off))
    };
    track(at, (0..600).map(|i| f64::from(i) * 0.025))
}

fn refusal(depth_m: fn(f64) -> f64, noise_m: f64) -> NoLag {
    let (samples, poses) = plain(depth_m, up_and_down(depth_m, noise_m), 0.05);
    match lag_of(&samples, &poses, &LagOptions::default()) {
        Err(refused) => refused,
        Ok(found) => panic!("not refused: {found:?}"),
    }
}

#[test]
fn a_motion_that_tells_no_lag_is_refused() {
    let constant_speed = |t: f64| 0.002 * t;
    for noise_m in [0.0, 2e-5, 1e-4, 5e-4] {
        let refused = refusal(constant_speed, noise_m);
        let right = matches!(
            refused,
            NoLag::TooUniform { .. }
                | NoLag::TooUncertain { .. }
                | NoLag::AtTheEnd { .. }
                | NoLag::Ambiguous { .. }
        );
        assert!(right, "noise {noise_m}: {refused}");
    }
    assert!(matches!(
        refusal(|t| 1e-4 * (3.0 * t).sin(), 1e-5),
        NoLag::PlaneStill { .. } | NoLag::ProbeStill { .. }
    ));
    assert!(matches!(refusal(|t| 0.01 * (TAU * 1.25 * t).sin(), 1e-5), NoLag::Ambiguous { .. }));
}

#[test]
fn a_circle_at_constant_speed_tells_no_lag() {
    let depth = |t: f64| 0.01 * (2.0 * t).sin();
    // FRAMES: the motion that the test makes up.
    let round = |t: f64| Pose::assume(Isometry3::translation(0.01 * (2.0 * t).cos(), 0.0, depth(t)));
    let (samples, poses) = plain(depth, track(round, (0..600).map(|i| f64::from(i) * 0.025)), 0.05);
    let refused = lag_of(&samples, &poses, &LagOptions::default()).unwrap_err();
    eprintln!("{refused}");
    assert!(!matches!(refused, NoLag::Unrelated { .. } | NoLag::NoOverlap { .. }), "{refused}");
}

fn bob(t: f64) -> f64 {
    0.006 * (2.5 * t).sin() + 0.004 * (0.9 * t * t.sqrt()).sin()
}

#[test]
fn signals_that_do_not_belong_together_are_refused_with_the_reason() {
    let options = LagOptions::default();
    let (samples, poses) = plain(bob, up_and_down(bob, 1e-5), 0.05);
    lag_of(&samples, &poses, &options).unwrap();
    let refused = |samples: &[Sample], poses: &Track<World, Probe>, options: &LagOptions| {
        lag_of(samples, poses, options).unwrap_err()
    };
    assert!(matches!(refused(&samples[..12], &poses, &options), NoLag::TooFewImages { images: 12, .. }));
    let short = track(|t| poses.at(stamp(t)).unwrap(), (0..5).map(f64::from));
    assert!(matches!(refused(&samples, &short, &options), NoLag::TooFewPoses { poses: 5, .. }));
    let late: Vec<Sample> =
        samples.iter().map(|s| Sample { stamp: s.stamp + Span::from_milliseconds(60_000), ..*s }).collect();
    assert!(matches!(refused(&late, &poses, &options), NoLag::NoOverlap { .. }));
    let other = up_and_down(|t| 0.01 * (1.3 * t + 2.0 * (0.7 * t).sin()).sin(), 1e-5);
    assert!(matches!(refused(&samples, &other, &options), NoLag::Unrelated { .. }));
    let still = up_and_down(|_| 0.0, 1e-5);
    assert!(matches!(refused(&samples, &still, &options), NoLag::ProbeStill { .. }));
    let flat: Vec<Sample> = samples.iter().map(|s| Sample { position_px: 300.0, ..*s }).collect();
    assert!(matches!(refused(&flat, &poses, &options), NoLag::PlaneStill { .. }));
    let mut broken = samples.clone();
    broken[3].position_px = f64::NAN;
    assert!(matches!(refused(&broken, &poses, &options), NoLag::NotFinite { .. }));
    let narrow = LagOptions { most_lag: Span::from_milliseconds(30), ..options };
    assert!(matches!(refused(&samples, &poses, &narrow), NoLag::AtTheEnd { .. }));
    let strict = LagOptions { worst_standard_error_s: 1e-7, ..options };
    assert!(matches!(refused(&samples, &poses, &strict), NoLag::TooUncertain { .. }));
}

/// Interpolation averages the noise of two poses, so the residual alone is least half way between them.
#[test]
fn images_stamped_with_the_poses_are_not_pulled_between_them() {
    let errors: Vec<f64> = (0..60)
        .map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let noise: Vec<f64> = (0..400).map(|_| 4e-4 * normal(&mut rng)).collect();
            // FRAMES: the motion that the test makes up, with noise.
            let at = |t: f64| {
                Pose::assume(Isometry3::translation(0.0, 0.0, bob(t) + noise[(t / 0.08).round() as usize]))
            };
            let (samples, poses) = plain(bob, track(at, (0..200).map(|i| f64::from(i) * 0.08)), 0.0);
            lag_of(&samples, &poses, &LagOptions::default()).unwrap().lag.seconds()
        })
        .collect();
    let mean = errors.iter().sum::<f64>() / 60.0;
    let sd = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 59.0).sqrt();
    eprintln!("mean {mean:.5} s, sd {sd:.5} s");
    assert!(mean.abs() < 3.0 * sd / 60f64.sqrt() + 2e-4, "mean {mean} s, sd {sd} s");
}
