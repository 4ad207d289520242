//! One RTDE connection, without its socket: bytes in, bytes out. Written from the guide alone and apart from the
//! driver's codec, so that a misreading of one shows at the other.

mod inputs;

use std::collections::BTreeMap;

use super::core::Controller;
use super::outputs::Source;
use inputs::Slot;

/// Types of packages.
const VERSION: u8 = b'V';
const URCONTROL: u8 = b'v';
const TEXT: u8 = b'M';
const DATA: u8 = b'U';
const OUTPUTS: u8 = b'O';
const INPUTS: u8 = b'I';
const START: u8 = b'S';
const PAUSE: u8 = b'P';

/// Ticks of the controller in a second.
const FASTEST_HZ: f64 = 500.0;
/// Version 1 has no rate of the client's.
const V1_HZ: f64 = 125.0;
/// Input recipes of one connection; ids are a byte and 0 is the bad one.
const MOST_RECIPES: usize = 255;

/// Which client holds which input.
pub(super) type Owners = BTreeMap<String, u64>;

/// One connection's state. It begins in version 1 of the protocol.
#[derive(Debug)]
pub(super) struct Session {
    client: u64,
    version: u16,
    unread: Vec<u8>,
    outputs: Option<Outputs>,
    inputs: Vec<Vec<Slot>>,
    started: bool,
    racing: bool,
}

/// What it wants to hear, and how often.
#[derive(Debug)]
struct Outputs {
    sources: Vec<Source>,
    /// A package every so many ticks.
    every: i64,
}

/// What came of some bytes.
#[derive(Debug, Default)]
pub(super) struct Heard {
    /// What to answer.
    pub(super) replies: Vec<u8>,
    /// The connection has to be closed: no RTDE is spoken there.
    pub(super) close: bool,
    /// Integer inputs that were written, one entry for each package that wrote it.
    pub(super) written: Vec<usize>,
}

/// A package with its header. Longer ones than the header can say are cut, which no answer of ours is.
pub(super) fn package(kind: u8, payload: &[u8]) -> Vec<u8> {
    let size = u16::try_from(payload.len() + 3).unwrap_or(u16::MAX);
    let mut bytes = size.to_be_bytes().to_vec();
    bytes.push(kind);
    bytes.extend(payload.iter().take(usize::from(size) - 3));
    bytes
}

impl Session {
    /// A new connection. With `racing`, a data package leaves before the answer to START, as it may.
    pub(super) fn new(client: u64, racing: bool) -> Self {
        Self {
            client,
            version: 1,
            unread: Vec::new(),
            outputs: None,
            inputs: Vec::new(),
            started: false,
            racing,
        }
    }

    /// Whether it gets data packages.
    pub(super) const fn is_started(&self) -> bool {
        self.started
    }

    /// Some bytes came, however they were split.
    pub(super) fn hear(&mut self, bytes: &[u8], controller: &mut Controller, owners: &mut Owners) -> Heard {
        let mut heard = Heard::default();
        self.unread.extend_from_slice(bytes);
        let mut unread = std::mem::take(&mut self.unread);
        let mut used = 0;
        while let Some([high, low, kind]) = unread.get(used..used + 3) {
            let size = usize::from(u16::from_be_bytes([*high, *low]));
            if size < 3 {
                let why = format!("a package of {size} bytes: the header alone has 3");
                heard.replies.extend(self.text(&why, 0));
                heard.close = true;
                break;
            }
            let kind = *kind;
            let Some(payload) = unread.get(used + 3..used + size) else { break };
            self.one(kind, payload, controller, owners, &mut heard);
            used += size;
        }
        unread.drain(..used);
        self.unread = unread;
        heard
    }

    /// One whole package.
    fn one(
        &mut self,
        kind: u8,
        payload: &[u8],
        controller: &mut Controller,
        owners: &mut Owners,
        heard: &mut Heard,
    ) {
        let reply = match kind {
            VERSION => package(kind, &[u8::from(self.speaks(payload, controller))]),
            URCONTROL => {
                let v = controller.config.version;
                let all = [v.major, v.minor, v.bugfix, v.build];
                package(kind, &all.map(u32::to_be_bytes).concat())
            }
            OUTPUTS => self.set_up_outputs(payload),
            INPUTS => self.set_up_inputs(payload, controller, owners),
            START => {
                self.started = true;
                if self.racing {
                    heard.replies.extend(self.data(controller).unwrap_or_default());
                }
                package(kind, &[1])
            }
            PAUSE => {
                self.started = false;
                package(kind, &[1])
            }
            DATA => match self.take(payload, controller) {
                Ok(written) => {
                    heard.written.extend(written);
                    return;
                }
                Err(why) => self.text(&why, 1),
            },
            // What clients say to people.
            TEXT => return,
            _ => self.text(&format!("a package of type {kind}, which is none"), 1),
        };
        heard.replies.extend(reply);
    }

    fn speaks(&mut self, payload: &[u8], controller: &Controller) -> bool {
        let asked = match payload {
            [high, low] => u16::from_be_bytes([*high, *low]),
            _ => 0,
        };
        let fine = (1..=2).contains(&asked) && !controller.config.knobs.refuses_protocol;
        if fine {
            self.version = asked;
        }
        fine
    }

