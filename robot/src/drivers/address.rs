//! [`Address`]: which arm is meant.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// Which arm is meant, as a cell's file says it: `sim`, or `ur://host`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// The simulated cell, in this process.
    Simulated,
    /// A UR controller on its own protocols, always on their own ports.
    Ur {
        /// Its name or number in the network.
        host: String,
    },
}

/// An address that is none.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error(
    "{given:?} is no arm's address: {why}; write `sim`, or `ur://` and the controller's name or IP address"
)]
pub struct WrongAddress {
    /// What was given.
    pub given: String,
    /// What is wrong with it.
    pub why: &'static str,
}

impl FromStr for Address {
    type Err = WrongAddress;

    fn from_str(text: &str) -> Result<Self, WrongAddress> {
        let wrong = |why| WrongAddress { given: text.into(), why };
        if text == "sim" {
            return Ok(Self::Simulated);
        }
        let host = text.strip_prefix("ur://").ok_or_else(|| wrong("it does not say which kind of arm"))?;
        let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
        match host {
            "" => Err(wrong("it names no host")),
            _ if host.contains(':') => Err(wrong("it names a port, and a controller always has its own")),
            _ if !host.chars().all(part) => Err(wrong("a host has letters, digits, dots and hyphens")),
            _ => Ok(Self::Ur { host: host.into() }),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Simulated => f.write_str("sim"),
            Self::Ur { host } => write!(f, "ur://{host}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_written_as_it_is_read() {
        for text in ["sim", "ur://192.168.1.10", "ur://arm-2.hospital.example", "ur://localhost"] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn what_is_no_address_is_refused_in_words() {
        for text in
            ["", "SIM", "192.168.1.10", "ur://", "ur://host:30004", "ur://a b", "http://host", "ur://a/b"]
        {
            let wrong = text.parse::<Address>().unwrap_err().to_string();
            assert!(wrong.contains("ur://") && wrong.contains(&format!("{text:?}")), "{wrong}");
        }
    }
}
