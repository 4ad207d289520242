//! [`Request`] and [`Reply`]: what either end can say.

use super::{Frame, RtdeError, Text, kind};

/// The protocol's version that a connection speaks: it begins with 1, until 2 is accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Version {
    /// Recipes have no number, and there is no frequency.
    #[default]
    V1,
    /// Since PolyScope 3.4.
    V2,
}

/// The controller's version, as it says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ControllerVersion {
    /// 5 on the e-series, 3 on CB3.
    pub major: u32,
    /// The second number.
    pub minor: u32,
    /// The third.
    pub bugfix: u32,
    /// The fourth.
    pub build: u32,
}

impl std::fmt::Display for ControllerVersion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}.{}.{}", self.major, self.minor, self.bugfix, self.build)
    }
}

/// What a client says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request<'a> {
    /// Speak this version from now on.
    ProtocolVersion(u16),
    /// Which version has the controller?
    ControllerVersion,
    /// Words.
    Text(Text<'a>),
    /// The fields of an input recipe, packed.
    Data {
        /// The recipe; always 0 in version 1.
        recipe: u8,
        /// Its fields.
        fields: &'a [u8],
    },
    /// Tell me these.
    Outputs {
        /// How often; version 1 has no such wish, and reads as 125.
        frequency_hz: f64,
        /// Their names, with commas between; some clients put one after the last.
        names: &'a str,
    },
    /// I shall tell you these.
    Inputs {
        /// Their names, with commas between.
        names: &'a str,
    },
    /// Send data packages.
    Start,
    /// Send none for now.
    Pause,
}

/// What the controller says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reply<'a> {
    /// To [`Request::ProtocolVersion`].
    ProtocolVersion {
        /// Whether it is spoken from now on.
        accepted: bool,
    },
    /// To [`Request::ControllerVersion`].
    ControllerVersion(ControllerVersion),
    /// Words, at any time.
    Text(Text<'a>),
    /// The fields of an output recipe, packed.
    Data {
        /// The recipe; always 0 in version 1.
        recipe: u8,
        /// Its fields.
        fields: &'a [u8],
    },
    /// To [`Request::Outputs`].
    Outputs {
        /// The recipe's number; always 0 in version 1.
        recipe: u8,
        /// Their types, with commas between, or `NOT_FOUND`.
        types: &'a str,
    },
    /// To [`Request::Inputs`].
    Inputs {
        /// The recipe's number; 0 when it is refused.
        recipe: u8,
        /// Their types, with commas between, or `NOT_FOUND`, or `IN_USE`.
        types: &'a str,
    },
    /// To [`Request::Start`]; data may come before it.
    Start {
        /// Whether data packages come.
        accepted: bool,
    },
    /// To [`Request::Pause`].
    Pause {
        /// Whether no more come.
        accepted: bool,
    },
}

/// What version 1 sends at.
const V1_HZ: f64 = 125.0;

impl<'a> Request<'a> {
    /// What a client's frame says.
    ///
    /// # Errors
    /// When its payload is not what its kind has.
    pub fn read(frame: Frame<'a>, version: Version) -> Result<Self, RtdeError> {
        let Frame { kind, payload } = frame;
        Ok(match kind {
            kind::PROTOCOL_VERSION => Self::ProtocolVersion(u16::from_be_bytes(exactly(
                "a wish for a protocol version",
                payload,
                "it has 2",
            )?)),
            kind::CONTROLLER_VERSION => {
                nothing("a question for the version", payload).map(|()| Self::ControllerVersion)?
            }
            kind::TEXT => Self::Text(Text::read(payload, version)?),
            kind::DATA => {
                let (recipe, fields) = numbered("a data package", payload, version)?;
                Self::Data { recipe, fields }
            }
            kind::OUTPUTS => Self::outputs(payload, version)?,
            kind::INPUTS => Self::Inputs { names: text("names", payload)? },
            kind::START => nothing("a start", payload).map(|()| Self::Start)?,
            kind::PAUSE => nothing("a pause", payload).map(|()| Self::Pause)?,
            other => return Err(unknown(other)),
        })
    }

