//! Fitting error and matching rate: what can be said of real scenes without poses (Eqs. 3.15, 3.16).
//!
//! Every scene point has a distance h to the nearest face of the recognised blocks. E_f is the mean of those within
//! h_th, R the share of points within h_th.

use geom::{MeshQuery, PointGrid, Vec3};
use scene::{Catalog, PlacedBlock, Recognised};
use serde::{Deserialize, Serialize};

/// Edge of a cell of the points' grid over the largest block's edge.
const CELL: f32 = 0.25;

/// E_f and R at one threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fitting {
    /// E_f, metres; `None` when no point is within the threshold.
    pub error_m: Option<f64>,
    /// R in [0, 1]; `None` without points.
    pub matching_rate: Option<f64>,
}

/// E_f and R of point-to-face distances at `threshold_m` (the thesis: 0.1 m, 0.2 m for the largest blocks).
pub fn fitting(distance_m: &[f32], threshold_m: f32) -> Fitting {
    let within: Vec<f64> =
        distance_m.iter().filter(|&&h| h <= threshold_m).map(|&h| f64::from(h)).collect();
    let n = within.len() as f64;
    Fitting {
        error_m: (!within.is_empty()).then(|| within.iter().sum::<f64>() / n),
        matching_rate: (!distance_m.is_empty()).then(|| n / distance_m.len() as f64),
    }
}

/// Distance of each point to the nearest face of any block, metres; infinite beyond `reach_m` of all blocks' boxes
/// (a reach of h_th or more leaves [`fitting`] exact).
pub fn model_distances_m(
    points: &[Vec3],
    blocks: &[PlacedBlock],
    catalog: &Catalog,
    reach_m: f32,
) -> Vec<f32> {
    let mut distance = vec![f32::INFINITY; points.len()];
    let largest_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    // A few cells across a block: every block then asks its own neighbourhood and not the whole survey.
    let grid = PointGrid::new(points, (CELL * largest_m).max(reach_m));
    for (id, model) in catalog.iter() {
        let placed: Vec<_> = blocks.iter().filter(|b| b.model == id).collect();
        let Ok(query) = MeshQuery::new(&model.mesh) else { continue };
        let bounds = model.mesh.bounds().grown(reach_m);
        let middle = 0.5 * (bounds.min + bounds.max);
        // A little more than half the diagonal: the box itself decides.
        let radius_m = 0.5 * bounds.size().length() * 1.001;
        for block in placed {
            let block_from_site = block.site_from_block.inverse();
            grid.for_each_within(block.site_from_block * middle, radius_m, |i, p, _| {
                let q = block_from_site * p;
                if bounds.contains(q) {
                    let nearest = &mut distance[i as usize];
                    *nearest = nearest.min((query.nearest(q).0 - q).length());
                }
            });
        }
    }
    distance
}

/// Distance of each point from the surface of the block it belongs to, metres (Fig. 3.21); NaN for points of no block.
pub fn point_fit_m(points: &[Vec3], blocks: &[Recognised], catalog: &Catalog) -> Vec<f32> {
    let queries: Vec<_> = catalog.iter().map(|(_, m)| MeshQuery::new(&m.mesh).ok()).collect();
    let mut distance = vec![f32::NAN; points.len()];
    for (block, fit) in blocks.iter().filter_map(|b| Some((b, b.fit()?))) {
        let Some(Some(query)) = queries.get(fit.model.0 as usize) else { continue };
        let block_from_site = fit.site_from_block.inverse();
        for &i in &block.points {
            if let Some(p) = points.get(i as usize) {
                let q = block_from_site * *p;
                distance[i as usize] = (query.nearest(q).0 - q).length();
            }
        }
    }
    distance
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{Pose, TriMesh};
    use scene::{BlockModel, Fit, InstanceId, ModelId, SymmetryGroup};

    #[test]
    fn a_point_is_as_far_as_its_own_block() {
        // A tetrahedron with a face in the plane x = 0, at (5, 0, 0).
        let vertices = vec![Vec3::ZERO, Vec3::Y, Vec3::Z, -Vec3::X];
        let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
        let model = BlockModel {
            name: "t".into(),
            mesh: TriMesh { vertices, triangles },
            parts: vec![],
            parts_volume_ratio: 1.0,
            volume_m3: 1.0 / 6.0,
            density_kg_m3: 2300.0,
            centre: Vec3::ZERO,
            symmetry: SymmetryGroup::trivial(Vec3::ZERO),
            d_max_m: 1.0,
            d_box_m: 1.0,
        };
        let pose = Pose::from_translation(Vec3::new(5.0, 0.0, 0.0));
        let fit = Fit::of_pose(ModelId(0), pose);
        let block = Recognised::of_fit(InstanceId(1), vec![0, 2, 9], fit);
        let points =
            [Vec3::new(5.25, 0.2, 0.2), Vec3::new(5.1, 0.2, 0.2), Vec3::new(4.0, 0.0, 0.0)];
        let got = point_fit_m(&points, &[block], &Catalog::new(vec![model]));
        assert!((got[0] - 0.25).abs() < 1e-6 && got[1].is_nan() && got[2].abs() < 1e-6, "{got:?}");
    }

    #[test]
    fn by_hand() {
        let got = fitting(&[0.0, 0.05, 0.1, 0.3], 0.1);
        assert!((got.error_m.unwrap() - 0.05).abs() < 1e-8);
        assert_eq!(got.matching_rate, Some(0.75));
        assert_eq!(fitting(&[], 0.1), Fitting { error_m: None, matching_rate: None });
    }
}
