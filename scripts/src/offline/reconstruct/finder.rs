//! [`LumenProcess`]: another program in the place of our own lumen finder. It gets images and answers contours.
//!
//! `docs/reconstruction.md` has the protocol; `scripts/examples/find_lumen.py` is one.

mod error;
mod message;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use probepath_recon::{ImageLumen, LumenFinder, NoLumen};
use probepath_us_capture::PlacedBScan;

pub use error::FinderFault;
use message::Answer;

/// An answer is one line, never longer than this (bytes): a contour of a thousand points has 40 kB.
const LONGEST: u64 = 4 << 20;
/// What is kept of the program's own last words (bytes).
const LAST_WORDS: usize = 2000;

/// Which program finds the lumen, and how long it may think.
#[derive(Clone, Debug, PartialEq)]
pub struct FinderWish {
    /// The program; a `.py` is run with Python (`PROBEPATH_PYTHON`, else `python3`).
    pub program: PathBuf,
    /// How long it may take for one image, the first with its start included (s).
    pub seconds: f64,
}

/// A running program that finds lumens.
pub(super) struct LumenProcess {
    name: String,
    child: Child,
    questions: Option<Sender<(String, PlacedBScan)>>,
    answers: Receiver<std::io::Result<Vec<u8>>>,
    last_words: Arc<Mutex<Vec<u8>>>,
    /// Disconnected once all its last words were heard.
    silent: Receiver<()>,
    patience: Duration,
    fault: Option<FinderFault>,
    declined: BTreeMap<String, usize>,
}