    fn outputs(payload: &'a [u8], version: Version) -> Result<Self, RtdeError> {
        if version == Version::V1 {
            return Ok(Self::Outputs { frequency_hz: V1_HZ, names: text("names", payload)? });
        }
        let (hz, names) = payload
            .split_first_chunk()
            .ok_or_else(|| short("an output recipe", payload, "its frequency alone has 8"))?;
        Ok(Self::Outputs { frequency_hz: f64::from_be_bytes(*hz), names: text("names", names)? })
    }

    /// Appends the frame.
    ///
    /// # Errors
    /// When it does not fit into one.
    pub fn write(&self, version: Version, to: &mut Vec<u8>) -> Result<(), RtdeError> {
        frame(self.kind(), to, |to| {
            match self {
                Self::ProtocolVersion(wanted) => to.extend_from_slice(&wanted.to_be_bytes()),
                Self::ControllerVersion | Self::Start | Self::Pause => {}
                Self::Text(text) => text.write(version, to)?,
                Self::Data { recipe, fields } => number(*recipe, fields, version, to),
                Self::Outputs { frequency_hz, names } => {
                    if version == Version::V2 {
                        to.extend_from_slice(&frequency_hz.to_be_bytes());
                    }
                    to.extend_from_slice(names.as_bytes());
                }
                Self::Inputs { names } => to.extend_from_slice(names.as_bytes()),
            }
            Ok(())
        })
    }

    const fn kind(&self) -> u8 {
        match self {
            Self::ProtocolVersion(_) => kind::PROTOCOL_VERSION,
            Self::ControllerVersion => kind::CONTROLLER_VERSION,
            Self::Text(_) => kind::TEXT,
            Self::Data { .. } => kind::DATA,
            Self::Outputs { .. } => kind::OUTPUTS,
            Self::Inputs { .. } => kind::INPUTS,
            Self::Start => kind::START,
            Self::Pause => kind::PAUSE,
        }
    }
}

impl<'a> Reply<'a> {
    /// What a controller's frame says.
    ///
    /// # Errors
    /// When its payload is not what its kind has.
    pub fn read(frame: Frame<'a>, version: Version) -> Result<Self, RtdeError> {
        let Frame { kind, payload } = frame;
        Ok(match kind {
            kind::PROTOCOL_VERSION => {
                Self::ProtocolVersion { accepted: accepted("the answer to a protocol version", payload)? }
            }
            kind::CONTROLLER_VERSION => Self::ControllerVersion(ControllerVersion::read(payload)?),
            kind::TEXT => Self::Text(Text::read(payload, version)?),
            kind::DATA => {
                let (recipe, fields) = numbered("a data package", payload, version)?;
                Self::Data { recipe, fields }
            }
            kind::OUTPUTS => {
                let (recipe, types) = numbered("the answer to an output recipe", payload, version)?;
                Self::Outputs { recipe, types: text("types", types)? }
            }
            kind::INPUTS => {
                let (recipe, types) = numbered("the answer to an input recipe", payload, Version::V2)?;
                Self::Inputs { recipe, types: text("types", types)? }
            }
            kind::START => Self::Start { accepted: accepted("the answer to a start", payload)? },
            kind::PAUSE => Self::Pause { accepted: accepted("the answer to a pause", payload)? },
            other => return Err(unknown(other)),
        })
    }

    /// Appends the frame.
    ///
    /// # Errors
    /// When it does not fit into one.
    pub fn write(&self, version: Version, to: &mut Vec<u8>) -> Result<(), RtdeError> {
        frame(self.kind(), to, |to| {
            match self {
                Self::ProtocolVersion { accepted } | Self::Start { accepted } | Self::Pause { accepted } => {
                    to.push(u8::from(*accepted));
                }
                Self::ControllerVersion(version) => version.write(to),
                Self::Text(text) => text.write(version, to)?,
                Self::Data { recipe, fields } => number(*recipe, fields, version, to),
                Self::Outputs { recipe, types } => number(*recipe, types.as_bytes(), version, to),
                Self::Inputs { recipe, types } => number(*recipe, types.as_bytes(), Version::V2, to),
            }
            Ok(())
        })
    }

