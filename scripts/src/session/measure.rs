//! `probepath arm --measure`: how punctual an arm's ticks are on this computer, the arm at rest.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::time::Duration;

use probepath_frames::{Span, Stamp};
use probepath_robot::drivers::Address;
use probepath_robot::realtime::{
    Clock, Figures, Histogram, Monotonic, RealtimeReport, Timed, TimingFigures, Timings, be_realtime,
    control_thread,
};
use probepath_robot::{Arm, ArmFault, Command};
use probepath_sim::SimulatedCell;
use serde::Serialize;

use super::SessionError;
use super::cell::{Cell, CellFile, ControllerTime};

/// The shortest and the longest measurement (s).
const SECONDS: (f64, f64) = (0.1, 3600.0);

/// How punctual an arm's ticks were.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// The arm's address.
    pub address: String,
    /// How long (s).
    pub seconds: f64,
    /// What the system granted.
    pub realtime: RealtimeReport,
    /// Lateness, step time, round trip, gaps.
    pub timings: TimingFigures,
    /// How old the measurements were when they came.
    pub age: Option<Figures>,
    /// A loop that only sleeps from tick to tick, meanwhile: how late it woke.
    pub bare_sleep: Option<Figures>,
    /// Tick lateness over the bare loop's.
    pub ratio: Option<Ratio>,
}

/// One lateness over another: 1 is as punctual as sleeping.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// Of the medians.
    pub p50: f64,
    /// Of what 99 of 100 stayed within.
    pub p99: f64,
    /// Of what 999 of 1,000 stayed within.
    pub p99_9: f64,
    /// Of the longest.
    pub max: f64,
}

impl Ratio {
    fn of(ours: &Figures, theirs: &Figures) -> Self {
        Self {
            p50: ours.p50_us / theirs.p50_us,
            p99: ours.p99_us / theirs.p99_us,
            p99_9: ours.p99_9_us / theirs.p99_9_us,
            max: ours.max_us / theirs.max_us,
        }
    }
}

/// What is to be measured.
#[derive(Clone, Debug, Default)]
pub struct MeasureRequest {
    /// `ur://host`; what the cell's file says when absent.
    pub address: Option<String>,
    /// The cell's file. Without one the address has to be this computer's, where `probepath simulate` serves the cell
    /// that comes along.
    pub cell: Option<PathBuf>,
    /// How long (s).
    pub seconds: f64,
}

impl MeasureRequest {
    /// Holds the arm where it is for so long, and measures every tick; beside it a loop that only sleeps.
    ///
    /// # Errors
    /// When the arm keeps no time of its own, cannot be reached or stops answering, or no thread can be started.
    pub fn run(&self) -> Result<Measured, SessionError> {
        let file = cell_file(self.address.as_deref(), self.cell.as_deref())?;
        if file.is_simulated() {
            let wanted =
                "an arm that is simulated in this process keeps no time: name one on its wire".to_owned();
            return Err(SessionError::Wish { what: "the arm's address", value: "sim".into(), wanted });
        }
        measure(&file, self.seconds)
    }
}

/// The cell of a file, its arm at another address where one is given; without a file the cell that comes along.
pub(super) fn cell_file(address: Option<&str>, cell: Option<&Path>) -> Result<CellFile, SessionError> {
    let address = address.map(str::parse::<Address>).transpose().map_err(|error| SessionError::Wish {
        what: "the arm's address",
        value: error.given.clone(),
        wanted: error.to_string(),
    })?;
    let mut file = match (cell, &address) {
        (Some(cell), _) => CellFile::read(cell)?,
        (None, Some(Address::Ur { host })) => served_here(host)?,
        (None, _) => CellFile::default(),
    };
    file.arm.address = address.unwrap_or(file.arm.address);
    Ok(file)
}

/// The cell that comes along, served on this computer.
fn served_here(host: &str) -> Result<CellFile, SessionError> {
    let here = if host == "localhost" { Some(IpAddr::V4(Ipv4Addr::LOCALHOST)) } else { host.parse().ok() };
    let Some(here) = here.filter(IpAddr::is_loopback) else {
        let wanted =
            "the controller is told what the arm carries: name the cell's file with --cell".to_owned();
        return Err(SessionError::Wish { what: "the arm's address", value: host.to_owned(), wanted });
    };
    let cell = SimulatedCell::new(&CellFile::default().simulated, 1)?;
    Ok(CellFile::of_served("simulated", &cell, here, ControllerTime::Wall))
}

