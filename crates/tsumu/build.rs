//! Tells the program which commit it was built from. Needs no network; without git, or outside a checkout, the commit
//! is "unknown". The same commit and options give the same text.

use std::path::Path;
use std::process::Command;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    println!("cargo:rustc-env=TSUMU_COMMIT={}", commit(&root).unwrap_or_else(|| "unknown".into()));
    println!("cargo:rustc-env=TSUMU_TARGET={}", std::env::var("TARGET").unwrap_or_default());
    println!("cargo:rustc-env=TSUMU_OPT_LEVEL={}", std::env::var("OPT_LEVEL").unwrap_or_default());
    println!("cargo:rustc-env=TSUMU_FEATURES={}", features());
    println!("cargo:rerun-if-changed=build.rs");
    // A program of changed sources must not claim its commit; all of these make the program be built again anyway.
    for watched in ["Cargo.toml", "Cargo.lock"] {
        println!("cargo:rerun-if-changed={}", root.join(watched).display());
    }
    for package in std::fs::read_dir(root.join("crates")).into_iter().flatten().flatten() {
        println!("cargo:rerun-if-changed={}", package.path().join("src").display());
    }
    for name in ["HEAD", "packed-refs"] {
        watch(&root, name);
    }
    if let Some(branch) = git(&root, &["symbolic-ref", "--quiet", "HEAD"]) {
        watch(&root, &branch);
    }
}

/// The optional parts that are built in.
fn features() -> String {
    let prefix = "CARGO_FEATURE_";
    let named = |(key, _): (String, String)| {
        key.strip_prefix(prefix).map(str::to_lowercase).filter(|f| f != "default")
    };
    let mut list: Vec<String> = std::env::vars().filter_map(named).collect();
    list.sort();
    if list.is_empty() { "none beside the usual".into() } else { list.join(", ") }
}

/// The commit, with a `+` when the sources are not as committed.
fn commit(root: &Path) -> Option<String> {
    let top = git(root, &["rev-parse", "--show-toplevel"])?;
    // An unpacked archive inside somebody else's repository has no commit of its own.
    if Path::new(&top).canonicalize().ok()? != root.canonicalize().ok()? {
        return None;
    }
    let commit = git(root, &["rev-parse", "--short=12", "HEAD"])?;
    let changed =
        git(root, &["status", "--porcelain", "--", "crates/*/src", "Cargo.toml", "Cargo.lock"])?;
    Some(if changed.is_empty() { commit } else { commit + "+" })
}

fn watch(root: &Path, name: &str) {
    if let Some(path) = git(root, &["rev-parse", "--git-path", name]) {
        let path = root.join(path);
        if path.exists() {
            println!("cargo:rerun-if-changed={}", path.display());
        }
    }
}

fn git(root: &Path, args: &[&str]) -> Option<String> {
    let output = Command::new("git").arg("-C").arg(root).args(args).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_string())
}
