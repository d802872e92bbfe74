//! Before a run and beside it: a first site, sizes from the survey, gridded surveys, halves of a survey against each other.

use crate::site::{CATALOG, RECIPE, SITE, copy, ok, shared, tsumu};
use serde_json::Value;
use std::path::Path;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// The value of an event among lines of JSON.
fn event(out: &str, name: &str) -> Value {
    let all = out.lines().map(|l| serde_json::from_str::<Value>(l).expect("lines of JSON"));
    all.into_iter().find(|e| e["event"] == name).unwrap_or_else(|| panic!("{out}"))["value"].clone()
}

/// The tiny site with its survey delivered as a grid of this cell.
fn gridded(cell_m: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let delivery = format!("{RECIPE}\n[delivery]\ncell_m = {cell_m}\n");
    std::fs::write(at("recipe.toml"), delivery.replace("220.0", "900.0")).unwrap();
    std::fs::write(at("catalog.toml"), CATALOG).unwrap();
    std::fs::write(at("site.toml"), SITE.split("[design]").next().unwrap()).unwrap();
    let origin = ["--site-crs", "EPSG:6679", "--site-origin", "41250,-98760,1.5", "--seed", "3"];
    let (recipe, catalog, out) =
        (text(&at("recipe.toml")), text(&at("catalog.toml")), text(&at("")));
    let words = ["synth", &recipe, "--catalog", &catalog, "--out", &out];
    ok(&[&words[..], &origin[..]].concat());
    folder
}

#[test]
fn size_and_kind_come_from_the_survey_alone() {
    let survey = text(&shared().join("survey.laz"));
    let words = ["blocks", "fit", &survey, "--kind", "tetrapod", "--from", "1.4", "--to", "4"];
    let found = event(&ok(&[&words[..], &["--json"]].concat()).out, "blocks-fit");
    let size_m = found[0]["size_m"].as_f64().unwrap();
    assert!((size_m / 2.0 - 1.0).abs() < 0.03, "{found:#}");
    assert!(found[0]["nominal"].as_str().unwrap().starts_with("tetrapod"), "{found:#}");
    let ran = tsumu(&["blocks", "fit", &survey, "--kind", "teapot"]);
    assert!(ran.code == 2 && ran.err.contains("hollow-tetrahedron-like"), "{}", ran.err);
    let ran = tsumu(&["blocks", "fit", &survey, "--from", "3", "--to", "2"]);
    assert!(ran.code == 2 && ran.err.contains("--from"), "{}", ran.err);
}

#[test]
fn a_check_holds_the_size_against_the_catalogue() {
    let site = copy();
    let found = event(&ok(&["check", &text(site.path()), "--json"]).out, "check");
    assert_eq!(found["can_be_answered"], true, "{found:#}");
    assert!(found["surface"]["spacing_m"].as_f64().unwrap() < 0.2, "{found:#}");
    // A tenth off: said, and refused before an hour of work.
    std::fs::write(site.path().join("catalog.toml"), CATALOG.replace("2.0", "1.75")).unwrap();
    let ran = tsumu(&["check", &text(site.path())]);
    assert_eq!(ran.code, 2, "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("fits") && ran.err.contains("catalogue says"), "{}", ran.err);
}

/// Waves have a size that fits best too; where none of its blocks is sure, it is no reason to refuse the catalogue's.
#[test]
fn a_surface_without_blocks_shows_no_size() {
    let site = tempfile::tempdir().unwrap();
    let even = |i: usize, step: f64| (i as f64 * step).fract() * 10.0 - 5.0;
    let row = |i: usize| {
        let (x, y) = (even(i, 0.618_034), even(i, 0.754_878));
        let z = 2.0 - 0.04 * (x * x + y * y) + 0.5 * (2.0 * x).sin() * (2.0 * y).sin();
        format!("{:.3},{:.3},{z:.3}\n", 41_250.0 + x, -98_760.0 + y)
    };
    let rows: String = (0..6000).map(row).collect();
    std::fs::write(site.path().join("a.csv"), format!("x,y,z\n{rows}")).unwrap();
    std::fs::write(site.path().join("catalog.toml"), CATALOG).unwrap();
    let text_of = "name = \"waves\"\ncrs = \"EPSG:6679\"\n[[survey]]\nfile = \"a.csv\"\nvertical_offset_m = 0.0\n";
    std::fs::write(site.path().join("site.toml"), text_of).unwrap();
    let found = event(&ok(&["check", &text(site.path()), "--json"]).out, "check");
    let wrong = |c: &&Value| c["code"] == "size" && c["severity"] == "refusal";
    let complaints = found["complaints"].as_array().unwrap();
    assert!(!complaints.iter().any(|c| wrong(&c)), "{found:#}");
    assert_eq!(found["sizes"], serde_json::json!([]), "{found:#}");
}

#[test]
fn grids_are_told_and_wide_cells_refused() {
    let fine = gridded(0.15);
    let ran = ok(&["check", &text(fine.path())]);
    assert!(ran.out.contains("grid of 150 mm"), "{}", ran.out);
    // Whether blocks can be told in it is not for this test.
    let ran = tsumu(&["run", &text(fine.path()), "-v"]);
    assert!(ran.code < 2 && ran.err.contains("grid of 150 mm"), "{}{}", ran.out, ran.err);
    let wide = gridded(0.4);
    for command in ["check", "run"] {
        let ran = tsumu(&[command, &text(wide.path())]);
        assert_eq!(ran.code, 2, "{}{}", ran.out, ran.err);
        assert!(ran.err.contains("cells of the grid"), "{}", ran.err);
    }
}

#[test]
fn halves_of_a_survey_are_held_against_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let (survey, catalog) = (shared().join("survey.laz"), shared().join("catalog.toml"));
    let (survey, catalog, out) = (text(&survey), text(&catalog), text(folder.path()));
    let words = ["recognise", &survey, "--catalog", &catalog, "--out", &out, "--self-check"];
    let ran = ok(&words);
    assert!(ran.out.contains("self-check by every other point"), "{}", ran.out);
    let summary = std::fs::read_to_string(folder.path().join("recognise/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    let check = &summary["self_check"];
    assert_eq!(check["split"], "points");
    assert!(check["matched"].as_u64().unwrap() >= 3, "{check:#}");
    assert!(check["p95_displacement_m"].as_f64().unwrap() < 0.1, "{check:#}");
    let blocks = std::fs::read_to_string(folder.path().join("recognise/blocks.csv")).unwrap();
    assert!(blocks.lines().next().unwrap().ends_with("legs_seen,legs_hidden,legs_missing"));
}

#[test]
fn a_first_site_needs_two_commands() {
    let folder = tempfile::tempdir().unwrap();
    let (survey, site) = (text(&shared().join("survey.laz")), text(&folder.path().join("site")));
    ok(&["init", &survey, "--block", "tetrapod 2m", "--out", &site]);
    ok(&["run", &site, "--plans", "0"]);
    assert!(folder.path().join("site/run/report.html").is_file());
    // A site that is there stays as it is.
    assert_eq!(tsumu(&["init", &survey, "--out", &site]).code, 2);
}
