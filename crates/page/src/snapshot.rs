//! What a piece of work has told so far: all a page needs to show it, however late it comes.

use serde::Serialize;
use serde_json::{Map, Value};
use std::time::{SystemTime, UNIX_EPOCH};

/// Warnings and lines of standard error that are kept.
const MOST_LINES: usize = 200;
/// Longest line that is kept, characters.
const LONGEST_LINE: usize = 2000;

/// How far it has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Other work is done first.
    Waiting,
    /// It is at work.
    Running,
    /// It ended well.
    Done,
    /// It ended with an error of its own.
    Failed,
    /// Somebody stopped it; finished parts are kept.
    Stopped,
    /// The system ended it: memory, perhaps.
    Died,
}

impl State {
    pub fn is_over(self) -> bool {
        !matches!(self, Self::Waiting | Self::Running)
    }
}

/// One stage.
#[derive(Clone, Debug, Serialize)]
pub struct Stage {
    pub stage: String,
    /// Units of work; 0: unknown.
    pub total: u64,
    pub done: u64,
    pub finished: bool,
}

/// The whole.
#[derive(Clone, Debug, Serialize)]
pub struct Snapshot {
    /// Raised with every change.
    pub version: u64,
    pub id: u64,
    pub kind: &'static str,
    /// The site, as lists name it; empty where there is none.
    pub site: String,
    /// What it writes, a path below the opened folder; empty for nothing.
    pub out: String,
    pub state: State,
    pub stages: Vec<Stage>,
    /// Parts taken over from an interrupted run.
    pub kept: Vec<String>,
    pub warnings: Vec<String>,
    /// What it is doing, in its own words.
    pub note: String,
    /// What it has found, by the name of the event.
    pub results: Map<String, Value>,
    /// Why it failed, a line each.
    pub errors: Vec<String>,
    pub started_ms: u64,
    pub ended_ms: u64,
}

pub fn now_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_millis() as u64)
}

impl Snapshot {
    pub fn new(id: u64, kind: &'static str, site: String, out: String) -> Self {
        Self {
            version: 1,
            id,
            kind,
            site,
            out,
            state: State::Waiting,
            stages: Vec::new(),
            kept: Vec::new(),
            warnings: Vec::new(),
            note: String::new(),
            results: Map::new(),
            errors: Vec::new(),
            started_ms: now_ms(),
            ended_ms: 0,
        }
    }

    /// Takes one line of the program's output.
    pub fn hear(&mut self, line: &str) {
        let Ok(Value::Object(mut event)) = serde_json::from_str(line) else { return };
        let kind = event.get("event").and_then(Value::as_str).unwrap_or_default().to_string();
        let text = |key: &str| event.get(key).and_then(Value::as_str).unwrap_or_default();
        let number = |key: &str| event.get(key).and_then(Value::as_u64).unwrap_or_default();
        match kind.as_str() {
            "started" => self.stages.push(Stage {
                stage: text("stage").into(),
                total: number("total"),
                done: 0,
                finished: false,
            }),
            "advanced" | "finished" => {
                let name = text("stage");
                if let Some(stage) = self.stages.iter_mut().rev().find(|s| s.stage == name) {
                    stage.finished |= kind == "finished";
                    stage.done = stage.done.max(number("done"));
                }
            }
            "warning" => {
                let line = format!("{}: {}", text("stage"), text("message"));
                keep(&mut self.warnings, &line);
            }
            "note" => self.note = cut(text("message")),
            "failed" => {
                let message = text("message").to_string();
                keep(&mut self.errors, &message);
            }
            "kept" => {
                let part = event.get("value").and_then(|v| v.get("part")).and_then(Value::as_str);
                self.kept.extend(part.map(String::from));
            }
            "keeping" | "" => {}
            _ => {
                let value = event.remove("value").unwrap_or_default();
                self.results.insert(kind, value);
            }
        }
        self.version += 1;
    }

    /// Takes one line of standard error: several reasons come so.
    pub fn hear_error(&mut self, line: &str) {
        let line = line.strip_prefix("tsumu: ").unwrap_or(line);
        keep(&mut self.errors, line);
        self.version += 1;
    }

    /// It is over.
    pub fn end(&mut self, state: State) {
        self.state = state;
        self.ended_ms = now_ms();
        self.version += 1;
    }
}

fn keep(lines: &mut Vec<String>, line: &str) {
    let line = cut(line);
    if lines.len() < MOST_LINES && !lines.contains(&line) {
        lines.push(line);
    }
}

fn cut(line: &str) -> String {
    line.chars().take(LONGEST_LINE).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_a_run_become_its_state() {
        let mut s = Snapshot::new(1, "run", "a".into(), "a/run".into());
        for line in [
            r#"{"event":"started","stage":"segment","total":10}"#,
            r#"{"event":"advanced","stage":"segment","done":4}"#,
            r#"{"event":"advanced","stage":"segment","done":3}"#,
            r#"{"event":"warning","stage":"check","message":"few points"}"#,
            r#"{"event":"warning","stage":"check","message":"few points"}"#,
            r#"{"event":"finished","stage":"segment"}"#,
            r#"{"event":"kept","value":{"part":"segment"}}"#,
            r#"{"event":"run","value":{"folder":"x"}}"#,
            "no JSON at all",
        ] {
            s.hear(line);
        }
        assert!(s.stages[0].finished && s.stages[0].done == 4);
        assert_eq!(s.warnings, ["check: few points"]);
        assert_eq!((s.kept.len(), s.results["run"]["folder"].as_str()), (1, Some("x")));
        s.hear_error("tsumu: no such file");
        assert_eq!(s.errors, ["no such file"]);
        // A program that talks without end fills nothing.
        for i in 0..1000 {
            s.hear_error(&format!("{i} {}", "x".repeat(10_000)));
        }
        assert!(s.errors.len() == MOST_LINES && s.errors[1].len() == LONGEST_LINE);
    }
}
