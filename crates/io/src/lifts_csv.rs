//! `lifts.csv`: the plan as the crane works it off, one lift a line.

use crate::{IoError, atomic, csv_table};
use scene::PatternNode;
use std::path::Path;

/// Columns.
pub const COLUMNS: [&str; 15] = [
    "order",
    "day",
    "start",
    "model",
    "mass_t",
    "x_m",
    "y_m",
    "rest_level_m",
    "drop_level_m",
    "stand",
    "radius_m",
    "up",
    "tilt_deg",
    "bearing_deg",
    "second_bearing_deg",
];

/// Columns of plans that are more than new blocks straight down.
pub const HANDLING: [&str; 3] = ["node", "reset_block", "segments"];

/// One lift. Levels are of the centre of mass, in the site's datum.
#[derive(Clone, Debug, PartialEq)]
pub struct LiftRow {
    /// Place in the order of the plan.
    pub order: u32,
    /// Day, from 1, and hour of its start.
    pub start: Option<(u32, f32)>,
    /// Name in the catalogue.
    pub model: String,
    /// Mass, t.
    pub mass_t: f64,
    /// East, north and level at rest.
    pub rest_m: [f64; 3],
    /// Level at which the crane lets go.
    pub drop_level_m: f64,
    /// The crane's stand, from 1, and the distance from it.
    pub stand: Option<(u32, f32)>,
    /// Whether the block is told by its legs or by its axes.
    pub legs: bool,
    /// Highest leg from the vertical, where it leans to, where the second points; degrees, clockwise from north.
    pub attitude_deg: [f32; 3],
    /// Node of the pattern.
    pub node: Option<PatternNode>,
    /// The recognised block that is lifted.
    pub reset_block: Option<u32>,
    /// Ways it is carried after it was lowered: metres sideways, degrees clockwise from north, degrees turned, level at their end.
    pub segments: Vec<[f64; 4]>,
}

impl LiftRow {
    fn fields(&self) -> Vec<String> {
        let (day, start) = self.start.map_or(Default::default(), |(day, hour)| {
            let minutes = (hour * 60.0).round() as u32;
            (day.to_string(), format!("{:02}:{:02}", minutes / 60, minutes % 60))
        });
        let (stand, radius) = self
            .stand
            .map_or(Default::default(), |(n, radius_m)| (n.to_string(), format!("{radius_m:.2}")));
        let [x, y, z] = self.rest_m.map(|v| format!("{v:.3}"));
        let [tilt, bearing, second] = self.attitude_deg.map(|v| format!("{v:.0}"));
        let up = if self.legs { "leg" } else { "axis" }.to_string();
        vec![
            self.order.to_string(),
            day,
            start,
            self.model.clone(),
            format!("{:.3}", self.mass_t),
            x,
            y,
            z,
            format!("{:.3}", self.drop_level_m),
            stand,
            radius,
            up,
            tilt,
            bearing,
            second,
        ]
    }
}

impl LiftRow {
    fn is_plain(&self) -> bool {
        self.node.is_none() && self.reset_block.is_none() && self.segments.is_empty()
    }

    fn handling(&self) -> Vec<String> {
        let segment = |[away_m, bearing, turn, level_m]: &[f64; 4]| {
            format!("{away_m:.2} m to {bearing:.0}°, turn {turn:.0}°, to level {level_m:.3}")
        };
        let segments: Vec<String> = self.segments.iter().map(segment).collect();
        vec![
            self.node.map_or(String::new(), |n| n.to_string()),
            self.reset_block.map_or(String::new(), |n| n.to_string()),
            segments.join("; "),
        ]
    }
}

/// Writes the file.
pub fn write(path: &Path, rows: &[LiftRow]) -> Result<(), IoError> {
    let text = if rows.iter().all(LiftRow::is_plain) {
        csv_table::text(&COLUMNS, rows.iter().map(LiftRow::fields))
    } else {
        let header = [&COLUMNS[..], &HANDLING[..]].concat();
        csv_table::text(&header, rows.iter().map(|r| [r.fields(), r.handling()].concat()))
    };
    atomic::write_bytes(path, text.as_bytes())
}
