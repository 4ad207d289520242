//! A replay on the small plant, judged by what was truly commanded and truly felt.

use std::cell::{Cell, RefCell};

use probepath_robot::motion::follow::Curve;
use probepath_robot::{Ending, Finished, Guard, GuardLimits, Tick, Wish, run};

use super::plant::{DT, Plant, Skin, Truth, arm, home, path};
use super::*;
use crate::PlanSettings;

const SOFT: Skin = Skin { stiffness: 300.0, bump: 0.0005, wave: 0.03, until: 1.0 };

struct Outcome {
    finished: Finished,
    status: ReplayStatus,
    truth: Vec<Truth>,
    /// Phase and distance along the path after every tick.
    seen: Vec<ReplayStatus>,
    corrected: f64,
}

/// Runs the default plan on a skin; the operator is told what to do at every tick.
fn replay(skin: Skin, seed: u64, operate: impl Fn(&ReplayStatus, usize, &Operator)) -> Outcome {
    let plan = Plan::new(&path(), &arm(), &home(), &PlanSettings::default()).unwrap();
    replay_plan(plan, skin, seed, operate)
}

fn replay_plan(
    plan: Plan,
    skin: Skin,
    seed: u64,
    operate: impl Fn(&ReplayStatus, usize, &Operator),
) -> Outcome {
    let operator = Operator::new();
    let mut replay = Replay::new(plan, ReplaySettings::default(), operator.clone()).unwrap();
    let watch = replay.watch();
    let mut plant = Plant::new(skin, home(), seed);
    let mut guard = Guard::new(GuardLimits::default(), arm().limits).unwrap().listening_to(operator.clone());
    let (mut seen, mut corrected) = (Vec::new(), 0.0_f64);
    let mut observer = |tick: &Tick| {
        let status = watch.status();
        operate(&status, seen.len(), &operator);
        seen.push(status);
        corrected = corrected.max(tick.changed);
        Wish::GoOn
    };
    let finished = run(&mut plant, &mut replay, &mut guard, &mut observer).unwrap();
    let status = replay.status();
    Outcome { finished, status, truth: plant.truth, seen, corrected }
}

/// Largest commanded velocity, acceleration and jerk, as fractions of the joints' limits.
fn read_back(truth: &[Truth]) -> [f64; 3] {
    let limits = arm().limits;
    let mut rows: Vec<Joints> = truth.iter().map(|t| t.commanded).collect();
    [limits.velocity, limits.acceleration, limits.jerk].map(|limit| {
        rows = rows.windows(2).map(|p| p[1].zip(&p[0], |b, a| (b - a) / DT)).collect();
        rows.iter().fold(0.0_f64, |most, row| most.max(row.zip(&limit, |x, l| x / l).largest()))
    })
}

fn following(outcome: &Outcome) -> impl Iterator<Item = (&Truth, &ReplayStatus)> {
    let after = outcome.truth.len() - outcome.seen.len();
    outcome.truth[after..].iter().zip(&outcome.seen).filter(|(_, s)| s.phase == ReplayPhase::Follow)
}

/// RMS of the true force's error while following, and the largest true force.
fn force(outcome: &Outcome) -> (f64, f64) {
    let errors: Vec<f64> = following(outcome).map(|(t, _)| t.force_n - 5.0).collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    (rms, outcome.truth.iter().fold(0.0, |most, t| most.max(t.force_n)))
}

/// Largest and RMS distance across the probe's axis of the commanded pose from the smooth path, and largest angle.
fn off_path(outcome: &Outcome) -> (f64, f64) {
    let (arm, path) = (arm(), path());
    let (mut squares, mut turned, mut n) = (0.0, 0.0_f64, 0.0);
    for (truth, status) in following(outcome).step_by(20) {
        let commanded = arm.probe(&truth.commanded);
        let near = (-10..=10).map(|i| path.curve().at(status.at_m + 2e-5 * f64::from(i)).base_from_probe);
        let off = near.map(|on| {
            let way = on.isometry().inverse() * commanded.isometry();
            (way.translation.vector.xy().norm(), way.rotation.angle())
        });
        let (across, angle) = off.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        (squares, turned, n) = (squares + across * across, turned.max(angle), n + 1.0);
    }
    ((squares / f64::max(n, 1.0)).sqrt(), turned)
}

