//! The layers of the GeoPackage: blocks, placements, not judged, design, alignment, sections, unfilled places.

use crate::details::{Details, station};
use crate::drawing::{Drawing, Source, Unit};
use rusqlite::types::Value;
use scene::Guess;

/// Kind of geometry of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Point,
    Line,
    Polygon,
}

impl Kind {
    /// The standard's word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Point => "POINT",
            Self::Line => "LINESTRING",
            Self::Polygon => "POLYGON",
        }
    }
}

/// One table of features.
pub(crate) struct Layer {
    pub name: &'static str,
    pub title: &'static str,
    pub kind: Kind,
    /// Names and types after the geometry.
    pub columns: Vec<&'static str>,
    pub rows: Vec<Row>,
}

/// One feature: rings, or one line, or one point; and its values.
pub(crate) struct Row {
    pub rings: Vec<Vec<[f64; 3]>>,
    pub values: Vec<Value>,
}

/// Name and title of each layer that may occur, from the bottom up.
pub(crate) const NAMES: [(&str, &str, Kind); 7] = [
    ("blocks", "認識ブロック Recognised blocks", Kind::Polygon),
    ("not_judged", "判定不能 Not judged", Kind::Point),
    ("placements", "据付ブロック Blocks to place", Kind::Polygon),
    ("unfilled", "未充填箇所 Unfilled places", Kind::Polygon),
    ("design", "計画線 Design lines", Kind::Line),
    ("alignment", "法線 Alignment", Kind::Line),
    ("sections", "横断線 Section lines", Kind::Line),
];

