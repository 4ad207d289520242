//! What can be wrong with a recording, a path or its file.

use std::path::PathBuf;

use probepath_frames::FrameError;
use probepath_robot::motion::follow::CurveError;
use thiserror::Error;

/// Why a recording gave no path, or a path's file could not be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PathError {
    /// Too little was recorded.
    #[error(
        "{found} states were recorded while the arm was guided, too few for a path: guide the probe along the leg"
    )]
    TooFewSamples {
        /// How many came.
        found: usize,
    },
    /// A recorded state has a number that is not finite.
    #[error("the state recorded at {at_s:.3} s has a number that is not finite: check the arm's connection")]
    SampleNotFinite {
        /// Its stamp (s).
        at_s: f64,
    },
    /// Stamps do not increase.
    #[error("the state recorded at {at_s:.3} s came after one at {last_s:.3} s: stamps must increase")]
    OutOfOrder {
        /// The stamp that came (s).
        at_s: f64,
        /// The one before it (s).
        last_s: f64,
    },
    /// The probe jumped between two states.
    #[error(
        "the probe jumped {jump_mm:.1} mm between {from_s:.3} s and {at_s:.3} s, faster than any hand: \
         states were lost; teach again"
    )]
    Jump {
        /// The distance (mm).
        jump_mm: f64,
        /// The state before (s).
        from_s: f64,
        /// The state after (s).
        at_s: f64,
    },
    /// The probe never touched.
    #[error(
        "no contact with the skin was found in {seconds:.1} s of recording ({how}): lower the probe onto the skin and teach again"
    )]
    NoContact {
        /// How long the recording is (s).
        seconds: f64,
        /// How contact was looked for.
        how: String,
    },
    /// The probe was off the skin for too far.
    #[error(
        "the probe was off the skin for {gap_mm:.0} mm from {at_mm:.0} mm along the path, more than the {most_mm:.0} mm \
         that may be bridged: teach again, or in two parts"
    )]
    LongGap {
        /// Where it begins (mm along the path).
        at_mm: f64,
        /// How long it is (mm).
        gap_mm: f64,
        /// What may be bridged (mm).
        most_mm: f64,
    },
    /// What is left is too short.
    #[error(
        "the path is {length_mm:.1} mm long, shorter than {least_mm:.1} mm: guide the probe further, or trim less"
    )]
    TooShort {
        /// What is left (mm).
        length_mm: f64,
        /// The shortest allowed (mm).
        least_mm: f64,
    },
    /// The probe came back beside its own path: what it did there would be lost.
    #[error(
        "{length_mm:.0} mm on the skin went back beside what was already taught, up to {away_mm:.0} mm from it: \
         a path does not come back beside itself; teach the two ways as two paths"
    )]
    ComesBack {
        /// How far it went there (mm).
        length_mm: f64,
        /// How far from the path it was (mm).
        away_mm: f64,
    },
    /// The hand was too unsteady to be smoothed honestly.
    #[error(
        "smoothing would move the path by {moved_mm:.1} mm at {at_mm:.0} mm along it, more than {most_mm:.1} mm: \
         the hand was too unsteady there; teach again, slower"
    )]
    TooUnsteady {
        /// Where (mm along the path).
        at_mm: f64,
        /// How far (mm).
        moved_mm: f64,
        /// The most allowed (mm).
        most_mm: f64,
    },
    /// No path of least jerk was found.
    #[error(
        "no path was found that stays within {tube_mm} mm and {tube_deg:.2} degrees of what was taught: \
         allow more, or teach again"
    )]
    Tube {
        /// How far from what was taught (mm).
        tube_mm: f64,
        /// How far turned (degrees).
        tube_deg: f64,
    },
    /// A setting that makes no sense.
    #[error("{name} = {value} cannot be: {why}")]
    Setting {
        /// The setting's name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it has to be.
        why: &'static str,
    },
    /// Points that make no curve.
    #[error("the path's points make no curve: {0}")]
    Curve(#[from] CurveError),
    /// A trim outside the path.
    #[error("cannot keep {from_mm} mm to {until_mm} mm of a path that runs from 0 to {length_mm} mm")]
    Trim {
        /// Start asked for (mm).
        from_mm: f64,
        /// End asked for (mm).
        until_mm: f64,
        /// The path's length (mm).
        length_mm: f64,
    },
    /// The file cannot be read or written.
    #[error("{}: cannot {verb} the path: {why}", file.display())]
    Io {
        /// The file or folder.
        file: PathBuf,
        /// What was tried.
        verb: &'static str,
        /// What the system says.
        why: std::io::Error,
    },
    /// The text is not a path's: wrong or missing fields, wrong types.
    #[error("{}: {why}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Line, column and field.
        why: Box<toml::de::Error>,
    },
    /// The text cannot be made.
    #[error("{}: the path cannot be written as text: {why}", file.display())]
    Unwritable {
        /// The file.
        file: PathBuf,
        /// The cause.
        why: Box<toml::ser::Error>,
    },
    /// A field whose value cannot be.
    #[error("{}: {field}: {why}", file.display())]
    Field {
        /// The file.
        file: PathBuf,
        /// The field.
        field: String,
        /// What is wrong and what to do.
        why: String,
    },
    /// A pose whose names or numbers are wrong.
    #[error("{}: {field}: {why}", file.display())]
    Pose {
        /// The file.
        file: PathBuf,
        /// The field.
        field: String,
        /// What is wrong.
        why: FrameError,
    },
}
