//! The page's table of messages: every word that is asked for is there, in both languages, with the same blanks to fill in.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

fn files() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("ui");
    let scripts = std::fs::read_dir(folder).unwrap().flatten().map(|e| e.path());
    let scripts = scripts.filter(|p| p.extension().is_some_and(|e| e == "js"));
    scripts
        .map(|p| {
            let name = p.file_name().unwrap().to_string_lossy().into_owned();
            (name, std::fs::read_to_string(&p).unwrap())
        })
        .collect()
}

/// Key → texts: pairs of `key: ["…", "…"]`, several on a line.
fn table(text: &str) -> BTreeMap<String, [String; 2]> {
    let body = text.split("const TABLE = {").nth(1).unwrap().split("\n};").next().unwrap();
    let mut out = BTreeMap::new();
    for part in body.split("\"],").map(|p| p.trim_end_matches("\"]")) {
        let Some((key, texts)) = part.split_once(": [\"") else { continue };
        let key = key.trim().trim_matches('"').to_string();
        let (english, japanese) = texts.split_once("\", \"").unwrap_or_else(|| panic!("{key}"));
        assert!(
            out.insert(key.clone(), [english.into(), japanese.into()]).is_none(),
            "{key} twice"
        );
    }
    out
}

fn blanks(text: &str) -> BTreeSet<&str> {
    text.split('{').skip(1).filter_map(|p| p.split_once('}')).map(|p| p.0).collect()
}

#[test]
fn every_word_is_there_in_both_languages() {
    let files = files();
    let table = table(&files.iter().find(|f| f.0 == "words.js").unwrap().1);
    assert!(table.len() > 150, "{}", table.len());
    for (key, [english, japanese]) in &table {
        assert!(!english.is_empty() && !japanese.is_empty(), "{key}");
        assert_eq!(blanks(english), blanks(japanese), "{key}");
    }
    let mut asked = 0;
    for (name, text) in &files {
        let word =
            |at: usize| !text[..at].ends_with(|c: char| c.is_alphanumeric() || "_.$".contains(c));
        for (at, _) in text.match_indices("t(\"").filter(|(at, _)| word(*at)) {
            let key = text[at + 3..].split('"').next().unwrap();
            assert!(table.contains_key(key), "{name}: no words for `{key}`");
            asked += 1;
        }
        // Keys with a changing end: some must begin so.
        for (at, _) in text.match_indices("t(`").filter(|(at, _)| word(*at)) {
            let start = text[at + 3..].split("${").next().unwrap();
            assert!(table.keys().any(|k| k.starts_with(start)), "{name}: `{start}…`");
        }
    }
    assert!(asked > 100, "{asked}");
}

/// What the server refuses has words of the page.
#[test]
fn every_refusal_has_words() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let words = files().into_iter().find(|f| f.0 == "words.js").unwrap().1;
    let table = table(&words);
    let mut codes = 0;
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let text = std::fs::read_to_string(entry.path()).unwrap();
        for call in ["Refusal::bad(\"", "Refusal::conflict(\"", "StatusCode::FORBIDDEN, \""] {
            for part in text.split(call).skip(1) {
                let code = part.split('"').next().unwrap();
                assert!(table.contains_key(&format!("e-{code}")), "no words for `{code}`");
                codes += 1;
            }
        }
    }
    assert!(codes > 10, "{codes}");
}
