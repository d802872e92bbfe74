//! `tsumu evaluate --labels`: any labelled cloud against any other, and what is wrong with them in one line.

use crate::site::{ok, tsumu};
use serde_json::Value;
use std::path::Path;

/// A row of three parts of ten points; `label` gives each point's number.
fn rows(label: impl Fn(usize) -> i64) -> Vec<String> {
    (0..30).map(|i| format!("{}.5 {} 0.25 {}", 400_000 + i, 3_900_000 + i % 3, label(i))).collect()
}

fn write(folder: &Path, name: &str, rows: &[String]) -> String {
    let path = folder.join(name);
    std::fs::write(&path, rows.join("\n") + "\n").unwrap();
    path.to_string_lossy().into_owned()
}

fn figures(args: &[&str]) -> Value {
    let ran = ok(&[&["--json", "evaluate", "--labels"], args].concat());
    let line = ran.out.lines().find(|l| l.contains("\"labels\"")).expect("the figures");
    serde_json::from_str::<Value>(line).unwrap()["value"].clone()
}

#[test]
fn order_numbering_and_format_do_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let truth = write(folder.path(), "truth.txt", &rows(|i| [7_000_000_000, -1, 3][i / 10]));
    let mut turned = rows(|i| [12, 0, 900_000][i / 10]);
    turned.reverse();
    let result = write(folder.path(), "result.csv", &turned);
    let all = figures(&["--truth", &truth, "--result", &result]);
    assert_eq!(
        (&all["precision"], &all["recall"], &all["ap"]),
        (&1.0.into(), &1.0.into(), &1.0.into())
    );
    assert_eq!((&all["true_instances"], &all["unmatched_true_points"]), (&2.into(), &0.into()));
    // A third of one part is lost: IoU 2/3.
    let cut =
        write(folder.path(), "cut.txt", &rows(|i| if i > 25 { 0 } else { [5, 0, 6][i / 10] }));
    let of = |iou: &str| figures(&["--truth", &truth, "--result", &cut, "--iou", iou]);
    assert_eq!(
        (of("0.5")["true_positives"].clone(), of("0.75")["true_positives"].clone()),
        (2.into(), 1.into())
    );
    // Numbered from nought, 0 is a part.
    let nought = write(folder.path(), "nought.txt", &rows(|i| i as i64 / 10));
    let count = |side: &[&str]| {
        figures(&[&["--truth", &nought, "--result", &nought], side].concat())["true_instances"]
            .clone()
    };
    assert_eq!(count(&[]), 2);
    assert_eq!(count(&["--zero-is-instance", "both"]), 3);
}

#[test]
fn a_ply_of_fewer_points_is_matched_within_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let truth = write(folder.path(), "truth.txt", &rows(|i| i as i64 / 10 + 1));
    let mut ply = vec![
        "ply\nformat ascii 1.0\nelement vertex 20\nproperty double x\nproperty double y\nproperty double z\n\
         property int instance\nend_header"
            .to_string(),
    ];
    // −1 means none, also in a file whose numbers begin with 0.
    ply[0] = ply[0].replace("vertex 20", "vertex 21");
    ply.extend(rows(|i| i as i64 / 10).into_iter().take(20).map(|r| r.replace(".5 ", ".51 ")));
    ply.push("400029.51 3900002 0.25 -1".into());
    let result = write(folder.path(), "result.ply", &ply);
    let near = figures(&[
        "--truth",
        &truth,
        "--result",
        &result,
        "--tolerance",
        "0.02",
        "--zero-is-instance",
        "result",
    ]);
    assert_eq!((&near["true_positives"], &near["false_negatives"]), (&2.into(), &1.into()));
    assert_eq!((&near["unmatched_true_points"], &near["result_points"]), (&9.into(), &21.into()));
    let far = tsumu(&[
        "evaluate",
        "--labels",
        "--truth",
        &truth,
        "--result",
        &result,
        "--tolerance",
        "0.001",
        "--zero-is-instance",
        "result",
    ]);
    assert_eq!(far.code, 2);
    assert!(far.err.contains("--tolerance") && far.err.trim().lines().count() == 1, "{}", far.err);
}

#[test]
fn what_cannot_be_scored_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str, rows: &[String]| write(folder.path(), name, rows);
    let good = at("good.txt", &rows(|i| i as i64 / 10 + 1));
    let none = at("none.txt", &rows(|_| 0));
    let bare: Vec<String> =
        rows(|_| 0).iter().map(|r| r.rsplit_once(' ').unwrap().0.into()).collect();
    let bare = at("bare.txt", &bare);
    let empty = at("empty.txt", &[]);
    let two: Vec<String> = rows(|_| 3).iter().map(|r| format!("{r} 8")).collect();
    let two = at("two.txt", &two);
    let missing = folder.path().join("missing.ply").to_string_lossy().into_owned();
    let root = folder.path().to_string_lossy().into_owned();
    for (truth, result, more, says) in [
        (&none, &good, None, "none.txt"),
        (&good, &bare, None, "bare.txt"),
        (&empty, &good, None, "empty.txt"),
        (&good, &two, None, "4, 5"),
        (&good, &missing, None, "missing.ply"),
        (&good, &root, None, "folder"),
        (&good, &good, Some(["--iou", "1.5"]), "1.5"),
        (&good, &good, Some(["--tolerance", "-1"]), "-1"),
        (&good, &good, Some(["--result-column", "9"]), "column 9"),
    ] {
        let mut args = vec!["evaluate", "--labels", "--truth", truth, "--result", result];
        args.extend(more.iter().flatten());
        let ran = tsumu(&args);
        assert_eq!(ran.code, 2, "{args:?}: {}{}", ran.out, ran.err);
        assert!(ran.err.contains(says), "{args:?}: {}", ran.err);
        assert_eq!(ran.err.trim().lines().count(), 1, "{}", ran.err);
    }
    // Without --labels a cloud is no result.
    let ran = tsumu(&["evaluate", "--truth", &good, "--result", &good]);
    assert!(ran.code == 2 && ran.err.contains("--labels"), "{}", ran.err);
}
