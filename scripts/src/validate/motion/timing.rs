//! Timing along a path: how long 4,000 taught points take, and how near the motion is to the fastest there is.

use std::f64::consts::TAU;

use probepath_robot::motion::timing::{PathLimits, PathSpeed};
use probepath_robot::{Joints, MotionLimits};
use serde::Deserialize;

use crate::validate::Goal;

/// Problems whose optimum IPOPT found on a fine grid: `tests/golden/make_timing.py`.
const OPTIMA: &str = include_str!("../../../../tests/golden/timing.json");
/// A taught path has a point every 0.5 mm.
const STEP_M: f64 = 0.0005;
const POINTS: usize = 4000;
/// Points of a problem, and how often a timing is timed; the median counts.
const POSTURES: usize = 401;
const TIMES: usize = 5;

/// Both figures' rows.
pub(super) fn rows() -> Vec<Goal> {
    let ratios: Vec<f64> = optima().iter().map(Problem::over_the_optimum).collect();
    let scan = PathSpeed::gentle(0.02);
    let alone = PathSpeed { speed: 2.0, acceleration: 50.0, jerk: 2000.0 };
    vec![
        Goal::of("timed path: duration over the fine-grid optimum's", &ratios, Some(1.02), None),
        Goal::of(
            "timing of 4,000 taught points, scan at 20 mm/s, ms of a processor",
            &[took_ms(scan)],
            Some(50.0),
            None,
        ),
        Goal::of(
            "timing of 4,000 taught points, joints' limits alone, ms of a processor",
            &[took_ms(alone)],
            Some(50.0),
            None,
        ),
    ]
}

/// A path of made-up joints and its optimum.
#[derive(Deserialize)]
struct Problem {
    length: f64,
    speed: [f64; 3],
    velocity: f64,
    acceleration: f64,
    jerk: f64,
    joints: Vec<Sway>,
    duration_s: f64,
}

/// A joint over the path.
#[derive(Deserialize)]
struct Sway {
    slope: f64,
    terms: Vec<Term>,
}

#[derive(Deserialize)]
struct Term {
    swing: f64,
    wave: f64,
    phase: f64,
}

#[derive(Deserialize)]
struct Optima {
    problems: Vec<Problem>,
}

/// None where the file is not what it was: a row without values keeps no bound.
fn optima() -> Vec<Problem> {
    serde_json::from_str::<Optima>(OPTIMA).map(|optima| optima.problems).unwrap_or_default()
}

impl Sway {
    fn at(&self, s: f64) -> f64 {
        let term = |term: &Term| term.swing * (TAU / term.wave * s + term.phase).sin();
        self.slope * s + self.terms.iter().map(term).sum::<f64>()
    }
}

impl Problem {
    /// Our duration as a share of the optimum's; what has no timing has no number.
    fn over_the_optimum(&self) -> f64 {
        let step = self.length / (POSTURES - 1) as f64;
        let postures: Vec<Joints> = (0..POSTURES).map(|i| along(&self.joints, step * i as f64)).collect();
        let limits = limits(self.joints.len(), [self.velocity, self.acceleration, self.jerk]);
        let [speed, acceleration, jerk] = self.speed;
        let timed = PathLimits::new(step, &postures, &limits, PathSpeed { speed, acceleration, jerk });
        timed.map_or(f64::NAN, |timed| timed.duration_s() / self.duration_s)
    }
}

fn along(joints: &[Sway], s: f64) -> Joints {
    let mut at = Joints::zeros(joints.len());
    for (joint, sway) in joints.iter().enumerate() {
        at[joint] = sway.at(s);
    }
    at
}

fn limits(joints: usize, [velocity, acceleration, jerk]: [f64; 3]) -> MotionLimits {
    let all = |value| Joints::splat(joints, value);
    MotionLimits {
        lower: all(-10.0),
        upper: all(10.0),
        velocity: all(velocity),
        acceleration: all(acceleration),
        jerk: all(jerk),
    }
}

/// Six joints that sway as those of an arm along a leg: slope (rad/m), swing (rad), wave (m).
const SWAYS: [[f64; 3]; 6] = [
    [1.2, 0.05, 0.31],
    [-0.9, 0.04, 0.23],
    [1.5, 0.06, 0.41],
    [0.4, 0.08, 0.17],
    [-1.1, 0.03, 0.13],
    [0.7, 0.1, 0.53],
];

/// How long the timing of 4,000 points of six joints takes a processor of this computer (ms), the median of a few.
fn took_ms(wanted: PathSpeed) -> f64 {
    let joints: Vec<Sway> = SWAYS
        .iter()
        .enumerate()
        .map(|(joint, [slope, swing, wave])| {
            let term = Term { swing: *swing, wave: *wave, phase: joint as f64 };
            Sway { slope: *slope, terms: vec![term] }
        })
        .collect();
    let postures: Vec<Joints> = (0..POINTS).map(|i| along(&joints, STEP_M * i as f64)).collect();
    let limits = limits(joints.len(), [1.5, 5.0, 100.0]);
    let mut took: Vec<f64> = (0..TIMES)
        .map(|_| {
            let began = spent_ms();
            let timed = PathLimits::new(STEP_M, &postures, &limits, wanted);
            let ms = spent_ms() - began;
            if timed.is_ok() { ms } else { f64::NAN }
        })
        .collect();
    took.sort_by(f64::total_cmp);
    took.get(TIMES / 2).copied().unwrap_or(f64::NAN)
}

/// What this thread has had of a processor (ms): on a machine with other work the wall's time tells of that too.
#[cfg(target_os = "linux")]
fn spent_ms() -> f64 {
    let spent = nix::time::ClockId::CLOCK_THREAD_CPUTIME_ID.now();
    spent.map_or(f64::NAN, |spent| spent.tv_sec() as f64 * 1e3 + spent.tv_nsec() as f64 * 1e-6)
}

/// The wall's time (ms), where no thread's is known.
#[cfg(not(target_os = "linux"))]
fn spent_ms() -> f64 {
    use probepath_robot::realtime::{Clock, Monotonic};
    static CLOCK: std::sync::OnceLock<Monotonic> = std::sync::OnceLock::new();
    CLOCK.get_or_init(Monotonic::new).now().nanoseconds() as f64 * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_optimum_is_read_and_ours_is_near_it() {
        let ratios: Vec<f64> = optima().iter().map(Problem::over_the_optimum).collect();
        assert!(ratios.len() >= 8, "{ratios:?}");
        assert!(ratios.iter().all(|ratio| *ratio > 0.99 && *ratio <= 1.02), "{ratios:?}");
    }
}
