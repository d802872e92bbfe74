//! The wall around the deep-learning library: layers, training loop, weights.
