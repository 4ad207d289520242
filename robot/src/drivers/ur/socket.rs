//! Blocking sockets whose every wait has an end and words for it.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use super::UrError;

/// How long a connection may take to come about.
const REACHED_IN: Duration = Duration::from_secs(3);

/// One connection, and who is at its other end.
#[derive(Debug)]
pub(super) struct Socket {
    pub(super) stream: TcpStream,
    pub(super) what: &'static str,
}

impl Socket {
    /// Connects; every later wait takes `patience` at most.
    pub(super) fn open(
        host: &str,
        port: u16,
        what: &'static str,
        patience: Duration,
    ) -> Result<Self, UrError> {
        let unreachable = |source| UrError::Unreachable { host: host.into(), port, what, source };
        let stream = reached(host, port).map_err(unreachable)?;
        stream.set_nodelay(true).map_err(unreachable)?;
        let socket = Self { stream, what };
        socket.wait_at_most(patience)?;
        Ok(socket)
    }

    /// Every wait from now on takes this long at most.
    pub(super) fn wait_at_most(&self, patience: Duration) -> Result<(), UrError> {
        let both = self.stream.set_read_timeout(Some(patience));
        both.and_then(|()| self.stream.set_write_timeout(Some(patience))).map_err(|source| UrError::Io {
            what: self.what,
            doing: "setting it up",
            source,
        })
    }

    pub(super) fn write(&mut self, bytes: &[u8], doing: &'static str) -> Result<(), UrError> {
        self.stream.write_all(bytes).map_err(|source| self.failed(source, doing, Duration::ZERO))
    }

    /// What came, at least a byte, before `deadline`.
    pub(super) fn read(
        &mut self,
        into: &mut [u8],
        doing: &'static str,
        began: Instant,
        patience: Duration,
    ) -> Result<usize, UrError> {
        let what = self.what;
        if began.elapsed() > patience {
            return Err(UrError::Silent { what, doing, waited: began.elapsed() });
        }
        match self.stream.read(into) {
            Ok(0) => Err(UrError::Closed { what, doing }),
            Ok(count) => Ok(count),
            Err(error) if error.kind() == ErrorKind::Interrupted => Ok(0),
            Err(source) => Err(self.failed(source, doing, began.elapsed())),
        }
    }

    fn failed(&self, source: std::io::Error, doing: &'static str, waited: Duration) -> UrError {
        let what = self.what;
        match source.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => UrError::Silent { what, doing, waited },
            ErrorKind::ConnectionReset | ErrorKind::BrokenPipe | ErrorKind::ConnectionAborted => {
                UrError::Closed { what, doing }
            }
            _ => UrError::Io { what, doing, source },
        }
    }
}

fn reached(host: &str, port: u16) -> std::io::Result<TcpStream> {
    let mut last = None;
    for address in (host, port).to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, REACHED_IN) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = Some(error),
        }
    }
    Err(last.unwrap_or_else(|| std::io::Error::new(ErrorKind::NotFound, "no such host")))
}
