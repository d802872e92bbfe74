//! Disks that are full and folders that may not be written: a named error, and every file whole or absent.

use crate::site::{copy, files, ok, shared, tsumu};
use std::path::Path;
use std::process::Command;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// A folder nobody may write into, not even root; `None` where the system has none.
fn read_only() -> Option<&'static Path> {
    let folder = Path::new("/sys");
    folder.is_dir().then_some(folder)
}

#[test]
fn a_folder_that_may_not_be_written_is_named() {
    let Some(folder) = read_only() else { return };
    let out = folder.join("run");
    for args in [vec!["run"], vec!["run", "--plans", "0"]] {
        let mut args: Vec<String> = args.into_iter().map(String::from).collect();
        args.insert(1, text(shared()));
        args.extend(["--out".into(), text(&out)]);
        let ran = tsumu(&args);
        assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
        assert!(ran.err.contains("cannot write") && ran.err.contains(&text(&out)), "{}", ran.err);
        assert!(!ran.err.contains("panicked"), "{}", ran.err);
    }
}

/// Events once were lost without a word.
#[cfg(target_os = "linux")]
#[test]
fn an_output_that_is_full_is_told() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tsumu"));
    let ran = command.args(["blocks"]).stdout(full).output().unwrap();
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert_eq!(ran.status.code(), Some(1), "{said}");
    assert!(said.contains("standard output"), "{said}");
}

/// A warning that could not be written once ended the run with status 101 and no line.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_error_ends_no_run() {
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let site = copy();
    let file = site.path().join("site.toml");
    // Far more is designed than was surveyed, which is warned of.
    let wide = std::fs::read_to_string(&file).unwrap().replace("41247.0", "41147.0");
    std::fs::write(&file, wide).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tsumu"));
    command.arg("run").arg(site.path()).args(["--plans", "0", "--policy", "random"]);
    assert!(command.stderr(full()).output().unwrap().status.success());
    let mut command = Command::new(env!("CARGO_BIN_EXE_tsumu"));
    command.args(["run", "/nowhere"]);
    assert_eq!(command.stderr(full()).output().unwrap().status.code(), Some(2));
}

/// A limit on the size of files stands in for a disk that is full: writes fail in the middle of a file.
#[cfg(unix)]
#[test]
fn a_disk_that_fills_up_leaves_no_half_file() {
    let (site, runs) = (copy(), tempfile::tempdir().unwrap());
    let whole = runs.path().join("whole");
    ok(&["run", &text(site.path()), "--out", &text(&whole), "--plans", "0"]);
    let reference = files(&whole);
    let mut stopped_in = std::collections::BTreeSet::new();
    for kilobytes in [4, 60, 200, 1000] {
        let run = runs.path().join(kilobytes.to_string());
        let ran = Command::new("bash")
            .args([
                "-c",
                "trap '' XFSZ; ulimit -f \"$1\"; exec \"$2\" run \"$3\" --out \"$4\" --plans 0",
                "-",
            ])
            .arg(kilobytes.to_string())
            .arg(env!("CARGO_BIN_EXE_tsumu"))
            .args([site.path(), &run])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        if ran.status.success() {
            continue;
        }
        assert_eq!(ran.status.code(), Some(1), "{said}");
        let line =
            said.lines().find(|l| l.starts_with("tsumu: ")).unwrap_or_else(|| panic!("{said}"));
        assert!(line.contains("cannot write") && line.contains(&text(&run)), "{line}");
        stopped_in.insert(line.to_string());
        // A run that kept nothing leaves no folder.
        let left = if run.exists() { files(&run) } else { Vec::new() };
        for (name, content) in left {
            assert!(
                !name.to_string_lossy().ends_with(".part"),
                "{} was left behind",
                name.display()
            );
            if let Some((_, whole)) = reference.iter().find(|r| r.0 == name) {
                assert!(content == *whole, "{} is neither whole nor absent", name.display());
            }
        }
        // With room again, the run goes on and ends the same.
        ok(&["run", &text(site.path()), "--out", &text(&run), "--plans", "0"]);
        let all = |files: Vec<(std::path::PathBuf, Vec<u8>)>| {
            files.into_iter().filter(|f| f.0 != Path::new("timing.json")).collect::<Vec<_>>()
        };
        assert!(all(files(&run)) == all(reference.clone()));
    }
    assert!(stopped_in.len() >= 2, "the limits stop nothing: {stopped_in:?}");
}
