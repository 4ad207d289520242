//! The general-purpose registers: how programs and clients talk.

/// How many integer and how many double registers there are, each way.
pub(super) const COUNT: usize = 48;

/// One direction's registers.
#[derive(Clone, Debug)]
pub(super) struct Bank {
    pub(super) bits: u128,
    pub(super) ints: [i32; COUNT],
    pub(super) doubles: [f64; COUNT],
}

impl Default for Bank {
    fn default() -> Self {
        Self { bits: 0, ints: [0; COUNT], doubles: [0.0; COUNT] }
    }
}

impl Bank {
    /// An integer; zero beyond the last.
    pub(super) fn int(&self, index: usize) -> i32 {
        self.ints.get(index).copied().unwrap_or(0)
    }

    /// A double; zero beyond the last.
    pub(super) fn double(&self, index: usize) -> f64 {
        self.doubles.get(index).copied().unwrap_or(0.0)
    }

    /// Six doubles in a row.
    pub(super) fn six(&self, from: usize) -> [f64; 6] {
        std::array::from_fn(|i| self.double(from + i))
    }

    pub(super) fn set_int(&mut self, index: usize, value: i32) {
        if let Some(register) = self.ints.get_mut(index) {
            *register = value;
        }
    }

    pub(super) fn set_double(&mut self, index: usize, value: f64) {
        if let Some(register) = self.doubles.get_mut(index) {
            *register = value;
        }
    }

    pub(super) fn set_six(&mut self, from: usize, values: &[f64; 6]) {
        for (i, value) in values.iter().enumerate() {
            self.set_double(from + i, *value);
        }
    }

    pub(super) fn set_bit(&mut self, index: usize, value: bool) {
        if index < 128 {
            let mask = 1_u128 << index;
            self.bits = if value { self.bits | mask } else { self.bits & !mask };
        }
    }
}
