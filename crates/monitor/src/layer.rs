//! Concrete, porosity two ways and packing of the layer that was built.
//!
//! In: the new blocks, the earlier epoch and the later survey's points, all in the earlier frame. Out: volumes between surfaces over
//! the place where new blocks rise above the old surface. *Measured*: both surfaces as the surveys show them; they bridge the gaps
//! no sensor looks into, so that the layer seems thinner than it is. *Of the poses*: the old surface is made of the blocks that were
//! recognised, with what lies between and below them from the points that no block explains; the new blocks stand on it as posed.

use crate::Epoch;
use crate::body::Body;
use geom::{DVec3, HeightMap, Vec3};
use scene::Catalog;

/// Cell of the grids that volumes are measured on, in block lengths.
const CELL: f32 = 0.08;

/// What is said of the new blocks together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Figures {
    pub concrete_m3: f64,
    pub area_m2: f64,
    pub porosity_measured: Option<f64>,
    pub porosity_of_poses: Option<f64>,
    pub packing: Option<f64>,
}

/// Of the new blocks; `later_points` are registered.
pub(crate) fn figures(
    new: &[Body],
    earlier: &Epoch,
    later_points: &[Vec3],
    catalog: &Catalog,
) -> Figures {
    let volume = |b: &Body| f64::from(catalog.get(b.model).volume_m3);
    // Adding to 0 keeps an empty sum from being −0.
    let concrete_m3: f64 = 0.0 + new.iter().map(volume).sum::<f64>();
    let mut out = Figures { concrete_m3, ..Figures::default() };
    if new.is_empty() {
        return out;
    }
    let size_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    let bounds = earlier.survey.cloud.bounds().grown(size_m);
    let empty = || HeightMap::empty(bounds.min.truncate(), bounds.max.truncate(), CELL * size_m);
    let (mut before, mut after) = (empty(), empty());
    before.raise_points(&earlier.survey.cloud.position_m);
    after.raise_points(later_points);
    before.fill_empty();
    after.fill_empty();
    let old = old_surface(earlier, catalog, empty()).unwrap_or_else(|| before.clone());
    let mut posed = old.clone();
    for body in new {
        let model = catalog.get(body.model);
        posed.raise(&model.mesh, &body.pose(model));
    }
    let cell = f64::from(before.cell_m).powi(2);
    let (mut measured, mut of_poses, mut area) = (0.0, 0.0, 0.0);
    for i in 0..old.z_m.len() {
        // Where a new block covers the old surface.
        let (rise, seen) = (posed.z_m[i] - old.z_m[i], after.z_m[i] - before.z_m[i]);
        if rise > 0.0 && seen.is_finite() {
            area += cell;
            of_poses += cell * f64::from(rise);
            measured += cell * f64::from(seen);
        }
    }
    let porosity = |volume: f64| (volume > 0.0).then(|| 1.0 - concrete_m3 / volume);
    let dn2 = new.iter().map(|b| volume(b).powf(2.0 / 3.0)).sum::<f64>() / new.len() as f64;
    out.area_m2 = area;
    out.porosity_measured = porosity(measured);
    out.porosity_of_poses = porosity(of_poses);
    out.packing = (area > 0.0).then(|| new.len() as f64 * dn2 / area);
    out
}

/// The recognised blocks over what no block explains; `None` where the blocks do not say which points they explain, or explain all.
fn old_surface(earlier: &Epoch, catalog: &Catalog, mut map: HeightMap) -> Option<HeightMap> {
    let cloud = &earlier.survey.cloud.position_m;
    let mut open = vec![true; cloud.len()];
    for &i in earlier.blocks.iter().flat_map(|b| &b.points) {
        if let Some(open) = open.get_mut(i as usize) {
            *open = false;
        }
    }
    if earlier.blocks.iter().all(|b| b.points.is_empty()) || !open.contains(&true) {
        return None;
    }
    // The middle of a cell's points: bridges between blocks and stray soundings stand above it.
    let mut of_cell: Vec<(usize, f32)> = cloud
        .iter()
        .zip(open)
        .filter(|(_, open)| *open)
        .filter_map(|(p, _)| map.cell_of(p.x, p.y).map(|(x, y)| (y * map.nx + x, p.z)))
        .collect();
    of_cell.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for cell in of_cell.chunk_by(|a, b| a.0 == b.0) {
        map.z_m[cell[0].0] = cell[cell.len() / 2].1;
    }
    map.fill_empty();
    for body in Body::all(earlier, catalog, DVec3::ZERO) {
        let model = catalog.get(body.model);
        map.raise(&model.mesh, &body.pose(model));
    }
    Some(map)
}
