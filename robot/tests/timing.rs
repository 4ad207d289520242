//! The fastest motion along a path, held against an optimum found by another road: `tests/golden/timing.json`, made by
//! `tests/golden/make_timing.py` (IPOPT over time, where ours is an interior point over the distance); and, where only
//! speed and acceleration count, against toppra's: `tests/golden/timing_toppra.json`, made by
//! `tests/golden/make_timing_toppra.py`.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a test's own helpers may stop at the first surprise, and say what they measured"
)]

use std::f64::consts::TAU;

use probepath_robot::motion::timing::{PathClock, PathLimits, PathSpeed};
use probepath_robot::{Joints, MotionLimits};
use serde_json::Value;

const POSTURES: usize = 401;
const DT: f64 = 0.0005;

struct Problem {
    name: String,
    length: f64,
    wanted: PathSpeed,
    limits: MotionLimits,
    joints: Vec<Value>,
    duration_s: f64,
}

fn number(value: &Value, name: &str) -> f64 {
    value[name].as_f64().unwrap()
}

fn golden(name: &str) -> Vec<Value> {
    let file = format!("{}/../tests/golden/{name}", env!("CARGO_MANIFEST_DIR"));
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    golden["problems"].as_array().unwrap().clone()
}

fn problems() -> Vec<Problem> {
    golden("timing.json").iter().map(problem).collect()
}

fn problem(value: &Value) -> Problem {
    let joints = value["joints"].as_array().unwrap().clone();
    let all = |name: &str| Joints::splat(joints.len(), number(value, name));
    let wanted = |k: usize| value["speed"][k].as_f64().unwrap();
    Problem {
        name: value["name"].as_str().unwrap().to_owned(),
        length: number(value, "length"),
        wanted: PathSpeed { speed: wanted(0), acceleration: wanted(1), jerk: wanted(2) },
        limits: MotionLimits {
            lower: Joints::splat(joints.len(), -10.0),
            upper: Joints::splat(joints.len(), 10.0),
            velocity: all("velocity"),
            acceleration: all("acceleration"),
            jerk: all("jerk"),
        },
        joints,
        duration_s: number(value, "duration_s"),
    }
}

impl Problem {
    fn at(&self, s: f64) -> Joints {
        let mut at = Joints::zeros(self.joints.len());
        for (i, joint) in self.joints.iter().enumerate() {
            at[i] = number(joint, "slope") * s;
            for term in joint["terms"].as_array().unwrap() {
                let phase = TAU / number(term, "wave") * s + number(term, "phase");
                at[i] += number(term, "swing") * phase.sin();
            }
        }
        at
    }

    fn timed(&self) -> PathLimits {
        let step = self.length / (POSTURES - 1) as f64;
        let postures: Vec<Joints> = (0..POSTURES).map(|i| self.at(step * i as f64)).collect();
        PathLimits::new(step, &postures, &self.limits, self.wanted).unwrap()
    }

    /// The largest share of any limit over ticks of `DT`, from the true path; and how long it takes.
    fn driven(&self, timed: &PathLimits) -> ([f64; 3], f64) {
        let mut clock = PathClock::new(timed.clone());
        let mut rows = vec![self.at(0.0); 4];
        while !clock.has_arrived() {
            rows.push(self.at(clock.step(self.wanted.speed, DT)));
        }
        let seconds = (rows.len() - 4) as f64 * DT;
        rows.extend([self.at(self.length); 3]);
        let mut shares = [0.0; 3];
        for (order, limit) in
            [&self.limits.velocity, &self.limits.acceleration, &self.limits.jerk].into_iter().enumerate()
        {
            rows = rows.windows(2).map(|p| p[1].zip(&p[0], |a, b| (a - b) / DT)).collect();
            shares[order] =
                rows.iter().map(|row| row.zip(limit, |x, most| x / most).largest()).fold(0.0, f64::max);
        }
        (shares, seconds)
    }
}

#[test]
fn the_motion_takes_within_two_percent_of_the_optimum_and_keeps_every_limit_at_the_tick() {
    for problem in problems() {
        let timed = problem.timed();
        let (shares, seconds) = problem.driven(&timed);
        let ratio = timed.duration_s() / problem.duration_s;
        println!(
            "{:<34} optimum {:.4} s, ours {:.4} s, ratio {ratio:.4}; shares {shares:.4?}",
            problem.name,
            problem.duration_s,
            timed.duration_s()
        );
        assert!((seconds - timed.duration_s()).abs() <= 2.0 * DT);
        assert!(ratio < 1.02, "{}: {ratio}", problem.name);
        // The golden one asks its limits at places too, and so may be a little too quick; ours never.
        assert!(ratio > 0.99, "{}: {ratio}", problem.name);
        assert!(shares.iter().all(|share| *share <= 1.0 + 1e-3), "{}: {shares:?}", problem.name);
    }
}

/// Accelerations change within this (s): a jerk that hardly counts.
const JERK_TIME_S: f64 = 0.001;

#[test]
fn where_only_acceleration_counts_it_takes_within_one_percent_of_what_toppra_finds() {
    for (mut problem, toppra) in problems().into_iter().zip(golden("timing_toppra.json")) {
        assert_eq!(toppra["name"].as_str(), Some(problem.name.as_str()));
        problem.limits.jerk = problem.limits.acceleration.map(|a| a / JERK_TIME_S);
        problem.wanted.jerk = problem.wanted.acceleration / JERK_TIME_S;
        let timed = problem.timed();
        let (shares, _) = problem.driven(&timed);
        let seconds = number(&toppra, "duration_s");
        let ratio = timed.duration_s() / seconds;
        println!("{:<34} toppra {seconds:.4} s, ratio {ratio:.4}; shares {shares:.4?}", problem.name);
        assert!(ratio > 0.999 && ratio < 1.01, "{}: {ratio}", problem.name);
        assert!(shares.iter().all(|share| *share <= 1.0 + 1e-3), "{}: {shares:?}", problem.name);
    }
}
