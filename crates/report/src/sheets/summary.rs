//! The first sheet: the answer with its lights, the site in one picture of the plan, quantities; and the annex.

use super::frame::{FIELD, HAIR, INK, SOFT, THIN, fitted};
use super::paper::{Align, Paper, both};
use super::{Sheet, plan_sheet};
use crate::headline::answer;
use crate::lights::lights;
use crate::text::grouped;
use crate::types_table::digits;
use crate::{Light, LightState, ReportInput, Text};
use scene::{Placement, PlacementState};

/// Summary.
pub(super) fn sheet<'a>(input: &'a ReportInput<'a>) -> Sheet<'a> {
    let draw = move |paper: &mut Paper| {
        let (sentence, sub) = answer(input);
        let width = FIELD[2] - FIELD[0];
        let mut y = FIELD[3] - 10.0;
        for (text, size, ink) in [
            (&sentence.ja, 6.0, INK),
            (&sentence.en, 5.0, INK),
            (&sub.ja, 3.0, SOFT),
            (&sub.en, 3.0, SOFT),
        ] {
            if !text.is_empty() {
                y = paper.paragraph([FIELD[0], y], size, width, text, ink) - 1.0;
            }
        }
        y = lights_row(paper, input, y - 2.0);
        let left = table(
            paper,
            [FIELD[0], y - 8.0],
            170.0,
            &Text::new("Figures", "数値"),
            &figures(input),
        );
        let types = types(input);
        let right = table(
            paper,
            [FIELD[0] + 195.0, y - 8.0],
            175.0,
            &Text::new("Block types", "ブロックの種類"),
            &types,
        );
        let under = notes(paper, input, [FIELD[0] + 195.0, right - 6.0]).min(left) - 6.0;
        if under - FIELD[1] > 50.0 {
            plan_sheet::overview(paper, input, [FIELD[0], FIELD[1]], [width, under - FIELD[1]]);
        }
    };
    Sheet { title: Text::new("Summary", "総括"), scale: "–".into(), draw: Box::new(draw) }
}

fn lights_row(paper: &mut Paper, input: &ReportInput, top: f32) -> f32 {
    let own = lights(input);
    let list: &[Light] = if input.lights.is_empty() { &own } else { &input.lights };
    let wide = (FIELD[2] - FIELD[0]) / list.len().max(1) as f32;
    for (k, light) in list.iter().enumerate() {
        let x = FIELD[0] + wide * k as f32;
        let (colour, word) = match light.state {
            LightState::Good => ([20, 122, 75], Text::new("good", "良")),
            LightState::Fair => ([200, 130, 0], Text::new("look closer", "要注意")),
            LightState::Bad => ([179, 21, 45], Text::new("do not rely on it", "信頼不可")),
            LightState::Unknown => ([120, 130, 140], Text::new("not judged", "未判定")),
        };
        paper.rect([x, top - 24.0], [2.0, 24.0], Some(colour), None);
        fitted(paper, [x + 4.0, top - 4.0], 4.0, wide - 8.0, &both(&light.name));
        paper.label([x + 4.0, top - 9.5], 3.2, Align::Left, &word, colour);
        let y = paper.paragraph([x + 4.0, top - 14.5], 2.5, wide - 8.0, &light.reason.ja, SOFT);
        paper.paragraph([x + 4.0, y], 2.5, wide - 8.0, &light.reason.en, SOFT);
    }
    top - 26.0
}

/// Heading and rows of name and value; returns where it ends.
fn table(
    paper: &mut Paper,
    [x, top]: [f32; 2],
    wide: f32,
    head: &Text,
    rows: &[(String, String)],
) -> f32 {
    paper.label([x, top], 4.0, Align::Left, head, INK);
    let mut y = top - 3.0;
    paper.line(&[[x, y], [x + wide, y]], THIN);
    for (name, value) in rows {
        y -= 6.0;
        if y < FIELD[1] + 4.0 {
            break;
        }
        let own = paper.width(value) * 3.2;
        fitted(paper, [x + 1.0, y + 1.8], 3.0, wide - own - 6.0, name);
        paper.words([x + wide - 1.0, y + 1.8], 3.2, Align::Right, value, INK);
        paper.line(&[[x, y], [x + wide, y]], HAIR);
    }
    y
}

