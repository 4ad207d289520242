//! [`Link`]: the RTDE connection, from its first byte to its recipes, and then a package out and a package in.

use std::time::Duration;

use super::measured::{Measured, OUTPUTS, RATE_HZ};
use super::registers::INPUTS;
use super::rtde::{
    self, ControllerVersion, Decoder, Recipe, Reply, Request, RtdeError, Text, Version, input_type,
    output_type,
};
use super::socket::Socket;
use super::{UrError, clock, error};

/// How long an answer may take while connecting.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

/// How long its first answer may take. A controller gives it within milliseconds; another server, a web server for one,
/// may wait for more than we send.
const FIRST_ANSWER: Duration = Duration::from_secs(2);

/// The longest frame that a controller sends us: ours are below 500 bytes, and so are its words.
const LONGEST: usize = 4096;

/// The last words of a controller that are kept.
const WORDS: usize = 255;

/// What goes out at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Order {
    pub(super) sequence: i32,
    pub(super) command: i32,
    pub(super) session: i32,
    pub(super) setpoint: [f64; 6],
}

/// So many packages that came together with a newer one are kept: half a second of them, after which every guard has
/// stopped the arm.
pub(super) const OLDER: usize = 256;

/// What came in: the newest package; those that came before it and together with it are in [`Link::older`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Received {
    pub(super) newest: Measured,
    pub(super) older: u64,
}

/// An RTDE connection with its recipes agreed.
#[derive(Debug)]
pub(super) struct Link {
    socket: Socket,
    decoder: Decoder,
    outputs: Recipe,
    inputs: Recipe,
    version: ControllerVersion,
    fields: Vec<u8>,
    packet: Vec<u8>,
    words: [u8; WORDS],
    said: usize,
    pub(super) texts: u64,
    /// The packages that came together with a newer one since [`forget`](Self::forget), oldest first; no more than there
    /// is room for.
    pub(super) older: Vec<Measured>,
}

impl Link {
    /// Connects, agrees on version 2 and both recipes, and starts the packages.
    pub(super) fn open(host: &str) -> Result<Self, UrError> {
        let socket = Socket::open(host, rtde::PORT, "RTDE server", FIRST_ANSWER)?;
        let none = || Recipe::new(0, []);
        let version = ControllerVersion { major: 0, minor: 0, bugfix: 0, build: 0 };
        let mut link = Self {
            socket,
            decoder: Decoder::with_limit(LONGEST),
            outputs: none(),
            inputs: none(),
            version,
            fields: Vec::with_capacity(256),
            packet: Vec::with_capacity(512),
            words: [0; WORDS],
            said: 0,
            texts: 0,
            older: Vec::with_capacity(OLDER),
        };
        link.version_2()?;
        link.wait_at_most(PATIENCE)?;
        link.version = link.controller_version()?;
        Ok(link)
    }

    /// Agrees on both recipes, and starts the packages.
    pub(super) fn agree(&mut self) -> Result<(), UrError> {
        self.outputs = self.asked_outputs()?;
        self.inputs = self.asked_inputs()?;
        let doing = "starting the packages";
        self.say(Request::Start, Version::V2, doing)?;
        match self.answered(Version::V2, doing, |reply| match reply {
            Reply::Start { accepted } => Some(accepted),
            _ => None,
        })? {
            true => Ok(()),
            false => Err(UrError::NotReady { why: "the controller does not start its data packages".into() }),
        }
    }

    /// The controller's version.
    pub(super) const fn version(&self) -> ControllerVersion {
        self.version
    }

    /// Every later wait takes this long at most.
    pub(super) fn wait_at_most(&self, patience: Duration) -> Result<(), UrError> {
        self.socket.wait_at_most(patience)
    }

    /// What the controller said last in words, empty when nothing.
    pub(super) fn said(&self) -> String {
        String::from_utf8_lossy(self.words.get(..self.said).unwrap_or_default()).into_owned()
    }

    fn version_2(&mut self) -> Result<(), UrError> {
        let doing = "agreeing on the protocol's version";
        self.say(Request::ProtocolVersion(2), Version::V1, doing)?;
        let accepted = self.answered(Version::V1, doing, |reply| match reply {
            Reply::ProtocolVersion { accepted } => Some(accepted),
            _ => None,
        })?;
        if accepted { Ok(()) } else { Err(UrError::OldProtocol) }
    }

    fn controller_version(&mut self) -> Result<ControllerVersion, UrError> {
        let doing = "asking for its version";
        self.say(Request::ControllerVersion, Version::V2, doing)?;
        self.answered(Version::V2, doing, |reply| match reply {
            Reply::ControllerVersion(version) => Some(version),
            _ => None,
        })
    }

    fn asked_outputs(&mut self) -> Result<Recipe, UrError> {
        let doing = "agreeing on what it tells";
        self.say(Request::Outputs { frequency_hz: RATE_HZ, names: OUTPUTS }, Version::V2, doing)?;
        let agreed = self.answered(Version::V2, doing, |reply| match reply {
            Reply::Outputs { recipe, types } => Some(Recipe::agreed(OUTPUTS, output_type, recipe, types)),
            _ => None,
        })?;
        agreed.map_err(|source| UrError::Rtde { doing, source })
    }

    fn asked_inputs(&mut self) -> Result<Recipe, UrError> {
        let doing = "agreeing on what it is told";
        self.say(Request::Inputs { names: INPUTS }, Version::V2, doing)?;
        let agreed = self.answered(Version::V2, doing, |reply| match reply {
            Reply::Inputs { recipe, types } => Some(Recipe::agreed(INPUTS, input_type, recipe, types)),
            _ => None,
        })?;
        agreed.map_err(|source| UrError::Rtde { doing, source })
    }

