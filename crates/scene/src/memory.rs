//! How much memory a run may take: `memory = "4GB"` of a site, `--memory 4GB` of a command.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A bound on memory, bytes. Written with its unit: `512MB`, `4GB`, `1.5GiB`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct MemoryBound {
    bytes: u64,
}

/// Less than this the program itself takes.
const LEAST_BYTES: u64 = 250_000_000;

/// Units, the longer ones first: `GiB` ends with `B` too.
const UNITS: [(&str, f64); 6] = [
    ("KiB", 1024.0),
    ("MiB", 1024.0 * 1024.0),
    ("GiB", 1024.0 * 1024.0 * 1024.0),
    ("kB", 1e3),
    ("MB", 1e6),
    ("GB", 1e9),
];

/// Why a bound cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MemoryError {
    /// No number with a unit.
    #[error("`{0}` is no amount of memory: write e.g. 4GB or 512MB")]
    NoAmount(String),
    /// The program does not fit.
    #[error("`{0}` is too little memory: the program alone takes 250MB")]
    TooLittle(String),
}

impl MemoryBound {
    /// The bound in bytes.
    pub fn bytes(self) -> u64 {
        self.bytes
    }
}

impl FromStr for MemoryBound {
    type Err = MemoryError;

    fn from_str(text: &str) -> Result<Self, MemoryError> {
        let shown = || text.chars().take(40).collect::<String>();
        let none = || MemoryError::NoAmount(shown());
        let (number, factor) = UNITS
            .iter()
            .find_map(|(unit, factor)| Some((text.trim().strip_suffix(unit)?, *factor)))
            .ok_or_else(none)?;
        let number: f64 = number.trim().parse().map_err(|_| none())?;
        if !(number >= 0.0 && number.is_finite()) {
            return Err(none());
        }
        let bytes = (number * factor) as u64;
        if bytes < LEAST_BYTES {
            return Err(MemoryError::TooLittle(shown()));
        }
        Ok(Self { bytes })
    }
}

impl fmt::Display for MemoryBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bytes {
            bytes if bytes.is_multiple_of(1_000_000_000) => {
                write!(f, "{}GB", bytes / 1_000_000_000)
            }
            bytes => write!(f, "{}MB", bytes as f64 / 1e6),
        }
    }
}

impl TryFrom<String> for MemoryBound {
    type Error = MemoryError;

    fn try_from(text: String) -> Result<Self, MemoryError> {
        text.parse()
    }
}

impl From<MemoryBound> for String {
    fn from(bound: MemoryBound) -> Self {
        bound.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_are_read_with_their_unit() {
        let bytes = |text: &str| text.parse::<MemoryBound>().map(MemoryBound::bytes);
        assert_eq!(bytes("4GB"), Ok(4_000_000_000));
        assert_eq!(bytes(" 1.5 GiB "), Ok(1_610_612_736));
        assert_eq!(bytes("512MB"), Ok(512_000_000));
        for wrong in ["", "4", "GB", "4 gigabytes", "-4GB", "nanGB", "infGB", "4 GBGB"] {
            assert!(matches!(bytes(wrong), Err(MemoryError::NoAmount(_))), "{wrong}");
        }
        assert!(matches!(bytes("10MB"), Err(MemoryError::TooLittle(_))));
        for text in ["4GB", "512MB", "1234567890kB"] {
            let bound: MemoryBound = text.parse().unwrap();
            assert_eq!(bound.to_string().parse(), Ok(bound));
        }
    }
}
