//! The B-scan nearest to each mark along the way.

use probepath_frames::{Point, World};

use super::Counts;
use crate::PlacedBScan;

/// The way grows only by steps of at least this part of the spacing: the trembling of a probe at rest, and the noise
/// of its joints, are no way.
const STEP: f64 = 0.2;

/// Chooses, for each of the marks 0, `every`, 2 `every`, ... along the way of the probe's origin, the B-scan nearest to
/// it, of those that are not nearer to another mark.
pub(super) struct Spacing {
    every: f64,
    /// The nearest so far to the newest mark.
    held: Option<Held>,
    /// The way's last corner, and how far along it is (in spacings).
    corner: Option<(Point<World>, f64)>,
}

struct Held {
    /// The mark it is nearest to, counted in spacings.
    mark: f64,
    /// How far it is from there, in spacings.
    off: f64,
    placed: PlacedBScan,
}

impl Spacing {
    pub(super) const fn new(every: f64) -> Self {
        Self { every, held: None, corner: None }
    }

    /// Takes the next B-scan; gives back the one of the mark before, once no nearer one can come.
    pub(super) fn offer(&mut self, placed: PlacedBScan, counts: &mut Counts) -> Option<PlacedBScan> {
        let place = self.along(placed.world_from_probe.origin());
        let mark = place.round();
        let new = Held { mark, off: (place - mark).abs(), placed };
        let Some(held) = self.held.take() else {
            self.held = Some(new);
            return None;
        };
        if mark > held.mark {
            counts.marks_without += (mark - held.mark - 1.0) as u64;
            self.held = Some(new);
            return Some(held.placed);
        }
        counts.between_marks += 1;
        let nearer = mark >= held.mark && new.off < held.off;
        self.held = Some(if nearer { new } else { held });
        None
    }

    /// The last mark's nearest.
    pub(super) fn finish(&mut self) -> Option<PlacedBScan> {
        self.held.take().map(|held| held.placed)
    }

    /// How far along the way a point is, in spacings.
    fn along(&mut self, origin: Point<World>) -> f64 {
        let Some((corner, along)) = self.corner else {
            self.corner = Some((origin, 0.0));
            return 0.0;
        };
        let step = corner.distance(&origin) / self.every;
        if step >= STEP {
            self.corner = Some((origin, along + step));
        }
        along + step
    }
}
