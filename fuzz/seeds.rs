//! Writes the small valid files that the targets damage: `seeds FOLDER` fills a folder in it for every target.

// The library is built with coverage, whose counters libFuzzer holds.
use libfuzzer_sys as _;

#[path = "../crates/io/tests/files/foreign.rs"]
mod foreign;
#[allow(dead_code)]
#[path = "../crates/io/tests/hostile/readers.rs"]
mod readers;
#[path = "../crates/io/tests/files/sample.rs"]
mod sample;
#[path = "../crates/io/tests/hostile/seeds.rs"]
mod seeds;

#[allow(dead_code)]
#[path = "../crates/tsumu/tests/hostile/folders.rs"]
mod folders;

/// Every file of a site and of its run, after the two bytes that choose it and how far it is used.
fn folders_of(folder: &std::path::Path) -> std::io::Result<()> {
    let site = folders::site_folder();
    let of_site = folders::names(site.path());
    let run = folders::run_of(site.path());
    let of_run = folders::read_again(&run);
    for (target, root, files) in [("sites", site.path(), of_site), ("runs", &run, of_run)] {
        std::fs::create_dir_all(folder.join(target))?;
        for (number, name) in files.iter().enumerate() {
            let content = std::fs::read(root.join(name))?;
            for how in [1, 2] {
                let file = folder.join(target).join(format!("{number:02}-{how}"));
                std::fs::write(file, [&[number as u8, how], &content[..]].concat())?;
            }
        }
    }
    Ok(())
}

fn main() -> std::io::Result<()> {
    let folder = std::path::PathBuf::from(std::env::args().nth(1).unwrap_or("corpus".into()));
    for (number, (kind, content)) in seeds::all().into_iter().enumerate() {
        for (target, kinds) in [("clouds", &readers::CLOUDS[..]), ("others", &readers::OTHERS)] {
            let Some(first) = kinds.iter().position(|k| *k == kind) else { continue };
            let file = folder.join(target).join(format!("{number:02}-{kind}"));
            std::fs::create_dir_all(folder.join(target))?;
            std::fs::write(file, [&[first as u8], &content[..]].concat())?;
        }
    }
    folders_of(&folder)
}
