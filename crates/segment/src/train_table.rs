//! The `[train]` table of a recipe: what of a training a user may say, in the thesis' own terms.
//!
//! In: the table and a configuration. Out: the configuration with what the table says. A key left out changes nothing; one
//! that the chosen network does not have is an error, not a silent nothing.

use crate::SegmentError;
use crate::fpcc::FpccConfig;
use crate::loss::{LossConfig, PairLossConfig, PairSum};
use crate::network::NetworkConfig;
use crate::sparse_votes::SparseVotesConfig;
use crate::train::TrainConfig;
use serde::{Deserialize, Serialize};

/// Which network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainedNetwork {
    /// Graph convolutions on Euclidean neighbours, with votes: the default.
    Fpccv2,
    /// The thesis' first network.
    Fpcc,
    /// The sparse U-Net.
    SparseUnet,
}

/// Readings of the pair loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LossForm {
    /// Mean over the valid pairs: ours.
    Mean,
    /// Sum over all pairs, as the thesis writes.
    Sum,
    /// Squared distance, double pull, mean over all pairs, as its authors' code has it.
    Authors,
}

/// `[train]`. Every key may be left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainTable {
    /// Which network.
    pub network: Option<TrainedNetwork>,
    /// Reading of the pair loss.
    pub loss: Option<LossForm>,
    /// Valid-distance matrix (VDM).
    pub valid_distance: Option<bool>,
    /// Attention score matrix (ASM).
    pub attention: Option<bool>,
    /// Weight α of the centre score's loss against the pair loss' 1.
    pub alpha: Option<f32>,
    /// Power β of the centre score.
    pub beta: Option<f32>,
    /// ε₁: no loss for pairs of one instance below.
    pub epsilon_same: Option<f32>,
    /// ε₂: no loss for pairs of two instances above.
    pub epsilon_other: Option<f32>,
    /// Points drawn for the pair loss.
    pub pair_points: Option<usize>,
    /// Peak learning rate.
    pub rate: Option<f64>,
    /// Steps of linear warm-up.
    pub warmup: Option<u64>,
    /// Weight decay.
    pub decay: Option<f32>,
    /// Optimiser steps.
    pub steps: Option<u64>,
    /// Tiles, or batches of FPCC, of a step.
    pub batch: Option<usize>,
    /// Points of each of them.
    pub points: Option<usize>,
    /// Neighbours K.
    pub neighbours: Option<usize>,
    /// Dilation d.
    pub dilation: Option<usize>,
    /// Widths: features on the edges of each level (FPCCv2), of the edge convolutions (FPCC, one number), or channels of each
    /// level (sparse U-Net).
    pub edge: Option<Vec<usize>>,
    /// Features of each level's result (FPCCv2).
    pub level: Option<Vec<usize>>,
    /// Features a point (FPCCv2).
    pub out: Option<usize>,
}

impl TrainTable {
    /// `config` with what the table says. Errors name the key.
    pub fn apply(&self, config: &mut TrainConfig) -> Result<(), SegmentError> {
        match self.network {
            Some(TrainedNetwork::Fpcc) => {
                *config = TrainConfig {
                    network: NetworkConfig::Fpcc(FpccConfig::default()),
                    loss: LossConfig::of_the_thesis(),
                    ..config.clone()
                };
            }
            Some(TrainedNetwork::Fpccv2) => {
                config.network = NetworkConfig::FpccV2(Default::default());
            }
            Some(TrainedNetwork::SparseUnet) => {
                config.network = NetworkConfig::SparseUnet(SparseVotesConfig::default());
            }
            None => {}
        }
        self.apply_loss(&mut config.loss)?;
        self.apply_schedule(config)?;
        self.apply_sizes(config)
    }

