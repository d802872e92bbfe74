//! The gate on foreign data: piles of another engine and scanner, bins and real clouds (`tools/oracle/bench_trust.py`).

use crate::check::built;
use crate::process::{cargo, command, done, works};
use crate::root;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

const REQUIREMENTS: &str = "tools/oracle/requirements-foreign.txt";

/// Builds the program, installs what the scripts need, and hands the flags on; `OUT/trust.md` is the table.
pub fn trust(args: &[&str]) -> Result<()> {
    let (out, flags) = out_and_flags(args)?;
    std::fs::create_dir_all(&out)?;
    let out = out.canonicalize()?;
    let python = python(&built().join("trust-python"))?;
    done(cargo(&["build", "--release", "--locked", "--bin", "tsumu"]))?;
    let text = |path: &Path| path.display().to_string();
    let mut gate = command(&text(&python), ["tools/oracle/bench_trust.py"]);
    gate.args(["--tsumu", &text(&built().join("release/tsumu"))]);
    gate.args(["--scenes", &text(&out.join("scenes")), "--runs", &text(&out.join("runs"))]);
    gate.args(["--out", &text(&out.join("trust.md"))]).args(flags);
    done(gate)
}

/// The folder for scenes, runs and table, and what the script is told.
fn out_and_flags<'a>(args: &[&'a str]) -> Result<(PathBuf, Vec<&'a str>)> {
    match args {
        [out, flags @ ..] if !out.starts_with('-') => Ok((out.into(), flags.to_vec())),
        _ => bail!(
            "OUT, the folder for scenes, runs and table, is missing: `bench trust OUT [--seeds 12,13] [--only CONDITION,…] \
             [--shapes SHAPE,…] [--data DIR] [--check] [--again]`"
        ),
    }
}

/// A Python with the packages of [`REQUIREMENTS`], in a folder of its own.
fn python(folder: &Path) -> Result<PathBuf> {
    let python = folder.join("bin/python");
    let stamp = folder.join("requirements.txt");
    let wanted = std::fs::read_to_string(root().join(REQUIREMENTS)).context(REQUIREMENTS)?;
    if std::fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
        return Ok(python);
    }
    let Some(system) = ["python3", "python"].into_iter().find(|p| works(command(p, ["--version"])))
    else {
        bail!("no Python found; install Python 3.11 or later");
    };
    let text = |path: &Path| path.display().to_string();
    done(command(system, ["-m", "venv", &text(folder)]))?;
    done(command(&text(&python), ["-m", "pip", "install", "--quiet", "-r", REQUIREMENTS]))?;
    std::fs::write(&stamp, wanted)?;
    Ok(python)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_comes_first_and_flags_are_handed_on() {
        let (out, flags) = out_and_flags(&["out", "--seeds", "12"]).unwrap();
        assert_eq!((out, flags), (PathBuf::from("out"), vec!["--seeds", "12"]));
        assert!(out_and_flags(&["--seeds", "12"]).unwrap_err().to_string().contains("OUT"));
    }
}
