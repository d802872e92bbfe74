//! The surfaces of a site as rasters: as surveyed, as designed, as planned; and cuts through them.

use geom::{HeightMap, Vec2};
use pipeline::Works;
use scene::{Plan, Scene};

/// Cells along the longer side of the works, at most.
const MOST_CELLS: f32 = 600.0;

/// Rasters of one extent, local heights in metres; NaN where there is nothing.
pub struct Surfaces {
    /// Bed and recognised blocks.
    pub as_is: HeightMap,
    /// The same with the planned blocks.
    pub planned: HeightMap,
    /// The bed alone.
    pub ground: HeightMap,
    /// The design surface.
    pub design: HeightMap,
}

impl Surfaces {
    /// Rasters over the works and a block's width around them.
    pub fn of(works: &Works, pile: &Scene, plan: &Plan) -> Self {
        let frame = &works.survey.frame;
        let [low, high] = works.design.extent();
        let local = |p: [f64; 2]| Vec2::new((p[0] - frame.origin[0]) as f32, (p[1] - frame.origin[1]) as f32);
        let margin_m = 2.0 * works.catalog.d_max_m();
        let (min, max) = (local(low) - margin_m, local(high) + margin_m);
        let cell_m = (0.05 * works.catalog.d_max_m()).max((max - min).max_element() / MOST_CELLS);
        let empty = HeightMap::empty(min, max, cell_m);

        let mut ground = empty.clone();
        ground.fill_with(|x, y| pile.ground.height_m(x, y));
        let mut as_is = ground.clone();
        for block in &pile.blocks {
            as_is.raise(&works.catalog.get(block.model).mesh, &block.site_from_block);
        }
        let mut planned = as_is.clone();
        for placement in &plan.placements {
            planned.raise(&works.catalog.get(placement.model).mesh, &placement.rest);
        }
        let mut design = empty;
        design.fill_with(|x, y| {
            let (east, north) = (f64::from(x) + frame.origin[0], f64::from(y) + frame.origin[1]);
            works.design.level_at(east, north).map_or(f32::NAN, |level| (level - frame.origin[2]) as f32)
        });
        Self { as_is, planned, ground, design }
    }

    /// Design minus a surface, cell by cell: positive where material is missing.
    pub fn deficit(&self, surface: &HeightMap) -> HeightMap {
        let mut deficit = self.design.clone();
        for (d, z) in deficit.z_m.iter_mut().zip(&surface.z_m) {
            *d -= z;
        }
        deficit
    }

    /// Finite values of a raster.
    pub fn known(map: &HeightMap) -> Vec<f32> {
        map.z_m.iter().copied().filter(|v| v.is_finite()).collect()
    }

    /// A surface along a straight line: (offset, height), one point a cell, heights shifted by `datum_m`.
    pub fn cut(map: &HeightMap, from: Vec2, to: Vec2, datum_m: f64) -> Vec<[f32; 2]> {
        let length_m = from.distance(to);
        let steps = (length_m / map.cell_m).ceil().max(1.0) as usize;
        (0..=steps)
            .map(|i| {
                let along = i as f32 / steps as f32;
                let at = from.lerp(to, along);
                let z = map.cell_of(at.x, at.y).map_or(f32::NAN, |(ix, iy)| map.at(ix, iy));
                [along * length_m, (f64::from(z) + datum_m) as f32]
            })
            .collect()
    }
}
