//! `tsumu run`: all stages for one site.

use crate::drawings::Drawings;
use crate::exit::{Exit, OrBadInput};
use crate::kept::Kept;
use crate::page::{self, PageInput};
use crate::progress::Terminal;
use crate::result_folder::RunFolder;
use crate::{cmd, inputs, outputs, review, settings, version, weights};
use anyhow::anyhow;
use clap::Args;
use geom::SeedTree;
use io::manifest::Manifest;
use pipeline::{Recogniser, Works};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Everything for one site: segment, recognise, plan, report.
///
/// Reads SITE_DIR/site.toml and leaves a run folder with the recognised blocks, the stacking plan and
/// report.html, which opens by double click. A run that was interrupted goes on from its last finished part when the
/// same command is given again, and ends as if it had not been.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Folder with site.toml, its catalogue and surveys
    #[arg(value_name = "SITE_DIR")]
    pub site: PathBuf,
    /// Run folder [default: SITE_DIR/run]
    #[arg(long, value_name = "RUN_DIR")]
    pub out: Option<PathBuf>,
    /// How the first pose of each new block is chosen [default: the site's, or search]
    #[arg(long, value_enum)]
    pub policy: Option<cmd::plan::PolicyName>,
    /// Folder or weights file of `tsumu train segment`, or shipped weights by name: `tetrapod`, `any-shape`, `fpcc`
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
}

/// Runs every stage and writes every file.
pub fn run(args: &RunArgs, terminal: &Terminal) -> Result<(), Exit> {
    let mut clock = Clock::default();
    let inputs = inputs::site(&args.site, terminal)?;
    let (site, survey, catalog) = (&inputs.site, &inputs.survey, &inputs.catalog);
    let config = settings::of_site(site, args.policy, args.plans)?;
    let design = inputs::design(site, terminal)?.ok_or_else(|| {
        Exit::bad_input(anyhow!(
            "{}: has no [design], so there is nothing to plan; add one, or use `tsumu recognise`",
            args.site.join("site.toml").display()
        ))
    })?;
    pipeline::survey::check_scale(survey, catalog)?;
    pipeline::survey::check_design(survey, &design)?;
    let decided = review::of_site(&site.folder)?;
    let weights = weights::choose(args.model.as_deref(), catalog, terminal)?;
    let proposer =
        weights::proposer(args.placement_model.as_deref(), &config.plan, catalog, terminal)?;
    let run = RunFolder::for_writing(&args.out.clone().unwrap_or_else(|| site.folder.join("run")))?;
    let seed_number = args.seed.unwrap_or(site.spec.seed);
    let seed = SeedTree::new(seed_number);
    let mut manifest = Manifest::new(version::STAMP, seed_number, serde_json::to_value(&config)?);
    weights.record(&mut manifest);
    weights::record_proposer(args.placement_model.as_deref(), &mut manifest)?;
    manifest.inputs = inputs
        .hashes
        .iter()
        .map(|(name, entry)| (io::manifest::portable(name), entry.clone()))
        .collect();
    if decided.is_some() {
        manifest.add_input(Path::new(io::review::FILE), &site.folder.join(io::review::FILE))?;
    }
    let kept = Kept::open(run.root(), manifest.key(&this_program()), terminal)?;
    clock.lap("read");

    let recogniser =
        Recogniser { catalog, model: &weights.model, config: &config, seed, observer: terminal };
    let segments = kept.part("segment", || recogniser.foreground_segments(survey))?;
    clock.lap("segment");
    let mut recognition = kept.part("recognise", || recogniser.blocks(survey, segments))?;
    let honoured = review::honour(
        decided.as_ref(),
        catalog,
        &survey.frame,
        &mut recognition.blocks,
        terminal,
    )?;
    clock.lap("recognise");
    outputs::write_segment(&run, survey, &recognition)?;
    let recognised = outputs::write_recognise(&run, survey, &recognition, catalog)?;
    cmd::recognise::say(&recognised, terminal);
    clock.lap("write recognise");

    let works = Works {
        survey,
        catalog,
        blocks: &recognition.blocks,
        placed: &[],
        previous: None,
        proposer: proposer.as_ref().map(|p| p as _),
        design: &design,
        ground: inputs::ground(site, survey),
    };
    let (pile, plan) =
        kept.part("plan", || pipeline::plan_works(&works, &config, seed, terminal))?;
    clock.lap("plan");
    let range = kept.part("range", || cmd::plan::range(&works, &pile, &config, seed, terminal))?;
    clock.lap("range");
    let planned = outputs::write_plan(&run, &works, &plan, range)?;
    cmd::plan::say(&planned, terminal);

    let drawings = Drawings::of(&works, &pile, &plan);
    drawings.export(&run.exports(), &site.spec.name, &works, &plan, seed_number)?;
    clock.lap("exports");
    honoured.iter().for_each(|h| h.record(&mut manifest));
    manifest.notes.insert("warnings".into(), json!(terminal.warnings()));
    let page = page::page(&PageInput {
        title: &site.spec.name,
        works: &works,
        pile: &pile,
        plan: &plan,
        drawings: &drawings,
        recognised: &recognised,
        planned: &planned,
        review: decided.as_ref(),
        provenance: cmd::report::provenance(&manifest),
        warnings: terminal.warnings(),
    })?;
    io::atomic::write_bytes(&run.report(), page.html.as_bytes())?;
    io::atomic::write_bytes(&run.picture(), &page.png)?;
    clock.lap("report");

    io::atomic::write_bytes(&run.config(), toml::to_string(&config)?.as_bytes())?;
    manifest.check_inputs(&site.folder).or_bad_input()?;
    let written = io::manifest::files_below(run.root())?;
    manifest.seal(run.root(), written.iter().map(|name| name.as_path()))?;
    clock.lap("manifest");
    outputs::write_json(&run.timing(), &clock.json())?;
    kept.finish()?;
    terminal
        .emit("run", json!({ "recognised": recognised, "planned": planned, "folder": run.root() }));
    terminal.say(format!("open {}", run.report().display()));
    Ok(())
}

/// What tells this build from another of the same version: the program file's own hash.
fn this_program() -> String {
    let entry = std::env::current_exe().ok().and_then(|path| io::manifest::entry(&path).ok());
    entry.map_or_else(|| version::STAMP.into(), |e| e.blake3)
}

/// Wall time of each part of a run.
struct Clock {
    last: Instant,
    laps: Vec<(&'static str, f64)>,
}

impl Default for Clock {
    fn default() -> Self {
        Self { last: Instant::now(), laps: Vec::new() }
    }
}

impl Clock {
    fn lap(&mut self, name: &'static str) {
        self.laps.push((name, self.last.elapsed().as_secs_f64()));
        self.last = Instant::now();
    }

    fn json(&self) -> serde_json::Value {
        let map: serde_json::Map<_, _> =
            self.laps.iter().map(|(n, s)| (format!("{n}_s"), json!(s))).collect();
        serde_json::Value::Object(map)
    }
}
