//! A block in one attitude as the height map sees it: its underside and its top, cell by cell.
//!
//! Lowered straight down, a block stops where its underside first meets the surface:
//! z = max over its cells of (surface − underside). That is exact on the raster and takes a fraction of a microsecond.

use geom::{HeightMap, Pose, Quat, Vec2, Vec3};
use scene::BlockModel;

/// Underside and top over a square of cells about the centre of mass, heights relative to it.
#[derive(Clone, Debug)]
pub(crate) struct Silhouette {
    pub rotation: Quat,
    /// The square has 2·half + 1 cells a side.
    pub half: usize,
    /// Each row's covered range of columns, half-open.
    pub rows: Vec<(usize, usize)>,
    /// Underside; +∞ where the block has no part.
    pub under: Vec<f32>,
    /// Top; −∞ where the block has no part.
    pub top: Vec<f32>,
}

impl Silhouette {
    /// Rasterises the model, turned about its centre of mass, which lies over the centre of the middle cell.
    pub fn new(model: &BlockModel, rotation: Quat, cell_m: f32) -> Self {
        let half = (model.d_max_m / cell_m).ceil() as usize;
        let edge = (half as f32 + 0.5) * cell_m;
        let square = HeightMap::empty(Vec2::splat(-edge), Vec2::splat(edge), cell_m);
        let (top, under) =
            square.top_and_underside(&model.mesh, &pose_at(model, rotation, Vec3::ZERO));
        let side = 2 * half + 1;
        let rows = (0..side)
            .map(|iy| {
                let covered = |ix: &usize| !under.at(*ix, iy).is_nan();
                let first = (0..side).find(covered).unwrap_or(0);
                let end = (0..side).rev().find(covered).map_or(0, |last| last + 1);
                (first, end)
            })
            .collect();
        let fill = |map: HeightMap, z: f32| {
            map.z_m.iter().map(|&v| if v.is_nan() { z } else { v }).collect()
        };
        Self {
            rotation,
            half,
            rows,
            under: fill(under, f32::INFINITY),
            top: fill(top, f32::NEG_INFINITY),
        }
    }

    /// Cells along an edge of the square.
    pub fn side(&self) -> usize {
        2 * self.half + 1
    }
}

/// The pose that puts the model's centre of mass at `centre` in the attitude `rotation`.
pub(crate) fn pose_at(model: &BlockModel, rotation: Quat, centre: Vec3) -> Pose {
    Pose::from_parts(centre - rotation * model.centre, rotation)
}

/// Height at which the centre of mass stops when the block is lowered at (x, y) onto the surface; `None` off the map.
pub(crate) fn lowered_height_m(
    surface: &HeightMap,
    model: &BlockModel,
    rotation: Quat,
    x: f32,
    y: f32,
) -> Option<f32> {
    let rect = surface.rect_around(x, y, model.d_max_m + surface.cell_m);
    if rect.area() == 0 {
        return None;
    }
    let first = surface.centre(rect.x0, rect.y0);
    let (nx, ny) = (rect.x1 - rect.x0, rect.y1 - rect.y0);
    let mut under = HeightMap {
        origin: [first.x, first.y],
        cell_m: surface.cell_m,
        nx,
        ny,
        z_m: vec![f32::NAN; nx * ny],
    };
    under.lower(&model.mesh, &pose_at(model, rotation, Vec3::new(x, y, 0.0)));
    let mut height = f32::NEG_INFINITY;
    for iy in 0..ny {
        for ix in 0..nx {
            let gap = surface.at(rect.x0 + ix, rect.y0 + iy) - under.at(ix, iy);
            if gap > height {
                height = gap;
            }
        }
    }
    height.is_finite().then_some(height)
}
