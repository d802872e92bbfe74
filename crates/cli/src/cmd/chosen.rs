//! Weights and settings: flags of the commands that take clouds.

use clap::Args;
use scene::MemoryBound;
use std::path::PathBuf;
use tsumu::{RecogniseOptions, Settings};

/// Weights and settings.
#[derive(Clone, Debug, Args)]
pub struct Chosen {
    /// Folder or weights file of `tsumu-lab train segment`, or shipped weights by name: `tetrapod`, `any-shape`, `fpcc`
    /// [default: the shipped weights that suit the catalogue]
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// A TOML file with settings that differ from the defaults, or config.toml of a run
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Root of all random choices [default: 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// How much memory it may take, e.g. 4GB: what does not fit is refused [default: as much as it needs]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<MemoryBound>,
}

impl Chosen {
    /// The settings as the library takes them.
    pub fn settings(&self) -> Settings {
        Settings {
            file: self.config.clone(),
            seed: self.seed,
            memory: self.memory,
            ..Settings::default()
        }
    }

    /// The weights as the library takes them.
    pub fn options(&self) -> RecogniseOptions {
        RecogniseOptions { weights: self.model.clone() }
    }
}
