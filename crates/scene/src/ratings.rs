//! What people who build think of planned blocks: the content of `ratings.json`.

use serde::{Deserialize, Serialize};

/// The signs by which policy `search` ranks where a block may come to rest, in the order of every list of them. All are
/// without unit, and all speak against a place the larger they are.
pub const SIGNS: [&str; 6] = ["above", "raised", "protruding", "loose", "wedged", "far"];

/// The whole file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ratings {
    /// Version of the format, 1.
    pub format: u32,
    /// Name of the site whose plan was rated.
    pub site: String,
    /// Ratings of planned blocks.
    #[serde(default)]
    pub blocks: Vec<RatedBlock>,
    /// Choices between two places for a block.
    #[serde(default)]
    pub pairs: Vec<RatedPair>,
}

/// What somebody thinks of a planned block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BlockRating {
    /// It may be built like that.
    Good,
    /// It will not stay.
    Loose,
    /// It stands out of the layer.
    SticksOut,
    /// The next block has no place beside it.
    BlocksTheNext,
    /// It cannot be set there.
    CannotBeReached,
}

impl BlockRating {
    /// Whether it speaks for the block.
    pub fn is_good(self) -> bool {
        self == Self::Good
    }
}

/// A place for a block: its type, where its mesh's origin comes to rest, and the signs of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RatedPlace {
    /// Type, by its name in the catalogue.
    pub model: String,
    /// Pose at rest as in `placements.csv`, site coordinates.
    pub x_m: f64,
    /// See `x_m`.
    pub y_m: f64,
    /// See `x_m`.
    pub z_m: f64,
    /// In the order of [`SIGNS`].
    pub signs: [f64; SIGNS.len()],
}

/// One rating.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RatedBlock {
    /// Who says so.
    pub by: String,
    /// When, `YYYY-MM-DD` or with a time after it.
    pub when: String,
    /// Its place in the order of the plan that was rated.
    pub order: u32,
    /// What they say.
    pub rating: BlockRating,
    /// Where it is.
    pub place: RatedPlace,
}

/// Which of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// The first.
    A,
    /// The second.
    B,
}

/// A choice between two places of one window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RatedPair {
    /// Who chose.
    pub by: String,
    /// When.
    pub when: String,
    /// Number of the pair in the plan that was rated.
    pub pair: u32,
    /// Which they would build.
    pub better: Better,
    /// The first.
    pub a: RatedPlace,
    /// The second.
    pub b: RatedPlace,
}