impl LumenProcess {
    /// Starts the program.
    ///
    /// # Errors
    /// When it cannot be started, or the time it has is none.
    pub(super) fn start(wish: &FinderWish, dynamic_range_db: f64) -> Result<Self, FinderFault> {
        let name = wish.program.display().to_string();
        let patience = Duration::try_from_secs_f64(wish.seconds).ok().filter(|patience| !patience.is_zero());
        let patience = patience.ok_or(FinderFault::Seconds { seconds: wish.seconds })?;
        let started = command(&wish.program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let mut child = started.map_err(|source| FinderFault::Start { name: name.clone(), source })?;
        let last_words = Arc::new(Mutex::new(Vec::new()));
        let (speaks, silent) = channel();
        if let Some(stderr) = child.stderr.take() {
            let kept = Arc::clone(&last_words);
            thread::spawn(move || {
                listen(stderr, &kept);
                drop::<Sender<()>>(speaks);
            });
        }
        let (to_answers, answers) = channel();
        if let Some(stdout) = child.stdout.take() {
            thread::spawn(move || hear(stdout, &to_answers));
        }
        let (questions, from_questions) = channel();
        if let Some(stdin) = child.stdin.take() {
            let hello = message::hello(dynamic_range_db);
            thread::spawn(move || ask(stdin, &hello, &from_questions));
        }
        Ok(Self {
            name,
            child,
            questions: Some(questions),
            answers,
            last_words,
            silent,
            patience,
            fault: None,
            declined: BTreeMap::new(),
        })
    }

    /// What every image gave, and why the program said there is no lumen, by its own words.
    ///
    /// # Errors
    /// When the program died, took too long, or answered what is no answer.
    pub(super) fn all(
        mut self,
        images: &[PlacedBScan],
    ) -> Result<(Vec<ImageLumen>, BTreeMap<String, usize>), FinderFault> {
        let mut lumens = Vec::with_capacity(images.len());
        for image in images {
            lumens.push(self.find(image));
            if let Some(fault) = self.fault.take() {
                return Err(fault);
            }
        }
        Ok((lumens, std::mem::take(&mut self.declined)))
    }

    fn answered(&mut self, image: &PlacedBScan) -> Result<Answer, FinderFault> {
        let number = image.bscan.number;
        let asked = self
            .questions
            .as_ref()
            .is_some_and(|questions| questions.send((message::question(image), image.clone())).is_ok());
        if !asked {
            return Err(self.died(number));
        }
        match self.answers.recv_timeout(self.patience) {
            Ok(Ok(line)) => self.understood(number, &line),
            Ok(Err(source)) => Err(FinderFault::Pipe { name: self.name.clone(), number, source }),
            Err(RecvTimeoutError::Disconnected) => Err(self.died(number)),
            Err(RecvTimeoutError::Timeout) => Err(FinderFault::Hung {
                name: self.name.clone(),
                number,
                seconds: self.patience.as_secs_f64(),
                said: self.said(),
            }),
        }
    }

    fn understood(&self, number: u64, line: &[u8]) -> Result<Answer, FinderFault> {
        Answer::of(line, number).map_err(|why| FinderFault::Nonsense {
            name: self.name.clone(),
            number,
            why,
            answer: String::from_utf8_lossy(line).trim_end().chars().take(200).collect(),
        })
    }

    fn died(&mut self, number: u64) -> FinderFault {
        // It closed its output: it has gone, or is about to.
        self.questions = None;
        let status = gone(&mut self.child);
        let _all_was_said = self.silent.recv_timeout(Duration::from_millis(500));
        let how = status.map_or_else(|| "it closed its output".into(), |status| status.to_string());
        FinderFault::Died { name: self.name.clone(), number, how, said: self.said() }
    }

    /// Its last words, indented.
    fn said(&self) -> String {
        let words = self.last_words.lock().unwrap_or_else(PoisonError::into_inner);
        let words = String::from_utf8_lossy(&words).trim().replace('\n', "\n  ");
        if words.is_empty() { String::new() } else { format!("; it said:\n  {words}") }
    }
}

impl LumenFinder for LumenProcess {
    fn find(&mut self, image: &PlacedBScan) -> ImageLumen {
        match self.answered(image) {
            Ok(answer) => answer.of_image(image, &mut self.declined),
            Err(fault) => {
                self.fault = Some(fault);
                ImageLumen { number: image.bscan.number, lumen: Err(NoLumen::Declined), others: Vec::new() }
            }
        }
    }
}

impl Drop for LumenProcess {
    fn drop(&mut self) {
        // A program that was told all reads the end of its input and goes by itself; one that hangs does not.
        self.questions = None;
        if gone(&mut self.child).is_none() {
            let _already_gone = self.child.kill();
            let _reaped = self.child.wait();
        }
    }
}

/// Its exit, when it comes within half a second.
#[allow(clippy::disallowed_methods, reason = "another program's end is waited for; no arm and no test does")]
fn gone(child: &mut Child) -> Option<ExitStatus> {
    (0..50).find_map(|_| {
        let status = child.try_wait().ok().flatten();
        if status.is_none() {
            thread::sleep(Duration::from_millis(10));
        }
        status
    })
}

fn command(program: &Path) -> Command {
    if program.extension() != Some(OsStr::new("py")) {
        return Command::new(program);
    }
    let python = std::env::var_os("PROBEPATH_PYTHON").unwrap_or_else(|| "python3".into());
    let mut command = Command::new(python);
    command.arg(program);
    command
}

/// Writes hello and questions until nobody asks, or nobody listens.
fn ask(mut stdin: ChildStdin, hello: &str, questions: &Receiver<(String, PlacedBScan)>) {
    let mut tell = |line: &str, pixels: &[u8]| {
        stdin.write_all(line.as_bytes())?;
        stdin.write_all(pixels)?;
        stdin.flush()
    };
    let mut listens = tell(hello, &[]).is_ok();
    while listens {
        let Ok((line, image)) = questions.recv() else { return };
        listens = tell(&line, image.bscan.pixels()).is_ok();
    }
}

/// Hands on its answers, line by line.
fn hear(stdout: impl Read, answers: &Sender<std::io::Result<Vec<u8>>>) {
    let mut stdout = BufReader::new(stdout);
    loop {
        let mut line = Vec::new();
        let read = stdout.by_ref().take(LONGEST).read_until(b'\n', &mut line);
        let heard = match read {
            Ok(0) => return,
            Ok(_) if line.last() == Some(&b'\n') => answers.send(Ok(line)),
            Ok(n) if n as u64 == LONGEST => answers.send(Err(std::io::Error::other("an answer without end"))),
            Ok(_) => answers.send(Ok(line)),
            Err(error) => answers.send(Err(error)),
        };
        if heard.is_err() {
            return;
        }
    }
}

/// Keeps its last words.
fn listen(mut stderr: impl Read, kept: &Mutex<Vec<u8>>) {
    let mut some = [0; 512];
    while let Ok(count @ 1..) = stderr.read(&mut some) {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend_from_slice(some.get(..count).unwrap_or_default());
        let over = kept.len().saturating_sub(LAST_WORDS);
        kept.drain(..over);
    }
}
