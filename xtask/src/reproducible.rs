//! The program built twice, in two checkouts of other names with build folders of their own: the same bytes, or it is told where
//! they part.

use crate::check::built;
use crate::package::reproducibly;
use crate::process::{cargo, command, done};
use anyhow::{Result, bail};
use std::fs;
use std::path::{Path, PathBuf};

/// Places of both: other names, other lengths, other depths.
const PLACES: [&str; 2] = ["one", "another/with-a-longer-name"];

/// What is built.
struct Wanted<'a> {
    profile: &'a str,
    package: &'a str,
    program: &'a str,
}

/// `reproducible [--profile P] [PACKAGE PROGRAM]`
pub fn reproducible(args: &[&str]) -> Result<()> {
    let (profile, rest) = match args {
        ["--profile", profile, rest @ ..] => (*profile, rest),
        rest => ("dist", rest),
    };
    let (package, program) = match rest {
        [] => ("tsumu-cli", "tsumu"),
        [package, program] => (*package, *program),
        _ => bail!("`reproducible [--profile P] [PACKAGE PROGRAM]`"),
    };
    let wanted = Wanted { profile, package, program };
    let folder = built().join("reproducible");
    let [first, second] = PLACES.map(|place| built_at(&folder.join(place), &wanted));
    let (first, second) = (first?, second?);
    let [a, b] = [fs::read(&first)?, fs::read(&second)?];
    done(command("sha256sum", [&first, &second]))?;
    if a == b {
        println!("{} bytes, the same in both", a.len());
        return Ok(());
    }
    let apart = a.iter().zip(&b).position(|(x, y)| x != y).unwrap_or(a.len().min(b.len()));
    bail!("{} and {} bytes, which part at byte {apart}", a.len(), b.len())
}

/// The committed tree at a place, and the program built of it there.
fn built_at(place: &Path, wanted: &Wanted) -> Result<PathBuf> {
    let (tree, target) = (place.join("tree"), place.join("target"));
    if tree.exists() {
        fs::remove_dir_all(&tree)?;
    }
    fs::create_dir_all(place)?;
    let tree_name = tree.display().to_string();
    done(command("git", ["clone", "--quiet", "--no-hardlinks", ".", &tree_name]))?;
    let Wanted { profile, package, program } = *wanted;
    let mut cargo =
        cargo(&["build", "--profile", profile, "--locked", "-p", package, "--bin", program]);
    cargo.current_dir(&tree);
    // The flags are in its environment.
    reproducibly(&mut cargo, &tree, &target)?;
    done(cargo)?;
    let folder = if profile == "dev" { "debug" } else { profile };
    Ok(target.join(folder).join(program))
}
