//! One tiny site from end to end.

use crate::site::{copy, files, ok, shared, tsumu};
use std::path::Path;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

#[test]
fn a_site_runs_to_a_plan_and_twice_to_the_same_bytes() {
    let site = copy();
    let runs = tempfile::tempdir().unwrap();
    let (one, two) = (runs.path().join("one"), runs.path().join("two"));
    ok(&["run", &text(site.path()), "--out", &text(&one), "--threads", "1"]);
    ok(&["run", &text(site.path()), "--out", &text(&two), "--threads", "2"]);

    let results = |folder: &Path| -> Vec<_> {
        files(folder).into_iter().filter(|(name, _)| name != Path::new("timing.json")).collect()
    };
    let (a, b) = (results(&one), results(&two));
    for ((name, x), (other, y)) in a.iter().zip(&b) {
        assert_eq!(name, other);
        assert!(x == y, "{} differs between two runs", name.display());
    }
    assert_eq!(a.len(), b.len());
    for wanted in [
        "recognise/blocks.csv",
        "plan/placements.csv",
        "report.html",
        "manifest.json",
        "segment/cloud.laz",
    ] {
        assert!(a.iter().any(|(name, _)| name == Path::new(wanted)), "{wanted} is missing");
    }

    // The truth is known: most of the few blocks must be found, at the right places.
    let metrics = runs.path().join("metrics.json");
    let truth = text(&shared().join("truth"));
    ok(&[
        "evaluate",
        "--truth",
        &truth,
        "--result",
        &text(&one),
        "--catalog",
        &text(&site.path().join("catalog.toml")),
        "--out",
        &text(&metrics),
    ]);
    let figures: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&metrics).unwrap()).unwrap();
    assert!(figures["pose_recall"].as_f64().unwrap() >= 0.7, "{figures:#}");
    assert!(figures["pose_precision"].as_f64().unwrap() >= 0.7, "{figures:#}");
    assert!(figures["mean_displacement_m"].as_f64().unwrap() < 0.05, "{figures:#}");

    // The stages alone: planning again from the run's files, the report again, and the hashes.
    let again = runs.path().join("again");
    ok(&[
        "plan",
        &text(&one),
        "--site",
        &text(site.path()),
        "--policy",
        "random",
        "--out",
        &text(&again),
    ]);
    // What made a result lies beside it, whichever command left it.
    for name in ["plan/placements.csv", "config.toml", "manifest.json"] {
        assert!(again.join(name).is_file(), "{name} is missing");
    }
    ok(&["verify", &text(&again), "--site", &text(site.path())]);
    assert!(std::fs::read_to_string(again.join("config.toml")).unwrap().contains("\"random\""));
    let page = runs.path().join("page.html");
    ok(&["report", &text(&one), "--site", &text(site.path()), "--out", &text(&page)]);
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(
        html == std::fs::read_to_string(one.join("report.html")).unwrap(),
        "not the run's own page"
    );
    assert!(html.contains("Tiny &lt;site&gt; &amp; test"), "the title is not escaped");
    assert!(
        !html.contains("http://") && !html.contains("https://"),
        "the report refers to the network"
    );
    ok(&["verify", &text(&one), "--site", &text(site.path())]);
    std::fs::write(one.join("recognise/blocks.csv"), "changed").unwrap();
    let verify = tsumu(&["verify", &text(&one)]);
    assert_eq!(verify.code, 1);
    assert!(verify.out.contains("blocks.csv"), "{}", verify.out);
}

#[test]
fn every_point_comes_back_labelled() {
    let folder = tempfile::tempdir().unwrap();
    let out = text(&folder.path().join("labelled.ply"));
    let survey = text(&shared().join("survey.laz"));
    let catalog = text(&shared().join("catalog.toml"));
    ok(&["segment", &survey, "--catalog", &catalog, "--out", &out]);
    let bytes = std::fs::read(&out).unwrap();
    let header = String::from_utf8_lossy(&bytes[..600.min(bytes.len())]).into_owned();
    assert!(header.contains("instance"), "{header}");
    let beside = |ending: &str| std::fs::read_to_string(format!("{out}{ending}")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&beside(".manifest.json")).unwrap();
    let stated = &manifest["outputs"]["labelled.ply"];
    assert_eq!(stated["bytes"].as_u64(), Some(bytes.len() as u64));
    assert!(manifest["inputs"]["survey.laz"]["blake3"].is_string(), "{manifest:#}");
    // A run and a loose cloud start from the same seed.
    assert_eq!(manifest["seed"], 0);
    let config = beside(".config.toml");
    assert!(config.contains("[segment]") && config.contains("[background]"), "{config}");
    let truth = tsumu(&[
        "segment",
        &survey,
        "--catalog",
        &catalog,
        "--out",
        &text(&folder.path().join("labelled.txt")),
    ]);
    assert_eq!(truth.code, 2, "{}", truth.err);
}

/// The FAQ's remedy for parts on no bin was once refused in site.toml.
#[test]
fn the_faqs_settings_are_accepted() {
    let faq =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/guide/faq.md"));
    let faq = faq.unwrap();
    let examples: Vec<&str> =
        faq.split("```toml").skip(1).map(|e| e.split("```").next().unwrap()).collect();
    assert!(examples.iter().any(|e| e.contains("bin = false")), "{examples:?}");
    for example in examples {
        let site = copy();
        let file = site.path().join("site.toml");
        let own = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, format!("{own}\n{example}")).unwrap();
        ok(&["run", &text(site.path()), "--plans", "0"]);
        // The settings a run leaves repeat it.
        let config = std::fs::read_to_string(site.path().join("run/config.toml")).unwrap();
        let (again, plain) = (site.path().join("again"), site.path().join("config.toml"));
        std::fs::write(&plain, &config).unwrap();
        std::fs::write(&file, own).unwrap();
        ok(&["run", &text(site.path()), "--config", &text(&plain), "--out", &text(&again)]);
        assert_eq!(std::fs::read_to_string(again.join("config.toml")).unwrap(), config);
        let read = |run: &Path| std::fs::read(run.join("recognise/blocks.csv")).unwrap();
        assert!(read(&again) == read(&site.path().join("run")));
    }
}

#[test]
fn events_are_json_lines() {
    let folder = tempfile::tempdir().unwrap();
    let ran = ok(&[
        "recognise",
        &text(&shared().join("survey.laz")),
        "--catalog",
        &text(&shared().join("catalog.toml")),
        "--out",
        &text(folder.path()),
        "--json",
    ]);
    let events: Vec<serde_json::Value> = ran
        .out
        .lines()
        .map(|l| serde_json::from_str(l).unwrap_or_else(|e| panic!("{e}: {l}")))
        .collect();
    assert!(events.iter().any(|e| e["event"] == "recognised"), "{}", ran.out);
}