    fn apply_loss(&self, loss: &mut LossConfig) -> Result<(), SegmentError> {
        let matrices = (loss.pair.valid_distance, loss.pair.attention);
        match self.loss {
            Some(LossForm::Mean) => loss.pair = PairLossConfig::default(),
            Some(LossForm::Sum) => {
                loss.pair = PairLossConfig { sum: PairSum::Sum, ..Default::default() };
            }
            Some(LossForm::Authors) => loss.pair = PairLossConfig::of_the_authors(),
            None => {}
        }
        (loss.pair.valid_distance, loss.pair.attention) =
            (self.valid_distance.unwrap_or(matrices.0), self.attention.unwrap_or(matrices.1));
        if let Some(alpha) = self.alpha {
            loss.pair_weight = 1.0;
            loss.centre_weight = above("train.alpha", alpha, 0.0)?;
        }
        set(&mut loss.centre_power, self.beta, "train.beta", 0.0)?;
        set(&mut loss.pair.near, self.epsilon_same, "train.epsilon_same", 0.0)?;
        set(&mut loss.pair.far, self.epsilon_other, "train.epsilon_other", 0.0)?;
        if loss.pair.far <= loss.pair.near {
            return Err(SegmentError::Setting {
                name: "train.epsilon_other",
                value: loss.pair.far.into(),
                allowed: "more than train.epsilon_same",
            });
        }
        loss.pair_points = self.pair_points.unwrap_or(loss.pair_points);
        Ok(())
    }

    fn apply_schedule(&self, config: &mut TrainConfig) -> Result<(), SegmentError> {
        if let Some(rate) = self.rate {
            above("train.rate", rate as f32, 0.0)?;
            config.learning_rate = rate;
        }
        config.warmup = self.warmup.unwrap_or(config.warmup);
        config.steps = self.steps.unwrap_or(config.steps);
        config.weight_decay = self.decay.unwrap_or(config.weight_decay);
        config.replicas = self.batch.unwrap_or(config.replicas);
        Ok(())
    }

