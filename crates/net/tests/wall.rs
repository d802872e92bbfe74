//! The wall stands: outside this crate nobody names the deep-learning library, and what passes is a short list.

use std::path::{Path, PathBuf};

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn no_other_crate_names_the_library() {
    let mut files = Vec::new();
    rust_files(&crates(), &mut files);
    let own = std::fs::canonicalize(env!("CARGO_MANIFEST_DIR")).expect("this crate");
    let mut looked_at = 0;
    for file in files {
        let path = std::fs::canonicalize(&file).expect("just listed");
        if path.starts_with(&own) {
            continue;
        }
        looked_at += 1;
        let text = std::fs::read_to_string(&path).expect("sources are text");
        for (number, line) in text.lines().enumerate() {
            assert!(
                !line.contains("burn::") && !line.contains("use burn"),
                "{}:{}: the library's names come from `net::prelude`: {line}",
                path.display(),
                number + 1
            );
        }
    }
    assert!(looked_at > 100, "only {looked_at} files were found");
}

#[test]
fn only_this_crate_depends_on_the_library() {
    for entry in std::fs::read_dir(crates()).expect("the workspace has crates") {
        let folder = entry.expect("readable").path();
        let manifest = folder.join("Cargo.toml");
        let Ok(text) = std::fs::read_to_string(&manifest) else { continue };
        let names = |line: &str| line.starts_with("burn.") || line.starts_with("burn =");
        let depends = text.lines().any(names);
        assert_eq!(depends, folder.ends_with("net"), "{}", manifest.display());
    }
}

#[test]
fn what_passes_the_wall_is_this() {
    let names = include_str!("../src/prelude.rs")
        .lines()
        .filter_map(|line| line.strip_prefix("pub use "))
        .collect::<Vec<_>>();
    let passing = [
        "burn;",
        "burn::module::Module;",
        "burn::nn::{Linear, LinearConfig};",
        "burn::optim::GradientsParams;",
        "burn::tensor::activation::{log_softmax, relu, sigmoid, softplus};",
        "burn::tensor::{Device, Distribution, Int, Shape, Tensor, TensorData};",
    ];
    assert_eq!(names, passing, "a name more is a decision: write it here too");
}
