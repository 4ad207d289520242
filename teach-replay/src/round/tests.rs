use nalgebra::Isometry3;
use probepath_frames::{Direction, Point};
use probepath_robot::{Ending, Guard, GuardLimits, Plane, Tick, Wish, Workspace, run};

use super::*;
use crate::replay::plant::{DT, Plant, Skin, arm, home};

const NO_SKIN: Skin = Skin { stiffness: 0.0, bump: 0.0, wave: 1.0, until: -1.0 };

/// The probe at home, moved and turned about its own axes.
fn moved(by: [f64; 3], turn: [f64; 3]) -> Pose<Base, Probe> {
    let (by, turn) = (nalgebra::Vector3::from(by), nalgebra::Vector3::from(turn));
    // FRAMES: the probe, moved and turned in its own axes, is the probe where it would be then.
    arm().probe(&home()) * Pose::<Probe, Probe>::assume(Isometry3::new(by, turn))
}

fn stops() -> Vec<Stop> {
    let rest = |pose| Stop {
        base_from_probe: pose,
        speed_m_s: 0.05,
        look_on_the_way: false,
        settle_s: 0.1,
        look_s: 0.2,
    };
    let sweep =
        |pose| Stop { speed_m_s: 0.02, look_on_the_way: true, settle_s: 0.0, look_s: 0.0, ..rest(pose) };
    vec![
        rest(moved([0.0; 3], [0.3, 0.0, 0.0])),
        rest(moved([0.02, 0.01, 0.0], [-0.3, 0.1, 0.2])),
        rest(moved([-0.02, 0.0, -0.01], [0.0, 0.3, -0.1])),
        sweep(moved([-0.01, 0.0, 0.0], [0.0; 3])),
        sweep(moved([0.01, 0.0, 0.0], [0.0; 3])),
    ]
}

fn start() -> Joints {
    let mut start = home();
    start[0] += 0.1;
    start
}

struct Ran {
    ending: Ending,
    commanded: Vec<Joints>,
    seen: Vec<(RoundStatus, Joints)>,
    corrected: f64,
}

fn go(round: Round, act: impl Fn(usize, &Operator)) -> Ran {
    let operator = round.operator.clone();
    let (watch, mut round) = (round.watch(), round);
    let mut plant = Plant::new(NO_SKIN, start(), 1);
    plant.drift_n = 0.0;
    let mut guard = Guard::new(GuardLimits::default(), arm().limits).unwrap();
    let mut ran = Ran { ending: Ending::Done, commanded: vec![start(); 3], seen: Vec::new(), corrected: 0.0 };
    let mut observer = |tick: &Tick| {
        act(ran.seen.len(), &operator);
        ran.corrected = f64::max(ran.corrected, tick.changed);
        ran.commanded.push(tick.state.commanded);
        ran.seen.push((watch.status(), tick.state.commanded));
        Wish::GoOn
    };
    ran.ending = run(&mut plant, &mut round, &mut guard, &mut observer).unwrap().ending;
    ran
}

fn round() -> Round {
    Round::new(&stops(), &arm(), (&start(), &home()), &PlanSettings::default(), Operator::new()).unwrap()
}

fn within_limits(ran: &Ran) {
    assert!(ran.corrected < 1e-9, "the limits had to correct {}", ran.corrected);
    let mut rows = ran.commanded.clone();
    for limit in [arm().limits.velocity, arm().limits.acceleration, arm().limits.jerk] {
        rows = rows.windows(2).map(|p| p[1].zip(&p[0], |b, a| (b - a) / DT)).collect();
        assert!(rows.iter().all(|row| row.zip(&limit, |x, l| x / l).largest() <= 1.0));
    }
}

/// The fastest that the commanded probe goes while `phase` (m/s).
fn fastest(ran: &Ran, wanted: impl Fn(RoundPhase) -> bool) -> f64 {
    let speed = |p: &[(RoundStatus, Joints)]| {
        arm().probe(&p[0].1).origin().distance(&arm().probe(&p[1].1).origin()) / DT
    };
    let both = |p: &&[(RoundStatus, Joints)]| wanted(p[0].0.phase) && wanted(p[1].0.phase);
    ran.seen.windows(2).filter(both).map(speed).fold(0.0, f64::max)
}

#[test]
fn it_rests_at_every_stop_and_goes_no_faster_than_it_may() {
    let ran = go(round(), |_, _| {});
    assert_eq!(ran.ending, Ending::Done);
    within_limits(&ran);
    for (i, stop) in stops().iter().enumerate() {
        let looking: Vec<_> =
            ran.seen.iter().filter(|(s, _)| s.stop == i && s.phase == RoundPhase::Looking).collect();
        assert!((looking.len() as f64 - stop.look_s / DT).abs() <= 3.0, "{i}: {}", looking.len());
        let off = looking.iter().map(|(_, q)| arm().probe(q).distance(&stop.base_from_probe));
        assert!(off.into_iter().all(|(m, rad)| m < 1e-9 && rad < 1e-9), "{i}");
    }
    let sweeping = fastest(&ran, |phase| phase == RoundPhase::Sweeping);
    assert!((0.015..=0.0204).contains(&sweeping), "{sweeping}");
    assert!(fastest(&ran, |_| true) <= 0.051);
}

#[test]
fn a_pause_rests_and_a_resume_is_slow() {
    let ran = go(round(), |tick, operator| match tick {
        500 => operator.pause(),
        1500 => operator.resume(),
        _ => {}
    });
    within_limits(&ran);
    let still = ran.commanded.windows(2).skip(500).take(1000).filter(|p| p[0] == p[1]).count();
    assert!(still > 100, "{still}");
    let after: Vec<_> = ran.seen[1500..1700].to_vec();
    let resumed = Ran { seen: after, ..ran };
    assert!(fastest(&resumed, |_| true) < 0.02);
}

#[test]
fn a_stop_that_cannot_be_is_refused_before_anything_moves() {
    let refused = |stops: &[Stop], settings: &PlanSettings| {
        Round::new(stops, &arm(), (&start(), &home()), settings, Operator::new()).unwrap_err()
    };
    let mut far = stops();
    far[2].base_from_probe = moved([0.0, 0.0, -1.5], [0.0; 3]);
    let error = refused(&far, &PlanSettings::default());
    assert!(matches!(error.place, Place::Stop { stop: 3 }), "{error}");
    let floor = Point::from_vector(moved([0.0; 3], [0.0; 3]).origin().vector());
    let table = Plane { through: floor, inward: Direction::z() };
    let settings = PlanSettings { workspace: Workspace::new().and(table), ..PlanSettings::default() };
    let mut low = stops();
    low[1].base_from_probe = moved([0.0, 0.0, 0.01], [0.0; 3]);
    let error = refused(&low, &settings);
    assert!(matches!(error.refusal, Refusal::Workspace { .. }), "{error}");
}

#[test]
fn a_round_planned_from_elsewhere_does_not_begin() {
    let round = Round::new(&stops(), &arm(), (&home(), &home()), &PlanSettings::default(), Operator::new());
    let round = round.unwrap();
    let watch = round.watch();
    let ran = go(round, |_, _| {});
    assert_eq!(watch.status().phase, RoundPhase::StartMoved);
    assert!(ran.commanded.iter().all(|q| *q == start()));
}
