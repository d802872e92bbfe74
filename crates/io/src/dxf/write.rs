//! DXF out (AutoCAD R12, which every CAD program reads): a drawing. In plan: outlines of the blocks with their numbers as
//! attributes, design lines, alignment with chainage, section lines, title and north. Below the plan: the sections laid
//! out with levels. In space: one BLOCK of faces per type and one INSERT per unit, on layers that are frozen at first, so
//! that the plan is not a blot of edges.
//!
//! An INSERT turns its block about the extrusion direction only, so that a general rotation is written as that
//! direction plus an angle, by the format's arbitrary-axis rule.

use super::arbitrary_axes;
use super::groups::Groups;
use super::sections;
use crate::details::{Details, station};
use crate::drawing::{Drawing, Source, Unit};
use crate::{IoError, atomic};
use geom::{DQuat, DVec3};
use std::path::Path;

/// Writes the drawing in site coordinates, metres.
pub fn write(path: &Path, drawing: &Drawing) -> Result<(), IoError> {
    write_with(path, drawing, &Details::default())
}

/// Writes the drawing with alignment, design and title.
pub fn write_with(path: &Path, drawing: &Drawing, details: &Details) -> Result<(), IoError> {
    atomic::write_bytes(path, document(drawing, details).as_bytes())
}

/// The file's text, without details.
pub fn text(drawing: &Drawing) -> String {
    document(drawing, &Details::default())
}

/// Name, colour and whether the layer is frozen at first.
const LAYERS: [(&str, u8, bool); 11] = [
    ("RECOGNISED", 8, false),
    ("PLANNED", 30, false),
    ("RECOGNISED_3D", 8, true),
    ("PLANNED_3D", 30, true),
    ("NUMBERS", 7, false),
    ("DESIGN", 1, false),
    ("ALIGNMENT", 7, false),
    ("SECTIONS", 5, false),
    ("SECTIONS_LAID_OUT", 7, false),
    ("UNFILLED", 6, false),
    ("TITLE", 7, false),
];

fn document(drawing: &Drawing, details: &Details) -> String {
    let mut out = Groups::default();
    let extent = extent(drawing, details);
    header(&mut out, extent);
    tables(&mut out, drawing);
    blocks(&mut out, drawing);
    out.section("ENTITIES");
    for unit in drawing.units() {
        solid(&mut out, drawing, &unit);
    }
    let letter_m = letter_m(drawing);
    for unit in drawing.units() {
        outline(&mut out, drawing, &unit);
        number(&mut out, drawing, &unit, letter_m);
    }
    works(&mut out, details, letter_m);
    section_lines(&mut out, drawing);
    let under = sections::laid_out(&mut out, drawing, details, extent, letter_m);
    title(&mut out, drawing, details, extent, under, letter_m);
    out.pair(0, "ENDSEC");
    out.pair(0, "EOF");
    out.0
}

/// Height of letters, metres: a fifth of a block.
fn letter_m(drawing: &Drawing) -> f64 {
    let block = drawing.catalog.iter().map(|(_, m)| f64::from(m.d_box_m)).fold(0.0, f64::max);
    if block > 0.0 { block / 5.0 } else { 0.5 }
}

/// Lowest and highest corner of all that is drawn in place.
fn extent(drawing: &Drawing, details: &Details) -> [DVec3; 2] {
    let [mut low, mut high] = [DVec3::MAX, DVec3::MIN];
    for unit in drawing.units() {
        let (centre, reach) =
            (drawing.centre(&unit), f64::from(drawing.catalog.get(unit.model).d_max_m));
        (low, high) = (low.min(centre - reach), high.max(centre + reach));
    }
    for p in details.design_lines.iter().flat_map(|(_, line)| line) {
        let p = DVec3::from_array(*p);
        (low, high) = (low.min(p), high.max(p));
    }
    if low.x > high.x { [DVec3::from_array(drawing.frame.origin); 2] } else { [low, high] }
}

fn header(out: &mut Groups, [low, high]: [DVec3; 2]) {
    out.section("HEADER");
    out.pair(9, "$ACADVER");
    out.pair(1, "AC1009");
    out.pair(9, "$EXTMIN");
    out.point(10, low);
    out.pair(9, "$EXTMAX");
    out.point(10, high);
    // No cross at points, lines of attributes as they are made visible.
    out.pair(9, "$ATTMODE");
    out.pair(70, 1);
    out.pair(0, "ENDSEC");
}

