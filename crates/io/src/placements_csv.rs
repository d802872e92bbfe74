//! `placements.csv`: one planned block a line, in placing order; removed ones too, with the reason in `state`.

use crate::csv_table::{self, Row, SitePose};
use crate::input::Input;
use crate::{IoError, atomic};
use scene::{
    Catalog, Handling, InstanceId, PatternNode, Placement, PlacementState, Reset, SiteFrame,
};
use std::path::Path;

/// Columns.
pub const COLUMNS: [&str; 20] = [
    "order",
    "round",
    "model",
    "drop_x_m",
    "drop_y_m",
    "drop_z_m",
    "drop_qw",
    "drop_qx",
    "drop_qy",
    "drop_qz",
    "rest_x_m",
    "rest_y_m",
    "rest_z_m",
    "rest_qw",
    "rest_qx",
    "rest_qy",
    "rest_qz",
    "filled_m3",
    "contacts",
    "state",
];

/// Columns of plans that are more than new blocks straight down; in other files they are left out.
pub const HANDLING: [&str; 10] = [
    "node",
    "reset_block",
    "lift_x_m",
    "lift_y_m",
    "lift_z_m",
    "lift_qw",
    "lift_qx",
    "lift_qy",
    "lift_qz",
    "path",
];

/// How a block gets to its place, site coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandlingRow {
    /// Node of the pattern: layer, row, column.
    pub node: Option<PatternNode>,
    /// Number of the recognised block that is lifted, and where it stands.
    pub reset: Option<(u32, SitePose)>,
    /// Poses through which it is carried before it is let go; in the file `x y z qw qx qy qz`, one after the other with `;`.
    pub path: Vec<SitePose>,
}

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacementRow {
    /// Position in the placing order, from 1.
    pub order: u32,
    /// Planning round, from 1.
    pub round: u32,
    /// Name in the catalogue.
    pub model: String,
    /// Where the crane lets go, site coordinates.
    pub drop: SitePose,
    /// Where the block comes to rest.
    pub rest: SitePose,
    /// Void it fills, m³.
    pub filled_m3: f64,
    /// Blocks and ground it touches.
    pub contacts: u32,
    /// Kept, or why not.
    pub state: PlacementState,
    /// How it gets there; the default: a new block, straight down.
    pub handling: HandlingRow,
}

impl HandlingRow {
    fn of(handling: &Handling, frame: &SiteFrame) -> Self {
        Self {
            node: handling.node,
            reset: handling.reset.map(|r| (r.block.0, SitePose::of(&r.from, frame))),
            path: handling.path.iter().map(|pose| SitePose::of(pose, frame)).collect(),
        }
    }

    /// In the local frame.
    pub fn local(&self, frame: &SiteFrame) -> Handling {
        let reset = |(block, from): (u32, SitePose)| Reset {
            block: InstanceId(block),
            from: from.local(frame),
        };
        Handling {
            path: self.path.iter().map(|pose| pose.local(frame)).collect(),
            reset: self.reset.map(reset),
            node: self.node,
        }
    }

    fn fields(&self) -> Vec<String> {
        let node = self.node.map_or(String::new(), |n| n.to_string());
        let (block, from) = match &self.reset {
            Some((block, from)) => (block.to_string(), from.fields()),
            None => (String::new(), vec![String::new(); 7]),
        };
        let path: Vec<String> = self.path.iter().map(|pose| pose.fields().join(" ")).collect();
        [vec![node, block], from, vec![path.join("; ")]].concat()
    }

    fn read(row: &Row, c: &[Option<usize>]) -> Result<Self, IoError> {
        let node = match row.text(c[0]) {
            "" => None,
            text => Some(node_of(text).ok_or_else(|| {
                row.bad(format!("`node` = `{text}` is not of the form `L1 R2 C3`"))
            })?),
        };
        let reset = match row.text(c[1]) {
            "" => None,
            _ => {
                let from = SitePose::read(row, &HANDLING[2..9], &c[2..9])?;
                Some((row.number("reset_block", c[1])?, from))
            }
        };
        let poses = row.text(c[9]).split(';').map(str::trim).filter(|text| !text.is_empty());
        let path = poses.map(|text| pose_of(row, text)).collect::<Result<_, _>>()?;
        Ok(Self { node, reset, path })
    }
}

