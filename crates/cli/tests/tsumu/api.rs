//! The library's face is what its page says, and an example of twenty lines does what the program does.

use crate::site::{copy, files, ok};
use std::collections::BTreeSet;
use std::path::Path;

#[path = "../../../../examples/02_plan.rs"]
mod example;

fn text(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Names after `pub use`, and public modules.
fn exported() -> BTreeSet<String> {
    let source = text("crates/tsumu/src/lib.rs");
    let uses = source.split("pub use ").skip(1).map(|u| u.split(';').next().unwrap());
    let names = uses.flat_map(|u| {
        let list = u.split_once('{').map_or(u.rsplit("::").next().unwrap(), |l| l.1);
        list.trim_end_matches(['}', '\n', ' ', ',']).split(',').map(str::trim).collect::<Vec<_>>()
    });
    let names = names.map(|n| n.rsplit(" as ").next().unwrap().to_string());
    let modules = source.lines().filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';'));
    names.chain(modules.map(String::from)).collect()
}

/// Names in the first column of the page's tables.
fn described() -> BTreeSet<String> {
    let page = text("docs/api.md");
    let cells = page.lines().filter(|l| l.starts_with("| `")).map(|l| l.split('|').nth(1).unwrap());
    cells.flat_map(|c| c.split('`').skip(1).step_by(2)).map(String::from).collect()
}

#[test]
fn the_page_names_what_is_exported() {
    let (exported, described) = (exported(), described());
    assert!(exported.len() > 20 && exported.contains("Site"), "{exported:?}");
    assert_eq!(exported, described);
    assert!(text("docs/api.md").lines().count() <= 60, "docs/api.md is more than a screen");
}

#[test]
fn the_example_gives_the_bytes_of_the_command() {
    let site = copy();
    let (by_command, by_example) = (site.path().join("run"), site.path().join("example"));
    ok(&["run", &site.path().to_string_lossy()]);
    example::run(site.path(), &by_example).unwrap();
    let apart = ["timing.json", "manifest.json"];
    let results = |folder: &Path| -> Vec<_> {
        let all = files(folder).into_iter();
        all.filter(|(name, _)| !apart.iter().any(|n| name == Path::new(n))).collect()
    };
    let (a, b) = (results(&by_command), results(&by_example));
    assert_eq!(a.len(), b.len());
    for ((name, x), (other, y)) in a.iter().zip(&b) {
        assert_eq!(name, other);
        assert!(x == y, "{} differs", name.display());
    }
    // Manifests name the program that wrote them, and nothing else is otherwise.
    let manifest = |folder: &Path| {
        let text = std::fs::read_to_string(folder.join("manifest.json")).unwrap();
        let mut all: serde_json::Value = serde_json::from_str(&text).unwrap();
        let program = all["notes"].as_object_mut().unwrap().remove("program_file").unwrap();
        all.as_object_mut().unwrap().remove("own_blake3").unwrap();
        (all, program)
    };
    let (a, b) = (manifest(&by_command), manifest(&by_example));
    assert_eq!(a.0, b.0);
    assert_ne!(a.1, b.1);
}
