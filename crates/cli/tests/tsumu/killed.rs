//! A run that is killed at any moment goes on when it is started again, and ends as if nothing had happened.

use crate::site::{SITE, copy, files, ok, small, tsumu};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn start(site: &Path, out: &Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_tsumu"))
        .args(["run", &text(site), "--out", &text(out), "--plans", "1", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts")
}

/// Everything but wall times; private files of a run in hand must be gone.
fn results(run: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let all: Vec<_> =
        files(run).into_iter().filter(|(name, _)| name != Path::new("timing.json")).collect();
    let private: Vec<_> =
        all.iter().filter(|(name, _)| name.to_string_lossy().contains(".tsumu-")).collect();
    assert!(
        private.is_empty(),
        "left behind: {:?}",
        private.iter().map(|f| &f.0).collect::<Vec<_>>()
    );
    all
}

fn assert_same(run: &Path, reference: &[(PathBuf, Vec<u8>)]) {
    let found = results(run);
    let names = |r: &[(PathBuf, Vec<u8>)]| r.iter().map(|f| f.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&found), names(reference));
    for ((name, a), (_, b)) in found.iter().zip(reference) {
        assert!(a == b, "{} differs from the run that was not killed", name.display());
    }
}

/// Lets the program say this many lines, then kills it. `None`: it ended before.
fn killed_after_lines(site: &Path, run: &Path, lines: usize) -> Option<usize> {
    let mut child = start(site, run);
    let said = BufReader::new(child.stdout.take().unwrap()).lines().take(lines).count();
    child.kill().expect("SIGKILL can be sent");
    let status = child.wait().unwrap();
    (!status.success()).then_some(said)
}

/// Kills the program as soon as a file is there.
fn killed_when_there(site: &Path, run: &Path, file: &str) {
    let mut child = start(site, run);
    while !run.join(file).exists() {
        assert!(child.try_wait().unwrap().is_none(), "the run ended without {file}");
        std::thread::yield_now();
    }
    child.kill().expect("SIGKILL can be sent");
    child.wait().unwrap();
}

/// Fifty kills and more, in chains: each run of a chain is killed after a drawn number of lines of what it says, until one
/// ends; then every file is as if nothing had happened.
#[test]
fn fifty_kills_change_no_byte() {
    let runs = tempfile::tempdir().unwrap();
    let whole = runs.path().join("whole");
    let args = |out: &Path| {
        [
            "run".into(),
            text(small()),
            "--out".into(),
            text(out),
            "--plans".into(),
            "1".into(),
            "--json".into(),
        ]
    };
    let said = ok(&args(&whole)).out.lines().count();
    let reference = results(&whole);
    let (mut kills, mut chain) = (0, 0);
    while kills < 50 {
        assert!(chain < 40, "{kills} kills in {chain} chains: the test kills nothing");
        let run = runs.path().join(format!("chain-{chain}"));
        for i in 0..5 {
            let draw = geom::SeedTree::new(22).child("chain", chain).child("kill", i).value();
            let lines = 1 + (draw % said as u64) as usize;
            kills += usize::from(killed_after_lines(small(), &run, lines).is_some());
        }
        ok(&args(&run));
        assert_same(&run, &reference);
        ok(&["verify", &text(&run), "--site", &text(small())]);
        chain += 1;
    }
}

#[test]
fn a_killed_run_goes_on_and_ends_the_same() {
    let (site, runs) = (copy(), tempfile::tempdir().unwrap());
    let whole = runs.path().join("whole");
    let said = ok(&["run", &text(site.path()), "--out", &text(&whole), "--plans", "1", "--json"])
        .out
        .lines()
        .count();
    let reference = results(&whole);
    ok(&["verify", &text(&whole), "--site", &text(site.path())]);

    // Killed again and again in one folder: at random lines of what it says, and when a file appears.
    let run = runs.path().join("killed");
    let draw = |i: u64, below: usize| {
        (geom::SeedTree::new(11).child("kill", i).value() % below as u64) as usize
    };
    let mut kills = 0;
    for i in 0..3 {
        kills += usize::from(killed_after_lines(site.path(), &run, 1 + draw(i, said)).is_some());
        // A run that is not whole does not pass for one.
        if run.exists() && !run.join("manifest.json").exists() {
            let verify = tsumu(&["verify", &text(&run)]);
            assert!(verify.code == 2 && verify.err.contains("not finished"), "{}", verify.err);
        }
    }
    assert!(kills > 0, "the test kills nothing");
    ok(&["run", &text(site.path()), "--out", &text(&run), "--plans", "1"]);
    assert_same(&run, &reference);

    // Killed when its blocks are written: what was finished is not done again.
    std::fs::remove_dir_all(&run).unwrap();
    killed_when_there(site.path(), &run, "recognise/blocks.csv");
    let ran = ok(&["run", &text(site.path()), "--out", &text(&run), "--plans", "1", "--json"]);
    for part in ["segment", "recognise"] {
        assert!(
            ran.out.contains(&format!(r#"{{"event":"kept","value":{{"part":"{part}"}}}}"#)),
            "{}",
            ran.out
        );
    }
    assert!(!ran.out.contains(r#"{"event":"started","stage":"segment""#), "{}", ran.out);
    assert_same(&run, &reference);

    // Killed near its end, then the seed is changed: nothing of the killed run may be used.
    std::fs::remove_dir_all(&run).unwrap();
    killed_when_there(site.path(), &run, "report.html");
    std::fs::write(site.path().join("site.toml"), SITE.replace("seed = 5", "seed = 6")).unwrap();
    let ran = ok(&["run", &text(site.path()), "--out", &text(&run), "--plans", "1", "--json"]);
    assert!(!ran.out.contains(r#""event":"kept""#), "{}", ran.out);
    std::fs::write(site.path().join("site.toml"), SITE).unwrap();

    // Killed when everything is written: only the tidying is left.
    std::fs::remove_dir_all(&run).unwrap();
    killed_when_there(site.path(), &run, "manifest.json");
    ok(&["run", &text(site.path()), "--out", &text(&run), "--plans", "1"]);
    assert_same(&run, &reference);
    ok(&["verify", &text(&run), "--site", &text(site.path())]);
}
