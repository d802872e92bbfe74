//! What every peer must do: a loss on a labelled tile, and groups from the features of a cloud.

use crate::asis::Asis;
use crate::bonet::BoNet;
use crate::point_group::PointGroup;
use crate::sgpn::Sgpn;
use geom::Vec3;
use net::prelude::{Device, Linear, LinearConfig, Tensor, TensorData, relu};
use segment::tile::Targets;

/// Points that a peer says belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// Their numbers, ascending.
    pub points: Vec<u32>,
    /// How sure it is, 0 to 1; 1 where the method states nothing.
    pub score: f32,
}

/// The methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Wang et al., "SGPN", CVPR 2018: similarity matrix, group proposals, merging.
    Sgpn,
    /// Wang et al., "Associatively segmenting instances and semantics", CVPR 2019: discriminative embedding, mean shift.
    Asis,
    /// Yang et al., "3D-BoNet", NeurIPS 2019: boxes and masks.
    BoNet,
    /// Jiang et al., "PointGroup", CVPR 2020: offset shift, grouping of two point sets, scores.
    PointGroup,
}

impl Method {
    /// As tables name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sgpn => "SGPN",
            Self::Asis => "ASIS",
            Self::BoNet => "3D-BoNet",
            Self::PointGroup => "PointGroup",
        }
    }

    pub(crate) fn grouping(self) -> &'static dyn Grouping {
        match self {
            Self::Sgpn => &Sgpn,
            Self::Asis => &Asis,
            Self::BoNet => &BoNet,
            Self::PointGroup => &PointGroup,
        }
    }
}

/// A tile while it is learnt from.
pub(crate) struct TrainingTile<'a> {
    /// Places and truth.
    pub tile: &'a Targets,
    /// Share of the training that is done.
    pub progress: f32,
    /// Where the tensors live.
    pub device: &'a Device,
}

/// A method's heads, loss and grouping. `layers` are those of [`Grouping::layers`], in their order.
pub(crate) trait Grouping: Sync {
    /// Inputs and outputs of its linear layers on `c` features a point.
    fn layers(&self, c: usize) -> Vec<(usize, usize)>;
    /// The loss for the features `[n, c]` of a tile.
    fn loss(&self, layers: &[Linear], features: Tensor<2>, sample: &TrainingTile<'_>) -> Tensor<1>;
    /// Groups among the points with these features, d_max; best first.
    fn groups(&self, layers: &[Linear], features: Tensor<2>, position: &[Vec3]) -> Vec<Group>;
}

pub(crate) fn linear_layers(shapes: &[(usize, usize)], device: &Device) -> Vec<Linear> {
    shapes.iter().map(|&(a, b)| LinearConfig::new(a, b).init(device)).collect()
}

/// Linear, relu, linear: layers `first` and `first + 1`.
pub(crate) fn head(layers: &[Linear], first: usize, x: Tensor<2>) -> Tensor<2> {
    layers[first + 1].forward(relu(layers[first].forward(x)))
}

/// `[rows, columns]` from row-major numbers.
pub(crate) fn matrix(values: Vec<f32>, rows: usize, device: &Device) -> Tensor<2> {
    let columns = values.len() / rows.max(1);
    Tensor::from_data(TensorData::new(values, [rows, columns]), device)
}

/// Truth of a tile: the instances in it, and for each of its points which of them, if any.
pub(crate) fn instances(tile: &Targets) -> (usize, Vec<Option<usize>>) {
    let mut seen: Vec<u32> = tile.instance.iter().copied().filter(|i| *i > 0).collect();
    seen.sort_unstable();
    seen.dedup();
    let find = |i: &u32| seen.binary_search(i).ok();
    (seen.len(), tile.instance.iter().map(find).collect())
}

/// Overlap of two ascending lists of points.
pub(crate) fn iou(a: &[u32], b: &[u32]) -> f32 {
    let (mut i, mut j, mut shared) = (0, 0, 0_usize);
    while i < a.len() && j < b.len() {
        shared += usize::from(a[i] == b[j]);
        let (x, y) = (a[i], b[j]);
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    shared as f32 / (a.len() + b.len() - shared).max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlap_of_lists() {
        assert_eq!(iou(&[1, 2, 3, 7], &[2, 3, 4]), 0.4);
        assert_eq!(iou(&[], &[]), 0.0);
    }
}
