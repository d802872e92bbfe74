//! A grid of values in site coordinates, as GeoTIFF has it.

use geom::HeightMap;
use scene::{DesignSurface, SiteFrame};

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
    /// A map of local heights as heights in the site's datum.
    pub fn of_heights(map: &HeightMap, frame: &SiteFrame) -> Self {
        let up = frame.origin[2];
        let mut raster = Self::of_differences(map, frame);
        raster.value.iter_mut().for_each(|v| *v = (f64::from(*v) + up) as f32);
        raster
    }

    /// A map of deficits or distances: only its place changes.
    pub fn of_differences(map: &HeightMap, frame: &SiteFrame) -> Self {
        let [east, north, _] = frame.origin;
        // The f64 with the f32's own digits: a cell of 0.1 m is 0.1 m.
        let cell_m = map.cell_m.to_string().parse().expect("a printed number is a number");
        Self {
            origin: [east + f64::from(map.origin[0]), north + f64::from(map.origin[1])],
            cell_m,
            columns: map.nx,
            value: map.z_m.clone(),
        }
    }

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
