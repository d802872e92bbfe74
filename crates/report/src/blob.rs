//! The page's binary data: little-endian columns in one gzip stream, in base64.

use crate::ReportError;
use base64::Engine;
use flate2::{Compression, GzBuilder};
use std::io::Write;

/// Columns under construction.
#[derive(Debug, Default)]
pub(crate) struct Blob {
    bytes: Vec<u8>,
}

/// Where a column lies: byte offset and number of values.
pub(crate) type Span = [usize; 2];

impl Blob {
    /// Values as they are.
    pub fn f32s(&mut self, values: impl IntoIterator<Item = f32>) -> Span {
        self.column(values.into_iter().map(f32::to_le_bytes))
    }

    /// Values as they are.
    pub fn u32s(&mut self, values: impl IntoIterator<Item = u32>) -> Span {
        self.column(values.into_iter().map(u32::to_le_bytes))
    }

    /// Differences of neighbours, low bytes and high bytes apart: sorted points pack three times better so.
    pub fn u16_deltas(&mut self, values: impl Iterator<Item = u16> + Clone) -> Span {
        let mut last = 0_u16;
        let deltas: Vec<u16> = values
            .map(|v| {
                let delta = v.wrapping_sub(last);
                last = v;
                // Zigzag: small steps either way keep a zero high byte.
                (delta << 1) ^ (((delta as i16) >> 15) as u16)
            })
            .collect();
        let start = self.bytes.len();
        self.bytes.extend(deltas.iter().map(|d| *d as u8));
        self.bytes.extend(deltas.iter().map(|d| (*d >> 8) as u8));
        [start, deltas.len()]
    }

    fn column<const N: usize>(&mut self, values: impl Iterator<Item = [u8; N]>) -> Span {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let start = self.bytes.len();
        self.bytes.extend(values.flatten());
        [start, (self.bytes.len() - start) / N]
    }

    /// The stream as text.
    pub fn packed(self) -> Result<String, ReportError> {
        let fail = |e: std::io::Error| ReportError::Pack(e.to_string());
        let mut gzip = GzBuilder::new().mtime(0).write(Vec::new(), Compression::new(6));
        gzip.write_all(&self.bytes).map_err(fail)?;
        Ok(base64::engine::general_purpose::STANDARD.encode(gzip.finish().map_err(fail)?))
    }
}
