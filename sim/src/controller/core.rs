//! [`Controller`]: everything behind the sockets, without one: registers, program, robot, pendant.

use probepath_frames::{Span, Stamp};
use serde::{Deserialize, Serialize};

use super::config::{ControllerConfig, Helper};
use super::program::{Cycle, Hung, Program, TICKS_PER_S};
use super::registers::{Bank, COUNT};
use super::robot::Robot;
use super::robot::safety::{Power, Safety};
use crate::cell::{SimulatedCell, TICK};
use crate::knobs::Ticks;

/// The clock shows at least this at the start: the official client library waits for 40 s.
const CLOCK_AT_LEAST: Span = Span::from_milliseconds(60_000);
/// Ticks that a person waits for what holds the arm, in simulated time.
const LONGEST_WAIT: u32 = 30_000;
/// Words that are kept of a popup.
const LONGEST_POPUP: usize = 500;

/// `runtime_state`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Runtime {
    Stopped = 1,
    Playing = 2,
    Paused = 4,
}

/// Digital and analog outputs, as clients set them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Io {
    pub(super) digital_outputs: u64,
    pub(super) analog_outputs: [f64; 2],
    pub(super) analog_types: u32,
}

/// What happened, for tests and for people.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Counters {
    /// Ticks since the start.
    pub ticks: u64,
    /// Data packages that left.
    pub packages: u64,
    /// Data packages that a slow client or a knob made it skip.
    pub skipped: u64,
    /// Input packages that came.
    pub inputs: u64,
    /// How often the clock fell behind the machine's (wall time).
    pub slips: u64,
    /// RTDE connections that were accepted.
    pub rtde_clients: u64,
    /// Scripts that were recognised and started.
    pub scripts: u64,
    /// Scripts that were refused.
    pub refused_scripts: u64,
}

/// Everything behind the sockets.
#[derive(Debug)]
pub(super) struct Controller {
    pub(super) config: ControllerConfig,
    pub(super) cell: SimulatedCell,
    pub(super) robot: Robot,
    pub(super) input: Bank,
    pub(super) written: [u64; COUNT],
    pub(super) output: Bank,
    pub(super) io: Io,
    pub(super) runtime: Runtime,
    pub(super) popup: Option<String>,
    pub(super) loaded: Option<String>,
    pub(super) counters: Counters,
    /// Why the last program ended.
    pub(super) ended: String,
    program: Option<Program>,
    stopped_at: Stamp,
    /// Whether the hand took the probe because freedrive began.
    guided_free: bool,
}

impl Controller {
    pub(super) fn new(cell: SimulatedCell, config: ControllerConfig) -> Self {
        let scene = cell.shared();
        scene.lock().start_clock_at(Stamp::ZERO + CLOCK_AT_LEAST);
        let mut robot = Robot::new(scene, cell.nominal());
        if !config.powered {
            robot.power = Power::Off;
        }
        Self {
            config,
            robot,
            cell,
            input: Bank::default(),
            written: [0; COUNT],
            output: Bank::default(),
            io: Io::default(),
            runtime: Runtime::Stopped,
            popup: None,
            loaded: None,
            counters: Counters::default(),
            ended: String::new(),
            program: None,
            stopped_at: Stamp::ZERO,
            guided_free: false,
        }
    }

    /// The controller's clock.
    pub(super) fn now(&self) -> Stamp {
        self.cell.now()
    }

    /// One tick of 2 ms.
    pub(super) fn tick(&mut self) {
        self.counters.ticks += 1;
        self.turn_knobs();
        self.run_program();
        let before = self.robot.safety;
        self.robot.tick();
        self.look_after(before);
        self.lend_a_hand();
        if let Some(seconds) = self.config.remembers_s {
            self.cell.shared().lock().forget_before((seconds * TICKS_PER_S) as usize);
        }
    }

    fn knob(&self, ticks: Option<Ticks>) -> bool {
        ticks.is_some_and(|ticks| ticks.has(self.counters.ticks))
    }

