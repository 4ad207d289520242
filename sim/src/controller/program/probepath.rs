//! probepath's own script, emulated line by line: `robot/src/drivers/ur/probepath.script`.
//!
//! Its two threads are two functions here, each a turn a tick: the reader first, then the mover. A `stopj` holds the
//! mover until the arm stands.

use nalgebra::UnitQuaternion;
use probepath_robot::drivers::ur::registers::{self, command, state};
use probepath_robot::drivers::ur::script::Parameters;

use super::Cycle;
use super::ur_rtde::{joints, numbers};
use crate::controller::robot::motion::Motion;
use crate::controller::robot::reading::Payload;

/// `pp_decel` (rad/s²) and `pp_far` (rad).
const DECELERATION: f64 = 8.0;
const FAR: f64 = 0.1;
/// Lines that this emulation counts on; a text without them is another script.
const LINES: [&str; 4] = [
    "\n  global PP_PROTOCOL = 1\n",
    "\n  global pp_decel = 8.0\n",
    "\n  global pp_far = 0.1\n",
    "\n  set_tcp(p[0, 0, 0, 0, 0, 0])\n",
];
/// Ticks that a stop of the mover may take.
const LONGEST_STOP: u32 = 500;

/// The script's globals and the places where its threads wait.
#[derive(Clone, Debug)]
pub(in crate::controller) struct Own {
    given: Parameters,
    want: i32,
    q: [f64; 6],
    doing: i32,
    zeroed: i32,
    bad: i32,
    reads: u64,
    reads_seen: u64,
    reads_old: u32,
    moves: u64,
    moves_seen: u64,
    moves_old: u32,
    session: i32,
    seq: i32,
    quiet: u32,
    zero_asked: bool,
    stopping: Option<Then>,
    netted: bool,
}

/// What the mover does after its `stopj`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Then {
    Hold,
    GiveWay,
    GoOn,
    Halt,
}

impl Own {
    /// The script of a text; `None` when it is another than the one that is emulated.
    pub(in crate::controller) fn of(text: &str) -> Option<Self> {
        let given = Parameters::read(text).filter(|_| LINES.iter().all(|line| text.contains(line)))?;
        Some(Self {
            given,
            want: command::STAY,
            q: [0.0; 6],
            doing: state::HOLDING,
            zeroed: 0,
            bad: 0,
            reads: 0,
            reads_seen: 0,
            reads_old: 0,
            moves: 0,
            moves_seen: 0,
            moves_old: 0,
            session: 0,
            seq: 0,
            quiet: 0,
            zero_asked: false,
            stopping: None,
            netted: false,
        })
    }

    /// Before the threads run: the tool, the first words.
    pub(in crate::controller) fn begin(&mut self, cycle: &mut Cycle<'_>) {
        let Parameters { mass_kg, centre_of_gravity_m: centre_m, .. } = self.given;
        cycle.robot.carry(Payload { mass_kg, centre_m });
        cycle.robot.arm.tcp = nalgebra::Isometry3::identity();
        self.q = numbers(cycle.robot.target().0);
        self.seq = input(cycle, registers::IN_SEQUENCE);
        say(cycle, registers::OUT_PROTOCOL, registers::PROTOCOL);
        say(cycle, registers::OUT_SEQUENCE, self.seq);
        say(cycle, registers::OUT_STATE, state::WAITING);
        say(cycle, registers::OUT_SESSION, 0);
        say(cycle, registers::OUT_ZEROED, 0);
    }

    /// Which integer input its client writes in every tick.
    pub(in crate::controller) const fn pulse() -> usize {
        registers::IN_SEQUENCE as usize
    }

    /// `rtde_set_watchdog` while it is set: which integer input, and how often a second at least.
    pub(in crate::controller) fn watchdog(&self) -> Option<(usize, f64)> {
        self.netted.then_some((Self::pulse(), self.given.watchdog_hz))
    }

    /// One tick of both threads; why the program ended, when it did.
    pub(in crate::controller) fn tick(&mut self, cycle: &mut Cycle<'_>) -> Option<String> {
        let ended = if cycle.hung.reader { None } else { self.read(cycle) };
        if ended.is_some() || cycle.hung.mover {
            return ended;
        }
        self.moving(cycle)
    }

    /// The reader's turn.
    fn read(&mut self, cycle: &mut Cycle<'_>) -> Option<String> {
        self.reads += 1;
        let asked = input(cycle, registers::IN_COMMAND);
        self.watch_the_host(cycle, asked);
        let going = self.decide(cycle, asked);
        if asked != command::ZERO {
            self.zero_asked = false;
        }
        self.report(cycle);
        self.spread_the_net();
        if self.mover_hangs() {
            say(cycle, registers::OUT_STATE, state::HUNG);
            cycle.robot.stiffen();
            cycle.robot.go(Motion::Stop { deceleration: DECELERATION });
            return Some("the thread that moves the arm hung".into());
        }
        (!going).then(|| "the client ended it".into())
    }

    /// The watchdog, and the handshake.
    fn watch_the_host(&mut self, cycle: &Cycle<'_>, asked: i32) {
        let seq = input(cycle, registers::IN_SEQUENCE);
        self.quiet = if seq == self.seq { self.quiet.saturating_add(1) } else { 0 };
        self.seq = seq;
        if self.quiet > self.given.watchdog_ticks && self.want != command::STAY {
            self.bad = state::TIMED_OUT;
        }
        let session = input(cycle, registers::IN_SESSION);
        if asked == command::HELLO && session != self.session && self.doing == state::HOLDING {
            (self.session, self.bad, self.quiet) = (session, 0, 0);
        }
    }