    /// Names, comma-separated; a trailing comma names nothing. In version 2 the rate comes before.
    fn set_up_outputs(&mut self, payload: &[u8]) -> Vec<u8> {
        let (rate, names) = match (self.version, payload.split_first_chunk::<8>()) {
            (1, _) => (V1_HZ, payload),
            (_, Some((rate, names))) => (f64::from_be_bytes(*rate), names),
            _ => (FASTEST_HZ, &[][..]),
        };
        let found: Vec<(Option<Source>, &'static str)> =
            names_of(names).map(|name| described(&name)).collect();
        let types: Vec<&str> = found.iter().map(|(_, kind)| *kind).collect();
        let sources: Option<Vec<Source>> = found.iter().map(|(source, _)| *source).collect();
        self.outputs = sources.map(|sources| Outputs { sources, every: every(rate) });
        let mut reply = if self.version == 1 { Vec::new() } else { vec![u8::from(self.outputs.is_some())] };
        reply.extend(types.join(",").bytes());
        package(OUTPUTS, &reply)
    }

    fn set_up_inputs(&mut self, payload: &[u8], controller: &Controller, owners: &mut Owners) -> Vec<u8> {
        let names: Vec<String> = names_of(payload).collect();
        let taken = &controller.config.knobs.taken;
        let slots: Vec<(Option<Slot>, &'static str)> = names
            .iter()
            .map(|name| match Slot::of(name) {
                None => (None, "NOT_FOUND"),
                Some(_) if owners.get(name).is_some_and(|owner| *owner != self.client) => (None, "IN_USE"),
                Some(_) if taken.iter().any(|other| other == name || other == "*") => (None, "IN_USE"),
                Some(slot) => (Some(slot), slot.kind()),
            })
            .collect();
        let types: Vec<&str> = slots.iter().map(|(_, kind)| *kind).collect();
        let whole: Option<Vec<Slot>> = slots.iter().map(|(slot, _)| *slot).collect();
        let mut id = 0;
        if let Some(recipe) = whole.filter(|_| self.inputs.len() < MOST_RECIPES && !names.is_empty()) {
            self.inputs.push(recipe);
            id = u8::try_from(self.inputs.len()).unwrap_or(0);
            owners.extend(names.into_iter().map(|name| (name, self.client)));
        }
        let mut reply = vec![id];
        reply.extend(types.join(",").bytes());
        package(INPUTS, &reply)
    }

    /// A package of inputs; which integers it wrote.
    fn take(&self, payload: &[u8], controller: &mut Controller) -> Result<Vec<usize>, String> {
        let (id, values) = payload.split_first().ok_or("an empty data package")?;
        let recipe = usize::from(*id).checked_sub(1).and_then(|index| self.inputs.get(index));
        let recipe = recipe.ok_or_else(|| format!("a data package of recipe {id}, which was not set up"))?;
        let needed: usize = recipe.iter().map(|slot| slot.size()).sum();
        // One that is longer has its fields taken and its rest left: ur_rtde 1.6.5's getForwardKinematics(q, tcp) sends 12
        // numbers by a recipe of 6.
        if values.len() < needed {
            return Err(format!("a data package of recipe {id} with {} bytes of {needed}", values.len()));
        }
        controller.counters.inputs += 1;
        Ok(inputs::take(recipe, values, controller))
    }

    /// The package of this tick, when one is due.
    pub(super) fn due(&self, controller: &Controller) -> Option<Vec<u8>> {
        let every = self.outputs.as_ref()?.every;
        if !self.started || controller.clock_ticks() % every != 0 {
            return None;
        }
        self.data(controller)
    }

    /// The package of now, whatever the rate, once it was started.
    pub(super) fn anyway(&self, controller: &Controller) -> Option<Vec<u8>> {
        if self.started { self.data(controller) } else { None }
    }

    fn data(&self, controller: &Controller) -> Option<Vec<u8>> {
        let outputs = self.outputs.as_ref()?;
        let mut payload = Vec::with_capacity(outputs.sources.len() * 16);
        if self.version > 1 {
            payload.push(1);
        }
        outputs.sources.iter().for_each(|source| source.value(controller).put(&mut payload));
        Some(package(DATA, &payload))
    }

    /// A message for people. Level 0 exception, 1 error, 2 warning, 3 info.
    pub(super) fn text(&self, message: &str, level: u8) -> Vec<u8> {
        let short: Vec<u8> = message.bytes().take(255).collect();
        if self.version == 1 {
            return package(TEXT, &[&[level], &short[..]].concat());
        }
        let source = b"simulated controller";
        let length = |text: &[u8]| u8::try_from(text.len()).unwrap_or(u8::MAX);
        let (long, from) = (length(&short), length(source));
        package(TEXT, &[&[long], &short[..], &[from], &source[..], &[level]].concat())
    }
}

/// Every name of a list.
fn names_of(bytes: &[u8]) -> impl Iterator<Item = String> {
    let names: Vec<String> = bytes
        .split(|byte| *byte == b',')
        .map(|name| String::from_utf8_lossy(name.trim_ascii()).into_owned())
        .filter(|name| !name.is_empty())
        .collect();
    names.into_iter()
}

fn described(name: &str) -> (Option<Source>, &'static str) {
    let source = Source::of(name);
    (source, source.map_or("NOT_FOUND", |source| source.kind()))
}

/// How many ticks lie between two packages at a rate.
fn every(rate_hz: f64) -> i64 {
    let rate = if rate_hz.is_finite() && rate_hz > 0.0 { rate_hz.min(FASTEST_HZ) } else { FASTEST_HZ };
    ((FASTEST_HZ / rate).round() as i64).clamp(1, 50_000)
}
