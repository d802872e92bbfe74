//! A point cloud: columns of equal length.

use crate::{Bounds, Vec3};

/// Measured or sampled points. An optional column is empty or as long as `position_m`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Positions, metres, in the local frame.
    pub position_m: Vec<Vec3>,
    /// Unit normals, or empty.
    pub normal: Vec<Vec3>,
}

impl PointCloud {
    /// A cloud without normals.
    pub fn from_positions(position_m: Vec<Vec3>) -> Self {
        Self { position_m, normal: Vec::new() }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.position_m.len()
    }

    /// True when there are no points.
    pub fn is_empty(&self) -> bool {
        self.position_m.is_empty()
    }

    /// Whether the normals column is filled.
    pub fn has_normals(&self) -> bool {
        !self.is_empty() && self.normal.len() == self.len()
    }

    /// Smallest box around the points.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.position_m.iter().copied())
    }

    /// The points at `index`, in that order; panics when an index is out of range.
    pub fn select(&self, index: &[usize]) -> Self {
        let pick = |column: &[Vec3]| index.iter().map(|&i| column[i]).collect();
        Self {
            position_m: pick(&self.position_m),
            normal: if self.has_normals() { pick(&self.normal) } else { Vec::new() },
        }
    }
}
