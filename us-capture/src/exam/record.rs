//! What an exam is made of, as plain values.

use std::borrow::Cow;
use std::collections::BTreeMap;

use probepath_frames::{Point, Pose, Probe, Span, Stamp, World, Wrench};
use sha2::{Digest, Sha256};

use crate::exam::ExamError;

/// The most numbers a [`Row`] holds: one per joint of the longest chain an arm here may have.
pub const ROW_ROOM: usize = 8;

/// A few numbers on the stack, one per joint of whatever arm holds the probe (rad or m, or a rate of these), so that
/// recording a tick touches no heap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    values: [f64; ROW_ROOM],
    len: usize,
}

impl Row {
    /// The numbers of a slice.
    ///
    /// # Errors
    /// When there are more than [`ROW_ROOM`].
    pub fn from_slice(values: &[f64]) -> Result<Self, ExamError> {
        let mut row = Self { len: values.len(), ..Self::default() };
        let room =
            row.values.get_mut(..values.len()).ok_or(ExamError::TooManyJoints { found: values.len() })?;
        room.copy_from_slice(values);
        Ok(row)
    }

    /// The numbers.
    pub fn as_slice(&self) -> &[f64] {
        self.values.get(..self.len).unwrap_or_default()
    }
}

/// One tick of the control loop: the command that went out and the state that came back, exact to the bit.
#[derive(Clone, Debug, PartialEq)]
pub struct TickRecord {
    /// Ticks since the connection.
    pub tick: u64,
    /// When the joints were measured.
    pub stamp: Stamp,
    /// The joint positions that were commanded for this tick (rad, m); `None` when the arm was told to stay,
    /// or to give way.
    pub command: Option<Row>,
    /// Measured joint positions (rad, m).
    pub position: Row,
    /// Measured joint velocities (rad/s, m/s).
    pub velocity: Row,
    /// The joint positions that the arm says it was last told to be at (rad, m).
    pub commanded: Row,
    /// What the outside does to the probe.
    pub wrench: Wrench<Probe>,
    /// The hold-to-move switch.
    pub guiding: bool,
    /// What the session was doing (`teach`, `approach`, `replay`, ...); borrowed, so that a tick touches no heap.
    pub phase: Cow<'static, str>,
    /// Where the probe was, by the arm's model; `None` when nobody asked the model.
    pub world_from_probe: Option<Pose<World, Probe>>,
    /// What the arm's safety system said (`reduced`, `protective stop`, ...); empty while all is well.
    pub safety: Cow<'static, str>,
    /// Whether the arm was told to give way to the hand; then there is no `command`.
    pub freedrive: bool,
    /// How old the measurement was, by the host's clock, when it was used; zero in simulation.
    pub age: Span,
    /// Whether a newer state came together with this one: it was seen, and nothing was commanded upon it.
    pub overtaken: bool,
}

/// How grave an [`Event`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Something happened that was meant to.
    Info,
    /// Something the operator should look at.
    Warning,
    /// Something failed.
    Error,
}

/// Something that happened, in words: what a log line would say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// When.
    pub stamp: Stamp,
    /// How grave.
    pub level: Level,
    /// Which part of the system says it (`guard`, `session`, ...).
    pub source: String,
    /// What, in words.
    pub text: String,
}

/// A surface for viewers: the lumen, once it is reconstructed. It is a copy, in single numbers of a viewer's scene: the
/// surface itself is made again from the B-scans.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// When it was made.
    pub stamp: Stamp,
    /// What it is (`lumen`, ...); a later one of the same name replaces it in the viewer.
    pub name: String,
    /// Its corners.
    pub vertices: Vec<Point<World>>,
    /// Its triangles, as indices of corners.
    pub triangles: Vec<[u32; 3]>,
}

/// A file inside the exam file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Its name; the constructors give the ones that the rest of the system looks for.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

impl Attachment {
    /// Name of the arm's URDF.
    pub const URDF: &str = "arm.urdf";
    /// Name of the cell description.
    pub const CELL: &str = "cell.toml";
    /// Name of the calibration.
    pub const CALIBRATION: &str = "calibration.toml";
    /// Name of the protocol's text.
    pub const PROTOCOL: &str = "protocol.rhai";
    /// Name of the taught path.
    pub const PATH: &str = "taught.path.toml";
    /// Name of the report.
    pub const REPORT: &str = "report.html";

    /// A file of the given name and media type.
    pub fn new(name: impl Into<String>, media_type: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { name: name.into(), media_type: media_type.into(), bytes: bytes.into() }
    }

    /// The arm's URDF.
    pub fn urdf(text: impl Into<Vec<u8>>) -> Self {
        Self::new(Self::URDF, "application/xml", text)
    }

    /// The cell description.
    pub fn cell(text: impl Into<Vec<u8>>) -> Self {
        Self::new(Self::CELL, "application/toml", text)
    }

