//! Coordinate reference systems as files state them: WKT of every make, GeoTIFF keys, EPSG codes; what they mean for a
//! survey, and whether files and site agree.

mod agreement;
mod epsg;
mod epsg_table;
mod geotiff_keys;
mod japan;
mod proj_string;
mod wkt;

pub use agreement::{disagreements, site_code};
pub use epsg::{Meaning, code, meaning};
pub use geotiff_keys::{GeoKeys, keys_of_epsg};
pub use japan::{code_of_zone, wkt_of_epsg};
pub use proj_string::of_proj;
pub use wkt::of_wkt;

use std::fmt;

/// A unit of length.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Its English name, or the file's own word.
    pub name: String,
    /// Metres in one; NaN when the file's word is unknown.
    pub metres: f64,
}

/// Units that files name, in metres, with the words they use (lower case, no blanks or underscores).
const UNITS: [(&str, f64, &[&str]); 9] = [
    ("metre", 1.0, &["m", "metre", "meter", "metres", "meters", "ｍ", "メートル"]),
    (
        "US survey foot",
        1200.0 / 3937.0,
        &["ussurveyfoot", "footus", "ftus", "us-ft", "usft", "ussurveyfeet", "foot-us", "sft"],
    ),
    (
        "international foot",
        0.3048,
        &["ft", "foot", "feet", "internationalfoot", "footinternational", "'"],
    ),
    ("millimetre", 0.001, &["mm", "millimetre", "millimeter", "millimetres", "millimeters"]),
    ("centimetre", 0.01, &["cm", "centimetre", "centimeter", "centimetres", "centimeters"]),
    ("kilometre", 1000.0, &["km", "kilometre", "kilometer", "kilometres", "kilometers"]),
    ("inch", 0.0254, &["in", "inch", "inches"]),
    ("yard", 0.9144, &["yd", "yard", "yards"]),
    ("mile", 1609.344, &["mi", "mile", "miles"]),
];

impl Unit {
    /// The metre.
    pub fn metre() -> Self {
        Self { name: "metre".into(), metres: 1.0 }
    }

    /// The unit of this length, by its usual name.
    pub fn of_metres(metres: f64) -> Self {
        // The two feet differ by two parts in a million.
        let known = UNITS.iter().find(|u| (u.1 / metres - 1.0).abs() < 5e-7);
        let name = known.map_or_else(|| format!("unit of {metres} m"), |u| u.0.to_string());
        Self { name, metres: known.map_or(metres, |u| u.1) }
    }

    /// The unit that a file names by a word; of an unknown one nothing but the word is known.
    pub fn of_word(word: &str) -> Self {
        let plain: String =
            word.to_lowercase().chars().filter(|c| !matches!(c, ' ' | '_' | '.')).collect();
        let known = UNITS.iter().find(|u| u.2.contains(&plain.as_str()));
        known.map_or_else(
            || Self { name: word.trim().to_string(), metres: f64::NAN },
            |u| Self { name: u.0.into(), metres: u.1 },
        )
    }

    /// True for the metre.
    pub fn is_metre(&self) -> bool {
        (self.metres - 1.0).abs() < 1e-9
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

/// What kind of coordinates a file says it holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CrsKind {
    /// The file does not say.
    #[default]
    Unstated,
    /// Plane coordinates of a map projection.
    Projected,
    /// Latitude and longitude.
    Geographic,
    /// Three axes from the middle of the earth.
    Geocentric,
    /// A system of the site's own.
    Local,
}

/// What a file says of the system its coordinates are in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileCrs {
    /// What kind of coordinates.
    pub kind: CrsKind,
    /// EPSG code of the horizontal system.
    pub horizontal: Option<u32>,
    /// Codes that the same words stand for too: a PROJ string may leave the datum open.
    pub alternatives: Vec<u32>,
    /// EPSG code of the vertical system.
    pub vertical: Option<u32>,
    /// Name of the system in the file; may be empty.
    pub name: String,
    /// Unit of the horizontal coordinates.
    pub unit: Option<Unit>,
    /// Unit of the heights.
    pub vertical_unit: Option<Unit>,
    /// The heights count downwards.
    pub depth: bool,
}

impl FileCrs {
    /// What an EPSG code alone says.
    pub fn of_code(code: u32) -> Self {
        let mut crs = Self::default();
        crs.take_code(code);
        crs
    }