    fn apply_sizes(&self, config: &mut TrainConfig) -> Result<(), SegmentError> {
        let foreign = |keys: &[(&'static str, bool)]| match keys.iter().find(|k| k.1) {
            Some((name, _)) => {
                Err(SegmentError::NoSuchKey { name, architecture: config.network.architecture() })
            }
            None => Ok(()),
        };
        match &config.network {
            NetworkConfig::FpccV2(_) => {}
            NetworkConfig::Fpcc(_) => foreign(&[
                ("train.dilation", self.dilation.is_some()),
                ("train.level", self.level.is_some()),
                ("train.out", self.out.is_some()),
                ("train.edge", self.edge.as_ref().is_some_and(|e| e.len() != 1)),
            ])?,
            NetworkConfig::SparseUnet(_) => foreign(&[
                ("train.neighbours", self.neighbours.is_some()),
                ("train.dilation", self.dilation.is_some()),
                ("train.level", self.level.is_some()),
                ("train.out", self.out.is_some()),
            ])?,
        }
        match &mut config.network {
            NetworkConfig::FpccV2(c) => {
                let sizes = &mut c.backbone;
                sizes.neighbours = self.neighbours.unwrap_or(sizes.neighbours);
                sizes.dilation = self.dilation.unwrap_or(sizes.dilation);
                sizes.out = self.out.unwrap_or(sizes.out);
                sizes.edge = self.edge.clone().unwrap_or_else(|| sizes.edge.clone());
                sizes.level = self.level.clone().unwrap_or_else(|| sizes.level.clone());
                config.tile_points = self.points.unwrap_or(config.tile_points);
            }
            NetworkConfig::Fpcc(c) => {
                c.neighbours = self.neighbours.unwrap_or(c.neighbours);
                c.batch_points = self.points.unwrap_or(c.batch_points);
                c.edge = self.edge.as_ref().map_or(c.edge, |e| e[0]);
            }
            NetworkConfig::SparseUnet(c) => {
                let channels = &mut c.unet.channels;
                *channels = self.edge.clone().unwrap_or_else(|| channels.clone());
                config.tile_points = self.points.unwrap_or(config.tile_points);
            }
        }
        match config.network.fault() {
            Some(what) => Err(SegmentError::Description(what.into())),
            None => Ok(()),
        }
    }
}

fn set(
    to: &mut f32,
    said: Option<f32>,
    name: &'static str,
    least: f32,
) -> Result<(), SegmentError> {
    if let Some(value) = said {
        *to = above(name, value, least)?;
    }
    Ok(())
}

fn above(name: &'static str, value: f32, least: f32) -> Result<f32, SegmentError> {
    if value > least && value.is_finite() {
        Ok(value)
    } else {
        Err(SegmentError::Setting { name, value: value.into(), allowed: "above 0" })
    }
}

impl TrainConfig {
    /// A training by the thesis' letter: its loss summed over every pair, 4096 points, two batches of FPCC or one of FPCCv2 a
    /// step, 10⁻⁴ without warm-up or decay. The rate still falls along a cosine (ADR 0123), and lengths stay in d_max.
    pub fn thesis(network: TrainedNetwork) -> Self {
        let batch = if network == TrainedNetwork::Fpcc { 2 } else { 1 };
        let table = TrainTable {
            network: Some(network),
            rate: Some(1e-4),
            warmup: Some(0),
            decay: Some(0.0),
            batch: Some(batch),
            points: Some(4096),
            loss: Some(LossForm::Sum),
            ..Default::default()
        };
        let mut config = Self { loss: LossConfig::of_the_thesis(), ..Self::default() };
        table.apply(&mut config).expect("the thesis' numbers are allowed");
        config
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Result<TrainTable, String> {
        serde_json::from_str(text).map_err(|e| e.to_string())
    }

    fn applied(text: &str) -> Result<TrainConfig, String> {
        let mut config = TrainConfig::default();
        table(text)?.apply(&mut config).map_err(|e| e.to_string())?;
        Ok(config)
    }

    #[test]
    fn an_empty_table_changes_nothing() {
        assert_eq!(applied("{}").unwrap(), TrainConfig::default());
    }

    #[test]
    fn every_key_reaches_its_setting() {
        let config = applied(
            r#"{"network": "fpcc", "loss": "authors", "attention": false, "alpha": 5, "beta": 1, "epsilon_same": 0.2,
                "epsilon_other": 2, "rate": 1e-4, "batch": 3, "points": 512, "neighbours": 10, "edge": [32], "steps": 7}"#,
        )
        .unwrap();
        let NetworkConfig::Fpcc(fpcc) = &config.network else { panic!("{:?}", config.network) };
        assert_eq!((fpcc.neighbours, fpcc.batch_points, fpcc.edge), (10, 512, 32));
        let pair = &config.loss.pair;
        assert_eq!((pair.sum, pair.pull, pair.attention), (PairSum::MeanOfAll, 2.0, false));
        assert_eq!((pair.near, pair.far, config.loss.centre_power), (0.2, 2.0, 1.0));
        assert_eq!((config.loss.centre_weight, config.replicas, config.steps), (5.0, 3, 7));
        assert!((config.learning_rate - 1e-4).abs() < 1e-9);
        let v2 = applied(r#"{"dilation": 2, "out": 64, "points": 700}"#).unwrap();
        assert_eq!(v2.tile_points, 700);
    }

    #[test]
    fn a_key_of_another_network_or_an_impossible_value_is_named() {
        let says = |text: &str| applied(text).unwrap_err();
        assert!(says(r#"{"network": "fpcc", "dilation": 2}"#).contains("train.dilation"));
        assert!(says(r#"{"network": "sparse-unet", "neighbours": 2}"#).contains("sparse-unet"));
        assert!(says(r#"{"beta": 0}"#).contains("train.beta"));
        assert!(says(r#"{"epsilon_other": 0.1}"#).contains("train.epsilon_other"));
        assert!(says(r#"{"gamma": 1}"#).contains("gamma"));
        assert!(says(r#"{"edge": []}"#).contains("levels"));
    }

    #[test]
    fn the_thesis_trains_by_its_letter() {
        let config = TrainConfig::thesis(TrainedNetwork::Fpcc);
        assert_eq!((config.replicas, config.warmup, config.loss.pair.sum), (2, 0, PairSum::Sum));
        assert_eq!(config.loss.centre_weight, 3.0);
        let v2 = TrainConfig::thesis(TrainedNetwork::Fpccv2);
        assert_eq!((v2.replicas, v2.tile_points, v2.loss.offset_weight), (1, 4096, 0.0));
    }
}
