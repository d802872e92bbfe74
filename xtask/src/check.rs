//! All that must pass before a change lands.
//!
//! A step passes, fails, or is skipped because something it needs is neither there nor to be had; with `--strict` a skipped
//! step is a failure. The last line is `N passed, N failed`: the tests', and a failed step counts as one failure.

use crate::process::{cargo, command, done, done_within, heard, output, works};
use crate::{citations, root};
use anyhow::{Context, Result, bail};
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

/// The version of cargo-deny that `deny.toml` is written for.
const DENY: &str = "0.20.2";
/// cargo-deny is built from its sources: some six minutes of two cores, more beside other work.
const INSTALLING_DENY: Duration = Duration::from_secs(15 * 60);
/// The readers that are not ours are Python packages of some 100 MB.
const INSTALLING_READERS: Duration = Duration::from_secs(400);

/// How a step went.
enum Went {
    Well,
    /// Not done, and why.
    Skipped(String),
}

/// What the tests said.
#[derive(Default)]
struct Tests {
    passed: u64,
    failed: u64,
}

struct Step {
    name: &'static str,
    /// The same by hand, for `--list` and CONTRIBUTING.md.
    by_hand: &'static str,
    run: fn(&mut Tests) -> Result<Went>,
}

const STEPS: &[Step] = &[
    Step { name: "format", by_hand: "cargo fmt --all --check", run: format },
    Step {
        name: "lints",
        by_hand: "cargo clippy --release --workspace --all-targets --locked -- -D warnings",
        run: lints,
    },
    Step {
        name: "docs",
        by_hand: "RUSTDOCFLAGS=-Dwarnings cargo doc --release --workspace --no-deps --locked",
        run: docs,
    },
    Step { name: "citations", by_hand: "cargo xtask check citations", run: resolve },
    Step { name: "tests", by_hand: "cargo test --release --workspace --locked", run: tests },
    Step { name: "exports", by_hand: "python3 tools/check_exports.py, check_run.py", run: exports },
    Step { name: "python", by_hand: "pytest python/tests (python/README.md)", run: python },
    Step {
        name: "faults",
        by_hand: "python3 tools/faults.py target/release/tsumu OUT --every K --kills N",
        run: faults,
    },
    Step { name: "tiles", by_hand: "python3 tools/check_tiles.py PROGRAM FOLDER", run: tiles },
    Step {
        name: "processors",
        by_hand: "python3 tools/processors.py target/release/tsumu",
        run: processors,
    },
    Step {
        name: "licences",
        by_hand: "cargo deny --all-features check licenses bans sources",
        run: licences,
    },
    Step {
        name: "advisories",
        by_hand: "cargo deny --all-features check advisories",
        run: advisories,
    },
];

