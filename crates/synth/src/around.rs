//! What stands around a pile and is measured with it, all label 0: sand over the lowest layer, a crown wall, a deck.
//!
//! Placed after the blocks have come to rest: sand drifts in, a deck is built over them. A crown wall stands behind the pile
//! on the upper side, where the physics has a wall of the site. Lengths in lengths of the largest block.

use crate::SynthError;
use crate::recipe::{Bed, Resolved};
use crate::sensor::within;
use geom::{TriMesh, Vec3};
use scene::Ground;
use serde::{Deserialize, Serialize};

/// Surfaces beside bed and blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Around {
    /// Depth of sand over the bed; 0: none.
    pub sand_blocks: f32,
    /// The sand is level and has this depth at the low side of the site: a wedge at the toe of a slope.
    pub sand_wedge: bool,
    /// Height of a crown wall above the bed behind the pile; 0: none.
    pub wall_blocks: f32,
    /// Width of a deck across the middle of the pile, half a block above its top; 0: none.
    pub deck_blocks: f32,
}

/// Cell of the sand's surface, in lengths of the largest block.
const CELL: f32 = 0.12;

impl Around {
    pub(crate) fn check(&self) -> Result<(), SynthError> {
        let why = "0 to 20 block lengths";
        within("around.sand_blocks", self.sand_blocks, [0.0, 20.0], why)?;
        within("around.wall_blocks", self.wall_blocks, [0.0, 20.0], why)?;
        within("around.deck_blocks", self.deck_blocks, [0.0, 20.0], why)
    }

    /// Adds the surfaces to `mesh`; `top_m` is the highest point of the blocks.
    pub(crate) fn add(
        &self,
        mesh: &mut TriMesh,
        ground: &Ground,
        bed: &Bed,
        resolved: &Resolved,
        top_m: f32,
    ) {
        if self.sand_blocks > 0.0 {
            mesh.append(&self.sand(ground, bed, resolved));
        }
        let [x, y] = resolved.size_m.map(|s| s / 2.0);
        let length = resolved.largest_m;
        if self.wall_blocks > 0.0 {
            // The side the bed rises to.
            let (sin, cos) = bed.falls_towards_deg.to_radians().sin_cos();
            let thick = 0.5 * length;
            let span = |side: f32, half: f32| {
                let (near, far) = (-side.signum() * half, -side.signum() * (half + thick));
                (near.min(far), near.max(far))
            };
            let (low, high) = if cos.abs() > sin.abs() {
                let (a, b) = span(cos, x);
                (Vec3::new(a, -y, 0.0), Vec3::new(b, y, 0.0))
            } else {
                let (a, b) = span(sin, y);
                (Vec3::new(-x, a, 0.0), Vec3::new(x, b, 0.0))
            };
            let foot = ground.height_m((low.x + high.x) / 2.0, (low.y + high.y) / 2.0);
            let low = low.with_z(foot - length);
            mesh.append(&cuboid(low, high.with_z(foot + self.wall_blocks * length)));
        }
        if self.deck_blocks > 0.0 {
            let half = 0.5 * self.deck_blocks * length;
            let under = top_m + 0.5 * length;
            let low = Vec3::new(-x, -half.min(y), under);
            mesh.append(&cuboid(low, Vec3::new(x, half.min(y), under + 0.15 * length)));
        }
    }

    fn sand(&self, ground: &Ground, bed: &Bed, resolved: &Resolved) -> TriMesh {
        let [x, y] = resolved.size_m.map(|s| s / 2.0);
        let depth = self.sand_blocks * resolved.largest_m;
        let (sin, cos) = bed.falls_towards_deg.to_radians().sin_cos();
        let plane = |px: f32, py: f32| bed.plane_m(px, py, resolved.largest_m);
        let lowest = plane(x * cos, y * sin);
        let level = |px: f32, py: f32| {
            // Ripples of a hundredth of a block.
            let ripple = 0.01 * resolved.largest_m * (3.0 * px / resolved.largest_m).sin();
            let base = if self.sand_wedge { lowest } else { plane(px, py) };
            // Below the bed there is no sand: the surface dives under it and is hidden.
            (base + depth + ripple).max(ground.height_m(px, py) - 0.3 * resolved.largest_m)
        };
        let cell = CELL * resolved.largest_m;
        let [nx, ny] = resolved.size_m.map(|s| (s / cell).ceil() as usize + 1);
        let at = |i: usize, n: usize, half: f32| (2.0 * i as f32 / (n - 1) as f32 - 1.0) * half;
        let mut mesh = TriMesh::default();
        for k in 0..nx * ny {
            let (px, py) = (at(k % nx, nx, x), at(k / nx, ny, y));
            mesh.vertices.push(Vec3::new(px, py, level(px, py)));
        }
        for j in 0..ny as u32 - 1 {
            for i in 0..nx as u32 - 1 {
                let a = j * nx as u32 + i;
                let b = a + nx as u32;
                mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
            }
        }
        mesh
    }
}

/// A box between two corners, facing outwards.
fn cuboid(low: Vec3, high: Vec3) -> TriMesh {
    let vertices = (0..8)
        .map(|i| {
            let pick = |bit: usize, a: f32, b: f32| if i >> bit & 1 == 0 { a } else { b };
            Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
        })
        .collect();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    TriMesh { vertices, triangles }
}
