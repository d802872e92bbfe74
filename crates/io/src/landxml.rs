//! LandXML 1.2: triangulated surfaces out and in. Points are written north, east, up, as the standard has it.

use crate::input::Input;
use crate::tin::Tin;
use crate::{IoError, Place, atomic};
use geom::DVec3;
use roxmltree::{Document, Node};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

const LIMIT: u64 = 256 << 20;

/// A surface to write.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name in the file.
    pub name: String,
    /// What a reader should know of it.
    pub note: String,
    /// The triangles.
    pub tin: Tin,
}

impl Surface {
    /// Digits behind the point: millimetres on a site, micrometres in a bin.
    fn digits(&self) -> usize {
        let first = self.tin.vertices.first().copied().unwrap_or_default();
        let reach =
            self.tin.vertices.iter().fold(0.0_f64, |r, v| r.max((*v - first).abs().max_element()));
        if reach < 10.0 { 6 } else { 3 }
    }
}

/// A number with so many digits behind the point, less the zeros at its end.
fn short(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Writes named surfaces. `crs` is the site's, `EPSG:n`.
pub fn write(path: &Path, project: &str, crs: &str, surfaces: &[Surface]) -> Result<(), IoError> {
    atomic::write_bytes(path, text(project, crs, surfaces).as_bytes())
}

/// The document. The date is fixed: the same result gives the same bytes.
pub fn text(project: &str, crs: &str, surfaces: &[Surface]) -> String {
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let mut line = |text: std::fmt::Arguments| {
        writeln!(out, "{text}").expect("a string takes every character")
    };
    line(format_args!(
        "<LandXML xmlns=\"http://www.landxml.org/schema/LandXML-1.2\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:schemaLocation=\"http://www.landxml.org/schema/LandXML-1.2 http://www.landxml.org/schema/LandXML-1.2/LandXML-1.2.xsd\" version=\"1.2\" date=\"2000-01-01\" time=\"00:00:00\" language=\"English\" readOnly=\"false\">"
    ));
    line(format_args!(
        "<Units><Metric areaUnit=\"squareMeter\" linearUnit=\"meter\" volumeUnit=\"cubicMeter\" temperatureUnit=\"celsius\" pressureUnit=\"HPA\" angularUnit=\"decimal degrees\" directionUnit=\"decimal degrees\"/></Units>"
    ));
    if let Some(code) = crs.strip_prefix("EPSG:") {
        line(format_args!("<CoordinateSystem epsgCode=\"{}\"/>", escaped(code)));
    }
    line(format_args!("<Project name=\"{}\"/>", escaped(project)));
    line(format_args!("<Application name=\"tsumu\" version=\"{}\"/>", env!("CARGO_PKG_VERSION")));
    line(format_args!("<Surfaces>"));
    for surface in surfaces {
        let (tin, digits) = (&surface.tin, surface.digits());
        line(format_args!(
            "<Surface name=\"{}\" desc=\"{}\"><Definition surfType=\"TIN\"><Pnts>",
            escaped(&surface.name),
            escaped(&surface.note)
        ));
        for (i, v) in tin.vertices.iter().enumerate() {
            let [north, east, up] = [v.y, v.x, v.z].map(|c| short(c, digits));
            line(format_args!("<P id=\"{}\">{north} {east} {up}</P>", i + 1));
        }
        line(format_args!("</Pnts><Faces>"));
        for [a, b, c] in &tin.triangles {
            line(format_args!("<F>{} {} {}</F>", a + 1, b + 1, c + 1));
        }
        line(format_args!("</Faces></Definition></Surface>"));
    }
    line(format_args!("</Surfaces>"));
    line(format_args!("</LandXML>"));
    out
}

/// Text as XML 1.0 may hold it: marks escaped, characters XML has no way to write replaced by U+FFFD.
pub(crate) fn escaped(text: &str) -> String {
    let allowed = |c: char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{D7FF}' | '\u{E000}'..='\u{FFFD}' | '\u{10000}'..);
    let text: String =
        text.chars().map(|c| if allowed(c) { c } else { char::REPLACEMENT_CHARACTER }).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Reads the surface called `name`, or the first one.
pub fn read(input: &mut Input, name: Option<&str>) -> Result<Tin, IoError> {
    let text = input.text(LIMIT)?;
    let input = &*input;
    let document = Document::parse(&text)
        .map_err(|e| input.malformed(Place::Line(e.pos().row.into()), format!("not XML: {e}")))?;
    let at = |node: Node| Place::Line(document.text_pos_at(node.range().start).row.into());
    let is = |node: &Node, tag: &str| node.tag_name().name() == tag;
    let mut surfaces = document.descendants().filter(|n| is(n, "Surface"));
    let wanted = |n: &Node| name.is_none_or(|name| n.attribute("name") == Some(name));
    let surface = surfaces.find(wanted).ok_or_else(|| {
        let what = name.map_or("there is no <Surface>".to_string(), |n| {
            format!("there is no surface called `{n}`")
        });
        input.malformed(Place::File, what)
    })?;
    let imperial = document.descendants().any(|n| is(&n, "Imperial"));
    if imperial {
        return Err(IoError::unsupported(
            input.path,
            "the units are imperial; export the surface in metres",
        ));
    }
    let (mut tin, mut by_id) = (Tin::default(), HashMap::new());
    for node in
        surface.descendants().filter(|n| is(n, "P") && n.parent().is_some_and(|p| is(&p, "Pnts")))
    {
        let numbers: Option<Vec<f64>> = node
            .text()
            .unwrap_or_default()
            .split_ascii_whitespace()
            .map(|w| w.parse().ok())
            .collect();
        let Some([north, east, up]) = numbers.as_deref() else {
            return Err(
                input.malformed(at(node), "a point <P> needs three numbers: north, east, height")
            );
        };
        let point = DVec3::new(*east, *north, *up);
        if !point.is_finite() {
            return Err(IoError::NotFinite {
                path: input.path.into(),
                at: at(node),
                x: *east,
                y: *north,
                z: *up,
            });
        }
        let id = node
            .attribute("id")
            .ok_or_else(|| input.malformed(at(node), "a point <P> has no id"))?;
        by_id.insert(id, tin.vertices.len() as u32);
        tin.vertices.push(point);
    }
    for node in surface.descendants().filter(|n| is(n, "F") && n.attribute("i") != Some("1")) {
        let words = node.text().unwrap_or_default().split_ascii_whitespace();
        let corners: Option<Vec<u32>> = words.map(|w| by_id.get(w).copied()).collect();
        let Some([a, b, c]) = corners.as_deref() else {
            return Err(input
                .malformed(at(node), "a face <F> needs the ids of three points of its surface"));
        };
        tin.triangles.push([*a, *b, *c]);
    }
    if tin.triangles.is_empty() {
        return Err(input.malformed(
            Place::File,
            "the surface has no faces <F>: only triangulated surfaces can be read",
        ));
    }
    Ok(tin)
}
