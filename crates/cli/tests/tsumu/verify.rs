//! `verify` finds every change of a byte, a name or a folder; a folder with files of two runs is no run.

use crate::site::{copy, files, ok, small, small_copy, tsumu};
use std::fs;
use std::path::{Path, PathBuf};
use tsumu::Run;

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

const FLAGS: [&str; 4] = ["--plans", "0", "--policy", "random"];

fn run(site: &Path, out: &Path, more: &[&str]) {
    let mut args = vec!["run".to_string(), text(site), "--out".into(), text(out)];
    args.extend(FLAGS.iter().chain(more).map(|s| s.to_string()));
    ok(&args);
}

/// Whether the library finds nothing wrong; the program's exit status follows from it.
fn is_clean(run: &Path) -> bool {
    Run::verify(run, None).is_ok_and(|differences| differences.is_empty())
}

/// Does something to the folder, sees that it is found, and undoes it.
#[track_caller]
fn found(run: &Path, what: &str, change: impl FnOnce(), undo: impl FnOnce()) {
    change();
    assert!(!is_clean(run), "{what} is not found");
    undo();
    assert!(is_clean(run), "after {what} was undone");
}

fn folders(run: &Path) -> Vec<PathBuf> {
    let mut all = vec![run.to_path_buf()];
    for (name, _) in files(run) {
        all.extend(run.join(name).parent().map(Path::to_path_buf));
    }
    all.sort();
    all.dedup();
    all
}

#[test]
fn every_change_of_a_finished_run_is_found() {
    let runs = tempfile::tempdir().unwrap();
    let out = runs.path().join("run");
    run(small(), &out, &[]);
    assert!(is_clean(&out));
    let all = files(&out);
    assert!(all.len() > 20, "{}", all.len());
    for (number, (name, content)) in all.iter().enumerate() {
        let (path, shown) = (out.join(name), name.display());
        // First, last and drawn places, each with a drawn change of bits.
        let draw = |k: u64| geom::SeedTree::new(22).child("byte", number as u64 * 100 + k).value();
        let length = content.len() as u64;
        let places = [0, length - 1].into_iter().chain((0..8).map(|k| draw(k) % length));
        for (k, place) in places.enumerate() {
            let mut other = content.clone();
            other[place as usize] ^= (draw(50 + k as u64) % 255 + 1) as u8;
            let write = |bytes: &[u8]| fs::write(&path, bytes).unwrap();
            found(&out, &format!("byte {place} of {shown}"), || write(&other), || write(content));
        }
        let put_back = || fs::write(&path, content).unwrap();
        let cut = || fs::write(&path, &content[..content.len() - 1]).unwrap();
        found(&out, &format!("the cut end of {shown}"), cut, put_back);
        let longer = || fs::write(&path, [content, &b" "[..]].concat()).unwrap();
        found(&out, &format!("a byte after {shown}"), longer, put_back);
        let aside = path.with_file_name(format!("_{}", name.file_name().unwrap().display()));
        let rename = || fs::rename(&path, &aside).unwrap();
        let back = || fs::rename(&aside, &path).unwrap();
        found(&out, &format!("the new name of {shown}"), rename, back);
        if name != Path::new("timing.json") {
            let remove = || fs::remove_file(&path).unwrap();
            found(&out, &format!("{shown} gone"), remove, put_back);
        }
    }
    for folder in folders(&out) {
        for name in
            ["new", ".tsumu-new.part", ".tsumu-lock", ".tsumu-outputs", ".tsumu-resume", "ü"]
        {
            let new = folder.join(name);
            let shown = new.strip_prefix(&out).unwrap().display().to_string();
            let file = || fs::write(&new, "x").unwrap();
            found(&out, &format!("file {shown}"), file, || fs::remove_file(&new).unwrap());
            let make = || fs::create_dir_all(new.join("deep")).unwrap();
            found(&out, &format!("folder {shown}"), make, || fs::remove_dir_all(&new).unwrap());
        }
    }
    program_says_so(&out);
}

fn program_says_so(out: &Path) {
    ok(&["verify", &text(out)]);
    let blocks = out.join("recognise/blocks.csv");
    let other = fs::read_to_string(&blocks).unwrap().replacen('1', "2", 1);
    fs::write(&blocks, other).unwrap();
    let said = tsumu(&["verify", &text(out)]);
    assert!(said.code == 1 && said.out.contains("blocks.csv: changed"), "{}{}", said.out, said.err);
}

#[cfg(unix)]
#[test]
fn a_link_in_the_place_of_a_file_is_found() {
    let runs = tempfile::tempdir().unwrap();
    let out = runs.path().join("run");
    run(small(), &out, &[]);
    let elsewhere = runs.path().join("elsewhere");
    for name in ["recognise/blocks.csv", "exports"] {
        let place = out.join(name);
        let swap = || {
            fs::rename(&place, &elsewhere).unwrap();
            std::os::unix::fs::symlink(&elsewhere, &place).unwrap();
        };
        let back = || {
            fs::remove_file(&place).unwrap();
            fs::rename(&elsewhere, &place).unwrap();
        };
        found(&out, &format!("a link for {name}"), swap, back);
    }
}