fn tables(out: &mut Groups, drawing: &Drawing) {
    out.section("TABLES");
    out.table("LTYPE", 2);
    line_type(out, "CONTINUOUS", "Solid line", &[]);
    line_type(out, "DASHDOT", "Dash dot", &[1.0, -0.4, 0.1, -0.4]);
    out.pair(0, "ENDTAB");
    let kinds = section_layers(drawing);
    out.table("LAYER", LAYERS.len() + kinds.len());
    for (name, colour, frozen) in LAYERS {
        let dashed = if name == "ALIGNMENT" { "DASHDOT" } else { "CONTINUOUS" };
        layer(out, name, colour, frozen, dashed);
    }
    for name in &kinds {
        layer(out, name, 2, false, "CONTINUOUS");
    }
    out.pair(0, "ENDTAB");
    out.table("STYLE", 1);
    out.pair(0, "STYLE");
    out.pair(2, "STANDARD");
    for (code, value) in [
        (70, "0"),
        (40, "0.0"),
        (41, "1.0"),
        (50, "0.0"),
        (71, "0"),
        (42, "0.2"),
        (3, "txt"),
        (4, ""),
    ] {
        out.pair(code, value);
    }
    out.pair(0, "ENDTAB");
    out.table("APPID", 1);
    out.pair(0, "APPID");
    out.pair(2, "TSUMU");
    out.pair(70, 0);
    out.pair(0, "ENDTAB");
    out.pair(0, "ENDSEC");
}

fn line_type(out: &mut Groups, name: &str, note: &str, dashes: &[f64]) {
    out.pair(0, "LTYPE");
    out.pair(2, name);
    out.pair(70, 0);
    out.pair(3, note);
    out.pair(72, 65);
    out.pair(73, dashes.len());
    out.pair(40, format!("{:?}", dashes.iter().map(|d| d.abs()).sum::<f64>()));
    dashes.iter().for_each(|d| out.pair(49, d));
}

fn layer(out: &mut Groups, name: &str, colour: u8, frozen: bool, line: &str) {
    out.pair(0, "LAYER");
    out.pair(2, name);
    out.pair(70, u8::from(frozen));
    out.pair(62, colour);
    out.pair(6, line);
}

