//! `tsumu report`: the report of a run folder, again.

use crate::drawings::Drawings;
use crate::exit::{Exit, OrBadInput};
use crate::page::{self, PageInput};
use crate::progress::Terminal;
use crate::result_folder::RunFolder;
use crate::{cmd, inputs, review};
use anyhow::anyhow;
use clap::Args;
use io::manifest::Manifest;
use pipeline::Works;
use report::Text;
use scene::{Recognised, Scene};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Write the report of a run folder again.
///
/// Reads recognise/ and plan/ of the run, and the site's survey and design; useful after blocks.csv was corrected.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The run folder
    #[arg(value_name = "RUN_DIR")]
    pub run: PathBuf,
    /// The HTML file [default: RUN_DIR/report.html]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// The site folder, when the run does not lie in it
    #[arg(long, value_name = "SITE_DIR")]
    pub site: Option<PathBuf>,
}

/// Reads a run and writes its page.
pub fn report(args: &ReportArgs, terminal: &Terminal) -> Result<(), Exit> {
    let run = RunFolder::existing(&args.run);
    let site_dir = cmd::plan::site_of_run(&args.run, args.site.as_deref())?;
    let inputs = inputs::site(&site_dir, terminal)?;
    let (survey, catalog) = (&inputs.survey, &inputs.catalog);
    let design = inputs::design(&inputs.site, terminal)?.ok_or_else(|| {
        Exit::bad_input(anyhow!("{}: has no [design]", site_dir.join("site.toml").display()))
    })?;
    let mut blocks = cmd::plan::recognised(&run, catalog, &survey.frame)?;
    give_points(&mut blocks, &run, survey.cloud.len(), terminal)?;
    let works = Works {
        survey,
        catalog,
        blocks: &blocks,
        placed: &[],
        previous: None,
        proposer: None,
        design: &design,
        ground: inputs::ground(&inputs.site, survey),
    };
    let config = crate::settings::of_site(&inputs.site, None, None)?;
    let pile = Scene {
        blocks: pipeline::placed_blocks(&blocks),
        ground: pipeline::ground_of(&works, &config, terminal),
    };
    let plan = cmd::plan::earlier_plan(&run.placements(), catalog, &survey.frame)?;
    let drawings = Drawings::of(&works, &pile, &plan);
    let manifest = Manifest::load(run.root()).ok();
    let honoured = review::honoured_one(&site_dir, manifest.as_ref(), terminal)?;
    let page = page::page(&PageInput {
        title: &inputs.site.spec.name,
        works: &works,
        pile: &pile,
        plan: &plan,
        drawings: &drawings,
        recognised: &json_file(&run.recognise_summary())?,
        planned: &json_file(&run.plan_summary())?,
        review: honoured.as_ref(),
        provenance: manifest.as_ref().map(provenance).unwrap_or_default(),
        warnings: terminal.warnings(),
    })?;
    let out = args.out.clone().unwrap_or_else(|| run.report());
    io::atomic::write_bytes(&out, page.html.as_bytes())?;
    terminal.say(format!("open {}", out.display()));
    Ok(())
}

/// What identifies a run on its report.
pub fn provenance(manifest: &Manifest) -> Vec<(Text, String)> {
    let weights = manifest.notes.get("weights").and_then(Value::as_str).unwrap_or("–");
    let mut rows = vec![
        (Text::new("Program", "プログラム"), format!("tsumu {}", manifest.version)),
        (Text::new("Seed", "乱数の種"), manifest.seed.to_string()),
        (Text::new("Network weights", "ネットワークの重み"), weights.to_string()),
    ];
    rows.extend(review::provenance(manifest));
    for (name, entry) in &manifest.inputs {
        let label = Text::new(format!("Input {name}"), format!("入力 {name}"));
        rows.push((
            label,
            format!(
                "{} bytes, BLAKE3 {}…",
                entry.bytes,
                entry.blake3.get(..16).unwrap_or_default()
            ),
        ));
    }
    rows
}

fn json_file(path: &Path) -> Result<Value, Exit> {
    let text = std::fs::read_to_string(path).map_err(|e| {
        Exit::bad_input(anyhow!("cannot read {}: {e}; run the stage before first", path.display()))
    })?;
    serde_json::from_str(&text).map_err(|e| Exit::bad_input(anyhow!("{}: {e}", path.display())))
}

/// The points of each block, from the labelled cloud of the run.
fn give_points(
    blocks: &mut [Recognised],
    run: &RunFolder,
    points: usize,
    terminal: &Terminal,
) -> Result<(), Exit> {
    let file = run.recognise_cloud();
    let cloud = io::points::read(&file, terminal).or_bad_input()?;
    if cloud.len() != points {
        return Err(Exit::bad_input(anyhow!(
            "{}: has {} points, the site's surveys {points}; run the site again",
            file.display(),
            cloud.len()
        )));
    }
    let mut of_block: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (i, &label) in cloud.instance.unwrap_or_default().iter().enumerate() {
        of_block.entry(label).or_default().push(i as u32);
    }
    for block in blocks {
        block.points = of_block.remove(&block.block.0).unwrap_or_default();
    }
    Ok(())
}
