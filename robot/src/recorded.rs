//! [`RecordedArm`]: an arm that reads its states from a recording, and compares every command with the one recorded.

use probepath_frames::Span;

use crate::{Arm, ArmFault, Command, State};

/// One tick of a recording: the command that went out, and the state that came back.
pub type Row = (Command, State);

/// Plays a recording back: the same software, protocol and exam give the same commands, to the bit.
#[derive(Clone, Debug)]
pub struct RecordedArm<R> {
    rows: R,
    period: Span,
    joints: usize,
    tick: u64,
}

impl<R: Iterator<Item = Row>> RecordedArm<R> {
    /// An arm of `joints` joints that reads its rows as it is asked.
    pub const fn new(rows: R, period: Span, joints: usize) -> Self {
        Self { rows, period, joints, tick: 0 }
    }
}

impl<R: Iterator<Item = Row>> Arm for RecordedArm<R> {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let (recorded, state) = self.rows.next().ok_or(ArmFault::RecordingEnds { tick: self.tick })?;
        compare(&recorded, command, state.tick)?;
        self.tick = state.tick;
        Ok(state)
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
