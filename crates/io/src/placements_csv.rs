//! `placements.csv`: one planned block a line, in placing order; removed ones too, with the reason in `state`.

use crate::csv_table::{self, SitePose};
use crate::input::Input;
use crate::{IoError, atomic};
use scene::{Catalog, Placement, PlacementState, SiteFrame};
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
    csv_table::text(&COLUMNS, rows.iter().map(PlacementRow::fields))
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
    csv_table::read(input, &COLUMNS, &[], |row, c| {
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
        })
    })
}
