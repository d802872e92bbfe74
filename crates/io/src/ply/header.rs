//! The header of a PLY file: encoding, elements, properties.

use crate::input::Input;
use crate::{IoError, Place};

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Its name in a header.
    pub fn word(self) -> &'static str {
        match self {
            Self::I8 => "char",
            Self::U8 => "uchar",
            Self::I16 => "short",
            Self::U16 => "ushort",
            Self::I32 => "int",
            Self::U32 => "uint",
            Self::F32 => "float",
            Self::F64 => "double",
        }
    }

    /// Bytes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value in the first bytes of `b`; every type fits an f64 exactly.
    #[inline]
    pub fn value(self, b: &[u8], big: bool) -> f64 {
        macro_rules! number {
            ($t:ty, $n:literal) => {{
                let raw: [u8; $n] = b[..$n].try_into().expect("a slice of this length");
                f64::from(if big { <$t>::from_be_bytes(raw) } else { <$t>::from_le_bytes(raw) })
            }};
        }
        match self {
            Self::I8 => f64::from(b[0] as i8),
            Self::U8 => f64::from(b[0]),
            Self::I16 => number!(i16, 2),
            Self::U16 => number!(u16, 2),
            Self::I32 => number!(i32, 4),
            Self::U32 => number!(u32, 4),
            Self::F32 => number!(f32, 4),
            Self::F64 => number!(f64, 8),
        }
    }
}

/// One property of an element.
#[derive(Clone, Debug, PartialEq)]
pub struct Property {
    pub name: String,
    pub scalar: Scalar,
    /// Type of the count when it is a list.
    pub list: Option<Scalar>,
}

/// One element: a name, how many, and its properties.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Number of the property with one of these names, the first name preferred.
    pub fn find(&self, names: &[&str]) -> Option<usize> {
        names.iter().find_map(|n| self.properties.iter().position(|p| p.name == *n))
    }

    /// Bytes of one binary record; `None` when it holds a list.
    pub fn stride(&self) -> Option<usize> {
        self.properties.iter().map(|p| p.list.is_none().then(|| p.scalar.size())).sum()
    }

    /// Bytes that one record takes at least.
    pub fn least_bytes(&self, encoding: Encoding) -> u64 {
        let of = |p: &Property| match (encoding, p.list) {
            (Encoding::Ascii, _) => 2, // a digit and a separator
            (_, Some(count)) => count.size() as u64,
            (_, None) => p.scalar.size() as u64,
        };
        self.properties.iter().map(of).sum::<u64>().max(1)
    }
}

/// The header.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    pub comments: Vec<String>,
    /// Lines of the header.
    pub lines: u64,
}

const LINE_LIMIT: u64 = 4096;
const LINES_LIMIT: u64 = 2000;

/// Reads the header and checks its counts against the size of the file.
pub fn read(input: &mut Input) -> Result<Header, IoError> {
    let mut buffer = Vec::new();
    let (mut encoding, mut elements, mut comments, mut line) =
        (None, Vec::<Element>::new(), Vec::new(), 0);
    loop {
        line += 1;
        if line > LINES_LIMIT {
            return Err(input.malformed(
                Place::Line(line),
                format!("the header has more than {LINES_LIMIT} lines"),
            ));
        }
        if !input.line(&mut buffer, line, LINE_LIMIT)? {
            return Err(input.malformed(
                Place::Line(line),
                "the file ends inside the header: `end_header` is missing",
            ));
        }
        let text = String::from_utf8_lossy(&buffer).into_owned();
        let words: Vec<&str> = text.split_whitespace().collect();
        let bad = |what: &str| input.malformed(Place::Line(line), format!("{what}: `{text}`"));
        match words.as_slice() {
            ["ply"] if line == 1 => {}
            _ if line == 1 => {
                return Err(
                    input.malformed(Place::Line(1), "a PLY file starts with the line `ply`")
                );
            }
            ["format", kind, _] => {
                encoding = Some(match *kind {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(bad("unknown format")),
                });
            }
            ["comment" | "obj_info", ..] => comments.push(text),
            ["element", name, count] => {
                let count =
                    count.parse().map_err(|_| bad("the element's count is not a number"))?;
                elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
            }
            ["property", "list", count, scalar, name] => {
                let list = Scalar::of(count).filter(|s| !matches!(s, Scalar::F32 | Scalar::F64));
                let list = Some(list.ok_or_else(|| bad("unknown type of list count"))?);
                let scalar = Scalar::of(scalar).ok_or_else(|| bad("unknown type"))?;
                let element =
                    elements.last_mut().ok_or_else(|| bad("a property before any element"))?;
                element.properties.push(Property { name: (*name).into(), scalar, list });
            }
            ["property", scalar, name] => {
                let scalar = Scalar::of(scalar).ok_or_else(|| bad("unknown type"))?;
                let element =
                    elements.last_mut().ok_or_else(|| bad("a property before any element"))?;
                element.properties.push(Property { name: (*name).into(), scalar, list: None });
            }
            ["end_header"] => break,
            [] => {}
            _ => return Err(bad("not a line of a PLY header")),
        }
    }
    let encoding =
        encoding.ok_or_else(|| input.malformed(Place::File, "the header has no `format` line"))?;
    let left = input.len.saturating_sub(input.position()?);
    for element in &elements {
        // The last number of an ascii file may lack its separator.
        let at_most = (left + 1) / element.least_bytes(encoding);
        if element.count > at_most {
            let file_bytes = input.len;
            return Err(IoError::TooMany {
                path: input.path.into(),
                what: "elements",
                promised: element.count,
                at_most,
                file_bytes,
            });
        }
    }
    Ok(Header { encoding, elements, comments, lines: line })
}
