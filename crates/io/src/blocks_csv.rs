//! `blocks.csv` and `truth.csv`: one block a line, pose from the mesh file's coordinates (metres) to site coordinates.

use crate::csv_table::{self, Row, SitePose};
use crate::input::Input;
use crate::{IoError, Place, atomic};
use scene::{Catalog, Fit, InstanceId, Legs, PlacedBlock, SiteFrame};
use std::path::Path;

/// Columns of `blocks.csv`; `truth.csv` has the first ten.
pub const COLUMNS: [&str; 18] = [
    "block_id",
    "model",
    "x_m",
    "y_m",
    "z_m",
    "qw",
    "qx",
    "qy",
    "qz",
    "occlusion",
    "confidence",
    "fitness_m",
    "runner_up",
    "runner_up_fitness_m",
    "type_judged",
    "legs_seen",
    "legs_hidden",
    "legs_missing",
];
/// How many of them `truth.csv` has.
pub const TRUTH_COLUMNS: usize = 10;
const NEEDED: usize = 9;

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockRow {
    /// Number of the block, from 1.
    pub block_id: u32,
    /// Name in the catalogue.
    pub model: String,
    /// Pose in site coordinates.
    pub pose: SitePose,
    /// 1 − visible model points / all model points.
    pub occlusion: Option<f64>,
    /// Probability that what is stated is right: the pose, and the type where that is judged.
    pub confidence: Option<f64>,
    /// Mean nearest distance scene → model, metres.
    pub fitness_m: Option<f64>,
    /// Second-best type.
    pub runner_up: Option<String>,
    /// Its fitness, metres.
    pub runner_up_fitness_m: Option<f64>,
    /// Whether the type is judged, or only the likeliest.
    pub type_judged: Option<bool>,
    /// What was seen of its legs; `None` for compact blocks, and in files of earlier versions.
    pub legs: Option<Legs>,
}

impl BlockRow {
    /// What is stated or guessed of a block.
    pub fn of_fit(block: InstanceId, fit: &Fit, catalog: &Catalog, frame: &SiteFrame) -> Self {
        Self {
            block_id: block.0,
            model: catalog.get(fit.model).name.clone(),
            pose: SitePose::of(&fit.site_from_block, frame),
            occlusion: fit.occlusion.map(short),
            confidence: fit.confidence.map(short),
            fitness_m: fit.fitness_m.map(short),
            runner_up: fit.runner_up.map(|(m, _)| catalog.get(m).name.clone()),
            runner_up_fitness_m: fit.runner_up.map(|(_, f)| short(f)),
            type_judged: Some(fit.type_judged),
            legs: fit.legs,
        }
    }

    /// A block of known pose.
    pub fn of_truth(
        block: &PlacedBlock,
        occlusion: f32,
        catalog: &Catalog,
        frame: &SiteFrame,
    ) -> Self {
        Self {
            block_id: block.block.0,
            model: catalog.get(block.model).name.clone(),
            pose: SitePose::of(&block.site_from_block, frame),
            occlusion: Some(short(occlusion)),
            confidence: None,
            fitness_m: None,
            runner_up: None,
            runner_up_fitness_m: None,
            type_judged: None,
            legs: None,
        }
    }

    /// From the columns of [`COLUMNS`].
    pub(crate) fn read(row: &Row, c: &[Option<usize>]) -> Result<Self, IoError> {
        let model = row.text(c[1]).to_string();
        if model.is_empty() {
            return Err(row.bad("`model` is empty".into()));
        }
        let runner_up = row.text(c[12]);
        let type_judged = match row.text(c[14]) {
            "" => None,
            "yes" => Some(true),
            "no" => Some(false),
            other => {
                return Err(row.bad(format!("`type_judged` = `{other}` is neither yes nor no")));
            }
        };
        Ok(Self {
            block_id: row.number("block_id", c[0])?,
            model,
            pose: SitePose::read(row, &COLUMNS[2..9], &c[2..9])?,
            occlusion: row.finite_or_empty("occlusion", c[9])?,
            confidence: row.finite_or_empty("confidence", c[10])?,
            fitness_m: row.finite_or_empty("fitness_m", c[11])?,
            runner_up: (!runner_up.is_empty()).then(|| runner_up.to_string()),
            runner_up_fitness_m: row.finite_or_empty("runner_up_fitness_m", c[13])?,
            type_judged,
            legs: legs(row, &c[15..18])?,
        })
    }

