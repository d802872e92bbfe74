//! Reads a triangulated surface, in metres.

use super::document::{self, LIMIT, is, metres, place};
use crate::crs::FileCrs;
use crate::input::Input;
use crate::tin::Tin;
use crate::{IoError, Place};
use geom::DVec3;
use roxmltree::Node;
use std::collections::HashMap;

/// A surface and what the file says of its coordinates.
#[derive(Clone, Debug)]
pub struct LandXmlSurface {
    /// The triangles: east, north, up, metres.
    pub tin: Tin,
    /// Coordinate system; its units are those of the file, which the triangles no longer are in.
    pub reference: FileCrs,
    /// Name of the surface.
    pub name: String,
}

/// The triangles of the surface called `name`, or of the only one.
pub fn read(input: &mut Input, name: Option<&str>) -> Result<Tin, IoError> {
    read_surface(input, name).map(|s| s.tin)
}

/// Reads the surface called `name`. Without a name the file must hold one surface alone.
pub fn read_surface(input: &mut Input, name: Option<&str>) -> Result<LandXmlSurface, IoError> {
    let text = input.text(LIMIT)?;
    let input = &*input;
    let document = document::parse(input, &text)?;
    let reference = document::reference(input, &document)?;
    let all: Vec<Node> = document.descendants().filter(|n| is(n, "Surface")).collect();
    let surface = choose(input, &all, name)?;
    let [plane, height] = metres(&reference);
    let (mut tin, mut by_id) = (Tin::default(), HashMap::new());
    let points = surface.descendants();
    for node in points.filter(|n| is(n, "P") && n.parent().is_some_and(|p| is(&p, "Pnts"))) {
        let point = point(input, node, [plane, height])?;
        let id = node
            .attribute("id")
            .ok_or_else(|| input.malformed(place(node), "a point <P> has no id"))?;
        by_id.insert(id, tin.vertices.len() as u32);
        tin.vertices.push(point);
    }
    // A face with i="1" is there for the triangulation alone.
    for node in surface.descendants().filter(|n| is(n, "F") && n.attribute("i") != Some("1")) {
        let words = node.text().unwrap_or_default().split_ascii_whitespace();
        let corners: Option<Vec<u32>> = words.map(|w| by_id.get(w).copied()).collect();
        let corners = corners.filter(|c| c.len() >= 3).ok_or_else(|| {
            input.malformed(
                place(node),
                "a face <F> needs the ids of three or more points of its surface",
            )
        })?;
        let outline: Vec<DVec3> = corners.iter().map(|&i| tin.vertices[i as usize]).collect();
        let triangles = crate::polygon::triangles(&outline);
        tin.triangles.extend(triangles.iter().map(|t| t.map(|k| corners[k])));
    }
    if tin.triangles.is_empty() {
        return Err(input.malformed(
            place(surface),
            "the surface has no faces <F>: only triangulated surfaces can be read",
        ));
    }
    let name = surface.attribute("name").unwrap_or_default().to_string();
    Ok(LandXmlSurface { tin, reference, name })
}

fn choose<'a, 'i>(
    input: &Input,
    all: &[Node<'a, 'i>],
    name: Option<&str>,
) -> Result<Node<'a, 'i>, IoError> {
    let names = || {
        let quoted = |n: &Node| format!("`{}`", n.attribute("name").unwrap_or_default());
        all.iter().take(20).map(quoted).collect::<Vec<_>>().join(", ")
    };
    match (name, all) {
        (_, []) => Err(input.malformed(Place::File, "there is no <Surface>")),
        (Some(name), all) => {
            let mut found = all.iter().filter(|n| n.attribute("name") == Some(name));
            let what = match (found.next(), found.next()) {
                (Some(one), None) => return Ok(*one),
                (Some(_), Some(_)) => format!(
                    "the file has several surfaces called `{name}`; give each a name of its own, or export the design alone"
                ),
                (None, _) => {
                    format!("there is no surface called `{name}`; the file has {}", names())
                }
            };
            Err(input.malformed(Place::File, what))
        }
        (None, [one]) => Ok(*one),
        (None, all) => {
            let what = format!(
                "the file has {} surfaces ({}); say which one is the design: `surface = \"…\"` in [design_file]",
                all.len(),
                names()
            );
            Err(input.malformed(Place::File, what))
        }
    }
}

