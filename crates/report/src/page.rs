//! Puts the page together: template, style, viewer and data in one file.

use crate::headline::headline;
use crate::script::{bundle, policy_hash};
use crate::text::{escape, grouped, t};
use crate::types_table::types;
use crate::view_data::{check, view_data};
use crate::{ReportError, ReportInput, Text, histogram};
use std::fmt::Write;

const TEMPLATE: &str = include_str!("page/page.html");
/// The style of every page of ours.
pub const STYLE: &str = include_str!("page/style.css");

/// The report as one HTML file. Errors: values that do not belong together ([`ReportError`]).
pub fn html(input: &ReportInput) -> Result<String, ReportError> {
    check(input)?;
    let (json, blob) = view_data(input)?;
    let scripts = bundle();
    let parts: [(&str, String); 15] = [
        ("script-hash", policy_hash(&scripts)),
        ("style-hash", policy_hash(STYLE)),
        ("title", escape(&input.title)),
        ("program", escape(&input.program)),
        ("place", place(input)),
        ("headline", headline(input)),
        ("figures", figures(input)),
        ("histograms", histogram::histograms(&input.histograms)),
        ("types", types(input)),
        ("assumptions", assumptions(input)),
        ("provenance", provenance(input)),
        ("style", STYLE.into()),
        ("json", json),
        ("blob", blob),
        ("scripts", scripts),
    ];
    Ok(fill(TEMPLATE, &parts))
}

/// Replaces each `{{name}}` once, left to right, so that nothing a user wrote is taken for a name.
fn fill(template: &str, parts: &[(&str, String)]) -> String {
    let mut page =
        String::with_capacity(template.len() + parts.iter().map(|p| p.1.len()).sum::<usize>());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").expect("the template closes what it opens");
        page += before;
        page += &parts.iter().find(|p| p.0 == name).expect("the template names known parts").1;
        rest = after;
    }
    page + rest
}

fn place(input: &ReportInput) -> String {
    let frame = &input.survey.frame;
    let mut words = Vec::new();
    let points = grouped(&input.survey.cloud.len().to_string());
    words.push(Text::new(format!("{points} survey points"), format!("測量点 {points} 点")).html());
    if !input.survey_date.is_empty() {
        words.push(format!("{} {}", t("Surveyed", "測量日"), escape(&input.survey_date)));
    }
    if !frame.crs.is_empty() {
        words.push(format!("{} {}", t("Horizontal", "平面座標系"), escape(&frame.crs)));
    }
    if !frame.vertical_datum.is_empty() {
        words.push(format!("{} {}", t("Levels", "標高基準"), escape(&frame.vertical_datum)));
    }
    words.join(" · ")
}

fn figures(input: &ReportInput) -> String {
    let mut html = String::new();
    for f in &input.figures {
        let note =
            if f.note.en.is_empty() { String::new() } else { format!("<p>{}</p>", f.note.html()) };
        let _ = write!(
            html,
            "<div class=\"figure\"><dt>{}</dt><dd>{} <small>{}</small></dd>{note}</div>",
            f.label.html(),
            escape(&grouped(&f.value)),
            escape(&f.unit)
        );
    }
    if html.is_empty() {
        return html;
    }
    format!(
        "<section id=\"figures\"><h2>{}</h2><dl class=\"figures\">{html}</dl></section>",
        t("Figures", "数値")
    )
}

fn assumptions(input: &ReportInput) -> String {
    if input.assumptions.is_empty() {
        return String::new();
    }
    let items: String =
        input.assumptions.iter().map(|a| format!("<li>{}</li>", a.html())).collect();
    format!(
        "<section id=\"assumptions\"><h2>{}</h2><ul>{items}</ul></section>",
        t("Assumptions", "前提条件")
    )
}

fn provenance(input: &ReportInput) -> String {
    if input.provenance.is_empty() {
        return String::new();
    }
    let rows: String = input
        .provenance
        .iter()
        .map(|(label, value)| {
            format!(
                "<tr><th scope=\"row\">{}</th><td><code>{}</code></td></tr>",
                label.html(),
                escape(value)
            )
        })
        .collect();
    format!(
        "<section id=\"provenance\"><h2>{}</h2><table class=\"plain\">{rows}</table></section>",
        t("Where this comes from", "来歴")
    )
}
