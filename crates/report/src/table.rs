//! The tables: blocks found, blocks to place, blocks tried and removed.

use crate::ReportInput;
use crate::text::{Text, escape, t};
use geom::{Pose, Vec3};
use scene::{Fit, ModelId, Placement, PlacementState};
use std::fmt::Write;

/// Blocks found.
pub(crate) fn found(input: &ReportInput) -> String {
    if input.recognised.is_empty() {
        return String::new();
    }
    let heads = [
        ("No.", "番号", ""),
        ("type", "種類", ""),
        ("east / x", "東 / x", "m"),
        ("north / y", "北 / y", "m"),
        ("level / z", "標高 / z", "m"),
        ("confidence", "信頼度", ""),
        ("fit", "適合誤差", "mm"),
        ("hidden", "隠蔽率", "%"),
        ("second type", "次点", ""),
        ("judged", "判定", ""),
    ];
    let mut html = open("found", &t("Blocks recognised", "認識したブロック"), &heads);
    let open_type = t("type not judged", "種類判定不能");
    for r in input.recognised {
        let [x, y, z] = site(input, r.centre(input.catalog));
        let judged =
            if r.is_stated() { t("accepted", "採用") } else { t("not judged", "判定不能") };
        let id = r.block.0;
        // A place that no type fits has nothing to show in the view.
        let chosen =
            r.fit().map_or(String::new(), |_| format!(" data-block=\"{id}\" tabindex=\"0\""));
        let [kind, confidence, fitness, hidden, second] = r
            .fit()
            .map_or(std::array::from_fn(|_| "–".into()), |fit| stated(input, fit, &open_type));
        let _ = write!(
            html,
            "<tr id=\"block-{id}\"{chosen}><td>{id}</td><td>{kind}</td><td>{x:.3}</td><td>{y:.3}</td><td>{z:.3}</td>\
             <td>{confidence}</td><td>{fitness}</td><td>{hidden}</td><td>{second}</td><td>{judged}</td></tr>",
        );
    }
    html + "</tbody></table></div></section>"
}

/// Type, confidence, fit, hidden share and second type of a block, as the table has them.
fn stated(input: &ReportInput, fit: &Fit, open_type: &str) -> [String; 5] {
    let number = |v: Option<f32>, digits: usize, scale: f32| {
        v.map_or("–".to_string(), |v| format!("{:.digits$}", v * scale))
    };
    let kind = name(input, fit.model);
    let second = |(m, fit): (ModelId, f32)| format!("{} ({:.0} mm)", name(input, m), fit * 1000.0);
    [
        if fit.type_judged { kind } else { format!("{kind} ({open_type})") },
        number(fit.confidence, 2, 1.0),
        number(fit.fitness_m, 0, 1000.0),
        number(fit.occlusion, 0, 100.0),
        fit.runner_up.map_or(String::new(), second),
    ]
}

/// Blocks to place, and those tried and removed.
pub(crate) fn placements(input: &ReportInput) -> String {
    let Some(plan) = input.plan else { return String::new() };
    let heads = [
        ("order", "順序", ""),
        ("round", "回", ""),
        ("type", "種類", ""),
        ("east / x", "東 / x", "m"),
        ("north / y", "北 / y", "m"),
        ("level / z", "標高 / z", "m"),
        ("let go at", "投下高", "m"),
        ("fills", "充填量", "m³"),
        ("contacts", "接触数", ""),
        ("state", "状態", ""),
    ];
    let row = |html: &mut String, p: &Placement, attributes: String| {
        let [x, y, z] = centre(input, p.model, &p.rest);
        let [.., drop] = centre(input, p.model, &p.drop);
        let _ = write!(
            html,
            "<tr {attributes}><td>{}</td><td>{}</td><td>{}</td><td>{x:.3}</td><td>{y:.3}</td><td>{z:.3}</td><td>{drop:.2}</td><td>{:.2}</td><td>{}</td><td>{}</td></tr>",
            p.order,
            p.round,
            name(input, p.model),
            p.filled_m3,
            p.contacts,
            state(p.state).html(),
        );
    };
    let mut html =
        open("placements", &t("Blocks to place, in order", "据付ブロック (施工順)"), &heads);
    for p in &plan.placements {
        row(&mut html, p, format!("id=\"place-{0}\" data-place=\"{0}\" tabindex=\"0\"", p.order));
    }
    html += "</tbody></table></div></section>";
    if !plan.removed.is_empty() {
        html += &open("removed", &t("Tried and removed", "試行後に除外"), &heads);
        plan.removed.iter().for_each(|p| row(&mut html, p, String::new()));
        html += "</tbody></table></div></section>";
    }
    html
}

/// The catalogue.
pub(crate) fn types(input: &ReportInput) -> String {
    let heads = [
        ("type", "種類", ""),
        ("recognised", "認識数", ""),
        ("to place", "据付数", ""),
        ("volume", "体積", "m³"),
        ("mass", "質量", "t"),
        ("largest edge", "最大寸法", "m"),
        ("rotations onto itself", "対称回転数", ""),
    ];
    let mut html = open("types", &t("Block types", "ブロックの種類"), &heads);
    for (id, m) in input.catalog.iter() {
        let found = scene::stated(input.recognised).filter(|(_, fit)| fit.model == id).count();
        let added = input.plan.map_or(0, |p| p.placements.iter().filter(|p| p.model == id).count());
        let round =
            if m.symmetry.axis().is_some() { "∞".into() } else { m.symmetry.order().to_string() };
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{found}</td><td>{added}</td><td>{}</td><td>{}</td><td>{}</td><td>{round}</td></tr>",
            escape(&m.name),
            digits(m.volume_m3),
            digits(m.mass_kg() / 1000.0),
            digits(m.d_box_m),
        );
    }
    html + "</tbody></table></div></section>"
}

/// Three significant digits: a breakwater's cubic metres and a bin's cubic centimetres in one column.
fn digits(v: f32) -> String {
    if v == 0.0 || !v.is_finite() {
        return "0".into();
    }
    let places = (2 - v.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{v:.places$}")
}

fn open(id: &str, title: &str, heads: &[(&str, &str, &str)]) -> String {
    let mut html =
        format!("<section id=\"{id}\"><h2>{title}</h2><div class=\"scroll\"><table><thead><tr>");
    for (en, ja, unit) in heads {
        let unit = if unit.is_empty() { String::new() } else { format!("<small> {unit}</small>") };
        let _ = write!(
            html,
            "<th scope=\"col\"><button type=\"button\">{}{unit}</button></th>",
            t(en, ja)
        );
    }
    html + "</tr></thead><tbody>"
}

fn centre(input: &ReportInput, model: ModelId, pose: &Pose) -> [f64; 3] {
    site(input, pose.transform_point(input.catalog.get(model).centre))
}

fn site(input: &ReportInput, place: Vec3) -> [f64; 3] {
    input.survey.frame.site_from_local(place).to_array()
}

fn name(input: &ReportInput, model: ModelId) -> String {
    escape(input.catalog.iter().find(|(id, _)| *id == model).map_or("?", |(_, m)| &m.name))
}

fn state(state: PlacementState) -> Text {
    let ja = match state {
        PlacementState::Kept => "採用",
        PlacementState::Overflow => "設計面超過",
        PlacementState::Unsettled => "静止せず",
        PlacementState::Outside => "範囲外",
        PlacementState::Unstable => "不安定",
    };
    Text::new(state.word(), ja)
}
