//! What a network says of the points it is shown.

use net::prelude::Tensor;

/// Numbers of an embedding.
pub const EMBEDDING: usize = 128;

/// What a network says of `n` points.
#[derive(Clone, Debug)]
pub struct Output {
    /// `[n, 128]`.
    pub embedding: Tensor<2>,
    /// Centre score in (0, 1), `[n, 1]`.
    pub centre: Tensor<2>,
    /// From the point to the pose centre, in d_max, `[n, 3]`.
    pub offset: Tensor<2>,
    /// ln of the expected length of the offset's error, in d_max, `[n, 1]`.
    pub log_error: Tensor<2>,
    /// Log-odds of lying on a block, `[n, 1]`.
    pub block: Tensor<2>,
}

/// The thesis' part of an [`Output`].
pub struct Centres {
    /// `[n, 128]`.
    pub embedding: Tensor<2>,
    /// Centre score in (0, 1), `[n, 1]`.
    pub centre: Tensor<2>,
}

/// Our part of an [`Output`].
pub struct Votes {
    /// From the point to the pose centre, in d_max, `[n, 3]`.
    pub offset: Tensor<2>,
    /// ln of the expected length of the offset's error, in d_max, `[n, 1]`.
    pub log_error: Tensor<2>,
    /// Log-odds of lying on a block, `[n, 1]`.
    pub block: Tensor<2>,
}
