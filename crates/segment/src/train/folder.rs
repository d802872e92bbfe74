//! What a training keeps on disk beside what every training keeps: settings of which some may change between runs, the
//! losses of a step, and the picture of their curve.

use super::TrainConfig;
use super::picture::learning_curve;
use crate::SegmentError;
use crate::loss::LossReport;
use crate::model::SegmentModel;
use net::Checkpoint;
use std::fs;
use std::path::{Path, PathBuf};

/// A training's folder.
pub(super) struct Folder {
    path: PathBuf,
    kept: Checkpoint,
}

/// First line of the learning curve.
pub(super) const HEADER: &str = "step,learning_rate,loss,pair,centre,offset_d_max,block,\
                      held_out_loss,held_out_pair,held_out_centre,held_out_offset_d_max,held_out_block";

impl Folder {
    /// Makes the folder. One that holds a checkpoint must be of the same settings, other than the number of steps.
    pub(super) fn open(folder: &Path, config: &TrainConfig) -> Result<Self, SegmentError> {
        let this = Self { path: folder.to_owned(), kept: Checkpoint::at(folder)? };
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
            path: self.path.join("config.json").display().to_string(),
            message,
        };
        // By way of text, so that numbers are rounded alike on both sides.
        let now =
            serde_json::to_string(config).map_err(|e| SegmentError::Description(e.to_string()))?;
        let read =
            |text: &str| -> Result<serde_json::Map<String, serde_json::Value>, SegmentError> {
                serde_json::from_str(text).map_err(|e| wrong(e.to_string()))
            };
        let (old, mut new) = (read(before)?, read(&now)?);
        leave_unsaid(&old, &mut new);
        let may_change = ["steps", "warmup", "checkpoint_steps", "calibration_scenes", "name"];
        let key =
            new.keys().find(|k| !may_change.contains(&k.as_str()) && old.get(*k) != new.get(*k));
        match key {
            Some(key) => Err(SegmentError::OtherTraining {
                folder: self.path.display().to_string(),
                key: key.clone(),
            }),
            None => Ok(()),
        }
    }

    /// What the training loop keeps there.
    pub(super) fn checkpoint(&self) -> &Checkpoint {
        &self.kept
    }

    /// Draws the learning curve as it stands.
    pub(super) fn draw_curve(&self) -> Result<(), SegmentError> {
        let csv = fs::read_to_string(self.path.join("curve.csv")).unwrap_or_default();
        Ok(self.kept.keep("curve.svg", learning_curve(&csv).as_bytes())?)
    }

    /// Writes the finished model.
    pub(super) fn finish(&self, model: &SegmentModel) -> Result<(), SegmentError> {
        Ok(self.kept.keep("model.safetensors", &model.to_bytes()?)?)
    }
}

/// A line of the learning curve.
pub(super) fn line(
    step: u64,
    rate: f64,
    train: &LossReport,
    held_out: Option<&LossReport>,
) -> String {
    let numbers = |r: &LossReport| {
        format!("{:.5},{:.5},{:.5},{:.5},{:.5}", r.total, r.pair, r.centre, r.offset, r.block)
    };
    let held_out = held_out.map_or_else(|| ",,,,".to_owned(), numbers);
    format!("{step},{rate:.3e},{},{held_out}", numbers(train))
}

/// Trainings of version 0.1 did not name their network's architecture: what they do not say is not compared.
fn leave_unsaid(
    old: &serde_json::Map<String, serde_json::Value>,
    new: &mut serde_json::Map<String, serde_json::Value>,
) {
    let said = old.get("network").is_some_and(|n| n.get("architecture").is_some());
    if let Some(network) = new.get_mut("network").and_then(|n| n.as_object_mut()).filter(|_| !said)
    {
        network.remove("architecture");
    }
}
