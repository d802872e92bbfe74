//! What surfaces and alignments of a LandXML file have in common: units, coordinate system, points.

use crate::crs::{self, FileCrs, Unit};
use crate::input::Input;
use crate::{IoError, Place};
use geom::DVec3;
use roxmltree::{Document, Node};

/// Larger files are no design.
pub(super) const LIMIT: u64 = 256 << 20;

/// The parsed text.
pub(super) fn parse<'a>(input: &Input, text: &'a str) -> Result<Document<'a>, IoError> {
    Document::parse(text)
        .map_err(|e| input.malformed(Place::Line(e.pos().row.into()), format!("not XML: {e}")))
}

pub(super) fn is(node: &Node, tag: &str) -> bool {
    node.tag_name().name() == tag
}

pub(super) fn place(node: Node) -> Place {
    Place::Line(node.document().text_pos_at(node.range().start).row.into())
}

/// The file's system of coordinates and its units: those of `linearUnit` and `elevationUnit`.
pub(super) fn reference(input: &Input, document: &Document) -> Result<FileCrs, IoError> {
    let mut reference = FileCrs::default();
    let system = document.descendants().find(|n| is(n, "CoordinateSystem"));
    if let Some(node) = system {
        let attribute = |name: &str| node.attribute(name).map(str::trim).filter(|v| !v.is_empty());
        let digits = |text: &str| -> Option<u32> {
            let last = text.rsplit(':').next()?.trim();
            last.parse().ok()
        };
        if let Some(code) = attribute("epsgCode").and_then(digits).filter(|c| *c > 0) {
            reference = FileCrs::of_code(code);
        } else if let Some(wkt) = attribute("ogcWktCode") {
            reference = crs::of_wkt(wkt);
        } else if let Some(proj) = attribute("proj4Def") {
            reference = crs::of_proj(proj);
        }
        if reference.is_unstated()
            && let Some(code) = attribute("horizontalDatum")
                .zip(attribute("horizontalCoordinateSystemName"))
                .and_then(|(datum, zone)| crs::code_of_zone(datum, zone))
        {
            reference = FileCrs::of_code(code);
        }
        if reference.name.is_empty() {
            reference.name = attribute("name").or(attribute("desc")).unwrap_or_default().into();
        }
    }
    let units = document.descendants().find(|n| is(n, "Metric") || is(n, "Imperial"));
    let word = |name: &str| {
        let node = units?;
        let default = if is(&node, "Imperial") { "foot" } else { "meter" };
        Some((node, node.attribute(name).unwrap_or(default).to_string()))
    };
    let known = |found: Option<(Node, String)>| match found {
        None => Ok(None),
        Some((node, word)) => {
            let unit = Unit::of_word(&word);
            if unit.metres.is_finite() {
                return Ok(Some(unit));
            }
            let what = format!("the unit `{word}` is not known here; export the file in metres");
            Err(input.malformed(place(node), what))
        }
    };
    let linear = known(word("linearUnit"))?;
    let height = match units.and_then(|n| n.attribute("elevationUnit")) {
        Some(_) => known(word("elevationUnit"))?,
        None => linear.clone(),
    };
    // What the numbers are in is said by the units, not by the code.
    reference.unit = linear.or(reference.unit);
    reference.vertical_unit = height.or(reference.vertical_unit);
    Ok(reference)
}

/// Metres in the units of plane and height.
pub(super) fn metres(reference: &FileCrs) -> [f64; 2] {
    let of = |unit: &Option<Unit>| unit.as_ref().map_or(1.0, |u| u.metres);
    [of(&reference.unit), of(&reference.vertical_unit)]
}

/// The numbers of a text; `None` when a word is none.
pub(super) fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |w: &str| w.parse().ok().filter(|v: &f64| v.is_finite());
    text.split_ascii_whitespace().map(number).collect()
}

/// North and east of a point element, by its own numbers or by the name of a survey point it refers to; in metres.
pub(super) fn north_east(input: &Input, node: Node, metre: f64) -> Result<DVec3, IoError> {
    let own = node.text().and_then(numbers).filter(|n| n.len() >= 2);
    let referred = || {
        let name = node.attribute("pntRef")?;
        let points = node.document().descendants().filter(|n| is(n, "CgPoint"));
        let mut named = points.filter(|n| n.attribute("name") == Some(name));
        named.next()?.text().and_then(numbers).filter(|n| n.len() >= 2)
    };
    let Some(values) = own.or_else(referred) else {
        let tag = node.tag_name().name();
        return Err(input.malformed(place(node), format!("<{tag}> needs two numbers: north, east")));
    };
    Ok(DVec3::new(values[1] * metre, values[0] * metre, 0.0))
}