/// Layers of the section lines in space, one a surface.
fn section_layers(drawing: &Drawing) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for line in drawing.sections {
        let name = section_layer(&line.surface);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

pub(crate) fn section_layer(surface: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    format!("SECTION_{}", surface.chars().map(plain).take(20).collect::<String>())
}

/// Attributes of a number: tag, prompt, whether it is hidden, and how many letters below the first it stands.
const TAGS: [(&str, &str, bool); 5] = [
    ("NO", "number", false),
    ("TYPE", "type", true),
    ("LEVEL", "level of the centre", true),
    ("ROUND", "round", true),
    ("CONFIDENCE", "confidence", true),
];

fn blocks(out: &mut Groups, drawing: &Drawing) {
    out.section("BLOCKS");
    for (id, model) in drawing.catalog.iter() {
        out.block(&block_name(id.0, &model.name));
        for t in 0..model.mesh.triangles.len() {
            let [a, b, c] = model.mesh.corners(t).map(|v| v.as_dvec3());
            out.pair(0, "3DFACE");
            out.pair(8, 0); // takes the layer of the INSERT
            for (i, p) in [a, b, c, c].into_iter().enumerate() {
                out.point(10 + i as u16, p);
            }
        }
        out.end_block();
    }
    out.block("NUMBER");
    for (i, (tag, prompt, hidden)) in TAGS.into_iter().enumerate() {
        out.pair(0, "ATTDEF");
        out.pair(8, 0);
        out.point(10, DVec3::new(0.0, -1.4 * i as f64, 0.0));
        out.pair(40, 1.0);
        out.pair(1, "");
        out.pair(3, prompt);
        out.pair(2, tag);
        out.pair(70, u8::from(hidden));
        out.pair(72, 1);
        out.point(11, DVec3::new(0.0, -1.4 * i as f64, 0.0));
    }
    out.end_block();
    out.pair(0, "ENDSEC");
}

/// The block in space.
fn solid(out: &mut Groups, drawing: &Drawing, unit: &Unit) {
    let model = drawing.catalog.get(unit.model);
    let (normal, angle_rad) = extrusion(unit.pose.rotation.as_dquat().normalize());
    let [ax, ay] = arbitrary_axes(normal);
    let at = drawing.frame.site_from_local(unit.pose.translation);
    out.pair(0, "INSERT");
    out.pair(8, format!("{}_3D", unit.layer().to_uppercase()));
    out.pair(2, block_name(unit.model.0, &model.name));
    // The insertion point is in the axes that belong to the extrusion direction.
    out.point(10, DVec3::new(at.dot(ax), at.dot(ay), at.dot(normal)));
    out.pair(50, angle_rad.to_degrees());
    out.point(210, normal);
    out.pair(1001, "TSUMU");
    out.pair(1000, unit.label());
    if let Source::Planned(p) = unit.source {
        out.pair(1000, format!("order {} round {}", p.order, p.round));
    }
}

fn outline(out: &mut Groups, drawing: &Drawing, unit: &Unit) {
    let z = drawing.centre(unit).z;
    for ring in drawing.footprint(unit) {
        let points: Vec<DVec3> = ring.iter().map(|p| DVec3::new(p[0], p[1], z)).collect();
        out.polyline(&unit.layer().to_uppercase(), &points, true);
    }
}

fn number(out: &mut Groups, drawing: &Drawing, unit: &Unit, letter_m: f64) {
    let centre = drawing.centre(unit);
    let (round, confidence, high) = match unit.source {
        Source::Recognised(_, fit) => {
            (String::new(), fit.confidence.map_or(String::new(), |c| format!("{c:.2}")), 0.7)
        }
        Source::Planned(p) => (p.round.to_string(), String::new(), 1.0),
    };
    let values = [
        unit.label(),
        drawing.catalog.get(unit.model).name.clone(),
        format!("{:.3}", centre.z),
        round,
        confidence,
    ];
    let size = letter_m * high;
    out.pair(0, "INSERT");
    out.pair(8, "NUMBERS");
    out.pair(66, 1);
    out.pair(2, "NUMBER");
    out.point(10, centre);
    out.pair(41, size);
    out.pair(42, size);
    out.pair(43, size);
    for (i, ((tag, _, hidden), value)) in TAGS.into_iter().zip(values).enumerate() {
        let at = centre - DVec3::Y * (size * (0.5 + 1.4 * i as f64));
        out.pair(0, "ATTRIB");
        out.pair(8, "NUMBERS");
        out.point(10, at);
        out.pair(40, size);
        out.words(&value);
        out.pair(2, tag);
        out.pair(70, u8::from(hidden));
        out.pair(72, 1);
        out.point(11, at);
    }
    out.pair(0, "SEQEND");
    out.pair(8, "NUMBERS");
}

/// Design lines, alignment with its stations, places that stay unfilled.
fn works(out: &mut Groups, details: &Details, letter_m: f64) {
    for (closed, line) in &details.design_lines {
        let points: Vec<DVec3> = line.iter().map(|p| DVec3::from_array(*p)).collect();
        out.polyline("DESIGN", &points, *closed);
    }
    let flat = |p: &[f64; 2]| DVec3::new(p[0], p[1], 0.0);
    let line: Vec<DVec3> = details.alignment.iter().map(flat).collect();
    if line.len() > 1 {
        out.polyline("ALIGNMENT", &line, false);
    }
    for (chainage, at, along) in details.stations(5.0) {
        let (p, across) = (flat(&at), DVec3::new(-along[1], along[0], 0.0));
        let long = chainage.rem_euclid(20.0) < 1e-6;
        let tick = across * letter_m * if long { 2.0 } else { 1.0 };
        out.line("ALIGNMENT", p - tick, p + tick);
        if long || details.stations(20.0).len() < 4 {
            let turn = upright(along[1].atan2(along[0]));
            out.text(
                "ALIGNMENT",
                p + across * letter_m * 2.6,
                letter_m,
                turn,
                1,
                &station(chainage),
            );
        }
    }
    for u in &details.unfilled {
        let [[x, y], h] = [u.centre, [u.half_m, u.half_m]];
        let ring = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let points: Vec<DVec3> =
            ring.iter().map(|s| DVec3::new(x + s[0] * h[0], y + s[1] * h[1], 0.0)).collect();
        out.polyline("UNFILLED", &points, true);
        out.text(
            "UNFILLED",
            DVec3::new(x, y - letter_m * 0.3, 0.0),
            letter_m * 0.6,
            0.0,
            1,
            &u.reason,
        );
    }
}

/// Letters that are not upside down.
fn upright(angle: f64) -> f64 {
    let half = std::f64::consts::FRAC_PI_2;
    if angle > half || angle <= -half { angle + std::f64::consts::PI } else { angle }
}

fn section_lines(out: &mut Groups, drawing: &Drawing) {
    for line in drawing.sections {
        let points: Vec<DVec3> = line.points.iter().map(|p| DVec3::from_array(*p)).collect();
        out.polyline(&section_layer(&line.surface), &points, false);
    }
}

/// Title and north arrow above the plan.
fn title(
    out: &mut Groups,
    drawing: &Drawing,
    details: &Details,
    [low, high]: [DVec3; 2],
    under: f64,
    letter_m: f64,
) {
    let size = letter_m * 2.0;
    let place = [drawing.frame.crs.as_str(), drawing.frame.vertical_datum.as_str()];
    let place: Vec<&str> = place.into_iter().filter(|p| !p.is_empty()).collect();
    let mut lines = vec![drawing.name.to_string(), place.join(" / ")];
    if !details.survey_date.is_empty() {
        lines.push(format!("Surveyed {}", details.survey_date));
    }
    lines.push(format!("tsumu {}  coordinates in metres, X(N) Y(E)", env!("CARGO_PKG_VERSION")));
    let top = high.y + size * 2.0 * (lines.len() as f64 + 1.0);
    for (i, text) in lines.iter().filter(|l| !l.is_empty()).enumerate() {
        let height = if i == 0 { size * 1.4 } else { size * 0.8 };
        out.text(
            "TITLE",
            DVec3::new(low.x, top - size * 2.0 * i as f64, 0.0),
            height,
            0.0,
            0,
            text,
        );
    }
    let foot = DVec3::new(high.x - size, high.y + size * 2.0, 0.0);
    let tip = foot + DVec3::Y * size * 5.0;
    out.line("TITLE", foot, tip);
    for side in [-1.0, 1.0] {
        out.line("TITLE", tip, tip + DVec3::new(side * size * 0.7, -size * 1.8, 0.0));
    }
    out.text("TITLE", tip + DVec3::Y * size * 0.4, size * 1.2, 0.0, 1, "N");
    // A frame about everything.
    let margin = size * 2.0;
    let [x0, x1] = [low.x - margin, high.x.max(low.x + 1.0) + margin];
    let [y0, y1] = [under - margin, top + size * 3.0];
    let ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|p| DVec3::new(p[0], p[1], 0.0));
    out.polyline("TITLE", &ring, true);
}

