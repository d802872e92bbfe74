//! `review.json` of a site: what a person decided about the blocks of an earlier run.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use anyhow::{Context, anyhow};
use io::manifest::Manifest;
use scene::{Catalog, Recognised, Review, SiteFrame};
use serde_json::json;
use std::io::Read;
use std::path::Path;

/// The file's name in the site folder.
pub const FILE: &str = "review.json";
/// A thousand blocks take half a megabyte.
const LARGEST: u64 = 64 << 20;

/// The review of a site folder; `None` without one.
pub fn of_site(folder: &Path) -> Result<Option<Review>, Exit> {
    let path = folder.join(FILE);
    let file = match std::fs::File::open(&path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        other => other.with_context(|| format!("cannot read {}", path.display())).or_bad_input()?,
    };
    let mut text = String::new();
    file.take(LARGEST)
        .read_to_string(&mut text)
        .with_context(|| format!("cannot read {}", path.display()))
        .or_bad_input()?;
    let review = serde_json::from_str(&text)
        .map_err(|e| Exit::bad_input(anyhow!("{}: {e}; save it again from the report", path.display())))?;
    Ok(Some(review))
}

/// The blocks as the reviewer left them.
pub fn honour(
    review: Option<&Review>,
    catalog: &Catalog,
    frame: &SiteFrame,
    blocks: &mut Vec<Recognised>,
    terminal: &Terminal,
) -> Result<(), Exit> {
    let Some(review) = review else { return Ok(()) };
    let touched = pipeline::review::honour(review, catalog, frame, blocks, terminal).or_bad_input()?;
    let by = if review.reviewer.is_empty() { "an unnamed reviewer" } else { &review.reviewer };
    terminal.say(format!("{touched} of {} decisions by {by} applied ({FILE})", review.blocks.len()));
    Ok(())
}

/// Who decided what, and the hash of the file.
pub fn record(review: Option<&Review>, folder: &Path, manifest: &mut Manifest) -> Result<(), Exit> {
    if let Some(review) = review {
        let decisions: Vec<_> = review
            .blocks
            .iter()
            .map(|b| json!({ "block_id": b.block_id, "verdict": b.verdict, "model": b.model, "note": b.note }))
            .collect();
        manifest.notes.insert("review".into(), json!({ "reviewer": review.reviewer, "decisions": decisions }));
        manifest.add_input(Path::new(FILE), &folder.join(FILE))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_review_is_read_or_named() {
        let folder = tempfile::tempdir().unwrap();
        assert!(of_site(folder.path()).unwrap().is_none());
        // As the report page writes it.
        let text = r#"{"format": 1, "reviewer": "Sato", "blocks": [{"block_id": 3, "verdict": "rejected", "model": "tetrapod",
            "x_m": -62000.5, "y_m": 1.0, "z_m": 2, "qw": 1, "qx": 0, "qy": 0, "qz": 0, "fitness_m": 0.02, "occlusion": 0.4, "note": ""}]}"#;
        std::fs::write(folder.path().join(FILE), text).unwrap();
        let review = of_site(folder.path()).unwrap().unwrap();
        assert_eq!((review.blocks[0].block_id, review.blocks[0].verdict), (3, scene::Verdict::Rejected));
        std::fs::write(folder.path().join(FILE), text.replace("rejected", "perhaps")).unwrap();
        let message = of_site(folder.path()).unwrap_err().line();
        assert!(message.contains("review.json") && message.contains("perhaps"), "{message}");
    }
}
