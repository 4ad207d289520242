//! What is done with an arm beside no scan: `probepath arm --identify-tool`, `probepath arm --recover`.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use probepath_robot::Operator;
use serde::Serialize;

use super::cell::{Cell, MachineAddress, MachineFile};
use super::measure::cell_file;
use super::{IdentifiedTool, Opening, Session, SessionError, motion};
use crate::progress::Progress;
use crate::protocol::Protocol;

/// An arm, by its address and its cell's file.
#[derive(Clone, Debug, Default)]
pub struct ArmRequest {
    /// `ur://host`; what the cell's file says when absent.
    pub address: Option<String>,
    /// The cell's file, as for [`MeasureRequest`](super::MeasureRequest).
    pub cell: Option<PathBuf>,
}

/// An arm that was made ready again.
#[derive(Clone, Debug, Serialize)]
pub struct Recovered {
    /// The arm's address.
    pub address: String,
    /// What was done.
    pub done: String,
    /// Where its joints are (degrees; mm where one slides).
    pub joints: Vec<f64>,
    /// What presses on the probe (N).
    pub force_n: f64,
}

impl ArmRequest {
    /// Turns the probe where it hangs and says what the arm carries; the exam of it goes to `out`. On a wire a person is
    /// asked first.
    ///
    /// # Errors
    /// When nobody says yes, the cell cannot be connected, or the tool not be told.
    pub fn identify_tool(
        &self,
        out: PathBuf,
        operator: &Operator,
        progress: Arc<dyn Progress>,
    ) -> Result<IdentifiedTool, SessionError> {
        let mut cell = cell_file(self.address.as_deref(), self.cell.as_deref())?;
        cell.machine = MachineFile { address: MachineAddress::None, ..MachineFile::default() };
        let question = "The arm turns the probe about its own face where it hangs, by up to 25 degrees to every side. Is \
                        it in the air, and nothing near?";
        if !cell.is_simulated() && !progress.confirm(question) {
            return Err(SessionError::NotConfirmed { why: "nobody said yes".into() });
        }
        let protocol = Protocol { name: "identify-tool".into(), text: "identify_tool();".into() };
        let (operator, date) = (operator.clone(), None);
        let mut session = Session::open(Opening { cell, seed: 1, out, protocol, date, operator, progress })?;
        let found = session.identify_tool();
        session.close()?;
        found
    }

    /// After the arm stopped by itself with nobody connected: asks a person, unlocks it, connects anew, and lets go of
    /// it. Nothing moves.
    ///
    /// # Errors
    /// When nobody says yes, or the arm cannot be made ready: the error says what to do first.
    pub fn recover(&self, progress: &dyn Progress) -> Result<Recovered, SessionError> {
        let cell = cell_file(self.address.as_deref(), self.cell.as_deref())?;
        if cell.is_simulated() {
            let wanted =
                "an arm that is simulated in this process never stays stopped: name one on its wire".into();
            return Err(SessionError::Wish { what: "the arm's address", value: "sim".into(), wanted });
        }
        let address = cell.arm.address.to_string();
        let question = format!("Look at the arm at {address}. Was the cause found, and may it be unlocked?");
        if !progress.confirm(&question) {
            return Err(SessionError::NotConfirmed { why: "nobody said yes".into() });
        }
        let (mut arm, facts, done) = Cell::arm_released(&cell)?;
        let state = motion::ask("recovering", &mut arm)?;
        let degrees =
            |(joint, q): (usize, f64)| if facts.model.slides(joint) { q * 1e3 } else { q.to_degrees() };
        let joints = state.position.iter().enumerate().map(degrees).collect();
        Ok(Recovered { address, done, joints, force_n: state.wrench.force.norm() })
    }
}

impl fmt::Display for Recovered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let joints: Vec<String> = self.joints.iter().map(|q| format!("{q:.1}")).collect();
        write!(
            f,
            "{}: {} It rests with its joints at {} degrees, {:.1} N on the probe. The next scan asks before it moves.",
            self.address,
            self.done,
            joints.join(", "),
            self.force_n
        )
    }
}
