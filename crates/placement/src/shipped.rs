//! The weights inside the program: no download, no path. Their card lies beside them in `weights/`.

use crate::{PlacementError, PlacementModel};

/// Tetrapods on tetrapods.
const TETRAPOD: &[u8] = include_bytes!("../weights/tetrapod.safetensors");

impl PlacementModel {
    /// The shipped weights; blocks of another shape they do not know ([`PlacementModel::knows`]).
    pub fn shipped() -> Result<Self, PlacementError> {
        Self::from_bytes(TETRAPOD)
    }
}
