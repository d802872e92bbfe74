//! The bin as the camera sees it: a floor, four walls and their rim, all label 0.
//!
//! In: the recipe's `[bin]` and the plan of the site. Out: a mesh around the site. The walls stand where the physics has
//! its own, so parts lean against what is seen. Without the table neither floor nor walls are measured.

use crate::SynthError;
use crate::recipe::Resolved;
use geom::{TriMesh, Vec3};
use serde::{Deserialize, Serialize};

/// A bin that is measured with its parts; lengths in lengths of the largest part, so that one recipe fits any part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bin {
    /// Whether the sensor sees floor and walls at all.
    pub measured: bool,
    /// Height of the walls above the floor.
    pub wall_blocks: f32,
    /// Thickness of the walls, which is the width of the rim.
    pub thickness_blocks: f32,
}

impl Default for Bin {
    fn default() -> Self {
        Self { measured: false, wall_blocks: 1.0, thickness_blocks: 0.05 }
    }
}

impl Bin {
    pub(crate) fn check(&self) -> Result<(), SynthError> {
        let within = |key, value: f32, low: f32, high: f32, why| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(SynthError::BadValue { key, value: value.into(), why })
            }
        };
        within("bin.wall_blocks", self.wall_blocks, 0.01, 20.0, "0.01 to 20 part lengths")?;
        within("bin.thickness_blocks", self.thickness_blocks, 0.001, 2.0, "0.001 to 2 part lengths")
    }

    /// Floor, insides, rim and outsides, facing what can see them.
    pub(crate) fn mesh(&self, resolved: &Resolved) -> TriMesh {
        let [x, y] = resolved.size_m.map(|s| s / 2.0);
        let (top, rim) =
            (self.wall_blocks * resolved.largest_m, self.thickness_blocks * resolved.largest_m);
        let ring = |grow: f32, z: f32| {
            let (x, y) = (x + grow, y + grow);
            [Vec3::new(-x, -y, z), Vec3::new(x, -y, z), Vec3::new(x, y, z), Vec3::new(-x, y, z)]
        };
        // From the middle of the floor outwards: floor's edge, inner rim, outer rim, outer foot.
        let vertices = [ring(0.0, 0.0), ring(0.0, top), ring(rim, top), ring(rim, 0.0)].concat();
        let mut triangles = vec![[0, 1, 2], [0, 2, 3]];
        for band in 0..3_u32 {
            for side in 0..4_u32 {
                let (a, b) = (4 * band + side, 4 * band + (side + 1) % 4);
                let (c, d) = (a + 4, b + 4);
                triangles.extend([[a, d, b], [a, c, d]]);
            }
        }
        TriMesh { vertices, triangles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Recipe;
    use scene::{Catalog, Shape};

    #[test]
    fn a_bin_faces_those_who_look_into_it() {
        let cube = blocks::shape_model("c", Shape::Cube { size: 0.1 }, 7800.0).unwrap();
        let text = "name = \"t\"\ndensity_per_m2 = 1e4\n[sensor]\nkind = \"depth-camera\"\n";
        let resolved = Recipe::parse(text).unwrap().resolve(&Catalog::new(vec![cube])).unwrap();
        let bin = Bin { measured: true, ..Bin::default() };
        let mesh = bin.mesh(&resolved);
        let inside = Vec3::Z * 0.05;
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(t);
            let (middle, normal) = ((a + b + c) / 3.0, mesh.triangle_normal(t));
            let outer_wall = middle.truncate().abs().max_element()
                > resolved.size_m[0] / 2.0 + 1e-4
                && normal.z.abs() < 0.5;
            let facing = normal.dot(if outer_wall { middle - inside } else { inside - middle });
            let rim = normal.z > 0.5 && middle.z > 0.05;
            assert!(facing > 0.0 || rim, "triangle {t}");
        }
        let size = mesh.bounds().size();
        assert!((size.z - 0.1).abs() < 1e-6 && (size.x - 0.51).abs() < 1e-5, "{size}");
    }
}
