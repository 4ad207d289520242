//! [`Type`] and [`Value`]: what a field of a data package can be.

use std::fmt;

/// A field's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// 0 or 1.
    Bool,
    /// 8 bits, without sign.
    Uint8,
    /// 32 bits, without sign.
    Uint32,
    /// 64 bits, without sign.
    Uint64,
    /// 32 bits.
    Int32,
    /// A double.
    Double,
    /// 3 doubles.
    Vector3D,
    /// 6 doubles.
    Vector6D,
    /// 6 times 32 bits.
    Vector6Int32,
    /// 6 times 32 bits, without sign.
    Vector6Uint32,
}

impl Type {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Bool,
        Self::Uint8,
        Self::Uint32,
        Self::Uint64,
        Self::Int32,
        Self::Double,
        Self::Vector3D,
        Self::Vector6D,
        Self::Vector6Int32,
        Self::Vector6Uint32,
    ];

    /// How many bytes it has in a package.
    pub const fn size(self) -> usize {
        match self {
            Self::Bool | Self::Uint8 => 1,
            Self::Uint32 | Self::Int32 => 4,
            Self::Uint64 | Self::Double => 8,
            Self::Vector3D | Self::Vector6Int32 | Self::Vector6Uint32 => 24,
            Self::Vector6D => 48,
        }
    }

    /// Its name in a reply to a recipe.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bool => "BOOL",
            Self::Uint8 => "UINT8",
            Self::Uint32 => "UINT32",
            Self::Uint64 => "UINT64",
            Self::Int32 => "INT32",
            Self::Double => "DOUBLE",
            Self::Vector3D => "VECTOR3D",
            Self::Vector6D => "VECTOR6D",
            Self::Vector6Int32 => "VECTOR6INT32",
            Self::Vector6Uint32 => "VECTOR6UINT32",
        }
    }

    /// The one of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|candidate| candidate.name() == name)
    }

    /// Zero of this type.
    pub const fn zero(self) -> Value {
        match self {
            Self::Bool => Value::Bool(false),
            Self::Uint8 => Value::Uint8(0),
            Self::Uint32 => Value::Uint32(0),
            Self::Uint64 => Value::Uint64(0),
            Self::Int32 => Value::Int32(0),
            Self::Double => Value::Double(0.0),
            Self::Vector3D => Value::Vector3D([0.0; 3]),
            Self::Vector6D => Value::Vector6D([0.0; 6]),
            Self::Vector6Int32 => Value::Vector6Int32([0; 6]),
            Self::Vector6Uint32 => Value::Vector6Uint32([0; 6]),
        }
    }

    /// Reads one from the bytes of a package; `None` when they are not exactly as many as it has. Any byte but 0 is
    /// true.
    pub fn read(self, bytes: &[u8]) -> Option<Value> {
        Some(match self {
            Self::Bool => Value::Bool(*one(bytes)? != 0),
            Self::Uint8 => Value::Uint8(*one(bytes)?),
            Self::Uint32 => Value::Uint32(u32::from_be_bytes(bytes.try_into().ok()?)),
            Self::Uint64 => Value::Uint64(u64::from_be_bytes(bytes.try_into().ok()?)),
            Self::Int32 => Value::Int32(i32::from_be_bytes(bytes.try_into().ok()?)),
            Self::Double => Value::Double(f64::from_be_bytes(bytes.try_into().ok()?)),
            Self::Vector3D => Value::Vector3D(several(bytes, f64::from_be_bytes)?),
            Self::Vector6D => Value::Vector6D(several(bytes, f64::from_be_bytes)?),
            Self::Vector6Int32 => Value::Vector6Int32(several(bytes, i32::from_be_bytes)?),
            Self::Vector6Uint32 => Value::Vector6Uint32(several(bytes, u32::from_be_bytes)?),
        })
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

fn one(bytes: &[u8]) -> Option<&u8> {
    bytes.first().filter(|_| bytes.len() == 1)
}

/// `N` numbers of `SIZE` bytes each; `None` when there are more bytes or fewer.
fn several<T: Copy + Default, const N: usize, const SIZE: usize>(
    bytes: &[u8],
    number: impl Fn([u8; SIZE]) -> T,
) -> Option<[T; N]> {
    let (chunks, rest) = bytes.as_chunks::<SIZE>();
    let mut all = [T::default(); N];
    for (to, from) in all.iter_mut().zip(chunks) {
        *to = number(*from);
    }
    (chunks.len() == N && rest.is_empty()).then_some(all)
}

/// A field's value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// 0 or 1.
    Bool(bool),
    /// 8 bits, without sign.
    Uint8(u8),
    /// 32 bits, without sign.
    Uint32(u32),
    /// 64 bits, without sign.
    Uint64(u64),
    /// 32 bits.
    Int32(i32),
    /// A double.
    Double(f64),
    /// 3 doubles.
    Vector3D([f64; 3]),
    /// 6 doubles.
    Vector6D([f64; 6]),
    /// 6 times 32 bits.
    Vector6Int32([i32; 6]),
    /// 6 times 32 bits, without sign.
    Vector6Uint32([u32; 6]),
}

