//! Thousands of seeded paths and limits, judged by what was commanded alone.

use nalgebra::{UnitQuaternion, Vector3};
use probepath_frames::{Direction, Point};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;
use crate::Workspace;
use crate::motion::timing::SpeedRamp;

const DT: f64 = 0.002;
const PERIOD: Span = Span::from_milliseconds(2);
/// Joint positions that are regular and within limits for both arms.
const BENT: [f64; 7] = [0.3, -0.8, 1.1, -1.6, 0.9, 1.4, 0.2];

fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn tool() -> Pose<Flange, Probe> {
    // FRAMES: a made-up holder: the probe's face 150 mm in front of the flange.
    Pose::assume(Isometry3::translation(0.0, 0.0, 0.15))
}

fn bent(model: &Model) -> Joints {
    Joints::from_slice(&BENT[..model.joints()]).unwrap()
}

fn limits(model: &Model, acceleration: f64, jerk: f64) -> MotionLimits {
    let joints = model.joints();
    MotionLimits::of_model(model, Joints::splat(joints, acceleration), Joints::splat(joints, jerk)).unwrap()
}

/// A smooth way of the probe from where it is: it runs along a direction, sways, and turns.
#[derive(Clone, Copy, Debug)]
struct Way {
    from: Isometry3<f64>,
    along: Vector3<f64>,
    sway: Vector3<f64>,
    turn: Vector3<f64>,
    wave: f64,
}

impl Way {
    fn some(rng: &mut ChaCha8Rng, from: Isometry3<f64>) -> Self {
        let mut vector = |size: f64| {
            Vector3::new(between(rng, -1.0, 1.0), between(rng, -1.0, 1.0), between(rng, -1.0, 1.0)) * size
        };
        let (along, sway, turn) = (vector(1.0).normalize(), vector(0.01), vector(0.15));
        Self { from, along, sway, turn, wave: between(rng, 0.04, 0.2) }
    }

    /// At `s` metres, the probe pushed in by `depth`.
    fn at(&self, s: f64, depth: f64) -> Pose<Base, Probe> {
        let angle = std::f64::consts::TAU * s / self.wave;
        // Begins with no slope, as the clock begins at rest.
        let place = self.from.translation.vector + self.along * s + self.sway * (1.0 - angle.cos());
        let turned = UnitQuaternion::from_scaled_axis(self.turn * (1.0 - (0.6 * angle).cos()));
        let rotation = self.from.rotation * turned;
        let place = place + rotation * Vector3::z() * depth;
        // FRAMES: a made-up path of a probe in a base.
        Pose::assume(Isometry3::from_parts(place.into(), rotation))
    }
}

/// One walk along a way, and all that was seen.
struct Walk {
    stepper: Stepper,
    way: Way,
    speed: f64,
    /// Contact: how deep it goes (m) and how often (rad/s).
    press: (f64, f64),
    clock: SpeedRamp,
    s: f64,
    behind: Behind,
    freedom: f64,
    rows: Vec<Joints>,
    seen: Vec<Stepped>,
    off: f64,
}

impl Walk {
    fn new(model: &Model, start: Joints, limits: MotionLimits, settings: StepSettings) -> Self {
        let from = *(model.forward(&start) * tool()).isometry();
        let way =
            Way { from, along: Vector3::x(), sway: Vector3::zeros(), turn: Vector3::zeros(), wave: 1.0 };
        let stepper = Stepper::at_rest(model.clone(), tool(), limits, PERIOD, start, settings).unwrap();
        let (clock, behind) = (SpeedRamp::at_rest(0.2, 4.0), Behind::default());
        let (rows, seen) = (vec![start; 4], Vec::new());
        Self {
            stepper,
            way,
            speed: 0.02,
            press: (0.0, 1.0),
            clock,
            s: 0.0,
            behind,
            freedom: 1.0,
            rows,
            seen,
            off: 0.0,
        }
    }

    fn tick(&mut self) -> Stepped {
        self.s += self.clock.step(self.speed * self.behind.scale(), DT) * DT;
        let t = self.seen.len() as f64 * DT;
        let (place, aim) = (self.behind.place(), self.behind.aim(self.s, DT));
        let depth = self.press.0 * (1.0 - (self.press.1 * t).cos());
        let (still, ahead) = (self.way.at(place, depth), self.way.at(aim, depth));
        let stepped = self.stepper.step(&PathStep { still, ahead, freedom: self.freedom }).unwrap();
        self.behind.went(&stepped);
        let goal = self.way.at(self.behind.place(), depth);
        let (metres, _) = (self.stepper.model.forward(&stepped.position) * tool()).distance(&goal);
        self.off = self.off.max(metres);
        self.rows.push(stepped.position);
        self.seen.push(stepped);
        stepped
    }

