//! Weights, settings and folders: flags that several commands share.

use clap::Args;
use scene::MemoryBound;
use std::path::PathBuf;
use tsumu::{Job, Method, RecogniseOptions, Recognition, Result, Run, RunFolder, Settings, Site};

/// Settings laid over what the site or the method says.
#[derive(Clone, Debug, Args)]
pub struct Laid {
    /// A TOML file whose settings count before the site's, or config.toml of a run
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Whose settings stand where site and file say no others: `thesis` is the thesis' chain (embedding and Algorithm 1; point
    /// pair features, point-to-point ICP, least fitness; random drops) [default: the file's, or ours]
    #[arg(long, value_enum)]
    pub method: Option<MethodName>,
    /// Root of all random choices [default: the site's, or 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// How much memory it may take, e.g. 4GB: what does not fit is refused [default: the site's, or as much as it needs]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<MemoryBound>,
}

impl Laid {
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
}

/// Weights and settings.
#[derive(Clone, Debug, Args)]
pub struct Chosen {
    /// Folder or weights file of `tsumu-lab train segment`, or shipped weights by name: `tetrapod`, `bin-parts`, `any-shape`, `fpcc`
    /// [default: the shipped weights that suit the catalogue]
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Settings over the method's
    #[command(flatten)]
    pub laid: Laid,
}

impl Chosen {
    /// The settings as the library takes them.
    pub fn settings(&self) -> Settings {
        self.laid.settings()
    }

    /// The weights as the library takes them.
    pub fn options(&self) -> RecogniseOptions {
        RecogniseOptions { weights: self.model.clone(), ..RecogniseOptions::default() }
    }
}

/// How blocks are added.
#[derive(Clone, Debug, Args)]
pub struct Planning {
    /// How the first pose of each new block is chosen [default: the site's, or search]
    #[arg(long, value_enum)]
    pub policy: Option<PolicyName>,
    /// Drops of policy `random` in a window, of which the best stays: the thesis' generate-and-test [default: 1]
    #[arg(long, value_name = "N")]
    pub drops: Option<u32>,
    /// A placement network of your own, for policy `network`: a training's folder or its file
    #[arg(long, value_name = "MODEL")]
    pub placement_model: Option<PathBuf>,
    /// How many plans the range of the count is taken from; 0: no range
    #[arg(long, value_name = "N")]
    pub plans: Option<u32>,
}

impl Planning {
    /// These settings and `others`.
    pub fn with(&self, others: Settings) -> Settings {
        let policy = self.policy.map(PolicyName::policy);
        Settings { policy, drops: self.drops, plans: self.plans, ..others }
    }
}

/// A run and its site.
#[derive(Clone, Debug, Args)]
pub struct OfRun {
    /// A site folder whose run exists, or a run folder inside its site
    #[arg(value_name = "SITE_OR_RUN")]
    pub site_or_run: PathBuf,
    /// The site folder, when the run does not lie in it
    #[arg(long, value_name = "SITE_DIR")]
    pub site: Option<PathBuf>,
}

impl OfRun {
    /// Both folders.
    pub fn folders(&self) -> Result<(PathBuf, RunFolder)> {
        tsumu::folders_of(&self.site_or_run, self.site.as_deref())
    }

    /// The site as the run had it, the run, and what was recognised in it.
    pub fn opened(&self, job: &Job) -> Result<(Site, RunFolder, Recognition)> {
        let (folder, run) = self.folders()?;
        let site = Run::settled(run.root(), Site::load(&folder, job)?, job)?;
        let found = Run::open_recognition(run.root(), &site, job)?;
        Ok((site, run, found))
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

/// Policies on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum PolicyName {
    /// A random attitude above the window
    Random,
    /// Poses a network proposes from the depth image, the best verified by physics
    Network,
    /// The best of many attitudes, verified by physics
    Search,
    /// The nodes of a regular grid, layer upon layer; see `[plan.pattern]`
    Pattern,
}

impl PolicyName {
    /// The planner's word.
    pub fn policy(self) -> plan::Policy {
        match self {
            Self::Random => plan::Policy::Random,
            Self::Network => plan::Policy::Network,
            Self::Search => plan::Policy::Search,
            Self::Pattern => plan::Policy::Pattern,
        }
    }
}
