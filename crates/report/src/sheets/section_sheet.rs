//! Cross-sections at scale, several to a sheet, with levels and offsets.

use super::Sheet;
use super::frame::{FIELD, HAIR, INK, SOFT};
use super::paper::{Align, Paper, Pen};
use super::view::{scale_bar, scale_for};
use crate::{ReportInput, Section, SectionLineKind, Text};

const COLUMNS: usize = 2;
const GAP_MM: f32 = 8.0;

/// Sheets of sections; the same scale on all.
pub(super) fn sheets<'a>(input: &'a ReportInput<'a>) -> Vec<Sheet<'a>> {
    let drawn: Vec<&Section> = input.sections.iter().filter(|s| extent(s).is_some()).collect();
    if drawn.is_empty() {
        return Vec::new();
    }
    let wide_mm = (FIELD[2] - FIELD[0] - GAP_MM) / COLUMNS as f32 - 14.0;
    let size = |axis: usize| {
        drawn.iter().filter_map(|s| extent(s)).map(|e| e[axis][1] - e[axis][0]).fold(0.0, f32::max)
    };
    let room_mm = FIELD[3] - FIELD[1] - 12.0;
    let scale = scale_for([size(0), size(1)], [wide_mm, room_mm - 22.0]);
    let tall_mm = size(1) * 1000.0 / scale + 22.0;
    let rows = ((room_mm / tall_mm).floor() as usize).max(1);
    drawn
        .chunks(rows * COLUMNS)
        .map(|sections| {
            let sections: Vec<&Section> = sections.to_vec();
            let draw = move |paper: &mut Paper| {
                for (k, s) in sections.iter().enumerate() {
                    let (row, column) = (k / COLUMNS, k % COLUMNS);
                    let left = FIELD[0] + column as f32 * (wide_mm + 14.0 + GAP_MM);
                    let top = FIELD[3] - 12.0 - row as f32 * (room_mm / rows as f32);
                    one(paper, s, [left + 12.0, top], wide_mm, scale);
                }
                legend(paper);
                scale_bar(paper, [FIELD[0] + 4.0, FIELD[3] - 6.0], scale);
            };
            let title = Text::new("Cross-sections", "横断図");
            Sheet { title, scale: format!("1:{scale:.0}"), draw: Box::new(draw) }
        })
        .collect()
}

/// Range of offsets and of levels.
fn extent(s: &Section) -> Option<[[f32; 2]; 2]> {
    let points =
        || s.lines.iter().flat_map(|l| &l.points).filter(|p| p[0].is_finite() && p[1].is_finite());
    points().next()?;
    let range = |axis: usize| {
        points().fold([f32::MAX, f32::MIN], |[l, h], p| [l.min(p[axis]), h.max(p[axis])])
    };
    Some([range(0), range(1)])
}

fn pen(kind: SectionLineKind) -> Pen {
    let (colour, width_mm, dash_mm) = match kind {
        SectionLineKind::Ground => ([122, 106, 85], 0.25, [0.8, 0.8]),
        SectionLineKind::AsIs => ([0, 92, 150], 0.3, [0.0, 0.0]),
        SectionLineKind::Planned => ([213, 94, 0], 0.4, [0.0, 0.0]),
        SectionLineKind::Design => ([176, 0, 32], 0.45, [4.0, 1.2]),
    };
    Pen { width_mm, colour, dash_mm }
}

const KINDS: [(SectionLineKind, &str, &str); 4] = [
    (SectionLineKind::Ground, "bed", "地盤"),
    (SectionLineKind::AsIs, "as surveyed", "現況"),
    (SectionLineKind::Planned, "with the plan", "計画後"),
    (SectionLineKind::Design, "design", "計画面"),
];

fn one(paper: &mut Paper, s: &Section, [left, top]: [f32; 2], wide_mm: f32, scale: f32) {
    let Some([[o0, o1], [z0, z1]]) = extent(s) else { return };
    let mm = 1000.0 / scale;
    let used = (o1 - o0) * mm;
    let x = |o: f32| left + (wide_mm - used) / 2.0 + (o - o0) * mm;
    let y = |z: f32| top - 8.0 - (z1 - z) * mm;
    paper.label([left + wide_mm / 2.0, top - 4.0], 3.4, Align::Middle, &s.label, INK);
    for (z, label) in crate::chart::ticks([z0.into(), z1.into()], 5) {
        let level = y(z as f32);
        paper.line(&[[x(o0), level], [x(o1), level]], HAIR);
        paper.words([x(o0) - 1.2, level - 0.9], 2.3, Align::Right, &label, SOFT);
    }
    for (o, label) in crate::chart::ticks([o0.into(), o1.into()], 6) {
        let at = x(o as f32);
        paper.line(&[[at, y(z0)], [at, y(z0) - 1.5]], HAIR);
        paper.words([at, y(z0) - 4.4], 2.3, Align::Middle, &label, SOFT);
    }
    for (kind, ..) in KINDS {
        for l in s.lines.iter().filter(|l| l.kind == kind) {
            for piece in l.points.split(|p| !p[1].is_finite()) {
                let points: Vec<[f32; 2]> = piece.iter().map(|p| [x(p[0]), y(p[1])]).collect();
                paper.line(&points, pen(kind));
            }
        }
    }
}

fn legend(paper: &mut Paper) {
    let (mut x, y) = (FIELD[0] + 70.0, FIELD[3] - 5.0);
    for (kind, en, ja) in KINDS {
        paper.line(&[[x, y], [x + 9.0, y]], pen(kind));
        x += 11.0
            + paper.label([x + 10.5, y - 1.0], 2.8, Align::Left, &Text::new(en, ja), INK)
            + 6.0;
    }
}
