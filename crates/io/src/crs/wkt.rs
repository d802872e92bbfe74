//! Well-known text of every make (WKT 1, WKT 2, ESRI) read as a tree, and what of it a survey needs.

use super::{CrsKind, FileCrs, Unit, epsg, japan};

/// Longer texts are no coordinate system.
const LIMIT: usize = 1 << 20;
const DEPTH: usize = 32;

/// One argument of a keyword.
#[derive(Debug)]
enum Argument {
    Text(String),
    Number(f64),
    Word(String),
    Node(Node),
}

/// `KEYWORD[argument, …]`.
#[derive(Debug)]
pub(super) struct Node {
    key: String,
    arguments: Vec<Argument>,
}

impl Node {
    pub fn children(&self) -> impl Iterator<Item = &Self> {
        self.arguments.iter().filter_map(|a| match a {
            Argument::Node(node) => Some(node),
            _ => None,
        })
    }

    pub fn child(&self, keys: &[&str]) -> Option<&Self> {
        self.children().find(|c| keys.contains(&c.key.as_str()))
    }

    pub fn text(&self) -> &str {
        self.arguments
            .iter()
            .find_map(|a| match a {
                Argument::Text(text) => Some(text.as_str()),
                _ => None,
            })
            .unwrap_or_default()
    }

    pub fn number(&self) -> Option<f64> {
        self.arguments.iter().find_map(|a| match a {
            Argument::Number(n) => Some(*n),
            _ => None,
        })
    }

    fn has_word(&self, word: &str) -> bool {
        self.arguments
            .iter()
            .any(|a| matches!(a, Argument::Word(w) if w.eq_ignore_ascii_case(word)))
    }

    /// The EPSG code among its own children.
    fn code(&self) -> Option<u32> {
        self.children().find_map(|c| {
            let is_epsg = matches!(c.key.as_str(), "AUTHORITY" | "ID")
                && c.text().eq_ignore_ascii_case("EPSG");
            is_epsg.then(|| c.arguments.get(1)).flatten().and_then(|a| match a {
                Argument::Text(t) => t.trim().parse().ok(),
                Argument::Number(n) if n.fract() == 0.0 && (0.0..1e9).contains(n) => {
                    Some(*n as u32)
                }
                _ => None,
            })
        })
    }

    /// The unit of its axes: its own, else that of its first axis that has one.
    fn unit(&self) -> Option<Unit> {
        const KEYS: [&str; 2] = ["UNIT", "LENGTHUNIT"];
        let own = self.child(&KEYS);
        let axes = || self.children().filter(|c| c.key == "AXIS").find_map(|a| a.child(&KEYS));
        let metres = own.or_else(axes)?.number()?;
        (metres > 0.0 && metres.is_finite()).then(|| Unit::of_metres(metres))
    }
}

/// What the text says; nothing when it is not well-known text.
pub fn of_wkt(wkt: &str) -> FileCrs {
    let mut crs = FileCrs::default();
    for node in parse(wkt) {
        take(&node, &mut crs, 0);
    }
    crs
}

fn take(node: &Node, crs: &mut FileCrs, depth: usize) {
    if depth > 3 {
        return;
    }
    match node.key.as_str() {
        "COMPD_CS" | "COMPOUNDCRS" => node.children().for_each(|c| take(c, crs, depth + 1)),
        "BOUNDCRS" => {
            let source = node.child(&["SOURCECRS"]);
            source.iter().for_each(|s| s.children().for_each(|c| take(c, crs, depth + 1)));
        }
        "PROJCS" | "PROJCRS" | "PROJECTEDCRS" | "DERIVEDPROJCRS" => {
            crs.kind = CrsKind::Projected;
            crs.name = node.text().into();
            crs.horizontal = node
                .code()
                .or_else(|| japan::code_of(node))
                .or_else(|| japan::code_of_name(node.text()));
            crs.unit = node.unit().or_else(|| unit_of_code(crs.horizontal));
        }
        "GEOGCS" | "GEOGCRS" | "GEODCRS" | "GEODETICCRS" | "GEOGRAPHICCRS" | "GEOCCS" => {
            let cartesian = node.child(&["CS"]).is_some_and(|c| c.has_word("Cartesian"));
            crs.kind = if node.key == "GEOCCS" || cartesian {
                CrsKind::Geocentric
            } else {
                CrsKind::Geographic
            };
            crs.name = node.text().into();
            crs.horizontal = node.code();
        }
        "VERT_CS" | "VERTCS" | "VERTCRS" | "VERTICALCRS" => take_vertical(node, crs),
        "LOCAL_CS" | "ENGCRS" | "ENGINEERINGCRS" => {
            crs.kind = CrsKind::Local;
            crs.name = node.text().into();
            crs.unit = node.unit();
        }
        _ => {}
    }
}

