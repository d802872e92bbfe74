//! The catalogue as a small table; the long tables are made by the page itself.

use crate::ReportInput;
use crate::text::{escape, grouped, t};
use scene::Placement;
use std::fmt::Write;

const HEADS: [(&str, &str, &str); 7] = [
    ("type", "種類", ""),
    ("recognised", "認識数", ""),
    ("to place", "据付数", ""),
    ("volume", "体積", "m³"),
    ("mass", "質量", "t"),
    ("largest edge", "最大寸法", "m"),
    ("rotations onto itself", "対称回転数", ""),
];

/// The catalogue.
pub(crate) fn types(input: &ReportInput) -> String {
    let mut html = format!(
        "<section id=\"types\"><h2>{}</h2><table class=\"plain\"><thead><tr>",
        t("Block types", "ブロックの種類")
    );
    for (en, ja, unit) in HEADS {
        let unit = if unit.is_empty() { String::new() } else { format!("<small> {unit}</small>") };
        let _ = write!(html, "<th scope=\"col\">{}{unit}</th>", t(en, ja));
    }
    html += "</tr></thead><tbody>";
    for (id, m) in input.catalog.iter() {
        let found = scene::stated(input.recognised).filter(|(_, fit)| fit.model == id).count();
        let of_it = |p: &&Placement| p.model == id && p.is_new();
        let added = input.plan.map_or(0, |p| p.placements.iter().filter(of_it).count());
        let round =
            if m.symmetry.axis().is_some() { "∞".into() } else { m.symmetry.order().to_string() };
        let cells = [
            escape(&m.name),
            grouped(&found.to_string()),
            grouped(&added.to_string()),
            digits(m.volume_m3),
            digits(m.mass_kg() / 1000.0),
            digits(m.d_box_m),
            round,
        ];
        let cells: String = cells.iter().map(|c| format!("<td>{c}</td>")).collect();
        let _ = write!(html, "<tr>{cells}</tr>");
    }
    html + "</tbody></table></section>"
}

/// Three significant digits: a breakwater's cubic metres and a bin's cubic centimetres in one column.
pub(crate) fn digits(v: f32) -> String {
    if v == 0.0 || !v.is_finite() {
        return "0".into();
    }
    let places = (2 - v.abs().log10().floor() as i32).clamp(0, 9) as usize;
    grouped(&format!("{v:.places$}"))
}
