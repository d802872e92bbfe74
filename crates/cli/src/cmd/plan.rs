//! `tsumu plan`: how many blocks to add, where, in which order and attitude.

use crate::cmd::chosen::MethodName;
use crate::words;
use clap::Args;
use scene::MemoryBound;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{Job, PlanOptions, Result, Run, Settings, Site};

/// Plan how many blocks to add, where, in which order and attitude.
///
/// Takes the recognised blocks of a run (or of a site's run folder) and the site's design surface.
/// Leaves plan/placements.csv, plan/summary.json, config.toml and manifest.json in the folder given with --out.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// A site folder whose run exists, or a run folder inside its site
    #[arg(value_name = "SITE_OR_RUN")]
    pub site_or_run: PathBuf,
    /// Folder for the plan
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// A TOML file whose settings count before the site's, or config.toml of a run
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Whose settings stand where site and file say no others: `thesis` is the thesis' chain (embedding and Algorithm 1; point
    /// pair features, point-to-point ICP, least fitness; random drops) [default: the file's, or ours]
    #[arg(long, value_enum)]
    pub method: Option<MethodName>,
    /// How the first pose of each new block is chosen
    #[arg(long, value_enum)]
    pub policy: Option<PolicyName>,
    /// Drops of policy `random` in a window, of which the best stays: the thesis' generate-and-test [default: 1]
    #[arg(long, value_name = "N")]
    pub drops: Option<u32>,
    /// The site folder, when the run does not lie in it
    #[arg(long, value_name = "SITE_DIR")]
    pub site: Option<PathBuf>,
    /// Plan on from this placements.csv (or the folder of a plan): what still holds of it is kept
    #[arg(long, value_name = "PLAN")]
    pub from: Option<PathBuf>,
    /// A placement network of your own, for policy `network`: a training's folder or its file
    #[arg(long, value_name = "MODEL")]
    pub placement_model: Option<PathBuf>,
    /// How many plans the range of the count is taken from; 0: no range
    #[arg(long, value_name = "N")]
    pub plans: Option<u32>,
    /// Improve the plan: so many times for each block it is lifted and its surroundings are filled anew [default: 0]
    #[arg(long, value_name = "PASSES")]
    pub improve: Option<f32>,
    /// Make three plans to choose from as well: fewest blocks, fullest, most stable (plan/choices.csv)
    #[arg(long)]
    pub choices: bool,
    /// Root of all random choices [default: the site's]
    #[arg(long)]
    pub seed: Option<u64>,
    /// How much memory it may take, e.g. 4GB: what does not fit is refused [default: the site's, or as much as it needs]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<MemoryBound>,
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

impl PlanArgs {
    fn settings(&self) -> Settings {
        Settings {
            file: self.config.clone(),
            method: self.method.map(MethodName::method),
            policy: self.policy.map(PolicyName::policy),
            drops: self.drops,
            plans: self.plans,
            improve: self.improve,
            seed: self.seed,
            memory: self.memory,
            ..Settings::default()
        }
    }
}

/// Plans and writes.
pub fn plan(args: &PlanArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let (folder, run) = tsumu::folders_of(&args.site_or_run, args.site.as_deref())?;
    let site = Site::load_with(&folder, &args.settings(), job)?;
    site.needed_design()?;
    let found = Run::open_recognition(run.root(), &site, job)?;
    let previous = args.from.as_deref().map(|from| site.read_plan(from)).transpose()?;
    let mut new = Run::create(&args.out, &site)?;
    new.note_source(&run, args.from.as_deref())?;
    let options =
        PlanOptions { proposer: args.placement_model.clone(), previous, choices: args.choices };
    let planned = site.plan(&found, &options, job)?;
    let run = new.keep(&planned)?.seal()?;
    let summary = planned.summary();
    terminal.emit("planned", &summary);
    site.learned.iter().for_each(|learned| terminal.say(learned.line()));
    words::planned(&summary, terminal);
    words::choices(&planned.choices, terminal);
    if let Some(previous) = &options.previous {
        words::against_earlier(&planned.plan, previous, terminal);
    }
    terminal.say(format!("plan: {}", run.placements().display()));
    Ok(())
}
