//! The table of rooms in ARCHITECTURE.md is true: every crate uses what its row says and nothing else, externals stay behind
//! their walls, and no file of the program leans on a file that leans on it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A row of the table.
struct Room {
    layer: String,
    uses: BTreeSet<String>,
}

/// Rows by crate, in the table's order.
fn rooms() -> Vec<(String, Room)> {
    let page = std::fs::read_to_string(root().join("ARCHITECTURE.md"))
        .expect("the page ships with the repository");
    page.lines()
        .filter_map(|line| {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            let name = cells.get(2)?.strip_prefix('`')?.strip_suffix('`')?;
            let uses = cells.get(3)?.split_whitespace().map(String::from).collect();
            Some((name.to_string(), Room { layer: cells[1].into(), uses }))
        })
        .collect()
}

/// A crate's folder with its manifest.
struct Package {
    folder: PathBuf,
    manifest: toml::Table,
}

impl Package {
    fn dependencies(&self, kind: &str) -> BTreeSet<String> {
        let table = self.manifest.get(kind).and_then(|d| d.as_table());
        table.into_iter().flat_map(|t| t.keys().cloned()).collect()
    }

    /// All Rust text below some of its folders, its build script not.
    fn text(&self, folders: &[&str]) -> String {
        let files = folders.iter().flat_map(|f| rust_files(&self.folder.join(f)));
        files.map(|f| std::fs::read_to_string(f).expect("readable")).collect()
    }
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let (mut found, mut open) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(here) = open.pop() {
        for entry in std::fs::read_dir(here).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found
}

/// Our crates by name.
fn packages() -> BTreeMap<String, Package> {
    let folders = std::fs::read_dir(root().join("crates")).expect("the workspace has crates");
    let folders =
        folders.map(|entry| entry.expect("readable").path()).chain([root().join("python")]);
    let package = |folder: PathBuf| {
        let text = std::fs::read_to_string(folder.join("Cargo.toml")).ok()?;
        let manifest: toml::Table = text.parse().expect("cargo has read it already");
        let name = manifest["package"]["name"].as_str().expect("a package has a name").to_string();
        Some((name, Package { folder, manifest }))
    };
    folders.filter_map(package).collect()
}

#[test]
fn every_crate_uses_what_its_row_says() {
    let (rooms, packages) = (rooms(), packages());
    let ours: BTreeSet<&String> = packages.keys().collect();
    assert_eq!(ours, rooms.iter().map(|r| &r.0).collect(), "rows and crates are not the same");
    for (name, room) in &rooms {
        let used = packages[name].dependencies("dependencies");
        let used: BTreeSet<&String> = used.iter().filter(|d| ours.contains(d)).collect();
        assert_eq!(used, room.uses.iter().collect(), "`{name}` uses / its row says");
    }
}

#[test]
fn arrows_point_up_the_list_only() {
    let rooms = rooms();
    let place = |name: &str| rooms.iter().position(|(n, _)| n == name);
    for (name, room) in &rooms {
        for other in &room.uses {
            assert!(place(other) < place(name), "`{name}` may use `{other}`, which comes after it");
        }
    }
}

/// Tests may look up to the stages, not to what stands above them.
#[test]
fn tests_lean_on_no_crate_above_the_stages() {
    let rooms: BTreeMap<String, Room> = rooms().into_iter().collect();
    for (name, package) in packages() {
        for other in package.dependencies("dev-dependencies") {
            let Some(room) = rooms.get(&other) else { continue };
            assert!(
                ["base", "engine", "stage"].contains(&room.layer.as_str())
                    || rooms[&name].uses.contains(&other),
                "the tests of `{name}` use `{other}`"
            );
        }
    }
}

#[test]
fn no_arrow_is_unused() {
    let packages = packages();
    for (name, package) in &packages {
        let mentions = |text: &str, other: &str| {
            let word = format!("{}::", other.replace('-', "_"));
            text.match_indices(&word).any(|(at, _)| {
                !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':')
            })
        };
        for (kind, folders) in [
            ("dependencies", &["src"][..]),
            ("dev-dependencies", &["src", "tests", "examples", "benches"]),
        ] {
            let text = package.text(folders);
            let ours = package.dependencies(kind).into_iter().filter(|d| packages.contains_key(d));
            for other in ours {
                assert!(
                    mentions(&text, &other),
                    "`{name}` names `{other}` as {kind} and uses it nowhere"
                );
            }
        }
    }
}

