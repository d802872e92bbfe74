//! Weights and settings: flags of the commands that take clouds.

use clap::Args;
use scene::MemoryBound;
use std::path::PathBuf;
use tsumu::{Method, RecogniseOptions, Settings};

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
    /// Whose settings stand where site and file say no others: `thesis` is the thesis' chain (embedding and Algorithm 1; point
    /// pair features, point-to-point ICP, least fitness; random drops) [default: the file's, or ours]
    #[arg(long, value_enum)]
    pub method: Option<MethodName>,
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
            method: self.method.map(MethodName::method),
            seed: self.seed,
            memory: self.memory,
            ..Settings::default()
        }
    }

    /// The weights as the library takes them.
    pub fn options(&self) -> RecogniseOptions {
        RecogniseOptions { weights: self.model.clone(), ..RecogniseOptions::default() }
    }
}

/// Methods on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum MethodName {
    /// The program's own
    Ours,
    /// The thesis', by the letter
    Thesis,
}

impl MethodName {
    /// The library's word.
    pub fn method(self) -> Method {
        match self {
            Self::Ours => Method::Ours,
            Self::Thesis => Method::Thesis,
        }
    }
}
