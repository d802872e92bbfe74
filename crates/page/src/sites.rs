//! What lies in the opened folder: sites with their runs, files that could be part of one, comparisons.

use crate::names::{SELF, shown};
use crate::order::VARIANTS;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tsumu::{InputKinds, RunEntry};

/// Files listed at most, and folders looked into.
const MOST: usize = 2000;
/// How deep files are looked for.
const DEEPEST: usize = 4;

/// A site in the list.
#[derive(Debug, Serialize)]
pub struct SiteEntry {
    /// Its folder's name; `~`: the opened folder itself.
    pub id: String,
    /// Its name as `site.toml` has it; empty when that cannot be read.
    pub name: String,
    pub runs: Vec<RunEntry>,
}

/// A file that a site could use.
#[derive(Debug, Serialize)]
pub struct FileEntry {
    pub path: String,
    pub bytes: u64,
    #[serde(flatten)]
    pub kinds: InputKinds,
}

/// The sites of a folder: itself, if it is one, and the folders in it.
pub fn sites(root: &Path) -> Vec<SiteEntry> {
    let own = std::iter::once((SELF.to_string(), root.to_path_buf()));
    let mut below: Vec<_> = folders(root).into_iter().map(|f| (shown(root, &f), f)).collect();
    below.sort();
    let all = own.chain(below).filter(|(_, folder)| folder.join("site.toml").is_file());
    let entry = |(id, folder): (String, PathBuf)| SiteEntry {
        id,
        name: tsumu::read_draft(&folder).map(|d| d.site.name).unwrap_or_default(),
        runs: tsumu::runs_of(&folder),
    };
    all.map(entry).collect()
}

/// Folders in a folder that are not hidden.
fn folders(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let open = entries.filter(|e| !e.file_name().to_string_lossy().starts_with('.'));
    open.filter(|e| e.file_type().is_ok_and(|t| t.is_dir())).map(|e| e.path()).take(MOST).collect()
}

/// Files of a site's kinds below the folder; those that runs have written are no input.
pub fn files(root: &Path) -> Vec<FileEntry> {
    let mut found = Vec::new();
    let mut open = vec![(root.to_path_buf(), 0)];
    while let Some((folder, depth)) = open.pop() {
        if made_by_us(&folder) || found.len() >= MOST {
            continue;
        }
        if depth < DEEPEST {
            open.extend(folders(&folder).into_iter().map(|f| (f, depth + 1)));
        }
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let kinds = InputKinds::of(&entry.path());
            let Ok(meta) = entry.metadata() else { continue };
            let hidden = entry.file_name().to_string_lossy().starts_with('.');
            if meta.is_file() && kinds.any() && !hidden {
                let path = shown(root, &entry.path());
                found.push(FileEntry { path, bytes: meta.len(), kinds });
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

fn made_by_us(folder: &Path) -> bool {
    folder.join("manifest.json").is_file()
        || folder.join(".tsumu-resume").exists()
        || folder.file_name().is_some_and(|n| n == VARIANTS)
}

/// One site with everything the page shows of it.
pub fn site(root: &Path, folder: &Path) -> Value {
    let draft = tsumu::read_draft(folder);
    let said = draft.as_ref().err().map(|e| e.lines());
    let place = shown(root, folder);
    json!({
        "place": place,
        // Paths in a site begin at its folder.
        "up": if place.is_empty() { "" } else { "../" },
        "draft": draft.ok(),
        "unreadable": said,
        "runs": tsumu::runs_of(folder),
        "variants": variants(folder),
        "review": folder.join("review.json").is_file(),
    })
}

/// Variants with what they change and what came of it.
fn variants(folder: &Path) -> Vec<Value> {
    let mut all: Vec<_> = folders(&folder.join(VARIANTS))
        .into_iter()
        .filter_map(|place| {
            let number: u32 = place.file_name()?.to_str()?.parse().ok()?;
            let draft = tsumu::read_draft(&place).ok()?;
            let plan = tsumu::runs_of(&place).into_iter().find_map(|run| run.planned);
            Some((number, json!({ "number": number, "site": draft.site, "planned": plan })))
        })
        .collect();
    all.sort_by_key(|(number, _)| *number);
    all.into_iter().map(|(_, value)| value).collect()
}

/// Files of a result, for downloads.
pub fn results(root: &Path, folder: &Path) -> Vec<Value> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(here) = open.pop() {
        open.extend(folders(&here));
        for entry in std::fs::read_dir(&here).into_iter().flatten().flatten() {
            let hidden = entry.file_name().to_string_lossy().starts_with('.');
            let Ok(meta) = entry.metadata() else { continue };
            if meta.is_file() && !hidden && found.len() < MOST {
                let (path, name) = (shown(root, &entry.path()), shown(folder, &entry.path()));
                found.push((
                    name.clone(),
                    json!({ "path": path, "name": name, "bytes": meta.len() }),
                ));
            }
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found.into_iter().map(|(_, value)| value).collect()
}

/// Comparisons that are finished.
pub fn comparisons(root: &Path) -> Vec<Value> {
    let all = folders(&root.join("comparisons"));
    let whole = all.iter().filter(|f| f.join("manifest.json").is_file());
    let mut list: Vec<String> = whole.map(|f| shown(root, f)).collect();
    list.sort();
    list.into_iter().map(|place| json!({ "place": place })).collect()
}
