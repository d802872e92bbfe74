//! The wall around the deep-learning library: layers, training loop, weights. Knows no stage's task.

pub mod attentive_pooling;
pub mod checkpoint;
pub mod graph_backbone;
pub mod graph_convolution;
pub mod half_weights;
pub mod image_transformer;
pub mod neighbourhood;
mod numbering;
pub mod prelude;
pub mod processor;
pub mod replicas;
pub mod residual;
pub mod row_norm;
pub mod schedule;
mod small_gemm;
pub mod sparse_convolution;
pub mod sparse_unet;
pub mod training;
pub mod voxels;
pub mod weights;

pub use checkpoint::{Checkpoint, CheckpointError, Curve};
pub use graph_backbone::{BackboneConfig, GraphBackbone, Trace};
pub use graph_convolution::{GraphConvolution, floats};
pub use image_transformer::{ImageTransformer, ImageTransformerConfig};
pub use neighbourhood::Neighbourhood;
pub use processor::{Processor, ProcessorError};
pub use replicas::Replicas;
pub use residual::{ResNet, ResNetConfig, ResNetDepth};
pub use sparse_unet::{SparseUnet, UnetConfig, UnetTrace};
pub use training::{Schedule, Task, Training, TrainingError};
pub use voxels::Voxels;
pub use weights::WeightsError;
