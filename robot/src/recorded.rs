//! [`RecordedArm`]: an arm that reads its states from a recording, and compares every command with the one recorded.

use probepath_frames::Span;

use crate::{Arm, ArmFault, Command, State};

/// One tick of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The command that went out.
    pub command: Command,
    /// The state that came back.
    pub state: State,
    /// Whether a newer state came with it ([`Arm::overtaken`]): the next row is of the same exchange.
    pub overtaken: bool,
}

impl From<(Command, State)> for Row {
    /// A row of an exchange that brought one state.
    fn from((command, state): (Command, State)) -> Self {
        Self { command, state, overtaken: false }
    }
}

/// Plays a recording back: the same software, protocol and exam give the same commands, to the bit.
#[derive(Clone, Debug)]
pub struct RecordedArm<R> {
    rows: R,
    period: Span,
    joints: usize,
    tick: u64,
    overtaken: Vec<State>,
}

impl<R: Iterator<Item = Row>> RecordedArm<R> {
    /// An arm of `joints` joints that reads its rows as it is asked.
    pub fn new(rows: R, period: Span, joints: usize) -> Self {
        Self { rows, period, joints, tick: 0, overtaken: Vec::new() }
    }
}

impl<R: Iterator<Item = Row>> Arm for RecordedArm<R> {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        self.overtaken.clear();
        loop {
            let row = self.rows.next().ok_or(ArmFault::RecordingEnds { tick: self.tick })?;
            compare(&row.command, command, row.state.tick)?;
            self.tick = row.state.tick;
            if !row.overtaken {
                return Ok(row.state);
            }
            self.overtaken.push(row.state);
        }
    }

    fn overtaken(&self) -> &[State] {
        &self.overtaken
    }

    fn period(&self) -> Span {
        self.period
    }

    fn joints(&self) -> usize {
        self.joints
    }
}

/// Whether a command is the recorded one, to the bit.
fn compare(recorded: &Command, given: &Command, tick: u64) -> Result<(), ArmFault> {
    let (Command::Position(then), Command::Position(now)) = (recorded, given) else {
        if recorded == given {
            return Ok(());
        }
        let name = |command: &Command| match command {
            Command::Stay => "to stay",
            Command::Position(_) => "to move",
            Command::Freedrive => "to give way",
        };
        let why = format!("it was told {} in the recording and {} now", name(recorded), name(given));
        return Err(ArmFault::Refused { tick, why });
    };
    if then.len() != now.len() {
        let why = format!("{} joints in the recording, {} now", then.len(), now.len());
        return Err(ArmFault::Refused { tick, why });
    }
    let differs = then.iter().zip(now.iter()).position(|(then, now)| then.to_bits() != now.to_bits());
    match differs {
        Some(joint) => Err(ArmFault::Diverged { tick, joint, recorded: then[joint], given: now[joint] }),
        None => Ok(()),
    }
}
