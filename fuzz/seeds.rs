//! Writes the small valid files that the targets damage: `seeds FOLDER` fills FOLDER/clouds and FOLDER/others.

#[path = "../crates/io/tests/files/foreign.rs"]
mod foreign;
#[path = "../crates/io/tests/hostile/readers.rs"]
mod readers;
#[path = "../crates/io/tests/files/sample.rs"]
mod sample;
#[path = "../crates/io/tests/hostile/seeds.rs"]
mod seeds;

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
    Ok(())
}
