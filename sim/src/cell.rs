//! [`SimulatedCell`]: a leg or a phantom on the table, an arm, an ultrasound machine and a hand, in one world.

mod config;
mod error;
mod nominal;
mod scene;
mod touch;
mod truth;

use std::fmt;
use std::sync::Arc;

use probepath_frames::{Span, Stamp};

pub use config::{ArmConfig, ArmKind, CellConfig, MachineConfig, SubjectConfig, Window};
pub use error::CellError;
pub use nominal::Nominal;
pub use scene::Moment;
pub(crate) use scene::{Scene, Shared};
pub use touch::Touch;
pub use truth::Truth;

use crate::arm::SimulatedArm;
use crate::disturbance::DisturbanceConfig;
use crate::hand::HandConfig;
use crate::machine::SimulatedMachine;
use crate::subject::Subject;
use crate::ultrasound::Renderer;

/// Between two ticks of the arm: 2 ms.
pub const TICK: Span = Span::from_milliseconds(2);

/// A whole cell of one seed, in simulated time: it stands still until the arm is told something, and then moves on by
/// one tick for each exchange. The same seed and the same commands give the same bytes.
///
/// ```
/// use probepath_robot::{Arm, Command};
/// use probepath_sim::{CellConfig, SimulatedCell};
///
/// let cell = SimulatedCell::new(&CellConfig::default(), 1)?;
/// let mut arm = cell.arm();
/// let state = arm.exchange(&Command::Stay).expect("the arm answers");
/// assert_eq!(state.commanded, cell.nominal().start);
/// # Ok::<(), probepath_sim::CellError>(())
/// ```
#[derive(Clone)]
pub struct SimulatedCell {
    config: CellConfig,
    nominal: Nominal,
    subject: Arc<Subject>,
    scene: Shared,
    truth: Truth,
    renderer: Arc<Renderer>,
    seed: u64,
}

impl fmt::Debug for SimulatedCell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedCell")
            .field("seed", &self.seed)
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}

impl SimulatedCell {
    /// The cell of one seed.
    ///
    /// # Errors
    /// When a number of the configuration is impossible, or the arm cannot be built with its error.
    pub fn new(config: &CellConfig, seed: u64) -> Result<Self, CellError> {
        config.check()?;
        let nominal = Nominal::new(config)?;
        let subject = Arc::new(Subject::new(&config.subject, seed)?);
        let scene = Shared::new(Scene::new(config, nominal.clone(), subject.clone(), seed)?);
        let truth = Truth::new(config, &nominal, &subject, &scene, seed);
        let renderer = Arc::new(Renderer::new(config.machine.imaging.clone(), seed)?);
        Ok(Self { config: config.clone(), nominal, subject, scene, truth, renderer, seed })
    }

    /// What the software may know.
    pub const fn nominal(&self) -> &Nominal {
        &self.nominal
    }

    /// How it was made.
    pub const fn config(&self) -> &CellConfig {
        &self.config
    }

    /// Connects to the arm; the force sensor's bias is taken off. A second connection recovers from what a knob did.
    pub fn arm(&self) -> SimulatedArm {
        SimulatedArm::new(self.scene.clone(), self.config.knobs.arm.clone())
    }

    /// Connects to the ultrasound machine: B-scans that are formed from now on.
    pub fn machine(&self) -> SimulatedMachine {
        SimulatedMachine::new(
            self.scene.clone(),
            self.truth.clone(),
            self.renderer.clone(),
            &self.config,
            self.seed,
        )
    }

    /// The hand that guides.
    pub fn hand(&self) -> SimulatedHand {
        SimulatedHand { scene: self.scene.clone(), usual: self.config.hand.clone() }
    }

    /// From now on the contact is disturbed like this; the configuration's own disturbance ends.
    ///
    /// # Errors
    /// When a number is impossible.
    pub fn disturb(&self, disturbance: &DisturbanceConfig) -> Result<(), CellError> {
        CellConfig { disturbance: disturbance.clone(), ..self.config.clone() }.check()?;
        self.scene.lock().disturb(disturbance);
        Ok(())
    }

    /// What was truly there: for tests and for `validate`, never for the code under test.
    pub const fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The world, for the controller that serves this cell.
    pub(crate) fn shared(&self) -> Shared {
        self.scene.clone()
    }

    /// The cell's time.
    pub fn now(&self) -> Stamp {
        self.scene.lock().now()
    }

    /// What lies on the table, for those who may know the truth.
    pub fn subject(&self) -> &Subject {
        &self.subject
    }
}

/// A person who can be asked to guide the probe. The hand grips the probe's holder below the force sensor, so the
/// sensor feels hand and skin together.
#[derive(Clone, Debug)]
pub struct SimulatedHand {
    scene: Shared,
    usual: HandConfig,
}

impl SimulatedHand {
    /// Takes the probe where it is, holds the switch, and guides it along the leg as the configuration says; lets go
    /// of the switch when it is done. It moves as the arm is exchanged with, and only where the arm gives way.
    pub fn guide(&self) {
        self.scene.lock().guide(&self.usual);
    }

    /// The same, another way.
    pub fn guide_as(&self, config: &HandConfig) {
        self.scene.lock().guide(config);
    }

    /// Lets go of probe and switch at once.
    pub fn let_go(&self) {
        self.scene.lock().let_go();
    }

    /// Whether it holds the switch.
    pub fn guides(&self) -> bool {
        self.scene.lock().hand_guides()
    }
}

#[cfg(test)]
mod tests;
