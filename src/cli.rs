//! What can be typed.

mod calibrate;
mod volume;

use std::path::PathBuf;

pub use calibrate::{Calibrate, Check, Spatial, Subject, Temporal};
use clap::{Args, Parser, Subcommand};
pub use volume::VolumeArgs;

/// An ultrasound probe on a robot arm: taught by hand, replayed at constant force, reconstructed in 3D.
/// Without a command it scans the simulated leg. A research tool, not a medical device.
#[derive(Debug, Parser)]
#[command(version, about, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// One JSON document on standard output; people's text goes to standard error.
    #[arg(long, global = true)]
    pub json: bool,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Teach, replay, capture, reconstruct, report.
    Scan(Scan),
    /// Where the image is on the probe, when it was formed, and how sure that is.
    #[command(subcommand)]
    Calibrate(Calibrate),
    /// The lumen of an exam or of a tracked sequence: surface, centreline, sections, stenoses, report; and the volume.
    Reconstruct(Reconstruct),
    /// How far a surface is from a gold standard.
    Compare(Compare),
    /// Between the formats of sequences (.igs.mha, .igs.mhd, .igs.nrrd), of volumes (.mha, .nrrd), and of surfaces
    /// (.stl, .ply, .vtp); and from an exam (.mcap) to a DICOM multi-frame image (.dcm).
    Convert(Convert),
    /// What the model of an arm says; forward and inverse kinematics. Or, of an arm on its wire: how punctual it is, what
    /// it carries; and the way out of its own stop.
    Arm(Arm),
    /// Serves the simulated cell on the protocols of a real one, until Ctrl-C.
    Simulate(Simulate),
    /// Prints a table: ours beside the published figure.
    Validate(Validate),
}

impl Default for Command {
    fn default() -> Self {
        Self::Scan(Scan { protocol: None, cell: None, seed: 1, out: PathBuf::from("out") })
    }
}

/// `scan`
#[derive(Args, Debug)]
pub struct Scan {
    /// The protocol, a Rhai script; the femoral artery when none is given.
    pub protocol: Option<PathBuf>,
    /// The cell: arm, limits, probe. The simulated cell when none is given.
    #[arg(long, value_name = "CELL.toml")]
    pub cell: Option<PathBuf>,
    /// Seed of the simulated cell; the same seed gives the same exam.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for the exam, the report and the surfaces.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
}

/// `reconstruct`
#[derive(Args, Debug)]
pub struct Reconstruct {
    /// An exam (.mcap) or a tracked sequence (.igs.mha, .igs.mhd, .igs.nrrd).
    pub input: PathBuf,
    /// The calibration: probepath's own (.toml) or a PLUS device set (.xml). An exam holds its own; another of the same
    /// setting (.toml) takes its place.
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<PathBuf>,
    /// Build the volume too.
    #[arg(long)]
    pub volume: bool,
    /// A place in the lumen of the first image: right of its first column and below its first row (mm). Found otherwise.
    #[arg(long, value_name = "X,Y", value_parser = place)]
    pub seed_mm: Option<(f64, f64)>,
    /// How.
    #[command(flatten)]
    pub volume_options: VolumeArgs,
    /// A program that finds the lumen in the place of probepath's own finder (a .py is run with Python): it gets images
    /// and answers contours. docs/reconstruction.md says how.
    #[arg(long, value_name = "PROGRAM")]
    pub lumen: Option<PathBuf>,
    /// How long that program may take for one image.
    #[arg(long, value_name = "S", default_value_t = 30.0, requires = "lumen")]
    pub lumen_seconds: f64,
    /// Folder for what is made.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
}

/// Two numbers with a comma between them.
fn place(text: &str) -> Result<(f64, f64), String> {
    let numbers: Vec<Result<f64, _>> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_slice() {
        [Ok(x), Ok(y)] if x.is_finite() && y.is_finite() => Ok((*x, *y)),
        _ => Err("a place is two numbers with a comma between them: 20,31.5".into()),
    }
}

/// `compare`
#[derive(Args, Debug)]
pub struct Compare {
    /// The surface (.stl, .ply, .vtp), mm; with --follow-up the earlier exam (.mcap) or its sections (.csv).
    pub surface: PathBuf,
    /// The gold standard (.stl, .ply, .vtp), mm.
    #[arg(long, value_name = "SURFACE", required_unless_present = "follow_up")]
    pub gold: Option<PathBuf>,
    /// A later exam (.mcap) of the same leg, or its sections (.csv): what changed, and whether more than the errors.
    #[arg(long, value_name = "LATER", conflicts_with_all = ["gold", "fit", "in_place", "gold_unit", "out"])]
    pub follow_up: Option<PathBuf>,
    /// How the surface is laid on the gold standard first.
    #[arg(long, value_enum, default_value_t = FitOf::Rigid)]
    pub fit: FitOf,
    /// Compare where they are: the same as `--fit none`.
    #[arg(long, conflicts_with = "fit")]
    pub in_place: bool,
    /// The unit of the gold standard's file: surface files do not say theirs, and are read as millimetres.
    #[arg(long, value_enum, default_value_t = Unit::Mm)]
    pub gold_unit: Unit,
    /// Folder for the error map: pictures (PNG) and a coloured mesh (PLY, VTP).
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// How a surface is laid on another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum FitOf {
    /// Centre of gravity, then the rigid motion that minimises the distances (the paper's).
    Rigid,
    /// The same from where both lie.
    Near,
    /// Iterated closest points, robust against parts that the gold standard has not.
    Icp,
    /// Not at all.
    None,
}

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Unit {
    /// Millimetres.
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
}

