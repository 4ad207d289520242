//! Programs that the controller runs: the scripts of clients, recognised by their first line and emulated.

mod probepath;
pub(super) mod ur_rtde;

use self::probepath::Own;
use self::ur_rtde::UrRtde;
use super::registers::Bank;
use super::robot::Robot;

/// Ticks in a second.
pub(super) const TICKS_PER_S: f64 = 500.0;

/// What a program sees in one cycle.
pub(super) struct Cycle<'a> {
    pub(super) input: &'a Bank,
    pub(super) output: &'a mut Bank,
    pub(super) robot: &'a mut Robot,
    pub(super) hung: Hung,
}

/// Which of a script's threads stand still.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Hung {
    pub(super) reader: bool,
    pub(super) mover: bool,
}

/// Which script a text is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Script {
    /// probepath's own (`def probepath():`).
    Probepath,
    /// ur_rtde's (`def rtde_control():`).
    UrRtde,
    /// Another: the simulated controller has no interpreter and cannot run it.
    Unknown,
}

/// Which script was uploaded: the first line that is neither empty nor a comment says it. Any bytes are fine.
pub fn recognise(text: &[u8]) -> Script {
    let first = text
        .split(|byte| *byte == b'\n')
        .map(<[u8]>::trim_ascii)
        .find(|line| !line.is_empty() && !line.starts_with(b"#"));
    match first {
        Some(b"def probepath():") => Script::Probepath,
        Some(b"def rtde_control():") => Script::UrRtde,
        _ => Script::Unknown,
    }
}

/// A program that was started.
#[derive(Clone, Debug)]
pub(super) enum Program {
    UrRtde(Box<UrRtde>),
    Probepath(Box<Own>),
}

impl Program {
    /// The program of an uploaded text; `None` when it is none that is known.
    pub(super) fn of(text: &[u8]) -> Option<Self> {
        let words = || String::from_utf8_lossy(text).into_owned();
        match recognise(text) {
            Script::UrRtde => Some(Self::UrRtde(Box::new(UrRtde::of(&words())))),
            Script::Probepath => Own::of(&words()).map(|own| Self::Probepath(Box::new(own))),
            Script::Unknown => None,
        }
    }

    /// What it does before its first cycle.
    pub(super) fn begin(&mut self, cycle: &mut Cycle<'_>) {
        match self {
            Self::UrRtde(script) => script.begin(cycle),
            Self::Probepath(script) => script.begin(cycle),
        }
    }

    /// One cycle; why it ended, when it did.
    pub(super) fn tick(&mut self, cycle: &mut Cycle<'_>) -> Option<String> {
        match self {
            Self::UrRtde(script) if !cycle.hung.reader => script.tick(cycle),
            Self::UrRtde(_) => None,
            Self::Probepath(script) => script.tick(cycle),
        }
    }

    /// Its name, as the dashboard says it.
    pub(super) const fn name(&self) -> &'static str {
        match self {
            Self::UrRtde(_) => "rtde_control",
            Self::Probepath(_) => "probepath",
        }
    }

    /// Which integer input its client writes in every cycle.
    pub(super) const fn pulse(&self) -> usize {
        match self {
            Self::UrRtde(script) => script.offset(),
            Self::Probepath(_) => Own::pulse(),
        }
    }

    /// `rtde_set_watchdog`, which belongs to the controller: which integer input, and how often a second at least.
    pub(super) fn watchdog(&self) -> Option<(usize, f64)> {
        match self {
            Self::UrRtde(script) => script.watchdog(),
            Self::Probepath(script) => script.watchdog(),
        }
    }
}
