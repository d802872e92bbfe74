//! Histograms: how the errors, confidences and distances are spread.

use crate::Histogram;
use crate::chart::{Chart, ticks};
use crate::text::{Text, t};
use std::fmt::Write;

/// All histograms.
pub(crate) fn histograms(histograms: &[Histogram]) -> String {
    let drawn: String = histograms.iter().filter_map(one).collect();
    if drawn.is_empty() {
        return String::new();
    }
    format!(
        "<section id=\"histograms\"><h2>{}</h2><div class=\"charts\">{drawn}</div></section>",
        t("Distributions", "分布")
    )
}

fn one(h: &Histogram) -> Option<String> {
    let mut values: Vec<f64> =
        h.values.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).collect();
    values.sort_by(f64::total_cmp);
    let (&low, &high) = (values.first()?, values.last()?);
    // Bars as wide as a round number, about as many as the root of the count.
    let wanted = (values.len() as f64).sqrt().clamp(5.0, 24.0);
    let marks = ticks([low, high.max(low + 1e-6)], wanted as usize);
    let step = if marks.len() > 1 { marks[1].0 - marks[0].0 } else { (high - low).max(1e-6) };
    let first = (low / step).floor();
    let bins = ((high / step - first).floor() as usize + 1).clamp(1, 200);
    let mut counts = vec![0_u32; bins];
    for v in &values {
        counts[((v / step - first) as usize).min(bins - 1)] += 1;
    }
    let most = f64::from(*counts.iter().max()?);
    let chart =
        Chart::new(420.0, 220.0, [first * step, (first + bins as f64) * step], [0.0, most * 1.08]);
    let mut svg = chart.open("chart", &h.label.en);
    let unit = if h.unit.is_empty() { String::new() } else { format!(" ({})", h.unit) };
    let name = Text::new(
        format!("{}{unit}", h.label.en),
        if h.label.ja.is_empty() { String::new() } else { format!("{}{unit}", h.label.ja) },
    );
    svg += &chart.axes(&name, &Text::new("count", "数"));
    for (i, &n) in counts.iter().enumerate() {
        let (x0, x1) =
            (chart.px((first + i as f64) * step), chart.px((first + i as f64 + 1.0) * step));
        let y = chart.py(f64::from(n));
        let height = chart.py(0.0) - y;
        let _ = write!(
            svg,
            "<rect class=\"bar\" x=\"{:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{height:.1}\"><title>{n}</title></rect>",
            x0 + 0.7,
            (x1 - x0 - 1.4).max(0.6)
        );
    }
    let median = values[values.len() / 2];
    let x = chart.px(median);
    let _ =
        write!(svg, "<path class=\"median\" d=\"M{x:.1} {:.1}V{:.1}\"/>", chart.top, chart.py(0.0));
    let missing = h.values.len() - values.len();
    let (mut en, mut ja) = (
        format!("n = {}, median {median:.3} {}", values.len(), h.unit),
        format!("n = {}、中央値 {median:.3} {}", values.len(), h.unit),
    );
    if missing > 0 {
        en += &format!(", {missing} without a value");
        ja += &format!("、値なし {missing}");
    }
    Some(format!(
        "<figure><figcaption>{} <small>{}</small></figcaption>{svg}</svg></figure>",
        h.label.html(),
        Text::new(en, ja).html()
    ))
}
