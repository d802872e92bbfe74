//! What is kept comes back, and what is made twice is the same.

mod tiny;

use tiny::{open, run, site, site_folder};
use tsumu::{Job, Kind, PlanOptions, RecogniseOptions, RecogniseSummary, Run, Settings, Site};

/// The page of a run was once made anew without its not-judged blocks.
#[test]
fn a_run_opened_is_the_run_that_was_kept() {
    let folder = site_folder(site());
    let job = Job::silent();
    let site = Site::load(folder.path(), &job).unwrap();
    let found = site.recognise(&RecogniseOptions::default(), &job).unwrap();
    let stated = scene::stated(&found.blocks).count();
    assert!(stated >= 1 && stated < found.blocks.len(), "{stated} of {}", found.blocks.len());
    let planned = site.plan(&found, &PlanOptions::default(), &job).unwrap();
    let new = Run::create(&folder.path().join("run"), &site).unwrap();
    new.keep(&found).unwrap().keep(&planned).unwrap().seal().unwrap();

    let (_, back) = open(folder.path());
    for (there, kept) in back.recognition.blocks.iter().zip(&found.blocks) {
        assert_eq!((there.block, &there.verdict), (kept.block, &kept.verdict));
        assert!(there.points == kept.points, "points of block {}", kept.block.0);
    }
    assert!(back.recognition == found, "labels, weights or review differ");
    let there = back.planned.unwrap();
    assert_eq!(there.summary(), planned.summary());
    assert_eq!(there.plan.placements, planned.plan.placements);
    assert_eq!(there.plan.removed, planned.plan.removed);
    assert_eq!(there.pile.blocks, planned.pile.blocks);
    assert_eq!(there.pile.ground, planned.pile.ground);
}

#[test]
fn the_report_of_a_run_is_its_own_page() {
    let folder = site_folder(site());
    run(folder.path());
    let own = std::fs::read_to_string(folder.path().join("run/report.html")).unwrap();
    let (site, run) = open(folder.path());
    let again = run.report(&site, &Job::silent()).unwrap();
    assert!(own.contains("not judged"));
    assert!(again.html == own, "the page made again differs from the run's");
    assert_eq!(again.png, std::fs::read(folder.path().join("run/picture.png")).unwrap());
}

/// Blocks corrected in blocks.csv were once shown under the figures of those that were recognised.
#[test]
fn the_report_follows_a_corrected_blocks_csv() {
    let folder = site_folder(site());
    run(folder.path());
    let file = folder.path().join("run/recognise/blocks.csv");
    let before = std::fs::read_to_string(&file).unwrap();
    let rows = before.lines().count() - 1;
    let shorter: String = before.lines().take(rows).map(|l| format!("{l}\n")).collect();
    std::fs::write(&file, shorter).unwrap();
    let (site, run) = open(folder.path());
    let summary = RecogniseSummary::of(&site.survey, &run.recognition, &site.catalog);
    assert_eq!(summary.recognised_blocks, rows - 1);
    let page = run.report(&site, &Job::silent()).unwrap().html;
    let shown = page.matches("\"typeJudged\":").count();
    assert_eq!(shown, rows - 1 + summary.not_judged_blocks);
    assert!(page.contains("blocks.csv was corrected after the run"));
}

/// Settings written by a run could once not be read.
#[test]
fn a_runs_settings_given_back_repeat_it() {
    let folder = site_folder(site());
    run(folder.path());
    let job = Job::silent();
    // The same survey in a site that says nothing of the settings.
    let bare = site().split("[pose.evidence]").next().unwrap().to_string()
        + "[design]"
        + site().split("[design]").nth(1).unwrap();
    let other = site_folder(&bare);
    let settings =
        Settings { file: Some(folder.path().join("run/config.toml")), ..Settings::default() };
    let site = Site::load_with(other.path(), &settings, &job).unwrap();
    tsumu::run(&site, &other.path().join("run"), &Default::default(), &job).unwrap();
    for name in ["config.toml", "recognise/blocks.csv", "plan/placements.csv", "plan/summary.json"]
    {
        let read = |site: &std::path::Path| std::fs::read(site.join("run").join(name)).unwrap();
        assert!(read(folder.path()) == read(other.path()), "{name} differs");
    }
}

/// A site without a design was once refused.
#[test]
fn without_a_design_a_run_is_an_inventory() {
    let folder = site_folder(site().split("[design]").next().unwrap());
    run(folder.path());
    let at = |name: &str| folder.path().join("run").join(name);
    for name in ["recognise/blocks.csv", "report.html", "exports/project.gpkg", "manifest.json"] {
        assert!(at(name).is_file(), "{name} is missing");
    }
    assert!(!at("plan").exists());
    let own = std::fs::read_to_string(at("report.html")).unwrap();
    let (site, run) = open(folder.path());
    assert!(run.planned.is_none());
    assert!(run.report(&site, &Job::silent()).unwrap().html == own);
    let error = site.plan(&run.recognition, &PlanOptions::default(), &Job::silent()).unwrap_err();
    assert_eq!(error.kind(), Kind::BadInput);
    assert!(error.line().contains("[design]"), "{}", error.line());
}

/// Swapping two entries of the catalogue once changed what was recognised.
#[test]
fn the_order_of_the_catalogue_decides_nothing() {
    let folder = site_folder(site());
    let job = Job::silent();
    let recognised = || {
        let site = Site::load(folder.path(), &job).unwrap();
        let found = site.recognise(&RecogniseOptions::default(), &job).unwrap();
        let named = |b: &scene::Recognised| {
            let fit = b.fit()?;
            let name = site.catalog.get(fit.model).name.clone();
            Some((b.is_stated(), name, fit.site_from_block, fit.confidence, b.points.clone()))
        };
        found.blocks.iter().map(named).collect::<Vec<_>>()
    };
    let there = recognised();
    let file = folder.path().join("catalog.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let mut blocks: Vec<&str> = text.split("[[block]]").skip(1).collect();
    blocks.reverse();
    let swapped: String = blocks.iter().map(|b| format!("[[block]]{b}\n")).collect();
    std::fs::write(&file, swapped).unwrap();
    assert_eq!(recognised(), there);
}

/// A manifest vouches for what its run has written, not for what somebody put beside it.
#[test]
fn a_strangers_file_is_not_vouched_for() {
    let folder = site_folder(site().split("[design]").next().unwrap());
    let unlisted = || {
        let found = Run::verify(&folder.path().join("run"), Some(folder.path())).unwrap();
        found.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    run(folder.path());
    assert_eq!(unlisted(), Vec::<String>::new());
    std::fs::write(folder.path().join("run/exports/note.txt"), "by hand").unwrap();
    run(folder.path());
    assert_eq!(unlisted().len(), 1);
    assert!(unlisted()[0].contains("note.txt"), "{:?}", unlisted());
}
