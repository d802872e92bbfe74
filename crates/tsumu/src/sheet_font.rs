//! A Japanese font of the machine, for the sheets. Without one they name a standard font and embed none.

use crate::{Error, Result};
use io::IoError;
use report::SheetFont;
use std::io::ErrorKind::{NotADirectory, NotFound, PermissionDenied};
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

/// The first that is there for this user. One that is there and cannot be read for want of something else is no reason for sheets
/// without it: the same run would write other sheets another time.
pub(crate) fn japanese() -> Result<Option<SheetFont>> {
    first_of(&FOLDERS.map(PathBuf::from))
}

fn first_of(folders: &[impl AsRef<Path>]) -> Result<Option<SheetFont>> {
    for file in FILES {
        for folder in folders {
            let path = folder.as_ref().join(file);
            match std::fs::read(&path) {
                Ok(data) => return Ok(Some(SheetFont { data, index: 0 })),
                Err(e) if [NotFound, NotADirectory, PermissionDenied].contains(&e.kind()) => {}
                Err(source) => {
                    return Err(Error::failed(IoError::Os { path, doing: "read", source }));
                }
            }
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_better_font_counts_before_the_nearer_folder() {
        let [near, far] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let folders = [near.path(), far.path()];
        assert!(first_of(&folders).unwrap().is_none());
        // No font is one thing, one that is there and cannot be read another. (Windows calls a folder forbidden.)
        let folder = near.path().join("YuGothM.ttc");
        std::fs::create_dir(&folder).unwrap();
        assert!(cfg!(windows) || first_of(&folders).is_err());
        std::fs::remove_dir(&folder).unwrap();
        std::fs::write(near.path().join("meiryo.ttc"), "meiryo").unwrap();
        assert_eq!(first_of(&folders).unwrap().unwrap().data, b"meiryo");
        std::fs::write(far.path().join("ipaexg.ttf"), "ipa").unwrap();
        assert_eq!(first_of(&folders).unwrap().unwrap().data, b"ipa");
    }
}