    fn ticks(&mut self, ticks: usize) -> &mut Self {
        for _ in 0..ticks {
            self.tick();
        }
        self
    }

    /// The check that a reader of an exam makes, from the commanded positions alone.
    fn check(&self, what: &str) {
        let limits = self.stepper.limiter().limits();
        for joint in 0..limits.joints() {
            let q: Vec<f64> = self.rows.iter().map(|row| row[joint]).collect();
            let slower = |x: &[f64]| x.windows(2).map(|p| (p[1] - p[0]) / DT).collect::<Vec<_>>();
            let (v, a) = (slower(&q), slower(&slower(&q)));
            let j = slower(&a);
            let most = |x: &[f64]| x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!(
                q.iter().all(|q| *q >= limits.lower[joint] - 1e-9 && *q <= limits.upper[joint] + 1e-9),
                "{what}"
            );
            assert!(most(&v) <= limits.velocity[joint] * (1.0 + 1e-9), "{what}: joint {joint} velocity");
            assert!(
                most(&a) <= limits.acceleration[joint] * (1.0 + 1e-9),
                "{what}: joint {joint} acceleration"
            );
            assert!(most(&j) <= limits.jerk[joint] * (1.0 + 1e-6), "{what}: joint {joint} jerk {}", most(&j));
        }
    }

    fn probe(&self) -> Vector3<f64> {
        (self.stepper.model.forward(&self.rows[self.rows.len() - 1]) * tool()).origin().vector()
    }

    fn held(&self) -> Vec<Binding> {
        self.seen.iter().filter_map(|stepped| stepped.binding).collect()
    }
}

#[test]
fn three_hundred_ways_within_the_limits_are_followed_to_a_picometre() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut worst, mut left) = (0.0_f64, 0.0_f64);
    for case in 0..300 {
        let model = if case % 2 == 0 { Model::ur5e() } else { Model::seven_joint() };
        let mut walk = Walk::new(&model, bent(&model), limits(&model, 10.0, 400.0), StepSettings::default());
        walk.way = Way::some(&mut rng, walk.way.from);
        walk.speed = between(&mut rng, 0.002, 0.03);
        walk.press = (between(&mut rng, 0.0, 0.002), between(&mut rng, 1.0, 9.0));
        walk.ticks(600);
        walk.check(&format!("case {case}"));
        assert!(
            walk.seen.iter().all(|stepped| stepped.part >= 1.0),
            "case {case}: {:?}",
            walk.held().first()
        );
        assert!(walk.behind.by() <= 0.0, "case {case}");
        worst = worst.max(walk.off);
        // After the first ticks, in which it is put on the way.
        left = walk.seen[20..].iter().fold(left, |most, stepped| most.max(stepped.off.0).max(stepped.off.1));
    }
    eprintln!("at most {worst:e} m off the way; {left:e} as it says itself");
    assert!(worst < 1e-12 && left < 1e-12, "{worst} {left}");
}

/// A walk whose joints are slow, weak, or jerky.
fn driven_hard(rng: &mut ChaCha8Rng, case: usize) -> Walk {
    let model = if case.is_multiple_of(2) { Model::ur5e() } else { Model::seven_joint() };
    let acceleration = between(rng, 1.0, 10.0);
    let mut limits = limits(&model, acceleration, acceleration * between(rng, 10.0, 60.0));
    let slower = between(rng, 0.01, 0.2);
    limits.velocity = limits.velocity.map(|v| v * slower);
    let mut walk = Walk::new(&model, bent(&model), limits, StepSettings::default());
    walk.way = Way::some(rng, walk.way.from);
    walk.speed = between(rng, 0.02, 0.2);
    walk.press = (between(rng, 0.0, 0.001), between(rng, 1.0, 6.0));
    walk
}

