//! Where things lie in a run folder: one folder a stage, named by the stage's word.

use crate::error::OrBadInput;
use crate::summary::{PlannedSummary, RecogniseSummary};
use crate::{Error, Result, resume};
use anyhow::{Context, anyhow};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// The drawings on paper, among the exports.
pub(crate) const SHEETS: &str = "sheets.pdf";

/// A run folder. Nothing is made until something is written.
#[derive(Clone, Debug)]
pub struct RunFolder {
    root: PathBuf,
}

impl RunFolder {
    /// The folder for a new run. Refuses one that holds something else than an earlier run, or lies in one.
    pub fn for_writing(root: &Path) -> Result<Self> {
        let folder = Self { root: root.to_path_buf() };
        outside_of_runs(root)?;
        io::atomic::refuse_links(root).or_bad_input()?;
        if root.is_file() {
            return Err(Error::bad_input(anyhow!(
                "{}: is a file, not a folder; choose another --out",
                root.display()
            )));
        }
        let entries = match std::fs::read_dir(root) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(folder),
            Err(e) => {
                return Err(Error::failed(
                    anyhow!(e).context(format!("cannot read {}", root.display())),
                ));
            }
        };
        let ours = [
            "config.toml",
            "manifest.json",
            "timing.json",
            "report.html",
            "picture.png",
            "segment",
            "recognise",
            "plan",
            "report",
            "exports",
        ];
        for entry in entries {
            let entry = entry.with_context(|| format!("cannot read {}", root.display()))?;
            let name = entry.file_name().to_string_lossy().into_owned();
            if !ours.contains(&name.as_str()) && !name.starts_with(".tsumu-") {
                return Err(Error::bad_input(anyhow!(
                    "{}: holds `{name}`, which is not of a run; choose an empty folder with --out",
                    root.display()
                )));
            }
        }
        Ok(folder)
    }

    /// An existing run.
    pub fn existing(root: &Path) -> Self {
        Self { root: root.to_path_buf() }
    }

    /// Writes the wall times of a run: the one file that no manifest vouches for.
    pub fn write_timing(&self, seconds: &serde_json::Value) -> Result<()> {
        Ok(io::manifest::write_times(&self.root, seconds)?)
    }

    /// The folder itself.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Resolved settings.
    pub fn config(&self) -> PathBuf {
        self.root.join("config.toml")
    }

    /// Wall times: the only file that differs between two runs.
    pub fn timing(&self) -> PathBuf {
        self.root.join("timing.json")
    }

    /// Files for GIS, CAD, BIM and viewers.
    pub fn exports(&self) -> PathBuf {
        self.root.join("exports")
    }

    /// The drawings on paper.
    pub fn sheets(&self) -> PathBuf {
        self.exports().join(SHEETS)
    }

    /// The page for people.
    pub fn report(&self) -> PathBuf {
        self.root.join("report.html")
    }

    /// The site with its blocks, as a picture.
    pub fn picture(&self) -> PathBuf {
        self.root.join("picture.png")
    }

    /// Survey with the instance of every point.
    pub fn segment_cloud(&self) -> PathBuf {
        self.root.join("segment/cloud.laz")
    }

    /// Recognised blocks.
    pub fn blocks(&self) -> PathBuf {
        self.root.join("recognise/blocks.csv")
    }

    /// How well the poses are held.
    pub fn covariance(&self) -> PathBuf {
        self.root.join("recognise/covariance.csv")
    }

    /// Blocks too little is seen of.
    pub fn not_judged(&self) -> PathBuf {
        self.root.join("recognise/not_judged.csv")
    }

    /// Survey points of each of those.
    pub fn not_judged_points(&self) -> PathBuf {
        self.root.join("recognise/not_judged_points.csv")
    }

    /// Survey with the recognised block of every point.
    pub fn recognise_cloud(&self) -> PathBuf {
        self.root.join("recognise/cloud.laz")
    }

    /// Figures of recognition.
    pub fn recognise_summary(&self) -> PathBuf {
        self.root.join("recognise/summary.json")
    }

    /// Blocks to add.
    pub fn placements(&self) -> PathBuf {
        self.root.join("plan/placements.csv")
    }

    /// Places that stay below the design.
    pub fn unfilled(&self) -> PathBuf {
        self.root.join("plan/unfilled.csv")
    }

    /// The plan as the crane works it off.
    pub fn lifts(&self) -> PathBuf {
        self.root.join("plan/lifts.csv")
    }

    /// Weights of the search that ratings moved.
    pub fn weights(&self) -> PathBuf {
        self.root.join("plan/weights.json")
    }

    /// Figures of the plan.
    pub fn plan_summary(&self) -> PathBuf {
        self.root.join("plan/summary.json")
    }
}

