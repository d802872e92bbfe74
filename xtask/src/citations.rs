//! Every "METHOD §n", "Eq. c.n", "Algorithm n", "Table c.n" and "thesis §n" of code and documents is told of in
//! docs/method.md, and the thesis is named in docs/bibliography.md.

use crate::check::foreign;
use anyhow::{Context, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Endings of the files that cite.
const TEXTS: [&str; 5] = ["rs", "md", "toml", "py", "sh"];
/// Notes that are not part of the repository must not be cited.
const ELSEWHERE: [&str; 3] = ["FINDINGS", "SENSORS.md", "(SENSORS:"];

/// Citations that lead nowhere, each with its file and line.
pub fn faults(root: &Path) -> Result<Vec<String>> {
    let page = |name: &str| {
        let path = root.join("docs").join(name);
        std::fs::read_to_string(&path).with_context(|| path.display().to_string())
    };
    let method = page("method.md")?;
    let told = Told::of(&method);
    let mut faults = Vec::new();
    let bibliography = page("bibliography.md")?;
    for key in keys(&method) {
        if !bibliography.contains(&format!("**[{key}]**")) {
            faults.push(format!("docs/method.md: [{key}] is not in docs/bibliography.md"));
        }
    }
    let mut files = Vec::new();
    texts(root, root, &mut files)?;
    for file in files {
        let text = std::fs::read_to_string(root.join(&file))?;
        for (number, line) in text.lines().enumerate() {
            for cited in citations(line).into_iter().filter(|c| !told.0.contains(c)) {
                faults.push(format!(
                    "{}:{}: {cited} is not in docs/method.md",
                    file.display(),
                    number + 1
                ));
            }
        }
    }
    Ok(faults)
}

/// What docs/method.md tells of, in the words of [`citations`].
struct Told(BTreeSet<String>);

impl Told {
    fn of(method: &str) -> Self {
        let mut told = BTreeSet::new();
        for line in method.lines() {
            match line.strip_prefix("## METHOD ").or(line.strip_prefix("### METHOD ")) {
                Some(heading) => {
                    told.extend(heading.split(':').next().map(|n| format!("METHOD {n}")));
                }
                // A section is told of by its heading, the rest by being named.
                None => {
                    told.extend(citations(line).into_iter().filter(|c| !c.starts_with("METHOD")))
                }
            }
        }
        Self(told)
    }
}

/// The keys of works, such as `Xu23`, in brackets.
fn keys(text: &str) -> BTreeSet<String> {
    let inside = text.split('[').skip(1).filter_map(|rest| rest.split(']').next());
    let key = |k: &str| {
        let digits = k.len() >= 4
            && k.chars().next().is_some_and(char::is_uppercase)
            && k.trim_end_matches(['a', 'b']).ends_with(|c: char| c.is_ascii_digit())
            && k.chars().all(char::is_alphanumeric);
        digits.then(|| k.to_owned())
    };
    inside.flat_map(|list| list.split(", ").filter_map(key)).collect()
}

/// What a line cites, one form for one thing: `METHOD §3`, `Eq. 2.7`, `Algorithm 1`, `Table 2.2`, `thesis §3.7`.
fn citations(line: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (mark, form) in [
        ("METHOD §", "METHOD §"),
        ("METHOD section ", "METHOD §"),
        ("thesis §", "thesis §"),
        ("dissertation §", "thesis §"),
        ("thesis' sensor (§", "thesis §"),
        ("Algorithm ", "Algorithm "),
    ] {
        for rest in line.split(mark).skip(1) {
            found.extend(range(rest).into_iter().map(|n| format!("{form}{n}")));
        }
    }
    for (mark, form) in [
        ("Eq. ", "Eq. "),
        ("Eqs. ", "Eq. "),
        ("Equation ", "Eq. "),
        ("Table ", "Table "),
        ("Tables ", "Table "),
    ] {
        for rest in line.split(mark).skip(1) {
            found.extend(list(rest).into_iter().map(|n| format!("{form}{n}")));
        }
    }
    found.extend(ELSEWHERE.iter().filter(|w| line.contains(*w)).map(|w| (*w).to_owned()));
    found
}

/// Numbers such as `2.3`, `2.3–2.5`, `3.8, 3.9`, `2.2 and 3.2` at the beginning of `text`.
fn list(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = text;
    loop {
        let numbers = range(rest);
        if !numbers.iter().all(|n| n.contains('.')) || numbers.is_empty() {
            return found;
        }
        found.extend(numbers);
        let end =
            rest.find(|c: char| !(c.is_ascii_digit() || "().–-".contains(c))).unwrap_or(rest.len());
        let after = &rest[end..];
        rest = match after.strip_prefix(", ").or(after.strip_prefix(" and ")) {
            Some(next) => next,
            None => return found,
        };
    }
}

/// A number at the beginning of `text`, or all from one to another of the same chapter.
fn range(text: &str) -> Vec<String> {
    let text = text.trim_start_matches('(');
    let number = |text: &str| -> String {
        let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
        text[..end].trim_end_matches('.').to_owned()
    };
    let first = number(text);
    if first.is_empty() {
        return Vec::new();
    }
    let last =
        text[first.len()..].strip_prefix('–').map(|rest| number(rest.trim_start_matches('§')));
    let ends = |n: &str| -> Option<(String, u32)> {
        let (chapter, last) = n.rsplit_once('.')?;
        Some((chapter.to_owned(), last.parse().ok()?))
    };
    match (ends(&first), last.as_deref().and_then(ends)) {
        (Some((chapter, from)), Some((to_chapter, to))) if chapter == to_chapter => {
            (from..=to).map(|n| format!("{chapter}.{n}")).collect()
        }
        _ => vec![first],
    }
}

/// The files below `folder` that may cite, but those that judge citations.
fn texts(root: &Path, folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let below = path.strip_prefix(root).expect("found below it").to_owned();
        if foreign(&below) || below.starts_with("xtask") {
            continue;
        }
        if path.is_dir() {
            texts(root, &path, found)?;
        } else if path.extension().is_some_and(|e| TEXTS.iter().any(|t| e == *t)) {
            found.push(below);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_citation_of_the_repository_resolves() {
        let faults = faults(&crate::root()).unwrap();
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }

    #[test]
    fn citations_are_read_as_they_are_written() {
        let all = |line| citations(line).join(" | ");
        assert_eq!(all("(METHOD §2, Eqs. 2.3–2.5)"), "METHOD §2 | Eq. 2.3 | Eq. 2.4 | Eq. 2.5");
        assert_eq!(all("Eqs. 3.8, 3.9 and 3.10)"), "Eq. 3.8 | Eq. 3.9 | Eq. 3.10");
        assert_eq!(all("numbers of Eq. (3.2) between"), "Eq. 3.2");
        assert_eq!(all("Tables 2.5 and 3.8, Algorithm 1."), "Algorithm 1 | Table 2.5 | Table 3.8");
        assert_eq!(
            all("dissertation §4.7.2–4.7.4"),
            "thesis §4.7.2 | thesis §4.7.3 | thesis §4.7.4"
        );
        assert_eq!(all("as FINDINGS say"), "FINDINGS");
        assert_eq!(all("Table of contents, Eq. none"), "");
    }

    #[test]
    fn a_citation_of_nothing_is_found() {
        let told = Told::of("## METHOD §1: a\nx (Eq. 2.3)\nsee METHOD §9");
        assert!(told.0.contains("METHOD §1") && told.0.contains("Eq. 2.3"));
        assert!(!told.0.contains("METHOD §9"), "naming a section does not make it");
        assert_eq!(keys("[Xu23] [ADR 0120](x) [Li19, Hu20] [0, 1]").len(), 3);
    }
}
