//! `review.json`: what a person decided about the blocks of an earlier run.

use crate::input::Input;
use crate::{IoError, Place};
use scene::Review;
use std::path::Path;

/// Its name in a site folder.
pub const FILE: &str = "review.json";
/// A thousand blocks take half a megabyte.
const LIMIT: u64 = 64 << 20;

/// Reads the file; `None` when there is none.
pub fn read(path: &Path) -> Result<Option<Review>, IoError> {
    match Input::open(path) {
        Err(IoError::Os { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            Ok(None)
        }
        opened => read_from(&mut opened?).map(Some),
    }
}

/// The same from an opened file.
pub fn read_from(input: &mut Input) -> Result<Review, IoError> {
    let text = input.text(LIMIT)?;
    serde_json::from_str(&text).map_err(|e| {
        input.malformed(
            Place::Line(e.line() as u64),
            format!("not a review: {e}; save it again from the report"),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_review_is_read_or_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        assert!(read(&path).unwrap().is_none());
        // As the report page writes it.
        let text = r#"{"format": 1, "reviewer": "Sato", "blocks": [{"block_id": 3, "verdict": "rejected", "model": "tetrapod",
            "x_m": -62000.5, "y_m": 1.0, "z_m": 2, "qw": 1, "qx": 0, "qy": 0, "qz": 0, "fitness_m": 0.02, "occlusion": 0.4, "note": ""}]}"#;
        std::fs::write(&path, text).unwrap();
        let review = read(&path).unwrap().unwrap();
        assert_eq!(
            (review.blocks[0].block_id, review.blocks[0].decision),
            (3, scene::Decision::Rejected)
        );
        std::fs::write(&path, text.replace("rejected", "perhaps")).unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(
            message.contains("review.json, line 1") && message.contains("perhaps"),
            "{message}"
        );
    }
}