impl Value {
    /// Its type.
    pub const fn kind(&self) -> Type {
        match self {
            Self::Bool(_) => Type::Bool,
            Self::Uint8(_) => Type::Uint8,
            Self::Uint32(_) => Type::Uint32,
            Self::Uint64(_) => Type::Uint64,
            Self::Int32(_) => Type::Int32,
            Self::Double(_) => Type::Double,
            Self::Vector3D(_) => Type::Vector3D,
            Self::Vector6D(_) => Type::Vector6D,
            Self::Vector6Int32(_) => Type::Vector6Int32,
            Self::Vector6Uint32(_) => Type::Vector6Uint32,
        }
    }

    /// Appends its bytes.
    pub fn write(&self, to: &mut Vec<u8>) {
        match self {
            Self::Bool(value) => to.push(u8::from(*value)),
            Self::Uint8(value) => to.push(*value),
            Self::Uint32(value) => to.extend_from_slice(&value.to_be_bytes()),
            Self::Uint64(value) => to.extend_from_slice(&value.to_be_bytes()),
            Self::Int32(value) => to.extend_from_slice(&value.to_be_bytes()),
            Self::Double(value) => to.extend_from_slice(&value.to_be_bytes()),
            Self::Vector3D(values) => {
                values.iter().for_each(|value| to.extend_from_slice(&value.to_be_bytes()))
            }
            Self::Vector6D(values) => {
                values.iter().for_each(|value| to.extend_from_slice(&value.to_be_bytes()))
            }
            Self::Vector6Int32(values) => {
                values.iter().for_each(|value| to.extend_from_slice(&value.to_be_bytes()));
            }
            Self::Vector6Uint32(values) => {
                values.iter().for_each(|value| to.extend_from_slice(&value.to_be_bytes()));
            }
        }
    }

    /// The double, where it is one.
    pub const fn double(self) -> Option<f64> {
        if let Self::Double(value) = self { Some(value) } else { None }
    }

    /// The integer, where it is one of 32 bits with sign.
    pub const fn int32(self) -> Option<i32> {
        if let Self::Int32(value) = self { Some(value) } else { None }
    }

    /// The bits, where they are 32.
    pub const fn uint32(self) -> Option<u32> {
        if let Self::Uint32(value) = self { Some(value) } else { None }
    }

    /// The three doubles, where they are.
    pub const fn vector3(self) -> Option<[f64; 3]> {
        if let Self::Vector3D(values) = self { Some(values) } else { None }
    }

    /// The six doubles, where they are.
    pub const fn vector6(self) -> Option<[f64; 6]> {
        if let Self::Vector6D(values) = self { Some(values) } else { None }
    }
}