/// Python is spoken to by its package alone, which no command line needs.
#[test]
fn the_interpreter_stays_behind_its_wall() {
    for (name, package) in packages() {
        let speaks = package.dependencies("dependencies").contains("pyo3");
        assert_eq!(speaks, name == "tsumu-python", "`{name}`");
    }
}

/// Libraries know no command line, and Burn is spoken to by its wall alone.
#[test]
fn externals_stay_behind_their_walls() {
    let rooms: BTreeMap<String, Room> = rooms().into_iter().collect();
    let (mut clap, mut burn) = (0, 0);
    for (name, package) in packages() {
        let used = package.dependencies("dependencies");
        for external in ["clap", "indicatif", "ctrlc"] {
            if used.contains(external) {
                assert_eq!(rooms[&name].layer, "app", "`{name}` uses {external}");
                clap += 1;
            }
        }
        if used.iter().any(|external| external.starts_with("burn")) {
            assert_eq!(name, "net", "`{name}` uses burn");
            burn += 1;
        }
    }
    assert!(clap > 2 && burn == 1, "the test looks at nothing");
}

/// What trains and judges the program is no part of it.
#[test]
fn the_program_holds_nothing_that_it_never_runs() {
    let packages = packages();
    let mut closure = BTreeSet::from(["tsumu-cli".to_string()]);
    let mut open = vec!["tsumu-cli".to_string()];
    while let Some(name) = open.pop() {
        for other in packages[&name].dependencies("dependencies") {
            if packages.contains_key(&other) && closure.insert(other.clone()) {
                open.push(other);
            }
        }
    }
    for other in ["teach", "reproduce", "peers", "lab"] {
        assert!(packages.contains_key(other) && !closure.contains(other), "{other}");
    }
    assert!(closure.contains("tsumu") && closure.contains("geom"));
}

/// Files of the program by module path, with the modules each names.
fn modules(src: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let path_of = |file: &Path| {
        let inside = file.strip_prefix(src).expect("below src").with_extension("");
        let text = inside.to_string_lossy().replace(['/', '\\'], "::");
        text.strip_suffix("::mod").unwrap_or(&text).to_string()
    };
    let files = rust_files(src);
    let names: BTreeSet<String> = files.iter().map(|f| path_of(f)).collect();
    let named = |file: &PathBuf| {
        let text = std::fs::read_to_string(file).expect("readable");
        let own = path_of(file);
        let parent = own.rsplit_once("::").map_or("", |p| p.0);
        let full =
            text.replace("super::", &format!("crate::{parent}::")).replace("crate::::", "crate::");
        let found = names.iter().filter(|n| **n != own && full.contains(&format!("crate::{n}::")));
        (own.clone(), found.cloned().collect())
    };
    files.iter().map(named).collect()
}

#[test]
fn no_files_of_the_program_lean_on_each_other() {
    let modules = modules(&root().join("crates/cli/src"));
    assert!(modules.len() > 8);
    for start in modules.keys() {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(name) = open.pop() {
            for next in modules.get(name).into_iter().flatten() {
                assert_ne!(next, start, "{start} leans on {name}, which leans on {start}");
                if seen.insert(next) {
                    open.push(next);
                }
            }
        }
    }
}

/// The command line is thin: flags, calls and words.
#[test]
fn the_program_stays_small() {
    let lines = |name: &str, folder: &str| {
        rust_files(&root().join("crates").join(name).join(folder))
            .iter()
            .map(|f| std::fs::read_to_string(f).expect("readable").lines().count())
            .sum::<usize>()
    };
    assert!(lines("cli", "src") <= 2000, "{}", lines("cli", "src"));
    assert!(lines("pipeline", "src") <= 700, "{}", lines("pipeline", "src"));
    for file in rust_files(&root().join("crates/cli/src/cmd")) {
        let text = std::fs::read_to_string(&file).expect("readable");
        let mut begin = None;
        for (n, line) in text.lines().enumerate() {
            let head = line.trim_start_matches("pub ");
            if head.starts_with("fn ") {
                begin = Some((n, head.to_string()));
            }
            if line == "}"
                && let Some((start, head)) = begin.take()
            {
                assert!(n - start < 40, "{}: {head} has {} lines", file.display(), n - start + 1);
            }
        }
    }
}
