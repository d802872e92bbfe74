//! Reads an alignment: lines, arcs and clothoids of its `CoordGeom`, as points in metres.

use super::document::{self, LIMIT, is, metres, north_east, place};
use crate::crs::FileCrs;
use crate::dxf::arc;
use crate::input::Input;
use crate::{IoError, Place};
use geom::{DVec2, DVec3};
use roxmltree::Node;

/// The points (east, north) of the alignment called `name`, or of the only one, and what the file says of its coordinates.
pub fn read_alignment(
    input: &mut Input,
    name: Option<&str>,
) -> Result<(Vec<[f64; 2]>, FileCrs), IoError> {
    let text = input.text(LIMIT)?;
    let input = &*input;
    let document = document::parse(input, &text)?;
    let reference = document::reference(input, &document)?;
    let all: Vec<Node> = document.descendants().filter(|n| is(n, "Alignment")).collect();
    let named = |n: &&Node| name.is_none() || n.attribute("name") == name;
    let matching: Vec<&Node> = all.iter().filter(named).collect();
    let alignment = match matching.as_slice() {
        [one] => **one,
        found => {
            let quoted = |n: &Node| format!("`{}`", n.attribute("name").unwrap_or_default());
            let names = all.iter().take(20).map(quoted).collect::<Vec<_>>().join(", ");
            let what = match (found.len(), name, all.len()) {
                (_, _, 0) => "there is no <Alignment>".to_string(),
                (0, Some(name), _) => {
                    format!("there is no alignment called `{name}`; the file has {names}")
                }
                _ => format!(
                    "the file has several alignments ({names}); say which one: `name = \"…\"`"
                ),
            };
            return Err(input.malformed(Place::File, what));
        }
    };
    let [metre, _] = metres(&reference);
    let geometry = alignment.descendants().find(|n| is(n, "CoordGeom"));
    let geometry = geometry
        .ok_or_else(|| input.malformed(place(alignment), "the alignment has no <CoordGeom>"))?;
    let mut points: Vec<DVec2> = Vec::new();
    for element in geometry.children().filter(Node::is_element) {
        let piece = piece(input, element, metre)?;
        // Elements begin where the one before ended.
        let joined = points.last().is_some_and(|p| p.distance(piece[0]) < 1e-6);
        points.extend(&piece[usize::from(joined)..]);
    }
    if points.len() < 2 {
        return Err(input.malformed(place(geometry), "the alignment has fewer than two points"));
    }
    Ok((points.iter().map(|p| p.to_array()).collect(), reference))
}

/// Points of one element, its ends among them.
fn piece(input: &Input, element: Node, metre: f64) -> Result<Vec<DVec2>, IoError> {
    let child = |tag: &str| {
        let node = element.children().find(|n| is(n, tag));
        let missing = || {
            let what = format!("<{}> has no <{tag}>", element.tag_name().name());
            input.malformed(place(element), what)
        };
        north_east(input, node.ok_or_else(missing)?, metre).map(DVec3::truncate)
    };
    match element.tag_name().name() {
        "Line" => Ok(vec![child("Start")?, child("End")?]),
        "Curve" => {
            let (from, centre, to) = (child("Start")?, child("Center")?, child("End")?);
            let left = element.attribute("rot").is_some_and(|r| r.eq_ignore_ascii_case("ccw"));
            let turn = (from - centre).angle_to(to - centre);
            let full = std::f64::consts::TAU;
            let angle = if left { turn.rem_euclid(full) } else { -(-turn).rem_euclid(full) };
            if angle == 0.0 || !angle.is_finite() {
                return Ok(vec![from, to]);
            }
            let mut points = vec![from];
            points.extend(arc(from, to, angle));
            points.push(to);
            Ok(points)
        }
        "Spiral" => {
            // A transition curve stays within decimetres of the curve through its point of intersection.
            let (from, corner, to) = (child("Start")?, child("PI")?, child("End")?);
            let at =
                |t: f64| from * (1.0 - t).powi(2) + corner * (2.0 * t * (1.0 - t)) + to * (t * t);
            Ok((0..=20).map(|k| at(f64::from(k) / 20.0)).collect())
        }
        "IrregularLine" => {
            let list = element.children().find(|n| is(n, "PntList2D") || is(n, "PntList3D"));
            let step = if list.is_some_and(|n| is(&n, "PntList3D")) { 3 } else { 2 };
            let numbers =
                list.and_then(|n| n.text()).and_then(document::numbers).unwrap_or_default();
            let mut points = vec![child("Start")?];
            points.extend(numbers.chunks_exact(step).map(|c| DVec2::new(c[1], c[0]) * metre));
            points.push(child("End")?);
            points.dedup_by(|a, b| a.distance(*b) < 1e-9);
            Ok(points)
        }
        other => Err(input.malformed(
            place(element),
            format!("<{other}> in an alignment is not read here; export it as lines and curves"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn lines_and_curves_become_points() {
        let text = "<LandXML><Alignments><Alignment name=\"CL\"><CoordGeom><Line><Start>0 0</Start><End>0 10</End></Line><Curve rot=\"ccw\"><Start>0 10</Start><Center>10 10</Center><End>10 20</End></Curve></CoordGeom></Alignment></Alignments></LandXML>";
        let mut input = Input::of_bytes(Path::new("a.xml"), text.as_bytes());
        let (points, _) = read_alignment(&mut input, None).unwrap();
        assert_eq!((points[0], points[1]), ([0.0, 0.0], [10.0, 0.0]));
        assert_eq!(points.last(), Some(&[20.0, 10.0]));
        let on_circle = |p: &[f64; 2]| ((p[0] - 10.0).hypot(p[1] - 10.0) - 10.0).abs() < 1e-9;
        assert!(points.len() > 20 && points[1..].iter().all(on_circle));
        let mut input = Input::of_bytes(Path::new("a.xml"), text.as_bytes());
        assert!(read_alignment(&mut input, Some("X")).unwrap_err().to_string().contains("`CL`"));
    }
}