    /// What the mover shall do; whether the program goes on.
    fn decide(&mut self, cycle: &Cycle<'_>, asked: i32) -> bool {
        let mut going = true;
        if self.session == 0 || self.bad != 0 {
            self.want = command::STAY;
        } else if asked == command::SERVO {
            self.q = cycle.input.six(registers::IN_SETPOINT as usize);
            self.want = command::SERVO;
        } else if asked == command::FREEDRIVE {
            self.want = command::FREEDRIVE;
        } else if asked == command::ZERO {
            if self.doing == state::HOLDING && !self.zero_asked {
                self.zero_asked = true;
                self.want = command::ZERO;
            }
        } else {
            self.want = command::STAY;
            going = !(asked == command::END && self.doing == state::HOLDING);
        }
        going
    }

    fn report(&self, cycle: &mut Cycle<'_>) {
        say(cycle, registers::OUT_SEQUENCE, self.seq);
        say(cycle, registers::OUT_ZEROED, self.zeroed);
        say(cycle, registers::OUT_SESSION, self.session);
        let doing = match (self.bad, self.session) {
            (0, 0) => state::WAITING,
            (0, _) => self.doing,
            (bad, _) => bad,
        };
        say(cycle, registers::OUT_STATE, doing);
    }

    /// The controller's own watchdog is set whenever the arm may move.
    fn spread_the_net(&mut self) {
        if self.want != command::STAY {
            self.netted = true;
        } else if self.doing == state::HOLDING {
            self.netted = false;
        }
    }

    fn mover_hangs(&mut self) -> bool {
        self.moves_old = if self.moves == self.moves_seen { self.moves_old + 1 } else { 0 };
        self.moves_seen = self.moves;
        self.moves_old > LONGEST_STOP
            || (self.moves_old > self.given.watchdog_ticks && self.doing == state::SERVOING)
    }

    fn reader_lives(&mut self) -> bool {
        self.reads_old = if self.reads == self.reads_seen { self.reads_old + 1 } else { 0 };
        self.reads_seen = self.reads;
        self.reads_old < self.given.watchdog_ticks
    }

    /// The mover's turn.
    fn moving(&mut self, cycle: &mut Cycle<'_>) -> Option<String> {
        if let Some(then) = self.stopping {
            if cycle.robot.is_busy() {
                return None;
            }
            self.stopping = None;
            if then != Then::GoOn {
                return self.after_stop(then, cycle);
            }
        }
        if !self.reader_lives() {
            cycle.robot.stiffen();
            self.stop(cycle, Then::Halt);
            return None;
        }
        self.moves += 1;
        if self.want == command::SERVO {
            if self.doing == state::FREEDRIVE {
                cycle.robot.stiffen();
                self.doing = state::BUSY;
                self.stop(cycle, Then::GoOn);
                return None;
            }
            if self.is_close(cycle) {
                self.doing = state::SERVOING;
                let lag_s = cycle.robot.servo_lag_s(self.given.lookahead_s, self.given.gain);
                cycle.robot.go(Motion::Servo { target: joints(&self.q), lag_s });
                return None;
            }
            // The script's loop goes round at once, and stops.
            (self.bad, self.want) = (state::REFUSED, command::STAY);
        }
        if self.want == command::FREEDRIVE {
            self.give_way(cycle)
        } else {
            self.hold(cycle)
        }
        None
    }

    fn is_close(&self, cycle: &Cycle<'_>) -> bool {
        let target = numbers(cycle.robot.target().0);
        self.q.iter().zip(target).all(|(q, target)| (q - target).abs() < FAR)
    }

    fn stop(&mut self, cycle: &mut Cycle<'_>, then: Then) {
        cycle.robot.go(Motion::Stop { deceleration: DECELERATION });
        self.stopping = Some(then);
    }

    fn give_way(&mut self, cycle: &mut Cycle<'_>) {
        match self.doing {
            state::FREEDRIVE => {}
            state::SERVOING => self.stop(cycle, Then::GiveWay),
            _ => self.be_free(cycle),
        }
    }

    fn be_free(&mut self, cycle: &mut Cycle<'_>) {
        cycle.robot.freedrive(UnitQuaternion::identity(), [true; 6]);
        self.doing = state::FREEDRIVE;
    }

    fn hold(&mut self, cycle: &mut Cycle<'_>) {
        if matches!(self.doing, state::SERVOING | state::FREEDRIVE) {
            if self.doing == state::FREEDRIVE {
                cycle.robot.stiffen();
            }
            self.doing = state::BUSY;
            return self.stop(cycle, Then::Hold);
        }
        self.zero_or_rest(cycle);
    }

    fn zero_or_rest(&mut self, cycle: &mut Cycle<'_>) {
        if self.want == command::ZERO {
            cycle.robot.zero_force();
            self.zeroed += 1;
            self.want = command::STAY;
        }
        self.doing = state::HOLDING;
    }

    fn after_stop(&mut self, then: Then, cycle: &mut Cycle<'_>) -> Option<String> {
        match then {
            Then::Hold | Then::GoOn => self.zero_or_rest(cycle),
            Then::GiveWay => self.be_free(cycle),
            Then::Halt => return Some("the thread that reads the registers hung".into()),
        }
        None
    }
}

fn input(cycle: &Cycle<'_>, register: u32) -> i32 {
    cycle.input.int(register as usize)
}

fn say(cycle: &mut Cycle<'_>, register: u32, value: i32) {
    cycle.output.set_int(register as usize, value);
}
