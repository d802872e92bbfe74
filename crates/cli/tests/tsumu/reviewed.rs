//! A review of a site's blocks stands in the next run, is recorded with what it changed, and is missed when it is new.

use crate::site::{copy, ok, tsumu};
use serde_json::{Value, json};
use std::path::Path;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn json_file(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Rows of `blocks.csv` by column name.
fn blocks(run: &Path) -> Vec<std::collections::BTreeMap<String, String>> {
    let table = std::fs::read_to_string(run.join("recognise/blocks.csv")).unwrap();
    let mut lines = table.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    lines
        .map(|l| head.iter().map(|h| h.to_string()).zip(l.split(',').map(String::from)).collect())
        .collect()
}

#[test]
fn a_review_stands_and_is_recorded() {
    let site = copy();
    let run = site.path().join("run");
    let arguments = ["run", &text(site.path()), "--plans", "0"];
    ok(&arguments);
    let before = blocks(&run);
    assert!(before.len() >= 3, "{before:?}");
    let decision = |i: usize, verdict: &str, lift_m: f64| {
        let of = |key: &str| before[i][key].parse::<f64>().unwrap();
        json!({ "block_id": of("block_id") as u32, "verdict": verdict, "model": before[i]["model"], "x_m": of("x_m"), "y_m": of("y_m"),
                "z_m": of("z_m") + lift_m, "qw": of("qw"), "qx": of("qx"), "qy": of("qy"), "qz": of("qz"),
                "fitness_m": of("fitness_m"), "occlusion": of("occlusion"), "note": "seen on site" })
    };
    let review = json!({ "format": 1, "reviewer": "Sato", "blocks":
        [decision(0, "rejected", 0.0), decision(1, "accepted", 0.0), decision(2, "corrected", 0.1)] });
    let file = site.path().join("review.json");
    std::fs::write(&file, review.to_string()).unwrap();

    // The run that was reviewed does not know the review yet, and says so.
    let verify = tsumu(&["verify", &text(&run), "--site", &text(site.path())]);
    assert_eq!(verify.code, 1);
    assert!(verify.out.contains("review.json: came after the run"), "{}", verify.out);
    let page = ok(&["report", &text(&run)]);
    assert!(page.err.contains("review.json is not the one this run applied"), "{}", page.err);

    let again = ok(&arguments);
    assert!(again.out.contains("3 decisions by Sato"), "{}", again.out);
    let after = blocks(&run);
    assert_eq!(after.len(), before.len() - 1);
    assert!(after.iter().all(|b| b["x_m"] != before[0]["x_m"]), "the rejected block is gone");
    let lifted =
        after.iter().find(|b| b["x_m"] == before[2]["x_m"]).expect("the corrected block is there");
    let z = |b: &std::collections::BTreeMap<String, String>| b["z_m"].parse::<f64>().unwrap();
    assert!((z(lifted) - z(&before[2]) - 0.1).abs() < 1e-3);
    assert_eq!(lifted["confidence"], "1");
    let manifest = json_file(&run.join("manifest.json"));
    let noted = &manifest["notes"]["review"];
    assert_eq!(noted["reviewer"], "Sato");
    let changed = |i: usize| noted["decisions"][i]["changed"].to_string();
    assert!(
        changed(0).contains("removed")
            && changed(1) == "[]"
            && changed(2).contains("moved by 0.100 m"),
        "{noted:#}"
    );
    assert!(manifest["inputs"]["review.json"]["blake3"].is_string());
    ok(&["verify", &text(&run), "--site", &text(site.path())]);
    let page = ok(&["report", &text(&run)]);
    assert!(!page.err.contains("review.json"), "{}", page.err);

    // A review changed since is noticed too, and `recognise` takes one by name.
    std::fs::write(&file, review.to_string().replace("Sato", "Suzuki")).unwrap();
    let verify = tsumu(&["verify", &text(&run), "--site", &text(site.path())]);
    assert!(verify.code == 1 && verify.out.contains("review.json: changed"), "{}", verify.out);
    let loose = site.path().join("loose");
    let survey = text(&site.path().join("survey.laz"));
    let catalog = text(&site.path().join("catalog.toml"));
    let recognise = [
        "recognise",
        &survey,
        "--catalog",
        &catalog,
        "--out",
        &text(&loose),
        "--seed",
        "5",
        "--review",
    ];
    let ran = ok(&[&recognise[..], &[&text(&file)]].concat());
    assert!(ran.out.contains("3 decisions by Suzuki"), "{}", ran.out);
    assert_eq!(json_file(&loose.join("manifest.json"))["notes"]["review"]["reviewer"], "Suzuki");
    assert_eq!(tsumu(&[&recognise[..], &["no-such.json"]].concat()).code, 2);
}