    /// What the knobs do at this tick.
    fn turn_knobs(&mut self) {
        let knobs = &self.config.knobs;
        let stop = knobs.protective_stop_at_tick == Some(self.counters.ticks);
        let (emergency, safeguard) = (self.knob(knobs.emergency_stop), self.knob(knobs.safeguard_stop));
        let reduced = self.knob(knobs.reduced);
        if stop {
            self.robot.protective_stop("the controller's own supervision (knob)".into());
            self.fall(Safety::ProtectiveStop);
        }
        match self.robot.safety {
            Safety::EmergencyStop if !emergency => self.robot.safety = Safety::Normal,
            Safety::SafeguardStop if !safeguard => self.robot.safety = Safety::Normal,
            Safety::Reduced if !reduced => self.robot.safety = Safety::Normal,
            Safety::EmergencyStop => {}
            _ if emergency => self.fall(Safety::EmergencyStop),
            Safety::Normal | Safety::Reduced if safeguard => self.fall(Safety::SafeguardStop),
            Safety::Normal if reduced => self.robot.safety = Safety::Reduced,
            _ => {}
        }
    }

    /// The arm may not move any more.
    fn fall(&mut self, to: Safety) {
        self.robot.safety = to;
        self.robot.halt();
        self.stopped_at = self.now();
        match to {
            Safety::SafeguardStop if self.program.is_some() => self.runtime = Runtime::Paused,
            Safety::SafeguardStop => {}
            Safety::EmergencyStop => {
                self.robot.power = Power::Off;
                self.end_program("an emergency stop");
            }
            _ => {
                let why = self.robot.why.clone();
                self.end_program(&why);
            }
        }
    }

    fn run_program(&mut self) {
        let running = self.runtime == Runtime::Playing && self.robot.safety.moves();
        let Some(mut program) = self.program.take_if(|_| running) else { return };
        let before = program.watchdog();
        let why = self.unfed(&program).or_else(|| program.tick(&mut self.cycle()));
        if before.is_none() {
            // A watchdog that was set just now begins to count.
            let tick = self.counters.ticks;
            self.written.iter_mut().for_each(|written| *written = tick);
        }
        self.program = Some(program);
        if let Some(why) = why {
            self.stop(&why);
        }
    }

    /// `rtde_set_watchdog`: the client has to write its register often enough.
    fn unfed(&self, program: &Program) -> Option<String> {
        let (register, hz) = program.watchdog()?;
        let most = (TICKS_PER_S / hz).ceil() as u64 + 1;
        let silent = self.counters.ticks.saturating_sub(*self.written.get(register)?);
        let why = || format!("its watchdog of {hz} Hz: nothing was written for {silent} ticks");
        (silent > most).then(why)
    }

