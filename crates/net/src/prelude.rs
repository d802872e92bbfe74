//! The names of the deep-learning library that a stage needs to define a network and its loss. Nothing else of it is
//! seen outside this crate (a test reads this list): what is not here has a home in `net`.

/// `#[derive(Module)]` writes paths that begin with the library's name.
#[doc(hidden)]
pub use burn;
pub use burn::module::Module;
pub use burn::nn::{Linear, LinearConfig};
pub use burn::optim::GradientsParams;
pub use burn::tensor::activation::{log_softmax, relu, sigmoid, softplus};
pub use burn::tensor::{Device, Distribution, Int, Shape, Tensor, TensorData};
