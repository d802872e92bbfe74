//! Dilated Euclidean neighbourhoods of a cloud, METHOD §3: N(i, K, d) = every d-th of the K·d nearest.

use geom::{Vec3, knn};

/// The points a network works on and who looks at whom. Computed once for all levels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Neighbourhood {
    /// Positions in the network's unit of length.
    pub position: Vec<Vec3>,
    /// Neighbours a point has.
    pub k: usize,
    /// Row-major neighbours, `k` a point, nearest first, the point itself included.
    pub index: Vec<u32>,
}

impl Neighbourhood {
    /// Every `dilation`-th of the `k · dilation` nearest. With fewer points than that the far ranks repeat the
    /// farthest neighbour there is. Positions must be finite.
    pub fn dilated(position: Vec<Vec3>, k: usize, dilation: usize) -> Self {
        let table = knn(&position, k * dilation);
        let mut index = Vec::with_capacity(position.len() * k);
        for i in 0..position.len() {
            let row = table.row(i);
            index.extend((0..k).map(|j| row[(j * dilation).min(row.len() - 1)]));
        }
        Self { position, k, index }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// The neighbours of point `i`.
    pub fn row(&self, i: usize) -> &[u32] {
        &self.index[i * self.k..(i + 1) * self.k]
    }

    /// How many points from the first on the first `count` points and their neighbours are among.
    pub fn reach(&self, count: usize) -> usize {
        self.index[..count * self.k].iter().map(|&i| i as usize + 1).max().unwrap_or(0).max(count)
    }

    /// The ten numbers of Eq. (3.2) between point `i` and each neighbour: p_i, p_ik, p_i − p_ik, ‖p_i − p_ik‖, with
    /// p_i and p_ik relative to the mean of the neighbours, so that nothing depends on where the tile lies.
    pub(crate) fn relative_positions(&self, i: usize, mut write: impl FnMut(usize, [f32; 10])) {
        let row = self.row(i);
        let own = self.position[i];
        let mean =
            row.iter().map(|&j| self.position[j as usize] - own).sum::<Vec3>() / row.len() as f32;
        let p = -mean;
        for (slot, &j) in row.iter().enumerate() {
            let d = own - self.position[j as usize];
            let q = p - d;
            write(slot, [p.x, p.y, p.z, q.x, q.y, q.z, d.x, d.y, d.z, d.length()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_second_neighbour() {
        let line = (0..10).map(|i| Vec3::new(1.1_f32.powi(i), 0.0, 0.0)).collect();
        let n = Neighbourhood::dilated(line, 3, 2);
        assert_eq!(n.row(0), &[0, 2, 4]);
        let few = Neighbourhood::dilated(vec![Vec3::ZERO, Vec3::X], 3, 2);
        assert_eq!(few.row(0), &[0, 1, 1]);
        assert_eq!((n.reach(0), n.reach(1), n.reach(10)), (0, 5, 10));
    }
}
