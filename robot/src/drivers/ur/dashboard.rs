//! [`Dashboard`]: port 29999, a line for a line.

use std::time::Duration;

use super::lines::Lines;
use super::socket::Socket;
use super::{UrError, clock};

/// The port.
pub const PORT: u16 = 29999;

/// How every dashboard begins.
const BANNER: &str = "Connected: Universal Robots Dashboard Server";

/// The longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// A connection to a dashboard.
#[derive(Debug)]
pub struct Dashboard {
    socket: Socket,
    lines: Lines,
}

impl Dashboard {
    /// Connects, and reads how it begins.
    ///
    /// # Errors
    /// When nobody answers, or somebody else does.
    pub fn connect(host: &str) -> Result<Self, UrError> {
        let socket = Socket::open(host, PORT, "dashboard server", PATIENCE)?;
        let mut dashboard = Self { socket, lines: Lines::new() };
        let banner = dashboard.line("waiting for its greeting")?;
        if banner.starts_with(BANNER) { Ok(dashboard) } else { Err(UrError::NoDashboard { banner }) }
    }

    /// Says a line, and gives the answer.
    ///
    /// # Errors
    /// When none comes.
    pub fn ask(&mut self, question: &str) -> Result<String, UrError> {
        self.socket.write(format!("{}\n", one_line(question)).as_bytes(), "asking")?;
        self.line("waiting for an answer")
    }

    /// Asks, and wants an answer that begins like this.
    ///
    /// # Errors
    /// When another comes.
    pub fn wants(&mut self, question: &str, answer: &str) -> Result<(), UrError> {
        let answered = self.ask(question)?;
        if answered.to_lowercase().starts_with(&answer.to_lowercase()) {
            return Ok(());
        }
        Err(UrError::Dashboard { asked: question.into(), answered })
    }

    /// Whether programs from the network may run.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn is_in_remote_control(&mut self) -> Result<bool, UrError> {
        Ok(self.ask("is in remote control")?.trim().eq_ignore_ascii_case("true"))
    }

    /// What it says of the arm's safety: `NORMAL`, `PROTECTIVE_STOP`.
    ///
    /// # Errors
    /// When it does not answer so.
    pub fn safety_status(&mut self) -> Result<String, UrError> {
        let answered = self.ask("safetystatus")?;
        match answered.split_once(':') {
            Some((_, status)) => Ok(status.trim().to_owned()),
            None => Err(UrError::Dashboard { asked: "safetystatus".into(), answered }),
        }
    }

    /// Shows words to whoever stands at the pendant.
    ///
    /// # Errors
    /// When it does not.
    pub fn popup(&mut self, words: &str) -> Result<(), UrError> {
        self.wants(&format!("popup {words}"), "showing popup")
    }

    /// Takes the words away.
    ///
    /// # Errors
    /// When it does not.
    pub fn close_popup(&mut self) -> Result<(), UrError> {
        self.wants("close popup", "closing popup")
    }

    fn line(&mut self, doing: &'static str) -> Result<String, UrError> {
        let began = clock::now();
        loop {
            if let Some(line) = self.lines.next()? {
                return Ok(line.to_owned());
            }
            let mut bytes = [0; 256];
            let count = self.socket.read(&mut bytes, doing, began, PATIENCE)?;
            self.lines.feed(bytes.get(..count).unwrap_or_default());
        }
    }
}

/// A line has one line: what ends it becomes a space.
fn one_line(words: &str) -> String {
    words.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
