//! A thousand moves from rest to rest, as long as those of PyPI's ruckig: `tests/golden/moves.json`, made by
//! `tests/golden/make_moves.py`.

#![allow(clippy::unwrap_used, reason = "a test's own helpers may stop at the first surprise")]

use probepath_frames::Span;
use probepath_robot::motion::PointToPoint;
use probepath_robot::{Joints, MotionLimits};

/// The same generator as in the script: Knuth's MMIX, the upper 53 bits.
struct Generator(u64);

impl Generator {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn some(&mut self, low: f64, high: f64) -> Joints {
        let mut joints = Joints::zeros(6);
        joints.as_mut_slice().iter_mut().for_each(|value| *value = self.between(low, high));
        joints
    }
}

#[test]
fn a_thousand_moves_take_as_long_as_those_of_ruckig() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/moves.json");
    let golden: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let durations = golden["durations_s"].as_array().unwrap();
    assert_eq!(durations.len(), 1000);
    let mut made = Generator(2026);
    for (case, duration) in durations.iter().enumerate() {
        let (start, target) = (made.some(-3.0, 3.0), made.some(-3.0, 3.0));
        let limits = MotionLimits {
            lower: Joints::splat(6, -4.0),
            upper: Joints::splat(6, 4.0),
            velocity: made.some(0.3, 3.2),
            acceleration: made.some(1.0, 15.0),
            jerk: made.some(30.0, 1000.0),
        };
        let plan = PointToPoint::plan(&start, &target, &limits, Span::from_milliseconds(2)).unwrap();
        let ratio = plan.duration_s() / duration.as_f64().unwrap();
        // Ours is planned with 0.9999 of every rate.
        assert!((0.99999..1.0002).contains(&ratio), "case {case}: {ratio}");
    }
}
