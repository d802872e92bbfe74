//! A grid of values in site coordinates, as GeoTIFF has it.

use scene::DesignSurface;

/// Values at the middles of square cells; NaN where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// East and north of the middle of the first cell (south-west), metres.
    pub origin: [f64; 2],
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Cells along east; the rest follows from the number of values.
    pub columns: usize,
    /// Row by row northwards.
    pub value: Vec<f32>,
}

impl Raster {
    /// Cells along north.
    pub fn rows(&self) -> usize {
        self.value.len().checked_div(self.columns).unwrap_or(0)
    }

    /// As a design surface whose nodes are the cells' middles.
    pub fn design(&self) -> DesignSurface {
        DesignSurface::Grid {
            origin: self.origin,
            cell_m: self.cell_m,
            columns: self.columns,
            level_m: self.value.iter().copied().map(f64::from).collect(),
        }
    }
}
