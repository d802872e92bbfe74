//! Lines in the reader's language.
//!
//! Crates say what they have to say in English, each where it knows it. Here a line that is about to be shown is held against one
//! table of messages (`messages.toml`): a template that fits gives its code and its words in Japanese, with the values in
//! their places. Of a line made of several (`file: what; what to do`) each part is looked up; what has no entry stays English.

use clap::ValueEnum;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// A language of the program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Language {
    /// English.
    #[default]
    En,
    /// 日本語
    Ja,
}

impl Language {
    /// The language that was asked for, else that of the system's settings (`LC_ALL`, `LC_MESSAGES`, `LANG`).
    pub fn chosen(asked: Option<Self>, setting: impl Fn(&str) -> Option<String>) -> Self {
        let of_system = || {
            let first = ["LC_ALL", "LC_MESSAGES", "LANG"]
                .iter()
                .find_map(|name| setting(name).filter(|v| !v.is_empty()))?;
            first.starts_with("ja").then_some(Self::Ja)
        };
        asked.or_else(of_system).unwrap_or_default()
    }

    /// The line in this language; values stay as they are.
    pub fn line(self, english: &str) -> String {
        match self {
            Self::En => english.into(),
            Self::Ja => translated(english, DEPTH).unwrap_or_else(|| english.into()),
        }
    }
}

/// The code of a message, or of the first part of it that has one.
pub fn code(english: &str) -> Option<&'static str> {
    let whole = |part: &str| table().iter().find(|m| m.english.values(part).is_some());
    let parts = || english.split("; ").flat_map(tails);
    whole(english).or_else(|| parts().find_map(whole)).map(|m| m.code)
}

/// The text and what follows each of its colons.
fn tails(text: &str) -> impl Iterator<Item = &str> {
    std::iter::once(text).chain(text.match_indices(": ").map(|(i, s)| &text[i + s.len()..]))
}

/// Parts of parts that are looked up.
const DEPTH: usize = 6;
/// What parts stand between.
const BETWEEN: [&str; 2] = ["; ", ": "];

fn translated(line: &str, depth: usize) -> Option<String> {
    let indent = line.len() - line.trim_start().len();
    if indent > 0 {
        return translated(&line[indent..], depth).map(|t| line[..indent].to_string() + &t);
    }
    if let Some(whole) = whole(line) {
        return Some(whole);
    }
    let depth = depth.checked_sub(1)?;
    BETWEEN.iter().find_map(|between| {
        line.match_indices(between).find_map(|(i, _)| {
            let (left, right) = (&line[..i], &line[i + between.len()..]);
            let (l, r) = (translated(left, depth), translated(right, depth));
            let changed = l.is_some() || r.is_some();
            let [l, r] = [(l, left), (r, right)].map(|(t, own)| t.unwrap_or_else(|| own.into()));
            changed.then(|| l + between + &r)
        })
    })
}

/// A word that stands before a message, or a message.
fn whole(part: &str) -> Option<String> {
    let word = WORDS.iter().find(|w| w.0 == part).map(|w| w.1.to_string());
    word.or_else(|| table().iter().find_map(|m| m.said_of(part)))
}

/// Words that stand before a message, and stages.
const WORDS: [(&str, &str); 15] = [
    ("warning", "警告"),
    ("note", "注記"),
    ("check", "点検"),
    ("read", "読込"),
    ("catalogue", "カタログ"),
    ("size", "寸法"),
    ("segment", "分割"),
    ("pose", "姿勢推定"),
    ("review", "確認"),
    ("plan", "計画"),
    ("uncertainty", "ばらつき"),
    ("ratings", "評価"),
    ("next", "次の据付"),
    ("compare", "比較"),
    ("run", "実行"),
];

/// A message of the table.
struct Message {
    code: &'static str,
    english: Template,
    japanese: Template,
}

impl Message {
    fn said_of(&self, line: &str) -> Option<String> {
        let values: Vec<String> = self.english.values(line)?.into_iter().map(value).collect();
        Some(self.japanese.with(&self.english.names, &values))
    }
}

