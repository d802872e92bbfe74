//! What a training keeps on disk, so that it can be stopped at any checkpoint and go on from there.

use super::TrainConfig;
use super::picture::learning_curve;
use crate::SegmentError;
use crate::loss::LossReport;
use crate::model::SegmentModel;
use crate::network::Learner;
use net::burn::optim::ModuleOptimizer;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A training's folder.
pub(super) struct Checkpoint {
    folder: PathBuf,
}

const HEADER: &str = "step,learning_rate,loss,pair,centre,offset_d_max,block,\
                      held_out_loss,held_out_pair,held_out_centre,held_out_offset_d_max,held_out_block";

impl Checkpoint {
    /// Makes the folder. One that holds a checkpoint must be of the same settings, other than the number of steps.
    pub(super) fn open(folder: &Path, config: &TrainConfig) -> Result<Self, SegmentError> {
        let this = Self { folder: folder.to_owned() };
        fs::create_dir_all(folder.join("checkpoint")).map_err(|e| this.error(folder, e))?;
        let path = folder.join("config.json");
        if this.steps_done()? > 0 {
            this.same_settings(&path, config)?;
        }
        let text = serde_json::to_string_pretty(config).map_err(|e| SegmentError::Description(e.to_string()))?;
        fs::write(&path, text).map_err(|e| this.error(&path, e))?;
        Ok(this)
    }

    fn same_settings(&self, path: &Path, config: &TrainConfig) -> Result<(), SegmentError> {
        let text = fs::read_to_string(path).map_err(|e| self.error(path, e))?;
        let old: serde_json::Value = serde_json::from_str(&text).map_err(|e| self.error(path, e))?;
        // By way of text, so that numbers are rounded alike on both sides.
        let text = serde_json::to_string(config).map_err(|e| SegmentError::Description(e.to_string()))?;
        let new: serde_json::Value = serde_json::from_str(&text).map_err(|e| self.error(path, e))?;
        let (Some(old), Some(new)) = (old.as_object(), new.as_object()) else {
            return Err(self.error(path, "is not an object"));
        };
        // Settings that older folders do not have are at their defaults there.
        let may_change = ["steps", "warmup", "checkpoint_steps", "calibration_scenes", "name"];
        let key = new.keys().find(|k| !may_change.contains(&k.as_str()) && old.get(*k) != new.get(*k));
        match key {
            Some(key) => {
                Err(SegmentError::OtherTraining { folder: self.folder.display().to_string(), key: key.clone() })
            }
            None => Ok(()),
        }
    }

    /// The last checkpoint's network, optimiser and steps done, or what was given and 0.
    pub(super) fn resume<L: Learner>(
        &self,
        network: L,
        optimiser: ModuleOptimizer,
    ) -> Result<(L, ModuleOptimizer, u64), SegmentError> {
        let done = self.steps_done()?;
        if done == 0 {
            return Ok((network, optimiser, 0));
        }
        let path = self.file("network.bpk");
        let network = net::checkpoint::guarded(|| network.try_load_file(&path)).map_err(|e| self.error(&path, e))?;
        let path = self.file("optimiser.bpk");
        let optimiser = net::checkpoint::guarded(|| optimiser.load(&path)).map_err(|e| self.error(&path, e))?;
        Ok((network, optimiser, done))
    }

    /// Steps of the last checkpoint; 0 without one.
    pub(super) fn steps_done(&self) -> Result<u64, SegmentError> {
        let path = self.file("steps");
        match fs::read_to_string(&path) {
            Ok(text) => text.trim().parse().map_err(|e| self.error(&path, e)),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(0),
            Err(e) => Err(self.error(&path, e)),
        }
    }

    /// Writes everything, the count of steps last.
    pub(super) fn save<L: Learner>(
        &self,
        network: &L,
        optimiser: &ModuleOptimizer,
        done: u64,
        config: &TrainConfig,
    ) -> Result<(), SegmentError> {
        let replace = |name: &str, write: &dyn Fn(&Path) -> Result<(), String>| {
            // Keeps its ending: the library adds its own to a name without one.
            let (new, path) = (self.file(&format!("new.{name}")), self.file(name));
            write(&new).map_err(|e| self.error(&new, e))?;
            fs::rename(&new, &path).map_err(|e| self.error(&path, e))
        };
        replace("network.bpk", &|p| network.clone().save_file(p).map_err(|e| e.to_string()))?;
        replace("optimiser.bpk", &|p| optimiser.save(p).map_err(|e| e.to_string()))?;
        let model = SegmentModel::of_network(network.valid().into_network(), config, done)?.to_bytes()?;
        replace("model.safetensors", &|p| fs::write(p, &model).map_err(|e| e.to_string()))?;
        replace("steps", &|p| fs::write(p, done.to_string()).map_err(|e| e.to_string()))?;
        let csv = fs::read_to_string(self.folder.join("curve.csv")).unwrap_or_default();
        let path = self.folder.join("curve.svg");
        fs::write(&path, learning_curve(&csv)).map_err(|e| self.error(&path, e))?;
        let path = self.folder.join("model.safetensors");
        fs::write(&path, &model).map_err(|e| self.error(&path, e))
    }

    /// Writes the finished model.
    pub(super) fn finish(&self, model: &SegmentModel) -> Result<(), SegmentError> {
        let (new, path) = (self.folder.join("new.model.safetensors"), self.folder.join("model.safetensors"));
        fs::write(&new, model.to_bytes()?).map_err(|e| self.error(&new, e))?;
        fs::rename(&new, &path).map_err(|e| self.error(&path, e))
    }

    /// The curve's file; lines beyond `done` steps (written after the last checkpoint) are dropped.
    pub(super) fn curve(&self, done: u64) -> Result<Curve, SegmentError> {
        let path = self.folder.join("curve.csv");
        let old = fs::read_to_string(&path).unwrap_or_default();
        let kept = old
            .lines()
            .skip(1)
            .filter(|l| l.split(',').next().and_then(|s| s.parse::<u64>().ok()).is_some_and(|s| s <= done));
        let text = std::iter::once(HEADER).chain(kept).fold(String::new(), |t, l| t + l + "\n");
        fs::write(&path, text).map_err(|e| self.error(&path, e))?;
        let file = OpenOptions::new().append(true).open(&path).map_err(|e| self.error(&path, e))?;
        Ok(Curve { path, file })
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join("checkpoint").join(name)
    }

    fn error(&self, path: &Path, message: impl ToString) -> SegmentError {
        SegmentError::File { path: path.display().to_string(), message: message.to_string() }
    }
}

/// `curve.csv`, open for appending.
pub(super) struct Curve {
    path: PathBuf,
    file: File,
}

impl Curve {
    pub(super) fn write(
        &mut self,
        step: u64,
        rate: f64,
        train: &LossReport,
        held_out: Option<&LossReport>,
    ) -> Result<(), SegmentError> {
        let numbers =
            |r: &LossReport| format!("{:.5},{:.5},{:.5},{:.5},{:.5}", r.total, r.pair, r.centre, r.offset, r.block);
        let held_out = held_out.map_or_else(|| ",,,,".to_owned(), numbers);
        writeln!(self.file, "{step},{rate:.3e},{},{held_out}", numbers(train))
            .map_err(|e| SegmentError::File { path: self.path.display().to_string(), message: e.to_string() })
    }
}
