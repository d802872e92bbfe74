//! The table of rooms in ARCHITECTURE.md is true: every crate uses only what its row allows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// crate → crates it may use, from the table.
fn allowed() -> BTreeMap<String, Vec<String>> {
    let page = std::fs::read_to_string(root().join("ARCHITECTURE.md"))
        .expect("the page ships with the repository");
    page.lines()
        .filter_map(|line| {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            let name = cells.get(2)?.strip_prefix('`')?.strip_suffix('`')?;
            let uses = cells.get(3)?.split_whitespace().map(String::from).collect();
            Some((name.to_string(), uses))
        })
        .collect()
}

/// Our crates named under `[dependencies]` of a manifest.
fn used(manifest: &Path, ours: &[String]) -> Vec<String> {
    let text =
        std::fs::read_to_string(manifest).unwrap_or_else(|e| panic!("{}: {e}", manifest.display()));
    let table: toml::Table = text.parse().expect("cargo has read it already");
    let dependencies =
        table.get("dependencies").and_then(|d| d.as_table()).cloned().unwrap_or_default();
    dependencies.keys().filter(|k| ours.contains(k)).cloned().collect()
}

#[test]
fn every_crate_uses_only_what_the_table_allows() {
    let allowed = allowed();
    let ours: Vec<String> = allowed.keys().cloned().collect();
    let mut folders = 0;
    for entry in std::fs::read_dir(root().join("crates")).expect("the workspace has crates") {
        let folder = entry.expect("readable").path();
        let manifest = folder.join("Cargo.toml");
        if !manifest.exists() {
            continue;
        }
        folders += 1;
        let folder_name =
            folder.file_name().expect("a crate folder has a name").to_string_lossy().into_owned();
        let name = if folder_name == "cli" { "tsumu".to_string() } else { folder_name };
        let may =
            allowed.get(&name).unwrap_or_else(|| panic!("ARCHITECTURE.md has no row for `{name}`"));
        for other in used(&manifest, &ours) {
            assert!(
                may.contains(&other),
                "`{name}` uses `{other}`, which its row in ARCHITECTURE.md does not allow"
            );
        }
    }
    assert_eq!(folders, allowed.len(), "ARCHITECTURE.md has rows for crates that do not exist");
}

#[test]
fn arrows_point_up_the_list_only() {
    let page = std::fs::read_to_string(root().join("ARCHITECTURE.md"))
        .expect("the page ships with the repository");
    let order: Vec<&str> = page
        .lines()
        .filter_map(|line| line.split('|').nth(2)?.trim().strip_prefix('`')?.strip_suffix('`'))
        .collect();
    let place = |name: &str| order.iter().position(|&n| n == name);
    for (name, uses) in allowed() {
        for other in uses {
            assert!(
                place(&other) < place(&name),
                "`{name}` may use `{other}`, which comes after it"
            );
        }
    }
}
