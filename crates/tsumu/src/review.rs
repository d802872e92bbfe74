//! A reviewer's decisions: applied to what a run recognised, recorded with what they changed, found again in its manifest.

use crate::Result;
use crate::error::OrBadInput;
use crate::review_matching::{self, Change};
use geom::{Event, Observer, Stage, Warning};
use io::manifest::Manifest;
use io::review::FILE;
use report::Text;
use scene::{Catalog, Decision, Recognised, Review, SiteFrame};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::Path;

/// What a review did to a run; `notes.review` of its manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReviewRecord {
    /// Who decided; may be empty.
    pub reviewer: String,
    /// What each decision did.
    pub decisions: Vec<DecisionRecord>,
}

/// One decision and what it changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DecisionRecord {
    /// The block's number in the run that was reviewed.
    pub block_id: u32,
    /// The decision.
    #[serde(rename = "verdict")]
    pub decision: Decision,
    /// Type, as decided.
    pub model: String,
    /// Why, in the reviewer's words.
    pub note: String,
    /// The block's number in this run; `None`: it has none.
    pub block_id_in_this_run: Option<u32>,
    /// What this run saw otherwise; empty: it agrees.
    pub changed: Vec<String>,
}

/// Leaves the blocks as the reviewer left them, and says what that changed.
pub(crate) fn apply(
    review: Option<&Review>,
    catalog: &Catalog,
    frame: &SiteFrame,
    blocks: &mut Vec<Recognised>,
    observer: &dyn Observer,
) -> Result<Option<ReviewRecord>> {
    let Some(review) = review else { return Ok(None) };
    let changes =
        review_matching::apply(review, catalog, frame, blocks, observer).or_bad_input()?;
    let record = |(said, change): (&scene::ReviewedBlock, Change)| DecisionRecord {
        block_id: said.block_id,
        decision: said.decision,
        model: said.model.clone(),
        note: said.note.clone(),
        block_id_in_this_run: change.block_id,
        changed: change.changed,
    };
    let decisions: Vec<_> = review.blocks.iter().zip(changes).map(record).collect();
    for d in decisions.iter().filter(|d| !d.changed.is_empty()) {
        let message = format!("reviewed block {}: {}", d.block_id, d.changed.join(", "));
        observer.event(Event::Noted { stage: Stage::Review, message });
    }
    Ok(Some(ReviewRecord { reviewer: review.reviewer.clone(), decisions }))
}

impl ReviewRecord {
    /// Decisions that changed something.
    pub fn changed(&self) -> usize {
        self.decisions.iter().filter(|d| !d.changed.is_empty()).count()
    }

    /// In words.
    pub fn line(&self) -> String {
        let by = if self.reviewer.is_empty() { "an unnamed reviewer" } else { &self.reviewer };
        format!(
            "{} decisions by {by} applied ({FILE}); {} of them changed this run's blocks",
            self.decisions.len(),
            self.changed()
        )
    }

    pub(crate) fn record(&self, manifest: &mut Manifest) {
        manifest.notes.insert("review".into(), json!(self));
    }

    /// What a manifest says of a review.
    pub(crate) fn of(manifest: &Manifest) -> Option<Self> {
        serde_json::from_value(manifest.notes.get("review")?.clone()).ok()
    }

    /// For the report: a label, and who decided how often what.
    pub(crate) fn provenance(&self) -> (Text, String) {
        let with = |d: Decision| self.decisions.iter().filter(|r| r.decision == d).count();
        let by = if self.reviewer.is_empty() { "–" } else { &self.reviewer };
        let counts = format!(
            "{by}: {} ✓, {} ✗, {} ✎; {} ≠",
            with(Decision::Accepted),
            with(Decision::Rejected),
            with(Decision::Corrected),
            self.changed()
        );
        let label = Text::new(
            "Review (by; accepted ✓, rejected ✗, corrected ✎; otherwise than the program ≠)",
            "照査（照査者; 承認 ✓、却下 ✗、修正 ✎; プログラムの判定と異なるもの ≠）",
        );
        (label, counts)
    }
}

/// Warns of a review in the site folder that is not the one a run applied; whether it is that one.
pub(crate) fn is_of_run(
    site: Option<&Path>,
    manifest: &Manifest,
    observer: &dyn Observer,
) -> Result<bool> {
    let Some(path) = site.map(|s| s.join(FILE)).filter(|p| p.exists()) else { return Ok(false) };
    if manifest.inputs.get(FILE) == Some(&io::manifest::entry(&path)?) {
        return Ok(true);
    }
    let message =
        format!("{} is not the one this run applied; `tsumu run` again does so", path.display());
    observer.event(Event::Warned(Warning { stage: Stage::Review, message }));
    Ok(false)
}
