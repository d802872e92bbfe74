//! How far the work on a plan is.

use super::plan::TilePlan;
use crate::Result;
use serde::Serialize;

/// Tiles by what became of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TileStatus {
    /// All tiles of the plan.
    pub tiles: usize,
    /// Names of those that are done.
    pub done: Vec<String>,
    /// Names of those that are not.
    pub missing: Vec<String>,
    /// What is wrong with the others, a line each.
    pub wrong: Vec<String>,
}

impl TilePlan {
    /// Looks at every tile. Nothing is worked on.
    pub fn status(&self) -> Result<TileStatus> {
        let mut status = TileStatus { tiles: self.tiles().len(), ..TileStatus::default() };
        for tile in self.tiles() {
            match self.done(&tile.key) {
                Ok(Some(_)) => status.done.push(tile.key.clone()),
                Ok(None) => status.missing.push(tile.key.clone()),
                Err(error) => status.wrong.push(error.line()),
            }
        }
        Ok(status)
    }
}
