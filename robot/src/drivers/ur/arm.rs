//! [`UrArm`]: a UR e-series arm behind [`Arm`].

mod turn;

use std::time::{Duration, Instant};

use probepath_frames::{Span, Stamp};

use super::connect::{Connected, Established, establish, release};
use super::counts::UrCounts;
use super::dashboard::Dashboard;
use super::link::{Link, OLDER};
use super::measured::Measured;
use super::registers::{command, state};
use super::settings::TICK;
use super::words::Words;
use super::{UrError, UrSettings, clock, safety, signs};
use crate::{Arm, ArmFault, Command, Joints, State};

/// The sending times of so many sequence numbers are kept: 128 ms of them.
const KEPT: usize = 64;

/// A UR e-series arm on its wire.
///
/// ```no_run
/// use probepath_frames::nalgebra::{Isometry3, Vector3};
/// use probepath_frames::{Flange, Pose, Probe};
/// use probepath_robot::drivers::ur::{UrArm, UrSettings};
/// use probepath_robot::{Arm, Command, Model};
///
/// // FRAMES: the holder's drawing: the probe's face is 180 mm in front of the flange.
/// let flange_from_probe = Pose::<Flange, Probe>::assume(Isometry3::translation(0.0, 0.0, 0.18));
/// let settings = UrSettings::new(Model::ur5e(), flange_from_probe, 0.62, Vector3::new(0.0, 0.0, 0.07));
/// let mut arm = UrArm::connect("192.168.1.10", settings)?;
/// let state = arm.exchange(&Command::Stay)?;
/// println!("at {:?} rad", state.position);
/// # Ok::<(), probepath_robot::drivers::ur::UrError>(())
/// ```
///
/// An exchange sends the command and waits for the controller's next package, so the controller's clock paces the
/// loop; it touches no heap. [`State::stamp`] is the controller's clock, [`State::tick`] counts its ticks, so a package
/// that was skipped shows as a gap. After a fault every further exchange gives the same fault, until a person
/// has [recovered](Self::recover) the arm: that redoes everything from the first byte, and resumes nothing.
///
/// While the last command was [`Command::Stay`] nothing need be exchanged: the arm rests. While it moves, or gives way,
/// a silence of [`UrSettings::watchdog`] makes our script stop it.
#[derive(Debug)]
pub struct UrArm {
    host: String,
    settings: UrSettings,
    /// `None` once it is lost.
    link: Option<Link>,
    dashboard: Dashboard,
    words: Words,
    report: Connected,
    counts: UrCounts,
    sequence: i32,
    session: i32,
    last: Measured,
    /// The controller's ticks when we connected.
    first_tick: i64,
    /// When each of the last sequence numbers left.
    sent: [Instant; KEPT],
    /// When the last package was read, and when the receive buffer was last seen empty after an absence.
    heard: Instant,
    emptied: Option<Instant>,
    /// The shortest so far.
    round_trip: Duration,
    same_echo: u32,
    /// What the last exchange left commanded.
    commanded: Joints,
    /// What came together with the newest package, and is older.
    overtaken: Vec<State>,
    fault: Option<ArmFault>,
}

impl UrArm {
    /// Connects: versions, dashboard, recipes, readiness, our model against the controller's, our script, payload.
    ///
    /// # Errors
    /// When any of it is not as it has to be, in words; nothing moves in that case.
    pub fn connect(host: &str, settings: UrSettings) -> Result<Self, UrError> {
        let Established { link, dashboard, last, sequence, session, report } = establish(host, &settings)?;
        let now = clock::now();
        let counts = UrCounts { connections: 1, ..UrCounts::default() };
        Ok(Self {
            host: host.to_owned(),
            settings,
            link: Some(link),
            dashboard,
            words: Words::of(host),
            report,
            counts,
            sequence,
            session,
            last,
            first_tick: ticks(last.timestamp_s),
            sent: [now; KEPT],
            heard: now,
            emptied: None,
            round_trip: Duration::MAX,
            same_echo: 0,
            commanded: joints(&last.target),
            overtaken: Vec::with_capacity(OLDER),
            fault: None,
        })
    }

