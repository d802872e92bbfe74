//! `tsumu plan`: how many blocks to add, where, in which order and attitude.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use crate::result_folder::RunFolder;
use crate::{inputs, outputs, review, settings, weights};
use anyhow::anyhow;
use clap::Args;
use geom::SeedTree;
use io::manifest::Manifest;
use pipeline::{Config, Works};
use scene::{Catalog, Placement, PlacementState, Plan, Recognised, Scene, SiteFrame};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Plan how many blocks to add, where, in which order and attitude.
///
/// Takes the recognised blocks of a run (or of a site's run folder) and the site's design surface.
/// Leaves plan/placements.csv and plan/summary.json in the folder given with --out.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// A site folder whose run exists, or a run folder inside its site
    #[arg(value_name = "SITE_OR_RUN")]
    pub site_or_run: PathBuf,
    /// Folder for the plan
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// How the first pose of each new block is chosen
    #[arg(long, value_enum)]
    pub policy: Option<PolicyName>,
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
    /// Root of all random choices [default: the site's]
    #[arg(long)]
    pub seed: Option<u64>,
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
}

impl PolicyName {
    /// The planner's word.
    pub fn policy(self) -> plan::Policy {
        match self {
            Self::Random => plan::Policy::Random,
            Self::Network => plan::Policy::Network,
            Self::Search => plan::Policy::Search,
        }
    }
}

/// Plans and writes.
pub fn plan(args: &PlanArgs, terminal: &Terminal) -> Result<(), Exit> {
    let (site_dir, run_dir) = folders(args)?;
    let inputs = inputs::site(&site_dir, terminal)?;
    let config = settings::of_site(&inputs.site, args.policy, args.plans)?;
    let design = inputs::design(&inputs.site, terminal)?.ok_or_else(|| {
        Exit::bad_input(anyhow!("{}: has no [design]", site_dir.join("site.toml").display()))
    })?;
    let blocks = recognised(&RunFolder::existing(&run_dir), &inputs.catalog, &inputs.survey.frame)?;
    let previous = match &args.from {
        Some(from) => {
            let inside = from.join("plan/placements.csv");
            let file = if inside.is_file() { inside } else { from.clone() };
            Some(earlier_plan(&file, &inputs.catalog, &inputs.survey.frame)?)
        }
        None => None,
    };
    review::honoured_one(&site_dir, Manifest::load(&run_dir).ok().as_ref(), terminal)?;
    let proposer = weights::proposer(
        args.placement_model.as_deref(),
        &config.plan,
        &inputs.catalog,
        terminal,
    )?;
    let run = RunFolder::for_writing(&args.out)?;
    let seed_number = args.seed.unwrap_or(inputs.site.spec.seed);
    let works = Works {
        survey: &inputs.survey,
        catalog: &inputs.catalog,
        blocks: &blocks,
        placed: &[],
        previous: previous.as_ref(),
        proposer: proposer.as_ref().map(|p| p as _),
        design: &design,
        ground: inputs::ground(&inputs.site, &inputs.survey),
    };
    let seed = SeedTree::new(seed_number);
    let (pile, plan) = pipeline::plan_works(&works, &config, seed, terminal)?;
    let range = range(&works, &pile, &config, seed, terminal)?;
    let summary = outputs::write_plan(&run, &works, &plan, range)?;
    terminal.emit("planned", summary.clone());
    say(&summary, terminal);
    if let Some(previous) = &previous {
        terminal.say(against_earlier(&plan, previous));
    }
    terminal.say(format!("plan: {}", run.placements().display()));
    Ok(())
}

/// The site folder and the run folder behind one path.
fn folders(args: &PlanArgs) -> Result<(PathBuf, PathBuf), Exit> {
    let given = &args.site_or_run;
    let is_site = |dir: &Path| dir.join("site.toml").is_file();
    let has_blocks = |dir: &Path| RunFolder::existing(dir).blocks().is_file();
    if is_site(given) {
        let run = given.join("run");
        return match has_blocks(&run) {
            true => Ok((given.clone(), run)),
            false => Err(Exit::bad_input(anyhow!(
                "{}: has no run yet; `tsumu run` recognises and plans in one go",
                given.display()
            ))),
        };
    }
    if !has_blocks(given) {
        return Err(Exit::bad_input(anyhow!(
            "{}: neither a site folder (site.toml) nor a run folder (recognise/blocks.csv)",
            given.display()
        )));
    }
    Ok((site_of_run(given, args.site.as_deref())?, given.clone()))
}

/// The site a run belongs to: named, or the folder the run lies in.
pub fn site_of_run(run: &Path, named: Option<&Path>) -> Result<PathBuf, Exit> {
    let beside = run.canonicalize().ok().and_then(|p| p.parent().map(Path::to_path_buf));
    let lies_in = beside.filter(|p| p.join("site.toml").is_file());
    named.map(Path::to_path_buf).or(lies_in).ok_or_else(|| {
        Exit::bad_input(anyhow!(
            "{}: does not lie in its site folder; name that with --site",
            run.display()
        ))
    })
}

/// The blocks of `blocks.csv`, as corrected by hand perhaps.
pub fn recognised(
    run: &RunFolder,
    catalog: &Catalog,
    frame: &SiteFrame,
) -> Result<Vec<Recognised>, Exit> {
    let file = run.blocks();
    let rows = io::blocks_csv::read(&file).or_bad_input()?;
    rows.iter().map(|row| inputs::recognised(row, catalog, frame, &file)).collect()
}

