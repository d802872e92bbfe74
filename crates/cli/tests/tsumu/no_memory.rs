//! Memory that does not suffice: refused before it is paid for, or ended with a line; never by the system.

use crate::site::{files, ok, small, small_copy, tsumu};
use std::path::Path;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

#[test]
fn what_does_not_fit_is_refused_at_once() {
    let site = small_copy();
    let file = site.path().join("site.toml");
    let own = std::fs::read_to_string(&file).unwrap();
    let out = text(&site.path().join("out"));
    // Some 8000 × 8000 cells: 3.6 GB.
    let fine = format!("{own}\n[plan]\ncell_m = 0.0012\nmemory_gb = 100.0\n");
    std::fs::write(&file, &fine).unwrap();
    let said = tsumu(&["run", &text(site.path()), "--out", &out, "--memory", "1GB"]);
    assert!(
        said.code == 2 && said.err.contains("1GB") && said.err.contains("--memory"),
        "{}",
        said.err
    );
    assert!(!Path::new(&out).exists(), "nothing is begun");
    // The same said by the site.
    std::fs::write(&file, format!("memory = \"1GB\"\n{fine}")).unwrap();
    let said = tsumu(&["run", &text(site.path()), "--out", &out]);
    assert!(said.code == 2 && said.err.contains("1GB"), "{}", said.err);
    for wrong in ["4", "10MB", "much"] {
        let said = tsumu(&["run", &text(site.path()), "--memory", wrong]);
        assert!(said.code == 2 && said.err.contains(wrong), "{}", said.err);
    }
    // No result depends on a bound that suffices.
    std::fs::write(&file, own).unwrap();
    let flags = ["--plans", "0", "--policy", "random", "--out"];
    let runs = tempfile::tempdir().unwrap();
    let with = |name: &str, more: &[&str]| {
        let out = runs.path().join(name);
        let mut args = vec!["run".to_string(), text(site.path())];
        args.extend(flags.iter().chain(more).map(|s| s.to_string()));
        args.insert(args.iter().position(|a| a == "--out").unwrap() + 1, text(&out));
        ok(&args);
        let results = files(&out).into_iter();
        results.filter(|f| f.0 != Path::new("timing.json")).collect::<Vec<_>>()
    };
    assert!(with("bound", &["--memory", "4GB"]) == with("free", &[]));
}

/// The address space is bounded from outside: allocations fail at one place after the other.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_runs_out_ends_with_a_line() {
    use std::process::Command;
    let runs = tempfile::tempdir().unwrap();
    let run = |out: &Path, kilobytes: Option<u64>| {
        let limit = kilobytes.map_or(String::new(), |k| format!("ulimit -v {k}; "));
        let script = format!(
            "ulimit -c 0; {limit}exec \"$1\" run \"$2\" --out \"$3\" --plans 0 --policy random --threads 1 -q"
        );
        let mut command = Command::new("bash");
        command.args(["-c", &script, "-", env!("CARGO_BIN_EXE_tsumu")]).arg(small()).arg(out);
        command.output().unwrap()
    };
    let whole = runs.path().join("whole");
    assert!(run(&whole, None).status.success());
    let all = |run: &Path| {
        let results = files(run).into_iter();
        results.filter(|f| f.0 != Path::new("timing.json")).collect::<Vec<_>>()
    };
    let mut failed = 0;
    for megabytes in (90..330).step_by(20) {
        let out = runs.path().join(megabytes.to_string());
        let ended = run(&out, Some(megabytes * 1000));
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        if said.contains("error while loading shared libraries") {
            continue;
        }
        if !ended.status.success() {
            failed += 1;
            assert_eq!(ended.status.code(), Some(1), "{megabytes} MB: {:?} {said}", ended.status);
            assert!(said.lines().any(|l| l.starts_with("tsumu: ")), "{megabytes} MB: {said}");
        }
        let again = run(&out, None);
        assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
        assert!(all(&out) == all(&whole), "{megabytes} MB: other bytes after going on");
    }
    assert!(failed >= 2, "no limit stops anything");
}
