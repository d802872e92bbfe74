//! Points sorted into the occupied cells of a grid: what neighbours, look-ups and thinning share.

use crate::Vec3;
use rayon::prelude::*;

/// Indices of points sorted by the key of their cell, ascending within a cell.
#[derive(Clone, Debug)]
pub(crate) struct Cells<K> {
    /// Key of each entry, ascending.
    pub key: Vec<K>,
    /// Index of the point of each entry.
    pub index: Vec<u32>,
}

impl<K: Ord + Copy + Send> Cells<K> {
    /// Sorts the points by the cell that `key` puts them into; those of none are left out.
    pub fn sorted(points: &[Vec3], key: impl Fn(Vec3) -> Option<K> + Sync) -> Self {
        let mut keyed: Vec<(K, u32)> =
            points.par_iter().enumerate().filter_map(|(i, &p)| Some((key(p)?, i as u32))).collect();
        keyed.par_sort_unstable();
        Self {
            key: keyed.iter().map(|k| k.0).collect(),
            index: keyed.iter().map(|k| k.1).collect(),
        }
    }

    /// The points of each occupied cell, in the order of the keys.
    pub fn members(&self) -> impl Iterator<Item = &[u32]> {
        let mut start = 0;
        self.key.chunk_by(|a, b| a == b).map(move |cell| {
            let members = &self.index[start..start + cell.len()];
            start += cell.len();
            members
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_that_has_a_cell_is_in_one() {
        let points =
            [Vec3::new(2.5, 0.0, 0.0), Vec3::NAN, Vec3::new(0.5, 0.0, 0.0), Vec3::splat(2.1)];
        let cells = Cells::sorted(&points, |p| p.is_finite().then_some(p.x as u64));
        assert_eq!(cells.members().collect::<Vec<_>>(), [&[2][..], &[0, 3]]);
        assert_eq!(cells.key, [0, 2, 2]);
    }
}
