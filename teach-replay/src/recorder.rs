//! [`Recorder`]: gathers what the loop does while the arm is taught.

use probepath_robot::{Observer, Tick, Wish};

use crate::{ProbeArm, Recording, Sample};

/// Writes every tick of a motion into a [`Recording`]. Its memory is asked for before the motion begins; when that
/// is full it asks the loop to stop, so that nothing is taught that was not recorded.
#[derive(Clone, Debug)]
pub struct Recorder {
    arm: ProbeArm,
    recording: Recording,
}

impl Recorder {
    /// Room for `capacity` states of `arm` (ten minutes at 500 a second are 300,000, about 50 MB).
    pub fn new(arm: ProbeArm, capacity: usize) -> Self {
        Self { arm, recording: Recording::with_capacity(capacity) }
    }

    /// What was recorded so far.
    pub const fn recording(&self) -> &Recording {
        &self.recording
    }

    /// What was recorded.
    pub fn into_recording(self) -> Recording {
        self.recording
    }
}

impl Observer for Recorder {
    fn tick(&mut self, tick: &Tick) -> Wish {
        let state = &tick.state;
        self.recording.push(Sample {
            stamp: state.stamp,
            base_from_probe: self.arm.probe(&state.position),
            wrench: state.wrench,
            guiding: state.guiding,
        });
        if self.recording.lost() == 0 {
            return Wish::GoOn;
        }
        Wish::Stop("the recording is full: teach a shorter path, or ask for more room".into())
    }
}