fn figures(input: &ReportInput) -> Vec<(String, String)> {
    let value =
        |f: &crate::Figure| format!("{} {}", grouped(&f.value), f.unit).trim_end().to_string();
    input.figures.iter().map(|f| (both(&f.label), value(f))).collect()
}

fn types(input: &ReportInput) -> Vec<(String, String)> {
    let row = |(id, m): (scene::ModelId, &scene::BlockModel)| {
        let found = scene::stated(input.recognised).filter(|(_, f)| f.model == id).count();
        let of_it = |p: &&Placement| p.model == id && p.is_new();
        let added = input.plan.map_or(0, |p| p.placements.iter().filter(of_it).count());
        let size =
            format!("{} ({} m³, {} t)", m.name, digits(m.volume_m3), digits(m.mass_kg() / 1000.0));
        (size, format!("認識 found {found}   据付 to place {added}"))
    };
    input.catalog.iter().map(row).collect()
}

/// Warnings and assumptions; returns where they end.
fn notes(paper: &mut Paper, input: &ReportInput, [x, top]: [f32; 2]) -> f32 {
    let mut y = top - 4.0;
    let wide = 175.0;
    let warnings = input.warnings.iter().map(|w| Text::from(w.message.clone()));
    for (head, list) in [
        (Text::new("Warnings", "警告"), warnings.collect::<Vec<_>>()),
        (Text::new("Assumptions", "前提条件"), input.assumptions.clone()),
    ] {
        if list.is_empty() || y < FIELD[1] + 14.0 {
            continue;
        }
        paper.label([x, y], 4.0, Align::Left, &head, INK);
        y -= 6.0;
        for text in list {
            if y > FIELD[1] + 8.0 {
                y = paper.paragraph([x + 1.0, y], 2.7, wide, &format!("・{}", both(&text)), INK)
                    - 0.6;
            }
        }
        y -= 4.0;
    }
    y
}

/// Diagnostics: what was tried, what stays unfilled, where the run comes from.
pub(super) fn annex<'a>(input: &'a ReportInput<'a>) -> Sheet<'a> {
    let draw = move |paper: &mut Paper| {
        let top = FIELD[3] - 8.0;
        table(
            paper,
            [FIELD[0], top],
            120.0,
            &Text::new("Tried and removed", "試行後に除外"),
            &removed(input),
        );
        table(
            paper,
            [FIELD[0] + 128.0, top],
            120.0,
            &Text::new("What stays unfilled", "充填されない箇所"),
            &unfilled(input),
        );
        table(
            paper,
            [FIELD[0] + 256.0, top],
            124.0,
            &Text::new("Where this comes from", "来歴"),
            &origin(input),
        );
    };
    Sheet { title: Text::new("Annex", "付録"), scale: "–".into(), draw: Box::new(draw) }
}

fn removed(input: &ReportInput) -> Vec<(String, String)> {
    let states = [
        (PlacementState::Overflow, "stands above the design", "計画面超過"),
        (PlacementState::Unsettled, "did not come to rest", "静止せず"),
        (PlacementState::Unstable, "unstable", "不安定"),
        (PlacementState::Outside, "outside the area or reach", "範囲外"),
    ];
    let list = input.plan.map_or(&[][..], |p| &p.removed);
    let row = |(state, en, ja)| {
        let count = list.iter().filter(|p| p.state == state).count();
        (both(&Text::new(en, ja)), grouped(&count.to_string()))
    };
    states.into_iter().map(row).collect()
}

fn unfilled(input: &ReportInput) -> Vec<(String, String)> {
    let mut reasons: Vec<(&Text, usize, f32)> = Vec::new();
    for w in &input.unfilled {
        match reasons.iter_mut().find(|r| r.0 == &w.reason) {
            Some(r) => (r.1, r.2) = (r.1 + 1, r.2 + w.void_m3),
            None => reasons.push((&w.reason, 1, w.void_m3)),
        }
    }
    let value = |n: usize, v: f32| {
        format!("{}   {} m³", grouped(&n.to_string()), grouped(&format!("{v:.1}")))
    };
    reasons.into_iter().map(|(reason, n, v)| (both(reason), value(n, v))).collect()
}

fn origin(input: &ReportInput) -> Vec<(String, String)> {
    let short = |v: &String| {
        if v.chars().count() > 34 {
            format!("{}…", v.chars().take(33).collect::<String>())
        } else {
            v.clone()
        }
    };
    input.provenance.iter().map(|(name, value)| (both(name), short(value))).collect()
}
