//! Thinning: one measured point for every occupied cell of a cubic grid.

use crate::Vec3;
use crate::cells::Cells;
use crate::point_grid::PointGrid;

/// The points that stay and which of them stands for each input point.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Thinned {
    /// Index of the point kept for each occupied cell.
    pub kept: Vec<u32>,
    /// For every input point the position in `kept` of its cell; `u32::MAX` for one that is not finite.
    pub cell_of_point: Vec<u32>,
}

/// Keeps in every cell of edge `cell_m` the point nearest the mean of the cell's points. `shift` moves the grid
/// by that part of a cell, each component in [0, 1), for a different choice. Kept points come in the order of their
/// cells (x, then y, then z).
pub fn thin(points: &[Vec3], cell_m: f32, shift: Vec3) -> Thinned {
    let cells = Cells::sorted(points, |p| {
        let c = (p.as_dvec3() / f64::from(cell_m) + shift.as_dvec3()).floor();
        c.is_finite().then_some([c.x as i32, c.y as i32, c.z as i32])
    });
    one_a_cell(points, &cells)
}

/// The same on a grid that begins at the lowest corner of the points, so that the choice does not depend on where the origin
/// lies; kept points come in the order of the points.
pub fn thin_from_lowest(points: &[Vec3], cell_m: f32) -> Thinned {
    let thinned = one_a_cell(points, PointGrid::new(points, cell_m).cells());
    let mut order: Vec<u32> = (0..thinned.kept.len() as u32).collect();
    order.sort_unstable_by_key(|&c| thinned.kept[c as usize]);
    let mut place = vec![0; order.len()];
    for (at, &c) in order.iter().enumerate() {
        place[c as usize] = at as u32;
    }
    let moved = |&c: &u32| place.get(c as usize).copied().unwrap_or(u32::MAX);
    Thinned {
        kept: order.iter().map(|&c| thinned.kept[c as usize]).collect(),
        cell_of_point: thinned.cell_of_point.iter().map(moved).collect(),
    }
}

fn one_a_cell<K: Ord + Copy + Send>(points: &[Vec3], cells: &Cells<K>) -> Thinned {
    let mut thinned = Thinned { kept: Vec::new(), cell_of_point: vec![u32::MAX; points.len()] };
    for members in cells.members() {
        let at = thinned.kept.len() as u32;
        for &i in members {
            thinned.cell_of_point[i as usize] = at;
        }
        thinned.kept.push(nearest_the_mean(points, members));
    }
    thinned
}

/// The member nearest the mean of all; the smaller index wins a tie.
fn nearest_the_mean(points: &[Vec3], members: &[u32]) -> u32 {
    // All about the first point: large coordinates cost no digits, and the choice is the same wherever the origin lies.
    let first = points[members[0] as usize];
    let from_first = |i: u32| points[i as usize] - first;
    let mean = members.iter().map(|&i| from_first(i)).sum::<Vec3>() / members.len() as f32;
    let distance2 = |i: u32| (from_first(i) - mean).length_squared();
    let by = |a: &&u32, b: &&u32| distance2(**a).total_cmp(&distance2(**b)).then(a.cmp(b));
    *members.iter().min_by(by).expect("a cell in the list has a point")
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

    proptest! {
        #[test]
        fn from_the_lowest_corner_the_origin_does_not_matter(
            points in prop::collection::vec(prop::array::uniform3(0_u16..1000), 1..200),
        ) {
            // Whole numbers, so that moving them rounds nothing.
            let at = |by: f32| -> Vec<Vec3> {
                points.iter().map(|p| Vec3::from_array(p.map(|v| f32::from(v) + by))).collect()
            };
            let here = thin_from_lowest(&at(0.0), 250.0);
            prop_assert_eq!(&here, &thin_from_lowest(&at(4096.0), 250.0));
            prop_assert!(here.kept.is_sorted() && here.kept.len() <= points.len().min(125));
            for (p, &c) in at(0.0).iter().zip(&here.cell_of_point) {
                let kept = at(0.0)[here.kept[c as usize] as usize];
                prop_assert!((kept - *p).length() <= 250.0 * 1.7321);
            }
        }
    }

    #[test]
    fn nothing_and_what_is_no_place() {
        assert_eq!(thin(&[], 0.1, Vec3::ZERO), Thinned::default());
        let points = [Vec3::X * 1.04, Vec3::NAN, Vec3::X * 1.06, Vec3::Y];
        for thinned in [thin(&points, 0.1, Vec3::ZERO), thin_from_lowest(&points, 0.1)] {
            assert_eq!(thinned.kept.len(), 2);
            assert_eq!(thinned.cell_of_point[1], u32::MAX);
            assert_eq!(thinned.cell_of_point[0], thinned.cell_of_point[2]);
        }
    }
}
