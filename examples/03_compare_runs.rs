//! Two runs of one site, block by block: `cargo run --release -p tsumu --example 03_compare_runs -- SITE RUN_A RUN_B`.

use scene::{PoseLimits, same_block, stated};
use std::path::PathBuf;
use tsumu::{Job, Run, Site};

fn main() -> tsumu::Result<()> {
    let words: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [site, a, b] = words.as_slice() else {
        eprintln!("give a site folder and two run folders");
        std::process::exit(2);
    };
    let site = Site::load(site, &Job::silent())?;
    let (a, b) = (Run::open(a, &site)?, Run::open(b, &site)?);
    for (block, fit) in stated(&a.recognition.blocks) {
        let here = fit.posed(&site.catalog);
        let limits = PoseLimits::same_place(here.model);
        let again = stated(&b.recognition.blocks)
            .find(|(_, other)| same_block(&other.posed(&site.catalog), &here, limits));
        match again {
            Some((other, _)) => println!("{} is {}", block.block.0, other.block.0),
            None => println!("{} is not in the second run", block.block.0),
        }
    }
    Ok(())
}