#[test]
fn a_thousand_ways_beyond_the_joints_speeds_are_slowed_down_and_the_limit_is_named() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (mut held, mut far, mut names) = (0, Vec::new(), std::collections::BTreeMap::<String, usize>::new());
    for case in 0..1000 {
        let mut walk = driven_hard(&mut rng, case);
        // Bends that nobody looked ahead at are gentle.
        (walk.way.sway, walk.way.turn) = (walk.way.sway * 0.2, walk.way.turn * 0.5);
        walk.speed = walk.speed.min(0.06);
        walk.way.wave = 0.2;
        walk.ticks(500).check(&format!("case {case}"));
        for stepped in &walk.seen {
            let whole = stepped.part >= 1.0 && stepped.off.0 < 1e-7;
            assert!(whole || stepped.binding.is_some() || stepped.off.0 > 0.0, "case {case}: {stepped:?}");
        }
        let bindings = walk.held();
        held += usize::from(!bindings.is_empty());
        far.push(walk.off);
        for binding in bindings {
            let Binding::Joint { bound, .. } = binding else { continue };
            *names.entry(bound.to_string()).or_default() += 1;
        }
    }
    far.sort_by(f64::total_cmp);
    eprintln!(
        "{held} held back, by {names:?}; off the way: median {:e} m, 95 % {:e}, 99 % {:e}, most {:e}",
        far[500], far[950], far[990], far[999]
    );
    assert!(held > 250, "{held}");
    assert!(far[500] < 1e-9 && far[950] < 1e-4, "{} {}", far[500], far[950]);
}

#[test]
fn however_hard_it_is_driven_no_limit_is_left_and_it_comes_back_to_its_way() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (mut most, mut back) = (0.0_f64, Vec::new());
    for case in 0..200 {
        let mut walk = driven_hard(&mut rng, case);
        walk.ticks(600);
        (walk.speed, walk.press.0) = (0.0, 0.0);
        walk.ticks(1500).check(&format!("case {case}"));
        most = most.max(walk.off);
        back.push(walk.seen[walk.seen.len() - 1].off.0);
    }
    back.sort_by(f64::total_cmp);
    eprintln!("at most {most:e} m off; after 3 s {:e} (median) {:e} (most)", back[100], back[199]);
    assert!(most < 0.15 && back[180] < 1e-6, "{most} {}", back[180]);
}

fn plane(through: Vector3<f64>, inward: Vector3<f64>) -> Workspace {
    let through = Point::<Base>::new(through.x, through.y, through.z);
    Workspace::new().and(Plane { through, inward: Direction::of(inward).unwrap() })
}

#[test]
fn two_hundred_ways_through_a_plane_stop_before_it_on_the_way() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (mut nearest, mut farthest, mut off) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    for case in 0..200 {
        let model = if case % 2 == 0 { Model::ur5e() } else { Model::seven_joint() };
        let start = bent(&model);
        let from = (model.forward(&start) * tool()).origin().vector();
        let mut way = Way::some(&mut rng, *(model.forward(&start) * tool()).isometry());
        (way.sway, way.turn, way.wave) = (way.sway * 0.1, way.turn * 0.3, 0.2);
        let speed = between(&mut rng, 0.01, 0.1);
        let inward = (-way.along + 0.5 * Vector3::new(0.3, -0.2, between(&mut rng, -1.0, 1.0))).normalize();
        let settings =
            StepSettings { workspace: plane(from + way.along * 0.03, inward), ..StepSettings::default() };
        let limits = limits(&model, between(&mut rng, 3.0, 20.0), between(&mut rng, 50.0, 500.0));
        let mut walk = Walk::new(&model, start, limits, settings);
        (walk.way, walk.speed) = (way, speed);
        let distance = |point: Vector3<f64>| (point - from - way.along * 0.03).dot(&inward);
        for _ in 0..(0.04 / speed / DT) as usize + 900 {
            walk.tick();
            let rest = model.forward(&walk.stepper.limiter().brakes_at()) * tool();
            assert!(distance(walk.probe()) >= 0.0, "case {case}: beyond the plane");
            assert!(distance(rest.origin().vector()) >= 0.0, "case {case}: brakes beyond the plane");
        }
        walk.check(&format!("case {case}"));
        let left = distance(walk.probe());
        (nearest, farthest) = (nearest.min(left), farthest.max(left));
        off = off.max(walk.off);
        assert!(
            walk.held().contains(&Binding::Plane { number: 0 }),
            "case {case}: {left} {:?}",
            walk.held().last()
        );
    }
    eprintln!("they came to rest {nearest:e} to {farthest:e} m before it, at most {off:e} m off the way");
    assert!(nearest >= 0.0 && farthest < 0.002 && off < 5e-4);
}

