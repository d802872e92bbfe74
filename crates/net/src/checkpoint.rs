//! What a training keeps on disk, so that it can be stopped at any checkpoint and go on from there.
//!
//! A folder holds `curve.csv` and `checkpoint/` with the network, the optimiser and, written last, the steps done. Files are
//! written beside their place and renamed: a power cut leaves the checkpoint before.

use burn::module::Module;
use burn::optim::ModuleOptimizer;
use burn_pack::{Reader, Writer};
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// A file of a training that could not be read or written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{path}: {message}")]
pub struct CheckpointError {
    /// The file.
    pub path: String,
    /// The system's message.
    pub message: String,
}

/// The file of the settings.
const SETTINGS: &str = "config.json";

/// A training's folder.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    folder: PathBuf,
}

impl Checkpoint {
    /// Makes the folder. The settings are written beside the checkpoint and held against those of an earlier run.
    pub fn open(folder: &Path, settings: &str) -> Result<Self, CheckpointError> {
        let this = Self::at(folder)?;
        if this.settings()?.is_some_and(|before| before != settings) {
            let path = folder.join(SETTINGS);
            return Err(error(
                &path,
                "this training was begun with other settings; choose another folder",
            ));
        }
        this.keep_settings(settings)?;
        Ok(this)
    }

    /// Makes the folder and compares nothing: for callers that let some settings change between runs.
    pub fn at(folder: &Path) -> Result<Self, CheckpointError> {
        fs::create_dir_all(folder.join("checkpoint")).map_err(|e| error(folder, e))?;
        Ok(Self { folder: folder.to_owned() })
    }

    /// The settings of the run that the checkpoint is of; `None` without a checkpoint.
    pub fn settings(&self) -> Result<Option<String>, CheckpointError> {
        if self.steps_done()? == 0 {
            return Ok(None);
        }
        let path = self.folder.join(SETTINGS);
        fs::read_to_string(&path).map(Some).map_err(|e| error(&path, e))
    }

    /// Writes the settings of this run.
    pub fn keep_settings(&self, settings: &str) -> Result<(), CheckpointError> {
        self.keep(SETTINGS, settings.as_bytes())
    }

    /// The last checkpoint's network, optimiser and steps done, or what was given and 0.
    pub fn resume<M: Module>(
        &self,
        network: M,
        optimiser: ModuleOptimizer,
    ) -> Result<(M, ModuleOptimizer, u64), CheckpointError> {
        let done = self.steps_done()?;
        if done == 0 {
            return Ok((network, optimiser, 0));
        }
        let path = self.file("network.bpk");
        let network = guarded(|| network.try_load_file(&path)).map_err(|e| error(&path, e))?;
        let path = self.file("optimiser.bpk");
        let optimiser = guarded(|| optimiser.load(&path)).map_err(|e| error(&path, e))?;
        Ok((network, optimiser, done))
    }

    /// Steps of the last checkpoint; 0 without one.
    pub fn steps_done(&self) -> Result<u64, CheckpointError> {
        let path = self.file("steps");
        match fs::read_to_string(&path) {
            Ok(text) => text.trim().parse().map_err(|e| error(&path, e)),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(0),
            Err(e) => Err(error(&path, e)),
        }
    }

    /// Writes everything, the count of steps last; `model` goes to `model.safetensors` in the folder.
    pub fn save<M: Module>(
        &self,
        network: &M,
        optimiser: &ModuleOptimizer,
        done: u64,
        model: &[u8],
    ) -> Result<(), CheckpointError> {
        replace(&self.file("network.bpk"), |p| {
            network.clone().save_file(p).map_err(|e| e.to_string())
        })?;
        let optimiser = in_order(optimiser).map_err(|e| error(&self.file("optimiser.bpk"), e))?;
        replace(&self.file("optimiser.bpk"), |p| {
            optimiser.write_to_file(p).map_err(|e| e.to_string())
        })?;
        self.keep("model.safetensors", model)?;
        replace(&self.file("steps"), |p| fs::write(p, done.to_string()).map_err(|e| e.to_string()))
    }

    /// The learning curve's file; lines beyond `done` steps (written after the last checkpoint) are dropped.
    pub fn curve(&self, header: &str, done: u64) -> Result<Curve, CheckpointError> {
        let path = self.folder.join("curve.csv");
        // One that is there and cannot be read now would be written anew without what it holds.
        let old = match fs::read_to_string(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            read => read.map_err(|e| error(&path, e))?,
        };
        let step = |line: &&str| line.split(',').next().and_then(|s| s.parse::<u64>().ok());
        let kept = old.lines().skip(1).filter(|l| step(l).is_some_and(|s| s <= done));
        let text = std::iter::once(header).chain(kept).fold(String::new(), |t, l| t + l + "\n");
        fs::write(&path, text).map_err(|e| error(&path, e))?;
        let file = OpenOptions::new().append(true).open(&path).map_err(|e| error(&path, e))?;
        Ok(Curve { path, file })
    }

    /// Writes a file of the folder.
    pub fn keep(&self, name: &str, bytes: &[u8]) -> Result<(), CheckpointError> {
        replace(&self.folder.join(name), |p| fs::write(p, bytes).map_err(|e| e.to_string()))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join("checkpoint").join(name)
    }
}

/// `curve.csv`, open for appending.
#[derive(Debug)]
pub struct Curve {
    path: PathBuf,
    file: File,
}

impl Curve {
    /// Appends a line, which begins with the step.
    pub fn write(&mut self, line: &str) -> Result<(), CheckpointError> {
        writeln!(self.file, "{line}").map_err(|e| error(&self.path, e))
    }
}

/// The optimiser's state with its tensors in the order of their names: the library keeps them in an order that it draws anew
/// in every process.
fn in_order(optimiser: &ModuleOptimizer) -> Result<Writer, String> {
    let bytes = optimiser.to_record().into_bytes().map_err(|e| e.to_string())?;
    let reader = Reader::from_bytes(bytes).map_err(|e| e.to_string())?;
    let (facts, scalars) = (reader.metadata().clone(), reader.scalars().clone());
    // The reader gives them sorted.
    let mut writer = Writer::new(reader.into_tensors().map_err(|e| e.to_string())?);
    for (name, value) in &facts {
        writer = writer.with_metadata(name, value);
    }
    for (name, value) in scalars {
        writer = writer.with_scalar(&name, value);
    }
    Ok(writer)
}

/// The library's readers panic at some damaged files: that is an error like any other.
pub fn guarded<T, E: ToString>(load: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(load)) {
        Ok(loaded) => loaded.map_err(|e| e.to_string()),
        Err(_) => {
            Err("is damaged; take an earlier copy of the folder, or begin the training anew".into())
        }
    }
}

fn replace(
    path: &Path,
    write: impl FnOnce(&Path) -> Result<(), String>,
) -> Result<(), CheckpointError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // Keeps its ending: the library adds its own to a name without one.
    let new = path.with_file_name(format!("new.{name}"));
    write(&new).map_err(|e| error(&new, e))?;
    fs::rename(&new, path).map_err(|e| error(path, e))
}

fn error(path: &Path, message: impl ToString) -> CheckpointError {
    CheckpointError { path: path.display().to_string(), message: message.to_string() }
}
