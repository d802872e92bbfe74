//! The page of a comparison: one self-contained file. Its script only moves the edge between the two surveys; without it everything
//! else is there.

use crate::script::policy_hash;
use crate::text::escape;
use base64::Engine;
use std::fmt::Write;

/// A block on the plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChangeMark {
    /// Number.
    pub block_id: u32,
    /// What happened, in a word.
    pub class: String,
    /// East and north where it was (or is, for one that came), metres.
    pub place_m: [f64; 2],
    /// East and north of its shift; `None` where it is seen once.
    pub shift_m: Option<[f64; 2]>,
    /// Length of the shift in space.
    pub distance_m: Option<f64>,
}

/// A table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PageTable {
    /// What it shows.
    pub title: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Rows, as long as the columns.
    pub rows: Vec<Vec<String>>,
}

/// Both surveys from above, and their difference, as pictures of one place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurveyPictures {
    /// West, south, east and north edge, metres.
    pub extent_m: [f64; 4],
    /// What the earlier and the later survey are called.
    pub names: [String; 2],
    /// PNG of the earlier survey.
    pub earlier: Vec<u8>,
    /// PNG of the later one.
    pub later: Vec<u8>,
    /// PNG of how much higher the later one is.
    pub difference: Vec<u8>,
    /// Difference that has full colour, metres.
    pub difference_m: f64,
}

/// What the page shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChangesPage {
    /// Title.
    pub title: String,
    /// The answer, a sentence.
    pub headline: String,
    /// Further sentences.
    pub facts: Vec<String>,
    /// The surveys under the plan; `None`: blocks alone.
    pub surveys: Option<SurveyPictures>,
    /// Blocks of the plan.
    pub marks: Vec<ChangeMark>,
    /// Tables, in order.
    pub tables: Vec<PageTable>,
}

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1a1a1a;background:#fff}\
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}.answer{font-size:1.15rem}svg{width:100%;height:auto;border:1px solid #ccc}\
.key svg{width:.8em;border:0}.swipe{display:flex;flex-wrap:wrap;gap:.5rem 1rem;align-items:center}.swipe input[type=range]{flex:1 1 12rem}\
.wide{overflow-x:auto}table{border-collapse:collapse;font-size:.9rem}th,td{padding:.2rem .6rem;border-bottom:1px solid #ddd;text-align:left}";

/// Moves the edge between the surveys, and shows or hides the layers.
const SCRIPT: &str = include_str!("page/changes.js");

/// Colours of the classes; told apart by the eye that sees no red or green too, and by the words beside.
fn colour(class: &str) -> &'static str {
    match class {
        "unchanged" => "#b0b0b0",
        "moved" => "#0072b2",
        "turned" => "#56b4e9",
        "sunk" => "#7b3294",
        "missing" => "#d55e00",
        "new" => "#009e73",
        "possibly broken" => "#e69f00",
        _ => "#555555",
    }
}

/// The page.
pub fn html(page: &ChangesPage) -> String {
    let (script_hash, style_hash) = (policy_hash(SCRIPT), policy_hash(STYLE));
    let (title, headline) = (escape(&page.title), escape(&page.headline));
    let facts: String = page.facts.iter().map(|f| format!("<li>{}</li>", escape(f))).collect();
    let tables: String = page.tables.iter().map(table).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\n\
<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src '{script_hash}'; style-src '{style_hash}'; img-src data:; base-uri 'none'; form-action 'none'\">\n\
<title>{title}</title><style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n<p class=\"answer\">{headline}</p>\n<ul>{facts}</ul>\n\
{}{}{tables}<script>{SCRIPT}</script></body></html>\n",
        plan(&page.marks, page.surveys.as_ref()),
        histogram(&page.marks)
    )
}

fn table(table: &PageTable) -> String {
    let cells = |tag: &str, row: &[String]| -> String {
        row.iter().map(|c| format!("<{tag}>{}</{tag}>", escape(c))).collect()
    };
    let rows: String =
        table.rows.iter().map(|r| format!("<tr>{}</tr>\n", cells("td", r))).collect();
    format!(
        "<h2>{}</h2><div class=\"wide\"><table><thead><tr>{}</tr></thead><tbody>\n{rows}</tbody></table></div>\n",
        escape(&table.title),
        cells("th", &table.columns)
    )
}

/// Longest arrow, as a share of the plan's larger side.
const ARROW: f64 = 0.08;

