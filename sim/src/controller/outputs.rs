//! Every output that the RTDE guide names (UR_WIRE.md), with its value: real where the simulation knows it, a documented
//! constant elsewhere.

mod fields;

use super::core::Controller;
use fields::FIELDS;

/// A value as it travels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    Bool(bool),
    U8(u8),
    U32(u32),
    U64(u64),
    I32(i32),
    F64(f64),
    V3([f64; 3]),
    V6([f64; 6]),
    V6I([i32; 6]),
}

impl Value {
    #[cfg(test)]
    /// Its type's name on the wire.
    pub(super) const fn kind(&self) -> &'static str {
        match self {
            Self::Bool(_) => "BOOL",
            Self::U8(_) => "UINT8",
            Self::U32(_) => "UINT32",
            Self::U64(_) => "UINT64",
            Self::I32(_) => "INT32",
            Self::F64(_) => "DOUBLE",
            Self::V3(_) => "VECTOR3D",
            Self::V6(_) => "VECTOR6D",
            Self::V6I(_) => "VECTOR6INT32",
        }
    }

    /// Big-endian, after what is there.
    pub(super) fn put(&self, out: &mut Vec<u8>) {
        match self {
            Self::Bool(b) => out.push(u8::from(*b)),
            Self::U8(x) => out.push(*x),
            Self::U32(x) => out.extend(x.to_be_bytes()),
            Self::U64(x) => out.extend(x.to_be_bytes()),
            Self::I32(x) => out.extend(x.to_be_bytes()),
            Self::F64(x) => out.extend(x.to_be_bytes()),
            Self::V3(v) => v.iter().for_each(|x| out.extend(x.to_be_bytes())),
            Self::V6(v) => v.iter().for_each(|x| out.extend(x.to_be_bytes())),
            Self::V6I(v) => v.iter().for_each(|x| out.extend(x.to_be_bytes())),
        }
    }
}

/// Where an output's value comes from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    /// A quantity of the arm or of its controller.
    Field(&'static str, fn(&Controller) -> Value),
    /// An output register: what the program wrote.
    Output(Register),
    /// An input register, read back.
    Input(Register),
}

/// A general-purpose register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Register {
    /// Bits 0 to 31.
    LowBits,
    /// Bits 32 to 63.
    HighBits,
    Bit(usize),
    Int(usize),
    Double(usize),
}

impl Register {
    /// The register of a name without its direction: `int_register_3`, `bit_registers0_to_31`.
    pub(super) fn of(name: &str) -> Option<Self> {
        let index = |text: &str, range: std::ops::Range<usize>| {
            let honest = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit()) && text.len() < 4;
            let honest = honest && (text == "0" || !text.starts_with('0'));
            text.parse().ok().filter(|i| honest && range.contains(i))
        };
        if name == "bit_registers0_to_31" {
            return Some(Self::LowBits);
        }
        if name == "bit_registers32_to_63" {
            return Some(Self::HighBits);
        }
        if let Some(rest) = name.strip_prefix("bit_register_") {
            return index(rest, 64..128).map(Self::Bit);
        }
        if let Some(rest) = name.strip_prefix("int_register_") {
            return index(rest, 0..48).map(Self::Int);
        }
        index(name.strip_prefix("double_register_")?, 0..48).map(Self::Double)
    }

    /// Its type's name on the wire.
    pub(super) const fn kind(self) -> &'static str {
        match self {
            Self::LowBits | Self::HighBits => "UINT32",
            Self::Bit(_) => "BOOL",
            Self::Int(_) => "INT32",
            Self::Double(_) => "DOUBLE",
        }
    }

    fn value(self, bank: &super::registers::Bank) -> Value {
        match self {
            Self::LowBits => Value::U32((bank.bits & 0xffff_ffff) as u32),
            Self::HighBits => Value::U32(((bank.bits >> 32) & 0xffff_ffff) as u32),
            Self::Bit(index) => Value::Bool((bank.bits >> index) & 1 == 1),
            Self::Int(index) => Value::I32(bank.int(index)),
            Self::Double(index) => Value::F64(bank.double(index)),
        }
    }
}

impl Source {
    /// Where the output called `name` comes from; `None` when there is none of that name.
    pub(super) fn of(name: &str) -> Option<Self> {
        if let Some(register) = name.strip_prefix("output_").and_then(Register::of) {
            return Some(Self::Output(register));
        }
        if let Some(rest) = name.strip_prefix("input_") {
            return Register::of(rest).map(Self::Input);
        }
        FIELDS.iter().find(|(known, ..)| *known == name).map(|(_, kind, read)| Self::Field(kind, *read))
    }

    /// Its type's name on the wire.
    pub(super) const fn kind(&self) -> &'static str {
        match self {
            Self::Field(kind, _) => kind,
            Self::Output(register) | Self::Input(register) => register.kind(),
        }
    }

    /// Its value now.
    pub(super) fn value(&self, controller: &Controller) -> Value {
        match self {
            Self::Field(_, read) => read(controller),
            Self::Output(register) => register.value(&controller.output),
            Self::Input(register) => register.value(&controller.input),
        }
    }
}
