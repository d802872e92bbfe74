//! What a training keeps on disk beside what every training keeps: settings of which some may change between runs, the
//! losses of a step, and the picture of their curve.

use super::TrainConfig;
use super::picture::learning_curve;
use crate::SegmentError;
use crate::loss::LossReport;
use crate::model::SegmentModel;
use crate::network::Learner;
use net::burn::optim::ModuleOptimizer;
use std::fs;
use std::path::{Path, PathBuf};

/// A training's folder.
pub(super) struct Checkpoint {
    folder: PathBuf,
    kept: net::Checkpoint,
}

const HEADER: &str = "step,learning_rate,loss,pair,centre,offset_d_max,block,\
                      held_out_loss,held_out_pair,held_out_centre,held_out_offset_d_max,held_out_block";

impl Checkpoint {
    /// Makes the folder. One that holds a checkpoint must be of the same settings, other than the number of steps.
    pub(super) fn open(folder: &Path, config: &TrainConfig) -> Result<Self, SegmentError> {
        let this = Self { folder: folder.to_owned(), kept: net::Checkpoint::at(folder)? };
        if let Some(before) = this.kept.settings()? {
            this.same_settings(&before, config)?;
        }
        let text = serde_json::to_string_pretty(config)
            .map_err(|e| SegmentError::Description(e.to_string()))?;
        this.kept.keep_settings(&text)?;
        Ok(this)
    }

    fn same_settings(&self, before: &str, config: &TrainConfig) -> Result<(), SegmentError> {
        let wrong = |message: String| SegmentError::File {
            path: self.folder.join("config.json").display().to_string(),
            message,
        };
        // By way of text, so that numbers are rounded alike on both sides.
        let now =
            serde_json::to_string(config).map_err(|e| SegmentError::Description(e.to_string()))?;
        let read =
            |text: &str| -> Result<serde_json::Map<String, serde_json::Value>, SegmentError> {
                serde_json::from_str(text).map_err(|e| wrong(e.to_string()))
            };
        let (old, new) = (read(before)?, read(&now)?);
        let may_change = ["steps", "warmup", "checkpoint_steps", "calibration_scenes", "name"];
        let key =
            new.keys().find(|k| !may_change.contains(&k.as_str()) && old.get(*k) != new.get(*k));
        match key {
            Some(key) => Err(SegmentError::OtherTraining {
                folder: self.folder.display().to_string(),
                key: key.clone(),
            }),
            None => Ok(()),
        }
    }

    /// The last checkpoint's network, optimiser and steps done, or what was given and 0.
    pub(super) fn resume<L: Learner>(
        &self,
        network: L,
        optimiser: ModuleOptimizer,
    ) -> Result<(L, ModuleOptimizer, u64), SegmentError> {
        Ok(self.kept.resume(network, optimiser)?)
    }

    /// Steps of the last checkpoint; 0 without one.
    pub(super) fn steps_done(&self) -> Result<u64, SegmentError> {
        Ok(self.kept.steps_done()?)
    }

    /// Writes everything, the count of steps last, then the curve's picture.
    pub(super) fn save<L: Learner>(
        &self,
        network: &L,
        optimiser: &ModuleOptimizer,
        done: u64,
        config: &TrainConfig,
    ) -> Result<(), SegmentError> {
        let model =
            SegmentModel::of_network(network.valid().into_network(), config, done)?.to_bytes()?;
        self.kept.save(network, optimiser, done, &model)?;
        let csv = fs::read_to_string(self.folder.join("curve.csv")).unwrap_or_default();
        Ok(self.kept.keep("curve.svg", learning_curve(&csv).as_bytes())?)
    }

    /// Writes the finished model.
    pub(super) fn finish(&self, model: &SegmentModel) -> Result<(), SegmentError> {
        Ok(self.kept.keep("model.safetensors", &model.to_bytes()?)?)
    }

    /// The curve's file; lines beyond `done` steps (written after the last checkpoint) are dropped.
    pub(super) fn curve(&self, done: u64) -> Result<Curve, SegmentError> {
        Ok(Curve(self.kept.curve(HEADER, done)?))
    }
}

/// `curve.csv`, open for appending.
pub(super) struct Curve(net::Curve);

impl Curve {
    pub(super) fn write(
        &mut self,
        step: u64,
        rate: f64,
        train: &LossReport,
        held_out: Option<&LossReport>,
    ) -> Result<(), SegmentError> {
        let numbers = |r: &LossReport| {
            format!("{:.5},{:.5},{:.5},{:.5},{:.5}", r.total, r.pair, r.centre, r.offset, r.block)
        };
        let held_out = held_out.map_or_else(|| ",,,,".to_owned(), numbers);
        Ok(self.0.write(&format!("{step},{rate:.3e},{},{held_out}", numbers(train)))?)
    }
}