    /// Sets what a code says where nothing is set yet.
    fn take_code(&mut self, code: u32) {
        match epsg::meaning(code) {
            Meaning::Projected(unit) => {
                self.kind = CrsKind::Projected;
                self.horizontal = Some(code);
                self.unit.get_or_insert(unit);
            }
            Meaning::Geographic => {
                self.kind = CrsKind::Geographic;
                self.horizontal = Some(code);
            }
            Meaning::Geocentric => {
                self.kind = CrsKind::Geocentric;
                self.horizontal = Some(code);
            }
            Meaning::Vertical { unit, depth } => {
                self.vertical = Some(code);
                self.vertical_unit.get_or_insert(unit);
                self.depth |= depth;
            }
            Meaning::Compound(horizontal, vertical) => {
                self.take_code(horizontal);
                self.take_code(vertical);
            }
        }
    }

    /// True when the file says nothing.
    pub fn is_unstated(&self) -> bool {
        *self == Self::default()
    }

    /// `EPSG:n` of the horizontal system.
    pub fn epsg(&self) -> Option<String> {
        self.horizontal.map(|code| format!("EPSG:{code}"))
    }

    /// What to call it in a message: its code, else its name.
    pub fn label(&self) -> String {
        match (self.horizontal, self.name.trim()) {
            (Some(code), "") => format!("EPSG:{code}"),
            (Some(code), name) => format!("EPSG:{code} ({name})"),
            (None, "") => "a system without a name".into(),
            (None, name) => format!("`{name}`"),
        }
    }

    /// Metres in the file's unit of height: the vertical unit, else the horizontal one, else the metre.
    pub fn height_unit(&self) -> Unit {
        self.vertical_unit.clone().or_else(|| self.unit.clone()).unwrap_or_else(Unit::metre)
    }
}

/// What comments of a header say: well-known text, a PROJ string, or a code behind `EPSG:`. Comments that name several codes say
/// nothing: which one the numbers are in is not known.
pub fn of_comments<'a>(comments: impl IntoIterator<Item = &'a str>) -> FileCrs {
    const WKT: [&str; 6] =
        ["PROJCS[", "PROJCRS[", "COMPD_CS[", "COMPOUNDCRS[", "GEOGCS[", "GEOGCRS["];
    let mut codes = Vec::new();
    for comment in comments {
        let upper = comment.to_ascii_uppercase();
        let start = WKT.iter().filter_map(|key| upper.find(key)).min();
        let stated = start.map(|start| of_wkt(&comment[start..])).filter(|c| !c.is_unstated());
        let stated = stated.or_else(|| Some(of_proj(comment)).filter(|c| !c.is_unstated()));
        if let Some(crs) = stated {
            return crs;
        }
        for (at, _) in upper.match_indices("EPSG:") {
            let rest = upper[at + 5..].trim_start_matches([':', ' ']);
            let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
            codes.extend(digits.parse().ok().filter(|&c: &u32| c > 0));
        }
    }
    codes.sort_unstable();
    codes.dedup();
    match codes[..] {
        [code] => FileCrs::of_code(code),
        _ => FileCrs::default(),
    }
}

/// What a text of its own says, such as a `.prj` file: well-known text, a PROJ string or a code.
pub fn of_text(text: &str) -> FileCrs {
    let wkt = of_wkt(text);
    if wkt.is_unstated() { of_comments([text]) } else { wkt }
}

/// A `.prj` beside a file (same name, other ending): the habit of programs whose formats have no place for it.
pub fn beside(path: &std::path::Path) -> Option<std::path::PathBuf> {
    let file = path.with_extension("prj");
    (file != path && file.is_file()).then_some(file)
}

/// The file's own word, else that of the `.prj` beside it.
pub(crate) fn or_beside(path: &std::path::Path, own: FileCrs) -> FileCrs {
    if own.horizontal.is_some() || own.kind != CrsKind::Unstated {
        return own;
    }
    let text = beside(path).and_then(|file| crate::input::read_text(&file, 1 << 20).ok());
    let stated = text.map(|text| of_text(&text)).unwrap_or_default();
    // A unit or a depth of its own stays.
    FileCrs {
        vertical: own.vertical.or(stated.vertical),
        unit: own.unit.or(stated.unit),
        vertical_unit: own.vertical_unit.or(stated.vertical_unit),
        depth: own.depth || stated.depth,
        ..stated
    }
}