    /// On a person's word, to an arm that stopped by itself while nobody was connected: unlocks a protective stop, then
    /// connects.
    ///
    /// # Errors
    /// As [`connect`](Self::connect), or when a person has to do something at the arm first.
    pub fn connect_released(host: &str, settings: UrSettings) -> Result<Self, UrError> {
        settings.check()?;
        release(host)?;
        Self::connect(host, settings)
    }

    /// What was found out while connecting.
    pub const fn report(&self) -> &Connected {
        &self.report
    }

    /// What went over the wire, and what did not.
    pub const fn counts(&self) -> UrCounts {
        self.counts
    }

    /// Why it does not move any more.
    pub const fn fault(&self) -> Option<&ArmFault> {
        self.fault.as_ref()
    }

    /// On a person's word, after a fault: unlocks a protective stop, connects anew, sends our script, checks everything
    /// again. The arm is at rest then, and stays so: what was commanded before is forgotten.
    ///
    /// # Errors
    /// When there is no fault, or a person has to do something at the arm first.
    pub fn recover(&mut self) -> Result<State, UrError> {
        if self.fault.is_none() {
            return Err(UrError::NothingToRecover);
        }
        self.reconnect()
    }

    /// Connects anew, as [`recover`](Self::recover) does, whether there was a fault or not.
    ///
    /// # Errors
    /// As [`recover`](Self::recover); the fault stays then.
    pub fn reconnect(&mut self) -> Result<State, UrError> {
        let tick = self.tick();
        self.link = None;
        let why = "it is being connected anew".into();
        self.fault.get_or_insert(ArmFault::ConnectionLost { tick, why });
        release(&self.host)?;
        let Established { link, dashboard, last, sequence, session, report } =
            establish(&self.host, &self.settings)?;
        let now = clock::now();
        self.words = Words::of(&self.host);
        (self.link, self.dashboard, self.report, self.last) = (Some(link), dashboard, report, last);
        (self.sequence, self.session) = (sequence, session);
        (self.sent, self.heard, self.emptied, self.same_echo) = ([now; KEPT], now, None, 0);
        self.round_trip = Duration::MAX;
        // A controller that was switched off begins its clock anew.
        self.first_tick = self.first_tick.min(ticks(last.timestamp_s));
        self.fault = None;
        self.counts.connections += 1;
        self.commanded = joints(&last.target);
        Ok(self.state(self.commanded, Span::ZERO))
    }

    /// Shows words on the pendant. Not from within a motion: it waits for the dashboard.
    ///
    /// # Errors
    /// When the dashboard does not answer.
    pub fn popup(&mut self, words: &str) -> Result<(), UrError> {
        if self.dashboard.popup(words).is_err() {
            // A dashboard may have closed an idle connection.
            self.dashboard = Dashboard::connect(&self.host)?;
            return self.dashboard.popup(words);
        }
        Ok(())
    }

    /// Takes the words away.
    ///
    /// # Errors
    /// When the dashboard does not answer.
    pub fn close_popup(&mut self) -> Result<(), UrError> {
        if self.dashboard.close_popup().is_err() {
            self.dashboard = Dashboard::connect(&self.host)?;
            return self.dashboard.close_popup();
        }
        Ok(())
    }

    /// Zeroes the force sensor. Only with the probe in the air, which the caller knows and nobody here can.
    ///
    /// # Errors
    /// When the arm moves, or is pushed harder than any bias pushes: the probe is on something then.
    pub fn zero_sensor(&mut self) -> Result<(), UrError> {
        const STILL: f64 = 0.01;
        const BIAS_N: f64 = 15.0;
        let resting = self.exchange(&Command::Stay)?;
        let (speed, force_n) = (resting.velocity.largest(), resting.wrench.force.norm());
        let refused = |why| Err(UrError::NotZeroed { why });
        if speed.is_nan() || speed >= STILL || self.last.state != state::HOLDING {
            return refused(format!("the arm moves, its fastest joint at {speed:.3} rad/s"));
        }
        if force_n.is_nan() || force_n >= BIAS_N {
            return refused(format!("it reads {force_n:.1} N, more than a bias: lift the probe off"));
        }
        let (before, began) = (self.last.zeroed, clock::now());
        while self.last.zeroed == before {
            self.turn(command::ZERO, [0.0; 6])?;
            if began.elapsed() > Duration::from_secs(5) {
                return refused("the controller does not say that it did".into());
            }
        }
        while self.last.state != state::HOLDING {
            self.turn(command::STAY, [0.0; 6])?;
        }
        self.turn(command::STAY, [0.0; 6])?;
        Ok(())
    }