/// Holds a cell's arm still, and measures.
fn measure(file: &CellFile, seconds: f64) -> Result<Measured, SessionError> {
    // Written so that NaN is refused as well.
    if !(seconds >= SECONDS.0 && seconds <= SECONDS.1) {
        let wanted = format!("it has to be between {} and {} s", SECONDS.0, SECONDS.1);
        return Err(SessionError::Wish {
            what: "the time to measure",
            value: format!("{seconds} s"),
            wanted,
        });
    }
    let mut arm = Cell::arm_alone(file)?;
    let period = arm.period();
    let ticks = (seconds / period.seconds()).ceil() as u64;
    let mut timings = Timings::default();
    let mut ages = Histogram::default();
    let work = |realtime: RealtimeReport| {
        let held = hold(&mut Timed::new(&mut *arm, Monotonic::new(), &mut timings), ticks, &mut ages);
        (realtime, held)
    };
    let bare = || std::thread::scope(|scope| scope.spawn(|| bare_sleep(period, ticks)).join());
    let ((realtime, held), slept) = control_thread("control", work, bare)
        .map_err(|error| SessionError::Ended { step: "measuring", why: error.to_string() })?;
    held.map_err(|fault| SessionError::Ended { step: "measuring", why: fault.to_string() })?;
    let (timings, age) = (timings.figures(), ages.figures());
    let bare_sleep = slept.ok().and_then(|slept| slept.figures());
    let ratio = timings.lateness.zip(bare_sleep).map(|(ours, theirs)| Ratio::of(&ours, &theirs));
    let address = file.arm.address.to_string();
    Ok(Measured { address, seconds, realtime, timings, age, bare_sleep, ratio })
}

/// Tells the arm to stay, tick by tick.
fn hold(arm: &mut dyn Arm, ticks: u64, ages: &mut Histogram) -> Result<(), ArmFault> {
    for _ in 0..ticks {
        ages.record(arm.exchange(&Command::Stay)?.age);
    }
    Ok(())
}

/// How late a thread wakes that only sleeps until its next tick, asking for the same as a control thread.
#[expect(clippy::disallowed_methods, reason = "sleeping is what is measured")]
fn bare_sleep(period: Span, ticks: u64) -> Histogram {
    let _ = be_realtime();
    let clock = Monotonic::new();
    let (mut lateness, mut next) = (Histogram::default(), clock.now());
    for _ in 0..ticks {
        next = next + period;
        let left = (next - clock.now()).nanoseconds();
        std::thread::sleep(Duration::from_nanos(u64::try_from(left).unwrap_or(0)));
        let late = clock.now() - next;
        lateness.record(late);
        // Late by more than a tick: the next counts from now, as it does for whoever is paced from outside.
        if late > period {
            next = Stamp::from_nanoseconds((next + late).nanoseconds());
        }
    }
    lateness
}

impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: held still for {} s", self.address, self.seconds)?;
        writeln!(f, "{}", self.realtime)?;
        writeln!(f, "{}", self.timings)?;
        if let Some(age) = &self.age {
            writeln!(f, "{:<14} {age}", "age of a state")?;
        }
        if let Some(bare) = &self.bare_sleep {
            writeln!(f, "{:<14} {bare}", "a bare sleep")?;
        }
        match &self.ratio {
            Some(Ratio { p50, p99, p99_9, max }) => {
                write!(f, "lateness over it: p50 {p50:.2}, p99 {p99:.2}, p99.9 {p99_9:.2}, max {max:.2}")
            }
            None => write!(f, "too few ticks to compare"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_simulated_arm_is_measured_beside_a_loop_that_sleeps() {
        let measured = measure(&CellFile::default(), 0.2).unwrap();
        let (timings, bare) = (measured.timings, measured.bare_sleep.unwrap());
        assert_eq!((timings.ticks, timings.skipped, bare.count), (100, 0, 100));
        assert!(measured.age.unwrap().max_us.abs() < f64::EPSILON);
        assert!(measured.to_string().contains("sim: held still for 0.2 s"), "{measured}");
    }

    #[test]
    fn an_arm_that_keeps_no_time_and_one_whose_load_nobody_knows_are_refused() {
        let asked = |address: &str| {
            MeasureRequest { address: Some(address.into()), cell: None, seconds: 1.0 }
                .run()
                .unwrap_err()
                .to_string()
        };
        assert!(asked("sim").contains("keeps no time"));
        assert!(asked("ur://192.168.56.101").contains("--cell"));
        assert!(asked("192.168.56.101").contains("ur://"));
    }

    #[test]
    fn a_measurement_of_no_time_is_refused() {
        for seconds in [0.0, -1.0, f64::NAN, 1e6] {
            assert!(matches!(measure(&CellFile::default(), seconds), Err(SessionError::Wish { .. })));
        }
    }
}
