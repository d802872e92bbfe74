//! A reviewer's decisions at the command line: read, honoured, and recorded with what they changed.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use anyhow::anyhow;
use geom::{Event, Observer, Warning};
use io::manifest::Manifest;
use io::review::FILE;
use pipeline::review::Change;
use report::Text;
use scene::{Catalog, Recognised, Review, SiteFrame};
use serde_json::json;
use std::path::Path;

/// The review of a site folder; `None` without one.
pub fn of_site(folder: &Path) -> Result<Option<Review>, Exit> {
    io::review::read(&folder.join(FILE)).or_bad_input()
}

/// A review that the user named.
pub fn of_file(file: &Path) -> Result<Review, Exit> {
    let review = io::review::read(file).or_bad_input()?;
    review.ok_or_else(|| {
        Exit::bad_input(anyhow!("cannot read {}: there is no such file", file.display()))
    })
}

/// What a review did.
pub struct Honoured<'a> {
    review: &'a Review,
    changes: Vec<Change>,
}

/// Leaves the blocks as the reviewer left them, and says what that changed.
pub fn honour<'a>(
    review: Option<&'a Review>,
    catalog: &Catalog,
    frame: &SiteFrame,
    blocks: &mut Vec<Recognised>,
    terminal: &Terminal,
) -> Result<Option<Honoured<'a>>, Exit> {
    let Some(review) = review else { return Ok(None) };
    let changes =
        pipeline::review::honour(review, catalog, frame, blocks, terminal).or_bad_input()?;
    for change in changes.iter().filter(|c| !c.changed.is_empty()) {
        let message =
            format!("reviewed block {}: {}", change.reviewed_block_id, change.changed.join(", "));
        terminal.event(Event::Noted { stage: "review", message });
    }
    let honoured = Honoured { review, changes };
    terminal.say(honoured.line());
    Ok(Some(honoured))
}

impl Honoured<'_> {
    fn line(&self) -> String {
        let changed = self.changes.iter().filter(|c| !c.changed.is_empty()).count();
        let by = if self.review.reviewer.is_empty() {
            "an unnamed reviewer"
        } else {
            &self.review.reviewer
        };
        format!(
            "{} decisions by {by} honoured ({FILE}); {changed} of them changed this run's blocks",
            self.changes.len()
        )
    }

    /// Who decided what, and what that changed, for the manifest.
    pub fn record(&self, manifest: &mut Manifest) {
        let decision = |(b, c): (&scene::ReviewedBlock, &Change)| {
            json!({ "block_id": b.block_id, "verdict": b.decision, "model": b.model, "note": b.note,
                    "block_id_in_this_run": c.block_id, "changed": c.changed })
        };
        let decisions: Vec<_> =
            self.review.blocks.iter().zip(&self.changes).map(decision).collect();
        manifest.notes.insert(
            "review".into(),
            json!({ "reviewer": self.review.reviewer, "decisions": decisions }),
        );
    }
}

/// What a manifest says of the review, for the report.
pub fn provenance(manifest: &Manifest) -> Option<(Text, String)> {
    let review = manifest.notes.get("review")?;
    let decisions = review["decisions"].as_array().map_or(&[][..], Vec::as_slice);
    let with = |verdict: &str| decisions.iter().filter(|d| d["verdict"] == verdict).count();
    let changed =
        decisions.iter().filter(|d| d["changed"].as_array().is_some_and(|c| !c.is_empty())).count();
    let by = review["reviewer"].as_str().filter(|r| !r.is_empty()).unwrap_or("–");
    let counts = format!(
        "{by}: {} ✓, {} ✗, {} ✎; {changed} ≠",
        with("accepted"),
        with("rejected"),
        with("corrected")
    );
    let label = Text::new(
        "Review (by; accepted ✓, rejected ✗, corrected ✎; otherwise than the program ≠)",
        "照査（照査者; 承認 ✓、却下 ✗、修正 ✎; プログラムの判定と異なるもの ≠）",
    );
    Some((label, counts))
}

/// The site's review when it is the one that a run honoured; another one is warned of.
pub fn honoured_one(
    site: &Path,
    manifest: Option<&Manifest>,
    terminal: &Terminal,
) -> Result<Option<Review>, Exit> {
    let path = site.join(FILE);
    if !path.exists() {
        return Ok(None);
    }
    if manifest.and_then(|m| m.inputs.get(FILE)) == Some(&io::manifest::entry(&path)?) {
        return of_site(site);
    }
    let message =
        format!("{} is not the one this run honoured; `tsumu run` again does so", path.display());
    terminal.event(Event::Warned(Warning { stage: "review", message }));
    Ok(None)
}
