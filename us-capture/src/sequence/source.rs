//! A sequence from disk that behaves like an ultrasound machine.

use std::collections::VecDeque;
use std::sync::Arc;

use probepath_frames::{Span, Stamp};

use super::Sequence;
use super::place::setting_of;
use crate::{BScan, BScanSource, PixelSpacing, SourceFault};

/// Replays the pictures of a sequence by their stamps.
#[derive(Clone, Debug)]
pub struct SequenceSource {
    waiting: VecDeque<BScan>,
    count: u64,
    skipped: u64,
}

impl SequenceSource {
    /// The pictures that may be used and have a stamp, in the order of their stamps, shifted so that the first arrives
    /// at `first`. The file's stamps say when an image was taken; nothing says when it arrived, so it arrives then.
    pub fn new(sequence: &Sequence, spacing: PixelSpacing, first: Stamp) -> Self {
        let setting = setting_of(spacing, sequence.width(), sequence.height());
        let size = (sequence.width(), sequence.height());
        let mut bscans: Vec<BScan> = Vec::new();
        for image in sequence.images() {
            let (Some(pixels), Some(stamp)) = (image.picture(), image.stamp) else { continue };
            bscans.extend(BScan::new(image.number, (stamp, stamp), setting, size, Arc::clone(pixels)));
        }
        bscans.sort_by_key(|b| b.arrived);
        let shift = bscans.first().map_or(Span::ZERO, |b| first - b.arrived);
        for bscan in &mut bscans {
            bscan.formed = bscan.formed + shift;
            bscan.arrived = bscan.arrived + shift;
        }
        let count = bscans.len() as u64;
        Self { count, skipped: sequence.images().len() as u64 - count, waiting: bscans.into() }
    }

    /// Images that are not replayed: invalid, without a picture, or without a stamp.
    pub const fn skipped(&self) -> u64 {
        self.skipped
    }
}

impl BScanSource for SequenceSource {
    fn poll(&mut self, now: Stamp) -> Result<Option<BScan>, SourceFault> {
        match self.waiting.front() {
            None => Err(SourceFault::Ended { count: self.count }),
            Some(next) if next.arrived > now => Ok(None),
            Some(_) => Ok(self.waiting.pop_front()),
        }
    }
}
