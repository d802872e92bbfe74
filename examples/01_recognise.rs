//! The blocks of a site, one line each: `cargo run --release -p tsumu --example 01_recognise -- examples/breakwater`.

use std::path::PathBuf;
use tsumu::{Job, RecogniseOptions, Site};

fn main() -> tsumu::Result<()> {
    let folder = std::env::args_os().nth(1).map_or("examples/breakwater".into(), PathBuf::from);
    let job = Job::silent();
    let site = Site::load(&folder, &job)?;
    let found = site.recognise(&RecogniseOptions::default(), &job)?;
    for block in &found.blocks {
        let place = site.survey.frame.site_from_local(block.centre(&site.catalog));
        match block.stated() {
            Some(fit) => {
                let name = &site.catalog.get(fit.model).name;
                println!("{}: {name} at {place:.2}, confidence {:?}", block.block.0, fit.confidence)
            }
            None => println!("{}: not judged, at {place:.2}", block.block.0),
        }
    }
    Ok(())
}
