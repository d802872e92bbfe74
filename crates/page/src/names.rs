//! Names and paths that come from a browser: they stay in the folder that was opened.

use crate::refusal::{Answer, Refusal};
use std::path::{Component, Path, PathBuf};

/// Longest name of a file or folder, bytes.
const LONGEST: usize = 120;
/// Names that Windows keeps for devices.
const DEVICES: [&str; 6] = ["con", "prn", "aux", "nul", "com", "lpt"];
/// The opened folder itself, where it is a site.
pub const SELF: &str = "~";

/// A name that every system can hold, from one that a user chose: what cannot stand in a name becomes `_`. Error: nothing is left.
pub fn made_plain(name: &str) -> Answer<String> {
    let last = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let safe = |c: char| if c.is_control() || "<>:\"|?*'`&%".contains(c) { '_' } else { c };
    let mut plain: String = last.chars().map(safe).collect();
    plain = plain.trim_matches([' ', '.', '~']).to_string();
    while plain.len() > LONGEST {
        // The end of the name is its kind.
        let middle = plain.char_indices().map(|(i, _)| i).nth(plain.chars().count() / 2);
        plain.remove(middle.expect("a long name has a middle"));
    }
    let stem = plain.split('.').next().unwrap_or_default().to_lowercase();
    if DEVICES.contains(&stem.trim_end_matches(|c: char| c.is_ascii_digit())) {
        plain = format!("_{plain}");
    }
    match plain.is_empty() {
        true => Err(Refusal::bad("name", format!("`{name}` is no name of a file or folder"))),
        false => Ok(plain),
    }
}

/// A path below the folder that exists; neither `..` nor a link leads out of it, and nothing hidden is shown.
pub fn below(root: &Path, path: &str) -> Answer<PathBuf> {
    let outside = || Refusal::new(axum::http::StatusCode::FORBIDDEN, "outside", path);
    let relative = Path::new(path);
    let plain = relative.components().all(|c| match c {
        Component::Normal(name) => !name.to_string_lossy().starts_with('.'),
        _ => false,
    });
    if !plain || path.contains(['\\', '\0']) {
        return Err(outside());
    }
    let whole = root.join(relative).canonicalize().map_err(|_| Refusal::gone(path))?;
    if whole.starts_with(root) { Ok(whole) } else { Err(outside()) }
}

/// The folder of a site by its name in a list.
pub fn site_folder(root: &Path, site: &str) -> Answer<PathBuf> {
    let folder = if site == SELF { root.to_path_buf() } else { below(root, site)? };
    match folder.join("site.toml").is_file() {
        true => Ok(folder),
        false => Err(Refusal::gone(site)),
    }
}

/// How the page names a path below the folder.
pub fn shown(root: &Path, path: &Path) -> String {
    let inside = path.strip_prefix(root).unwrap_or(path);
    let parts: Vec<_> = inside.components().map(|c| c.as_os_str().to_string_lossy()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_names_become_plain_ones() {
        for (given, kept) in [
            ("survey.laz", "survey.laz"),
            ("東防波堤 測量.laz", "東防波堤 測量.laz"),
            ("../../etc/passwd", "passwd"),
            ("C:\\data\\a.laz", "a.laz"),
            ("<img src=x onerror=alert(1)>.laz", "_img src=x onerror=alert(1)_.laz"),
            ("a\u{0}b\nc.laz", "a_b_c.laz"),
            (" .hidden. ", "hidden"),
            ("con.laz", "_con.laz"),
            ("COM1.txt", "_COM1.txt"),
        ] {
            assert_eq!(made_plain(given).unwrap(), kept, "{given:?}");
        }
        assert!(made_plain("a/..").is_err() && made_plain("").is_err());
        let long = made_plain(&format!("{}.laz", "防".repeat(300))).unwrap();
        assert!(long.len() <= LONGEST && long.ends_with(".laz"));
    }

    #[test]
    fn no_path_leads_out() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("root").canonicalize().unwrap_or_else(|_| {
            std::fs::create_dir(folder.path().join("root")).unwrap();
            folder.path().join("root").canonicalize().unwrap()
        });
        std::fs::write(folder.path().join("secret"), "x").unwrap();
        std::fs::write(root.join("open"), "x").unwrap();
        std::fs::write(root.join(".hidden"), "x").unwrap();
        assert!(below(&root, "open").is_ok());
        for path in ["../secret", "..", "/etc/passwd", ".hidden", "a/../../secret", "..\\secret"] {
            assert_eq!(below(&root, path).unwrap_err().code, "outside", "{path}");
        }
        assert_eq!(below(&root, "nothing").unwrap_err().code, "gone");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(folder.path(), root.join("link")).unwrap();
            assert_eq!(below(&root, "link/secret").unwrap_err().code, "outside");
        }
    }
}
