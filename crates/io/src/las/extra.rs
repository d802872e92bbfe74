//! Extra dimensions (LASF_Spec record 4): where `instance`, `model` and `confidence` lie in a point record.

use super::header::{f64_at, u16_at};

const DESCRIPTOR: usize = 192;

/// A number type of an extra dimension, by its code in the specification.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Dimension {
    at: usize,
    code: u8,
    scale: f64,
    offset: f64,
}

impl Dimension {
    fn size(code: u8, options: u8) -> usize {
        match code {
            0 => usize::from(options), // raw bytes
            1 | 2 => 1,
            3 | 4 => 2,
            5 | 6 | 9 => 4,
            7 | 8 | 10 => 8,
            11..=20 => 2 * Self::size(code - 10, 0),
            21..=30 => 3 * Self::size(code - 20, 0),
            _ => 0,
        }
    }

    fn value(&self, record: &[u8]) -> f64 {
        let b = &record[self.at..];
        macro_rules! number {
            ($t:ty, $n:literal) => {
                <$t>::from_le_bytes(b[..$n].try_into().expect("a slice of this length")) as f64
            };
        }
        let raw = match self.code {
            1 => f64::from(b[0]),
            2 => f64::from(b[0] as i8),
            3 => number!(u16, 2),
            4 => number!(i16, 2),
            5 => number!(u32, 4),
            6 => number!(i32, 4),
            7 => number!(u64, 8),
            8 => number!(i64, 8),
            9 => number!(f32, 4),
            _ => number!(f64, 8),
        };
        raw * self.scale + self.offset
    }
}

/// The three dimensions, where the file has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Dimensions {
    instance: Option<Dimension>,
    model: Option<Dimension>,
    confidence: Option<Dimension>,
}

impl Dimensions {
    /// From the descriptors; those that do not fit into the record are passed over.
    pub fn of(descriptors: Option<&[u8]>, start: usize, record_bytes: usize) -> Self {
        let (mut found, mut at) = (Self::default(), start);
        for d in descriptors.unwrap_or_default().chunks_exact(DESCRIPTOR) {
            let (code, options) = (d[2], d[3]);
            let size = Dimension::size(code, options);
            let name =
                String::from_utf8_lossy(&d[4..36]).trim_end_matches('\0').trim().to_lowercase();
            let scale = if options & 8 != 0 { f64_at(d, 112) } else { 1.0 };
            let offset = if options & 16 != 0 { f64_at(d, 136) } else { 0.0 };
            let fits = (1..=10).contains(&code) && at + size <= record_bytes;
            let dimension = fits.then_some(Dimension { at, code, scale, offset });
            match name.as_str() {
                "instance" => found.instance = dimension,
                "model" => found.model = dimension,
                "confidence" => found.confidence = dimension,
                _ => {}
            }
            at = at.saturating_add(size);
        }
        found
    }

    /// Which of `instance`, `model`, `confidence` exist.
    pub fn present(&self) -> [bool; 3] {
        [self.instance.is_some(), self.model.is_some(), self.confidence.is_some()]
    }

    /// The values in a record, 0 for a missing one.
    #[inline]
    pub fn values(&self, record: &[u8]) -> [f64; 3] {
        [&self.instance, &self.model, &self.confidence].map(|d| d.map_or(0.0, |d| d.value(record)))
    }
}

/// Bytes of a record that stay when earlier labels are taken out, and the descriptors of what stays behind the standard fields.
pub(super) fn without_labels(
    descriptors: &[u8],
    base: usize,
    record_bytes: usize,
) -> (Vec<std::ops::Range<usize>>, Vec<u8>) {
    let (mut kept, mut out, mut at) = (Vec::new(), Vec::new(), base);
    kept.push(0..base);
    for d in descriptors.chunks_exact(DESCRIPTOR) {
        let size = Dimension::size(d[2], d[3]);
        if at + size > record_bytes {
            break;
        }
        let name = String::from_utf8_lossy(&d[4..36]).trim_end_matches('\0').trim().to_lowercase();
        if !matches!(name.as_str(), "instance" | "model" | "confidence") {
            kept.push(at..at + size);
            out.extend_from_slice(d);
        }
        at += size;
    }
    // Bytes that nobody describes stay too, as what the standard calls undocumented.
    while at < record_bytes {
        let size = (record_bytes - at).min(255);
        let mut d = [0; DESCRIPTOR];
        d[3] = size as u8;
        d[4..16].copy_from_slice(b"undocumented");
        out.extend_from_slice(&d);
        kept.push(at..at + size);
        at += size;
    }
    (kept, out)
}

/// The record content for these dimensions: (name, type code, description), in this order in each point.
pub(super) fn descriptors(dimensions: &[(&str, u8, &str)]) -> Vec<u8> {
    let mut out = Vec::with_capacity(DESCRIPTOR * dimensions.len());
    for (name, code, description) in dimensions {
        let mut d = [0; DESCRIPTOR];
        d[2] = *code;
        d[4..4 + name.len()].copy_from_slice(name.as_bytes());
        d[160..160 + description.len()].copy_from_slice(description.as_bytes());
        debug_assert_eq!(u16_at(&d, 0), 0);
        out.extend_from_slice(&d);
    }
    out
}
