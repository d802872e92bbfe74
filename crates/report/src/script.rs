//! The page's script: ES modules that a server can hand out one by one, and one text of them all for a page without a
//! server.
//!
//! Modules name each other as `import { a, b } from "./x.js";` on one line and export where they declare. Put one
//! after the other in the order below, with those words left out, they are one module.

use base64::Engine;
use sha2::{Digest, Sha256};

/// Name and text of each module, each after those it imports.
pub const MODULES: [(&str, &str); 20] = [
    ("words.js", include_str!("page/words.js")),
    ("frame.js", include_str!("page/frame.js")),
    ("colours.js", include_str!("page/colours.js")),
    ("camera.js", include_str!("page/camera.js")),
    ("data.js", include_str!("page/data.js")),
    ("shaders.js", include_str!("page/shaders.js")),
    ("shade.js", include_str!("page/shade.js")),
    ("draw.js", include_str!("page/draw.js")),
    ("selection.js", include_str!("page/selection.js")),
    ("overlay.js", include_str!("page/overlay.js")),
    ("viewer.js", include_str!("page/viewer.js")),
    ("measure.js", include_str!("page/measure.js")),
    ("table.js", include_str!("page/table.js")),
    ("plan.js", include_str!("page/plan.js")),
    ("cut.js", include_str!("page/cut.js")),
    ("sections.js", include_str!("page/sections.js")),
    ("review.js", include_str!("page/review.js")),
    ("ratings.js", include_str!("page/ratings.js")),
    ("tables.js", include_str!("page/tables.js")),
    ("tools.js", include_str!("page/tools.js")),
];

/// The module that starts the report.
const PAGE: &str = include_str!("page/page.js");

/// All modules as one.
pub(crate) fn bundle() -> String {
    let mut all = String::from("\n");
    for text in MODULES.iter().map(|(_, text)| *text).chain([PAGE]) {
        for line in text.lines().filter(|l| !l.starts_with("import {")) {
            all += line.strip_prefix("export ").unwrap_or(line);
            all.push('\n');
        }
    }
    all
}

/// How a content security policy names a script or style that may run.
pub(crate) fn policy_hash(text: &str) -> String {
    let hash = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(text));
    format!("sha256-{hash}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The modules' own words for each other.
    fn imports(text: &str) -> Vec<(&str, Vec<&str>)> {
        let of_line = |line: &'static str| {
            let (names, file) = line.strip_prefix("import { ")?.split_once(" } from \"./")?;
            Some((file.strip_suffix("\";")?, names.split(", ").collect()))
        };
        text.lines()
            .filter(|l| l.starts_with("import"))
            .map(|l| {
                let l: &'static str = Box::leak(l.to_string().into_boxed_str());
                of_line(l).unwrap_or_else(|| panic!("an import of another form: {l}"))
            })
            .collect()
    }

    #[test]
    fn every_module_imports_what_stands_before_it_and_is_exported_there() {
        let all = MODULES.iter().copied().chain([("page.js", PAGE)]);
        let mut seen: Vec<(&str, &str)> = Vec::new();
        for (name, text) in all {
            for (file, names) in imports(text) {
                // Two modules may name each other; the bundle is one scope, and nothing runs before page.js.
                let (_, there) = MODULES
                    .iter()
                    .find(|m| m.0 == file)
                    .unwrap_or_else(|| panic!("{name}: {file}"));
                for wanted in names {
                    let forms = ["const", "function", "async function", "class"]
                        .map(|k| format!("export {k} {wanted}"));
                    assert!(forms.iter().any(|f| there.contains(f)), "{name}: {wanted} of {file}");
                }
                assert!(
                    seen.iter().any(|s| s.0 == file),
                    "{name} imports {file}, which comes later"
                );
            }
            seen.push((name, text));
        }
    }

    #[test]
    fn no_name_is_declared_twice_in_the_bundle() {
        let bundle = bundle();
        let mut names = std::collections::BTreeSet::new();
        for line in bundle.lines() {
            for kind in ["const ", "function ", "async function ", "class ", "let "] {
                if let Some(rest) = line.strip_prefix(kind) {
                    let name: String =
                        rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    assert!(names.insert(name.clone()), "{name} is declared twice");
                }
            }
        }
        assert!(names.len() > 60);
        assert!(!bundle.contains("export ") && !bundle.contains("</"));
    }

    #[test]
    fn a_policy_hash_is_that_of_the_standard() {
        // echo -n "" | openssl dgst -sha256 -binary | base64
        assert_eq!(policy_hash(""), "sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=");
    }
}