/// What stands in a gap: a name or a number as it is; a message of its own, or a list of such with their numbers, in Japanese.
fn value(text: &str) -> String {
    let said = |part: &str| table().iter().find_map(|m| m.said_of(part));
    let counted = |part: &str| {
        let (n, what) = part.split_once(' ')?;
        let is_number = n.chars().all(|c| c.is_ascii_digit());
        is_number.then(|| said(what)).flatten().map(|what| format!("{what} {n}"))
    };
    let one = |part: &str| said(part).or_else(|| counted(part));
    let between = if text.contains("; ") { "; " } else { ", " };
    let parts: Vec<Option<String>> = text.split(between).map(one).collect();
    if parts.len() > 1 && parts.iter().all(Option::is_some) {
        return parts.into_iter().flatten().collect::<Vec<_>>().join(between);
    }
    let some = || {
        let own = text.split(between).zip(parts).map(|(own, said)| said.unwrap_or(own.into()));
        own.collect::<Vec<String>>().join(between)
    };
    one(text).unwrap_or_else(some)
}

/// Text with named gaps: `texts` stand around the gaps. What stands in a gap whose name ends in `?` may be missing, and
/// be left out in Japanese.
struct Template {
    texts: Vec<&'static str>,
    names: Vec<&'static str>,
}

impl Template {
    fn of(text: &'static str) -> Self {
        let (mut texts, mut names, mut rest) = (Vec::new(), Vec::new(), text);
        while let Some((before, name, after)) = rest.split_once('{').and_then(|(before, more)| {
            more.split_once('}').map(|(name, after)| (before, name, after))
        }) {
            texts.push(before);
            names.push(name);
            rest = after;
        }
        texts.push(rest);
        Self { texts, names }
    }

    /// What stands in the gaps of a line that is this template.
    fn values<'l>(&self, line: &'l str) -> Option<Vec<&'l str>> {
        let (first, others) = self.texts.split_first()?;
        let mut rest = line.strip_prefix(first)?;
        let mut values = Vec::with_capacity(others.len());
        for (i, text) in others.iter().enumerate() {
            let last = i + 1 == others.len();
            let at = if last { rest.strip_suffix(text)?.len() } else { rest.find(text)? };
            values.push(&rest[..at]);
            rest = &rest[at + text.len()..];
        }
        // What stands before a message is none of its values.
        let led = first.is_empty() && values.first().is_some_and(|v| v.contains(": "));
        let filled = values.iter().zip(&self.names).all(|(v, n)| !v.is_empty() || n.ends_with('?'));
        (rest.is_empty() && !led && filled).then_some(values)
    }

    /// The template with values by name.
    fn with(&self, names: &[&str], values: &[String]) -> String {
        let value =
            |name: &str| names.iter().position(|n| *n == name).map_or("", |i| values[i].as_str());
        let gaps = self.names.iter().map(|n| value(n)).chain(std::iter::once(""));
        self.texts.iter().zip(gaps).flat_map(|(text, gap)| [*text, gap]).collect()
    }
}

#[derive(Deserialize)]
struct Row {
    en: String,
    ja: String,
}

const TABLE: &str = include_str!("messages.toml");

