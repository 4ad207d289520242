//! A scan over the wire by another process, which is lost on the way.
#![expect(
    clippy::disallowed_methods,
    reason = "another process and a controller in wall time are watched from outside"
)]

use std::fs::File;
use std::net::{IpAddr, Ipv4Addr};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

use probepath_frames::{Point, Span, Stamp, World};
use probepath_robot::Operator;
use probepath_sim::controller::{ControllerConfig, ControllerServer, Running, WireKnobs};
use probepath_sim::{SimulatedCell, Ticks};

use crate::protocol::Protocol;
use crate::session::{CellFile, ControllerTime, MachineAddress, Opening, Session, SessionError, TeachWish};
use crate::validate::ValidateError;

/// What is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Loss {
    Killed,
    Paused,
    Cable,
    Connection,
    Reader,
    Mover,
}

impl Loss {
    pub(super) const ALL: [Self; 6] =
        [Self::Killed, Self::Paused, Self::Cable, Self::Connection, Self::Reader, Self::Mover];

    pub(super) const fn words(self) -> &'static str {
        match self {
            Self::Killed => "process killed",
            Self::Paused => "process paused, then continued",
            Self::Cable => "cable pulled",
            Self::Connection => "connection cut",
            Self::Reader => "script's reading thread hung",
            Self::Mover => "script's moving thread hung",
        }
    }

    /// Whether it is the controller's own script that is lost: counted from then, not from the last package.
    const fn is_of_the_script(self) -> bool {
        matches!(self, Self::Reader | Self::Mover)
    }
}

/// Where and with what.
pub(super) struct Bench<'a> {
    pub(super) seed: u64,
    /// The program `probepath`.
    pub(super) probepath: &'a Path,
    pub(super) folder: &'a Path,
}

/// How a loss went, by the controller's clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lost {
    /// From the last package that came (or the hang) until the probe was where it stayed (ms).
    pub(super) rest_ms: f64,
    /// How far the probe moved once it had been at rest (mm).
    pub(super) moved_after_mm: f64,
}

/// What was seen of the controller at one look.
#[derive(Clone, Copy, Debug)]
struct Look {
    at: Stamp,
    inputs: u64,
}

/// The probe is where it stays within this (m): a tenth of the bound of what may move again.
const THERE_M: f64 = 2e-5;
/// No package for so long is silence.
const SILENCE: Span = Span::from_milliseconds(60);
/// What a loss gets, by the controller's clock.
const WATCHED: Span = Span::from_milliseconds(1500);
/// How long anything may take by the wall's clock.
const PATIENCE: Duration = Duration::from_secs(120);

/// How often a scan may begin: a computer that is late for more than 80 ms stops it before anything is lost.
const BEGINNINGS: usize = 5;

/// Lets a process scan over the wire, and loses it on the way: with an odd seed in the air, else on the skin.
pub(super) fn lose(loss: Loss, bench: &Bench<'_>) -> Result<Lost, ValidateError> {
    let mut done = lose_once(loss, bench);
    for _ in 1..BEGINNINGS {
        if done.is_ok() {
            break;
        }
        done = lose_once(loss, bench);
    }
    done
}

fn lose_once(loss: Loss, bench: &Bench<'_>) -> Result<Lost, ValidateError> {
    let wrong = |source| ValidateError::Session { seed: bench.seed, source };
    let (cell, file) = served(loss, bench.seed).map_err(wrong)?;
    let protocol = written(&file, bench).map_err(wrong)?;
    let config = ControllerConfig { host: host(loss, bench.seed), ..ControllerConfig::default() };
    let running = ControllerServer::start(cell, config).map_err(|e| failed(bench, e.to_string()))?;
    let mut child = Scanning::start(&protocol, bench)?;
    on_the_way(&running, &mut child, bench)?;
    let (begun, looks) = lost(loss, &running, &mut child, bench)?;
    drop(child);
    let lost = judge(loss, &running, begun, &looks);
    lost.ok_or_else(|| failed(bench, "the arm was not seen to rest".into()))
}

/// A cell of a short leg, and the file to scan it with over the wire.
fn served(loss: Loss, seed: u64) -> Result<(SimulatedCell, CellFile), SessionError> {
    let cell = SimulatedCell::new(&short().simulated, seed)?;
    let mut file = CellFile::of_served("served", &cell, host(loss, seed), ControllerTime::Wall);
    file.machine = Default::default();
    file.machine.address = MachineAddress::None;
    // This computer is shared, and late itself.
    file.arm.heartbeat_ms = Some(80.0);
    Ok((cell, file))
}