    const fn kind(&self) -> u8 {
        match self {
            Self::ProtocolVersion { .. } => kind::PROTOCOL_VERSION,
            Self::ControllerVersion(_) => kind::CONTROLLER_VERSION,
            Self::Text(_) => kind::TEXT,
            Self::Data { .. } => kind::DATA,
            Self::Outputs { .. } => kind::OUTPUTS,
            Self::Inputs { .. } => kind::INPUTS,
            Self::Start { .. } => kind::START,
            Self::Pause { .. } => kind::PAUSE,
        }
    }
}

impl ControllerVersion {
    fn read(payload: &[u8]) -> Result<Self, RtdeError> {
        let numbers: [u8; 16] = exactly("the controller's version", payload, "it has 16")?;
        let (chunks, _) = numbers.as_chunks::<4>();
        let mut all = chunks.iter().map(|chunk| u32::from_be_bytes(*chunk));
        let mut next = || all.next().unwrap_or_default();
        Ok(Self { major: next(), minor: next(), bugfix: next(), build: next() })
    }

    fn write(&self, to: &mut Vec<u8>) {
        for number in [self.major, self.minor, self.bugfix, self.build] {
            to.extend_from_slice(&number.to_be_bytes());
        }
    }
}

/// Appends a frame around what `payload` appends; nothing when it does not fit.
fn frame(
    kind: u8,
    to: &mut Vec<u8>,
    payload: impl FnOnce(&mut Vec<u8>) -> Result<(), RtdeError>,
) -> Result<(), RtdeError> {
    let start = to.len();
    to.extend_from_slice(&[0, 0, kind]);
    let written = payload(to);
    let length = to.len() - start;
    let fits = u16::try_from(length).map_err(|_| RtdeError::DoesNotFit { what: "payloads", length });
    let written = written.and(fits);
    if written.is_err() {
        to.truncate(start);
    }
    let length = written?.to_be_bytes();
    for (to, from) in to.iter_mut().skip(start).zip(length) {
        *to = from;
    }
    Ok(())
}

/// A recipe's number before its content, which version 1 does not have.
fn number(recipe: u8, content: &[u8], version: Version, to: &mut Vec<u8>) {
    if version == Version::V2 {
        to.push(recipe);
    }
    to.extend_from_slice(content);
}

fn numbered<'a>(
    what: &'static str,
    payload: &'a [u8],
    version: Version,
) -> Result<(u8, &'a [u8]), RtdeError> {
    if version == Version::V1 {
        return Ok((0, payload));
    }
    let (&[recipe], content) =
        payload.split_first_chunk().ok_or_else(|| short(what, payload, "the recipe's number alone has 1"))?;
    Ok((recipe, content))
}

fn accepted(what: &'static str, payload: &[u8]) -> Result<bool, RtdeError> {
    let [found] = exactly(what, payload, "it has 1")?;
    match found {
        0 | 1 => Ok(found == 1),
        _ => Err(RtdeError::NoBool { what, found }),
    }
}

fn nothing(what: &'static str, payload: &[u8]) -> Result<(), RtdeError> {
    if payload.is_empty() { Ok(()) } else { Err(short(what, payload, "it has none")) }
}

fn exactly<const N: usize>(
    what: &'static str,
    payload: &[u8],
    expected: &'static str,
) -> Result<[u8; N], RtdeError> {
    payload.try_into().map_err(|_| short(what, payload, expected))
}

pub(super) fn short(what: &'static str, payload: &[u8], expected: &'static str) -> RtdeError {
    RtdeError::Payload { what, found: payload.len(), expected }
}

pub(super) fn cut(bytes: &[u8], at: usize) -> Option<(&[u8], &[u8])> {
    bytes.split_at_checked(at)
}

fn text<'a>(what: &'static str, bytes: &'a [u8]) -> Result<&'a str, RtdeError> {
    if let Some(at) = bytes.iter().position(|byte| !(0x20..0x7f).contains(byte)) {
        return Err(RtdeError::NoText { what, byte: bytes.get(at).copied().unwrap_or_default(), at });
    }
    str::from_utf8(bytes).map_err(|error| RtdeError::NoText { what, byte: 0, at: error.valid_up_to() })
}

fn unknown(kind: u8) -> RtdeError {
    RtdeError::UnknownKind { kind, shown: char::from(kind), http: false }
}
