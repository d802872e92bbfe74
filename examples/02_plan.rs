//! A whole run step by step: `cargo run --release -p tsumu --example 02_plan -- examples/breakwater out`. The folder is, byte for
//! byte, what `tsumu run` leaves.

use std::path::{Path, PathBuf};
use tsumu::{Job, PlanOptions, RecogniseOptions, Run, Site};

/// Recognises, plans, presents and seals; how many blocks are to add.
pub fn run(folder: &Path, out: &Path) -> tsumu::Result<usize> {
    let job = Job::silent();
    let site = Site::load(folder, &job)?;
    let found = site.recognise(&RecogniseOptions::default(), &job)?;
    let planned = site.plan(&found, &PlanOptions::default(), &job)?;
    Run::create(out, &site)?.keep(&found)?.keep(&planned)?.present(&job)?.seal()?;
    Ok(planned.plan.placements.len())
}

#[allow(dead_code, reason = "a test calls `run`")]
fn main() -> tsumu::Result<()> {
    let mut words = std::env::args_os().skip(1).map(PathBuf::from);
    let site = words.next().unwrap_or("examples/breakwater".into());
    let out = words.next().unwrap_or("out".into());
    println!("{} blocks to add: open {}", run(&site, &out)?, out.join("report.html").display());
    Ok(())
}
