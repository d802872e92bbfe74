//! Results in words, for people.

use scene::Severity;
use terminal::Terminal;
use tsumu::{
    BlockFit, Compared, CountRange, LabelScores, NextLift, PlanChoice, PlannedSummary, Preflight,
    RecogniseSummary, Recognition, Repeatability, Scores, SurveyLook, TypeCount, UnfilledCount,
    WhatIfRow,
};

fn percent(value: Option<f64>) -> String {
    value.map_or("–".to_string(), |v| format!("{:.1} %", v * 100.0))
}

fn millimetres(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".to_string(), |v| format!("{:.digits$} mm", v * 1000.0))
}

/// What a check found; the refusals are the error that follows.
pub fn checked(found: &Preflight, terminal: &Terminal) {
    for complaint in found.complaints.iter().filter(|c| c.severity != Severity::Refusal) {
        let word = if complaint.severity == Severity::Warning { "warning" } else { "note" };
        terminal.say(format!("{word}: {complaint}"));
    }
    for s in &found.surveys {
        terminal.say(format!(
            "{}: {} points, {:.0} on a square metre, heights {:.2} to {:.2} m; {}",
            s.file,
            s.points,
            s.density_per_m2,
            s.low[2],
            s.high[2],
            shares(s)
        ));
    }
    if let Some(s) = &found.surface {
        terminal.say(format!(
            "of a part of them: {}; {:.0} % on wide planes, {:.0} % on no surface",
            s.sentence,
            100.0 * s.texture.flat_share,
            100.0 * s.texture.scattered_share
        ));
    }
    let e = &found.expected;
    if e.points > 0 {
        terminal.say(format!(
            "a guess of what a run takes: {:.0} s for the recognition, {:.1} GB",
            e.recognition_s.ceil(),
            e.memory_bytes as f64 / 1e9
        ));
    }
    terminal.say(match found.because.len() {
        0 => "can be answered".to_string(),
        1 => "cannot be answered, because:".to_string(),
        n => format!("cannot be answered, because of {n} things:"),
    });
}

/// What the file's classes say of its points.
fn shares(look: &SurveyLook) -> String {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    match (look.ground_share, look.vegetation_share) {
        (Some(ground), Some(vegetation)) => format!(
            "by its classes {} ground, {} vegetation, {} water",
            percent(ground),
            percent(vegetation),
            percent(look.water_share)
        ),
        _ => "no classes".into(),
    }
}

/// Shapes and sizes that fit a survey, and what to write in the catalogue.
pub fn fitted(found: &[BlockFit], terminal: &Terminal) {
    let Some(best) = found.first() else { return };
    terminal.say(format!(
        "{:<18}{:>17}{:>11}{:>8}  {}",
        "block", "size m", "explains", "found", "nearest"
    ));
    for fit in found {
        let beside = fit.beside();
        terminal.say(format!(
            "{:<18}{:>17}{:>11}{:>8}  {beside}",
            fit.block,
            fit.size_text(),
            format!("{:.0} %", 100.0 * fit.explained),
            fit.found
        ));
    }
    terminal.say(best.proposal());
}

/// What a review did.
pub fn review(found: &Recognition, terminal: &Terminal) {
    found.review.iter().for_each(|review| terminal.say(review.line()));
}

/// The figures of recognition.
pub fn recognised(summary: &RecogniseSummary, terminal: &Terminal) {
    terminal.say(format!(
        "{} blocks recognised, {} not judged, in {} points",
        summary.recognised_blocks, summary.not_judged_blocks, summary.points
    ));
    if summary.types_not_judged > 0 {
        terminal.say(format!(
            "{} of them have a pose, but their type is not judged: `type_judged` = no in blocks.csv",
            summary.types_not_judged
        ));
    }
    if summary.damaged_blocks > 0 {
        terminal.say(format!(
            "{} of them lack a leg: `legs_missing` in blocks.csv",
            summary.damaged_blocks
        ));
    }
    terminal.say(format!(
        "fitting error {}, matching rate {} (within {:.1} mm of a block)",
        millimetres(summary.fitting_error_m, 2),
        percent(summary.matching_rate),
        summary.fitting_threshold_m * 1000.0
    ));
    summary.self_check.iter().flat_map(Repeatability::lines).for_each(|line| terminal.say(line));
}

/// What a survey in which nothing was recognised gets instead of a count.
pub fn nothing_recognised(summary: &RecogniseSummary) -> String {
    format!(
        "no block of the catalogue was recognised in {} points, so no count is stated and nothing is planned; check catalogue, size and unit, or say --bare-ground to plan on what was surveyed",
        summary.points
    )
}