/// R12 names: capitals, digits, `_`, `-`; the number in front keeps them apart.
fn block_name(id: u16, name: &str) -> String {
    let plain =
        |c: char| if c.is_ascii_alphanumeric() || c == '-' { c.to_ascii_uppercase() } else { '_' };
    let name: String = name.chars().map(plain).take(24).collect();
    format!("B{}_{name}", id + 1)
}

/// The rotation as extrusion direction and angle about it.
fn extrusion(rotation: DQuat) -> (DVec3, f64) {
    let normal = (rotation * DVec3::Z).normalize();
    let [ax, ay] = arbitrary_axes(normal);
    let x = rotation * DVec3::X;
    (normal, x.dot(ay).atan2(x.dot(ax)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extrusion_and_angle_give_the_rotation_back() {
        for i in 0..200 {
            let t = f64::from(i);
            let axis = DVec3::new(t.sin(), (t * 1.7).cos(), (t * 0.3).sin() + 0.01).normalize();
            let rotation = DQuat::from_axis_angle(axis, t * 0.41);
            let (normal, angle) = extrusion(rotation);
            let [ax, ay] = arbitrary_axes(normal);
            let x = ax * angle.cos() + ay * angle.sin();
            assert!((x - rotation * DVec3::X).length() < 1e-12);
            assert!((normal.cross(x) - rotation * DVec3::Y).length() < 1e-12);
        }
    }
}