/// Refuses a folder or file inside a finished run, which would then no longer be what its manifest says.
pub(crate) fn outside_of_runs(place: &Path) -> Result<()> {
    let whole = std::path::absolute(place).unwrap_or_else(|_| place.to_path_buf());
    let is_run = |folder: &&Path| {
        let run = RunFolder::existing(folder);
        let ours = run.blocks().is_file() || run.placements().is_file();
        ours && folder.join(io::manifest::FILE).is_file()
    };
    match whole.ancestors().skip(1).find(is_run) {
        Some(run) => Err(Error::bad_input(anyhow!(
            "{}: lies in the run {}, of which it would be no part; choose a place beside it with --out",
            place.display(),
            run.display()
        ))),
        None => Ok(()),
    }
}

/// A run of a site, or a plan alone, for lists.
#[derive(Clone, Debug, Serialize)]
pub struct RunEntry {
    /// Name of its folder in the site folder.
    pub name: String,
    /// False for one that was interrupted; the same command goes on with it.
    pub whole: bool,
    /// When it was sealed or last written to; seconds since 1970.
    pub at_s: u64,
    /// Figures of recognition; `None` for a plan alone, or where they cannot be read.
    pub recognised: Option<RecogniseSummary>,
    /// Figures of the plan.
    pub planned: Option<PlannedSummary>,
}

/// The runs that lie in a site folder, the latest first. A folder that cannot be read has none.
pub fn runs_of(site: &Path) -> Vec<RunEntry> {
    let folders = std::fs::read_dir(site).into_iter().flatten().flatten().map(|e| e.path());
    let mut runs: Vec<RunEntry> = folders.filter_map(|f| RunEntry::of(&f)).collect();
    runs.sort_by(|a, b| b.at_s.cmp(&a.at_s).then_with(|| b.name.cmp(&a.name)));
    runs
}

impl RunEntry {
    fn of(root: &Path) -> Option<Self> {
        let manifest = root.join(io::manifest::FILE);
        let whole = manifest.is_file();
        let begun = whole || resume::is_unfinished(root);
        let run = RunFolder::existing(root);
        // A comparison has a manifest too, but neither blocks nor a plan.
        let ours = run.blocks().is_file() || run.placements().is_file();
        if !begun || (whole && !ours) {
            return None;
        }
        let at = std::fs::metadata(if whole { &manifest } else { root }).and_then(|m| m.modified());
        let since = at.ok().and_then(|t| t.duration_since(std::time::UNIX_EPOCH).ok());
        Some(Self {
            name: root.file_name()?.to_str()?.into(),
            whole,
            at_s: since.unwrap_or_default().as_secs(),
            recognised: figures(&run.recognise_summary()),
            planned: figures(&run.plan_summary()),
        })
    }
}

fn figures<T: DeserializeOwned>(file: &Path) -> Option<T> {
    let bytes = io::read_bytes(file, 64 << 20).ok()?;
    serde_json::from_slice(&bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_listed_and_other_folders_are_not() {
        let site = tempfile::tempdir().unwrap();
        for (name, file) in
            [("run", "manifest.json"), ("photos", "a.jpg"), ("run-2", ".tsumu-lock")]
        {
            std::fs::create_dir_all(site.path().join(name).join("recognise")).unwrap();
            std::fs::write(site.path().join(name).join(file), "{}").unwrap();
        }
        std::fs::write(site.path().join("run/recognise/blocks.csv"), "").unwrap();
        let runs = runs_of(site.path());
        let whole: std::collections::BTreeMap<_, _> =
            runs.iter().map(|r| (r.name.as_str(), r.whole)).collect();
        assert_eq!(whole, [("run", true), ("run-2", false)].into());
        assert!(runs_of(&site.path().join("gone")).is_empty());
    }

    #[test]
    fn a_folder_in_a_run_is_refused() {
        let site = tempfile::tempdir().unwrap();
        let run = site.path().join("run");
        std::fs::create_dir_all(run.join("plan")).unwrap();
        std::fs::write(run.join("plan/placements.csv"), "").unwrap();
        let inside = run.join("deep/down");
        assert!(RunFolder::for_writing(&inside).is_ok());
        std::fs::write(run.join("manifest.json"), "{}").unwrap();
        let message = RunFolder::for_writing(&inside).unwrap_err().line();
        assert!(message.contains("lies in the run"), "{message}");
        assert!(RunFolder::for_writing(&run).is_ok());
        assert!(RunFolder::for_writing(&site.path().join("run-2")).is_ok());
    }

    #[test]
    fn a_folder_of_something_else_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(RunFolder::for_writing(folder.path()).is_ok());
        std::fs::write(folder.path().join("thesis.docx"), "precious").unwrap();
        let message = RunFolder::for_writing(folder.path()).unwrap_err().line();
        assert!(message.contains("thesis.docx"), "{message}");
    }
}