/// Runs the steps named, or all of them.
pub fn check(args: &[&str]) -> Result<ExitCode> {
    if args == ["--list"] {
        for step in STEPS {
            println!("{:<12}{}", step.name, step.by_hand);
        }
        return Ok(ExitCode::SUCCESS);
    }
    let strict = args.contains(&"--strict");
    let names: Vec<&str> = args.iter().copied().filter(|a| *a != "--strict").collect();
    if let Some(other) = names.iter().find(|n| !STEPS.iter().any(|s| s.name == **n)) {
        bail!("there is no step `{other}`; `cargo xtask check --list` has them");
    }
    let mut tests = Tests::default();
    let mut notes = Vec::new();
    let mut failed_steps = 0;
    for step in STEPS.iter().filter(|s| names.is_empty() || names.contains(&s.name)) {
        println!("== {}", step.name);
        let start = Instant::now();
        let failure = match (step.run)(&mut tests) {
            Ok(Went::Well) => None,
            Ok(Went::Skipped(why)) if strict => Some(format!("not done: {why}")),
            Ok(Went::Skipped(why)) => {
                notes.push(format!("{} not done: {why}", step.name));
                None
            }
            Err(error) => Some(format!("{error:#}")),
        };
        if let Some(why) = failure {
            failed_steps += 1;
            notes.push(format!("{} FAILED: {why}", step.name));
        }
        println!("== {} took {:.0} s", step.name, start.elapsed().as_secs_f64());
    }
    for note in notes {
        println!("{note}");
    }
    let failed = tests.failed.max(failed_steps);
    println!("{} passed, {failed} failed", tests.passed);
    Ok(if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Whether a component of the toolchain is there, or could be fetched.
fn component(name: &str, probe: &[&str]) -> bool {
    works(cargo(probe))
        || (works(command("rustup", ["component", "add", name])) && works(cargo(probe)))
}

fn format(_: &mut Tests) -> Result<Went> {
    if !component("rustfmt", &["fmt", "--version"]) {
        return Ok(Went::Skipped("rustfmt is not installed and cannot be fetched".into()));
    }
    done(cargo(&["fmt", "--all", "--check"]))?;
    Ok(Went::Well)
}

fn lints(_: &mut Tests) -> Result<Went> {
    let all = ["--release", "--workspace", "--all-targets", "--locked"];
    if component("clippy", &["clippy", "--version"]) {
        done(cargo(&[&["clippy"], &all[..], &["--", "-D", "warnings"]].concat()))?;
        return Ok(Went::Well);
    }
    let mut check = cargo(&[&["check"], &all[..]].concat());
    check.env("RUSTFLAGS", "-D warnings");
    done(check)?;
    Ok(Went::Skipped("clippy is not installed and cannot be fetched; warnings checked".into()))
}

fn docs(_: &mut Tests) -> Result<Went> {
    let mut doc = cargo(&["doc", "--release", "--workspace", "--no-deps", "--locked", "--quiet"]);
    doc.env("RUSTDOCFLAGS", "-D warnings");
    done(doc)?;
    Ok(Went::Well)
}

fn resolve(_: &mut Tests) -> Result<Went> {
    let faults = citations::faults(&root())?;
    if !faults.is_empty() {
        bail!("{}", faults.join("\n"));
    }
    Ok(Went::Well)
}

fn tests(tests: &mut Tests) -> Result<Went> {
    let all = cargo(&["test", "--release", "--workspace", "--locked", "--no-fail-fast"]);
    let well = heard(all, |line| {
        if let Some((passed, failed)) = counts(line) {
            tests.passed += passed;
            tests.failed += failed;
        }
    })?;
    if !well {
        bail!("{} tests failed, or did not build", tests.failed);
    }
    Ok(Went::Well)
}

/// Passed and failed in a line such as `test result: ok. 12 passed; 0 failed; 1 ignored; ...`.
fn counts(line: &str) -> Option<(u64, u64)> {
    let words: Vec<&str> = line.strip_prefix("test result:")?.split_whitespace().collect();
    let before = |word: &str| {
        let at = words.iter().position(|w| w.trim_end_matches(';') == word)?;
        words.get(at.checked_sub(1)?)?.parse().ok()
    };
    Some((before("passed")?, before("failed")?))
}

/// Where builds go.
pub fn built() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// An empty folder of this name where builds go.
fn emptied(name: &str) -> Result<PathBuf> {
    let folder = built().join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    std::fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Makes a Python environment with these requirements; false where they cannot be had.
fn python_with(folder: &str, requirements: &str) -> bool {
    let python = format!("{folder}/bin/python");
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"];
    let install = [&install[..], &[requirements]].concat();
    works(command("python3", ["-m", "venv", folder]))
        && done_within(command(&python, install), INSTALLING_READERS).is_ok()
}

/// The sample's exports and run folder, opened by readers that are not ours.
fn exports(_: &mut Tests) -> Result<Went> {
    let work = emptied("xtask-exports")?;
    let at = |name: &str| work.join(name).display().to_string();
    let python = at("readers/bin/python");
    if !python_with(&at("readers"), "tools/requirements-exports.txt") {
        return Ok(Went::Skipped(
            "the readers of tools/requirements-exports.txt cannot be installed here; exports opened by our own tests only"
                .into(),
        ));
    }
    done(built_programs())?;
    let program = |name: &str| built().join("release").join(name).display().to_string();
    done(command(&program("examples/exports"), [at("exports")]))?;
    done(command(&python, ["tools/check_exports.py", &at("exports")]))?;
    let site = "examples/breakwater";
    let run = at("run");
    done(command(&program("tsumu"), ["run", site, "--out", &run, "--plans", "1", "--quiet"]))?;
    done(command(&python, ["tools/check_run.py", &run]))?;
    done(command(&program("tsumu"), ["verify", &run, "--site", site]))?;
    Ok(Went::Well)
}

/// The Python package as a wheel in an environment of its own, and its tests, which hold it against the program of the same build.
fn python(tests: &mut Tests) -> Result<Went> {
    let work = emptied("xtask-python")?;
    let at = |name: &str| work.join(name).display().to_string();
    let python = at("venv/bin/python");
    if !python_with(&at("venv"), "python/requirements-test.txt") {
        return Ok(Went::Skipped(
            "there is no Python, or python/requirements-test.txt cannot be installed here; the package is compiled only"
                .into(),
        ));
    }
    let module = ["build", "--release", "--workspace", "--bins", "--lib", "--example", "exports"];
    done(cargo(&[&module[..], &["--locked"]].concat()))?;
    let built = |name: &str| built().join("release").join(name).display().to_string();
    let module = built(&format!("{DLL_PREFIX}_tsumu{DLL_SUFFIX}"));
    done(command(&python, ["tools/pack_wheel.py", &module, &at("wheels")]))?;
    let install = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--find-links"];
    done(command(&python, [&install[..], &[&at("wheels"), "tsumu"]].concat()))?;
    let mut all = command(&python, ["-m", "pytest", "-q", "-rs", "python/tests"]);
    all.env("TSUMU_PROGRAM", built("tsumu"));
    let well = heard(all, |line| {
        let (passed, failed) = pytest_counts(line);
        tests.passed += passed;
        tests.failed += failed;
    })?;
    if !well {
        bail!("tests of the Python package failed");
    }
    Ok(Went::Well)
}

/// Passed and failed in a line such as `1 failed, 78 passed, 1 skipped in 41.20s`.
fn pytest_counts(line: &str) -> (u64, u64) {
    let words: Vec<&str> = line.split([' ', ',', '=']).filter(|w| !w.is_empty()).collect();
    if !words.contains(&"in") {
        return (0, 0);
    }
    let before = |word: &str| {
        let at = words.iter().position(|w| *w == word)?;
        words.get(at.checked_sub(1)?)?.parse().ok()
    };
    (before("passed").unwrap_or(0), before("failed").unwrap_or(0))
}

/// Builds the programs. With an example, so that units have the features of the tests and nothing is built anew.
fn built_programs() -> Command {
    let programs = ["build", "--release", "--workspace", "--bins", "--example", "exports"];
    cargo(&[&programs[..], &["--locked"]].concat())
}

/// Failures of the system at places drawn from a run of a tiny site, and kills; all places by hand.
fn faults(_: &mut Tests) -> Result<Went> {
    if !works(command("strace", ["-V"])) {
        return Ok(Went::Skipped(
            "strace, which makes calls of the system fail, is not here".into(),
        ));
    }
    done(built_programs())?;
    let program = built().join("release/tsumu").display().to_string();
    let trials = built().join("xtask-faults.jsonl");
    if trials.exists() {
        std::fs::remove_file(&trials)?;
    }
    let trials = trials.display().to_string();
    let calls = "write,fsync,renameat,openat,mmap";
    done(command(
        "python3",
        ["tools/faults.py", &program, &trials, "--every", "24", "--calls", calls, "--kills", "8"],
    ))?;
    Ok(Went::Well)
}

/// The same bytes on a processor of another class, by an emulator.
fn processors(_: &mut Tests) -> Result<Went> {
    let emulated = works(command("qemu-x86_64", ["--version"]));
    let wide = std::fs::read_to_string("/proc/cpuinfo").is_ok_and(|c| c.contains("avx512f"));
    if !emulated || !wide {
        let lacks = if emulated { "a processor with AVX-512" } else { "qemu-x86_64" };
        return Ok(Went::Skipped(format!("{lacks} is not here")));
    }
    done(built_programs())?;
    let program = built().join("release/tsumu").display().to_string();
    done(command("python3", ["tools/processors.py", &program]))?;
    Ok(Went::Well)
}

/// Tiles by a Dask cluster of which a worker is killed: the bytes of tiles worked on one by one.
fn tiles(_: &mut Tests) -> Result<Went> {
    let work = emptied("xtask-tiles")?;
    let at = |name: &str| work.join(name).display().to_string();
    let python = at("dask/bin/python");
    if !python_with(&at("dask"), "tools/requirements-tiles.txt") {
        return Ok(Went::Skipped(
            "Dask (tools/requirements-tiles.txt) cannot be installed here; tiles driven by our own tests only"
                .into(),
        ));
    }
    done(built_programs())?;
    let program = built().join("release/tsumu").display().to_string();
    done(command(&python, ["tools/check_tiles.py", &program, &at("work")]))?;
    Ok(Went::Well)
}

/// cargo-deny, installed when it is not there and the registry answers.
fn deny_is_there() -> Result<Result<(), String>> {
    let probe = || works(cargo(&["deny", "--version"]));
    if probe() {
        return Ok(Ok(()));
    }
    if !works(cargo(&["info", "--quiet", &format!("cargo-deny@{DENY}")])) {
        return Ok(Err("cargo-deny is not installed and the registry does not answer".into()));
    }
    println!("installing cargo-deny {DENY} (some minutes, once)");
    let install = ["install", "--locked", "--quiet", "cargo-deny", "--version", DENY];
    // What cannot be checked where the registry answers is a failure: a check that is left out quietly holds nothing.
    done_within(cargo(&install), INSTALLING_DENY).context("cargo-deny cannot be installed")?;
    if !probe() {
        bail!("cargo-deny was installed but does not run; is Cargo's bin folder in PATH?");
    }
    Ok(Ok(()))
}

fn licences(_: &mut Tests) -> Result<Went> {
    if let Err(why) = deny_is_there()? {
        return Ok(Went::Skipped(why));
    }
    done(cargo(&["deny", "--all-features", "check", "licenses", "bans", "sources"]))?;
    Ok(Went::Well)
}

fn advisories(_: &mut Tests) -> Result<Went> {
    if let Err(why) = deny_is_there()? {
        return Ok(Went::Skipped(why));
    }
    if output(cargo(&["deny", "fetch", "db"])).is_err() {
        return Ok(Went::Skipped("the advisory database cannot be fetched here".into()));
    }
    done(cargo(&["deny", "--all-features", "check", "advisories"]))?;
    Ok(Went::Well)
}

/// Whether a path is below one of the folders that hold nothing of ours.
pub fn foreign(path: &Path) -> bool {
    path.components().any(|c| {
        let name = c.as_os_str().to_string_lossy();
        name == "target"
            || name == "node_modules"
            || (name.starts_with('.')
                && name != "."
                && name != ".."
                && name != ".ci"
                && name != ".github")
    })
}

#[cfg(test)]
mod tests_of_words {
    use super::*;

    #[test]
    fn results_of_tests_are_counted() {
        let line = "test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 1.00s";
        assert_eq!(counts(line), Some((12, 0)));
        assert_eq!(counts("test result: FAILED. 3 passed; 2 failed; 0 ignored"), Some((3, 2)));
        assert_eq!(counts("test a::b ... ok"), None);
        assert_eq!(counts("test result: passed"), None);
    }

    #[test]
    fn results_of_pytest_are_counted() {
        assert_eq!(pytest_counts("1 failed, 78 passed, 1 skipped in 41.20s"), (78, 1));
        assert_eq!(pytest_counts("=== 3 passed in 0.1s ==="), (3, 0));
        assert_eq!(pytest_counts("SKIPPED [1] a.py:3: 2 passed tests are not enough"), (0, 0));
    }

    #[test]
    fn every_step_is_told_of_in_contributing() {
        let page = std::fs::read_to_string(root().join("CONTRIBUTING.md")).expect("ships with it");
        for step in STEPS {
            assert!(
                page.contains(&format!("| `{}` |", step.name)),
                "CONTRIBUTING.md lacks `{}`",
                step.name
            );
        }
    }
}