    fn say(&mut self, request: Request<'_>, version: Version, doing: &'static str) -> Result<(), UrError> {
        self.packet.clear();
        request.write(version, &mut self.packet).map_err(|source| UrError::Rtde { doing, source })?;
        self.socket.write(&self.packet, doing)
    }

    /// The answer that `wanted` picks; words may come before it, and data packages.
    fn answered<T>(
        &mut self,
        version: Version,
        doing: &'static str,
        wanted: impl Fn(Reply<'_>) -> Option<T>,
    ) -> Result<T, UrError> {
        let began = clock::now();
        loop {
            while let Some(frame) = self.decoder.next().map_err(error::rtde(doing))? {
                match Reply::read(frame, version).map_err(error::rtde(doing))? {
                    Reply::Text(text) => {
                        self.texts += 1;
                        self.said = keep(&mut self.words, &text);
                    }
                    Reply::Data { .. } => {}
                    reply => {
                        let kind = error::kind_of(&reply);
                        return wanted(reply).ok_or(UrError::Unexpected { doing, kind });
                    }
                }
            }
            let count = self.socket.read(self.decoder.room(), doing, began, PATIENCE)?;
            self.decoder.filled(count);
        }
    }

    /// Sends the order of a tick. No heap.
    pub(super) fn send(&mut self, order: &Order) -> Result<(), UrError> {
        self.fields.clear();
        for number in [order.sequence, order.command, order.session] {
            self.fields.extend_from_slice(&number.to_be_bytes());
        }
        for number in order.setpoint {
            self.fields.extend_from_slice(&number.to_be_bytes());
        }
        self.packet.clear();
        let doing = "sending a command";
        Request::Data { recipe: self.inputs.number(), fields: &self.fields }
            .write(Version::V2, &mut self.packet)
            .map_err(|source| UrError::Rtde { doing, source })?;
        self.socket.write(&self.packet, doing)
    }

    /// Forgets the packages that were overtaken: a new exchange begins.
    pub(super) fn forget(&mut self) {
        self.older.clear();
    }

    /// Waits for the next package, and gives the newest of those that have come. No heap.
    pub(super) fn receive(&mut self, patience: Duration) -> Result<Received, UrError> {
        let (began, doing) = (clock::now(), "waiting for its next package");
        loop {
            if let Some(received) = self.newest(doing)? {
                return Ok(received);
            }
            let count = self.socket.read(self.decoder.room(), doing, began, patience)?;
            self.decoder.filled(count);
        }
    }

    /// Reads away what has come while nobody asked, into [`older`](Self::older); how many packages that was. No heap.
    pub(super) fn drain(&mut self) -> Result<u64, UrError> {
        let doing = "reading what came meanwhile";
        let io = |source| UrError::Io { what: "RTDE server", doing, source };
        self.socket.stream.set_nonblocking(true).map_err(io)?;
        let drained = self.drained(doing);
        self.socket.stream.set_nonblocking(false).map_err(io)?;
        drained
    }

    fn drained(&mut self, doing: &'static str) -> Result<u64, UrError> {
        let mut packages = 0;
        let began = clock::now();
        // As much as a full receive buffer holds, and then it is enough.
        for _ in 0..256 {
            if let Some(received) = self.newest(doing)? {
                packages += received.older + 1;
                keep_older(&mut self.older, received.newest);
            }
            match self.socket.read(self.decoder.room(), doing, began, PATIENCE) {
                Ok(count) => self.decoder.filled(count),
                Err(UrError::Silent { .. }) => break,
                Err(error) => return Err(error),
            }
        }
        Ok(packages)
    }

    /// The newest of the whole packages that wait in the decoder.
    fn newest(&mut self, doing: &'static str) -> Result<Option<Received>, UrError> {
        let (mut newest, mut older): (Option<Measured>, u64) = (None, 0);
        while let Some(frame) = self.decoder.next().map_err(error::rtde(doing))? {
            match Reply::read(frame, Version::V2).map_err(error::rtde(doing))? {
                Reply::Data { recipe, fields } => {
                    self.outputs.check(recipe, fields).map_err(error::rtde(doing))?;
                    let next = measured(&self.outputs, fields).map_err(error::rtde(doing))?;
                    if let Some(overtaken) = newest.replace(next) {
                        older += 1;
                        keep_older(&mut self.older, overtaken);
                    }
                }
                Reply::Text(text) => {
                    self.texts += 1;
                    self.said = keep(&mut self.words, &text);
                }
                Reply::Start { .. } | Reply::Pause { .. } => {}
                other => return Err(UrError::Unexpected { doing, kind: error::kind_of(&other) }),
            }
        }
        Ok(newest.map(|newest| Received { newest, older }))
    }
}

/// Keeps a package that was overtaken, where there is room.
fn keep_older(older: &mut Vec<Measured>, overtaken: Measured) {
    if older.len() < older.capacity().min(OLDER) {
        older.push(overtaken);
    }
}

fn measured(outputs: &Recipe, fields: &[u8]) -> Result<Measured, RtdeError> {
    Measured::read(outputs, fields).ok_or(RtdeError::Package {
        recipe: outputs.number(),
        found: fields.len(),
        expected: outputs.size(),
    })
}

/// Copies what is said over what was said before; how long it is.
fn keep(words: &mut [u8; WORDS], text: &Text<'_>) -> usize {
    for (to, from) in words.iter_mut().zip(text.message) {
        *to = *from;
    }
    text.message.len().min(WORDS)
}
