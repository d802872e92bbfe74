//! `ratings.json`: what people who build think of the blocks of earlier plans.

use crate::input::Input;
use crate::{IoError, Place};
use scene::Ratings;
use std::path::Path;

/// Its name in a site folder.
pub const FILE: &str = "ratings.json";
/// Ten thousand ratings take four megabytes.
const LIMIT: u64 = 64 << 20;

/// Reads the file; `None` when there is none.
pub fn read(path: &Path) -> Result<Option<Ratings>, IoError> {
    match Input::open(path) {
        Err(IoError::Os { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            Ok(None)
        }
        opened => read_from(&mut opened?).map(Some),
    }
}

/// The same from an opened file.
pub fn read_from(input: &mut Input) -> Result<Ratings, IoError> {
    let text = input.text(LIMIT)?;
    let ratings: Ratings = serde_json::from_str(&text).map_err(|e| {
        input.malformed(
            Place::Line(e.line() as u64),
            format!("no ratings: {e}; save them again from the report"),
        )
    })?;
    if ratings.format != 1 {
        let what = format!("format = {} is not known; this program reads 1", ratings.format);
        return Err(input.malformed(Place::Line(1), what));
    }
    Ok(ratings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratings_are_read_or_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        assert!(read(&path).unwrap().is_none());
        // As the report page writes them.
        let place = r#"{"model": "t", "x_m": 1.5, "y_m": -2, "z_m": 0.25, "signs": [-0.5, 0.1, 0, 0.5, 0, 0]}"#;
        let text = format!(
            r#"{{"format": 1, "site": "s", "blocks": [{{"by": "Sato", "when": "2026-11-30", "order": 3, "rating": "sticks-out", "place": {place}}}],
            "pairs": [{{"by": "Sato", "when": "2026-11-30T08:00:00Z", "pair": 1, "better": "b", "a": {place}, "b": {place}}}]}}"#
        );
        std::fs::write(&path, &text).unwrap();
        let ratings = read(&path).unwrap().unwrap();
        assert_eq!(ratings.blocks[0].rating, scene::BlockRating::SticksOut);
        assert_eq!(ratings.pairs[0].better, scene::Better::B);
        for (right, wrong) in
            [("sticks-out", "ugly"), ("\"format\": 1", "\"format\": 7"), ("0.5, 0, 0]", "0.5]")]
        {
            std::fs::write(&path, text.replace(right, wrong)).unwrap();
            let message = read(&path).unwrap_err().to_string();
            assert!(message.contains("ratings.json, line"), "{message}");
        }
    }
}
