//! `tsumu synth`: a dataset is the same bytes whole, in shards, on one thread or two, and after an interruption.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const RECIPE: &str = r#"
name = "tiny"
count = [4, 6]
density_per_m2 = 40
site = { kind = "pen", side_blocks = 2.5 }
bed = { stone_blocks = 0.0 }

[sensor]
kind = "uav"

[[catalog.block]]
name = "cube"
shape = { kind = "cube", size = 1.0 }
"#;

fn synth(folder: &Path, out: &str, more: &[&str]) -> Output {
    let recipe = folder.join("recipe.toml");
    fs::write(&recipe, RECIPE).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tsumu"));
    command.arg("synth").arg(recipe).arg("--out").arg(folder.join(out)).args(more);
    command.output().unwrap()
}

fn made(folder: &Path, out: &str, more: &[&str]) {
    let output = synth(folder, out, more);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn files(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut waiting = vec![root.to_path_buf()];
    while let Some(folder) = waiting.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                found.insert(
                    path.strip_prefix(root).unwrap().to_path_buf(),
                    fs::read(&path).unwrap(),
                );
            }
        }
    }
    found
}

#[test]
fn whole_shards_threads_and_resuming_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let five = ["--scenes", "5", "--seed", "7", "--preview"];
    made(folder, "whole", &[&five[..], &["--threads", "2"]].concat());
    let whole = files(&folder.join("whole"));
    assert_eq!(whole.len(), 3 + 5 * 4, "{:?}", whole.keys());

    made(folder, "shards", &[&five[..], &["--threads", "1", "--shard", "1/2"]].concat());
    assert!(!folder.join("shards/index.csv").exists());
    made(folder, "shards", &[&five[..], &["--threads", "1", "--shard", "0/2"]].concat());
    assert_eq!(files(&folder.join("shards")), whole);

    // As a killed run leaves it: some scenes missing, one half written, no index.
    fs::remove_dir_all(folder.join("shards/scenes/00003")).unwrap();
    fs::remove_file(folder.join("shards/index.csv")).unwrap();
    fs::create_dir(folder.join("shards/scenes/.00003-99.part")).unwrap();
    fs::write(folder.join("shards/scenes/.00003-99.part/cloud.ply"), b"ply").unwrap();
    made(folder, "shards", &five);
    assert_eq!(files(&folder.join("shards")), whole);
}

#[test]
fn a_scene_alone_has_the_bytes_it_has_among_others() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    made(folder, "whole", &["--scenes", "4", "--seed", "3"]);
    made(folder, "alone", &["--scenes", "4", "--seed", "3", "--shard", "2/4", "--threads", "1"]);
    let (whole, alone) = (files(&folder.join("whole")), files(&folder.join("alone")));
    let scene: Vec<_> = alone.keys().filter(|name| name.starts_with("scenes")).collect();
    assert_eq!(scene.len(), 3, "{scene:?}");
    assert!(alone.iter().all(|(name, bytes)| whole[name] == *bytes));
}

/// Folders of scenes, whole or under way.
fn begun(folder: &Path) -> usize {
    fs::read_dir(folder.join("scenes")).map_or(0, Iterator::count)
}

/// Killed for good (no handler runs) once so many folders are there, which is before, in the middle of or after writing one.
#[test]
fn killed_again_and_again_it_ends_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let order = ["--scenes", "12", "--seed", "5", "--preview", "--threads", "2"];
    made(folder, "whole", &order);
    let recipe = folder.join("recipe.toml");
    let mut killed = 0;
    for most in 1..=10 {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tsumu"));
        command.arg("synth").arg(&recipe).arg("--out").arg(folder.join("killed")).args(order);
        let mut run = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while begun(&folder.join("killed")) < most && run.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        run.kill().unwrap();
        killed += usize::from(!run.wait().unwrap().success());
    }
    assert!(killed >= 5, "{killed} of 10 runs were killed before their end");
    made(folder, "killed", &order);
    assert_eq!(files(&folder.join("killed")), files(&folder.join("whole")));
}

