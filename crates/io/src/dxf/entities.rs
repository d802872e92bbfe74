//! A DXF as its entities: what model space holds, the block definitions, the layers and the unit. Text files only.

use crate::crs::Unit;
use crate::input::Input;
use crate::{IoError, Place};
use encoding_rs::SHIFT_JIS;
use geom::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Kinds whose groups are kept; of all others only the number counts.
const KINDS: [&str; 8] =
    ["3DFACE", "POLYLINE", "VERTEX", "SEQEND", "MESH", "INSERT", "LWPOLYLINE", "LINE"];

/// One entity with the groups that describe it.
#[derive(Clone, Debug, Default)]
pub(super) struct Entity {
    pub kind: String,
    pub layer: String,
    /// On a sheet of paper, not in the model.
    pub paper: bool,
    pub invisible: bool,
    groups: Vec<(i32, String)>,
    /// Vertices of a POLYLINE.
    pub vertices: Vec<Entity>,
}

impl Entity {
    pub fn text(&self, code: i32) -> Option<&str> {
        self.groups.iter().find(|g| g.0 == code).map(|g| g.1.as_str())
    }

    pub fn number(&self, code: i32) -> Option<f64> {
        self.text(code)?.parse().ok().filter(|v: &f64| v.is_finite())
    }

    pub fn integer(&self, code: i32) -> Option<i64> {
        self.text(code)?.parse().ok()
    }

    /// Every group in its order.
    pub fn groups(&self) -> impl Iterator<Item = (i32, &str)> {
        self.groups.iter().map(|g| (g.0, g.1.as_str()))
    }

    /// The point that begins with this code; a missing height is 0.
    pub fn point(&self, code: i32) -> Option<DVec3> {
        let (x, y) = (self.number(code)?, self.number(code + 10)?);
        Some(DVec3::new(x, y, self.number(code + 20).unwrap_or(0.0)))
    }

    /// The extrusion direction, straight up when none is given.
    pub fn normal(&self) -> DVec3 {
        self.point(210).and_then(DVec3::try_normalize).unwrap_or(DVec3::Z)
    }
}

/// A block definition.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub base: DVec3,
    /// Its content is in another file.
    pub external: bool,
    pub entities: Vec<Entity>,
}

/// Whether a layer shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Layer {
    pub off: bool,
    pub frozen: bool,
}

/// The whole drawing.
#[derive(Clone, Debug, Default)]
pub(super) struct Entities {
    pub unit: Option<Unit>,
    pub layers: HashMap<String, Layer>,
    pub blocks: HashMap<String, Block>,
    pub model: Vec<Entity>,
    /// Entities of other kinds in model space: kind and number.
    pub others: BTreeMap<String, usize>,
}

/// Names are compared without regard to case.
pub(super) fn plain(name: &str) -> String {
    name.trim().to_uppercase()
}

/// One pair of lines.
struct Pair {
    code: i32,
    value: String,
    line: u64,
}

struct Pairs {
    buffer: Vec<u8>,
    line: u64,
}

impl Pairs {
    fn next(&mut self, input: &mut Input) -> Result<Option<Pair>, IoError> {
        self.line += 1;
        if !input.line(&mut self.buffer, self.line, 1 << 16)? {
            return Ok(None);
        }
        if self.line == 1 && self.buffer.starts_with(b"AutoCAD Binary DXF") {
            return Err(IoError::unsupported(
                input.path,
                "binary DXF is not read; save it as a text DXF",
            ));
        }
        let release = self.buffer.get(..4).is_some_and(|b| b.starts_with(b"AC1"));
        if self.line == 1 && release {
            let what = "this is a DWG drawing under another name; save it as a text DXF";
            return Err(IoError::unsupported(input.path, what));
        }
        let code: String =
            text(&self.buffer).chars().filter(|c| !c.is_control()).take(40).collect();
        let code = code.trim_start_matches('\u{feff}');
        let code: i32 = code.parse().map_err(|_| {
            input.malformed(
                Place::Line(self.line),
                format!("`{code}` is not a DXF group code: is this a text DXF?"),
            )
        })?;
        self.line += 1;
        if !input.line(&mut self.buffer, self.line, 1 << 16)? {
            return Err(input.malformed(
                Place::Line(self.line),
                "the file ends inside a pair of lines; it is cut short",
            ));
        }
        Ok(Some(Pair { code, value: text(&self.buffer), line: self.line }))
    }
}

fn text(bytes: &[u8]) -> String {
    let text = std::str::from_utf8(bytes).map_or_else(
        |_| SHIFT_JIS.decode_without_bom_handling(bytes).0.into_owned(),
        str::to_string,
    );
    text.trim().to_string()
}

/// Where the reader stands.
#[derive(Default)]
struct State {
    section: String,
    /// Name of the header's variable whose value comes next.
    variable: String,
    /// Entity, layer or block under way.
    entity: Option<Entity>,
    block: Option<(String, Block)>,
    polyline: Option<Entity>,
}