fn take_vertical(node: &Node, crs: &mut FileCrs) {
    crs.vertical = node.code();
    let of_code = crs.vertical.map(epsg::meaning);
    let (mut unit, mut depth) = (None, false);
    if let Some(epsg::Meaning::Vertical { unit: u, depth: d }) = of_code {
        (unit, depth) = (Some(u), d);
    }
    crs.vertical_unit = node.unit().or(unit);
    let down = |a: &Node| a.key == "AXIS" && a.has_word("down");
    // ESRI says the direction by a parameter.
    let turned = |p: &Node| {
        p.key == "PARAMETER"
            && p.text().eq_ignore_ascii_case("Direction")
            && p.number() == Some(-1.0)
    };
    crs.depth = depth || node.children().any(|c| down(c) || turned(c));
}

fn unit_of_code(code: Option<u32>) -> Option<Unit> {
    match epsg::meaning(code?) {
        epsg::Meaning::Projected(unit) => Some(unit),
        _ => None,
    }
}

/// The nodes of the text; ESRI writes two side by side. What follows a fault is passed over.
fn parse(wkt: &str) -> Vec<Node> {
    let mut reader = Reader { rest: &wkt[..floor(wkt, LIMIT)] };
    let mut nodes = Vec::new();
    while let Some(Argument::Node(node)) = reader.argument(0) {
        nodes.push(node);
        if !reader.eat(',') {
            break;
        }
    }
    nodes
}

fn floor(text: &str, limit: usize) -> usize {
    (0..=limit.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
}

struct Reader<'a> {
    rest: &'a str,
}

impl<'a> Reader<'a> {
    fn eat(&mut self, c: char) -> bool {
        self.rest = self.rest.trim_start();
        let found = self.rest.strip_prefix(c);
        self.rest = found.unwrap_or(self.rest);
        found.is_some()
    }

    fn argument(&mut self, depth: usize) -> Option<Argument> {
        self.rest = self.rest.trim_start();
        if depth > DEPTH {
            return None;
        }
        if let Some(text) = self.rest.strip_prefix(['"', '“']) {
            return self.quoted(text);
        }
        let end = self.rest.find([',', '[', ']', '(', ')']).unwrap_or(self.rest.len());
        let word = self.rest[..end].trim();
        self.rest = &self.rest[end..];
        if word.is_empty() {
            return None;
        }
        if !self.rest.starts_with(['[', '(']) {
            let number = word.parse().ok();
            return Some(number.map_or_else(|| Argument::Word(word.into()), Argument::Number));
        }
        let mut node = Node { key: word.to_uppercase(), arguments: Vec::new() };
        self.rest = &self.rest[1..];
        loop {
            node.arguments.extend(self.argument(depth + 1));
            if self.eat(']') || self.eat(')') {
                break;
            }
            if !self.eat(',') {
                self.rest = ""; // a fault: what was read so far counts
                break;
            }
        }
        Some(Argument::Node(node))
    }

