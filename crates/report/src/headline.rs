//! The answer in one sentence, the lights beside it, and the warnings.

use crate::lights::{filled, lights};
use crate::text::{escape, grouped, t};
use crate::{Light, LightState, ReportInput, Text};
use scene::Plan;
use std::fmt::Write;

/// The head of the page.
pub(crate) fn headline(input: &ReportInput) -> String {
    let (sentence, sub) = answer(input);
    let own = input.lights.is_empty().then(|| lights(input));
    let lights = own.as_ref().unwrap_or(&input.lights);
    let sub = if sub.en.is_empty() {
        String::new()
    } else {
        format!("<p class=\"sub\">{}</p>", sub.html())
    };
    format!(
        "<section id=\"answer\"><h1>{}</h1>{sub}<ul class=\"lights\">{}</ul>{}</section>",
        sentence.html(),
        lights.iter().map(light).collect::<String>(),
        warnings(input)
    )
}

fn light(light: &Light) -> String {
    let (class, en, ja) = match light.state {
        LightState::Good => ("good", "good", "良"),
        LightState::Fair => ("fair", "look closer", "要注意"),
        LightState::Bad => ("bad", "do not rely on it", "信頼不可"),
        LightState::Unknown => ("none", "not judged", "未判定"),
    };
    format!(
        "<li class=\"light {class}\"><b>{}</b><span class=\"word\">{}</span><p>{}</p></li>",
        light.name.html(),
        t(en, ja),
        light.reason.html()
    )
}

/// The sentence, and what is to be said of it.
pub(crate) fn answer(input: &ReportInput) -> (Text, Text) {
    let stated = scene::stated(input.recognised).count();
    let open = input.recognised.len() - stated;
    match input.plan {
        _ if stated == 0 && !input.bare_ground => (
            Text::new(
                "No plan: nothing was recognised",
                "計画なし：ブロックを認識できませんでした",
            ),
            Text::new(
                "A count without a recognised pile would be a guess. Check size and kind of the block, the survey's density and its area.",
                "認識されたブロックがないため、必要数は示しません。ブロックの寸法・種類、測量の密度と範囲を確認してください。",
            ),
        ),
        None => (
            Text::new(
                format!(
                    "{} recognised; {open} could not be judged",
                    blocks(stated as u32, "block")
                ),
                format!("ブロック {stated} 個を認識、{open} 個は判定不能"),
            ),
            Text::new(
                "There is no design, so nothing was planned.",
                "計画面がないため、計画は作成していません。",
            ),
        ),
        Some(plan) if plan.placements.is_empty() => (
            Text::new("No block is needed", "追加ブロックは不要です"),
            Text::new(
                "No place below the design takes a whole block.",
                "計画面より下に、ブロック一個が収まる場所がありません。",
            ),
        ),
        Some(plan) => order(input, plan),
    }
}

fn order(input: &ReportInput, plan: &Plan) -> (Text, Text) {
    let planned = plan.placements.iter().filter(|p| p.is_new()).count() as u32;
    let range = input.count.as_ref().and_then(|c| c.p10_p90);
    let wanted = range.map_or(planned, |(_, high)| high.max(planned));
    let tonnes = grouped(&format!("{:.0}", plan.summary.mass_kg / 1000.0));
    let (name, name_ja) = kinds(input, plan);
    let (n, p) = (grouped(&wanted.to_string()), grouped(&planned.to_string()));
    let (mut en, mut ja) = match range {
        Some((low, high)) => {
            let (low, high) = (grouped(&low.to_string()), grouped(&high.to_string()));
            (
                format!("Order {n} {name} (this plan {p} = {tonnes} t, range {low}–{high})."),
                format!(
                    "{name_ja} {n} 個を手配（本計画 {p} 個・{tonnes} t、範囲 {low}～{high}）。"
                ),
            )
        }
        None => (
            format!("Order {n} {name} = {tonnes} t."),
            format!("{name_ja} {n} 個を手配（{tonnes} t）。"),
        ),
    };
    if let Some(filled) = filled(&plan.summary) {
        let _ = write!(en, " Fills {:.0} % of the void", filled * 100.0);
        let _ = write!(ja, "不足量の {:.0} % を充填", filled * 100.0);
        let high = plan.summary.protruding;
        if high > 0 {
            let stands = if high == 1 { "stands" } else { "stand" };
            let _ = write!(en, "; {} {stands} above the design", grouped(&high.to_string()));
            let _ = write!(ja, "、{} 個が計画面より上", grouped(&high.to_string()));
        }
        en.push('.');
        ja.push('。');
    }
    let reset = plan.placements.iter().filter(|p| !p.is_new()).count();
    if reset > 0 {
        let _ = write!(en, " {} of the pile set elsewhere first.", blocks(reset as u32, "block"));
        let _ = write!(ja, "既設 {reset} 個を先に据え直し。");
    }
    (Text::new(en, ja), basis(input, range.is_some()))
}

fn basis(input: &ReportInput, ranged: bool) -> Text {
    let Some(count) = &input.count else { return Text::default() };
    let (en, ja) = (
        &count.basis.en,
        if count.basis.ja.is_empty() { &count.basis.en } else { &count.basis.ja },
    );
    if ranged {
        Text::new(
            format!(
                "The number to order is the upper end of the range, so that the work does not wait for a block. Range: {en}."
            ),
            format!("手配数は、工事が待たされないよう範囲の上限としています。範囲：{ja}。"),
        )
    } else {
        count.basis.clone()
    }
}

/// The one type that is placed by its name, several as blocks.
fn kinds(input: &ReportInput, plan: &Plan) -> (String, String) {
    let new = || plan.placements.iter().filter(|p| p.is_new());
    let first = new().next().map(|p| p.model);
    match first.filter(|m| new().all(|p| p.model == *m)) {
        Some(model) => {
            let name = input.catalog.get(model).name.clone();
            (format!("× {name}"), name)
        }
        None => ("blocks".into(), "ブロック".into()),
    }
}

fn blocks(n: u32, word: &str) -> String {
    format!("{} {word}{}", grouped(&n.to_string()), if n == 1 { "" } else { "s" })
}

/// Folded when there are many: the answer stays on the first screen.
fn warnings(input: &ReportInput) -> String {
    if input.warnings.is_empty() {
        return String::new();
    }
    let mut seen = Vec::new();
    let mut items = String::new();
    for w in &input.warnings {
        let item = format!("<li>{}</li>", escape(&w.message));
        if !seen.contains(&item) {
            items += &item;
            seen.push(item);
        }
    }
    let (n, open) = (seen.len(), if seen.len() < 3 { " open=\"\"" } else { "" });
    let words = Text::new(
        format!("{n} {}", if n == 1 { "warning" } else { "warnings" }),
        format!("警告 {n} 件"),
    );
    format!(
        "<details id=\"warnings\"{open}><summary>{}</summary><ul>{items}</ul></details>",
        words.html()
    )
}
