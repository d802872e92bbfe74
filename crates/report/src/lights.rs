//! How far the answer may be trusted, from the input's own figures: recognition, coverage, design reached,
//! sensitivity. A caller that knows better gives its own lights.

use crate::text::grouped;
use crate::{Light, LightState, ReportInput, Text};

/// Median share of a block that lies hidden: above the first its pose leans on little, above the second on next to
/// nothing (a survey of natural ground without a block had 0.81 to 0.97 in all it took for blocks).
const HIDDEN: [f32; 2] = [0.65, 0.8];
/// Shares of candidates that are stated, of the void that is filled, and of the count that its range spans.
const STATED: [f32; 2] = [0.85, 0.5];
const FILLED: [f32; 2] = [0.9, 0.6];
const SPREAD: [f32; 2] = [0.1, 0.25];
/// Median confidence of what is stated.
const CONFIDENT: [f32; 2] = [0.9, 0.75];

/// The four lights.
pub fn lights(input: &ReportInput) -> Vec<Light> {
    vec![recognition(input), coverage(input), design_reached(input), sensitivity(input)]
}

/// Good from the first limit up, fair from the second, else bad.
fn at_least(value: f32, [good, fair]: [f32; 2]) -> LightState {
    match value {
        v if v >= good => LightState::Good,
        v if v >= fair => LightState::Fair,
        _ => LightState::Bad,
    }
}

fn worse(a: LightState, b: LightState) -> LightState {
    let rank = |s| match s {
        LightState::Bad => 2,
        LightState::Fair => 1,
        LightState::Good | LightState::Unknown => 0,
    };
    if rank(a) >= rank(b) { a } else { b }
}

/// Middle of the values that are numbers.
pub(crate) fn median(values: impl Iterator<Item = f32>) -> Option<f32> {
    let mut values: Vec<f32> = values.filter(|v| v.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}

fn recognition(input: &ReportInput) -> Light {
    let name = Text::new("Recognition", "認識");
    let all = input.recognised.len();
    let count = scene::stated(input.recognised).count();
    if count == 0 {
        let reason = if all == 0 {
            Text::new("nothing in the survey looks like a block", "ブロックらしいものがない")
        } else {
            Text::new(
                format!("none of {all} candidates could be judged"),
                format!("候補 {all} 個のいずれも判定できない"),
            )
        };
        return Light { name, state: LightState::Bad, reason };
    }
    let confidence = median(scene::stated(input.recognised).filter_map(|(_, fit)| fit.confidence));
    let share = count as f32 / all as f32;
    let stated = at_least(share, STATED);
    let (count, all) = (grouped(&count.to_string()), grouped(&all.to_string()));
    let (mut en, mut ja) =
        (format!("{count} of {all} candidates stated"), format!("候補 {all} 中 {count} を判定"));
    if let Some(confidence) = confidence {
        en += &format!(", median confidence {confidence:.2}");
        ja += &format!("、信頼度の中央値 {confidence:.2}");
    }
    let state = confidence.map_or(stated, |c| worse(stated, at_least(c, CONFIDENT)));
    Light { name, state, reason: Text::new(en, ja) }
}

fn coverage(input: &ReportInput) -> Light {
    let name = Text::new("Coverage", "測量の見え方");
    match median(scene::stated(input.recognised).filter_map(|(_, fit)| fit.occlusion)) {
        None => {
            let reason = Text::new(
                "nobody measured how much of a block is in sight",
                "見えている割合は不明",
            );
            Light { name, state: LightState::Unknown, reason }
        }
        Some(hidden) => Light {
            name,
            state: at_least(1.0 - hidden, HIDDEN.map(|h| 1.0 - h)),
            reason: Text::new(
                format!("the survey saw {:.0} % of the median block", (1.0 - hidden) * 100.0),
                format!("中央値のブロックで表面の {:.0} % が測れている", (1.0 - hidden) * 100.0),
            ),
        },
    }
}

fn design_reached(input: &ReportInput) -> Light {
    let name = Text::new("Design reached", "計画面の達成");
    match input.plan.and_then(|p| filled(&p.summary)) {
        None => Light {
            name,
            state: LightState::Unknown,
            reason: Text::new("no plan, or nothing to fill", "計画がない、または充填の必要がない"),
        },
        Some(filled) => {
            let summary = input.plan.map(|p| p.summary).unwrap_or_default();
            let left = grouped(&format!("{:.1}", summary.void_after_m3));
            let high = grouped(&summary.protruding.to_string());
            Light {
                name,
                state: at_least(filled, FILLED),
                reason: Text::new(
                    format!("{left} m³ stay below the design, {high} blocks stand above it"),
                    format!("計画面に {left} m³ 不足、{high} 個が計画面より上"),
                ),
            }
        }
    }
}

/// Share of the void that the plan fills.
pub(crate) fn filled(summary: &scene::PlanSummary) -> Option<f32> {
    let (before, after) = (summary.void_before_m3, summary.void_after_m3);
    (before > 0.0 && after.is_finite()).then(|| (1.0 - after / before).clamp(0.0, 1.0))
}

fn sensitivity(input: &ReportInput) -> Light {
    let name = Text::new("Sensitivity", "結果の安定性");
    match input.count.as_ref().and_then(|c| c.p10_p90.map(|range| (c.blocks, range))) {
        None => Light {
            name,
            state: LightState::Unknown,
            reason: Text::new(
                "one plan only: nobody looked how far chance moves it",
                "計画は一回のみで、ばらつきは未確認",
            ),
        },
        Some((blocks, (low, high))) => {
            let spread = high.saturating_sub(low) as f32 / blocks.max(1) as f32;
            let [low, high] = [low, high].map(|n| grouped(&n.to_string()));
            Light {
                name,
                state: at_least(-spread, SPREAD.map(|s| -s)),
                reason: Text::new(
                    format!("repeated plans need {low} to {high} blocks"),
                    format!("繰り返し計画で {low}～{high} 個"),
                ),
            }
        }
    }
}