/// Blocks from above, north up, shifts as arrows on a scale of their own.
fn plan(marks: &[ChangeMark], surveys: Option<&SurveyPictures>) -> String {
    if marks.is_empty() {
        return String::new();
    }
    let side = |i: usize| {
        let pictured = surveys.map(|s| [s.extent_m[i], s.extent_m[i + 2]]).into_iter().flatten();
        let all = || marks.iter().map(move |m| m.place_m[i]).chain(pictured.clone());
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max))
    };
    let ((west, east), (south, north)) = (side(0), side(1));
    let size = (east - west).max(north - south).max(1.0);
    let margin = if surveys.is_some() { 0.02 } else { 0.1 } * size;
    let moved = |m: &&ChangeMark| m.class != "unchanged" && m.shift_m.is_some();
    let length = |m: &ChangeMark| m.shift_m.map_or(0.0, |[x, y]| x.hypot(y));
    let longest = marks.iter().filter(moved).map(length).fold(0.0, f64::max);
    let times = if longest > 0.0 { nice(ARROW * size / longest) } else { 1.0 };
    let arrows = match longest > 0.0 {
        true if times == 1.0 => "; arrows are as long as the movement".into(),
        true => format!("; arrows are {times} times as long as the movement"),
        false => String::new(),
    };
    let (w, h) = (east - west + 2.0 * margin, north - south + 2.0 * margin);
    let radius = size / 90.0;
    let mut out = format!(
        "<h2>Plan</h2><p class=\"key\">North is up{arrows}. {}</p>\n{}<svg id=\"plan\" viewBox=\"0 0 {w:.3} {h:.3}\" role=\"img\" aria-label=\"plan of all blocks\">\n{}<g id=\"blocks\">\n",
        legend(marks),
        surveys.map(controls).unwrap_or_default(),
        surveys.map(|s| layers(s, [west - margin, north + margin])).unwrap_or_default()
    );
    for m in marks {
        let (x, y) = (m.place_m[0] - west + margin, north - m.place_m[1] + margin);
        let (c, name) = (colour(&m.class), escape(&m.class));
        let _ = writeln!(
            out,
            "<circle cx=\"{x:.3}\" cy=\"{y:.3}\" r=\"{radius:.3}\" fill=\"{c}\"><title>block {}: {name}</title></circle>",
            m.block_id
        );
        if let Some([dx, dy]) = m.shift_m.filter(|_| moved(&m)) {
            let (x1, y1) = (x + times * dx, y - times * dy);
            let _ = writeln!(
                out,
                "<path d=\"M{x:.3} {y:.3}L{x1:.3} {y1:.3}\" stroke=\"{c}\" stroke-width=\"{:.3}\"/>{}",
                0.4 * radius,
                head([x, y], [x1, y1], radius, c)
            );
        }
    }
    out + "</g></svg>\n"
}

/// What moves the edge between the surveys and chooses the layers.
fn controls(surveys: &SurveyPictures) -> String {
    let [earlier, later] = surveys.names.each_ref().map(|n| escape(n));
    format!(
        "<div class=\"swipe\"><label for=\"edge\">{earlier}</label><input type=\"range\" id=\"edge\" min=\"0\" max=\"100\" value=\"50\" \
aria-label=\"edge between {earlier} and {later}\"><span>{later}</span>\
<label><input type=\"checkbox\" id=\"show-difference\"> difference of height (blue lower, orange higher, full colour at {:.2} m)</label>\
<label><input type=\"checkbox\" id=\"show-blocks\" checked> blocks</label></div>\n",
        surveys.difference_m
    )
}

/// The pictures under the plan; the later survey is cut at the edge.
fn layers(surveys: &SurveyPictures, corner: [f64; 2]) -> String {
    let [west, south, east, north] = surveys.extent_m;
    let (x, y, w, h) = (west - corner[0], corner[1] - north, east - west, north - south);
    let image = |id: &str, png: &[u8], more: &str| {
        let data = base64::engine::general_purpose::STANDARD.encode(png);
        format!(
            "<image id=\"{id}\" x=\"{x:.3}\" y=\"{y:.3}\" width=\"{w:.3}\" height=\"{h:.3}\" preserveAspectRatio=\"none\" {more} href=\"data:image/png;base64,{data}\"/>\n"
        )
    };
    let half = x + 0.5 * w;
    format!(
        "<clipPath id=\"cut\"><rect x=\"{half:.3}\" y=\"{y:.3}\" width=\"{w:.3}\" height=\"{h:.3}\"/></clipPath>\n{}{}\
<path id=\"edge-line\" d=\"M0 {y:.3}v{h:.3}\" transform=\"translate({half:.3} 0)\" stroke=\"#fff\" stroke-width=\"{:.3}\"/>\n{}",
        image("earlier", &surveys.earlier, ""),
        image("later", &surveys.later, "clip-path=\"url(#cut)\""),
        w / 300.0,
        image("difference", &surveys.difference, "visibility=\"hidden\"")
    )
}