fn table() -> &'static [Message] {
    static MESSAGES: OnceLock<Vec<Message>> = OnceLock::new();
    MESSAGES.get_or_init(|| {
        let rows: BTreeMap<String, Row> = toml::from_str(TABLE).expect("a test reads the table");
        let kept = |text: String| -> &'static str { Box::leak(text.into_boxed_str()) };
        let message = |(code, row): (String, Row)| Message {
            code: kept(code),
            english: Template::of(kept(row.en)),
            japanese: Template::of(kept(row.ja)),
        };
        rows.into_iter().map(message).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn lines_are_translated_with_their_values() {
        let ja = |line: &str| Language::Ja.line(line);
        assert_eq!(
            ja("62 blocks recognised, 3 not judged, in 60190 points"),
            "60190 点の中に 62 個のブロックを認識、3 か所は判定できませんでした"
        );
        let said = ja(
            "warning: a/site.toml, line 3: 80 % of the points are water; see that the pile itself is surveyed",
        );
        assert!(
            said.starts_with("警告: a/site.toml, line 3: 点の 80 % が水面です; 積み上がり"),
            "{said}"
        );
        let said = ja(
            "a.toml: survey `x: y.laz`: add `vertical_offset_m` (0.0 when its heights already refer to the site's vertical datum)",
        );
        assert!(said.contains("測量 `x: y.laz`"), "{said}");
        // A list in a gap, and a gap that may be empty.
        assert_eq!(
            ja(
                "places left below the design: 12 overflow (3.1 m³), 1 out-of-reach (0.2 m³) (plan/unfilled.csv)"
            ),
            "計画面より低いまま残る所:計画面を超過 12 か所(3.1 m³), クレーンの作業半径外 1 か所(0.2 m³)(plan/unfilled.csv)"
        );
        assert_eq!(
            ja("  tetrapod: 3 blocks of 9 in stock, cost 30"),
            "  tetrapod:3 個(在庫 9 個)、費用 30"
        );
        assert_eq!(ja("  tetrapod: 3 blocks, cost 30"), "  tetrapod:3 個、費用 30");
        assert_eq!(
            ja("note: a.laz: 300 of class 7 (noise), 4 withheld points are left out"),
            "注記: a.laz: 分類 7(ノイズ) 300, 除外フラグ(withheld) 4 点を除きました"
        );
        assert_eq!(ja("something nobody translated: 3"), "something nobody translated: 3");
        assert_eq!(Language::En.line("can be answered"), "can be answered");
        assert_eq!(
            code("x/site.toml: there is no [[survey]]: add one with `file = \"survey.laz\"`"),
            Some("S03")
        );
        assert_eq!(code("something else"), None);
    }

    #[test]
    fn the_systems_settings_choose_and_the_flag_overrules() {
        let with = |name: &'static str, value: &'static str| {
            move |asked: &str| (asked == name).then(|| value.to_string())
        };
        assert_eq!(Language::chosen(None, with("LANG", "ja_JP.UTF-8")), Language::Ja);
        assert_eq!(Language::chosen(None, with("LC_ALL", "de_DE.UTF-8")), Language::En);
        assert_eq!(Language::chosen(Some(Language::En), with("LANG", "ja_JP.UTF-8")), Language::En);
        assert_eq!(Language::chosen(None, |_| None), Language::En);
    }

    /// Text with every gap, named or not, as `{}`; other braces stay.
    fn bare(text: &str) -> String {
        let (mut out, mut rest) = (String::new(), text);
        while let Some((before, more)) = rest.split_once('{') {
            out += before;
            out.push('{');
            let gap = more.find(['{', '}', '\n', '"', ' ']);
            rest = match gap {
                Some(end) if more[end..].starts_with('}') => &more[end..],
                _ => more,
            };
        }
        out + rest
    }

    fn sources(folder: &Path, out: &mut String) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                sources(&path, out);
            } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("language.rs")
            {
                let text = std::fs::read_to_string(&path).unwrap();
                // Strings that go on in the next line are one.
                let joined: String = text
                    .split("\\\n")
                    .enumerate()
                    .map(|(i, part)| if i == 0 { part } else { part.trim_start() })
                    .collect();
                *out += &joined.replace("\\\"", "\"");
            }
        }
    }

    #[test]
    fn every_template_is_what_the_source_says() {
        let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let mut all = String::new();
        sources(crates, &mut all);
        let all = bare(&all);
        let rows: BTreeMap<String, Row> = toml::from_str(TABLE).unwrap();
        let lost: Vec<&String> = rows
            .iter()
            .filter(|(_, row)| !all.contains(&bare(&row.en)))
            .map(|(code, _)| code)
            .collect();
        assert!(lost.is_empty(), "{lost:?} of messages.toml are said nowhere: follow the source");
    }

    #[test]
    fn both_languages_have_the_same_gaps() {
        for message in table() {
            let sorted = |t: &Template| {
                let needed = t.names.iter().filter(|n| !n.ends_with('?'));
                let mut names: Vec<&str> = needed.copied().collect();
                names.sort_unstable();
                names
            };
            assert_eq!(sorted(&message.english), sorted(&message.japanese), "{}", message.code);
        }
    }
}
