//! LandXML 1.2 out: surfaces, alignment, cross-sections. Points are written north, east, up, as the standard has it.

use crate::details::{Details, station};
use crate::drawing::SectionLine;

use crate::tin::Tin;
use crate::{IoError, atomic};
use std::fmt::Write as _;
use std::path::Path;

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
    write_with(path, project, crs, surfaces, &[], &Details::default())
}

/// Writes surfaces, alignment and cross-sections, with the day of the survey.
pub fn write_with(
    path: &Path,
    project: &str,
    crs: &str,
    surfaces: &[Surface],
    sections: &[SectionLine],
    details: &Details,
) -> Result<(), IoError> {
    atomic::write_bytes(path, document(project, crs, surfaces, sections, details).as_bytes())
}

/// The document of surfaces alone.
pub fn text(project: &str, crs: &str, surfaces: &[Surface]) -> String {
    document(project, crs, surfaces, &[], &Details::default())
}

/// The date is that of the survey: the same result gives the same bytes.
fn document(
    project: &str,
    crs: &str,
    surfaces: &[Surface],
    sections: &[SectionLine],
    details: &Details,
) -> String {
    let date = details.date();
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let mut line = |text: std::fmt::Arguments| {
        writeln!(out, "{text}").expect("a string takes every character")
    };
    line(format_args!(
        "<LandXML xmlns=\"http://www.landxml.org/schema/LandXML-1.2\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:schemaLocation=\"http://www.landxml.org/schema/LandXML-1.2 http://www.landxml.org/schema/LandXML-1.2/LandXML-1.2.xsd\" version=\"1.2\" date=\"{date}\" time=\"00:00:00\" language=\"English\" readOnly=\"false\">"
    ));
    line(format_args!(
        "<Units><Metric areaUnit=\"squareMeter\" linearUnit=\"meter\" volumeUnit=\"cubicMeter\" temperatureUnit=\"celsius\" pressureUnit=\"HPA\" angularUnit=\"decimal degrees\" directionUnit=\"decimal degrees\"/></Units>"
    ));
    if let Some(code) = crs.strip_prefix("EPSG:") {
        line(format_args!("<CoordinateSystem epsgCode=\"{}\"/>", escaped(code)));
    }
    line(format_args!("<Project name=\"{}\"/>", escaped(project)));
    line(format_args!("<Application name=\"tsumu\" version=\"{}\"/>", env!("CARGO_PKG_VERSION")));
    if details.alignment.len() > 1 {
        line(format_args!("{}", alignments(project, sections, details)));
    }
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

/// The alignment with its cross-sections: offsets to the right of it and levels, one surface a kind.
fn alignments(project: &str, sections: &[SectionLine], details: &Details) -> String {
    let corners = &details.alignment;
    let long = |a: &[f64; 2], b: &[f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
    let length: f64 = corners.windows(2).map(|w| long(&w[0], &w[1])).sum();
    let mut out = format!(
        "<Alignments><Alignment name=\"{}\" length=\"{}\" staStart=\"0\"><CoordGeom>",
        escaped(project),
        short(length, 4)
    );
    for w in corners.windows(2) {
        let [a, b] = [w[0], w[1]].map(|p| format!("{} {}", short(p[1], 4), short(p[0], 4)));
        let long = short(long(&w[0], &w[1]), 4);
        let _ = write!(out, "<Line length=\"{long}\"><Start>{a}</Start><End>{b}</End></Line>");
    }
    out += "</CoordGeom>";
    let mut chainages: Vec<f64> = sections.iter().map(|s| s.chainage_m).collect();
    chainages.sort_by(f64::total_cmp);
    chainages.dedup();
    if !chainages.is_empty() {
        out += "<CrossSects>";
        for chainage in chainages {
            let own = sections.iter().filter(|s| s.chainage_m == chainage);
            let _ = write!(
                out,
                "<CrossSect sta=\"{}\" name=\"{}\">",
                short(chainage, 4),
                station(chainage)
            );
            for s in own {
                let _ = write!(out, "<CrossSectSurf name=\"{}\"><PntList2D>", escaped(&s.surface));
                for p in &s.points {
                    let offset = offset_m(corners, [p[0], p[1]]);
                    let _ = write!(out, "{} {} ", short(offset, 3), short(p[2], 3));
                }
                out = format!("{}</PntList2D></CrossSectSurf>", out.trim_end());
            }
            out += "</CrossSect>";
        }
        out += "</CrossSects>";
    }
    out + "</Alignment></Alignments>"
}

/// Distance of a place from the nearest piece of a line, positive on its right.
pub(crate) fn offset_m(line: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let piece = |w: &[[f64; 2]]| {
        let ([dx, dy], [px, py]) =
            ([w[1][0] - w[0][0], w[1][1] - w[0][1]], [p[0] - w[0][0], p[1] - w[0][1]]);
        let long = dx.hypot(dy).max(1e-12);
        let along = (px * dx + py * dy) / long;
        let across = (py * dx - px * dy) / long;
        let beyond = (-along).max(along - long).max(0.0);
        (across.hypot(beyond), -across)
    };
    line.windows(2).map(piece).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, offset)| offset)
}
/// Text as XML 1.0 may hold it: marks escaped, characters XML has no way to write replaced by U+FFFD.
pub(crate) fn escaped(text: &str) -> String {
    let allowed = |c: char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{D7FF}' | '\u{E000}'..='\u{FFFD}' | '\u{10000}'..);
    let text: String =
        text.chars().map(|c| if allowed(c) { c } else { char::REPLACEMENT_CHARACTER }).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
