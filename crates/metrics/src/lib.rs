//! Figures that judge a result against a truth.
