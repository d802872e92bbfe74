//! `tsumu run`: all stages for one site.

use crate::cmd::chosen::MethodName;
use crate::cmd::plan::PolicyName;
use crate::words;
use anyhow::anyhow;
use clap::Args;
use scene::MemoryBound;
use serde_json::json;
use std::path::PathBuf;
use terminal::Terminal;
use tsumu::{
    Error, Job, PlanOptions, RecogniseOptions, RecogniseSummary, Result, RunOptions, Settings,
    Site, WholeRun,
};

/// Everything for one site: segment, recognise, plan, report.
///
/// Checks SITE_DIR as `tsumu check` does, reads its site.toml and leaves a run folder with the recognised blocks, the stacking plan and
/// report.html, which opens by double click. A site without a [design] gives an inventory: all of it but the plan. A run that was interrupted goes on from its last finished part when the
/// same command is given again, and ends as if it had not been.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Folder with site.toml, its catalogue and surveys
    #[arg(value_name = "SITE_DIR")]
    pub site: PathBuf,
    /// Run folder [default: SITE_DIR/run]
    #[arg(long, value_name = "RUN_DIR")]
    pub out: Option<PathBuf>,
    /// A TOML file whose settings count before the site's, or config.toml of a run
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Whose settings stand where site and file say no others: `thesis` is the thesis' chain (embedding and Algorithm 1; point
    /// pair features, point-to-point ICP, least fitness; random drops) [default: the file's, or ours]
    #[arg(long, value_enum)]
    pub method: Option<MethodName>,
    /// How the first pose of each new block is chosen [default: the site's, or search]
    #[arg(long, value_enum)]
    pub policy: Option<PolicyName>,
    /// Drops of policy `random` in a window, of which the best stays: the thesis' generate-and-test [default: 1]
    #[arg(long, value_name = "N")]
    pub drops: Option<u32>,
    /// Folder or weights file of `tsumu-lab train segment`, or shipped weights by name: `tetrapod`, `any-shape`, `fpcc`
    /// [default: the shipped weights that suit the catalogue]
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// A placement network of your own, for policy `network`: a training's folder or its file
    #[arg(long, value_name = "MODEL")]
    pub placement_model: Option<PathBuf>,
    /// How many plans the range of the count is taken from; 0: no range
    #[arg(long, value_name = "N")]
    pub plans: Option<u32>,
    /// Root of all random choices [default: the site's]
    #[arg(long)]
    pub seed: Option<u64>,
    /// How much memory it may take, e.g. 4GB: what does not fit is refused [default: the site's, or as much as it needs]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<MemoryBound>,
    /// Plan also where no block was recognised: on the surveyed ground
    #[arg(long)]
    pub bare_ground: bool,
    /// Also recognise both halves of the surveys and tell how far they agree: repeatability without truth
    #[arg(long)]
    pub self_check: bool,
}

impl RunArgs {
    fn settings(&self) -> Settings {
        Settings {
            file: self.config.clone(),
            method: self.method.map(MethodName::method),
            policy: self.policy.map(PolicyName::policy),
            drops: self.drops,
            plans: self.plans,
            improve: None,
            seed: self.seed,
            memory: self.memory,
            ..Settings::default()
        }
    }

    fn options(&self) -> RunOptions {
        RunOptions {
            recognise: RecogniseOptions {
                weights: self.model.clone(),
                self_check: self.self_check,
            },
            plan: PlanOptions { proposer: self.placement_model.clone(), ..PlanOptions::default() },
        }
    }
}

/// Runs every stage and writes every file.
pub fn run(args: &RunArgs, terminal: &Terminal, job: &Job) -> Result<()> {
    let options = args.options();
    let site = Site::load_checked(&args.site, &args.settings(), job)?;
    let out = args.out.clone().unwrap_or_else(|| site.run_folder());
    let whole = WholeRun::begin(&site, &out, &options, job)?;
    through(&site, whole, args.bare_ground, terminal)
}

/// The steps of a run that was begun, and what is said of each.
pub fn through(site: &Site, whole: WholeRun, bare_ground: bool, terminal: &Terminal) -> Result<()> {
    let recognition = whole.recognise()?;
    let recognised = RecogniseSummary::of(&site.survey, &recognition, &site.catalog);
    words::review(&recognition, terminal);
    words::recognised(&recognised, terminal);
    site.size_sentence(&recognition).iter().for_each(|line| terminal.say(line));
    let nothing = recognised.recognised_blocks == 0 && !bare_ground;
    let planned = if nothing { None } else { whole.plan(&recognition)? };
    let summary = planned.as_ref().map(|p| p.summary());
    match &summary {
        Some(summary) => {
            site.learned.iter().for_each(|learned| terminal.say(learned.line()));
            words::planned(summary, terminal);
        }
        None if nothing => {}
        None => terminal.say("no [design], so nothing is planned: this is an inventory"),
    }
    let run = whole.finish(&recognition, planned.as_ref())?;
    run.write_timing(&terminal.timing())?;
    let value = json!({
        "recognised": tsumu::json_value(&recognised)?,
        "planned": tsumu::json_value(&summary)?,
        "folder": run.root(),
    });
    terminal.emit("run", &value);
    terminal.say(format!("open {}", run.report().display()));
    if nothing {
        return Err(Error::failed(anyhow!(words::nothing_recognised(&recognised))));
    }
    Ok(())
}
