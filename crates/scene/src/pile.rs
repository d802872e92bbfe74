//! A pile as physics, ground truth and recognition all speak of it.

use crate::{Catalog, InstanceId, ModelId, PosedModel};
use geom::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// A block with a known pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlacedBlock {
    /// Number of the block.
    pub block: InstanceId,
    /// Type.
    pub model: ModelId,
    /// Block to local frame.
    pub site_from_block: Pose,
}

impl PlacedBlock {
    /// With its type's model.
    pub fn posed<'a>(&self, catalog: &'a Catalog) -> PosedModel<'a> {
        PosedModel::new(catalog.get(self.model), self.site_from_block)
    }
}

/// What the blocks lie on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Ground {
    /// A horizontal plane at this height, metres.
    Level {
        /// Height, metres.
        z_m: f32,
    },
    /// A plane through a point with an upward unit normal.
    Plane {
        /// A point of it.
        point: Vec3,
        /// Unit normal, z > 0.
        normal: Vec3,
    },
    /// A height grid: `z_m[iy * nx + ix]` at `(x0 + ix * cell, y0 + iy * cell)`.
    Grid {
        /// Position of the first node.
        origin: [f32; 2],
        /// Spacing, metres.
        cell_m: f32,
        /// Nodes along x; the rest follows from the length of `z_m`.
        nx: usize,
        /// Heights, metres, all finite.
        z_m: Vec<f32>,
    },
}

impl Ground {
    /// Height below (x, y), metres; a grid continues its border values outside.
    pub fn height_m(&self, x: f32, y: f32) -> f32 {
        match self {
            Self::Level { z_m } => *z_m,
            Self::Plane { point, normal } => {
                point.z - (normal.x * (x - point.x) + normal.y * (y - point.y)) / normal.z
            }
            Self::Grid { origin, cell_m, nx, z_m } => {
                let ny = z_m.len() / nx;
                let node = |v: f32, n: usize| {
                    let v = v.clamp(0.0, (n - 1) as f32);
                    let i = (v as usize).min(n.saturating_sub(2));
                    (i, v - i as f32)
                };
                let (ix, fx) = node((x - origin[0]) / cell_m, *nx);
                let (iy, fy) = node((y - origin[1]) / cell_m, ny);
                let at = |i: usize, j: usize| z_m[j.min(ny - 1) * nx + i.min(nx - 1)];
                let low = at(ix, iy) * (1.0 - fx) + at(ix + 1, iy) * fx;
                let high = at(ix, iy + 1) * (1.0 - fx) + at(ix + 1, iy + 1) * fx;
                low * (1.0 - fy) + high * fy
            }
        }
    }
}

/// Blocks on a ground.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Scene {
    /// Blocks.
    pub blocks: Vec<PlacedBlock>,
    /// What they lie on.
    pub ground: Ground,
}