/// The figures of a plan.
pub fn planned(summary: &PlannedSummary, terminal: &Terminal) {
    let p = &summary.plan;
    terminal.say(format!(
        "{} blocks to add in {} rounds: {:.1} m³ of concrete, {:.1} t",
        p.blocks,
        p.rounds,
        p.concrete_m3,
        p.mass_kg / 1000.0
    ));
    summary.count_range.iter().for_each(|range| count_range(range, terminal));
    if p.blocks > 0 {
        terminal.say(format!(
            "new layer: porosity {:.3} by volumes, {:.3} by raster; {} protruding blocks",
            p.porosity, p.porosity_rasterised, p.protruding
        ));
    }
    terminal.say(format!(
        "drops removed: {} overflowing, {} unsettled, {} unstable, {} outside",
        p.overflowed, p.unsettled, p.unstable, p.outside
    ));
    terminal.say(format!(
        "void below the design {:.1} m³ before, {:.1} m³ after; mean distance to the design {:.2} m",
        p.void_before_m3, p.void_after_m3, p.mean_distance_m
    ));
    types(&summary.types, terminal);
    if let Some(days) = summary.days {
        let a_day = f64::from(p.blocks) / f64::from(days.max(1));
        terminal.say(format!("{days} working days, {a_day:.1} blocks a day (plan/lifts.csv)"));
    }
    unfilled(&summary.unfilled, terminal);
}

/// The next blocks to place.
pub fn next(lifts: &[NextLift], terminal: &Terminal) {
    if lifts.is_empty() {
        terminal.say("every block of the plan is placed");
    }
    for l in lifts {
        let (Some([x, y, z]), Some([tilt, bearing, second])) = (l.centre_m, l.attitude_deg) else {
            terminal.say(format!(
                "block {} ({}): its place has no stable pose any more; leave it out, or plan on with `tsumu plan --from`",
                l.order, l.model
            ));
            continue;
        };
        let moved = match l.what {
            "moved" => format!("moved {:.2} m from the plan", l.moved_m),
            _ => "as planned".to_string(),
        };
        terminal.say(format!(
            "block {} ({}): centre {x:.2}, {y:.2}, level {z:.2} m, {moved}; highest leg {tilt:.0}° from the vertical towards {bearing:.0}°, the second towards {second:.0}°",
            l.order, l.model
        ));
    }
}

/// Heads of a what-if table.
pub fn what_if_head(terminal: &Terminal) {
    terminal.say(format!(
        "{:>8}{:>8}{:>18}{:>10}{:>8}{:>10}{:>10}{:>10}{:>10}",
        "raise m", "slope", "block", "f, m", "blocks", "mass t", "void left", "porosity", "protr."
    ));
}

/// A row of it.
pub fn what_if(row: &WhatIfRow, terminal: &Terminal) {
    let [raise, slope, block, overflow] =
        row.assumed.clone().map(|a| if a.is_empty() { "–".into() } else { a });
    let [blocks, mass, _, _, left, _, porosity, protruding] = row.figures;
    terminal.say(format!(
        "{raise:>8}{slope:>8}{block:>18}{overflow:>10}{blocks:>8.0}{mass:>10.1}{left:>10.1}{porosity:>10.3}{protruding:>10.0}"
    ));
}

/// Plans to choose from.
pub fn choices(choices: &[PlanChoice], terminal: &Terminal) {
    for c in choices {
        let s = &c.plan.summary;
        terminal.say(format!(
            "  {:<12} {:>5} blocks, void filled {:.1} m³, left {:.1} m³, {} protruding, {:.1} contacts a block, cost {:.0}",
            c.aim.word(),
            s.blocks,
            s.void_before_m3 - s.void_after_m3,
            s.void_after_m3,
            s.protruding,
            c.mean_contacts(),
            c.cost
        ));
    }
}

fn types(types: &[TypeCount], terminal: &Terminal) {
    for t in types {
        let stock = t.stock.map_or(String::new(), |stock| format!(" of {stock} in stock"));
        terminal.say(format!("  {}: {} blocks{stock}, cost {:.0}", t.name, t.blocks, t.cost));
    }
}

fn unfilled(reasons: &[UnfilledCount], terminal: &Terminal) {
    if reasons.is_empty() {
        return;
    }
    let of = |c: &UnfilledCount| format!("{} {} ({:.1} m³)", c.places, c.reason.word(), c.void_m3);
    let list: Vec<String> = reasons.iter().map(of).collect();
    terminal.say(format!("places left below the design: {} (plan/unfilled.csv)", list.join(", ")));
}

