//! What goes out: the program, the list of its components, and their checksums, after everything was checked.

use crate::check;
use crate::package::{self, Wanted};
use crate::process::{command, output};
use crate::root;
use anyhow::{Context, Result, bail};
use std::process::ExitCode;

pub fn release(args: &[&str]) -> Result<()> {
    let (dry, targets) = match args {
        ["--dry-run"] => (true, Vec::new()),
        targets if targets.iter().all(|t| !t.starts_with('-')) => (false, targets.to_vec()),
        _ => bail!("`release [--dry-run | TARGET...]`"),
    };
    let version = version()?;
    let wrong = unready(&version)?;
    for fault in &wrong {
        println!("not ready: {fault}");
    }
    if dry {
        println!("version {version}; a release would check, build, list and sum up");
        return Ok(());
    }
    if !wrong.is_empty() {
        bail!("version {version} is not ready; docs/release.md has the list");
    }
    if check::check(&["--strict"])? != ExitCode::SUCCESS {
        bail!("a check failed, so nothing is released");
    }
    let folder = package::pack(&Wanted { version: &version, profile: "dist", targets })?;
    println!("{}", folder.display());
    println!("now: git tag -s v{version} (docs/release.md)");
    Ok(())
}

/// The version of the workspace.
pub fn version() -> Result<String> {
    let table: toml::Table = std::fs::read_to_string(root().join("Cargo.toml"))?.parse()?;
    let package = table.get("workspace").and_then(|w| w.get("package"));
    let version = package.and_then(|p| p.get("version")).and_then(|v| v.as_str());
    Ok(version.context("Cargo.toml has no [workspace.package] version")?.to_owned())
}

/// What stands in the way of this version.
fn unready(version: &str) -> Result<Vec<String>> {
    let mut wrong = Vec::new();
    let changes = std::fs::read_to_string(root().join("CHANGELOG.md"))?;
    if !released(&changes, version) {
        wrong.push(format!("CHANGELOG.md has no heading `## {version} (date)`"));
    }
    if !output(command("git", ["status", "--porcelain"]))?.trim().is_empty() {
        wrong.push("the working tree has changes that are not committed".into());
    }
    if !output(command("git", ["tag", "--list", &format!("v{version}")]))?.trim().is_empty() {
        wrong.push(format!("the tag v{version} exists already; raise the version in Cargo.toml"));
    }
    Ok(wrong)
}

/// Whether a changelog has a dated heading for the version.
fn released(changes: &str, version: &str) -> bool {
    let heading = format!("## {version} (");
    changes.lines().any(|line| line.starts_with(&heading) && line.ends_with(')'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_is_released_by_its_dated_heading() {
        let changes = "# Changes\n## Unreleased\n## 0.2.0 (2026-11-30)\n";
        assert!(released(changes, "0.2.0"));
        assert!(!released(changes, "0.2") && !released(changes, "0.3.0"));
        assert!(!released("## 0.2.0\n", "0.2.0"));
    }

    #[test]
    fn the_workspace_has_a_version() {
        assert_eq!(version().unwrap(), env!("CARGO_PKG_VERSION"));
    }
}