#[test]
fn a_joint_that_comes_to_the_end_of_its_range_stops_the_probe_on_its_way() {
    for model in [Model::ur5e(), Model::seven_joint()] {
        let mut limits = limits(&model, 5.0, 100.0);
        let start = bent(&model);
        limits.upper[0] = start[0] + 0.05;
        if model.joints() == 7 {
            // The other joint that could turn the arm about its upright axis.
            limits.upper[2] = start[2] + 0.02;
            limits.lower[2] = start[2] - 0.02;
        }
        let mut walk = Walk::new(&model, start, limits, StepSettings::default());
        let outward = walk.way.from.translation.vector.xy();
        walk.way.along = Vector3::new(-outward.y, outward.x, 0.0).normalize();
        walk.speed = 0.05;
        let before = walk.ticks(3500).behind.place();
        walk.ticks(500).check(model.name());
        assert!(walk.behind.place() - before < 2e-3, "it goes on");
        let last = walk.seen[walk.seen.len() - 1];
        eprintln!(
            "{}: {last:?}, off {:e} m, {}",
            model.name(),
            walk.off,
            walk.stepper.limiter().position()[0] - start[0]
        );
        assert!(walk.off < 2e-3, "{}", walk.off);
        assert!(matches!(last.binding, Some(Binding::Joint { bound: JointBound::Position, .. })), "{last:?}");
        assert!(last.binding.unwrap().to_string().starts_with("joint "));
    }
}

#[test]
fn near_a_singularity_it_slows_down_along_its_way_and_says_so() {
    let model = Model::ur5e();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut least, mut slow, mut off) = (f64::INFINITY, 0, Vec::new());
    for case in 0..120 {
        // Wrist 2 near zero: its neighbours' axes nearly meet. The way turns the probe across.
        let mut start = bent(&model);
        start[4] = between(&mut rng, 0.15, 0.4);
        let mut walk = Walk::new(&model, start, limits(&model, 10.0, 200.0), StepSettings::default());
        walk.way = Way::some(&mut rng, walk.way.from);
        (walk.way.turn, walk.way.wave) = (walk.way.turn * 6.0, 0.2);
        walk.speed = between(&mut rng, 0.005, 0.02);
        walk.ticks(2500);
        walk.check(&format!("case {case}"));
        for row in walk.rows.iter().step_by(50) {
            let value = model.jacobian(row, &tool()).smallest_singular_value();
            least = least.min(value);
        }
        let held = walk.seen.iter().filter(|stepped| stepped.part < 0.9);
        slow += usize::from(held.clone().next().is_some());
        assert!(held.clone().all(|stepped| stepped.binding.is_some()), "case {case}: nothing was named");
        off.push((walk.off, case));
    }
    off.sort_by(|a, b| a.0.total_cmp(&b.0));
    eprintln!(
        "singular value {least:e}; {slow} of 120 slowed down; off the way {:e} m (median), at most {:?}",
        off[60].0,
        &off[110..]
    );
    assert!(slow > 15 && least > 1e-3, "{slow} {least}");
    // Nobody looked ahead here, as a plan's timing does: two of these ways turn into the singularity too sharply.
    assert!(off[60].0 < 1e-9 && off[117].0 < 1e-4 && off[119].0 < 1e-3, "{:?}", &off[117..]);
}

#[test]
fn what_a_seventh_joint_leaves_free_keeps_the_joints_further_from_their_limits() {
    let model = Model::seven_joint();
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let motion = limits(&model, 5.0, 100.0);
    let nearest = |walk: &Walk| {
        let last = walk.rows[walk.rows.len() - 1];
        let part = |joint: usize| {
            let (low, high) = (motion.lower[joint], motion.upper[joint]);
            (last[joint] - low).min(high - last[joint]) / (high - low)
        };
        (0..7).map(part).fold(f64::INFINITY, f64::min)
    };
    let (mut better, mut gained) = (0, 0.0);
    for _ in 0..60 {
        let mut start = Joints::zeros(7);
        for joint in 0..7 {
            let share = between(&mut rng, 0.1, 0.9);
            start[joint] = motion.lower[joint] + share * (motion.upper[joint] - motion.lower[joint]);
        }
        if model.jacobian(&start, &tool()).smallest_singular_value() < 0.05 {
            continue;
        }
        let mut way = Way::some(&mut rng, *(model.forward(&start) * tool()).isometry());
        way.turn *= 0.2;
        let [free, stiff] = [1.0, 0.0].map(|freedom| {
            let mut walk = Walk::new(&model, start, motion, StepSettings::default());
            (walk.way, walk.speed, walk.freedom) = (way, 0.01, freedom);
            walk.ticks(2500);
            walk.check("freedom");
            nearest(&walk)
        });
        better += i32::from(free > stiff + 1e-6) - i32::from(free < stiff - 1e-6);
        gained += free - stiff;
    }
    eprintln!("{better} more are further than nearer; {gained:.3} of a range gained in all");
    assert!(better >= 10 && gained > 0.3, "{better} {gained}");
}