fn count_range(range: &CountRange, terminal: &Terminal) {
    let over = if range.varied() { "over seeds, v and f" } else { "over seeds" };
    terminal.say(format!(
        "{over}: {:.0} to {:.0} blocks, median {:.0} (P10 to P90 of {} plans)",
        range.p10, range.p90, range.p50, range.plans
    ));
    for t in range.by_thresholds.iter().filter(|_| range.varied()) {
        terminal.say(format!(
            "  v = {} m³, f = {} m: {:.0} to {:.0} blocks, median {:.0}, mean distance {:.2} m",
            t.minimum_volume_m3, t.overflow_m, t.p10, t.p90, t.p50, t.mean_distance_m
        ));
    }
    terminal.say(format!(
        "to hold against it: {:.0} by N = φ·A·V^(−2/3), {:.0} by void·(1 − P)/V of the handbook, {:.0} with the plan's own porosity",
        range.by_layers, range.by_volume, range.by_own_porosity
    ));
}

/// What became of the earlier plan.
pub fn against_earlier(plan: &scene::Plan, previous: &scene::Plan, terminal: &Terminal) {
    let (kept, all) = (tsumu::kept_of(previous, plan), previous.placements.len());
    terminal.say(format!(
        "earlier plan of {all} blocks: {kept} still to place as it says, {} built or given up; {} blocks planned anew",
        all - kept,
        plan.placements.len() - kept
    ));
}

/// What happened between the last two epochs.
pub fn compared(found: &Compared, terminal: &Terminal) {
    terminal.say(found.headline());
    if let Some(settled_m) = found.last().common_settlement_m() {
        terminal.say(format!(
            "against the ground all blocks together went {settled_m:+.3} m up: see registration.json"
        ));
    }
    if let Some(built) = &found.as_built {
        terminal.say(format!(
            "works: {} new blocks, {:.1} m³ of concrete: see as_built.csv",
            built.built(),
            built.concrete_m3
        ));
    }
}

/// The scores as a table.
pub fn scores(s: &Scores, terminal: &Terminal) {
    let count = |v: Option<usize>| v.map_or("–".to_string(), |v| v.to_string());
    let degrees = |v: Option<f64>| v.map_or("–".to_string(), |v| format!("{v:.2}°"));
    let rows = [
        ("scenes", s.scenes.to_string()),
        ("true blocks", format!("{} ({} scored)", s.true_blocks, s.true_blocks_asked_for)),
        ("recognised blocks", s.recognised_blocks.to_string()),
        ("pose precision", percent(s.pose_precision)),
        ("pose recall", percent(s.pose_recall)),
        ("mean displacement E_d", millimetres(s.mean_displacement_m, 1)),
        ("E_d about the survey's own shift", millimetres(s.mean_displacement_about_shift_m, 1)),
        ("mean rotation error E_R", degrees(s.mean_rotation_deg)),
        ("average recall of MSSD (BOP)", percent(s.mssd_average_recall)),
        ("type right, where judged", percent(s.type_accuracy)),
        ("type not judged", s.types_not_judged.to_string()),
        ("instance precision, IoU ≥ .5", percent(s.instance_precision)),
        ("instance recall, IoU ≥ .5", percent(s.instance_recall)),
        ("points of blocks, precision", percent(s.block_point_precision)),
        ("points of blocks, recall", percent(s.block_point_recall)),
        ("true points without a partner", count(s.unmatched_true_points)),
        ("result's points without one", count(s.unmatched_result_points)),
        ("fitting error E_f", millimetres(s.fitting_error_m, 1)),
        ("matching rate R", percent(s.matching_rate)),
    ];
    for (name, value) in rows {
        terminal.say(format!("{name:<34}{value:>20}"));
    }
}

/// The figures of labels.
pub fn label_scores(s: &LabelScores, terminal: &Terminal) {
    let outside = match s.instances_outside_the_truth {
        0 => String::new(),
        n => format!(" ({n} outside the truth)"),
    };
    let ordered = if s.scored_by_confidence { "by confidence" } else { "all weigh the same" };
    let rows = [
        ("scenes", s.scenes.to_string()),
        ("true instances", s.true_instances.to_string()),
        ("instances of the result", format!("{}{outside}", s.result_instances)),
        ("right, wrong, missed", {
            format!("{}, {}, {}", s.true_positives, s.false_positives, s.false_negatives)
        }),
        ("precision", format!("{} (IoU ≥ {})", percent(s.precision), s.min_iou)),
        ("recall", format!("{} (IoU ≥ {})", percent(s.recall), s.min_iou)),
        ("AP, IoU .50 to .90", format!("{} ({ordered})", percent(s.ap))),
        ("AP50", percent(s.ap50)),
        ("AP25", percent(s.ap25)),
        ("coverage", percent(s.coverage)),
        ("coverage weighted by points", percent(s.weighted_coverage)),
        ("true points without a partner", {
            format!("{} of {}", s.unmatched_true_points, s.true_points)
        }),
        ("result's points without one", {
            format!("{} of {}", s.unmatched_result_points, s.result_points)
        }),
        ("tolerance", format!("{:.3e} m: {}", s.tolerance_m, s.tolerance_from)),
    ];
    for (name, value) in rows {
        terminal.say(format!("{name:<34}{value}"));
    }
}
