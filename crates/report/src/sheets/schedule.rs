//! The block schedule: what the crane places, in its order.

use super::Sheet;
use super::frame::{FIELD, HAIR, INK, SOFT, THIN};
use super::paper::{Align, Paper};
use crate::text::grouped;
use crate::{ReportInput, Text};
use scene::Placement;

const ROW_MM: f32 = 4.6;
/// Side by side on a sheet.
const COLUMNS: usize = 2;
const HEADS: [(&str, &str, f32); 8] = [
    ("order", "順序", 14.0),
    ("type", "種類", 34.0),
    ("X north", "X（北）", 28.0),
    ("Y east", "Y（東）", 28.0),
    ("level", "標高", 18.0),
    ("let go at", "投下高", 20.0),
    ("fills m³", "充填", 18.0),
    ("done", "確認", 22.0),
];

/// Sheets of the schedule; none without a plan.
pub(super) fn sheets<'a>(input: &'a ReportInput<'a>) -> Vec<Sheet<'a>> {
    let rows = ((FIELD[3] - FIELD[1] - 20.0) / ROW_MM) as usize;
    let placements = input.plan.map_or(&[][..], |p| &p.placements);
    placements
        .chunks(rows * COLUMNS)
        .map(|chunk| {
            let draw = move |paper: &mut Paper| {
                for (k, part) in chunk.chunks(rows).enumerate() {
                    let left = FIELD[0] + k as f32 * (FIELD[2] - FIELD[0]) / COLUMNS as f32;
                    column(paper, input, part, left);
                }
            };
            let title = Text::new("Block schedule", "ブロック据付表");
            Sheet { title, scale: "–".into(), draw: Box::new(draw) }
        })
        .collect()
}

fn column(paper: &mut Paper, input: &ReportInput, part: &[Placement], left: f32) {
    let wide: f32 = HEADS.iter().map(|h| h.2).sum();
    let local = input.survey.frame.crs.is_empty();
    let top = FIELD[3] - 6.0;
    let mut x = left;
    for (en, ja, w) in HEADS {
        let words = match (local, en) {
            (true, "X north") => Text::from("y"),
            (true, "Y east") => Text::from("x"),
            _ => Text::new("", ja),
        };
        let first = if words.ja.is_empty() { words.en } else { words.ja };
        paper.words([x + w - 1.0, top], 2.6, Align::Right, &first, INK);
        if !local || !en.contains(' ') || en == "let go at" {
            paper.words([x + w - 1.0, top - 3.0], 1.9, Align::Right, en, SOFT);
        }
        x += w;
    }
    paper.line(&[[left, top - 4.4], [left + wide, top - 4.4]], THIN);
    for (i, p) in part.iter().enumerate() {
        let y = top - 4.4 - ROW_MM * (i as f32 + 1.0);
        let mut x = left;
        for (text, (_, _, w)) in cells(input, p).iter().zip(HEADS) {
            paper.words([x + w - 1.0, y + 1.2], 2.6, Align::Right, text, INK);
            x += w;
        }
        paper.line(&[[left, y], [left + wide, y]], HAIR);
        paper.rect([left + wide - 6.5, y + 0.8], [3.0, 3.0], None, Some(HAIR));
    }
}

fn cells(input: &ReportInput, p: &Placement) -> [String; 8] {
    let model = input.catalog.get(p.model);
    let site =
        |pose: &geom::Pose| input.survey.frame.site_from_local(pose.transform_point(model.centre));
    let (rest, drop) = (site(&p.rest), site(&p.drop));
    [
        p.order.to_string(),
        model.name.chars().take(16).collect(),
        grouped(&format!("{:.3}", rest.y)),
        grouped(&format!("{:.3}", rest.x)),
        format!("{:.3}", rest.z),
        format!("{:.2}", drop.z),
        format!("{:.2}", p.filled_m3),
        String::new(),
    ]
}