#[test]
fn a_motion_that_no_joint_can_make_leaves_the_way_least_and_comes_back_without_a_jump() {
    for model in [Model::ur5e(), Model::seven_joint()] {
        let mut walk = Walk::new(&model, bent(&model), limits(&model, 5.0, 100.0), StepSettings::default());
        walk.ticks(500);
        // The contact jumps by 5 mm in a tick.
        walk.way.from.translation.vector.z -= 0.005;
        walk.ticks(1);
        let first = walk.seen[walk.seen.len() - 1];
        assert!(first.off.0 > 0.0045 && first.off.0 < 0.0051, "{first:?}");
        walk.ticks(2000);
        walk.check(model.name());
        let offs: Vec<f64> = walk.seen[500..].iter().map(|stepped| stepped.off.0).collect();
        eprintln!("{}: off {:e} after 0.2 s, {:e} after 1 s", model.name(), offs[100], offs[500]);
        assert!(offs[500] < 1e-6, "{}", offs[500]);
        assert!(offs.iter().all(|off| *off < 0.0065), "it went further off");
    }
}

#[test]
fn led_against_a_plane_it_slides_along_it() {
    let model = Model::ur5e();
    let start = bent(&model);
    let from = (model.forward(&start) * tool()).origin().vector();
    let settings = StepSettings {
        workspace: plane(from - Vector3::z() * 0.02, Vector3::z()),
        ..StepSettings::default()
    };
    let mut stepper =
        Stepper::at_rest(model.clone(), tool(), limits(&model, 5.0, 100.0), PERIOD, start, settings).unwrap();
    let mut speed = SpeedRamp::at_rest(0.5, 5.0);
    for _ in 0..1500 {
        let v = speed.step(0.04, DT);
        stepper.lead(&Vector6::from([0.0, v, -v, 0.0, 0.0, 0.0]), 0.0).unwrap();
        let probe = (model.forward(stepper.limiter().position()) * tool()).origin().vector();
        assert!(probe.z >= from.z - 0.02, "{}", probe.z);
    }
    let probe = (model.forward(stepper.limiter().position()) * tool()).origin().vector() - from;
    eprintln!("{probe:?}");
    assert!(probe.z < -0.018 && probe.y > 0.1 && probe.x.abs() < 0.005, "{probe:?}");
}

#[test]
fn what_is_no_number_is_refused_and_nothing_moves() {
    let model = Model::ur5e();
    let mut walk = Walk::new(&model, bent(&model), limits(&model, 5.0, 100.0), StepSettings::default());
    walk.ticks(100);
    let before = *walk.stepper.limiter().position();
    // FRAMES: a broken pose, made to be refused.
    let broken = Pose::assume(Isometry3::translation(f64::NAN, 0.0, 0.0));
    let goal = PathStep { still: walk.way.at(0.0, 0.0), ahead: broken, freedom: 1.0 };
    assert_eq!(walk.stepper.step(&goal), Err(StepError::NotFinite { what: "goal" }));
    let twist = Vector6::from([0.0, f64::INFINITY, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(walk.stepper.lead(&twist, 0.0), Err(StepError::NotFinite { what: "velocity" }));
    assert_eq!(*walk.stepper.limiter().position(), before);
    let settings = StepSettings { least_singular: f64::NAN, ..StepSettings::default() };
    let made = Stepper::at_rest(model.clone(), tool(), limits(&model, 5.0, 100.0), PERIOD, before, settings);
    assert!(matches!(made.map(drop), Err(StepError::Setting { name: "least singular value", .. })));
}

#[test]
fn brakes_and_commands_of_others_are_remembered() {
    let model = Model::ur5e();
    let mut walk = Walk::new(&model, bent(&model), limits(&model, 5.0, 100.0), StepSettings::default());
    walk.ticks(300);
    for _ in 0..500 {
        let position = walk.stepper.brake();
        walk.rows.push(position);
    }
    assert!(walk.stepper.limiter().is_at_rest());
    let here = walk.stepper.limiter().position().map(|q| q + 1e-9);
    walk.stepper.sent(&here).unwrap();
    walk.rows.push(here);
    walk.behind = Behind::at(walk.behind.place());
    (walk.s, walk.clock) = (walk.behind.place(), SpeedRamp::at_rest(0.2, 4.0));
    walk.ticks(500).check("after a brake");
}
