//! What clients may write, and where it goes.

use crate::controller::core::Controller;
use crate::controller::outputs::Register;

/// One input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    Register(Register),
    SpeedMask,
    SpeedFraction,
    /// Digital outputs from this bit on: which, and their values.
    DigitalMask(u32),
    Digital(u32),
    AnalogMask,
    AnalogTypes,
    Analog(usize),
    ExternalForce,
}

impl Slot {
    /// The input called `name`.
    pub(super) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "speed_slider_mask" => Self::SpeedMask,
            "speed_slider_fraction" => Self::SpeedFraction,
            "standard_digital_output_mask" => Self::DigitalMask(0),
            "standard_digital_output" => Self::Digital(0),
            "configurable_digital_output_mask" => Self::DigitalMask(8),
            "configurable_digital_output" => Self::Digital(8),
            "tool_digital_output_mask" => Self::DigitalMask(16),
            "tool_digital_output" => Self::Digital(16),
            "standard_analog_output_mask" => Self::AnalogMask,
            "standard_analog_output_type" => Self::AnalogTypes,
            "standard_analog_output_0" => Self::Analog(0),
            "standard_analog_output_1" => Self::Analog(1),
            "external_force_torque" => Self::ExternalForce,
            _ => Self::Register(Register::of(name.strip_prefix("input_")?)?),
        })
    }

    /// Its type on the wire.
    pub(super) const fn kind(self) -> &'static str {
        match self {
            Self::Register(Register::LowBits | Register::HighBits) | Self::SpeedMask => "UINT32",
            Self::Register(Register::Bit(_)) => "BOOL",
            Self::Register(Register::Int(_)) => "INT32",
            Self::Register(Register::Double(_)) | Self::SpeedFraction | Self::Analog(_) => "DOUBLE",
            Self::DigitalMask(_) | Self::Digital(_) | Self::AnalogMask | Self::AnalogTypes => "UINT8",
            Self::ExternalForce => "VECTOR6D",
        }
    }

    /// Its bytes.
    pub(super) fn size(self) -> usize {
        match self.kind() {
            "BOOL" | "UINT8" => 1,
            "UINT32" | "INT32" => 4,
            "DOUBLE" => 8,
            _ => 48,
        }
    }
}

/// What a package says about outputs; masks say which count.
#[derive(Default)]
struct Said {
    speed: (u32, f64),
    digital: [(u8, u8); 3],
    analog: (u8, u8, [f64; 2]),
}

/// Takes the values of a whole recipe, whose length was checked; gives which integers were written.
pub(super) fn take(recipe: &[Slot], values: &[u8], controller: &mut Controller) -> Vec<usize> {
    let (mut left, mut said, mut written) = (values, Said::default(), Vec::new());
    for slot in recipe {
        let (bytes, rest) = left.split_at(slot.size().min(left.len()));
        left = rest;
        put(*slot, bytes, controller, &mut said);
        if let Slot::Register(Register::Int(index)) = slot {
            written.push(*index);
            if let Some(tick) = controller.written.get_mut(*index) {
                *tick = controller.counters.ticks;
            }
        }
    }
    apply(&said, controller);
    written
}

fn put(slot: Slot, bytes: &[u8], controller: &mut Controller, said: &mut Said) {
    let byte = bytes.first().copied().unwrap_or(0);
    let word = u32::from_be_bytes(bytes.first_chunk().copied().unwrap_or_default());
    let double = f64::from_be_bytes(bytes.first_chunk().copied().unwrap_or_default());
    let input = &mut controller.input;
    match slot {
        Slot::Register(Register::LowBits) => set_word(&mut input.bits, 0, word),
        Slot::Register(Register::HighBits) => set_word(&mut input.bits, 32, word),
        Slot::Register(Register::Bit(index)) => input.set_bit(index, byte != 0),
        Slot::Register(Register::Int(index)) => input.set_int(index, word.cast_signed()),
        Slot::Register(Register::Double(index)) => input.set_double(index, double),
        Slot::SpeedMask => said.speed.0 = word,
        Slot::SpeedFraction => said.speed.1 = double,
        Slot::DigitalMask(from) => said.digital[(from / 8) as usize % 3].0 = byte,
        Slot::Digital(from) => said.digital[(from / 8) as usize % 3].1 = byte,
        Slot::AnalogMask => said.analog.0 = byte,
        Slot::AnalogTypes => said.analog.1 = byte,
        Slot::Analog(index) => said.analog.2[index % 2] = double,
        // The cell has no external sensor; what a client says of one is read and left.
        Slot::ExternalForce => {}
    }
}

fn set_word(bits: &mut u128, from: u32, word: u32) {
    *bits = (*bits & !(0xffff_ffff_u128 << from)) | (u128::from(word) << from);
}

fn apply(said: &Said, controller: &mut Controller) {
    let (mask, fraction) = said.speed;
    if mask == 1 && fraction.is_finite() {
        controller.robot.slider = fraction.clamp(0.0, 1.0);
    }
    for (bank, (mask, value)) in said.digital.iter().enumerate() {
        let shift = 8 * bank;
        let all = controller.io.digital_outputs;
        controller.io.digital_outputs =
            (all & !(u64::from(*mask) << shift)) | (u64::from(*mask & *value) << shift);
    }
    let (mask, types, levels) = said.analog;
    for (index, level) in levels.iter().enumerate() {
        if mask >> index & 1 == 1 && level.is_finite() {
            controller.io.analog_outputs[index] = level.clamp(0.0, 1.0);
            let bit = 1_u32 << index;
            let kind = u32::from(types) & bit;
            controller.io.analog_types = (controller.io.analog_types & !bit) | kind;
        }
    }
}