#[test]
fn a_replay_holds_the_force_and_keeps_the_path_and_every_limit() {
    for (seed, stiffness) in [300.0, 700.0, 1500.0, 3000.0].into_iter().enumerate() {
        let skin = Skin { stiffness, ..SOFT };
        let outcome = replay(skin, seed as u64, |_, _, _| {});
        assert_eq!(outcome.status.ending, Some(ReplayEnding::Completed), "{stiffness}: {:?}", outcome.status);
        let (rms, most) = force(&outcome);
        eprintln!(
            "stiffness {stiffness} N/m: force {rms:.3} N RMS, most {most:.2} N; {:?}",
            off_path(&outcome)
        );
        assert!(rms <= 0.3, "{stiffness} N/m: {rms} N RMS");
        assert!(most <= 6.0, "{stiffness} N/m: {most} N");
        let (across, turned) = off_path(&outcome);
        assert!(across <= 0.05e-3 && turned < 1e-3, "{across} m, {turned} rad");
        let [v, a, j] = read_back(&outcome.truth);
        eprintln!("  {v:.3} {a:.3} {j:.3} of the limits, corrected by {:e}", outcome.corrected);
        assert!(v.max(a).max(j) <= 1.0, "{v} {a} {j}");
        assert!(outcome.corrected < 1e-9, "the limits had to correct {}", outcome.corrected);
    }
}

#[test]
fn a_pause_waits_on_the_skin_with_the_force_held_and_a_resume_is_slow() {
    let outcome = replay(SOFT, 7, |status, tick, operator| {
        match (status.phase, tick % 2500) {
            // In every phase: a second of pause every five.
            (_, 1500) => operator.pause(),
            (_, 2000) => operator.resume(),
            _ => {}
        }
    });
    assert_eq!(outcome.status.ending, Some(ReplayEnding::Completed));
    assert!(force(&outcome).0 <= 0.3);
    let waiting = following(&outcome).filter(|(_, s)| s.speed_m_s == 0.0).count();
    assert!(waiting > 500, "{waiting}");
    assert!(following(&outcome).all(|(_, s)| s.speed_m_s <= 0.01 + 1e-9));
    assert!(outcome.seen.windows(2).all(|p| p[1].at_m >= p[0].at_m), "it went back");
    assert!(read_back(&outcome.truth).iter().all(|part| *part <= 1.0));
}

#[test]
fn the_same_seed_gives_the_same_commands() {
    let commands = || replay(SOFT, 3, |_, _, _| {}).truth.iter().map(|t| t.commanded).collect::<Vec<_>>();
    assert!(commands() == commands());
}

#[test]
fn where_the_skin_ends_contact_is_lost_and_the_probe_lifted() {
    let outcome = replay(Skin { until: 0.12, ..SOFT }, 5, |_, _, _| {});
    let Some(ReplayEnding::ContactLost { at_m }) = outcome.status.ending else {
        panic!("{:?}", outcome.status)
    };
    assert!((0.06..0.08).contains(&at_m), "{at_m}");
    assert!(matches!(outcome.finished.ending, Ending::Done));
    // Lifted to the standoff, not left hanging where the skin was.
    assert!((outcome.status.offset_m + 0.04).abs() < 0.002, "{:?}", outcome.status);
    assert!(read_back(&outcome.truth).iter().all(|part| *part <= 1.0));
}

#[test]
fn without_skin_the_descent_ends_at_its_bound_and_the_probe_is_lifted() {
    let outcome = replay(Skin { until: -1.0, ..SOFT }, 5, |_, _, _| {});
    assert_eq!(outcome.status.ending, Some(ReplayEnding::NoSkin));
    assert!(outcome.seen.iter().all(|s| s.offset_m < 0.0151));
}

#[test]
fn a_stop_in_any_phase_brakes_within_the_limits() {
    for at in [200, 1500, 2500, 3200, 4000, 6000] {
        let outcome = replay(SOFT, 1, |_, tick, operator| {
            if tick == at {
                operator.stop();
            }
        });
        assert_eq!(outcome.finished.ending, Ending::Operator, "{at}");
        assert!(read_back(&outcome.truth).iter().all(|part| *part <= 1.0 + 1e-9), "{at}");
        assert!(force(&outcome).1 < 6.5, "{at}");
    }
}