/// The range of the count over seeds, as `plan/summary.json` has it; `None` when no plans were asked for.
pub fn range(
    works: &Works,
    pile: &Scene,
    config: &Config,
    seed: SeedTree,
    terminal: &Terminal,
) -> Result<Option<serde_json::Value>, Exit> {
    if config.uncertainty.seeds == 0 {
        return Ok(None);
    }
    let found = pipeline::count_range(works, pile, config, seed, terminal)?;
    let short = |v: f32| v.to_string().parse::<f64>().unwrap_or(f64::NAN);
    let by_thresholds: Vec<serde_json::Value> = found
        .by_thresholds
        .iter()
        .map(|t| {
            json!({
                "minimum_volume_m3": short(t.minimum_volume_m3),
                "overflow_m": short(t.overflow_m),
                "p10": short(t.blocks.p10),
                "p50": short(t.blocks.p50),
                "p90": short(t.blocks.p90),
                "mean_distance_m": short(t.mean_distance_m),
                "void_after_m3": short(t.void_after_m3),
            })
        })
        .collect();
    Ok(Some(json!({
        "seeds": config.uncertainty.seeds,
        "plans": found.cases.len(),
        "p10": short(found.blocks.p10),
        "p50": short(found.blocks.p50),
        "p90": short(found.blocks.p90),
        "by_thresholds": by_thresholds,
        "by_layers": short(found.by_layers),
        "by_volume": short(found.by_volume),
        "by_own_porosity": short(found.by_own_porosity),
    })))
}

/// A plan as `placements.csv` has it.
pub fn earlier_plan(file: &Path, catalog: &Catalog, frame: &SiteFrame) -> Result<Plan, Exit> {
    let mut plan = Plan::default();
    for row in io::placements_csv::read(file).or_bad_input()? {
        let model = catalog.find(&row.model).ok_or_else(|| {
            Exit::bad_input(anyhow!("{}: `{}` is not in the catalogue", file.display(), row.model))
        })?;
        let placement = Placement {
            order: row.order,
            round: row.round,
            model,
            drop: row.drop.local(frame),
            rest: row.rest.local(frame),
            filled_m3: row.filled_m3 as f32,
            contacts: row.contacts,
            state: row.state,
        };
        match row.state {
            PlacementState::Kept => plan.placements.push(placement),
            _ => plan.removed.push(placement),
        }
    }
    Ok(plan)
}

/// A line for every (v, f) of the range.
fn thresholds(summary: &serde_json::Value) -> Vec<String> {
    let none = Vec::new();
    let entries = summary["count_range"]["by_thresholds"].as_array().unwrap_or(&none);
    let line = |t: &serde_json::Value| {
        let number = |key: &str| t[key].as_f64().unwrap_or(f64::NAN);
        format!(
            "  v = {} m³, f = {} m: {:.0} to {:.0} blocks, median {:.0}, mean distance {:.2} m",
            number("minimum_volume_m3"),
            number("overflow_m"),
            number("p10"),
            number("p90"),
            number("p50"),
            number("mean_distance_m")
        )
    };
    entries.iter().map(line).collect()
}

/// What became of the earlier plan.
fn against_earlier(plan: &Plan, previous: &Plan) -> String {
    let earlier =
        |p: &&Placement| previous.placements.iter().any(|q| q.drop == p.drop && q.rest == p.rest);
    let kept = plan.placements.iter().filter(earlier).count();
    format!(
        "earlier plan of {} blocks: {kept} still to place as it says, {} built or given up; {} blocks planned anew",
        previous.placements.len(),
        previous.placements.len() - kept,
        plan.placements.len() - kept
    )
}

/// The figures of a plan in words.
pub fn say(summary: &serde_json::Value, terminal: &Terminal) {
    let number = |key: &str| summary[key].as_f64().unwrap_or(0.0);
    terminal.say(format!(
        "{} blocks to add in {} rounds: {:.1} m³ of concrete, {:.1} t",
        summary["blocks"],
        summary["rounds"],
        number("concrete_m3"),
        number("mass_kg") / 1000.0
    ));
    if let Some(plans) = summary["count_range"]["plans"].as_u64() {
        let of = |key: &str| summary["count_range"][key].as_f64().unwrap_or(0.0);
        let varied = thresholds(summary);
        let over = if varied.len() > 1 { "over seeds, v and f" } else { "over seeds" };
        terminal.say(format!(
            "{over}: {:.0} to {:.0} blocks, median {:.0} (P10 to P90 of {plans} plans)",
            of("p10"),
            of("p90"),
            of("p50")
        ));
        if varied.len() > 1 {
            varied.iter().for_each(|line| terminal.say(line));
        }
        terminal.say(format!(
            "to hold against it: {:.0} by N = φ·A·V^(−2/3), {:.0} by void·(1 − P)/V of the handbook, {:.0} with the plan's own porosity",
            of("by_layers"),
            of("by_volume"),
            of("by_own_porosity")
        ));
    }
    if number("blocks") > 0.0 {
        terminal.say(format!(
            "new layer: porosity {:.3} by volumes, {:.3} by raster; {} protruding blocks",
            number("porosity"),
            number("porosity_rasterised"),
            summary["protruding"]
        ));
    }
    terminal.say(format!(
        "drops removed: {} overflowing, {} unsettled, {} unstable, {} outside",
        summary["overflowed"], summary["unsettled"], summary["unstable"], summary["outside"]
    ));
    terminal.say(format!(
        "void below the design {:.1} m³ before, {:.1} m³ after; mean distance to the design {:.2} m",
        number("void_before_m3"),
        number("void_after_m3"),
        number("mean_distance_m")
    ));
}