/// All layers; empty ones are there too, so that a project finds what it names.
pub(crate) fn layers(drawing: &Drawing, details: &Details) -> Vec<Layer> {
    let rows: [(Vec<&'static str>, Vec<Row>); 7] = [
        blocks(drawing),
        not_judged(drawing),
        placements(drawing),
        unfilled(details),
        design(details),
        alignment(details),
        sections(drawing),
    ];
    NAMES
        .into_iter()
        .zip(rows)
        .map(|((name, title, kind), (columns, rows))| Layer { name, title, kind, columns, rows })
        .collect()
}

fn real(v: impl Into<f64>) -> Value {
    Value::Real(v.into())
}

/// A number that may be unknown, with the digits of its f32.
fn known(v: Option<f32>) -> Value {
    v.map_or(Value::Null, |v| Value::Real(f64::from(v)))
}

fn text(v: impl Into<String>) -> Value {
    Value::Text(v.into())
}

fn flat(rings: Vec<Vec<[f64; 2]>>) -> Vec<Vec<[f64; 3]>> {
    rings.into_iter().map(|r| r.into_iter().map(|[x, y]| [x, y, 0.0]).collect()).collect()
}

/// Place, volume, mass and attitude: what every block has.
fn body(drawing: &Drawing, unit: &Unit) -> Vec<Value> {
    let (model, centre) = (drawing.catalog.get(unit.model), drawing.centre(unit));
    let q = unit.pose.rotation;
    let mut values = vec![text(&*model.name), real(centre.x), real(centre.y), real(centre.z)];
    values.extend([model.volume_m3, model.mass_kg(), q.w, q.x, q.y, q.z].map(real));
    values
}

const BODY: [&str; 10] = [
    "model TEXT",
    "x_m DOUBLE",
    "y_m DOUBLE",
    "z_m DOUBLE",
    "volume_m3 DOUBLE",
    "mass_kg DOUBLE",
    "qw DOUBLE",
    "qx DOUBLE",
    "qy DOUBLE",
    "qz DOUBLE",
];

fn blocks(drawing: &Drawing) -> (Vec<&'static str>, Vec<Row>) {
    let mut columns = vec!["block_id INTEGER"];
    columns.extend(BODY);
    columns.extend([
        "occlusion DOUBLE",
        "confidence DOUBLE",
        "fitness_m DOUBLE",
        "runner_up TEXT",
        "runner_up_fitness_m DOUBLE",
        "type_judged BOOLEAN",
        "legs_seen INTEGER",
        "legs_hidden INTEGER",
        "legs_missing INTEGER",
        "state TEXT",
    ]);
    let row = |unit: Unit| {
        let Source::Recognised(r, fit) = unit.source else { return None };
        let mut values = vec![Value::Integer(r.block.0.into())];
        values.extend(body(drawing, &unit));
        let second = fit.runner_up.map(|(m, _)| drawing.catalog.get(m).name.clone());
        values.extend([
            known(fit.occlusion),
            known(fit.confidence),
            known(fit.fitness_m),
            second.map_or(Value::Null, Value::Text),
            known(fit.runner_up.map(|(_, f)| f)),
            Value::Integer(fit.type_judged.into()),
        ]);
        let legs = fit.legs.map(|l| [l.seen, l.hidden, l.missing]);
        values.extend((0..3).map(|i| legs.map_or(Value::Null, |l| Value::Integer(l[i].into()))));
        values.push(text("stated"));
        Some(Row { rings: flat(drawing.footprint(&unit)), values })
    };
    (columns, drawing.units().filter_map(row).collect())
}

fn placements(drawing: &Drawing) -> (Vec<&'static str>, Vec<Row>) {
    let mut columns = vec!["placing_order INTEGER", "round INTEGER"];
    columns.extend(BODY);
    columns.extend(["drop_z_m DOUBLE", "filled_m3 DOUBLE", "contacts INTEGER", "state TEXT"]);
    let row = |unit: Unit| {
        let Source::Planned(p) = unit.source else { return None };
        let mut values = vec![Value::Integer(p.order.into()), Value::Integer(p.round.into())];
        values.extend(body(drawing, &unit));
        let drop = drawing.frame.site_from_local(p.drop * drawing.catalog.get(p.model).centre);
        values.extend([
            real(drop.z),
            real(p.filled_m3),
            Value::Integer(p.contacts.into()),
            text(p.state.word()),
        ]);
        Some(Row { rings: flat(drawing.footprint(&unit)), values })
    };
    (columns, drawing.units().filter_map(row).collect())
}

fn not_judged(drawing: &Drawing) -> (Vec<&'static str>, Vec<Row>) {
    let columns = vec![
        "block_id INTEGER",
        "likeliest TEXT",
        "z_m DOUBLE",
        "confidence DOUBLE",
        "occlusion DOUBLE",
        "points INTEGER",
    ];
    let open = drawing.recognised.iter().filter(|r| !r.is_stated());
    let row = |r: &scene::Recognised| {
        let p = drawing.frame.site_from_local(r.centre(drawing.catalog));
        let fit = r.fit();
        let likeliest = match &r.verdict {
            scene::Verdict::NotJudged(Guess::Place(_)) => Value::Null,
            _ => fit.map_or(Value::Null, |f| text(&*drawing.catalog.get(f.model).name)),
        };
        let values = vec![
            Value::Integer(r.block.0.into()),
            likeliest,
            real(p.z),
            known(fit.and_then(|f| f.confidence)),
            known(fit.and_then(|f| f.occlusion)),
            Value::Integer(r.points.len() as i64),
        ];
        Row { rings: vec![vec![[p.x, p.y, p.z]]], values }
    };
    (columns, open.map(row).collect())
}

fn unfilled(details: &Details) -> (Vec<&'static str>, Vec<Row>) {
    let row = |u: &crate::details::Unfilled| {
        let ([x, y], h) = (u.centre, u.half_m);
        let ring = vec![
            [x - h, y - h, 0.0],
            [x + h, y - h, 0.0],
            [x + h, y + h, 0.0],
            [x - h, y + h, 0.0],
        ];
        Row { rings: vec![ring], values: vec![text(&*u.reason), real(u.void_m3)] }
    };
    (vec!["reason TEXT", "void_m3 DOUBLE"], details.unfilled.iter().map(row).collect())
}

fn design(details: &Details) -> (Vec<&'static str>, Vec<Row>) {
    let row = |(i, (closed, points)): (usize, &(bool, Vec<[f64; 3]>))| {
        let line = points.iter().chain(points.first().filter(|_| *closed)).copied().collect();
        Row { rings: vec![line], values: vec![text(format!("design {}", i + 1))] }
    };
    (vec!["name TEXT"], details.design_lines.iter().enumerate().map(row).collect())
}

/// From station to station, so that each piece can be labelled.
fn alignment(details: &Details) -> (Vec<&'static str>, Vec<Row>) {
    let stations = details.stations(20.0);
    let end = details.alignment.last();
    let mut rows = Vec::new();
    for (i, (chainage, at, _)) in stations.iter().enumerate() {
        let next = stations.get(i + 1).map(|s| &s.1).or(end);
        if let Some(next) = next.filter(|n| *n != at) {
            let line = vec![[at[0], at[1], 0.0], [next[0], next[1], 0.0]];
            rows.push(Row {
                rings: vec![line],
                values: vec![text(station(*chainage)), real(*chainage)],
            });
        }
    }
    (vec!["station TEXT", "chainage_m DOUBLE"], rows)
}

fn sections(drawing: &Drawing) -> (Vec<&'static str>, Vec<Row>) {
    let row = |s: &crate::drawing::SectionLine| Row {
        rings: vec![s.points.clone()],
        values: vec![text(&*s.surface), real(s.chainage_m), text(station(s.chainage_m))],
    };
    (
        vec!["surface TEXT", "chainage_m DOUBLE", "station TEXT"],
        drawing.sections.iter().map(row).collect(),
    )
}