/// Tip of an arrow; none where it is shorter than its tip.
fn head(from: [f64; 2], to: [f64; 2], size: f64, colour: &str) -> String {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if length < size {
        return String::new();
    }
    let (ux, uy) = (dx / length * size, dy / length * size);
    let corner = |s: f64| (to[0] - ux - 0.5 * s * uy, to[1] - uy + 0.5 * s * ux);
    let ((ax, ay), (bx, by)) = (corner(1.0), corner(-1.0));
    format!(
        "<path d=\"M{:.3} {:.3}L{ax:.3} {ay:.3}L{bx:.3} {by:.3}Z\" fill=\"{colour}\"/>",
        to[0], to[1]
    )
}

fn legend(marks: &[ChangeMark]) -> String {
    let mut classes: Vec<&str> = marks.iter().map(|m| m.class.as_str()).collect();
    classes.sort_unstable();
    classes.dedup();
    let one = |c: &&str| {
        format!(
            "<svg viewBox=\"0 0 10 10\"><circle cx=\"5\" cy=\"5\" r=\"5\" fill=\"{}\"/></svg> {}",
            colour(c),
            escape(c)
        )
    };
    classes.iter().map(one).collect::<Vec<_>>().join(" · ")
}

/// The largest of 1, 2, 5 times a power of ten that is no larger; at least 1.
fn nice(v: f64) -> f64 {
    let power = 10_f64.powf(v.max(1.0).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|k| k * power).find(|k| *k <= v).unwrap_or(1.0)
}

const BINS: usize = 20;

/// How far the blocks went that are seen in both surveys.
fn histogram(marks: &[ChangeMark]) -> String {
    let distances: Vec<f64> = marks.iter().filter_map(|m| m.distance_m).collect();
    let most = distances.iter().copied().fold(0.0, f64::max);
    if distances.is_empty() || most <= 0.0 {
        return String::new();
    }
    let mut counts = [0_usize; BINS];
    for d in &distances {
        counts[((d / most * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    let top = counts.iter().copied().max().unwrap_or(1).max(1) as f64;
    let bar = |(i, n): (usize, &usize)| {
        let h = 100.0 * *n as f64 / top;
        let (from, to) = (most * i as f64 / BINS as f64, most * (i + 1) as f64 / BINS as f64);
        format!(
            "<rect x=\"{}\" y=\"{:.2}\" width=\"18\" height=\"{h:.2}\" fill=\"#0072b2\"><title>{from:.3} to {to:.3} m: {n}</title></rect>\n",
            20 * i,
            100.0 - h
        )
    };
    let bars: String = counts.iter().enumerate().map(bar).collect();
    let blocks = if top > 1.0 { "blocks" } else { "block" };
    format!(
        "<h2>How far blocks went</h2><p>{} blocks seen in both surveys; the bars go from 0 to {most:.3} m, the highest is {top} {blocks}.</p>\n\
<svg viewBox=\"0 0 400 102\" role=\"img\" aria-label=\"histogram of distances\">\n{bars}</svg>\n",
        distances.len()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_escapes_and_scales() {
        let mark = ChangeMark {
            block_id: 3,
            class: "moved".into(),
            place_m: [10.0, 5.0],
            shift_m: Some([0.1, 0.0]),
            distance_m: Some(0.1),
        };
        let other =
            ChangeMark { place_m: [110.0, 45.0], class: "new".into(), ..ChangeMark::default() };
        let page = ChangesPage {
            title: "a < b".into(),
            marks: vec![mark, other],
            tables: vec![PageTable { rows: vec![vec!["<x>".into()]], ..PageTable::default() }],
            ..ChangesPage::default()
        };
        let html = html(&page);
        assert!(
            html.contains("a &lt; b")
                && html.contains("&lt;x&gt;")
                && !html.contains("unsafe-inline")
        );
        assert!(!html.contains("<image"), "no surveys were given");
        // 0.1 m of 8 m that the longest arrow may have: 50 times.
        assert!(html.contains("arrows are 50 times"), "{html}");
        assert_eq!(nice(79.9), 50.0);
        assert_eq!(nice(0.3), 1.0);
    }

    #[test]
    fn surveys_lie_under_the_plan() {
        let surveys = SurveyPictures {
            extent_m: [0.0, 0.0, 100.0, 50.0],
            names: ["2025 <b>".into(), "2026".into()],
            difference_m: 0.2,
            ..SurveyPictures::default()
        };
        let mark =
            ChangeMark { place_m: [50.0, 25.0], class: "new".into(), ..ChangeMark::default() };
        let page =
            ChangesPage { surveys: Some(surveys), marks: vec![mark], ..ChangesPage::default() };
        let html = html(&page);
        assert_eq!(html.matches("<image").count(), 3);
        assert!(html.contains("2025 &lt;b&gt;") && html.contains("full colour at 0.20 m"));
        // 2 % of 100 m around the surveys: the block is in the middle.
        assert!(
            html.contains("viewBox=\"0 0 104.000 54.000\"")
                && html.contains("cx=\"52.000\" cy=\"27.000\"")
        );
    }
}