#[test]
fn a_plan_from_elsewhere_never_moves_the_arm() {
    let plan = Plan::new(&path(), &arm(), &home(), &PlanSettings::default()).unwrap();
    let mut replay = Replay::new(plan, ReplaySettings::default(), Operator::new()).unwrap();
    let mut start = home();
    start[2] += 0.01;
    let mut plant = Plant::new(SOFT, start, 0);
    let mut guard = Guard::new(GuardLimits::default(), arm().limits).unwrap();
    run(&mut plant, &mut replay, &mut guard, &mut ()).unwrap();
    assert!(
        matches!(replay.status().ending, Some(ReplayEnding::StartMoved { away }) if (away - 0.01).abs() < 1e-9)
    );
    assert!(plant.truth.iter().all(|t| t.commanded == start));
}

#[test]
fn a_force_in_the_air_is_a_reason_not_to_touch() {
    let plan = Plan::new(&path(), &arm(), &home(), &PlanSettings::default()).unwrap();
    let mut replay = Replay::new(plan, ReplaySettings::default(), Operator::new()).unwrap();
    let mut plant = Plant::new(SOFT, home(), 0);
    plant.drift_n = 3.0;
    let mut guard = Guard::new(GuardLimits::default(), arm().limits).unwrap();
    run(&mut plant, &mut replay, &mut guard, &mut ()).unwrap();
    assert!(matches!(replay.status().ending, Some(ReplayEnding::ForceInAir { .. })), "{:?}", replay.status());
}

#[test]
fn settings_that_cannot_be_are_refused_by_name() {
    let plan = Plan::new(&path(), &arm(), &home(), &PlanSettings::default()).unwrap();
    for settings in [
        ReplaySettings { force_n: f64::NAN, ..ReplaySettings::default() },
        ReplaySettings { force_n: 12.0, ..ReplaySettings::default() },
        ReplaySettings { touch_speed: 0.5, ..ReplaySettings::default() },
    ] {
        let refused = Replay::new(plan.clone(), settings, Operator::new());
        assert!(matches!(refused, Err(ReplayError::Setting { .. })));
    }
}

/// Ticks after each phase began: as it begins, soon after, and well within.
const WITHIN: [usize; 3] = [0, 20, 300];
const PHASES: [ReplayPhase; 5] = [
    ReplayPhase::Approach,
    ReplayPhase::Descend,
    ReplayPhase::Settle,
    ReplayPhase::Follow,
    ReplayPhase::Lift,
];

/// The short way of a path, at twice the usual speed, so that a slow resume shows.
fn short_fast_plan() -> Plan {
    let settings = PlanSettings {
        speed: probepath_robot::motion::timing::PathSpeed::gentle(0.02),
        ..PlanSettings::default()
    };
    Plan::new(&path().trimmed(0.0, 0.03).unwrap(), &arm(), &home(), &settings).unwrap()
}

/// Tells, tick by tick, whether a phase has been going on for so long.
fn reaches(phase: ReplayPhase, within: usize) -> impl FnMut(&ReplayStatus) -> bool {
    let mut ticks = 0;
    move |status| {
        ticks += usize::from(status.phase == phase);
        ticks == within + 1 && status.phase == phase
    }
}

#[test]
fn a_pause_in_every_phase_comes_to_rest_and_a_resume_is_slow() {
    let plan = short_fast_plan();
    for phase in PHASES {
        for within in WITHIN {
            let (reached, at) = (RefCell::new(reaches(phase, within)), Cell::new(None));
            let outcome = replay_plan(plan.clone(), SOFT, 11, |status, tick, operator| {
                if reached.borrow_mut()(status) {
                    operator.pause();
                    at.set(Some(tick));
                }
                if at.get().is_some_and(|at| tick == at + 750) {
                    operator.resume();
                }
            });
            let what = format!("{phase:?} + {within} ticks");
            assert_eq!(outcome.status.ending, Some(ReplayEnding::Completed), "{what}");
            assert!(read_back(&outcome.truth).iter().all(|part| *part <= 1.0), "{what}");
            let at = at.get().expect("every phase was reached");
            paused_at_rest(&outcome, at, &what);
        }
    }
}

