//! No step touches the heap: not a controller's, not the limits', the guard's, the black box's, nor the loop's own.
//!
//! The allocator ends the process at the first allocation inside [`assert_no_alloc`].

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use probepath_frames::nalgebra::{Isometry3, Vector3};
use probepath_frames::{Base, Direction, Flange, Point, Pose, Probe, Span, Stamp, Wrench};
use probepath_robot::*;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const PERIOD: Span = Span::from_milliseconds(2);

/// Does what it is told at once, and presses a little.
struct Ideal(State);

impl Ideal {
    fn at(joints: Joints) -> Self {
        Self(State {
            tick: 0,
            stamp: Stamp::ZERO,
            position: joints,
            velocity: Joints::zeros(joints.len()),
            commanded: joints,
            wrench: Wrench::<Probe>::new(Vector3::new(0.1, 0.0, -1.0), Vector3::zeros()),
            guiding: false,
            safety: Safety::Normal,
            age: Span::ZERO,
        })
    }
}

impl Arm for Ideal {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let state = &mut self.0;
        if let Command::Position(position) = command {
            state.velocity = position.zip(&state.position, |now, before| (now - before) / PERIOD.seconds());
            (state.position, state.commanded) = (*position, *position);
        }
        state.tick += 1;
        state.stamp = state.stamp + PERIOD;
        // Every sensor has noise; one without is taken for one that hangs.
        state.wrench.force.x = 0.1 + 1e-3 * (state.tick % 5) as f64;
        Ok(*state)
    }

    fn period(&self) -> Span {
        PERIOD
    }

    fn joints(&self) -> usize {
        self.0.position.len()
    }
}

fn limits(model: &Model) -> MotionLimits {
    let joints = model.joints();
    MotionLimits::of_model(model, Joints::splat(joints, 5.0), Joints::splat(joints, 100.0)).unwrap()
}

/// A share of the way from each joint's lower limit to its upper.
fn between(model: &Model, share: f64) -> Joints {
    let limits = limits(model);
    limits.lower.zip(&limits.upper, |lower, upper| lower + (upper - lower) * share)
}

fn guard(model: &Model) -> Guard {
    // FRAMES: a probe of 200 mm, straight out of the flange.
    let flange_from_probe = Pose::<Flange, Probe>::assume(Isometry3::translation(0.0, 0.0, 0.2));
    let table = Plane { through: Point::<Base>::new(0.0, 0.0, -2.0), inward: Direction::z() };
    let guard_limits = GuardLimits { free_speed_m_s: 5.0, ..GuardLimits::default() };
    Guard::new(guard_limits, limits(model))
        .unwrap()
        .within(Workspace::new().and(table), probe_place(model.clone(), flange_from_probe))
        .leaning_at_most(Tilt { upright: Direction::z(), most_rad: std::f64::consts::PI })
        .pressing_with(Face::default())
        .listening_to(Operator::new())
}

/// Runs the whole loop, brake and end included, with the allocator shut.
fn run_without_heap(model: &Model, controller: &mut dyn Controller, observer: &mut dyn Observer) -> Finished {
    let (mut arm, mut guard) = (Ideal::at(between(model, 0.4)), guard(model));
    let finished = assert_no_alloc(|| run(&mut arm, controller, &mut guard, observer));
    let finished = finished.unwrap();
    assert!(finished.ticks > 100, "only {} ticks were watched", finished.ticks);
    finished
}

#[test]
fn the_loop_and_every_motion_touch_no_heap() {
    for model in [Model::ur5e(), Model::seven_joint()] {
        let (start, target) = (between(&model, 0.4), between(&model, 0.6));
        let plan = || PointToPoint::plan(&start, &target, &limits(&model), PERIOD).unwrap();
        // More ticks than the black box holds, so that it goes round.
        run_without_heap(&model, &mut Hold::ticks(3000), &mut ());
        run_without_heap(&model, &mut plan(), &mut ());
        run_without_heap(&model, &mut Switch(plan(), 150), &mut ());
        let mut last = None;
        let mut watch = |tick: &Tick| {
            last = Some(*tick);
            Wish::GoOn
        };
        run_without_heap(&model, &mut plan(), &mut watch);
    }
}

/// Turns to a brake in full motion.
struct Switch(PointToPoint, u64);

impl Controller for Switch {
    fn step(&mut self, state: &State) -> Option<Command> {
        self.1 = self.1.checked_sub(1)?;
        if self.1 > 50 { self.0.step(state) } else { Brake::default().step(state) }
    }
}

#[test]
fn the_contact_law_and_the_limits_at_a_wall_touch_no_heap() {
    let mut law = ContactLaw::new(ContactSettings::default(), PERIOD).unwrap();
    let model = Model::ur5e();
    let mut limiter = Limiter::at_rest(limits(&model), PERIOD, Joints::zeros(6)).unwrap();
    assert_no_alloc(|| {
        let mut force = 0.0;
        for _ in 0..5000 {
            let offset = if force < 0.8 { law.step_at(0.008, force) } else { law.step(force, 5.0) };
            force = (1000.0 * (offset - 0.01)).max(0.0);
            let wall = limiter.position().map(|now| now + 0.1);
            limiter.limit(&wall).unwrap();
        }
    });
    assert!((law.force_n() - 5.0).abs() < 0.1, "{} N", law.force_n());
}

#[test]
fn a_step_along_a_path_with_six_and_seven_joints_touches_no_heap() {
    use probepath_robot::step::{Behind, PathStep, StepSettings, Stepper};
    // FRAMES: a probe of 150 mm, straight out of the flange.
    let flange_from_probe = Pose::<Flange, Probe>::assume(Isometry3::translation(0.0, 0.0, 0.15));
    for model in [Model::ur5e(), Model::seven_joint()] {
        let bent = Joints::from_slice(&[0.3, -0.8, 1.1, -1.6, 0.9, 1.4, 0.2][..model.joints()]).unwrap();
        let from = model.forward(&bent) * flange_from_probe;
        let x = from.origin().vector().x;
        // The way leads through a plane, so that it is slowed down too.
        let wall =
            Plane { through: Point::<Base>::new(x + 0.01, 0.0, 0.0), inward: Direction::x().reversed() };
        let settings = StepSettings { workspace: Workspace::new().and(wall), ..StepSettings::default() };
        let limits = limits(&model);
        let mut stepper = Stepper::at_rest(model, flange_from_probe, limits, PERIOD, bent, settings).unwrap();
        let (mut behind, mut clock, mut held) = (Behind::default(), 0.0, 0);
        assert_no_alloc(|| {
            for tick in 0..2000 {
                clock += behind.scale() * 2e-5 * (f64::from(tick) / 500.0).min(1.0);
                let (place, aim) = (behind.place(), behind.aim(clock, 0.002));
                let [still, ahead] = [place, aim].map(|s| {
                    let mut pose = *from.isometry();
                    pose.translation.vector.x += s;
                    // FRAMES: the probe where it began, moved along the base's x axis.
                    Pose::<Base, Probe>::assume(pose)
                });
                let stepped = stepper.step(&PathStep { still, ahead, freedom: 1.0 }).unwrap();
                behind.went(&stepped);
                held += i32::from(stepped.binding.is_some());
            }
        });
        assert!(held > 100, "{held}");
    }
}
