//! Lines of a drawing's model space, for alignments: LWPOLYLINE, POLYLINE and LINE, arcs cut into short pieces.

use super::arbitrary_axes;
use super::entities::{self, Entity, plain};
use crate::IoError;
use crate::input::Input;
use geom::{DVec2, DVec3};

/// Pieces of a full circle.
const PIECES: f64 = 180.0;

/// A line of the drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnLine {
    /// Its layer.
    pub layer: String,
    /// Its points in the file's coordinates.
    pub points: Vec<DVec2>,
}

/// Every line that model space shows (with `layer`: of that layer, shown or not), and the unit when the file says it.
pub fn read_polylines(
    input: &mut Input,
    layer: Option<&str>,
) -> Result<(Vec<DrawnLine>, Option<crate::crs::Unit>), IoError> {
    let drawing = entities::read(input)?;
    let wanted = layer.map(plain);
    let shows = |e: &&Entity| {
        let state = drawing.layers.get(&e.layer).copied().unwrap_or_default();
        match &wanted {
            Some(name) => *name == e.layer,
            None => !(e.paper || e.invisible || state.off || state.frozen),
        }
    };
    let line = |e: &Entity| {
        let points = points(e);
        (points.len() >= 2).then(|| DrawnLine { layer: e.layer.clone(), points })
    };
    let lines = drawing.model.iter().filter(shows).filter_map(line).collect();
    Ok((lines, drawing.unit))
}

fn points(entity: &Entity) -> Vec<DVec2> {
    let [ax, ay] = arbitrary_axes(entity.normal());
    // Plane entities are drawn in the axes of their extrusion direction.
    let world = |p: DVec2| (ax * p.x + ay * p.y).truncate();
    match entity.kind.as_str() {
        "LINE" => [10, 11].iter().filter_map(|c| entity.point(*c)).map(DVec3::truncate).collect(),
        "LWPOLYLINE" => {
            let mut corners: Vec<(DVec2, f64)> = Vec::new();
            for (code, value) in entity.groups() {
                let number = value.parse().unwrap_or(f64::NAN);
                match (code, corners.last_mut()) {
                    (10, _) => corners.push((DVec2::new(number, f64::NAN), 0.0)),
                    (20, Some(last)) => last.0.y = number,
                    (42, Some(last)) => last.1 = number,
                    _ => {}
                }
            }
            bulged(corners, entity.integer(70).unwrap_or(0) & 1 != 0)
                .into_iter()
                .map(world)
                .collect()
        }
        "POLYLINE" => {
            let flags = entity.integer(70).unwrap_or(0);
            if flags & (16 | 64) != 0 {
                return Vec::new();
            }
            let corner = |v: &Entity| Some((v.point(10)?.truncate(), v.number(42).unwrap_or(0.0)));
            let corners = entity.vertices.iter().filter_map(corner).collect();
            let line = bulged(corners, flags & 1 != 0);
            if flags & 8 != 0 { line } else { line.into_iter().map(world).collect() }
        }
        _ => Vec::new(),
    }
}

/// Corners with the tangent of a quarter of the arc to the next one.
fn bulged(corners: Vec<(DVec2, f64)>, closed: bool) -> Vec<DVec2> {
    let corners: Vec<_> = corners.into_iter().filter(|(p, _)| p.is_finite()).collect();
    let mut out = Vec::new();
    for (i, (from, bulge)) in corners.iter().enumerate() {
        out.push(*from);
        let next = if closed { corners.get((i + 1) % corners.len()) } else { corners.get(i + 1) };
        let Some((to, _)) = next else { break };
        if *bulge != 0.0 && bulge.is_finite() && to != from {
            out.extend(arc(*from, *to, 4.0 * bulge.atan()));
        }
    }
    if closed && let Some(first) = corners.first() {
        out.push(first.0);
    }
    out
}

/// Points between the ends of an arc that turns by `angle_rad`, left positive.
pub(crate) fn arc(from: DVec2, to: DVec2, angle_rad: f64) -> Vec<DVec2> {
    let half = (to - from) / 2.0;
    let centre = from + half + half.perp() / (angle_rad / 2.0).tan();
    let count =
        (angle_rad.abs() / std::f64::consts::TAU * PIECES).ceil().clamp(1.0, PIECES) as usize;
    let spoke = from - centre;
    (1..count)
        .map(|k| centre + DVec2::from_angle(angle_rad * k as f64 / count as f64).rotate(spoke))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_circle_keeps_its_radius() {
        let line = bulged(vec![(DVec2::ZERO, 1.0), (DVec2::new(10.0, 0.0), 0.0)], false);
        assert!(line.len() > 50);
        assert!(line.iter().all(|p| (p.distance(DVec2::new(5.0, 0.0)) - 5.0).abs() < 1e-9));
        // A positive bulge runs counter-clockwise: from left to right that is below.
        assert!(line[line.len() / 2].y < -4.9);
    }
}
