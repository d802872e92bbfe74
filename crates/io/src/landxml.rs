//! LandXML 1.2: triangulated surfaces out and in. Points are written north, east, up, as the standard has it.

use crate::input::Input;
use crate::tin::Tin;
use crate::{IoError, Place};
use geom::DVec3;
use roxmltree::{Document, Node};
use std::collections::HashMap;

pub use crate::landxml_writer::{Surface, text, write, write_with};

const LIMIT: u64 = 256 << 20;

/// Text as XML shows it; control characters, which XML cannot hold, become blanks.
pub(crate) fn escaped(text: &str) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
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