fn short() -> CellFile {
    let mut file = CellFile::default();
    file.simulated.hand.length_mm = 60.0;
    file
}

/// A loopback address of this process, seed and loss: controllers always have their own ports.
fn host(loss: Loss, seed: u64) -> IpAddr {
    let pid = std::process::id();
    let part = |n: u64| (n % 250 + 1) as u8;
    let (a, b) = (part(u64::from(pid) / 250), part(u64::from(pid)));
    IpAddr::V4(Ipv4Addr::new(127, 130 + (loss as u8) * 10 + (seed % 10) as u8, a, b))
}

/// The path that the hand teaches on this leg, the cell's file, and a protocol that scans along the path.
fn written(file: &CellFile, bench: &Bench<'_>) -> Result<std::path::PathBuf, SessionError> {
    let out = bench.folder.join(format!("seed-{}", bench.seed));
    let path = out.join("taught.path.toml");
    if !path.exists() {
        let mut session = Session::open(Opening {
            cell: short(),
            seed: bench.seed,
            out: out.clone(),
            protocol: Protocol { name: "validate".into(), text: String::new() },
            date: None,
            operator: Operator::new(),
            progress: Arc::new(()),
        })?;
        let taught = session.teach(&TeachWish { study: "VALIDATE".into(), ..TeachWish::default() })?;
        taught.save(&path)?;
    }
    let text =
        format!("scan(load_path({:?}), #{{ speed: mm_s(20), look: false }});", path.display().to_string());
    let write = |name: &str, text: &str| {
        let path = out.join(name);
        let wrote = std::fs::write(&path, text);
        wrote
            .map_err(|source| SessionError::File { doing: "write", path: path.clone(), source })
            .map(|()| path)
    };
    write("cell.toml", &file.text()?)?;
    write("lost.rhai", &text)
}

/// A process that scans; it ends with this.
struct Scanning {
    child: Child,
    said: std::path::PathBuf,
}

impl Scanning {
    fn start(protocol: &Path, bench: &Bench<'_>) -> Result<Self, ValidateError> {
        let out = protocol.with_file_name("out");
        let said = protocol.with_file_name("said.txt");
        let child = Command::new(bench.probepath)
            .arg("scan")
            .arg(protocol)
            .arg("--cell")
            .arg(protocol.with_file_name("cell.toml"))
            .arg("--out")
            .arg(out)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(&said)?)
            .spawn()?;
        Ok(Self { child, said })
    }

    fn has_ended(&mut self) -> bool {
        !matches!(self.child.try_wait(), Ok(None))
    }

    fn said(&self) -> String {
        std::fs::read_to_string(&self.said).unwrap_or_default()
    }

    #[cfg(unix)]
    fn signal(&self, signal: nix::sys::signal::Signal) -> Result<(), ValidateError> {
        let pid = nix::unistd::Pid::from_raw(i32::try_from(self.child.id()).unwrap_or(0));
        nix::sys::signal::kill(pid, signal).map_err(|e| ValidateError::Folder(e.into()))
    }
}

