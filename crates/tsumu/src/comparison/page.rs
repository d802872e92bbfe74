//! What the page of a comparison is told.

use super::rows::basis;
use super::{Compared, pictures};
use io::changes_csv::ChangeRow;
use monitor::{AsBuilt, Basis, Built, Class, Decided, Grade, MovedAlike};
use report::changes_page::{self, ChangeMark, ChangesPage, PageTable};

pub(super) fn html(out: &Compared, rows: &[ChangeRow]) -> String {
    changes_page::html(&ChangesPage {
        title: title(out),
        headline: out.headline(),
        facts: facts(out),
        surveys: pictures::of(out),
        marks: rows.iter().filter_map(mark).collect(),
        tables: [changed(rows), built(out), spans(out)].into_iter().flatten().collect(),
    })
}

fn title(out: &Compared) -> String {
    let n = out.epochs.len();
    let (site, [a, b]) =
        (&out.epochs[n - 2].site.name, [n - 2, n - 1].map(|i| out.epochs[i].title()));
    format!("{site}: {a} → {b}")
}

impl Compared<'_> {
    /// The answer in a sentence.
    pub fn headline(&self) -> String {
        let last = self.last();
        let counted: Vec<String> = Class::ALL
            .iter()
            .filter(|c| last.count(**c) > 0)
            .map(|c| format!("{} {}", last.count(*c), c.word()))
            .collect();
        format!("{} blocks compared: {}.", last.changes.len(), counted.join(", "))
    }
}

fn facts(out: &Compared) -> Vec<String> {
    let last = out.last();
    let (r, [dx, dy, dz]) = (&last.reference, last.reference.motion.shift_m);
    let registered = format!(
        "Registration on {}: the later survey was shifted by {dx:.3}, {dy:.3}, {dz:.3} m (east, north, up; height ± {:.3} m) and turned by {:.3}°.",
        basis(r.basis),
        1.96 * r.sd()[2],
        r.motion.turn_rad[2].to_degrees()
    );
    let mut facts = vec![match r.basis {
        Basis::Fixed => "No registration: the coordinates were left as they are.".into(),
        _ => registered,
    }];
    facts.extend(last.moved_alike.iter().map(alike));
    if let Some(moved) = last.common_movement {
        // Adding 0 takes the sign off what rounds to nothing.
        let z = (1e3 * moved.shift_m[2]).round() / 1e3 + 0.0;
        let level = moved.level_m[2];
        facts.push(match moved.settled {
            true => format!("Against the ground all blocks together went {z:+.3} m ± {level:.3} m."),
            false => format!(
                "No common settlement against the ground: {z:+.3} m, not beyond its level of {level:.3} m."
            ),
        });
    }
    if let Some(built) = &out.as_built {
        facts.push(works(built));
    }
    facts
}

/// What stands of a plan, and how well it is known.
fn works(built: &AsBuilt) -> String {
    let counted: Vec<String> = Built::ALL
        .iter()
        .filter(|s| built.count(**s) > 0)
        .map(|s| format!("{} {}", built.count(*s), s.word()))
        .collect();
    let mut levels: Vec<f64> =
        built.blocks.iter().map(|b| b.level_m).filter(|level| *level > 0.0).collect();
    levels.sort_by(f64::total_cmp);
    let level = levels.get(levels.len() / 2).map_or(String::new(), |level| {
        format!(
            " What a block is off by is right to ± {level:.3} m (95 %, the middle one), with what the plan's own survey may be off by as a whole."
        )
    });
    format!(
        "Works: {} new blocks, {:.1} m³ of concrete; of plan and extras {}.{level}",
        built.built(),
        built.concrete_m3,
        counted.join(", ")
    )
}

