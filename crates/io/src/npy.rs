//! NumPy arrays of two dimensions (`.npy`), as peers' programs leave their labelled clouds.
//!
//! In: an opened file. Out: rows of numbers. Plain integer and float types in either byte order, rows or columns first; the
//! size that the header promises is held against the file before memory is taken.

use crate::IoError;
use crate::Place;
use crate::input::Input;

/// A table of numbers, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Numbers of a row.
    pub columns: usize,
    /// All rows, one after the other.
    pub values: Vec<f64>,
}

/// Longest header read; NumPy's own is 128 bytes.
const HEADER_LIMIT: u32 = 1 << 16;

/// Reads the array. Errors: not such a file, another kind of array, or a file cut short.
pub fn read(input: &mut Input) -> Result<Table, IoError> {
    let mut magic = [0; 8];
    input.fill(&mut magic, "the header")?;
    if &magic[..6] != b"\x93NUMPY" {
        return Err(input.malformed(Place::File, "it does not begin as a NumPy array does"));
    }
    let length = if magic[6] == 1 {
        let mut two = [0; 2];
        input.fill(&mut two, "the header")?;
        u32::from(u16::from_le_bytes(two))
    } else {
        let mut four = [0; 4];
        input.fill(&mut four, "the header")?;
        u32::from_le_bytes(four)
    };
    if length > HEADER_LIMIT {
        let what = format!("a header of {length} bytes is none that NumPy writes");
        return Err(input.malformed(Place::File, what));
    }
    let text = input.take(length.into(), "the header")?;
    let text = String::from_utf8_lossy(&text).into_owned();
    let header = Header::parse(&text).ok_or_else(|| {
        let what = format!(
            "the array is `{}`; a table of two dimensions of plain numbers is needed: np.save(file, np.column_stack([xyz, instance]))",
            text.trim()
        );
        input.malformed(Place::File, what)
    })?;
    let count = (header.rows as u64).checked_mul(header.columns as u64);
    let bytes = count.and_then(|c| c.checked_mul(header.width as u64)).unwrap_or(u64::MAX);
    let raw = input.take(bytes, "the numbers")?;
    let at = |i: usize| header.number(&raw[i * header.width..(i + 1) * header.width]);
    let (rows, columns) = (header.rows, header.columns);
    let values = if header.columns_first {
        (0..rows * columns).map(|i| at(i % columns * rows + i / columns)).collect()
    } else {
        (0..rows * columns).map(at).collect()
    };
    Ok(Table { columns, values })
}

struct Header {
    rows: usize,
    columns: usize,
    columns_first: bool,
    big_endian: bool,
    /// `f`, `i` or `u`.
    kind: u8,
    width: usize,
}

impl Header {
    fn parse(text: &str) -> Option<Self> {
        let after = |key: &str| {
            let at = text.find(&format!("'{key}'"))?;
            text[at + key.len() + 2..].split_once(':').map(|s| s.1.trim_start())
        };
        let descr = after("descr")?.strip_prefix('\'')?.split('\'').next()?;
        let [order, kind, width] = descr.as_bytes() else { return None };
        let width = usize::from(width.checked_sub(b'0')?);
        let known = match kind {
            b'f' => [4, 8].contains(&width),
            b'i' | b'u' => [1, 2, 4, 8].contains(&width),
            _ => false,
        };
        let shape = after("shape")?.strip_prefix('(')?.split(')').next()?;
        let sizes: Vec<usize> = shape
            .split(',')
            .map(str::trim)
            .filter(|s| !s.is_empty())
            .map(|s| s.parse().ok())
            .collect::<Option<_>>()?;
        let [rows, columns] = sizes.as_slice() else { return None };
        (known && b"<>|=".contains(order)).then_some(Self {
            rows: *rows,
            columns: *columns,
            columns_first: after("fortran_order")?.starts_with("True"),
            big_endian: *order == b'>',
            kind: *kind,
            width,
        })
    }

    /// Whole numbers beyond 2⁵³ lose their last digits.
    fn number(&self, raw: &[u8]) -> f64 {
        let mut wide = [0_u8; 8];
        wide[..raw.len()].copy_from_slice(raw);
        if self.big_endian {
            wide[..raw.len()].reverse();
        }
        let bits = u64::from_le_bytes(wide);
        let spare = 64 - 8 * self.width as u32;
        match (self.kind, self.width) {
            (b'f', 4) => f32::from_bits(bits as u32).into(),
            (b'f', _) => f64::from_bits(bits),
            (b'i', _) => (((bits << spare) as i64) >> spare) as f64,
            _ => bits as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn file(descr: &str, order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let text =
            format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn table(bytes: &[u8]) -> Result<Table, IoError> {
        read(&mut Input::of_bytes(Path::new("a.npy"), bytes))
    }

    #[test]
    fn every_plain_type_and_order_is_read() {
        let f: Vec<u8> = [1.5_f32, -2.0, 3.0, 4.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let got = table(&file("<f4", "False", "(2, 2)", &f)).unwrap();
        assert_eq!(got, Table { columns: 2, values: vec![1.5, -2.0, 3.0, 4.0] });
        let got = table(&file("<f4", "True", "(2, 2)", &f)).unwrap();
        assert_eq!(got.values, [1.5, 3.0, -2.0, 4.0]);
        let i: Vec<u8> = [-1_i16, 7].iter().flat_map(|v| v.to_be_bytes()).collect();
        assert_eq!(table(&file(">i2", "False", "(1, 2)", &i)).unwrap().values, [-1.0, 7.0]);
        let u = 3_000_000_000_u32.to_le_bytes();
        assert_eq!(table(&file("<u4", "False", "(1, 1)", &u)).unwrap().values, [3e9]);
    }

    #[test]
    fn other_arrays_and_bombs_are_refused_in_words() {
        let says = |bytes: &[u8]| table(bytes).unwrap_err().to_string();
        assert!(says(b"ply\nformat").contains("NumPy"));
        assert!(says(&file("<f4", "False", "(3,)", &[0; 12])).contains("two dimensions"));
        assert!(says(&file("|O8", "False", "(1, 1)", &[0; 8])).contains("plain numbers"));
        assert!(says(&file("<f8", "False", "(1, 4)", &[0; 8])).contains("cut short"));
        let huge = "(18446744073709551615, 18446744073709551615)";
        assert!(says(&file("<f8", "False", huge, &[0; 8])).contains("cut short"));
    }
}