impl Drop for Scanning {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits until the probe moves as it is to be when the loss comes.
fn on_the_way(running: &Running, child: &mut Scanning, bench: &Bench<'_>) -> Result<(), ValidateError> {
    let (begun, truth) = (Instant::now(), running.cell().truth());
    let on_skin = bench.seed.is_multiple_of(2);
    let mut before = truth.now();
    loop {
        sleep(Duration::from_millis(40));
        let now = truth.now();
        let seconds = (now.stamp - before.stamp).seconds().max(1e-3);
        let speed = now.world_from_probe.origin().distance(&before.world_from_probe.origin()) / seconds;
        let presses = -now.skin.force.z > 2.0;
        if (on_skin && presses && speed > 0.015) || (!on_skin && speed > 0.03) {
            return Ok(());
        }
        before = now;
        if child.has_ended() || begun.elapsed() > PATIENCE {
            return Err(failed(bench, child.said()));
        }
    }
}

/// The loss, and every look at the controller from a little before on.
fn lost(
    loss: Loss,
    running: &Running,
    child: &mut Scanning,
    bench: &Bench<'_>,
) -> Result<(Stamp, Vec<Look>), ValidateError> {
    let mut looks = Vec::new();
    let mut look = |running: &Running| {
        // The stamp first: whatever a later look finds new came after it.
        let at = running.cell().truth().now().stamp;
        looks.push(Look { at, inputs: running.counters().inputs });
    };
    let before = running.cell().truth().now().stamp;
    while running.cell().truth().now().stamp - before < SILENCE {
        look(running);
        sleep(Duration::from_micros(500));
    }
    let begun = begin(loss, running, child)?;
    let (wall, mut continued) = (Instant::now(), false);
    while running.cell().truth().now().stamp - begun < WATCHED {
        look(running);
        sleep(Duration::from_micros(500));
        let half = running.cell().truth().now().stamp - begun > Span::from_milliseconds(700);
        if half && !continued {
            continued = true;
            go_on(loss, child)?;
        }
        if wall.elapsed() > PATIENCE {
            return Err(failed(bench, "the controller's clock stands".into()));
        }
    }
    Ok((begun, looks))
}

/// When it began, by the controller's clock.
fn begin(loss: Loss, running: &Running, child: &mut Scanning) -> Result<Stamp, ValidateError> {
    let next = running.counters().ticks + 3;
    let from_now = Some(Ticks { from_tick: next, count: 5000 });
    let knobs = match loss {
        Loss::Killed => {
            child.child.kill()?;
            None
        }
        Loss::Paused => {
            #[cfg(unix)]
            child.signal(nix::sys::signal::Signal::SIGSTOP)?;
            None
        }
        Loss::Cable => Some(WireKnobs { stalled: from_now, ..WireKnobs::default() }),
        Loss::Connection => Some(WireKnobs { cut_at_tick: Some(next), ..WireKnobs::default() }),
        Loss::Reader => Some(WireKnobs { reader_hangs: from_now, ..WireKnobs::default() }),
        Loss::Mover => Some(WireKnobs { mover_hangs: from_now, ..WireKnobs::default() }),
    };
    if let Some(knobs) = knobs {
        running.set_knobs(knobs);
    }
    Ok(running.cell().truth().now().stamp)
}

/// A paused process goes on.
fn go_on(loss: Loss, child: &Scanning) -> Result<(), ValidateError> {
    #[cfg(unix)]
    if loss == Loss::Paused {
        return child.signal(nix::sys::signal::Signal::SIGCONT);
    }
    let _ = (loss, child);
    Ok(())
}

/// From when to when it took, and whether anything moved after.
fn judge(loss: Loss, running: &Running, begun: Stamp, looks: &[Look]) -> Option<Lost> {
    let from = if loss.is_of_the_script() { begun } else { last_package(looks)? };
    let moments = running.cell().truth().moments();
    // Where it was half a second later: five times what it may take.
    let settled = |stamp: Stamp| stamp - from >= Span::from_milliseconds(500);
    let rest = moments.iter().find(|moment| settled(moment.stamp))?.world_from_probe.origin();
    let far = |place: Point<World>, from: Point<World>| place.distance(&from) > THERE_M;
    let until = moments.iter().take_while(|moment| !settled(moment.stamp));
    let moving = until.filter(|moment| far(moment.world_from_probe.origin(), rest)).last()?;
    let after = moments.iter().filter(|moment| settled(moment.stamp));
    let moved = after.map(|moment| moment.world_from_probe.origin().distance(&rest)).fold(0.0, f64::max);
    let rest_ms = (moving.stamp - from).seconds() * 1e3 + 2.0;
    Some(Lost { rest_ms: rest_ms.max(0.0), moved_after_mm: moved * 1e3 })
}

/// When the last package before the first silence came, at the earliest: at the look before the one that found it.
fn last_package(looks: &[Look]) -> Option<Stamp> {
    let mut last: Option<Look> = None;
    for pair in looks.windows(2) {
        let [before, now] = pair else { continue };
        if now.inputs != before.inputs {
            last = Some(*before);
        } else if let Some(last) = last
            && now.at - last.at > SILENCE
        {
            return Some(last.at);
        }
    }
    None
}

fn failed(bench: &Bench<'_>, why: String) -> ValidateError {
    ValidateError::Session { seed: bench.seed, source: SessionError::Ended { step: "losing a scan", why } }
}