/// `L1 R2 C3`.
fn node_of(text: &str) -> Option<PatternNode> {
    let mut words = text.split_whitespace();
    let layer = words.next()?.strip_prefix('L')?.parse().ok()?;
    let row = words.next()?.strip_prefix('R')?.parse().ok()?;
    let column = words.next()?.strip_prefix('C')?.parse().ok()?;
    words.next().is_none().then_some(PatternNode { layer, row, column })
}

/// `x y z qw qx qy qz`.
fn pose_of(row: &Row, text: &str) -> Result<SitePose, IoError> {
    let bad = || row.bad(format!("`path`: `{text}` is not a pose `x y z qw qx qy qz`"));
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(|word| word.parse().ok().filter(|v: &f64| v.is_finite()))
        .collect::<Option<_>>()
        .ok_or_else(bad)?;
    let [x, y, z, w, i, j, k] = numbers[..] else { return Err(bad()) };
    if ((w * w + i * i + j * j + k * k).sqrt() - 1.0).abs() > 1e-3 {
        return Err(bad());
    }
    Ok(SitePose { position_m: [x, y, z], rotation_wxyz: [w, i, j, k] })
}

impl PlacementRow {
    /// A planned block.
    pub fn of(p: &Placement, catalog: &Catalog, frame: &SiteFrame) -> Self {
        Self {
            order: p.order,
            round: p.round,
            model: catalog.get(p.model).name.clone(),
            drop: SitePose::of(&p.drop, frame),
            rest: SitePose::of(&p.rest, frame),
            filled_m3: p.filled_m3.to_string().parse().expect("a printed number is a number"),
            contacts: p.contacts,
            state: p.state,
            handling: HandlingRow::of(&p.handling, frame),
        }
    }

    fn fields(&self) -> Vec<String> {
        let mut fields = vec![self.order.to_string(), self.round.to_string(), self.model.clone()];
        fields.extend(self.drop.fields());
        fields.extend(self.rest.fields());
        fields.extend([
            self.filled_m3.to_string(),
            self.contacts.to_string(),
            self.state.word().to_string(),
        ]);
        fields
    }
}

/// The text of the file.
pub fn text(rows: &[PlacementRow]) -> String {
    if rows.iter().all(|row| row.handling == HandlingRow::default()) {
        return csv_table::text(&COLUMNS, rows.iter().map(PlacementRow::fields));
    }
    let header = [&COLUMNS[..], &HANDLING[..]].concat();
    csv_table::text(&header, rows.iter().map(|r| [r.fields(), r.handling.fields()].concat()))
}

/// Writes the file.
pub fn write(path: &Path, rows: &[PlacementRow]) -> Result<(), IoError> {
    atomic::write_bytes(path, text(rows).as_bytes())
}

/// Reads the file.
pub fn read(path: &Path) -> Result<Vec<PlacementRow>, IoError> {
    read_from(&mut Input::open(path)?)
}

/// The same from an opened file.
pub fn read_from(input: &mut Input) -> Result<Vec<PlacementRow>, IoError> {
    csv_table::read(input, &COLUMNS, &HANDLING, |row, c| {
        let word = row.text(c[19]);
        Ok(PlacementRow {
            order: row.number("order", c[0])?,
            round: row.number("round", c[1])?,
            model: row.text(c[2]).to_string(),
            drop: SitePose::read(row, &COLUMNS[3..10], &c[3..10])?,
            rest: SitePose::read(row, &COLUMNS[10..17], &c[10..17])?,
            filled_m3: row.finite("filled_m3", c[17])?,
            contacts: row.number("contacts", c[18])?,
            state: PlacementState::of_word(word)
                .ok_or_else(|| row.bad(format!("`state` = `{word}` is not known")))?,
            handling: HandlingRow::read(row, &c[20..])?,
        })
    })
}