#[test]
fn the_manifest_vouches_for_itself() {
    let runs = tempfile::tempdir().unwrap();
    let out = runs.path().join("run");
    run(small(), &out, &[]);
    let path = out.join("manifest.json");
    let own = fs::read_to_string(&path).unwrap();
    let edits = [
        ("\"format\": 2", "\"format\": 99"),
        ("\"format\": 2", "\"format\": 1"),
        ("\"seed\": 5", "\"seed\": 777"),
        ("\"version\": \"0", "\"version\": \"9"),
        ("{\n", "{ \n"),
        ("\"outputs\": {", "\"outputs\":  {"),
    ];
    for (from, to) in edits {
        assert!(own.contains(from), "{from}");
        fs::write(&path, own.replacen(from, to, 1)).unwrap();
        for command in ["verify", "report"] {
            let mut args = vec![command.to_string(), text(&out)];
            if command == "report" {
                args.extend(["--site".into(), text(small())]);
            }
            let said = tsumu(&args);
            assert_eq!(said.code, 2, "{command} believes {to}: {}{}", said.out, said.err);
            assert!(said.err.contains("manifest.json"), "{}", said.err);
        }
    }
    fs::write(&path, own).unwrap();
    ok(&["verify", &text(&out)]);
}

/// Inputs, weights, settings, program and class of processor; reviews: `a_review_stands_and_is_recorded`.
#[test]
fn the_manifest_says_what_made_a_run() {
    let runs = tempfile::tempdir().unwrap();
    let out = runs.path().join("run");
    run(small(), &out, &[]);
    let text = fs::read_to_string(out.join("manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
    for input in ["site.toml", "catalog.toml", "survey.laz"] {
        assert_eq!(manifest["inputs"][input]["blake3"].as_str().map(str::len), Some(64), "{input}");
    }
    let notes = &manifest["notes"];
    let program = fs::metadata(env!("CARGO_BIN_EXE_tsumu")).unwrap().len();
    assert_eq!(notes["program_file"]["bytes"].as_u64(), Some(program), "{notes:#}");
    assert_eq!(notes["program_file"]["blake3"].as_str().map(str::len), Some(64));
    assert!(notes["weights"].as_str().is_some_and(|w| w.contains("steps")), "{notes:#}");
    assert!(notes["processor"].as_str().is_some_and(|p| !p.is_empty()), "{notes:#}");
    assert!(manifest["config"]["plan"].is_object() && manifest["seed"] == 5);
}

/// Files of one run in the folder of another were once taken for one run's.
#[test]
fn files_of_two_runs_are_no_run() {
    let runs = tempfile::tempdir().unwrap();
    let (one, two) = (runs.path().join("one"), runs.path().join("two"));
    let site = small_copy();
    run(site.path(), &one, &[]);
    // Of another pile: two seeds may well recognise the same.
    run(copy().path(), &two, &[]);
    for name in ["recognise/summary.json", "plan/summary.json"] {
        let own = fs::read(one.join(name)).unwrap();
        let others = fs::read(two.join(name)).unwrap();
        assert!(own != others, "{name} shows nothing");
        fs::write(one.join(name), others).unwrap();
        for command in ["report", "plan"] {
            let again = text(&runs.path().join("again"));
            let mut args =
                vec![command, one.to_str().unwrap(), "--site", site.path().to_str().unwrap()];
            args.extend(["--out", &again]);
            let said = tsumu(&args);
            assert!(
                said.code == 2 && said.err.contains(name),
                "{command}: {} {}",
                said.code,
                said.err
            );
        }
        fs::write(one.join(name), own).unwrap();
    }
    // A table that was corrected by hand is no fault, and is told.
    let blocks = one.join("recognise/blocks.csv");
    fs::write(&blocks, fs::read_to_string(&blocks).unwrap() + "\n").unwrap();
    ok(&["report", &text(&one), "--site", &text(site.path())]);
}

/// What lay in the folder of a killed run was once vouched for by the next one.
#[test]
fn what_others_put_into_an_unfinished_run_stays_theirs() {
    let runs = tempfile::tempdir().unwrap();
    let out = runs.path().join("run");
    run(small(), &out, &[]);
    // As a run leaves it that was killed after its first files.
    fs::remove_file(out.join("manifest.json")).unwrap();
    let lines: String = files(&out).iter().map(|(name, _)| record(&out, name)).collect();
    fs::write(out.join(".tsumu-outputs"), lines).unwrap();
    fs::write(out.join("exports/theirs.tif"), "theirs").unwrap();
    for command in ["verify", "report"] {
        let mut args = vec![command.to_string(), text(&out)];
        if command == "report" {
            args.extend(["--site".into(), text(small())]);
        }
        let said = tsumu(&args);
        assert!(said.code == 2 && said.err.contains("not finished"), "{command}: {}", said.err);
    }
    run(small(), &out, &[]);
    let said = tsumu(&["verify", &text(&out)]);
    assert_eq!(said.code, 1);
    let told: Vec<&str> = said.out.lines().collect();
    assert!(told.len() == 1 && told[0].contains("theirs.tif: not made by the run"), "{told:?}");
}

fn record(run: &Path, name: &Path) -> String {
    let entry = io::manifest::entry(&run.join(name)).unwrap();
    format!("{} {} {}\n", entry.blake3, entry.bytes, name.display())
}
