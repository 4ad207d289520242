//! The simulated cell in a process of its own, as a real one is a machine of its own: what is soaked shares nothing with
//! it but the wire and this computer's processors.

use std::io::{BufRead, BufReader};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use probepath_sim::CellConfig;
use probepath_sim::controller::Time;

use crate::offline;
use crate::session::CellFile;
use crate::validate::ValidateError;

/// `probepath simulate`, until this is dropped.
pub(super) struct Served {
    child: Child,
    folder: PathBuf,
}

impl Served {
    /// Starts it, and waits until everything listens; its files are kept in `folder`.
    pub(super) fn start(
        probepath: &Path,
        cell: &CellConfig,
        (seed, host, time): (u64, IpAddr, Time),
        folder: &Path,
    ) -> Result<Self, ValidateError> {
        let file = CellFile { name: "soak".into(), simulated: cell.clone(), ..CellFile::default() };
        let text = file.text().map_err(|source| ValidateError::Session { seed, source })?;
        std::fs::write(folder.join(CELL), text)?;
        let time = if time == Time::Wall { "wall" } else { "simulated" };
        let mut child = Command::new(probepath)
            .args(["simulate", "--json", "--until-input-ends", "--time", time])
            .args(["--seed", &seed.to_string(), "--host", &host.to_string()])
            .arg("--cell")
            .arg(folder.join(CELL))
            .arg("--write-cell")
            .arg(folder.join(WIRE))
            .arg("--report")
            .arg(folder.join(REPORT))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(std::fs::File::create(folder.join(SAID))?)
            .spawn()?;
        let ready = listens(&mut child);
        let served = Self { child, folder: folder.to_owned() };
        if ready { Ok(served) } else { Err(served.failed("it does not begin")) }
    }

    /// The file with which the cell is scanned over its wire.
    pub(super) fn wire(&self) -> Result<CellFile, crate::session::SessionError> {
        CellFile::read(&self.folder.join(WIRE))
    }

    /// Ends it; what happened while it served.
    pub(super) fn end(mut self) -> Result<offline::Served, ValidateError> {
        self.child.stdin.take();
        let status = self.child.wait()?;
        if !status.success() {
            return Err(self.failed(&format!("it ended with {status}")));
        }
        let text = std::fs::read_to_string(self.folder.join(REPORT))?;
        serde_json::from_str(&text).map_err(|why| self.failed(&format!("its report cannot be read: {why}")))
    }

    fn failed(&self, why: &str) -> ValidateError {
        let said = std::fs::read_to_string(self.folder.join(SAID)).unwrap_or_default();
        ValidateError::Served { why: format!("{why}: {}", said.trim()) }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

const CELL: &str = "cell.toml";
const WIRE: &str = "wire.toml";
const REPORT: &str = "served.json";
const SAID: &str = "served.txt";

/// Whether it printed the document that it prints when everything listens: up to the brace that closes it.
fn listens(child: &mut Child) -> bool {
    let Some(said) = child.stdout.take() else { return false };
    BufReader::new(said).lines().map_while(Result::ok).any(|line| line == "}")
}
