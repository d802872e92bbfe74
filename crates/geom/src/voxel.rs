//! Thinning on a voxel grid: one measured point for every occupied cell.

use crate::Vec3;
use rayon::prelude::*;

/// The points that stay and which of them stands for each input point.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Thinned {
    /// Index of the point kept for each occupied cell, in cell order (x, then y, then z).
    pub kept: Vec<u32>,
    /// For every input point the position in `kept` of its cell.
    pub cell_of_point: Vec<u32>,
}

/// Keeps in every cell of edge `cell_m` the point nearest the mean of the cell's points. `shift` moves the grid
/// by that part of a cell, each component in [0, 1), for a different choice. Points must be finite.
pub fn thin(points: &[Vec3], cell_m: f32, shift: Vec3) -> Thinned {
    let mut keyed: Vec<([i32; 3], u32)> = points
        .par_iter()
        .enumerate()
        .map(|(i, &p)| {
            let c = (p.as_dvec3() / f64::from(cell_m) + shift.as_dvec3()).floor();
            ([c.x as i32, c.y as i32, c.z as i32], i as u32)
        })
        .collect();
    keyed.par_sort_unstable();
    let mut thinned = Thinned { kept: Vec::new(), cell_of_point: vec![0; points.len()] };
    for cell in keyed.chunk_by(|a, b| a.0 == b.0) {
        // About the first point, so that large coordinates do not cost digits.
        let first = points[cell[0].1 as usize];
        let mean = cell.iter().map(|&(_, i)| points[i as usize] - first).sum::<Vec3>()
            / cell.len() as f32
            + first;
        let nearest = cell
            .iter()
            .min_by(|a, b| {
                let d = |i: u32| (points[i as usize] - mean).length_squared();
                d(a.1).total_cmp(&d(b.1)).then(a.1.cmp(&b.1))
            })
            .expect("a chunk has at least one point");
        let at = thinned.kept.len() as u32;
        for &(_, i) in cell {
            thinned.cell_of_point[i as usize] = at;
        }
        thinned.kept.push(nearest.1);
    }
    thinned
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn one_point_a_cell_and_every_point_has_one(
            points in prop::collection::vec((-20.0_f32..20.0, -20.0_f32..20.0, -2.0_f32..2.0), 1..300),
            cell in 0.1_f32..5.0,
        ) {
            let points: Vec<Vec3> = points.into_iter().map(Vec3::from).collect();
            let t = thin(&points, cell, Vec3::ZERO);
            let key = |p: Vec3| (p.as_dvec3() / f64::from(cell)).floor();
            for (i, &c) in t.cell_of_point.iter().enumerate() {
                prop_assert_eq!(key(points[i]), key(points[t.kept[c as usize] as usize]));
            }
            for pair in t.kept.windows(2) {
                prop_assert_ne!(key(points[pair[0] as usize]), key(points[pair[1] as usize]));
            }
            // Thinning what is thin changes nothing.
            let kept: Vec<Vec3> = t.kept.iter().map(|&i| points[i as usize]).collect();
            prop_assert_eq!(thin(&kept, cell, Vec3::ZERO).kept.len(), kept.len());
        }
    }

    #[test]
    fn empty() {
        assert_eq!(thin(&[], 0.1, Vec3::ZERO), Thinned::default());
    }
}
