//! Every commanded motion within the limits, read back from the exam file; the path's error; and the recorded exam
//! that gives the same commands.

use std::path::Path;
use std::sync::Arc;

use probepath_robot::{Command, Joints, MotionLimits, Operator};
use probepath_us_capture::exam::Exam;

use super::bench::{Folder, taught_and_scanned, tell};
use super::{Goal, Goals, ValidateError};
use crate::progress::Progress;
use crate::protocol::Protocol;
use crate::session::{CellFile, Opening, ScanWish, Session, SessionError, TeachWish, recorded_row};

/// Largest commanded position, velocity, acceleration and jerk, as shares of their limits: 1 is at the limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shares {
    /// Position: distance from the middle of the joint's range, by half the range.
    pub position: f64,
    /// Velocity.
    pub velocity: f64,
    /// Acceleration.
    pub acceleration: f64,
    /// Jerk.
    pub jerk: f64,
}

/// What an exam's commands are, by finite differences over its ticks.
///
/// # Errors
/// When a row is none.
pub fn shares(exam: &Exam, limits: &MotionLimits) -> Result<Shares, SessionError> {
    let dt = exam.header.period.seconds();
    let mut shares = Shares::default();
    let mut past: Vec<Joints> = Vec::new();
    for record in &exam.ticks {
        let (command, state) = recorded_row(record)?;
        let position = match command {
            Command::Position(position) => position,
            // Told to stay, the arm is where it was last told to be.
            Command::Stay | Command::Freedrive => state.commanded,
        };
        past.push(position);
        if past.len() > 4 {
            past.remove(0);
        }
        shares.add(&past, limits, dt);
    }
    Ok(shares)
}

impl Shares {
    /// Takes in the newest of up to four commands.
    fn add(&mut self, past: &[Joints], limits: &MotionLimits, dt: f64) {
        let Some(newest) = past.last() else { return };
        for joint in 0..newest.len() {
            let (low, high) = (limits.lower[joint], limits.upper[joint]);
            let off = (newest[joint] - (low + high) / 2.0).abs() / ((high - low) / 2.0);
            self.position = larger(self.position, off);
            let mut differences: Vec<f64> = past.iter().map(|q| q[joint]).collect();
            let orders = [
                (&mut self.velocity, limits.velocity[joint]),
                (&mut self.acceleration, limits.acceleration[joint]),
                (&mut self.jerk, limits.jerk[joint]),
            ];
            for (share, limit) in orders {
                differences = differences.windows(2).map(|pair| (pair[1] - pair[0]) / dt).collect();
                if let Some(newest) = differences.last() {
                    *share = larger(*share, newest.abs() / limit);
                }
            }
        }
    }
}

/// The larger one; NaN is larger than anything, so that it cannot hide.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Differences of positions that are stored to the last bit still round: third differences over 2 ms cubed by 1e-7.
const ROUNDING: f64 = 1.0 + 1e-6;

/// Teaches and scans each seed's leg, reads the exam back, and plays it back.
///
/// # Errors
/// When a session fails, or an exam cannot be read.
pub fn motion(seeds: u64, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    if seeds == 0 {
        return Err(ValidateError::NoSeeds);
    }
    let folder = Folder::new("motion")?;
    let mut columns: [Vec<f64>; 6] = Default::default();
    for seed in 1..=seeds {
        tell(progress, "motion", seed - 1, seeds);
        let wish = ScanWish { look: false, ..ScanWish::default() };
        let mut bench = taught_and_scanned(&CellFile::default(), seed, &wish, folder.path())?;
        bench.session.close().map_err(|source| ValidateError::Session { seed, source })?;
        let exam =
            Exam::open(&bench.session.exam_path()).map_err(|source| ValidateError::Exam { seed, source })?;
        let limits = *bench.session.motion_limits();
        let found = shares(&exam, &limits).map_err(|source| ValidateError::Session { seed, source })?;
        let same = played_back(&exam, &wish, folder.path());
        let row = [
            found.position,
            found.velocity,
            found.acceleration,
            found.jerk,
            bench.scan.figures.path.rms_error_mm,
            same,
        ];
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(value);
        }
    }
    let [position, velocity, acceleration, jerk, path, same] = &columns;
    let rows = vec![
        Goal::of("commanded position, share of the limit", position, Some(ROUNDING), None),
        Goal::of("commanded velocity, share of the limit", velocity, Some(ROUNDING), None),
        Goal::of("commanded acceleration, share of the limit", acceleration, Some(ROUNDING), None),
        Goal::of("commanded jerk, share of the limit", jerk, Some(ROUNDING), None),
        Goal::of("path error of the replay, RMS, mm", path, Some(0.3), None),
        Goal::of("played back: exams whose commands differ", same, Some(0.0), None),
    ];
    Ok(Goals::new("motion: teach and replay along the leg, read back from the exam", seeds, rows))
}

/// Gives the recorded states to the same software: 0 when every command is the recorded one, 1 when one differs.
fn played_back(exam: &Exam, wish: &ScanWish, out: &Path) -> f64 {
    let again = || -> Result<(), SessionError> {
        let mut session = Session::open_recorded(
            exam,
            Opening {
                cell: CellFile::default(),
                seed: 0,
                out: out.join("again"),
                protocol: Protocol { name: "validate".into(), text: String::new() },
                date: None,
                operator: Operator::new(),
                progress: Arc::new(()),
            },
        )?;
        let path = session.teach(&TeachWish { study: "VALIDATE".into(), ..TeachWish::default() })?;
        session.scan(&path, wish).map(drop)
    };
    f64::from(u8::from(again().is_err()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_of_one_tick_breaks_the_jerk_limit() {
        let one = Joints::splat(1, 1.0);
        let limits = MotionLimits {
            lower: one.map(|_| -1.0),
            upper: one,
            velocity: one,
            acceleration: one.map(|_| 10.0),
            jerk: one.map(|_| 100.0),
        };
        let mut shares = Shares::default();
        let at = |q: f64| Joints::splat(1, q);
        shares.add(&[at(0.0), at(0.0), at(0.0), at(0.0001)], &limits, 0.002);
        // 0.1 mrad in one tick: 0.05 rad/s, 25 rad/s², 12,500 rad/s³.
        assert!((shares.velocity - 0.05).abs() < 1e-9, "{shares:?}");
        assert!((shares.acceleration - 2.5).abs() < 1e-9, "{shares:?}");
        assert!((shares.jerk - 125.0).abs() < 1e-6, "{shares:?}");
    }

    #[test]
    fn a_number_that_is_none_cannot_hide() {
        assert!(larger(1.0, f64::NAN).is_nan() && larger(f64::NAN, 1.0).is_nan());
    }
}