fn point(input: &Input, node: Node, [plane, height]: [f64; 2]) -> Result<DVec3, IoError> {
    let words = node.text().unwrap_or_default().split_ascii_whitespace();
    let numbers: Option<Vec<f64>> = words.map(|w| w.parse().ok()).collect();
    let Some([north, east, up]) = numbers.as_deref() else {
        let what = "a point <P> needs three numbers: north, east, height";
        return Err(input.malformed(place(node), what));
    };
    let point = DVec3::new(east * plane, north * plane, up * height);
    if point.is_finite() {
        return Ok(point);
    }
    let (path, at) = (input.path.into(), place(node));
    Err(IoError::NotFinite { path, at, x: *east, y: *north, z: *up })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn read_text(text: &str, name: Option<&str>) -> Result<LandXmlSurface, String> {
        let mut input = Input::of_bytes(Path::new("a.xml"), text.as_bytes());
        read_surface(&mut input, name).map_err(|e| e.to_string())
    }

    fn file(head: &str, surfaces: &[(&str, f64)]) -> String {
        let surface = |(name, z): &(&str, f64)| {
            format!(
                "<Surface name=\"{name}\"><Definition surfType=\"TIN\"><Pnts><P id=\"1\">0 0 {z}</P><P id=\"2\">0 10 {z}</P><P id=\"3\">10 10 {z}</P><P id=\"4\">10 0 {z}</P></Pnts><Faces><F>1 2 3 4</F></Faces></Definition></Surface>"
            )
        };
        let all: String = surfaces.iter().map(surface).collect();
        format!("<LandXML>{head}<Surfaces>{all}</Surfaces></LandXML>")
    }

    #[test]
    fn a_name_that_two_surfaces_have_names_none() {
        let text = file("", &[("FG", 1.2), ("FG", 3.4), ("EG", 0.0)]);
        let error = read_text(&text, Some("FG")).unwrap_err();
        assert!(error.contains("several surfaces called `FG`"), "{error}");
        assert!(read_text(&text, Some("EG")).is_ok());
    }

    #[test]
    fn of_several_surfaces_one_must_be_named() {
        let text = file("", &[("EG", 1.2), ("FG", 3.4)]);
        let error = read_text(&text, None).unwrap_err();
        assert!(
            ["2 surfaces", "`EG`", "`FG`", "surface ="].iter().all(|p| error.contains(p)),
            "{error}"
        );
        assert_eq!(read_text(&text, Some("FG")).unwrap().tin.vertices[0].z, 3.4);
        assert!(read_text(&text, Some("X")).unwrap_err().contains("`EG`"));
        assert_eq!(read_text(&file("", &[("EG", 1.2)]), None).unwrap().name, "EG");
    }

    #[test]
    fn quadrilaterals_are_cut_in_two() {
        assert_eq!(read_text(&file("", &[("a", 1.0)]), None).unwrap().tin.triangles.len(), 2);
    }

    #[test]
    fn units_of_plane_and_height_are_obeyed() {
        let read =
            |head: &str| read_text(&file(head, &[("a", 2.0)]), None).map(|s| s.tin.vertices[2]);
        let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-9, "{a} {b}");
        near(
            read("<Units><Metric linearUnit=\"millimeter\" areaUnit=\"x\"/></Units>").unwrap(),
            DVec3::new(0.01, 0.01, 0.002),
        );
        near(
            read("<Units><Metric linearUnit=\"meter\" elevationUnit=\"centimeter\"/></Units>")
                .unwrap(),
            DVec3::new(10.0, 10.0, 0.02),
        );
        near(
            read("<Units><Imperial linearUnit=\"USSurveyFoot\"/></Units>").unwrap(),
            DVec3::new(10.0, 10.0, 2.0) * (1200.0 / 3937.0),
        );
        near(
            read("<Units><Imperial linearUnit=\"foot\"/></Units>").unwrap(),
            DVec3::new(10.0, 10.0, 2.0) * 0.3048,
        );
        assert!(
            read("<Units><Metric linearUnit=\"shaku\"/></Units>").unwrap_err().contains("shaku")
        );
    }

    #[test]
    fn other_encodings_are_read_as_their_declaration_says() {
        let text =
            format!("<?xml version=\"1.0\" encoding=\"CODE\"?>{}", file("", &[("計画面", 3.4)]));
        let utf_16: Vec<u8> = std::iter::once(0xfeff)
            .chain(text.replace("CODE", "UTF-16").encode_utf16())
            .flat_map(u16::to_le_bytes)
            .collect();
        let shift_jis = text.replace("CODE", "Shift_JIS");
        let shift_jis = encoding_rs::SHIFT_JIS.encode(&shift_jis).0;
        for bytes in [&utf_16[..], &shift_jis] {
            let mut input = Input::of_bytes(Path::new("a.xml"), bytes);
            assert_eq!(read_surface(&mut input, None).unwrap().name, "計画面");
        }
        let broken = text.replace("CODE", "UTF-8").into_bytes();
        let broken = [&broken[..60], b"\xff\xff", &broken[60..]].concat();
        let mut input = Input::of_bytes(Path::new("a.xml"), &broken);
        assert!(read_surface(&mut input, None).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn the_coordinate_system_is_read() {
        let code =
            |head: &str| read_text(&file(head, &[("a", 1.0)]), None).unwrap().reference.horizontal;
        assert_eq!(code("<CoordinateSystem epsgCode=\"6677\"/>"), Some(6677));
        assert_eq!(code("<CoordinateSystem epsgCode=\"EPSG:6677\"/>"), Some(6677));
        let wkt = crate::crs::wkt_of_epsg(6678).unwrap();
        assert_eq!(
            code(&format!("<CoordinateSystem ogcWktCode=\"{}\"/>", super::super::escaped(&wkt))),
            Some(6678)
        );
        assert_eq!(code(""), None);
        // As Japanese programs write it.
        let japanese = "<CoordinateSystem horizontalDatum=\"JGD2011\" verticalDatum=\"T.P\" horizontalCoordinateSystemName=\"9(X,Y)\"/>";
        assert_eq!(code(japanese), Some(6677));
    }
}
