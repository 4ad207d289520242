//! An arm with somebody beside it: who is told to guide it, and who lets it go on after it stopped by itself.

use probepath_frames::Span;
use probepath_robot::drivers::ur::UrArm;
use probepath_robot::{Arm, ArmFault, Command, RecordedArm, Row, State};
use probepath_sim::{SimulatedArm, SimulatedCell};

use super::SessionError;

/// The arm of a cell, and the person beside it.
pub(super) trait Bedside: Arm + Send {
    /// Takes the force sensor's bias off, the probe in the air and the arm at rest, where connecting has not done so.
    fn zero_sensor(&mut self) -> Result<(), SessionError> {
        Ok(())
    }

    /// Asks whoever stands beside it to take the probe and guide it, where the arm itself has a way to say so (a
    /// pendant).
    fn ask_to_guide(&mut self, text: &str) -> Result<(), SessionError>;

    /// The probe was let go.
    fn done_guiding(&mut self) {}

    /// After it stopped by itself: makes it ready to move again, and says what was done. Nothing moves.
    fn recover(&mut self) -> Result<String, SessionError>;
}

/// The arm that is simulated in this process, and its hand.
pub(super) struct SimulatedBedside {
    cell: SimulatedCell,
    arm: SimulatedArm,
}

impl SimulatedBedside {
    /// Connects to the simulated arm.
    pub(super) fn new(cell: &SimulatedCell) -> Self {
        Self { arm: cell.arm(), cell: cell.clone() }
    }
}

impl Bedside for SimulatedBedside {
    fn ask_to_guide(&mut self, _text: &str) -> Result<(), SessionError> {
        // The hand stands in for the operator's.
        self.cell.hand().guide();
        Ok(())
    }

    fn recover(&mut self) -> Result<String, SessionError> {
        self.arm = self.cell.arm();
        Ok("The simulated arm was connected again.".into())
    }
}

impl Arm for SimulatedBedside {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        self.arm.exchange(command)
    }

    fn overtaken(&self) -> &[State] {
        self.arm.overtaken()
    }

    fn period(&self) -> Span {
        self.arm.period()
    }

    fn joints(&self) -> usize {
        self.arm.joints()
    }
}

/// A UR on its wire, its pendant in place of a voice.
impl Bedside for UrArm {
    fn zero_sensor(&mut self) -> Result<(), SessionError> {
        Ok(UrArm::zero_sensor(self)?)
    }

    fn ask_to_guide(&mut self, text: &str) -> Result<(), SessionError> {
        Ok(self.popup(text)?)
    }

    fn done_guiding(&mut self) {
        // Words that stay on the pendant harm nobody.
        let _ = self.close_popup();
    }

    fn recover(&mut self) -> Result<String, SessionError> {
        if self.fault().is_none() {
            return Ok("The arm says that nothing stopped it.".into());
        }
        UrArm::recover(self)?;
        let version = &self.report().version;
        Ok(format!(
            "The controller (PolyScope {version}) was unlocked and connected anew; our program runs; nothing goes on by \
             itself."
        ))
    }
}

/// A recording: whoever stood beside the arm is in it.
impl<R: Iterator<Item = Row> + Send> Bedside for RecordedArm<R> {
    fn ask_to_guide(&mut self, _text: &str) -> Result<(), SessionError> {
        Ok(())
    }

    fn recover(&mut self) -> Result<String, SessionError> {
        Ok("A recording goes on as it was recorded.".into())
    }
}