/// `convert`
#[derive(Args, Debug)]
pub struct Convert {
    /// What to read.
    pub input: PathBuf,
    /// What to write; the ending says the format.
    pub output: PathBuf,
    /// Of an exam on its way to DICOM: you have looked, and nothing is written into its pictures.
    #[arg(long)]
    pub no_burned_in: bool,
}

/// `arm`
#[derive(Args, Debug)]
pub struct Arm {
    /// A URDF file, or the name of a model that comes along: `ur5e`, `seven_joint`. With --measure, --identify-tool and
    /// --recover the arm's address: `ur://host`.
    #[arg(required_unless_present = "cell")]
    pub urdf: Option<String>,
    /// Hold the arm still, and measure how punctual its ticks are.
    #[arg(long, group = "mode", conflicts_with_all = ["base", "tip", "joints_deg", "flange_mm_deg"])]
    pub measure: bool,
    /// Turn the probe where it hangs in the air, and say what the arm carries: mass, centre of gravity, the sensor's bias.
    #[arg(long, group = "mode", conflicts_with_all = ["base", "tip", "joints_deg", "flange_mm_deg"])]
    pub identify_tool: bool,
    /// After the arm stopped by itself: ask, unlock it, and say where it is. Nothing moves.
    #[arg(long, group = "mode", conflicts_with_all = ["base", "tip", "joints_deg", "flange_mm_deg"])]
    pub recover: bool,
    /// The cell: where the arm is, and what it carries.
    #[arg(long, value_name = "CELL.toml", requires = "mode")]
    pub cell: Option<PathBuf>,
    /// Folder for the exam of --identify-tool.
    #[arg(long, value_name = "DIR", default_value = "out", requires = "identify_tool")]
    pub out: PathBuf,
    /// How long to measure.
    #[arg(long, value_name = "S", default_value_t = 10.0, requires = "measure")]
    pub seconds: f64,
    /// The chain's first link.
    #[arg(long, value_name = "LINK")]
    pub base: Option<String>,
    /// The chain's last link.
    #[arg(long, value_name = "LINK")]
    pub tip: Option<String>,
    /// Joint positions (degrees; mm for a prismatic joint), separated by commas: where is the flange?
    #[arg(long, value_name = "Q1,Q2,…", value_delimiter = ',', allow_hyphen_values = true)]
    pub joints_deg: Option<Vec<f64>>,
    /// Where the flange should be: x, y, z (mm) and rotation vector (degrees), separated by commas: which joints?
    #[arg(long, value_name = "X,Y,Z,RX,RY,RZ", value_delimiter = ',', allow_hyphen_values = true)]
    pub flange_mm_deg: Option<Vec<f64>>,
}

/// `simulate`
#[derive(Args, Debug)]
pub struct Simulate {
    /// The cell: leg or phantom, arm, what fails. The simulated leg when none is given.
    #[arg(long, value_name = "CELL.toml")]
    pub cell: Option<PathBuf>,
    /// Seed of the simulated cell.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// The address to listen on; the ports are the controller's. Several cells side by side take 127.0.0.2 and so on.
    #[arg(long, default_value = "127.0.0.1")]
    pub host: std::net::IpAddr,
    /// What makes the clock go.
    #[arg(long, value_enum, default_value_t = Clock::Wall)]
    pub time: Clock,
    /// Write the file with which this cell is scanned over the wire: `probepath scan --cell FILE`.
    #[arg(long, value_name = "FILE")]
    pub write_cell: Option<PathBuf>,
    /// When it ends, write there what happened (JSON): ticks, packages, B-scans, how punctual it was.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// End when standard input does, besides Ctrl-C: for whoever starts it from a program, and may be killed.
    #[arg(long)]
    pub until_input_ends: bool,
}

/// What makes a simulated cell's clock go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Clock {
    /// 500 Hz.
    Wall,
    /// A tick for each package of the client whose script runs.
    Simulated,
}

/// `validate`
#[derive(Args, Debug)]
pub struct Validate {
    /// What to validate.
    #[arg(value_enum)]
    pub goal: Goal,
    /// How many seeds.
    #[arg(long, default_value_t = 10)]
    pub seeds: u64,
    /// How long the soak is.
    #[arg(long, default_value_t = 10.0)]
    pub minutes: f64,
    /// Only this setting of the table ("zoom 3:7"), or this number of images of speed.
    #[arg(long, value_name = "NAME")]
    pub setting: Option<String>,
    /// How many seeds of table2 at a time.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub jobs: usize,
    /// Folder that keeps what every seed of table2 gave; what is there already is not run again.
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
}

/// What can be validated.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Goal {
    /// Table I of the paper: the calibration's precision, setting by setting, and its true error.
    Table1,
    /// Table II of the paper: the error of the reconstructed phantom, setting by setting.
    Table2,
    /// From an exam file to the report: time by stage and memory, for 500 to 4,000 images.
    Speed,
    /// The contact force along the leg.
    Force,
    /// Minutes of replay on the wire beside image capture and recording: what was lost, how punctual it was.
    Soak,
    /// Every commanded motion within the limits, read back from the exam; the path's error.
    Motion,
    /// Every way of losing the process, the link, the operator or a sensor ends with the arm at rest.
    Safety,
}
