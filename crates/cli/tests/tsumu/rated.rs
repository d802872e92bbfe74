//! What people who build say of a plan teaches the next one; the plan as the crane works it off; the next block on what stands.

use crate::site::{copy, ok, tsumu};
use serde_json::{Value, json};
use std::path::Path;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// Rows of a table by column name.
fn table(file: &Path) -> Vec<std::collections::BTreeMap<String, String>> {
    let all = std::fs::read_to_string(file).unwrap();
    let mut lines = all.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    lines
        .map(|l| head.iter().map(|h| h.to_string()).zip(l.split(',').map(String::from)).collect())
        .collect()
}

/// What the page's script is given.
fn page(run: &Path) -> Value {
    let html = std::fs::read_to_string(run.join("report.html")).unwrap();
    let from = html.find("id=\"view-data\">").unwrap() + "id=\"view-data\">".len();
    let end = from + html[from..].find("</script>").unwrap();
    serde_json::from_str(&html[from..end]).unwrap()
}

#[test]
fn ratings_teach_and_the_site_is_built_block_by_block() {
    let site = copy();
    let run = site.path().join("run");
    ok(&["run", &text(site.path()), "--plans", "0"]);
    let (placements, data) = (table(&run.join("plan/placements.csv")), page(&run));
    let kept: Vec<_> = placements.iter().filter(|p| p["state"] == "kept").collect();
    let signs = data["rating"]["signs"].as_array().unwrap();
    assert_eq!(signs.len(), kept.len());
    assert_eq!(data["rating"]["site"], "Tiny <site> & test");

    // Everything that touches little is called loose, the rest good.
    let number =
        |p: &std::collections::BTreeMap<String, String>, key: &str| p[key].parse::<f64>().unwrap();
    let rated: Vec<Value> = kept
        .iter()
        .zip(signs)
        .map(|(p, signs)| {
            let rating = if number(p, "contacts") < 3.0 { "loose" } else { "good" };
            let place = json!({ "model": p["model"], "x_m": number(p, "rest_x_m"), "y_m": number(p, "rest_y_m"),
                                "z_m": number(p, "rest_z_m"), "signs": signs });
            json!({ "by": "Sato", "when": "2026-11-30", "order": number(p, "order") as u32, "rating": rating, "place": place })
        })
        .collect();
    let ratings =
        json!({ "format": 1, "site": "Tiny <site> & test", "blocks": rated, "pairs": [] });
    let file = site.path().join("ratings.json");
    std::fs::write(&file, ratings.to_string()).unwrap();
    let out = site.path().join("next");
    let said = ok(&["plan", &text(site.path()), "--plans", "0", "--out", &text(&out)]).out;
    assert!(said.contains(&format!("{} ratings and 0 choices by Sato", kept.len())), "{said}");
    let manifest: Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["notes"]["ratings"]["by"]["Sato"][0], kept.len());
    assert!(manifest["inputs"]["ratings.json"]["blake3"].is_string());
    let weights = std::fs::read_to_string(out.join("plan/weights.json")).unwrap();
    assert!(weights.contains("\"loose\""), "{weights}");
    // Every block keeps the rules it kept before.
    assert!(
        table(&out.join("plan/placements.csv"))
            .iter()
            .filter(|p| p["state"] == "kept")
            .all(|p| number(p, "contacts") >= 1.0)
    );

    for (right, wrong, why) in [
        ("Tiny <site> & test", "Other", "rates a plan of \"Other\""),
        ("tetrapod-5t", "huge", "is a \"huge\""),
        ("\"order\":1,", "\"order\":1,\"x\":0,", "ratings.json, line"),
    ] {
        std::fs::write(&file, ratings.to_string().replacen(right, wrong, 1)).unwrap();
        let refused = tsumu(&["plan", &text(site.path()), "--out", &text(&out)]);
        assert!(refused.code == 2 && refused.err.contains(why), "{why}: {}", refused.err);
    }
    std::fs::remove_file(&file).unwrap();

    let (lifts, unfilled) = (table(&run.join("plan/lifts.csv")), run.join("plan/unfilled.csv"));
    assert_eq!(lifts.len(), kept.len());
    assert!(table(&unfilled).iter().all(|u| !u["reason"].is_empty() && number(u, "void_m3") > 0.0));

    // The first block stands 5 cm off: the next is told, and the numbers in the list are the plan's.
    let placed = site.path().join("as_placed.csv");
    let first = &lifts[0];
    let list = format!(
        "order,x_m,y_m,rest_level_m\n1,{},{},{}\n",
        number(first, "x_m") + 0.05,
        first["y_m"],
        first["rest_level_m"]
    );
    std::fs::write(&placed, list).unwrap();
    let arguments = ["next", &text(site.path()), "--placed", &text(&placed), "--count", "3"];
    let said = ok(&arguments).out;
    assert!(said.contains("block 2 (") && said.contains("highest leg"), "{said}");
    std::fs::write(&placed, "order,x_m,y_m,rest_level_m\n999,0,0,0\n").unwrap();
    let refused = tsumu(&arguments);
    assert!(
        refused.code == 2 && refused.err.contains("block 999 is not in the plan"),
        "{}",
        refused.err
    );
}