    /// The newest package as everybody else knows it.
    fn state(&self, commanded: Joints, age: Span) -> State {
        self.state_of(&self.last, commanded, age)
    }

    /// A package as everybody else knows it.
    fn state_of(&self, last: &Measured, commanded: Joints, age: Span) -> State {
        let position = joints(&last.position);
        let base_from_flange = self.settings.model.forward(&position);
        State {
            tick: self.tick_of(last),
            stamp: Stamp::from_nanoseconds((last.timestamp_s * 1e9).round() as i64),
            position,
            velocity: joints(&last.velocity),
            commanded,
            wrench: signs::wrench(&last.force, &base_from_flange, &self.settings.flange_from_probe),
            guiding: last.status_bits & safety::TEACH_BUTTON != 0,
            safety: safety::of_bits(last.safety_bits).0,
            age,
        }
    }

    /// The packages that came together with the newest, as everybody else knows them: older by their own stamps, and
    /// from before the command of this exchange.
    fn overtake(&mut self, newest: &State, commanded_before: Joints) {
        self.overtaken.clear();
        for n in 0..self.link.as_ref().map_or(0, |link| link.older.len()) {
            let Some(older) = self.link.as_ref().and_then(|link| link.older.get(n)) else { continue };
            let mut state = self.state_of(older, commanded_before, newest.age);
            let behind = (newest.stamp - state.stamp).nanoseconds();
            state.age = Span::from_nanoseconds(newest.age.nanoseconds().saturating_add(behind));
            let known = state.position.iter().all(|q| q.is_finite()) && state.tick < newest.tick;
            // The room was asked for while connecting.
            if known && self.overtaken.len() < OLDER {
                self.overtaken.push(state);
            }
        }
    }

    /// The command for the script, or why it is none.
    fn understood(&self, command: &Command) -> Result<(i32, [f64; 6]), ArmFault> {
        let Command::Position(next) = command else {
            let code = if *command == Command::Freedrive { command::FREEDRIVE } else { command::STAY };
            return Ok((code, [0.0; 6]));
        };
        let tick = self.tick() + 1;
        let refused = |why| ArmFault::Refused { tick, why };
        let setpoint: [f64; 6] = next
            .as_slice()
            .try_into()
            .map_err(|_| refused(format!("it has {} joints and the arm has 6", next.len())))?;
        if let Some(joint) = next.iter().position(|q| !q.is_finite()) {
            let why = format!("joint {joint} is {}; send a finite position", next[joint]);
            return Err(refused(why));
        }
        Ok((command::SERVO, setpoint))
    }
}

impl Arm for UrArm {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        self.overtaken.clear();
        let before = self.commanded;
        if let Some(fault) = &self.fault {
            let fault = fault.clone();
            self.last_word();
            return Err(fault);
        }
        match self.understood(command) {
            Ok((code, setpoint)) => self.turn(code, setpoint)?,
            Err(refused) => {
                self.turn(command::STAY, [0.0; 6])?;
                return Err(refused);
            }
        }
        let commanded = match command {
            Command::Position(next) => *next,
            Command::Freedrive => joints(&self.last.position),
            Command::Stay => joints(&self.last.target),
        };
        let age = self.age();
        let state = self.state(commanded, age);
        self.overtake(&state, before);
        self.commanded = commanded;
        Ok(state)
    }

    fn overtaken(&self) -> &[State] {
        &self.overtaken
    }

    fn period(&self) -> Span {
        TICK
    }

    fn joints(&self) -> usize {
        6
    }
}

impl Drop for UrArm {
    fn drop(&mut self) {
        self.last_word();
    }
}

/// The controller's ticks at a time of its clock.
fn ticks(timestamp_s: f64) -> i64 {
    (timestamp_s / TICK.seconds()).round() as i64
}

fn joints(values: &[f64; 6]) -> Joints {
    let mut all = Joints::zeros(6);
    for (to, from) in all.as_mut_slice().iter_mut().zip(values) {
        *to = *from;
    }
    all
}
