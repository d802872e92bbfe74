//! A Japanese font of the machine, for the sheets. Without one they name a standard font and embed none.

use report::SheetFont;
use std::path::{Path, PathBuf};

/// Where systems keep their fonts.
const FOLDERS: [&str; 7] = [
    "/usr/share/fonts/opentype/noto",
    "/usr/share/fonts/noto-cjk",
    "/usr/share/fonts/google-noto-cjk",
    "/usr/share/fonts/opentype/ipaexfont-gothic",
    "/usr/share/fonts/truetype/fonts-japanese-gothic",
    "C:\\Windows\\Fonts",
    "/System/Library/Fonts",
];
/// Upright sans serifs whose first font is the Japanese one, best first.
const FILES: [&str; 6] = [
    "NotoSansCJK-Regular.ttc",
    "ipaexg.ttf",
    "BIZ-UDGothicR.ttc",
    "YuGothM.ttc",
    "meiryo.ttc",
    "ヒラギノ角ゴシック W3.ttc",
];

/// The first that can be read.
pub(crate) fn japanese() -> Option<SheetFont> {
    first_of(&FOLDERS.map(PathBuf::from))
}

fn first_of(folders: &[impl AsRef<Path>]) -> Option<SheetFont> {
    let there =
        |name: &&str| folders.iter().find_map(|f| std::fs::read(f.as_ref().join(name)).ok());
    let data = FILES.iter().find_map(there)?;
    Some(SheetFont { data, index: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_better_font_counts_before_the_nearer_folder() {
        let [near, far] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let folders = [near.path(), far.path()];
        assert!(first_of(&folders).is_none());
        std::fs::write(near.path().join("meiryo.ttc"), "meiryo").unwrap();
        assert_eq!(first_of(&folders).unwrap().data, b"meiryo");
        std::fs::write(far.path().join("ipaexg.ttf"), "ipa").unwrap();
        assert_eq!(first_of(&folders).unwrap().data, b"ipa");
    }
}
