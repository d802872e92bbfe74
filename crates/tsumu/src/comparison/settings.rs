//! Settings of a comparison from a file, in the words of its manifest.

use super::CompareOptions;
use crate::error::OrBadInput;
use crate::{Error, Result};
use anyhow::{Context, anyhow};
use monitor::{CompareConfig, SpanConfig};
use serde::Deserialize;
use std::path::Path;

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    compare: CompareConfig,
    spans: SpanConfig,
}

impl CompareOptions {
    /// Takes the settings of a TOML file: tables `[compare.…]` (`registration`, `matching`, `detection`, `single`, `breakage`) and
    /// `[spans]` with `[spans.grades]`. Errors name the file and the key.
    pub fn read_config(&mut self, file: &Path) -> Result<()> {
        let named = || file.display().to_string();
        let text = std::fs::read_to_string(file)
            .with_context(|| format!("cannot read {}", file.display()))
            .or_bad_input()?;
        let settings: Settings = toml::from_str(&text).with_context(named).or_bad_input()?;
        check(&settings.spans).map_err(|why| Error::bad_input(anyhow!("{}: {why}", named())))?;
        settings
            .compare
            .check()
            .map_err(|why| Error::bad_input(anyhow!("{}: compare.{why}", named())))?;
        (self.config, self.spans) = (settings.compare, settings.spans);
        Ok(())
    }
}

/// A span needs a length, grades need an order.
fn check(spans: &SpanConfig) -> std::result::Result<(), String> {
    let positive = [
        ("spans.span_m", spans.span_m),
        ("spans.cell_blocks", f64::from(spans.cell_blocks)),
        ("spans.displaced_dn", spans.displaced_dn),
    ];
    if let Some((key, value)) = positive.iter().find(|(_, v)| !(v.is_finite() && *v > 0.0)) {
        return Err(format!("{key} = {value} is not a number above 0"));
    }
    let g = &spans.grades;
    let limits = [
        ("lost_layers", g.lost_layers),
        ("gone_share", g.gone_share),
        ("moved_share", g.moved_share),
        ("sinking_layers", g.sinking_layers),
    ];
    match limits.iter().find(|(_, l)| !(l.a >= l.b && l.b >= l.c && l.c >= 0.0)) {
        Some((key, l)) => Err(format!(
            "spans.grades.{key} = {{ a = {}, b = {}, c = {} }}: grade a is the worst, so a is not below b nor b below c, and none below 0",
            l.a, l.b, l.c
        )),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<CompareOptions> {
        let file = tempfile::NamedTempFile::new().expect("a folder for temporary files");
        std::fs::write(file.path(), text).expect("it is writable");
        let mut options = CompareOptions::default();
        options.read_config(file.path()).map(|()| options)
    }

    #[test]
    fn what_is_left_out_keeps_its_default() {
        let read =
            read("[spans]\nspan_m = 25\n[spans.grades.moved_share]\na = 0.9\nb = 0.6\nc = 0.3\n")
                .unwrap();
        assert_eq!(read.spans.span_m, 25.0);
        assert_eq!(read.spans.grades.moved_share.a, 0.9);
        assert_eq!(read.spans.grades.gone_share, SpanConfig::default().grades.gone_share);
        assert_eq!(read.config, CompareConfig::default());
    }

    #[test]
    fn slips_are_named() {
        let said = |text: &str| format!("{:#}", read(text).unwrap_err());
        assert!(said("[spans]\nspam_m = 25\n").contains("spam_m"));
        assert!(said("[spans]\nspan_m = -1\n").contains("spans.span_m = -1"));
        let wrong = "[spans.grades.gone_share]\na = 0.1\nb = 0.2\nc = 0.0\n";
        assert!(said(wrong).contains("spans.grades.gone_share"));
    }
}
