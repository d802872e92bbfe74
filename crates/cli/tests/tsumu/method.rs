//! `--method thesis` changes what it says, is recorded, and goes together with other choices.

use crate::site::{copy, ok, tsumu};
use std::path::Path;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn config(folder: &Path) -> toml::Table {
    std::fs::read_to_string(folder.join("config.toml")).unwrap().parse().unwrap()
}

fn word<'a>(config: &'a toml::Table, table: &str, key: &str) -> &'a str {
    config[table][key].as_str().unwrap()
}

#[test]
fn the_chain_of_the_thesis_by_one_word() {
    let site = copy();
    let runs = tempfile::tempdir().unwrap();
    let (thesis, again, mixed) =
        (runs.path().join("thesis"), runs.path().join("again"), runs.path().join("mixed"));
    let folder = text(site.path());
    let run = |args: &[&str], out: &Path| {
        let out = text(out);
        ok(&[&["run", &folder, "--plans", "0", "--out", &out], args].concat())
    };
    run(&["--method", "thesis"], &thesis);
    let used = config(&thesis);
    assert_eq!(used["method"].as_str(), Some("thesis"));
    assert_eq!(word(&used, "segment", "clustering"), "embedding");
    assert_eq!(word(&used, "pose", "method"), "ppf");
    assert_eq!(word(&used, "plan", "policy"), "random");
    assert_eq!(used["pose"]["ppf"]["icp"].as_str(), Some("point-to-point"));
    assert_eq!(used["pose"]["verification"].as_bool(), Some(false));
    let manifest = std::fs::read_to_string(thesis.join("manifest.json")).unwrap();
    assert!(
        manifest.contains("\"method\": \"thesis\"") || manifest.contains("\"method\":\"thesis\"")
    );
    // Its settings given back repeat it without the word.
    run(&["--config", &text(&thesis.join("config.toml"))], &again);
    let blocks = |folder: &Path| std::fs::read(folder.join("recognise/blocks.csv")).unwrap();
    assert_eq!(blocks(&thesis), blocks(&again));
    // The stages differ from ours.
    let ours = runs.path().join("ours");
    run(&[], &ours);
    assert_ne!(blocks(&thesis), blocks(&ours));
    let labels = |folder: &Path| std::fs::read(folder.join("segment/cloud.laz")).unwrap();
    assert_ne!(labels(&thesis), labels(&ours));
    assert!(!config(&ours).contains_key("method"));
    // Another policy goes with it, and what is therefore not the thesis' is said.
    let ran = run(&["--method", "thesis", "--policy", "search"], &mixed);
    assert_eq!(word(&config(&mixed), "plan", "policy"), "search");
    assert!(ran.err.contains("plan.policy"), "{}", ran.err);
    assert_eq!(blocks(&mixed), blocks(&thesis));
}

#[test]
fn generate_and_test_is_a_number_of_drops() {
    let site = copy();
    let out = text(&site.path().join("run"));
    let ran = tsumu(&["run", &text(site.path()), "--out", &out, "--drops", "5"]);
    assert!(ran.code == 2 && ran.err.contains("--policy random"), "{}", ran.err);
}