/// What is said of blocks that moved alike.
fn alike(group: &MovedAlike) -> String {
    let [x, y, z] = group.shift_m;
    let (blocks, still, pairs) = (group.blocks, group.still, group.pairs);
    let went = format!(
        "{blocks} of {pairs} blocks moved alike, by {x:+.3}, {y:+.3}, {z:+.3} m (east, north, up) against {still} others"
    );
    match group.decided {
        Decided::Majority => format!("{went}, which are most of the blocks and taken for still."),
        Decided::Ground => format!("{went}, which the ground says stood still."),
        Decided::Nobody => format!(
            "{went}. Which of both stood still is not decided: neither holds three of five blocks, and the ground does not tell. If it \
             was the {blocks}, the others moved by {:+.3}, {:+.3}, {:+.3} m. Name stable ground (`--stable`) to decide.",
            -x, -y, -z
        ),
    }
}

fn mark(row: &ChangeRow) -> Option<ChangeMark> {
    let place = row.centre_earlier.or(row.centre_later)?;
    Some(ChangeMark {
        block_id: row.block_id,
        class: row.class.clone(),
        place_m: [place[0], place[1]],
        shift_m: row.shift_m.map(|s| [s[0], s[1]]),
        distance_m: row.distance_m,
    })
}

fn figure(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".into(), |v| format!("{v:.digits$}"))
}

fn columns(names: &[&str]) -> Vec<String> {
    names.iter().map(|n| n.to_string()).collect()
}

/// Every block that is not unchanged.
fn changed(rows: &[ChangeRow]) -> Option<PageTable> {
    let row = |r: &ChangeRow| {
        vec![
            r.block_id.to_string(),
            r.model.clone(),
            r.class.clone(),
            figure(r.distance_m, 3),
            figure(r.shift_m.map(|s| s[2]), 3),
            figure(r.turn_deg, 2),
            figure(r.level_m, 3),
            figure(r.level_deg, 2),
            r.note.clone(),
        ]
    };
    let rows: Vec<_> = rows.iter().filter(|r| r.class != "unchanged").map(row).collect();
    let names =
        ["block", "type", "what", "moved, m", "up, m", "turn, °", "level, m", "level, °", "note"];
    let title = "Blocks that are not unchanged".into();
    (!rows.is_empty()).then(|| PageTable { title, columns: columns(&names), rows })
}

fn built(out: &Compared) -> Option<PageTable> {
    let row = |b: &monitor::BuiltBlock| {
        let off = b.order.is_some() && b.later_id.is_some();
        vec![
            b.order.map_or("–".into(), |o| o.to_string()),
            b.state.word().to_string(),
            figure(off.then_some(b.distance_m), 3),
            figure(off.then_some(b.turn_rad.to_degrees()), 2),
            figure(off.then_some(b.level_m), 3),
            b.note.clone(),
        ]
    };
    out.as_built.as_ref().map(|b| PageTable {
        title: "As built".into(),
        columns: columns(&["order", "state", "off, m", "turn, °", "level, m", "note"]),
        rows: b.blocks.iter().map(row).collect(),
    })
}

fn spans(out: &Compared) -> Option<PageTable> {
    let grade = |g: Grade| format!("{g:?}").to_lowercase();
    let row = |s: &monitor::Span| {
        let changed: usize = Class::ALL
            .iter()
            .zip(s.counts)
            .filter(|(c, _)| **c != Class::Unchanged)
            .map(|x| x.1)
            .sum();
        vec![
            format!("{:.0}–{:.0}", s.chainage_m[0], s.chainage_m[1]),
            s.counts.iter().sum::<usize>().to_string(),
            changed.to_string(),
            figure(s.height_change_m, 3),
            figure(Some(s.lost_m3), 2),
            figure(Some(s.gained_m3), 2),
            figure(Some(s.n_od), 2),
            figure(Some(s.s), 2),
            grade(s.grade),
            s.reason.clone(),
        ]
    };
    let names = [
        "chainage, m",
        "blocks",
        "not unchanged",
        "height, m",
        "lost, m³",
        "gained, m³",
        "N_od",
        "S",
        "grade",
        "because",
    ];
    (!out.spans.is_empty()).then(|| PageTable {
        title: "Spans".into(),
        columns: columns(&names),
        rows: out.spans.iter().map(row).collect(),
    })
}
