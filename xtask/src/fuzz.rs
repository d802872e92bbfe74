//! libFuzzer with the compiler of the release: targets built with its coverage, fed from a kept corpus.
//!
//! In: the name of a target of `fuzz/`, seconds. Out: a corpus that grew, and the input that ended the target where one did. Coverage
//! is a pass of the compiler's own back end, so that no nightly one is needed; AddressSanitizer is not in it.

use crate::check::built;
use crate::package::host;
use crate::process::{cargo, command, done};
use crate::root;
use anyhow::{Context, Result, bail};
use std::path::PathBuf;

/// Targets, and how long one input may take, seconds.
const TARGETS: [(&str, u32); 4] = [("clouds", 20), ("others", 20), ("runs", 120), ("sites", 120)];
/// What an input may make the target hold, megabytes.
const MOST_MEMORY_MB: u32 = 4096;
/// Counters at every edge, and comparisons told, as libFuzzer wants them.
const COVERAGE: [&str; 6] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "--cfg=fuzzing",
];

/// `fuzz [TARGET SECONDS [FOLDER]]`
pub fn fuzz(args: &[&str]) -> Result<()> {
    let (target, seconds, folder) = match args {
        [] => {
            TARGETS.iter().for_each(|(name, _)| println!("{name}"));
            return Ok(());
        }
        [target, seconds] => (*target, *seconds, built().join("fuzz")),
        [target, seconds, folder] => (*target, *seconds, PathBuf::from(folder)),
        _ => bail!("`fuzz [TARGET SECONDS [FOLDER]]`"),
    };
    let Some((_, slowest_s)) = TARGETS.iter().find(|t| t.0 == target) else {
        bail!("there is no target `{target}`; `cargo xtask fuzz` lists them");
    };
    let seconds: u32 = seconds.parse().with_context(|| format!("`{seconds}` are no seconds"))?;
    let programs = build()?;
    let corpus = folder.join("corpus");
    let own = corpus.join(target);
    if !own.exists() {
        let seeds = programs.join("seeds").display().to_string();
        done(command(&seeds, [corpus.display().to_string()]))?;
    }
    let flags = [
        own.display().to_string(),
        format!("-max_total_time={seconds}"),
        format!("-timeout={slowest_s}"),
        format!("-rss_limit_mb={MOST_MEMORY_MB}"),
        format!("-artifact_prefix={}/{target}-", folder.display()),
        "-print_final_stats=1".to_string(),
    ];
    done(command(&programs.join(target).display().to_string(), flags))?;
    println!("corpus: {}", own.display());
    Ok(())
}

/// Builds targets and seeds; the folder of the programs comes back.
fn build() -> Result<PathBuf> {
    let (host, folder) = (host()?, built().join("fuzz/target"));
    let manifest = root().join("fuzz/Cargo.toml").display().to_string();
    // With a target named, what runs while building is not instrumented.
    let mut cargo =
        cargo(&["build", "--release", "--manifest-path", &manifest, "--target", &host, "--bins"]);
    cargo.env("RUSTFLAGS", COVERAGE.join(" ")).env("CARGO_TARGET_DIR", &folder);
    done(cargo)?;
    Ok(folder.join(host).join("release"))
}
