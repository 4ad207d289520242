//! ur_rtde's control script (1.6.5), emulated: its command loop over the registers.
//!
//! Command register `input_int_register_0`, arguments in the doubles and the other integers, `output_int_register_0`
//! is 1 (ready) or 2 (done). Commands that are streamed are carried out in every cycle and answered with 1; any other
//! is carried out once, answered with 2 when it is over, and the command has to return to 0 before the next.

mod commands;
mod path;

pub(in crate::controller) use commands::{joints, numbers};

use super::Cycle;
use crate::controller::robot::motion::Motion;
use crate::controller::robot::{Robot, force::ForceMode};
use path::PathStep;

/// Commands of the real-time loop: answered with 1 at once.
const STREAMED: [i32; 16] = [6, 9, 10, 11, 24, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71];
const READY: i32 = 1;
const DONE: i32 = 2;

/// The script's state.
#[derive(Clone, Debug)]
pub(in crate::controller) struct UrRtde {
    /// 24 with the upper range of registers, else 0.
    offset: usize,
    executing: bool,
    waiting: bool,
    /// What a whole path still has to do.
    path: Vec<PathStep>,
    uploaded_path: Vec<PathStep>,
    force: Option<ForceMode>,
    /// 0 speedL, 1 speedJ: what speedStop stops.
    speed_kind: i32,
    /// A move or stop that the client does not wait for.
    background: bool,
    writes: i32,
    operations: i32,
    /// Lowest rate at which the command register has to be written (Hz).
    watchdog_hz: Option<f64>,
    contact: Contact,
}

/// Contact detection, as a thread of the script and as a move.
#[derive(Clone, Copy, Debug, Default)]
struct Contact {
    watching: bool,
    /// Ticks since it was felt, when it was.
    felt: Option<i32>,
    moving: bool,
}

/// What a command leaves the loop to do.
enum After {
    Done,
    Wait,
    End(String),
}

impl UrRtde {
    /// The script as it was uploaded: its text says which registers, and holds the path of `moveJ(path)`.
    pub(in crate::controller) fn of(text: &str) -> Self {
        let upper = text
            .lines()
            .any(|line| line.trim_start().starts_with("global reg_offset_int") && line.contains("24"));
        Self {
            offset: if upper { 24 } else { 0 },
            executing: false,
            waiting: false,
            path: Vec::new(),
            uploaded_path: path::of(text),
            force: None,
            speed_kind: 0,
            background: false,
            writes: 0,
            operations: 0,
            watchdog_hz: None,
            contact: Contact::default(),
        }
    }

    /// Its first register.
    pub(in crate::controller) const fn offset(&self) -> usize {
        self.offset
    }

    /// What it does before its loop: force mode's defaults, the progress register, "ready".
    pub(in crate::controller) fn begin(&mut self, cycle: &mut Cycle<'_>) {
        cycle.robot.force_gain = 0.5;
        cycle.robot.force_damping = 0.025;
        self.progress(cycle, None);
        cycle.output.set_int(self.offset, READY);
    }

    /// One cycle; why it ended, when it did.
    pub(in crate::controller) fn tick(&mut self, cycle: &mut Cycle<'_>) -> Option<String> {
        self.threads(cycle);
        if self.waiting {
            self.wait(cycle);
            return None;
        }
        let command = cycle.input.int(self.offset);
        if STREAMED.contains(&command) {
            let after = self.perform(command, cycle);
            cycle.output.set_int(self.offset, READY);
            return ended(after);
        }
        if command == 0 {
            self.executing = false;
            cycle.output.set_int(self.offset, READY);
        } else if !self.executing {
            self.executing = true;
            match self.perform(command, cycle) {
                After::Done => cycle.output.set_int(self.offset, DONE),
                After::Wait => self.waiting = true,
                After::End(why) => return Some(why),
            }
        }
        None
    }

    /// `rtde_set_watchdog`: the client has to write the command register often enough.
    pub(in crate::controller) fn watchdog(&self) -> Option<(usize, f64)> {
        self.watchdog_hz.map(|hz| (self.offset, hz))
    }

    /// What runs beside the loop: force mode is said again in every cycle, a contact is felt for, a move ends.
    fn threads(&mut self, cycle: &mut Cycle<'_>) {
        if let Some(force) = &self.force {
            cycle.robot.force_mode(force.clone());
        }
        self.feel(cycle);
        if self.background && self.path_is_done(cycle) {
            self.background = false;
            self.progress(cycle, None);
        }
    }

    fn feel(&mut self, cycle: &mut Cycle<'_>) {
        if !self.contact.watching && !self.contact.moving {
            return;
        }
        let touched = commands::touches(cycle.robot);
        self.contact.felt = match (touched, self.contact.felt) {
            (false, None) => None,
            (_, felt) => Some(felt.unwrap_or(0).saturating_add(1)),
        };
        if self.contact.moving && self.contact.felt.is_some() {
            self.contact.moving = false;
            cycle.robot.go(Motion::StopTool { deceleration: 3.0 });
        }
    }

    /// A command that takes its time: done when nothing moves any more.
    fn wait(&mut self, cycle: &mut Cycle<'_>) {
        if !self.contact.moving && self.path_is_done(cycle) {
            self.waiting = false;
            cycle.output.set_int(self.offset, DONE);
        }
    }

    /// The next step of a path, when there is one and the last is over.
    fn path_is_done(&mut self, cycle: &mut Cycle<'_>) -> bool {
        if cycle.robot.is_busy() {
            return false;
        }
        if self.path.is_empty() {
            return true;
        }
        let step = self.path.remove(0);
        step.begin(cycle.robot);
        false
    }

    /// The progress of what nobody waits for: counters of writes and of operations, bit 15 while it runs.
    fn progress(&mut self, cycle: &mut Cycle<'_>, running: Option<i32>) {
        self.writes = (self.writes + 1) % 128;
        if running == Some(0) {
            self.operations = (self.operations + 1) % 128;
        }
        let state = running.map_or(0, |value| value.clamp(0, 32767) + 32768);
        cycle.output.set_int(self.offset + 2, self.writes * 65536 + self.operations * 16_777_216 + state);
    }

    /// A move, waited for or not.
    fn begin_move(&mut self, cycle: &mut Cycle<'_>, begin: impl FnOnce(&mut Robot)) -> After {
        self.path.clear();
        begin(cycle.robot);
        if cycle.input.int(self.offset + 1) == 1 {
            self.background = true;
            self.progress(cycle, Some(0));
            return After::Done;
        }
        self.background = false;
        After::Wait
    }
}

fn ended(after: After) -> Option<String> {
    match after {
        After::End(why) => Some(why),
        _ => None,
    }
}
