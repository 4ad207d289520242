//! Who watches a motion: [`Taped`] keeps every exchange with the arm in the exam, [`Recorder`] takes the hand's path,
//! the B-scans and the figures from every tick.

use std::borrow::Cow;

use probepath_frames::{Base, Flange, Pose, Probe, Span, Stamp, Track, World};
use probepath_robot::{
    Arm, ArmFault, Command, Joints, Model, Operator, Safety, State, Tick, Wish, ZeroWatch,
};
use probepath_teach_replay::{Recording, Sample};
use probepath_us_capture::exam::{ExamWriter, Row, TickRecord};
use probepath_us_capture::{BScanSource, Capture, CaptureError, PlacedBScan};

use super::figures::Figures;
use super::live::Live;
use super::motion::Watcher;
use crate::progress::Progress;

/// Where a motion is, as its controller says it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stand {
    /// What it is doing: `teach`, `approach`, `touch`, `follow`, `lift`.
    pub(super) phase: &'static str,
    /// How far along the path (m), where there is one.
    pub(super) along_m: Option<f64>,
    /// Whether what is seen now counts.
    pub(super) look: bool,
    /// How much of the step is done, 0 to 1.
    pub(super) fraction: f64,
}

/// What the cell knows about where things are.
#[derive(Clone)]
pub(super) struct Facts {
    pub(super) model: Model,
    pub(super) world_from_base: Pose<World, Base>,
    pub(super) flange_from_probe: Pose<Flange, Probe>,
}

impl Facts {
    /// Where the model says the probe is.
    pub(super) fn base_from_probe(&self, joints: &Joints) -> Pose<Base, Probe> {
        self.model.forward(joints) * self.flange_from_probe
    }
}

/// An arm whose every exchange is kept, those before and after a motion too: so that a recorded exam can stand in for
/// the arm, exchange by exchange.
pub(super) struct Taped<'a> {
    pub(super) arm: &'a mut (dyn Arm + Send),
    pub(super) exam: &'a ExamWriter,
    pub(super) facts: &'a Facts,
    pub(super) stand: &'a dyn Fn() -> Stand,
}

impl Arm for Taped<'_> {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let state = self.arm.exchange(command)?;
        for older in self.arm.overtaken() {
            let overtaken = record(command, older, &(self.stand)(), self.facts);
            self.exam.tick(TickRecord { overtaken: true, ..overtaken });
        }
        self.exam.tick(record(command, &state, &(self.stand)(), self.facts));
        Ok(state)
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

/// One exchange as the exam keeps it.
pub(super) fn record(command: &Command, state: &State, stand: &Stand, facts: &Facts) -> TickRecord {
    let base_from_probe = facts.base_from_probe(&state.position);
    TickRecord {
        tick: state.tick,
        stamp: state.stamp,
        command: match command {
            Command::Stay | Command::Freedrive => None,
            Command::Position(joints) => Some(row(joints)),
        },
        position: row(&state.position),
        velocity: row(&state.velocity),
        commanded: row(&state.commanded),
        wrench: state.wrench,
        guiding: state.guiding,
        phase: Cow::Borrowed(stand.phase),
        world_from_probe: Some(facts.world_from_base * base_from_probe),
        // Nothing where all is well, so that it takes no room.
        safety: Cow::Borrowed(if state.safety == Safety::Normal { "" } else { state.safety.name() }),
        freedrive: *command == Command::Freedrive,
        age: state.age,
        overtaken: false,
    }
}

/// As many numbers as joints; both have room for eight.
fn row(joints: &Joints) -> Row {
    Row::from_slice(joints.as_slice()).unwrap_or_default()
}

/// The B-scans of a scan.
pub(super) struct Eye<'a> {
    pub(super) machine: &'a mut (dyn BScanSource + Send),
    pub(super) capture: &'a mut Capture,
    pub(super) images: &'a mut Vec<PlacedBScan>,
    /// Paused while the machine is silent.
    pub(super) operator: &'a Operator,
    /// Whether it was the silence that paused, and not a person.
    pub(super) paused: bool,
    /// The last tick at which what is seen counted, once there was one.
    pub(super) looked: Option<Stamp>,
    /// No machine is later with a B-scan.
    pub(super) latest: Span,
    /// Where somebody watches the vessel grow.
    pub(super) live: Option<&'a mut Live>,
}

/// No machine is later with a B-scan.
pub(super) const LATEST: Span = Span::from_milliseconds(500);

/// A machine that is silent for longer than this ends the scan.
const LONGEST_SILENCE: Span = Span::from_milliseconds(5000);

