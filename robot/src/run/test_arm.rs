//! An arm of two joints that does what it is told, one tick late, and fails when it is told to.

use probepath_frames::{Probe, Span, Stamp, Wrench, nalgebra::Vector3};

use crate::{Arm, ArmFault, Command, Joints, MotionLimits, PointToPoint, Safety, State};

pub(crate) const PERIOD: Span = Span::from_milliseconds(2);

pub(crate) fn limits() -> MotionLimits {
    MotionLimits {
        lower: Joints::splat(2, -3.0),
        upper: Joints::splat(2, 3.0),
        velocity: Joints::splat(2, 1.0),
        acceleration: Joints::splat(2, 5.0),
        jerk: Joints::splat(2, 100.0),
    }
}

/// What goes wrong with the arm, and at which tick.
#[derive(Clone, Copy, Default)]
pub(crate) struct Fails {
    pub(crate) lost: Option<u64>,
    pub(crate) late: Option<u64>,
    pub(crate) frozen: Option<u64>,
    pub(crate) wrench_nan: Option<u64>,
    pub(crate) force: Option<(u64, f64)>,
    pub(crate) jump: Option<u64>,
    pub(crate) blocked: Option<u64>,
    /// The whole wrench from this tick on, with noise.
    pub(crate) wrench: Option<(u64, Wrench<Probe>)>,
    /// The sensor says the same from this tick on.
    pub(crate) hangs: Option<u64>,
    /// The safety system says something else from this tick on; unless it is reduced mode, the arm stops by itself.
    pub(crate) safety: Option<(u64, Safety)>,
    /// Every state is so old from this tick on.
    pub(crate) age: Option<(u64, Span)>,
    /// While it gives way, the hand moves every joint so fast (rad/s).
    pub(crate) hand: f64,
}

pub(crate) struct TestArm {
    pub(crate) state: State,
    pub(crate) fails: Fails,
    blocked_at: Option<Joints>,
    pub(crate) rows: Vec<(Command, State)>,
}

impl TestArm {
    pub(crate) fn new(fails: Fails) -> Self {
        let at = Joints::zeros(2);
        let state = State {
            tick: 0,
            stamp: Stamp::ZERO,
            position: at,
            velocity: at,
            commanded: at,
            wrench: Wrench::zero(),
            guiding: false,
            safety: Safety::Normal,
            age: Span::ZERO,
        };
        Self { state, fails, blocked_at: None, rows: Vec::new() }
    }

    fn since(&self, tick: Option<u64>) -> bool {
        tick.is_some_and(|tick| self.state.tick >= tick)
    }

    fn measure(&mut self) {
        let s = &mut self.state;
        s.velocity = s.commanded.zip(&s.position, |now, before| (now - before) / PERIOD.seconds());
        s.position = s.commanded;
        if self.since(self.fails.blocked) {
            self.state.position = *self.blocked_at.get_or_insert(self.state.position);
            self.state.velocity = Joints::zeros(2);
        }
        if self.since(self.fails.jump) {
            self.state.position[1] += 0.1;
        }
        if self.since(self.fails.wrench_nan) {
            self.state.wrench.force.y = f64::NAN;
        }
        if let Some((tick, age)) = self.fails.age {
            self.state.age = if self.state.tick >= tick { age } else { Span::ZERO };
        }
        self.feel();
    }

    fn feel(&mut self) {
        if let Some((tick, wrench)) = self.fails.wrench
            && !self.since(self.fails.hangs)
        {
            let noise = 1e-3 * (self.state.tick % 7) as f64;
            let quiet = Wrench::new(Vector3::new(noise, 0.0, 0.0), Vector3::zeros());
            self.state.wrench = if self.state.tick >= tick { wrench + quiet } else { quiet };
        }
        if let Some((tick, force)) = self.fails.force {
            let noise = 1e-6 * (self.state.tick % 7) as f64;
            let force = if self.state.tick >= tick { noise - force } else { 0.0 };
            self.state.wrench = Wrench::<Probe>::new(Vector3::new(0.0, 0.0, force), Vector3::zeros());
        }
    }
}

impl Arm for TestArm {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        if self.since(self.fails.lost) {
            return Err(ArmFault::ConnectionLost { tick: self.state.tick, why: "unplugged".into() });
        }
        if let Some((_, safety)) = self.fails.safety.filter(|(tick, _)| self.state.tick >= *tick) {
            self.state.safety = safety;
        }
        match command {
            Command::Position(position) if self.state.safety.lets_move() => self.state.commanded = *position,
            Command::Freedrive if self.state.safety.lets_move() => {
                let way = self.fails.hand * PERIOD.seconds();
                self.state.commanded = self.state.position.map(|q| q + way);
            }
            _ => {}
        }
        if !self.since(self.fails.frozen) {
            let late = self.fails.late == Some(self.state.tick);
            self.state.tick += if late { 10 } else { 1 };
            self.state.stamp = Stamp::from_nanoseconds(PERIOD.nanoseconds() * self.state.tick as i64);
            self.measure();
        }
        self.rows.push((*command, self.state));
        Ok(self.state)
    }

    fn period(&self) -> Span {
        PERIOD
    }

    fn joints(&self) -> usize {
        2
    }
}

pub(crate) fn there() -> PointToPoint {
    PointToPoint::plan(&Joints::zeros(2), &Joints::from_slice(&[1.0, -0.4]).unwrap(), &limits(), PERIOD)
        .unwrap()
}

/// Every command of the arm within the limits, as read back from its rows.
pub(crate) fn check(arm: &TestArm) {
    let (dt, limits) = (PERIOD.seconds(), limits());
    for joint in 0..2 {
        let positions: Vec<f64> = arm.rows.iter().map(|(_, state)| state.commanded[joint]).collect();
        for q in positions.windows(4) {
            let jerk = (((q[3] - q[2]) - (q[2] - q[1])) - ((q[2] - q[1]) - (q[1] - q[0]))).abs() / dt.powi(3);
            assert!((q[3] - q[2]).abs() / dt <= limits.velocity[joint]);
            assert!((q[3] - 2.0 * q[2] + q[1]).abs() / dt.powi(2) <= limits.acceleration[joint]);
            assert!(jerk <= limits.jerk[joint], "{jerk}");
        }
    }
}