/// At the end of a pause nothing moves but what holds the force, and the way goes on at 10 mm/s at most.
fn paused_at_rest(outcome: &Outcome, at: usize, what: &str) {
    let before = outcome.truth.len() - outcome.seen.len();
    let end = at + 740;
    let (seen, truth) = (&outcome.seen[end], &outcome.truth[before + end - 100..before + end]);
    assert!(seen.speed_m_s == 0.0, "{what}: {seen:?}");
    if matches!(seen.phase, ReplayPhase::Settle | ReplayPhase::Follow) {
        assert!((truth[99].force_n - seen.set_n).abs() < 0.5, "{what}: {:?} {seen:?}", truth[99]);
    } else {
        let moved = truth[99].commanded.zip(&truth[0].commanded, |a, b| (a - b).abs()).largest();
        assert!(moved < 1e-9, "{what}: {moved}");
    }
    // The commanded probe, the force's share left out where there is one, half a second from the resume on.
    let (arm, mut fastest) = (arm(), 0.0_f64);
    for i in at + 751..(at + 1000).min(outcome.seen.len()) {
        let probe = |i: usize| arm.probe(&outcome.truth[before + i].commanded);
        let way = (probe(i - 1).inverse() * probe(i)).isometry().translation.vector;
        let held = matches!(outcome.seen[i].phase, ReplayPhase::Settle | ReplayPhase::Follow);
        let speed = if held { way.xy().norm() } else { way.norm() } / DT;
        let allowed = 0.01 * (1.0 + (i - at - 750) as f64 * DT).powi(2);
        assert!(speed <= allowed + 2e-4, "{what}: {speed} m/s {} ticks after the resume", i - at - 750);
        fastest = fastest.max(speed);
    }
    assert!(fastest > 0.0 || seen.phase == ReplayPhase::Settle, "{what}: it never went on");
}

#[test]
fn a_stop_in_every_phase_brakes_and_a_lift_off_then_takes_the_probe_off_the_skin() {
    let plan = short_fast_plan();
    for phase in PHASES {
        for within in WITHIN {
            let (what, operator) = (format!("{phase:?} + {within} ticks"), Operator::new());
            let mut replay = Replay::new(plan.clone(), ReplaySettings::default(), operator.clone()).unwrap();
            let (watch, mut reached) = (replay.watch(), reaches(phase, within));
            let mut plant = Plant::new(SOFT, home(), 13);
            let mut guard =
                Guard::new(GuardLimits::default(), arm().limits).unwrap().listening_to(operator.clone());
            let mut observer = |_: &Tick| {
                if reached(&watch.status()) {
                    operator.stop();
                }
                Wish::GoOn
            };
            let stopped = run(&mut plant, &mut replay, &mut guard, &mut observer).unwrap();
            assert_eq!(stopped.ending, Ending::Operator, "{what}");
            let mut guard = Guard::new(GuardLimits::default(), arm().limits).unwrap();
            let mut lift = crate::LiftOff::new(arm(), 0.04, 0.02).unwrap();
            run(&mut plant, &mut lift, &mut guard, &mut ()).unwrap();
            assert!(plant.truth[plant.truth.len() - 1].force_n == 0.0, "{what}: still on the skin");
            assert!(read_back(&plant.truth).iter().all(|part| *part <= 1.0 + 1e-9), "{what}");
        }
    }
}

#[test]
fn a_stop_on_the_path_comes_to_rest_along_it_in_less_than_a_tenth_of_a_second() {
    let plan = short_fast_plan();
    let (curve, length) = (path().trimmed(0.0, 0.03).unwrap().curve().clone(), plan.timing.length());
    for part in [0.2, 0.4, 0.6] {
        let stops_at = part * length;
        let stop = |status: &ReplayStatus, _: usize, operator: &Operator| {
            if status.phase == ReplayPhase::Follow && status.at_m >= stops_at {
                operator.stop();
            }
        };
        let outcome = replay_plan(plan.clone(), SOFT, 17, stop);
        assert_eq!(outcome.finished.ending, Ending::Operator);
        let stopped = outcome.seen.iter().position(|status| status.at_m >= stops_at).unwrap();
        let after = &outcome.truth[stopped..];
        let beside = |truth: &Truth| {
            let probe = arm().probe(&truth.commanded).origin();
            let local = |s: f64| (curve.at(s).base_from_probe.inverse() * probe).vector().xy().norm();
            (0..1000).map(|i| local(stops_at + 5e-6 * f64::from(i) - 1e-3)).fold(f64::INFINITY, f64::min)
        };
        let moves =
            |pair: &[Truth]| (pair[1].commanded.zip(&pair[0].commanded, |a, b| a - b)).largest() > 1e-9;
        let ticks = after.windows(2).rposition(moves).map_or(0, |last| last + 1);
        let off = after.iter().map(beside).fold(0.0, f64::max);
        eprintln!("at rest {} ms after the word, at most {off:e} m beside the path", ticks * 2);
        assert!(ticks <= 50, "{ticks} ticks");
        assert!(off < 1e-5, "{off} m beside the path");
    }
}