    /// The calibration with its error.
    pub fn calibration(text: impl Into<Vec<u8>>) -> Self {
        Self::new(Self::CALIBRATION, "application/toml", text)
    }

    /// The protocol's text.
    pub fn protocol(text: impl Into<Vec<u8>>) -> Self {
        Self::new(Self::PROTOCOL, "text/plain", text)
    }

    /// The taught path.
    pub fn path(text: impl Into<Vec<u8>>) -> Self {
        Self::new(Self::PATH, "application/toml", text)
    }

    /// The report.
    pub fn report(html: impl Into<Vec<u8>>) -> Self {
        Self::new(Self::REPORT, "text/html", html)
    }

    /// The bytes as text.
    ///
    /// # Errors
    /// When they are not UTF-8.
    pub fn text(&self) -> Result<&str, ExamError> {
        std::str::from_utf8(&self.bytes).map_err(|_| ExamError::NotText { name: self.name.clone() })
    }
}

/// What an exam is, in a few words: its first metadata record. There is no field for a person's name, and a study
/// code that could be one is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExamHeader {
    /// The software that recorded it, with its version.
    pub software: String,
    /// The study's code for this exam: letters, digits, `-`, `_` and `.` only.
    pub study_code: String,
    /// The protocol's name.
    pub protocol: String,
    /// SHA-256 of the protocol's text (hexadecimal).
    pub protocol_sha256: String,
    /// Id of the calibration; empty when there was none.
    pub calibration_id: String,
    /// Seed of the simulated world; `None` for a real exam.
    pub seed: Option<u64>,
    /// The arm's joint names, in the order of every [`Row`].
    pub joint_names: Vec<String>,
    /// The time between two ticks.
    pub period: Span,
}

impl ExamHeader {
    /// SHA-256 of a protocol's text, hexadecimal.
    pub fn sha256(text: &str) -> String {
        Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Name of its metadata record.
    pub(crate) const NAME: &str = "probepath.exam";
    /// Version of the layout; a reader refuses a newer one.
    pub(crate) const FORMAT: u32 = 1;

    /// Before anything was read.
    pub(crate) fn unknown() -> Self {
        Self {
            software: String::new(),
            study_code: String::new(),
            protocol: String::new(),
            protocol_sha256: String::new(),
            calibration_id: String::new(),
            seed: None,
            joint_names: Vec::new(),
            period: Span::ZERO,
        }
    }

    pub(crate) fn to_metadata(&self) -> Result<BTreeMap<String, String>, ExamError> {
        check_study_code(&self.study_code)?;
        let mut map = BTreeMap::from([
            ("format".into(), Self::FORMAT.to_string()),
            ("software".into(), self.software.clone()),
            ("study_code".into(), self.study_code.clone()),
            ("protocol".into(), self.protocol.clone()),
            ("protocol_sha256".into(), self.protocol_sha256.clone()),
            ("calibration_id".into(), self.calibration_id.clone()),
            ("joint_names".into(), serde_json::Value::from(self.joint_names.clone()).to_string()),
            ("period_ns".into(), self.period.nanoseconds().to_string()),
        ]);
        if let Some(seed) = self.seed {
            map.insert("seed".into(), seed.to_string());
        }
        Ok(map)
    }

    pub(crate) fn from_metadata(map: &BTreeMap<String, String>) -> Result<Self, ExamError> {
        let text = |field: &'static str| map.get(field).cloned().ok_or(ExamError::Missing { field });
        let format: u32 = number(&text("format")?, "format")?;
        if format > Self::FORMAT {
            return Err(ExamError::NewerFormat { found: format, known: Self::FORMAT });
        }
        Ok(Self {
            software: text("software")?,
            study_code: text("study_code")?,
            protocol: text("protocol")?,
            protocol_sha256: text("protocol_sha256")?,
            calibration_id: text("calibration_id")?,
            seed: map.get("seed").map(|seed| number(seed, "seed")).transpose()?,
            joint_names: names(&text("joint_names")?)?,
            period: Span::from_nanoseconds(number(&text("period_ns")?, "period_ns")?),
        })
    }
}

fn number<T: std::str::FromStr>(text: &str, field: &'static str) -> Result<T, ExamError> {
    text.parse().map_err(|_| ExamError::BadField { field, found: text.into() })
}

fn names(text: &str) -> Result<Vec<String>, ExamError> {
    serde_json::from_str(text).map_err(|_| ExamError::BadField { field: "joint_names", found: text.into() })
}

/// A code has no spaces, so that a first and a last name do not pass for one by accident.
fn check_study_code(code: &str) -> Result<(), ExamError> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if code.is_empty() || code.len() > 64 || !code.chars().all(allowed) {
        return Err(ExamError::StudyCode { found: code.into() });
    }
    Ok(())
}