    fn cycle(&mut self) -> Cycle<'_> {
        let knobs = &self.config.knobs;
        let hung = Hung { reader: self.knob(knobs.reader_hangs), mover: self.knob(knobs.mover_hangs) };
        Cycle { input: &self.input, output: &mut self.output, robot: &mut self.robot, hung }
    }

    /// A stop that the program or the arm itself brought about.
    fn look_after(&mut self, before: Safety) {
        if self.robot.safety == Safety::ProtectiveStop
            && (before != self.robot.safety || self.program.is_some())
        {
            self.fall(Safety::ProtectiveStop);
        }
    }

    /// The hand takes the probe when freedrive begins, and lets go when it ends.
    fn lend_a_hand(&mut self) {
        if self.robot.is_free() && !self.guided_free {
            self.guided_free = true;
            self.guide();
        }
        if !self.robot.is_free() && self.guided_free {
            self.guided_free = false;
            self.cell.hand().let_go();
        }
    }

    fn guide(&self) {
        if self.config.hand == Helper::Guides && !self.cell.hand().guides() {
            self.cell.hand().guide();
        }
    }

    /// Whether the teach button is held.
    pub(super) fn teach_button(&self) -> bool {
        self.cell.hand().guides() || self.knob(self.config.knobs.teach_button)
    }

    /// A script came. Whether it was one to run, and may run.
    pub(super) fn upload(&mut self, text: &[u8]) -> bool {
        let Some(mut program) = Program::of(text) else {
            self.counters.refused_scripts += 1;
            return false;
        };
        if self.robot.power != Power::Running || !self.robot.safety.moves() {
            self.counters.refused_scripts += 1;
            return false;
        }
        if self.program.is_some() {
            self.end_program("another script came");
            self.robot.halt();
        }
        let tick = self.counters.ticks;
        self.written.iter_mut().for_each(|written| *written = tick);
        program.begin(&mut self.cycle());
        self.program = Some(program);
        self.runtime = Runtime::Playing;
        self.counters.scripts += 1;
        true
    }

    /// Ends the program, for a reason.
    pub(super) fn end_program(&mut self, why: &str) {
        if self.program.take().is_some() {
            self.ended = why.to_owned();
        }
        self.runtime = Runtime::Stopped;
        self.robot.stiffen();
    }

    /// Stops program and arm.
    pub(super) fn stop(&mut self, why: &str) {
        self.end_program(why);
        self.robot.halt();
    }

    pub(super) fn pause(&mut self) {
        if self.runtime == Runtime::Playing {
            self.runtime = Runtime::Paused;
            self.robot.halt();
        }
    }

    /// Goes on with a paused program.
    pub(super) fn play(&mut self) -> bool {
        let may = self.runtime == Runtime::Paused && self.robot.safety.moves();
        if may {
            self.runtime = Runtime::Playing;
        }
        may
    }

    pub(super) fn program_name(&self) -> Option<&'static str> {
        self.program.as_ref().map(Program::name)
    }

    /// Which integer input paces the program in simulated time, while there is one.
    pub(super) fn pulse(&self) -> Option<usize> {
        self.program.as_ref().map(Program::pulse)
    }

    /// Whether something has still to come to its end with nobody there: a motion, a watchdog that was set.
    pub(super) fn is_unsettled(&self) -> bool {
        self.is_moving() || self.program.as_ref().is_some_and(|program| program.watchdog().is_some())
    }

    /// In simulated time the person who comes to the pendant does so when whatever held the arm is over.
    pub(super) fn wait_out(&mut self) {
        let held = |c: &Self| {
            c.knob(c.config.knobs.emergency_stop) || c.knob(c.config.knobs.safeguard_stop) || c.is_moving()
        };
        if self.config.time == super::Time::Wall || self.robot.safety.moves() {
            return;
        }
        for _ in 0..LONGEST_WAIT {
            self.tick();
            if self.robot.safety.moves() || !held(self) {
                return;
            }
        }
    }

    /// A popup on the pendant. The person there reads it.
    pub(super) fn show(&mut self, text: &str) {
        self.popup = Some(text.chars().take(LONGEST_POPUP).collect());
        if asks_to_guide(text) {
            self.guide();
        }
    }

    /// Unlocks a protective stop, when it is time; in simulated time the person waits until it is.
    pub(super) fn unlock(&mut self) -> bool {
        if self.robot.safety != Safety::ProtectiveStop {
            return true;
        }
        let until = self.stopped_at + Span::from_seconds(self.config.unlock_after_s);
        while self.config.time == super::Time::Simulated && self.now() < until {
            self.tick();
        }
        if self.now() < until {
            return false;
        }
        self.robot.safety = Safety::Normal;
        true
    }

    /// Whether time goes on although nobody asks: something still moves.
    pub(super) fn is_moving(&self) -> bool {
        !self.robot.is_at_rest()
    }

    /// Ticks of the clock: what a lower rate of packages counts.
    pub(super) fn clock_ticks(&self) -> i64 {
        (self.now() - Stamp::ZERO).nanoseconds() / TICK.nanoseconds()
    }
}

/// Whether a popup asks the person at the pendant to guide the probe.
fn asks_to_guide(text: &str) -> bool {
    text.to_lowercase().contains("guide")
}
