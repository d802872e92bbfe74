//! What every sheet has: border, title block with approval boxes, sheet number.

use super::paper::{Align, HEIGHT_MM, Paper, Pen, WIDTH_MM};
use super::{Sheet, SheetSet};
use crate::colour::Rgb;
use crate::{ReportInput, Text};

pub(crate) const INK: Rgb = [20, 26, 34];
pub(crate) const SOFT: Rgb = [95, 105, 116];
pub(crate) const HAIR: Pen = Pen::solid(0.15, [120, 130, 140]);
pub(crate) const THIN: Pen = Pen::solid(0.25, INK);
const THICK: Pen = Pen::solid(0.6, INK);

/// Left, lower, right and upper edge of what may be drawn on, millimetres.
pub(crate) const FIELD: [f32; 4] = [25.0, 48.0, WIDTH_MM - 15.0, HEIGHT_MM - 15.0];
/// Height of the title block.
const BLOCK_MM: f32 = 30.0;

pub(crate) fn draw(
    paper: &mut Paper,
    input: &ReportInput,
    set: &SheetSet,
    sheet: &Sheet,
    n: [usize; 2],
) {
    let (left, low, right) = (20.0, 10.0, WIDTH_MM - 10.0);
    paper.rect([left, low], [right - left, HEIGHT_MM - 20.0], None, Some(THICK));
    let top = low + BLOCK_MM;
    paper.line(&[[left, top], [right, top]], THICK);
    let frame = &input.survey.frame;
    let datum = [frame.crs.as_str(), frame.vertical_datum.as_str()];
    let datum = datum.iter().filter(|s| !s.is_empty()).copied().collect::<Vec<_>>().join(" / ");
    let number = match set.drawing.as_str() {
        "" => format!("{} / {}", n[0], n[1]),
        drawing => format!("{drawing}-{:02}   {} / {}", n[0], n[0], n[1]),
    };
    // Two rows of cells: heading and value; the widths are their shares of the block.
    let cells: [[(Text, String); 4]; 2] = [
        [
            (Text::new("Works", "工事名"), input.title.clone()),
            (Text::new("Drawing", "図面名"), super::paper::both(&sheet.title)),
            (Text::new("Surveyed", "測量日"), input.survey_date.clone()),
            (Text::new("Scale (A3)", "縮尺"), sheet.scale.clone()),
        ],
        [
            (Text::new("By", "作成者"), set.author.clone()),
            (Text::new("Coordinates / levels", "座標系・標高"), datum),
            (Text::new("Program", "ソフト"), input.program.clone()),
            (Text::new("Sheet", "図番"), number),
        ],
    ];
    let edges = [left, left + 105.0, left + 215.0, left + 270.0, left + 310.0];
    for (row, cells) in cells.iter().enumerate() {
        let y = top - BLOCK_MM / 2.0 * (row as f32 + 1.0);
        for (k, (head, value)) in cells.iter().enumerate() {
            let x = edges[k];
            paper.rect([x, y], [edges[k + 1] - x, BLOCK_MM / 2.0], None, Some(THIN));
            paper.label([x + 1.5, y + BLOCK_MM / 2.0 - 3.6], 2.2, Align::Left, head, SOFT);
            fitted(paper, [x + 2.0, y + 3.4], 4.0, edges[k + 1] - x - 4.0, value);
        }
    }
    approval(paper, edges[4], top, right);
}

/// Boxes to be stamped.
fn approval(paper: &mut Paper, left: f32, top: f32, right: f32) {
    let names =
        [Text::new("Drawn", "作成"), Text::new("Checked", "照査"), Text::new("Approved", "承認")];
    let wide = (right - left) / names.len() as f32;
    for (k, name) in names.iter().enumerate() {
        let x = left + wide * k as f32;
        paper.rect([x, top - BLOCK_MM], [wide, BLOCK_MM], None, Some(THIN));
        paper.line(&[[x, top - 6.0], [x + wide, top - 6.0]], THIN);
        paper.label([x + wide / 2.0, top - 4.2], 2.6, Align::Middle, name, SOFT);
    }
}

/// Words as large as wished, or as small as they must be.
pub(crate) fn fitted(paper: &mut Paper, at: [f32; 2], size_mm: f32, width_mm: f32, text: &str) {
    let natural = paper.width(text) * size_mm;
    let size = if natural > width_mm { (size_mm * width_mm / natural).max(1.4) } else { size_mm };
    paper.words(at, size, Align::Left, text, INK);
}