/// Everybody who wants to know of a tick, in one place.
pub(super) struct Recorder<'a> {
    pub(super) exam: &'a ExamWriter,
    pub(super) facts: &'a Facts,
    pub(super) progress: &'a dyn Progress,
    pub(super) step: &'static str,
    pub(super) recording: Option<&'a mut Recording>,
    /// Where the probe was at every tick.
    pub(super) track: Option<&'a mut Track<World, Probe>>,
    pub(super) eye: Option<Eye<'a>>,
    pub(super) figures: Option<&'a mut Figures>,
    /// Learns where something was felt.
    pub(super) zero: Option<&'a mut ZeroWatch>,
    /// The last tick's stamp.
    pub(super) now: Stamp,
}

/// The bar moves five times a second of exam time.
const TICKS_BETWEEN_BARS: u64 = 100;

impl Watcher for Recorder<'_> {
    fn see(&mut self, tick: &Tick, stand: &Stand) -> Wish {
        let state = &tick.state;
        let base_from_probe = self.facts.base_from_probe(&state.position);
        self.now = state.stamp;
        if let Some(zero) = &mut self.zero {
            zero.step(&state.wrench, &base_from_probe);
        }
        if let Some(recording) = &mut self.recording {
            let (stamp, wrench, guiding) = (state.stamp, state.wrench, state.guiding);
            recording.push(Sample { stamp, base_from_probe, wrench, guiding });
            if recording.lost() > 0 {
                return Wish::Stop("ten minutes were recorded: let go of the switch earlier".into());
            }
        }
        if let Some(figures) = &mut self.figures
            && !tick.braking
        {
            figures.tick(tick, stand, &base_from_probe);
        }
        if tick.index.is_multiple_of(TICKS_BETWEEN_BARS) {
            self.progress.at(self.step, stand.fraction);
        }
        if let Some(fault) = self.exam.fault() {
            return Wish::Stop(format!("the exam cannot be recorded: {fault}"));
        }
        let world_from_probe = self.facts.world_from_base * base_from_probe;
        if let Some(track) = &mut self.track
            && let Err(error) = track.push(state.stamp, world_from_probe)
        {
            return Wish::Stop(error.to_string());
        }
        let Some(eye) = &mut self.eye else { return Wish::GoOn };
        let looked = if stand.look {
            eye.look(state, world_from_probe, self.exam)
        } else {
            eye.wait(state.stamp, self.exam)
        };
        looked.unwrap_or_else(|error| Wish::Stop(error.to_string()))
    }
}

impl Eye<'_> {
    /// Before, after and between nothing is looked at, but for B-scans that were formed when it counted and arrive
    /// late.
    fn wait(&mut self, now: Stamp, exam: &ExamWriter) -> Result<Wish, CaptureError> {
        if self.looked.is_some_and(|last| now - last < self.latest) {
            self.take(now, exam)?;
        } else {
            self.machine.skip(now)?;
        }
        Ok(Wish::GoOn)
    }

    /// Takes what the machine has, and keeps what the capture wants.
    fn take(&mut self, now: Stamp, exam: &ExamWriter) -> Result<(), CaptureError> {
        self.capture.poll(self.machine, now)?;
        while let Some(placed) = self.capture.take() {
            exam.bscan(placed.clone());
            if let Some(live) = &mut self.live {
                live.see(&placed);
            }
            self.images.push(placed);
        }
        Ok(())
    }

    /// Takes what the machine has, keeps what the capture wants, and holds the probe still while nothing comes.
    fn look(
        &mut self,
        state: &State,
        world_from_probe: Pose<World, Probe>,
        exam: &ExamWriter,
    ) -> Result<Wish, CaptureError> {
        if self.looked.is_none_or(|last| state.stamp - last > self.latest) {
            self.capture.listen(state.stamp);
        }
        self.looked = Some(state.stamp);
        self.capture.tick(state.stamp, world_from_probe, Some(state.wrench))?;
        self.take(state.stamp, exam)?;
        if !self.machine.silence_is_a_fault() {
            return Ok(Wish::GoOn);
        }
        match self.capture.stalled(state.stamp) {
            Some(silence) if silence > LONGEST_SILENCE => {
                let seconds = silence.seconds();
                return Ok(Wish::Stop(format!(
                    "the ultrasound machine has sent nothing for {seconds:.1} s: is it frozen, is its cable in?"
                )));
            }
            Some(_) if !self.paused => {
                self.operator.pause();
                self.paused = true;
            }
            None if self.paused => {
                self.operator.resume();
                self.paused = false;
            }
            _ => {}
        }
        Ok(Wish::GoOn)
    }
}
