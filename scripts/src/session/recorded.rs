//! A recorded exam in place of the hardware: the same software, protocol and exam give the same commands.

use std::collections::VecDeque;

use probepath_frames::Stamp;
use probepath_robot::{Command, Joints, RecordedArm, Row, Safety, State};
use probepath_us_capture::exam::{Attachment, Exam, TickRecord};
use probepath_us_capture::{BScan, BScanSource, Calibration, SourceFault};

use super::cell::Cell;
use super::{CellFile, Opening, Session, SessionError, StoredCalibration};
use crate::protocol::Protocol;

impl Session {
    /// A session whose arm and machine are those of a recorded exam: its cell, its states, its B-scans. Every command
    /// is compared with the recorded one; the first that differs ends the motion.
    ///
    /// # Errors
    /// When the exam holds no cell, or rows that are none.
    pub fn open_recorded(exam: &Exam, opening: Opening) -> Result<Self, SessionError> {
        let cell = exam.attachment(Attachment::CELL).ok_or(SessionError::Order(
            "the exam holds no cell file: it was not recorded to its beginning",
        ))?;
        let mut cell = CellFile::parse(cell.text()?, "the exam's cell file")?;
        if cell.calibration.is_some() {
            cell.stored = Some(calibration_of(exam)?);
        }
        let seed = exam.header.seed.unwrap_or(opening.seed);
        let rows: Vec<_> = exam.ticks.iter().map(row).collect::<Result<_, _>>()?;
        let (period, joints) = (exam.header.period, exam.header.joint_names.len());
        let arm = Box::new(RecordedArm::new(rows.into_iter(), period, joints));
        let urdf = exam.attachment(Attachment::URDF).map(Attachment::text).transpose()?;
        let cell_of_exam = Cell::recorded(&cell, seed, urdf, arm, Box::new(RecordedMachine::of(exam)))?;
        Self::make_folder(&opening.out)?;
        Self::beside(cell_of_exam, Opening { cell, seed, ..opening })
    }
}

/// The calibration that an exam was recorded with: its file may be gone, or another by now.
fn calibration_of(exam: &Exam) -> Result<StoredCalibration, SessionError> {
    let text = exam
        .attachment(Attachment::CALIBRATION)
        .ok_or(SessionError::Order("the exam holds no calibration: it was not recorded to its beginning"))?;
    let calibration = Calibration::from_toml(text.text()?)?;
    Ok(StoredCalibration { path: Attachment::CALIBRATION.into(), calibration })
}

/// The protocol that an exam was recorded with.
///
/// # Errors
/// When it holds none.
pub fn protocol_of(exam: &Exam) -> Result<Protocol, SessionError> {
    let text = exam
        .attachment(Attachment::PROTOCOL)
        .ok_or(SessionError::Order("the exam holds no protocol: it was not recorded to its beginning"))?;
    Ok(Protocol { name: exam.header.protocol.clone(), text: text.text()?.to_owned() })
}

/// One exchange as the arm's trait speaks of it.
pub(crate) fn row(record: &TickRecord) -> Result<Row, SessionError> {
    let joints = |values: &[f64]| {
        Joints::from_slice(values)
            .map_err(|_| SessionError::Order("the exam has more joints than any arm here"))
    };
    let command = match &record.command {
        None if record.freedrive => Command::Freedrive,
        None => Command::Stay,
        Some(position) => Command::Position(joints(position.as_slice())?),
    };
    let safety = match record.safety.as_ref() {
        "" => Safety::Normal,
        name => Safety::from_name(name)
            .ok_or(SessionError::Order("the exam has a safety state that this software does not know"))?,
    };
    let state = State {
        tick: record.tick,
        stamp: record.stamp,
        position: joints(record.position.as_slice())?,
        velocity: joints(record.velocity.as_slice())?,
        commanded: joints(record.commanded.as_slice())?,
        wrench: record.wrench,
        guiding: record.guiding,
        safety,
        age: record.age,
    };
    Ok(Row { command, state, overtaken: record.overtaken })
}

/// The B-scans that an exam kept, arriving when they arrived.
struct RecordedMachine {
    waiting: VecDeque<BScan>,
}

impl RecordedMachine {
    fn of(exam: &Exam) -> Self {
        Self { waiting: exam.bscans.iter().map(|placed| placed.bscan.clone()).collect() }
    }
}

impl BScanSource for RecordedMachine {
    fn poll(&mut self, now: Stamp) -> Result<Option<BScan>, SourceFault> {
        Ok(self.waiting.pop_front_if(|bscan| bscan.arrived <= now))
    }

    fn silence_is_a_fault(&self) -> bool {
        false
    }
}
