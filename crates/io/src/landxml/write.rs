//! Writes LandXML 1.2: triangulated surfaces. Points are written north, east, up, as the standard has it.

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

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
