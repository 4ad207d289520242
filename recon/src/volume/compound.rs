//! What many pixels in one voxel become, as cells that pixels are added to and runs are merged into.

/// A cell of the volume while it is built. Its default is a voxel no pixel came to.
pub(super) trait Cell: Copy + Default + Send + Sync {
    /// Adds one pixel; its weight is above zero.
    fn add(&mut self, weight: u64, grey: u8);
    /// Adds what a run of later pixels became.
    fn merge(&mut self, run: &Self);
    /// The grey level, when any pixel came.
    fn grey(&self) -> Option<u8>;
}

/// Sum and count in one word: 28 bits of count, 36 of sum.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CountedMean(u64);

/// Sums of weights and of weighted grey levels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WeightedMean {
    weights: u64,
    sum: u64,
}

/// The brightest, plus one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Brightest(u16);

/// The last one, plus one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Last(u16);

impl Cell for CountedMean {
    fn add(&mut self, _weight: u64, grey: u8) {
        self.0 += (u64::from(grey) << 28) | 1;
    }

    fn merge(&mut self, run: &Self) {
        self.0 += run.0;
    }

    fn grey(&self) -> Option<u8> {
        let (sum, count) = (self.0 >> 28, self.0 & 0xFFF_FFFF);
        (sum + count / 2).checked_div(count).map(|g| g as u8)
    }
}

impl Cell for WeightedMean {
    fn add(&mut self, weight: u64, grey: u8) {
        self.weights += weight;
        self.sum += weight * u64::from(grey);
    }

    fn merge(&mut self, run: &Self) {
        self.weights += run.weights;
        self.sum += run.sum;
    }

    fn grey(&self) -> Option<u8> {
        (self.sum + self.weights / 2).checked_div(self.weights).map(|g| g as u8)
    }
}

impl Cell for Brightest {
    fn add(&mut self, _weight: u64, grey: u8) {
        self.0 = self.0.max(u16::from(grey) + 1);
    }

    fn merge(&mut self, run: &Self) {
        self.0 = self.0.max(run.0);
    }

    fn grey(&self) -> Option<u8> {
        self.0.checked_sub(1).map(|g| g as u8)
    }
}

impl Cell for Last {
    fn add(&mut self, _weight: u64, grey: u8) {
        self.0 = u16::from(grey) + 1;
    }

    fn merge(&mut self, run: &Self) {
        if run.0 > 0 {
            *self = *run;
        }
    }

    fn grey(&self) -> Option<u8> {
        self.0.checked_sub(1).map(|g| g as u8)
    }
}