    /// A quoted text; two quotes stand for one.
    fn quoted(&mut self, mut text: &'a str) -> Option<Argument> {
        let mut out = String::new();
        while let Some(end) = text.find(['"', '”']) {
            out.push_str(&text[..end]);
            let mark = text[end..].chars().next().map_or(1, char::len_utf8);
            let after = text.len() - end - mark;
            let rest = &self.rest[self.rest.len() - after..];
            let Some(more) = rest.strip_prefix('"') else {
                self.rest = &self.rest[self.rest.len() - after..];
                return Some(Argument::Text(out));
            };
            out.push('"');
            text = more;
        }
        self.rest = "";
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crs::wkt_of_epsg;

    const GEOG: &str = r#"GEOGCS["JGD2011",DATUM["Japanese_Geodetic_Datum_2011",SPHEROID["GRS 1980",6378137,298.257222101]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","6668"]]"#;

    #[test]
    fn a_compound_system_gives_both_parts_and_both_units() {
        let plane = wkt_of_epsg(6679).unwrap();
        let crs = of_wkt(&format!(
            r#"COMPD_CS["a [b",{plane},VERT_CS["NAVD88 height (ftUS)",VERT_DATUM["x",2005],UNIT["US survey foot",0.304800609601219],AXIS["Up",UP],AUTHORITY["EPSG","6360"]]]"#
        ));
        assert_eq!((crs.kind, crs.horizontal), (CrsKind::Projected, Some(6679)));
        assert_eq!(crs.vertical, Some(6360));
        assert!(crs.unit.unwrap().is_metre());
        assert_eq!(crs.vertical_unit.unwrap().name, "US survey foot");
        assert!(!crs.depth);
    }

    #[test]
    fn version_2_names_units_in_its_axes() {
        let crs = of_wkt(
            r#"COMPOUNDCRS["x",PROJCRS["y",BASEGEOGCRS["z",DATUM["d",ELLIPSOID["e",6378137,298]],ID["EPSG",6318]],CONVERSION["c",METHOD["Lambert Conic Conformal (2SP)"]],CS[Cartesian,2],AXIS["easting (X)",east,ORDER[1],LENGTHUNIT["foot",0.3048]],AXIS["northing (Y)",north,ORDER[2],LENGTHUNIT["foot",0.3048]],ID["EPSG",6557]],VERTCRS["d",VDATUM["v"],CS[vertical,1],AXIS["depth (D)",down,LENGTHUNIT["metre",1.0]],ID["EPSG",5706]]]"#,
        );
        assert_eq!((crs.horizontal, crs.vertical), (Some(6557), Some(5706)));
        assert_eq!(crs.unit.unwrap().name, "international foot");
        assert!(crs.depth && crs.vertical_unit.unwrap().is_metre());
    }

    #[test]
    fn esri_texts_have_no_codes_but_are_known() {
        let crs = of_wkt(
            r#"PROJCS["JGD_2011_Japan_Zone_9",GEOGCS["GCS_JGD_2011",DATUM["D_JGD_2011",SPHEROID["GRS_1980",6378137.0,298.257222101]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",0.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",139.8333333333333],PARAMETER["Scale_Factor",0.9999],PARAMETER["Latitude_Of_Origin",36.0],UNIT["Meter",1.0]],VERTCS["a",VDATUM["b"],PARAMETER["Vertical_Shift",0.0],PARAMETER["Direction",1.0],UNIT["Foot_US",0.3048006096012192]]"#,
        );
        assert_eq!((crs.kind, crs.horizontal), (CrsKind::Projected, Some(6677)));
        assert_eq!(crs.vertical_unit.unwrap().name, "US survey foot");
    }

    #[test]
    fn degrees_and_earth_centred_axes_are_told_apart() {
        assert_eq!(of_wkt(GEOG).kind, CrsKind::Geographic);
        assert_eq!(of_wkt(GEOG).horizontal, Some(6668));
        let geocentric =
            r#"GEODCRS["WGS 84",DATUM["x",ELLIPSOID["e",1,2]],CS[Cartesian,3],ID["EPSG",4978]]"#;
        assert_eq!(of_wkt(geocentric).kind, CrsKind::Geocentric);
        assert_eq!(of_wkt(r#"LOCAL_CS["bin",UNIT["metre",1]]"#).kind, CrsKind::Local);
    }

    #[test]
    fn broken_texts_say_what_they_can() {
        for text in ["", "[[[", "PROJCS", "PROJCS[\"a\"", "PROJCS[\"a", &"A[".repeat(100_000)] {
            let _ = of_wkt(text);
        }
        assert_eq!(of_wkt("PROJCS[\"a\"").kind, CrsKind::Projected);
        assert_eq!(of_wkt("GEOGCS[\"a \"\"b\"\" c\",UNIT[\"degree\",0.01]]").name, "a \"b\" c");
    }
}