/// Reads the drawing.
pub(super) fn read(input: &mut Input) -> Result<Entities, IoError> {
    let (mut pairs, mut state, mut out) =
        (Pairs { buffer: Vec::new(), line: 0 }, State::default(), Entities::default());
    let mut names_section = false;
    while let Some(pair) = pairs.next(input)? {
        if pair.code == 0 {
            state.close(&mut out);
            names_section = pair.value == "SECTION";
            match pair.value.as_str() {
                "SECTION" | "ENDSEC" => state.section.clear(),
                "EOF" => break,
                kind => {
                    let kind = kind.to_string();
                    state.entity = Some(Entity { kind, ..Entity::default() });
                }
            }
        } else if names_section && pair.code == 2 {
            state.section = pair.value;
            names_section = false;
        } else if state.section == "HEADER" {
            state.header(&mut out, &pair);
        } else if let Some(entity) = &mut state.entity {
            take(input, entity, pair)?;
        }
    }
    state.close(&mut out);
    state.end_polyline(&mut out);
    if let Some((name, block)) = state.block.take() {
        out.blocks.insert(name, block);
    }
    Ok(out)
}

/// Adds a group to its entity.
fn take(input: &Input, entity: &mut Entity, pair: Pair) -> Result<(), IoError> {
    let Pair { code, value, line } = pair;
    match code {
        8 => entity.layer = plain(&value),
        67 => entity.paper = value == "1",
        60 => entity.invisible = value == "1",
        _ => {}
    }
    let kept = KINDS.contains(&entity.kind.as_str());
    let is_table = matches!(entity.kind.as_str(), "LAYER" | "BLOCK");
    if kept
        && (10..40).contains(&code)
        && value.parse().ok().filter(|v: &f64| v.is_finite()).is_none()
    {
        return Err(input.malformed(Place::Line(line), format!("`{value}` is not a coordinate")));
    }
    if kept || is_table {
        entity.groups.push((code, value));
    }
    Ok(())
}

impl State {
    fn header(&mut self, out: &mut Entities, pair: &Pair) {
        if pair.code == 9 {
            self.variable.clone_from(&pair.value);
        } else if self.variable == "$INSUNITS" && pair.code == 70 {
            out.unit = unit(pair.value.parse().unwrap_or(0));
        }
    }

    /// The entity under way is complete.
    fn close(&mut self, out: &mut Entities) {
        let Some(entity) = self.entity.take() else { return };
        match (self.section.as_str(), entity.kind.as_str()) {
            ("TABLES", "LAYER") => {
                let off = entity.integer(62).is_some_and(|c| c < 0);
                let frozen = entity.integer(70).is_some_and(|f| f & 1 != 0);
                let name = plain(entity.text(2).unwrap_or_default());
                out.layers.insert(name, Layer { off, frozen });
            }
            ("BLOCKS", "BLOCK") => {
                let base = entity.point(10).unwrap_or_default();
                let external = entity.integer(70).is_some_and(|f| f & 4 != 0);
                let name = plain(entity.text(2).unwrap_or_default());
                self.block = Some((name, Block { base, external, entities: Vec::new() }));
            }
            ("BLOCKS", "ENDBLK") => {
                self.end_polyline(out);
                if let Some((name, block)) = self.block.take() {
                    out.blocks.insert(name, block);
                }
            }
            ("BLOCKS" | "ENTITIES", "POLYLINE") => {
                self.end_polyline(out);
                self.polyline = Some(entity);
            }
            ("BLOCKS" | "ENTITIES", "VERTEX") => {
                if let Some(polyline) = &mut self.polyline {
                    polyline.vertices.push(entity);
                }
            }
            ("BLOCKS" | "ENTITIES", "SEQEND") => self.end_polyline(out),
            ("BLOCKS" | "ENTITIES", _) => {
                self.end_polyline(out);
                self.keep(entity, out);
            }
            _ => {}
        }
    }

    fn end_polyline(&mut self, out: &mut Entities) {
        if let Some(polyline) = self.polyline.take() {
            self.keep(polyline, out);
        }
    }

    fn keep(&mut self, entity: Entity, out: &mut Entities) {
        let known = KINDS.contains(&entity.kind.as_str());
        match &mut self.block {
            Some((_, block)) if known => block.entities.push(entity),
            Some(_) => {}
            None if known => out.model.push(entity),
            None => {
                // A file cannot fill the list with names of its own making.
                if !entity.paper
                    && (out.others.len() < 200 || out.others.contains_key(&entity.kind))
                {
                    *out.others.entry(entity.kind).or_default() += 1;
                }
            }
        }
    }
}

/// `$INSUNITS`; 0 and unknown numbers say nothing.
fn unit(number: i64) -> Option<Unit> {
    let metres = match number {
        1 => 0.0254,
        2 => 0.3048,
        3 => 1609.344,
        4 => 0.001,
        5 => 0.01,
        6 => 1.0,
        7 => 1000.0,
        10 => 0.9144,
        14 => 0.1,
        15 => 10.0,
        16 => 100.0,
        21 => 1200.0 / 3937.0,
        _ => return None,
    };
    Some(Unit::of_metres(metres))
}