#[test]
fn bad_recipes_are_refused_with_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("sheet.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let block = "[[catalog.block]]\nname = \"cube\"\nshape = { kind = \"cube\", size = 1.0 }";
    let sheet = "[[catalog.block]]\nname = \"sheet\"\nmesh = \"sheet.obj\"\nunit = \"m\"";
    for (was, is, words) in [
        ("density_per_m2 = 40", "density_per_m2 = 1e8", ["density_per_m2", "lower the density"]),
        ("density_per_m2 = 40", "density_per_m2 = 0", ["density_per_m2", "above 0"]),
        ("density_per_m2 = 40", "density_per_m2 = nan", ["density_per_m2", "above 0"]),
        (
            "kind = \"uav\"",
            "kind = \"mbes\"\npasses = 1\nbeams = 16",
            ["cannot be reached", "more passes or beams"],
        ),
        ("count = [4, 6]", "count = [0, 0]", ["count", "1 to 20000"]),
        ("count = [4, 6]", "count = [6, 4]", ["count", "larger"]),
        ("side_blocks = 2.5", "side_blocks = 0.8", ["one block needs", "make the site larger"]),
        (block, sheet, ["`sheet`", "watertight"]),
        (block, "", ["has no [[catalog.block]]", "--catalog FILE"]),
        ("name = \"tiny\"", "name = \"tiny\"\ncolour = 3", ["colour", "line 3"]),
        ("kind = \"uav\"", "kind = \"sonar\"", ["sonar", "line"]),
        ("kind = \"uav\"", "kind = \"uav\"\nnoise = 3", ["noise", "line"]),
        (
            "kind = \"uav\"",
            "kind = \"uav\"\nleast_views = 50",
            ["least_views", "number of cameras"],
        ),
        (
            "name = \"tiny\"",
            "name = \"tiny\"\nvisibility = \"katz\"\nsensor = { kind = \"mbes\" }",
            ["katz", "mbes"],
        ),
        (
            "name = \"tiny\"",
            "name = \"tiny\"\nmost_attempts = 1\nphysics = { max_time_s = 0.1 }",
            ["no pile", "still moved"],
        ),
        ("name = \"tiny\"", "name = \"tiny\"\nphysics = { step_s = 0.5 }", ["step_s", "0.0333"]),
        (
            "name = \"tiny\"",
            "name = \"tiny\"\nmix = [{ model = \"dolos\", share = 1.0 }]",
            ["dolos", "it has cube"],
        ),
    ] {
        let mut text = RECIPE.replacen(was, is, 1);
        if is.contains("sensor = ") {
            text = text.replacen("[sensor]\nkind = \"uav\"\n", "", 1);
        }
        assert_ne!(text, RECIPE);
        let recipe = folder.join("bad.toml");
        fs::write(&recipe, text).unwrap();
        let out = folder.join("refused");
        let output = Command::new(env!("CARGO_BIN_EXE_tsumu"))
            .arg("synth")
            .arg(recipe)
            .arg("--out")
            .arg(&out)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{is}: {said}");
        assert_eq!(said.lines().filter(|l| l.starts_with("tsumu: ")).count(), 1, "{is}: {said}");
        assert!(words.iter().all(|w| said.contains(w)), "{is}: {said}");
        assert!(!out.exists(), "{is}: a refused recipe leaves nothing");
    }
}

#[test]
fn bad_orders_are_refused_with_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    made(folder, "there", &[]);
    for (out, more, words) in [
        ("there", &["--seed", "9"][..], "choose another --out"),
        ("new", &["--shard", "3/3"], "0/3 to 2/3"),
        ("new", &["--scenes", "0"], "at least 1"),
        ("new", &["--split", "0.5,0.1,0.1"], "add up to 1"),
        ("new", &["--catalog", "nowhere.toml"], "nowhere.toml"),
    ] {
        let output = synth(folder, out, more);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{more:?}: {said}");
        assert!(said.contains(words), "{more:?}: {said}");
        assert!(!folder.join("new").exists());
    }
}
