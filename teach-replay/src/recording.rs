//! What is gathered while a hand guides the arm.

use probepath_frames::{Base, Pose, Probe, Stamp, Wrench};

/// One state of the arm while it was taught.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// When.
    pub stamp: Stamp,
    /// Where the probe was.
    pub base_from_probe: Pose<Base, Probe>,
    /// What hand and skin together did to the probe.
    pub wrench: Wrench<Probe>,
    /// Whether the hold-to-move switch was held.
    pub guiding: bool,
}

/// States in order, in memory that is asked for once: gathering them inside the loop touches no heap.
#[derive(Clone, Debug)]
pub struct Recording {
    samples: Vec<Sample>,
    capacity: usize,
    lost: u64,
}

impl Recording {
    /// Room for `capacity` states (a minute at 500 a second is 30,000, about 5 MB).
    pub fn with_capacity(capacity: usize) -> Self {
        Self { samples: Vec::with_capacity(capacity), capacity, lost: 0 }
    }

    /// Adds a state; when there is no more room it is lost, and counted.
    pub fn push(&mut self, sample: Sample) {
        if self.samples.len() < self.capacity {
            self.samples.push(sample);
        } else {
            self.lost += 1;
        }
    }

    /// The states, in order.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// How many states found no room.
    pub const fn lost(&self) -> u64 {
        self.lost
    }

    /// Whether there is room for no more.
    pub fn is_full(&self) -> bool {
        self.samples.len() >= self.capacity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_recording_loses_states_and_counts_them() {
        let sample = Sample {
            stamp: Stamp::ZERO,
            // FRAMES: any pose will do.
            base_from_probe: Pose::assume(nalgebra::Isometry3::identity()),
            wrench: Wrench::zero(),
            guiding: true,
        };
        let mut recording = Recording::with_capacity(3);
        for _ in 0..5 {
            recording.push(sample);
        }
        assert_eq!((recording.samples().len(), recording.lost(), recording.is_full()), (3, 2, true));
    }
}
