//! Help texts, completions and manual pages.

use crate::site::{ok, tsumu};

const COMMANDS: [&str; 20] = [
    "init",
    "blocks",
    "check",
    "run",
    "tiles",
    "segment",
    "recognise",
    "plan",
    "next",
    "what-if",
    "report",
    "compare",
    "evaluate",
    "verify",
    "sign",
    "serve-bin",
    "synth",
    "open",
    "completions",
    "man",
];

#[test]
fn every_command_explains_itself() {
    let help = ok(&["--help"]).out;
    let mut last = 0;
    for command in COMMANDS {
        let at = help
            .find(&format!("\n  {command}"))
            .unwrap_or_else(|| panic!("{command} is not listed"));
        assert!(at > last, "{command} is out of order");
        last = at;
        let own = ok(&[command, "--help"]).out;
        assert!(own.lines().next().is_some_and(|l| l.len() > 15), "{command} has no description");
    }
    // None is missing here, and what makes the program is another program's.
    let listed = help.split("Commands:").nth(1).unwrap().split("\n\n").next().unwrap();
    let first =
        |line: &str| line.strip_prefix("  ").filter(|l| !l.starts_with(' ')).map(String::from);
    let names: Vec<String> = listed.lines().filter_map(first).collect();
    assert_eq!(names.len(), COMMANDS.len() + 1, "{names:?}");
    for command in ["train", "reproduce"] {
        assert_eq!(tsumu(&[command]).code, 2);
    }
}

#[test]
fn completions_and_man_pages() {
    for shell in ["bash", "zsh", "fish", "powershell"] {
        assert!(ok(&["completions", shell]).out.contains("recognise"));
    }
    let folder = tempfile::tempdir().unwrap();
    ok(&["man", "--out", &folder.path().to_string_lossy()]);
    let page = std::fs::read_to_string(folder.path().join("tsumu-recognise.1")).unwrap();
    assert!(page.contains("CLOUD"));
}

#[test]
fn the_version_names_the_build() {
    let long = ok(&["--version"]).out;
    for word in ["tsumu 0.", "commit:", "features:", "target:"] {
        assert!(long.contains(word), "{long}");
    }
    assert_eq!(ok(&["-V"]).out.lines().count(), 1);
}

#[test]
fn no_arguments_show_the_help() {
    let ran = tsumu::<&str>(&[]);
    assert_eq!(ran.code, 2);
    assert!(ran.err.contains("Usage"), "{}", ran.err);
}

/// What is said to people comes in Japanese where it is asked for; what is said to programs does not, and has a code.
#[test]
fn messages_come_in_japanese() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("site.toml");
    std::fs::write(&file, "name = \"s\"\ncrs = \"none\"\n").unwrap();
    let site = folder.path().to_string_lossy().into_owned();
    let ran = tsumu(&["check", &site, "--lang", "ja"]);
    assert_eq!(ran.code, 2);
    assert!(ran.err.contains("[[survey]] がありません"), "{}", ran.err);
    assert!(ran.out.contains("次の 2 つの理由で回答できません"), "{}", ran.out);
    let english = tsumu(&["check", &site]);
    assert!(english.err.contains("there is no [[survey]]"), "{}", english.err);
    let json = tsumu(&["check", &site, "--lang", "ja", "--json"]);
    let failed = json.out.lines().find(|l| l.contains("\"failed\"")).unwrap();
    assert!(
        failed.contains("\"id\":\"S03\"") && failed.contains("there is no [[survey]]"),
        "{failed}"
    );
}
