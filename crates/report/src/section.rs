//! Cross-sections: design, as-is and planned surface at true scale.

use crate::chart::Chart;
use crate::text::{Text, t};
use crate::{Section, SectionLine, SectionLineKind};
use std::fmt::Write;

/// All sections, one drawing each.
pub(crate) fn sections(sections: &[Section]) -> String {
    if sections.is_empty() {
        return String::new();
    }
    let mut html =
        format!("<section id=\"sections\"><h2>{}</h2>{}", t("Cross-sections", "横断図"), legend());
    html += "<div class=\"sections\">";
    for s in sections {
        html += &one(s);
    }
    html + "</div></section>"
}

const KINDS: [(SectionLineKind, &str, &str, &str); 4] = [
    (SectionLineKind::Ground, "ground", "ground", "地盤"),
    (SectionLineKind::AsIs, "asis", "as surveyed", "現況"),
    (SectionLineKind::Planned, "planned", "with the plan", "計画後"),
    (SectionLineKind::Design, "design", "design", "設計面"),
];

fn class(kind: SectionLineKind) -> &'static str {
    KINDS.iter().find(|k| k.0 == kind).map_or("asis", |k| k.1)
}

fn legend() -> String {
    let entry = |(_, class, en, ja): &(SectionLineKind, &str, &str, &str)| {
        format!(
            "<span><svg class=\"key\" viewBox=\"0 0 28 8\"><path class=\"{class}\" d=\"M0 4H28\"/></svg>{}</span>",
            t(en, ja)
        )
    };
    format!("<p class=\"legend\">{}</p>", KINDS.iter().map(entry).collect::<String>())
}

fn one(section: &Section) -> String {
    let finite = || {
        section
            .lines
            .iter()
            .flat_map(|l| &l.points)
            .filter(|p| p[0].is_finite() && p[1].is_finite())
    };
    let range = |axis: usize| {
        let values = || finite().map(|p| f64::from(p[axis]));
        [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
    };
    let [low, high] = range(1);
    let air = (high - low).max(1.0) * 0.08;
    let mut chart = Chart::true_to_scale(520.0, range(0), [low - air, high + air]);
    // A flat site would be a ribbon, a tall one a tower: then the heights have their own scale, and it is said.
    let exaggerated = !(150.0..=400.0).contains(&chart.height);
    let natural = chart.height;
    chart.height = chart.height.clamp(150.0, 400.0);
    let factor = (chart.height - chart.top - chart.bottom) / (natural - chart.top - chart.bottom);
    let mut svg = chart.open("chart section", &section.label.en);
    svg += &chart.axes(&Text::new("offset (m)", "離れ (m)"), &Text::new("level (m)", "標高 (m)"));
    if let (Some(present), Some(planned)) =
        (line(section, SectionLineKind::AsIs), line(section, SectionLineKind::Planned))
    {
        let points = |l: &SectionLine| {
            l.points
                .iter()
                .filter(|p| p[1].is_finite())
                .map(|p| p.map(f64::from))
                .collect::<Vec<_>>()
        };
        let outline = points(planned).into_iter().chain(points(present).into_iter().rev());
        let _ = write!(svg, "<path class=\"fill\" d=\"{}Z\"/>", chart.path(outline));
    }
    for (kind, ..) in KINDS {
        for l in section.lines.iter().filter(|l| l.kind == kind) {
            let d = chart.path(l.points.iter().map(|p| p.map(f64::from)));
            let _ = write!(svg, "<path class=\"{}\" d=\"{d}\"/>", class(kind));
        }
    }
    let scale = if exaggerated {
        let (en, ja) = (format!("heights ×{factor:.1}"), format!("高さ {factor:.1} 倍"));
        format!(" <small>{}</small>", Text::new(en, ja).html())
    } else {
        String::new()
    };
    format!("<figure><figcaption>{}{scale}</figcaption>{svg}</svg></figure>", section.label.html())
}

fn line(section: &Section, kind: SectionLineKind) -> Option<&SectionLine> {
    section.lines.iter().find(|l| l.kind == kind)
}