    pub(crate) fn fields(&self) -> Vec<String> {
        let number = |v: Option<f64>| v.map(|v| v.to_string()).unwrap_or_default();
        let mut fields = vec![self.block_id.to_string(), self.model.clone()];
        fields.extend(self.pose.fields());
        fields.extend([
            number(self.occlusion),
            number(self.confidence),
            number(self.fitness_m),
            self.runner_up.clone().unwrap_or_default(),
            number(self.runner_up_fitness_m),
            self.type_judged
                .map_or(String::new(), |judged| if judged { "yes" } else { "no" }.into()),
        ]);
        let legs = self.legs.map(|l| [l.seen, l.hidden, l.missing]);
        let legs = (0..3).map(|i| legs.map_or(String::new(), |l| l[i].to_string()));
        fields.extend(legs);
        fields
    }
}

/// What was seen of the legs; nothing where the three cells are empty or the columns are not there.
fn legs(row: &Row, columns: &[Option<usize>]) -> Result<Option<Legs>, IoError> {
    if columns.iter().all(|c| row.text(*c).is_empty()) {
        return Ok(None);
    }
    let number = |i: usize| row.number(COLUMNS[15 + i], columns[i]);
    Ok(Some(Legs { seen: number(0)?, hidden: number(1)?, missing: number(2)? }))
}

/// The f64 with the f32's own shortest digits: 0.1 stays 0.1.
fn short(v: f32) -> f64 {
    v.to_string().parse().expect("a printed number is a number")
}

/// Text of `blocks.csv`.
pub fn blocks_text(rows: &[BlockRow]) -> String {
    csv_table::text(&COLUMNS, rows.iter().map(BlockRow::fields))
}

/// Text of `truth.csv`.
pub fn truth_text(rows: &[BlockRow]) -> String {
    let cut = |row: &BlockRow| row.fields().into_iter().take(TRUTH_COLUMNS).collect();
    csv_table::text(&COLUMNS[..TRUTH_COLUMNS], rows.iter().map(cut))
}

/// Writes `blocks.csv`.
pub fn write_blocks(path: &Path, rows: &[BlockRow]) -> Result<(), IoError> {
    atomic::write_bytes(path, blocks_text(rows).as_bytes())
}

/// Writes `truth.csv`.
pub fn write_truth(path: &Path, rows: &[BlockRow]) -> Result<(), IoError> {
    atomic::write_bytes(path, truth_text(rows).as_bytes())
}

/// Reads either file; the columns from `occlusion` on may be missing or empty.
pub fn read(path: &Path) -> Result<Vec<BlockRow>, IoError> {
    read_from(&mut Input::open(path)?)
}

/// The same from an opened file.
pub fn read_from(input: &mut Input) -> Result<Vec<BlockRow>, IoError> {
    let rows = csv_table::read(input, &COLUMNS[..NEEDED], &COLUMNS[NEEDED..], BlockRow::read)?;
    check_numbers(input, rows.iter().map(|r| r.block_id))?;
    Ok(rows)
}

/// Every number stands once.
pub(crate) fn check_numbers(
    input: &Input,
    numbers: impl Iterator<Item = u32>,
) -> Result<(), IoError> {
    let mut ids: Vec<u32> = numbers.collect();
    ids.sort_unstable();
    match ids.windows(2).find(|p| p[0] == p[1]) {
        Some(pair) => {
            Err(input.malformed(Place::File, format!("block_id {} appears twice", pair[0])))
        }
        None => Ok(()),
    }
}
